"""The configuration file: what it may say, what it does, and that it does all of it or nothing."""
from __future__ import annotations

import json
from copy import deepcopy
from dataclasses import replace
from datetime import datetime, time, timedelta
from typing import Any

import pytest
from hypothesis import HealthCheck, given
from hypothesis import strategies as st

from app.database.connection import Database
from app.database.executions import ExecutionRepository
from app.database.missions import MissionRepository
from app.database.robots import RobotRepository
from app.database.schedules import ScheduleRepository
from app.database.settings import SettingsRepository
from app.domain.message import Message, render
from app.domain.models import (
    WEEKDAYS,
    Between,
    Execution,
    IdleRule,
    InvalidInput,
    Mission,
    Overlap,
    Robot,
    Schedule,
    Settings,
    State,
    Trigger,
)
from app.domain.names import cleaned
from app.i18n import translation
from app.services.catalogue.catalogue import Catalogue
from app.services.catalogue.configuration import FORMAT, export_configuration, import_configuration
from tests.support.clock import VirtualClock
from tests.support.examples import examples

FULL: dict[str, Any] = {
    "format": FORMAT,
    "settings": {
        "poll_interval_seconds": 20, "retry_limit": 5, "minimum_battery_percent": 15, "working_days": ["MO", "TU"],
        "timezone": "Europe/Helsinki", "start_window_minutes": 30, "unknown_outcome_quiet_seconds": 60, "history_limit": None},
    "robots": [
        {"name": "R1", "address": "http://192.168.12.20", "username": "distributor", "password": "secret", "enabled": True,
         "idle": {"mission": "Home", "after_minutes": 7, "enabled": False}},
        {"name": "R2", "address": "https://r2.local:8443", "username": "admin", "password": "other", "certificate_sha256": "AB" * 32}],
    "missions": [{"name": "Deliver", "guid": "3d7c7c40-ce85-11ef-904a-000e8e9884eb"}, {"name": "Home", "guid": "home-1"},
                 {"name": "Home", "guid": "home-2", "robot": "R1"}],
    "schedules": [
        {"name": "Morning", "robot": "R1", "mission": "Deliver", "start": "2026-11-23T09:30", "timezone": "Europe/Paris",
         "recurrence": "FREQ=MINUTELY;INTERVAL=30;BYDAY=MO,WE,FR", "enabled": True, "minimum_battery_percent": 30,
         "respect_working_days": False, "between": {"from": "08:30", "to": "16:45"}, "start_window_minutes": 0, "overlap": "queue",
         "priority": 3, "parameters": {"speed": 0.5, "place": "Ä"}},
        {"robot": "R1", "mission": "Home", "start": "2026-11-24T06:30"}],
}


class World:
    def __init__(self, path) -> None:
        self.clock = VirtualClock()                                # Monday 2026-11-23 06:00 UTC
        self.db = Database.open(path / "data" / "a.db", clock=self.clock, threaded=False, durable=False)
        self.catalogue = Catalogue(self.db, self.clock)

    def take(self, document: Any) -> list[str]:
        return [render(line) for line in self.take_in_parts(document)]

    def take_in_parts(self, document: Any) -> list[Message]:
        return import_configuration(self.catalogue, document if isinstance(document, bytes) else json.dumps(document).encode())

    def export(self) -> dict[str, Any]:
        return json.loads(export_configuration(self.db.read()))

    @property
    def robots(self) -> dict[str, Robot]:
        return {robot.name: robot for robot in RobotRepository().all(self.db.read())}

    @property
    def missions(self) -> list[Mission]:
        return MissionRepository().all(self.db.read())

    @property
    def schedules(self) -> dict[str, Schedule]:
        return {schedule.name: schedule for schedule in ScheduleRepository().all(self.db.read())}

    @property
    def settings(self) -> Settings:
        return SettingsRepository().load(self.db.read())

    def everything(self) -> object:
        return "\n".join(self.db.read().iterdump())


