"""The Logs as an operator uses them: taps and typing on real services, at an invented plant on Friday 20 Nov 2026, 14:38."""

from __future__ import annotations

import codecs
import csv
import threading
from dataclasses import replace
from datetime import UTC, datetime, timedelta
from pathlib import Path

import pytest
from kivy.core.window import Window

from app.domain.models import State
from app.domain.robot import MissionParameter
from app.screens.logs.cards import RunsList
from app.services.files.history_export import COLUMNS
from app.services.files.places import Place, PlaceKind
from app.services.history.kpis import KpiFilter
from app.widgets.buttons import ChoiceChip, CommandButton, IconButton, Segment
from app.widgets.dialogs import ChoiceDialog, ConfirmDialog
from app.widgets.display import CardHead
from app.widgets.fields import SearchField
from app.widgets.figures import FigureCard, FigureDialog
from app.widgets.frame import Frame
from app.widgets.rows import LogRow, OptionRow, StoryStep
from app.widgets.snackbar import Snackbar
from app.widgets.text import Note
from tests.support.home_facts import FAILED, READY
from tests.ui import checks
from tests.ui.logbook import failures, reset_logs, settle, tap
from tests.ui.whole_app import standing


@pytest.fixture
def screen(logs, ui):
    reset_logs(logs, ui)
    return logs


def tick(app, ui, chip: str, *options: str) -> None:
    """Tap a filter and, in the list that opens, some options; then the button that shows them."""
    tap(app, ui, ui.find(ChoiceChip, text=chip))
    for option in options:
        tap(app, ui, ui.find(OptionRow, ui.find(ChoiceDialog), text=option))
    tap(app, ui, ui.find(CommandButton, ui.find(ChoiceDialog), text="Show"))


def export_button(ui) -> CommandButton:
    return ui.find(CommandButton, icon="file-export-outline")


def outcomes(app) -> set[str]:
    return {row.outcome for row in app.logs.rows}


def rows(ui) -> list[LogRow]:
    """Those in sight, from the top."""
    seen = [row for row in ui.find_all(LogRow) if checks.visible_area(row, checks.parents(row))]
    return sorted(seen, key=lambda row: -row.to_window(0, row.y)[1])


# ---------------------------------------------------------------------- what is seen
def test_five_figures_with_their_counts_and_what_the_charts_show(screen, container, ui):
    cards = ui.find_all(FigureCard)
    assert [card.label for card in cards] == [
        "Success rate",
        "Mean duration",
        "Missions per day",
        "Utilisation",
        "Schedule adherence",
    ]
    kpis = container.kpis.facts(KpiFilter(start=datetime(2026, 11, 13, 22, tzinfo=UTC)))  # Saturday's midnight there
    assert cards[0].note == f"{kpis.completed} of {kpis.completed + kpis.failed} ended runs"
    assert [bar.robot for bar in screen.logs.utilisation] == ["Aino", "Sisu", "Veikko"]
    assert [day.label for day in screen.logs.days] == ["Sa", "Su", "Mo", "Tu", "We", "Th", "Fr"]


def test_runs_are_listed_newest_first_with_their_reasons(screen, ui):
    _queued, _waiting, first, second, *_rest = rows(ui)
    assert (first.outcome, first.mission, first.robot, first.trigger, first.reason) == (
        "Working",
        "Deliver kits to line 2",
        "Aino",
        "Run now",
        "Running on the robot",
    )
    assert (second.outcome, second.reason) == ("Not run", "Battery 12 % stayed under 30 % until 14:30")


def test_a_row_opens_its_story_and_closes_it(screen, ui):
    row = rows(ui)[3]
    tap(screen, ui, row)
    assert [step.label for step in ui.find_all(StoryStep)] == ["Planned", "Not run"]
    row = next(row for row in rows(ui) if row.opened)
    ui.tap_at(*row.to_window(row.center_x, row.top - 24))
    settle(screen, ui)
    assert not ui.find_all(StoryStep)


