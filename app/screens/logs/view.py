"""The runs of the Logs in words: the filters, how many runs ended how, each run as a row. Pure; story.py has a run's story."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from datetime import date, datetime, timedelta
from enum import StrEnum
from itertools import groupby
from zoneinfo import ZoneInfo

from app.domain.clock import DAY, midnight
from app.domain.execution import OPEN_STATES, DurationEstimate, Execution, Reason, ReasonCode, State, Trigger
from app.domain.models import Robot
from app.domain.reasons import sentence
from app.i18n import _, ngettext
from app.screens.common import execution_appearance, formats
from app.screens.common.holding import waiting_words
from app.screens.common.mission_names import NOTHING_KNOWN, MissionNames
from app.screens.common.robot_texts import problem_of
from app.screens.logs import of_groups
from app.screens.logs.of_groups import OfGroup
from app.services.history.figures import kind_of
from app.services.history.shift_report import ReportPeriod
from app.widgets.items import Item, Option

ON_TIME_S = 60.0  # later than this, the delay is shown
UNDER_WAY = "under_way"  # the outcome filter's key of what has not ended
NOT_RUN = (State.SKIPPED, State.MISSED)  # one outcome for people, named by the first
COUNTED = (State.COMPLETED, State.FAILED, NOT_RUN[0])  # outcomes whose numbers are shown
PROBLEMS = (str(State.FAILED), str(NOT_RUN[0]))  # the filter that folds equal causes


class Period(StrEnum):
    """Whole days up to today, in the zone of the settings; the shortest first. ALL includes future days: starts that
    are skipped in advance."""

    TODAY = "today"
    WEEK = "week"
    MONTH = "month"
    ALL = "all"

    @property
    def days(self) -> int | None:
        return {Period.TODAY: 1, Period.WEEK: 7, Period.MONTH: 30}.get(self)


@dataclass(frozen=True)
class Like:
    """Runs that ended for one cause. ``part``: what the robot's messages have in common, if the robot ended them."""

    words: str
    code: ReasonCode
    part: str = ""


@dataclass(frozen=True)
class Filters:
    """The filters. ``robot_id`` None: all robots; ``outcomes`` are values of ``State`` and UNDER_WAY, none: all; ``day``: that one
    only, instead of the period."""

    period: Period = Period.WEEK
    robot_id: int | None = None
    outcomes: tuple[str, ...] = ()
    mission: str | None = None
    triggers: tuple[Trigger, ...] = ()
    text: str = ""
    values: tuple[str, ...] = ()  # identifiers of positions in whose names that text is
    group: OfGroup | None = None  # in place of the robot
    day: date | None = None
    like: Like | None = None  # in place of the text

    @property
    def states(self) -> tuple[State, ...]:
        return tuple(state for outcome in self.outcomes for state in states_of(outcome))

    @property
    def robot_ids(self) -> tuple[int, ...] | None:
        """Whose figures are shown."""
        if self.group is not None:
            return self.group.members
        return None if self.robot_id is None else (self.robot_id,)

    @property
    def folds(self) -> bool:
        """Whether runs that ended for the same cause are one row."""
        return self.outcomes == PROBLEMS and self.like is None

    def span(self, now: datetime, zone: ZoneInfo) -> tuple[datetime | None, datetime | None]:
        """From its first local midnight, in UTC, to that after its last day; None: without a limit."""
        today, days = now.astimezone(zone).date(), self.period.days
        first, last = (self.day, self.day) if self.day else (today - (days - 1) * DAY, today) if days else (None, None)
        return midnight(first, zone) if first else None, midnight(last + DAY, zone) if last else None


def states_of(outcome: str) -> Sequence[State]:
    return OPEN_STATES if outcome == UNDER_WAY else NOT_RUN if outcome == NOT_RUN[0] else (State(outcome),)


# ---------------------------------------------------------------------- the filters
def period_options() -> list[Option]:
    words = (_("Today"), _("7 days"), _("30 days"), _("All"))
    return [Option(period, word) for period, word in zip(Period, words, strict=True)]


def period_word(period: Period) -> str:
    return next(option.text for option in period_options() if option.key == period)


