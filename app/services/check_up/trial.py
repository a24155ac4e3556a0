"""The second stage of a check-up: a harmless mission is queued and watched.

Four items while the robot is paused: one, the same again, one to cancel, one of higher priority. Then the robot is
resumed, and paused again while one of them runs. What is about to change is noted before it is changed.
"""

from __future__ import annotations

import math
import uuid
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any, NoReturn

from app.domain.message import Message, message
from app.domain.robot import QueueState, RobotState, RobotStatus
from app.mir import parse
from app.mir.errors import Refusal, RobotError, Unauthorized
from app.mir.raw_client import QUEUE, Answer
from app.mir.texts import clean
from app.services.check_up.journal import Journal, has_ended, items_above, read_item, set_state
from app.services.check_up.load_probes import LENGTH_S
from app.services.check_up.session import CheckUpSession, Found, amber, red

NAME, SECOND = "AMR Scheduler check-up", "00:00:01.000000"
GROUP = "Missions"  # of missions, on every robot from the factory on
URGENT = 10  # priority
PAUSE_S = 3.0  # that the robot is paused at a time, at least
STATE_WITHIN = 10.0  # s until its status shows the pause
ENDS_WITHIN, OWN_ENDS_WITHIN = 90.0, 900.0  # s for all items to end: of the mission that waits a second, of another one
TAKES_S, OWN_TAKES_S = 40.0, 240.0  # that a trial takes, about
READ_EVERY = 1.0  # s between two looks at all items
WATCH_EVERY = 0.3  # s after which its state is read again
LONGEST_WORD = 40  # characters for a state
_ENDED = message("The trial ended. Check up again when the robot is used by no one else.")
PAUSED = amber("Somebody paused it while it was tried", _ENDED)
RELEASED = amber("Somebody ended the pause of the trial", _ENDED)
WENT_ON = red(
    "A mission continued while it was in Pause",
    "Either somebody resumed it and paused it again, or Pause in the app does not stop it from driving: look at the "
    "robot, and check up again.",
)


@dataclass
class Item:
    """A queued item. ``words``: its state's word in each phase. ``now``: as last read."""

    token: str
    id: int
    words: dict[QueueState, str] = field(default_factory=dict)
    now: parse.Object = field(default_factory=dict)

    @property
    def has_ended(self) -> bool:
        return has_ended(self.now)

    @property
    def word(self) -> str:
        """For its state."""
        return clean(self.now.get("state"), LONGEST_WORD)

    @property
    def has_begun(self) -> bool:
        return bool(self.now.get("started")) or parse.queue_state(self.now) is QueueState.EXECUTING or self.has_ended

    @property
    def phase(self) -> QueueState:
        """Its phase, independent of the robot's words."""
        if self.has_ended:
            return QueueState.DONE
        return QueueState.EXECUTING if self.has_begun else QueueState.PENDING


@dataclass
class TrialResult:
    """The results of a trial. None: not tried, or unclear."""

    items: list[Item] = field(
        default_factory=list
    )  # that were found in the queue, in the order in which they were queued
    cancelled: Item | None = None  # one of them, as is the one of higher priority
    preferred: Item | None = None
    places: Mapping[str, Mapping[str, Any]] = field(default_factory=dict)  # the first item in: item, list, search
    first: Answer | None = None  # to the first order, and to the same one again
    second: Answer | None = None
    cancel: Answer | None = None
    pause_problem: RobotError | None = None
    waits_in_pause: bool = False  # what is queued then
    runs_on: bool | None = None  # after a pause, what ran before
    is_in_error: bool = False  # at the end: an ended one may have failed
    may_not_make: bool = False  # a mission
    problem: RobotError | None = None  # that ended the trial early

    @property
    def runs(self) -> list[Item]:
        """Those that are to run."""
        return [item for item in self.items if item is not self.cancelled]


class TakenOver(Exception):
    """Somebody else has paused the robot, or ended the trial's pause: from then on the pause is theirs. ``found``: the
    evidence."""

    def __init__(self, found: Found) -> None:
        self.found = found


