"""The key figures in the Logs, by taps on real services at an invented plant on Friday 20 Nov 2026, 14:38."""

from __future__ import annotations

from datetime import UTC, date, datetime, timedelta
from pathlib import Path

import pytest

from app.domain.execution import State
from app.screens.logs.cards import RunsList
from app.services.history.kpis import KpiFilter
from app.widgets.buttons import ChoiceChip, CommandButton, MenuChip
from app.widgets.charts import RobotBars, StackedBars
from app.widgets.choices import ChoiceSheet, OptionRow
from app.widgets.figure_charts import CauseRow, FigureCard, FigureSheet, TrendRow
from app.widgets.snackbar import Snackbar
from tests.ui import checks
from tests.ui.logbook import choose_tab, reset_logs, runs_of, settle, tap

WEEK = KpiFilter(start=datetime(2026, 11, 13, 22, tzinfo=UTC))  # Saturday's midnight there


@pytest.fixture
def screen(logs, ui):
    reset_logs(logs, ui, "figures")
    return logs


def choose(app, ui, chip: str, option: str) -> None:
    tap(app, ui, ui.find(MenuChip, text=chip))
    tap(app, ui, ui.find(OptionRow, ui.find(ChoiceSheet), title=option))


def tap_part(app, ui, chart, key) -> None:
    """Tap the part of a chart, wherever on the page it is."""
    page = next(above for above in checks.parents(chart) if hasattr(above, "scroll_to"))
    page.scroll_to(chart, animate=False)
    ui.advance(0.3)
    x, y, width, height = next(box[:4] for box in chart.boxes if box[4] == key)
    ui.tap_at(*chart.to_window(x + width / 2, y + height / 2))
    settle(app, ui)


def test_figures_take_the_place_of_the_runs(screen, ui):
    assert not ui.find_all(RunsList)
    assert [card.item.label for card in ui.find_all(FigureCard)] == [
        "Success",
        "Duration",
        "Missions",
        "In use",
        "On time",
    ]
    choose_tab(screen, ui, "runs")
    assert not ui.find_all(FigureCard)


def test_a_figure_is_set_against_as_long_before_if_the_history_reaches_so_far(screen, container, ui):
    now = container.clock.now()
    before = container.kpis.facts(KpiFilter(datetime(2026, 11, 6, 22, tzinfo=UTC), now - timedelta(days=7)))
    after = container.kpis.facts(WEEK)
    points = (after.value("success") - before.value("success")) * 100
    card = ui.find(FigureCard, label="Success")
    assert card.item.change == f"{'▲' if points > 0 else '▼'} {abs(points):.1f} vs. last week"
    assert len({card.height for card in ui.find_all(FigureCard)}) == 1
    choose(screen, ui, "7 days", "30 days")
    assert {card.item.change for card in ui.find_all(FigureCard)} == {""}  # 30 days of history are not 60


def test_figures_are_of_the_period_when_the_runs_of_one_day_were_looked_at(screen, ui):
    before = [(card.item.label, card.item.value) for card in ui.find_all(FigureCard)]
    screen.logs.figures.show_runs(day=date(2026, 11, 20))
    settle(screen, ui)
    choose_tab(screen, ui, "figures")
    assert [(card.item.label, card.item.value) for card in ui.find_all(FigureCard)] == before


def test_a_figure_says_what_it_means(screen, ui):
    tap(screen, ui, ui.find(FigureCard, label="On time"))
    dialog = ui.find(FigureSheet)
    assert dialog.text.startswith("Planned starts that reached the robot")
    assert {"Planned", "Ran"} <= {line.title for line in dialog.rows}
    assert (dialog.rows[-1].title, dialog.rows[-1].meta) == ("Period", "Sat 14 Nov – Fri 20 Nov")
    ui.key(27)
    assert not ui.find_all(FigureSheet)


def test_use_is_one_figure_wherever_it_is_shown(screen, ui):
    """The card, the bar and the explanation agree, for all robots together and for one."""
    bars = ui.find(RobotBars).rows
    low, high = min(bar.busy for bar in bars), max(bar.busy for bar in bars)
    whole = float(ui.find(FigureCard, label="In use").item.value.partition("[")[0])
    assert low * 100 - 1 <= whole <= high * 100 + 1
    choose(screen, ui, "All robots", "Sisu")
    [bar] = ui.find(RobotBars).rows
    assert ui.find(FigureCard, label="In use").item.value.partition("[")[0] == bar.share.partition(" ")[0]
    tap(screen, ui, ui.find(FigureCard, label="In use"))
    assert [line.title for line in ui.find(FigureSheet).rows] == ["Sisu", "Period"]


