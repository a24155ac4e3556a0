"""The form's notes: what may go wrong, one sentence each, and buttons that help. Pure."""

from __future__ import annotations

from collections.abc import Hashable, Iterator, Mapping
from dataclasses import dataclass
from datetime import date, datetime, time, timedelta
from typing import Any
from zoneinfo import ZoneInfo

from app.domain import conflicts
from app.domain.models import InvalidInput
from app.i18n import _
from app.screens.common import formats
from app.screens.scheduler.draft import LAST, SOON, Draft, Kind
from app.screens.scheduler.facts import SchedulerFacts
from app.services.catalogue.preview import Concern, ConcernCode, Forecast
from app.services.planning.sentences import missing_months
from app.widgets.items import Option

LAST_MINUTE = time(23, 59)
MOST_DAYS = 3  # that are left out, by name


@dataclass(frozen=True)
class Preview:
    """What the services answer to a draft: a forecast, or why it can't be saved; and the robot that has not answered."""

    forecast: Forecast | None = None
    problem: InvalidInput | None = None
    silent: str = ""


@dataclass(frozen=True)
class NoteRow:
    """A sentence, and what helps: the keys are fields of the draft and their values. A ``quiet`` one is not a warning."""

    text: str
    remedies: tuple[Option, ...] = ()
    quiet: bool = False


def dated(day: date, today: date) -> str:
    """A day, with its year if it is not the present one."""
    return (
        formats.wall_day(day)
        if day.year == today.year or day - today < timedelta(days=180)
        else formats.wall_day(day, year=True)
    )


def notes(facts: SchedulerFacts, draft: Draft, preview: Preview, problem: str, now: datetime) -> tuple[NoteRow, ...]:
    """Those with a remedy first."""
    if problem:
        remedies = tuple(_ways_out(facts, draft, now))
        return (NoteRow(_("Instead"), remedies),) if remedies else ()
    found = [*_unknown(preview.silent), *_left_out(draft), *_concerns(facts, draft, preview.forecast)]
    return tuple(sorted(found, key=lambda note: (note.quiet, not note.remedies)))


def _ways_out(facts: SchedulerFacts, draft: Draft, now: datetime) -> Iterator[Option]:
    """Of a problem."""
    today = now.astimezone(ZoneInfo(draft.timezone)).replace(tzinfo=None)
    is_closed = draft.respect_working_days and not facts.calendar.is_working_day(draft.day)
    if draft.kind is Kind.ONCE and (is_closed or draft.start <= today):
        after = max(draft.day, today.date() if draft.at > today.time() else today.date() + timedelta(days=1))
        days = (after + timedelta(days=n) for n in range(SOON))
        day = next((day for day in days if not draft.respect_working_days or facts.calendar.is_working_day(day)), None)
        if day is not None:
            yield Option((("day", day),), dated(day, today.date()))
        if is_closed:
            yield anyway()
    elif draft.kind is Kind.EVERY and not draft.all_day and draft.until_time <= draft.at:
        yield Option((("until_time", LAST_MINUTE),), _("Until {time}").format(time=formats.wall_time(LAST_MINUTE)))
        yield Option((("all_day", True),), _("Day and night"))


def anyway() -> Option:
    return Option((("respect_working_days", False),), _("Run anyway"))


def closed_weekdays(facts: SchedulerFacts, draft: Draft) -> list[str]:
    """Of the chosen days, those that are no working days, as long as it respects these."""
    if draft.kind not in (Kind.WEEKLY, Kind.EVERY) or not draft.respect_working_days:
        return []
    return [day for day in draft.weekdays if day not in facts.settings.working_days]


def _unknown(robot: str) -> Iterator[NoteRow]:
    """The parameters of its mission."""
    if robot:
        text = _("{robot} has not said which values this mission needs. Nothing is sent without them")
        yield NoteRow(text.format(robot=robot))


def _left_out(draft: Draft) -> Iterator[NoteRow]:
    """Months that don't have its day."""
    if draft.kind is Kind.MONTHLY and not draft.by_weekday and draft.month_day != LAST:
        words = missing_months(draft.schedule(), _)
        if words:
            yield NoteRow(words[:1].upper() + words[1:], (Option((("month_day", LAST),), _("Last day")),))


