"""Settings, Robots, as an integrator uses it: taps and typing against simulated robots."""

from __future__ import annotations

import socket
import threading
from dataclasses import replace
from datetime import datetime

import pytest

from app.domain.models import Group, Robot, Schedule
from app.mir.credentials import Token
from app.screens.settings.find import FindSheet
from app.screens.settings.robot_sheet import RobotSheet
from app.screens.settings.trust import TrustSheet
from app.services.robots import finder
from app.widgets.buttons import Toggle
from app.widgets.choices import ChoiceSheet, OptionRow
from app.widgets.fields import Field, PickBox
from app.widgets.frame import NavItem
from app.widgets.sheet import AskSheet
from app.widgets.snackbar import Snackbar
from tests.hostile.capture import capture
from tests.integration.mir.servers import pin_of
from tests.ui.integrator import (
    add,
    choose,
    enter,
    entry,
    fill_in,
    go,
    item_of,
    open_row,
    page,
    press,
    robots,
    says,
    schedules,
    titles,
    undo,
)
from tests.ui.whole_app import PASSWORD, USER


@pytest.mark.parametrize("first_screen", ["home"])
def test_the_first_robot_from_the_empty_home_to_its_panel(site, app, ui):
    ui.wait(lambda: "No robots yet" in ui.texts())
    press(ui, "Add robot")
    ui.wait(lambda: ui.find_all(RobotSheet))
    dialog = fill_in(ui, name="Aino", address=site.fleet.robots[0].url, username=USER, password=PASSWORD)
    press(ui, "Test connection", dialog)
    ui.wait(lambda: dialog.outcome.tone == "done")
    assert dialog.outcome.text.startswith("Aino answers in ")
    assert "MiR" in dialog.outcome.note
    assert "serial" in dialog.outcome.note
    assert robots(site) == []  # a test saves nothing
    press(ui, "Save", dialog)
    ui.wait(lambda: robots(site) and not ui.find_all(RobotSheet))
    ui.wait(lambda: titles(ui))
    assert titles(ui) == ["Aino"]
    assert site.fleet.robots[0].url.removeprefix("http://") in item_of(ui, "Aino").support
    ui.wait(lambda: item_of(ui, "Aino").icon == "wifi")
    assert "serial" in open_row(ui, "Aino").about.note
    ui.tap(ui.find(NavItem, name="home"))
    ui.wait(lambda: "Send Aino" in ui.texts())


def test_saving_tests_first_and_says_what_is_wrong(site, app, ui):
    go(ui, "robots")
    add(ui, "Add robot")
    dialog = fill_in(ui, name="Aino", address=site.fleet.robots[0].url, username=USER, password="wrong")
    press(ui, "Save", dialog)
    ui.wait(lambda: "password" in dialog.problems)
    assert says(ui, "doesn't accept the user name and password")
    assert robots(site) == []
    enter(ui, entry(dialog, "password"), PASSWORD)  # mended: Save saves
    press(ui, "Save", dialog)
    ui.wait(lambda: [robot.name for robot in robots(site)] == ["Aino"])
    assert robots(site)[0].token == Token.derive(USER, PASSWORD).header


def test_a_robot_that_does_not_answer_can_be_saved_by_a_second_press(site, app, ui):
    with socket.socket() as closed:  # bound, not listening: refused
        closed.bind(("127.0.0.1", 0))
        go(ui, "robots")
        add(ui, "Add robot")
        dialog = fill_in(
            ui, name="Late", address=f"127.0.0.1:{closed.getsockname()[1]}", username=USER, password=PASSWORD
        )
        press(ui, "Save", dialog)
        ui.wait(lambda: dialog.foot == "Save anyway")
        assert says(ui, "refused the connection")
        assert robots(site) == []
        press(ui, "Save anyway", dialog)
        ui.wait(lambda: [robot.name for robot in robots(site)] == ["Late"])


