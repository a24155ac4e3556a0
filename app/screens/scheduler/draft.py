"""The form of the Scheduler as plain values: the choices so far, and the schedule made of them. No kivy.

The form knows once, daily, weekly, "every" and monthly; any other rule (yearly, every second week, a count …), as in
imported files, is kept unchanged under ``Kind.OTHER``. An unchanged draft makes exactly the schedule it came from.
"""

from __future__ import annotations

from collections.abc import Collection, Mapping
from contextlib import suppress
from dataclasses import dataclass, field, replace
from datetime import UTC, date, datetime, time, timedelta
from enum import StrEnum
from typing import Any
from zoneinfo import ZoneInfo

from app.domain.models import WEEKDAYS, Between, InvalidInput, Overlap, Schedule, Settings
from app.services.planning.recurrence import next_occurrence
from app.services.planning.working_days import WorkingCalendar

Target = int | tuple[str, int]  # a robot's id, or ("group", id)
LAST = -1  # day of month or number of a weekday: the last one
NTH = (1, 2, 3, 4, 5, LAST)
MONTH_DAYS = (*range(1, 32), LAST)
SOON = 60  # days in which a working day is looked for


class Kind(StrEnum):
    """How often."""

    ONCE = "once"
    DAILY = "daily"
    WEEKLY = "weekly"
    EVERY = "every"
    MONTHLY = "monthly"
    OTHER = "other"


class Unit(StrEnum):
    """Of "every n …"."""

    MINUTES = "minutes"
    HOURS = "hours"


BEGINS_AT = {Unit.MINUTES: 30, Unit.HOURS: 1}  # "every …" with that unit, until another number is chosen
MOST = {Unit.MINUTES: 720, Unit.HOURS: 24}  # "every …": what the form offers
COMMON = {Unit.MINUTES: (5, 10, 15, 20, 30), Unit.HOURS: (1, 2, 3, 4, 6)}
DAY_BEGINS = time(8, 0)  # a new "every …" does, until another time is chosen
# the fields that a schedule has, too
SAME = (
    *("mission_id", "robot_id", "group_id", "finish_by_minutes", "minimum_battery_percent", "start_window_minutes"),
    *("overlap", "priority", "respect_working_days", "parameters"),
)


