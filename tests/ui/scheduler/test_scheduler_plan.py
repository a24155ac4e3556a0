"""What is planned, as an operator uses it: the schedules that are there, the timeline and its list."""
from __future__ import annotations

from dataclasses import replace
from datetime import time

import pytest

from app.domain.models import ReasonCode, State
from app.screens.scheduler.cards import FormCard, SchedulesCard
from app.screens.scheduler.listed import QUIET_S
from app.widgets.buttons import IconButton, Toggle
from app.widgets.fields import SearchField
from app.widgets.long_list import LongList
from app.widgets.plan_rows import ScheduleLine
from app.widgets.rows import OptionRow
from app.widgets.snackbar import Snackbar
from tests.support import month
from tests.ui import checks
from tests.ui.planner import (
    KITS,
    WASTE,
    card_of,
    choose,
    kind,
    menu,
    named,
    pick_time,
    press,
    save,
    save_button,
    schedules,
    settle,
    show_anew,
    take,
)


# ---------------------------------------------------------------------- schedules that are there
def test_editing_keeps_identity_and_history(screen, container, ui):
    schedule = named(container, WASTE, "Veikko")
    rows_before = container.history.last_of_schedule(schedule.id)
    screen.plan.edit(schedule.id)
    settle(screen, ui)
    assert ui.find(FormCard).view.title == "Edit schedule"
    assert save_button(ui).text == "Save changes"
    pick_time(screen, ui, "Time", "1800")
    save(screen, ui)
    after = container.repositories.schedules.get(container.db.read(), schedule.id)
    assert (after.start.time(), after.recurrence, after.name) == (time(18), schedule.recurrence, schedule.name)
    assert container.history.last_of_schedule(schedule.id) == rows_before
    assert len(schedules(container)) == len(month.SCHEDULED)


def test_a_row_opens_its_schedule_and_the_cross_leaves_it(screen, container, ui):
    line = ui.find_all(ScheduleLine)[0]
    ui.tap_at(*line.to_window(line.center_x - 40, line.center_y))
    settle(screen, ui)
    assert screen.plan.form.editing == line.key
    assert line.selected
    ui.tap(ui.find(IconButton, ui.find(FormCard), icon="close"))
    settle(screen, ui)
    assert screen.plan.form.editing is None


def test_the_switch_turns_a_schedule_off_and_on(screen, container, ui):
    line = ui.find_all(ScheduleLine)[0]
    number = line.key
    ui.tap(ui.find(Toggle, line))
    settle(screen, ui)
    assert not container.repositories.schedules.get(container.db.read(), number).enabled
    assert next(data for data in screen.plan.listed.rows if data.key == number).next.endswith("switched off")
    screen.plan.actions.switch(number, True)
    settle(screen, ui)
    assert container.repositories.schedules.get(container.db.read(), number).next_at is not None


def test_skip_next_leaves_one_start_out_with_its_row(screen, container, ui):
    schedule = named(container, KITS, "Aino")
    menu(screen, ui, schedule, "Skip next")
    last = container.history.last_of_schedule(schedule.id)
    assert (last.state, last.reason.code, last.planned_at) == (State.SKIPPED, ReasonCode.HOLD, schedule.next_at)
    assert container.repositories.schedules.get(container.db.read(), schedule.id).next_at > schedule.next_at
    ui.tap(ui.find(root=ui.find(Snackbar), text="Undo"))
    settle(screen, ui)
    assert container.history.last_of_schedule(schedule.id).planned_at < schedule.next_at
    assert container.repositories.schedules.get(container.db.read(), schedule.id).next_at == schedule.next_at


def test_the_list_keeps_its_order_while_somebody_works_in_it(screen, container, ui, monkeypatch):
    monkeypatch.setattr(screen.plan.listed._quiet, "timeout", quiet := 10 * QUIET_S)  # a busy machine draws many frames while it reads

    def order() -> list[int]:
        settle(screen, ui)
        return [data.key for data in screen.plan.listed.rows]

    schedule, before = named(container, KITS, "Aino"), order()
    assert before[0] == schedule.id
    menu(screen, ui, schedule, "Skip next")
    assert order() == before
    assert next(data for data in screen.plan.listed.rows if data.key == schedule.id).next == "Aino · in 1 h 22 min"
    screen.plan.row_action(before[1], "switch", False)                # a switch that is pressed again is the same one
    assert order() == before
    other = container.catalogue.save_schedule(replace(schedule, id=0, name="New"))
    assert [key for key in order() if key != other.id] == before
    ui.skip(quiet / 2)
    ui.wheel(ui.find(LongList, ui.find(SchedulesCard)), 1)            # still at it
    ui.skip(quiet / 2 + 1)
    assert [key for key in order() if key != other.id] == before
    ui.skip(quiet)
    assert order().index(before[1]) > len(before) - 2                 # those that are off come last
    assert order().index(schedule.id) > 0


@pytest.mark.parametrize("way", ["filtered", "shown again"])
def test_a_list_that_is_looked_at_anew_has_its_order_by_next_start(screen, container, ui, way):
    schedule, before = named(container, KITS, "Aino"), [data.key for data in screen.plan.listed.rows]
    menu(screen, ui, schedule, "Skip next")
    settle(screen, ui)
    assert [data.key for data in screen.plan.listed.rows] == before
    if way == "filtered":
        screen.plan.listed.set(query="a")
    else:
        show_anew(screen, ui)
    settle(screen, ui)
    after = [data.key for data in screen.plan.listed.rows]
    assert after[0] != schedule.id
    assert schedule.id in after


