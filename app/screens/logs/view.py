"""The Logs in words: runs as rows, a run as its story, the filters. Pure; the figures are in kpi_view.py."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from datetime import datetime, timedelta
from enum import StrEnum
from zoneinfo import ZoneInfo

from app.database.executions import Replacement
from app.domain import writing
from app.domain.clock import midnight
from app.domain.models import OPEN_STATES, DurationEstimate, Execution, ReasonCode, Robot, State, Trigger
from app.domain.reasons import sentence
from app.i18n import _, ngettext, translator
from app.screens.common import execution_appearance, formats
from app.screens.common.holding import waiting_words
from app.screens.common.mission_names import NOTHING_KNOWN, MissionNames
from app.screens.common.options import Option
from app.screens.logs import of_groups
from app.screens.logs.of_groups import OfGroup
from app.services.history.shift_report import ReportPeriod

UsualSeconds = Mapping[tuple[int | None, str], float]  # usual seconds by robot and guid

ON_TIME_S = 60.0  # later than this, the delay is shown
SEEN_LATE = timedelta(minutes=1)  # after the robot's own durations, which show that the run was seen late
AS_USUAL = 0.2  # of the usual duration: this deviation still counts as usual
LONGEST_CHIP = 26  # characters of a mission's name on its button
UNDER_WAY = "under_way"  # the outcome filter's key of what has not ended
NOT_RUN = (State.SKIPPED, State.MISSED)  # one outcome for people, named by the first


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
class Filters:
    """The filters. ``robot_id`` None: all robots; ``outcomes`` are values of ``State`` and UNDER_WAY, none: all."""

    period: Period = Period.WEEK
    robot_id: int | None = None
    outcomes: tuple[str, ...] = ()
    mission: str | None = None
    triggers: tuple[Trigger, ...] = ()
    text: str = ""
    values: tuple[str, ...] = ()  # identifiers of positions in whose names that text is
    group: OfGroup | None = None  # in place of the robot

    @property
    def states(self) -> tuple[State, ...]:
        chosen = (
            OPEN_STATES if outcome == UNDER_WAY else NOT_RUN if outcome == NOT_RUN[0] else (State(outcome),)
            for outcome in self.outcomes
        )
        return tuple(state for states in chosen for state in states)

    @property
    def robot_ids(self) -> tuple[int, ...] | None:
        """Whose figures are shown."""
        if self.group is not None:
            return self.group.members
        return None if self.robot_id is None else (self.robot_id,)

    @property
    def narrow_list(self) -> bool:
        """Whether the list shows less than the period and robot have."""
        return bool(self.outcomes or self.mission or self.triggers or self.text.strip())


def period_start(period: Period, now: datetime, zone: ZoneInfo) -> datetime | None:
    """Local midnight of its first day, in UTC; None: from the beginning."""
    if period.days is None:
        return None
    return midnight(now.astimezone(zone).date() - timedelta(days=period.days - 1), zone)


def period_end(period: Period, now: datetime, zone: ZoneInfo) -> datetime | None:
    """Local midnight after today, in UTC; None: no end."""
    return None if period.days is None else midnight(now.astimezone(zone).date() + timedelta(days=1), zone)


# ---------------------------------------------------------------------- the filters
def periods() -> list[tuple[str, str]]:
    return [
        (Period.TODAY, _("Today")),
        (Period.WEEK, _("7 days")),
        (Period.MONTH, _("30 days")),
        (Period.ALL, _("All")),
    ]


def parts() -> list[tuple[str, str]]:
    """What can be shown below the figures."""
    return [("runs", _("Runs")), ("figures", _("Figures")), ("robots", _("Robots"))]


def report_options() -> list[Option]:
    return [
        Option(ReportPeriod.SHIFT, _("This shift"), "account-clock-outline", _("The last 8 hours")),
        Option(ReportPeriod.TODAY, _("Today"), "calendar-today"),
        Option(ReportPeriod.YESTERDAY, _("Yesterday"), "calendar-arrow-left"),
        Option(ReportPeriod.WEEK, _("7 days"), "calendar-week"),
    ]


def robot_chip(filters: Filters, robots: Sequence[Robot]) -> str:
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


def outcome_chip(filters: Filters) -> str:
    """The one chosen, how many, or nothing."""
    words = [option.text for option in outcome_options() if option.key in filters.outcomes]
    return (
        words[0]
        if len(words) == 1
        else ngettext("{n} outcome", "{n} outcomes", len(words)).format(n=len(words))
        if words
        else ""
    )


def trigger_options() -> list[Option]:
    icons = {Trigger.SCHEDULED: "calendar-clock", Trigger.MANUAL: "gesture-tap", Trigger.IDLE: "sleep"}
    return [Option(trigger, execution_appearance.trigger_word(trigger), icon) for trigger, icon in icons.items()]


def trigger_chip(filters: Filters) -> str:
    return ", ".join(execution_appearance.trigger_word(trigger) for trigger in Trigger if trigger in filters.triggers)


def mission_chip(filters: Filters) -> str:
    """Its name, unless that would take all the room."""
    name = filters.mission or ""
    return name if len(name) <= LONGEST_CHIP else _("One mission")


def mission_options(names: Sequence[str]) -> list[Option]:
    return [Option("", _("All missions")), *(Option(name, name, "flag-outline") for name in names)]


def count_text(count: int, filters: Filters) -> str:
    """How many rows the list has."""
    if filters.narrow_list:
        return ngettext("{n} found, newest first", "{n} found, newest first", count).format(n=count)
    return ngettext("{n} run, newest first", "{n} runs, newest first", count).format(n=count)


def export_text(count: int) -> str:
    """The exported rows: exactly those of the list."""
    return ngettext("Export {n} run", "Export {n} runs", count).format(n=count)


def table_options() -> list[Option]:
    """Forms of the table; the key is whether it is for Excel."""
    return [
        Option(True, _("For Excel"), "microsoft-excel", _("with semicolons")),
        Option(False, "CSV", "file-delimited-outline", _("with commas, as other programs read it")),
    ]


def empty_texts(filters: Filters) -> tuple[str, str]:
    """(title, text) of a list without rows."""
    if not filters.narrow_list and filters.period is Period.ALL and filters.robot_ids is None:
        return _("Nothing has run yet"), _(
            "Every run of a schedule, of idle automation and of Run now appears here, with its outcome and the reason."
        )
    return _("Nothing found"), _("Choose a longer period, or fewer filters.")


# ---------------------------------------------------------------------- a run as a row
@dataclass(frozen=True)
class StepView:
    """One step of a run's story."""

    label: str
    time: str
    note: str
    tone: str
    last: bool


