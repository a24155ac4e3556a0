"""The page of robots in the Logs, by taps: bands of what they did, and what a tap on one shows."""

from __future__ import annotations

from itertools import pairwise

import pytest

from app.screens.logs.cards import RobotsPart
from app.widgets.activity_bands import ActivityBands, ActivityLegend
from app.widgets.buttons import ChoiceChip, IconButton, Segment
from app.widgets.dialogs import ChoiceDialog
from app.widgets.figures import FigureDialog
from app.widgets.rows import OptionRow
from tests.ui import checks
from tests.ui.logbook import reset_logs, settle, tap


@pytest.fixture
def screen(logs, ui):
    reset_logs(logs, ui, "robots")
    return logs


def tap_band(screen, ui, robot: str, place: float) -> FigureDialog:
    """Tap the robot's band at 0..1 of the period; returns the dialog that opens."""
    bands = ui.find(ActivityBands)
    key = next(lane.key for lane in bands.lanes if lane.name == robot)
    bottom, top, _key = next(band for band in bands._places if band[2] == key)
    ui.tap_at(*bands.to_window(bands._left + bands._room * place, (bottom + top) / 2))
    settle(screen, ui)
    return ui.find(FigureDialog)


def span_of(bands: ActivityBands, robot: str, kind: str) -> tuple[float, float]:
    lane = next(lane for lane in bands.lanes if lane.name == robot)
    return next((span.start, span.end) for span in lane.spans if span.kind == kind)


def test_every_robot_has_a_band_that_fills_the_period(screen, ui):
    bands = ui.find(ActivityBands)
    assert [lane.name for lane in bands.lanes] == ["Aino", "Sisu", "Veikko"]
    for lane in bands.lanes:
        assert (lane.spans[0].start, lane.spans[-1].end) == pytest.approx((0, 1))
        assert all(first.end == second.start for first, second in pairwise(lane.spans))
    assert sorted(item.text for item in ui.find_all(ActivityLegend)) == sorted(
        ["Working", "Charging", "Ready", "Paused", "Stopped", "No answer", "No data"]
    )


def test_a_tap_shows_what_from_when_to_when_and_how_long(screen, ui):
    tap(screen, ui, ui.find(Segment, text="Today"))
    start, end = span_of(ui.find(ActivityBands), "Sisu", "charging")
    dialog = tap_band(screen, ui, "Sisu", (start + end) / 2)
    assert dialog.title == "Sisu: Charging"
    assert [(line.label, line.value) for line in dialog.rows] == [
        ("From", "10:06"),
        ("To", "11:30"),
        ("For", "1 h 24 min"),
    ]
    assert (screen.logs.mark.start, screen.logs.mark.end) == pytest.approx((start, end))
    ui.key(27)
    settle(screen, ui)
    assert screen.logs.mark is None


def test_a_current_span_has_no_end(screen, ui):
    tap(screen, ui, ui.find(Segment, text="Today"))
    dialog = tap_band(screen, ui, "Aino", 0.999)
    assert (dialog.title, dialog.rows[1].value) == ("Aino: Working", "ongoing")


def test_one_robot_alone_and_what_the_bands_mean(screen, ui):
    tap(screen, ui, ui.find(ChoiceChip, text="All robots"))
    tap(screen, ui, ui.find(OptionRow, ui.find(ChoiceDialog), text="Veikko"))
    assert [lane.name for lane in ui.find(ActivityBands).lanes] == ["Veikko"]
    tap(screen, ui, ui.find(IconButton, root=ui.find(RobotsPart)))
    dialog = ui.find(FigureDialog)
    assert dialog.text.startswith("Recorded at every poll")
    assert dialog.rows[0].label == "Veikko"
    assert "Working" in dialog.rows[0].note


def test_longer_periods_are_thinned_out_but_keep_every_robot(screen, ui):
    for period in ("30 days", "All"):
        tap(screen, ui, ui.find(Segment, text=period))
        lanes = ui.find(ActivityBands).lanes
        assert len(lanes) == 3
        assert all(0 < len(lane.spans) <= 600 for lane in lanes)
        assert all("error" in {span.kind for span in lane.spans} for lane in lanes if lane.name == "Aino")


def test_nothing_overlaps_or_is_too_small(screen, ui):
    assert checks.problems(screen.shell.navigator.screen("logs")) == []


def by_icon(ui, icon: str) -> IconButton:
    return ui.find(IconButton, ui.find(RobotsPart), icon=icon)


def test_the_bands_are_zoomed_and_moved_by_buttons(screen, ui):
    tap(screen, ui, ui.find(Segment, text="7 days"))
    bands = ui.find(ActivityBands)
    whole, days = [lane.spans for lane in bands.lanes], [tick.label for tick in bands.ticks]
    assert by_icon(ui, "magnify-minus-outline").x < by_icon(ui, "magnify-plus-outline").x
    assert by_icon(ui, "magnify-minus-outline").disabled
    assert by_icon(ui, "chevron-left").disabled
    for _ in range(3):
        tap(screen, ui, by_icon(ui, "magnify-plus-outline"))
    assert [lane.spans for lane in bands.lanes] != whole
    assert sum(tick.label.endswith(":00") for tick in bands.ticks) > 2  # less than a day
    assert [(lane.spans[0].start, lane.spans[-1].end) for lane in bands.lanes] == [pytest.approx((0, 1))] * 3
    assert by_icon(ui, "chevron-right").disabled  # it still ends with the period
    tap(screen, ui, by_icon(ui, "chevron-left"))
    assert not by_icon(ui, "chevron-right").disabled
    start, end = span_of(bands, "Sisu", "idle")
    assert tap_band(screen, ui, "Sisu", (start + end) / 2).title == "Sisu: Idle"
    ui.key(27)
    settle(screen, ui)
    for _ in range(3):
        tap(screen, ui, by_icon(ui, "magnify-minus-outline"))
    assert [tick.label for tick in bands.ticks] == days


def test_another_period_is_seen_whole(screen, ui):
    tap(screen, ui, ui.find(Segment, text="7 days"))
    tap(screen, ui, by_icon(ui, "magnify-plus-outline"))
    tap(screen, ui, ui.find(Segment, text="30 days"))
    assert by_icon(ui, "magnify-minus-outline").disabled
