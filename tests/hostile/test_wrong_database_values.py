"""Databases with one impossible value: each once ended all scheduling, or every start, without a message."""

from __future__ import annotations

import json
import math
import sqlite3
from contextlib import closing
from dataclasses import asdict
from datetime import UTC, datetime
from pathlib import Path

import pytest

from app.container import Container
from app.database import backups
from app.database.connection import DatabaseDamaged, DatabaseRefused
from app.database.group_executions import GroupExecutionRepository, Watch
from app.database.schema import MIGRATIONS
from app.database.value_checks import LARGEST_IN_BACKUP, tables
from app.domain import rules
from app.domain.check_up import LeftBehind, Report, RobotProfile
from app.domain.execution import Trigger
from app.domain.models import DayException, Group, IdleRule, Mission, Place, Robot, Schedule
from app.domain.robot import Pose
from app.mir import parse
from app.mir.errors import Unreadable
from app.services.catalogue.database_check import find_problem
from tests.support.errors import raises
from tests.support.examples import first_of_each
from tests.support.process import is_one_line, run

NOW = datetime(2026, 11, 23, 6, 0, tzinfo=UTC)
PIN_OF_HOURS = json.dumps({"salt": "00" * 16, "hash": "00" * 32, "n": 2**14, "r": 8, "p": 10_000})
KNOWN = RobotProfile(None, None)
STATUS = {"state_id": 3, "state_text": "Ready", "battery_percentage": 50.0}


def checked_up(column: str, **values: object) -> str:
    """A statement: a check-up has this in that column."""
    sound = {
        "profile": {**asdict(KNOWN), "ignores": None},
        "left_behind": asdict(LeftBehind(None)),
        "report": {
            **asdict(Report("Bad", "http://127.0.0.1:10", "", NOW, 60.0, (), KNOWN)),
            "began_at": NOW.isoformat(),
        },
    }
    text = json.dumps({**sound[column], **values})
    columns = {"profile": json.dumps(sound["profile"]), column: text}
    return (
        f"INSERT INTO check_ups (robot_id, {', '.join(columns)}) SELECT id, {', '.join(map(repr, columns.values()))} FROM robots "
        "WHERE name = 'Bad'"
    )


