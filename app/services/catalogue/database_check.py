"""Checks that the content of a database can be read and used. A value that can't have been entered here (the file was
prepared, or another program wrote to it) would otherwise stop all scheduling when it is first used."""

from __future__ import annotations

import itertools
import sqlite3
from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import asdict, replace
from datetime import datetime
from functools import partial
from typing import Any

from app.database.alarms import AlarmRepository
from app.database.check_ups import CheckUpRepository
from app.database.errors import primary_code
from app.database.execution_history import ExecutionFilter, ExecutionHistory
from app.database.executions import ExecutionRepository
from app.database.fleets import FleetRepository
from app.database.groups import GroupRepository, PlaceRepository
from app.database.missions import MissionRepository
from app.database.robots import HoldRepository, RobotRepository
from app.database.schedules import ScheduleRepository
from app.database.settings import (
    CLOCK_CONFIRMED_AT,
    DECLINED_PLACES,
    STEPS_LEFT_OUT,
    WRONG_PINS,
    CalendarRepository,
    SettingsRepository,
)
from app.database.table import Table
from app.database.value_checks import LARGEST_IN_USE, YEARS, tables, unusable, wrong_number
from app.database.values import to_optional_instant
from app.domain.execution import OPEN_STATES
from app.domain.message import Message, message
from app.domain.models import InvalidInput
from app.services.catalogue import checks, fields, validation
from app.services.catalogue.fields import checked
from app.services.live.access import PIN, is_hash
from app.services.live.tablet import stored_move
from app.services.planning.recurrence import Recurrence

LATEST = 1000  # of the executions and past alarms that are read
MOST_ROWS = 100_000  # of a table that is read as a whole
MOST_ROBOTS = 1000  # each takes a thread and 300 kB
LONGEST_TEXT = 100_000  # characters in a cell of it
# What has a default of its own when it isn't known here.
_FORGIVEN = ("timezone", "language", "theme", "holiday_country", "holiday_subdivision")


def find_problem(c: sqlite3.Connection) -> Message | None:
    """The first unusable value and its table; None: none. Reads only the open and the newest executions of the
    history."""
    for table, check in itertools.chain(_CHECKS.items(), _of_numbers(c)):
        try:
            check(c)
        except InvalidInput as error:
            problem: Message = message("{path}: {problem}", path=error.field, problem=error.message)
        except sqlite3.Error as error:
            if primary_code(error) not in (0, sqlite3.SQLITE_ERROR):  # of the storage, not of what is stored
                raise
            problem = str(error)[:200]
        except (ValueError, TypeError, LookupError, AttributeError, ArithmeticError, RecursionError) as error:
            problem = str(error)[:200] or type(error).__name__
        else:
            continue
        return unusable(table, problem)
    return None


def _require(condition: object, problem: str) -> None:
    if not condition:
        raise ValueError(problem)


def _check_instants(found: Iterable[Any]) -> None:
    """Each of a dataclass with a time zone and in a year that can be reckoned with; only a schedule's start has no zone."""
    for each in found:
        for name, value in vars(each).items():
            if isinstance(value, datetime):
                _require(value.year in YEARS and (value.tzinfo is None) == (name == "start"), f"{name} {value}")


def _check_objects(*values: object) -> None:
    for value in values:
        _require(isinstance(value, Mapping), "no JSON object")


def _each(repository: Table[Any], check: Callable[[Any], object]) -> Callable[[sqlite3.Connection], None]:
    def check_all(c: sqlite3.Connection) -> None:
        for each in repository.all(c):
            check(each)

    return check_all


