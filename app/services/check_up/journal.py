"""The changes of a trial on a robot: recorded on the disk before they are made, and undone at its end, or later if it
was interrupted."""

from __future__ import annotations

import sqlite3
from collections.abc import Callable, Iterable
from dataclasses import replace
from typing import Any, NamedTuple

from app.database.check_ups import CheckUpRepository
from app.database.connection import Database
from app.domain.check_up import LeftBehind
from app.domain.message import Message, message, render
from app.domain.models import InvalidInput, Robot
from app.domain.robot import QueueState, RobotState
from app.mir import parse
from app.mir.errors import RobotError, Unreadable
from app.mir.fleet_target import NOT_FOUND
from app.mir.raw_client import QUEUE
from app.services.check_up.session import CheckUpSession
from app.services.live.alarms import Alarms
from app.services.live.holds import Holds

MOST_ITEMS = 60  # numbers above the floor that are checked: those of the trial, and others queued in between
MISSING_IN_A_ROW = 3  # missing numbers, until the search ends
ENDS_WITHIN = 15.0  # s from the request to cancel an item to its end

HOLD = render(message("Check-up"))  # reason of the hold that stops starts during a trial, translated where it is shown
NO_HOLD = 0  # the id of none
ALARM = "check_up_left"


class Journal:
    """The changes of one trial on one robot that have to be undone: queue items, the mission that was made, the pause
    and the hold. They are plain data, so that another process can undo them when this one is killed."""

    def __init__(self, db: Database, holds: Holds, alarms: Alarms, robot: Robot, left: LeftBehind) -> None:
        self._db, self._holds, self._alarms, self._robot, self._left = db, holds, alarms, robot, left
        self._check_ups = CheckUpRepository()

    @property
    def left(self) -> LeftBehind:
        """As it is on the disk, or was before the robot was removed."""
        self._left = self._check_ups.left_behind(self._db.read()).get(self._robot.id, self._left)
        return self._left

    def begin(self) -> None:
        """Both or neither is on the disk: what a trial is about to change, and the hold. It has no end, as nothing may
        be sent to the robot until it is restored; a person may release it. Raises InvalidInput where the robot has been
        removed or replaced."""
        self._holds.hold(
            HOLD, robot_id=self._robot.id, also=lambda c, hold: self._put(c, replace(self._left, hold=hold.id))
        )

    def note(self, **changes: Any) -> None:
        """Before the act that they are about. On the disk when it returns. Raises InvalidInput as ``begin``."""
        left = replace(self.left, **changes)
        self._db.write(lambda c: self._put(c, left))

    def end_hold(self) -> None:
        """It is paused only if a person has paused it, and the plan may use it."""
        left = replace(self.left, is_paused=False, hold=None)
        self._holds.release(self._robot.id, self._left.hold or NO_HOLD, also=lambda c: self._put(c, left))

    def end(self) -> None:
        """All was undone. The plan continues, unless a person has set another hold."""
        self._holds.release(
            self._robot.id,
            self.left.hold or NO_HOLD,
            also=lambda c: self._check_ups.note_left_behind(c, self._robot.id, None),
        )
        self._alarms.clear(ALARM, f"robot:{self._robot.id}")

    def warn(self, problem: Message) -> None:
        """By an alarm, until all was put back."""
        self._alarms.raise_about_robot(ALARM, self._robot, problem=problem)

    def _put(self, c: sqlite3.Connection, left: LeftBehind) -> None:
        self._check_ups.note_left_behind(c, self._robot.id, left)
        if self._check_ups.left_behind(c).get(self._robot.id) != left:
            raise InvalidInput("robot", "this robot has been removed")


class Outcome(NamedTuple):
    """``problem``: what could not be restored; None: everything was. ``stays_paused``: by somebody else.
    ``is_in_error``: the robot's state."""

    problem: Message | None
    stays_paused: bool = False
    is_in_error: bool = False


def put_back(
    session: CheckUpSession, journal: Journal, is_claimed: Callable[[int], bool], *, is_late: bool = False
) -> Outcome:
    """Undo from the last to the first: cancel open items of the trial, end its pause, remove the mission that was made,
    and end the hold.

    ``is_claimed``: whether an item is a start of the plan. ``is_late``: a robot in Pause may have been paused by a
    person since: it is not released with missions of others in its queue, as it would drive off. Raises RobotError.
    """
    left = journal.left
    ours, others = _items(session, left, is_claimed)
    open_ids = [item["id"] for item in ours if not has_ended(item)]
    for queue_id in open_ids:
        session.robot.ask("DELETE", f"{QUEUE}/{queue_id}").checked(*NOT_FOUND)
    began = session.clock.monotonic()
    while left_open := [item for queue_id in open_ids if not has_ended(item := read_item(session, queue_id))]:
        if session.clock.monotonic() - began > ENDS_WITHIN:
            if known := [item for item in left_open if parse.queue_state(item) is not QueueState.UNKNOWN]:
                return Outcome(
                    message(
                        "mission {number} of the trial does not end: cancel it on the robot",
                        number=str(known[0].get("id")),
                    )
                )
            break  # with an unknown word, and no time: it was cancelled
    outcome = _end_pause(session, journal, ours, is_late and bool(others))
    try:
        if left.mission is not None:
            _remove(session, f"/missions/{left.mission}")
    except RobotError:
        if outcome.problem is None:
            journal.end_hold()
        raise
    if outcome.problem is None:
        journal.end()
    return outcome


