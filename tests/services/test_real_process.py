"""The app as a real process: what the contract says about commands, signals, locks and damage, and SIGKILL at random moments."""

from __future__ import annotations

import base64
import csv
import io
import json
import re
import shutil
import signal
import stat
from pathlib import Path

import pytest

import mir_sim
from app.database.connection import Database
from app.domain.clock import SystemClock
from app.mir.credentials import Token
from app.services.live.access import Access
from app.services.live.alarms import Alarms
from app.services.live.changes import Changes
from tests.support.examples import at_night, first_of_each
from tests.support.process import (
    PATIENCE,
    answer,
    begun,
    configuration_of,
    import_configuration,
    once_now,
    prepared,
    read_only,
    refusal,
    run,
    running,
    wait_for,
    write_configuration,
)

DATABASE = "amr-scheduler.db"
STOPS_WITHIN = 15.0  # s; the contract says 5, the rest is for a busy machine


@pytest.fixture
def data(tmp_path) -> Path:
    return tmp_path / "data"


@pytest.fixture
def robot(fleet) -> mir_sim.FleetRobot:
    return fleet.robots[0]


@pytest.fixture
def site(data, fleet) -> Path:
    """A data directory that knows the robot and its missions; polls every second, so that "within one poll" is soon."""
    prepared(data, configuration_of(fleet, poll_interval_seconds=1, unknown_outcome_quiet_seconds=5))
    return data


def queue_of(robot) -> list[dict]:
    return robot.state()["queue"]


def history(data) -> list[dict]:
    return list(csv.DictReader(io.StringIO(answer(data, "--export-log", "-"))))


# ---------------------------------------------------------------------- start and stop
@pytest.mark.parametrize("by", [signal.SIGTERM, *at_night(signal.SIGINT)])
def test_headless_says_ready_once_and_ends_with_0(site, by):
    with running(site) as app:
        assert app.stop(by) == 0
        assert app._stdout.empty()
        assert not app.said("Traceback")


@pytest.mark.long
def test_a_robot_that_hangs_holds_up_neither_ready_nor_the_end(site, robot):
    robot.control({"fault": {"kind": "hang", "count": None}})
    with running(site) as app:
        app.process.send_signal(signal.SIGTERM)
        assert app.process.wait(STOPS_WITHIN) == 0


def test_a_second_process_on_the_same_data_refuses_and_names_the_first(site):
    with running(site) as app:
        assert str(app.process.pid) in refusal(site, "--headless")
        assert app.process.poll() is None


# ---------------------------------------------------------------------- run now
def test_run_now_waits_until_the_robot_has_it_and_prints_the_queue_id(site, robot):
    position = "a1c4e006-5d0f-11ef-93c1-0001297b6e20"
    printed = answer(site, "--run-now", robot.name, "Go to position", "--parameter", f"Position={position}")
    (item,) = queue_of(robot)
    assert printed == f"{item['id']}\n"
    assert [p["value"] for p in item["parameters"]] == [position]


def test_run_now_during_a_running_app_is_handed_to_it(site, robot):
    with running(site):
        printed = answer(site, "--run-now", robot.name, "Home")
        assert [f"{item['id']}\n" for item in queue_of(robot)] == [printed]
        wait_for(lambda: [row["state"] in ("queued", "executing", "completed") for row in history(site)] == [True])


@pytest.mark.long
def test_an_answer_lost_on_the_radio_does_not_make_run_now_send_twice(site, robot):
    robot.control({"fault": {"kind": "drop_response", "method": "POST", "path": "/mission_queue"}})
    done = run(site, "--run-now", robot.name, "Home")
    assert done.returncode == 0
    assert [f"{item['id']}\n" for item in queue_of(robot)] == [done.stdout]


@pytest.mark.long
def test_run_now_says_why_it_did_not_run(site, robot):
    import_configuration(site, {"missions": [{"name": "Fly", "guid": "00000000-1"}]})
    for wanted, code, words in (
        (("R9", "Home"), 2, "no robot 'R9'"),
        ((robot.name, "Swim"), 2, "no mission 'Swim'"),
        ((robot.name, "Fly"), 1, "Fly on Aino was not started: "),
    ):
        assert words in refusal(site, "--run-now", *wanted, code=code)
    assert queue_of(robot) == []


