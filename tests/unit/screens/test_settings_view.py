from dataclasses import replace
from datetime import UTC, datetime, timedelta
from pathlib import Path

import pytest

from app.domain.message import message
from app.domain.models import (
    Connection,
    Group,
    IdleRule,
    InvalidInput,
    Mission,
    Robot,
    RobotSnapshot,
    Schedule,
    Settings,
)
from app.domain.robot import IdentifiedBy, Identity, MissionInfo, RobotStatus
from app.mir.credentials import Token
from app.mir.errors import CertificateProblem, TimedOut, Unreachable
from app.screens.settings import missions_view, trust_view, view
from app.screens.settings.facts import SettingsFacts
from app.services.catalogue.configuration.importing import DeletesRuns
from app.services.files.places import FoundFile

NOW = datetime(2026, 11, 20, 12, 38, tzinfo=UTC)
AINO = Robot(
    "Aino", "http://10.40.12.21", "scheduler", id=1, serial_number="200104012", model="MiR250", software="3.5.4"
)
SISU = Robot("Sisu", "https://sisu.plant:8443", "scheduler", id=2)
DELIVER = Mission("Deliver kits", "guid-deliver", id=10)
CHARGE = Mission("Charge", "guid-charge", id=11, favourite=True)
COILS = Mission("Coils", "guid-coils", id=12, robot_id=2)
MORNING = Schedule("Morning", 1, 10, datetime(2026, 11, 23, 6, 30), "Europe/Helsinki", id=20)


def facts(**values):
    state = {
        "settings": Settings(timezone="Europe/Helsinki"),
        "robots": (AINO, SISU),
        "missions": (CHARGE, COILS, DELIVER),
        "schedules": (MORNING,),
    }
    return SettingsFacts(**{**state, **values})


def snapshot(robot_id=1, seconds_old=2.0, connection=Connection.CONNECTED):
    return RobotSnapshot(robot_id, connection, RobotStatus(), NOW - timedelta(seconds=seconds_old))


def notes(state):
    return {key: note.text for key, note in view.section_notes(state, NOW).items()}


# ---------------------------------------------------------------------- sections
def test_groups_are_counted_with_the_robots_in_their_section():
    assert view.section_notes(facts(groups=(Group("Hall 1", (1, 2), id=1),)), NOW)["robots"].text == "2 robots, 1 group"


def test_every_section_says_its_present_value():
    state = facts(
        settings=Settings(timezone="Europe/Helsinki", minimum_battery_percent=30.0, language="fi", theme="dark"),
        robots=(replace(AINO, idle=IdleRule(11, 15)), SISU),
        backups=(FoundFile(Path("b.db"), datetime(2026, 11, 20, 0, 0, tzinfo=UTC), 5000),),
    )
    assert notes(state) == {
        "robots": "2 robots",
        "missions": "3 missions",
        "constraints": "30 %, Mon–Fri",
        "idle": "1 robot",
        "scheduler": "reads every 30 s",
        "display": "Dark, Suomi",
        "data": "last backup 02:00",
        "about": "0.1.0",
    }


def test_nothing_set_up_yet_is_said_and_not_shown_as_zero():
    found = notes(SettingsFacts())
    assert (found["robots"], found["missions"], found["idle"], found["data"]) == (
        "none yet",
        "none yet",
        "off",
        "no backup yet",
    )
    assert found["constraints"] == "Mon–Fri"


def test_what_needs_somebody_is_amber_in_the_list():
    state = facts(robots=(replace(AINO, needs_password=True, enabled=False), SISU), names={2: {"other": "Other"}})
    found = view.section_notes(state, NOW)
    assert (found["robots"].text, found["robots"].tone) == ("Aino needs a password", "attention")
    assert (found["missions"].text, found["missions"].tone) == ("3, 1 missing", "attention")


def test_only_the_open_section_is_marked():
    rows = view.section_items(facts(), NOW, "idle")
    assert [row.key for row in rows if row.look == "chosen"] == ["idle"]
    assert [row.key for row in rows] == [
        "robots",
        "missions",
        "constraints",
        "idle",
        "scheduler",
        "display",
        "data",
        "about",
    ]