# ---------------------------------------------------------------------- table by table
def _sizes(c: sqlite3.Connection) -> None:
    for table in (
        "settings",
        "fleets",
        "current_robots",
        "missions",
        "idle_rules",
        "robot_groups",
        "group_members",
        "places",
        "mission_places",
        "mission_stops",
        "schedules",
        "skips",
        "watches",
        "calendar_days",
        "alarms",
        "holds",
        "check_ups",
    ):
        texts = [row["name"] for row in c.execute(f"PRAGMA table_info({table})") if row["type"] == "TEXT"]
        longest = ", ".join(f"coalesce(length({name}), 0)" for name in texts)
        count, length = c.execute(f"SELECT count(*), max(max(0, {longest or 0})) FROM {table}").fetchone()
        most = MOST_ROBOTS if table == "current_robots" else MOST_ROWS
        _require(count <= most and (length or 0) <= LONGEST_TEXT, f"{table}: {count}, {length}")
    for row in c.execute("PRAGMA foreign_key_check").fetchall():
        raise ValueError(f"{row[0]} {row[1]} → {row[2]}")
    removed = c.execute("""
        SELECT 'schedules', id FROM current_schedules WHERE coalesce(
            (SELECT deleted_at FROM missions WHERE id = mission_id), (SELECT deleted_at FROM robots WHERE id = robot_id),
            (SELECT deleted_at FROM robot_groups WHERE id = group_id)) IS NOT NULL
        UNION SELECT 'missions', id FROM current_missions
            WHERE (SELECT deleted_at FROM robots WHERE id = robot_id) IS NOT NULL
        UNION SELECT 'robots', id FROM current_robots
            WHERE (SELECT deleted_at FROM fleets WHERE id = fleet_id) IS NOT NULL""")
    for row in removed.fetchall():
        raise ValueError(f"{row[0]} {row[1]} → deleted_at")


def _sequences(c: sqlite3.Connection) -> None:
    for table, last in c.execute("SELECT name, seq FROM sqlite_sequence"):
        _require(isinstance(last, int) and 0 <= last <= LARGEST_IN_USE, f"{table}: {last!r}")
    for (table,) in c.execute("SELECT name FROM sqlite_schema WHERE sql LIKE '%AUTOINCREMENT%'").fetchall():
        low, high = c.execute(f"SELECT coalesce(min(id), 1), coalesce(max(id), 1) FROM {table}").fetchone()
        _require(0 < low <= high <= LARGEST_IN_USE, f"{table}: {low}, {high}")


def _settings(c: sqlite3.Connection) -> None:
    repository = SettingsRepository()
    found = asdict(repository.load(c))
    validation.settings({name: value for name, value in found.items() if name not in _FORGIVEN})
    for text in (*(found[name] for name in _FORGIVEN), repository.get(c, "install_id", "")):
        _require(isinstance(text, str), repr(text)[:60])
    instants = [
        repository.heartbeat(c),
        repository.restored_at(c),
        repository.former_ran_until(c),
        to_optional_instant(repository.get(c, CLOCK_CONFIRMED_AT)),
    ]
    if move := stored_move(repository, c):
        instants.append(move.at)
    for instant in instants:
        _require(instant is None or (instant.tzinfo is not None and instant.year in range(1970, 10000)), str(instant))
    pin = repository.get(c, PIN)
    _require(pin is None or is_hash(pin), PIN)
    for name in (DECLINED_PLACES, STEPS_LEFT_OUT):
        keys = repository.get(c, name, [])
        _require(isinstance(keys, list) and all(isinstance(key, str) for key in keys), name)
    wrong, offsets = repository.get(c, WRONG_PINS, 0), repository.get(c, "confirmed_clock_offsets", {})
    _require(type(wrong) is int and 0 <= wrong <= LARGEST_IN_USE, f"{WRONG_PINS} {wrong!r}"[:60])
    _check_objects(offsets)
    _require(
        all(isinstance(offset, int | float) and abs(offset) <= LARGEST_IN_USE for offset in offsets.values()),
        "confirmed_clock_offsets",
    )


def _schedules(c: sqlite3.Connection) -> None:
    """Values that older versions allowed are accepted: only those that would stop the planning of others are
    refused."""
    found = ScheduleRepository().all(c)
    moved = {schedule.id for schedule in found if schedule.moved_of is not None}
    for schedule in found:
        is_moved = schedule.id in moved
        _require(is_moved == (schedule.moved_from is not None) and schedule.moved_of not in moved, "a moved start")
        _check_objects(schedule.parameters)
        Recurrence.parse(schedule.recurrence)
        checked(schedule, fields.SCHEDULE, "minimum_battery_percent", "start_window_minutes", "finish_by_minutes")
        _require(schedule.start.year in checks.YEARS, f"start {schedule.start}")
    _check_instants(found)


