"""The second stage of a check-up: a harmless mission is queued, to see what becomes of it.

Four items, while the robot is paused: one, the same once more, one that is cancelled, one of higher priority. Then the robot is released,
and paused once more while one of them runs. What is about to change is noted before it is changed.
"""

from __future__ import annotations

import math
import uuid
from collections.abc import Mapping
from dataclasses import dataclass, field
from enum import Enum, auto
from typing import Any, NoReturn

from app.domain.check_up import LeftBehind
from app.domain.message import message
from app.domain.robot import QueueState, RobotState, RobotStatus
from app.mir import parse
from app.mir.errors import Refusal, RobotError, Unauthorized
from app.mir.probe import QUEUE, Answer, ids_of
from app.mir.texts import clean
from app.services.check_up.look import Look
from app.services.check_up.restore import Note, has_ended, items_above, read_item, set_state, with_pause, without_pause

NAME, SECOND = "AMR Scheduler check-up", "00:00:01.000000"
GROUP = "Missions"  # of missions, on every robot from the factory on
URGENT = 10  # priority
PAUSE_S = 3.0  # that the robot is paused at a time, at least
STATE_WITHIN = 10.0  # s until it shows that it is paused
ENDS_WITHIN, OWN_ENDS_WITHIN = 90.0, 900.0  # s for all items to end: of the mission that waits a second, of another one
TAKES_S, OWN_TAKES_S = 40.0, 240.0  # that a trial takes, about
READ_EVERY = 1.0  # s between two looks at all items
WATCH_EVERY = 0.3  # s after which its state is looked at again, before another question
LONGEST_WORD = 40  # characters for a state
FIRST, AGAIN, CANCELLED, PREFERRED = range(4)  # items, in the order in which they are queued


@dataclass
class Item:
    """One that was queued. ``words``: what its state was called in each phase. ``now``: as it was read last."""

    token: str
    answer: Answer
    id: int | None = None
    words: dict[QueueState, str] = field(default_factory=dict)
    now: parse.Object = field(default_factory=dict)

    @property
    def given_id(self) -> int | None:
        """By the answer to its order."""
        return next(iter(ids_of(Answer(found=[self.answer.one]))), None)

    @property
    def has_ended(self) -> bool:
        return has_ended(self.now)

    @property
    def has_begun(self) -> bool:
        return bool(self.now.get("started")) or parse.queue_state(self.now) is QueueState.EXECUTING or self.has_ended


@dataclass
class Seen:
    """What a trial has seen, for ``judge``. None: not tried, or it could not be told."""

    items: list[Item] = field(default_factory=list)
    cancelled: Item | None = None  # one of them, as is the one of higher priority
    preferred: Item | None = None
    places: Mapping[str, Mapping[str, Any]] = field(default_factory=dict)  # the first item in: item, list, search
    second: Answer | None = None
    cancel: Answer | None = None
    pause_problem: RobotError | None = None
    waits_in_pause: bool | None = None  # what is queued meanwhile
    runs_on: bool | None = None  # after a pause, what ran before
    is_in_error: bool = False  # at the end: what ended may have failed
    may_not_make: bool = False  # a mission
    problem: RobotError | None = None  # that ended the trial early


class Sign(Enum):
    """That somebody else uses the robot."""

    PAUSED = auto()
    RELEASED = auto()
    WENT_ON = auto()  # a mission, in Pause


class TakenOver(Exception):
    """Somebody else has paused the robot, or ended the trial's pause: from then on it is theirs."""

    def __init__(self, sign: Sign) -> None:
        super().__init__(sign)
        self.sign = sign


def length_s(mission: str | None) -> float:
    return TAKES_S if mission is None else OWN_TAKES_S


def tokens() -> tuple[str, ...]:
    """As those of starts are: a robot that shortens them shows it. The second item has that of the first."""
    one, two, three = (str(uuid.uuid4()) for _ in range(3))
    return one, one, two, three


