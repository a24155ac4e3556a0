"""What a trial has shown, as findings and in the robot's profile."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from app.domain.check_up import Topic
from app.domain.message import Message, message
from app.domain.robot import QueueState
from app.mir import parse
from app.mir.errors import Refusal, Unauthorized
from app.mir.robot_vocabulary import CANCELLED, USER_REQUEST
from app.mir.texts import clean, resolve
from app.services.check_up.look import Look, why
from app.services.check_up.trial import FIRST, LONGEST_WORD, Item, Seen, Sign

DESCRIPTION, CREATED = "description", 201
LONGEST_NAME = 80  # characters of a field's name
LONGEST_PREFIX = 200  # characters of what a cancelled mission says
TIMES = ("started", "finished")
PLACES = {"item": message("the item itself"), "list": message("lists"), "search": message("searches")}
WORDS = {QueueState.PENDING: "Pending", QueueState.EXECUTING: "Executing", QueueState.DONE: "Done"}


def judge(look: Look, seen: Seen, user: str) -> None:
    """Adds a finding for each topic that was tried, and what is known now to the profile."""
    if seen.may_not_make:
        look.amber(
            Topic.ORDER,
            message("User {user} may not make a mission for the trial", user=user or "?"),
            message("Choose a harmless one of the robot's missions, or give the user more rights."),
        )
    if seen.items:
        _order(look, seen, user)
    if seen.items and seen.items[FIRST].id is not None:
        _recognised(look, seen)
        of_others = _words(look, seen)
        if seen.cancelled is not None:
            _cancelled(look, seen, seen.cancelled, of_others)
        _failed(look)
        _priority(look, seen)
        _second(look, seen)
    _pause(look, seen)
    if seen.problem is not None:
        found = {finding.topic for finding in look.findings}
        topic = next((each for each in Topic if each.is_tried and each not in found), Topic.LEFT)
        look.red(
            topic,
            message("The trial ended early: {problem}", problem=why(seen.problem)),
            message("Check up again when it answers."),
        )


def judge_taken_over(look: Look, sign: Sign) -> None:
    """The one finding of a trial that ended because somebody else used the robot, or seemed to."""
    ended = message("The trial ended. Check up again when nobody else uses the robot.")
    if sign is Sign.PAUSED:
        look.amber(Topic.PAUSE, message("Somebody paused it while it was tried"), ended)
    elif sign is Sign.RELEASED:
        look.amber(Topic.PAUSE, message("Somebody ended the pause of the trial"), ended)
    else:
        look.red(
            Topic.PAUSE,
            message("A mission went on while it was in Pause"),
            message(
                "Either somebody released it and paused it again, or Pause in the app does not keep it from driving: look at the "
                "robot, and check up again."
            ),
        )


def _order(look: Look, seen: Seen, user: str) -> None:
    first = seen.items[FIRST]
    answer = first.answer
    if not answer.is_good:
        if isinstance(answer.error, Unauthorized):
            look.red(
                Topic.ORDER,
                message("User {user} may not start missions", user=user or "?"),
                message("Give the user more rights on the robot (Setup, Users), or use another one."),
            )
        else:
            look.red(
                Topic.ORDER,
                message("It does not take a mission: {problem}", problem=why(answer)),
                message("Nothing can be scheduled on it before that is put right."),
            )
        return
    gives_id = first.given_id is not None
    look.seen["gives_id"], look.seen["order_status"] = gives_id, answer.status
    if first.id is None:
        look.red(
            Topic.ORDER,
            message("It took a mission, but its queue does not have it"),
            message("The app could not tell whether a start arrived: do not schedule on this robot."),
        )
    elif not gives_id:
        look.amber(
            Topic.ORDER,
            message("It takes a mission, but does not tell its number"),
            message("The app looks for each start in the queue, which takes some more requests. Nothing to do."),
        )
    elif answer.status != CREATED:
        look.amber(
            Topic.ORDER,
            message("It takes a mission with status {status}, where MiR's definition says 201", status=answer.status),
            message("The app looks for each start in the queue, which takes some more requests. Nothing to do."),
        )
    else:
        look.green(Topic.ORDER, message("It takes a mission and tells its number"))


def _recognised(look: Look, seen: Seen) -> None:
    token = seen.items[FIRST].token
    found = {place: _fields_with(row, token) for place, row in seen.places.items()}
    fields = found.get("item", [])
    field = DESCRIPTION if DESCRIPTION in fields else next(iter(fields), "")
    look.seen["token_field"] = field
    places = [place for place, names in found.items() if field and field in names]
    where: Message = ""
    for place in places:
        where = message("{some}, {more}", some=where, more=PLACES[place]) if where else PLACES[place]
    if field == DESCRIPTION:
        look.green(Topic.RECOGNISED, message("The app's mark comes back in the description: in {where}", where=where))
    elif field:
        look.amber(
            Topic.RECOGNISED,
            message("The app's mark comes back in the field {field}: in {where}", field=field, where=where),
            message("The app reads it there from now on. Nothing to do."),
        )
    else:
        shown = clean(seen.items[FIRST].now.get(DESCRIPTION), 80)
        look.amber(
            Topic.RECOGNISED,
            message("The app's mark does not come back; the description is {text}", text=shown)
            if shown
            else message("The app's mark does not come back"),
            message(
                "The app knows its missions by their number, and after a lost answer by mission, user and time. Let nobody else "
                "use the app's user on this robot."
            ),
        )


def _fields_with(row: Mapping[str, Any], token: str) -> list[str]:
    return [name for name, value in row.items() if value == token and clean(name, LONGEST_NAME) == name]


def _words(look: Look, seen: Seen) -> list[str]:
    """Learns the words for states that are not MiR's, each for one state; returns them, and those that stand for several."""
    runs = [item for item in seen.items if item.id is not None and item is not seen.cancelled]
    phases: dict[str, set[QueueState]] = {}
    for item in runs:
        for phase, word in item.words.items():
            phases.setdefault(word, set()).add(
                QueueState.ABORTED if seen.is_in_error and phase is QueueState.DONE else phase
            )
    if seen.cancelled is not None and seen.cancelled.has_ended:
        phases.setdefault(clean(seen.cancelled.now.get("state"), LONGEST_WORD), set()).add(QueueState.ABORTED)
    unknown = {word: found for word, found in phases.items() if word and _is_unknown(word)}
    own = {word: WORDS[phase] for word, (phase, *others) in unknown.items() if not others and phase in WORDS}
    shared = [word for word, found in unknown.items() if len(found) > 1]
    look.seen["item_states"] = dict(own)
    gone = any(not item.now for item in runs)
    failed = next(
        (
            item
            for item in runs
            if item.has_ended and (seen.is_in_error or parse.queue_state(item.now) is QueueState.ABORTED)
        ),
        None,
    )
    not_ended = next((item for item in runs if not item.has_ended), None)
    if failed is not None:
        look.red(
            Topic.WORDS,
            message(
                "The mission of the trial did not complete: {text}", text=resolve(failed.now.get("message")) or "?"
            ),
            message("Run it on the robot itself, and look why."),
        )
    elif not_ended is not None:
        look.amber(
            Topic.WORDS,
            message(
                "A mission of the trial did not end in time; its state is {state}",
                state=clean(not_ended.now.get("state"), LONGEST_WORD),
            ),
            message("Look at the robot, and check up again with a shorter mission."),
        )
    elif gone:
        look.amber(
            Topic.WORDS,
            message("A mission that has ended is gone from its queue"),
            message(
                "Whether it was done can't be told there: the app shows such a run as failed, gone from the robot."
            ),
        )
    elif shared:
        look.amber(
            Topic.WORDS,
            message("It has one word for several states of missions: {words}", words=", ".join(shared)),
            message(
                "A run whose word is not known is followed until the robot has ended it, and shown as failed with that word."
            ),
        )
    elif own:
        pairs = ", ".join(f"{word} = {state}" for word, state in own.items())
        look.amber(
            Topic.WORDS,
            message("It has words of its own for the states of missions: {words}", words=pairs),
            message("The app knows them from now on. Nothing to do."),
        )
    elif missing := [name for name in TIMES if parse.instant(runs[0].now.get(name)) is None]:
        look.amber(
            Topic.WORDS,
            message("A mission that is done lacks its times: {fields}", fields=", ".join(missing)),
            message("How long runs take on it is not known, so charts and forecasts have no durations of it."),
        )
    else:
        look.green(Topic.WORDS, message("Its words for the states of missions are MiR's"))
    return [*own, *shared]