def counts(numbers: Mapping[State, int], filters: Filters) -> list[Option]:
    """How many runs ended how, whatever outcomes are asked for; nothing before the first one has."""
    found = [sum(numbers.get(state, 0) for state in states_of(outcome)) for outcome in COUNTED]
    if not any(found) and not filters.outcomes:
        return []
    texts = (
        ngettext("{n} completed", "{n} completed", found[0]),
        ngettext("{n} failed", "{n} failed", found[1]),
        ngettext("{n} not run", "{n} not run", found[2]),
    )
    return [
        Option(
            str(outcome),
            text.format(n=formats.count(number)),
            icon,
            selected=filters.outcomes == (str(outcome),),
            tone=tone,
        )
        for outcome, text, number in zip(COUNTED, texts, found, strict=True)
        for icon, tone in [execution_appearance.LOOKS[outcome]]
    ]


def set_filters(filters: Filters, robots: Sequence[Robot]) -> list[Option]:
    """What narrows the list, each with the name of the field that a tap clears; not what is marked elsewhere."""
    is_marked = len(filters.outcomes) == 1 and filters.outcomes[0] in COUNTED
    words = {
        "outcomes": "" if is_marked else _outcomes_word(filters),
        "robot": robot_word(filters, robots) if filters.robot_ids is not None else "",
        "mission": filters.mission or "",
        "triggers": ", ".join(execution_appearance.trigger_word(each) for each in Trigger if each in filters.triggers),
        "day": formats.wall_day(filters.day) if filters.day else "",
        "like": filters.like.words if filters.like else "",
    }
    return [Option(key, word, "close", selected=True) for key, word in words.items() if word]


def cleared(filters: Filters, key: str) -> Filters:
    """Without one of ``set_filters``."""
    if key == "robot":
        return replace(filters, robot_id=None, group=None)
    return replace(filters, **{key: getattr(Filters(), key)})


def filter_menu() -> list[Option]:
    return [
        Option("problems", _("Problems"), "alert-circle-outline"),
        Option("outcomes", _("Outcome"), "list-status"),
        Option("robot", _("Robot"), "robot-outline"),
        Option("mission", _("Mission"), "flag-outline"),
        Option("triggers", _("Started by"), "gesture-tap"),
    ]


def robot_word(filters: Filters, robots: Sequence[Robot]) -> str:
    if filters.group is not None:
        return _("Any of {group}").format(group=filters.group.name)
    return next((robot.name for robot in robots if robot.id == filters.robot_id), _("All robots"))


def outcome_options() -> list[Option]:
    ended = (State.COMPLETED, State.FAILED, State.CANCELLED, NOT_RUN[0])
    return [
        *(
            Option(str(state), execution_appearance.word(state), execution_appearance.LOOKS[state][0])
            for state in ended
        ),
        Option(UNDER_WAY, _("Under way"), execution_appearance.LOOKS[State.EXECUTING][0]),
    ]


def _outcomes_word(filters: Filters) -> str:
    if filters.outcomes == PROBLEMS:
        return _("Problems")
    return ", ".join(option.text for option in outcome_options() if option.key in filters.outcomes)


def trigger_options() -> list[Option]:
    icons = {Trigger.SCHEDULED: "calendar-clock", Trigger.MANUAL: "gesture-tap", Trigger.IDLE: "sleep"}
    return [Option(trigger, execution_appearance.trigger_word(trigger), icon) for trigger, icon in icons.items()]


def mission_options(names: Sequence[str]) -> list[Option]:
    return [Option("", _("All missions")), *(Option(name, name, "flag-outline") for name in names)]


def report_options() -> list[Option]:
    return [
        Option(ReportPeriod.SHIFT, _("This shift"), "account-clock-outline", _("The last 8 hours")),
        Option(ReportPeriod.TODAY, _("Today"), "calendar-today"),
        Option(ReportPeriod.YESTERDAY, _("Yesterday"), "calendar-arrow-left"),
        Option(ReportPeriod.WEEK, _("7 days"), "calendar-week"),
    ]


def export_text(count: int) -> str:
    """The exported rows: exactly those of the list."""
    return ngettext("Export {n} run", "Export {n} runs", count).format(n=count)


def table_options() -> list[Option]:
    """Forms of the table; the key is whether it is for Excel."""
    return [
        Option(True, _("For Excel"), "microsoft-excel", _("with semicolons")),
        Option(False, "CSV", "file-delimited-outline", _("with commas, as other programs read it")),
    ]


def empty_text(filters: Filters) -> str:
    if filters != Filters(filters.period):
        return _("Nothing found")
    return _("Nothing has run yet") if filters.period is Period.ALL else _("Nothing ran in this time")


