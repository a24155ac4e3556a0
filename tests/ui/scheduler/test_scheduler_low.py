"""The form in low windows, and with the banner of an alarm above it: what saves is in sight as soon as there is something to save."""
from __future__ import annotations

import pytest

from app.screens.common.shell import pick
from app.screens.scheduler.screen import SchedulerScreen
from app.widgets.buttons import CommandButton
from app.widgets.snackbar import Snackbar
from app.widgets.timeline import Timeline
from tests.ui import checks
from tests.ui.planner import KITS, named, schedules, settle

BANNER = (976, 352)                      # what a banner leaves of 1024 × 600
LOW = (976, 440)                         # 1024 × 600
WIDE_BANNER = (1232, 552)                # 1280 × 800 with a banner


@pytest.fixture
def low(request, screen, container, ui):
    """The screen alone, as large as the test says."""
    screen.shell.go("home")
    low = ui.show(SchedulerScreen(pick(SchedulerScreen.Services, container), screen.shell), request.param)
    low.shown()
    settle(screen, ui)
    yield low
    low.hidden()
    ui.show(screen.root)


def saves(ui, low) -> list[CommandButton]:
    """The buttons that can save and are wholly on the page."""
    bottom = low.to_window(*low.pos)[1]
    found = [(button, button.to_window(*button.pos)[1]) for button in ui.find_all(CommandButton)
             if button.text in ("Save schedule", "Save changes") and not button.disabled]
    return [button for button, y in found if bottom <= y and y + button.height <= bottom + low.height]


@pytest.mark.parametrize("low", [WIDE_BANNER], indirect=True)
def test_a_banner_takes_lanes_of_the_timeline_and_nothing_of_the_form(low, screen, ui):
    assert not low.ids.page.do_scroll_y
    low.vm.edit(low.vm.listed.rows[0].key)
    settle(screen, ui)
    assert saves(ui, low) == [low.ids.form.ids.save.__self__]
    assert ui.find(Timeline).parent.height >= 60


@pytest.mark.parametrize("low", [LOW, BANNER], indirect=True)
def test_where_the_page_scrolls_what_saves_stays_at_its_foot_until_the_form_shows_it(low, screen, container, ui):
    assert low.ids.page.do_scroll_y
    assert not saves(ui, low)                                # there is nothing to save
    low.vm.form.set(mission_id=named(container, KITS, "Aino").mission_id)
    settle(screen, ui)
    before = len(schedules(container))
    foot, = saves(ui, low)
    assert checks.problems(low) == []                        # it lies on nothing that could be pressed
    low.ids.page.scroll_y = 0
    ui.advance(.3)
    own, = saves(ui, low)
    assert own is not foot
    low.ids.page.scroll_y = 1
    ui.advance(.3)
    ui.tap(saves(ui, low)[0])
    settle(screen, ui)
    assert len(schedules(container)) == before + 1
    assert ui.find(Snackbar).text == f"{KITS} on Aino is planned"
    assert not saves(ui, low)


@pytest.mark.parametrize("low", [BANNER], indirect=True)
def test_it_is_there_for_a_schedule_that_is_edited_and_goes_with_it(low, screen, container, ui):
    low.vm.edit(named(container, KITS, "Aino").id)
    settle(screen, ui)
    assert [button.text for button in saves(ui, low)] == ["Save changes"]
    low.vm.form.begin()
    settle(screen, ui)
    assert not saves(ui, low)