FLAGS = [
    ("robots", "enabled"),
    ("robots", "needs_password"),
    ("robots", "off_with_fleet"),
    ("idle_rules", "enabled"),
    ("missions", "favourite"),
    ("missions", "on_low_battery"),
    ("missions", "charges"),
    ("schedules", "enabled"),
    ("schedules", "respect_working_days"),
    ("calendar_days", "is_working"),
    ("calendar_days", "yearly"),
    ("executions", "held"),
]
FLEET = "INSERT INTO fleets (name, address, kind, enabled) VALUES ('Hall', 'http://127.0.0.1:11', '{}', {})"
# table, statement
WRONG = {
    "an unknown identity": ("robots", "UPDATE robots SET identified_by = 'nonsense' WHERE name = 'Bad'"),
    **{
        f"{table}.{flag} that is neither on nor off": (table, f"UPDATE {table} SET {flag} = 7") for table, flag in FLAGS
    },
    "a fleet of an unknown kind": ("fleets", FLEET.format("other", 1)),
    "a fleet that is neither on nor off": ("fleets", FLEET.format("classic", 7)),
    "a robot of a fleet that never was": ("sqlite_schema", "UPDATE robots SET fleet_id = 77"),
    "idle minutes": ("robots", "UPDATE idle_rules SET after_minutes = 9223372036854775807"),
    "a guid that is a path": ("missions", "UPDATE missions SET guid = '../../users'"),
    "a rule that can't be read": ("schedules", "UPDATE schedules SET recurrence = 'FREQ=NONSENSE'"),
    "a start that is no time": ("schedules", "UPDATE schedules SET start = 'yesterday'"),
    "an instant without a zone": ("schedules", "UPDATE schedules SET next_at = '2026-11-23'"),
    "an instant at the end of time": ("schedules", "UPDATE schedules SET next_at = '9999-12-31T23:59:59.999999Z'"),
    "a window of ages": ("schedules", "UPDATE schedules SET start_window_minutes = 4611686018427387904"),
    "a start that was moved from no time": ("schedules", "UPDATE schedules SET moved_of = id"),
    "a moved start of itself": ("schedules", "UPDATE schedules SET moved_of = id, moved_from = next_at"),
    "parameters that are a list": ("schedules", "UPDATE schedules SET parameters = '[1]'"),
    "a start that was skipped at no time": ("skips", "INSERT INTO skips SELECT id, 'tomorrow', 0 FROM schedules"),
    "a start that is neither skipped nor kept back": (
        "skips",
        "INSERT INTO skips SELECT id, '2026-11-23T06:10:00.000000Z', 2 FROM schedules",
    ),
    "a schedule of a robot that was deleted": ("sqlite_schema", "UPDATE robots SET deleted_at = '2026-11-23'"),
    "a schedule of a mission that was deleted": ("sqlite_schema", "UPDATE missions SET deleted_at = '2026-11-23'"),
    "a schedule of no robot": ("sqlite_schema", "UPDATE schedules SET robot_id = 77 WHERE name = 'S'"),
    "a name without end": ("sqlite_schema", "UPDATE robots SET name = hex(zeroblob(500000)) WHERE name = 'Bad'"),
    "a parameter without end": (
        "sqlite_schema",
        "UPDATE schedules SET parameters = json_object('x', hex(zeroblob(500000)))",
    ),
    "more robots than there can be threads": (
        "sqlite_schema",
        """WITH RECURSIVE n(i) AS (SELECT 1 UNION ALL SELECT i + 1 FROM n WHERE i < 1000)
                            INSERT INTO robots (name, address) SELECT 'R' || i, 'http://127.0.0.1:9' FROM n""",
    ),
    "a setting of another type": (
        "settings",
        "INSERT OR REPLACE INTO settings VALUES ('poll_interval_seconds', '\"abc\"')",
    ),
    "a setting out of its range": ("settings", "INSERT OR REPLACE INTO settings VALUES ('poll_interval_seconds', '0')"),
    "a setting that is no JSON": (
        "settings",
        "INSERT OR REPLACE INTO settings VALUES ('poll_interval_seconds', 'not json')",
    ),
    "bottomless JSON": ("settings", f"INSERT OR REPLACE INTO settings VALUES ('working_days', '{'[' * 90_000}')"),
    "a heartbeat that is a number": ("settings", "INSERT OR REPLACE INTO settings VALUES ('heartbeat', '5')"),
    "declined places that are a number": (
        "settings",
        "INSERT OR REPLACE INTO settings VALUES ('declined_places', '[5]')",
    ),
    "wrong PINs that are a text": (
        "settings",
        "INSERT OR REPLACE INTO settings VALUES ('settings_pin_wrong', '\"many\"')",
    ),
    "wrong PINs without end": (
        "settings",
        f"INSERT OR REPLACE INTO settings VALUES ('settings_pin_wrong', '1{'0' * 400}')",
    ),
    "a clock's error without end": (
        "settings",
        f"INSERT OR REPLACE INTO settings VALUES ('confirmed_clock_offsets', json_object('1', json('1{'0' * 400}')))",
    ),
    "a clock's error that is no number": (
        "settings",
        "INSERT OR REPLACE INTO settings VALUES ('confirmed_clock_offsets', '{\"1\": NaN}')",
    ),
    "a PIN that is no JSON": ("settings", "INSERT INTO settings VALUES ('settings_pin', 'not json')"),
    "a PIN that is a number": ("settings", "INSERT INTO settings VALUES ('settings_pin', '1234')"),
    "a PIN that takes hours to compare": (
        "settings",
        f"INSERT INTO settings VALUES ('settings_pin', '{PIN_OF_HOURS}')",
    ),
    "a move that is none": ("settings", "INSERT OR REPLACE INTO settings VALUES ('moved', '{\"at\": 7}')"),
    "a hand-over that is none": ("robot_groups", "UPDATE robot_groups SET hand_over = 'whim'"),
    "robots kept free without end": ("robot_groups", "UPDATE robot_groups SET keep_free = 9223372036854775807"),
    "a group without end": ("sqlite_schema", "UPDATE robot_groups SET name = hex(zeroblob(500000))"),
    "a group of no robot": ("sqlite_schema", "UPDATE group_members SET robot_id = 77 WHERE robot_id = 2"),
    "a group's id at its end": (
        "sqlite_sequence",
        "INSERT INTO robot_groups (id, name) VALUES (9223372036854775807, 'Last')",
    ),
    "a profile that is none": (
        "robots",
        "INSERT INTO check_ups (robot_id, profile) SELECT id, '[]' FROM robots WHERE name = 'Bad'",
    ),
    "a check-up that is none": (
        "check_ups",
        "INSERT INTO check_ups (robot_id, report) SELECT id, '{}' FROM robots WHERE name = 'Bad'",
    ),
    "what no check-up leaves": (
        "check_ups",
        "INSERT INTO check_ups (robot_id, left_behind) SELECT id, '7' FROM robots WHERE name = 'Bad'",
    ),
    "a page of a robot's list with less than nothing": ("robots", checked_up("profile", page_limit=-50)),
    "pages of one entry, which have no order": ("robots", checked_up("profile", page_limit=1)),
    "a time-out that is no number": ("robots", checked_up("profile", timeout_s=float("nan"))),
    "a quiet time without end": ("robots", checked_up("profile", quiet_s=float("inf"))),
    "an answer before the question": ("robots", checked_up("profile", latency=[-1.0, 0.1, 0.2, 0.3])),
    "a rest of no requests": ("robots", checked_up("profile", rest={"requests": 0, "seconds": 10.0})),
    "a word that means something else": ("robots", checked_up("profile", item_states={"Executing": "Done"})),
    "a word that means nothing": ("robots", checked_up("profile", item_states={"Fertig": "Ready"})),
    "a check-up that took no time": ("check_ups", checked_up("report", took_s=float("nan"))),
    "a check-up at the end of time": ("check_ups", checked_up("report", began_at="9999-12-31T23:59:59-12:00")),
    "a mission that was left elsewhere": ("check_ups", checked_up("left_behind", mission="../users/admin")),
    "a stop without end": (
        "mission_stops",
        "INSERT INTO mission_stops VALUES ('guid-1', 1, 'p', 'P', NULL, 9e999, 0.0)",
    ),
    "a place of none": ("places", "UPDATE places SET most = -1"),
    "a place without end": ("sqlite_schema", "UPDATE places SET name = hex(zeroblob(500000))"),
    "a finish of ages": ("schedules", "UPDATE schedules SET finish_by_minutes = 4611686018427387904"),
    "a start that may come at no time": ("watches", "UPDATE watches SET until = 'never'"),
    "a start that may come without a zone": ("watches", "UPDATE watches SET until = '2026-11-23'"),
    "a day that does not exist": ("calendar_days", "UPDATE calendar_days SET first_day = '0000-00-00'"),
    "a hold of no time": ("holds", "INSERT INTO holds (started_at) VALUES ('now')"),
    "an alarm that is no JSON": ("alarms", "UPDATE alarms SET details = '{{{'"),
    "an alarm of an unknown priority": ("alarms", "UPDATE alarms SET priority = 'shrill'"),
    "an unknown state": ("executions", "UPDATE executions SET state = 'dancing'"),
    "an unknown reason": ("executions", "UPDATE executions SET reason_code = 'whim'"),
    "ids at their end": ("sqlite_sequence", "UPDATE sqlite_sequence SET seq = 9223372036854775000"),
    "a sequence that is a text": ("sqlite_sequence", "UPDATE sqlite_sequence SET seq = 'abc'"),
    "an id at its end": ("sqlite_sequence", "UPDATE robots SET id = 9223372036854775807 WHERE name = 'Good'"),
}


