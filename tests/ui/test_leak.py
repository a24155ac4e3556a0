"""Screens, dialogs and sizes of the window leak nothing: a tablet on the wall runs for months."""

from __future__ import annotations

import gc
import weakref

import pytest

from app.screens.common.shell import SCREENS
from app.screens.home.cards import RobotFoot
from app.screens.home.fleet_page import FleetPage
from app.widgets.fields import FieldInput
from app.window.garbage import LET_GO
from app.window.window import quiet_garbage
from tests.support import month
from tests.ui.fleet.operator import add_robots
from tests.ui.wear import CACHED, Wear, widgets
from tests.ui.whole_app import shown

pytestmark = pytest.mark.long

WARM = 36  # rounds: all there is has been built once
ROUNDS = 60
TURNS = 12  # each builds Home again
PILED = 6  # Homes that may wait for a collection


def test_sixty_rounds_leave_no_widget_and_nothing_that_holds_one(tmp_path, ui):
    container = month.plant(tmp_path)
    with shown(container, ui) as app:
        wear = Wear(app, ui)
        wear.rounds(WARM)
        before, kinds = wear.counts(), widgets()
        wear.rounds(ROUNDS)
        after, more = wear.counts(), widgets() - kinds
    container.close()
    # the dialog that was open last may linger; what leaks grows with every round
    growth = {name: count - before[name] for name, count in after.items() if count - before[name] >= ROUNDS}
    assert growth == {}, f"and of widgets: {dict(more)}"


def test_screens_replaced_by_a_turn_of_the_window_are_collected_in_use(container, ui):
    with shown(container, ui) as app, quiet_garbage():
        wear = Wear(app, ui)
        wear.turn(2)
        wear.settle()
        gc.unfreeze()  # what is frozen can't be counted
        before = wear.counts()
        built = wear.turn(TURNS)
        gc.unfreeze()
        piled = widgets()[RobotFoot.__name__]
        wear.settle()
        gc.unfreeze()
        after = wear.counts()
    gc.collect()
    gc.freeze()  # as before
    assert built == TURNS
    assert piled <= PILED
    assert {name: count - before[name] for name, count in after.items() if count - before[name] >= TURNS} == {}


@pytest.mark.parametrize("more", [0, 3], ids=["few robots", "many robots"])
def test_screens_replaced_by_another_text_size_are_freed_in_time(container, ui, more):
    add_robots(container, more)
    with shown(container, ui) as app, quiet_garbage(app):
        Wear(app, ui).turn(0)
        for name in (*SCREENS, "home"):
            app.shell.go(name)
            ui.wait(lambda: app.shell.background.idle)
        old = {name: weakref.ref(app.shell.navigator.screen(name)) for name in SCREENS}
        old |= {str(page): weakref.ref(page) for page in ui.find_all(FleetPage)}
        old["frame"] = weakref.ref(app.root_box.children[0])
        gc.collect()
        gc.freeze()  # as what is on screen for a while
        container.catalogue.change_settings(font_scale_percent=130)
        ui.wait(lambda: app.shell.navigator.built == [app.shell.navigator.current])
        ui.advance(LET_GO + 0.5)
        assert [name for name, screen in old.items() if screen() is not None] == []


def test_a_field_that_had_the_focus_keeps_no_screen_that_was_thrown_away(container, silent_robots, ui):
    with shown(container, ui) as app:
        app.shell.go("settings", section="scheduler")
        ui.wait(lambda: app.shell.background.idle and ui.find_all(FieldInput))
        ui.find(FieldInput).focus = True
        ui.advance(0.5)
        old = weakref.ref(app.shell.navigator.screen("settings"))
        app.shell.navigator.rebuild()
        ui.wait(lambda: app.shell.background.idle)
        ui.skip(CACHED)
        ui.wait(lambda: gc.collect() >= 0 and old() is None)