def test_bad_input_is_one_sentence_at_its_field_and_nothing_is_saved(site, app, ui):
    go(ui, "robots")
    add(ui, "Add robot")
    right = {"name": "Aino", "address": site.fleet.robots[0].url, "username": USER, "password": PASSWORD}
    dialog = fill_in(ui, **right)
    for name, wrong, problem in (
        ("name", "", "Give the robot a name"),
        ("address", "not an address", "An address has no spaces"),
        ("username", "a:b", "A user name can't contain a colon"),
        ("username", "", "Enter the robot's user name"),
        ("password", "", f"Enter the password of {USER}"),
    ):
        field = entry(dialog, name)
        enter(ui, field, wrong)
        press(ui, "Save", dialog)
        ui.wait(lambda field=field, problem=problem: field.problem.startswith(problem))
        ui.wait(lambda: app.shell.background.idle)
        assert robots(site) == []
        shown = {other: entry(ui.find(RobotSheet), other) for other in right}
        assert {other: seen.text for other, seen in shown.items()} == {
            **right,
            name: wrong,
        }  # nothing that was entered is lost
        assert [other for other, seen in shown.items() if seen.problem] == [name]
        enter(ui, field, right[name])


def test_a_name_that_is_taken_is_said_at_the_name(site, app, ui):
    site.container.catalogue.remove_robot(site.add_robots()[1].id)
    go(ui, "robots")
    ui.wait(lambda: len(titles(ui)) == 1)
    add(ui, "Add robot")
    dialog = fill_in(ui, name="Aino", address=site.fleet.robots[1].url, username=USER, password=PASSWORD)
    press(ui, "Save", dialog)
    ui.wait(lambda: dialog.ids.name_field.problem == "There is a robot Aino already")
    assert len(robots(site)) == 1


def test_something_else_at_the_address_is_no_robot(site, app, ui):
    site.fleet.robots[0].control({"fault": {"kind": "html", "path": "*", "count": None}})
    go(ui, "robots")
    add(ui, "Add robot")
    dialog = fill_in(ui, name="Page", address=site.fleet.robots[0].url, username=USER, password=PASSWORD)
    press(ui, "Test connection", dialog)
    ui.wait(lambda: dialog.outcome.tone == "fault")
    assert "web page" in dialog.outcome.text


def test_a_test_without_changes_tests_the_stored_connection(site, app, ui):
    site.add_robots()
    go(ui, "robots")
    sheet = open_row(ui, "Veikko")
    press(ui, "Test connection", sheet)
    ui.wait(lambda: sheet.outcome.tone == "done")
    assert sheet.outcome.text.startswith("Veikko answers in")


def test_editing_keeps_the_password_and_never_shows_it(site, app, ui):
    site.add_robots()
    token = robots(site)[0].token
    go(ui, "robots")
    ui.wait(lambda: titles(ui))
    dialog = open_row(ui, "Aino")
    assert (entry(dialog, "password").text, entry(dialog, "password").hint) == ("", "unchanged")
    enter(ui, dialog.ids.name_field, "Aino 2")
    dialog.ids.name_field.focus = False
    ui.wait(lambda: {robot.name: robot.token for robot in robots(site)}.get("Aino 2") == token)
    ui.wait(lambda: says(ui, "Aino 2 saved"))
    assert dialog.title == "Aino 2"
    undo(ui)
    ui.wait(lambda: dialog.ids.name_field.text == "Aino")
    assert robots(site)[0].token == token


def test_another_user_needs_the_users_own_password(site, app, ui):
    site.add_robots()
    go(ui, "robots")
    ui.wait(lambda: titles(ui))
    open_row(ui, "Aino")
    dialog = fill_in(ui, username="admin")
    press(ui, "Save", dialog)
    assert entry(dialog, "password").problem == "Enter the password of admin"
    enter(ui, entry(dialog, "password"), "admin")
    press(ui, "Save", dialog)
    ui.wait(lambda: not ui.find_all(RobotSheet))
    assert robots(site)[0].username == "admin"


