"""Checks of whole objects: each value by the tables of ``fields``, then the rules between them. The catalogue checks
relations to other objects. Each returns the object in its normal form or raises InvalidInput, which names the field and
says how to correct it."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import replace
from datetime import timedelta
from typing import Any

from app.domain.message import message
from app.domain.models import FEWEST_TO_KEEP_FREE, DayException, Fleet, Group, InvalidInput, Overlap, Robot, Schedule
from app.mir.address import machine
from app.services.catalogue import fields
from app.services.planning.recurrence import Recurrence, check_has_instants
from app.services.planning.working_days import WorkingCalendar

LONGEST_EXCEPTION = timedelta(days=366)
MOST_DAY_EXCEPTIONS = 2000
# Robots of a group; with fewer, everything else waits too long (tests/benchmarks/bench_allocation.py).
_SETTINGS = {
    field.attribute: field
    for field in (*fields.SETTINGS, *fields.DISPLAY, *fields.CALENDAR, *fields.UNLISTED)
    if not field.special
}
_WEEKDAY_NAMES = (
    message("Monday"),
    message("Tuesday"),
    message("Wednesday"),
    message("Thursday"),
    message("Friday"),
    message("Saturday"),
    message("Sunday"),
)


def check_name_is_free(other: Any, id_: int, msgid: str) -> None:
    """``other``: who has the name, or None; raises InvalidInput with this sentence unless it is the one with this id."""
    if other is not None and other.id != id_:
        raise InvalidInput("name", msgid, name=other.name)


def settings(changes: Mapping[str, Any]) -> dict[str, Any]:
    """Changes of settings, each in its normal form."""
    for name in changes:
        if name not in _SETTINGS:
            raise InvalidInput(name, "there is no setting {name!r}", name=name)
    return {name: _SETTINGS[name].check(value, name) for name, value in changes.items()}


def group(entered: Group, *, may_be_empty: bool = False) -> Group:
    entered = fields.checked(entered, fields.GROUP)
    members = tuple(sorted(set(entered.members)))
    if not members and not may_be_empty:
        raise InvalidInput("members", "choose the robots of the group")
    if entered.keep_free and (len(members) < FEWEST_TO_KEEP_FREE or entered.keep_free >= len(members)):
        raise InvalidInput(
            "keep_free",
            "robots can be kept free in a group of {fewest} robots or more, and not all of them",
            fewest=FEWEST_TO_KEEP_FREE,
        )
    return replace(entered, members=members)


def _machine(address: str) -> object:
    """An invalid one, after damage, belongs to no other."""
    try:
        return machine(address)
    except InvalidInput:
        return address


def _place(it: Robot | Fleet) -> tuple[int, str] | None:
    """At a fleet; None where it is reached directly."""
    return (it.fleet.id, it.vehicle) if isinstance(it, Robot) and it.fleet is not None else None


def check_is_no_other(it: Robot | Fleet, others: Iterable[Robot | Fleet]) -> None:
    """Raises InvalidInput for the address when one of ``others`` is the same machine, or for the place at a fleet. One
    machine may be reached directly and through a fleet, which is warned about."""
    place = _place(it)
    for other in others:
        if (type(other), other.id) == (type(it), it.id) or (place is None) is not (_place(other) is None):
            continue
        if place is not None:
            if place == _place(other):
                raise InvalidInput("vehicle", "this is {robot}, which is configured already", robot=other.name)
        elif _machine(it.address) == _machine(other.address):
            raise InvalidInput(
                "address", "this is the address of {robot}, which is configured already", robot=other.name
            )
        elif isinstance(it, Robot) and it.serial_number and it.serial_number == getattr(other, "serial_number", None):
            raise InvalidInput(
                "address",
                "this is {robot}, which is configured already: serial number {serial}",
                robot=other.name,
                serial=it.serial_number,
            )


def schedule(entered: Schedule) -> Schedule:
    entered = fields.checked(entered, fields.SCHEDULE)
    if entered.group_id is None and entered.finish_by_minutes is not None:
        raise InvalidInput(
            "finish_by_minutes", "a time by which it must be done is possible only for a group of robots"
        )
    if entered.group_id is None and entered.overlap is Overlap.PARALLEL:
        raise InvalidInput("overlap", "only a group of robots can run two starts of a schedule at once")
    if entered.between is not None and not Recurrence.parse(entered.recurrence).frequency.is_sub_daily:
        raise InvalidInput("between", "a part of the day is possible only for a recurrence in minutes or hours")
    check_has_instants(entered)
    return entered


def one_time_on_working_day(schedule: Schedule, calendar: WorkingCalendar) -> None:
    """A one-time schedule that respects working days can't lie on another day: it would never run. ``next`` of the
    error is the first working day after it ("" if there is none within a year)."""
    if schedule.recurrence is not None or not schedule.respect_working_days:
        return
    day = schedule.start.date()
    status = calendar.day_status(day)
    if status.is_working:
        return
    following = calendar.next_working_day(day)
    next_day = "" if following is None else following.isoformat()
    if status.name:
        raise InvalidInput(
            "start",
            "{day} is a day off: {name}. Choose another day or do not respect working days",
            day=f"{day:%Y-%m-%d}",
            name=status.name,
            next=next_day,
        )
    raise InvalidInput(
        "start",
        "{day} is a {weekday}, a day off: choose another day or do not respect working days",
        day=f"{day:%Y-%m-%d}",
        weekday=_WEEKDAY_NAMES[day.weekday()],
        next=next_day,
    )


def day_exception(exception: DayException) -> DayException:
    """Days off or extra working days."""
    exception = fields.checked(exception, fields.DAY)
    if exception.last_day < exception.first_day:
        raise InvalidInput("last_day", "the last day is before the first")
    if exception.last_day - exception.first_day >= LONGEST_EXCEPTION:
        raise InvalidInput("last_day", "at most a year can be entered at once")
    return exception
