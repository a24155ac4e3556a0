"""Texts of the form: its choices, its problems and their fields, its next starts. Pure."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from datetime import datetime, timedelta
from zoneinfo import ZoneInfo

from app.domain import rules
from app.domain.models import WEEKDAYS, Group, InvalidInput, Mission, Overlap, Robot, Schedule
from app.i18n import _, ngettext
from app.screens.common import formats
from app.screens.common.holding import HAND, held_word
from app.screens.common.options import Option
from app.screens.common.problems import sentence_of
from app.screens.scheduler import of_groups
from app.screens.scheduler.draft import COMMON_MINUTES, LAST, MOST_HOURS, MOST_MINUTES, Draft, Kind, Target, Unit
from app.screens.scheduler.facts import SchedulerFacts
from app.screens.scheduler.form_warnings import WarningRow, dated, warnings
from app.screens.scheduler.view import rule_line, rule_sentence
from app.services.catalogue.preview import Forecast
from app.services.planning.planned import ASSUMED_S
from app.services.planning.sentences import missing_months

# field of a service's InvalidInput -> the form's field that shows it
FIELDS = {
    "start": "day",
    "recurrence": "kind",
    "between": "until_time",
    "minimum_battery_percent": "battery",
    "start_window_minutes": "window",
    "until": "last_day",
    "respect_working_days": "day",
    "overlap": "overlap",
    "finish_by_minutes": "finish_by",
    "group": "robot",
}
UNDER_MORE = ("last_day", "name")
SHOWN_FIELDS = (
    "mission",
    "robot",
    "day",
    "time",
    "kind",
    "weekdays",
    "every",
    "until_time",
    "battery",
    "window",
    "overlap",
    "finish_by",
    *UNDER_MORE,
)
SOON = timedelta(days=28)  # in which a weekday and its number mean a day
WINDOWS = (5, 15, 30, 60, 120)  # min
BATTERIES = (10, 20, 30, 50)  # %
SKIPPED = "skip-next"  # icon of a start that a person skips


@dataclass(frozen=True)
class Preview:
    """What the services answer to a draft: a forecast, or why it can't be saved."""

    forecast: Forecast | None = None
    problem: InvalidInput | None = None


@dataclass(frozen=True)
class StartRow:
    """One of the next starts; ``kind`` is the icon of one with a warning, a held one or a skipped one."""

    text: str
    kind: str = ""


@dataclass(frozen=True)
class Steps:
    """A number to ask for. ``chips``: key and word of the common values; the numbers of those with other words are in
    ``meant``."""

    title: str
    label: str  # of the number itself
    help: str
    minimum: int
    maximum: int
    step: int
    unit: str
    chips: tuple[tuple[int | None, str], ...]
    meant: Mapping[float | None, float] = field(default_factory=dict)

    def number(self, chosen: float | None) -> float:
        """That holds when this is chosen."""
        return self.meant.get(chosen, chosen or 0)