def edit_aino(ui) -> RobotSheet:
    ui.wait(lambda: titles(ui))
    return open_row(ui, "Aino")


def answer(ui, word: str) -> TrustSheet:
    """Press ``word`` on the question that is asked next; returns the question."""
    ui.wait(lambda: ui.find_all(TrustSheet))
    question = ui.find(TrustSheet)
    press(ui, word, question)
    return question


def test_another_address_needs_the_password_again(site, app, ui):
    site.add_robots()
    go(ui, "robots")
    dialog = edit_aino(ui)
    enter(ui, entry(dialog, "address"), site.fleet.robots[0].url.replace("127.0.0.1", "localhost"))
    press(ui, "Test connection", dialog)
    ui.wait(lambda: entry(dialog, "password").problem.startswith("Enter the password"))
    press(ui, "Save", dialog)
    ui.wait(lambda: app.shell.background.idle)
    assert ui.find_all(RobotSheet)
    assert "localhost" not in robots(site)[0].address
    enter(ui, entry(dialog, "password"), PASSWORD)
    press(ui, "Save", dialog)
    ui.wait(lambda: not ui.find_all(RobotSheet))
    assert "localhost" in robots(site)[0].address


def test_another_machine_gets_nothing_until_it_is_accepted_with_its_password(site, app, ui):
    site.add_robots()
    ui.wait(lambda: all(robot.serial_number for robot in robots(site)))
    before, other = (robot.serial_number for robot in robots(site))
    site.container.catalogue.remove_robot(robots(site)[1].id)  # the machine there is no longer a robot of the plan
    go(ui, "robots")
    ui.wait(lambda: len(titles(ui)) == 1)
    edit_aino(ui)
    dialog = fill_in(ui, address=site.fleet.robots[1].url, password=PASSWORD)
    press(ui, "Save", dialog)
    question = answer(ui, "Send nothing").question
    assert question.title == "Another robot answers"
    assert (question.before, question.now) == (before, other)
    assert dialog.outcome.tone == "attention"
    assert robots(site)[0].serial_number == before
    enter(ui, entry(dialog, "username"), USER)
    press(ui, "Save", dialog)
    answer(ui, "This is the new Aino")  # then it is tested and saved
    ui.wait(lambda: not ui.find_all(RobotSheet))
    assert (robots(site)[0].serial_number, robots(site)[0].needs_password) == (other, False)
    ui.wait(lambda: item_of(ui, "Aino").meta == "" and item_of(ui, "Aino").icon == "wifi")
    ui.wait(lambda: "Identified by its serial number" in open_row(ui, "Aino").about.note)
    assert "Default password of MiR" in ui.find(RobotSheet).about.note


def test_a_new_robot_at_the_old_address_needs_its_password_too(site, app, ui):
    site.add_robots()
    ui.wait(lambda: robots(site)[0].serial_number)
    site.container.catalogue.save_robot(replace(robots(site)[0], serial_number="the one before"), PASSWORD)
    go(ui, "robots")
    ui.wait(lambda: item_of(ui, "Aino"))
    ui.wait(lambda: item_of(ui, "Aino").meta.startswith("Another robot"))
    edit_aino(ui)
    answer(ui, "This is the new Aino")
    dialog = ui.find(RobotSheet)
    assert entry(dialog, "password").problem == f"Enter the password of {USER}"
    enter(ui, entry(dialog, "password"), PASSWORD)
    press(ui, "Save", dialog)
    ui.wait(lambda: not ui.find_all(RobotSheet))
    ui.wait(lambda: item_of(ui, "Aino").meta == "" and item_of(ui, "Aino").icon == "wifi")
    assert robots(site)[0].serial_number != "the one before"