# ---------------------------------------------------------------------- a run as a row
def row(
    execution: Execution,
    now: datetime,
    zone: ZoneInfo,
    expected: DurationEstimate | None = None,
    mission_names: MissionNames = NOTHING_KNOWN,
) -> Item:
    """``expected``: the duration of a run that has not ended, if known; ``mission_names``: what is known of the values that
    missions get."""
    icon, tone = execution_appearance.LOOKS[execution.state]
    return Item(
        execution.id,
        mission_names.run(execution),
        place=of_groups.whose(execution),
        meta=outcome_line(execution, now, zone, expected),
        lead=formats.wall_time(execution.planned_at.astimezone(zone)),
        icon=icon,
        tone=tone,
        meta_tone=tone if tone in ("fault", "attention") else "",
        strong=False,
    )


def listed(
    runs: Sequence[Execution],
    folds: bool,
    now: datetime,
    zone: ZoneInfo,
    expected: Mapping[int, DurationEstimate],
    mission_names: MissionNames = NOTHING_KNOWN,
) -> list[Item]:
    """Runs as rows below the names of their days, if it ``folds`` one for each cause; ``expected`` goes by the id of what has not ended."""
    found, today = list[Item](), now.astimezone(zone).date()
    pairs = folded(runs, zone) if folds else ((run, 1) for run in runs)
    for day, of_day in groupby(pairs, lambda pair: pair[0].planned_at.astimezone(zone).date()):
        found.append(Item(f"day {day}", day_word(day, today), look="head", opens=False))
        for run, number in of_day:
            item = row(run, now, zone, expected.get(run.id), mission_names)
            like = like_of(run, zone) if number > 1 else None
            found.append(several(item, like, number) if like else item)
    return found


def day_word(day: date, today: date) -> str:
    if day == today:
        return _("Today")
    return _("Yesterday") if day == today - DAY else formats.wall_day(day, year=day.year != today.year)


def folded(executions: Sequence[Execution], zone: ZoneInfo) -> Iterator[tuple[Execution, int]]:
    """The newest run of each cause, and how many there are."""
    number, newest = Counter[object](), dict[object, Execution]()
    for run in executions:
        key = like_of(run, zone) or run.id
        number[key] += 1
        newest.setdefault(key, run)
    return ((run, number[key]) for key, run in newest.items())


def several(item: Item, like: Like, number: int) -> Item:
    """The row of several runs that ended for one cause."""
    return replace(item, title=f"{like.words} ×{number}", meta="", place="")


# ---------------------------------------------------------------------- why
def like_of(execution: Execution, zone: ZoneInfo) -> Like | None:
    """The runs that ended for the same cause as this one, with the same message of the robot."""
    if execution.reason is None:
        return None
    message = execution_appearance.said_by_robot(execution)
    words = problem_of(message).words or message or sentence(Reason(execution.reason.code), zone, _)
    return Like(words, execution.reason.code, message)


def like_kind(words: str, code: ReasonCode, kind: str) -> Like:
    """The runs of a kind of message: of its longest part without names and numbers."""
    return Like(words, code, max(kind_of(kind).split("…"), key=len).strip())


def outcome_line(execution: Execution, now: datetime, zone: ZoneInfo, expected: DurationEstimate | None = None) -> str:
    """How it ended, or how far it is, in one line."""
    if execution.state is State.EXECUTING:
        return _working(execution, now, expected)
    if execution.state.is_open:
        return waiting_words(execution, str(zone))
    if execution.state is not State.COMPLETED:
        return execution_appearance.cause(execution, zone)[0] or execution_appearance.word(execution.state)
    took, late = formats.rough_duration(execution.duration_s), _late_s(execution)
    if execution.trigger is not Trigger.SCHEDULED or late is None or late <= ON_TIME_S:
        return took
    return _("{duration}, started {late} late").format(duration=took, late=formats.rough_duration(late))


def _working(execution: Execution, now: datetime, expected: DurationEstimate | None) -> str:
    word = execution_appearance.word(execution.state)
    if expected is None or execution.started_at is None:
        return word
    left = execution.started_at + timedelta(seconds=expected.median_s) - now
    if left.total_seconds() < ON_TIME_S:
        return word
    return _("Working, about {time} left").format(time=formats.rough_duration(left.total_seconds()))


def _late_s(execution: Execution) -> float | None:
    """The delay after the planned time: until it was sent, and then in the robot's queue."""
    if execution.submitted_at is None:
        return None
    return (execution.submitted_at - execution.planned_at).total_seconds() + (execution.robot_delay_s or 0.0)
