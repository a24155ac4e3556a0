"""What a trial has shown, as findings and in the robot's profile."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from app.domain.check_up import Topic
from app.domain.message import Message, message
from app.domain.robot import QueueState
from app.mir import parse
from app.mir.errors import Refusal, Unauthorized
from app.mir.robot_vocabulary import CANCELLED, USER_REQUEST
from app.mir.texts import clean, resolve
from app.services.check_up.session import CheckUpSession, Found, amber, green, probe, red, why
from app.services.check_up.trial import FIRST, LONGEST_WORD, Item, TrialResult

DESCRIPTION, CREATED = "description", 201
LONGEST_NAME = 80  # characters of a field's name
LONGEST_PREFIX = 200  # characters of what a cancelled mission says
TIMES = ("started", "finished")
PLACES = {"item": message("the item itself"), "list": message("lists"), "search": message("searches")}
WORDS = {QueueState.PENDING: "Pending", QueueState.EXECUTING: "Executing", QueueState.DONE: "Done"}


def look_at_trial(session: CheckUpSession, result: TrialResult) -> None:
    """Adds a finding for each topic that was tried, and what is known now to the profile."""
    if result.may_not_make:
        session.add(
            Topic.ORDER,
            amber(
                message("User {user} may not make a mission for the trial", user=session.identity.user_name or "?"),
                message("Choose a harmless one of the robot's missions, or give the user more rights."),
            ),
        )
    if result.items:
        _order(session, result)
    if result.items and result.items[FIRST].id is not None:
        for look in TRIED:
            look(session, result)
    _pause(session, result)
    if result.problem is not None:
        found = {finding.topic for finding in session.findings}
        session.add(
            next((each for each in Topic if each.is_tried and each not in found), Topic.LEFT),
            red(
                message("The trial ended early: {problem}", problem=why(result.problem)),
                message("Check up again when it answers."),
            ),
        )


@probe(Topic.ORDER)
def _order(session: CheckUpSession, result: TrialResult) -> Found:
    first = result.items[FIRST]
    answer = first.answer
    if isinstance(answer.error, Unauthorized):
        return red(
            message("User {user} may not start missions", user=session.identity.user_name or "?"),
            message("Give the user more rights on the robot (Setup, Users), or use another one."),
        )
    if not answer.is_good:
        return red(
            message("It does not take a mission: {problem}", problem=why(answer)),
            message("Nothing can be scheduled on it before that is put right."),
        )
    gives_id = first.answered_id is not None
    session.facts["gives_id"], session.facts["order_status"] = gives_id, answer.status
    if first.id is None:
        return red(
            message("It took a mission, but its queue does not have it"),
            message("The app could not tell whether a start arrived: do not schedule on this robot."),
        )
    if not gives_id:
        return amber(
            message("It takes a mission, but does not tell its number"),
            message("The app looks for each start in the queue, which takes some more requests. Nothing to do."),
        )
    if answer.status != CREATED:
        return amber(
            message("It takes a mission with status {status}, where MiR's definition says 201", status=answer.status),
            message("The app looks for each start in the queue, which takes some more requests. Nothing to do."),
        )
    return green(message("It takes a mission and tells its number"))


@probe(Topic.RECOGNISED)
def _recognised(session: CheckUpSession, result: TrialResult) -> Found:
    token = result.items[FIRST].token
    found = {place: _fields_with(row, token) for place, row in result.places.items()}
    fields = found.get("item", [])
    field = DESCRIPTION if DESCRIPTION in fields else next(iter(fields), "")
    session.facts["token_field"] = field
    where: Message = ""
    for place in (PLACES[name] for name, names in found.items() if field and field in names):
        where = message("{some}, {more}", some=where, more=place) if where else place
    if field == DESCRIPTION:
        return green(message("The app's mark comes back in the description: in {where}", where=where))
    if field:
        return amber(
            message("The app's mark comes back in the field {field}: in {where}", field=field, where=where),
            message("The app reads it there from now on. Nothing to do."),
        )
    shown = clean(result.items[FIRST].now.get(DESCRIPTION), 80)
    return amber(
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


def _own_words(result: TrialResult) -> tuple[dict[str, str], list[str]]:
    """The robot's words for states that are not MiR's: those for one state, with MiR's word, and those that stand for several."""
    phases: dict[str, set[QueueState]] = {}
    for item in result.runs:
        for phase, word in item.words.items():
            phases.setdefault(word, set()).add(
                QueueState.ABORTED if result.is_in_error and phase is QueueState.DONE else phase
            )
    if result.cancelled is not None and result.cancelled.has_ended:
        phases.setdefault(result.cancelled.word, set()).add(QueueState.ABORTED)
    unknown = {word: found for word, found in phases.items() if word and _is_unknown(word)}
    own = {word: WORDS[phase] for word, (phase, *others) in unknown.items() if not others and phase in WORDS}
    return own, [word for word, found in unknown.items() if len(found) > 1]


