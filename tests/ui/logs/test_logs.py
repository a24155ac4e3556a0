"""The list of runs as an operator uses it: taps and typing on real services, at an invented plant on Friday 20 Nov 2026, 14:38."""

from __future__ import annotations

import codecs
import csv
from dataclasses import replace
from pathlib import Path

import pytest

from app.domain.execution import State
from app.domain.robot import MissionParameter
from app.i18n import translator
from app.screens.logs.cards import RunsList
from app.services.files.history_export import COLUMNS
from app.services.files.places import Place, PlaceKind
from app.widgets.buttons import ChoiceChip, CommandButton, IconButton, MenuChip
from app.widgets.choices import ChoiceSheet, OptionRow
from app.widgets.fields import SearchField
from app.widgets.menu import Menu
from app.widgets.snackbar import Snackbar
from tests.ui.logbook import choose_tab, failures, reset_logs, rows, runs_of, settle, tap


@pytest.fixture
def screen(logs, ui):
    reset_logs(logs, ui)
    return logs


def menu(app, ui, icon: str, text: str) -> None:
    """Choose from the menu of a button above the list."""
    tap(app, ui, ui.find(IconButton, icon=icon))
    tap(app, ui, ui.find(root=ui.find(Menu), text=text))


def tick(app, ui, filter: str, *options: str) -> None:
    """Open a filter and tick some options of its list; then the button that shows them."""
    menu(app, ui, "filter-variant", filter)
    for option in options:
        tap(app, ui, ui.find(OptionRow, ui.find(ChoiceSheet), title=option))
    tap(app, ui, ui.find(CommandButton, ui.find(ChoiceSheet), text="Show"))


def choose_period(app, ui, now: str, wanted: str) -> None:
    tap(app, ui, ui.find(MenuChip, text=now))
    tap(app, ui, ui.find(OptionRow, ui.find(ChoiceSheet), title=wanted))


# ---------------------------------------------------------------------- what is seen
def test_runs_are_listed_newest_first_below_their_days_with_their_reasons(screen, ui):
    assert (screen.logs.rows[0].title, screen.logs.rows[0].look) == ("Today", "head")
    _queued, _waiting, first, second, *_rest = [row.item for row in rows(ui)]
    assert (first.lead, first.title, first.place, first.meta) == (
        "14:33",
        "Deliver kits to line 2",
        "Aino",
        "Working, about 1 min left",
    )
    assert second.meta == "Battery 12 % stayed under 30 % until 14:30"
    assert "Yesterday" in {item.title for item in screen.logs.rows}


def test_after_the_language_was_switched_elsewhere_they_are_in_it_at_once(screen, ui):
    screen.shell.go("settings")
    settle(screen, ui)
    try:
        translator.use("fi")
        screen.shell.go("logs")
        assert screen.logs.rows[0].title == "Tänään"
        assert ui.find(MenuChip, text="7 päivää")
    finally:
        translator.use("en")
        settle(screen, ui)


def test_the_numbers_of_outcomes_filter_the_list_and_a_second_tap_ends_that(screen, ui):
    everything = screen.logs.facts.count
    failed = next(chip for chip in ui.find_all(ChoiceChip) if chip.text.endswith("failed"))
    tap(screen, ui, failed)
    assert {run.state for run in screen.logs.facts.rows} == {State.FAILED}
    assert failed.text == f"{screen.logs.facts.count} failed"
    assert failed.active
    tap(screen, ui, failed)
    assert screen.logs.facts.count == everything


# ---------------------------------------------------------------------- filters
def test_a_longer_period_has_more_runs(screen, ui):
    week = screen.logs.facts.count
    choose_period(screen, ui, "7 days", "30 days")
    assert screen.logs.facts.count > week
    choose_period(screen, ui, "30 days", "Today")
    assert screen.logs.facts.count < week


def test_filters_are_named_above_the_list_and_a_tap_on_one_ends_it(screen, ui):
    everything = screen.logs.facts.count
    tick(screen, ui, "Outcome", "Failed", "Cancelled")
    assert {run.state for run in screen.logs.facts.rows} <= {State.FAILED, State.CANCELLED}
    tick(screen, ui, "Started by", "Run now")
    menu(screen, ui, "filter-variant", "Mission")
    tap(screen, ui, ui.find(OptionRow, ui.find(ChoiceSheet), title="Bring pallet to dock"))
    assert [chip.text for chip in ui.find_all(ChoiceChip, icon="close")] == [
        "Failed, Cancelled",
        "Bring pallet to dock",
        "Run now",
    ]
    assert {item.title for item in runs_of(screen)} == {"Bring pallet to dock"}
    for text in ("Failed, Cancelled", "Bring pallet to dock", "Run now"):
        tap(screen, ui, ui.find(ChoiceChip, text=text))
    assert not ui.find_all(ChoiceChip, icon="close")
    assert screen.logs.facts.count == everything


def test_one_robot_can_be_looked_at_alone(screen, ui):
    menu(screen, ui, "filter-variant", "Robot")
    tap(screen, ui, ui.find(OptionRow, ui.find(ChoiceSheet), title="Sisu"))
    assert {item.place for item in runs_of(screen)} == {"Sisu"}


def test_problems_of_one_cause_are_one_row_that_leads_to_its_runs(screen, ui):
    choose_period(screen, ui, "7 days", "30 days")
    menu(screen, ui, "filter-variant", "Problems")
    folded = next(row for row in rows(ui) if row.item.title.endswith("×2"))
    cause = folded.item.title.removesuffix(" ×2")
    tap(screen, ui, folded)
    assert len(runs_of(screen)) == 2
    assert {item.meta for item in runs_of(screen)} == {cause}
    tap(screen, ui, ui.find(ChoiceChip, text=cause))
    assert folded.item.title in {item.title for item in runs_of(screen)}