def test_a_story_that_finds_no_room_where_it_was_opened_comes_into_sight(screen, ui):
    last = rows(ui)[-1]
    x, y, right, top = checks.visible_area(last, checks.parents(last))
    ui.tap_at((x + right) / 2, (y + top) / 2)
    settle(screen, ui)
    ui.advance(0.6)
    opened = next(row for row in ui.find_all(LogRow) if row.opened)
    assert opened.key == last.key
    assert opened.to_window(0, opened.y)[1] >= ui.find(RunsList).to_window(0, ui.find(RunsList).y)[1]
    assert "queue item" in opened.message.casefold()


def test_a_figure_says_what_it_means(screen, ui):
    tap(screen, ui, ui.find(FigureCard, label="Schedule adherence"))
    dialog = ui.find(FigureDialog)
    assert dialog.text.startswith("Planned starts that reached the robot")
    assert {"Planned", "Ran"} <= {line.label for line in dialog.rows}
    ui.key(27)
    assert not ui.find_all(FigureDialog)


def test_its_parts_stand_on_a_line_of_their_own_above_the_filters(screen, ui):
    parts, filters = (
        [ui.find(Segment, text=word) for word in words] for words in (("Runs", "Figures", "Robots"), ("Today", "All"))
    )
    assert min(part.to_window(0, part.y)[1] for part in parts) >= max(one.to_window(0, one.top)[1] for one in filters)


# ---------------------------------------------------------------------- filters
def test_a_longer_period_has_more_runs_and_other_figures(screen, ui):
    week = screen.logs._facts.count
    tap(screen, ui, ui.find(Segment, text="30 days"))
    assert screen.logs._facts.count > week
    assert len(screen.logs.days) == 30
    tap(screen, ui, ui.find(Segment, text="Today"))
    assert screen.logs._facts.count < week
    assert len(screen.logs.days) == 7  # a history needs more than one day
    ui.tap(ui.find(Segment, text="Figures"))
    ui.advance(0.2)
    assert ui.find(CardHead, title="Outcomes per day").note == "7 days"


def test_a_figure_is_set_against_as_long_before_if_the_history_reaches_so_far(screen, container, ui):
    cards = {card.label: card for card in ui.find_all(FigureCard)}
    now, week = container.clock.now(), timedelta(days=7)
    before = container.kpis.facts(KpiFilter(datetime(2026, 11, 6, 22, tzinfo=UTC), now - week))
    after = container.kpis.facts(KpiFilter(datetime(2026, 11, 13, 22, tzinfo=UTC)))
    points = f"{abs(after.value('success') - before.value('success')) * 100:.1f} points against the 7 days before"
    assert cards["Success rate"].change == ("+" if after.value("success") > before.value("success") else "−") + points
    assert len({card.height for card in cards.values()}) == 1
    tap(screen, ui, ui.find(Segment, text="30 days"))
    assert {card.change for card in ui.find_all(FigureCard)} == {""}  # 30 days of history are not 60


def test_a_period_longer_than_the_history_says_when_the_history_begins(screen, ui):
    assert not [text for text in ui.texts() if text.startswith("Runs kept")]
    tap(screen, ui, ui.find(Segment, text="All"))
    assert "Runs kept since Thu 22 Oct" in ui.texts()


def test_figures_say_that_they_count_what_the_list_omits(screen, ui):
    tap(screen, ui, ui.find(Segment, text="All"))
    tick(screen, ui, "Trigger", "Run now")
    assert "Figures also count the runs left out · Runs kept since Thu 22 Oct" in ui.texts()
    ui.tap(ui.find(Segment, text="Figures"))  # no such filters exist, while readings are still under way
    assert "Runs kept since Thu 22 Oct" in ui.texts()


def test_one_robot_can_be_looked_at_alone(screen, ui):
    tap(screen, ui, ui.find(ChoiceChip, text="All robots"))
    tap(screen, ui, ui.find(OptionRow, ui.find(ChoiceDialog), text="Sisu"))
    assert {row.robot for row in screen.logs.rows} == {"Sisu"}
    assert [bar.robot for bar in screen.logs.utilisation] == ["Sisu"]
    tap(screen, ui, ui.find(FigureCard, label="Utilisation"))
    assert [line.label for line in ui.find(FigureDialog).rows] == ["Sisu", "Period"]