def table_of(case: tuple[str, ...]) -> str:
    return case[0]


@pytest.fixture(scope="module")
def sound(tmp_path_factory) -> Path:
    """A backup with something in every table."""
    directory = tmp_path_factory.mktemp("sound")
    container = Container.open(directory / "data")
    catalogue = container.catalogue
    mission = catalogue.save_mission(Mission("M", "guid-1"))
    catalogue.save_robot(Robot("Good", "http://127.0.0.1:9", "distributor"), "secret")
    bad = catalogue.save_robot(Robot("Bad", "http://127.0.0.1:10", "distributor", idle=IdleRule(mission.id)), "secret")
    catalogue.save_schedule(Schedule("S", bad.id, mission.id, datetime(2026, 11, 23, 6), "UTC", "FREQ=DAILY"))
    third = catalogue.save_robot(Robot("Third", "http://127.0.0.1:11", "distributor"), "secret")
    group = catalogue.save_group(Group("Hall", (bad.id, third.id)))
    catalogue.save_place(Place("Dock", 1, (mission.id,)))
    catalogue.save_schedule(
        Schedule("G", None, mission.id, datetime(2026, 11, 23, 6), "UTC", "FREQ=DAILY", group_id=group.id)
    )
    container.db.write(lambda c: GroupExecutionRepository().watch(c, Watch(1, bad.id, 0, NOW)))
    catalogue.save_days(DayException("Inventory", NOW.date(), NOW.date()))
    container.alarms.raise_("backup_failed", "backup", problem="x")
    container.ledger.add(rules.one_off(Trigger.MANUAL, bad, mission, container.settings(), NOW, "token"))
    container.close()
    backups.back_up(directory / "data" / "amr-scheduler.db", directory / "backup.db")
    return directory / "backup.db"


