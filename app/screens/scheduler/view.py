"""Texts of the Scheduler: rules, the list of days, the list of schedules. Pure; timeline.py has the bars, form_view.py the form."""

from __future__ import annotations

from collections.abc import Hashable, Iterable
from dataclasses import dataclass, replace
from datetime import UTC, date, datetime, time, timedelta
from itertools import groupby
from zoneinfo import ZoneInfo

from app.domain import rules
from app.domain.models import Execution, Group, Mission, Robot, Schedule, Settings, State
from app.i18n import _, ngettext
from app.screens.common import execution_appearance, foreseen, formats
from app.screens.common.holding import held_next, held_note, run_words
from app.screens.common.options import MenuItem, Option
from app.screens.common.robot_appearance import silence_word
from app.screens.common.start_now import why_not
from app.screens.scheduler import of_groups
from app.screens.scheduler.draft import Target
from app.screens.scheduler.facts import DAYS, SchedulerFacts
from app.services.files.plan_export import PlanExport
from app.services.planning import sentences
from app.services.planning.planned import PlannedRun
from app.services.planning.recurrence import to_utc
from app.services.planning.working_days import WorkingCalendar

NO_BREAK = "\N{NO-BREAK SPACE}"
GROUPED_FROM = 4  # starts of one schedule on one day become one line
PICK = "pick"  # key of the option for choosing a day


@dataclass(frozen=True)
class DayRow:
    """A row of the list of days: the heading of a day, or a start on it."""

    key: Hashable
    heading: str = ""
    time: str = ""
    mission: str = ""
    robot: str = ""
    note: str = ""
    until: str = ""  # when it is over, as far as is known; of many, when the last one starts
    condition: str = ""  # what stops it, else what it needs
    name: str = ""  # of its schedule, where a person has given one


@dataclass(frozen=True)
class Listing:
    """The filter and order of the list: search words, one robot or group or all (None), by name or by next start."""

    query: str = ""
    target: Target | None = None
    by_name: bool = False


@dataclass(frozen=True)
class ScheduleItem:
    """A row of the list of schedules."""

    key: int
    on: bool
    mission: str
    rule: str
    next: str
    selected: bool = False
    icon: str = ""  # how it last went
    tone: str = "neutral"
    last: str = ""
    name: str = ""  # that a person has given it
    over: bool = False  # no start is left


# ---------------------------------------------------------------------- the rule of a schedule
def rule_line(schedule: Schedule) -> str:
    """When it starts, for a row of a list."""
    return _when(replace(schedule, respect_working_days=False))


def rule_sentence(
    schedule: Schedule, mission: Mission | None, settings: Settings, calendar: WorkingCalendar | None = None
) -> str:
    """When it starts and under which conditions."""
    condition, when = battery_condition(schedule, mission, settings), _when(schedule)
    if (
        calendar is not None
        and calendar.has_exceptions
        and schedule.respect_working_days
        and schedule.recurrence is not None
    ):
        when = _("{rule}, not on holidays or other days off").format(rule=rule_line(schedule))
    return f"{when}, {condition}" if condition else when


def battery_condition(schedule: Schedule, mission: Mission | None, settings: Settings) -> str:
    """Empty: it starts at any charge."""
    minimum = rules.minimum_battery(schedule, mission, settings)
    if minimum is None:
        return ""
    condition = _("if battery ≥ {percent}").format(percent=formats.percent(minimum))
    return condition.replace("≥ ", f"≥{NO_BREAK}").replace(" %", f"{NO_BREAK}%")


def _when(schedule: Schedule) -> str:
    if schedule.recurrence is None:
        return _("Once on {day} at {time}").format(
            day=formats.wall_day(schedule.start.date(), year=True), time=formats.wall_time(schedule.start)
        )
    return sentences.sentence(schedule, _)


# ---------------------------------------------------------------------- the next days
def days(facts: SchedulerFacts, now: datetime) -> list[DayRow]:
    """The plan as a list: a heading for each of the days, below it its starts; many of one schedule are one line."""
    zone = facts.zone
    today = now.astimezone(zone).date()
    by_day: dict[date, list[PlannedRun]] = {today + timedelta(days=n): [] for n in range(DAYS)}
    for run in facts.planned:
        by_day.setdefault(run.at.astimezone(zone).date(), []).append(run)
    rows: list[DayRow] = []
    for day, runs in sorted(by_day.items()):
        rows.append(
            _day_heading(
                facts, day, today, len(runs), any(at.astimezone(zone).date() <= day for at in facts.more.values())
            )
        )
        rows += (row for _at, row in sorted(_day_rows(facts, runs, now), key=lambda entry: entry[0]))
    return rows


