"""A check-up's report for people, as text, and as a file: what the robot was found to be, without secrets.

The file is a profile of ``python -m mir_sim --profile FILE``: a simulated robot that behaves as this one was found to.
"""

from __future__ import annotations

import json
import re
from collections.abc import Callable, Mapping
from dataclasses import asdict
from typing import Any
from zoneinfo import ZoneInfo

from app.domain.check_up import Finding, Level, Report, RobotProfile, Topic
from app.domain.message import Message, message, render
from app.mir.robot_vocabulary import USER_REQUEST

Language = Callable[[str], str]  # a text in it, from English

# For people. Of a robot's topics, in the report's order.
TOPICS: Mapping[Topic, Message] = {
    Topic.IDENTITY: message("Who it is"),
    Topic.SOFTWARE: message("Software"),
    Topic.RIGHTS: message("Rights"),
    Topic.PASSWORD: message("Password"),
    Topic.CERTIFICATE: message("Encryption"),
    Topic.BATTERY: message("Battery"),
    Topic.CLOCK: message("Clock"),
    Topic.LANGUAGE: message("Language"),
    Topic.MISSIONS: message("Missions"),
    Topic.MAPS: message("Maps"),
    Topic.QUEUE: message("Mission queue"),
    Topic.SEARCH: message("Searching"),
    Topic.PAGING: message("Lists"),
    Topic.SORTING: message("Order of lists"),
    Topic.OTHERS: message("Other users"),
    Topic.LATENCY: message("Answer time"),
    Topic.LOAD: message("Load"),
    Topic.ORDER: message("Taking a mission"),
    Topic.RECOGNISED: message("Recognising a mission"),
    Topic.WORDS: message("Words"),
    Topic.CANCELLED: message("Cancelling"),
    Topic.FAILED: message("Failing"),
    Topic.PRIORITY: message("Priority"),
    Topic.SECOND: message("Sent twice"),
    Topic.PAUSE: message("Pause"),
    Topic.LEFT: message("Afterwards"),
}
LEVELS: Mapping[Level, Message] = {
    Level.GREEN: message("Fine"),
    Level.AMBER: message("Note"),
    Level.RED: message("Problem"),
}
DEFINITIONS = {(2, 0): "2.14.7", (3, 0): "3.5.4", (3, 8): "3.8.1"}  # the simulator's, each from that software on
OFFLINE_S = 40.0  # that a robot boots, where only that it does is known
SMALL_OFFSET_S = 2.0  # of clocks: not more than the resolution of robots' times
LARGEST_OFFSET_S = 1e6  # that the simulator takes
# Usual fields of items, to which a simulated robot can't move the description.
ITEM_FIELDS = frozenset(
    {
        "actions",
        "allowed_methods",
        "control_posid",
        "control_state",
        "created_by",
        "created_by_id",
        "created_by_name",
        "fleet_schedule_guid",
        "finished",
        "id",
        "message",
        "mission",
        "mission_id",
        "ordered",
        "parameters",
        "priority",
        "started",
        "state",
        "url",
    }
)


def heading(report: Report, zone: str, language: Language = str) -> list[str]:
    """Lines: which robot, when, and how it was checked up."""
    at = report.began_at.astimezone(ZoneInfo(zone))
    profile = report.profile
    lines = [
        message("Check-up of {robot}", robot=report.robot),
        message("Software {software}, at {address}", software=profile.software or "?", address=report.address)
        if report.of_fleet and profile.software
        else message(
            "{model}, serial number {number}, software {software}, at {address}",
            model=report.model or "?",
            number=profile.serial_number or "?",
            software=profile.software or "?",
            address=report.address,
        )
        if not report.of_fleet and (report.model or profile.serial_number or profile.software)
        else message("At {address}. It did not report what it is", address=report.address),
        message(
            "{time} ({zone}), it took {seconds} s", time=f"{at:%Y-%m-%d %H:%M}", zone=zone, seconds=round(report.took_s)
        ),
        message("Tried with the mission {mission}", mission=report.mission)
        if report.mission
        else message("Only read: no mission was queued"),
    ]
    if not report.is_complete:
        lines.append(message("It is not complete"))
    return [render(line, language) for line in lines]