def test_a_search_that_comes_back_with_its_words_opens_no_keyboard(screen, ui):
    tap(screen, ui, ui.find(IconButton, icon="magnify"))
    assert ui.find(SearchField).focus
    ui.type(ui.find(SearchField), "pallet")
    settle(screen, ui)
    choose_tab(screen, ui, "figures")
    choose_tab(screen, ui, "runs")
    assert (ui.find(SearchField).text, ui.find(SearchField).focus) == ("pallet", False)


def test_typing_searches_and_closing_the_search_clears_it(screen, ui):
    tap(screen, ui, ui.find(IconButton, icon="magnify"))
    ui.type(ui.find(SearchField), "pallet")
    settle(screen, ui)
    assert {item.title for item in runs_of(screen)} == {"Bring pallet to dock"}
    tap(screen, ui, ui.find(IconButton, icon="magnify"))
    assert len({item.title for item in runs_of(screen)}) > 1


@pytest.mark.parametrize(("typed", "reason"), [("stayed under", "Battery"), ("DOCK 3", "Can't reach Dock 3")])
def test_a_search_finds_reasons_too(screen, ui, typed, reason):
    tap(screen, ui, ui.find(IconButton, icon="magnify"))
    ui.type(ui.find(SearchField), typed)
    settle(screen, ui)
    assert runs_of(screen)
    assert all(item.meta.startswith(reason) for item in runs_of(screen))


@pytest.mark.usefixtures("put_back")
@pytest.mark.parametrize("learnt_before", [True, False])
def test_a_search_finds_the_position_that_a_row_names(screen, container, ui, learnt_before):
    """The history stores the robots' value; their name for it is shown, and may be learnt after it was typed."""
    guid = "a1c4e008-5d0f-11ef-93c1-0001297b6e20"
    run = replace(
        container.history.page(failures(container)).rows[0],
        id=None,
        token="to-dock",
        queue_id=None,
        parameters={"goal": guid},
    )
    added = container.db.write(lambda c: container.repositories.executions.add_each_once(c, [run])[0])
    names = MissionParameter("goal", "Position", choices=((guid, "Cold store"),), sets="position")
    if learnt_before:
        screen.shell.mission_names.take("m-1", (names,))
    tap(screen, ui, ui.find(IconButton, icon="magnify"))
    ui.type(ui.find(SearchField), "COLD")
    settle(screen, ui)
    if not learnt_before:
        assert not screen.logs.rows
        screen.logs._names._take("m-2", (names,))
        settle(screen, ui)
    assert [(item.key, item.title) for item in runs_of(screen)] == [(added.id, f"{run.mission} · Cold store")]


def test_where_nothing_is_found_the_screen_says_so_and_nothing_can_be_exported(screen, ui):
    tick(screen, ui, "Outcome", "Not run")
    tick(screen, ui, "Started by", "Idle")
    assert "Nothing found" in ui.texts()
    tap(screen, ui, ui.find(IconButton, icon="dots-vertical"))
    assert [item.off for item in ui.find(Menu).items] == ["Nothing to export"]


# ---------------------------------------------------------------------- paged, exported
def test_the_list_loads_more_as_it_is_scrolled_until_everything_is_there(screen, container, ui):
    choose_period(screen, ui, "7 days", "All")
    everything = screen.logs.facts.count
    assert everything > len(screen.logs.facts.rows) == 100
    for _page in range(20):
        if len(screen.logs.facts.rows) == everything:
            break
        ui.find(RunsList).scroll_y = 0
        settle(screen, ui)
    ids = [item.key for item in runs_of(screen)]
    assert len(ids) == len(set(ids)) == everything
    planned = [row.planned_at for row in screen.logs.facts.rows]
    assert planned == sorted(planned, reverse=True)


def export_as(screen, ui, form):
    menu(screen, ui, "dots-vertical", f"Export {screen.logs.facts.count} runs")
    tap(screen, ui, ui.find(OptionRow, ui.find(ChoiceSheet), title=form))


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
    assert ui.find(ChoiceSheet).title == "Where to?"
    tap(screen, ui, ui.find(OptionRow, ui.find(ChoiceSheet), title="USB: STICK"))
    assert [path.suffix for path in stick.iterdir()] == [".csv"]
    assert not [*documents.iterdir()]


def test_the_runs_that_are_seen_are_exported_and_the_file_is_named(screen, ui, documents):
    tap(screen, ui, next(chip for chip in ui.find_all(ChoiceChip) if chip.text.endswith("failed")))
    count = screen.logs.facts.count
    export_as(screen, ui, "CSV")
    text = ui.find(Snackbar).text
    assert text.startswith(f"{count} runs written to {documents}")
    with Path(text.partition(" to ")[2]).open(newline="", encoding="utf-8") as file:
        lines = list(csv.reader(file))
    assert tuple(lines[0]) == COLUMNS
    assert len(lines) == count + 1
    assert {line[COLUMNS.index("state")] for line in lines[1:]} == {"failed"}


def test_an_export_that_cannot_be_written_says_why_in_one_sentence(screen, ui, monkeypatch):
    def no_room(*_where, **_how):
        raise OSError(28, "No space left on device")

    monkeypatch.setattr("app.services.files.exports.draft_of", no_room)
    export_as(screen, ui, "CSV")
    assert "No space left on device" in ui.find(Snackbar).text
    assert not screen.logs.files.exporting
