"""The form's warnings: one line each, and the whole sentence after a tap. Pure."""

from __future__ import annotations

from collections.abc import Hashable, Sequence
from dataclasses import dataclass
from datetime import date, datetime, timedelta
from zoneinfo import ZoneInfo

from app.domain import conflicts
from app.i18n import _, ngettext
from app.screens.common import formats
from app.screens.scheduler.draft import Draft
from app.screens.scheduler.facts import SchedulerFacts
from app.services.catalogue.preview import Concern, ConcernCode, Forecast


@dataclass(frozen=True)
class WarningRow:
    """A sentence next to the form; ``line`` is its short form, empty if the sentence is short enough. A ``quiet`` one
    is not a warning."""

    text: str
    line: str = ""
    quiet: bool = False


def dated(day: date, today: date) -> str:
    """A day, with its year if it is not the present one."""
    return (
        formats.wall_day(day)
        if day.year == today.year or day - today < timedelta(days=180)
        else formats.wall_day(day, year=True)
    )


def warnings(facts: SchedulerFacts, draft: Draft, forecast: Forecast | None, now: datetime) -> tuple[WarningRow, ...]:
    """One for each concern; those with the same schedule, group or place are one."""
    alike: dict[Hashable, list[Concern]] = {}
    for concern in forecast.concerns if forecast else ():
        about = next(
            (concern.details[key] for key in ("schedule_id", "group", "place") if key in concern.details), concern.at
        )
        alike.setdefault((concern.code, about), []).append(concern)
    return tuple(
        WarningRow(_warning(facts, draft, same[0], len(same), now), _line(facts, draft, same[0], len(same)))
        for same in alike.values()
    )


def _line(facts: SchedulerFacts, draft: Draft, concern: Concern, times: int) -> str:
    """In a few words."""
    details = concern.details
    match concern.code:
        case ConcernCode.OVERLAP:
            return ngettext("{n} overlap: {mission}", "{n} overlaps: {mission}", times).format(
                n=times, mission=_other(facts, concern)
            )
        case ConcernCode.LOW_BATTERY:
            return _("Battery too low {n} times lately").format(n=details["count"])
        case ConcernCode.DAY_OFF:
            return _("Begins after {day}").format(day=formats.wall_day(details["day"]))
        case ConcernCode.WEEKDAYS_OFF:
            return _("{days}: not a working day").format(days=_weekdays(details["weekdays"]))
        case ConcernCode.CLOSED_DAYS:
            return ngettext("{n} day is left out", "{n} days are left out", len(details["days"])).format(
                n=len(details["days"])
            )
        case ConcernCode.CLOCK_CHANGE:
            return _("{day}: the clocks change").format(day=formats.day(concern.at, draft.timezone))
        case ConcernCode.MISSION_MISSING:
            return (_("No robot of {group} has it") if "group" in details else _("{robot} does not have it")).format(
                **details
            )
        case ConcernCode.ROBOT_OFF:
            return _("{robot} is switched off").format(**details)
        case _:
            return conflicts.line(concern.code, concern.at, details, draft.timezone, _)


def _other(facts: SchedulerFacts, concern: Concern) -> str:
    """What it overlaps with."""
    schedule = facts.schedule(concern.details.get("schedule_id"))
    mission = facts.mission(schedule.mission_id) if schedule is not None else None
    return (
        facts.mission_names.mission(mission, schedule.parameters)
        if schedule and mission
        else concern.details["mission"]
    )


