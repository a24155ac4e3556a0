"""The Logs in words: runs as rows, a run as its story, what is filtered. Pure; the figures are logs_kpi_view's."""
from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from datetime import UTC, datetime, time, timedelta
from enum import StrEnum
from typing import Any
from zoneinfo import ZoneInfo

from app.domain.models import OPEN_STATES, DurationEstimate, Execution, ReasonCode, Robot, State, Trigger
from app.domain.reasons import sentence, waiting_sentence
from app.i18n import _, ngettext
from app.screens.common import execution_appearance, formats
from app.services.history.shift_report import ReportPeriod

Row = dict[str, Any]
UsualSeconds = Mapping[tuple[int | None, str], float]       # usual seconds by robot and guid

ON_TIME_S = 60.0             # submitted later than this is told
AS_USUAL = 0.2               # of the usual duration, within which a run took as long as usual
LONGEST_CHIP = 26            # characters of a mission's name on its chip
UNDER_WAY = "under_way"      # the outcome filter's word for what has not ended


class Period(StrEnum):
    """Whole days up to now, in the zone of the settings."""
    TODAY = "today"
    WEEK = "week"
    MONTH = "month"
    ALL = "all"

    @property
    def days(self) -> int | None:
        return {Period.TODAY: 1, Period.WEEK: 7, Period.MONTH: 30}.get(self)


@dataclass(frozen=True)
class Chosen:
    """What is looked at. ``robot_id`` None: all; ``outcomes`` are states' values and UNDER_WAY, none: all."""
    period: Period = Period.WEEK
    robot_id: int | None = None
    outcomes: tuple[str, ...] = ()
    mission: str | None = None
    triggers: tuple[Trigger, ...] = ()
    text: str = ""

    @property
    def states(self) -> tuple[State, ...]:
        ended = tuple(State(outcome) for outcome in self.outcomes if outcome != UNDER_WAY)
        return (*ended, *(OPEN_STATES if UNDER_WAY in self.outcomes else ()))

    @property
    def narrows(self) -> bool:
        """Whether the list shows less than the period and robot have."""
        return bool(self.outcomes or self.mission or self.triggers or self.text.strip())


def period_start(period: Period, now: datetime, zone: ZoneInfo) -> datetime | None:
    """Local midnight of its first day, in UTC; None: from the beginning."""
    if period.days is None:
        return None
    first = now.astimezone(zone).date() - timedelta(days=period.days - 1)
    return datetime.combine(first, time(), zone).astimezone(UTC)


# ---------------------------------------------------------------------- the filters
def periods() -> list[tuple[str, str]]:
    return [(Period.TODAY, _("Today")), (Period.WEEK, _("7 days")), (Period.MONTH, _("30 days")), (Period.ALL, _("All"))]


def parts() -> list[tuple[str, str]]:
    """What can stand below the figures."""
    return [("runs", _("Runs")), ("figures", _("Figures")), ("robots", _("Robots"))]


def report_options() -> list[Row]:
    return [{"key": ReportPeriod.SHIFT, "text": _("This shift"), "note": _("The last 8 hours"), "icon": "account-clock-outline"},
            {"key": ReportPeriod.TODAY, "text": _("Today"), "icon": "calendar-today"},
            {"key": ReportPeriod.YESTERDAY, "text": _("Yesterday"), "icon": "calendar-arrow-left"},
            {"key": ReportPeriod.WEEK, "text": _("7 days"), "icon": "calendar-week"}]


def robot_chip(chosen: Chosen, robots: Sequence[Robot]) -> str:
    return next((robot.name for robot in robots if robot.id == chosen.robot_id), _("All robots"))


def robot_options(robots: Sequence[Robot]) -> list[Row]:
    return [{"key": 0, "text": _("All robots")}, *({"key": robot.id, "text": robot.name, "note": robot.model or ""} for robot in robots)]


def outcome_options() -> list[Row]:
    ended = (State.COMPLETED, State.FAILED, State.CANCELLED, State.SKIPPED, State.MISSED)
    return [*({"key": str(state), "text": execution_appearance.word(state), "icon": execution_appearance.LOOKS[state][0]}
              for state in ended),
            {"key": UNDER_WAY, "text": _("Under way"), "icon": execution_appearance.LOOKS[State.EXECUTING][0]}]


