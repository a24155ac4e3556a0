"""Texts of putting all robots on hold, or one: why and until when. Pure."""

from __future__ import annotations

from collections.abc import Collection
from datetime import datetime, time, timedelta
from zoneinfo import ZoneInfo

from app.i18n import _
from app.screens.common import formats
from app.screens.common.robot_appearance import robot_option
from app.screens.scheduler.facts import SchedulerFacts
from app.widgets.items import Option

ALL = 0  # key of all robots
HOUR, DAY, CHOSEN, OPEN = "hour", "day", "chosen", "open"


def reasons() -> dict[str, str]:
    """As they are stored, in English, and in the present language."""
    return {"Maintenance": _("Maintenance"), "Audit": _("Audit"), "Cleaning": _("Cleaning")}


def reason_chips(typed: str) -> list[Option]:
    return [Option(key, text, selected=typed.strip() == text) for key, text in reasons().items()]


def reason_of(typed: str) -> str:
    """As it is stored."""
    plain = " ".join(typed.split())
    return next((key for key, text in reasons().items() if text == plain), plain)


def end_chips(chosen: str, until: datetime | None, zone: str, now: datetime) -> list[Option]:
    at = (
        _("Until {time}").format(time=formats.day_or_time(until, zone, now))
        if chosen == CHOSEN and until
        else _("Until a time")
    )
    texts = {HOUR: _("1 hour"), DAY: _("Rest of the day"), CHOSEN: at, OPEN: _("No end")}
    return [Option(key, text, selected=key == chosen) for key, text in texts.items()]


def end_of(choice: str, chosen: datetime | None, zone: str, now: datetime) -> datetime | None:
    """UTC; None: no end. ``chosen`` is the time picked for CHOSEN."""
    match choice:
        case "hour":
            return now + timedelta(hours=1)
        case "day":
            local = now.astimezone(ZoneInfo(zone))
            return datetime.combine(local.date() + timedelta(days=1), time(), ZoneInfo(zone)).astimezone(now.tzinfo)
        case "chosen":
            return chosen
    return None


def robot_name(facts: SchedulerFacts, robot_id: int) -> str:
    robot = facts.robot(robot_id)
    return robot.name if robot else _("All robots")


def looked_at(facts: SchedulerFacts, shown: Collection[int]) -> int:
    """The first choice: the only robot ``shown`` in the plan, else all of them."""
    only = facts.robot(next(iter(shown))) if len(shown) == 1 and len(facts.robots) > 1 else None
    return only.id if only is not None else ALL


def robot_options(facts: SchedulerFacts) -> list[Option]:
    return [
        Option(ALL, _("All robots"), "robot-outline"),
        *map(robot_option, facts.robots),
    ]


def what_follows(facts: SchedulerFacts, robot_id: int) -> str:
    """What will happen to the starts; others of a group can stand in for a robot."""
    text = _("Starts wait. Those too late by then are not run. Running missions continue.")
    shares = any(robot_id in group.members and len(group.members) > 1 for group in facts.groups)
    return text + " " + _("Starts for a group go to its other robots.") if shares else text


def held_message(robot: str | None, until: datetime | None, zone: str, now: datetime) -> str:
    """What is said when it has been set."""
    who = robot or _("All robots")
    if until is None:
        return _("{robot} on hold").format(robot=who)
    return _("{robot} on hold until {time}").format(robot=who, time=formats.day_or_time(until, zone, now))
