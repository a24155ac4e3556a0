"""Texts of the form: its choices, its problems and their fields, its next starts. Pure."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from datetime import UTC, datetime, timedelta
from operator import attrgetter
from typing import Any
from zoneinfo import ZoneInfo

from app.domain import rules
from app.domain.models import WEEKDAYS, InvalidInput, Overlap
from app.i18n import _, ngettext
from app.screens.common import formats
from app.screens.common.holding import HAND, held_word
from app.screens.common.priorities import level
from app.screens.common.problems import sentence_of
from app.screens.scheduler import of_groups
from app.screens.scheduler.draft import COMMON, LAST, NTH, Draft, Kind, Target, Unit
from app.screens.scheduler.facts import SchedulerFacts
from app.screens.scheduler.form_notes import NoteRow, Preview, closed_weekdays, dated, notes
from app.screens.scheduler.view import days_word, rule_line, short_rule, zoned
from app.services.catalogue.preview import STARTS, Forecast
from app.widgets.items import Option

# field of a service's InvalidInput -> the form's field that shows it
FIELDS = {
    "start": "day",
    "recurrence": "kind",
    "between": "until_time",
    "until": "last_day",
    "respect_working_days": "day",
    "group": "robot",
}
COMMON_BATTERY = (20, 30, 40, 50)  # %
UNDER_MORE = ("last_day", "name")
SHOWN_FIELDS = ("mission", "robot", "day", "time", "kind", "weekdays", "until_time", *UNDER_MORE)
SKIPPED = "skip-next"  # icon of a start that a person skips
MANY_A_DAY = 100  # starts


@dataclass(frozen=True)
class FormView:
    """The form's draft in words."""

    title: str = ""
    mission: str = ""
    robot: str = ""
    day: str = ""
    time: str = ""
    until: str = ""
    repeats: str = ""  # which of the rarer kinds
    days: tuple[tuple[str, str], ...] = ()  # of the week
    common_every: tuple[Option, ...] = ()  # numbers that are chosen by one tap
    nth: str = ""
    month_weekday: str = ""
    last_day: str = ""
    also: str = ""
    battery: int = 0  # %
    common_battery: tuple[Option, ...] = ()
    window: int = 0  # minutes
    overlaps: tuple[tuple[str, str], ...] = ()
    priority: int = 0
    priorities: tuple[tuple[int, str], ...] = ()
    name_hint: str = ""
    advanced: str = ""  # the rarer fields in a few words, while they are folded
    sentence: str = ""
    is_much: bool = False  # very many starts a day
    starts: tuple[Option, ...] = ()  # the next ones; the icon is of one with a warning, a held one or a skipped one
    notes: tuple[NoteRow, ...] = ()
    why: str = ""  # it can't be saved
    wrong_field: str = ""  # the field with the problem, which shows it; empty: shown next to Save

    def problem_at(self, field: str) -> str:
        return self.why if field == self.wrong_field else ""

    @property
    def warning(self) -> str:
        """The first of what may go wrong, and how many more: shown next to Save, as the notes may be out of sight."""
        warnings = [note.text for note in self.notes if not (note.quiet or self.why)]
        if len(warnings) < 2:
            return "".join(warnings)
        more = len(warnings) - 1
        return ngettext("{warning}, and {n} more", "{warning}, and {n} more", more).format(warning=warnings[0], n=more)


def called(facts: SchedulerFacts, draft: Draft) -> str:
    """What a message calls it."""
    if draft.base is not None:
        return facts.called(draft.base)
    mission = facts.mission(draft.mission_id)
    if draft.name or mission is None:
        return draft.name or _("New schedule")
    return facts.mission_names.mission(mission, {**draft.parameters, **draft.entered})


def present(facts: SchedulerFacts, draft: Draft, preview: Preview, now: datetime) -> FormView:
    """``preview`` is that of this draft, or empty."""
    mission, target = facts.mission(draft.mission_id), facts.target(draft)
    field_name, problem = _problem(facts, draft, preview, now)
    forecast = None if problem else preview.forecast
    waits = mission is None or target is None  # not begun rather than wrong
    a_day = starts_a_day(draft)
    battery = number_of(facts, draft, "minimum_battery_percent")
    return FormView(
        title=_("New schedule") if draft.base is None else mission.name if mission else draft.base.name,
        mission=mission.name if mission else _("Choose a mission"),
        robot=of_groups.target_text(target),
        day=dated(draft.day, now.astimezone(ZoneInfo(draft.timezone)).date()),
        time=formats.wall_time(draft.at),
        until=formats.wall_time(draft.until_time),
        repeats=repeats_text(repeats_of(draft)),
        days=_days(),
        common_every=tuple(Option(n, str(n), selected=n == draft.every) for n in COMMON[draft.unit]),
        nth=nth_text(draft.nth),
        month_weekday=formats.current().weekdays[WEEKDAYS.index(draft.month_weekday)],
        last_day=formats.wall_day(draft.last_day, year=True) if draft.ends else _("None"),
        also=", ".join(formats.wall_time(draft.at.replace(hour=hour)) for hour in draft.more_hours) or _("None"),
        battery=battery,
        common_battery=tuple(Option(n, formats.percent(n), selected=n == battery) for n in COMMON_BATTERY),
        window=max(1, number_of(facts, draft, "start_window_minutes")),
        overlaps=_overlaps(draft),
        priority=level(draft.priority),
        priorities=of_groups.priorities(),
        name_hint=_("{mission} on {robot}").format(mission=mission.name, robot=target.name)
        if mission and target
        else "",  # its name without an entered one
        advanced=_advanced(facts, draft),
        sentence="" if problem else _sentence(facts, draft, a_day),
        is_much=a_day > MANY_A_DAY,
        starts=_starts(facts, forecast, draft, now),
        notes=notes(facts, draft, preview, problem, now),
        why=problem,
        wrong_field="" if waits else field_name,
    )


