"""Text typed in the form counts at once, even if the field is not left."""

from __future__ import annotations

from dataclasses import replace

import pytest
from kivy.core.window import Window

from app.screens.scheduler.cards import FormSheet
from app.widgets.buttons import ChoiceChip
from app.widgets.fields import Field
from tests.ui.planner import KITS, bring_back, choose, kind, named, new, reveal, save_button, schedules, settle

pytestmark = pytest.mark.long


def type_name(screen, ui, text: str) -> Field:
    screen.plan.form.more = True
    settle(screen, ui)
    field = ui.find(Field, label="Name")
    reveal(ui, field)
    ui.type(field, text)
    return field


def test_typed_text_stays_while_the_plan_is_read_and_forecast_again(screen, container, ui):
    choose(screen, ui, "Mission", KITS)
    field = type_name(screen, ui, "Typed")
    container.catalogue.save_schedule(replace(named(container, "Night stock count", "Aino"), priority=2))
    screen.plan.form.set(priority=3)
    settle(screen, ui)
    assert (field.text, field.focus) == ("Typed", True)


def test_typed_text_is_brought_back_with_its_draft(screen, container, ui):
    choose(screen, ui, "Mission", KITS)
    type_name(screen, ui, "Typed")
    screen.plan.edit(named(container, "Collect empties", "Veikko").id)
    for key in " later":
        Window.dispatch("on_textinput", key)  # no field takes them now
    settle(screen, ui)
    assert screen.plan.form.draft.name == ""
    bring_back(screen, ui)
    assert screen.plan.form.draft.name == "Typed"


def test_typed_text_is_saved_by_a_tap_on_save(screen, container, ui):
    choose(screen, ui, "Mission", KITS)
    before = {schedule.id for schedule in schedules(container)}
    type_name(screen, ui, "Typed")
    ui.tap(save_button(ui))
    settle(screen, ui)
    [added] = [schedule for schedule in schedules(container) if schedule.id not in before]
    assert added.name == "Typed"
    assert not screen.plan.form.is_open


def test_an_hour_never_becomes_a_minute(screen, ui):
    new(screen, ui)
    form = screen.plan.form
    kind(screen, ui, "More")
    for word, unit, every in (("Hours between", "hours", 1), ("Minutes between", "minutes", 30)):
        choose(screen, ui, "Repeats", word)
        assert (form.draft.unit, form.draft.every) == (unit, every)


def test_common_minutes_are_one_tap_away(screen, ui):
    new(screen, ui)
    kind(screen, ui, "More")
    chips = ui.find_all(ChoiceChip, ui.find(FormSheet))
    assert [(chip.text, chip.active) for chip in chips] == [
        ("5", False),
        ("10", False),
        ("15", False),
        ("20", False),
        ("30", True),
    ]
    ui.tap(chips[2])
    settle(screen, ui)
    assert (screen.plan.form.draft.every, chips[2].active) == (15, True)