@pytest.fixture
def world(tmp_path):
    world = World(tmp_path)
    yield world
    world.db.close()


def changed(path: str, value: Any) -> dict[str, Any]:
    """FULL with one value replaced: ``schedules.0.start``."""
    document = deepcopy(FULL)
    *parents, last = [int(part) if part.isdigit() else part for part in path.split(".")]
    place = document
    for parent in parents:
        place = place[parent]
    place[last] = value
    return document


# ---------------------------------------------------------------------- what it does
def test_everything_that_can_be_said_is_taken(world):
    assert world.take(FULL) == [
        "setting poll_interval_seconds changed: 30 -> 20", "setting retry_limit changed: 10 -> 5",
        "setting minimum_battery_percent changed: none -> 15", "setting working_days changed: MO TU WE TH FR -> MO TU",
        "setting timezone changed: UTC -> Europe/Helsinki", "setting start_window_minutes changed: 15 -> 30",
        "setting unknown_outcome_quiet_seconds changed: 90 -> 60", "setting history_limit changed: 100000 -> none",
        "robot R1 added", "robot R2 added", "mission Deliver added", "mission Home added", "mission Home of R1 added",
        "schedule Morning added", "schedule Home on R1 added"]
    assert world.settings == Settings(20, 5, 15.0, ("MO", "TU"), "Europe/Helsinki", 30, 60, None)
    general, home, own = world.missions
    r1, r2 = world.robots["R1"], world.robots["R2"]
    assert (r1.address, r1.username, r1.enabled, r1.idle) == ("http://192.168.12.20", "distributor", True, IdleRule(own.id, 7, False))
    assert (r2.address, r2.certificate_sha256, r2.enabled, r2.idle) == ("https://r2.local:8443", "ab" * 32, True, None)
    assert (home.robot_id, own.robot_id) == (None, r1.id)
    assert replace(world.schedules["Morning"], id=0, next_at=None, changed_at=None) == Schedule(
        "Morning", r1.id, general.id, datetime(2026, 11, 23, 9, 30), "Europe/Paris", "FREQ=MINUTELY;INTERVAL=30;BYDAY=MO,WE,FR",
        between=Between(time(8, 30), time(16, 45)), minimum_battery_percent=30.0, respect_working_days=False, start_window_minutes=0,
        overlap=Overlap.QUEUE, priority=3, parameters={"speed": 0.5, "place": "Ä"})
    assert world.schedules["Morning"].next_at.isoformat() == "2026-11-23T08:30:00+00:00"
    assert world.schedules["Home on R1"].mission_id == own.id


def test_what_an_import_did_is_reported_in_the_language_of_the_screen(world):
    finnish = translation("fi").gettext
    lines = [render(line, finnish) for line in world.take_in_parts(changed("settings.minimum_battery_percent", 12.5))]
    assert lines[2] == "asetus muuttui – akun alaraja (%): ei asetettu → 12,5"
    assert lines[8:14] == ["robotti R1 lisätty", "robotti R2 lisätty", "tehtävä Deliver lisätty", "tehtävä Home lisätty",
                           "robotin R1 tehtävä Home lisätty", "ajastus Morning lisätty"]
    again = {"format": FORMAT, "robots": [{"name": "R1", "address": "10.0.0.9", "username": "else"}],
             "schedules": [{"name": "Morning", "robot": "R1", "mission": "Deliver", "start": "2026-11-24T09:00", "overlap": "skip"}]}
    assert [render(line, finnish) for line in world.take_in_parts(again)] == [
        "robotti R1 muuttui: osoite, käyttäjätunnus, käytössä; se on poissa käytöstä ja tarvitsee salasanan",
        "ajastus Morning muuttui: aloitusaika, päällekkäiset suoritukset"]


