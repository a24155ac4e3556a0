"""The reason for an execution's end or wait: stored as a code and values, shown as one sentence. docs/interfaces.md
lists the codes.

Nothing here ever fails: a row of an older version, or one whose details are missing or odd, still gets a sentence.
"""

from __future__ import annotations

import math
import re
from collections.abc import Mapping, Sequence
from dataclasses import replace
from datetime import datetime, tzinfo
from types import MappingProxyType
from typing import Any
from zoneinfo import ZoneInfo

from app.domain import writing
from app.domain.execution import Execution, Reason, ReasonCode, State, Wait
from app.domain.message import decimal, is_message, render
from app.domain.writing import Translate

Template = tuple[tuple[str, ...], str]  # the details it needs, and the English text

# The first template with known details is used; the last one of each code needs none.
_TEMPLATES: Mapping[ReasonCode, Sequence[Template]] = MappingProxyType(
    {
        ReasonCode.ROBOT_ABORTED: (
            (("message",), "The robot ended it: {message}"),
            (("fleet",), "It was stopped at the fleet, or it failed: the fleet doesn't say which"),
            ((), "The robot ended it without saying why"),
        ),
        ReasonCode.RETRY_LIMIT: (
            (("attempts", "problem"), "Given up at attempt {attempts}: {problem}"),
            (("attempts",), "Given up at attempt {attempts}"),
            ((), "Given up after too many attempts"),
        ),
        ReasonCode.WINDOW_CLOSED: (
            (
                ("attempts", "until", "problem"),
                "Its start window closed at {until} after attempt {attempts}: {problem}",
            ),
            (("until", "problem"), "Its start window closed at {until}: {problem}"),
            (("until",), "Its start window closed at {until} before it could be sent"),
            ((), "Its start window closed before it could be sent"),
        ),
        ReasonCode.UNAUTHORIZED: (((), "Access was refused: enter the password or key again in Settings"),),
        ReasonCode.UNKNOWN_MISSION: (
            (("mission",), "There is no mission {mission}: choose another or create it"),
            ((), "There is no such mission: choose another or create it"),
        ),
        ReasonCode.REFUSED: ((("problem",), "It was refused: {problem}"), ((), "It was refused")),
        ReasonCode.WRONG_ROBOT: (
            (("fleet", "found", "expected"), "Another fleet answered at this address: {found} instead of {expected}"),
            (
                ("found", "expected"),
                "Another robot answered at this address: serial number {found} instead of {expected}",
            ),
            ((), "Another robot answered at this address"),
        ),
        ReasonCode.VANISHED: (
            (("fleet",), "The fleet no longer has this order"),
            (("queue_id",), "The robot no longer has queue item {queue_id}"),
            ((), "It is no longer in the queue"),
        ),
        ReasonCode.UNKNOWN_OUTCOME: (
            (("problem",), "It is not known whether it arrived: {problem}"),
            ((), "It is not known whether it arrived"),
        ),
        ReasonCode.NO_ROBOT: (
            (("until", "group"), "No robot of {group} could be asked until {until}"),
            ((), "No robot of its group could be asked"),
        ),
        ReasonCode.USER_CANCELLED: (
            (("fleet",), "Cancelled at the fleet before it began"),
            ((), "Cancelled by a person"),
        ),
        ReasonCode.QUEUE_CLEARED: (((), "Cancelled with the robot's whole queue"),),
        ReasonCode.SCHEDULE_CHANGED: (
            (("idle",), "The idle mission was changed or switched off while it waited"),
            (("deleted",), "Its schedule was deleted while it waited"),
            (("switched_off",), "Its schedule was switched off while it waited"),
            (("changed",), "Its schedule was changed while it waited"),
            ((), "Its schedule was changed, switched off or deleted while it waited"),
        ),
        ReasonCode.ROBOT_REMOVED: (
            (("robot",), "Robot {robot} is switched off or was removed"),
            (("removed",), "The group {removed} was removed"),
            (("group",), "No robot of {group} is switched on"),
            (("others",), "No other robot of {others} is switched on"),
            ((), "The robot is switched off or was removed"),
        ),
        ReasonCode.BATTERY_LOW: (
            (("battery", "minimum", "until"), "Battery {battery} % stayed under {minimum} % until {until}"),
            (("minimum", "until"), "Battery unknown until {until}, at least {minimum} % needed"),
            (("minimum",), "Battery stayed under {minimum} % for its whole start window"),
            ((), "Battery stayed under the minimum for its whole start window"),
        ),
        ReasonCode.OVERLAP: (
            (("planned_at",), "The run planned for {planned_at} had not ended"),
            (("idle",), "Not needed now: the robot was used, something is planned soon, or it is a day off"),
            ((), "Its previous run had not ended"),
        ),
        ReasonCode.HOLD: (
            (("hold", "until"), "On hold until its start window closed on {until_with_date}: {hold}"),
            (("until",), "On hold until its start window closed on {until_with_date}"),
            (
                ("starts", "dates", "paused_until"),
                "{starts} starts were not run, {dates}: the schedule was paused until {paused_until_with_date}",
            ),
            (("paused_until",), "The schedule was paused until {paused_until_with_date}"),
            (("skipped_at",), "Skipped by a person on {skipped_at_with_date}"),
            ((), "Skipped or put on hold by a person"),
        ),
        ReasonCode.FINISH_BY: (
            (("finish_by",), "It could not be done by {finish_by}"),
            ((), "It could not be done in time"),
        ),
        ReasonCode.PLACE_BUSY: (
            (("place", "until"), "{place} was full until {until}"),
            ((), "A place that it uses stayed full"),
        ),
        ReasonCode.APP_DOWN: (
            (("starts", "dates", "problem"), "Missed {starts} starts, {dates}: nothing could be written ({problem})"),
            (("starts", "dates"), "Missed {starts} starts, {dates}: the app was off or asleep"),
            (("start", "end", "problem"), "Nothing could be written from {start} to {end}: {problem}"),
            (("start", "end"), "The app was off or asleep from {start} to {end}"),
            (("until",), "The app was off or asleep until its start window closed at {until}"),
            ((), "The app was off or asleep"),
        ),
        ReasonCode.CLOCK_IMPLAUSIBLE: (
            (("starts", "dates"), "Missed {starts} starts, {dates}: the tablet's clock could not be trusted"),
            (("start", "end"), "The tablet's clock could not be trusted from {start} to {end}"),
            (("until",), "The tablet's clock could not be trusted until its start window closed at {until}"),
            ((), "The tablet's clock could not be trusted"),
        ),
    }
)

