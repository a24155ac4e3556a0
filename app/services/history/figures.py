"""Key figures: executions that ended in a period, counted once as ``Facts``, and tables of the figures computed from
them. Pure. ``docs/kpis.md`` has the tables in words, ``kpis`` reads their data.
"""

from __future__ import annotations

import re
from collections import Counter, defaultdict
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from datetime import date
from enum import StrEnum
from typing import Any, Generic, TypeVar

from app.database.kpi import Count
from app.domain.execution import ENDED_STATES, STATE_OF_REASON, ReasonCode, State
from app.domain.writing import Translate
from app.services.planning.durations import percentile

LATE_S = 60.0  # after the planned instant; a start within it is on time
_CODES = {code.value: code for code in STATE_OF_REASON}
_AT_THE_ROBOT = (ReasonCode.ROBOT_ABORTED, ReasonCode.VANISHED)  # ended there, so it did run
_MAY_HAVE_RUN = (ReasonCode.USER_CANCELLED, ReasonCode.QUEUE_CLEARED)  # ran if the robot had accepted it


@dataclass(frozen=True)
class Facts:
    """Executions that ended in a period, on a day of it, or on one robot. Numbers are starts; times are in s."""

    completed: int = 0
    failed: int = 0
    cancelled: int = 0  # a person's decision is not a failure
    skipped: int = 0
    missed: int = 0
    timed: int = 0  # completed ones whose duration is known
    completed_s: float = 0.0  # their durations together
    mission_s: float = 0.0  # the robots' own durations of everything that ran, however it ended
    planned: int = 0  # by schedules
    ran: int = 0  # of these: reached the robot's queue and were carried out or tried there
    not_run: Mapping[ReasonCode, int] = field(default_factory=dict)  # the others by why, most frequent first
    recorded_days: int = 0  # local days on which something ended
    observed_s: float = 0.0  # observed time of the robots, without gaps of the app and of the connection
    charging_s: float = 0.0  # of observed_s
    robots: Sequence[Facts] = ()  # in order of name
    robot_id: int = 0
    robot: str = ""
    is_any: bool = (
        False  # runs that any robot of a fleet was asked for, under its name: which robot had them is not known
    )
    day: date | None = None

    @property
    def total(self) -> int:
        return self.completed + self.failed + self.cancelled + self.skipped + self.missed

    def value(self, key: str) -> float | None:
        """One of FIGURES; None without data."""
        return FIGURES[key].compute(self)


@dataclass(frozen=True)
class Delays:
    """Of the newest planned runs that started (at most 5,000): seconds, shortest first."""

    starts: Sequence[float] = ()  # from the planned instant to the start on the robot
    accepted: Sequence[float] = ()  # of that, until the robot had accepted it
    queued: Sequence[float] = ()  # and waiting in the robot's queue
    runs: Sequence[float] = ()  # on the robot, where that is known

    @property
    def late(self) -> int:
        """How many started more than a minute after the planned instant."""
        return sum(delay > LATE_S for delay in self.starts)

    def value(self, key: str) -> float | None:
        """One of DELAY_FIGURES."""
        return DELAY_FIGURES[key].compute(self)


@dataclass(frozen=True)
class GroupFacts:
    """``starts``: planned ones that ended in the period, except those that a person cancelled; ``in_time``: of these,
    on a robot within a minute. ``waits`` for a robot: seconds, shortest first, of the newest (at most 5,000) that were
    sent. ``used``: utilisation of its robots, by name."""

    group_id: int
    group: str
    starts: int = 0
    in_time: int = 0
    waits: Sequence[float] = ()
    used: Sequence[tuple[str, float]] = ()

    def value(self, key: str) -> float | None:
        """One of GROUP_FIGURES."""
        return GROUP_FIGURES[key].compute(self)


# ---------------------------------------------------------------------- the table
class Unit(StrEnum):
    SHARE = "share"  # 0..1
    POINTS = "points"  # between two shares
    SECONDS = "seconds"
    NUMBER = "number"


F = TypeVar("F")


@dataclass(frozen=True)
class Figure(Generic[F]):
    """``compute`` returns None without data."""

    title: str
    unit: Unit
    compute: Callable[[F], float | None]
    explain: str = ""  # if the title is not enough
    digits: int = 1  # of a share, in percent