def _end_pause(session: CheckUpSession, journal: Journal, ours: Iterable[parse.Object], is_in_use: bool) -> Outcome:
    """Ends the trial's pause; one that is or may be somebody else's stays. ``is_in_use``: by others, so that it would
    drive off."""
    status = session.robot.paced_status()
    if status.state is not RobotState.PAUSE:
        return Outcome(None, is_in_error=status.state is RobotState.ERROR)
    left = journal.left  # its present value: a person may have pressed Pause in the app
    if not left.is_paused:
        return Outcome(None, stays_paused=True)
    if status.has_booted_since(left.uptime_s) or _have_gone_on(ours, left.started):
        return Outcome(message("it is paused, and somebody may have paused it: press Resume there or in the app"))
    if is_in_use:
        return Outcome(message("it is paused, with missions of others in its queue: press Resume there or in the app"))
    set_state(session, RobotState.READY)
    return Outcome(None)


def _have_gone_on(items: Iterable[parse.Object], started: str | None) -> bool:
    """Whether missions of the trial ran since it was paused, so that the pause was ended and set again."""
    begun = [(at, item) for item in items if (at := parse.instant(item.get("started"))) is not None]
    if not begun:
        return False
    _at, newest = max(begun, key=lambda each: each[0])
    return newest.get("started") != started or parse.queue_state(newest) is QueueState.DONE


def _remove(session: CheckUpSession, path: str) -> None:
    """Delete a mission, and first its actions: not every robot is known to delete them with it. Raises RobotError."""
    actions = session.robot.get(f"{path}/actions").checked(*NOT_FOUND)
    guids = [parse.text_or_none(action.get("guid")) for action in actions.rows]
    if actions.is_good and not (actions.is_list and len(guids) == len(actions.found) and all(guids)):
        raise Unreadable(
            address=session.robot.client.address.netloc, problem=message("the answer is no list of actions")
        )
    for guid in guids:
        session.robot.ask("DELETE", f"{path}/actions/{guid}").checked(*NOT_FOUND)
    session.robot.ask("DELETE", path).checked(*NOT_FOUND)


def set_state(session: CheckUpSession, state: RobotState) -> None:
    """Pause or release it, right after its status was read: changes by others in between can't be seen. Raises
    RobotError."""
    session.robot.ask("PUT", "/status", json={"state_id": int(state)}, at_once=True).checked()


def read_item(session: CheckUpSession, queue_id: int) -> parse.Object:
    """Empty if there is none. Raises RobotError."""
    answer = session.robot.get(f"{QUEUE}/{queue_id}").checked(*NOT_FOUND)
    if not answer.is_good:
        return {}
    item = answer.one
    if item.get("id", queue_id) != queue_id or not parse.text_or_none(item.get("state")):
        raise Unreadable(address=session.robot.client.address.netloc, problem=message("the answer is no queue item"))
    return item


def items_above(session: CheckUpSession, floor: int) -> Iterable[parse.Object]:
    """One by one, as that works on every robot. Raises RobotError."""
    missing = 0
    for number in range(floor + 1, floor + 1 + MOST_ITEMS):
        item = read_item(session, number)
        if item:
            missing = 0
            yield {**item, "id": number}
        elif (missing := missing + 1) >= MISSING_IN_A_ROW:
            return


def has_ended(item: parse.Object) -> bool:
    """Also by its time, where its word is not known."""
    return not item or bool(item.get("finished")) or parse.queue_state(item) in (QueueState.DONE, QueueState.ABORTED)


def _is_of_trial(item: parse.Object, left: LeftBehind) -> bool:
    """By its token in any field; by the mission that was made."""
    return any(isinstance(value, str) and value in left.tokens for value in item.values()) or (
        left.mission is not None and item.get("mission_id") == left.mission
    )


def _may_be_of_trial(item: parse.Object, left: LeftBehind, user: str, is_claimed: Callable[[int], bool]) -> bool:
    """For robots that forget tokens: by the mission queued, if it is not somebody else's."""
    return (
        left.queued is not None
        and item.get("mission_id") == left.queued
        and item.get("created_by_name") in ("", None, user)
        and not is_claimed(item["id"])
    )


def _items(
    session: CheckUpSession, left: LeftBehind, is_claimed: Callable[[int], bool]
) -> tuple[list[parse.Object], list[parse.Object]]:
    """Those of the trial, and open ones of others."""
    items = list(items_above(session, left.queue_floor))
    # With a token found, the robot keeps them: the rest belongs to others.
    ours = [item for item in items if _is_of_trial(item, left)] or [
        item for item in items if _may_be_of_trial(item, left, session.identity.user_name, is_claimed)
    ]
    return ours, [item for item in items if item not in ours and not has_ended(item)]