def tokens() -> tuple[str, ...]:
    """As those of starts are: a robot that shortens them shows it. The second item has that of the first."""
    one, two, three = (str(uuid.uuid4()) for _ in range(3))
    return one, one, two, three


class TrialRun:
    """Of what is noted in ``journal``."""

    def __init__(self, session: CheckUpSession, journal: Journal) -> None:
        self._session, self._robot, self._clock, self._journal = session, session.robot, session.clock, journal
        left = journal.left
        self._mission, self._is_made, self._tokens = left.mission or left.queued, left.mission is not None, left.tokens
        self._highest = left.queue_floor
        self._began, self._ends = session.clock.monotonic(), math.inf
        self._is_paused, self._watched_at = False, -math.inf
        self.result = TrialResult()

    def run(self) -> TrialResult:
        """Raises Cancelled or TakenOver; a silent robot is part of the result."""
        try:
            self._run()
        except RobotError as error:
            self.result.problem = error
        return self.result

    def _run(self) -> None:
        if self._is_made:
            try:
                self._make()
            except Unauthorized:
                self.result.may_not_make = True
                return
        self._at(message("Pausing it"))
        self._pause(None)
        self._at(message("Queueing missions"))
        one, again, other, urgent = self._tokens
        first = self._order(one)
        if first is None:
            return
        self._look_where_it_is(first)
        self._order(again, is_repeated=True)
        if (cancelled := self._order(other)) is not None:
            self.result.cancelled, self.result.cancel = cancelled, self._robot.ask("DELETE", f"{QUEUE}/{cancelled.id}")
        self.result.preferred = self._order(urgent, URGENT)
        self._wait(PAUSE_S)
        self._read(self.result.items)
        self._ends = self._clock.monotonic() + (ENDS_WITHIN if self._is_made else OWN_ENDS_WITHIN)
        if self._is_paused:
            self.result.waits_in_pause = True
            self._release(0)
            # The first alone, so that not much of a second has passed when it is seen running.
            self._until(lambda: first.has_begun, [first])
            if first.has_begun and not first.has_ended:
                self._pause_while(first)
        self._until(lambda: all(item.has_ended for item in self.result.items), self.result.items, READ_EVERY)
        self.result.is_in_error = self._robot.client.status().state is RobotState.ERROR

    # ------------------------------------------------------------------ steps
    def _make(self) -> None:
        """The mission that waits a second."""
        self._at(message("Making a mission that waits a second"))
        groups = self._robot.get("/mission_groups").checked().rows
        group = next((each for each in groups if each.get("name") == GROUP), groups[0] if groups else {})
        self._robot.ask(
            "POST",
            "/missions",
            json={"guid": self._mission, "name": NAME, "description": NAME, "group_id": group.get("guid", "")},
        ).checked()
        self._robot.ask(
            "POST",
            f"/missions/{self._mission}/actions",
            json={
                "action_type": "wait",
                "mission_id": self._mission,
                "priority": 1,
                "parameters": [{"id": "time", "value": SECOND}],
            },
        ).checked()

    def _pause(self, started: str | None) -> None:
        """``started``: when the newest of the missions had begun."""
        status = self._watch()
        self._journal.note(is_paused=True, started=started, uptime_s=status.uptime_s)
        try:
            set_state(self._session, RobotState.PAUSE)
        except Refusal as error:
            if self._shows_pause(True, within=0.0):
                raise  # its state does not match its behaviour
            self.result.pause_problem = error
        else:
            self._is_paused = self._shows_pause(True)

    def _release(self, progress: int) -> None:
        """``progress``: when it stood in Pause."""
        if self._progress != progress:
            self._lose(WENT_ON)
        self._watch()
        self._session.check_is_wanted()  # a person may have pressed Pause in the app
        set_state(self._session, RobotState.READY)
        self._journal.note(is_paused=False)
        self._is_paused = False
        if not self._shows_pause(False):
            self._lose(PAUSED)

    def _shows_pause(self, wanted: bool, within: float = STATE_WITHIN) -> bool:
        """Whether it is so within so many seconds."""
        began = self._clock.monotonic()
        while (self._robot.client.status().state is RobotState.PAUSE) is not wanted:
            if self._clock.monotonic() - began >= within:
                return False
            self._session.check_is_wanted()
            self._clock.sleep(WATCH_EVERY)
        self._watched_at = self._clock.monotonic()
        return True

    def _watch(self) -> RobotStatus:
        """Raises TakenOver."""
        status = self._robot.paced_status()
        self._watched_at = self._clock.monotonic()
        if (status.state is RobotState.PAUSE) is not self._is_paused:
            self._lose(RELEASED if self._is_paused else PAUSED)
        return status

    def _watch_in_turn(self) -> None:
        self._session.check_is_wanted()
        if self._clock.monotonic() - self._watched_at >= WATCH_EVERY:
            self._watch()

    def _lose(self, found: Found) -> NoReturn:
        self._journal.note(is_paused=False)
        raise TakenOver(found)

    @property
    def _progress(self) -> int:
        """How many of the missions have begun, and how many have ended."""
        return sum(item.has_begun + item.has_ended for item in self.result.runs)

    def _order(self, token: str, priority: int = 0, *, is_repeated: bool = False) -> Item | None:
        """As it has been found in the queue; None: it has not."""
        self._watch_in_turn()
        order = {"mission_id": self._mission, "description": token, "priority": priority}
        answer = self._robot.ask("POST", QUEUE, json=order)
        if is_repeated:
            self.result.second = answer
        if answer.error is not None and not isinstance(answer.error, Refusal):
            raise answer.error
        self.result.first = self.result.first or answer
        queue_id = (answer.id or self._newest()) if answer.is_good else None
        if queue_id is None:
            return None
        self.result.items.append(item := Item(token, queue_id))
        self._highest = max(self._highest, queue_id)
        self._note_of(item)
        return item

    def _newest(self) -> int | None:
        """The id of the item that has just been queued, where the answer doesn't have it."""
        return max(
            (
                item["id"]
                for item in items_above(self._session, self._highest)
                if item.get("mission_id") in (self._mission, None)
            ),
            default=None,
        )

    def _look_where_it_is(self, item: Item) -> None:
        queries = {"whitelist": "all", "sort_by": "id,desc", "limit": "20"}
        self._watch_in_turn()
        listed = self._robot.get(QUEUE, **queries).rows
        self._watch_in_turn()
        found = self._robot.search({"fieldname": "id", "operator": ">", "value": item.id - 1}, **queries).rows
        rows = {"item": [item.now], "list": listed, "search": found}
        self.result.places = {
            place: row for place, found in rows.items() for row in found if row.get("id", item.id) == item.id
        }

    def _pause_while(self, running: Item) -> None:
        self._pause(parse.text_or_none(running.now.get("started")))
        if self._is_paused:
            self._read(self.result.items)
            progress = self._progress
            self._wait(PAUSE_S)
            self._read(self.result.items)
            self._release(progress)
            if not running.has_ended:
                self._until(lambda: running.has_ended, [running])
                self.result.runs_on = (
                    running.has_ended and parse.queue_state(running.now) is not QueueState.ABORTED
                    if running.now
                    else None
                )

    def _until(self, is_over: Callable[[], bool], items: Sequence[Item], every_s: float = 0.0) -> None:
        """Or until it takes too long."""
        while not is_over() and self._clock.monotonic() < self._ends:
            self._at(message("Waiting until the missions have ended"))
            self._read(items)
            self._wait(every_s)

    # ------------------------------------------------------------------ looking
    def _read(self, items: Sequence[Item]) -> None:
        for item in items:
            if not item.has_ended:
                self._note_of(item)

    def _note_of(self, item: Item) -> None:
        self._watch_in_turn()
        item.now = read_item(self._session, item.id)
        if item.word:
            item.words[item.phase] = item.word

    def _wait(self, seconds: float) -> None:
        end = self._clock.monotonic() + seconds
        while (rest := end - self._clock.monotonic()) > 0:
            self._watch_in_turn()
            self._clock.sleep(min(rest, WATCH_EVERY))

    def _at(self, says: Message) -> None:
        self._session.at(says, LENGTH_S + self._clock.monotonic() - self._began)