@pytest.mark.parametrize(
    ("days", "phrase"),
    [
        (("MO", "TU", "WE", "TH", "FR"), "Mon–Fri"),
        (("MO", "TU", "WE", "TH", "FR", "SA", "SU"), "every day"),
        (("MO", "WE", "FR"), "Mon, Wed, Fri"),
        (("SU", "MO", "TU", "WE"), "Mon–Wed, Sun"),
        (("SA", "SU"), "Sat, Sun"),
        (("TU",), "Tue"),
    ],
)
def test_days_in_few_words(days, phrase):
    assert view.days_phrase(days) == phrase


# ---------------------------------------------------------------------- robots
def robot_items(**values):
    return view.robot_items(facts(**values), NOW, {})


def test_a_row_of_a_robot_says_what_it_is_and_nothing_else_while_all_is_well():
    [aino, _sisu] = robot_items(snapshots={1: snapshot()})
    assert (aino.key, aino.title, aino.support, aino.meta) == (1, "Aino", "MiR250 · 10.40.12.21", "")


def test_the_sheet_of_a_robot_has_its_data():
    known = facts(snapshots={1: snapshot()})
    assert view.robot_note(known, known.robot(1), NOW) == view.NoticeView(
        "Connected · now", "MiR250 · serial 200104012 · software 3.5.4", "neutral", "wifi"
    )


def test_what_is_not_plain_http_is_said():
    [_aino, sisu] = robot_items(missions=())
    assert sisu.support == "MiR robot · https://sisu.plant:8443"


def test_missing_missions_stand_out_on_their_robot():
    [aino, sisu] = robot_items(names={1: {"guid-deliver": "Deliver kits"}, 2: {"guid-deliver": "Deliver kits"}})
    assert "missing" not in aino.meta
    assert (sisu.meta, sisu.meta_tone, sisu.meta_icon) == ("1 mission missing", "attention", "alert")


def test_a_robot_without_password_says_so_first():
    [row] = robot_items(robots=(replace(AINO, needs_password=True, enabled=False),))
    assert (row.meta, row.meta_tone) == ("Needs a password", "attention")


@pytest.mark.parametrize(("tone", "shown"), [("fault", "1 problem"), ("action", ""), ("done", "")])
def test_only_a_problem_of_a_check_up_stands_in_the_list(tone, shown):
    check_up = view.NoticeView("1 problem", tone=tone)
    [aino, _sisu] = view.robot_items(facts(snapshots={1: snapshot()}), NOW, {1: check_up})
    assert aino.meta == shown


def identity(serial="200104012", **values):
    status = RobotStatus(robot_name="MiR_R1234", robot_model="MiR250", serial_number=serial, elapsed_s=0.0384)
    return Identity(status, "scheduler", **{"software": "3.5.4", **values})


def test_two_that_turn_out_to_be_one_machine_name_each_other():
    """A silent one is saved without its serial number, which is read later."""
    twins = (AINO, replace(AINO, id=2, name="Lempi"), replace(AINO, id=3, name="Third", serial_number=""))
    rows = robot_items(robots=twins)
    assert [(row.meta, row.meta_tone) for row in rows[:2]] == [
        ("Same machine as Lempi", "fault"),
        ("Same machine as Aino", "fault"),
    ]
    assert "Same" not in rows[2].meta


def test_a_passed_test_says_who_answered():
    notice = view.connection_found(identity())
    assert notice == view.NoticeView(
        "MiR_R1234 answers in 38 ms", "MiR250 · serial 200104012 · software 3.5.4", "done", "check-circle"
    )


def test_a_passed_test_omits_missing_facts():
    assert view.connection_found(identity(serial=None, software=None)).note == "MiR250"


def test_a_certificate_is_said_without_what_was_just_pressed():
    assert "Test connection" not in view.went_wrong(CertificateProblem(code="certificate_untrusted")).text


