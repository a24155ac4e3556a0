"""Charts: steps, lines, fillings and gaps."""

from __future__ import annotations

from datetime import date, timedelta
from itertools import pairwise

import pytest
from kivy.graphics import Mesh, Rectangle, SmoothLine
from kivy.metrics import sp

from app.screens.logs import kpi_view
from app.screens.logs.kpi_view import DayBar, RobotBar
from app.screens.scheduler.timeline import Lane
from app.services.history.figures import Facts
from app.widgets.chart import Sparkline, glyphs, nice_step
from app.widgets.charts import RobotBars, StackedBars
from app.widgets.display import KpiCard
from app.widgets.robot_map import RobotMap
from app.widgets.timeline import Timeline
from tests.ui.drawing import instructions


def test_grid_steps_are_round_and_few():
    assert [nice_step(top) for top in (1, 3, 7, 88, 140, 999, 4200)] == [1, 1, 2, 25, 50, 250, 2000]
    for top in range(1, 3000, 7):
        assert 1 <= top // nice_step(top) + 1 <= 5


def test_a_share_that_hardly_changes_draws_no_mountain_and_is_not_filled(ui):
    line = ui.show(Sparkline(values=[0.97, 0.98, 0.96, 0.97], least_span=0.1), (64, 50))
    low, high = line.scale()
    assert high - low == pytest.approx(0.1)
    assert 0 <= low <= 0.96 <= 0.98 <= high <= 1.0001
    assert not [one for one in instructions(line.canvas) if isinstance(one, Mesh)]
    [points] = line.runs()
    assert max(y for _x, y in points) - min(y for _x, y in points) < 10


def test_a_day_that_has_not_ended_does_not_flatten_those_before_it(ui):
    """At noon a share may be far from what it will be."""
    line = ui.show(Sparkline(values=[0.95, 0.99, 0.90, 0.97, 0.40], least_span=0.1), (64, 50))
    [points] = line.runs()
    assert max(y for _x, y in points[:-1]) - min(y for _x, y in points[:-1]) > 30
    assert points[-1][1] == min(y for _x, y in points)
    assert line.y <= points[-1][1] <= line.top


def test_fillings_begin_at_zero_and_gaps_stay_open(ui):
    line = ui.show(Sparkline(values=[20, 21, None, 19, 20, 9]), (64, 50))
    assert line.scale() == (0, 21)
    first, second = line.runs()
    assert (len(first), len(second)) == (2, 3)
    assert len([one for one in instructions(line.canvas) if isinstance(one, Mesh)]) == 2  # and nothing below today's


def test_today_has_not_ended_and_a_single_day_is_no_line(ui):
    line = ui.show(Sparkline(values=[5, 6, 2]), (64, 50))
    solid, *dashes = [one for one in instructions(line.canvas) if isinstance(one, SmoothLine)]
    assert (len(solid.points), len(dashes)) == (4, 3)
    assert dashes[0].points[:2] == solid.points[-2:]
    line.values = [None, None, 6]
    ui.advance()
    assert not line.canvas.children


@pytest.mark.parametrize("value", ["95.6", "26 min 56 s", "1"])
def test_every_figure_has_its_line_at_the_same_width(ui, value):
    card = ui.show(KpiCard(label="Figure", value=value, history=[1, 2, 3]), (320, 120))
    assert ui.find(Sparkline, card).width == 64


@pytest.mark.parametrize(
    "chart",
    [
        lambda: Timeline(),
        lambda: Timeline(lanes=[Lane("Aino")]),
        lambda: StackedBars(),
        lambda: StackedBars(days=[DayBar("Mo", 0, 0, 0, 0)]),
        lambda: RobotBars(),
        lambda: RobotBars(rows=[RobotBar("Aino", "0 %", "0 min", 0, 0), RobotBar("Sisu", "100 %", "8 h", 1, 0.5)]),
        lambda: Sparkline(),
        lambda: Sparkline(values=[None, None]),
        lambda: Sparkline(values=[5]),
        lambda: Sparkline(values=[5, 5, None, 5]),
        lambda: RobotMap(),
        lambda: RobotMap(at=[0.5, 0.5], path=[(0.5, 0.5), (0.5, 0.5)]),
    ],
)
def test_charts_draw_whatever_there_is(ui, chart):
    widget = ui.show(chart(), (400, 120))
    drawn = len(widget.canvas.children)
    widget.size = 2, 2
    ui.advance()
    assert len(widget.canvas.children) <= drawn


@pytest.mark.parametrize(
    ("days", "width", "dates"),
    [
        (1, 400, ["Fri 20 Nov"]),
        (2, 400, ["Thu 19 Nov", "Fri 20 Nov"]),
        (7, 560, ["Sat 14 Nov", "Fri 20 Nov"]),
        (30, 560, ["Thu 22 Oct", "Fri 20 Nov"]),
        (30, 280, ["Thu 22 Oct", "Fri 20 Nov"]),
        (30, 140, ["Fri 20 Nov"]),
    ],
)
def test_outcomes_per_day_begin_and_end_with_a_date_and_no_day_lies_on_another(ui, days, width, dates):
    found = [date(2026, 11, 20) - timedelta(days=ago) for ago in reversed(range(days))]
    shown = kpi_view.outcome_days([Facts(completed=9, failed=1, day=day) for day in found])
    chart = ui.show(StackedBars(days=shown), (width, 160))
    words = {}
    for day in shown:
        for said in (day.date, day.label):
            words |= {glyphs(said, sp(14), font): said for font in ("Roboto", "RobotoMedium")}
    below = [
        one
        for one in instructions(chart.canvas)
        if isinstance(one, Rectangle) and one.texture in words and one.pos[1] < chart.y + 18
    ]
    spans = sorted((one.pos[0], one.pos[0] + one.size[0]) for one in below)
    assert [
        said
        for said in map(words.get, (one.texture for one in sorted(below, key=lambda one: one.pos[0])))
        if " " in said
    ] == dates
    assert all(end < start for (_start, end), (start, _end) in pairwise(spans))
    assert spans[-1][1] <= chart.right
    if days > 2 and width > 200:
        assert len(spans) > 2
