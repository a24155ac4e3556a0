"""A mission that fails at its robot: one alarm, one row, one press. On real services and simulated robots."""

from __future__ import annotations

import pytest

from app.widgets.list_row import ListRow
from tests.ui.alarms.listed import fold, open_list, press, row, wait_for_rows
from tests.ui.home.operator import run

pytestmark = pytest.mark.long

REASON = "Failed to reach goal position 'Dock'"
SHOWN = "Can't reach Dock"


@pytest.fixture
def failed(home, ui):
    """Aino has ended the mission with an error."""
    home.aino.control({"fail_next_mission": REASON})
    run(ui, "Deliver")
    ui.wait(
        lambda: sorted(alarm.code for alarm in home.site.container.alarms.open()) == ["execution_failed", "robot_error"]
    )
    open_list(ui)
    wait_for_rows(ui, 1)
    return home


def acknowledged(home) -> bool:
    """Both of them: of the mission nothing is left, the error lasts."""
    return [(alarm.code, alarm.acknowledged_at is not None) for alarm in home.site.container.alarms.open()] == [
        ("robot_error", True)
    ]


def test_one_row_acknowledges_both_and_each_of_them_is_a_tap_away(failed, ui):
    led = row(ui, SHOWN)
    assert (led.item.title, led.item.tone) == (SHOWN, "fault")
    assert led.item.support.startswith("Mission failed: Deliver")
    fold(ui, led)
    wait_for_rows(ui, 3)
    assert {f"Aino · {SHOWN}", "Aino · Deliver failed"} == {each.item.whole for each in ui.find_all(ListRow)}
    press(ui, row(ui, SHOWN), "Acknowledge 2")
    ui.wait(lambda: acknowledged(failed))


def test_alarms_in_one_row_can_be_acknowledged_one_by_one(failed, ui):
    fold(ui, row(ui, SHOWN))
    wait_for_rows(ui, 3)
    ui.advance(1)  # what has only just come under a finger is not pressed
    press(ui, row(ui, "Deliver failed"), "Acknowledge")
    ui.wait(
        lambda: (
            [(alarm.code, alarm.acknowledged_at) for alarm in failed.site.container.alarms.open()]
            == [("robot_error", None)]
        )
    )