@dataclass(frozen=True)
class RunRow:
    """A run in the list; only an opened one has ``steps``, ``message`` and, if it can be run ``again``, the word for
    that."""

    key: int
    icon: str
    tone: str
    outcome: str
    mission: str
    reason: str
    robot: str
    trigger: str
    when: str
    took: str
    opened: bool
    steps: tuple[StepView, ...] = ()
    message: str = ""
    again: str = ""


RUN_AGAIN = (State.FAILED, *NOT_RUN)  # possibly still wanted


def row(
    execution: Execution,
    now: datetime,
    zone: ZoneInfo,
    usual: UsualSeconds,
    opened: bool,
    expected: DurationEstimate | None = None,
    replacement: Replacement | None = None,
    mission_names: MissionNames = NOTHING_KNOWN,
) -> RunRow:
    """``expected``: the duration of a run that has not ended, if known; ``replacement``: that it was started on another
    robot, or instead of one there; ``mission_names``: what is known of the values that missions get."""
    icon, tone = execution_appearance.LOOKS[execution.state]
    return RunRow(
        execution.id,
        icon,
        tone,
        execution_appearance.word(execution.state),
        mission_names.run(execution),
        reason_line(execution, zone, usual),
        of_groups.whose(execution),
        execution_appearance.trigger_word(execution.trigger),
        when(execution.planned_at.astimezone(zone), now.astimezone(zone)),
        formats.duration(execution.duration_s),
        opened,
        story(execution, zone, usual, expected, replacement) if opened else (),
        message(execution, mission_names) if opened else "",
        _("Run again") if opened and execution.state in RUN_AGAIN else "",
    )