def _is_unknown(word: str) -> bool:
    return parse.queue_state({"state": word}) is QueueState.UNKNOWN


def _cancelled(look: Look, seen: Seen, item: Item, own_words: Sequence[str]) -> None:
    word, text = clean(item.now.get("state"), LONGEST_WORD), resolve(item.now.get("message"))[:LONGEST_PREFIX]
    if seen.cancel is not None and isinstance(seen.cancel.error, Refusal):
        look.red(
            Topic.CANCELLED,
            message("A mission can't be cancelled: {problem}", problem=why(seen.cancel)),
            message("What the app has started can only be stopped on the robot: give the user more rights there."),
        )
        return
    if not item.has_ended:
        look.amber(
            Topic.CANCELLED,
            message("A cancelled mission stays {state}", state=word or "?"),
            message("Look at the robot, and check up again."),
        )
        return
    if not item.now:
        look.amber(
            Topic.CANCELLED,
            message("A cancelled mission is gone from its queue"),
            message("A mission that somebody cancels at the robot is shown as failed, gone from the robot."),
        )
        return
    failed = {clean(entry.get("state"), LONGEST_WORD) for entry in _failures(look, text)}
    is_shared = _is_unknown(word) and word in own_words
    is_word_enough = _is_unknown(word) and not is_shared and word not in failed and (bool(failed) or not own_words)
    if _is_unknown(word) and not is_shared:
        look.seen["item_states"][word] = CANCELLED if is_word_enough else "Aborted"
    if is_word_enough:
        look.amber(
            Topic.CANCELLED,
            message("It calls a cancelled mission {word}", word=word),
            message("The app knows it from now on. Nothing to do."),
        )
        return
    look.seen["cancelled_message"] = text
    if not text:
        look.amber(
            Topic.CANCELLED,
            message("It says of a cancelled mission only {word}", word=word),
            message("A mission that somebody cancels at the robot is shown as failed."),
        )
    elif text.startswith(USER_REQUEST) and not _is_unknown(word):
        look.green(Topic.CANCELLED, message("A cancelled mission says so: {text}", text=text))
    else:
        look.amber(
            Topic.CANCELLED,
            message("A cancelled mission is {word} and says: {text}", word=word, text=text),
            message("The app knows it from now on. Nothing to do."),
        )


