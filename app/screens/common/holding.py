"""Holds in words: which hold stops a start, and until when. Pure."""

from __future__ import annotations

from collections.abc import Hashable, Iterable, Sequence
from datetime import datetime

from app.database.robots import Hold
from app.domain import rules
from app.domain.execution import Execution, State, Wait
from app.domain.models import Group, Robot, Settings
from app.domain.reasons import naming_robot, waiting_sentence
from app.i18n import _
from app.screens.common import formats
from app.services.planning.planned import PlannedRun

HAND = "hand-back-right-outline"


def about_hold(robot_id: int | None) -> Hashable:
    """The subject of messages about a hold of that robot, or of all of them (None), or its release."""
    return "hold", robot_id


def hold_at(holds: Iterable[Hold], robot_id: int | None, at: datetime) -> Hold | None:
    """The hold that stops a start on that robot at that instant: of several, the one that ends last."""
    return max((hold for hold in holds if hold.covers(robot_id, at)), key=_end, default=None)


def _end(hold: Hold) -> tuple[bool, float]:
    return hold.until is None, hold.until.timestamp() if hold.until is not None else 0.0


def until_words(hold: Hold, settings: Settings, now: datetime) -> str:
    if hold.until is None:
        return _("on hold")
    return _("on hold until {time}").format(time=formats.day_or_time(hold.until, settings.timezone, now))


def hold_for(
    holds: Sequence[Hold], robot_id: int | None, group: Group | None, robots: Iterable[Robot], at: datetime
) -> Hold | None:
    """The hold that stops a start on that robot at that instant or, with a group, on all of its robots: of these, the
    one that ends first."""
    if group is None:
        return hold_at(holds, robot_id, at)
    found = [hold_at(holds, robot.id, at) for robot in robots if robot.id in group.members and robot.enabled]
    kept = [hold for hold in found if hold is not None]
    return min(kept, key=_end, default=None) if len(kept) == len(found) else None


def hold_of_run(holds: Sequence[Hold], run: PlannedRun, robots: Iterable[Robot]) -> Hold | None:
    """The hold that stops a planned start at its instant: of its robot, of all robots of its group, or of this start
    alone."""
    return Hold() if run.held else hold_for(holds, run.robot.id, run.group, robots, run.at)


def held_until(hold: Hold | None, closes_at: datetime) -> datetime | None:
    """When a held start is sent; None: it is skipped when its start window closes, unless somebody releases it
    before."""
    return hold.until if hold is not None and hold.until is not None and hold.until < closes_at else None


def run_words(
    hold: Hold | None, silent: Robot | None, closes_at: datetime, zone: str, now: datetime
) -> tuple[str, str] | None:
    """Text and icon of the button if the mission can't be sent at once, because of a hold or a silent robot."""
    if hold is not None:
        until = held_until(hold, closes_at)
        text = (
            _("Queue, on hold")
            if until is None
            else _("Queue, on hold until {time}").format(time=formats.day_or_time(until, zone, now))
        )
        return text, HAND
    return (_("Send when {robot} answers").format(robot=silent.name), "timer-sand") if silent is not None else None


def waiting_words(execution: Execution, zone: str, hold: Hold | None = None) -> str:
    """What an open execution waits for. ``hold`` is its hold, if known: its end decides what happens to the
    execution."""
    if execution.state is not State.WAITING or execution.wait is not Wait.HOLD or (hold is None and not execution.held):
        return waiting_sentence(naming_robot(execution), zone, _)
    reason = hold.reason if hold is not None else str(execution.wait_details.get("hold", ""))
    why = reason and _(reason)
    if not execution.held and (until := held_until(hold, execution.closes_at)) is not None:
        words = _("On hold until {time}").format(time=formats.clock_time(until, zone))
        return f"{words}: {why}" if why else words
    text = _("On hold, not run from {time}: {hold}") if why else _("On hold, not run from {time}")
    return text.format(hold=why, time=formats.clock_time(execution.closes_at, zone))


def held_note(hold: Hold | None, at: datetime, window_minutes: int | None, settings: Settings, now: datetime) -> str:
    """Until when a start at that instant is held, and whether it is too late then; empty without a hold.
    ``window_minutes`` None: as in Settings."""
    if hold is None:
        return ""
    if hold.until is None or not _is_too_late(hold, at, window_minutes, settings):
        return until_words(hold, settings, now)
    return _("not run: on hold until {time}").format(time=formats.day_or_time(hold.until, settings.timezone, now))


def held_word(hold: Hold | None, at: datetime, window_minutes: int | None, settings: Settings) -> str:
    """``held_note`` as one word."""
    if hold is None:
        return ""
    return _("not run") if _is_too_late(hold, at, window_minutes, settings) else _("on hold")


def _is_too_late(hold: Hold, at: datetime, window_minutes: int | None, settings: Settings) -> bool:
    return hold.until is not None and rules.closes_at(at, window_minutes, settings) <= hold.until


def about_start(execution_id: int) -> Hashable:
    """The subject of messages about that start: a newer message replaces the older one."""
    return "start", execution_id