def _warning(facts: SchedulerFacts, draft: Draft, concern: Concern, times: int, now: datetime) -> str:
    """The first of ``times`` alike."""
    zone, details = ZoneInfo(draft.timezone), concern.details
    robot = facts.robot(draft.robot_id)
    day = dated(concern.at.astimezone(zone).date(), now.astimezone(zone).date()) if concern.at else ""
    match concern.code:
        case ConcernCode.OVERLAP:
            begins, ends = (formats.wall_time(details[name].astimezone(zone)) for name in ("start", "end"))
            text = _overlap_text(concern, times).format(
                n=times,
                day=day,
                robot=robot.name if robot else "–",
                start=begins,
                end=ends,
                mission=_other(facts, concern),
            )
            return text + _likely(details.get("likely"))
        case ConcernCode.LOW_BATTERY:
            return _("The battery of {robot} was too low around this time {n} times in the last {days} days").format(
                robot=robot.name if robot else "–", n=details["count"], days=details["days"]
            )
        case ConcernCode.DAY_OFF:
            if details.get("name"):
                return _("{day} is not a working day: {name}. It begins later").format(
                    day=formats.wall_day(details["day"]), name=details["name"]
                )
            return _("{day} is not a working day, so it begins later").format(day=formats.wall_day(details["day"]))
        case ConcernCode.WEEKDAYS_OFF:
            text = (
                _("{days}: not a working day, so it never starts")
                if details["all"]
                else _("{days}: not a working day, so nothing starts then")
            )
            return text.format(days=_weekdays(details["weekdays"]))
        case ConcernCode.CLOSED_DAYS:
            return _passed_over(details["days"])
        case ConcernCode.CLOCK_CHANGE:
            text = (
                _("{day}: {time} comes twice that night, it starts at the first")
                if details["twice"]
                else _("{day}: there is no {time} that night, it starts at {start}")
            )
            begins = formats.wall_time((concern.at or now).astimezone(zone))
            return text.format(day=day, time=formats.wall_time(details["nominal"]), start=begins)
        case ConcernCode.MISSION_MISSING:
            return (
                _("No robot of {group} has the mission {mission}")
                if "group" in details
                else _("{robot} does not have the mission {mission}")
            ).format(**details)
        case ConcernCode.ROBOT_OFF:
            return _("{robot} is switched off in Settings: nothing will be sent").format(**details)
        case ConcernCode.PAUSED:
            return _("Paused: no start before {time}").format(
                time=formats.day_or_time(details["until"], draft.timezone, now)
            )
        case ConcernCode.SWITCHED_OFF:
            return _("Switched off: nothing starts")
        case ConcernCode.NO_START:
            return _("No more starts")
        case _:
            text = conflicts.sentence(concern.code, concern.at, details, zone, _)
            return _("{day}: {what}").format(day=day, what=text) if day else text


def _weekdays(days: Sequence[int]) -> str:
    return ", ".join(formats.current().weekdays[day] for day in days)


def _passed_over(days: Sequence[tuple[date, str]]) -> str:
    """The first of the omitted days, by name."""
    day, name = days[0]
    if len(days) == 1:
        return _("Not on {day}, not a working day: {name}").format(day=formats.wall_day(day), name=name)
    text = ngettext(
        "Not on {day} ({name}) nor {n} other day: not working days",
        "Not on {day} ({name}) nor {n} other days: not working days",
        len(days) - 1,
    )
    return text.format(day=formats.wall_day(day), name=name, n=len(days) - 1)


def _likely(share: float | None) -> str:
    """The probability that two runs overlap, if it is not nearly certain; rounded, as it is based on at most twenty
    runs."""
    if share is None or share > 0.9:
        return ""
    return _(" (about {percent} % of the runs)").format(percent=max(5, round(share * 20) * 5))


def _overlap_text(concern: Concern, times: int) -> str:
    begins = concern.details["start"]
    if times > 1:
        return _("{n} of these runs overlap with {mission} on {robot}: first {day}, {start}–{end}")
    if concern.at is None or begins < concern.at:
        return _("{day}: {mission} is still running on {robot} then, {start}–{end}")
    if begins == concern.at:
        return _("{day}: {mission} starts on {robot} at the same time, {start}–{end}")
    return _("{day}: {mission} starts on {robot} before this run ends, {start}–{end}")
