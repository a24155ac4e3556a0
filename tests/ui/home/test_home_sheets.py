"""What comes over the page of a robot: never over its button, in any window."""

from __future__ import annotations

from collections.abc import Callable

import pytest
from kivy.core.window import Window

from app.screens.home.cards import RobotFoot, SendTile, TodayRow
from app.screens.home.screen import HomeViewModel
from app.widgets.sheet import Sheet
from app.window.key_focus import ENTER, ESCAPE
from tests.screenshots.home import home
from tests.support import home_facts as sample
from tests.ui.looks import targets
from tests.ui.window_sizes import window

RUNNING = ("execution", sample.FACTS.open[0].id)


@pytest.mark.parametrize(
    "press",
    [
        lambda vm: vm.cancel(RUNNING),
        lambda vm: vm.clear_queue(),
        lambda vm: vm.sending.open(sample.KITS.id),
        lambda vm: vm.sending.open_all(),
    ],
    ids=["cancel", "clear", "send", "all"],
)
@pytest.mark.parametrize(
    ("size", "scale", "gloves"),
    [
        ((1280, 800), 1.3, False),
        ((1024, 600), 1.0, False),
        ((1024, 600), 1.0, True),
        ((800, 1280), 1.3, True),
        ((600, 1000), 1.0, False),
    ],
)
def test_no_sheet_covers_the_button_of_the_robot(
    ui, size, scale, gloves, press: Callable[[HomeViewModel], object]
) -> None:
    with window(ui, size, scale, "fi", gloves=gloves) as rig:
        vm = home(rig, sample.FACTS).vm
        press(vm)
        ui.advance(0.5)
        foot, sheet = ui.find(RobotFoot), ui.find(Sheet)
        x, y = foot.to_window(*foot.pos)
        left, bottom = sheet.to_window(*sheet.pos)
        lies_apart = left >= x + foot.width or bottom >= y + foot.height or bottom + sheet.height <= y
        assert lies_apart, ((x, y, *foot.size), (left, bottom, *sheet.size))
        assert targets(sheet) == []


@pytest.mark.parametrize("size", [(800, 1280), (1024, 600), (640, 800)])
def test_a_sheet_that_is_turned_lies_as_if_it_were_opened_there(ui, size):
    with window(ui, (1280, 800)) as rig:
        vm = home(rig, sample.FACTS).vm
        vm.sending.open(sample.KITS.id)
        for turned in (size, (1280, 800)):
            Window.size = turned
            ui.advance(0.5)
            lies = ui.find(Sheet).pos, ui.find(Sheet).size
            vm.sheets.give_up()
            vm.sending.open(sample.KITS.id)
            ui.advance(0.5)
            assert lies == (ui.find(Sheet).pos, ui.find(Sheet).size)


@pytest.mark.parametrize(("size", "covered"), [((1280, 800), SendTile), ((800, 1280), TodayRow)])
def test_the_ring_goes_from_a_tile_into_its_sheet_and_back_and_never_under_it(ui, keys, size, covered):
    with window(ui, size) as rig:
        home(rig, sample.FACTS)
        ui.advance(0.5)
        tile = ui.find_all(SendTile)[0]
        keys._go(tile)
        ui.key(ENTER)
        ui.advance(0.5)
        assert keys.target.text == "Run on Aino"
        assert not [target for target in keys.targets() if isinstance(target, covered)]
        ui.key(ESCAPE)
        assert keys.target is tile
        keys.forget()
