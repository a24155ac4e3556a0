"""What was entered in the form and not saved, when something else is put into it."""

from __future__ import annotations

from app.domain.models import Group
from app.screens.scheduler.cards import FormSheet
from app.widgets.buttons import IconButton, Segment
from app.widgets.snackbar import Snackbar
from tests.ui.planner import KITS, bring_back, choose, field, kind, menu, named, new, save, settle

STOCK, NOT_SAVED = "Night stock count on Aino", "{}: not saved"


def said(app) -> list[str]:
    return app.shell.snackbars.texts


def test_entries_that_another_schedule_takes_the_place_of_are_brought_back(screen, container, ui):
    choose(screen, ui, "Mission", KITS)
    kind(screen, ui, "Weekly")
    entered = screen.plan.form.draft
    menu(screen, ui, named(container, "Collect empties", "Veikko"), "Edit")
    ui.tap(ui.find(root=ui.find(Snackbar), text="Undo"))
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
    ui.tap(ui.find(root=ui.find(Snackbar), text="Undo"))
    settle(screen, ui)
    assert screen.plan.form.editing == veikko.id
    save(screen, ui)
    assert container.repositories.schedules.get(container.db.read(), veikko.id).minimum_battery_percent == 55


def test_what_was_not_saved_is_not_offered_beside_what_was_saved_later(screen, container, ui):
    veikko = named(container, "Collect empties", "Veikko")
    for battery in (55.0, 60.0):
        menu(screen, ui, veikko, "Edit")
        screen.plan.form.set(minimum_battery_percent=battery)
        if battery == 55.0:
            screen.plan.form.put_aside()
    assert said(screen) == [NOT_SAVED.format("Collect empties on Veikko")]
    save(screen, ui)
    assert said(screen) == ["Collect empties on Veikko is changed"]


def test_nothing_is_put_aside_where_nothing_was_entered(screen, container, ui):
    menu(screen, ui, named(container, KITS, "Aino"), "Edit")
    menu(screen, ui, named(container, "Collect empties", "Veikko"), "Edit")
    assert said(screen) == []


def test_bringing_back_leads_to_the_scheduler(screen, container, ui):
    choose(screen, ui, "Mission", KITS)
    entered = screen.plan.form.draft
    screen.plan.edit(named(container, "Night stock count", "Aino").id)
    screen.shell.go("home")
    ui.advance()
    ui.tap(ui.find(root=ui.find(Snackbar), text="Undo"))
    settle(screen, ui)
    assert screen.shell.navigator.current == "scheduler"
    assert screen.plan.form.draft == entered


def begin(plan, container) -> None:
    """A finger on free time of Aino, this evening."""
    plan.free = named(container, KITS, "Aino").robot_id, 8.0
    plan.begin_free()


def test_the_cross_closes_the_form_and_undo_brings_back_what_was_entered(screen, container, ui):
    choose(screen, ui, "Mission", KITS)
    entered = screen.plan.form.draft
    cross = ui.find(IconButton, ui.find(FormSheet), icon="close")
    ui.tap(cross)
    settle(screen, ui)
    assert (screen.plan.form.is_open, said(screen)) == (False, [NOT_SAVED.format(KITS)])
    bring_back(screen, ui)
    assert (screen.plan.form.is_open, screen.plan.form.draft) == (True, entered)
    save(screen, ui)
    assert said(screen) == [f"{KITS} on Aino is planned"]


def test_the_cross_of_an_untouched_form_says_nothing(screen, container, ui):
    new(screen, ui)
    ui.tap(ui.find(IconButton, ui.find(FormSheet), icon="close"))
    settle(screen, ui)
    assert (screen.plan.form.is_open, said(screen)) == (False, [])


def test_opening_the_same_schedule_again_changes_nothing(screen, container, ui):
    stock = named(container, "Night stock count", "Aino")
    screen.plan.edit(stock.id)
    screen.plan.form.set(priority=2)
    screen.plan.edit(stock.id)
    assert (screen.plan.form.draft.priority, said(screen)) == (2, [])


def test_a_time_that_a_finger_on_free_time_has_begun_is_no_entry(screen, container, ui):
    plan = screen.plan
    for _each in range(2):
        begin(plan, container)
    plan.edit(named(container, "Night stock count", "Aino").id)
    assert said(screen) == []
    begin(plan, container)
    plan.form.set(priority=3)
    plan.edit(named(container, "Night stock count", "Aino").id)
    assert said(screen) == [NOT_SAVED.format("New schedule")]


def test_entries_made_before_a_finger_set_the_time_count(screen, container, ui):
    plan = screen.plan
    plan.begin()
    plan.form.set(priority=3)
    begin(plan, container)
    assert (plan.form.draft.priority, said(screen)) == (3, [])
    plan.edit(named(container, "Night stock count", "Aino").id)
    assert said(screen) == [NOT_SAVED.format("New schedule")]
    begin(plan, container)  # in the place of a schedule in which nothing was changed
    plan.edit(named(container, "Night stock count", "Aino").id)


def test_touching_free_time_of_a_robot_puts_entries_for_a_group_aside(screen, container, ui):
    """It is meant for any of them: a touch does not aim it at one."""
    plan, aino = screen.plan, named(container, KITS, "Aino").robot_id
    group = container.catalogue.save_group(Group("Hall 1", (aino,)))
    settle(screen, ui)
    plan.begin()
    plan.form.set(group_id=group.id, robot_id=None, finish_by_minutes=30)
    begin(plan, container)
    assert (plan.form.draft.target, said(screen)) == (aino, [NOT_SAVED.format("New schedule")])