@dataclass(frozen=True)
class Draft:
    """The form's content. ``base`` is the schedule being edited; None: a new one."""

    day: date
    at: time
    timezone: str
    mission_id: int | None = None
    robot_id: int | None = None
    group_id: int | None = None  # in place of the robot: any of this group
    kind: Kind = Kind.ONCE
    more_hours: tuple[int, ...] = ()  # daily, weekly, monthly: also at the same minute of these hours
    weekdays: tuple[str, ...] = WEEKDAYS  # of weekly and every
    every: int = BEGINS_AT[Unit.MINUTES]
    unit: Unit = Unit.MINUTES
    all_day: bool = False  # every: round the clock instead of between two times
    until_time: time = time(18, 0)  # every: the second of the two times
    by_weekday: bool = False  # monthly: n-th weekday instead of day of month
    month_day: int = 1  # 1–31 or LAST
    nth: int = 1  # 1–5 or LAST
    month_weekday: str = "MO"
    last_day: date | None = None
    other_rule: str = ""
    minimum_battery_percent: float | None = None
    start_window_minutes: int | None = None
    finish_by_minutes: int | None = None  # of a group: it has to be done by then, after its instant
    overlap: Overlap = Overlap.SKIP
    priority: int = 0
    respect_working_days: bool = True
    parameters: Mapping[str, Any] = field(default_factory=dict)
    entered: Mapping[str, Any] = field(default_factory=dict)  # in the parameters' fields, as text where it was typed
    name: str = ""
    base: Schedule | None = None
    origin: Schedule | None = None  # the source of its times: the base, or the copied schedule

    @property
    def is_new(self) -> bool:
        return self.base is None

    @property
    def target(self) -> Target | None:
        """The robot, by its id, or the group, ("group", id)."""
        return self.robot_id if self.group_id is None else ("group", self.group_id)

    def aimed_at(self, target: Target) -> Draft:
        """At another robot or group; what only a group can do is dropped for a robot."""
        if isinstance(target, tuple):
            return replace(self, robot_id=None, group_id=target[1])
        return replace(
            self,
            robot_id=target,
            group_id=None,
            finish_by_minutes=None,
            overlap=Overlap.SKIP if self.overlap is Overlap.PARALLEL else self.overlap,
        )

    @property
    def is_stored(self) -> bool:
        """Whether it is an unchanged schedule, except for its name."""
        return self.base is not None and replace(Draft.of(self.base, self.name), origin=self.origin) == self

    @property
    def ends(self) -> bool:
        """Whether it has a last day that counts."""
        return self.last_day is not None and self.kind not in (Kind.ONCE, Kind.OTHER)

    @property
    def start(self) -> datetime:
        """Naive local: the earliest of its times on the first day."""
        return datetime.combine(self.day, self.at.replace(hour=min(self.hours)))

    @property
    def recurrence(self) -> str | None:
        """The choices as an RFC 5545 RRULE value; None for once. Raises InvalidInput for an impossible rule."""
        match self.kind:
            case Kind.ONCE:
                return None
            case Kind.OTHER:
                return self.other_rule
            case Kind.EVERY:
                frequency = "FREQ=HOURLY" if self.unit is Unit.HOURS else "FREQ=MINUTELY"
                parts = [frequency, *([f"INTERVAL={self.every}"] if self.every > 1 else []), *self._by_day()]
            case Kind.WEEKLY:
                parts = ["FREQ=WEEKLY", *self._by_day()]
            case Kind.MONTHLY if self.by_weekday:
                parts = [f"FREQ=MONTHLY;BYDAY={self.nth}{self.month_weekday}"]
            case Kind.MONTHLY:
                parts = [f"FREQ=MONTHLY;BYMONTHDAY={self.month_day}"]
            case Kind.DAILY:
                parts = ["FREQ=DAILY"]
        if len(hours := self.hours) > 1:
            parts += ["BYHOUR=" + ",".join(map(str, hours)), f"BYMINUTE={self.at.minute}"]
        if self.last_day is not None:
            if self.last_day < self.day:
                raise InvalidInput("last_day", "The last day is before the first")
            parts.append(f"UNTIL={self.last_day:%Y%m%d}")
        return ";".join(parts)

    @property
    def between(self) -> Between | None:
        """The part of the day of "every …". Raises InvalidInput when it ends before it begins."""
        if self.kind is Kind.OTHER:
            return self.origin.between if self.origin else None
        if self.kind is not Kind.EVERY or self.all_day:
            return None
        if self.until_time < self.at:
            raise InvalidInput("until_time", "It must end after it begins. Over midnight: make two schedules")
        return Between(self.at, self.until_time)

    def schedule(self) -> Schedule:
        """The schedule that this makes. Raises InvalidInput whose ``field`` is the form's (mission, robot, weekdays, every …)."""
        if self.mission_id is None:
            raise InvalidInput("mission", "Choose a mission")
        if self.target is None:
            raise InvalidInput("robot", "Choose a robot")
        base = self.base or Schedule(self.name, self.robot_id, self.mission_id, self.start, self.timezone)
        times: Draft | Schedule = self
        if self.origin is not None and _rule(self) == _rule(Draft.of(self.origin)):
            times = self.origin  # in the form in which they are stored
        return replace(
            base,
            name=self.name.strip(),
            **{name: getattr(self, name) for name in SAME},
            **_rule(times),
        )

    def with_day(self, day: date) -> Draft:
        """Another first day; what was derived from the old one changes with it."""
        old = Draft.derived(self.day)
        follow = {name: value for name, value in Draft.derived(day).items() if getattr(self, name) == old[name]}
        return replace(self, day=day, **follow)

    def moved(self, before: datetime, after: datetime) -> Draft:
        """Move the start at ``before`` (naive local) to ``after``. In a rule, starts of its hour on other days move
        too, the others keep their hours and get its minute; with "every …" all move. Those round the clock move by at most half
        an interval, so that no start at the beginning is lost, and none is before the first day."""
        if after == before:
            return self
        if self.kind is Kind.ONCE:
            return replace(self.with_day(after.date()), at=after.time())
        if self.kind is Kind.EVERY and self.all_day:
            apart = timedelta(minutes=self.every * (60 if self.unit is Unit.HOURS else 1))
            by = (after - before + apart / 2) % apart - apart / 2
            begins = datetime.combine(self.day, self.at) + by
            begins += apart if begins.date() < self.day else timedelta()
            return replace(self, day=begins.date(), at=begins.time())
        if self.kind in (Kind.EVERY, Kind.OTHER):
            by = datetime.combine(before, after.time()) - before
            begins, ends = datetime.combine(before, self.at) + by, datetime.combine(before, self.until_time) + by
            return replace(
                self, at=begins.time(), until_time=ends.time() if ends.date() <= begins.date() else time(23, 59)
            )
        hour = after.hour if before.hour == self.at.hour else self.at.hour
        hours = {*self.hours, after.hour} - ({before.hour} if before.hour != after.hour else set())
        draft = replace(self, at=time(hour, after.minute), more_hours=tuple(sorted(hours - {hour})))
        if before.date() == after.date():
            return draft
        old, new = WEEKDAYS[before.weekday()], WEEKDAYS[after.weekday()]
        return replace(
            draft,
            weekdays=tuple({new if day == old else day: None for day in self.weekdays}),
            **(Draft.derived(after.date()) if self.kind is Kind.MONTHLY else {}),
        )

    def starts_at(self, local: datetime, calendar: WorkingCalendar) -> bool:
        """Whether it would, at that naive local time."""
        try:
            begins = local.replace(second=0, microsecond=0, tzinfo=ZoneInfo(self.timezone))
            return next_occurrence(self.schedule(), begins.astimezone(UTC) - timedelta(seconds=1), calendar) == begins
        except InvalidInput:
            return False

    @staticmethod
    def derived(day: date) -> dict[str, Any]:
        """Fields of a monthly rule whose first day this is."""
        nth = (day.day - 1) // 7 + 1 if day.day <= 28 else LAST  # a fifth Monday is rare: the last one is meant
        return {"month_day": day.day, "nth": nth, "month_weekday": WEEKDAYS[day.weekday()]}

    @classmethod
    def new(
        cls,
        now: datetime,
        settings: Settings,
        calendar: WorkingCalendar,
        robot_id: int | None = None,
    ) -> Draft:
        """An empty form. ``now`` is local: the next full hour, on the next working day."""
        start = (now + timedelta(minutes=65)).replace(minute=0, second=0, microsecond=0, tzinfo=None)
        start = next(
            (day for n in range(SOON) if calendar.is_working_day((day := start + timedelta(days=n)).date())), start
        )
        return cls(
            day=start.date(),
            at=start.time(),
            timezone=settings.timezone,
            robot_id=robot_id,
            weekdays=tuple(settings.working_days),
            **cls.derived(start.date()),
        )

    @classmethod
    def of(cls, schedule: Schedule, name: str | None = None) -> Draft:
        """The form for a stored schedule. ``name`` is the one entered by a person, empty without one; None: as
        stored."""
        draft = cls(
            day=schedule.start.date(),
            at=schedule.start.time(),
            timezone=schedule.timezone,
            **{name: getattr(schedule, name) for name in SAME},
            name=schedule.name if name is None else name,
            base=schedule,
            origin=schedule,
            **cls.derived(schedule.start.date()),
        )
        return replace(draft, **_read_rule(schedule))

    def copy(self) -> Draft:
        """The same as a new schedule, without its name."""
        return replace(self, base=None, name="")

    # ------------------------------------------------------------------ inside
    @property
    def hours(self) -> list[int]:
        """Of all its times of day."""
        more = self.more_hours if self.kind in (Kind.DAILY, Kind.WEEKLY, Kind.MONTHLY) else ()
        return sorted({self.at.hour, *more})

    def _by_day(self) -> list[str]:
        days = [day for day in WEEKDAYS if day in self.weekdays]
        if not days:
            raise InvalidInput("weekdays", "Choose at least one day")
        if self.kind is Kind.EVERY and len(days) == len(WEEKDAYS):
            return []
        return ["BYDAY=" + ",".join(days)]


