"""The robot dialog with wrong entries, and at an address where another robot of the plan answers."""

from __future__ import annotations

from dataclasses import replace
from threading import Event

import pytest

from app.domain.models import HandOver, Robot
from app.screens.settings.robot_sheet import RobotSheet
from app.screens.settings.trust import TrustSheet, marked
from app.widgets.buttons import CommandButton, Toggle
from tests.hostile.capture import capture
from tests.ui.integrator import add, enter, entry, fill_in, go, item_of, open_row, page, press, robots, says, titles
from tests.ui.whole_app import PASSWORD, USER


@pytest.fixture
def refused(site, app, ui) -> RobotSheet:
    """The user name was typed wrongly, and the robot has refused it."""
    go(ui, "robots")
    add(ui, "Add robot")
    dialog = fill_in(ui, name="Aino", address=site.fleet.robots[0].url, username="distributr", password=PASSWORD)
    press(ui, "Test connection", dialog)
    ui.wait(lambda: "password" in dialog.problems)
    return dialog


@pytest.mark.parametrize("button", ["Test connection", "Save"])
def test_a_corrected_user_name_alone_is_tested_again(site, ui, refused, button):
    enter(ui, entry(refused, "username"), USER)
    assert refused.problems == {}
    press(ui, button, refused)
    ui.wait(lambda: refused.outcome.tone == "done" or robots(site))


def test_save_right_after_a_new_name_saves_the_rest_too(site, ui, monkeypatch):
    """Leaving the field saves the name; the tap on Save comes while that is being written."""
    site.add_robots()
    go(ui, "robots")
    dialog = open_row(ui, "Aino")
    enter(ui, entry(dialog, "password"), PASSWORD)
    enter(ui, entry(dialog, "name"), "Alma")
    change, is_pressed = site.container.catalogue.change, Event()

    def slow(*args, **how):
        assert is_pressed.wait(30)
        return change(*args, **how)

    monkeypatch.setattr(site.container.catalogue, "change", slow)
    press(ui, "Save", dialog)
    is_pressed.set()
    ui.wait(lambda: not ui.find_all(RobotSheet))
    assert "Alma" in [robot.name for robot in robots(site)]


def test_a_refusal_leaves_the_buttons_where_they_were(ui, app, site):
    go(ui, "robots")
    add(ui, "Add robot")
    dialog = fill_in(ui, name="Aino", address=site.fleet.robots[0].url, username=USER, password="wrong")

    def buttons() -> list[tuple[str, str, float]]:
        return [(button.text, button.style, button.x) for button in ui.find_all(CommandButton, root=dialog.ids.foot)]

    (_test, its_style, its_x), (_save, style, x) = before = buttons()
    assert [text for text, _style, _x in before] == ["Test connection", "Save"]
    press(ui, "Test connection", dialog)
    ui.wait(lambda: "password" in dialog.problems)
    ui.advance(0.5)
    assert buttons() == [("Test connection", its_style, its_x), ("Save anyway", style, x)]


def test_a_second_press_tests_again_as_it_is(ui, refused):
    press(ui, "Test connection", refused)
    ui.wait(lambda: not refused.second_busy)
    assert says(ui, "doesn't accept the user name and password")
    assert ([*refused.problems], refused.outcome.text) == (["password"], "")  # one refusal is said once


def test_a_name_in_use_is_reported_first_and_cannot_be_saved_anyway(site, app, ui, refused):
    site.add_robots()
    ui.wait(lambda: page(app).context.facts.robots)
    press(ui, "Save anyway", refused)
    assert refused.ids.name_field.problem == "There is a robot Aino already"
    assert (refused.busy, refused.saving) == (False, False)
    enter(ui, refused.ids.name_field, "Other")
    assert refused.ids.name_field.problem == ""


@pytest.fixture
def aino(site, app, ui) -> RobotSheet:
    """Aino's sheet is open, and all is read."""
    site.add_robots()
    go(ui, "robots")
    ui.wait(lambda: len(titles(ui)) == 2 and all(item_of(ui, name).icon == "wifi" for name in titles(ui)))
    return open_row(ui, "Aino")


def test_what_was_changed_elsewhere_in_the_same_moment_stays(site, ui, aino):
    before = robots(site)[0]
    site.container.catalogue.change(before, replace(before, hand_over=HandOver.WHEN_FREE))
    aino.save()  # before the change is read
    ui.wait(lambda: not ui.find_all(RobotSheet))
    assert robots(site)[0].hand_over is HandOver.WHEN_FREE


def test_a_connection_changed_elsewhere_is_shown_and_what_was_entered_is_kept(site, ui, aino):
    enter(ui, entry(aino, "username"), "someone")
    before, url = robots(site)[0], site.fleet.robots[0].url.replace("127.0.0.1", "localhost")
    site.container.catalogue.change(before, replace(before, address=url), password=PASSWORD)
    ui.wait(lambda: (aino.it.address, aino.it.username) == (url.removeprefix("http://"), "someone"))
    enter(ui, entry(aino, "username"), before.username)
    assert (aino.password_hint, aino.draft) == ("unchanged", False)
    press(ui, "Save", aino)
    ui.wait(lambda: not ui.find_all(RobotSheet))
    assert (robots(site)[0].address, robots(site)[0].needs_password) == (url, False)


