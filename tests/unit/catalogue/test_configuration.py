"""The configuration file: what it may say, what it does, and that it does all of it or nothing."""

from __future__ import annotations

import json
from dataclasses import replace
from datetime import datetime, time

import pytest

from app.database.schedules import ScheduleRepository
from app.domain.message import render
from app.domain.models import (
    WEEKDAYS,
    Between,
    IdleRule,
    InvalidInput,
    Overlap,
    Robot,
    Schedule,
    Settings,
)
from app.i18n import translation
from app.services.catalogue.configuration import FORMAT, export_configuration
from app.services.catalogue.fields import SECTIONS
from tests.unit.catalogue.configured import FULL, World, changed


@pytest.fixture
def full(tablet):
    """After FULL was imported."""
    tablet.take(FULL)
    return tablet


# ---------------------------------------------------------------------- what it does
def test_everything_that_can_be_said_is_taken(tablet):
    assert tablet.take(FULL) == [
        "Ask the robots every: 30 s → 20 s",
        "Retries when a robot can't be reached: 10 → 5",
        "Minimum battery: none → 15 %",
        "Working days: Mon, Tue, Wed, Thu, Fri → Mon, Tue",
        "Time zone: UTC → Europe/Helsinki",
        "A mission may start late by: 15 min → 30 min",
        "Wait after an unknown outcome: 90 s → 60 s",
        "Runs kept: 100,000 → All",
        "robot R1 added",
        "robot R2 added",
        "mission Deliver added",
        "mission Home added",
        "mission Home of R1 added",
        "schedule Morning added",
        "schedule Home on R1 added",
    ]
    assert tablet.settings == Settings(**FULL["settings"] | {"working_days": ("MO", "TU")})
    general, home, own = tablet.missions
    r1, r2 = tablet.robots["R1"], tablet.robots["R2"]
    assert (r1.address, r1.username, r1.enabled, r1.idle) == (
        "http://192.168.12.20",
        "distributor",
        True,
        IdleRule(own.id, 7, False),
    )
    assert (r2.address, r2.certificate_sha256, r2.enabled, r2.idle) == ("https://r2.local:8443", "ab" * 32, True, None)
    assert (home.robot_id, own.robot_id) == (None, r1.id)
    assert replace(tablet.schedules["Morning"], id=0, next_at=None, changed_at=None) == Schedule(
        "Morning",
        r1.id,
        general.id,
        datetime(2026, 11, 23, 9, 30),
        "Europe/Paris",
        "FREQ=MINUTELY;INTERVAL=30;BYDAY=MO,WE,FR",
        between=Between(time(8, 30), time(16, 45)),
        minimum_battery_percent=30.0,
        respect_working_days=False,
        start_window_minutes=0,
        overlap=Overlap.QUEUE,
        priority=3,
        parameters={"speed": 0.5, "place": "Ä"},
    )
    assert tablet.schedules["Morning"].next_at.isoformat() == "2026-11-23T08:30:00+00:00"
    assert tablet.schedules["Home on R1"].mission_id == own.id


def test_changes_by_an_import_are_reported_in_the_language_of_the_screen(tablet):
    finnish = translation("fi").gettext
    lines = [render(line, finnish) for line in tablet.take_in_parts(changed("settings.minimum_battery_percent", 12.5))]
    assert lines[2] == "Akun alaraja: ei asetettu → 12,5 %"
    assert lines[8:14] == [
        "robotti R1 lisätty",
        "robotti R2 lisätty",
        "tehtävä Deliver lisätty",
        "tehtävä Home lisätty",
        "robotin R1 tehtävä Home lisätty",
        "ajastus Morning lisätty",
    ]
    again = {
        "format": FORMAT,
        "robots": [{"name": "R1", "address": "10.0.0.9", "username": "else"}],
        "schedules": [{"name": "Morning", "start": "2026-11-24T09:00", "overlap": "skip", "recurrence": "FREQ=HOURLY"}],
    }
    assert [render(line, finnish) for line in tablet.take_in_parts(again)] == [
        "robotti R1 muuttui: Osoite 192.168.12.20 → 10.0.0.9, Käyttäjä distributor → else, Käytössä kyllä → ei. "
        "Se on poissa käytöstä ja tarvitsee salasanan",
        "ajastus Morning muuttui: Ensimmäinen aloitus 23.11.2026 09.30 → 24.11.2026 09.00, "
        "Toistuu 30 minuutin välein klo 08.30–16.45, vain ma, ke, pe → Joka tunti klo 08.30–16.45, "
        "Jos vielä ajossa Odottaa → Ei ajettu",
    ]


