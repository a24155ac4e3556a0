"""The page of figures in the Logs, by taps on real services at an invented plant on Friday 20 Nov 2026, 14:38."""

from __future__ import annotations

from pathlib import Path

import pytest

from app.domain.models import ReasonCode
from app.screens.logs.cards import FiguresPart, MoreCard, RunsList, RunsPart
from app.services.history.kpis import KpiFilter
from app.widgets.buttons import ChoiceChip, CommandButton, IconButton, Segment
from app.widgets.dialogs import ChoiceDialog
from app.widgets.figure_charts import RankRow, TrendRow
from app.widgets.figures import FigureCard, FigureDialog
from app.widgets.rows import OptionRow
from app.widgets.snackbar import Snackbar
from tests.support import month
from tests.ui import checks
from tests.ui.logbook import reset_logs, tap


@pytest.fixture
def screen(logs, ui):
    reset_logs(logs, ui, "figures")
    return logs


def texts(ui, kind) -> list[str]:
    return [row.label for row in sorted(ui.find_all(kind), key=lambda row: -row.to_window(0, row.y)[1])]


def test_the_figures_take_the_place_of_the_runs_and_the_cards_stay(screen, ui):
    assert not ui.find_all(RunsPart)
    assert len(ui.find_all(FigureCard)) == 5
    assert {card.title for card in ui.find_all(MoreCard)} == {
        "Reasons for failure",
        "Schedule adherence",
        "Starting and waiting",
        "Utilisation",
        "Duration of missions",
    }
    tap(screen, ui, ui.find(Segment, text="Runs"))
    assert ui.find_all(RunsList)
    assert not ui.find_all(FiguresPart)


def test_failures_are_ranked_and_their_shares_add_up(screen, container, ui):
    tap(screen, ui, ui.find(Segment, text="30 days"))
    start = next(day.day for day in screen.logs._figures.days)
    assert screen.logs._figures.first_day == start
    card = ui.find(MoreCard, title="Reasons for failure")
    rows = ui.find_all(RankRow, root=card)
    causes = screen.logs._more.causes
    assert sorted((row.value for row in rows), key=int) == sorted((str(cause.number) for cause in causes), key=int)
    assert "Failed to reach goal position …" in {row.label for row in rows}
    assert sum(row.share for row in rows) == pytest.approx(1)
    assert next(row.detail for row in rows if row.label == "Failed to reach goal position …").startswith("Dock ")
    assert sum(cause.number for cause in causes) == screen.logs._figures.facts.failed


def test_why_planned_runs_did_not_run_is_shown(screen, container, ui):
    rows = ui.find_all(RankRow, root=ui.find(MoreCard, title="Schedule adherence"))
    not_run = screen.logs._figures.facts.not_run
    assert [int(row.value) for row in rows] == list(not_run.values())
    assert list(not_run) == [ReasonCode.BATTERY_LOW]


def test_a_mission_is_shown_with_what_is_usual(screen, container, ui):
    rows = {row.mission: row for row in ui.find_all(TrendRow)}
    assert "As usual: 6 min 21 s" in rows["Deliver kits to line 2"].note
    assert len(rows["Deliver kits to line 2"].points) == 5
    expected = container.kpis.trends(KpiFilter(start=month.NOW.replace(day=13, hour=22, minute=0, second=0)))
    assert rows.keys() == {trend.mission for trend in expected}


@pytest.mark.parametrize(
    ("title", "beginning"),
    [
        ("Reasons for failure", "All failed runs by their reason"),
        ("Schedule adherence", "Planned starts that reached the robot"),
        ("Starting and waiting", "The newest 5,000"),
        ("Duration of missions", "The median duration"),
    ],
)
def test_a_tap_explains_a_figure(screen, ui, title, beginning):
    card = ui.find(MoreCard, title=title)
    column = next(above for above in _above(card) if hasattr(above, "scroll_to"))
    button = ui.find(IconButton, root=card)
    column.scroll_to(button, animate=False)
    ui.advance(0.3)
    tap(screen, ui, button)
    dialog = ui.find(FigureDialog)
    assert dialog.text.startswith(beginning)
    assert dialog.rows[-1].label == "Period"
    assert dialog.rows[-1].value == "Sat 14 Nov – Fri 20 Nov"


def _above(widget):
    while widget.parent is not None and widget.parent is not widget:
        widget = widget.parent
        yield widget


@pytest.mark.parametrize(
    ("choice", "words"), [("This shift", "06:38–14:38"), ("Yesterday", "Thu 19 Nov 00:00 – Fri 20 Nov 2026 00:00")]
)
def test_a_report_is_written_and_the_file_named(screen, ui, tmp_path, monkeypatch, choice, words):
    documents = tmp_path / "Documents"
    documents.mkdir()
    monkeypatch.setattr("app.services.files.exports.platformdirs.user_documents_path", lambda: documents)
    tap(screen, ui, ui.find(ChoiceChip, text="All robots"))
    tap(screen, ui, ui.find(OptionRow, ui.find(ChoiceDialog), text="Aino"))
    tap(screen, ui, ui.find(CommandButton, text="Report"))
    dialog = ui.find(ChoiceDialog)
    assert dialog.title == "Shift report, Aino"
    tap(screen, ui, ui.find(OptionRow, dialog, text=choice))
    text = ui.find(Snackbar).text
    assert text.startswith(f"Report written to {documents}")
    page = Path(text.removeprefix("Report written to ")).read_text(encoding="utf-8")
    assert words in page
    assert "Aino" in page
    assert "Veikko" not in page
    assert not screen.logs.reporting
    tap(screen, ui, ui.find(root=ui.find(Snackbar), text="Show"))  # a kiosk has nothing to open a page with
    shown = ui.find(FigureDialog)
    assert (shown.title, words in shown.text.replace(" · Aino", ""), shown.rows[0].label) == (
        "Shift report",
        True,
        "Success rate",
    )
    assert "Aino" in [row.label for row in shown.rows]


def test_a_report_that_cannot_be_written_says_why_in_one_sentence(screen, ui, monkeypatch):
    def no_room(*_where, **_how):
        raise OSError(28, "No space left on device")

    monkeypatch.setattr("app.services.files.exports.draft_of", no_room)
    tap(screen, ui, ui.find(CommandButton, text="Report"))
    tap(screen, ui, ui.find(OptionRow, ui.find(ChoiceDialog), text="Today"))
    assert "No space left on device" in ui.find(Snackbar).text
    assert not ui.find(CommandButton, text="Report").busy


def test_nothing_overlaps_or_is_too_small(screen, ui):
    assert checks.problems(screen.shell.navigator.screen("logs")) == []
