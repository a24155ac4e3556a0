"""Text typed in the form counts at once, even if the field is not left."""

from __future__ import annotations

from dataclasses import replace

import pytest
from kivy.core.window import Window

from app.screens.scheduler.cards import FormCard
from app.widgets.buttons import ChoiceChip, Segment
from app.widgets.fields import FieldInput, FormField, StepField
from tests.ui.planner import KITS, choose, kind, named, reveal, save_button, schedules, settle

pytestmark = pytest.mark.long


def type_name(screen, ui, text: str) -> FormField:
    screen.plan.form.more = True
    settle(screen, ui)
    field = ui.find(FormField, label="Name")
    reveal(ui, field)
    ui.type(field, text)
    return field


def type_every(ui, text: str) -> StepField:
    field = ui.find(StepField, ui.find(FormCard))
    field.text = ""
    ui.type(field, text)
    return field


@pytest.fixture
def twice(screen, container, ui):
    """Two schedules that start every hour."""
    one = container.catalogue.save_schedule(
        replace(named(container, "Night stock count", "Aino"), name="One", recurrence="FREQ=HOURLY")
    )
    two = container.catalogue.save_schedule(replace(one, id=0, name="Two"))
    settle(screen, ui)
    return one, two


def test_typed_text_stays_while_the_plan_is_read_and_forecast_again(screen, container, ui):
    choose(screen, ui, "Mission", KITS)
    field = type_name(screen, ui, "Typed")
    container.catalogue.save_schedule(replace(named(container, "Night stock count", "Aino"), priority=2))
    screen.plan.form.set(priority=3)
    settle(screen, ui)
    assert (field.text, field.focus) == ("Typed", True)


def test_typed_text_is_put_aside_with_its_draft(screen, container, ui):
    choose(screen, ui, "Mission", KITS)
    type_name(screen, ui, "Typed")
    screen.plan.edit(named(container, "Collect empties", "Veikko").id)
    for key in " later":
        Window.dispatch("on_textinput", key)  # no field takes them now
    settle(screen, ui)
    assert ([draft.name for draft in screen.plan.form.drafts], screen.plan.form.draft.name) == (["Typed"], "")


def test_so_is_a_number(screen, ui, twice):
    one, two = twice
    screen.plan.edit(one.id)
    settle(screen, ui)
    field = type_every(ui, "7")
    screen.plan.edit(two.id)
    settle(screen, ui)
    field.focus = False
    settle(screen, ui)
    assert ([draft.every for draft in screen.plan.form.drafts], screen.plan.form.draft.every, field.text) == (
        [7],
        1,
        "1",
    )


@pytest.mark.parametrize("typed", ["", "99"])
def test_a_number_that_cant_be_is_not_saved_as_the_one_before(screen, ui, twice, typed):
    screen.plan.edit(twice[0].id)
    settle(screen, ui)
    field = type_every(ui, typed)
    settle(screen, ui)
    assert (field.text, field.problem, save_button(ui).disabled) == (typed, "A number from 1 to 24", True)
    field.text = "5"
    settle(screen, ui)
    assert (field.problem, save_button(ui).disabled) == ("", False)


@pytest.mark.parametrize("typed", ["1.5", "1,5", "1_5", "-2"])
def test_an_interval_stays_as_it_is_typed_and_is_not_saved(screen, ui, twice, typed):
    screen.plan.edit(twice[0].id)
    settle(screen, ui)
    field = type_every(ui, typed)
    settle(screen, ui)
    assert (field.text, field.outside, save_button(ui).disabled) == (typed, True, True)


def test_typed_text_is_saved_by_a_tap_on_save(screen, container, ui):
    choose(screen, ui, "Mission", KITS)
    before = {schedule.id for schedule in schedules(container)}
    kind(screen, ui, "Interval")
    type_every(ui, "7")
    type_name(screen, ui, "Typed")
    ui.tap(save_button(ui))
    settle(screen, ui)
    [added] = [schedule for schedule in schedules(container) if schedule.id not in before]
    assert (added.name, "INTERVAL=7" in added.recurrence) == ("Typed", True)
    assert not screen.plan.form.is_in_use


def test_an_hour_never_becomes_a_minute(screen, ui):
    kind(screen, ui, "Interval")
    for unit, every in (("minutes", 30), ("hours", 1)):
        ui.tap(ui.find(Segment, text=unit))
        settle(screen, ui)
        draft, field = screen.plan.form.draft, ui.find(StepField, ui.find(FormCard))
        assert (draft.unit, draft.every, field.text) == (unit, every, str(every))


def test_common_minutes_are_one_tap_away(screen, ui):
    kind(screen, ui, "Interval")
    ui.tap(ui.find(Segment, text="minutes"))
    settle(screen, ui)
    chips = [chip for chip in ui.find_all(ChoiceChip, ui.find(FormCard)) if chip.text.endswith(" min")]
    assert [(chip.text, chip.active) for chip in chips] == [
        ("5 min", False),
        ("10 min", False),
        ("15 min", False),
        ("30 min", True),
    ]
    reveal(ui, chips[2])
    ui.tap(chips[2])
    settle(screen, ui)
    assert (screen.plan.form.draft.every, chips[2].active) == (15, True)


def test_a_minute_is_chosen_only_by_typing_it(screen, ui):
    kind(screen, ui, "Interval")
    ui.tap(ui.find(Segment, text="minutes"))
    settle(screen, ui)
    ui.tap(ui.find(FieldInput, ui.find(FormCard)))
    Window.dispatch("on_textinput", "1")
    settle(screen, ui)
    assert screen.plan.form.draft.every == 1