class TrialRun:
    """``left`` has been noted; ``done_s`` of ``of_s`` seconds of the check-up are over."""

    def __init__(self, look: Look, left: LeftBehind, note: Note, done_s: float, of_s: float) -> None:
        self._look, self._probe, self._left, self._note = look, look.probe, left, note
        self._began, self._done_s, self._of_s = look.probe.clock(), done_s, of_s
        self._highest = left.queue_floor
        self._is_paused, self._watched_at = False, -math.inf
        self.seen = Seen()

    @property
    def left(self) -> LeftBehind:
        """As it is noted."""
        return self._left

    def run(self) -> Seen:
        """Raises NotWanted or TakenOver; a robot that doesn't answer is part of what was seen."""
        try:
            self._run()
        except RobotError as error:
            self.seen.problem = error
        return self.seen

    def _run(self) -> None:
        if self._left.mission is not None:
            try:
                self._make(self._left.mission)
            except Unauthorized:
                self.seen.may_not_make = True
                return
        self._at(message("Pausing it"))
        self._pause(None)
        self._at(message("Queueing missions"))
        if not self._order(FIRST):
            return
        self._look_where_it_is(self.seen.items[FIRST])
        self._order(AGAIN)
        if self._order(CANCELLED):
            self.seen.cancelled = self.seen.items[-1]
            self.seen.cancel = self._probe.ask("DELETE", f"{QUEUE}/{self.seen.cancelled.id}")
        if self._order(PREFERRED, URGENT):
            self.seen.preferred = self.seen.items[-1]
        self._wait(PAUSE_S)
        self._read()
        if self._is_paused:
            self.seen.waits_in_pause = True
            self._release(0)
        self._follow()
        self.seen.is_in_error = self._probe.status().state is RobotState.ERROR

    # ------------------------------------------------------------------ steps
    def _make(self, guid: str) -> None:
        """The mission that waits a second."""
        self._at(message("Making a mission that waits a second"))
        groups = self._must(self._probe.get("/mission_groups")).rows
        group = next((each for each in groups if each.get("name") == GROUP), groups[0] if groups else {})
        self._must(
            self._probe.ask(
                "POST",
                "/missions",
                json={"guid": guid, "name": NAME, "description": NAME, "group_id": group.get("guid", "")},
            )
        )
        self._must(
            self._probe.ask(
                "POST",
                f"/missions/{guid}/actions",
                json={
                    "action_type": "wait",
                    "mission_id": guid,
                    "priority": 1,
                    "parameters": [{"id": "time", "value": SECOND}],
                },
            )
        )

    def _pause(self, started: str | None) -> None:
        """``started``: when the newest of the missions had begun."""
        status = self._watch()
        self._left = with_pause(self._left, self._note, started, status.uptime_s)
        try:
            set_state(self._look, RobotState.PAUSE)
        except Refusal as error:
            if self._shows_pause(True, within=0.0):
                raise  # what it says is not what it does
            self.seen.pause_problem = error
        else:
            self._is_paused = self._shows_pause(True)

    def _release(self, progress: int) -> None:
        """``progress``: when it stood in Pause."""
        if self._progress != progress:
            self._lose(Sign.WENT_ON)
        self._watch()
        self._look.check_is_wanted()  # a person may have pressed Pause in the app
        set_state(self._look, RobotState.READY)
        self._left, self._is_paused = without_pause(self._left, self._note), False
        if not self._shows_pause(False):
            self._lose(Sign.PAUSED)

    def _shows_pause(self, wanted: bool, within: float = STATE_WITHIN) -> bool:
        """Whether it is so within so many seconds."""
        began = self._probe.clock()
        while (self._probe.status().state is RobotState.PAUSE) is not wanted:
            if self._probe.clock() - began >= within:
                return False
            self._look.check_is_wanted()
            self._look.pause(WATCH_EVERY)
        self._watched_at = self._probe.clock()
        return True

    def _watch(self) -> RobotStatus:
        """Raises TakenOver."""
        status = self._probe.paced_status()
        self._watched_at = self._probe.clock()
        if (status.state is RobotState.PAUSE) is not self._is_paused:
            self._lose(Sign.RELEASED if self._is_paused else Sign.PAUSED)
        return status

    def _watch_in_turn(self) -> None:
        self._look.check_is_wanted()
        if self._probe.clock() - self._watched_at >= WATCH_EVERY:
            self._watch()

    def _lose(self, sign: Sign) -> NoReturn:
        self._left = without_pause(self._left, self._note)
        raise TakenOver(sign)

    @property
    def _progress(self) -> int:
        """How many of the missions have begun, and how many have ended."""
        runs = [item for item in self.seen.items if item.id is not None and item is not self.seen.cancelled]
        return sum(item.has_begun + item.has_ended for item in runs)

    def _order(self, number: int, priority: int = 0) -> bool:
        """Whether it has been found in the queue."""
        self._watch_in_turn()
        token = self._left.tokens[number]
        answer = self._probe.ask(
            "POST",
            QUEUE,
            json={"mission_id": self._left.mission or self._left.queued, "description": token, "priority": priority},
        )
        if number == AGAIN:
            self.seen.second = answer
        if answer.error is not None and not isinstance(answer.error, Refusal):
            raise answer.error
        item = Item(token, answer)
        if number != AGAIN or answer.is_good:
            self.seen.items.append(item)
        if not answer.is_good:
            return False
        item.id = item.given_id or self._newest()
        if item.id is not None:
            self._highest = max(self._highest, item.id)
            self._note_of(item)
        return item.id is not None

    def _newest(self) -> int | None:
        """The id of the item that has just been queued, where the answer doesn't have it."""
        mission = self._left.mission or self._left.queued
        return max(
            (
                item["id"]
                for item in items_above(self._look, self._highest)
                if item.get("mission_id") in (mission, None)
            ),
            default=None,
        )

    def _look_where_it_is(self, item: Item) -> None:
        queries = {"whitelist": "all", "sort_by": "id,desc", "limit": "20"}
        self._watch_in_turn()
        listed = self._probe.queue(**queries).rows
        self._watch_in_turn()
        found = self._probe.search([{"fieldname": "id", "operator": ">", "value": (item.id or 0) - 1}], **queries).rows
        rows = {"item": [item.now], "list": listed, "search": found}
        self.seen.places = {
            place: row for place, found in rows.items() for row in found if row.get("id", item.id) == item.id
        }

    def _follow(self) -> None:
        """Until all have ended, with a pause as soon as the first one runs."""
        began, first = self._probe.clock(), self.seen.items[FIRST]
        to_pause = self.seen.waits_in_pause is not None
        while (
            any(item.id is not None and not item.has_ended for item in self.seen.items)
            and self._probe.clock() - began < self._within
        ):
            self._at(message("Waiting until the missions have ended"))
            if not to_pause:
                self._read()
                self._wait(READ_EVERY)
                continue
            self._note_of(first)  # it alone, so that not much of a second is gone when it is seen running
            if first.has_begun:
                to_pause = False
                self._pause_while(first)

    @property
    def _within(self) -> float:
        return ENDS_WITHIN if self._left.mission is not None else OWN_ENDS_WITHIN

    def _pause_while(self, running: Item) -> None:
        if running.has_ended:
            return
        self._pause(parse.text_or_none(running.now.get("started")))
        if self._is_paused:
            self._read()
            progress = self._progress
            self._wait(PAUSE_S)
            self._read()
            self._release(progress)
            if not running.has_ended:
                self._until_ended(running)
                self.seen.runs_on = running.has_ended and not _is_aborted(running) if running.now else None

    def _until_ended(self, item: Item) -> None:
        began = self._probe.clock()
        while not item.has_ended and self._probe.clock() - began < self._within:
            self._at(message("Waiting until the missions have ended"))
            self._note_of(item)

    # ------------------------------------------------------------------ looking
    def _read(self) -> None:
        for item in self.seen.items:
            if item.id is not None and not item.has_ended:
                self._note_of(item)

    def _note_of(self, item: Item) -> None:
        self._watch_in_turn()
        item.now = read_item(self._look, item.id or 0)
        if word := clean(item.now.get("state"), LONGEST_WORD):
            item.words[_phase(item)] = word

    def _wait(self, seconds: float) -> None:
        end = self._probe.clock() + seconds
        while (rest := end - self._probe.clock()) > 0:
            self._watch_in_turn()
            self._look.pause(min(rest, WATCH_EVERY))

    def _at(self, says: Any) -> None:
        self._look.at(says, min(self._of_s, self._done_s + self._probe.clock() - self._began), self._of_s)

    @staticmethod
    def _must(answer: Answer) -> Answer:
        if answer.error is not None:
            raise answer.error
        return answer


def _phase(item: Item) -> QueueState:
    if item.has_ended:
        return QueueState.DONE
    return QueueState.EXECUTING if item.has_begun else QueueState.PENDING


def _is_aborted(item: Item) -> bool:
    return parse.queue_state(item.now) is QueueState.ABORTED
