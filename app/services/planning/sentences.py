"""What a schedule does, in one sentence: "Every Mon, Wed, Fri at 06:30". English msgids with named placeholders."""

from __future__ import annotations

from calendar import monthrange
from collections.abc import Sequence
from contextlib import suppress
from datetime import datetime, time
from types import MappingProxyType
from zoneinfo import ZoneInfo

from app.domain import models, writing
from app.domain.models import InvalidInput, Schedule
from app.domain.writing import Translate
from app.services.planning.recurrence import Frequency, Recurrence, months_of

LEAP_YEAR, LEAP_DAY = 2028, 29

WEEKDAYS = ("Mon", "Tue", "Wed", "Thu", "Fri", "Sat", "Sun")
MONTHS = (
    "January",
    "February",
    "March",
    "April",
    "May",
    "June",
    "July",
    "August",
    "September",
    "October",
    "November",
    "December",
)
_ORDINALS = MappingProxyType(
    {1: "first", 2: "second", 3: "third", 4: "fourth", 5: "fifth", -1: "last", -2: "last but one"}
)
_EVERY = MappingProxyType(
    {
        Frequency.MINUTELY: ("Every minute", "Every {number} minutes"),
        Frequency.HOURLY: ("Every hour", "Every {number} hours"),
        Frequency.DAILY: ("Every day", "Every {number} days"),
        Frequency.WEEKLY: ("Every {days}", "Every {number} weeks on {days}"),
        Frequency.MONTHLY: ("Every month on {days}", "Every {number} months on {days}"),
        Frequency.YEARLY: ("Every year on {days}", "Every {number} years on {days}"),
    }
)


def sentence(schedule: Schedule, translate: Translate = lambda text: text) -> str:
    """Never raises: a rule that can't be read is shown as it is."""
    with suppress(InvalidInput):
        return _Words(schedule, Recurrence.parse(schedule.recurrence), translate).sentence()
    return schedule.recurrence or ""


def missing_months(schedule: Schedule, translate: Translate = lambda text: text) -> str:
    """The months without a 29th, 30th or 31st of a rule, as in the sentence; "" without any. Never raises."""
    with suppress(InvalidInput):
        return "".join(_Words(schedule, Recurrence.parse(schedule.recurrence), translate).missing_months())
    return ""


def weekdays(days: Sequence[str], translate: Translate) -> str:
    """ "Mon, Tue" of their two letters."""
    return ", ".join(translate(WEEKDAYS[models.WEEKDAYS.index(day)]) for day in days)