def spoilt(sound: Path, path: Path, statement: str) -> Path:
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_bytes(sound.read_bytes())
    with closing(sqlite3.connect(path)) as connection, connection:
        connection.execute(statement)
    return path


@pytest.mark.parametrize(("table", "statement"), first_of_each(WRONG, table_of))
def test_one_wrong_value_is_refused_before_anything_is_changed(sound, tmp_path, table, statement):
    backup = spoilt(sound, tmp_path / "backup.db", statement)
    target = tmp_path / "data" / "amr-scheduler.db"
    with pytest.raises(DatabaseRefused, match=f"its table {table} has a value that can't be used"):
        backups.restore(backup, target, NOW, find_problem)
    assert not target.exists()


@pytest.mark.parametrize(("table", "statement"), first_of_each(WRONG))
def test_nor_is_scheduled_with_a_database_that_has_one(sound, tmp_path, table, statement):
    database = spoilt(sound, tmp_path / "amr-scheduler.db", statement)
    good = spoilt(sound, tmp_path / "backups" / "daily-2026-11-22.db", "SELECT 1")
    spoilt(sound, tmp_path / "backups" / "daily-2026-11-23.db", statement)
    with raises(DatabaseDamaged, f"its table {table} .*--restore-backup", backup=good):
        Container.open(tmp_path)
    assert database.exists()
    backups.restore(good, database, NOW, find_problem)
    Container.open(tmp_path).close()


def test_a_rule_that_could_be_entered_once_is_not_a_reason_to_refuse_everything(sound, tmp_path):
    for rule in ("FREQ=YEARLY;BYMONTH=2;BYMONTHDAY=30", "FREQ=MINUTELY;COUNT=1000000"):
        spoilt(sound, tmp_path / "amr-scheduler.db", f"UPDATE schedules SET recurrence = '{rule}'")
        Container.open(tmp_path).close()


