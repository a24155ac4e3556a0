"""The schedule, robot or mission in the form is deleted or restored while the form is open."""

from __future__ import annotations

from zoneinfo import ZoneInfo

import pytest

from app.domain.models import Group, InvalidInput, Schedule
from app.widgets.flow import ParameterFields
from tests.ui.planner import KITS, PALLETS, choose, field, new, said, save, save_button, schedules, settle, stock

pytestmark = pytest.mark.long


# ---------------------------------------------------------------------- what it names
@pytest.mark.parametrize("what", ["Mission", "Robot"])
def test_a_deleted_choice_must_be_chosen_again_unless_it_is_restored(screen, container, ui, what):
    catalogue = container.catalogue
    choose(screen, ui, "Mission", KITS)
    screen.plan.form.set(priority=3)
    draft, chosen = screen.plan.form.draft, field(ui, what).value
    removed = (
        catalogue.remove_mission(draft.mission_id) if what == "Mission" else catalogue.remove_robot(draft.robot_id)
    )
    settle(screen, ui)
    word = f"Choose a {what.lower()}"
    assert (field(ui, what).value, screen.plan.form.view.why, save_button(ui).disabled) == (word, word, True)
    catalogue.restore(removed)
    settle(screen, ui)
    assert (field(ui, what).value, save_button(ui).disabled) == (chosen, False)
    save(screen, ui)


def test_so_is_a_group(screen, container, ui):
    group = container.catalogue.save_group(Group("Hall", tuple(robot.id for robot in container.catalogue.robots())))
    settle(screen, ui)
    choose(screen, ui, "Mission", KITS)
    choose(screen, ui, "Robot", "Any of Hall")
    container.catalogue.remove_group(group.id)
    settle(screen, ui)
    assert (screen.plan.form.view.why, save_button(ui).disabled) == ("Choose a robot", True)


# ---------------------------------------------------------------------- the schedule itself
def test_a_missing_schedule_that_should_be_shown_is_not_shown_later(screen, container, ui):
    removed = container.catalogue.remove_schedule(stock(container).id)
    settle(screen, ui)
    screen.shell.go("scheduler", schedule_id=removed.ids[Schedule][0])
    settle(screen, ui)
    choose(screen, ui, "Mission", KITS)
    container.catalogue.restore(removed)
    settle(screen, ui)
    assert screen.plan.form.draft.is_new


# ---------------------------------------------------------------------- a refusal whose reason ended
def test_a_refused_schedule_can_be_saved_with_another_parameter(screen, container, ui, monkeypatch):
    monkeypatch.setattr(container.robot_missions, "parameters", lambda _robot_id, _guid: (PALLETS,))
    choose(screen, ui, "Mission", KITS)

    def refuse(_schedule):
        raise InvalidInput("parameters", "Choose another value")

    with monkeypatch.context() as patch:
        patch.setattr(container.catalogue, "save_schedule", refuse)
        save(screen, ui)
    assert save_button(ui).disabled
    ui.find(ParameterFields).children[0].text = "9"
    settle(screen, ui)
    save(screen, ui)
    assert [schedule.parameters for schedule in schedules(container) if schedule.parameters] == [{"count": 9}]


# ---------------------------------------------------------------------- nothing was entered
def test_an_untouched_form_follows_what_it_proposes(screen, container, ui):
    new(screen, ui)
    form = screen.plan.form
    container.catalogue.remove_robot(form.draft.robot_id)
    container.catalogue.change_settings(timezone="Asia/Tokyo")
    container.clock.step(3 * 3600)
    screen.plan._refresher.request()
    settle(screen, ui)
    local = container.clock.now().astimezone(ZoneInfo("Asia/Tokyo")).replace(tzinfo=None)
    assert (container.catalogue.robot(form.draft.robot_id).enabled, form.draft.timezone) == (True, "Asia/Tokyo")
    assert form.draft.start > local
    form.put_aside()
    assert said(screen) == []
