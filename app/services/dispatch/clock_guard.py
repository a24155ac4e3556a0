"""Whether the tablet's clock can be right, judged at every round: at the start, after every jump, and against the
robots' clocks.

While it is in doubt nothing is sent and nothing is written as missed. A robot with the same time, or the operator, ends
the doubt; if no robot can be asked, the time since the last run has to be plausible.
"""

from __future__ import annotations

import logging
import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from datetime import datetime, timedelta

from app.database.connection import Database
from app.database.settings import BACKUP_HEARTBEAT, CLOCK_CONFIRMED_AT, SettingsRepository
from app.database.values import to_optional_instant, to_text
from app.domain.clock import EARLIEST, Clock, ClockReading
from app.domain.message import Message, message
from app.services.dispatch.timing import CLOCKS_AGREE, FIRST_DOUBT, REPORTED_STEP
from app.services.live.alarms import Alarms
from app.services.live.downtime import HEARTBEAT_EVERY, SHORTEST_ABSENCE, UNKNOWN_START, Downtime, Gap
from app.services.live.holds import Holds

log = logging.getLogger(__name__)

BACKWARDS = timedelta(minutes=2)  # a tablet that lost some seconds over a restart is not a tablet that lost its clock
HEARD_AGAIN = 3600.0  # s of agreement after which the clock of an overruled robot counts again
CONFIRMED = "confirmed_clock_offsets"  # name of the setting: robots' differences when a person confirmed this clock
CONFIRMATION_LASTS = timedelta(days=1)  # until an app is started to which it is said
UNPROVEN = message("it is being compared with the robots' clocks")

Readings = Mapping[int, ClockReading]  # by robot
Span = tuple[datetime, datetime]  # both included


@dataclass(frozen=True)
class Judgement:
    """``absent_since``: the app was off, asleep or in doubt until now. ``went_back``: handled instants may come again.
    ``step``: how much the clock was set, or the tablet slept, since the actions of the last judgement were done.
    ``wrong``: the period in which the clock showed a wrong time before it was set to that of the robots."""

    is_trusted: bool
    absent_since: datetime | None = None
    went_back: bool = False
    step: timedelta = timedelta()
    wrong: Span | None = None


@dataclass
class _Doubt:
    since: datetime
    since_mono: float
    jump_s: float = 0.0  # that the clock has moved ahead while the app ran
    has_alarm: bool = False
    ahead: Mapping[int, float] = field(
        default_factory=dict
    )  # s, of robots' clocks when they last contradicted this one
    shown: Span | None = None  # the times that it showed until then, or until it was set
    moved_s: float = 0.0  # ahead, since then

    def restart(self, mono: float) -> None:
        """After a jump: readings up to that moment are void."""
        self.since_mono = math.nextafter(mono, math.inf)

    def move(self, before: datetime, step: float) -> None:
        """By ``step`` seconds the clock was set, or the tablet has slept; ``before`` is what it would show now without that."""
        if self.shown is not None and not self.moved_s:
            self.shown = (self.shown[0], before)
        self.moved_s += step
        if self.jump_s:
            self.jump_s = max(0.0, self.jump_s + step)  # perhaps set back

    def found_wrong(self, readings: Readings) -> Span | None:
        """The wrong times that the clock showed, if a robot agrees now that had contradicted it before it was set ahead
        by about that difference. In any other case it may have been right: the tablet slept, or a robot's clock was
        set."""
        for key, ahead in self.ahead.items():
            if (
                key in readings
                and abs(readings[key].offset) <= CLOCKS_AGREE
                and abs(self.moved_s - ahead) <= min(CLOCKS_AGREE, ahead / 2)
            ):
                return self.shown
        return None


