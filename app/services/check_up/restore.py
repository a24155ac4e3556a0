"""Puts back what a trial changed on a robot: at its end, and later where it was cut off."""
from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import replace

from app.domain.check_up import LeftBehind
from app.domain.message import Message, message
from app.domain.robot import QueueState, RobotState
from app.mir import parse
from app.mir.errors import Refusal, RobotError, Unreadable
from app.mir.probe import QUEUE, Answer
from app.services.check_up.look import Look

MOST_ITEMS = 60              # numbers above the floor that are looked at: those of the trial, and what others queued between them
MISSING_IN_A_ROW = 3         # numbers that aren't there, until no more are looked for
ENDS_WITHIN = 15.0           # s from the request to cancel an item to its end
NOT_THERE = (404, 410)

Note = Callable[[LeftBehind | None], None]


def put_back(look: Look, left: LeftBehind, note: Note, user: str, is_claimed: Callable[[int], bool] = lambda queue_id: False, *,
             is_late: bool = False) -> Message | None:
    """Cancels what is still open of the trial, removes the mission that was made, and releases the robot. Returns what is not as it was;
    None, with the note taken back, when everything is.

    ``user``: who we are to the robot. ``is_claimed``: whether an item is a start of the plan. ``is_late``: a robot in Pause may have been
    paused by a person since: it is not released while something of others is in its queue, as it would drive off. Raises RobotError.
    """
    open_ids, others = _open(look, left, user, is_claimed)
    for queue_id in open_ids:
        _check(look.probe.ask("DELETE", f"{QUEUE}/{queue_id}"), NOT_THERE)
    began = look.probe.clock()
    while left_open := [item for queue_id in open_ids if not has_ended(item := read_item(look, queue_id))]:
        if look.probe.clock() - began > ENDS_WITHIN:
            if known := [item for item in left_open if parse.queue_state(item) is not QueueState.UNKNOWN]:
                return message("mission {number} of the trial does not end; cancel it on the robot", number=str(known[0].get("id")))
            break                                # with a word that is not known, and no time: it was cancelled
    stands = left.is_paused and look.probe.status().state is RobotState.PAUSE
    stays = stands and is_late and bool(others)
    if stands and not stays:
        set_state(look, RobotState.READY)
    try:
        if left.mission is not None:
            _remove(look, f"/missions/{left.mission}")
    except RobotError:
        if not stays:            # from now on it stands in Pause only where a person has paused it, and the plan may have it
            note(replace(left, is_paused=False, hold=None))
        raise
    if stays:
        return message("it stands in Pause, with missions of others in its queue; release it there or in the app")
    note(None)
    return None


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


def set_state(look: Look, state: RobotState) -> Answer:
    """Pause or release it. Raises RobotError."""
    answer = look.probe.ask("PUT", "/status", json={"state_id": int(state)})
    _check(answer)
    return answer


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
    return (any(isinstance(value, str) and value in left.tokens for value in item.values())
            or (left.mission is not None and item.get("mission_id") == left.mission))


def _may_be_of_trial(item: parse.Object, left: LeftBehind, user: str, is_claimed: Callable[[int], bool]) -> bool:
    """Where robots forget tokens: by what was queued, if it is nobody else's."""
    return (left.queued is not None and item.get("mission_id") == left.queued and item.get("created_by_name") in ("", None, user)
            and not is_claimed(item["id"]))


def _open(look: Look, left: LeftBehind, user: str, is_claimed: Callable[[int], bool]) -> tuple[list[int], list[int]]:
    """Ids of what has not ended: of the trial, and of others."""
    items = list(items_above(look, left.queue_floor))
    ours = [item for item in items if _is_of_trial(item, left)]            # with a token found, the robot keeps them: the rest is of others
    ours = ours or [item for item in items if _may_be_of_trial(item, left, user, is_claimed)]
    return [item["id"] for item in ours if not has_ended(item)], [item["id"] for item in items if item not in ours and not has_ended(item)]


def _check(answer: Answer, fine: tuple[int, ...] = ()) -> None:
    """Raises the error of an answer, unless its status is fine as well."""
    error: RobotError | None = answer.error
    if error is not None and not (isinstance(error, Refusal) and error.status in fine):
        raise error


def with_pause(left: LeftBehind, is_paused: bool, note: Note) -> LeftBehind:
    """Noted before it is done."""
    left = replace(left, is_paused=is_paused)
    note(left)
    return left
