"""Sheets for a time and for a day."""

from __future__ import annotations

from datetime import date, time

import pytest
from kivy.core.window import Window

from app.screens.common.overlays import Dialogs
from app.widgets.buttons import CommandButton
from app.widgets.month import MonthDay
from app.widgets.pickers import TimeCell
from tests.support.examples import at_night
from tests.ui.checks import area, parents, visible_area
from tests.ui.test_widgets_dialogs import press


@pytest.fixture
def dialogs(ui) -> Dialogs:
    return Dialogs()


# ---------------------------------------------------------------------- time
def test_a_time_by_single_minutes(ui, dialogs):
    picked: list[time] = []
    dialogs.pick_time("Time", time(6, 30), picked.append)
    ui.tap(ui.find(TimeCell, text="55"))
    minus, plus = ui.find(CommandButton, icon="minus"), ui.find(CommandButton, icon="plus")
    for button in (*[plus] * 6, minus, minus):
        ui.tap(button)
    ui.tap(ui.find(CommandButton, text="Set 06:59"))
    assert picked == [time(6, 59)]


@pytest.mark.parametrize("size", [(1280, 600), (1024, 600), (800, 480)])
def test_the_button_that_sets_the_time_is_in_sight_in_a_low_window(ui, dialogs, size):
    before, Window.size = Window.size, size
    try:
        dialogs.pick_time("Time", time(6, 30), print)
        ui.advance(1)
        button = ui.find(CommandButton, text="Set 06:30")
        assert visible_area(button, parents(button)) == pytest.approx(area(button), abs=2)
    finally:
        Window.size = before


@pytest.mark.parametrize("cells", ["45 07", *at_night("07 45", "06 07 45", "40 45 07")])
def test_an_hour_and_a_minute_are_a_time_in_any_order(ui, dialogs, cells):
    picked: list[time] = []
    dialogs.pick_time("Time", time(6, 30), picked.append)
    for text in cells.split():
        assert picked == []
        ui.tap(ui.find(TimeCell, text=text))
    assert (picked, dialogs.top) == ([time(7, 45)], None)


def test_enter_picks_the_time_that_is_shown(ui, dialogs):
    picked: list[time] = []
    dialogs.pick_time("Time", time(6, 30), picked.append)
    ui.advance(1)
    ui.key(13)
    assert (picked, dialogs.top) == ([time(6, 30)], None)


# ---------------------------------------------------------------------- date
def pick_date(dialogs, picked, first=None):
    return dialogs.pick_date("First day", date(2026, 11, 23), picked.append, today=date(2026, 11, 20), first=first)


def test_a_day_of_another_month(ui, dialogs):
    picked: list[date] = []
    dialog = pick_date(dialogs, picked)
    ui.advance()
    assert dialog.month_title == "November 2026"
    dialog.turn(1)
    dialog.turn(1)
    ui.advance()
    assert dialog.month_title == "January 2027"
    ui.tap(ui.find(MonthDay, text="31"))
    press(ui, "Set Sun 31 Jan")
    assert picked == [date(2027, 1, 31)]


def test_the_grid_begins_on_monday_and_knows_leap_days(ui, dialogs):
    dialog = pick_date(dialogs, [])
    dialog.year, dialog.month = 2028, 2
    ui.advance()
    cells = [day.text for day in dialog.days]
    assert cells[:7] == ["", "1", "2", "3", "4", "5", "6"]  # 1 February 2028 is a Tuesday
    assert [text for text in cells if text][-1] == "29"


def test_days_out_of_bounds_cannot_be_chosen(ui, dialogs):
    dialog = pick_date(dialogs, [], first=date(2026, 11, 20))
    ui.advance()
    ui.tap(ui.find(MonthDay, text="19"))
    assert dialog.chosen == date(2026, 11, 23)
    ui.tap(ui.find(MonthDay, text="27"))
    assert dialog.chosen == date(2026, 11, 27)


def test_today_is_one_tap_away_where_it_may_be_chosen(ui, dialogs):
    dialog = pick_date(dialogs, [])
    dialog.turn(12)
    ui.advance()
    press(ui, "Today")
    assert dialog.chosen == date(2026, 11, 20)
    assert dialog.month_title == "November 2026"
    dialog.first = date(2026, 12, 1)
    press(ui, "Today")
    assert dialog.chosen == date(2026, 12, 1)


def test_years_end_where_dates_end(ui, dialogs):
    dialog = pick_date(dialogs, [])
    dialog.year, dialog.month = 9999, 12
    dialog.turn(1)
    assert (dialog.year, dialog.month) == (9999, 12)
