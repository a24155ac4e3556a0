"""What a trial has shown, as findings and in the robot's profile."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from app.domain.check_up import Topic
from app.domain.message import Message, message
from app.domain.robot import QueueState
from app.mir import parse
from app.mir.errors import Refusal, RobotError, Unauthorized
from app.mir.raw_client import Answer
from app.mir.robot_vocabulary import CANCELLED, USER_REQUEST
from app.mir.texts import clean, resolve
from app.services.check_up.session import CheckUpSession, Found, amber, green, red
from app.services.check_up.trial import LONGEST_WORD, Item, TrialResult

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
                "User {user} may not make a mission for the trial",
                "Choose a harmless one of the robot's missions, or give the user more rights.",
                user=session.identity.user_name or "?",
            ),
        )
    if result.first is not None:
        session.add(Topic.ORDER, taken(session, result.first, is_found=bool(result.items)))
    if result.items:
        for topic, look in TRIED:
            session.add(topic, look(session, result))
    session.add(Topic.PAUSE, _pause(result))
    if result.problem is not None:
        add_early_end(session, result.problem)


def add_early_end(session: CheckUpSession, problem: RobotError) -> None:
    found = {finding.topic for finding in session.findings}
    session.add(
        next((each for each in Topic if each.is_tried and each not in found), Topic.LEFT),
        red("The trial ended early: {problem}", "Check up again when it answers.", problem=problem.message),
    )


def taken(session: CheckUpSession, answer: Answer, *, is_found: bool) -> Found:
    if isinstance(answer.error, Unauthorized):
        return red(
            "User {user} may not start missions",
            "Give the user more rights on the robot (Setup, Users), or use another one.",
            user=session.identity.user_name or "?",
        )
    if not answer.is_good:
        return red(
            "It does not take a mission: {problem}",
            "Nothing can be scheduled on it until that is corrected.",
            problem=answer.problem,
        )
    gives_id = answer.id is not None
    session.facts["gives_id"], session.facts["order_status"] = gives_id, answer.status
    if not is_found:
        return red(
            "It took a mission, but its queue does not have it",
            "The app could not know whether a start arrived: do not schedule on this robot.",
        )
    if not gives_id:
        return amber(
            "It takes a mission, but does not return its number",
            "The app looks for each start in the queue, which takes some more requests. Nothing to do.",
        )
    if answer.status != CREATED:
        return amber(
            "It takes a mission with status {status}, where MiR's definition says 201",
            "The app looks for each start in the queue, which takes some more requests. Nothing to do.",
            status=answer.status,
        )
    return green("It takes a mission and returns its number")


def recognised(session: CheckUpSession, result: TrialResult) -> Found:
    token = result.items[0].token
    found = {place: _fields_with(row, token) for place, row in result.places.items()}
    fields = found.get("item", [])
    field = DESCRIPTION if DESCRIPTION in fields else next(iter(fields), "")
    session.facts["token_field"] = field
    where: Message = ""
    for place in (PLACES[name] for name, names in found.items() if field and field in names):
        where = message("{some}, {more}", some=where, more=place) if where else place
    if field == DESCRIPTION:
        return green("The app's mark comes back in the description: in {where}", where=where)
    if field:
        return amber(
            "The app's mark comes back in the field {field}: in {where}",
            "The app reads it there from now on. Nothing to do.",
            field=field,
            where=where,
        )
    shown = clean(result.items[0].now.get(DESCRIPTION), 80)
    return amber(
        "The app's mark does not come back, the description is {text}"
        if shown
        else "The app's mark does not come back",
        "The app knows its missions by their number, and after a lost answer by mission, user and time. Only the app "
        "may use its user on this robot.",
        text=shown,
    )


def _fields_with(row: Mapping[str, Any], token: str) -> list[str]:
    return [name for name, value in row.items() if value == token and clean(name, LONGEST_NAME) == name]


def _own_words(result: TrialResult) -> tuple[dict[str, str], list[str]]:
    """The robot's own words for states: those for one state, with MiR's word, and ambiguous ones."""
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


def _words(session: CheckUpSession, result: TrialResult) -> Found:
    own, shared = _own_words(result)
    session.facts["item_states"] = own
    if (found := _ends(result)) is not None:
        return found
    if shared:
        return amber(
            "It has one word for several states of missions: {words}",
            "A run with an unknown word is followed until the robot has ended it, and shown as failed with that word.",
            words=", ".join(shared),
        )
    if own:
        pairs = ", ".join(f"{word} = {state}" for word, state in own.items())
        return amber(
            "It has its own words for the states of missions: {words}",
            "The app knows them from now on. Nothing to do.",
            words=pairs,
        )
    if missing := [name for name in TIMES if parse.instant(result.runs[0].now.get(name)) is None]:
        return amber(
            "A completed mission lacks its times: {fields}",
            "Charts and forecasts have no durations of its runs.",
            fields=", ".join(missing),
        )
    return green("Its words for the states of missions are MiR's")


def _ends(result: TrialResult) -> Found | None:
    """What is wrong with how the missions ended."""
    ended = [item for item in result.runs if item.has_ended]
    failed = [item for item in ended if result.is_in_error or parse.queue_state(item.now) is QueueState.ABORTED]
    if failed:
        return red(
            "The mission of the trial did not complete: {text}",
            "Run it on the robot itself to see why.",
            text=resolve(failed[0].now.get("message")) or "?",
        )
    if len(ended) < len(result.runs):
        return amber(
            "A mission of the trial did not end in time, its state is {state}",
            "Look at the robot, and check up again with a shorter mission.",
            state=next(item.word for item in result.runs if not item.has_ended),
        )
    if not all(item.now for item in ended):
        return amber(
            "A mission that has ended is not in its queue any longer",
            "Its outcome can't be read there: the app shows such a run as failed, no longer in the robot's queue.",
        )
    return None


def _is_unknown(word: str) -> bool:
    return parse.queue_state({"state": word}) is QueueState.UNKNOWN


def _cancelled(session: CheckUpSession, result: TrialResult) -> Found | None:
    item = result.cancelled
    if item is None:
        return None
    if result.cancel is not None and isinstance(result.cancel.error, Refusal):
        return red(
            "A mission can't be cancelled: {problem}",
            "What the app has started can only be stopped on the robot: give the user more rights there.",
            problem=result.cancel.problem,
        )
    return _words_of_cancelled(session, result, item)


def _words_of_cancelled(session: CheckUpSession, result: TrialResult, item: Item) -> Found:
    word, text = item.word, resolve(item.now.get("message"))[:LONGEST_PREFIX]
    if not item.has_ended:
        return amber("A cancelled mission stays {state}", "Look at the robot, and check up again.", state=word or "?")
    if not item.now:
        return amber(
            "A cancelled mission is not in its queue any longer",
            "A mission that somebody cancels at the robot is shown as failed, no longer in the robot's queue.",
        )
    own, shared = _own_words(result)
    failed = {clean(entry.get("state"), LONGEST_WORD) for entry in _failures(session, text)}
    is_new = _is_unknown(word) and word not in own and word not in shared
    is_word_enough = is_new and word not in failed and bool(failed or not (own or shared))
    if is_new:
        session.facts["item_states"][word] = CANCELLED if is_word_enough else "Aborted"
    if is_word_enough:
        return amber("It calls a cancelled mission {word}", "The app knows it from now on. Nothing to do.", word=word)
    session.facts["cancelled_message"] = text
    if not text:
        return amber(
            "It says of a cancelled mission only {word}",
            "A mission that somebody cancels at the robot is shown as failed.",
            word=word,
        )
    if text.startswith(USER_REQUEST) and not _is_unknown(word):
        return green("A cancelled mission says so: {text}", text=text)
    return amber(
        "A cancelled mission is {word} and says: {text}",
        "The app knows it from now on. Nothing to do.",
        word=word,
        text=text,
    )


def _failures(session: CheckUpSession, cancelled: str) -> list[parse.Object]:
    """Earlier failed items of its queue, the newest first. Completed and cancelled ones are not evidence."""
    others = [word for word, state in session.facts["item_states"].items() if state in ("Done", CANCELLED)]
    return [
        entry
        for entry in session.entries
        if entry.get("finished")
        and resolve(entry.get("message")) not in ("", cancelled)
        and parse.queue_state(entry) in (QueueState.ABORTED, QueueState.UNKNOWN)
        and entry.get("state") not in others
    ]


def _failed(session: CheckUpSession, _result: TrialResult) -> Found:
    if failures := _failures(session, session.facts.get("cancelled_message") or USER_REQUEST):
        return green("Its newest failed mission says: {text}", text=clean(resolve(failures[0].get("message")), 120))
    return green(
        "Its text for a failed mission was not tried, as that would stop the robot with an error",
        "The first one that fails is shown with the robot's own text.",
    )


def _priority(session: CheckUpSession, result: TrialResult) -> Found:
    first, second = (
        parse.instant(item.now.get("started")) if item else None for item in (result.items[0], result.preferred)
    )
    if not result.waits_in_pause or first is None or second is None or first == second:
        return green("It could not be seen whether priority has an effect", "The app does not rely on it.")
    session.facts["priority_counts"] = second < first
    if second < first:
        return green(
            "A mission of higher priority begins before earlier ones",
            "Missions that others queue with a higher priority go before the plan.",
        )
    return green(
        "Priority has no effect: missions begin in the order in which they were queued",
        "Which start goes first is decided in the app.",
    )


def _second(_session: CheckUpSession, result: TrialResult) -> Found | None:
    first, again = result.items[0], result.second
    if again is None:
        return None
    if again.is_good and any(item.token == first.token and item.id != first.id for item in result.items):
        return green(
            "The same order sent twice makes two missions",
            "That is why the app looks into the queue before it sends a start again.",
        )
    return green(
        "The same order sent twice makes one mission"
        if again.is_good
        else "It refuses the same order sent twice: {problem}",
        "The app still looks first.",
        problem=again.problem,
    )


def _pause(result: TrialResult) -> Found | None:
    if result.pause_problem is not None:
        return amber(
            "It can't be paused: {problem}",
            "The app's Pause and Resume have no effect on it: give the user more rights on the robot.",
            problem=result.pause_problem.message,
        )
    if result.runs_on is False and all(parse.queue_state(item.now) is not QueueState.PENDING for item in result.items):
        return amber(
            "A paused mission does not continue when the robot is resumed",
            "After Pause and Resume a run counts as failed: start it again.",
        )
    if result.waits_in_pause:
        return green(
            "While it is paused, missions wait. The running one continues afterwards"
            if result.runs_on
            else "While it is paused, missions wait. They were too short to see whether a running one continues"
        )
    return None


TRIED = (  # in the order of the report
    (Topic.RECOGNISED, recognised),
    (Topic.WORDS, _words),
    (Topic.CANCELLED, _cancelled),
    (Topic.FAILED, _failed),
    (Topic.PRIORITY, _priority),
    (Topic.SECOND, _second),
)
