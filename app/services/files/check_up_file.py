"""What a check-up found of a robot, as a file without secrets: a profile that the simulator takes (docs/simulator.md). Pure."""
from __future__ import annotations

import json
from typing import Any

from app.domain.check_up import Level, Report, RobotProfile
from app.domain.message import render

DEFINITIONS = ("2.14.7", "3.5.4", "3.8.1")       # softwares that the simulator knows
OFFLINE_S = 60.0                                 # of a robot that boots


def simulator_profile(report: Report) -> str:
    """JSON; what was not found out is left out, and is then as on a faithful robot."""
    profile = report.profile
    found: dict[str, Any] = {
        "about": _about(report), "software": _definition(profile.software), "model": report.model or None, "timezone": profile.timezone,
        "clock_offset": profile.clock_offset, "search": profile.has_search, "ignores": sorted(profile.ignores or ()) or None,
        "page_limit": profile.page_limit or None, "order_status": profile.order_status,
        "fields": {"order": ["state"]} if profile.gives_id is False else None,
        "item_states": {state: word for word, state in profile.item_states.items()} or None,
        "latency": None if profile.latency is None else [profile.latency[0], profile.latency[3]],
        "reboots": None if profile.rest is None else {
            "requests": profile.rest.requests, "within_seconds": profile.rest.seconds, "offline_seconds": OFFLINE_S},
        **_description(profile)}
    return json.dumps({key: value for key, value in found.items() if value is not None}, ensure_ascii=False, indent=1) + "\n"


def _about(report: Report) -> str:
    """When, and what was not in order."""
    found = [f"{finding.topic}: {render(finding.says)}." for finding in report.findings if finding.level is not Level.GREEN]
    software = f" with software {report.profile.software}" if report.profile.software else ""
    return " ".join([f"{report.model or 'A robot'}{software}, as it was found on {report.began_at:%Y-%m-%d}.", *found])


def _definition(software: str | None) -> str | None:
    """The newest that is not newer, as far as its number can be read."""
    def number(version: str) -> list[int]:
        return [int(part) for part in version.split(".") if part.isdecimal()]
    if software is None or not number(software):
        return None
    return max((each for each in DEFINITIONS if number(each) <= number(software)), key=number, default=DEFINITIONS[0])


def _description(profile: RobotProfile) -> dict[str, Any]:
    if profile.token_field == "":
        return {"description_text": ""}
    return {"description_field": profile.token_field}