def test_what_is_left_out_has_the_defaults(world):
    world.take({"format": FORMAT, "robots": [{"name": "R1", "address": "10.0.0.1"}], "missions": [{"name": "Go", "guid": "g"}],
                "settings": {"timezone": "Asia/Tokyo"},
                "schedules": [{"robot": "R1", "mission": "Go", "start": "2026-11-24T06:30"}]})
    robot, [mission] = world.robots["R1"], world.missions
    assert (robot.username, robot.enabled, robot.needs_password) == ("", False, True)
    assert replace(world.schedules["Go on R1"], id=0, next_at=None, changed_at=None) == Schedule(
        "Go on R1", robot.id, mission.id, datetime(2026, 11, 24, 6, 30), "Asia/Tokyo", respect_working_days=True, overlap=Overlap.SKIP)


def test_sections_may_be_left_out_and_nothing_is_ever_deleted(world):
    world.take(FULL)
    before = world.everything()
    assert world.take({"format": FORMAT}) == []
    assert world.take({"format": FORMAT, "settings": {}, "robots": [], "missions": [], "schedules": []}) == []
    assert world.everything() == before


def test_keys_given_are_set_and_the_others_stay(world):
    world.take(FULL)
    before = world.robots["R1"]
    moved = {"name": "R1", "address": "10.0.0.9", "password": "secret"}
    assert world.take({"format": FORMAT, "robots": [moved]}) == ["robot R1 changed: address"]
    assert world.robots["R1"] == replace(before, address="http://10.0.0.9")
    morning = world.schedules["Morning"]
    lines = world.take({"format": FORMAT, "schedules": [
        {"name": "Morning", "robot": "R2", "mission": "Home", "start": "2026-11-23T09:30", "priority": 1, "between": None}]})
    assert lines == ["schedule Morning changed: between, priority, robot, mission"]
    after = world.schedules["Morning"]
    assert (after.priority, after.between, after.parameters, after.overlap) == (1, None, morning.parameters, morning.overlap)
    assert after.robot_id == world.robots["R2"].id
    assert world.take({"format": FORMAT, "robots": [{"name": "R1", "address": "10.0.0.9", "idle": None}]}) == ["robot R1 changed: idle"]
    assert world.take({"format": FORMAT, "missions": [{"name": "Deliver", "guid": "new"}]}) == ["mission Deliver changed: guid"]


def test_an_idle_rule_keeps_what_is_not_said(world):
    world.take(FULL)
    before = world.robots["R1"].idle
    world.take({"format": FORMAT, "robots": [{"name": "R1", "address": "10.0.0.9", "idle": {"enabled": True}}]})
    assert world.robots["R1"].idle == replace(before, enabled=True)
    with pytest.raises(InvalidInput, match=r"robots\[0\]\.idle: 'mission' is missing"):
        world.take({"format": FORMAT, "robots": [{"name": "R2", "address": "10.0.0.9", "idle": {"after_minutes": 5}}]})


def test_taking_the_same_file_again_changes_nothing_and_fires_nothing(world):
    world.take(FULL)
    due = world.schedules["Home on R1"]
    world.clock.step(86400 * 3)                                    # past a one-time start and many others
    world.db.write(lambda c: ScheduleRepository().advance(c, due.id, None))
    before = world.everything()
    assert world.take(FULL) == []
    assert world.everything() == before


@pytest.mark.parametrize(("path", "value", "state"), [("schedules.0.priority", 4, State.WAITING),
                                                      ("schedules.0.start", "2026-11-23T09:40", State.CANCELLED)])
def test_what_waits_of_a_changed_schedule_follows_it_unless_its_instant_is_gone(world, path, value, state):
    world.take(FULL)
    schedule, now = world.schedules["Morning"], world.clock.now()
    row = world.db.write(lambda c: ExecutionRepository().add(c, Execution(
        Trigger.SCHEDULED, schedule.robot_id, "R1", "Deliver", "g", schedule.next_at, schedule.next_at + timedelta(hours=1), now, "t",
        "UTC", schedule_id=schedule.id, priority=3)))
    world.take(changed(path, value))
    found = ExecutionRepository().get(world.db.read(), row.id)
    assert (found.state, found.priority) == (state, 4 if state is State.WAITING else 3)


