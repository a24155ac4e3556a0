"""Key performance indicators, computed when shown and never stored, each with the number of executions that it rests on.

Success rate, mean duration, total duration per robot, missions per day and utilisation, plus adherence and start delays. A period is
[start, end) of the instant at which an execution ended, and never goes beyond now: a start that a person skips ahead ends when it was
planned. Days are local days of settings.timezone, of 23, 24 or 25 hours.
"""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from datetime import UTC, date, datetime, timedelta
from zoneinfo import ZoneInfo

from app.database.activities import ActivityRepository
from app.database.connection import Database
from app.database.kpi import EARLIEST, KpiRepository, Outcome, RobotSum, Span
from app.database.robots import RobotRepository
from app.database.settings import SettingsRepository
from app.database.values import to_instant, to_text
from app.domain.activity import seen_seconds
from app.domain.clock import Clock, midnight
from app.domain.models import ENDED_STATES, STATE_OF_REASON, Execution, ReasonCode, Settings, State
from app.services.history.pareto import Cause, causes
from app.services.planning.durations import BASELINE_OF, DURATIONS_OF, MOST_MISSIONS, Trend, percentile, trend
from app.services.planning.plan import MOMENT
from app.services.planning.working_days import working_calendar

DAY = timedelta(days=1)
_FIRST_INSTANT = datetime(1970, 1, 1, tzinfo=UTC)
DELAYS_OF = 5_000  # newest runs that the percentiles of delays rest on
LATE_S = 60.0  # after the planned instant; a start within it is on time
RAN = (State.COMPLETED, State.FAILED, State.CANCELLED)
_AT_THE_ROBOT = (ReasonCode.ROBOT_ABORTED, ReasonCode.VANISHED)  # ended there, so it did run
_MAY_HAVE_RUN = (ReasonCode.USER_CANCELLED, ReasonCode.QUEUE_CLEARED)  # ran if the robot had accepted it

_OUTCOMES: Sequence[Outcome] = (
    (State.COMPLETED, None, False),
    *((state, code, False) for code, state in STATE_OF_REASON.items()),
    *((STATE_OF_REASON[code], code, True) for code in _MAY_HAVE_RUN),
)


@dataclass(frozen=True)
class KpiFilter:
    """Which ended executions count; None: from the first, until now, of all robots. ``group``: those that any robot of it could take, by
    its name then, whoever did; what its robots did and how long they were seen is that of ``robot_ids``, for whomever they did it."""

    start: datetime | None = None
    end: datetime | None = None
    robot_ids: Sequence[int] | None = None
    group: str | None = None


@dataclass(frozen=True)
class RobotKpis:
    """One robot's share. ``mission_s`` sums the robot's own durations of everything that ran, however it ended."""

    robot_id: int
    robot: str
    completed: int = 0
    failed: int = 0
    cancelled: int = 0
    mission_s: float = 0.0
    observed_s: float = 0.0  # for how long it was seen in the period: gaps of the app and of the connection left out
    charging_s: float = 0.0  # of observed_s
    working_s: float = 0.0  # length of the period's working days

    @property
    def utilisation(self) -> float | None:
        """Mission seconds ÷ observed seconds, at most 1 (a mission may have run on through a gap); None when it was never seen."""
        return min(1.0, self.mission_s / self.observed_s) if self.observed_s > 0 else None

    @property
    def utilisation_of_working_days(self) -> float | None:
        """Mission seconds ÷ the hours of the period's working days."""
        return self.mission_s / self.working_s if self.working_s > 0 else None


@dataclass(frozen=True)
class ThesisKpis:
    """The five, over all robots of the filter; ``robots`` has the third and the fifth for each, in order of name."""

    completed: int
    failed: int
    cancelled: int  # counted apart: a person's decision is no failure
    timed: int  # completed ones whose duration is known
    completed_s: float  # their durations together
    recorded_days: int  # local days on which at least one recorded execution ended
    robots: Sequence[RobotKpis]

    @property
    def success_rate(self) -> float | None:
        """completed ÷ (completed + failed); None without either."""
        tried = self.completed + self.failed
        return self.completed / tried if tried else None

    @property
    def mean_duration_s(self) -> float | None:
        return self.completed_s / self.timed if self.timed else None

    @property
    def mission_s(self) -> float:
        return sum(robot.mission_s for robot in self.robots)

    @property
    def observed_s(self) -> float:
        return sum(robot.observed_s for robot in self.robots)

    @property
    def utilisation(self) -> float | None:
        """Mission seconds ÷ observed seconds of those that were seen, together; None when none was."""
        seen = [robot for robot in self.robots if robot.observed_s > 0]
        return min(1.0, sum(robot.mission_s for robot in seen) / self.observed_s) if seen else None

    @property
    def completed_per_day(self) -> float | None:
        """Per recorded day."""
        return self.completed / self.recorded_days if self.recorded_days else None