def _concerns(facts: SchedulerFacts, draft: Draft, forecast: Forecast | None) -> Iterator[NoteRow]:
    """One for each concern; those with the same schedule, group or place are one."""
    alike: dict[Hashable, list[Concern]] = {}
    for concern in forecast.concerns if forecast else ():
        about = next(
            (concern.details[key] for key in ("schedule_id", "group", "place") if key in concern.details), concern.at
        )
        alike.setdefault((concern.code, about), []).append(concern)
    free = forecast.free_at if forecast is not None else None
    for same in alike.values():
        code, remedies = same[0].code, ()  # type: ConcernCode, tuple[Option, ...]
        if free is not None and code is ConcernCode.OVERLAP:
            text = _("Move to {time}").format(time=formats.wall_time(free))
            remedies, free = (Option((("at", free.time()),), text),), None
        elif code is ConcernCode.WEEKDAYS_OFF:
            remedies = (anyway(),)
        yield NoteRow(
            _words(facts, draft, same[0], len(same)),
            remedies,
            code in (ConcernCode.CLOSED_DAYS, ConcernCode.CLOCK_CHANGE, ConcernCode.DAY_OFF),
        )


def _words(facts: SchedulerFacts, draft: Draft, concern: Concern, times: int) -> str:
    """The first of ``times`` alike."""
    details = concern.details
    match concern.code:
        case ConcernCode.OVERLAP:
            return _overlap(facts, draft, concern, times)
        case ConcernCode.DAY_OFF:
            return _("Begins after {day}, a day off").format(day=formats.wall_day(details["day"]))
        case ConcernCode.WEEKDAYS_OFF:
            return _weekdays_off(details)
        case ConcernCode.CLOSED_DAYS:
            return _closed(details["days"])
        case ConcernCode.CLOCK_CHANGE:
            return _clock_change(concern, draft.timezone)
        case ConcernCode.MISSION_MISSING if "group" in details:
            return _("No robot of {group} has the mission {mission}").format(**details)
        case ConcernCode.MISSION_MISSING:
            return _("{robot} does not have the mission {mission}").format(**details)
        case ConcernCode.ROBOT_OFF:
            return _("{robot} is switched off").format(**details)
        case ConcernCode.NOT_CHECKED_UP:
            return _("Nothing is sent until the fleet {fleet} is checked up").format(**details)
        case ConcernCode.PAUSED:
            until = details["until"]
            return _("Paused: no start before {time}").format(time=formats.day_or_time(until, draft.timezone, until))
        case ConcernCode.SWITCHED_OFF:
            return _("Switched off: nothing starts")
        case ConcernCode.NO_START:
            return _("No more starts")
    return conflicts.line(concern.code, concern.at, details, draft.timezone, _)


def _weekdays_off(details: Mapping[str, Any]) -> str:
    text = _("{days}: day off, so it never starts") if details["all"] else _("{days}: day off, so nothing starts then")
    return text.format(days=", ".join(formats.current().weekdays[day] for day in details["weekdays"]))


def _clock_change(concern: Concern, zone: str) -> str:
    text = (
        _("{day}: {time} comes twice that night, it starts at the first")
        if concern.details["twice"]
        else _("{day}: there is no {time} that night, it starts at {start}")
    )
    day, time = formats.day(concern.at, zone), formats.wall_time(concern.details["nominal"])
    return text.format(day=day, time=time, start=formats.clock_time(concern.at, zone))


def _overlap(facts: SchedulerFacts, draft: Draft, concern: Concern, times: int) -> str:
    """With which schedule: of several of one mission, the one that starts then."""
    schedule = facts.schedule(concern.details.get("schedule_id"))
    mission = facts.mission(schedule.mission_id) if schedule is not None else None
    name = (
        facts.mission_names.mission(mission, schedule.parameters)
        if schedule and mission
        else concern.details["mission"]
    )
    begins = formats.clock_time(concern.details["start"], draft.timezone)
    if times == 1:
        return _("Overlaps {mission}, {time}").format(mission=name, time=begins)
    return _("{n} overlaps with {mission}, {time}").format(n=times, mission=name, time=begins)


def _closed(days: list[tuple[date, str]]) -> str:
    """The omitted days, the first with its name."""
    (first, name), more = days[0], [formats.wall_day(day) for day, _name in days[1:MOST_DAYS]]
    said = ", ".join([f"{formats.wall_day(first)} ({name})", *more])
    left = len(days) - MOST_DAYS
    if left > 0:
        said = _("{days} and {n} more").format(days=said, n=left)
    return _("Days off: {days}").format(days=said)