_WAITS: Mapping[Wait, Sequence[Template]] = MappingProxyType(
    {
        Wait.DUE: (((), "Is being sent"),),
        Wait.RETRY: (
            (("attempts", "problem"), "Attempt {attempts} failed, trying again until {closes_at}: {problem}"),
            ((), "The last attempt failed, trying again until {closes_at}"),
        ),
        Wait.BATTERY: (
            (("battery", "minimum"), "Battery {battery} % is under {minimum} %, waits until {closes_at}"),
            (("minimum",), "Battery unknown, at least {minimum} % needed, waits until {closes_at}"),
            ((), "Battery under the minimum, waits until {closes_at}"),
        ),
        Wait.HOLD: (
            (("hold",), "On hold: {hold}, waits until {closes_at}"),
            ((), "On hold, waits until {closes_at}"),
        ),
        Wait.LATE_START: (((), "Starts late because the app was off, can still be put on hold"),),
        Wait.CLOCK: (((), "The tablet's clock can't be trusted, waits until {closes_at}"),),
        Wait.CHECK_UP: (
            (
                ("fleet", "user"),
                "Another fleet with the user {user} could get it: give the app a user of its own at {fleet}, waits until {closes_at}",
            ),
            (("fleet",), "The fleet {fleet} has to be checked up first, waits until {closes_at}"),
            ((), "Its fleet has to be checked up first, waits until {closes_at}"),
        ),
        Wait.ROBOT: (
            (("before",), "Waits for the end of the start of {before}, until {closes_at}"),
            (("group",), "Waits for a robot of {group} until {closes_at}"),
            (("robot",), "Waits until {robot} is free, until {closes_at} at the latest"),
            ((), "Waits for a robot until {closes_at}"),
        ),
        Wait.PLACE: (
            (("place", "robot", "until"), "Waits for {place}: {robot} uses it until about {until}"),
            (("place", "robot"), "Waits for {place}, which {robot} uses, until {closes_at}"),
            (("place",), "Waits for {place} until {closes_at}"),
            ((), "Waits for a place until {closes_at}"),
        ),
        Wait.ELSEWHERE: (
            (("robots",), "May have run already, waits until {closes_at} for an answer from {robots}"),
            ((), "Robots are being asked whether it has run already, waits until {closes_at}"),
        ),
    }
)