def _rule(times: Draft | Schedule) -> dict[str, Any]:
    return {name: getattr(times, name) for name in ("start", "timezone", "recurrence", "between")}


def _read_rule(schedule: Schedule) -> dict[str, Any]:
    """The form's fields for a schedule's recurrence; Kind.OTHER for a rule that the form doesn't know."""
    if schedule.recurrence is None:
        return {"kind": Kind.ONCE}
    parts = dict(part.split("=", 1) for part in schedule.recurrence.upper().split(";") if "=" in part)
    with suppress(ValueError):
        fields = _read_frequency(parts, schedule)
        if (until := parts.pop("UNTIL", None)) is not None:
            fields["last_day"] = datetime.strptime(until, "%Y%m%d").date()  # noqa: DTZ007 - a date
        if not parts:
            return fields
    return {"kind": Kind.OTHER, "other_rule": schedule.recurrence}


def _read_frequency(parts: dict[str, str], schedule: Schedule) -> dict[str, Any]:
    """The form's fields; parsed parts are removed from ``parts``. Raises ValueError for what the form doesn't know."""
    frequency, interval = parts.pop("FREQ", ""), int(parts.pop("INTERVAL", "1"))
    if frequency in ("MINUTELY", "HOURLY"):
        return _read_every(Unit.HOURS if frequency == "HOURLY" else Unit.MINUTES, interval, parts, schedule.between)
    if interval != 1 or schedule.between is not None:
        raise ValueError(schedule.recurrence)
    first = schedule.start.date()
    own: dict[str, Any] = {}
    match frequency:
        case "WEEKLY":
            own = {"weekdays": _plain_days(parts.pop("BYDAY", WEEKDAYS[first.weekday()]))}
        case "MONTHLY" if day := parts.pop("BYDAY", ""):
            own = {
                "by_weekday": True,
                "nth": _one_of(NTH, day[:-2]),
                "month_weekday": _plain_days(day[-2:])[0],
            }
        case "MONTHLY":
            own = {"month_day": _one_of(MONTH_DAYS, parts.pop("BYMONTHDAY", first.day))}
    hours = [int(hour) for hour in parts.pop("BYHOUR", str(schedule.start.hour)).split(",")]
    hour = schedule.start.hour if schedule.start.hour in hours else min(hours)
    at = time(hour, int(parts.pop("BYMINUTE", schedule.start.minute)))  # one minute of several hours
    return {"kind": Kind(frequency.lower()), "at": at, "more_hours": tuple(sorted({*hours} - {hour})), **own}


def _read_every(unit: Unit, interval: int, parts: dict[str, str], between: Between | None) -> dict[str, Any]:
    days = _plain_days(parts.pop("BYDAY", ",".join(WEEKDAYS)))
    every = _one_of(range(1, MOST[unit] + 1), interval)
    read = {"kind": Kind.EVERY, "unit": unit, "every": every, "weekdays": days, "all_day": between is None}
    return read if between is None else {**read, "at": between.start, "until_time": between.end}


def _one_of(numbers: Collection[int], value: Any) -> int:
    if int(value) not in numbers:
        raise ValueError(value)
    return int(value)


def _plain_days(value: str) -> tuple[str, ...]:
    days = {WEEKDAYS.index(day) for day in value.split(",")}
    return tuple(day for number, day in enumerate(WEEKDAYS) if number in days)
