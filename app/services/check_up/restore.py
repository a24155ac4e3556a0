"""Puts back what a trial changed on a robot: at its end, and later where it was cut off."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import replace
from typing import NamedTuple

from app.domain.check_up import LeftBehind
from app.domain.message import Message, message
from app.domain.robot import QueueState, RobotState
from app.mir import parse
from app.mir.errors import Refusal, RobotError, Unreadable
from app.mir.probe import QUEUE, Answer
from app.services.check_up.look import Look

MOST_ITEMS = 60  # numbers above the floor that are looked at: those of the trial, and what others queued between them
MISSING_IN_A_ROW = 3  # numbers that aren't there, until no more are looked for
ENDS_WITHIN = 15.0  # s from the request to cancel an item to its end
NOT_THERE = (404, 410)

Note = Callable[[LeftBehind | None], None]


class Outcome(NamedTuple):
    """``problem``: what could not be put back; None: all was. ``stays_paused``: by somebody else. ``is_in_error``: the robot stands so."""

    problem: Message | None
    stays_paused: bool = False
    is_in_error: bool = False


def put_back(
    look: Look,
    left: LeftBehind,
    note: Note,
    user: str,
    is_claimed: Callable[[int], bool] = lambda queue_id: False,
    *,
    is_late: bool = False,
    is_ours: Callable[[], bool] = lambda: True,
) -> Outcome:
    """Cancels what is still open of the trial, removes the mission that was made, and releases the robot. When everything is put back,
    the note is taken back.

    ``user``: who we are to the robot. ``is_claimed``: whether an item is a start of the plan. ``is_late``: a robot in Pause may have been
    paused by a person since: it is not released while something of others is in its queue, as it would drive off. ``is_ours``: whether the
    pause is still the trial's, asked just before it is ended. Raises RobotError.
    """
    ours, others = _items(look, left, user, is_claimed)
    open_ids = [item["id"] for item in ours if not has_ended(item)]
    for queue_id in open_ids:
        _check(look.probe.ask("DELETE", f"{QUEUE}/{queue_id}"), NOT_THERE)
    began = look.probe.clock()
    while left_open := [item for queue_id in open_ids if not has_ended(item := read_item(look, queue_id))]:
        if look.probe.clock() - began > ENDS_WITHIN:
            if known := [item for item in left_open if parse.queue_state(item) is not QueueState.UNKNOWN]:
                return Outcome(
                    message(
                        "mission {number} of the trial does not end; cancel it on the robot",
                        number=str(known[0].get("id")),
                    )
                )
            break  # with a word that is not known, and no time: it was cancelled
    outcome = _end_pause(look, left, ours, is_late and bool(others), is_ours)
    try:
        if left.mission is not None:
            _remove(look, f"/missions/{left.mission}")
    except RobotError:
        if (
            outcome.problem is None
        ):  # from now on it stands in Pause only where a person has paused it, and the plan may have it
            note(replace(left, is_paused=False, hold=None))
        raise
    if outcome.problem is None:
        note(None)
    return outcome


def _end_pause(
    look: Look, left: LeftBehind, ours: Iterable[parse.Object], is_in_use: bool, is_ours: Callable[[], bool]
) -> Outcome:
    """Of the trial; one that is or may be somebody else's stays. ``is_in_use``: by others, so that it would drive off."""
    status = look.probe.paced_status()
    if status.state is not RobotState.PAUSE:
        return Outcome(None, is_in_error=status.state is RobotState.ERROR)
    if not left.is_paused or not is_ours():
        return Outcome(None, stays_paused=True)
    if status.has_booted_since(left.uptime_s) or _have_gone_on(ours, left.started):
        return Outcome(message("it stands in Pause, and somebody may have paused it; release it there or in the app"))
    if is_in_use:
        return Outcome(
            message("it stands in Pause, with missions of others in its queue; release it there or in the app")
        )
    set_state(look, RobotState.READY)
    return Outcome(None)


def _have_gone_on(items: Iterable[parse.Object], started: str | None) -> bool:
    """Whether missions of the trial ran since it was paused, so that the pause was left and has come again."""
    begun = [(at, item) for item in items if (at := parse.instant(item.get("started"))) is not None]
    if not begun:
        return False
    _at, newest = max(begun, key=lambda each: each[0])
    return newest.get("started") != started or parse.queue_state(newest) is QueueState.DONE