@dataclass(frozen=True)
class FormView:
    """What the form shows."""

    title: str = ""
    closable: bool = False  # there is something in it
    mission: str = ""
    robot: str = ""
    day_label: str = ""
    day: str = ""
    time_label: str = ""
    time: str = ""
    until: str = ""
    kind: str = Kind.ONCE
    kinds: tuple[tuple[str, str], ...] = ()
    day_chips: tuple[Option, ...] = ()
    every: int | None = 1
    most_every: int = MOST_HOURS
    common_every: tuple[Option, ...] = ()  # numbers that are chosen by one tap
    unit: str = Unit.HOURS
    all_day: bool = False
    by_weekday: bool = False
    nth: str = ""
    month_weekday: str = ""
    month_day: str = ""
    left_out: str = ""  # the months that don't have that day; the last day of each is offered then
    repeats: bool = False
    last_day: str = ""
    ends: bool = False  # a last day is set
    can_also: bool = False
    also: str = ""
    battery: str = ""
    window: str = ""
    overlap: str = ""
    respect_working_days: bool = True
    priorities: tuple[Option, ...] = ()
    of_group: bool = False
    finish_by: str = ""
    name: str = ""
    name_hint: str = ""
    sentence: str = ""
    starts: tuple[StartRow, ...] = ()
    has_skip: bool = False  # a start can be skipped, or is skipped
    skip: str = ""  # offers that, and to start after all what is skipped
    can_skip: bool = False  # one of those shown
    skip_why: str = ""  # it can't be skipped
    lasts: str = ""  # how long it takes, and how that is known
    warnings: tuple[WarningRow, ...] = ()
    free: str = ""  # offers a time without an overlap
    save: str = ""
    save_off: bool = True
    why: str = ""  # it can't be saved
    wrong_field: str = ""  # the field with the problem, which shows it; empty: shown next to Save

    def problem_at(self, field: str) -> str:
        return self.why if field == self.wrong_field else ""

    @property
    def kind_fields(self) -> str:
        """The widget with the fields that this kind of recurrence needs besides; empty: none."""
        monthly = "MonthWeekdayFields" if self.by_weekday else "MonthDayFields"
        return {
            Kind.WEEKLY: "WeeklyFields",
            Kind.EVERY: "EveryFields",
            Kind.MONTHLY: monthly,
            Kind.OTHER: "OtherFields",
        }.get(Kind(self.kind), "")


def called(facts: SchedulerFacts, draft: Draft) -> str:
    """What a message calls it."""
    if draft.base is not None:
        return facts.called(draft.base)
    mission = facts.mission(draft.mission_id)
    if draft.name or mission is None:
        return draft.name or _("New schedule")
    return facts.mission_names.mission(mission, {**draft.parameters, **draft.entered})


def draft_option(facts: SchedulerFacts, draft: Draft) -> Option:
    """Its name among the drafts, and when it would start."""
    icon = "calendar-plus" if draft.is_new else "calendar-edit-outline"
    try:
        return Option(draft.entry, called(facts, draft), icon, rule_line(draft.schedule()))
    except InvalidInput:
        return Option(draft.entry, called(facts, draft), icon)


def present(facts: SchedulerFacts, draft: Draft, preview: Preview, now: datetime) -> FormView:
    """``preview`` is that of this draft, or empty."""
    mission = facts.mission(draft.mission_id)
    target = facts.target(draft)
    field_name, problem = _problem(facts, draft, preview, now)
    forecast = None if problem else preview.forecast
    waits = mission is None or target is None  # not begun rather than wrong
    minimum = rules.minimum_battery(_schedule_so_far(draft), mission, facts.settings)
    repeats = draft.kind not in (Kind.ONCE, Kind.OTHER)
    skipped = forecast.skipped if forecast else ()
    is_stored = draft.is_stored(facts.name(draft.base))  # what is shown are its starts
    return FormView(
        title=_("New schedule") if draft.is_new else _("Edit schedule"),
        mission=mission.name if mission else _("Choose a mission"),
        robot=of_groups.target_text(target),
        day_label=_("First day") if draft.kind is not Kind.ONCE else _("Day"),
        day=formats.wall_day(draft.day, year=True),
        time_label=_("From") if draft.kind is Kind.EVERY and not draft.all_day else _("Time"),
        time=formats.wall_time(draft.at),
        until=formats.wall_time(draft.until_time),
        kind=draft.kind,
        kinds=kinds(draft),
        day_chips=_day_chips(draft),
        every=draft.every,
        most_every=MOST_HOURS if draft.unit is Unit.HOURS else MOST_MINUTES,
        unit=draft.unit,
        all_day=draft.all_day,
        common_every=_common_every(draft),
        by_weekday=draft.by_weekday,
        nth=nth_text(draft.nth),
        month_day=month_day_text(draft.month_day),
        month_weekday=formats.current().weekdays[WEEKDAYS.index(draft.month_weekday)],
        left_out=_left_out(draft),
        repeats=repeats,
        last_day=formats.wall_day(draft.last_day, year=True) if repeats and draft.last_day else _("No last day"),
        ends=repeats and draft.last_day is not None,
        can_also=repeats and draft.kind is not Kind.EVERY,
        also=_also(draft),
        battery=formats.percent(minimum) if minimum else _("Any"),
        window=window_text(
            facts.settings.start_window_minutes if draft.start_window_minutes is None else draft.start_window_minutes
        ),
        overlap=overlap_text(draft.overlap),
        respect_working_days=draft.respect_working_days,
        priorities=of_groups.priority_chips(draft.priority),
        of_group=draft.group_id is not None,
        finish_by=of_groups.finish_by_text(draft.finish_by_minutes),
        name=draft.name,
        name_hint=_name_hint(mission, target),
        sentence="" if problem else rule_sentence(draft.schedule(), mission, facts.settings, facts.calendar),
        starts=_starts(facts, forecast, draft, now),
        has_skip=draft.base is not None and draft.base.enabled and (draft.base.next_at is not None or bool(skipped)),
        skip=_("Skip or restore a start") if skipped else _("Skip a start"),
        can_skip=bool(forecast and (forecast.starts or skipped)) and is_stored,
        skip_why="" if is_stored else _("Save the changes first, then skip a start"),
        lasts=_lasts(forecast, target),
        warnings=warnings(facts, draft, forecast, now),
        free=_free(forecast),
        save=_("Save schedule") if draft.is_new else _("Save changes"),
        save_off=bool(problem) or preview.forecast is None,
        why=problem,
        wrong_field="" if waits else field_name,
    )