def test_what_is_chosen_is_named_by_the_words_of_the_screen(tablet):
    again = {"format": FORMAT, "display": {"theme": "dark", "keyboard": "off"}, "settings": {"history_limit": 20000}}
    finnish = translation("fi").gettext
    assert [render(line, finnish) for line in tablet.take_in_parts(again)] == [
        "Säilytettävät ajot: 100\u00a0000 → 20\u00a0000",
        "Teema: Vaalea → Tumma",
        "Näyttönäppäimistö: Tarvittaessa → Ei koskaan",
    ]


def test_omitted_keys_have_the_defaults(tablet):
    tablet.take(
        robots=[{"name": "R1", "address": "10.0.0.1"}],
        missions=[{"name": "Go", "guid": "g"}],
        settings={"timezone": "Asia/Tokyo"},
        schedules=[{"robot": "R1", "mission": "Go", "start": "2026-11-24T06:30"}],
    )
    robot, [mission] = tablet.robots["R1"], tablet.missions
    assert (robot.username, robot.enabled, robot.needs_password) == ("", False, True)
    assert replace(tablet.schedules["Go on R1"], id=0, next_at=None, changed_at=None) == Schedule(
        "Go on R1",
        robot.id,
        mission.id,
        datetime(2026, 11, 24, 6, 30),
        "Asia/Tokyo",
        respect_working_days=True,
        overlap=Overlap.SKIP,
    )


def test_sections_may_be_left_out_and_nothing_is_ever_deleted(full):
    before = full.everything()
    assert full.take({"format": FORMAT}) == []
    assert full.take(settings={}, robots=[], missions=[], schedules=[]) == []
    assert full.everything() == before


def test_an_earlier_export_restores_deleted_entries(full):
    """With new ids: those of deleted robots and missions never come back."""
    before = full.robots["R2"].id
    full.catalogue.remove_mission(next(mission.id for mission in full.missions if mission.guid == "home-2"))
    for robot in full.robots.values():
        full.catalogue.remove_robot(robot.id)
    full.take(FULL)
    assert full.robots["R1"].id > before
    assert {schedule.robot_id for schedule in full.schedules.values()} == {full.robots["R1"].id}


def test_an_import_after_deleting_a_robot_plans_on_the_robots_it_names(tablet):
    for number, name in enumerate(("Stays", "Goes")):
        last = tablet.catalogue.save_robot(
            Robot(name, f"http://192.168.12.{90 + number}", "distributor"), password="secret"
        )
    tablet.catalogue.remove_robot(last.id)
    document = changed("schedules.0.robot", "R2")
    document["schedules"], document["missions"] = document["schedules"][:1], document["missions"][:1]
    del document["robots"][0]["idle"]
    tablet.take(document)
    assert tablet.schedules["Morning"].robot_id == tablet.robots["R2"].id


def test_keys_in_the_file_are_set_and_the_others_stay(full):
    before = full.robots["R1"]
    moved = {"name": "R1", "address": "10.0.0.9", "password": "secret"}
    assert full.take(robots=[moved]) == ["robot R1 changed: Address 192.168.12.20 → 10.0.0.9"]
    assert full.robots["R1"] == replace(before, address="http://10.0.0.9")
    morning = full.schedules["Morning"]
    lines = full.take(
        schedules=[
            {
                "name": "Morning",
                "robot": "R2",
                "mission": "Home",
                "start": "2026-11-23T09:30",
                "priority": 1,
                "between": None,
            }
        ]
    )
    assert lines == ["schedule Morning changed: Between 08:30–16:45 → none, Priority 3 → 1, Robot, Mission"]
    after = full.schedules["Morning"]
    assert (after.priority, after.between, after.parameters, after.overlap) == (
        1,
        None,
        morning.parameters,
        morning.overlap,
    )
    assert after.robot_id == full.robots["R2"].id
    assert full.take(robots=[{"name": "R1", "address": "10.0.0.9", "idle": None}]) == ["robot R1 changed: When idle"]
    assert full.take(missions=[{"name": "Deliver", "guid": "new"}]) == ["mission Deliver changed: GUID"]


GROUP_AND_PLACE = {"groups": [{"name": "Hall", "robots": ["R1", "R2"]}], "places": [{"name": "Dock", "most": 2}]}