@pytest.mark.parametrize(
    ("by", "words"),
    [
        (IdentifiedBy.SERIAL_NUMBER, "its serial number"),
        (IdentifiedBy.CERTIFICATE, "its certificate"),
        (IdentifiedBy.ADDRESS, "its address only"),
    ],
)
def test_the_sheet_says_what_makes_the_machine_the_robot(by, words):
    assert f"Identified by {words}" in view.robot_note(facts(), replace(AINO, identified_by=by), NOW).note


@pytest.mark.parametrize(("user", "is_published"), [("distributor", True), ("scheduler", False)])
def test_a_password_that_is_printed_in_manuals_is_flagged(user, is_published):
    robot = replace(AINO, token=Token.derive(user, "distributor").header)
    assert ("Default password of MiR" in view.robot_note(facts(), robot, NOW).note) is is_published


def test_numbers_are_compared_in_fours_and_differences_are_marked():
    assert trust_view.fours("201806001234", "202106004471") == [("2018", True), ("0600", False), ("1234", True)]
    assert trust_view.fours("A-1") == [("A-1", False)]


@pytest.mark.parametrize(
    ("problem", "sentence"),
    [
        (Unreachable(code="refused", address="10.1.1.1"), "10.1.1.1 refused the connection"),
        (Unreachable(code="no_route", address="10.1.1.1"), "There is no route to 10.1.1.1"),
        (TimedOut(address="10.1.1.1", seconds=5), "10.1.1.1 didn't answer within 5 s"),
        (InvalidInput("address", "enter the robot's address"), "Enter the robot's address"),
    ],
)
def test_a_failed_test_says_exactly_what_is_wrong(problem, sentence):
    notice = view.went_wrong(problem)
    assert notice.text.startswith(sentence)
    assert notice.tone == "fault"


def test_a_robot_that_was_asked_is_named_and_not_its_address():
    said = view.went_wrong(Unreachable(code="no_route", address="10.1.1.1:8080"), "Aino").text
    assert said.startswith("There is no route to Aino. ")


# ---------------------------------------------------------------------- missions
def lines(state, most=6, **choice):
    return missions_view.mission_lines(state, missions_view.Choice(**choice), most)


def heads(state, most=6, **choice):
    return [head for head, _robots in missions_view.columns(state, missions_view.Choice(**choice), most)]


def signs(line):
    return [cell.icon or cell.text for cell in line.cells]


def test_a_row_of_the_matrix_is_a_mission_with_its_usual_duration():
    """As its runs took or, without any, as a person typed it."""
    missions = (replace(CHARGE, usual_minutes=84), COILS, replace(DELIVER, usual_minutes=84))
    state = facts(missions=missions, usual_s={DELIVER.guid: 300.0})
    assert [(row.name, row.note, row.favourite, row.usual) for row in lines(state)] == [
        ("Charge", "", True, "1 h 24 min"),
        ("Coils", "Only Sisu", False, "–"),
        ("Deliver kits", "", False, "5 min"),
    ]


def test_a_cell_says_whether_the_robot_has_it_lacks_it_or_was_not_asked():
    known = facts(names={1: {"guid-charge": ""}})
    charge, coils, deliver = lines(known)
    assert signs(charge) == ["check", "help"]  # Sisu has not answered yet
    assert signs(coils) == ["–", "help"]  # which only Sisu has
    assert (signs(deliver), deliver.cells[0].is_missing) == (["close", "help"], True)  # a schedule starts it on Aino
    assert signs(lines(facts(names={1: {"guid-deliver": ""}}))[0]) == ["–", "help"]  # nothing starts it there


def test_what_a_group_plans_is_missing_on_its_robots():
    of_group = replace(MORNING, robot_id=None, group_id=5)
    names = {1: {"guid-deliver": ""}, 2: {"guid-coils": ""}}
    known = facts(groups=(Group("Hall 1", (1, 2), id=5),), schedules=(of_group,), names=names)
    assert [mission.name for mission in known.missing[2]] == ["Deliver kits"]
    own = Mission("Deliver kits", "guid-own", id=14, robot_id=2)  # takes its place there
    with_own = replace(known, missions=(DELIVER, own), names={**names, 2: {"guid-own": ""}})
    assert with_own.missing[2] == ()