def test_schedules_without_a_name_are_numbered_and_found_again(world):
    home = {"robot": "R1", "mission": "Home"}
    named = {"name": "Home on R1 2", **home, "start": "2026-11-24T09:00"}
    unnamed = [{**home, "start": "2026-11-24T07:00"}, {**home, "start": "2026-11-24T08:00", "name": None}]
    document = {**FULL, "schedules": [*unnamed, named]}
    assert world.take(document)[-3:] == ["schedule Home on R1 added", "schedule Home on R1 3 added", "schedule Home on R1 2 added"]
    assert world.take(document) == []
    assert world.take({**FULL, "schedules": [{**home, "start": "2026-11-24T10:00"}]}) == ["schedule Home on R1 4 added"]
    assert len(world.schedules) == 4


# ---------------------------------------------------------------------- passwords
def test_a_password_becomes_a_token_at_once_and_is_not_stored(world):
    world.take(FULL)
    dump = world.everything()
    assert "secret" not in dump
    assert world.robots["R1"].token is not None
    assert world.take(FULL) == []


def test_without_a_password_an_existing_robot_keeps_its_token(world):
    world.take(FULL)
    before = world.robots["R1"]
    assert world.take({"format": FORMAT, "robots": [{"name": "R1", "address": "192.168.12.20", "username": "distributor"}]}) == []
    assert world.robots["R1"] == before


def test_a_new_robot_or_user_without_a_password_is_off_and_needs_one(world):
    robot = {"name": "R1", "address": "10.0.0.1", "username": "a", "enabled": True}
    assert world.take({"format": FORMAT, "robots": [robot]}) == ["robot R1 added; it is switched off and needs a password"]
    assert (world.robots["R1"].enabled, world.robots["R1"].needs_password) == (False, True)
    assert world.take({"format": FORMAT, "robots": [robot]}) == []
    assert world.take({"format": FORMAT, "robots": [{**robot, "password": "x"}]}) == ["robot R1 changed: enabled, password"]
    assert (world.robots["R1"].enabled, world.robots["R1"].needs_password) == (True, False)
    assert world.take({"format": FORMAT, "robots": [{**robot, "username": "b"}]}) == [
        "robot R1 changed: username, enabled; it is switched off and needs a password"]
    assert world.robots["R1"].token is None


def test_a_robot_can_be_given_its_password_and_stay_off(world):
    robot = {"name": "R1", "address": "10.0.0.1", "username": "a"}
    world.take({"format": FORMAT, "robots": [robot]})
    world.take({"format": FORMAT, "robots": [{**robot, "password": "x", "enabled": False}]})
    assert (world.robots["R1"].enabled, world.robots["R1"].needs_password) == (False, False)