def _failures(look: Look, cancelled: str) -> list[Mapping[str, Any]]:
    """Of the items that its queue had before: those that failed, the newest first. Completed ones say nothing."""
    done = {word for word, state in look.seen.get("item_states", {}).items() if state == "Done"}
    return [
        entry
        for entry in look.entries
        if entry.get("finished")
        and (text := resolve(entry.get("message")))
        and text != cancelled
        and (
            parse.queue_state(dict(entry)) is QueueState.ABORTED
            or (_is_unknown(str(entry.get("state"))) and str(entry.get("state")) not in done)
        )
    ]


def _failed(look: Look) -> None:
    said = look.seen.get("cancelled_message") or USER_REQUEST
    failures = [
        entry for entry in _failures(look, said) if look.seen["item_states"].get(str(entry.get("state"))) != CANCELLED
    ]
    if failures:
        look.green(
            Topic.FAILED,
            message("Its newest failed mission says: {text}", text=clean(resolve(failures[0].get("message")), 120)),
        )
    else:
        look.green(
            Topic.FAILED,
            message("How a failed mission is worded was not tried, as it would stop the robot with an error"),
            message("The first one that fails is shown with the robot's own text."),
        )


def _priority(look: Look, seen: Seen) -> None:
    usual, urgent = seen.items[FIRST], seen.preferred
    first, second = (
        parse.instant(usual.now.get("started")),
        parse.instant(urgent.now.get("started")) if urgent else None,
    )
    if urgent is None or seen.waits_in_pause is not True or first is None or second is None or first == second:
        look.green(
            Topic.PRIORITY,
            message("Whether priority counts could not be seen"),
            message("The app does not rely on it."),
        )
        return
    look.seen["priority_counts"] = second < first
    if second < first:
        look.green(
            Topic.PRIORITY,
            message("A mission of higher priority begins before earlier ones"),
            message("What others queue with a higher priority goes before the plan."),
        )
    else:
        look.green(
            Topic.PRIORITY,
            message("Priority has no effect: missions begin in the order in which they were queued"),
            message("Which start goes first is decided in the app."),
        )


def _second(look: Look, seen: Seen) -> None:
    first, again = seen.items[FIRST], seen.second
    if again is None:
        return
    if again.is_good and not any(item.token == first.token and item.id not in (None, first.id) for item in seen.items):
        look.green(
            Topic.SECOND,
            message("The same order sent twice makes one mission"),
            message("The app looks first all the same."),
        )
    elif again.is_good:
        look.green(
            Topic.SECOND,
            message("The same order sent twice makes two missions"),
            message("That is why the app looks into the queue before it sends a start again."),
        )
    else:
        look.green(
            Topic.SECOND,
            message("It refuses the same order sent twice: {problem}", problem=why(again)),
            message("The app looks first all the same."),
        )


def _pause(look: Look, seen: Seen) -> None:
    says: Message
    if seen.pause_problem is not None:
        look.amber(
            Topic.PAUSE,
            message("It can't be paused: {problem}", problem=why(seen.pause_problem)),
            message("Pause and Resume of the app have no effect on it: give the user more rights on the robot."),
        )
    elif seen.runs_on is False and all(parse.queue_state(item.now) is not QueueState.PENDING for item in seen.items):
        look.amber(
            Topic.PAUSE,
            message("A mission that is paused does not go on when the robot is released"),
            message("After Pause and Resume a run counts as failed: start it again."),
        )
    elif seen.waits_in_pause:
        says = (
            message("While it is paused missions wait, and what ran goes on afterwards")
            if seen.runs_on
            else message(
                "While it is paused missions wait; whether what runs goes on could not be seen, as the missions were too short"
            )
        )
        look.green(Topic.PAUSE, says)