def outcome_chip(chosen: Chosen) -> str:
    """The one chosen, how many, or nothing."""
    words = [option["text"] for option in outcome_options() if option["key"] in chosen.outcomes]
    return words[0] if len(words) == 1 else ngettext("{n} outcome", "{n} outcomes", len(words)).format(n=len(words)) if words else ""


def trigger_options() -> list[Row]:
    icons = {Trigger.SCHEDULED: "calendar-clock", Trigger.MANUAL: "gesture-tap", Trigger.IDLE: "sleep"}
    return [{"key": trigger, "text": execution_appearance.trigger_word(trigger), "icon": icon} for trigger, icon in icons.items()]


def trigger_chip(chosen: Chosen) -> str:
    return ", ".join(execution_appearance.trigger_word(trigger) for trigger in Trigger if trigger in chosen.triggers)


def mission_chip(chosen: Chosen) -> str:
    """Its name, unless that would take all the room."""
    name = chosen.mission or ""
    return name if len(name) <= LONGEST_CHIP else _("One mission")


def mission_options(names: Sequence[str]) -> list[Row]:
    return [{"key": "", "text": _("All missions"), "icon": ""}, *({"key": name, "text": name, "icon": "flag-outline"} for name in names)]


def found(count: int, chosen: Chosen) -> str:
    """How many rows the list has."""
    if chosen.narrows:
        return ngettext("{n} found, newest first", "{n} found, newest first", count).format(n=count)
    return ngettext("{n}, newest first", "{n}, newest first", count).format(n=count)


def nothing(chosen: Chosen) -> tuple[str, str]:
    """What stands where there are no rows: (title, text)."""
    if not chosen.narrows and chosen.period is Period.ALL and chosen.robot_id is None:
        return _("Nothing has run yet"), \
            _("Every run of a schedule, of idle automation and of Run now stands here, with how it went and why.")
    return _("Nothing found"), _("Choose a longer period, or fewer filters.")


# ---------------------------------------------------------------------- a run as a row
def row(execution: Execution, now: datetime, zone: ZoneInfo, usual: UsualSeconds, opened: bool, narrow: bool = False,
        expected: DurationEstimate | None = None) -> Row:
    """``expected``: how long one that is open will take, as far as anybody knows."""
    line: Row = {
        "key": execution.id, **execution_appearance.look(execution), "mission": execution.mission,
        "reason": reason_line(execution, zone, usual),
        "robot": execution.robot, "trigger": execution_appearance.trigger_word(execution.trigger),
        "when": when(execution.planned_at.astimezone(zone), now.astimezone(zone)), "took": formats.duration(execution.duration_s),
        "opened": opened, "narrow": narrow}
    if opened:
        line |= {"steps": story(execution, zone, usual, expected), "message": message(execution)}
    return line


class RowCache:
    """Rows of many runs: a run that is as it was isn't put into words again, so that thousands can be shown anew within a frame."""

    def __init__(self) -> None:
        self._alike: object = None                       # what all rows rest on
        self._rows: dict[int, tuple[Execution, object, Row]] = {}        # by run: as it was, what else its row rests on

    def forget(self) -> None:
        """The language is another one."""
        self._rows = {}

    def rows(self, executions: Sequence[Execution], now: datetime, zone: ZoneInfo, usual: UsualSeconds, told: int | None,
             narrow: bool, expected: Mapping[int, DurationEstimate]) -> list[Row]:
        """``row`` of each; ``told`` is the one that is opened, ``expected`` goes by the id of what has not ended."""
        alike = now.astimezone(zone).date(), zone, narrow
        known = self._rows if alike == self._alike else {}
        self._alike, self._rows = alike, {}
        for execution in executions:
            details = usual.get((execution.robot_id, execution.mission_guid)), execution.id == told, expected.get(execution.id)
            before = known.get(execution.id)
            if before is not None and details == before[1] and (execution is before[0] or execution == before[0]):
                self._rows[execution.id] = execution, details, before[2]
            else:
                line = row(execution, now, zone, usual, execution.id == told, narrow, expected.get(execution.id))
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
    """Why it went as it did, in one sentence."""
    if execution.state.is_open:
        return waiting_sentence(execution, zone, _)
    if execution.reason is not None:
        return sentence(execution.reason, zone, _)
    if execution.state is not State.COMPLETED:
        return "–"
    return _completed(execution, usual)