def test_a_certificate_is_shown_to_compare_and_pinned_when_it_is_trusted(site, app, ui):
    with capture("field_robot.pem") as machine:
        go(ui, "robots")
        add(ui, "Add robot")
        dialog = fill_in(ui, name="Safe", address=machine.url, username=USER, password=PASSWORD)
        press(ui, "Save", dialog)
        ui.wait(lambda: ui.find_all(TrustSheet))
        assert machine.seen == []
        question, pin = answer(ui, "Trust it").question, pin_of("field_robot.pem")
        assert (question.title, question.before, question.now) == ("Unknown certificate", "", pin.upper())
        ui.wait(lambda: not ui.find_all(RobotSheet))
        assert robots(site)[0].certificate_sha256 == pin
        ui.wait(lambda: "Identified by its certificate" in open_row(ui, "Safe").about.note)


def test_another_certificate_is_compared_with_the_pinned_one(site, app, ui):
    with capture("plant_robot.pem") as machine:
        site.container.catalogue.save_robot(
            Robot("Aino", machine.url, USER, certificate_sha256=pin_of("field_robot.pem")), PASSWORD
        )
        go(ui, "robots")
        ui.wait(lambda: item_of(ui, "Aino") and item_of(ui, "Aino").meta.startswith("Another certificate"))
        edit_aino(ui)
        question, dialog = answer(ui, "Trust it").question, ui.find(RobotSheet)
        assert question.before == pin_of("field_robot.pem").upper()
        assert dialog.it.certificate_sha256 == pin_of("plant_robot.pem")
        assert entry(dialog, "password").problem == f"Enter the password of {USER}"
        assert machine.seen == []
        assert robots(site)[0].certificate_sha256 == pin_of("field_robot.pem")


def test_a_robot_reached_over_https_asks_before_it_uses_http(site, app, ui):
    with capture() as machine:
        site.container.catalogue.save_robot(Robot("Aino", "https://127.0.0.1:1", USER), PASSWORD)
        go(ui, "robots")
        edit_aino(ui)
        dialog = fill_in(ui, address=machine.url, password=PASSWORD)
        press(ui, "Save", dialog)
        answer(ui, "Send nothing")
        ui.wait(lambda: app.shell.background.idle)
        assert (machine.seen, robots(site)[0].address) == ([], "https://127.0.0.1:1")
        press(ui, "Save", dialog)
        answer(ui, "Use http")
        ui.wait(lambda: not ui.find_all(RobotSheet))
        assert robots(site)[0].address == machine.url


def test_a_robot_is_switched_off_at_once_and_on_again(site, app, ui):
    site.add_robots()
    go(ui, "robots")
    ui.wait(lambda: titles(ui))
    dialog = open_row(ui, "Aino")
    ui.tap(ui.find(Toggle, root=dialog))
    ui.wait(lambda: not robots(site)[0].enabled)
    ui.wait(lambda: item_of(ui, "Aino").meta == "Off" and says(ui, "Aino saved"))
    undo(ui)
    ui.wait(lambda: robots(site)[0].enabled and dialog.it.enabled)


def test_a_certificate_is_asked_for_only_with_https(site, app, ui):
    go(ui, "robots")
    add(ui, "Add robot")
    dialog = fill_in(ui, name="Safe", address="https://10.0.0.1", username=USER, password=PASSWORD)
    field = ui.find(Field, dialog, label="Certificate fingerprint (SHA-256)")
    enter(ui, field, "no fingerprint")
    press(ui, "Save", dialog)
    ui.wait(lambda: field.problem.startswith("A SHA-256 fingerprint"))
    enter(ui, entry(dialog, "address"), "10.0.0.1")
    assert "Certificate fingerprint (SHA-256)" not in ui.texts(dialog)


