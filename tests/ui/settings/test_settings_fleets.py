"""Settings, Robots, Add fleet, as an integrator uses it: taps and typing against a simulated fleet of two robots."""

from __future__ import annotations

import pytest

import mir_sim
from app.domain.models import ANY_VEHICLE, FleetKind
from app.screens.settings.check_up import CheckUpSheet
from app.screens.settings.fleet_sheet import FleetRobotsSheet, FleetSheet
from app.screens.settings.robot_sheet import RobotSheet
from app.widgets.buttons import Toggle
from app.widgets.choices import ChoiceSheet, OptionRow
from app.widgets.fields import Field, PickBox
from app.widgets.frame import NavItem
from app.widgets.list_row import ListRow, RowButton
from app.widgets.sheet import AskSheet
from tests.ui.home import operator
from tests.ui.integrator import (
    add,
    choose,
    enter,
    entry,
    fill_in,
    go,
    item_of,
    open_row,
    press,
    robots,
    row_of,
    says,
    undo,
)
from tests.ui.whole_app import PASSWORD, USER

pytestmark = pytest.mark.long  # the texts and rows: tests/unit/screens/test_settings_fleets_view.py


@pytest.fixture(scope="module")
def hall():
    with mir_sim.serve(robots=2, fleet="classic", time_scale=20.0, battery=90.0) as served:
        yield served


def fleets(site):
    return site.container.catalogue.fleets()


@pytest.fixture
def added(site, app, ui, hall) -> FleetRobotsSheet:
    """The fleet has just been added, and says which robots it has."""
    go(ui, "robots")
    add(ui, "Add fleet")
    sheet = fill_in(ui, name="Hall 2", address=hall.above.url, username=USER, password=PASSWORD)
    press(ui, "Save", sheet)
    ui.wait(lambda: ui.find_all(FleetRobotsSheet) and ui.find(FleetRobotsSheet).items)
    return ui.find(FleetRobotsSheet)


def add_robot(ui, name: str) -> None:
    ui.wait(lambda: row_of(ui, name))
    ui.advance(0.5)  # what has just appeared takes no touch
    ui.tap(ui.find(RowButton, row_of(ui, name)))


def add_aino(site, ui) -> None:
    add_robot(ui, "Aino")
    ui.wait(lambda: [robot.name for robot in robots(site)] == ["Aino"])


def row_of_plan(ui, name: str) -> ListRow | None:
    """Of the page, not of the sheet that lies beside it."""
    return next((row for row in ui.find_all(ListRow) if isinstance(row.key, int) and row.item.title == name), None)


def test_a_fleet_is_tested_saved_and_its_robots_are_added(site, ui, added):
    (fleet,) = fleets(site)
    assert (fleet.name, fleet.kind, fleet.needs_password) == ("Hall 2", FleetKind.CLASSIC, False)
    assert [item.title for item in added.items] == ["Any robot of the fleet", "Aino", "Veikko"]
    add_aino(site, ui)
    ui.wait(lambda: [item.meta for item in added.items] == ["", "Added", ""])
    add_robot(ui, "Any robot of the fleet")
    ui.wait(lambda: {robot.vehicle for robot in robots(site)} == {"1", ANY_VEHICLE})
    ui.wait(lambda: item_of(ui, "Hall 2").support == "MiR Fleet · 1 robot")
    ui.wait(lambda: row_of_plan(ui, "Any of Hall 2"))
    assert row_of_plan(ui, "Any of Hall 2").item.support == "Any robot of the fleet · Hall 2"
    ui.advance(0.5)
    ui.tap(row_of_plan(ui, "Any of Hall 2"))
    ui.wait(lambda: ui.find_all(RobotSheet))
    sheet = ui.find(RobotSheet)
    assert not ui.find_all(Field, sheet, label="When idle")  # a fleet is never idle
    ui.tap(ui.find(PickBox, ui.find(Field, sheet, label="Fleet")))
    ui.wait(lambda: ui.find_all(FleetSheet))
    choose(ui, "Delete", ui.find(FleetSheet))
    ui.wait(lambda: ui.find_all(AskSheet))
    assert says(ui, "This goes with it: Aino, Any of Hall 2.")
    press(ui, "Delete", ui.find(AskSheet))
    ui.wait(lambda: not fleets(site) and not robots(site))
    ui.wait(lambda: says(ui, "Hall 2 deleted"))
    undo(ui)
    ui.wait(lambda: len(fleets(site)) == 1 and len(robots(site)) == 2)


