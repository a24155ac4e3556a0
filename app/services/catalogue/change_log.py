"""Log lines about changes: before and after. Names come from people, files and robots: each is quoted and escaped."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from datetime import datetime
from enum import StrEnum
from typing import Any

from app.domain.models import Between, DayException, Fleet, Group, IdleRule, Mission, Robot, Schedule
from app.services.catalogue.fields import FLEET, MISSION, ROBOT, SCHEDULE, attributes

_OF_ROBOT = (*attributes(ROBOT), "needs_password", "serial_number")
_OF_FLEET = (*attributes(FLEET), "needs_password", "identity")
_OF_MISSION = (*attributes(MISSION), "charges")
_OF_SCHEDULE = ("name", *attributes(SCHEDULE))


def differences(before: Mapping[str, object], after: Mapping[str, object]) -> str:
    """ "name 'Aino' → 'Alma', enabled yes → no"; empty without differences."""
    return ", ".join(
        f"{name} {shown(before[name])} → {shown(value)}" for name, value in after.items() if before[name] != value
    )


def parts(whole: object, names: Iterable[str]) -> dict[str, object]:
    return {name: getattr(whole, name) for name in names}


def change_of_robot(before: Robot | Fleet, after: Robot | Fleet) -> str:
    """Of a password only that there is another one."""
    names = _OF_ROBOT if isinstance(after, Robot) else _OF_FLEET
    changed = [differences(parts(before, names), parts(after, names))]
    if before.token and after.token and before.token != after.token:
        changed.append("another password")
    return ", ".join(filter(None, changed))


def of_mission(mission: Mission, only: Robot | None) -> dict[str, object]:
    return parts(mission, _OF_MISSION) | {"robot": only and only.name}


def of_schedule(schedule: Schedule, robot: Robot | Group, mission: Mission) -> dict[str, object]:
    return parts(schedule, _OF_SCHEDULE) | {"robot": robot.name, "mission": mission.name}


def of_idle_rule(rule: IdleRule | None, mission: Mission | None) -> dict[str, object]:
    """None: there is none."""
    return {
        "mission": mission and mission.name,
        "after_minutes": rule and rule.after_minutes,
        "enabled": rule and rule.enabled,
    }


def days(exception: DayException) -> str:
    """ "days off 'Audit' 2026-11-23–2026-11-24"."""
    last = "" if exception.last_day == exception.first_day else f"–{exception.last_day}"
    return (
        f"{'extra working days' if exception.is_working else 'days off'} {exception.name!r} {exception.first_day}{last}"
        f"{' of each year' if exception.yearly else ''}"
    )


def moment(at: datetime) -> str:
    return at.isoformat(timespec="minutes")


def shown(value: Any) -> str:
    if value is None or value == "":
        return "none"
    if isinstance(value, bool):
        return "yes" if value else "no"
    if isinstance(value, datetime):
        return moment(value)
    if isinstance(value, Between):
        return f"{value.start:%H:%M}–{value.end:%H:%M}"
    if isinstance(value, tuple):
        return " ".join(map(str, value)) or "none"
    return str(value) if isinstance(value, StrEnum) else repr(dict(value) if isinstance(value, Mapping) else value)