def test_a_deleted_robot_comes_back_with_its_schedules(site, app, ui):
    aino, _veikko = site.add_robots()
    (mission,) = site.add_missions("Deliver")
    site.container.catalogue.save_schedule(
        Schedule("Morning", aino.id, mission.id, datetime(2030, 1, 7, 6, 30), "UTC", "FREQ=DAILY")
    )
    go(ui, "robots")
    ui.wait(lambda: item_of(ui, "Aino"))
    site.container.catalogue.change_idle_rule(aino.id, mission_id=mission.id)
    ui.wait(lambda: page(app).context.facts.robot(aino.id).idle is not None)
    sheet = open_row(ui, "Aino")
    enter(ui, entry(sheet, "password"), "typed")
    choose(ui, "Delete", sheet)
    question = ui.find(AskSheet)
    assert question.title == "Delete Aino?"
    assert question.text.splitlines()[:4] == [
        "This schedule goes with it:",
        "Morning",
        "",
        "This goes with it: its idle automation.",
    ]
    press(ui, "Keep", question)
    ui.wait(lambda: app.shell.background.idle)
    assert len(robots(site)) == 2
    assert ui.find(RobotSheet).password == "typed"
    choose(ui, "Delete", sheet)
    press(ui, "Delete", ui.find(AskSheet))
    ui.wait(lambda: len(robots(site)) == 1 and not ui.find_all(RobotSheet))
    assert schedules(site) == []
    ui.wait(lambda: says(ui, "Aino deleted"))
    undo(ui)
    ui.wait(lambda: len(robots(site)) == 2)
    assert [schedule.name for schedule in schedules(site)] == ["Morning"]
    ui.wait(lambda: len(titles(ui)) == 2)


def test_a_robot_that_answers_for_the_first_time_shows_who_it_is(site, app, ui):
    go(ui, "robots")
    robot = site.fleet.robots[0]
    site.container.catalogue.save_robot(Robot("New", robot.url, USER), PASSWORD)
    ui.wait(lambda: item_of(ui, "New"))
    ui.wait(lambda: item_of(ui, "New").icon == "wifi" and item_of(ui, "New").support.startswith("MiR"))
    sheet = open_row(ui, "New")
    ui.wait(lambda: "serial" in sheet.about.note)


def test_a_robot_joins_groups_at_once(site, app, ui):
    aino, veikko = site.add_robots()
    site.container.catalogue.save_group(Group("Hall 1", (veikko.id,)))
    go(ui, "robots")
    dialog = edit_aino(ui)
    ui.tap(next(field for field in ui.find_all(PickBox, dialog) if field.parent.card.label == "Groups"))
    ui.wait(lambda: ui.find_all(ChoiceSheet))
    ui.tap(ui.find(OptionRow, title="Hall 1"))
    press(ui, "Set", ui.find(ChoiceSheet))
    ui.wait(lambda: dialog.groups == "Hall 1")
    assert set(site.container.catalogue.groups()[0].members) == {aino.id, veikko.id}
    undo(ui)
    ui.wait(lambda: dialog.groups == "")


def test_robots_of_the_network_are_looked_for_when_that_is_pressed(site, app, ui, monkeypatch):
    asked = [robot.url.removeprefix("http://") for robot in site.fleet.robots]
    site.container.catalogue.save_robot(Robot("Aino", site.fleet.robots[0].url, USER), PASSWORD)
    monkeypatch.setattr(finder, "addresses", lambda: asked)
    go(ui, "robots")
    add(ui, "Find robots")
    sheet = ui.find(FindSheet)
    ui.wait(lambda: not sheet.is_searching)
    assert sheet.said == "2 robots answer."
    aino, veikko = sorted(sheet.items, key=lambda item: asked.index(item.key))
    assert (aino.meta, aino.actions) == ("Added", ())
    assert veikko.title.endswith(asked[1])
    press(ui, "Add", sheet)
    ui.wait(lambda: ui.find_all(RobotSheet))
    form = ui.find(RobotSheet).it
    assert (form.address, form.name) == (asked[1], "Veikko")


def test_a_search_for_robots_that_fails_says_so_and_can_be_repeated(site, app, ui, monkeypatch):
    def no_addresses():
        raise OSError("too many open files")

    monkeypatch.setattr(finder, "addresses", no_addresses)
    go(ui, "robots")
    add(ui, "Find robots")
    sheet = ui.find(FindSheet)
    ui.wait(lambda: not sheet.is_searching)
    assert sheet.foot == "Search again"
    assert sheet.said == "Something unexpected went wrong. The log file has the details"