def number_of(facts: SchedulerFacts, draft: Draft, name: str) -> int:
    """What holds: the draft's own value, else that of Settings."""
    number = getattr(draft, name)
    return _inherited(facts, draft, name) if number is None else int(number)


def _inherited(facts: SchedulerFacts, draft: Draft, name: str) -> int:
    if name == "start_window_minutes":
        return facts.settings.start_window_minutes
    return int(rules.minimum_battery(None, facts.mission(draft.mission_id), facts.settings) or 0)


def own(facts: SchedulerFacts, draft: Draft, name: str, number: int) -> int | None:
    """The draft's own value of such a number; None: as in Settings."""
    return None if number == _inherited(facts, draft, name) else number


def _advanced(facts: SchedulerFacts, draft: Draft) -> str:
    """What of the rarer fields isn't as usual; else how late it may start."""
    percent = number_of(facts, draft, "minimum_battery_percent")
    said = [
        _("battery ≥ {percent}").format(percent=formats.percent(percent))
        if draft.minimum_battery_percent is not None
        else "",
        "" if draft.respect_working_days else _("any day"),
        draft.name,
    ]
    usual = _("{time} late at most").format(time=formats.duration(60 * number_of(facts, draft, "start_window_minutes")))
    return ", ".join(filter(None, said)) or usual


def _sentence(facts: SchedulerFacts, draft: Draft, a_day: int) -> str:
    """When it starts; ticked days that are no working days are said to be left out."""
    schedule = draft.schedule()
    rule = rule_line(schedule) if draft.kind in (Kind.MONTHLY, Kind.OTHER) else short_rule(schedule)
    if draft.kind is Kind.EVERY and not draft.all_day:
        rule = ngettext("{rule}: {n} a day", "{rule}: {n} a day", a_day).format(rule=rule, n=a_day)
    rule, closed = zoned(rule, draft.timezone, facts), closed_weekdays(facts, draft)
    return _("{rule}, not {days}").format(rule=rule, days=days_word(closed)) if closed else rule


