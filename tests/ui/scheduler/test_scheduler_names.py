"""Names of schedules: the one that a person entered, else mission and robot. The number that the app adds to equal
names would read as part of a robot's name."""

from __future__ import annotations

from dataclasses import replace
from datetime import timedelta

import pytest

from app.widgets.fields import Field
from tests.ui.planner import KITS, WASTE, card_of, choose, menu, named, press, save, schedules, settle, take, tap_bar

pytestmark = pytest.mark.long

SHOWN = "Deliver kits to line 2 on Aino"


@pytest.fixture
def second(screen, container, ui):
    """A second schedule of one mission on one robot: inside the app it is "… on Aino 2"."""
    first = named(container, KITS, "Aino")
    for other in schedules(container):
        if other.id != first.id:
            container.catalogue.remove_schedule(other.id)  # both are visible
    made = container.catalogue.save_schedule(
        replace(first, id=0, name="", start=first.start + timedelta(minutes=30), between=None)
    )
    settle(screen, ui)
    assert made.name == f"{SHOWN} 2"
    return made


def said(app) -> str:
    """By the newest message."""
    return app.shell.snackbars.texts[-1]


def test_a_second_schedule_of_a_mission_is_planned_and_changed_under_what_it_does(screen, container, ui, second):
    menu(screen, ui, second, "Duplicate")
    save(screen, ui)
    ui.wait(lambda: said(screen) == f"{SHOWN} is planned")
    screen.plan.edit(second.id)
    screen.plan.form.set(priority=1)
    settle(screen, ui)
    save(screen, ui)
    ui.wait(lambda: said(screen) == f"{SHOWN} is changed")
    assert container.repositories.schedules.get(container.db.read(), second.id).name == second.name


def test_messages_about_a_schedule_omit_the_number_too(screen, container, ui, second):
    menu(screen, ui, second, "Skip next")
    ui.wait(lambda: said(screen).startswith(f"The start of {SHOWN} is skipped: "))
    menu(screen, ui, second, "Pause until a day")
    press(screen, ui, "Set Sat 21 Nov")
    ui.wait(lambda: said(screen).startswith(f"{SHOWN} is paused until "))
    menu(screen, ui, second, "Resume now")
    ui.wait(lambda: said(screen) == f"{SHOWN} is resumed")
    menu(screen, ui, second, "Delete")
    ui.wait(lambda: said(screen) == f"{SHOWN} is deleted")


def test_a_name_that_a_person_gave_is_said_as_it_is(screen, container, ui, second):
    container.catalogue.save_schedule(replace(second, name="Night kits 2"))
    settle(screen, ui)
    menu(screen, ui, second, "Delete")
    ui.wait(lambda: said(screen) == "Night kits 2 is deleted")


def test_the_form_shows_no_made_name_and_what_is_made_follows_the_mission(screen, container, ui, second):
    screen.plan.edit(second.id)
    settle(screen, ui)
    screen.plan.form.more = True
    settle(screen, ui)
    name = ui.find(Field, label="Name")
    assert (name.text, name.hint) == ("", SHOWN)
    choose(screen, ui, "Mission", WASTE)
    save(screen, ui)
    assert next(one for one in schedules(container) if one.id == second.id).name == f"{WASTE} on Aino"


def test_a_generated_name_that_is_already_used_does_not_prevent_undo(screen, container, ui, second):
    removed = container.catalogue.remove_schedule(second.id)
    container.catalogue.save_schedule(replace(second, id=0, name=""))
    container.catalogue.restore(removed)
    assert next(one for one in schedules(container) if one.id == second.id).name == f"{SHOWN} 3"


def test_a_generated_name_that_is_restored_uses_the_new_names(screen, container, ui, second):
    removed = container.catalogue.remove_schedule(second.id)
    mission = next(mission for mission in container.catalogue.missions() if mission.id == second.mission_id)
    container.catalogue.save_mission(replace(mission, name="Bring kits"))
    container.catalogue.restore(removed)
    assert next(one for one in schedules(container) if one.id == second.id).name.startswith("Bring kits on Aino")


def test_a_start_taken_from_the_plan_is_called_so_as_well(screen, container, ui, second):
    tap_bar(ui, ("schedule", second.id))
    card_of(ui)
    take(screen, ui, "Skip")
    ui.wait(lambda: said(screen).startswith(f"The start of {SHOWN} is skipped: "))
