"""Runs once a second, or when something falls due: heartbeat, gaps, plausibility of the clock, due schedules.

It has no thread of its own and talks to no robot; poll_loop calls ``tick`` and hands what fell due to the robots' workers.
"""
from __future__ import annotations

import logging
from collections.abc import Callable, Sequence
from datetime import datetime, timedelta

from app.database.connection import Database
from app.database.settings import SettingsRepository
from app.domain.clock import Clock
from app.domain.rules import INTENT_LEAD
from app.services.dispatch.ledger import Ledger
from app.services.dispatch.planner import DueBatch, Planner
from app.services.dispatch.plausibility import clock_problem
from app.services.live.alarms import Alarms
from app.services.live.gaps import HEARTBEAT_EVERY, NOTEWORTHY, Downtime, Gap
from app.services.live.holds import Holds

log = logging.getLogger(__name__)

LONGEST_WAIT = 1.0          # s: bounds what a clock step or a sleep can delay
REPORTED_STEP = 5.0         # s; a clock step raises an alarm from here on
PREFETCH_LEAD = timedelta(seconds=1.2)     # a robot is read so long before an instant; more than LONGEST_WAIT, or some are missed
PREFETCH_TOGETHER = timedelta(seconds=0.5) # robots with instants this close together are announced at once
INTENT_EVERY = 0.025        # s between checks for what falls due in a moment: some of it shares a transaction
PRUNE_EVERY = 600.0         # s; a lowered limit shows after this at the latest
TIDY_EVERY = 0.5            # s
TIDIES_WITHIN = 60.0        # s that housekeeping gives way to what falls due
MIN_IDLE = 0.02             # s until the next start; with less, housekeeping waits


class Scheduler:
    def __init__(self, db: Database, *, settings: SettingsRepository, clock: Clock, planner: Planner, ledger: Ledger, holds: Holds,
                 alarms: Alarms, downtime: Downtime, clock_offsets: Callable[[], Sequence[float | None]]) -> None:
        self._db, self._settings, self._clock = db, settings, clock
        self._planner, self._ledger, self._holds, self._alarms, self._downtime = planner, ledger, holds, alarms, downtime
        self._clock_offsets = clock_offsets
        self._last: tuple[datetime, float] | None = None      # wall and monotonic time of the last tick
        self._beat_at = self._pruned_at = self._looked_at = self._tidied_at = -1e9
        self._last_heartbeat: datetime | None = None          # of the previous run
        self._clock_doubted_since: datetime | None = None
        self._clock_trusted = False
        self._announced_until: datetime | None = None              # of what is due soon

    def start(self) -> None:
        """Find out for how long the app was off. Called once, before the first tick."""
        self._last_heartbeat = self._settings.heartbeat(self._db.read())
        now = self._clock.now()
        if self._last_heartbeat is not None and now - self._last_heartbeat > timedelta(seconds=2 * HEARTBEAT_EVERY):
            self._away(self._last_heartbeat, now)

    def tick(self) -> DueBatch:
        """One round. Returns what fell due."""
        now, mono = self._clock.now(), self._clock.monotonic()
        self._notice_jump(now, mono)
        self._last = (now, mono)
        if not self._clock_is_trusted(now):
            return DueBatch()
        if mono - self._beat_at >= HEARTBEAT_EVERY:
            self._beat_at = mono
            self._db.write(lambda c: self._settings.set_heartbeat(c, now))
        return self._planner.insert_due()

    def due_soon(self) -> set[int]:
        """Robots with something due in a moment, announced once for each instant."""
        now, announced = self._clock.now(), self._announced_until
        until = now + PREFETCH_LEAD
        if not self._clock_trusted or (announced is not None and now <= announced <= until and until - announced < PREFETCH_TOGETHER):
            return set()
        self._announced_until = until
        return self._planner.robots_due(announced if announced is not None and now < announced < until else now, until)

    def tidy(self) -> None:
        """Hold history and alarms to their limits, once what fell due is on its way. Gives way while more is due in a moment, but no longer
        than a minute without a piece of it."""
        mono = self._clock.monotonic()
        if mono - self._pruned_at >= PRUNE_EVERY:
            self._pruned_at = mono
            self._ledger.grew = True             # the limit may be lower now
            self._alarms.prune()
        if not self._ledger.grew or mono - self._looked_at < TIDY_EVERY:
            return
        self._looked_at = mono
        if self._has_time() or mono - self._tidied_at >= TIDIES_WITHIN:
            self._tidied_at = mono
            self._ledger.prune(self._has_time)

    def _has_time(self) -> bool:
        return self.seconds_to_next() > MIN_IDLE

    def probe(self) -> None:
        """Try to write. Raises DatabaseUnavailable as long as nothing can be written."""
        self._db.write(lambda c: self._settings.put(c, "probed_at", self._clock.now().isoformat()))

    def seconds_to_next(self, longest: float = LONGEST_WAIT) -> float:
        """How long the caller may wait before the next tick."""
        due = self._planner.next_due()
        if due is None or self._clock_doubted_since is not None:
            return longest
        left = (due - self._clock.now()).total_seconds()
        return min(max(left, 0.0), max(left - INTENT_LEAD.total_seconds(), INTENT_EVERY), longest)

    def stop(self) -> None:
        now = self._clock.now()
        if self._clock_trusted:
            self._db.write(lambda c: self._settings.set_heartbeat(c, now))

    # ------------------------------------------------------------------ inside
    def _notice_jump(self, now: datetime, mono: float) -> None:
        """The wall clock ran differently from the monotonic one: the tablet slept (forward) or its clock was set."""
        if self._last is None:
            return
        jump = (now - self._last[0]).total_seconds() - (mono - self._last[1])
        if abs(jump) < REPORTED_STEP:
            return
        log.warning("The wall clock moved by %+.0f s against the monotonic one (asleep, or the clock was set)", jump)
        if jump >= NOTEWORTHY.total_seconds():
            self._away(self._last[0], now)
        else:
            self._alarms.raise_("clock_stepped", "clock", seconds=round(jump))

    def _away(self, start: datetime, end: datetime) -> None:
        self._downtime.add(Gap(start, end))
        if end - start >= NOTEWORTHY:
            log.warning("The app was off or asleep from %s to %s UTC", f"{start:%Y-%m-%d %H:%M:%S}", f"{end:%Y-%m-%d %H:%M:%S}")
            zone = self._settings.load(self._db.read()).timezone
            self._alarms.raise_("app_was_off", "app", start=start.isoformat(), end=end.isoformat(), timezone=zone)

    def _clock_is_trusted(self, now: datetime) -> bool:
        """Judged until it has been plausible once; then never again in this run."""
        if self._clock_trusted:
            return True
        problem = clock_problem(now, self._last_heartbeat, self._clock_offsets())
        self._holds.distrust_clock(problem)
        if problem is not None:
            if self._clock_doubted_since is None:
                self._clock_doubted_since = now
                self._alarms.raise_("clock_implausible", "clock", problem=problem)
            return False
        if self._clock_doubted_since is not None:
            self._downtime.add(Gap(min(self._clock_doubted_since, now), now, clock=True))
            self._clock_doubted_since = None
        self._alarms.clear("clock_implausible", "clock")
        self._clock_trusted = True
        return True