def test_a_menu_says_what_it_is_about(screen, container, ui):
    own = container.catalogue.save_schedule(replace(named(container, WASTE, "Veikko"), name="Morning round"))
    settle(screen, ui)
    for about, words in ((named(container, KITS, "Aino"), [KITS, "Aino"]), (own, ["Morning round", f"{WASTE} · Veikko"])):
        screen.plan.row_action(about.id, "menu", ui.find(SchedulesCard))
        assert ui.texts(card_of(ui))[:2] == words
        screen.shell.dialogs.close_all()
        ui.advance(.3)
    ui.tap(ui.find(IconButton, ui.find(SchedulesCard), icon="sort-clock-ascending-outline"))
    assert ui.texts(card_of(ui))[0] == "Order of the schedules"


def test_the_menu_opens_a_schedule_for_editing(screen, container, ui):
    schedule = named(container, KITS, "Aino")
    menu(screen, ui, schedule, "Edit")
    assert screen.plan.form.editing == schedule.id


def test_run_now_starts_it_whatever_its_time_is(screen, container, ui):
    schedule = named(container, KITS, "Aino")
    menu(screen, ui, schedule, "Run now")
    newest = container.history.open()[-1]
    assert (newest.mission, newest.robot, newest.state) == (KITS, "Aino", State.WAITING)
    ui.skip(5)                                                # nobody answers
    ui.wait(lambda: ui.find_all(Snackbar))
    assert ui.find(Snackbar).text == f"{KITS} waits for an answer of Aino, until 14:53 at most"


def test_duplicate_fills_the_form_with_the_same_and_saves_another(screen, container, ui):
    schedule = named(container, KITS, "Aino")
    menu(screen, ui, schedule, "Duplicate")
    assert ui.find(FormCard).view.title == "New schedule"
    save(screen, ui)
    copy = named(container, KITS, "Aino 2")
    assert (copy.recurrence, copy.between, copy.start) == (schedule.recurrence, schedule.between, schedule.start)


def test_delete_is_at_once_and_undo_brings_it_back(screen, container, ui):
    schedule = named(container, KITS, "Aino")
    menu(screen, ui, schedule, "Delete")
    assert schedule.id not in [s.id for s in schedules(container)]
    assert schedule.id not in [data.key for data in screen.plan.listed.rows]
    ui.skip(600)                                              # the offer stays until it is closed
    ui.tap(ui.find(root=ui.find(Snackbar), text="Undo"))
    settle(screen, ui)
    restored = container.repositories.schedules.get(container.db.read(), schedule.id)
    assert (restored.name, restored.recurrence, restored.next_at) == (schedule.name, schedule.recurrence, schedule.next_at)


def listed(ui) -> list[str]:
    return [line.mission for line in sorted(ui.find_all(ScheduleLine), key=lambda line: -line.to_window(0, line.y)[1])]


def test_the_schedules_are_searched_sorted_and_narrowed_to_a_robot(screen, container, ui):
    assert listed(ui)[0] == KITS
    ui.tap(ui.find(IconButton, icon="sort-clock-ascending-outline"))
    ui.advance(.3)
    take(screen, ui, "By name")
    assert [data.mission for data in screen.plan.listed.rows] == sorted(month.SCHEDULED)
    ui.tap(ui.find(IconButton, root=ui.find(SchedulesCard), icon="robot-outline"))
    ui.advance(.3)
    ui.tap(ui.find(OptionRow, text="Veikko"))
    settle(screen, ui)
    assert listed(ui) == ["Collect empties", "Floor wash, hall A", WASTE]
    assert "Veikko · 2 of 3 on" in ui.texts(ui.find(SchedulesCard))
    ui.tap(ui.find(IconButton, root=ui.find(SchedulesCard), icon="magnify"))
    ui.advance(.2)
    ui.type(ui.find(SearchField, ui.find(SchedulesCard)), "first mon")      # of the rule
    ui.advance(.2)
    assert listed(ui) == ["Floor wash, hall A"]
    screen.shell.go("logs")
    screen.shell.go("scheduler")
    settle(screen, ui)
    assert listed(ui) == ["Floor wash, hall A"]               # kept while the app runs
    ui.tap(ui.find(IconButton, root=ui.find(SchedulesCard), icon="magnify"))
    settle(screen, ui)
    assert not ui.find_all(SearchField, root=ui.find(SchedulesCard))
    assert len(listed(ui)) == 3                               # without the field nothing is searched for


def test_a_row_is_hardly_over_72_dp_high_and_a_list_of_few_has_no_tools(screen, container, ui):
    heights = {line.height for line in ui.find_all(ScheduleLine)}
    assert min(heights) == 72
    assert max(heights) < 90                                  # a long rule has two lines
    for schedule in schedules(container)[:4]:
        container.catalogue.remove_schedule(schedule.id)
    settle(screen, ui)
    assert not ui.find_all(IconButton, root=ui.find(SchedulesCard), icon="robot-outline")


def test_what_changes_elsewhere_shows_at_once(screen, container, ui):
    schedule = named(container, KITS, "Aino")
    container.catalogue.remove_schedule(schedule.id)
    settle(screen, ui)
    assert schedule.id not in [data.key for data in screen.plan.listed.rows]


def test_without_a_robot_the_screen_leads_to_settings(screen, container, ui):
    for robot in container.catalogue.robots():
        container.catalogue.remove_robot(robot.id)
    settle(screen, ui)
    press(screen, ui, "Add your first robot")
    assert screen.shell.navigator.current == "settings"


def test_nothing_overlaps_or_is_too_small(screen, ui):
    choose(screen, ui, "Mission", KITS)
    kind(screen, ui, "Weekly")
    assert checks.problems(screen.shell.navigator.screen("scheduler")) == []