def test_above_six_robots_or_without_room_columns_are_groups():
    robots = tuple(replace(AINO, id=n, name=f"R{n}") for n in range(1, 9))
    halls = (Group("Hall 1", (1, 2, 3), id=1), Group("Hall 2", (4, 5, 6), id=2))
    many = facts(robots=robots, groups=halls, names={n: {"guid-charge": ""} for n in range(1, 8)}, schedules=())
    assert heads(many) == ["Hall 1", "Hall 2", "Others"]
    assert signs(lines(many)[0]) == ["3/3", "3/3", "1/1"]  # robot 8 has not answered
    assert heads(many, group_id=1) == ["R1", "R2", "R3"]
    assert heads(many, most=2) == ["Robots"]
    assert heads(many, most=2, group_id=1) == ["Hall 1"]
    assert heads(replace(many, groups=())) == ["Robots"]
    assert signs(lines(replace(many, names={}))[0]) == ["–", "–", "–"]


def test_a_robot_that_lacks_a_planned_mission_marks_its_group():
    robots = tuple(replace(AINO, id=n, name=f"R{n}") for n in range(1, 9))
    state = facts(
        missions=(CHARGE, DELIVER),
        robots=robots,
        names={n: {"guid-charge": "", **({} if n == 1 else {"guid-deliver": ""})} for n in range(1, 9)},
    )
    [deliver] = [line for line in lines(state) if line.name == "Deliver kits"]
    assert [(cell.text, cell.is_missing) for cell in deliver.cells] == [("7/8", True)]
    assert lines(state, only_missing=True) == [deliver]


@pytest.mark.parametrize(
    ("query", "names"),
    [
        ("COIL", ["Coils"]),
        ("kits deliver", ["Deliver kits"]),
        ("sisu", ["Coils"]),
        ("guid-ch", ["Charge"]),
        ("nothing", []),
        ("  ", ["Charge", "Coils", "Deliver kits"]),
    ],
)
def test_missions_are_found_by_words_of_name_guid_or_robot(query, names):
    assert [row.name for row in lines(facts(), query=query)] == names


def test_a_mission_is_missing_only_where_it_is_used_and_the_robot_has_answered():
    known = facts(names={1: {"guid-charge": "Charge"}})
    assert missions_view.missing_sentence(known, DELIVER) == "Not on Aino any more"
    assert missions_view.missing_sentence(known, CHARGE) == ""
    assert missions_view.missing_sentence(known, COILS) == ""  # Sisu has not answered yet
    assert missions_view.missing_sentence(facts(), DELIVER) == ""


def test_the_sheet_says_what_starts_a_mission_and_who_lacks_it():
    state = facts(robots=(replace(AINO, idle=IdleRule(11, 15)), SISU), names={1: {"guid-charge": ""}})
    notes = [missions_view.mission_note(state, mission) for mission in state.missions]
    assert [(note.text, note.note) for note in notes] == [
        ("Idle automation on Aino", ""),
        ("No schedule uses it", ""),
        ("Not on Aino any more", "1 schedule"),
    ]


# ---------------------------------------------------------------------- taking over from a robot
def test_a_shortened_name_of_the_robot_is_reported():
    short, long = missions_view.offer_options(offers(("A", "guid-1"), ("L" * 81, "guid-2")))
    assert (short.note, long.text, long.note) == ("", "L" * 80, "Name cut at 80 characters")


def offers(*found, missions=(CHARGE, COILS, DELIVER), robot_id=1):
    return missions_view.offers([MissionInfo(guid, name) for name, guid in found], missions, robot_id)


def test_what_is_here_already_is_not_offered_again():
    offered = offers(("Deliver kits", "guid-deliver"), ("New", "guid-new"))
    assert [(offer.name, offer.known) for offer in offered] == [("Deliver kits", True), ("New", False)]
    assert [option.key for option in missions_view.offer_options(offered)] == ["guid-new"]