def _ratio(part: float, whole: float) -> float | None:
    return part / whole if whole else None


def _utilisation(facts: Facts) -> float | None:
    """At most 1: a mission may have continued through a gap. Robots never seen are omitted."""
    seen = [robot for robot in facts.robots or (facts,) if robot.observed_s > 0]
    share = _ratio(sum(robot.mission_s for robot in seen), sum(robot.observed_s for robot in seen))
    return None if share is None else min(1.0, share)


# The cards, in this order.
FIGURES: Mapping[str, Figure[Facts]] = {
    "success": Figure(
        "Success rate",
        Unit.SHARE,
        lambda facts: _ratio(facts.completed, facts.completed + facts.failed),
        "Completed runs as a share of completed and failed ones. Runs cancelled by a person do not count.",
    ),
    "duration": Figure(
        "Mean duration",
        Unit.SECONDS,
        lambda facts: _ratio(facts.completed_s, facts.timed),
        "Of completed runs, from start to end in robot time. Waiting in the robot's queue does not count.",
    ),
    "per_day": Figure(
        "Missions per day",
        Unit.NUMBER,
        lambda facts: _ratio(facts.completed, facts.recorded_days),
        "Completed runs per recorded day. A day is recorded when at least one run ended on it.",
    ),
    "utilisation": Figure(
        "Utilisation",
        Unit.SHARE,
        _utilisation,
        "Time on missions started from here, as a share of the time for which the robot was observed. Times without "
        "connection and with the app off do not count.",
        digits=0,
    ),
    "adherence": Figure(
        "Schedule adherence",
        Unit.SHARE,
        lambda facts: _ratio(facts.ran, facts.planned),
        "Planned starts that reached the robot and were run or tried there. The others by their reason:",
    ),
}
# How late starts were, and how long they then took.
DELAY_FIGURES: Mapping[str, Figure[Delays]] = {
    "delay_half": Figure("Start delay, median", Unit.SECONDS, lambda delays: percentile(delays.starts, 50)),
    "delay_most": Figure("Start delay, nine of ten within", Unit.SECONDS, lambda delays: percentile(delays.starts, 90)),
    "accepted": Figure(
        "of it until the robot had accepted, median", Unit.SECONDS, lambda delays: percentile(delays.accepted, 50)
    ),
    "queue": Figure("of it in the robot's queue, median", Unit.SECONDS, lambda delays: percentile(delays.queued, 50)),
    "run_half": Figure("Run, median", Unit.SECONDS, lambda delays: percentile(delays.runs, 50)),
    "run_most": Figure("Run, nine of ten within", Unit.SECONDS, lambda delays: percentile(delays.runs, 90)),
}
# Of each group of robots.
GROUP_FIGURES: Mapping[str, Figure[GroupFacts]] = {
    "in_time": Figure("Started within 1 min of plan", Unit.SHARE, lambda group: _ratio(group.in_time, group.starts)),
    "wait_half": Figure("Waited for a robot, half within", Unit.SECONDS, lambda group: percentile(group.waits, 50)),
    "wait_most": Figure("Nine of ten within", Unit.SECONDS, lambda group: percentile(group.waits, 90)),
    "spread": Figure("Spread of use", Unit.POINTS, lambda group: _spread([share for _, share in group.used])),
}


def _spread(shares: Sequence[float]) -> float | None:
    """Between the most and the least used robot; None if fewer than two were seen."""
    return max(shares) - min(shares) if len(shares) > 1 else None


# ---------------------------------------------------------------------- counting
def counted(counts: Iterable[Count], **more: Any) -> Facts:
    """The sums of ended executions; ``more``: other known facts."""
    number, not_run = Counter[str](), Counter[ReasonCode]()
    timed = ran = planned = microseconds = completed = 0
    for one in counts:
        number[one.state] += one.starts
        microseconds += one.microseconds
        if one.state == State.COMPLETED:
            timed, completed = timed + one.timed, completed + one.microseconds
        if one.is_scheduled:
            planned += one.starts
            if one.state == State.COMPLETED or _did_run(one):
                ran += one.starts
            elif (code := _CODES.get(one.reason_code)) is not None:
                not_run[code] += one.starts
    order = list(STATE_OF_REASON)
    values: dict[str, Any] = {state.value: number[state] for state in ENDED_STATES}
    values |= {
        "timed": timed,
        "completed_s": completed / 1e6,
        "mission_s": microseconds / 1e6,
        "planned": planned,
        "ran": ran,
        "not_run": dict(sorted(not_run.items(), key=lambda item: (-item[1], order.index(item[0])))),
    }
    return Facts(**values | more)