@pytest.mark.parametrize(
    ("section", "item", "lines"),
    [
        (
            "robots",
            {"name": "R2", "hand_over": "when_free"},
            ["robot R2 changed: Starts go to the robot At once → When it is free"],
        ),
        ("robots", {"name": "R1", "idle": {"after_minutes": 9}}, ["robot R1 changed: When idle"]),
        ("missions", {"name": "Deliver", "favourite": True}, ["mission Deliver changed: Favourite no → yes"]),
        (
            "missions",
            {"name": "Home", "robot": "R1", "usual_minutes": 3},
            ["mission Home of R1 changed: Usual none → 3 min"],
        ),
        (
            "groups",
            {"name": "Hall", "hand_over": "at_once"},
            ["group Hall changed: Starts go to a robot When it is free → At once"],
        ),
        ("places", {"name": "Dock"}, []),
        ("schedules", {"name": "Morning", "enabled": False}, ["schedule Morning changed: Switched on yes → no"]),
        ("schedules", {"name": "Morning", "mission": "Home"}, ["schedule Morning changed: Mission"]),
        ("schedules", {"name": "Morning", "robot": "R2"}, ["schedule Morning changed: Robot"]),
        (
            "schedules",
            {"name": "Morning", "group": "Hall", "overlap": "parallel"},
            ["schedule Morning changed: If still running Waits → Beside it, Robot, Group"],
        ),
    ],
)
def test_an_existing_schedule_is_changed_by_its_name_and_the_changed_keys(tablet, section, item, lines):
    tablet.take({**FULL, **GROUP_AND_PLACE})
    assert tablet.take(**{section: [item]}) == lines


def test_a_schedule_that_is_changed_by_its_name_keeps_everything_else(full):
    before = full.schedules["Morning"]
    full.take(schedules=[{"name": "Morning", "priority": 7}])
    assert replace(full.schedules["Morning"], priority=before.priority, changed_at=before.changed_at) == before


@pytest.mark.parametrize(
    ("section", "item", "missing"),
    [
        ("robots", {"name": "R9"}, r"robots\[0\]: 'address' is missing"),
        ("groups", {"name": "G"}, r"groups\[0\]: 'robots' is missing"),
        ("places", {"name": "P"}, r"places\[0\]: 'most' is missing"),
        ("missions", {"name": "M"}, r"missions\[0\]: 'guid' is missing"),
        ("missions", {"name": "Deliver", "robot": "R1"}, r"missions\[0\]: 'guid' is missing"),
        ("schedules", {"name": "S", "robot": "R1", "mission": "Home"}, r"schedules\[0\]: 'start' is missing"),
        ("schedules", {"name": "S", "mission": "Home", "start": "2026-11-23T09:30"}, "name either a robot or a group"),
        ("schedules", {"enabled": False}, r"schedules\[0\]: 'mission' is missing"),
    ],
)
def test_a_new_one_has_to_say_what_it_cannot_do_without(full, section, item, missing):
    before = full.everything()
    with pytest.raises(InvalidInput, match=missing):
        full.take(**{section: [item]})
    assert full.everything() == before


def test_an_idle_rule_keeps_what_is_not_said(full):
    before = full.robots["R1"].idle
    full.take(robots=[{"name": "R1", "address": "10.0.0.9", "idle": {"enabled": True}}])
    assert full.robots["R1"].idle == replace(before, enabled=True)
    with pytest.raises(InvalidInput, match=r"robots\[0\]\.idle: 'mission' is missing"):
        full.take(robots=[{"name": "R2", "address": "10.0.0.8", "idle": {"after_minutes": 5}}])


def test_taking_the_same_file_again_changes_nothing_and_fires_nothing(full):
    due = full.schedules["Home on R1"]
    full.clock.step(86400 * 3)  # past a one-time start and many others
    full.db.write(lambda c: ScheduleRepository().advance(c, due.id, None))
    before = full.everything()
    assert full.take(FULL) == []
    assert full.everything() == before


def test_schedules_without_a_name_are_numbered_and_found_again(tablet):
    home = {"robot": "R1", "mission": "Home"}
    named = {"name": "Home on R1 2", **home, "start": "2026-11-24T09:00"}
    unnamed = [{**home, "start": "2026-11-24T07:00"}, {**home, "start": "2026-11-24T08:00", "name": None}]
    document = {**FULL, "schedules": [*unnamed, named]}
    assert tablet.take(document)[-3:] == [
        "schedule Home on R1 added",
        "schedule Home on R1 3 added",
        "schedule Home on R1 2 added",
    ]
    assert tablet.take(document) == []
    assert tablet.take({**FULL, "schedules": [{**home, "start": "2026-11-24T10:00"}]}) == [
        "schedule Home on R1 4 added"
    ]
    assert len(tablet.schedules) == 4