@dataclass(frozen=True)
class DayKpis:
    """What ended on one local day. ``timed`` and ``completed_s`` are of completed ones; ``mission_s`` of everything that ran."""

    day: date
    completed: int = 0
    failed: int = 0
    cancelled: int = 0
    skipped: int = 0
    missed: int = 0
    timed: int = 0
    completed_s: float = 0.0
    mission_s: float = 0.0

    @property
    def total(self) -> int:
        return self.completed + self.failed + self.cancelled + self.skipped + self.missed


@dataclass(frozen=True)
class Adherence:
    """How many planned executions ran: reached the robot's queue and were carried out or tried there."""

    planned: int
    ran: int
    not_run: Mapping[ReasonCode, int]  # by why, most frequent first

    @property
    def rate(self) -> float | None:
        return self.ran / self.planned if self.planned else None


@dataclass(frozen=True)
class Delays:
    """From the planned instant to the start on the robot, in seconds, over the newest ``count`` runs (at most 5,000); and what they did
    next: waiting in the robot's queue, and running."""

    count: int
    p50_s: float | None
    p90_s: float | None
    app_p50_s: float | None  # of that, until the robot had accepted it
    queue_p50_s: float | None  # and waiting in the robot's queue
    queue_s: float = 0.0  # of those with a known duration, together
    run_s: float = 0.0
    run_p50_s: float | None = None
    run_p90_s: float | None = None
    late: int = 0  # of ``count``: started more than LATE_S after the planned instant

    @property
    def queue_share(self) -> float | None:
        """Waiting ÷ (waiting + running)."""
        both = self.queue_s + self.run_s
        return self.queue_s / both if both else None


