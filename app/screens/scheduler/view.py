"""Texts of the Scheduler: rules, the list of schedules, menus. Pure; timeline.py has the bars, form_view.py the form."""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import dataclass, replace
from datetime import UTC, date, datetime, time
from zoneinfo import ZoneInfo

from app.domain import rules
from app.domain.execution import State
from app.domain.models import WEEKDAYS, Group, Schedule
from app.i18n import _, ngettext
from app.screens.common import execution_appearance, foreseen, formats
from app.screens.common.holding import held_note, run_words
from app.screens.common.robot_appearance import silence_word
from app.screens.common.start_now import why_not
from app.screens.scheduler import of_groups
from app.screens.scheduler.draft import Draft, Kind, Target, Unit
from app.screens.scheduler.facts import SchedulerFacts
from app.services.files.plan_export import PlanExport
from app.services.planning import sentences
from app.services.planning.recurrence import to_utc
from app.widgets.items import Action, Item, Option


@dataclass(frozen=True)
class Listing:
    """The filter and order of the list: search words, one robot or group, one mission, or all (None), by name or by next start."""

    query: str = ""
    target: Target | None = None
    mission_id: int | None = None
    by_name: bool = False


MENU = Action("menu", icon="dots-vertical")


# ---------------------------------------------------------------------- the rule of a schedule
def rule_line(schedule: Schedule) -> str:
    """When it starts, for a row of a list."""
    return _when(replace(schedule, respect_working_days=False))


def short_rule(schedule: Schedule) -> str:
    """The same in as few words as can be."""
    draft, table = Draft.of(schedule), formats.current()
    times = ", ".join(
        formats.wall_time(schedule.start.replace(hour=hour, minute=draft.at.minute)) for hour in draft.hours
    )
    match draft.kind:
        case Kind.ONCE:
            return _("Once, {day} {time}").format(day=formats.wall_day(draft.day), time=times)
        case Kind.DAILY:
            rule = _("Daily {times}").format(times=times)
        case Kind.WEEKLY:
            rule = f"{days_word(draft.weekdays)} {times}"
        case Kind.EVERY:
            rule = (
                _("Hourly")
                if draft.unit is Unit.HOURS and draft.every == 1
                else _("Every {time}").format(time=f"{draft.every} {table.units[2 if draft.unit is Unit.HOURS else 1]}")
            )
            if not draft.all_day:
                rule += f" {_hour(draft.at)}–{_hour(draft.until_time)}"
            if len(draft.weekdays) < len(WEEKDAYS):
                rule += f", {days_word(draft.weekdays)}"
        case _:
            return rule_line(schedule)
    return _("{rule} until {day}").format(rule=rule, day=formats.wall_day(draft.last_day)) if draft.last_day else rule


def zoned(rule: str, timezone: str, facts: SchedulerFacts) -> str:
    """With the time zone of the schedule, where it is not that of the times next to it."""
    return rule if timezone == facts.settings.timezone else f"{rule} {timezone.replace('_', ' ')}"


def _hour(at: time) -> str:
    return formats.wall_time(at) if at.minute else f"{at.hour:02d}"


def days_word(weekdays: Collection[str]) -> str:
    """Mon–Fri, Sun."""
    said = formats.weekdays(weekdays)
    return said[:1].upper() + said[1:]


def _when(schedule: Schedule) -> str:
    if schedule.recurrence is None:
        return _("Once on {day} at {time}").format(
            day=formats.wall_day(schedule.start.date(), year=True), time=formats.wall_time(schedule.start)
        )
    return sentences.sentence(schedule, _)


# ---------------------------------------------------------------------- the schedules
def schedule_rows(facts: SchedulerFacts, now: datetime, listing: Listing = Listing()) -> list[Item]:
    """Sorted by next start, with those off or over last; or by name, with those over last."""
    never, words = datetime.max.replace(tzinfo=UTC), listing.query.casefold().split()

    def place(schedule: Schedule) -> tuple[object, ...]:
        next_at, over = facts.next_start(schedule) or never, _is_over(facts, schedule, now)
        return over, *(() if listing.by_name else (not (schedule.enabled or over), next_at)), schedule.name.casefold()

    listed = (
        schedule
        for schedule in facts.schedules
        if of_groups.is_listed(facts, schedule, listing.target) and listing.mission_id in (None, schedule.mission_id)
    )
    rows = (_schedule_row(facts, schedule, now) for schedule in sorted(listed, key=place))
    names: dict[object, str] = {schedule.id: schedule.name for schedule in facts.schedules} if words else {}
    return [
        row
        for row in rows
        if all(word in f"{names[row.key]} {row.title} {row.support} {row.place}".casefold() for word in words)
    ]