@pytest.mark.long
def test_run_now_on_a_group_without_robots_leaves_nothing_behind_that_may_start_later(site):
    import_configuration(site, {"groups": [{"name": "Hall", "robots": []}]})
    refusal(site, "--run-now", "Hall", "Home", code=1)
    (row,) = history(site)
    assert (row["state"], row["reason_code"]) == ("cancelled", "robot_removed")


@pytest.mark.long
def test_run_now_gives_up_at_the_retry_limit(data, fleet, robot):
    import_configuration(data, configuration_of(fleet, retry_limit=0))
    fleet.stop()
    refusal(data, "--run-now", robot.name, "Home", code=1)
    (row,) = history(data)
    assert (row["state"], row["reason_code"], row["attempts"]) == ("failed", "retry_limit", "1")


# ---------------------------------------------------------------------- import and export while the app runs
@pytest.mark.long
def test_an_import_during_a_running_app_is_done_at_once_and_only_once(site, robot):
    schedules = {"schedules": [once_now(robot.name, "Home", "Now")]}
    with running(site):
        assert "Now added" in import_configuration(site, schedules)
        wait_for(lambda: len(queue_of(robot)) == 1, what="the robot has it")
        assert import_configuration(site, schedules) == "nothing changed\n"
        wrong = write_configuration(site.with_name("wrong.json"), {"format": "amr-scheduler/2"})
        refusal(site, "--import-config", wrong)
    with running(site):
        assert len(queue_of(robot)) == 1


@pytest.mark.long
def test_an_import_of_a_new_password_says_that_backups_hold_the_former_token(site, robot):
    def changed_to(password: str) -> str:
        return import_configuration(site, {"robots": [{"name": robot.name, "password": password}]})

    said = "backups made before still hold the former access tokens: the daily ones for a week, others until they are deleted\n"
    assert changed_to("another").endswith(said)
    assert changed_to("another") == "nothing changed\n"
    with running(site):
        assert changed_to("distributor").endswith(said)


@pytest.mark.long
def test_exports_during_a_running_app(site, robot, tmp_path):
    with running(site):
        assert json.loads(answer(site, "--export-config", "-"))["robots"][0]["name"] == robot.name
        answer(site, "--export-config", tmp_path / "out.json")
        assert answer(site, "--import-config", tmp_path / "out.json") == "nothing changed\n"
        answer(site, "--export-log", tmp_path / "log.csv")
        assert (tmp_path / "log.csv").read_bytes().startswith(b"id,trigger,schedule,robot,mission,")


# ---------------------------------------------------------------------- a forgotten PIN
@pytest.mark.long
def test_a_forgotten_pin_is_removed_with_and_without_a_running_app(data):
    def set_pin() -> None:
        db, clock, changes = Database.open(data / DATABASE), SystemClock(), Changes()
        Access(db, clock, changes, Alarms(db, clock, changes)).set_pin("4711")
        db.close()

    set_pin()
    assert answer(data, "--remove-pin") == "the PIN for Settings was removed\n"
    assert answer(data, "--remove-pin") == "there was no PIN for Settings\n"
    set_pin()
    with running(data):
        assert answer(data, "--remove-pin") == "the PIN for Settings was removed\n"
    refusal(data, "--remove-pin", "--headless")


@pytest.mark.long
@pytest.mark.parametrize("is_accepted", [True, False], ids=["accepted", "not read yet"])
def test_run_now_takes_over_from_an_app_that_is_killed_before_it_answers(site, robot, is_accepted):
    with running(site) as app:
        robot.control({"fault": {"kind": "hang", "count": None}})
        asking = begun(site, "--run-now", robot.name, "Home")
        try:
            if is_accepted:
                wait_for(lambda: any(row["trigger"] == "manual" for row in history(site)), what="the app to accept it")
            else:
                app.process.send_signal(signal.SIGSTOP)
                wait_for(lambda: list((site / "inbox").glob("*.request")), what="the request")
            app.kill()
            robot.control({"fault": None})
            stdout, stderr = asking.communicate(timeout=PATIENCE)
        finally:
            asking.kill()
            asking.communicate()
    assert (asking.returncode, stderr) == (0, "")
    assert [f"{item['id']}\n" for item in queue_of(robot)] == [stdout]
    (row,) = (row for row in history(site) if row["trigger"] == "manual")
    assert row["queue_id"] == stdout.strip()


