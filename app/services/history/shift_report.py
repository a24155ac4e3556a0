"""The figures of a shift, for its handover; app.screens.logs.report_page makes a page of them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from datetime import datetime, timedelta
from enum import StrEnum
from zoneinfo import ZoneInfo

from app.database.alarms import AlarmRepository
from app.database.connection import Database
from app.database.settings import SettingsRepository
from app.domain.clock import DAY, Clock, midnight
from app.domain.execution import Execution
from app.domain.models import Alarm, Settings
from app.services.history.figures import Cause, Delays, Facts, GroupFacts
from app.services.history.kpis import KpiFilter, Kpis
from app.services.history.runs import RobotStates, RobotTimeline

SHIFT = timedelta(hours=8)
LINES, LEAST = 18, 6  # of robots (two each), runs and alarms that fit on a page; of runs and alarms always some
PAST_ALARMS = 1000  # as many as are kept


class ReportPeriod(StrEnum):
    SHIFT = "shift"  # the last 8 hours
    TODAY = "today"
    YESTERDAY = "yesterday"
    WEEK = "week"  # today and the 6 days before


@dataclass(frozen=True)
class ShiftReport:
    """Executions count that ended in [start, end). ``runs`` are the newest that did not complete, ``alarms`` the newest that were
    active."""

    start: datetime
    end: datetime
    made_at: datetime
    settings: Settings
    robot: str  # the only one; empty: all
    facts: Facts
    delays: Delays
    causes: Sequence[Cause]
    timelines: Sequence[RobotTimeline]
    runs: Sequence[Execution]
    alarms: Sequence[Alarm]
    more_alarms: int
    groups: Sequence[GroupFacts] = ()
    group: str = ""  # the group whose runs these are; empty: those of ``robot``

    @property
    def more_runs(self) -> int:
        """That did not complete and are not among ``runs``."""
        return self.facts.total - self.facts.completed - sum(run.starts for run in self.runs)


def bounds(period: ReportPeriod, now: datetime, zone: ZoneInfo) -> tuple[datetime, datetime]:
    """[start, end); what has not ended yet ends now."""
    today = now.astimezone(zone).date()
    if period is ReportPeriod.SHIFT:
        return now - SHIFT, now
    if period is ReportPeriod.YESTERDAY:
        return midnight(today - DAY, zone), midnight(today, zone)
    days = 6 if period is ReportPeriod.WEEK else 0
    return midnight(today - days * DAY, zone), now


def split_lines(runs: int, alarms: int, room: int) -> tuple[int, int]:
    """How many runs and alarms are listed in this many lines: half each, and one gets what the other does not need."""
    return min(runs, max(room // 2, room - alarms)), min(alarms, max(room - room // 2, room - runs))


class ShiftReports:
    def __init__(self, db: Database, clock: Clock) -> None:
        self._db, self._clock, self._kpis = db, clock, Kpis(db, clock)

    def make(
        self,
        period: ReportPeriod,
        robot_id: int | None = None,
        *,
        group: str | None = None,
        members: Sequence[int] = (),
    ) -> ShiftReport:
        """Of one robot, or of all; or of what any robot of a group could take, with its ``members``."""
        robot_ids = tuple(members) if group is not None else None if robot_id is None else (robot_id,)
        c, now = self._db.read(), self._clock.now()
        settings = SettingsRepository().load(c)
        start, end = bounds(period, now, ZoneInfo(settings.timezone))
        wanted = KpiFilter(start, None if end >= now else end, robot_ids, group)
        alarms = self._alarms(start, end, robot_ids)
        timelines = RobotStates(self._db).timelines(start, end, wanted.robot_ids) if start < end else []
        facts, causes = self._kpis.facts(wanted), self._kpis.failures(wanted)
        room = max(LEAST, LINES - 2 * len(facts.robots) - max(0, len(facts.not_run) - 1, len(causes) - 3))
        runs = self._kpis.not_completed(wanted, room)
        most_runs, most_alarms = split_lines(len(runs), len(alarms), room)
        return ShiftReport(
            start,
            end,
            now,
            settings,
            next((one.robot for one in facts.robots if one.robot_id == robot_id), ""),
            facts,
            self._kpis.delays(wanted),
            causes,
            timelines,
            runs[:most_runs],
            alarms[:most_alarms],
            len(alarms) - most_alarms,
            self._kpis.groups(wanted, facts.robots),
            group or "",
        )

    def _alarms(self, start: datetime, end: datetime, robot_ids: Sequence[int] | None) -> list[Alarm]:
        """Alarms that were raised in the period, or whose cause lasted into it; newest first, without those of other
        robots."""
        c, repository, keys = self._db.read(), AlarmRepository(), {f"robot:{robot_id}" for robot_id in robot_ids or ()}
        found = [
            alarm
            for alarm in [*repository.open(c), *repository.past(c, PAST_ALARMS)]
            if alarm.raised_at < end
            and (alarm.cleared_at is None or alarm.cleared_at >= start or (alarm.last_at or start) > start)
            and (robot_ids is None or not alarm.key.startswith("robot:") or alarm.key in keys)
        ]
        return sorted(found, key=lambda alarm: alarm.last_at or alarm.raised_at, reverse=True)
