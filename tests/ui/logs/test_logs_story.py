"""The story of a run: why it ended so, the runs before and after it, running it again."""

from __future__ import annotations

import threading

import pytest
from kivy.core.window import Window

from app.domain.execution import State
from app.screens.logs.cards import RunsList
from app.screens.logs.run_story import StorySheet
from app.screens.logs.view import Filters, Period
from app.widgets.buttons import ChoiceChip, CommandButton, IconButton
from app.widgets.frame import NavItem
from app.widgets.sheet import AskSheet
from app.widgets.snackbar import Snackbar
from tests.support.home_facts import FAILED, READY
from tests.ui import checks
from tests.ui.logbook import choose_tab, failures, reset_logs, rows, runs_of, settle, tap
from tests.ui.whole_app import standing


@pytest.fixture
def screen(logs, ui):
    reset_logs(logs, ui)
    return logs


def open_failed(screen, ui) -> None:
    tap(screen, ui, next(row for row in rows(ui) if row.item.tone == "fault"))


def test_why_a_run_failed_takes_two_touches(screen, ui):
    screen.shell.go("home")
    settle(screen, ui)
    tap(screen, ui, ui.find(NavItem, name="logs"))
    open_failed(screen, ui)
    assert {"Can't reach Dock 3", "“Failed to reach goal position 'Dock 3'”"} <= set(ui.texts(ui.find(StorySheet)))
    assert [step.title for step in screen.logs.story.words.steps] == ["Planned", "Sent", "Started", "Failed"]


def test_the_story_stands_beside_the_list_and_the_cross_closes_it(screen, ui):
    row = rows(ui)[3]
    tap(screen, ui, row)
    panel = ui.find(StorySheet)
    assert panel.width == 400
    assert ui.find(RunsList).to_window(ui.find(RunsList).right, 0)[0] <= panel.to_window(*panel.pos)[0]
    assert row.item.look == "chosen"
    assert checks.problems(screen.shell.navigator.screen("logs")) == []
    tap(screen, ui, ui.find(IconButton, panel, icon="close"))
    assert not ui.find_all(StorySheet)
    assert row.item.look == "plain"


def test_arrows_lead_to_the_runs_before_and_after(screen, ui):
    first, second = (item.key for item in runs_of(screen)[:2])
    tap(screen, ui, rows(ui)[0])
    up, down = (ui.find(IconButton, ui.find(StorySheet), icon=f"chevron-{way}") for way in ("up", "down"))
    assert (up.disabled, down.disabled) == (True, False)  # there is none above it
    tap(screen, ui, down)
    assert screen.logs.story.words.key == second
    tap(screen, ui, up)
    assert screen.logs.story.words.key == first


@pytest.mark.parametrize("size", [(1024, 600), (800, 1280)])
def test_in_a_low_or_narrow_window_the_story_takes_the_page(screen, ui, size):
    before = Window.size
    Window.size = size
    try:
        screen.logs.set_filters(outcomes=("failed",))
        settle(screen, ui)
        open_failed(screen, ui)
        sheet = ui.find(StorySheet)
        assert sheet.size == sheet.parent.size
        assert checks.problems(sheet) == []
        assert checks.is_seen(ui.find(CommandButton, text="Run again"))
        tap(screen, ui, ui.find(IconButton, sheet, icon="close"))
        assert not ui.find_all(StorySheet)
    finally:
        Window.size = before
        settle(screen, ui)


@pytest.mark.parametrize(
    "leave", [lambda screen, ui: choose_tab(screen, ui, "figures"), lambda screen, ui: screen.shell.go("home")]
)
def test_the_story_closes_where_its_list_is_left(screen, ui, leave):
    tap(screen, ui, rows(ui)[0])
    leave(screen, ui)
    assert not ui.find_all(StorySheet)
    screen.shell.go("logs")
    settle(screen, ui)
    assert screen.logs.story.run is None


def test_runs_that_ended_for_the_same_cause_are_counted_and_found(screen, ui):
    screen.logs.set_filters(outcomes=("skipped",))
    settle(screen, ui)
    tap(screen, ui, rows(ui)[0])
    number = int(screen.logs.story.words.like.split()[0])
    assert number > 1
    tap(screen, ui, ui.find(text=f"{number} like this in 30 days"))
    assert len(runs_of(screen)) == number
    assert screen.logs.story.words.key == screen.logs.story.run


# ---------------------------------------------------------------------- asked for by another screen
def test_a_link_to_a_run_leaves_no_tab_filter_or_search_in_its_way(screen, container, ui):
    old = container.history.page(failures(container)).rows[-1]
    screen.logs.set_filters(outcomes=("skipped",), text="charger")
    choose_tab(screen, ui, "activity")
    screen.shell.go("home")
    screen.shell.go("logs", execution_id=old.id)
    settle(screen, ui)
    ui.wait(lambda: screen.logs.story.words.key == old.id)
    ui.wait(lambda: old.id in {row.key for row in rows(ui)})  # and its row is in sight
    assert screen.logs.filters == []
    screen.shell.go("logs", execution_id=10**6)
    settle(screen, ui)
    assert ui.find(Snackbar).text == "This run is no longer in the history"