def test_utilisation_is_one_figure_wherever_it_is_shown(screen, ui):
    """The card, the bar and the explanation agree, for all robots together and for one."""
    bars = screen.logs.utilisation
    low, high = min(bar.busy for bar in bars), max(bar.busy for bar in bars)
    whole = float(ui.find(FigureCard, label="Utilisation").value.partition("[")[0])
    assert low * 100 - 1 <= whole <= high * 100 + 1
    tap(screen, ui, ui.find(ChoiceChip, text="All robots"))
    tap(screen, ui, ui.find(OptionRow, ui.find(ChoiceDialog), text="Sisu"))
    [bar] = screen.logs.utilisation
    assert ui.find(FigureCard, label="Utilisation").value.partition("[")[0] == bar.share.partition(" ")[0]


def test_outcomes_missions_and_triggers_filter_the_list_and_one_tap_clears_them(screen, ui):
    everything = screen.logs._facts.count
    tick(screen, ui, "Outcome", "Failed", "Not run")
    assert outcomes(screen) == {"Failed", "Not run"}
    assert ui.find_all(ChoiceChip, text="2 outcomes", active=True)
    tick(screen, ui, "Trigger", "Run now")
    assert {row.trigger for row in screen.logs.rows} == {"Run now"}
    tap(screen, ui, ui.find(ChoiceChip, text="Mission"))
    tap(screen, ui, ui.find(OptionRow, ui.find(ChoiceDialog), text="Bring pallet to dock"))
    assert [(row.outcome, row.mission) for row in screen.logs.rows] == [("Failed", "Bring pallet to dock")]
    assert screen.logs.count_text == "1 found, newest first"
    tap(screen, ui, ui.find(IconButton, icon="filter-remove-outline"))
    assert screen.logs._facts.count == everything


def test_a_search_that_comes_back_with_its_words_opens_no_keyboard(screen, ui):
    tap(screen, ui, ui.find(IconButton, icon="magnify"))
    assert ui.find(SearchField).focus
    ui.type(ui.find(SearchField), "pallet")
    settle(screen, ui)
    for part in ("figures", "runs"):
        screen.logs.choose_part(part)
        settle(screen, ui)
    assert (ui.find(SearchField).text, ui.find(SearchField).focus) == ("pallet", False)


def test_typing_searches_and_closing_the_search_clears_it(screen, ui):
    tap(screen, ui, ui.find(IconButton, icon="magnify"))
    ui.type(ui.find(SearchField), "pallet")
    settle(screen, ui)
    assert {row.mission for row in screen.logs.rows} == {"Bring pallet to dock"}
    tap(screen, ui, ui.find(IconButton, icon="magnify"))
    assert len({row.mission for row in screen.logs.rows}) > 1


@pytest.mark.parametrize(
    ("typed", "reason"),
    [("stayed under", "Battery"), ("DOCK 3", "The robot ended it: Failed to reach goal position 'Dock 3'")],
)
def test_a_search_finds_reasons_too(screen, ui, typed, reason):
    tap(screen, ui, ui.find(IconButton, icon="magnify"))
    ui.type(ui.find(SearchField), typed)
    settle(screen, ui)
    assert screen.logs.rows
    assert all(row.reason.startswith(reason) for row in screen.logs.rows)


@pytest.mark.usefixtures("put_back")
def test_a_search_finds_the_position_that_a_row_names(screen, container, ui):
    """The history stores the robots' value; their name for it is shown."""
    guid = "a1c4e008-5d0f-11ef-93c1-0001297b6e20"
    run = replace(
        container.history.page(failures(container)).rows[0],
        id=None,
        token="to-dock",
        queue_id=None,
        parameters={"goal": guid},
    )
    added = container.db.write(lambda c: container.repositories.executions.add(c, run))
    screen.shell.mission_names.take(
        "m-1", (MissionParameter("goal", "Position", choices=((guid, "Cold store"),), sets="position"),)
    )
    tap(screen, ui, ui.find(IconButton, icon="magnify"))
    ui.type(ui.find(SearchField), "COLD")
    settle(screen, ui)
    assert [(row.key, row.mission) for row in screen.logs.rows] == [(added.id, f"{run.mission} · Cold store")]