def _name_hint(mission: Mission | None, robot: Robot | Group | None) -> str:
    """Its name without an entered one."""
    return _("{mission} on {robot}").format(mission=mission.name, robot=robot.name) if mission and robot else ""


def _schedule_so_far(draft: Draft) -> Schedule:
    """As much of a schedule as the battery limit needs, also of an incomplete draft."""
    return Schedule("", 0, 0, draft.start, draft.timezone, minimum_battery_percent=draft.minimum_battery_percent)


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
            return "day", _("Not a working day: {name}. Choose another day, or any day under More").format(
                name=status.name
            )
        weekday = formats.current().weekdays[draft.day.weekday()]
        return "day", _("{weekday} is not a working day: choose another day, or any day under More").format(
            weekday=weekday[:1].upper() + weekday[1:]
        )
    if preview.problem is not None:
        return form_field(preview.problem), sentence_of(preview.problem)
    if _is_over(draft, schedule, now):
        return "time", _("This time has passed: choose a later one")
    return "", ""


def _is_over(draft: Draft, schedule: Schedule, now: datetime) -> bool:
    """A one-time start in the past would never run, or at once: neither is what a person plans."""
    is_past = draft.start <= now.astimezone(ZoneInfo(draft.timezone)).replace(tzinfo=None)
    return (
        draft.kind is Kind.ONCE
        and is_past
        and (draft.base is None or (schedule.start, schedule.recurrence) != (draft.base.start, draft.base.recurrence))
    )


def form_field(problem: InvalidInput) -> str:
    """Where the form shows it; empty: next to Save."""
    name = FIELDS.get(problem.field, problem.field)
    return name if name in SHOWN_FIELDS else ""


# ---------------------------------------------------------------------- what is chosen
def kinds(draft: Draft) -> tuple[tuple[str, str], ...]:
    own = ((Kind.OTHER, _("Own rule")),) if draft.kind is Kind.OTHER or draft.other_rule else ()
    return (
        (Kind.ONCE, _("Once")),
        (Kind.DAILY, _("Daily")),
        (Kind.WEEKLY, _("Weekly")),
        (Kind.EVERY, _("Interval")),
        (Kind.MONTHLY, _("Monthly")),
        *own,
    )


def _common_every(draft: Draft) -> tuple[Option, ...]:
    return tuple(
        Option(n, formats.duration(n * 60), selected=n == draft.every)
        for n in COMMON_MINUTES
        if draft.unit is Unit.MINUTES
    )