def mission_options(facts: SchedulerFacts) -> list[Option]:
    """Whose schedules are listed; 0: all."""
    used = {schedule.mission_id for schedule in facts.schedules}
    known = sorted((mission for mission in facts.missions if mission.id in used), key=lambda one: one.name.casefold())
    return [Option(0, _("All missions"), "format-list-bulleted"), *(Option(one.id, one.name) for one in known)]


def robot_options(facts: SchedulerFacts) -> list[Option]:
    """Whose schedules are listed; 0: all."""
    return [Option(0, _("All robots"), "robot-outline"), *of_groups.target_options(facts)]


def _schedule_row(facts: SchedulerFacts, schedule: Schedule, now: datetime) -> Item:
    mission, last = facts.mission(schedule.mission_id), facts.last.get(schedule.id)
    is_over = _is_over(facts, schedule, now)
    why = _("over") if is_over else _why_not_next(facts, schedule, now) if schedule.enabled else ""
    row = Item(
        schedule.id,
        facts.mission_names.mission(mission, schedule.parameters) if mission else schedule.name,
        " · ".join(
            filter(None, (zoned(short_rule(schedule), schedule.timezone, facts), of_groups.what_matters(schedule), why))
        ),
        lead=_next_time(facts, schedule, now),
        place=of_groups.whose(facts, schedule, last),
        on=schedule.enabled,
        aside=facts.name(schedule) if mission else "",
        look="plain" if schedule.enabled and not is_over else "faint",
        actions=(MENU,),
    )
    if not schedule.enabled:
        return replace(row, meta=_("Off"))
    if last is None:
        return row
    icon, tone = execution_appearance.LOOKS[last.state]
    went = last.ended_at or last.planned_at
    meta = near_time(went, facts, now) if last.state is State.COMPLETED else execution_appearance.word(last.state)
    return replace(row, meta_icon=icon, meta_tone="neutral" if last.state is State.COMPLETED else tone, meta=meta)


def near_time(at: datetime, facts: SchedulerFacts, now: datetime) -> str:
    """15:00 of today, Mon 06:30 within some days, Mon 30 Nov 06:30 beyond."""
    local, today = (moment.astimezone(facts.zone) for moment in (at, now))
    apart = abs((local.date() - today.date()).days)
    if not 0 < apart < 6:
        return formats.day_and_time(at, facts.settings.timezone, now)
    word = formats.current().weekdays_date[local.weekday()]
    return f"{word[:1].upper()}{word[1:]} {formats.wall_time(local)}"


def _next_time(facts: SchedulerFacts, schedule: Schedule, now: datetime) -> str:
    at = facts.next_start(schedule)
    return formats.NOTHING if at is None else near_time(at, facts, now)


def _is_over(facts: SchedulerFacts, schedule: Schedule, now: datetime) -> bool:
    """Whether it has no more starts and none under way; a one-time schedule also if it was off at its time."""
    has_passed = schedule.recurrence is None and to_utc(schedule.start, ZoneInfo(schedule.timezone)) <= now
    return not _has_starts(facts, schedule) and (schedule.enabled or has_passed)


def _has_starts(facts: SchedulerFacts, schedule: Schedule) -> bool:
    """In the future, or under way."""
    last = facts.last.get(schedule.id)
    return schedule.next_at is not None or (last is not None and last.state.is_open)