class RowCache:
    """Rows of many runs: the row of an unchanged run is not built again, so that thousands can be shown within a frame."""

    def __init__(self) -> None:
        self._context: object = None  # what all rows depend on
        self._rows: dict[
            int, tuple[Execution, object, RunRow]
        ] = {}  # by run: its previous values, and what else its row depends on

    def rows(
        self,
        executions: Sequence[Execution],
        now: datetime,
        zone: ZoneInfo,
        usual: UsualSeconds,
        opened_run: int | None,
        expected: Mapping[int, DurationEstimate],
        replacements: Mapping[int, Replacement],
        mission_names: MissionNames = NOTHING_KNOWN,
    ) -> list[RunRow]:
        """``row`` of each; ``opened_run`` is the id of the one that shows its story, ``expected`` goes by the id of what has not ended."""
        context = now.astimezone(zone).date(), zone, translator.language, mission_names
        known = self._rows if context == self._context else {}
        self._context, self._rows = context, {}
        for execution in executions:
            further = expected.get(execution.id), replacements.get(execution.id)
            details = usual.get((execution.robot_id, execution.mission_guid)), execution.id == opened_run, further
            before = known.get(execution.id)
            if before is not None and details == before[1] and (execution is before[0] or execution == before[0]):
                self._rows[execution.id] = execution, details, before[2]
            else:
                line = row(execution, now, zone, usual, execution.id == opened_run, *further, mission_names)
                self._rows[execution.id] = execution, details, line
        return [line for _execution, _details, line in self._rows.values()]


def when(at: datetime, now: datetime) -> str:
    """Local times: 14:15 of today, Mon 14:15 within a week, 16 Nov 14:15 before; short, so that the columns of the list stay in line."""
    time_of_day = formats.wall_time(at)
    days = (now.date() - at.date()).days
    if days == 0:
        return time_of_day
    weekday, _space, day = formats.wall_day(at.date(), year=at.year != now.year).partition(" ")
    return f"{weekday if 0 < days < 7 else day} {time_of_day}"


def reason_line(execution: Execution, zone: ZoneInfo, usual: UsualSeconds) -> str:
    """Why it ended so, in one sentence; empty if everything was normal."""
    if execution.state.is_open:
        return waiting_words(execution, str(zone))
    if execution.reason is not None:
        return sentence(execution.reason, zone, _)
    if execution.state is not State.COMPLETED:
        return "–"
    return _completed(execution, usual)


def _completed(execution: Execution, usual: UsualSeconds) -> str:
    """In what it was out of the ordinary, if it was: late, longer or shorter. Whole sentences: translations can't be joined."""
    length = _length(execution, usual)
    late = _late_s(execution)
    if execution.trigger is not Trigger.SCHEDULED or late is None or late <= ON_TIME_S:
        return {"longer": _("Longer than usual"), "shorter": _("Shorter than usual")}.get(length, "")
    text = {
        "longer": _("Started {late} late, longer than usual"),
        "shorter": _("Started {late} late, shorter than usual"),
    }.get(length, _("Started {late} late"))
    return text.format(late=formats.rough_duration(late))


def _late_s(execution: Execution) -> float | None:
    """The delay after the planned time: until it was sent, and then in the robot's queue."""
    if execution.submitted_at is None:
        return None
    return (execution.submitted_at - execution.planned_at).total_seconds() + (execution.robot_delay_s or 0.0)


def _length(execution: Execution, usual: UsualSeconds) -> str:
    """Against the usual duration: "usual", "longer", "shorter", or empty when one of them is not known."""
    expected = usual.get((execution.robot_id, execution.mission_guid))
    if not expected or execution.duration_s is None:
        return ""
    share = execution.duration_s / expected
    return "usual" if abs(share - 1) <= AS_USUAL else "longer" if share > 1 else "shorter"


# ---------------------------------------------------------------------- its story
def story(
    execution: Execution,
    zone: ZoneInfo,
    usual: UsualSeconds,
    expected: DurationEstimate | None = None,
    replacement: Replacement | None = None,
) -> tuple[StepView, ...]:
    """planned → submitted → started → ended, as far as it went; with dates if there are several days."""
    started_at, ran_until = _really_ran(execution)
    ended_at = skipped_at(execution) or ran_until
    left = replacement if replacement is not None and replacement.id == execution.id else None
    instants = (execution.planned_at, execution.submitted_at, started_at, ended_at, left.at if left else None)
    with_day = len({at.astimezone(zone).date() for at in instants if at is not None}) > 1

    def time(at: datetime | None) -> str:
        there = None if at is None else at.astimezone(zone)
        return " ".join(
            [*([formats.wall_day(there.date())] if there and with_day else []), formats.wall_time(there, seconds=True)]
        )

    attempts = ngettext("{n} attempt", "{n} attempts", execution.attempts).format(n=execution.attempts)
    steps = [(_("Planned"), time(execution.planned_at), _planned_note(execution, replacement))]
    steps += of_groups.steps(execution, zone)
    if execution.submitted_at is not None:
        steps.append((_("Submitted"), time(execution.submitted_at), attempts))
    elif execution.attempts:
        steps.append((_("Tried"), attempts, _("none accepted")))
    if left is not None:
        steps.append(
            (_("Elsewhere"), time(left.at), _("a person started it on {robot} instead").format(robot=left.other_robot))
        )
    if started_at is not None:
        steps.append((_("Started"), time(started_at), _queue_note(execution)))
    state = execution_appearance.word(execution.state)
    seen = _("seen at {time}").format(time=time(execution.ended_at)) if ran_until != execution.ended_at else ""
    steps.append(
        (state, "–", _open_note(expected))
        if execution.state.is_open
        else (state, time(ended_at), " · ".join(filter(None, (_end_note(execution, usual), seen))))
    )
    last = len(steps) - 1
    return tuple(
        StepView(*step, _last_tone(execution.state) if n == last else "neutral", n == last)
        for n, step in enumerate(steps)
    )