def _day_heading(facts: SchedulerFacts, day: date, today: date, count: int, has_more: bool) -> DayRow:
    names = {0: _("Today"), 1: _("Tomorrow")}
    dated = formats.wall_day(day)
    near = names.get((day - today).days)
    starts = ngettext("{n} start", "{n} starts", count).format(n=count) if count else _("nothing planned")
    if has_more:
        starts = _("{starts} and more").format(starts=starts) if count else _("more starts than can be listed")
    notes = [starts]
    status = facts.calendar.day_status(day)
    if not status.is_working:
        notes.append(_("not a working day: {name}").format(name=status.name) if status.name else _("not a working day"))
    elif status.name:
        notes.append(_("extra working day: {name}").format(name=status.name))
    return DayRow(("day", day.isoformat()), heading=f"{near}, {dated}" if near else dated, note=" · ".join(notes))


def _day_rows(facts: SchedulerFacts, runs: list[PlannedRun], now: datetime) -> Iterable[tuple[datetime, DayRow]]:
    """Each with the instant by which they are ordered."""
    zone = facts.zone
    by_schedule = sorted(runs, key=lambda run: (run.schedule.id, run.at))
    for _id, group in groupby(by_schedule, key=lambda run: run.schedule.id):
        same = list(group)
        first = same[0]
        names = facts.mission_names.start(first), foreseen.whose(first, exactly=False)
        needs = battery_condition(first.schedule, first.mission, facts.settings)
        own, silent = facts.name(first.schedule), foreseen.silence(first, facts.silent.get(first.robot.id))
        if len(same) >= GROUPED_FROM:
            begins, ends = (formats.wall_time(run.at.astimezone(zone)) for run in (first, same[-1]))
            number, last = (
                ngettext("{n} start", "{n} starts", len(same)).format(n=len(same)),
                _("last at {time}").format(time=ends),
            )
            if (more := facts.more.get(first.schedule.id)) and more.astimezone(zone).date() == first.at.astimezone(
                zone
            ).date():
                number, last = _("{starts} and more").format(starts=number), ""
            held = sum(facts.hold_of(run) is not None for run in same)
            kept = _joined(
                _("{n} held").format(n=held) if held else "", foreseen.lack(first), silent if held < len(same) else ""
            )
            note = _joined(f"{number}, {last}" if last else number, kept)
            yield (
                first.at,
                DayRow(
                    ("schedule", first.schedule.id, first.at),
                    "",
                    begins,
                    *names,
                    note,
                    last or formats.NOTHING,
                    _joined(number, kept),
                    own,
                ),
            )
            continue
        for run in same:
            kept = held_note(facts.hold_of(run), run.at, run.schedule.start_window_minutes, facts.settings, now)
            kept = kept or foreseen.lack(run)
            begins = formats.wall_time(run.at.astimezone(zone))
            note = kept or _joined(silent, formats.ahead((run.at - now).total_seconds()))
            yield (
                run.at,
                DayRow(
                    ("schedule", run.schedule.id, run.at),
                    "",
                    begins,
                    facts.mission_names.start(run),
                    foreseen.whose(run),
                    note,
                    _until(run, zone),
                    kept or _joined(silent, needs),
                    own,
                ),
            )


def _joined(*parts: str) -> str:
    return " · ".join(filter(None, parts))


def _until(run: PlannedRun, zone: ZoneInfo) -> str:
    """About when it is over, as a rule."""
    if run.usual_s is None:
        return formats.NOTHING
    return _("ends ~{time}").format(
        time=formats.wall_time((run.begins + timedelta(seconds=run.usual_s)).astimezone(zone))
    )


# ---------------------------------------------------------------------- the schedules
def schedule_rows(
    facts: SchedulerFacts, now: datetime, selected: int | None = None, listing: Listing = Listing()
) -> list[ScheduleItem]:
    """Sorted by next start, with those off or over last; or by name, with those over last."""
    never, words = datetime.max.replace(tzinfo=UTC), listing.query.casefold().split()

    def place(schedule: Schedule) -> tuple[object, ...]:
        next_at = max(schedule.next_at, schedule.paused_until or schedule.next_at) if schedule.next_at else never
        over = _is_over(facts, schedule, now)
        return over, *(() if listing.by_name else (not (schedule.enabled or over), next_at)), schedule.name.casefold()

    listed = (schedule for schedule in facts.schedules if of_groups.is_listed(facts, schedule, listing.target))
    rows = (_schedule_row(facts, schedule, now, schedule.id == selected) for schedule in sorted(listed, key=place))
    names = {schedule.id: schedule.name for schedule in facts.schedules} if words else {}
    return [
        row
        for row in rows
        if all(word in f"{names[row.key]} {row.mission} {row.rule} {row.next}".casefold() for word in words)
    ]