def _texts_of_instants(c: sqlite3.Connection, table: str, column: str) -> None:
    for (text,) in c.execute(f"SELECT {column} FROM {table}"):
        _require(datetime.fromisoformat(text).tzinfo is not None, text)


def _alarms(c: sqlite3.Connection) -> None:
    repository = AlarmRepository()
    found = [*repository.open(c), *repository.past(c, LATEST)]
    _check_instants(found)
    _check_objects(*(alarm.details for alarm in found))


def _lengths(c: sqlite3.Connection, table: str, *values: str) -> None:
    """Metres. NULL: not known."""
    for value in values:
        wrong = c.execute(f"SELECT {value} FROM {table} WHERE {value} < 0 OR {value} >= 9e999 LIMIT 1").fetchone()
        _require(wrong is None, f"{value} {wrong and wrong[0]}")


def _executions(c: sqlite3.Connection) -> None:
    found = [*ExecutionRepository().open_all(c), *ExecutionHistory().page(c, ExecutionFilter(), None, LATEST)]
    _check_instants(found)
    _check_objects(
        *itertools.chain.from_iterable((each.parameters, each.wait_details, each.choice, each.tried) for each in found)
    )
    for robot_id, tried in itertools.chain.from_iterable(each.tried.items() for each in found):
        _check_objects(tried)
        names = ("until",) if tried.get("is_for_good") else ("at", "until")
        instants = [datetime.fromisoformat(tried[name]) for name in names]
        _require(robot_id.isdigit() and all(instant.tzinfo is not None for instant in instants), f"tried {robot_id}")
        _require(
            isinstance(tried.get("tries", 0), int) and isinstance(tried.get("floor", 0), int | None),
            f"tried {robot_id}",
        )


def _of_numbers(c: sqlite3.Connection) -> Iterator[tuple[str, Callable[[sqlite3.Connection], None]]]:
    """Checks of all columns of numbers, except those only shown."""
    states = ", ".join(f"'{state}'" for state in OPEN_STATES)
    for table in tables(c):
        if table not in ("activity_spans", "activity_days", "ended_days"):
            yield (
                table,
                partial(_numbers, table=table, rows=f"WHERE state IN ({states})" if table == "executions" else ""),
            )


def _numbers(c: sqlite3.Connection, table: str, rows: str) -> None:
    problem = wrong_number(c, table, LARGEST_IN_USE, rows)
    _require(problem is None, problem or "")


# One robot that can't be reached at its address holds up no other, and is an alarm: its address is not checked.
_CHECKS: Mapping[str, Callable[[sqlite3.Connection], None]] = {
    "sqlite_schema": _sizes,
    "sqlite_sequence": _sequences,
    "settings": _settings,
    "fleets": _each(FleetRepository(), lambda fleet: checked(fleet, fields.FLEET, "name")),
    "robots": _each(RobotRepository(), lambda robot: robot.idle and checked(robot.idle, fields.IDLE)),
    "missions": _each(MissionRepository(), lambda mission: checked(mission, fields.MISSION, "guid", "usual_minutes")),
    "robot_groups": _each(GroupRepository(), partial(validation.group, may_be_empty=True)),
    "places": _each(PlaceRepository(), partial(checked, fields=fields.PLACE)),
    "schedules": _schedules,
    "skips": partial(_texts_of_instants, table="skips", column="planned_at"),
    "watches": partial(_texts_of_instants, table="watches", column="until"),
    "mission_stops": lambda c: _lengths(c, "mission_stops", "abs(x)", "abs(y)"),
    "check_ups": CheckUpRepository().check,
    "calendar_days": _each(CalendarRepository(), lambda day: validation.day_exception(replace(day, name="-"))),
    "holds": lambda c: _check_instants(HoldRepository().all(c)),
    "alarms": _alarms,
    "executions": _executions,
}
