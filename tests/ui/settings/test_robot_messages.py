"""Messages of Settings about a robot stay true: after a repair, after a mistake, and in a low window."""

from __future__ import annotations

from collections.abc import Iterator

import pytest
from kivy.core.window import Window

from app.domain.models import Connection, Robot
from app.screens.settings.robot_sheet import RobotSheet
from app.screens.settings.trust import TrustSheet
from tests.hostile.capture import Capture, capture
from tests.ui import checks
from tests.ui.integrator import enter, entry, fill_in, go, item_of, open_row, press, robots
from tests.ui.whole_app import PASSWORD, USER

pytestmark = pytest.mark.long


@pytest.fixture
def low(app, ui) -> Iterator[None]:
    """A small tablet."""
    before = Window.size
    Window.size = 800, 480
    ui.advance(0.2)
    yield
    Window.size = before


def refused(ui) -> RobotSheet:
    """Its sheet asks by itself, and the answer is no."""
    go(ui, "robots")
    ui.wait(lambda: item_of(ui, "Aino") and item_of(ui, "Aino").meta.startswith("Another robot"))
    open_row(ui, "Aino")
    ui.wait(lambda: ui.find_all(TrustSheet))
    assert ui.find(TrustSheet).title == "Another robot answers"
    press(ui, "Send nothing", ui.find(TrustSheet))
    return ui.find(RobotSheet)


def taken_over(site, ui, machine: Capture) -> None:
    """Aino was known, and now another machine answers at its address."""
    site.container.catalogue.save_robot(Robot("Aino", machine.url, USER), PASSWORD)
    ui.wait(lambda: robots(site)[0].serial_number)
    machine.pretend({"serial": "B-2"})
    ui.wait(lambda: site.container.snapshots.get(robots(site)[0].id).connection is Connection.WRONG_ROBOT)


def is_seen(widget) -> bool:
    return checks.visible_area(widget, checks.parents(widget)) == pytest.approx(checks.area(widget), abs=2)


def test_saving_a_robot_that_needs_a_decision_asks_for_it(site, app, ui):
    with capture() as machine:
        taken_over(site, ui, machine)
        machine.seen.clear()
        dialog = refused(ui)
        assert (dialog.foot, dialog.second) == ("Save anyway", "Test connection")
        assert dialog.outcome.text == "Nothing was sent to it."
        assert not [text for text in ui.texts() if "B-2" in text]  # nor in the banner
        assert machine.credentials == []


@pytest.mark.parametrize(
    ("password", "says"),
    [("", "It needs its password again"), (PASSWORD, "gets the entered password")],
    ids=["stored", "entered"],
)
def test_the_form_says_beforehand_what_a_new_robot_gets(site, app, ui, password, says):
    with capture() as machine:
        taken_over(site, ui, machine)
        dialog = refused(ui)
        enter(ui, entry(dialog, "password"), password)
        press(ui, "Test connection", dialog)
        ui.wait(lambda: ui.find_all(TrustSheet))
        assert says in ui.find(TrustSheet).question.more


def filled_in(app, ui, **values: str) -> RobotSheet:
    """A new robot, scrolled to the end of its dialog."""
    app.shell.go("settings", section="robots", add=True)
    ui.wait(lambda: ui.find_all(RobotSheet))
    dialog = fill_in(ui, **values)
    Window.release_all_keyboards()
    ui.advance(1)
    dialog.ids.page.scroll_y = 0
    ui.advance()
    return dialog


def test_a_field_that_has_to_be_filled_in_comes_in_sight_in_a_low_window(site, app, ui, low):
    dialog = filled_in(app, ui, address=site.fleet.robots[0].url, username=USER, password=PASSWORD)
    assert not is_seen(dialog.ids.name_field)
    press(ui, "Save", dialog)
    ui.advance(1)
    assert is_seen(dialog.ids.name_field)


def test_a_failure_is_in_sight_in_a_low_window(site, app, ui, low):
    dialog = filled_in(app, ui, name="Aino", address=site.fleet.robots[0].url, username=USER, password="wrong")
    dialog.ids.page.scroll_y = 1
    press(ui, "Save", dialog)
    ui.wait(lambda: dialog.foot == "Save anyway")
    ui.advance(1)
    assert is_seen(entry(dialog, "password"))