@pytest.mark.long
def test_several_commands_at_one_instant_each_start_their_mission(site, robot):
    asking = [begun(site, "--run-now", robot.name, "Home") for _ in range(3)]
    said = [one.communicate(timeout=PATIENCE) for one in asking]
    assert [(one.returncode, stderr) for one, (_stdout, stderr) in zip(asking, said, strict=True)] == [(0, "")] * 3
    assert sorted(stdout for stdout, _stderr in said) == sorted(f"{item['id']}\n" for item in queue_of(robot))


# ---------------------------------------------------------------------- only reading
@pytest.mark.long
def test_exports_read_where_nothing_can_be_written(site, robot, tmp_path):
    with running(site) as app:
        wait_for(lambda: list((site / "backups").glob("*.db")), what="the daily backup")
        answer(site, "--run-now", robot.name, "Home")
        assert app.stop() == 0
    shutil.copytree(site, tmp_path / "copy")
    for kind in ("--export-log", "--export-config"):
        wanted = answer(tmp_path / "copy", kind, "-")
        assert "Home" in wanted
        with read_only(site) as as_anybody:
            assert answer(site, kind, "-", before=as_anybody) == wanted
    assert not list(site.glob(f"{DATABASE}-*"))


@pytest.mark.long
def test_changes_next_to_a_read_only_database_are_read(site, robot, tmp_path):
    """After a killed app: with SQLite's index file they are read, without it one sentence says what to do."""
    with running(site) as app:
        answer(site, "--run-now", robot.name, "Home")
        app.kill()
    shutil.copytree(site, tmp_path / "copy")
    assert (tmp_path / "copy" / f"{DATABASE}-wal").stat().st_size
    wanted = answer(site, "--export-log", "-")
    assert "Home" in wanted
    with read_only(tmp_path / "copy") as as_anybody:
        assert answer(tmp_path / "copy", "--export-log", "-", before=as_anybody) == wanted
    (tmp_path / "copy" / f"{DATABASE}-shm").unlink()
    with read_only(tmp_path / "copy") as as_anybody:
        problem = refusal(tmp_path / "copy", "--export-log", "-", code=1, before=as_anybody)
        assert "copy the data directory elsewhere and name the copy with --data-dir" in problem
    with read_only(site) as as_anybody:
        refusal(site, "--import-config", "-", before=as_anybody)


# ---------------------------------------------------------------------- damage
@pytest.mark.long
def test_a_damaged_database_is_kept_aside_and_cured_by_its_backup_alone(site, robot):
    with running(site) as app:
        wait_for(lambda: list((site / "backups").glob("*.db")), what="the daily backup")
        assert app.stop() == 0
    database = site / DATABASE
    damaged = bytearray(database.read_bytes())
    damaged[100:8192] = b"\x55" * 8092
    database.write_bytes(damaged)

    (backup,) = (site / "backups").glob("*.db")
    assert f"--restore-backup {backup}" in refusal(site, "--headless")
    (kept,) = site.glob(f"{DATABASE}.damaged-*")
    assert kept.read_bytes() == damaged
    for later in (("--headless",), ("--run-now", robot.name, "Home"), ("--export-log", "-"), ("--export-config", "-")):
        assert f"--restore-backup {backup}" in refusal(site, *later)
    assert not database.exists()

    assert run(site, "--restore-backup", backup).returncode == 0
    with running(site):
        answer(site, "--run-now", robot.name, "Home")
    assert kept.exists()


@pytest.mark.long
def test_what_is_no_backup_is_not_restored(site, tmp_path):
    refusal(site, "--restore-backup", tmp_path / "none.db")
    with running(site):
        refusal(site, "--restore-backup", site / DATABASE)


