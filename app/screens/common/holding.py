"""Holds in words: what keeps a start from being sent, and until when. Pure."""
from __future__ import annotations

from collections.abc import Hashable, Iterable, Sequence
from datetime import datetime

from app.domain import rules
from app.domain.models import Group, Robot, Settings
from app.i18n import _
from app.screens.common import formats
from app.services.live.holds import Hold
from app.services.planning.planned import PlannedRun

HAND = "hand-back-right-outline"


def about_hold(robot_id: int | None) -> Hashable:
    """What a message is about that says a person holds that robot, or all of them (None), or releases it."""
    return "hold", robot_id


def hold_at(holds: Iterable[Hold], robot_id: int | None, at: datetime) -> Hold | None:
    """What keeps a start on that robot from being sent at that instant."""
    return next((hold for hold in holds if hold.covers(robot_id, at)), None)


def until_words(hold: Hold, settings: Settings, now: datetime) -> str:
    if hold.until is None:
        return _("held until released")
    return _("held until {time}").format(time=formats.day_or_time(hold.until, settings.timezone, now))


def state_and_hold(word: str, hold: Hold | None) -> str:
    """A robot's state; nothing is sent to one that is held, whatever it does."""
    return word if hold is None else _("{state}, held").format(state=word)


def hold_for(holds: Sequence[Hold], robot_id: int | None, group: Group | None, robots: Iterable[Robot], at: datetime) -> Hold | None:
    """What keeps a start on that robot or, with a group, on every one of its robots from being sent at that instant: of these the one that
    ends first."""
    if group is None:
        return hold_at(holds, robot_id, at)
    found = [hold_at(holds, robot.id, at) for robot in robots if robot.id in group.members and robot.enabled]
    kept = [hold for hold in found if hold is not None]
    return min(kept, key=lambda hold: (hold.until is None, hold.until), default=None) if len(kept) == len(found) else None


def hold_of_run(holds: Sequence[Hold], run: PlannedRun, robots: Iterable[Robot]) -> Hold | None:
    """What keeps a planned start from being sent at its instant: of a group's from all of its robots; or a person, that one alone."""
    return Hold() if run.kept_back else hold_for(holds, run.robot.id, run.group, robots, run.at)


def held_note(hold: Hold | None, at: datetime, window_minutes: int | None, settings: Settings, now: datetime) -> str:
    """Until when a start at that instant is held, and whether it is too late by then; empty when nothing holds it. ``window_minutes`` None:
    as in Settings."""
    if hold is None:
        return ""
    if hold.until is None or not _is_too_late(hold, at, window_minutes, settings):
        return until_words(hold, settings, now)
    return _("skipped: held until {time}").format(time=formats.day_or_time(hold.until, settings.timezone, now))


def held_next(hold: Hold | None, at: datetime, window_minutes: int | None, settings: Settings, now: datetime) -> str:
    """``held_note`` where nothing else says for when the start is planned."""
    if hold is None:
        return ""
    planned = formats.day_and_time(at, settings.timezone, now)
    if hold.until is None:
        return _("held · next {time} once released").format(time=planned)
    text = _("{time} is skipped: held until {until}") if _is_too_late(hold, at, window_minutes, settings) else \
        _("held until {until} · planned {time}")
    return text.format(time=planned, until=formats.day_or_time(hold.until, settings.timezone, now))


def held_word(hold: Hold | None, at: datetime, window_minutes: int | None, settings: Settings) -> str:
    """``held_note`` as one word."""
    if hold is None:
        return ""
    return _("skipped") if _is_too_late(hold, at, window_minutes, settings) else _("held")


def _is_too_late(hold: Hold, at: datetime, window_minutes: int | None, settings: Settings) -> bool:
    return hold.until is not None and rules.closes_at(at, window_minutes, settings) <= hold.until


def about_start(execution_id: int) -> Hashable:
    """What a message is about that says what is done with that start, or what becomes of it: until the next one does."""
    return "start", execution_id