_ANSWERED: Sequence[Template] = (
    (("answer",), "Asking whether it has arrived: {answer}"),
    ((), "Asking whether it has arrived"),
)
_UNDER_WAY: Mapping[State, str] = MappingProxyType(
    {
        State.SUBMITTING: "Asking whether it has arrived",
        State.QUEUED: "Sent, waits its turn",
        State.EXECUTING: "Running on the robot",
    }
)

_INSTANTS = frozenset(
    {"until", "paused_until", "skipped_at", "start", "end", "planned_at", "closes_at", "finish_by", "before"}
)
_FILLED_IN = re.compile(r"\{\w+\}")
_LONGEST = 400  # characters of a text that came from elsewhere


def sentence(reason: Reason, zone: tzinfo | str, translate: Translate = lambda text: text) -> str:
    """One sentence; ``zone`` is the one its times are given in."""
    return _filled_in(_TEMPLATES[reason.code], reason.details, zone, translate)


def naming_robot(execution: Execution) -> Execution:
    """With the name of its robot in the place of the address at which an attempt failed."""
    reason = execution.reason and Reason(execution.reason.code, at_robot(execution.reason.details, execution.robot))
    return replace(execution, reason=reason, wait_details=at_robot(execution.wait_details, execution.robot))


def at_robot(details: Mapping[str, Any], robot: str) -> Mapping[str, Any]:
    """The same with its name instead of an address, unless it says that the address is a fleet's."""
    if not robot or not address_in(details) or "fleet" in (problem := details["problem"])["msgid"]:
        return details
    return {**details, "problem": {**problem, "params": {**problem["params"], "address": robot}}}


def address_in(details: Mapping[str, Any]) -> str:
    """Of the robot or fleet that a failed attempt was made at; empty if it is in none."""
    problem = details.get("problem")
    params = problem.get("params") if is_message(problem) else None
    address = params.get("address") if isinstance(params, Mapping) else None
    return address if isinstance(address, str) else ""


def codes_with(text: str, translate: Translate = lambda text: text) -> tuple[ReasonCode, ...]:
    """Codes with ``text`` in one of their sentences, ignoring case and filled-in values."""
    wanted = text.casefold()
    return tuple(
        code
        for code, templates in _TEMPLATES.items()
        if any(
            wanted in part.casefold()
            for _needed, template in templates
            for part in _FILLED_IN.split(translate(template))
        )
    )


def to_store(reason: Reason) -> dict[str, Any]:
    """To store in the details of something else; ``stored_sentence`` makes its sentence."""
    return {"code": str(reason.code), "details": dict(reason.details)}


def stored_sentence(stored: Mapping[str, Any], zone: tzinfo | str, translate: Translate = lambda text: text) -> str:
    """The sentence of ``to_store``; the code itself when this version does not know it."""
    details = stored.get("details")
    try:
        return sentence(
            Reason(ReasonCode(str(stored.get("code"))), details if isinstance(details, Mapping) else {}),
            zone,
            translate,
        )
    except ValueError:
        return str(stored.get("code"))


