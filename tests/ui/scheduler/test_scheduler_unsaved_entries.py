"""What was entered in the form and not saved, when something else is put into it."""

from __future__ import annotations

from dataclasses import replace
from datetime import date, time

import pytest

from app.domain.models import Group
from app.screens.scheduler.cards import FormCard
from app.screens.scheduler.draft import Draft, Kind
from app.widgets.buttons import IconButton, Segment
from app.widgets.snackbar import Snackbar
from app.widgets.timeline import Timeline
from tests.ui.planner import KITS, choose, field, kind, menu, named, save, settle

STOCK, DRAFTS_KEPT = "Night stock count on Aino", "{}: the unsaved entries are kept as a draft"


def said(app) -> list[str]:
    return app.shell.snackbars.texts


def test_entries_that_another_schedule_takes_the_place_of_are_brought_back(screen, container, ui):
    choose(screen, ui, "Mission", KITS)
    kind(screen, ui, "Weekly")
    entered = screen.plan.form.draft
    menu(screen, ui, named(container, "Collect empties", "Veikko"), "Edit")
    ui.tap(ui.find(root=ui.find(Snackbar), text="Open the draft"))
    settle(screen, ui)
    assert screen.plan.form.draft == entered
    assert field(ui, "Mission").value == KITS
    assert ui.find(Segment, text="Weekly").selected
    assert said(screen) == []  # of the other one nothing was changed


def test_changes_of_a_schedule_are_brought_back_too_and_saved(screen, container, ui):
    veikko = named(container, "Collect empties", "Veikko")
    menu(screen, ui, veikko, "Edit")
    screen.plan.form.set(minimum_battery_percent=55.0)
    menu(screen, ui, named(container, KITS, "Aino"), "Duplicate")
    ui.tap(ui.find(root=ui.find(Snackbar), text="Open the draft"))
    settle(screen, ui)
    assert screen.plan.form.editing == veikko.id
    save(screen, ui)
    assert container.repositories.schedules.get(container.db.read(), veikko.id).minimum_battery_percent == 55


def test_nothing_is_put_aside_where_nothing_was_entered(screen, container, ui):
    menu(screen, ui, named(container, KITS, "Aino"), "Edit")
    menu(screen, ui, named(container, "Collect empties", "Veikko"), "Edit")
    assert said(screen) == []


def drag(screen, ui, schedule, hours: float) -> None:
    """A bar of that schedule, from where it is stored."""
    timeline = ui.find(Timeline)
    key = next(hit[4] for hit in timeline.boxes() if hit[4][:2] == ("schedule", schedule.id))
    screen.plan.move_start(key, (key[2] - screen.plan.timeline.origin).total_seconds() / 3600 + hours)
    settle(screen, ui)


def test_a_bar_that_is_dragged_keeps_what_else_was_entered_for_it(screen, container, ui):
    stock = named(container, "Night stock count", "Aino")
    screen.plan.edit(stock.id)
    screen.plan.form.set(minimum_battery_percent=55.0, name="Count")
    for hours, at in ((1.5, time(20, 30)), (2.5, time(21, 30))):  # he changes his mind: the bar is where it was
        drag(screen, ui, stock, hours)
        draft = screen.plan.form.draft
        assert (draft.at, draft.more_hours, draft.minimum_battery_percent, draft.name) == (at, (), 55, "Count")
        assert said(screen) == []
    save(screen, ui)
    saved = container.repositories.schedules.get(container.db.read(), stock.id)
    assert (saved.start.time(), saved.minimum_battery_percent, saved.name) == (time(21, 30), 55, "Count")


def test_a_rule_that_was_changed_by_hand_is_put_aside_by_a_drag(screen, container, ui):
    stock = named(container, "Night stock count", "Aino")
    screen.plan.edit(stock.id)
    screen.plan.form.set(kind=Kind.WEEKLY, weekdays=("SA",), priority=3)
    entered = screen.plan.form.draft
    drag(screen, ui, stock, 1.5)
    draft = screen.plan.form.draft
    assert replace(draft, dragged=None) == replace(Draft.of(stock, ""), at=time(20, 30))  # as stored, at another time
    assert said(screen) == [DRAFTS_KEPT.format(STOCK)]
    ui.tap(ui.find(root=ui.find(Snackbar), text="Open the draft"))
    settle(screen, ui)
    assert screen.plan.form.draft == entered


@pytest.mark.parametrize(
    "changed", [{"kind": Kind.MONTHLY}, {"at": time(20, 40)}, {"day": date(2026, 12, 1)}, {"more_hours": (22,)}]
)
def test_times_changed_by_hand_after_a_drag_are_put_aside(screen, container, ui, changed):
    stock = named(container, "Night stock count", "Aino")
    drag(screen, ui, stock, 1.5)
    screen.plan.form.set(**changed)
    entered = screen.plan.form.draft
    drag(screen, ui, stock, 2.5)
    assert said(screen) == [DRAFTS_KEPT.format(STOCK)]
    assert screen.plan.form.drafts == [entered]