def starts_a_day(draft: Draft) -> int:
    """Of "every …", on a whole day or between its two times."""
    if draft.kind is not Kind.EVERY:
        return 1
    between = (draft.until_time.hour - draft.at.hour) * 60 + draft.until_time.minute - draft.at.minute
    minutes = 24 * 60 - 1 if draft.all_day else between
    return max(0, minutes * 60 // (draft.every * UNIT_S[draft.unit])) + 1


# ---------------------------------------------------------------------- what is wrong
def _problem(facts: SchedulerFacts, draft: Draft, preview: Preview, now: datetime) -> tuple[str, str]:
    """The form's field and one sentence; empty when it can be saved."""
    try:
        schedule = draft.schedule()
    except InvalidInput as problem:
        return problem.field, sentence_of(problem)
    if facts.mission(draft.mission_id) is None:  # deleted since, as are the following
        return "mission", _("Choose a mission")
    if facts.target(draft) is None:
        return "robot", _("Choose a robot")
    status = facts.calendar.day_status(draft.day)
    if draft.kind is Kind.ONCE and draft.respect_working_days and not status.is_working:
        if status.name:
            return "day", _("Day off: {name}").format(name=status.name)
        weekday = formats.current().weekdays[draft.day.weekday()]
        return "day", _("{weekday} is a day off").format(weekday=weekday[:1].upper() + weekday[1:])
    if preview.problem is not None:
        return form_field(preview.problem), sentence_of(preview.problem)
    is_past = draft.start <= now.astimezone(ZoneInfo(draft.timezone)).replace(tzinfo=None)
    is_new = draft.base is None or (schedule.start, schedule.recurrence) != (draft.base.start, draft.base.recurrence)
    if draft.kind is Kind.ONCE and is_past and is_new:  # it would never run, or at once: neither is what a person plans
        return "time", _("This time has passed")
    return "", ""


def form_field(problem: InvalidInput) -> str:
    """Where the form shows it; empty: next to Save."""
    name = FIELDS.get(problem.field, problem.field)
    return name if name in SHOWN_FIELDS else ""


# ---------------------------------------------------------------------- what is chosen
REPEATS = ((Kind.EVERY, Unit.MINUTES), (Kind.EVERY, Unit.HOURS), (Kind.MONTHLY, False), (Kind.MONTHLY, True))
UNIT_S = {Unit.MINUTES: 60, Unit.HOURS: 3600}


def repeats_of(draft: Draft) -> tuple[Kind, Any]:
    """Which of the rarer kinds it is."""
    return draft.kind, {Kind.EVERY: draft.unit, Kind.MONTHLY: draft.by_weekday}.get(draft.kind, "")


def repeats_text(key: tuple[Kind, Any]) -> str:
    words = _("Minutes between"), _("Hours between"), _("Monthly, by date"), _("Monthly, by weekday")
    return dict(zip(REPEATS, words, strict=True)).get(key, _("Own rule"))


def repeats_options(draft: Draft) -> list[Option]:
    own = [(Kind.OTHER, "")] if draft.kind is Kind.OTHER or draft.other_rule else []
    return [Option(key, repeats_text(key)) for key in (*REPEATS, *own)]


def _days() -> tuple[tuple[str, str], ...]:
    names = (name[:1].upper() + name[1:] for name in formats.current().weekdays_short)
    return tuple(zip(WEEKDAYS, names, strict=True))


def also_options(draft: Draft) -> list[Option]:
    return [Option(hour, formats.wall_time(draft.at.replace(hour=hour))) for hour in range(24) if hour != draft.at.hour]


def nth_text(nth: int) -> str:
    return {1: _("first"), 2: _("second"), 3: _("third"), 4: _("fourth"), 5: _("fifth"), LAST: _("last")}[nth]


def _overlaps(draft: Draft) -> tuple[tuple[str, str], ...]:
    beside = ((Overlap.PARALLEL, _("Beside it")),) if draft.group_id is not None else ()
    return ((Overlap.SKIP, _("Not run")), (Overlap.QUEUE, _("Waits")), *beside)


# ---------------------------------------------------------------------- the options of its pickers
def mission_options(facts: SchedulerFacts, target: Target | None) -> list[Option]:
    """Missions that can be started on the robot, favourites first; without a robot all of them. A robot's missions are
    known once its list has been read."""
    if isinstance(target, tuple):
        return of_groups.mission_options(facts, target[1])
    robot_id = target
    fitting = [mission for mission in facts.missions if robot_id is None or mission.robot_id in (None, robot_id)]
    if there := facts.names.get(robot_id or 0):
        fitting = [mission for mission in fitting if mission.guid in there]
    if robot_id is not None:  # a robot's own guid replaces the general one
        own = {mission.name for mission in fitting if mission.robot_id is not None}
        fitting = [mission for mission in fitting if mission.robot_id is not None or mission.name not in own]
    return [
        Option(
            mission.id,
            mission.name,
            "star" if mission.favourite else "star-outline",
            _("only on {robot}").format(robot=robot.name) if (robot := facts.robot(mission.robot_id)) else "",
        )
        for mission in sorted(fitting, key=lambda m: (not m.favourite, m.name.casefold()))
    ]


def nth_options() -> list[Option]:
    return [Option(nth, nth_text(nth)) for nth in NTH]


# ---------------------------------------------------------------------- what would follow
def _starts(facts: SchedulerFacts, forecast: Forecast | None, draft: Draft, now: datetime) -> tuple[Option, ...]:
    """The next starts, and between them the chosen days that are left out."""
    if forecast is None:
        return ()
    marked = {concern.at for concern in forecast.concerns if concern.at is not None}
    rows = []
    for at in sorted([*(start.instant for start in forecast.starts[:STARTS]), *forecast.skipped]):
        local, today = (moment.astimezone(ZoneInfo(draft.timezone)) for moment in (at, now))
        text = f"{dated(local.date(), today.date())} · {formats.wall_time(local)}"
        held = held_word(facts.hold(draft.robot_id, draft.group_id, at), at, draft.start_window_minutes, facts.settings)
        if at in forecast.skipped:
            rows.append(Option(at, f"{text} · {_('not run')}", SKIPPED))
        else:
            kind = HAND if held else "alert" if at in marked else ""
            rows.append(Option(at, " · ".join(filter(None, (text, held))), kind))
    return tuple(sorted([*rows, *_left_out(facts, forecast, draft, now)], key=attrgetter("key")))


def _left_out(facts: SchedulerFacts, forecast: Forecast, draft: Draft, now: datetime) -> Iterator[Option]:
    """Ticked days that are no working days, until the last start that is shown, or of a week."""
    closed, zone = closed_weekdays(facts, draft), ZoneInfo(draft.timezone)
    today = now.astimezone(zone).date()
    first = max(draft.day, today)
    shown = forecast.starts[:STARTS]
    last = shown[-1].instant.astimezone(zone).date() if shown else first + timedelta(days=6)
    for n in range((last - first).days + 1 if closed else 0):
        day = first + timedelta(days=n)
        if WEEKDAYS[day.weekday()] in closed:
            at = datetime.combine(day, draft.at, zone).astimezone(UTC)
            yield Option(at, f"{dated(day, today)} · {_('day off')}", "calendar-remove")