def _why_not_next(facts: SchedulerFacts, schedule: Schedule, now: datetime) -> str:
    """What stands in the way of its next start; empty: nothing that is known."""
    robot = facts.robot(schedule.robot_id)
    if schedule.next_at is None:
        return _("no more starts")
    if robot is not None and not robot.enabled:
        return _("the robot needs its password") if robot.needs_password else _("the robot is switched off")
    if of_groups.all_are_off(facts, schedule):
        return _("no robot of the group is switched on")
    if of_groups.all_lack_mission(facts, schedule):
        return _("no robot of the group has the mission")
    if schedule.id in facts.refused:
        return foreseen.wrong_values()
    if schedule.paused_until is not None and schedule.paused_until > now:
        return _("paused until {time}").format(
            time=formats.day_or_time(schedule.paused_until, facts.settings.timezone, now)
        )
    hold = facts.hold(schedule.robot_id, schedule.group_id, schedule.next_at)
    if held := held_note(hold, schedule.next_at, schedule.start_window_minutes, facts.settings, now):
        return held
    return silence_word(facts.silent.get(schedule.robot_id or 0))


def menu_title(facts: SchedulerFacts, schedule: Schedule) -> tuple[str, str]:
    """The schedule of a menu: its name or mission, and below that what else identifies it."""
    target, mission, name = facts.target(schedule), facts.mission(schedule.mission_id), facts.name(schedule)
    what, where = (
        facts.mission_names.mission(mission, schedule.parameters) if mission else schedule.name,
        target.name if target else "",
    )
    return (name, " · ".join(filter(None, (what, where)))) if name else (what, where)


def run_item(facts: SchedulerFacts, schedule: Schedule, now: datetime) -> Option:
    """The button to start it now: what a press does, or why it does nothing, as on Home."""
    hold = facts.own_hold or facts.hold(schedule.robot_id, schedule.group_id, now)
    target = facts.target(schedule)
    nothing = why_not(target, facts.robots, hold, schedule.robot_id in facts.stopped) if target is not None else ""
    if not nothing and isinstance(target, Group) and of_groups.all_lack_mission(facts, schedule):
        nothing = _("No robot of {group} has this mission").format(group=target.name)
    if nothing:
        return Option("run", _("Run now"), "play", off=nothing)
    silent = facts.robot(schedule.robot_id) if schedule.robot_id in facts.silent else None
    words = run_words(hold, silent, rules.closes_at(now, None, facts.settings), facts.settings.timezone, now)
    return Option("run", *(words or (_("Run now"), "play")))


def schedule_menu(facts: SchedulerFacts, schedule: Schedule, now: datetime) -> list[Option]:
    """What can be done with it."""
    if schedule.is_paused(now):
        starts = [Option("resume", _("Resume now"), "play-circle-outline")]
    elif schedule.enabled and schedule.next_at:
        starts = [
            Option("skip", _("Skip next"), "skip-next"),
            Option("pause", _("Pause until a day"), "pause-circle-outline"),
        ]
    else:
        starts = []
    return [
        Option("edit", _("Edit"), "pencil-outline"),
        run_item(facts, schedule, now),
        *starts,
        Option("duplicate", _("Duplicate"), "content-copy"),
        Option("delete", _("Delete"), "trash-can-outline", tone="fault"),
    ]


def day_begins(day: date, zone: ZoneInfo) -> datetime:
    """UTC instant of its first moment."""
    return datetime.combine(day, time(), zone).astimezone(UTC)


def looks_in_words() -> str:
    """What colours and shapes mean."""
    return "\n".join(
        (
            _("Dark: working"),
            _("Light: planned"),
            _("Grey: ended"),
            _("Red: failed"),
            _("Amber frame: not run, or on hold"),
            _("Amber edge: overlaps"),
            _("Dashed: not saved yet"),
            _("Hatched: day off"),
        )
    )


def export_result(done: PlanExport, zone: str) -> str:
    """How many starts were written, and where to."""
    if done.is_cut:
        return ngettext(
            "The next {n} start, until {day}, written to {path}",
            "The next {n} starts, until {day}, written to {path}",
            done.count,
        ).format(n=formats.count(done.count), day=formats.day(done.until, zone), path=done.path)
    return ngettext(
        "{n} start of the next 30 days written to {path}",
        "{n} starts of the next 30 days written to {path}",
        done.count,
    ).format(n=formats.count(done.count), path=done.path)