# ---------------------------------------------------------------------- what can't be taken
BAD: list[tuple[str, Any, str, str]] = [
    ("format", "amr-scheduler/2", "format", "this app reads amr-scheduler/1"),
    ("unknown", 1, "file", "unknown key 'unknown'"),
    ("settings", [], "settings", "an object"),
    ("settings.colour", 1, "settings", "unknown key 'colour'"),
    ("settings.poll_interval_seconds", 0, "settings.poll_interval_seconds", "1 to 3600"),
    ("settings.poll_interval_seconds", 3601, "settings.poll_interval_seconds", "1 to 3600"),
    ("settings.poll_interval_seconds", "30", "settings.poll_interval_seconds", "1 to 3600"),
    ("settings.poll_interval_seconds", True, "settings.poll_interval_seconds", "1 to 3600"),
    ("settings.retry_limit", 21, "settings.retry_limit", "0 to 20"),
    ("settings.minimum_battery_percent", 101, "settings.minimum_battery_percent", "0 to 100"),
    ("settings.working_days", [], "settings.working_days", "at least one"),
    ("settings.working_days", ["MO", "XX"], "settings.working_days", "MO, TU"),
    ("settings.timezone", "Helsinki", "settings.timezone", "Europe/Helsinki"),
    ("settings.timezone", None, "settings.timezone", "Europe/Helsinki"),
    ("settings.start_window_minutes", 1441, "settings.start_window_minutes", "0 to 1440"),
    ("settings.unknown_outcome_quiet_seconds", 4, "settings.unknown_outcome_quiet_seconds", "5 to 600"),
    ("settings.history_limit", 0, "settings.history_limit", "from 1"),
    ("robots", {}, "robots", "a list"),
    ("robots.0", "R1", "robots[0]", "an object"),
    ("robots.0", {"address": "x"}, "robots[0].name", "'name' is missing"),
    ("robots.0", {"name": "R1"}, "robots[0].address", "'address' is missing"),
    ("robots.0.adress", "x", "robots[0]", "'adress'"),
    ("robots.0.name", "", "robots[0].name", "enter a name"),
    ("robots.0.name", "x" * 81, "robots[0].name", "at most 80"),
    ("robots.0.name", "a\tb", "robots[0].name", "control characters"),
    ("robots.0.name", "R2", "robots[1].name", "twice in the file"),
    ("robots.0.address", "http://x/api", "robots[0].address", "after the host"),
    ("robots.0.address", 5, "robots[0].address", "a text"),
    ("robots.0.username", "a:b", "robots[0].username", "colon"),
    ("robots.0.username", "", "robots[0].username", "user name"),
    ("robots.0.password", "", "robots[0].password", "can't be empty"),
    ("robots.0.password", 5, "robots[0].password", "a text"),
    ("robots.0.enabled", "yes", "robots[0].enabled", "true or false"),
    ("robots.0.certificate_sha256", "12", "robots[0].certificate_sha256", "64"),
    ("robots.0.idle.mission", "Nothing", "robots[0].idle.mission", "no mission Nothing for R1"),
    ("robots.0.idle.after_minutes", 4, "robots[0].idle.after_minutes", "5 to 30"),
    ("robots.0.idle.minutes", 4, "robots[0].idle", "'minutes'"),
    ("missions.0.guid", "", "missions[0].guid", "guid"),
    ("missions.0.robot", "R9", "missions[0].robot", "no robot R9"),
    ("missions.1.name", "Deliver", "missions[1].name", "twice in the file"),
    ("schedules.0.robot", "R9", "schedules[0].robot", "no robot R9"),
    ("schedules.0.mission", "Nothing", "schedules[0].mission", "no mission Nothing for R1"),
    ("schedules.0.start", "2026-02-30T06:30", "schedules[0].start", "no such date"),
    ("schedules.0.start", "2026-11-23T06:30:30", "schedules[0].start", "whole minutes"),
    ("schedules.0.start", "2026-11-23T06:30Z", "schedules[0].start", "without a zone"),
    ("schedules.0.start", "2026-11-23 06:30", "schedules[0].start", "2026-11-23T06:30"),
    ("schedules.0.start", 20261123, "schedules[0].start", "local time"),
    ("schedules.0.timezone", "EET/Moon", "schedules[0].timezone", "no time zone"),
    ("schedules.0.recurrence", "", "schedules[0].recurrence", "null"),
    ("schedules.0.recurrence", "RRULE:FREQ=DAILY", "schedules[0].recurrence", "without RRULE:"),
    ("schedules.0.recurrence", "FREQ=SECONDLY", "schedules[0].recurrence", "MINUTELY"),
    ("schedules.0.recurrence", "FREQ=MINUTELY;BYSETPOS=1", "schedules[0].recurrence", "BYSETPOS"),
    ("schedules.0.recurrence", "FREQ=MINUTELY;BYMONTH=2;BYMONTHDAY=30", "schedules[0].recurrence", "has no start"),
    ("schedules.0.recurrence", "FREQ=DAILY", "schedules[0].between", "every so many minutes or hours"),
    ("schedules.0.between", {"from": "08:30"}, "schedules[0].between.to", "'to' is missing"),
    ("schedules.0.between", {"from": "16:45", "to": "08:30"}, "schedules[0].between", "end after it begins"),
    ("schedules.0.between", {"from": "8:30", "to": "16:45"}, "schedules[0].between.from", "08:30"),
    ("schedules.0.between", {"from": "24:00", "to": "24:00"}, "schedules[0].between.from", "08:30"),
    ("schedules.0.minimum_battery_percent", -1, "schedules[0].minimum_battery_percent", "0 to 100"),
    ("schedules.0.start_window_minutes", 1.5, "schedules[0].start_window_minutes", "0 to 1440"),
    ("schedules.0.overlap", "wait", "schedules[0].overlap", "skip or queue"),
    ("schedules.0.priority", "high", "schedules[0].priority", "whole number"),
    ("schedules.0.parameters", [], "schedules[0].parameters", "parameters"),
    ("schedules.0.parameters", {"a": {}}, "schedules[0].parameters", "'a'"),
    ("schedules.1.name", "Morning", "schedules[1].name", "twice in the file"),
    ("schedules.1.start", "2026-11-25T06:30", "schedules[1].start", "2026-11-25 is a Wednesday, which is not a working day"),
]