def robot_options(facts: SchedulerFacts) -> list[Option]:
    """Whose schedules are listed; 0: all."""
    return [Option(0, _("All robots"), "robot-outline"), *of_groups.target_options(facts)]


def _schedule_row(facts: SchedulerFacts, schedule: Schedule, now: datetime, selected: bool) -> ScheduleItem:
    robot, mission, last = (
        facts.robot(schedule.robot_id),
        facts.mission(schedule.mission_id),
        facts.last.get(schedule.id),
    )
    whose = of_groups.whose(facts, schedule, last)
    row = ScheduleItem(
        schedule.id,
        schedule.enabled,
        facts.mission_names.mission(mission, schedule.parameters) if mission else schedule.name,
        _joined(rule_line(schedule), of_groups.what_matters(schedule)),
        " · ".join(filter(None, (whose, _next(facts, schedule, robot, now)))),
        selected,
        name=facts.name(schedule) if mission else "",
    )
    if _is_over(facts, schedule, now):
        row = replace(
            row, rule=" · ".join(filter(None, (whose, row.rule))), next=_became(facts, schedule, last), over=True
        )
    if last is None:
        return row
    icon, tone = execution_appearance.LOOKS[last.state]
    return replace(row, icon=icon, tone=tone, last="" if row.over else execution_appearance.word(last.state))


def _is_over(facts: SchedulerFacts, schedule: Schedule, now: datetime) -> bool:
    """Whether it has no more starts and none under way; a one-time schedule also if it was off at its time."""
    has_passed = schedule.recurrence is None and to_utc(schedule.start, ZoneInfo(schedule.timezone)) <= now
    return not _has_starts(facts, schedule) and (schedule.enabled or has_passed)


def _has_starts(facts: SchedulerFacts, schedule: Schedule) -> bool:
    """In the future, or under way."""
    last = facts.last.get(schedule.id)
    return schedule.next_at is not None or (last is not None and last.state.is_open)


def _became(facts: SchedulerFacts, schedule: Schedule, last: Execution | None) -> str:
    """The outcome of a finished schedule: that of its last start, if the history still has it."""
    start = to_utc(schedule.start, ZoneInfo(schedule.timezone))
    if last is None or (schedule.recurrence is None and last.planned_at != start):
        if not schedule.enabled:
            return _("Over · was switched off")
        return (
            _("Over · was due {time}").format(time=_when_it_was(facts, start))
            if schedule.recurrence is None
            else _("Over")
        )
    text = {
        State.COMPLETED: _("Over · ran {time}"),
        State.FAILED: _("Over · failed {time}"),
        State.CANCELLED: _("Over · cancelled {time}"),
        State.SKIPPED: _("Over · not run {time}"),
        State.MISSED: _("Over · not run {time}"),
    }[last.state]
    return text.format(time=_when_it_was(facts, last.started_at or last.planned_at))


def _when_it_was(facts: SchedulerFacts, at: datetime) -> str:
    return formats.day_and_time(at, facts.settings.timezone)


def _next(facts: SchedulerFacts, schedule: Schedule, robot: Robot | None, now: datetime) -> str:
    if not schedule.enabled:
        return _("switched off")
    if schedule.next_at is None:
        return _("no more starts")
    if robot is not None and not robot.enabled:
        return _("the robot needs its password") if robot.needs_password else _("the robot is switched off")
    if of_groups.all_are_off(facts, schedule):
        return _("no robot of the group is switched on")
    if of_groups.all_lack_mission(facts, schedule):
        return _("no robot of the group has the mission")
    if schedule.paused_until is not None and schedule.paused_until > now:
        return _("paused until {time}").format(
            time=formats.day_or_time(schedule.paused_until, facts.settings.timezone, now)
        )
    hold = facts.hold(schedule.robot_id, schedule.group_id, schedule.next_at)
    if held := held_next(hold, schedule.next_at, schedule.start_window_minutes, facts.settings, now):
        return held
    when = formats.until(schedule.next_at, now, facts.settings.timezone)
    return _joined(silence_word(facts.silent.get(schedule.robot_id or 0)), when)