def test_the_api_key_of_a_new_fleet_has_all_of_the_width(site, app, ui):
    go(ui, "robots")
    add(ui, "Add fleet")
    sheet = ui.find(FleetSheet)
    sheet.choose_kind(FleetKind.ENTERPRISE)
    ui.advance(0.3)
    key, address = entry(sheet, "password"), entry(sheet, "address")
    assert (key.x, key.width) == (address.x, address.width)
    sheet.choose_kind(FleetKind.CLASSIC)
    ui.advance(0.3)
    assert entry(sheet, "username").width == key.width < address.width / 2


def test_a_wrong_password_is_said_at_its_field(site, app, ui, hall):
    go(ui, "robots")
    add(ui, "Add fleet")
    sheet = fill_in(ui, name="Hall 2", address=hall.above.url, username=USER, password="wrong")
    press(ui, "Save", sheet)
    ui.wait(lambda: "password" in sheet.problems)
    assert fleets(site) == []
    sheet.choose_kind(FleetKind.ENTERPRISE)
    assert ui.find_all(Field, sheet, label="API key")
    press(ui, "Test connection", sheet)
    assert sheet.problems.get("password") == "Enter the API key"
    sheet.choose_kind(FleetKind.CLASSIC)
    enter(ui, entry(sheet, "username"), USER)
    enter(ui, entry(sheet, "password"), PASSWORD)
    press(ui, "Test connection", sheet)
    ui.wait(lambda: sheet.outcome.text == "The fleet answers, with 2 robots")
    assert fleets(site) == []  # a test saves nothing


def test_a_wrong_api_key_is_said_at_its_field(site, app, ui):
    go(ui, "robots")
    add(ui, "Add fleet")
    with mir_sim.serve(robots=1, fleet="enterprise") as served:
        sheet = fill_in(ui, name="Hall 2", address=served.above.url)
        sheet.choose_kind(FleetKind.ENTERPRISE)
        enter(ui, entry(sheet, "password"), "wrong")
        press(ui, "Test connection", sheet)
        ui.wait(lambda: "password" in sheet.problems)
    assert sheet.problems.get("password") == "The fleet doesn't accept the API key"


def test_from_the_fleet_to_the_log(site, app, ui, added):
    add_aino(site, ui)
    ui.wait(lambda: row_of_plan(ui, "Aino"))
    ui.advance(0.5)
    ui.tap(row_of_plan(ui, "Aino"))
    ui.wait(lambda: ui.find_all(RobotSheet))
    sheet = ui.find(RobotSheet)
    assert not [field.label for field in ui.find_all(Field, sheet) if field.label in ("Address", "User", "Password")]
    assert ui.find_all(Toggle, sheet)
    site.add_missions("Home")
    ui.tap(ui.find(NavItem, name="home"))
    ui.wait(lambda: "Send Aino" in ui.texts())
    operator.run(ui, "Home")
    ui.wait(lambda: site.container.history.last_ended(robots(site)[0].id, site.container.clock.now(), 1), 60)
    ui.tap(ui.find(NavItem, name="logs"))
    ui.wait(lambda: row_of(ui, "Home"))
    assert item_of(ui, "Home").place == "Aino"


@pytest.mark.long
def test_a_fleet_is_checked_up_with_a_mission_and_a_robot_that_a_person_chooses(site, app, ui, added):
    sheet = open_row(ui, "Hall 2")
    press(ui, "Check up", sheet)
    ui.wait(lambda: ui.find_all(CheckUpSheet))
    check_up = ui.find(CheckUpSheet)
    assert check_up.foot_off == "Choose a mission and a robot"
    for label, word in (("Mission", "Home"), ("Robot", "Aino (Hall 2)")):
        ui.tap(ui.find(PickBox, ui.find(Field, check_up, label=label)))
        ui.wait(lambda: ui.find_all(ChoiceSheet))
        ui.tap(ui.find(OptionRow, title=word))
    ui.wait(lambda: says(ui, "Hall 2 gets one order: Home for Aino (Hall 2), not before tomorrow."))
    ui.advance(0.5)
    press(ui, "Make one order for tomorrow", check_up)
    go(ui, "about")
    ui.wait(lambda: [text for text in app.shell.snackbars.texts if text.startswith("Hall 2 is checked up: ")], 60)
    go(ui, "robots")
    press(ui, "Check up", open_row(ui, "Hall 2"))
    ui.wait(lambda: ui.find_all(CheckUpSheet) and ui.find(CheckUpSheet).vm.part == "CheckUpReport")
    assert says(ui, "The app's mark comes back in the description")
    ui.wait(lambda: fleets(site)[0].known is not None)
    ui.wait(lambda: item_of(ui, "Hall 2").meta == "Give the app its own user at the fleet")
