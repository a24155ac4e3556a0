"""Double taps where they once started a mission or switched a schedule off: in the app, on real services and a simulated robot."""

from __future__ import annotations

from dataclasses import replace
from datetime import time

import pytest
from kivy.core.window import Window
from kivy.uix.widget import Widget

from app.screens.home.cards import SendTile
from app.screens.home.sending import SendSheet
from app.screens.scheduler.draft import Kind
from app.widgets.buttons import CommandButton
from app.widgets.list_row import ListRow
from app.widgets.pickers import TimeCell, TimeSheet
from app.widgets.places import places
from app.widgets.rest import DOUBLE_TAP, rest
from app.widgets.sheet import FOOT_RESTS, AskSheet
from tests.ui.home.operator import clear_queue, is_shown_pending, pend, run
from tests.ui.planner import opened, settle
from tests.ui.whole_app import plant, shown

pytestmark = pytest.mark.long

GAPS = [0.2, *(pytest.param(gap, marks=pytest.mark.long) for gap in (0.35, 0.5))]


def common_point(upper: Widget, lower: Widget) -> tuple[float, float] | None:
    """In the middle of what one of them covers of the other, px of the window; None: they lie apart."""
    (left, bottom, right, top), (x, y, end, height) = (
        (*widget.to_window(*widget.pos), *widget.to_window(widget.right, widget.top)) for widget in (upper, lower)
    )
    left, bottom, right, top = max(left, x), max(bottom, y), min(right, end), min(top, height)
    return ((left + right) / 2, (bottom + top) / 2) if left < right and bottom < top else None


@pytest.fixture
def resized(ui):
    """A window of another size, for one test."""
    before = tuple(Window.size)

    def resize(*size: int) -> None:
        Window.size = size
        ui.advance(0.5)

    yield resize
    Window.size = before


# ---------------------------------------------------------------------- Home
@pytest.fixture
def home(tmp_path, ui):
    with plant(tmp_path, robots=1) as site:
        site.add_robots()
        site.add_missions("Charge to 80 %", "Collect empties", "Deliver", "Home")
        with shown(site.container, ui) as app:
            ui.wait(lambda: "Ready" in ui.texts() and "Held" not in ui.texts())  # its clock is right, too
            app.site, app.aino = site, site.fleet.robots[0]
            yield app


def sent(app) -> list[str]:
    names = {mission.guid: mission.name for mission in app.site.container.catalogue.missions()}
    return [names[execution.mission_guid] for execution in app.site.container.history.open()]


@pytest.mark.parametrize("gap", GAPS)
def test_a_mission_that_is_chosen_by_a_double_tap_is_not_sent(home, ui, gap):
    vm = home.shell.navigator.screen("home").vm
    vm.sending.open_all()
    ui.advance(2 * DOUBLE_TAP)
    row = next(row for row in ui.find_all(ListRow) if row.item.title == "Home")
    ui.tap_twice(row.to_window(*row.center), gap)
    ui.wait(lambda: home.shell.background.idle)
    assert (sent(home), ui.find(SendSheet).title) == ([], "Home")


@pytest.mark.parametrize("gap", GAPS)
def test_a_tile_pressed_twice_sends_nothing(home, ui, gap):
    ui.wait(lambda: not rest.is_on)  # after the sheet of the test before
    tile = ui.find(SendTile, text="Home")
    ui.wait(lambda: not places.has_just_moved(tile))
    ui.tap_twice(tile.to_window(*tile.center), gap)
    ui.wait(lambda: home.shell.background.idle)
    assert (sent(home), ui.find(SendSheet).title) == ([], "Home")


@pytest.mark.parametrize("gap", GAPS)
def test_clear_queue_pressed_twice_sends_nothing(home, ui, resized, gap):
    pend(home)
    run(ui, "Deliver")
    ui.wait(lambda: is_shown_pending(ui))
    resized(1024, 600)
    clear_queue(ui)
    yes = ui.find(CommandButton, ui.find(AskSheet), text="Clear queue")
    ui.tap_twice(yes.to_window(*yes.center), gap)
    ui.wait(lambda: not sent(home))
    ui.advance(1)
    ui.wait(lambda: home.shell.background.idle)
    assert sent(home) == []


# ---------------------------------------------------------------------- Scheduler
@pytest.fixture
def planned(container, ui, silent_robots):
    with opened(container, ui) as app:
        yield app


@pytest.mark.parametrize("gap", [0.35, 0.55, 0.9])
@pytest.mark.parametrize("last", ["30", "Set 06:30"])
def test_the_second_tap_on_a_time_does_nothing_in_the_form_below(planned, container, ui, last, gap):
    """The first has closed the time; its button was where Save is."""
    planned.plan.begin()
    planned.plan.form.set(mission_id=container.catalogue.missions()[0].id, kind=Kind.DAILY)
    planned.plan.form.pick_time("at")
    settle(planned, ui)
    before, draft = container.catalogue.schedules(), planned.plan.form.draft
    ui.advance(2 * FOOT_RESTS)
    sheet = ui.find(TimeSheet)
    ui.tap(ui.find(TimeCell, text="06"))
    if last != "30":
        sheet.minute = 30
        ui.advance()
    button = ui.find(root=sheet, text=last)
    ui.tap_twice(button.to_window(*button.center), gap)
    settle(planned, ui)
    form = planned.plan.form
    assert (form.is_open, form.draft) == (True, replace(draft, at=time(6, 30)))
    assert container.catalogue.schedules() == before