class ClockGuard:
    def __init__(self, db: Database, clock: Clock, holds: Holds, alarms: Alarms, downtime: Downtime) -> None:
        self._db, self._settings, self._clock = db, SettingsRepository(), clock
        self._holds, self._alarms, self._downtime = holds, alarms, downtime
        self._last: tuple[datetime, float] | None = None  # wall and monotonic time of the last round, or of the start
        self._last_heartbeat: datetime | None = None  # of the previous run, or of this one
        self._beat_at = -1e9
        self._doubt: _Doubt | None = None
        self._absent_since: datetime | None = None
        self._unreported: Gap | None = None  # an absence that is reported once the clock is trusted
        self._started_at: float | None = None  # on the monotonic clock, until the time off is reported
        self._went_back = False
        self._step = timedelta()
        # Robots against whose clocks a person decided, and when they last differed.
        self._overruled: dict[int, float] = {}
        # The begin of the wrong time, if it is found wrong; None: when the doubt began.
        self._wrong_since: datetime | None = clock.now()
        self._wrong: Span | None = None
        self._confirmed_at: datetime | None = None  # by a person, before this run
        self.is_proven = False  # by a robot or a person; else one robot's word counts

    def start(self) -> None:
        """Called once, before the first round."""
        self._last_heartbeat = self._settings.heartbeat(self._db.read())
        self._confirmed_at = to_optional_instant(self._settings.get(self._db.read(), CLOCK_CONFIRMED_AT))
        now, self._started_at = self._clock.now(), self._clock.monotonic()
        self._last = (
            now,
            self._started_at,
        )  # before the first round, robots may report the time and the clock may be set
        self._begin_doubt(now)

    def judge(self, readings: Readings, can_ask: bool) -> Judgement:
        """One round. ``can_ask``: some robots may report the time."""
        now, mono = self._clock.now(), self._clock.monotonic()
        self._notice_step(now, mono)
        self._last = (now, mono)
        self._holds.clock_checked(now, mono)
        problem = self._problem(readings, can_ask, now, mono)
        if self._doubt is None:
            self._beat(now, mono)
            self._report_absence(now)
            if self._went_back:
                self._downtime.forget_future(now)
            return Judgement(True, self._absent_since, self._went_back, self._step, self._wrong)
        if problem is not None:
            self._holds.doubt_clock(problem)
            if problem is not UNPROVEN and not self._doubt.has_alarm:
                self._doubt.has_alarm = True
                self._alarms.raise_("clock_implausible", "clock", problem=problem)
        return Judgement(False)

    def acted(self) -> None:
        """The actions of the last judgement were done; until then each judgement repeats them, as writing may fail."""
        self._absent_since, self._went_back, self._step, self._wrong = None, False, timedelta(), None

    def is_contradicted(self, robot_id: int, reading: ClockReading) -> bool:
        """Whether that robot's time is enough to put the clock in doubt, as nothing has proven it right: the next round
        does. Until then nothing may be sent to it. A one-shot command has no rounds: a person waits for what it starts.
        Any thread may ask."""
        return self._last is not None and not self.is_proven and self._votes({robot_id: reading})[0] == 0

    @property
    def is_in_doubt(self) -> bool:
        return self._doubt is not None

    def stop(self) -> None:
        if self._doubt is None:
            now = self._clock.now()
            self._db.write(lambda c: self._settings.set_heartbeat(c, now))

    # ------------------------------------------------------------------ inside
    def _begin_doubt(self, now: datetime, jump_s: float = 0.0, said_at: float = math.inf) -> _Doubt:
        """``said_at``: robots' times since then still count until newer ones arrive."""
        doubt = self._doubt = _Doubt(now, min(said_at, self._clock.monotonic()), jump_s)
        if jump_s:
            doubt.restart(self._clock.monotonic())
        self._holds.doubt_clock(UNPROVEN)
        return doubt

    def _end_doubt(self, now: datetime, wrong: Span | None) -> None:
        """``wrong``: the times that the clock showed before it was corrected."""
        doubt, self._doubt = self._doubt, None
        self._wrong = wrong or self._wrong
        if self._confirmed_at is not None:
            self._db.write(lambda c: self._settings.put(c, CLOCK_CONFIRMED_AT, None))
            self._confirmed_at = None
        self._notice_absence(now)
        was_wrong = wrong is not None or (doubt is not None and doubt.since < EARLIEST <= now)
        if doubt is not None and (doubt.has_alarm or was_wrong):
            self._downtime.add(Gap(min(doubt.since, now), now, clock=True))
            self._absent_since = self._absent_since or min(doubt.since, now)
        if (
            doubt is not None and not was_wrong and timedelta(seconds=doubt.jump_s) >= SHORTEST_ABSENCE
        ):  # the tablet slept
            self._away(doubt.since, now)
        self._went_back = True  # perhaps before this run
        self._holds.doubt_clock(None)
        self._alarms.clear("clock_implausible", "clock")

    def _problem(self, readings: Readings, can_ask: bool, now: datetime, mono: float) -> Message | None:
        """None ends the doubt."""
        since = self._doubt.since_mono if self._doubt else -1.0
        fresh = {key: reading for key, reading in readings.items() if reading.read_at >= since}
        agree, differ = self._votes(fresh)
        self.is_proven |= agree > 0
        if self._doubt is None:
            if len(differ) >= (2 if self.is_proven else 1) and len(differ) > agree:
                doubt = self._begin_doubt(now, said_at=min(reading.read_at for reading in readings.values()))
                return self._contradict(doubt, differ, now)
            return None
        problem = (
            self._contradict(self._doubt, differ, now)
            if agree < len(differ)
            else None
            if agree
            else self._unproven(can_ask, now, mono)
        )
        if self._holds.take_clock_confirmation() or (problem not in (None, UNPROVEN) and self._was_confirmed(now)):
            offsets = {str(key): reading.offset for key, reading in fresh.items()}
            self._db.write(lambda c: self._settings.put(c, CONFIRMED, offsets))
            self._overrule(readings, mono)
            self.is_proven = True
            self._end_doubt(now, wrong=None)
        elif problem is not None:
            return problem
        else:
            self._end_doubt(now, self._doubt.found_wrong(fresh))
        return None

    def _contradict(self, doubt: _Doubt, differ: Mapping[int, float], now: datetime) -> Message:
        """Robots' clocks differ: this one may be wrong."""
        since = None if self.is_proven else self._wrong_since
        doubt.ahead, doubt.shown, doubt.moved_s = differ, (since or doubt.since, now), 0.0
        return _difference(list(differ.values()))

    def _was_confirmed(self, now: datetime) -> bool:
        """By a command, a short time before this run."""
        return self._confirmed_at is not None and timedelta() <= now - self._confirmed_at <= CONFIRMATION_LASTS

    def _unproven(self, can_ask: bool, now: datetime, mono: float) -> Message | None:
        """No robot has said its time yet."""
        doubt, then = self._doubt, self._last_heartbeat
        if doubt is not None and can_ask and mono - doubt.since_mono < FIRST_DOUBT:
            return UNPROVEN
        if doubt is not None and can_ask and doubt.jump_s:
            return message("it jumped ahead by {time}, and no robot can be asked", time=_span(doubt.jump_s))
        if then is not None and now < then - BACKWARDS:
            return message(
                "it shows {now} UTC, but the app already ran on {then} UTC",
                now=f"{now:%Y-%m-%d %H:%M}",
                then=f"{then:%Y-%m-%d %H:%M}",
            )
        return None

    def _overrule(self, readings: Readings, mono: float) -> None:
        """Robots whose clocks differ when a person says that the tablet's is right are ignored until they have agreed
        for long. If the tablet's clock does not step and theirs differ in another way, theirs have moved: no reason for
        a hold."""
        self._overruled = {key: mono for key, reading in readings.items() if abs(reading.offset) > CLOCKS_AGREE}
        if self._overruled:
            log.warning(
                "A person decided against the clocks of robots %s", ", ".join(f"#{key}" for key in self._overruled)
            )

    def _has_a_say(self, key: int, reading: ClockReading) -> bool:
        """Of a robot whose clock differs."""
        if key in self._overruled and reading.read_at - self._overruled[key] <= HEARD_AGAIN:
            self._overruled[key] = reading.read_at
            return False
        return True

    def _votes(self, readings: Readings) -> tuple[int, dict[int, float]]:
        """How many robots' clocks agree, and by how many seconds the others differ. A clock with the same difference as
        when a person confirmed the tablet's counts as agreeing."""
        differ: dict[int, float] = {}
        agree = 0
        confirmed: Mapping[str, float] | None = None
        for key, reading in readings.items():
            offset, has_a_say = reading.offset, True
            if abs(offset) > CLOCKS_AGREE:
                if confirmed is None:
                    confirmed = self._settings.get(self._db.read(), CONFIRMED, {})
                offset -= confirmed.get(str(key), 0.0)
                has_a_say = self._has_a_say(key, reading)
            if abs(offset) <= CLOCKS_AGREE:
                agree += 1
            elif has_a_say:
                differ[key] = reading.offset
        return agree, differ

    def _notice_step(self, now: datetime, mono: float) -> None:
        """The wall clock ran differently from the monotonic one: the tablet slept (forward) or its clock was set."""
        if self._last is None:
            return
        step = (now - self._last[0]).total_seconds() - (mono - self._last[1])
        if abs(step) < REPORTED_STEP:
            return
        log.warning("The wall clock moved by %+.0f s against the monotonic one (asleep, or the clock was set)", step)
        self._overruled.clear()  # now the tablet's may be wrong
        self._step += timedelta(seconds=step)
        if step < 0:
            self._went_back = True
        self._wrong_since = None
        if self._doubt is not None:  # earlier readings are void
            self._doubt.restart(mono)
            self._doubt.move(now - timedelta(seconds=step), step)
        elif now < EARLIEST <= self._last[0]:
            self._begin_doubt(now).restart(mono)
        elif step > self._shortest_doubtful():
            self._begin_doubt(self._last[0], step)
        elif step >= SHORTEST_ABSENCE.total_seconds():
            self._away(self._last[0], now)
        else:
            self._alarms.raise_("clock_stepped", "clock", seconds=round(step))

    def _shortest_doubtful(self) -> float:
        """s; a jump ahead beyond a start window would make starts late that a wrong clock only pretends to be."""
        return 60.0 * self._settings.load(self._db.read()).start_window_minutes

    def _notice_absence(self, now: datetime) -> None:
        """For how long the app was off before this run: by a clock that is trusted, and was perhaps set since the start."""
        if self._started_at is None:
            return
        began = now - timedelta(seconds=self._clock.monotonic() - self._started_at)
        self._started_at = None
        if self._last_heartbeat is None:
            self._downtime.add(Gap(UNKNOWN_START, began))  # a run before may have ended before its first heartbeat
            self._absent_since = UNKNOWN_START
        elif self._last_heartbeat < EARLIEST <= now:  # by a wrong clock: unknown for how long it was off
            self._downtime.add(Gap(self._last_heartbeat, began, clock=True))
            self._absent_since = self._last_heartbeat
        elif began - self._last_heartbeat > timedelta(seconds=2 * HEARTBEAT_EVERY):
            self._away(self._last_heartbeat, began)

    def _away(self, start: datetime, end: datetime) -> None:
        self._downtime.add(Gap(start, end))
        if end - start >= SHORTEST_ABSENCE:
            self._absent_since = start if self._absent_since is None else min(self._absent_since, start)
            self._unreported = Gap(min(start, self._unreported.start) if self._unreported else start, end)
            log.warning(
                "The app was off or asleep from %s to %s UTC", f"{start:%Y-%m-%d %H:%M:%S}", f"{end:%Y-%m-%d %H:%M:%S}"
            )

    def _report_absence(self, now: datetime) -> None:
        """Once the clock is trusted: one that was wrong when the absence was noticed shows a wrong end."""
        gap = self._unreported
        if gap is not None and (end := min(gap.end, now)) - gap.start >= SHORTEST_ABSENCE:
            c = self._db.read()
            zone = self._settings.load(c).timezone
            # the app may have been on since the backup was made
            is_forgotten = to_text(gap.start) == self._settings.get(c, BACKUP_HEARTBEAT)
            self._alarms.raise_(
                "backup_restored" if is_forgotten else "app_was_off",
                "app",
                start=gap.start.isoformat(),
                end=end.isoformat(),
                timezone=zone,
            )
        self._unreported = None

    def _beat(self, now: datetime, mono: float) -> None:
        if mono - self._beat_at >= HEARTBEAT_EVERY:
            self._beat_at = mono
            self._db.write(lambda c: self._settings.set_heartbeat(c, now))


def _difference(differ: list[float]) -> Message:
    seconds = sorted(differ)[len(differ) // 2]
    if len(differ) == 1:
        return (
            message("the robot's clock is {time} ahead of it", time=_span(seconds))
            if seconds > 0
            else message("the robot's clock is {time} behind it", time=_span(-seconds))
        )
    if seconds > 0:
        return message("most robots' clocks are {time} ahead of it", time=_span(seconds))
    return message("most robots' clocks are {time} behind it", time=_span(-seconds))


def _span(seconds: float) -> Message:
    """In a suitable unit."""
    if seconds < 2 * 3600:
        return message("{minutes} min", minutes=round(seconds / 60))
    if seconds < 48 * 3600:
        return message("{hours} h", hours=round(seconds / 3600))
    return message("{days} days", days=round(seconds / 86400))