@pytest.mark.usefixtures("put_back")
def test_a_search_finds_a_position_whose_name_is_learnt_after_it_was_typed(screen, container, ui):
    """As after a start of the app, when the robots are asked for the names of what is shown."""
    guid = "b2d5f119-5d0f-11ef-93c1-0001297b6e20"
    run = replace(
        container.history.page(failures(container)).rows[0],
        id=None,
        token="to-ramp",
        queue_id=None,
        parameters={"goal": guid},
    )
    container.db.write(lambda c: container.repositories.executions.add(c, run))
    tap(screen, ui, ui.find(IconButton, icon="magnify"))
    ui.type(ui.find(SearchField), "ramp")
    settle(screen, ui)
    assert not screen.logs.rows
    screen.logs._given._take(
        "m-2", (MissionParameter("goal", "Position", choices=((guid, "North ramp"),), sets="position"),)
    )
    settle(screen, ui)
    assert [row.mission for row in screen.logs.rows] == [f"{run.mission} · North ramp"]


def test_where_nothing_is_found_the_screen_says_what_to_do(screen, ui):
    tick(screen, ui, "Outcome", "Not run")
    tick(screen, ui, "Trigger", "Idle")
    assert {"Nothing found", "Choose a longer period, or fewer filters."} <= set(ui.texts())
    assert export_button(ui).disabled


# ---------------------------------------------------------------------- live, paged, exported


def test_the_story_asked_for_by_another_screen_is_shown(screen, container, ui):
    old = container.history.page(failures(container)).rows[-1]
    screen.shell.go("home")
    screen.shell.go("logs", execution_id=old.id)
    settle(screen, ui)
    assert screen.logs.opened_run == old.id
    ui.wait(lambda: [row.key for row in ui.find_all(LogRow) if row.opened] == [old.id])
    screen.shell.go("logs", execution_id=10**6)
    settle(screen, ui)
    assert ui.find(Snackbar).text == "This run is no longer in the history"


def test_the_whole_story_is_seen_in_a_low_window_below_a_banner(screen, container, ui):
    old, before = container.history.page(failures(container)).rows[-1], Window.size
    Window.size = (1024, 600)
    frame = ui.find(Frame)
    frame.alarm, frame.alarm_note = "Aino is stopped", "Since 14:36"
    try:
        settle(screen, ui)
        screen.shell.go("logs", execution_id=old.id)
        settle(screen, ui)
        ui.wait(lambda: [row.key for row in ui.find_all(LogRow) if row.opened] == [old.id])
        ui.advance(1)
        row = next(row for row in ui.find_all(LogRow) if row.opened)
        assert checks.is_seen(row)
    finally:
        frame.alarm = frame.alarm_note = ""
        Window.size = before
        settle(screen, ui)


def test_a_link_to_a_run_leaves_no_tab_filter_or_search_in_its_way(screen, container, ui):
    old = container.history.page(failures(container)).rows[-1]
    tap(screen, ui, ui.find(IconButton, icon="magnify"))
    ui.type(ui.find(SearchField), "charger")
    settle(screen, ui)
    tick(screen, ui, "Outcome", "Not run")
    tap(screen, ui, ui.find(Segment, text="Robots"))
    screen.shell.go("home")
    screen.shell.go("logs", execution_id=old.id)
    settle(screen, ui)
    ui.wait(lambda: [row.key for row in ui.find_all(LogRow) if row.opened] == [old.id])
    assert not ui.find_all(SearchField)
    assert not screen.logs.is_filtered


def test_a_link_to_the_runs_as_a_whole_shows_them_unfiltered(screen, ui):
    everything = screen.logs._facts.count
    tick(screen, ui, "Outcome", "Not run")
    tap(screen, ui, ui.find(Segment, text="Figures"))
    screen.shell.go("logs", unfiltered=True)
    settle(screen, ui)
    assert len(rows(ui)) > 1
    assert screen.logs._facts.count == everything


