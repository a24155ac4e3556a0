"""Charts: steps, lines, fillings and gaps."""

from __future__ import annotations

from datetime import date, timedelta
from itertools import pairwise

import pytest
from kivy.graphics import Rectangle, SmoothLine
from kivy.metrics import sp

from app.screens.logs import key_figures
from app.screens.logs.key_figures import Card, DayBar, RobotBar
from app.screens.scheduler.timeline import Lane
from app.services.history.figures import Facts
from app.widgets import load_kv
from app.widgets.chart import Sparkline, glyphs, nice_step
from app.widgets.charts import RobotBars, StackedBars
from app.widgets.figure_charts import FigureCard
from app.widgets.lanes import Lanes
from app.widgets.robot_map import RobotMap
from tests.ui.drawing import instructions


def test_grid_steps_are_round_and_few():
    assert [nice_step(top) for top in (1, 3, 7, 88, 140, 999, 4200)] == [1, 1, 2, 25, 50, 250, 2000]
    for top in range(1, 3000, 7):
        assert 1 <= top // nice_step(top) + 1 <= 5


def test_a_share_that_hardly_changes_draws_no_mountain(ui):
    line = ui.show(Sparkline(values=[0.97, 0.98, 0.96, 0.97], least_span=0.1), (64, 50))
    low, high = line.scale()
    assert high - low == pytest.approx(0.1)
    assert 0 <= low <= 0.96 <= 0.98 <= high <= 1.0001
    [points] = line.runs(line.values)
    assert max(y for _x, y in points) - min(y for _x, y in points) < 10


def test_gaps_stay_open_and_a_single_day_is_no_line(ui):
    line = ui.show(Sparkline(values=[20, 21, None, 19, 20, 9]), (64, 50))
    assert line.scale() == (0, 21)
    assert [len(points) for points in line.runs(line.values)] == [2, 3]
    line.values = [None, None, 6]
    ui.advance()
    assert not line.canvas.children


def test_the_period_before_has_the_same_scale_and_lies_below(ui):
    line = ui.show(Sparkline(values=[1, 2], before=[4, 3]), (64, 50))
    assert line.scale() == (0, 4)
    before, values = [one for one in instructions(line.canvas) if isinstance(one, SmoothLine)]
    assert before.points[1] > values.points[1]


def test_a_figure_shows_its_value_with_the_unit_and_how_it_has_changed(ui):
    load_kv("logs/figures")
    value = "98.1[size=18sp] %[/size]"
    card = ui.show(FigureCard(item=Card("success", "Success", value, "▼ 1.9", (1, 2, 3))), (260, 200))
    assert {"Success", value, "▼ 1.9"} <= set(ui.texts(card))
    assert ui.find(Sparkline, card).width > 200


@pytest.mark.parametrize(
    "chart",
    [
        lambda: Lanes(),
        lambda: Lanes(lanes=[Lane("Aino")]),
        lambda: StackedBars(),
        lambda: StackedBars(days=[DayBar(date(2026, 11, 16), "Mon", "16 Nov", 0, 0, 0)]),
        lambda: RobotBars(),
        lambda: RobotBars(rows=[RobotBar(1, "Aino", "0 %", 0, 0), RobotBar(2, "Sisu", "100 %", 1, 0.5)]),
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


@pytest.mark.parametrize(("days", "width"), [(1, 400), (2, 400), (7, 560), (7, 300), (30, 560), (30, 140)])
def test_days_are_named_up_to_today_and_no_name_lies_on_another(ui, days, width):
    found = [date(2026, 11, 20) - timedelta(days=ago) for ago in reversed(range(days))]
    shown = key_figures.outcome_days([Facts(completed=9, failed=1, day=day) for day in found])
    chart = ui.show(StackedBars(days=shown), (width, 160))
    words = {glyphs(said, sp(14), "Roboto"): said for day in shown for said in (day.date, day.label)}
    below = sorted(
        (one.pos[0], one.pos[0] + one.size[0], words[one.texture])
        for one in instructions(chart.canvas)
        if isinstance(one, Rectangle) and one.texture in words and one.pos[1] < chart.y + 18
    )
    assert below[-1][2] == "Today"
    assert all(end < start for (_, end, _), (start, _, _) in pairwise(below))
    assert below[-1][1] <= chart.right
    assert len(below) == (days if days <= 7 and width >= 400 else len(below))


def test_a_tap_on_a_day_or_a_robot_names_it_and_keys_reach_them(ui):
    chart = ui.show(
        RobotBars(rows=[RobotBar(7, "Aino", "46 %", 0.46, 0.1), RobotBar(8, "Sisu", "1 %", 0, 0)]), (400, 96)
    )
    tapped = []
    chart.bind(on_part=lambda _chart, key: tapped.append(key))
    ui.tap_at(*chart.to_window(200, chart.top - 20))
    assert tapped == [7]
    seat = chart.seats()[1]
    seat.dispatch("on_release")
    assert tapped == [7, 8]
    assert chart.seats()[1] is seat