class Kpis:
    def __init__(self, db: Database, clock: Clock) -> None:
        self._db, self._clock = db, clock
        self._repository, self._settings, self._activities = KpiRepository(), SettingsRepository(), ActivityRepository()

    def thesis(self, wanted: KpiFilter | None = None) -> ThesisKpis:
        """Success rate, mean duration, total duration per robot, completed per recorded day, utilisation."""
        c, span = self._db.read(), span_of(wanted, self._clock.now())
        settings = self._settings.load(c)
        days = self._days(span, settings)
        sums = self._repository.by_robot(c, span)
        of = {state: [one for one in sums if one.state == state] for state in RAN}
        recorded = sum(self._repository.has_any(c, replace(span, start=day.start, end=day.end)) for day in days)
        wanted = wanted or KpiFilter()
        of_robots = (
            sums
            if wanted.group is None
            else self._repository.by_robot(c, span_of(replace(wanted, group=None), self._clock.now()))
        )
        return ThesisKpis(
            completed=sum(one.number for one in of[State.COMPLETED]),
            failed=sum(one.number for one in of[State.FAILED]),
            cancelled=sum(one.number for one in of[State.CANCELLED]),
            timed=sum(one.timed for one in of[State.COMPLETED]),
            completed_s=sum(one.seconds for one in of[State.COMPLETED]),
            recorded_days=recorded,
            robots=self._robots(of_robots, wanted, days, settings),
        )

    def _robots(
        self, sums: Sequence[RobotSum], wanted: KpiFilter, days: Sequence[_Day], settings: Settings
    ) -> list[RobotKpis]:
        """The configured robots of the filter, and removed ones that have history in the period."""
        c = self._db.read()
        names = {
            robot.id: robot.name
            for robot in RobotRepository().all(c)
            if wanted.robot_ids is None or robot.id in wanted.robot_ids
        }
        for one in sums:
            if one.robot_id and one.robot_id not in names:
                names[one.robot_id] = self._repository.name_of_removed(c, one.robot_id)
        seen = self._seen(wanted, names, ZoneInfo(settings.timezone))
        working_s = self._working_seconds(wanted, days, settings)
        found = []
        for robot_id, name in names.items():
            number = {
                state: sum(one.number for one in sums if (one.robot_id, one.state) == (robot_id, state))
                for state in RAN
            }
            found.append(
                RobotKpis(
                    robot_id,
                    name,
                    number[State.COMPLETED],
                    number[State.FAILED],
                    number[State.CANCELLED],
                    mission_s=sum(one.seconds for one in sums if one.robot_id == robot_id),
                    observed_s=seen_seconds(seen[robot_id]),
                    charging_s=seen[robot_id]["charging"],
                    working_s=working_s,
                )
            )
        return sorted(found, key=lambda robot: (robot.robot.casefold(), robot.robot_id))

    def _seen(self, wanted: KpiFilter, robot_ids: Iterable[int], zone: ZoneInfo) -> Mapping[int, Mapping[str, float]]:
        """Seconds of each activity in the period, by robot."""
        start, end = wanted.start or _FIRST_INSTANT, min(wanted.end or self._clock.now(), self._clock.now())
        found: dict[int, dict[str, float]] = {robot_id: defaultdict(float) for robot_id in robot_ids}
        for robot_id, seconds in found.items():
            for of_day in (
                self._activities.seconds(self._db.read(), robot_id, start, end, zone).values() if start < end else ()
            ):
                for activity, value in of_day.items():
                    seconds[activity] += value
        return found

    def _working_seconds(self, wanted: KpiFilter, days: Sequence[_Day], settings: Settings) -> float:
        """Length of the working days from the beginning of the period, or the first recorded day, to its end, or now."""
        zone, calendar = ZoneInfo(settings.timezone), working_calendar(self._db.read(), settings)
        start = wanted.start or (to_instant(days[0].start) if days else None)
        end = min(wanted.end or self._clock.now(), self._clock.now())
        if start is None or start >= end:
            return 0.0
        return sum(
            (min(midnight(day + DAY, zone), end) - max(midnight(day, zone), start)).total_seconds()
            for day in _dates(start.astimezone(zone).date(), end.astimezone(zone).date())
            if calendar.is_working_day(day) and midnight(day, zone) < end
        )

    def observed_seconds(self, first: date, last: date, zone: ZoneInfo) -> Mapping[int, Mapping[date, float]]:
        """For how long each configured robot was seen and answered, by its id and local day, both days included; a day on which it was not
        seen is left out."""
        c, start, end = self._db.read(), midnight(first, zone), min(midnight(last + DAY, zone), self._clock.now())
        return {
            robot.id: {
                day: seconds
                for day, activities in self._activities.seconds(c, robot.id, start, end, zone).items()
                if (seconds := seen_seconds(activities))
            }
            for robot in RobotRepository().all(c)
        }

    # ------------------------------------------------------------------ beyond the five
    def kept_since(self) -> datetime | None:
        """The end of the first run of the history: older ones were deleted, or there never were any. None: nothing has run."""
        first = self._repository.kept_since(self._db.read())
        return to_instant(first) if first else None

    def per_day(self, wanted: KpiFilter | None = None) -> list[DayKpis]:
        """Every local day from the first to the last with something recorded in the period; days without anything are zero."""
        c, span = self._db.read(), span_of(wanted, self._clock.now())
        found = []
        robots = span.robot_ids if span.robot_ids is not None else self._repository.robots(c)
        for day in self._days(span, self._settings.load(c)):
            states = self._repository.by_state(c, replace(span, start=day.start, end=day.end), robots)
            number = {state: states.get(state, (0, 0, 0.0)) for state in ENDED_STATES}
            found.append(
                DayKpis(
                    day.date,
                    number[State.COMPLETED][0],
                    number[State.FAILED][0],
                    number[State.CANCELLED][0],
                    number[State.SKIPPED][0],
                    number[State.MISSED][0],
                    timed=number[State.COMPLETED][1],
                    completed_s=number[State.COMPLETED][2],
                    mission_s=sum(number[state][2] for state in RAN),
                )
            )
        return found

    def adherence(self, wanted: KpiFilter | None = None) -> Adherence:
        """Of scheduled executions only."""
        found = self._repository.outcomes(self._db.read(), span_of(wanted, self._clock.now()), _OUTCOMES)
        ran = planned = found[State.COMPLETED, None, False]
        not_run: dict[ReasonCode, int] = {}
        for code, state in STATE_OF_REASON.items():
            number = found[state, code, False]
            accepted = number if code in _AT_THE_ROBOT else found.get((state, code, True), 0)
            planned, ran = planned + number, ran + accepted
            if number > accepted:
                not_run[code] = number - accepted
        return Adherence(planned, ran, dict(sorted(not_run.items(), key=lambda item: -item[1])))

    def delays(self, wanted: KpiFilter | None = None) -> Delays:
        """Of scheduled executions that started on the robot."""
        found = self._repository.timings(self._db.read(), span_of(wanted, self._clock.now()), DELAYS_OF)
        both = sorted(one.app_s + one.queue_s for one in found)
        run = sorted(one.run_s for one in found if one.run_s is not None)
        return Delays(
            len(found),
            percentile(both, 50),
            percentile(both, 90),
            percentile(sorted(one.app_s for one in found), 50),
            percentile(sorted(one.queue_s for one in found), 50),
            sum(one.queue_s for one in found if one.run_s is not None),
            sum(run),
            percentile(run, 50),
            percentile(run, 90),
            sum(delay > LATE_S for delay in both),
        )

    def failures(self, wanted: KpiFilter | None = None) -> Sequence[Cause]:
        """Why runs failed, whatever had triggered them, the most frequent cause first."""
        return causes(self._repository.failures(self._db.read(), span_of(wanted, self._clock.now())))

    def not_completed(self, wanted: KpiFilter | None = None, most: int = 50) -> Sequence[Execution]:
        """What ended in any state but completed, newest first."""
        return self._repository.not_completed(self._db.read(), span_of(wanted, self._clock.now()), most)

    def trends(self, wanted: KpiFilter | None = None, most: int = MOST_MISSIONS) -> Sequence[Trend]:
        """How long completed runs took, of the missions that took the most time in all, against the runs before the period."""
        c, span = self._db.read(), span_of(wanted, self._clock.now())
        settings = self._settings.load(c)
        found = self._repository.missions(c, span)
        guids = sorted(found, key=lambda guid: (-found[guid][1], guid))[:most]
        days = self._days(span, settings)
        before = replace(span, start=EARLIEST, end=span.start)
        trends = []
        for guid in guids:
            number = found[guid][0]
            runs = (
                self._repository.durations(c, span, guid)
                if number <= DURATIONS_OF
                else self._repository.newest_durations(c, span, guid, DURATIONS_OF)
            )
            usual = [seconds for _, seconds in self._repository.newest_durations(c, before, guid, BASELINE_OF)]
            trends.append(
                trend(
                    guid,
                    self._repository.name_of_mission(c, guid, span.robot_ids),
                    number,
                    runs,
                    usual,
                    [(day.date, day.start) for day in days],
                )
            )
        return trends

    # ------------------------------------------------------------------ days
    def _days(self, span: Span, settings: Settings) -> list[_Day]:
        """Local days from the first to the last with something recorded, cut to the period."""
        ends = self._repository.first_and_last(self._db.read(), span)
        if ends is None:
            return []
        zone = ZoneInfo(settings.timezone)
        first, last = (to_instant(end).astimezone(zone).date() for end in ends)
        return [
            _Day(day, max(to_text(midnight(day, zone)), span.start), min(to_text(midnight(day + DAY, zone)), span.end))
            for day in _dates(first, last)
        ]


@dataclass(frozen=True)
class _Day:
    """A local day, and which instants (as text) belong to it."""

    date: date
    start: str
    end: str


def _dates(first: date, last: date) -> Iterator[date]:
    return (first + number * DAY for number in range((last - first).days + 1))


def span_of(wanted: KpiFilter | None, now: datetime) -> Span:
    """The period and robots of a filter as the columns have them; of what has ended by now."""
    wanted, until = wanted or KpiFilter(), now + MOMENT
    return Span(
        to_text(wanted.start) if wanted.start else EARLIEST,
        to_text(min(wanted.end or until, until)),
        None if wanted.robot_ids is None or wanted.group is not None else tuple(wanted.robot_ids),
        wanted.group,
    )
