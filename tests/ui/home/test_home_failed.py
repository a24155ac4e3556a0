"""A mission that fails at its robot: one alarm, one row, one press. On real services and simulated robots."""

from __future__ import annotations

import pytest

from app.screens.frame.alarm_list import AlarmRow, AlarmsDialog
from app.widgets.buttons import CommandButton, IconButton
from app.widgets.frame import AlarmBanner, TopBar
from tests.ui.home.operator import run

pytestmark = pytest.mark.long

REASON = "Failed to reach goal position 'Dock'"


@pytest.fixture
def failed(home, ui):
    """Aino has ended the mission with an error."""
    home.aino.control({"fail_next_mission": REASON})
    run(ui, "Deliver")
    ui.wait(
        lambda: sorted(alarm.code for alarm in home.site.container.alarms.open()) == ["execution_failed", "robot_error"]
    )
    ui.wait(lambda: ui.find_all(AlarmBanner) and "Mission failed: Deliver" in ui.find(AlarmBanner).note)
    return home


def acknowledged(home) -> bool:
    """Both of them: of the mission nothing is left, the error lasts."""
    return [(alarm.code, alarm.acknowledged_at is not None) for alarm in home.site.container.alarms.open()] == [
        ("robot_error", True)
    ]


def test_the_banner_at_the_robot_acknowledges_both(failed, ui):
    assert (ui.find(TopBar).bell_count, ui.find(AlarmBanner).others) == ("1", "Details")
    ui.tap(ui.find(CommandButton, ui.find(AlarmBanner), text="Acknowledge"))
    ui.wait(lambda: acknowledged(failed))


def test_the_list_has_one_row_that_acknowledges_both_and_each_of_them_a_tap_away(failed, ui):
    ui.tap(ui.find(TopBar).ids.bell)
    [row] = ui.find_all(AlarmRow, ui.find(AlarmsDialog))
    assert (row.text, row.tone) == (f"Aino: {REASON} (10120)", "fault")
    ui.tap(ui.find(IconButton, row, icon="chevron-down"))
    ui.wait(
        lambda: (
            [row.text for row in ui.find_all(AlarmRow)][1:]
            == [f"Aino: {REASON} (10120)", f"Deliver on Aino failed: The robot ended it: {REASON}"]
        )
    )
    ui.tap(ui.find(CommandButton, ui.find_all(AlarmRow)[0], text="Acknowledge"))
    ui.wait(lambda: acknowledged(failed))


def test_alarms_in_one_row_can_be_acknowledged_one_by_one(failed, ui):
    ui.tap(ui.find(TopBar).ids.bell)
    ui.tap(ui.find(IconButton, ui.find(AlarmRow), icon="chevron-down"))
    ui.wait(lambda: len(ui.find_all(AlarmRow)) == 3)
    ui.advance(1)  # what has only just come under a finger is not pressed
    mission = next(row for row in ui.find_all(AlarmRow) if row.text.startswith("Deliver on Aino failed"))
    ui.tap(ui.find(CommandButton, mission, text="Acknowledge"))
    ui.wait(
        lambda: (
            [(alarm.code, alarm.acknowledged_at) for alarm in failed.site.container.alarms.open()]
            == [("robot_error", None)]
        )
    )