def test_a_text_that_is_no_text(sound, tmp_path):
    statement = "UPDATE robots SET name = CAST(x'ff' AS TEXT) WHERE name = 'Bad'"
    database = spoilt(sound, tmp_path / "amr-scheduler.db", statement)
    with pytest.raises(DatabaseDamaged, match="its table robots has a value"):
        Container.open(tmp_path)
    with pytest.raises(DatabaseRefused, match=r"it is damaged\). Nothing was changed"):
        backups.restore(spoilt(sound, tmp_path / "backup.db", statement), database, NOW, find_problem)


def test_a_start_says_so_in_one_line(sound, tmp_path):
    database = spoilt(sound, tmp_path / "amr-scheduler.db", "UPDATE schedules SET start = 'yesterday'")
    done = run(tmp_path, "--headless")
    assert (done.returncode, is_one_line(done.stderr)) == (2, True)
    assert "table schedules" in done.stderr
    assert database.exists()


@pytest.mark.parametrize(
    ("command", "statement"),
    first_of_each(
        {
            "an instant": ("--export-config", "UPDATE schedules SET start = 'yesterday'"),
            "JSON": ("--export-config", "UPDATE schedules SET parameters = '[1'"),
            "a text": ("--export-config", "UPDATE robots SET name = CAST(x'ff' AS TEXT) WHERE name = 'Bad'"),
            "an instant of a run": ("--export-log", "UPDATE executions SET planned_at = 'yesterday'"),
            "a state": ("--export-log", "UPDATE executions SET state = 'dancing'"),
        },
        lambda case: case[0],
    ),
)
def test_so_does_an_export_and_leaves_the_file_of_the_last_one(sound, tmp_path, command, statement):
    spoilt(sound, tmp_path / "amr-scheduler.db", statement)
    (target := tmp_path / "export").write_text("of yesterday")
    done = run(tmp_path, command, str(target))
    assert (done.returncode, is_one_line(done.stderr)) == (2, True)
    assert "has a value that can't be used" in done.stderr
    assert target.read_text() == "of yesterday"


# ---------------------------------------------------------------------- what only grows, or is only counted
END = 2**63 - 1
SPAN = "INSERT INTO activity_spans VALUES (1, '{}', '{}', '{}')"
GROWN = {
    "a span that began at no time": ("activity_spans", SPAN.format("tomorrow", "2026-11-23T06:00:00.000000Z", "idle")),
    "a span that ended on a day that no month has": (
        "activity_spans",
        SPAN.format("2026-02-28T06:00:00.000000Z", "2026-02-30T06:00:00.000000Z", "idle"),
    ),
    "a span of thousands of years": (
        "activity_spans",
        SPAN.format("0001-01-01T00:00:00.000000Z", "9999-12-31T00:00:00.000000Z", "idle"),
    ),
    "a span out of order": ("activity_spans", SPAN.format("2026-11-23T06:00:00Z", "2026-11-23T07:00:00Z", "idle")),
    "a span of an unknown activity": (
        "activity_spans",
        SPAN.format("2026-11-23T06:00:00.000000Z", "2026-11-23T07:00:00.000000Z", "dancing"),
    ),
    "a day of an unknown activity": (
        "activity_days",
        "INSERT INTO activity_days VALUES (1, '2026-11-22', 'dancing', 5.0)",
    ),
    "a day that no month has": ("activity_days", "INSERT INTO activity_days VALUES (1, '2026-02-30', 'idle', 5.0)"),
    "seconds without end": ("activity_days", "INSERT INTO activity_days VALUES (1, '2026-11-22', 'idle', 9e999)"),
    "a battery that was used without end": ("robots", "UPDATE robots SET drain_percent = 9e999 WHERE name = 'Bad'"),
    "runs of a battery without end": ("robots", f"UPDATE robots SET drain_runs = {END} WHERE name = 'Bad'"),
    "an alarm that was counted without end": ("alarms", f"UPDATE alarms SET count = {END}"),
    "attempts without end": ("executions", f"UPDATE executions SET attempts = {END}"),
    "a robot that was tried at no time": (
        "executions",
        """UPDATE executions SET tried = '{"1": {"until": "2026-11-23T06:00:00Z", "at": "now"}}'""",
    ),
}


