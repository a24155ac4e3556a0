"""The page of activity in the Logs, by taps: lanes of what the robots did, and what a tap on a band shows."""

from __future__ import annotations

from itertools import pairwise

import pytest

from app.domain.models import Group
from app.widgets.activity_bands import ActivityBands, ActivityLegend
from app.widgets.buttons import CommandButton, IconButton, MenuChip
from app.widgets.dialogs import ChoiceDialog
from app.widgets.figures import FigureDialog
from app.widgets.rows import OptionRow
from tests.ui.logbook import reset_logs, settle, tap


@pytest.fixture
def screen(logs, ui):
    reset_logs(logs, ui, "activity")
    return logs


def choose(app, ui, chip: str, option: str) -> None:
    tap(app, ui, ui.find(MenuChip, text=chip))
    tap(app, ui, ui.find(OptionRow, ui.find(ChoiceDialog), text=option))


def tap_lane(screen, ui, name: str, place: float) -> None:
    """Tap the lane of that name at 0..1 of the time."""
    bands = ui.find(ActivityBands)
    _x, y, _width, height, _lane = next(box for box in bands.boxes if box[4].name == name)
    left = bands.x + bands.names_width
    ui.tap_at(*bands.to_window(left + (bands.right - left) * place, y + height / 2))
    settle(screen, ui)


def group(name: str, *robots) -> Group:
    return Group(name, tuple(robot.id for robot in robots), id=robots[0].id)


def span_of(ui, robot: str, kind: str) -> tuple[float, float]:
    lane = next(lane for lane in ui.find(ActivityBands).lanes if lane.name == robot)
    return next((span.start, span.end) for span in lane.spans if span.kind == kind)


def test_every_robot_has_a_lane_that_fills_the_time_up_to_now(screen, ui):
    bands = ui.find(ActivityBands)
    assert [lane.name for lane in bands.lanes] == ["Aino", "Sisu", "Veikko"]
    for lane in bands.lanes:
        assert (lane.spans[0].start, lane.spans[-1].end) == pytest.approx((0, 1))
        assert all(first.end == second.start for first, second in pairwise(lane.spans))
    assert [tick.label for tick in bands.ticks] == [f"{hour:02}:00" for hour in range(7, 15)]
    assert [item.text for item in ui.find_all(ActivityLegend)] == [
        "Working",
        "Charging",
        "Ready",
        "Paused",
        "Stopped",
        "No answer",
    ]


def test_a_tap_shows_what_from_when_to_when_and_how_long(screen, ui):
    start, end = span_of(ui, "Sisu", "charging")
    tap_lane(screen, ui, "Sisu", (start + end) / 2)
    dialog = ui.find(FigureDialog)
    assert dialog.title == "Sisu · Charging"
    assert [(line.label, line.value) for line in dialog.rows] == [
        ("From", "10:06"),
        ("To", "11:30"),
        ("For", "1 h 24 min"),
    ]
    assert screen.logs.activity.mark[1:] == pytest.approx((start, end))
    ui.key(27)
    settle(screen, ui)
    assert screen.logs.activity.mark is None


def test_a_current_span_has_no_end(screen, ui):
    tap_lane(screen, ui, "Aino", 0.999)
    dialog = ui.find(FigureDialog)
    assert (dialog.title, dialog.rows[1].value) == ("Aino · Working", "ongoing")


def test_one_robot_can_be_looked_at_alone(screen, ui):
    choose(screen, ui, "All robots", "Veikko")
    assert [lane.name for lane in ui.find(ActivityBands).lanes] == ["Veikko"]


def test_arrows_move_the_time_and_a_button_leads_back_to_now(screen, ui):
    later = ui.find(IconButton, icon="chevron-right")
    assert later.disabled
    tap(screen, ui, ui.find(IconButton, icon="chevron-left"))
    assert [tick.label for tick in ui.find(ActivityBands).ticks] == [f"{hour:02}:00" for hour in range(3, 11)]
    assert "Fri 20 Nov" in ui.texts()
    tap(screen, ui, later)
    assert later.disabled
    tap(screen, ui, ui.find(IconButton, icon="chevron-left"))
    tap(screen, ui, ui.find(CommandButton, text="Today"))
    assert ui.find(ActivityBands).ticks[0].label == "07:00"


def test_longer_times_are_thinned_out_but_keep_every_robot_and_error(screen, ui):
    for chip, length in (("8 h", "7 days"), ("7 days", "30 days")):
        choose(screen, ui, chip, length)
        lanes = ui.find(ActivityBands).lanes
        assert len(lanes) == 3
        assert all(0 < len(lane.spans) <= 600 for lane in lanes)
        assert "error" in {span.kind for lane in lanes if lane.name == "Aino" for span in lane.spans}
    choose(screen, ui, "30 days", "8 h")


def test_of_many_robots_one_group_is_open_and_a_tap_opens_another(screen, ui, monkeypatch):
    monkeypatch.setattr("app.screens.logs.activity.MOST_LANES", 2)
    aino, *others = screen.logs.facts.robots
    monkeypatch.setattr(
        screen.logs._services.catalogue, "groups", lambda: [group("Hall 1", aino), group("Hall 2", *others)]
    )
    choose(screen, ui, "8 h", "24 h")
    assert [lane.name for lane in ui.find(ActivityBands).lanes] == ["Hall 1 · 1 robot", "Aino", "Hall 2 · 2 robots"]
    tap_lane(screen, ui, "Hall 2 · 2 robots", 0.5)
    assert [lane.name for lane in ui.find(ActivityBands).lanes][1:] == ["Hall 2 · 2 robots", "Sisu", "Veikko"]
    choose(screen, ui, "24 h", "8 h")
