"""What the runs of one robot use of its battery, each from when it was first seen executing to when it is seen completed."""

from __future__ import annotations

from dataclasses import dataclass, replace
from datetime import datetime

from app.domain.drain import Used
from app.domain.models import Execution, State
from app.services.dispatch.availability import is_charging
from app.services.dispatch.context import Context
from app.services.dispatch.observation import Observation
from app.services.dispatch.timing import REPORTED_STEP, UNSEEN_AT_MOST

HOUR = 3600.0  # s


@dataclass(frozen=True)
class _Run:
    """``began``, and was last ``seen`` executing, on the monotonic clock."""

    battery: float
    began: float
    began_at: datetime
    seen: float


class Draining:
    """A run of which the beginning or the end was not seen, or during which the battery was unknown or charged, says nothing."""

    def __init__(self, context: Context, observation: Observation) -> None:
        self._s, self._seen = context, observation
        self._runs: dict[int, _Run] = {}  # by the execution's id

    def saw_executing(self, row: Execution) -> None:
        """``row`` as it was before: only one that was not known to execute begins now."""
        battery, mono = self._battery(), self._s.clock.monotonic()
        before = self._runs.pop(row.id, None)
        if battery is not None and before is not None:
            self._runs[row.id] = replace(before, seen=mono)
        elif battery is not None and row.state is State.QUEUED:
            self._runs[row.id] = _Run(battery, mono, self._s.clock.now(), mono)

    def saw_completed(self, row: Execution) -> Used | None:
        run, battery, mono = self._runs.pop(row.id, None), self._battery(), self._s.clock.monotonic()
        if (
            run is None
            or battery is None
            or battery > run.battery
            or mono - run.seen > UNSEEN_AT_MOST
            or self._slept(run)
        ):
            return None
        mission = self._s.missions.with_guid(self._s.db.read(), row.mission_guid, self._seen.robot.id)
        return (
            None if mission is not None and mission.charges else Used(run.battery - battery, (mono - run.began) / HOUR)
        )

    def forget_all_but(self, ids: set[int]) -> None:
        """What has ended otherwise."""
        self._runs = {key: run for key, run in self._runs.items() if key in ids}

    def _battery(self) -> float | None:
        """As read a moment ago; None: unknown, or it charges."""
        status = self._seen.fresh_status
        return None if status is None or is_charging(status) else status.battery_percentage

    def _slept(self, run: _Run) -> bool:
        """The tablet slept, for which its monotonic clock stands still; or its clock was set, which looks the same."""
        passed = (self._s.clock.now() - run.began_at).total_seconds()
        return abs(passed - (self._s.clock.monotonic() - run.began)) >= REPORTED_STEP