def test_what_is_refused_with_a_taken_name_is_not_shown_as_saved(site, app, ui):
    site.add_robots()
    go(ui, "robots")
    dialog = edit_aino(ui)
    enter(ui, dialog.ids.name_field, "Veikko")
    dialog.ids.name_field.focus = False
    ui.wait(lambda: dialog.problems.get("name") == "There is a robot Veikko already")
    ui.tap(ui.find(Toggle, root=dialog))
    ui.wait(lambda: app.shell.background.idle and not dialog.saving)
    assert dialog.it.enabled == robots(site)[0].enabled
    assert "name" in dialog.problems


def test_undo_of_a_name_leaves_a_later_connection_as_it_is(site, app, ui):
    site.add_robots()
    go(ui, "robots")
    dialog = edit_aino(ui)
    enter(ui, dialog.ids.name_field, "Aino 2")
    dialog.ids.name_field.focus = False
    ui.wait(lambda: says(ui, "Aino 2 saved"))
    fill_in(ui, username="admin", password="admin")
    press(ui, "Save", dialog)
    ui.wait(lambda: not ui.find_all(RobotSheet))
    ui.wait(lambda: says(ui, "Aino 2 saved") and "Undo" in ui.texts(ui.find(Snackbar)))
    undo(ui)
    ui.wait(lambda: robots(site)[0].name == "Aino")
    assert (robots(site)[0].username, robots(site)[0].needs_password, robots(site)[0].enabled) == ("admin", False, True)


def test_undo_changes_nothing_that_was_changed_again(site, app, ui):
    site.add_robots()
    go(ui, "robots")
    dialog = edit_aino(ui)
    enter(ui, dialog.ids.name_field, "Aino 2")
    dialog.ids.name_field.focus = False
    ui.wait(lambda: says(ui, "Aino 2 saved"))
    site.container.catalogue.save_robot(replace(robots(site)[0], name="Aino 3"))
    undo(ui)
    ui.wait(lambda: says(ui, "Aino 3 was changed again, so nothing is undone"))
    assert robots(site)[0].name == "Aino 3"


def test_a_robot_is_switched_off_while_its_connection_is_tested(site, app, ui):
    site.add_robots()
    go(ui, "robots")
    dialog = edit_aino(ui)
    site.fleet.robots[0].control({"fault": {"kind": "late", "count": None, "seconds": 2.0}})
    enter(ui, entry(dialog, "password"), "wrong")
    press(ui, "Save", dialog)
    ui.tap(ui.find(Toggle, root=dialog))
    ui.wait(lambda: not robots(site)[0].enabled)
    assert dialog.second_busy
    site.fleet.robots[0].control({"fault": None})
    ui.wait(lambda: not dialog.second_busy)
    assert not dialog.it.enabled


def test_a_search_that_is_stopped_says_how_many_were_asked(site, app, ui, monkeypatch):
    answer, asked = threading.Event(), []
    monkeypatch.setattr(finder, "addresses", lambda: [f"10.0.0.{n}" for n in range(150)])
    monkeypatch.setattr(finder, "status_of", lambda address: asked.append(address) or (answer.wait(30) and None))
    go(ui, "robots")
    add(ui, "Find robots")
    sheet = ui.find(FindSheet)
    ui.wait(lambda: len(asked) == finder.AT_ONCE and sheet.said == "0 of 150 asked, no robot")
    press(ui, "Stop", sheet)
    answer.set()
    ui.wait(lambda: not sheet.is_searching)
    assert sheet.said == "32 of 150 asked, no robot"


def test_a_tablet_without_a_private_network_says_so(site, app, ui, monkeypatch):
    monkeypatch.setattr(finder, "addresses", list)
    go(ui, "robots")
    add(ui, "Find robots")
    sheet = ui.find(FindSheet)
    ui.wait(lambda: sheet.said == "This tablet has no private network.")