@pytest.mark.parametrize(("table", "statement"), first_of_each(GROWN, table_of))
def test_nor_is_one_restored_with_what_can_not_be_reckoned_with(sound, tmp_path, table, statement):
    backup = spoilt(sound, tmp_path / "backup.db", statement)
    with pytest.raises(DatabaseRefused, match=f"its table {table} has a value that can't be used"):
        backups.restore(backup, tmp_path / "data" / "amr-scheduler.db", NOW, find_problem)


SPANS = ("2026-11-23T06:00:00.000000Z", "2026-11-23T07:00:00.000000Z", "idle")
MORE = f"""
INSERT INTO executions (trigger, robot_id, robot, mission, mission_guid, timezone, token, planned_at, closes_at, created_at, state,
                        ended_at, duration_s, submitted_at, started_at, robot_delay_s, approach_m, minimum_battery_percent, queue_id,
                        queue_floor)
VALUES ('manual', NULL, '', 'M', 'guid-1', 'UTC', 'old', '{SPANS[0]}', '{SPANS[1]}', '{SPANS[0]}', 'completed', '{SPANS[1]}', 60.0,
        '{SPANS[0]}', '{SPANS[0]}', 1.0, 2.0, 20.0, 7, 6);
INSERT INTO fleets (name, address, kind) VALUES ('Hall', 'http://127.0.0.1:11', 'classic');
INSERT INTO run_durations VALUES (1, 'guid-1', '{SPANS[1]}', 7, 60.0, 2.0);
INSERT INTO skips SELECT id, '{SPANS[1]}', 0 FROM schedules;
INSERT INTO holds (robot_id, started_at) VALUES (1, '{SPANS[0]}');
INSERT INTO mission_stops VALUES ('guid-1', 1, 'p', 'P', NULL, 1.0, 1.0);
INSERT INTO mission_parameters VALUES (1, 'guid-1', '[]');
INSERT INTO suggestion_answers (schedule_id, answer, answered_at, late, starts) VALUES (1, 'accepted', '{SPANS[0]}', 1, 2);
INSERT INTO activity_days VALUES (1, '2026-11-22', 'idle', 5.0);
{SPAN.format(*SPANS)};
{checked_up("left_behind")};
"""


@pytest.fixture(scope="module")
def full(sound, tmp_path_factory) -> Path:
    """The same with a row in every table."""
    path = spoilt(sound, tmp_path_factory.mktemp("full") / "backup.db", "SELECT 1")
    with closing(sqlite3.connect(path)) as c:
        c.executescript(MORE)
    return path


def columns_of_numbers() -> dict[str, tuple[str, str, object]]:
    with closing(sqlite3.connect(":memory:")) as c:
        c.executescript("".join(MIGRATIONS))
        return {
            f"{table}.{row[1]}": (table, row[1], {"INTEGER": END, "REAL": float("inf")}[row[2]])
            for table in tables(c)
            for row in c.execute(f"PRAGMA table_info({table})")
            if row[2] in ("INTEGER", "REAL")
        }


@pytest.mark.parametrize(("table", "column", "number"), first_of_each(columns_of_numbers(), table_of))
def test_no_number_is_restored_to_which_nothing_can_be_added(full, tmp_path, table, column, number):
    target = tmp_path / "data" / "amr-scheduler.db"
    backup = spoilt(full, tmp_path / "backup.db", "SELECT 1")
    with closing(sqlite3.connect(backup)) as c, c:
        c.execute("PRAGMA ignore_check_constraints = ON")
        *_others, last = c.execute(f"SELECT * FROM {table}")
        is_last = " AND ".join(f"{row[1]} IS ?" for row in c.execute(f"PRAGMA table_info({table})"))
        assert c.execute(f"UPDATE {table} SET {column} = ? WHERE {is_last}", (number, *last)).rowcount == 1
    if table == "ended_days":
        backups.restore(backup, target, NOW, find_problem)
    else:
        with pytest.raises(DatabaseRefused):
            backups.restore(backup, target, NOW, find_problem)