def test_a_mission_whose_guid_differs_on_this_robot_is_its_own():
    [offer] = offers(("Deliver kits", "another-guid"))
    assert (offer.name, offer.robot_id) == ("Deliver kits", 1)
    assert missions_view.offer_options([offer])[0].note


def test_two_missions_of_one_name_on_a_robot_get_two_names():
    offered = offers(("Twice", "a"), ("Twice", "b"), ("Charge", "guid-charge"), ("Charge", "c"))
    assert [(offer.name, offer.robot_id) for offer in offered] == [
        ("Charge 2", None),
        ("Charge", None),
        ("Twice", None),
        ("Twice 2", None),
    ]


def test_a_name_of_another_robots_own_mission_is_free():
    [offer] = offers(("Coils", "x"))
    assert (offer.name, offer.robot_id) == ("Coils", None)


def test_long_and_empty_names_become_names_that_can_be_saved():
    [long, other, _nameless] = sorted(
        offers(("n" * 100, "a"), ("n" * 100, "b"), ("", "c")), key=lambda offer: offer.guid
    )
    assert long.name == "n" * 80
    assert other.name == "n" * 78 + " 2"
    assert _nameless.name == "c"


def test_nothing_to_choose_is_said():
    assert missions_view.fetched_sentence([], AINO) == "Aino has no missions. Make one on the robot first."
    assert (
        missions_view.fetched_sentence(offers(("Deliver kits", "guid-deliver")), AINO)
        == "The mission of Aino is already added"
    )
    assert missions_view.fetched_sentence(offers(("New", "guid-new")), AINO) == ""


def test_a_robots_own_mission_hides_the_common_one_of_its_name():
    own = Mission("Deliver kits", "own", id=13, robot_id=2)
    state = facts(missions=(CHARGE, DELIVER, own))
    assert [option.key for option in missions_view.mission_options(state, SISU)] == [11, 13]
    assert [option.key for option in missions_view.mission_options(state, AINO)] == [11, 10]
    assert {option.icon for option in missions_view.mission_options(state, AINO)} <= {"star", "star-outline"}


# ---------------------------------------------------------------------- idle automation
def test_idle_rows_say_what_will_happen():
    state = facts(robots=(replace(AINO, idle=IdleRule(11, 15)), SISU))
    [aino, sisu] = missions_view.idle_items(state, {})
    assert (aino.on, aino.support) == (True, "Charge · after 15 min")
    assert (sisu.on, sisu.support) == (False, "No mission")
    [aino, _sisu] = missions_view.idle_items(state, {AINO.id: "The disk is full"})
    assert (aino.support, aino.support_tone) == ("The disk is full", "fault")


# ---------------------------------------------------------------------- files
def test_backups_are_offered_newest_first_with_their_time():
    state = facts(
        backups=(
            FoundFile(Path("/d/daily-2026-11-20.db"), datetime(2026, 11, 20, 0, 0, tzinfo=UTC), 512_000),
            FoundFile(Path("/d/daily-2026-11-19.db"), datetime(2026, 11, 19, 0, 0, tzinfo=UTC), 400),
        )
    )
    row = view.data_items(state, NOW, can_restore=False)[-1]
    assert (row.support, row.at_right) == ("last backup 02:00", "Ask the person in charge")
    row = view.data_items(facts(), NOW, can_restore=True)[-1]
    assert (row.support, row.at_right) == ("no backup yet", "")
    assert view.file_note(state.backups[0], "Europe/Helsinki", NOW) == "02:00 · 512 kB"


def test_an_import_lists_what_is_lost_first():
    stopped = message(
        "robot {name} changed: {what}. It is switched off and needs a password", name="R1", what="address"
    )
    items = view.import_items([message("robot {name} added", name="R2"), stopped], DeletesRuns(1, 3))
    assert [(item.title, item.tone) for item in items] == [
        ("Deletes the oldest 3 runs for ever", "fault"),
        ("Robot R1 changed: address. It is switched off and needs a password", "attention"),
        ("Robot R2 added", "neutral"),
    ]