def _day_chips(draft: Draft) -> tuple[Option, ...]:
    return tuple(
        Option(day, name[:1].upper() + name[1:], selected=day in draft.weekdays)
        for day, name in zip(WEEKDAYS, formats.current().weekdays_short, strict=True)
    )


def _also(draft: Draft) -> str:
    return ", ".join(formats.wall_time(draft.at.replace(hour=hour)) for hour in draft.more_hours) or _("No other time")


def also_options(draft: Draft) -> list[Option]:
    return [Option(hour, formats.wall_time(draft.at.replace(hour=hour))) for hour in range(24) if hour != draft.at.hour]


def nth_text(nth: int) -> str:
    return {1: _("first"), 2: _("second"), 3: _("third"), 4: _("fourth"), 5: _("fifth"), LAST: _("last")}[nth]


def month_day_text(day: int) -> str:
    return _("the last day") if day == LAST else _("day {n}").format(n=day)


def _left_out(draft: Draft) -> str:
    """Everything else still missing in the form."""
    if draft.kind is not Kind.MONTHLY or draft.by_weekday or draft.month_day == LAST:
        return ""
    words = missing_months(replace(_schedule_so_far(draft), recurrence=f"FREQ=MONTHLY;BYMONTHDAY={draft.month_day}"), _)
    return words[:1].upper() + words[1:]


def battery_text(percent: float | None) -> str:
    return formats.percent(percent) if percent else _("No minimum")


def window_text(minutes: int) -> str:
    return formats.duration(minutes * 60) if minutes else _("1 min")


def overlap_text(overlap: Overlap) -> str:
    return {Overlap.SKIP: _("Skip"), Overlap.QUEUE: _("Queue"), Overlap.PARALLEL: _("Beside it")}[overlap]


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
    own = {
        mission.name for mission in fitting if mission.robot_id is not None
    }  # a robot's own guid replaces the general one
    options = []
    for mission in sorted(fitting, key=lambda m: (not m.favourite, m.name.casefold())):
        if mission.robot_id is None and mission.name in own and robot_id is not None:
            continue
        robot = facts.robot(mission.robot_id)
        options.append(
            Option(
                mission.id,
                mission.name,
                "star" if mission.favourite else "star-outline",
                _("only on {robot}").format(robot=robot.name) if robot else "",
            )
        )
    return options


def steps(facts: SchedulerFacts, draft: Draft, name: str) -> Steps:
    """The question for a number of the draft, by its field. The value of Settings has no own chip, unless it is
    chosen."""
    label = _("Or any other")
    if name == "minimum_battery_percent":
        inherited = rules.minimum_battery(None, facts.mission(draft.mission_id), facts.settings) or 0
        common = [
            (value, battery_text(value))
            for value in (0, *BATTERIES)
            if value != inherited or value == draft.minimum_battery_percent
        ]
        return Steps(
            _("Start only if the battery is at least"),
            label,
            _("0 to 100 %"),
            0,
            100,
            5,
            "%",
            (
                (
                    None,
                    _("As in Settings: {minimum}").format(
                        minimum=formats.percent(inherited) if inherited else _("none")
                    ),
                ),
                *common,
            ),
            {None: inherited},
        )
    if name == "start_window_minutes":
        minutes = facts.settings.start_window_minutes
        common = [
            (value, window_text(value))
            for value in (0, *WINDOWS)
            if max(1, value) != max(1, minutes) or value == draft.start_window_minutes
        ]
        return Steps(
            _("How late it may start"),
            label,
            _("1 to 1440 min"),
            1,
            1440,
            5,
            _("min"),
            ((None, _("As in Settings: {minimum}").format(minimum=window_text(minutes))), *common),
            {None: max(1, minutes), 0: 1},
        )
    if name == "finish_by_minutes":
        return Steps(
            _("Must be done within"),
            label,
            _("1 to 1440 min after its start; one that can't be done by then is skipped"),
            1,
            1440,
            5,
            _("min"),
            (
                (None, of_groups.finish_by_text(None)),
                *((value, formats.duration(value * 60)) for value in of_groups.FINISH_BY),
            ),
            {None: of_groups.FINISH_BY[0]},
        )
    return Steps(
        _("Day of the month"),
        label,
        _("1 to 31; not every month has a 29th, 30th and 31st"),
        1,
        31,
        1,
        "",
        ((1, "1"), (15, "15"), (LAST, month_day_text(LAST))),
        {LAST: 31},
    )


