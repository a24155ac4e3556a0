"""Suggestions, as a planner uses them: what often came late, a tap that fills the form, Not now, and undo of both."""

from __future__ import annotations

import threading
from dataclasses import replace
from datetime import time, timedelta

import pytest

from app.container import Container
from app.database.connection import Database
from app.i18n import translator
from app.screens.scheduler.advice import SOON
from app.screens.scheduler.cards import FormSheet, SuggestionRow
from app.widgets.buttons import CommandButton, IconButton
from app.widgets.fields import Field
from app.widgets.menu import MenuRow
from app.widgets.snackbar import Snackbar
from tests.services import test_suggestions as month_of_kits
from tests.support.clock import VirtualClock
from tests.ui.planner import opened, save, settle, tab


@pytest.fixture
def container(tmp_path):
    """Kits at 07:30 on Aino came late on each of the last twenty days: Aino was busy with the waste of 07:15."""
    clock = VirtualClock(month_of_kits.NOW - timedelta(days=40))
    container = Container(Database.open(tmp_path / "amr-scheduler.db", clock=clock, durable=False), clock)
    month_of_kits.plan(container)
    clock.advance((month_of_kits.NOW - clock.now()).total_seconds())
    month_of_kits.usually_late(container)
    yield container
    container.close()


@pytest.fixture
def app(container, ui, silent_robots):
    with opened(container, ui) as app:
        yield app


def open_all(app, ui) -> SuggestionRow:
    """The first of them."""
    ui.skip(SOON + 1)
    ui.wait(lambda: app.plan.advice.count)
    tab(app, ui, "suggestions")
    return ui.find(SuggestionRow)


def not_now(app, ui) -> None:
    ui.tap(ui.find(IconButton, ui.find(SuggestionRow), icon="dots-vertical"))
    ui.advance(0.3)
    ui.tap(ui.find(MenuRow, text="Not now"))
    settle(app, ui)


def kits(container):
    return next(schedule for schedule in container.catalogue.schedules() if schedule.name == "Kits")


def undo(app, ui, text: str) -> None:
    ui.wait(lambda: ui.find_all(Snackbar, text=text))
    ui.tap(ui.find(root=ui.find(Snackbar, text=text), text="Undo"))
    settle(app, ui)


@pytest.mark.long
def test_they_follow_a_language_that_was_switched_on_another_page(app, ui, monkeypatch):
    open_all(app, ui)
    app.shell.go("logs")
    settle(app, ui)
    monkeypatch.setattr(app.plan.advice, "compute", lambda: None)
    translator.use("fi")
    try:
        app.shell.go("scheduler")
        assert ui.find(SuggestionRow).item.support.startswith("20/20")
    finally:
        translator.use("en")
        settle(app, ui)


def test_a_suggestion_says_why_and_fills_the_form_which_a_person_saves(app, container, ui):
    panel = open_all(app, ui)
    assert app.shell.navigator.screen("scheduler").tabs[2].count == 1
    assert panel.item.support == "20 of 20 starts late, about 9 min"
    assert panel.item.note == "Aino was busy with Waste to compactor"
    assert [button.text for button in panel.item.under] == ["Move to 07:40", "Use Sisu", "Any of Hall 1"]
    before = kits(container)
    ui.tap(ui.find(CommandButton, panel, text="Any of Hall 1"))
    settle(app, ui)
    assert ui.find(Field, label="Robot").value == "Any of Hall 1"
    assert ui.find(FormSheet).view.title == "Kits to line 2"
    assert kits(container) == before  # nothing is changed before it is saved
    save(app, ui)
    ui.wait(lambda: kits(container).group_id is not None)
    ui.wait(lambda: not app.plan.advice.count)
    assert app.shell.snackbars.texts == ["Kits: the suggestion is applied"]
    undo(app, ui, "Kits: the suggestion is applied")
    ui.wait(lambda: kits(container).robot_id == before.robot_id and kits(container).group_id is None)
    ui.wait(lambda: app.plan.advice.count)  # as if it had not been taken


@pytest.fixture
def unnamed(container):
    """No person has given it a name: that was made, with a number."""
    numbered = replace(kits(container), name="Kits to line 2 on Aino 2")
    container.db.write(lambda c: container.repositories.schedules.update(c, numbered))
    return numbered


def test_a_made_name_is_said_without_its_number_and_follows_to_the_group(unnamed, app, container, ui):
    assert open_all(app, ui).item.title == "Kits to line 2"
    ui.tap(ui.find(CommandButton, ui.find(SuggestionRow), text="Any of Hall 1"))
    settle(app, ui)
    save(app, ui)
    ui.wait(lambda: container.catalogue.schedules()[0].name == "Kits to line 2 on Hall 1")
    undo(app, ui, "Kits to line 2 on Hall 1: the suggestion is applied")
    ui.wait(lambda: container.catalogue.schedules()[0].name == unnamed.name)


def test_a_time_of_day_comes_into_the_form(app, container, ui):
    open_all(app, ui)
    ui.tap(ui.find(CommandButton, ui.find(SuggestionRow), text="Move to 07:40"))
    settle(app, ui)
    save(app, ui)
    ui.wait(lambda: kits(container).start.time() == time(7, 40))


def test_another_edit_is_not_taken_for_the_suggestion(app, container, ui):
    open_all(app, ui)
    ui.tap(ui.find(CommandButton, ui.find(SuggestionRow), text="Move to 07:40"))
    settle(app, ui)
    app.plan.form.set(at=time(9, 0))
    settle(app, ui)
    save(app, ui)
    ui.wait(lambda: kits(container).start.time() == time(9, 0))
    settle(app, ui)
    assert not ui.find_all(Snackbar, text="Kits: the suggestion is applied")


def test_not_now_is_silent_and_can_be_undone(app, container, ui):
    open_all(app, ui)
    not_now(app, ui)
    ui.wait(lambda: not app.plan.advice.count)
    undo(app, ui, "Kits: not suggested again for 60 days")
    ui.wait(lambda: app.plan.advice.count)


def test_an_answered_suggestion_disappears_at_once_although_it_was_found_again(app, container, ui, monkeypatch):
    """Suggestions computed before the answer are also delivered before it."""
    open_all(app, ui)
    suggestions = container.suggestions
    dismiss, compute, answered, computed = (
        suggestions.dismiss,
        suggestions.compute,
        threading.Event(),
        threading.Event(),
    )
    monkeypatch.setattr(suggestions, "dismiss", lambda one: answered.wait(30) and dismiss(one))
    app.plan.advice._dismiss(app.plan.advice._advice.suggestions[0])
    found: list[object] = []
    monkeypatch.setattr(suggestions, "compute", lambda: found.append(compute()) or found[0])
    app.plan.advice.compute()
    ui.wait(lambda: found)
    ui.advance(0.2)
    monkeypatch.setattr(suggestions, "compute", lambda: computed.wait(30) and compute())
    answered.set()
    ui.wait(lambda: not app.plan.advice.count)
    assert not app.plan.advice.count
    computed.set()
    settle(app, ui)
    assert not app.plan.advice.count