def test_changes_are_put_aside_when_the_same_schedule_is_opened_again(screen, container, ui):
    stock = named(container, "Night stock count", "Aino")
    screen.plan.edit(stock.id)
    screen.plan.form.set(priority=3)
    screen.plan.edit(stock.id)
    assert screen.plan.form.draft.priority == stock.priority
    assert said(screen) == [DRAFTS_KEPT.format(STOCK)]


def test_entries_are_put_aside_when_a_new_schedule_is_begun(screen, container, ui):
    stock = named(container, "Night stock count", "Aino")
    screen.plan.edit(stock.id)
    screen.plan.form.set(priority=3)
    settle(screen, ui)
    ui.tap(ui.find(IconButton, ui.find(FormCard), icon="close"))
    assert screen.plan.form.draft.is_new
    assert said(screen) == [DRAFTS_KEPT.format(STOCK)]


def test_a_new_one_is_put_aside_by_its_cross_which_is_there_once_something_was_entered(screen, container, ui):
    assert not ui.find_all(IconButton, ui.find(FormCard), icon="close")
    choose(screen, ui, "Mission", KITS)
    entered = screen.plan.form.draft
    ui.tap(ui.find(IconButton, ui.find(FormCard), icon="close"))
    settle(screen, ui)
    assert (screen.plan.form.draft.mission_id, screen.plan.form.drafts) == (None, [entered])
    assert said(screen) == [DRAFTS_KEPT.format(KITS)]


def open_draft(ui):
    return ui.find(IconButton, ui.find(FormCard), icon="backup-restore")


def test_a_draft_that_was_put_aside_can_be_restored_long_after_the_message_closed(screen, container, ui):
    choose(screen, ui, "Mission", KITS)
    entered = screen.plan.form.draft
    screen.plan.edit(named(container, "Night stock count", "Aino").id)
    screen.plan.form.set(priority=3)
    edited = screen.plan.form.draft
    ui.advance(60)
    assert said(screen) == []
    ui.tap(open_draft(ui))
    settle(screen, ui)
    assert screen.plan.form.draft == entered
    ui.tap(open_draft(ui))  # what was in the form has taken its place
    settle(screen, ui)
    assert screen.plan.form.draft == edited
    assert screen.plan.form.drafts == [entered]


def test_bringing_back_leads_to_the_scheduler(screen, container, ui):
    choose(screen, ui, "Mission", KITS)
    entered = screen.plan.form.draft
    screen.plan.edit(named(container, "Night stock count", "Aino").id)
    screen.shell.go("home")
    ui.advance()
    ui.tap(ui.find(root=ui.find(Snackbar), text="Open the draft"))
    settle(screen, ui)
    assert screen.shell.navigator.current == "scheduler"
    assert screen.plan.form.draft == entered
    assert screen.plan.form.drafts == []


def test_a_time_that_a_finger_on_free_time_has_begun_is_no_entry(screen, container, ui):
    plan = screen.plan
    for _each in range(2):
        plan.begin_at(named(container, KITS, "Aino").robot_id, 8.0)
    plan.edit(named(container, "Night stock count", "Aino").id)
    assert said(screen) == []
    plan.begin_at(named(container, KITS, "Aino").robot_id, 8.0)
    plan.form.set(priority=3)
    plan.edit(named(container, "Night stock count", "Aino").id)
    assert said(screen) == [DRAFTS_KEPT.format("New schedule")]


def test_entries_made_before_a_finger_set_the_time_count(screen, container, ui):
    plan, aino = screen.plan, named(container, KITS, "Aino").robot_id
    plan.form.set(priority=3)
    plan.begin_at(aino, 8.0)
    assert (plan.form.draft.priority, said(screen)) == (3, [])
    plan.edit(named(container, "Night stock count", "Aino").id)
    assert said(screen) == [DRAFTS_KEPT.format("New schedule")]
    plan.begin_at(aino, 8.0)  # in the place of a schedule in which nothing was changed
    plan.edit(named(container, "Night stock count", "Aino").id)
    assert [draft.priority for draft in plan.form.drafts] == [3]


def test_touching_free_time_of_a_robot_puts_entries_for_a_group_aside(screen, container, ui):
    """It is meant for any of them: a touch does not aim it at one."""
    plan, aino = screen.plan, named(container, KITS, "Aino").robot_id
    group = container.catalogue.save_group(Group("Hall 1", (aino,)))
    settle(screen, ui)
    plan.form.set(group_id=group.id, robot_id=None, finish_by_minutes=30)
    plan.begin_at(aino, 8.0)
    assert (plan.form.draft.target, said(screen)) == (aino, [DRAFTS_KEPT.format("New schedule")])
    assert [(draft.group_id, draft.finish_by_minutes) for draft in plan.form.drafts] == [(group.id, 30)]