# ---------------------------------------------------------------------- passwords
def test_a_password_becomes_a_token_at_once_and_is_not_stored(full):
    assert "secret" not in full.everything()
    assert full.robots["R1"].token is not None
    assert full.take(FULL) == []


def test_a_new_robot_or_user_without_a_password_is_off_and_needs_one(tablet):
    robot = {"name": "R1", "address": "10.0.0.1", "username": "a", "enabled": True}
    assert tablet.take(robots=[robot]) == ["robot R1 added, it is switched off and needs a password"]
    assert (tablet.robots["R1"].enabled, tablet.robots["R1"].needs_password) == (False, True)
    assert tablet.take(robots=[robot]) == []
    assert tablet.take(robots=[{**robot, "password": "x"}]) == ["robot R1 changed: In use no → yes, Password"]
    assert (tablet.robots["R1"].enabled, tablet.robots["R1"].needs_password) == (True, False)
    assert tablet.take(robots=[{**robot, "username": "b"}]) == [
        "robot R1 changed: User a → b, In use yes → no. It is switched off and needs a password"
    ]
    assert tablet.robots["R1"].token is None
    assert tablet.take(robots=[{**robot, "username": "b", "address": "10.0.0.2"}]) == [
        "robot R1 changed: Address 10.0.0.1 → 10.0.0.2. It is switched off and needs a password"
    ]  # it still does


def test_the_end_of_a_trusted_certificate_is_said(tablet):
    robot = {
        "name": "R1",
        "address": "https://10.0.0.1",
        "username": "a",
        "password": "x",
        "certificate_sha256": "ab" * 32,
    }
    tablet.take(robots=[robot])
    assert tablet.take(robots=[{**robot, "certificate_sha256": None}])[-1] == (
        "the certificate of robot R1 is no longer the only trusted one"
    )


def test_a_robot_can_get_its_password_and_stay_off(tablet):
    robot = {"name": "R1", "address": "10.0.0.1", "username": "a"}
    tablet.take(robots=[robot])
    tablet.take(robots=[{**robot, "password": "x", "enabled": False}])
    assert (tablet.robots["R1"].enabled, tablet.robots["R1"].needs_password) == (False, False)


def test_two_robots_may_swap_their_addresses_and_a_new_one_may_not_take_one(full):
    first, second = FULL["robots"]
    swapped = [{**first, "address": second["address"]}, {**second, "address": first["address"]}]
    full.take(robots=swapped)
    assert [full.robots[name].address for name in ("R1", "R2")] == ["https://r2.local:8443", "http://192.168.12.20"]
    with pytest.raises(
        InvalidInput, match=r"robots\[0\].address: R3 has the address of R2, which is configured already"
    ):
        full.take(robots=[{"name": "R3", "address": "192.168.12.20"}])
    with pytest.raises(
        InvalidInput, match=r"robots\[0\].address: this is the address of R2, which is configured already"
    ):
        full.take(robots=[{"name": "R1", "address": "192.168.12.20"}])


def test_a_file_with_the_name_that_a_robot_had_makes_no_second_one_of_it(full):
    full.catalogue.save_robot(replace(full.robots["R1"], name="Aino"))
    before = full.export()
    for document, problem in (
        (
            FULL,
            r"robots\[0\].address: R1 has the address of Aino, which is configured already: if it is the same one, write Aino in ",
        ),
        (
            {"format": FORMAT, "schedules": FULL["schedules"]},
            r"schedules\[0\].robot: there is no robot R1, add it or write the name that it has now",
        ),
    ):
        with pytest.raises(InvalidInput, match=problem):
            full.take(document)
    assert full.export() == before


# ---------------------------------------------------------------------- its form and its days
def test_null_working_days_mean_every_day(tablet):
    tablet.take(settings={"working_days": None})
    assert tablet.settings.working_days == WEEKDAYS


def test_a_one_time_schedule_is_judged_by_the_working_days_of_the_same_file(tablet):
    sunday = {"name": "Once", "robot": "R1", "mission": "Home", "start": "2026-11-29T06:30"}
    document = {**FULL, "schedules": [sunday]}
    with pytest.raises(InvalidInput, match="a day off"):
        tablet.take(document)
    tablet.take({**document, "settings": {"working_days": ["SU"]}})
    assert tablet.take(settings={"working_days": ["MO"]}, schedules=[sunday]) == [
        "Working days: Sun → Mon"
    ]  # an unchanged one is not judged again