def test_a_link_to_a_run_of_the_chosen_period_leaves_that_period(screen, container, ui):
    last = container.history.page(failures(container)).rows[0]
    screen.logs.set_filters(period=Period.MONTH)
    screen.shell.go("logs", execution_id=last.id)
    ui.wait(lambda: screen.logs.story.words.key == last.id)
    assert screen.logs.wanted == Filters(Period.MONTH)


def test_a_link_to_an_older_run_shows_its_day_and_leads_back_to_the_chosen_period(screen, container, ui):
    old = container.history.page(failures(container)).rows[-1]
    screen.logs.set_filters(period=Period.TODAY)
    screen.shell.go("logs", execution_id=old.id)
    ui.wait(lambda: screen.logs.story.words.key == old.id)
    settle(screen, ui)
    day = old.planned_at.astimezone(screen.logs.zone).date()
    assert {run.planned_at.astimezone(screen.logs.zone).date() for run in screen.logs.facts.rows} == {day}
    assert screen.logs.wanted == Filters(Period.TODAY, day=day)
    screen.logs.close_story()
    ui.advance(1)
    ui.tap(ui.find(ChoiceChip, text=screen.logs.filters[0].text))
    assert screen.logs.wanted == Filters(Period.TODAY)


def test_a_link_to_the_runs_as_a_whole_shows_them_unfiltered(screen, ui):
    everything = screen.logs.facts.count
    screen.logs.set_filters(outcomes=("skipped",))
    choose_tab(screen, ui, "figures")
    screen.shell.go("logs", unfiltered=True)
    settle(screen, ui)
    assert len(rows(ui)) > 1
    assert screen.logs.facts.count == everything


def test_a_row_comes_into_sight_however_long_its_list_takes_to_be_read(screen, container, ui, monkeypatch):
    old = container.history.page(failures(container)).rows[-1]
    page, may_read = container.history.page, threading.Event()
    monkeypatch.setattr(container.history, "page", lambda *args, **more: may_read.wait(60) and page(*args, **more))
    screen.shell.go("home")
    screen.shell.go("logs", execution_id=old.id)
    ui.wait(lambda: screen.logs.story.run == old.id)
    ui.advance(2)
    may_read.set()
    ui.wait(lambda: old.id in {row.key for row in rows(ui)})


# ---------------------------------------------------------------------- run again
@pytest.fixture
def asked(screen, container, monkeypatch):
    """The runs that were asked to be run again."""
    runs: list[int] = []
    monkeypatch.setattr(container.operator, "run_again", lambda run: runs.append(run) or container.history.get(run))
    return runs


def press_run_again(screen, ui):
    """Press Run again of the newest failed run; returns its item."""
    screen.logs.set_filters(outcomes=(State.FAILED,))
    settle(screen, ui)
    failed = rows(ui)[0]
    tap(screen, ui, failed)
    tap(screen, ui, ui.find(CommandButton, text="Run again"))
    return failed.item


@pytest.mark.parametrize(
    ("kind", "answer", "times"), [(CommandButton, {"text": "Run now"}, 1), (IconButton, {"icon": "close"}, 0)]
)
def test_a_failed_run_can_be_run_again(screen, container, ui, asked, kind, answer, times):
    robot_id = container.history.page(failures(container), size=1).rows[0].robot_id
    with standing(container, robot_id, READY):
        failed = press_run_again(screen, ui)
    question = ui.find(AskSheet)
    assert question.title == f"Run {failed.title} on {failed.place} now?"
    tap(screen, ui, ui.find(kind, question, **answer))
    assert asked == [failed.key] * times
    assert screen.logs.story.words.key == failed.key


def test_a_run_is_not_run_again_on_a_stopped_robot(screen, container, ui, asked):
    robot_id = container.history.page(failures(container), size=1).rows[0].robot_id
    with standing(container, robot_id, FAILED):
        failed = press_run_again(screen, ui)
    assert not ui.find_all(AskSheet)
    assert screen.shell.snackbars.texts == [
        f"{failed.title} was not started on {failed.place}. {failed.place} is stopped"
    ]
    assert asked == []


def test_run_again_on_a_silent_robot_says_that_it_is_sent_when_it_answers(screen, ui, asked):
    failed = press_run_again(screen, ui)
    tap(screen, ui, ui.find(CommandButton, ui.find(AskSheet), text=f"Send when {failed.place} answers"))
    assert asked == [failed.key]


def test_run_again_under_a_hold_says_that_it_is_held(screen, container, ui, asked):
    container.holds.hold("shift meeting")
    try:
        press_run_again(screen, ui)
        tap(screen, ui, ui.find(CommandButton, ui.find(AskSheet), text="Queue, on hold"))
    finally:
        container.holds.release()
    assert len(asked) == 1


def test_a_completed_run_has_no_such_button(screen, ui):
    screen.logs.set_filters(outcomes=(State.COMPLETED,))
    settle(screen, ui)
    tap(screen, ui, rows(ui)[0])
    assert ui.find_all(StorySheet)
    assert not ui.find_all(CommandButton, text="Run again")