@pytest.mark.parametrize(("path", "value", "field", "told"), BAD, ids=[f"{path}={value!r:.30}" for path, value, _, _ in BAD])
def test_what_cannot_be_taken_is_reported_with_its_place_and_nothing_is_changed(world, path, value, field, told):
    before = world.everything()
    with pytest.raises(InvalidInput) as caught:
        world.take(changed(path, value))
    assert caught.value.field == field
    assert told in caught.value.text
    assert field == "file" or caught.value.text.startswith(field) or caught.value.text.startswith(field.rpartition(".")[0])
    assert "\n" not in caught.value.text
    assert world.everything() == before


@pytest.mark.parametrize(("content", "told"), [
    (b"", "line 1, column 1"), (b"{", "line 1"), (b"[]", "one JSON object"), (b"null", "one JSON object"), (b"{}", 'lacks "format"'),
    (b"\xff\xfe", "UTF-8"), (b'{"format": "amr-scheduler/1", "format": "x"}', "'format' appears twice"), (b'{"a": NaN}', "NaN"),
    (b'{"a": -Infinity}', "Infinity"), (b"[" * 100_000, "nested"), (b'{"a": ' + b"1" * 6000 + b"}", "number"),
    (b" " * (5 * 1024 * 1024 + 1), "larger than 5 MiB")], ids=range(12))
def test_what_is_no_configuration_is_reported_in_one_sentence(world, content, told):
    with pytest.raises(InvalidInput, match=told) as caught:
        world.take(content)
    assert caught.value.field in ("file", "format")
    assert "\n" not in caught.value.text


def test_a_byte_order_mark_is_tolerated(world):
    assert world.take(b"\xef\xbb\xbf" + json.dumps(FULL).encode()) != []


def test_null_working_days_mean_every_day(world):
    world.take({"format": FORMAT, "settings": {"working_days": None}})
    assert world.settings.working_days == WEEKDAYS


def test_a_one_time_schedule_is_judged_by_the_working_days_of_the_same_file(world):
    sunday = {"name": "Once", "robot": "R1", "mission": "Home", "start": "2026-11-29T06:30"}
    document = {**FULL, "schedules": [sunday]}
    with pytest.raises(InvalidInput, match="not a working day"):
        world.take(document)
    world.take({**document, "settings": {"working_days": ["SU"]}})
    assert world.take({"format": FORMAT, "settings": {"working_days": ["MO"]}, "schedules": [sunday]}) == [
        "setting working_days changed: SU -> MO"]                  # an unchanged one is not judged again