def _remove(look: Look, path: str) -> None:
    """A mission, and first its actions: whether they go with it is not known of every robot. Raises RobotError."""
    actions = look.probe.get(f"{path}/actions")
    _check(actions, NOT_THERE)
    guids = [parse.text_or_none(action.get("guid")) for action in actions.rows]
    if actions.is_good and not (isinstance(actions.found, list) and len(guids) == len(actions.found) and all(guids)):
        raise Unreadable(address=look.probe.client.address.netloc, problem=message("the answer is no list of actions"))
    for guid in guids:
        _check(look.probe.ask("DELETE", f"{path}/actions/{guid}"), NOT_THERE)
    _check(look.probe.ask("DELETE", path), NOT_THERE)


def set_state(look: Look, state: RobotState) -> None:
    """Pause or release it, right after its status was read: what somebody does in between can't be seen. Raises RobotError."""
    _check(look.probe.ask("PUT", "/status", json={"state_id": int(state)}, at_once=True))


def read_item(look: Look, queue_id: int) -> parse.Object:
    """Empty: there is none. Raises RobotError."""
    answer = look.probe.get(f"{QUEUE}/{queue_id}")
    _check(answer, NOT_THERE)
    if not answer.is_good:
        return {}
    item = answer.one
    if item.get("id", queue_id) != queue_id or not parse.text_or_none(item.get("state")):
        raise Unreadable(address=look.probe.client.address.netloc, problem=message("the answer is no queue item"))
    return item


def items_above(look: Look, floor: int) -> Iterable[parse.Object]:
    """One by one, as that works on every robot. Raises RobotError."""
    missing = 0
    for number in range(floor + 1, floor + 1 + MOST_ITEMS):
        item = read_item(look, number)
        if item:
            missing = 0
            yield {**item, "id": number}
        elif (missing := missing + 1) >= MISSING_IN_A_ROW:
            return


def has_ended(item: parse.Object) -> bool:
    """Also by its time, where its word is not known."""
    return not item or bool(item.get("finished")) or parse.queue_state(item) in (QueueState.DONE, QueueState.ABORTED)


def _is_of_trial(item: parse.Object, left: LeftBehind) -> bool:
    """By its token, in whichever field that is; by the mission that was made."""
    return any(isinstance(value, str) and value in left.tokens for value in item.values()) or (
        left.mission is not None and item.get("mission_id") == left.mission
    )


def _may_be_of_trial(item: parse.Object, left: LeftBehind, user: str, is_claimed: Callable[[int], bool]) -> bool:
    """Where robots forget tokens: by what was queued, if it is nobody else's."""
    return (
        left.queued is not None
        and item.get("mission_id") == left.queued
        and item.get("created_by_name") in ("", None, user)
        and not is_claimed(item["id"])
    )


def _items(
    look: Look, left: LeftBehind, user: str, is_claimed: Callable[[int], bool]
) -> tuple[list[parse.Object], list[parse.Object]]:
    """Those of the trial, and open ones of others."""
    items = list(items_above(look, left.queue_floor))
    ours = [
        item for item in items if _is_of_trial(item, left)
    ]  # with a token found, the robot keeps them: the rest is of others
    ours = ours or [item for item in items if _may_be_of_trial(item, left, user, is_claimed)]
    return ours, [item for item in items if item not in ours and not has_ended(item)]


def _check(answer: Answer, fine: tuple[int, ...] = ()) -> None:
    """Raises the error of an answer, unless its status is fine as well."""
    error: RobotError | None = answer.error
    if error is not None and not (isinstance(error, Refusal) and error.status in fine):
        raise error


def with_pause(left: LeftBehind, note: Note, started: str | None, uptime_s: float | None) -> LeftBehind:
    """Noted before it is done."""
    left = replace(left, is_paused=True, started=started, uptime_s=uptime_s)
    note(left)
    return left


def without_pause(left: LeftBehind, note: Note) -> LeftBehind:
    """From now on a pause is somebody else's."""
    left = replace(left, is_paused=False)
    note(left)
    return left