# ---------------------------------------------------------------------- usage
USAGES = (
    ("--headles",),
    ("--frobnicate",),
    ("--run-now", "R1"),
    ("--import-config",),
    ("--parameter", "a=b"),
    ("--run-now", "R1", "M", "--parameter", "novalue"),
    ("--headless", "--export-log", "-"),
    ("--headless", "--kiosk"),
    ("--headless", "--import-config", ""),
    ("--export-config", ""),
    ("--export-log", ""),
    ("--import-config", "a.json", "--export-config", "-"),
    ("--import-config", "/nowhere/at/all.json"),
    ("--export-log", "/nowhere/at/all.csv"),
    ("--export-config", "/nowhere/at/all.json"),
    ("stray",),
)


@pytest.mark.parametrize("arguments", first_of_each({" ".join(each): (each,) for each in USAGES}))
def test_wrong_usage_is_one_line_and_2(data, arguments):
    refusal(data, *arguments)


UNREADABLE = (
    b"",
    b"\xff\xfe\x00",
    b"[]",
    b"{",
    b'{"format": 1}',
    b'{"format": "amr-scheduler/1", "robotz": []}',
    b"[" * 100_000,
    b'{"format": "amr-scheduler/1", "settings": {"poll_interval_seconds": NaN}}',
)


@pytest.mark.parametrize("content", first_of_each({repr(each[:60]): each for each in UNREADABLE}))
def test_a_configuration_that_can_t_be_read_is_one_line_and_2(data, tmp_path, content):
    (tmp_path / "c.json").write_bytes(content)
    refusal(data, "--import-config", tmp_path / "c.json")


# ---------------------------------------------------------------------- the data directory
@pytest.mark.long
def test_everything_in_the_data_directory_is_its_owner_s_alone(site, robot):
    with running(site):
        run(site, "--run-now", robot.name, "Home")
        found = {path: stat.S_IMODE(path.lstat().st_mode) for path in (site, *site.rglob("*"))}
    assert {path: oct(mode) for path, mode in found.items() if mode != (0o700 if path.is_dir() else 0o600)} == {}


@pytest.mark.long
def test_a_directory_of_others_is_refused_and_left_as_it_was(tmp_path):
    (tmp_path / "logs").mkdir()
    (tmp_path / "thesis.txt").write_text("mine")
    tmp_path.chmod(0o755)
    refusal(tmp_path, "--headless")
    assert sorted(path.name for path in tmp_path.rglob("*")) == ["logs", "thesis.txt"]
    assert stat.S_IMODE(tmp_path.stat().st_mode) == 0o755


@pytest.mark.long
def test_secrets_are_in_the_database_and_its_backups_only(data, fleet, robot):
    """The password nowhere at all; the token made of it nowhere else."""
    password = "canary-Zx81-password"
    configuration = configuration_of(fleet, poll_interval_seconds=1)
    configuration["robots"][0]["password"] = password
    path = write_configuration(data.with_name("configuration.json"), configuration)
    said = []
    with running(data) as app:
        for arguments in (
            ("--import-config", path),
            ("--run-now", robot.name, "Home"),
            ("--export-config", "-"),
            ("--export-log", "-"),
        ):
            done = run(data, *arguments)
            said.append(done.stdout + done.stderr)
        wait_for(lambda: app.said("unauthorized"), what="the robot refuses the password")
        assert app.stop() == 0
        said.append("\n".join(app.stderr))
    token = Token.derive("distributor", password).header.removeprefix("Basic ")
    digest = re.search(rb"[0-9a-f]{64}", base64.b64decode(token)).group().decode()
    for secret in (password, token, digest):
        assert not [text for text in said if secret in text]
        holders = {file.name for file in data.rglob("*") if file.is_file() and secret.encode() in file.read_bytes()}
        assert {
            name for name in holders if not re.fullmatch(r"(amr-scheduler|daily-.*)\.db(-wal|-shm)?", name)
        } == set()
        assert secret != password or not holders