def overlap_options(draft: Draft) -> list[Option]:
    options = [
        Option(Overlap.SKIP, _("Skip the new start"), note=_("while the previous run of this schedule is open")),
        Option(Overlap.QUEUE, _("Queue it"), note=_("it runs when the previous one has ended")),
    ]
    if draft.group_id is not None:
        options.append(
            Option(Overlap.PARALLEL, _("Run it beside the previous one"), note=_("on another robot of the group"))
        )
    return options


def nth_options() -> list[Option]:
    return [Option(nth, nth_text(nth)) for nth in (1, 2, 3, 4, 5, LAST)]


def weekday_options() -> list[Option]:
    return [Option(day, name) for day, name in zip(WEEKDAYS, formats.current().weekdays, strict=True)]


# ---------------------------------------------------------------------- what would follow
def _starts(facts: SchedulerFacts, forecast: Forecast | None, draft: Draft, now: datetime) -> tuple[StartRow, ...]:
    if forecast is None:
        return ()
    marked = {concern.at for concern in forecast.concerns if concern.at is not None}
    rows = []
    for at in _shown(forecast):
        if at in forecast.skipped:
            rows.append(StartRow(f"{_day_and_time(at, draft, now)} · {_('skipped')}", SKIPPED))
            continue
        held = held_word(facts.hold(draft.robot_id, draft.group_id, at), at, draft.start_window_minutes, facts.settings)
        kind = HAND if held else "alert" if at in marked else ""
        rows.append(StartRow(" · ".join(filter(None, (_day_and_time(at, draft, now), held))), kind))
    return tuple(rows)


def skip_options(forecast: Forecast, draft: Draft, now: datetime) -> list[Option]:
    """Its next starts in order of time; skipped ones are marked."""
    icon, note = {True: "undo", False: SKIPPED}, {True: _("skipped: start it after all"), False: ""}
    return [
        Option(at, _day_and_time(at, draft, now), icon[skipped], note[skipped])
        for at in _shown(forecast)
        for skipped in [at in forecast.skipped]
    ]


def _shown(forecast: Forecast) -> list[datetime]:
    """The next starts, and all that are skipped."""
    return sorted([*(start.instant for start in forecast.starts), *forecast.skipped])


def _day_and_time(at: datetime, draft: Draft, now: datetime) -> str:
    local, today = (moment.astimezone(ZoneInfo(draft.timezone)) for moment in (at, now))
    near = local.date() - today.date() < SOON
    return (
        f"{formats.near_day(local.date()) if near else dated(local.date(), today.date())} · {formats.wall_time(local)}"
    )


def _lasts(forecast: Forecast | None, robot: Robot | Group | None) -> str:
    """How long it takes, and how that is known."""
    if forecast is None or robot is None:
        return ""
    usual = forecast.usual
    if usual is None:
        return _("Its duration on {robot} is not known yet: {duration} are assumed").format(
            robot=robot.name, duration=formats.duration(ASSUMED_S)
        )
    if usual.typed:
        return _("{duration} as typed in Settings: no run was completed on {robot} yet").format(
            robot=robot.name, duration=formats.duration(usual.median_s)
        )
    return ngettext(
        "Usually {duration}, by its one run on {robot}",
        "Usually {duration}, by the last {n} runs on {robot}",
        usual.runs,
    ).format(duration=formats.duration(usual.median_s), n=usual.runs, robot=robot.name)


def _free(forecast: Forecast | None) -> str:
    free = forecast.free_at if forecast is not None else None
    return _("Use {time}: free").format(time=formats.wall_time(free)) if free is not None else ""
