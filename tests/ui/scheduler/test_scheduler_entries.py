"""What was entered in the form and not saved, when something else is put into it."""
from __future__ import annotations

from app.widgets.buttons import Segment
from app.widgets.snackbar import Snackbar
from tests.ui.planner import KITS, choose, field, kind, menu, named, save, settle

PUT_ASIDE = "What was entered and not saved is put aside"


def said(app) -> list[str]:
    return app.shell.snackbars.texts


def test_entries_that_another_schedule_takes_the_place_of_are_brought_back(screen, container, ui):
    choose(screen, ui, "Mission", KITS)
    kind(screen, ui, "Weekly")
    entered = screen.plan.form.draft
    menu(screen, ui, named(container, "Collect empties", "Veikko"), "Edit")
    assert said(screen) == [PUT_ASIDE]
    ui.tap(ui.find(root=ui.find(Snackbar), text="Bring it back"))
    settle(screen, ui)
    assert screen.plan.form.draft == entered
    assert field(ui, "Mission").value == KITS
    assert ui.find(Segment, text="Weekly").selected
    assert said(screen) == []                                 # of the other one nothing was changed


def test_changes_of_a_schedule_are_brought_back_too_and_saved(screen, container, ui):
    veikko = named(container, "Collect empties", "Veikko")
    menu(screen, ui, veikko, "Edit")
    screen.plan.form.set(minimum_battery_percent=55.0)
    menu(screen, ui, named(container, KITS, "Aino"), "Duplicate")
    ui.tap(ui.find(root=ui.find(Snackbar), text="Bring it back"))
    settle(screen, ui)
    assert screen.plan.form.editing == veikko.id
    save(screen, ui)
    assert container.repositories.schedules.get(container.db.read(), veikko.id).minimum_battery_percent == 55


def test_nothing_is_put_aside_where_nothing_was_entered(screen, container, ui):
    menu(screen, ui, named(container, KITS, "Aino"), "Edit")
    menu(screen, ui, named(container, "Collect empties", "Veikko"), "Edit")
    assert said(screen) == []