# ---------------------------------------------------------------------- to the runs
def test_a_cause_leads_to_its_runs(screen, ui):
    choose(screen, ui, "7 days", "30 days")
    assert sum(cause.number for cause in screen.logs.figures._facts.causes) == screen.logs.figures._facts.facts.failed
    row = ui.find_all(CauseRow)[0]
    number, label = int(row.item.number), row.item.label
    tap(screen, ui, row)
    assert label in [chip.text for chip in ui.find_all(ChoiceChip, icon="close")]
    assert len(runs_of(screen)) == number
    assert {run.state for run in screen.logs.facts.rows} == {State.FAILED}


def test_a_day_leads_to_its_runs(screen, ui):
    chart = ui.find(StackedBars)
    thursday = next(day for day in chart.days if day.key == date(2026, 11, 19))
    tap_part(screen, ui, chart, thursday.key)
    assert [item.title for item in screen.logs.rows if not item.opens] == ["Yesterday"]
    assert sum(run.state is State.COMPLETED for run in screen.logs.facts.rows) == thursday.completed


def test_a_robot_leads_to_its_runs(screen, ui):
    chart = ui.find(RobotBars)
    sisu = next(bar.key for bar in chart.rows if bar.robot == "Sisu")
    tap_part(screen, ui, chart, sisu)
    assert {item.place for item in runs_of(screen)} == {"Sisu"}


def test_a_mission_leads_to_its_runs_and_is_shown_with_what_is_usual(screen, container, ui):
    rows = {row.item.mission: row for row in ui.find_all(TrendRow)}
    assert rows.keys() == {trend.mission for trend in container.kpis.trends(WEEK)}
    row = rows["Deliver kits to line 2"]
    assert (row.item.value, len(row.item.points)) == ("6 min", 5)
    assert row.item.band is not None
    next(above for above in checks.parents(row) if hasattr(above, "scroll_to")).scroll_to(row, animate=False)
    ui.advance(0.3)
    tap(screen, ui, row)
    assert {item.title for item in runs_of(screen)} == {"Deliver kits to line 2"}


# ---------------------------------------------------------------------- the shift report
@pytest.mark.parametrize(
    ("choice", "words"), [("This shift", "06:38–14:38"), ("Yesterday", "Thu 19 Nov 00:00 – Fri 20 Nov 2026 00:00")]
)
def test_a_report_is_written_and_the_file_named(screen, ui, tmp_path, monkeypatch, choice, words):
    documents = tmp_path / "Documents"
    documents.mkdir()
    monkeypatch.setattr("app.services.files.exports.platformdirs.user_documents_path", lambda: documents)
    tap(screen, ui, ui.find(MenuChip, text="All robots"))
    tap(screen, ui, ui.find(OptionRow, ui.find(ChoiceSheet), title="Aino"))
    tap(screen, ui, ui.find(CommandButton, text="Shift report"))
    dialog = ui.find(ChoiceSheet)
    assert dialog.title == "Shift report, Aino"
    tap(screen, ui, ui.find(OptionRow, dialog, title=choice))
    text = ui.find(Snackbar).text
    assert text.startswith(f"Report written to {documents}")
    page = Path(text.removeprefix("Report written to ")).read_text(encoding="utf-8")
    assert words in page
    assert "Aino" in page
    assert "Veikko" not in page
    assert not screen.logs.files.reporting
    tap(screen, ui, ui.find(root=ui.find(Snackbar), text="Show"))  # a kiosk has nothing to open a page with
    shown = ui.find(FigureSheet)
    assert (shown.title, words in shown.text.replace(" · Aino", ""), shown.rows[0].title) == (
        "Shift report",
        True,
        "Success rate",
    )
    assert "Aino" in [row.title for row in shown.rows]


def test_a_report_that_cannot_be_written_says_why_in_one_sentence(screen, ui, monkeypatch):
    def no_room(*_where, **_how):
        raise OSError(28, "No space left on device")

    monkeypatch.setattr("app.services.files.exports.draft_of", no_room)
    tap(screen, ui, ui.find(CommandButton, text="Shift report"))
    tap(screen, ui, ui.find(OptionRow, ui.find(ChoiceSheet), title="Today"))
    assert "No space left on device" in ui.find(Snackbar).text
    assert not ui.find(CommandButton, text="Shift report").busy