# ---------------------------------------------------------------------- out again
def test_an_export_has_no_secret_and_reading_it_in_again_changes_nothing(world):
    world.take(FULL)
    text = export_configuration(world.db.read())
    assert world.robots["R1"].token not in text
    assert "password" not in text
    before = world.everything()
    assert world.take(text.encode()) == []
    assert world.everything() == before


def test_an_export_carries_everything_to_another_tablet(world, tmp_path):
    world.take(FULL)
    other = World(tmp_path / "other")
    other.take(export_configuration(world.db.read()).encode())
    exported = world.export()
    for robot in exported["robots"]:
        robot["enabled"] = False                                   # until somebody enters the passwords there
    assert other.export() == exported
    other.db.close()


def test_an_export_says_what_the_contract_shows(world):
    world.take(FULL)
    exported = world.export()
    assert list(exported) == ["format", "settings", "robots", "missions", "schedules"]
    assert exported["settings"] == FULL["settings"]
    assert exported["robots"][0] == {key: value for key, value in FULL["robots"][0].items() if key != "password"}
    assert exported["missions"] == FULL["missions"]
    assert exported["schedules"][1] == {**FULL["schedules"][0], "minimum_battery_percent": 30}
    assert exported["schedules"][0]["recurrence"] is exported["schedules"][0]["between"] is None


def test_a_typed_duration_travels_and_is_left_out_where_there_is_none(world, tmp_path):
    assert world.take(changed("missions.0.usual_minutes", 25))[10:11] == ["mission Deliver added"]
    assert [mission.usual_minutes for mission in world.missions] == [25, None, None]
    exported = world.export()
    assert [list(mission) for mission in exported["missions"]] == [
        ["name", "guid", "usual_minutes"], ["name", "guid"], ["name", "guid", "robot"]]
    other = World(tmp_path / "other")
    other.take(json.dumps(exported).encode())
    assert other.export()["missions"] == exported["missions"]
    other.db.close()
    assert world.take(FULL) == []                                  # not said: it stays
    assert world.take(changed("missions.0.usual_minutes", None)) == ["mission Deliver changed: usual_minutes"]
    assert world.export()["missions"] == FULL["missions"]


@pytest.mark.parametrize("value", [0, 1441, 2.5, "12", True])
def test_a_typed_duration_that_cannot_be_is_reported_with_its_place(world, value):
    with pytest.raises(InvalidInput, match=r"missions\[0\].usual_minutes: enter a whole number from 1 to 1440"):
        world.take(changed("missions.0.usual_minutes", value))
    assert world.missions == []


NAMES = st.text(st.characters(exclude_categories=("Cc", "Cs", "Zl", "Zp")), min_size=1, max_size=20).map(cleaned).filter(bool)


@examples(40, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(names=st.lists(NAMES, min_size=3, max_size=3, unique=True), working=st.lists(st.sampled_from(WEEKDAYS), min_size=1, unique=True),
       window=st.none() | st.integers(0, 1440), battery=st.none() | st.floats(0, 100), overlap=st.sampled_from(["skip", "queue"]),
       parameters=st.dictionaries(NAMES, st.none() | st.booleans() | st.integers(-9, 9) | NAMES, max_size=3))
def test_whatever_is_taken_comes_out_and_in_again_unchanged(world, names, working, window, battery, overlap, parameters):
    robot, mission, schedule = names
    world.take({"format": FORMAT, "settings": {"working_days": working}, "robots": [{"name": robot, "address": "10.0.0.1"}],
                "missions": [{"name": mission, "guid": "g"}], "schedules": [
                    {"name": schedule, "robot": robot, "mission": mission, "start": "2026-11-23T06:30", "recurrence": "FREQ=DAILY",
                     "start_window_minutes": window, "minimum_battery_percent": battery, "overlap": overlap, "parameters": parameters}]})
    assert world.take(export_configuration(world.db.read()).encode()) == []