def menu_title(facts: SchedulerFacts, schedule: Schedule) -> tuple[str, str]:
    """The schedule of a menu: its name or mission, and below that what else identifies it."""
    target, mission, name = facts.target(schedule), facts.mission(schedule.mission_id), facts.name(schedule)
    what, where = (
        facts.mission_names.mission(mission, schedule.parameters) if mission else schedule.name,
        target.name if target else "",
    )
    return (name, " · ".join(filter(None, (what, where)))) if name else (what, where)


def run_item(facts: SchedulerFacts, schedule: Schedule, now: datetime) -> MenuItem:
    """The button to start it now: what a press does, or why it does nothing, as on Home."""
    hold = facts.own_hold or facts.hold(schedule.robot_id, schedule.group_id, now)
    target = facts.target(schedule)
    nothing = why_not(target, facts.robots, hold, schedule.robot_id in facts.stopped) if target is not None else ""
    if not nothing and isinstance(target, Group) and of_groups.all_lack_mission(facts, schedule):
        nothing = _("No robot of {group} has this mission").format(group=target.name)
    if nothing:
        return MenuItem("run", nothing, "play", disabled=True)
    silent = facts.robot(schedule.robot_id) if schedule.robot_id in facts.silent else None
    words = run_words(hold, silent, rules.closes_at(now, None, facts.settings), facts.settings.timezone, now)
    return MenuItem("run", *(words or (_("Run now"), "play")))


def schedule_menu(facts: SchedulerFacts, schedule: Schedule, now: datetime) -> list[MenuItem]:
    """What can be done with it."""
    return [
        MenuItem("edit", _("Edit"), "pencil-outline"),
        run_item(facts, schedule, now),
        MenuItem("skip", _("Skip next"), "skip-next", disabled=not (schedule.enabled and schedule.next_at)),
        MenuItem("resume", _("Resume now"), "play-circle-outline")
        if schedule.is_paused(now)
        else MenuItem(
            "pause",
            _("Pause until a day"),
            "pause-circle-outline",
            disabled=not (schedule.enabled and schedule.next_at),
        ),
        MenuItem("duplicate", _("Duplicate"), "content-copy"),
        MenuItem("delete", _("Delete"), "trash-can-outline", tone="fault"),
    ]


def pause_options(schedule: Schedule, now: datetime) -> list[Option]:
    """The choices for a pause: keys are the first day with starts, PICK asks for one."""
    today = now.astimezone(ZoneInfo(schedule.timezone)).date()
    monday = today + timedelta(days=7 - today.weekday())
    texts = {today + timedelta(days=1): _("For today"), today + timedelta(days=2): _("Today and tomorrow")}
    texts.setdefault(monday, _("Until Monday"))
    return [
        *(
            Option(day, text, "pause-circle-outline", _("no start before {day}").format(day=formats.wall_day(day)))
            for day, text in texts.items()
        ),
        Option(PICK, _("Until a day of your choice"), "calendar-month", _("starts resume on that day")),
    ]


def day_begins(day: date, zone: ZoneInfo) -> datetime:
    """UTC instant of its first moment."""
    return datetime.combine(day, time(), zone).astimezone(UTC)


def export_result(done: PlanExport, zone: str) -> str:
    """How many starts were written, and where to."""
    if done.is_cut:
        return ngettext(
            "The next {n} start, until {day}, written to {path}",
            "The next {n} starts, until {day}, written to {path}",
            done.count,
        ).format(n=done.count, day=formats.day(done.until, zone), path=done.path)
    return ngettext(
        "{n} start of the next 30 days written to {path}",
        "{n} starts of the next 30 days written to {path}",
        done.count,
    ).format(n=done.count, path=done.path)


def schedules_empty(facts: SchedulerFacts) -> str:
    """Shown instead of missing rows."""
    return (
        ""
        if facts.schedules
        else _(
            "No schedule yet. Fill in the form and save it: it appears here with its next start and how it last went."
        )
    )


def schedules_note(facts: SchedulerFacts, target: Target | None = None) -> str:
    """How many are on, of all or of one robot or group."""
    listed = [schedule for schedule in facts.schedules if of_groups.is_listed(facts, schedule, target)]
    robot = facts.group(target[1]) if isinstance(target, tuple) else facts.robot(target)
    if not facts.schedules:
        return ""
    note = _("{on} of {all} on").format(
        on=sum(schedule.enabled and _has_starts(facts, schedule) for schedule in listed), all=len(listed)
    )
    return f"{robot.name} · {note}" if robot else note