def _completed(execution: Execution, usual: UsualSeconds) -> str:
    """How punctual and how long, as whole sentences: their halves must not be joined."""
    length = _length(execution, usual)
    late = _late_s(execution)
    if execution.trigger is not Trigger.SCHEDULED:
        return {"": "", "usual": _("As long as usual"), "longer": _("Longer than usual"), "shorter": _("Shorter than usual")}[length] or \
            (_("After a time without work") if execution.trigger is Trigger.IDLE else _("Started by a person"))
    if late is None or late <= ON_TIME_S:
        return {"": _("Started on time"), "usual": _("Started on time, as long as usual"),
                "longer": _("Started on time, longer than usual"), "shorter": _("Started on time, shorter than usual")}[length]
    text = {"": _("Started {late} late"), "usual": _("Started {late} late, as long as usual"),
            "longer": _("Started {late} late, longer than usual"), "shorter": _("Started {late} late, shorter than usual")}[length]
    return text.format(late=formats.rough_duration(late))


def _late_s(execution: Execution) -> float | None:
    """How much later than planned the robot began it: until it was sent, and what it then waited in the robot's queue."""
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
def story(execution: Execution, zone: ZoneInfo, usual: UsualSeconds, expected: DurationEstimate | None = None) -> list[Row]:
    """planned → submitted → started → ended, as far as it came."""
    steps = [_step(_("Planned"), execution.planned_at, zone, _planned_note(execution))]
    if execution.submitted_at is not None:
        steps.append(_step(_("Submitted"), execution.submitted_at, zone,
                           ngettext("{n} attempt", "{n} attempts", execution.attempts).format(n=execution.attempts)))
    elif execution.attempts:
        steps.append({"label": _("Tried"), "time": ngettext("{n} attempt", "{n} attempts", execution.attempts).format(n=execution.attempts),
                      "note": _("none accepted")})
    if execution.started_at is not None:
        steps.append(_step(_("Started"), execution.started_at, zone, _queue_note(execution)))
    if execution.state.is_open:
        steps.append({"label": execution_appearance.word(execution.state), "time": "–", "note": _open_note(expected),
                      "tone": execution_appearance.LOOKS[execution.state][1]})
    else:
        steps.append({**_step(execution_appearance.word(execution.state), execution.ended_at, zone, _end_note(execution, usual)),
                      "tone": _end_tone(execution.state)})
    return [{"tone": "neutral", **step, "key": n, "last": n == len(steps) - 1} for n, step in enumerate(steps)]


def _step(label: str, at: datetime | None, zone: ZoneInfo, note: str) -> Row:
    return {"label": label, "time": "–" if at is None else formats.wall_time(at.astimezone(zone), seconds=True), "note": note}


def _end_tone(state: State) -> str:
    tone = execution_appearance.LOOKS[state][1]
    return "neutral" if state is State.COMPLETED else tone


def _planned_note(execution: Execution) -> str:
    """What asked for it."""
    return execution.schedule or execution_appearance.trigger_word(execution.trigger)


def _queue_note(execution: Execution) -> str:
    """How long it stood in the robot's queue."""
    if execution.robot_delay_s is None:
        return ""
    if execution.robot_delay_s < 1:
        return _("no wait")
    return _("after {duration} in the queue").format(duration=formats.duration(execution.robot_delay_s))


def _open_note(expected: DurationEstimate | None) -> str:
    """How long it will take, and who says so."""
    if expected is None:
        return _("not ended yet")
    text = _("not ended yet, {duration} as typed in Settings") if expected.typed else _("not ended yet, usually {duration}")
    return text.format(duration=formats.duration(expected.median_s))


def _end_note(execution: Execution, usual: UsualSeconds) -> str:
    if execution.duration_s is None:
        return ""
    expected = usual.get((execution.robot_id, execution.mission_guid))
    if expected and execution.state is State.COMPLETED:
        return _("after {duration}, usually {usual}").format(duration=formats.duration(execution.duration_s),
                                                             usual=formats.duration(expected))
    return _("after {duration}").format(duration=formats.duration(execution.duration_s))


def message(execution: Execution) -> str:
    """What the robot said, and the number of its queue item."""
    said = execution.reason.details.get("message") if execution.reason and execution.reason.code is ReasonCode.ROBOT_ABORTED else None
    item = execution.queue_id
    if said and item is not None:
        return _("Robot: {message} (queue item {n})").format(message=said, n=item)
    if said:
        return _("Robot: {message}").format(message=said)
    return _("Queue item {n} of the robot").format(n=item) if item is not None else ""
