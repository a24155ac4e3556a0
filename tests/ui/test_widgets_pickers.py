"""Dialogs for a time and for a day."""

from __future__ import annotations

from datetime import date, time

import pytest

from app.screens.common.overlays import Dialogs
from app.widgets.buttons import CommandButton
from app.widgets.pickers import DayCell, TimeEntry, TimePart
from tests.ui.test_widgets_dialogs import ENTER, ESCAPE, press


@pytest.fixture
def dialogs(ui) -> Dialogs:
    return Dialogs(animate=False)


# ---------------------------------------------------------------------- time
@pytest.mark.parametrize(
    ("digits", "time_of_day"),
    [
        ("0630", (6, 30)),
        ("745", (7, 45)),
        ("2359", (23, 59)),
        ("27", (2, 7)),
        ("1299", (9, 9)),
        ("3", (3, 0)),
        ("00", (0, 0)),
    ],
)
def test_digits_make_a_time(digits, time_of_day):
    entry = TimeEntry(0, 0)
    for digit in digits:
        entry.digit(int(digit))
    assert (entry.hour, entry.minute) == time_of_day


def test_steps_go_round_the_clock():
    entry = TimeEntry(23, 58)
    entry.nudge("hour", 1)
    entry.nudge("minute", 1)
    assert (entry.hour, entry.minute) == (0, 0)
    entry.nudge("minute", -1)
    entry.nudge("hour", -1)
    assert (entry.hour, entry.minute) == (23, 55)
    entry = TimeEntry(6, 32)
    entry.nudge("minute", -1)
    assert entry.minute == 30


def test_erasing_goes_back():
    entry = TimeEntry(6, 30)
    entry.select("minute")
    entry.erase()
    assert (entry.hour, entry.minute, entry.part) == (6, 0, "minute")
    entry.erase()
    assert (entry.hour, entry.part) == (0, "hour")


def test_a_time_by_the_keypad(ui, dialogs):
    picked: list[time] = []
    dialogs.pick_time("Time", time(12, 0), picked.append)
    ui.advance()
    for key in "0645":
        press(ui, key)
    press(ui, "Set")
    assert picked == [time(6, 45)]


def test_a_time_by_steps_and_keyboard(ui, dialogs):
    picked: list[time] = []
    dialogs.pick_time("Time", time(6, 30), picked.append)
    ui.advance()
    hour, minute = ui.find_all(TimePart)
    assert (hour.text, minute.text) == ("06", "30")
    plus = [b for b in ui.find_all(CommandButton) if b.icon == "plus"]
    ui.tap(plus[0])
    ui.tap(plus[1])
    assert (hour.text, minute.text) == ("07", "35")
    ui.tap(minute)
    ui.key(ord("0"), "0")
    ui.key(ord("5"), "5")
    ui.key(ENTER)
    assert picked == [time(7, 5)]
    assert dialogs.top is None


def test_a_closed_time_dialog_takes_no_more_keys(ui, dialogs):
    picked: list[time] = []
    dialog = dialogs.pick_time("Time", None, picked.append)
    ui.advance()
    ui.key(ESCAPE)
    ui.key(ord("5"), "5")
    ui.key(ENTER)
    assert picked == []
    assert dialog.hour == 0


# ---------------------------------------------------------------------- date
def pick_date(dialogs, picked, **limits):
    return dialogs.pick_date("First day", date(2026, 11, 23), picked.append, today=date(2026, 11, 20), **limits)


def test_a_day_of_another_month(ui, dialogs):
    picked: list[date] = []
    dialog = pick_date(dialogs, picked)
    ui.advance()
    assert dialog.month_title == "November 2026"
    dialog.turn(1)
    dialog.turn(1)
    ui.advance()
    assert dialog.month_title == "January 2027"
    ui.tap(ui.find(DayCell, text="31"))
    press(ui, "Set")
    assert picked == [date(2027, 1, 31)]


def test_the_grid_begins_on_monday_and_knows_leap_days(ui, dialogs):
    dialog = pick_date(dialogs, [])
    dialog.year, dialog.month = 2028, 2
    ui.advance()
    cells = [cell.text for cell in reversed(dialog.ids.days.children)]
    assert cells[:7] == ["", "1", "2", "3", "4", "5", "6"]  # 1 February 2028 is a Tuesday
    assert [text for text in cells if text][-1] == "29"


def test_days_out_of_bounds_cannot_be_chosen(ui, dialogs):
    dialog = pick_date(dialogs, [], first=date(2026, 11, 20), last=date(2026, 11, 27))
    ui.advance()
    ui.tap(ui.find(DayCell, text="19"))
    ui.tap(ui.find(DayCell, text="28"))
    assert dialog.chosen == date(2026, 11, 23)
    ui.tap(ui.find(DayCell, text="27"))
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