def waiting_sentence(
    execution: Execution, zone: tzinfo | str | None = None, translate: Translate = lambda text: text
) -> str:
    """What an open execution waits for, in its own zone unless another is given; empty for an ended one."""
    if execution.state is State.WAITING:
        details = {**execution.wait_details, "attempts": execution.attempts, "closes_at": execution.closes_at}
        return _filled_in(_WAITS[execution.wait], details, zone or execution.timezone, translate)
    if execution.state is State.SUBMITTING and execution.cancel_code is not None:
        return translate("Not sent again, and cancelled there if it has arrived")
    if execution.state is State.SUBMITTING and execution.withdrawn is not None:
        return translate("Not sent again, asking whether it has arrived")
    if execution.state is State.SUBMITTING and "answer" in execution.wait_details:
        return _filled_in(_ANSWERED, execution.wait_details, zone or execution.timezone, translate)
    return translate(_UNDER_WAY[execution.state]) if execution.state in _UNDER_WAY else ""


def _filled_in(
    templates: Sequence[Template], details: Mapping[str, Any], zone: tzinfo | str, translate: Translate
) -> str:
    known = _known(details, known_zone(zone), translate)
    text = next(
        (text for needed, text in templates if all(name in known or _is_flag(name, details, text) for name in needed)),
        templates[-1][1],
    )
    return translate(text).format_map(writing.Dashes(known))


def _is_flag(name: str, details: Mapping[str, Any], text: str) -> bool:
    """Whether a detail is a flag and not filled in."""
    return details.get(name) is True and f"{{{name}" not in text


def _known(details: Mapping[str, Any], zone: tzinfo, translate: Translate) -> dict[str, str]:
    """The details that can be shown, as text. Times have their date with them when they lie on different days, or as ``…_with_date``."""
    instants = _instants(details, zone)
    known = {f"{name}_with_date": writing.end_in_words(instant, translate) for name, instant in instants.items()}
    known |= instants_in_words(details, zone, translate)
    for name, value in details.items():
        value = render(value, translate) if is_message(value) else value
        if name not in _INSTANTS and (text := _text(value, translate)) and (name, value) != ("attempts", 0):
            known[str(name)] = (
                translate(text) if name == "hold" else text
            )  # those that are offered are known by their English word
    first, last, starts = (details.get(name) for name in ("first", "last", "starts"))
    if (begin := instant_of(first, zone)) and (end := instant_of(last, zone)) and isinstance(starts, int):
        known |= {"dates": writing.span(begin, end, translate), "starts": writing.count(starts, translate)}
    return known


def instants_in_words(
    details: Mapping[str, Any], zone: tzinfo | str, translate: Translate = lambda text: text
) -> dict[str, str]:
    """The details that are instants, as wall time of ``zone``: with the date when they lie on different days."""
    instants = _instants(details, known_zone(zone))
    is_one_day = len({instant.date() for instant in instants.values()}) == 1
    in_words = writing.time_of_day if is_one_day else writing.day_and_time
    return {name: in_words(instant, translate) for name, instant in instants.items()}


def _instants(details: Mapping[str, Any], zone: tzinfo) -> dict[str, datetime]:
    return {name: instant for name in _INSTANTS if (instant := instant_of(details.get(name), zone)) is not None}


def _text(value: object, translate: Translate) -> str:
    """Numbers as the language writes them, without needless decimals, texts on one line; empty if there is nothing to
    show."""
    if value is None or isinstance(value, bool):
        return ""
    if isinstance(value, float):
        return "" if not math.isfinite(value) else decimal(f"{value:.1f}".removesuffix(".0"), translate)
    text = " ".join(str(value).split())
    return text if len(text) <= _LONGEST else text[:_LONGEST] + "…"


def instant_of(value: object, zone: tzinfo) -> datetime | None:
    """In that zone; None without an instant."""
    try:
        instant = value if isinstance(value, datetime) else datetime.fromisoformat(str(value))
        return instant.astimezone(zone) if instant.tzinfo else None
    except (ValueError, OverflowError):
        return None


def known_zone(zone: tzinfo | str) -> tzinfo:
    if isinstance(zone, tzinfo):
        return zone
    try:
        return ZoneInfo(zone)
    except (KeyError, ValueError, OSError):  # a zone that this system does not know
        return ZoneInfo("UTC")