@probe(Topic.WORDS)
def _words(session: CheckUpSession, result: TrialResult) -> Found:
    own, shared = _own_words(result)
    session.facts["item_states"] = own
    if (found := _ends(result)) is not None:
        return found
    if shared:
        return amber(
            message("It has one word for several states of missions: {words}", words=", ".join(shared)),
            message(
                "A run whose word is not known is followed until the robot has ended it, and shown as failed with that word."
            ),
        )
    if own:
        pairs = ", ".join(f"{word} = {state}" for word, state in own.items())
        return amber(
            message("It has words of its own for the states of missions: {words}", words=pairs),
            message("The app knows them from now on. Nothing to do."),
        )
    if missing := [name for name in TIMES if parse.instant(result.runs[0].now.get(name)) is None]:
        return amber(
            message("A mission that is done lacks its times: {fields}", fields=", ".join(missing)),
            message("How long runs take on it is not known, so charts and forecasts have no durations of it."),
        )
    return green(message("Its words for the states of missions are MiR's"))


def _ends(result: TrialResult) -> Found | None:
    """What is wrong with how the missions ended."""
    runs = result.runs
    failed = next(
        (
            item
            for item in runs
            if item.has_ended and (result.is_in_error or parse.queue_state(item.now) is QueueState.ABORTED)
        ),
        None,
    )
    not_ended = next((item for item in runs if not item.has_ended), None)
    if failed is not None:
        return red(
            message(
                "The mission of the trial did not complete: {text}", text=resolve(failed.now.get("message")) or "?"
            ),
            message("Run it on the robot itself, and look why."),
        )
    if not_ended is not None:
        return amber(
            message(
                "A mission of the trial did not end in time; its state is {state}",
                state=not_ended.word,
            ),
            message("Look at the robot, and check up again with a shorter mission."),
        )
    if not all(item.now for item in runs):
        return amber(
            message("A mission that has ended is gone from its queue"),
            message(
                "Whether it was done can't be told there: the app shows such a run as failed, gone from the robot."
            ),
        )
    return None


def _is_unknown(word: str) -> bool:
    return parse.queue_state({"state": word}) is QueueState.UNKNOWN


@probe(Topic.CANCELLED)
def _cancelled(session: CheckUpSession, result: TrialResult) -> Found | None:
    item = result.cancelled
    if item is None:
        return None
    if result.cancel is not None and isinstance(result.cancel.error, Refusal):
        return red(
            message("A mission can't be cancelled: {problem}", problem=why(result.cancel)),
            message("What the app has started can only be stopped on the robot: give the user more rights there."),
        )
    return _words_of_cancelled(session, result, item)


def _words_of_cancelled(session: CheckUpSession, result: TrialResult, item: Item) -> Found:
    word, text = item.word, resolve(item.now.get("message"))[:LONGEST_PREFIX]
    if not item.has_ended:
        return amber(
            message("A cancelled mission stays {state}", state=word or "?"),
            message("Look at the robot, and check up again."),
        )
    if not item.now:
        return amber(
            message("A cancelled mission is gone from its queue"),
            message("A mission that somebody cancels at the robot is shown as failed, gone from the robot."),
        )
    own, shared = _own_words(result)
    failed = {clean(entry.get("state"), LONGEST_WORD) for entry in _failures(session, text)}
    is_new = _is_unknown(word) and word not in own and word not in shared
    is_word_enough = is_new and word not in failed and bool(failed or not (own or shared))
    if is_new:
        session.facts["item_states"][word] = CANCELLED if is_word_enough else "Aborted"
    if is_word_enough:
        return amber(
            message("It calls a cancelled mission {word}", word=word),
            message("The app knows it from now on. Nothing to do."),
        )
    session.facts["cancelled_message"] = text
    if not text:
        return amber(
            message("It says of a cancelled mission only {word}", word=word),
            message("A mission that somebody cancels at the robot is shown as failed."),
        )
    if text.startswith(USER_REQUEST) and not _is_unknown(word):
        return green(message("A cancelled mission says so: {text}", text=text))
    return amber(
        message("A cancelled mission is {word} and says: {text}", word=word, text=text),
        message("The app knows it from now on. Nothing to do."),
    )