def _did_run(one: Count) -> bool:
    return one.reason_code in _AT_THE_ROBOT or (bool(one.is_submitted) and one.reason_code in _MAY_HAVE_RUN)


# ---------------------------------------------------------------------- why runs failed
MOST_PARTICULARS = 3
MOST_CAUSES = 6  # listed; the rest is summed up at the end

# what differs from one failure to the next of the same kind: names in quotes, numbers
_NAMES = re.compile(r"""['"]([^'"]+)['"]""")
_PARTICULARS = re.compile(r"""'[^']*'|"[^"]*"|\d+(?:[.,:]\d+)*""")


@dataclass(frozen=True)
class Cause:
    """``code`` None: all others together. ``words`` the robot's message, if the code alone is not enough."""

    code: ReasonCode | None
    words: str
    number: int
    share: float  # of all failures
    cumulative: float  # share of this one and those before it
    particulars: Sequence[
        tuple[str, int]
    ] = ()  # what the robot's messages named in quotes, such as goals, the most frequent first


def kind_of(message: str) -> str:
    """A robot's message without what is particular to one failure: "Failed to reach goal position 'Dock 3'" and 'Dock 1' are one kind."""
    return re.sub(r"…(?:[,;]?\s*…)+", "…", " ".join(_PARTICULARS.sub("…", message).split()))


def causes(counted: Iterable[tuple[str | None, str | None, int]], most: int = MOST_CAUSES) -> Sequence[Cause]:
    """Of (reason code, message, number). Runs that the robot ended are distinguished by its message; of two equally
    frequent causes the one whose code comes first in the alphabet is first. All others come last, as one."""
    found: Counter[tuple[str, str]] = Counter()
    named: defaultdict[tuple[str, str], Counter[str]] = defaultdict(Counter)
    for code, message, number in counted:
        aborted = code == ReasonCode.ROBOT_ABORTED
        kind = code or "", kind_of(message) if aborted and message else ""
        found[kind] += number
        if kind[1]:
            named[kind].update(dict.fromkeys(_NAMES.findall(message or ""), number))
    total = found.total()
    ordered = sorted(found.items(), key=lambda item: (-item[1], item[0]))
    if len(ordered) > most:
        ordered = [*ordered[:most], (("", ""), sum(number for _, number in ordered[most:]))]
    rows, so_far = [], 0
    for (code, words), number in ordered:
        so_far += number
        rows.append(
            Cause(
                ReasonCode(code) if code else None,
                words,
                number,
                number / total,
                so_far / total,
                tuple(sorted(named[code, words].items(), key=lambda item: (-item[1], item[0]))[:MOST_PARTICULARS]),
            )
        )
    return rows


# ---------------------------------------------------------------------- in words
_LINE = "{group}: {in_time} of {starts} within 1 min of plan"
_WAITED = "{line} · waited for a robot: half {half} s, nine of ten {most} s"
_SPREAD = "{line} · use of its robots {least}–{largest} %"


def line(group: GroupFacts, translate: Translate = lambda text: text) -> str:
    """For the shift report: "Hall 1: 96 of 104 within 1 min of plan · waited for a robot: half 0 s, nine of ten 25 s"."""
    text = translate(_LINE).format(group=group.group, in_time=group.in_time, starts=group.starts)
    half, most = group.value("wait_half"), group.value("wait_most")
    if half is not None and most is not None:
        text = translate(_WAITED).format(line=text, half=round(half), most=round(most))
    if len(group.used) > 1:
        least, largest = (round(100 * pick(share for _, share in group.used)) for pick in (min, max))
        text = translate(_SPREAD).format(line=text, least=least, largest=largest)
    return text