def test_a_robot_without_its_password_is_saved_switched_off(site, app, ui):
    site.container.catalogue.save_robot(Robot("Late", "10.0.0.9", USER))
    go(ui, "robots")
    dialog = open_row(ui, "Late")
    assert (dialog.password_hint, dialog.it.enabled) == ("needed to switch it on", True)
    enter(ui, entry(dialog, "address"), "10.0.0.8")
    press(ui, "Save", dialog)
    assert entry(dialog, "password").problem == f"Enter the password of {USER}"
    ui.tap(ui.find(Toggle, root=dialog))
    press(ui, "Save", dialog)
    ui.wait(lambda: not ui.find_all(RobotSheet))
    (robot,) = robots(site)
    assert (robot.address, robot.enabled, robot.needs_password) == ("http://10.0.0.8", False, True)


def aino_at_veikkos_address(site, ui) -> RobotSheet:
    go(ui, "robots")
    ui.wait(lambda: len(titles(ui)) == 2 and all(item_of(ui, name).icon == "wifi" for name in titles(ui)))
    dialog = open_row(ui, "Aino")
    assert dialog.password_hint == "unchanged"
    enter(ui, entry(dialog, "address"), site.fleet.robots[1].url)
    assert dialog.password_hint == "needed for this change"
    return dialog


def test_a_robot_of_the_plan_is_not_accepted_as_another_one(site, app, ui):
    site.add_robots()
    dialog = aino_at_veikkos_address(site, ui)
    enter(ui, entry(dialog, "password"), PASSWORD)
    press(ui, "Test connection", dialog)
    assert entry(dialog, "address").problem == "This is the address of Veikko, which is configured already"
    assert (dialog.second_busy, ui.find_all(TrustSheet)) == (False, [])
    enter(ui, entry(dialog, "address"), site.fleet.robots[0].url)  # set back: nothing is asked for
    enter(ui, entry(dialog, "password"), "")
    press(ui, "Test connection", dialog)
    ui.wait(lambda: dialog.outcome.tone == "done")


def test_a_robot_of_the_plan_is_not_added_a_second_time(site, app, ui):
    site.add_robots()
    go(ui, "robots")
    ui.wait(lambda: [robot.serial_number for robot in robots(site) if robot.serial_number][1:])
    ui.wait(lambda: all(robot.serial_number for robot in page(app).context.facts.robots))
    add(ui, "Add robot")
    url = site.fleet.robots[1].url
    dialog = fill_in(ui, name="Third", address=url, username=USER, password=PASSWORD)
    press(ui, "Save", dialog)
    ui.wait(lambda: entry(dialog, "address").problem == "This is the address of Veikko, which is configured already")
    enter(ui, entry(dialog, "address"), url.replace("127.0.0.1", "localhost"))  # the same machine by another address
    for _press in range(2):
        press(ui, "Save", dialog)
        ui.wait(lambda: not dialog.busy)
        assert entry(dialog, "address").problem.startswith(
            "This is Veikko, which is configured already: serial number "
        )
    assert len(robots(site)) == 2


def test_a_robot_that_another_person_has_just_added_is_not_added_twice(site, app, ui):
    go(ui, "robots")
    add(ui, "Add robot")
    dialog = fill_in(ui, name="Third", address=site.fleet.robots[0].url, username=USER, password=PASSWORD)
    page(app).context.facts = replace(page(app).context.facts, robots=())
    site.add_robots()  # not read by the window yet
    press(ui, "Save", dialog)
    ui.wait(lambda: "Aino, which is configured already" in entry(dialog, "address").problem)
    assert len(robots(site)) == 2


def test_a_default_password_is_said_while_it_is_entered(site, app, ui):
    go(ui, "robots")
    add(ui, "Add robot")
    dialog = fill_in(ui, name="Aino", address=site.fleet.robots[0].url, username=USER, password=PASSWORD)
    press(ui, "Test connection", dialog)
    ui.wait(lambda: dialog.outcome.tone == "done")
    assert "Default password of MiR: change it on the robot" in dialog.outcome.note


def test_a_name_of_the_robot_that_is_cut_is_said(site, app, ui):
    with capture(status={"robot_name": "R" * 100}) as machine:
        go(ui, "robots")
        add(ui, "Add robot")
        dialog = fill_in(ui, address=machine.url, username=USER, password=PASSWORD)
        press(ui, "Test connection", dialog)
        ui.wait(lambda: dialog.outcome.tone == "done")
        assert dialog.it.name == "R" * 79 + "…"
        assert dialog.outcome.note.endswith("Name cut at 80 characters")


def test_a_number_is_shown_in_lines_of_four_groups_and_is_no_markup():
    assert marked("a&b", "") == "a&amp;b"
    assert marked("0123456789ABCDEF" * 4, "").split("\n") == ["0123  4567  89AB  CDEF"] * 4