def _failures(session: CheckUpSession, cancelled: str) -> list[Mapping[str, Any]]:
    """Of the items that its queue had before: those that failed, the newest first. Completed ones say nothing."""
    done = {word for word, state in session.facts.get("item_states", {}).items() if state == "Done"}
    return [
        entry
        for entry in session.entries
        if entry.get("finished")
        and (text := resolve(entry.get("message")))
        and text != cancelled
        and (
            parse.queue_state(dict(entry)) is QueueState.ABORTED
            or (_is_unknown(str(entry.get("state"))) and str(entry.get("state")) not in done)
        )
    ]


@probe(Topic.FAILED)
def _failed(session: CheckUpSession, _result: TrialResult) -> Found:
    said = session.facts.get("cancelled_message") or USER_REQUEST
    failures = [
        entry
        for entry in _failures(session, said)
        if session.facts["item_states"].get(str(entry.get("state"))) != CANCELLED
    ]
    if failures:
        return green(
            message("Its newest failed mission says: {text}", text=clean(resolve(failures[0].get("message")), 120)),
        )
    return green(
        message("How a failed mission is worded was not tried, as it would stop the robot with an error"),
        message("The first one that fails is shown with the robot's own text."),
    )


@probe(Topic.PRIORITY)
def _priority(session: CheckUpSession, result: TrialResult) -> Found:
    first, second = (
        parse.instant(item.now.get("started")) if item else None for item in (result.items[FIRST], result.preferred)
    )
    if result.waits_in_pause is not True or first is None or second is None or first == second:
        return green(
            message("Whether priority counts could not be seen"),
            message("The app does not rely on it."),
        )
    session.facts["priority_counts"] = second < first
    if second < first:
        return green(
            message("A mission of higher priority begins before earlier ones"),
            message("What others queue with a higher priority goes before the plan."),
        )
    return green(
        message("Priority has no effect: missions begin in the order in which they were queued"),
        message("Which start goes first is decided in the app."),
    )


@probe(Topic.SECOND)
def _second(_session: CheckUpSession, result: TrialResult) -> Found | None:
    first, again = result.items[FIRST], result.second
    if again is None:
        return None
    if again.is_good and any(item.token == first.token and item.id not in (None, first.id) for item in result.items):
        return green(
            message("The same order sent twice makes two missions"),
            message("That is why the app looks into the queue before it sends a start again."),
        )
    return green(
        message("The same order sent twice makes one mission")
        if again.is_good
        else message("It refuses the same order sent twice: {problem}", problem=why(again)),
        message("The app looks first all the same."),
    )


@probe(Topic.PAUSE)
def _pause(_session: CheckUpSession, result: TrialResult) -> Found | None:
    if result.pause_problem is not None:
        return amber(
            message("It can't be paused: {problem}", problem=why(result.pause_problem)),
            message("Pause and Resume of the app have no effect on it: give the user more rights on the robot."),
        )
    if result.runs_on is False and all(parse.queue_state(item.now) is not QueueState.PENDING for item in result.items):
        return amber(
            message("A mission that is paused does not go on when the robot is released"),
            message("After Pause and Resume a run counts as failed: start it again."),
        )
    if result.waits_in_pause:
        return green(
            message("While it is paused missions wait, and what ran goes on afterwards")
            if result.runs_on
            else message(
                "While it is paused missions wait; whether what runs goes on could not be seen, as the missions were too short"
            )
        )
    return None


TRIED = (_recognised, _words, _cancelled, _failed, _priority, _second)  # in the order of the report