def test_a_story_comes_into_sight_however_long_its_list_takes_to_be_read(screen, container, ui, monkeypatch):
    tap(screen, ui, ui.find(Segment, text="Today"))  # which does not have it
    old = container.history.page(failures(container)).rows[-1]
    page, may_read = container.history.page, threading.Event()
    monkeypatch.setattr(container.history, "page", lambda *args, **more: may_read.wait(60) and page(*args, **more))
    screen.shell.go("home")
    screen.shell.go("logs", execution_id=old.id)
    ui.wait(lambda: screen.logs.opened_run == old.id)
    ui.advance(2)
    may_read.set()
    ui.wait(lambda: [row.key for row in ui.find_all(LogRow) if row.opened] == [old.id])


def test_the_list_loads_more_as_it_is_scrolled_until_everything_is_there(screen, container, ui):
    tap(screen, ui, ui.find(Segment, text="All"))
    everything = screen.logs._facts.count
    assert everything > len(screen.logs.rows) == 100
    for _page in range(20):
        if len(screen.logs.rows) == everything:
            break
        ui.find(RunsList).scroll_y = 0
        settle(screen, ui)
    ids = [row.key for row in screen.logs.rows]
    assert len(ids) == len(set(ids)) == everything
    planned = [row.planned_at for row in screen.logs._facts.rows]
    assert planned == sorted(planned, reverse=True)


def export_as(screen, ui, form):
    tap(screen, ui, export_button(ui))
    tap(screen, ui, ui.find(OptionRow, ui.find(ChoiceDialog), text=form))


@pytest.fixture
def documents(tmp_path, monkeypatch):
    documents = tmp_path / "Documents"
    documents.mkdir()
    monkeypatch.setattr("app.services.files.exports.platformdirs.user_documents_path", lambda: documents)
    return documents


def test_a_table_for_excel_has_semicolons_and_a_byte_order_mark(screen, ui, documents):
    export_as(screen, ui, "For Excel")
    [written] = documents.iterdir()
    assert written.read_bytes().startswith(codecs.BOM_UTF8 + b"id;trigger;schedule;")


def test_where_a_stick_is_there_it_is_asked_where_to(screen, ui, tmp_path, documents, monkeypatch):
    stick = tmp_path / "STICK"
    stick.mkdir()
    monkeypatch.setattr("app.services.files.exports.mounted", lambda: iter([Place(PlaceKind.USB, stick, "STICK")]))
    export_as(screen, ui, "CSV")
    assert ui.find(ChoiceDialog).title == "Where to?"
    tap(screen, ui, ui.find(OptionRow, ui.find(ChoiceDialog), text="USB: STICK"))
    tap(screen, ui, ui.find(CommandButton, text="Report"))
    tap(screen, ui, ui.find(OptionRow, ui.find(ChoiceDialog), text="Today"))
    tap(screen, ui, ui.find(OptionRow, ui.find(ChoiceDialog), text="USB: STICK"))
    assert sorted(path.suffix for path in stick.iterdir()) == [".csv", ".html"]
    assert not [*documents.iterdir()]


def test_the_filtered_runs_are_exported_and_the_file_is_named(screen, ui, documents):
    tick(screen, ui, "Outcome", "Failed")
    export_as(screen, ui, "CSV")
    text = ui.find(Snackbar).text
    count = screen.logs._facts.count
    assert export_button(ui).text == f"Export {count} runs"
    assert text.startswith(f"{count} runs written to {documents}")
    with Path(text.partition(" to ")[2]).open(newline="", encoding="utf-8") as file:
        lines = list(csv.reader(file))
    assert tuple(lines[0]) == COLUMNS
    assert len(lines) == count + 1
    assert {line[COLUMNS.index("state")] for line in lines[1:]} == {"failed"}
    assert len([*documents.iterdir()]) == 1


def test_runs_that_no_list_shows_are_not_exported(screen, ui):
    """The filters of the list do not apply to figures and bands, so there is nothing to export there."""
    tick(screen, ui, "Outcome", "Failed")
    for part in ("Figures", "Robots"):
        tap(screen, ui, ui.find(Segment, text=part))
        assert not ui.find_all(CommandButton, icon="file-export-outline")
        assert not ui.find_all(ChoiceChip, text="Failed")
        assert ui.find_all(ChoiceChip, text="All robots")
    tap(screen, ui, ui.find(Segment, text="Runs"))
    assert outcomes(screen) == {"Failed"}
    assert export_button(ui).text == f"Export {screen.logs._facts.count} runs"