def _really_ran(execution: Execution) -> tuple[datetime | None, datetime | None]:
    """When it started and ended, as this tablet saw it. If it saw that much later (it was off, or the answer was lost),
    by the robot's own durations from the submission."""
    started_at, ended_at = execution.started_at, execution.ended_at
    if started_at is None or execution.submitted_at is None or execution.robot_delay_s is None:
        return started_at, ended_at
    began = execution.submitted_at + timedelta(seconds=execution.robot_delay_s)
    started_at = began if started_at - began > SEEN_LATE else started_at
    if ended_at is None or execution.duration_s is None:
        return started_at, ended_at
    done = started_at + timedelta(seconds=execution.duration_s)
    return started_at, done if ended_at - done > SEEN_LATE else ended_at


def skipped_at(execution: Execution) -> datetime | None:
    """When a person skipped it, where one did."""
    at = execution.reason.details.get("skipped_at") if execution.reason else None
    return datetime.fromisoformat(at) if isinstance(at, str) else None


def _last_tone(state: State) -> str:
    return "neutral" if state is State.COMPLETED else execution_appearance.LOOKS[state][1]


def _planned_note(execution: Execution, replacement: Replacement | None) -> str:
    """Whether it is the last of several, what started it, its group, and which start it replaces."""
    last = _("the last of {n}").format(n=writing.count(execution.starts, _)) if execution.starts > 1 else ""
    started_by = execution.own_name or execution_appearance.trigger_word(execution.trigger)
    instead = (
        _("instead of the start on {robot}").format(robot=replacement.robot)
        if replacement and replacement.other == execution.id
        else ""
    )
    return " · ".join(filter(None, (last, started_by, of_groups.any_of(execution), instead)))


def _queue_note(execution: Execution) -> str:
    """How long it waited in the robot's queue."""
    if execution.robot_delay_s is None:
        return ""
    if execution.robot_delay_s < 1:
        return _("no wait")
    return _("after {duration} in the queue").format(duration=formats.duration(execution.robot_delay_s))


def _open_note(expected: DurationEstimate | None) -> str:
    """Its expected duration and the source of that."""
    if expected is None:
        return _("not ended yet")
    text = (
        _("not ended yet, {duration} as typed in Settings")
        if expected.typed
        else _("not ended yet, usually {duration}")
    )
    return text.format(duration=formats.duration(expected.median_s))


def _end_note(execution: Execution, usual: UsualSeconds) -> str:
    if execution.duration_s is None:
        return ""
    expected = usual.get((execution.robot_id, execution.mission_guid))
    if expected and execution.state is State.COMPLETED:
        return _("after {duration}, usually {usual}").format(
            duration=formats.duration(execution.duration_s), usual=formats.duration(expected)
        )
    return _("after {duration}").format(duration=formats.duration(execution.duration_s))


def message(execution: Execution, mission_names: MissionNames = NOTHING_KNOWN) -> str:
    """What it was given; below that the robot's message, and the number of its queue item."""
    return "\n".join(
        filter(None, (mission_names.line(execution.mission_guid, execution.parameters), _robot_message(execution)))
    )


def _robot_message(execution: Execution) -> str:
    text = (
        execution.reason.details.get("message")
        if execution.reason and execution.reason.code is ReasonCode.ROBOT_ABORTED
        else None
    )
    item = execution.queue_id
    if text and item is not None:
        return _("Robot: {message} (queue item {n})").format(message=text, n=item)
    if text:
        return _("Robot: {message}").format(message=text)
    return _("Queue item {n} of the robot").format(n=item) if item is not None else ""