def test_a_restored_database_can_grow_and_be_opened(full, tmp_path):
    """With the largest numbers that a backup may have, and one more run."""
    backup = spoilt(
        full,
        tmp_path / "backup.db",
        f"UPDATE robots SET drain_runs = {LARGEST_IN_BACKUP}, failures = {LARGEST_IN_BACKUP}",
    )
    spoilt_more = spoilt(backup, tmp_path / "more.db", f"UPDATE sqlite_sequence SET seq = {LARGEST_IN_BACKUP}")
    database = tmp_path / "data" / "amr-scheduler.db"
    backups.restore(spoilt_more, database, NOW, find_problem)
    spoilt(database, database, "UPDATE robots SET drain_runs = drain_runs + 1, failures = failures + 1")
    Container.open(tmp_path / "data").close()


def test_all_of_these_are_restored_with_what_they_should_hold(full, tmp_path):
    backups.restore(full, tmp_path / "amr-scheduler.db", NOW, find_problem)
    with closing(sqlite3.connect(tmp_path / "amr-scheduler.db")) as c:
        assert all(c.execute(f"SELECT count(*) FROM {table}").fetchone()[0] for table in tables(c))


@pytest.mark.parametrize(
    "wrong",
    [
        f"UPDATE ended_days SET number = {END}",
        f"UPDATE ended_days SET starts = {END}",
        f"UPDATE ended_days SET microseconds = {END}",
        "DELETE FROM ended_days",
        "UPDATE executions SET duration_s = 9e15 WHERE ended_at IS NOT NULL",
    ],
)
def test_wrong_counters_are_recounted_so_that_runs_can_end(full, tmp_path, wrong):
    backups.restore(spoilt(full, tmp_path / "backup.db", wrong), tmp_path / "amr-scheduler.db", NOW, find_problem)
    with closing(sqlite3.connect(tmp_path / "amr-scheduler.db")) as c:
        assert c.execute("SELECT number, starts FROM ended_days").fetchall() == [(1, 1)]
        c.execute(f"UPDATE executions SET state = 'completed', ended_at = '{SPANS[1]}', duration_s = 60.0")
        assert c.execute("SELECT sum(number), sum(timed) FROM ended_days").fetchone() == (2, 2)


def test_no_number_that_a_robot_may_say_keeps_the_app_from_starting_again(sound, tmp_path):
    """The largest ones that are taken of it: its queue's, and how far away it and its missions' stops are."""
    for number in (2**53 + 1, 2**63 - 1):
        with pytest.raises(Unreadable):
            parse.queue_id({"id": number})
    far = parse.FARTHEST
    assert parse.status({**STATUS, "position": {"x": 2 * far, "y": 0.0, "orientation": 0.0}}).position is None
    assert parse.status({**STATUS, "position": {"x": far, "y": -far, "orientation": 0.0}}).position == Pose(
        far, -far, 0.0
    )
    number = parse.queue_id({"id": 2**53})
    database = spoilt(
        sound, tmp_path / "amr-scheduler.db", f"UPDATE robots SET last_queue_id = {number}, idle_queue_id = {number}"
    )
    for statement in (
        f"UPDATE executions SET queue_id = {number}, queue_floor = {number}, approach_m = {math.hypot(2 * far, 2 * far)}",
        f"INSERT INTO mission_stops VALUES ('guid-1', 1, 'p', 'P', NULL, {far}, {-far})",
    ):
        spoilt(database, database, statement)
    Container.open(tmp_path).close()
