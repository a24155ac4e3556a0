"""Starts that wait for a robot, in the list of All robots: assigning a robot, cancelling."""

from __future__ import annotations

from app.domain.execution import Execution
from app.screens.common.group_starts import GroupStarts, robots_for
from app.screens.home.facts import HomeFacts, HomeServices
from app.screens.home.waiting import others_for, starts_with_a_robot, waiting_of, waiting_row, waiting_title
from app.widgets.items import Item

READ_EVERY = 5  # s, while something waits


class WaitingModel:
    """``rows`` of what waits, and their number in words as ``title``, empty without any."""

    def __init__(self, services: HomeServices, starts: GroupStarts) -> None:
        self._services, self._starts = services, starts
        self._facts = HomeFacts()
        self.rows: list[Item] = []
        self.title = ""
        self._waiting: dict[int, Execution] = {}
        self._seconds = 0

    def take(self, facts: HomeFacts) -> None:
        assigned = starts_with_a_robot(facts, self._services.clock.now())
        waiting = waiting_of(facts.open)
        self._facts, self._waiting = facts, {row.id: row for row in (*(row for row, _item in assigned), *waiting)}
        self.rows = [*(item for _row, item in assigned), *(waiting_row(facts, row) for row in waiting)]
        self.title = waiting_title([*self._waiting.values()])

    def is_old(self) -> bool:
        """Whether its note has to be read again: the robots' work changes it without an event, and so does time while
        it is being sent."""
        self._seconds = (self._seconds + 1) % READ_EVERY
        is_sent = any(row.group_id is not None and row.queue_id is None for row in self._facts.open)
        return (is_sent or bool(self._waiting)) and self._seconds == 0

    def act(self, key: int, action: str) -> None:
        row, facts = self._waiting.get(key), self._facts
        if row is None:
            return
        match action:
            case "give" if row.robot_id is not None:  # a silent one
                self._starts.start_on_another(row, others_for(row, facts.robots, facts.groups))
            case "give":
                now = self._services.clock.now()
                self._starts.give(row, robots_for(row, facts.robots, facts.groups, facts.holds, facts.settings, now))
            case "cancel":
                self._starts.cancel(row)