def text(report: Report, zone: str, language: Language = str) -> str:
    """Plain text: problems first, each finding with its meaning."""
    lines = heading(report, zone, language)
    for level in (Level.RED, Level.AMBER, Level.GREEN):
        findings = [finding for finding in report.findings if finding.level is level]
        lines += ["", render(LEVELS[level], language)] if findings else []
        for finding in findings:
            means = render(finding.means, language)
            lines.append(f"- {render(TOPICS[finding.topic], language)}: {_sentence(finding, language)}")
            lines += [f"  {means}"] if means else []
    return "\n".join(lines) + "\n"


def document(report: Report, zone: str) -> str:
    """The file: keys of a simulated robot's profile (of a fleet none), and under ``report`` everything that was found."""
    known = {
        **asdict(report.profile),
        "ignores": None if report.profile.ignores is None else sorted(report.profile.ignores),
    }
    findings = [
        {"topic": each.topic, "level": each.level, "says": render(each.says), "means": render(each.means)}
        for each in report.findings
    ]
    found = {
        "robot": report.robot,
        "address": report.address,
        "began_at": report.began_at.isoformat(timespec="seconds"),
        "took_s": round(report.took_s, 1),
        "mission": report.mission,
        "is_complete": report.is_complete,
        "level": report.level,
        "findings": findings,
        "profile": known,
        "text": text(report, zone),
    }
    simulated = {} if report.of_fleet else _simulated(report)
    return json.dumps({**simulated, "report": found}, ensure_ascii=False, indent=1) + "\n"


def _simulated(report: Report) -> dict[str, Any]:
    """The known facts in the simulator's terms; unknown ones are as on its faithful robot."""
    found = report.profile
    values: dict[str, Any] = {
        "about": f"{report.robot}, as it was found on {report.began_at:%Y-%m-%d}.",
        "software": _definition(found.software),
        "model": report.model or None,
        "timezone": found.timezone,
        "clock_offset": _offset(found.clock_offset),
        "search": found.has_search,
        "ignores": sorted(found.ignores) if found.ignores else None,
        "page_limit": found.page_limit or None,
        "fields": {"order": ["state"]} if found.gives_id is False else None,
        "order_status": found.order_status,
        **_description(found),
        "item_states": {state: word for word, state in found.item_states.items() if word} or None,
        "texts": {USER_REQUEST: found.cancelled_message}
        if found.cancelled_message not in (None, "", USER_REQUEST)
        else None,
        "latency": [round(found.latency[0], 3), round(found.latency[3], 3)] if found.latency else None,
        "reboots": {"requests": found.rest.requests, "within_seconds": found.rest.seconds, "offline_seconds": OFFLINE_S}
        if found.rest
        else None,
    }
    return {name: value for name, value in values.items() if value is not None}


def _offset(seconds: float | None) -> float | None:
    if seconds is None or abs(seconds) <= SMALL_OFFSET_S:
        return None
    return max(-LARGEST_OFFSET_S, min(LARGEST_OFFSET_S, seconds))


def _description(found: RobotProfile) -> dict[str, str]:
    if found.token_field == "":
        return {"description_text": ""}
    is_usual = found.token_field in (None, "description", *ITEM_FIELDS)
    return {} if is_usual else {"description_field": str(found.token_field)}


def _definition(software: str | None) -> str | None:
    """The simulator's software that is nearest to it."""
    found = re.match(r"(\d{1,4})\.(\d{1,4})(?![^.])", software or "")
    version = tuple(map(int, found.groups())) if found else ()
    return next((name for since, name in reversed(DEFINITIONS.items()) if version >= since), None)


def _sentence(finding: Finding, language: Language) -> str:
    says = render(finding.says, language)
    return says if says.endswith((".", "…", "?", "!")) else f"{says}."
