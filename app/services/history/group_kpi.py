"""Figures of groups of robots, beside those of robots: how punctual their starts were, how long they waited for one, who did how much."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from app.database.connection import Database
from app.database.group_kpi import GroupKpiRepository
from app.database.groups import GroupRepository
from app.domain.clock import Clock
from app.domain.writing import Translate
from app.services.history.kpi import DELAYS_OF, LATE_S, KpiFilter, RobotKpis, span_of
from app.services.planning.durations import percentile

_LINE = "{group}: {in_time} of {starts} within 1 min of plan"
_WAITED = "{line} · waited for a robot: half {half} s, nine of ten {most} s"
_SPREAD = "{line} · use of its robots {least}–{largest} %"


@dataclass(frozen=True)
class GroupKpis:
    """``starts``: planned ones that ended in the period and that nobody had called off; ``in_time``: of these, on a robot within a minute.
    Waits in s, over the newest ``waited`` (at most 5,000) that were sent. ``used``: share of the time that each of its robots was seen for
    which it ran, whoever had started that."""

    group_id: int
    group: str
    starts: int = 0
    in_time: int = 0
    waited: int = 0
    wait_p50_s: float | None = None
    wait_p90_s: float | None = None
    used: Sequence[tuple[str, float]] = ()

    @property
    def in_time_share(self) -> float | None:
        return self.in_time / self.starts if self.starts else None

    @property
    def spread(self) -> float | None:
        """Between the robot that was used most and the one that was used least, as a share; None where fewer than two were seen."""
        return max(use for _, use in self.used) - min(use for _, use in self.used) if len(self.used) > 1 else None


class GroupFigures:
    def __init__(self, db: Database, clock: Clock) -> None:
        self._db, self._clock, self._repository = db, clock, GroupKpiRepository()

    def of(self, wanted: KpiFilter | None = None, robots: Sequence[RobotKpis] = ()) -> list[GroupKpis]:
        """In order of name; groups without a start in the period are left out. ``robots``: as ``Kpis.thesis`` has them of the period."""
        c, span = self._db.read(), span_of(wanted, self._clock.now())
        sums = self._repository.sums(c, span, LATE_S)
        if not sums:
            return []
        groups = {group.id: group for group in GroupRepository().all(c)}
        use = {robot.robot_id: (robot.robot, robot.utilisation) for robot in robots if robot.utilisation is not None}
        found = []
        for one in sums:
            group = groups.get(one.group_id)
            waits = sorted(self._repository.waits(c, span, one.group_id, DELAYS_OF))
            members = group.members if group is not None else tuple(self._repository.runs(c, span, one.group_id))
            used = [
                (robot, share)
                for robot_id in members
                if robot_id in use
                for robot, share in (use[robot_id],)
                if share is not None
            ]
            name = group.name if group is not None else self._repository.name_of_removed(c, one.group_id)
            if wanted is not None and wanted.group not in (None, name):
                continue
            found.append(
                GroupKpis(
                    one.group_id,
                    name,
                    one.starts,
                    one.in_time,
                    len(waits),
                    percentile(waits, 50),
                    percentile(waits, 90),
                    used,
                )
            )
        return sorted(found, key=lambda one: (one.group.casefold(), one.group_id))


def line(kpis: GroupKpis, translate: Translate = lambda text: text) -> str:
    """For the shift report: "Hall 1: 96 of 104 within 1 min of plan · waited for a robot: half 0 s, nine of ten 25 s"."""
    text = translate(_LINE).format(group=kpis.group, in_time=kpis.in_time, starts=kpis.starts)
    if kpis.wait_p50_s is not None and kpis.wait_p90_s is not None:
        text = translate(_WAITED).format(line=text, half=round(kpis.wait_p50_s), most=round(kpis.wait_p90_s))
    if kpis.spread is not None:
        least, largest = (round(100 * pick(use for _, use in kpis.used)) for pick in (min, max))
        text = translate(_SPREAD).format(line=text, least=least, largest=largest)
    return text