class _Words:
    def __init__(self, schedule: Schedule, rule: Recurrence, translate: Translate) -> None:
        self._schedule, self._rule, self._translate = schedule, rule, translate

    def _say(self, text: str, **values: object) -> str:
        return self._translate(text).format(**values)

    def sentence(self) -> str:
        start, rule = self._schedule.start, self._rule
        if rule.frequency is Frequency.ONCE:
            once = self._say("Once on {day} at {time}", **self._moment(start))
            was = self._schedule.moved_from
            return (
                once
                if was is None
                else self._say(
                    "{once}, moved from {day} {time}",
                    once=once,
                    **self._moment(was.astimezone(ZoneInfo(self._schedule.timezone))),
                )
            )
        head = self._every()
        if not rule.frequency.is_sub_daily:
            head = self._say("{every} at {times}", every=head, times=self._times())
        elif between := self._schedule.between:
            head = self._say(
                "{every} from {start} to {end}",
                every=head,
                start=self._time(between.start),
                end=self._time(between.end),
            )
        working_days = [self._say("on working days only")] if self._schedule.respect_working_days else []
        return ", ".join([head, *self._limits(), *self.missing_months(), *self._end(), *working_days])

    def _moment(self, local: datetime) -> dict[str, str]:
        return {"day": writing.day_in_words(local, self._translate), "time": self._time(local)}

    def _every(self) -> str:
        one, many = _EVERY[self._rule.frequency]
        return self._say(one if self._rule.interval == 1 else many, number=self._rule.interval, days=self._days())

    def _days(self) -> str:
        rule, start = self._rule, self._schedule.start
        if rule.frequency is Frequency.WEEKLY:
            return self._weekdays(rule.weekdays or ((0, start.weekday()),))
        days = [self._weekdays(rule.weekdays)] if rule.weekdays else []
        if rule.month_days or not rule.weekdays:
            days.append(", ".join([self._month_day(day) for day in rule.month_days or (start.day,)]))
        said = ", ".join(days)
        if rule.frequency is Frequency.YEARLY and not (rule.months or rule.month_days or rule.weekdays):
            return self._say("{days} of {months}", days=said, months=self._translate(MONTHS[start.month - 1]))
        return said

    def _weekdays(self, weekdays: Sequence[tuple[int, int]]) -> str:
        days = [self._translate(WEEKDAYS[day]) for n, day in weekdays if n == 0]
        if [day for n, day in weekdays if n == 0] == [0, 1, 2, 3, 4]:
            days = [f"{days[0]}–{days[-1]}"]
        return ", ".join(
            days
            + [
                self._say("the {which} {weekday}", which=self._ordinal(n), weekday=self._translate(WEEKDAYS[day]))
                for n, day in weekdays
                if n
            ]
        )

    def _ordinal(self, number: int) -> str:
        return (
            self._translate(_ORDINALS[number]) if number in _ORDINALS else self._say("number {number}", number=number)
        )

    def _month_day(self, day: int) -> str:
        if day == -1:
            return self._say("the last day")
        return (
            self._say("day {day}", day=day) if day > 0 else self._say("{number} days before the last", number=-day - 1)
        )

    def _times(self) -> str:
        rule, start = self._rule, self._schedule.start
        return ", ".join(
            [
                self._time(time(hour, minute))
                for hour in rule.hours or (start.hour,)
                for minute in rule.minutes or (start.minute,)
            ]
        )

    def _time(self, at: datetime | time) -> str:
        return writing.time_of_day(at, self._translate)

    def _limits(self) -> list[str]:
        """What narrows a rule down further."""
        rule, said = self._rule, []
        is_daily = rule.frequency in (Frequency.MINUTELY, Frequency.HOURLY, Frequency.DAILY)
        if rule.weekdays and is_daily:
            said.append(self._say("on {days}", days=self._weekdays(rule.weekdays)))
        if rule.month_days and is_daily:
            said.append(self._say("on {days}", days=", ".join([self._month_day(day) for day in rule.month_days])))
        if rule.months:
            said.append(
                self._say(
                    "in {months}", months=", ".join([self._translate(MONTHS[month - 1]) for month in rule.months])
                )
            )
        if rule.frequency.is_sub_daily:
            if rule.hours:
                said.append(self._say("in the hours {hours}", hours=", ".join([f"{hour:02}" for hour in rule.hours])))
            if rule.minutes:
                said.append(
                    self._say(
                        "at the minutes {minutes}", minutes=", ".join([f"{minute:02}" for minute in rule.minutes])
                    )
                )
        return said

    def missing_months(self) -> list[str]:
        """Of a rule for a 29th, 30th or 31st the months that have none."""
        rule, start = self._rule, self._schedule.start
        if rule.frequency not in (Frequency.MONTHLY, Frequency.YEARLY) or rule.weekdays:
            return []
        months = months_of(rule, start.date())
        earliest = min(abs(day) for day in rule.month_days or (start.day,))
        never = [month for month in months if monthrange(LEAP_YEAR, month)[1] < earliest]
        if earliest == LEAP_DAY and 2 in months:
            return [self._say("in leap years only") if months == [2] else self._say("in February in leap years only")]
        return (
            [self._say("not in {months}", months=", ".join([self._translate(MONTHS[month - 1]) for month in never]))]
            if never
            else []
        )

    def _end(self) -> list[str]:
        rule = self._rule
        if rule.count is not None:
            return [self._say("once only") if rule.count == 1 else self._say("{number} times", number=rule.count)]
        return [] if rule.until is None else [self._say("until {day}", day=self._day_of(rule.until))]

    def _day_of(self, until: datetime) -> str:
        if (until.hour, until.minute, until.second) == (23, 59, 59) and until.tzinfo is None:
            return writing.day_in_words(until, self._translate)
        return f"{writing.day_in_words(until, self._translate)} {self._time(until)}" + (" UTC" if until.tzinfo else "")
