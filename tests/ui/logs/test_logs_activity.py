"""The page of activity in the Logs, by taps: lanes of what the robots did, and what a tap on a band shows."""

from __future__ import annotations

from itertools import pairwise

import pytest

from app.domain.models import Group
from app.screens.logs import activity
from app.widgets import lanes_frame
from app.widgets.buttons import CommandButton, IconButton, MenuChip
from app.widgets.choices import ChoiceSheet, OptionRow
from app.widgets.display import LegendItem
from app.widgets.figure_charts import FigureSheet
from app.widgets.lanes import Lanes
from app.widgets.tokens import apply_theme
from tests.ui.logbook import reset_logs, settle, tap


@pytest.fixture
def screen(logs, ui):
    reset_logs(logs, ui, "activity")
    return logs


def choose(app, ui, chip: str, option: str) -> None:
    tap(app, ui, ui.find(MenuChip, text=chip))
    tap(app, ui, ui.find(OptionRow, ui.find(ChoiceSheet), title=option))


def box_of(ui, name: str, state: str) -> tuple[float, float, float, float]:
    """Left, bottom, right, top of the first bar of that state in that lane."""
    lanes = ui.find(Lanes)
    bar = next(bar for lane in lanes.lanes if lane.name == name for bar in lane.bars if bar.state == state)
    return next(box[:4] for box in lanes.boxes() if box[4] == bar.key)


def tap_bar(screen, ui, name: str, state: str) -> None:
    left, bottom, right, top = box_of(ui, name, state)
    ui.tap_at(*ui.find(Lanes).to_window((left + right) / 2, (bottom + top) / 2))
    settle(screen, ui)


def hours(ui) -> list[str]:
    return [label for _hour, label, _strong in ui.find(Lanes).ticks]


def group(name: str, *robots) -> Group:
    return Group(name, tuple(robot.id for robot in robots), id=robots[0].id)


def test_every_robot_has_a_lane_that_fills_the_time_up_to_now(screen, ui):
    lanes = ui.find(Lanes)
    assert [lane.name for lane in lanes.lanes] == ["Aino", "Sisu", "Veikko"]
    for lane in lanes.lanes:
        assert (lane.bars[0].start, lane.bars[-1].end) == pytest.approx((0, 8))
        assert all(first.end == second.start for first, second in pairwise(lane.bars))
    assert hours(ui) == [f"{hour:02}:00" for hour in range(7, 15)]
    words = ["Working", "Charging", "Ready", "Paused", "Stopped", "No answer"]
    assert [item.text for item in ui.find_all(LegendItem)] == words


@pytest.mark.parametrize("theme", ["light", "dark", "contrast"])
def test_every_activity_has_a_look_of_its_own(ui, theme):
    apply_theme(ui.app.theme_cls, theme)
    looks = [lanes_frame.colours()[kind] for kind in activity.KINDS if kind != "offline"]  # which is hatched
    apply_theme(ui.app.theme_cls, "light")
    assert len({tuple(look.fill) for look in looks}) == len(looks)


def test_a_tap_shows_what_from_when_to_when_and_how_long(screen, ui):
    tap_bar(screen, ui, "Sisu", "charging")
    dialog = ui.find(FigureSheet)
    assert dialog.title == "Sisu · Charging"
    assert [(line.title, line.meta) for line in dialog.rows] == [
        ("From", "10:06"),
        ("To", "11:30"),
        ("For", "1 h 24 min"),
    ]


def test_a_current_span_has_no_end(screen, ui):
    lanes = ui.find(Lanes)
    screen.logs.activity.show_bar(lanes.lanes[0].bars[-1].key)
    dialog = ui.find(FigureSheet)
    assert (dialog.title, dialog.rows[1].meta) == ("Aino · Working", "ongoing")


def test_a_finger_takes_the_lanes_to_an_earlier_time_and_back_to_now(screen, ui):
    lanes = ui.find(Lanes)
    hour = lanes.left_of(1) - lanes.left_of(0)
    ui.drag(lanes, 2 * hour, 0)
    settle(screen, ui)
    assert hours(ui) == [f"{hour:02}:00" for hour in range(5, 13)]
    assert (lanes.first, ui.find(IconButton, icon="chevron-right").disabled) == (0, False)
    ui.drag(lanes, -4 * hour, 0)  # to the future: nothing is there
    settle(screen, ui)
    assert hours(ui)[0] == "07:00"
    assert (lanes.first, ui.find(IconButton, icon="chevron-right").disabled) == (0, True)


def test_one_robot_can_be_looked_at_alone(screen, ui):
    choose(screen, ui, "All robots", "Veikko")
    assert [lane.name for lane in ui.find(Lanes).lanes] == ["Veikko"]
    assert ui.find(MenuChip, text="Veikko").active


def test_arrows_move_the_time_and_a_button_leads_back_to_now(screen, ui):
    later = ui.find(IconButton, icon="chevron-right")
    assert later.disabled
    tap(screen, ui, ui.find(IconButton, icon="chevron-left"))
    assert hours(ui) == [f"{hour:02}:00" for hour in range(3, 11)]
    tap(screen, ui, later)
    assert later.disabled
    tap(screen, ui, ui.find(IconButton, icon="chevron-left"))
    tap(screen, ui, ui.find(CommandButton, text="Today"))
    assert hours(ui)[0] == "07:00"


def test_longer_times_are_thinned_out_but_keep_every_robot_and_error(screen, ui):
    for chip, length in (("8 h", "7 days"), ("7 days", "30 days")):
        choose(screen, ui, chip, length)
        lanes = ui.find(Lanes).lanes
        assert len(lanes) == 3
        assert all(0 < len(lane.bars) <= 600 for lane in lanes)
        assert "error" in {bar.state for lane in lanes if lane.name == "Aino" for bar in lane.bars}
    choose(screen, ui, "30 days", "8 h")


def test_of_many_robots_one_group_is_open_and_a_tap_opens_another(screen, ui, monkeypatch):
    monkeypatch.setattr("app.screens.logs.activity.MOST_LANES", 2)
    aino, *others = screen.logs.facts.robots
    monkeypatch.setattr(
        screen.logs._services.catalogue, "groups", lambda: [group("Hall 1", aino), group("Hall 2", *others)]
    )
    choose(screen, ui, "8 h", "24 h")
    lanes = ui.find(Lanes)
    assert [lane.name for lane in lanes.lanes] == ["Hall 1", "Aino", "Hall 2"]
    ui.tap(lanes.seats()[-1])
    settle(screen, ui)
    assert [lane.name for lane in lanes.lanes] == ["Hall 1", "Hall 2", "Sisu", "Veikko"]
    choose(screen, ui, "24 h", "8 h")