# ---------------------------------------------------------------------- out again
def test_an_export_has_no_secret_and_reading_it_in_again_changes_nothing(full):
    text = export_configuration(full.db.read())
    assert full.robots["R1"].token not in text
    assert "password" not in text
    before = full.everything()
    assert full.take(text.encode()) == []
    assert full.everything() == before


def test_an_export_says_what_the_contract_shows(full):
    exported = full.export()
    assert list(exported) == ["format", "settings", "display", "calendar", "robots", "missions", "schedules"]
    assert exported["settings"] == FULL["settings"]
    assert exported["robots"][0] == {key: value for key, value in FULL["robots"][0].items() if key != "password"}
    assert exported["missions"] == FULL["missions"]
    assert exported["schedules"][1] == {**FULL["schedules"][0], "minimum_battery_percent": 30}
    assert exported["schedules"][0]["recurrence"] is exported["schedules"][0]["between"] is None


def test_a_typed_duration_travels_and_is_omitted_where_there_is_none(tablet, tmp_path):
    assert tablet.take(changed("missions.0.usual_minutes", 25))[10:11] == ["mission Deliver added"]
    assert [mission.usual_minutes for mission in tablet.missions] == [25, None, None]
    exported = tablet.export()
    assert [list(mission) for mission in exported["missions"]] == [
        ["name", "guid", "usual_minutes"],
        ["name", "guid"],
        ["name", "guid", "robot"],
    ]
    other = World(tmp_path / "other")
    other.take(json.dumps(exported).encode())
    assert other.export()["missions"] == exported["missions"]
    other.db.close()
    assert tablet.take(FULL) == []  # not said: it stays
    assert tablet.take(changed("missions.0.usual_minutes", None)) == ["mission Deliver changed: Usual 25 min → none"]
    assert tablet.export()["missions"] == FULL["missions"]


def test_a_file_with_places_writes_about_as_much_as_it_says(tablet):
    """All is written again while no one else can write, and once took missions² × places²."""
    places = [f"P{number}" for number in range(8)]
    missions = [{"name": f"M{number}", "guid": f"g{number}", "places": places} for number in range(40)]
    before = tablet.db.write(lambda c: c.total_changes)
    tablet.take(places=[{"name": name, "most": 1} for name in places], missions=missions)
    written = tablet.db.write(lambda c: c.total_changes) - before
    assert written <= 2 * len(missions) * len(places)
    assert tablet.export()["missions"] == sorted(missions, key=lambda mission: mission["name"])


def test_a_mission_uses_the_places_that_a_file_names_and_no_others(tablet):
    document = {
        "format": FORMAT,
        "places": [{"name": name, "most": 1} for name in "ABC"],
        "missions": [{"name": "M", "guid": "g", "places": ["A", "B"]}, {"name": "N", "guid": "g", "places": ["A"]}],
    }
    tablet.take(document)
    assert tablet.take(document) == []
    assert tablet.take(missions=[{"name": "M", "guid": "g", "places": ["B", "C"]}]) == ["mission M changed: Places"]
    assert [mission["places"] for mission in tablet.export()["missions"]] == [["B", "C"], ["A"]]
    tablet.take(missions=[{"name": "M", "guid": "g"}])
    assert tablet.export()["missions"][0]["places"] == ["B", "C"]
    with pytest.raises(InvalidInput, match=r"missions\[0\].places: there is no place D"):
        tablet.take(missions=[{"name": "M", "guid": "g", "places": ["D"]}])


@pytest.mark.parametrize("encoding", ["utf-8", "utf-8-sig", "utf-16"])
def test_a_file_with_the_mark_of_its_encoding_is_read(tablet, encoding):
    tablet.take(json.dumps(FULL, ensure_ascii=False).encode(encoding))
    assert tablet.schedules["Morning"].parameters == FULL["schedules"][0]["parameters"]


def test_a_setting_of_the_opposite_sense_is_said_as_the_form_says_it(tablet):
    tablet.take(FULL)
    again = {"name": "Morning", "respect_working_days": not tablet.schedules["Morning"].respect_working_days}
    any_day = ("no", "yes") if tablet.schedules["Morning"].respect_working_days else ("yes", "no")
    assert tablet.take(schedules=[again]) == ["schedule Morning changed: Any day {} → {}".format(*any_day)]


def test_no_sentence_has_a_key_of_the_file_in_it():
    labels = [field.label for fields in SECTIONS.values() for field in fields if field.key not in ("name", "days")]
    assert not [label for label in map(render, labels) if not label or "_" in label or label[0].islower()]