def test_an_export_that_cannot_be_written_says_why_in_one_sentence(screen, ui, tmp_path, monkeypatch):
    monkeypatch.setattr("app.services.files.exports.draft_of", no_room)
    export_as(screen, ui, "CSV")
    assert "No space left on device" in ui.find(Snackbar).text
    assert not export_button(ui).busy


def no_room(*_where, **_how):
    raise OSError(28, "No space left on device")


# ---------------------------------------------------------------------- layout


def test_nothing_overlaps_or_is_too_small(screen, ui):
    tap(screen, ui, rows(ui)[1])
    assert checks.problems(screen.shell.navigator.screen("logs")) == []


# ---------------------------------------------------------------------- run again
def test_the_button_that_runs_a_failed_run_again_covers_nothing(screen, ui):
    screen.logs.set_filters(outcomes=(State.FAILED,))
    settle(screen, ui)
    failed = rows(ui)[0]
    tap(screen, ui, failed)
    button, message = ui.find(CommandButton, failed, text="Run again"), ui.find(Note, failed, text=failed.message)
    assert button.to_window(0, button.top)[1] <= message.to_window(0, message.y)[1]
    assert checks.problems(screen.shell.navigator.screen("logs")) == []


@pytest.fixture
def asked(screen, container, monkeypatch):
    """The runs that were asked to be run again."""
    runs: list[int] = []
    monkeypatch.setattr(container.operator, "run_again", lambda run: runs.append(run) or container.history.get(run))
    return runs


def press_run_again(screen, ui) -> LogRow:
    """Press Run again of the newest failed run."""
    screen.logs.set_filters(outcomes=(State.FAILED,))
    settle(screen, ui)
    failed = rows(ui)[0]
    tap(screen, ui, failed)
    tap(screen, ui, ui.find(CommandButton, failed, text="Run again"))
    return failed


@pytest.mark.parametrize(("answer", "times"), [("Run now", 1), ("Cancel", 0)])
def test_a_failed_run_can_be_run_again(screen, container, ui, asked, answer, times):
    robot_id = container.history.page(failures(container), size=1).rows[0].robot_id
    with standing(container, robot_id, READY):
        failed = press_run_again(screen, ui)
    question = ui.find(ConfirmDialog)
    assert question.title == f"Run {failed.mission} on {failed.robot} now?"
    tap(screen, ui, ui.find(CommandButton, question, text=answer))
    assert asked == [failed.key] * times
    assert failed.opened


def test_a_run_is_not_run_again_on_a_stopped_robot(screen, container, ui, asked):
    robot_id = container.history.page(failures(container), size=1).rows[0].robot_id
    with standing(container, robot_id, FAILED):
        failed = press_run_again(screen, ui)
    assert not ui.find_all(ConfirmDialog)
    assert screen.shell.snackbars.texts == [
        f"{failed.mission} was not started on {failed.robot}. {failed.robot} is stopped"
    ]
    assert asked == []


def test_run_again_on_a_silent_robot_says_that_it_is_sent_when_it_answers(screen, container, ui, asked):
    failed = press_run_again(screen, ui)
    tap(screen, ui, ui.find(CommandButton, ui.find(ConfirmDialog), text=f"Send when {failed.robot} answers"))
    assert asked == [failed.key]


def test_run_again_under_a_hold_says_that_it_is_held(screen, container, ui, asked):
    container.holds.hold("shift meeting")
    try:
        press_run_again(screen, ui)
        tap(screen, ui, ui.find(CommandButton, ui.find(ConfirmDialog), text="Queue, held"))
    finally:
        container.holds.release()
    assert len(asked) == 1


def test_a_completed_run_has_no_such_button(screen, ui):
    screen.logs.set_filters(outcomes=(State.COMPLETED,))
    settle(screen, ui)
    tap(screen, ui, rows(ui)[0])
    assert ui.find_all(StoryStep)
    assert not ui.find_all(CommandButton, text="Run again")
