"""What is planned, as an operator uses it: the schedules that are there, the timeline and its list."""

from __future__ import annotations

from dataclasses import replace
from datetime import time

import pytest

from app.domain.execution import ReasonCode, State
from app.screens.scheduler.cards import FormSheet, ScheduleRow, SchedulesPage
from app.widgets.buttons import IconButton, MenuChip, Toggle
from app.widgets.choices import OptionRow
from app.widgets.fields import SearchField
from app.widgets.lists import KEPT
from app.widgets.long_list import LongList
from app.widgets.sheet import AskSheet
from app.widgets.snackbar import Snackbar
from tests.support import month
from tests.support.home_facts import FAILED
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
    row,
    said,
    save,
    schedules,
    settle,
    stored,
    tab,
    take,
)
from tests.ui.whole_app import standing


# ---------------------------------------------------------------------- schedules that are there
def test_editing_keeps_identity_and_history(screen, container, ui):
    schedule = named(container, WASTE, "Veikko")
    rows_before = container.history.last_of_schedule(schedule.id)
    screen.plan.edit(schedule.id)
    settle(screen, ui)
    assert ui.find(FormSheet).view.title == WASTE
    pick_time(screen, ui, "Time", 18, 0)
    save(screen, ui)
    after = container.repositories.schedules.get(container.db.read(), schedule.id)
    assert (after.start.time(), after.recurrence, after.name) == (time(18), schedule.recurrence, schedule.name)
    assert container.history.last_of_schedule(schedule.id) == rows_before
    assert len(schedules(container)) == len(month.SCHEDULED)


def test_a_row_opens_its_schedule_and_the_cross_leaves_it(screen, container, ui):
    tab(screen, ui, "schedules")
    ui.advance(1)  # rows that have just come take no tap
    line = ui.find_all(ScheduleRow)[0]
    ui.tap_at(*line.to_window(line.x + 200, line.center_y))
    settle(screen, ui)
    assert (screen.plan.form.editing, line.item.look) == (line.key, "chosen")
    ui.tap(ui.find(IconButton, ui.find(FormSheet), icon="close"))
    settle(screen, ui)
    assert (screen.plan.form.editing, screen.plan.form.is_open, line.item.look) == (None, False, "plain")


def test_another_schedule_opens_at_the_top_of_its_sheet(screen, container, ui):
    screen.plan.edit(named(container, WASTE, "Veikko").id)
    screen.plan.form.more = True
    settle(screen, ui)
    sheet = ui.find(FormSheet)
    sheet.ids.page.scroll_y = 0
    screen.plan.edit(named(container, KITS, "Aino").id)
    screen.plan.form.more = True
    settle(screen, ui)
    assert (sheet.view.title, sheet.ids.page.scroll_y) == (KITS, 1)


def test_the_switch_turns_a_schedule_off_and_on(screen, container, ui):
    tab(screen, ui, "schedules")
    line = ui.find_all(ScheduleRow)[0]
    number = line.key
    ui.tap(ui.find(Toggle, line))
    settle(screen, ui)
    assert not container.repositories.schedules.get(container.db.read(), number).enabled
    assert next(data for data in screen.plan.listed.rows if data.key == number).meta == "Off"
    screen.plan.actions.switch(number, True)
    settle(screen, ui)
    assert container.repositories.schedules.get(container.db.read(), number).next_at is not None


def test_only_the_last_word_about_a_switch_is_said(screen, ui):
    tab(screen, ui, "schedules")
    line = ui.find_all(ScheduleRow)[0]
    screen.plan.actions.switch(line.key, False)
    settle(screen, ui)
    (off,) = screen.shell.snackbars.texts
    assert off.endswith("is switched off")
    for on in (True, False, True):
        screen.plan.actions.switch(line.key, on)
        settle(screen, ui)
    assert screen.shell.snackbars.texts == [off.replace("switched off", "switched on")]


def test_a_switch_says_nothing_of_another_schedule(screen, ui):
    tab(screen, ui, "schedules")
    first, second = ui.find_all(ScheduleRow)[:2]
    for line in (first, second):
        screen.plan.actions.switch(line.key, False)
        settle(screen, ui)
    assert len(screen.shell.snackbars.texts) == 2  # both can be undone


def test_a_deleted_schedule_is_not_said_to_be_switched_off(screen, container, ui):
    schedule = schedules(container)[0]
    screen.plan.actions.switch(schedule.id, False)
    settle(screen, ui)
    screen.plan.actions.delete(schedule)
    settle(screen, ui)
    (said,) = screen.shell.snackbars.texts
    assert said.endswith("is deleted")


def test_a_start_that_is_planned_again_is_not_said_to_be_skipped(screen, container, ui):
    schedule = named(container, KITS, "Aino")
    screen.plan.actions.skip(schedule, schedule.next_at)
    settle(screen, ui)
    screen.plan.actions.unskip(schedule, schedule.next_at)
    settle(screen, ui)
    (said,) = screen.shell.snackbars.texts
    assert "is planned again" in said


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


def shown_order(ui) -> list[int]:
    return [row.key for row in ui.find(LongList, ui.find(SchedulesPage)).views]


def test_a_row_that_was_switched_stays_where_it_is_for_a_while(screen, container, ui):
    """A list by next start has those that are off at its end."""
    tab(screen, ui, "schedules")
    rows, before = ui.find(LongList, ui.find(SchedulesPage)), shown_order(ui)
    rows.kept._keep.timeout = 10 * KEPT  # a busy machine draws many frames while it reads
    ui.tap(ui.find(Toggle, ui.find(ScheduleRow, key=before[1])))
    settle(screen, ui)
    assert before[1] in [data.key for data in screen.plan.listed.rows[-2:]]
    assert shown_order(ui) == before
    ui.skip(10 * KEPT)
    settle(screen, ui)
    assert shown_order(ui) == [data.key for data in screen.plan.listed.rows] != before


def test_a_list_that_is_sorted_otherwise_is_so_at_once(screen, container, ui):
    tab(screen, ui, "schedules")
    rows, before = ui.find(LongList, ui.find(SchedulesPage)), shown_order(ui)
    ui.tap(ui.find(Toggle, ui.find(ScheduleRow, key=before[1])))
    settle(screen, ui)
    screen.plan.listed.set(by_name=True)
    settle(screen, ui)
    assert shown_order(ui) == [data.key for data in screen.plan.listed.rows][: len(rows.views)]


@pytest.mark.parametrize("is_on", [False, True])
def test_a_switch_says_what_it_did_and_undo_puts_it_back(screen, container, ui, is_on):
    schedule = container.catalogue.save_schedule(replace(named(container, KITS, "Aino"), enabled=not is_on))
    tab(screen, ui, "schedules")
    ui.advance(1)  # rows that have moved take no tap for a moment
    ui.tap(ui.find(Toggle, row(ui, schedule)))
    ui.wait(lambda: said(screen))
    words = f"Deliver kits to line 2 on Aino is switched {'on' if is_on else 'off'}"
    assert (said(screen), stored(container, schedule).enabled) == ([words], is_on)
    ui.tap(ui.find(root=ui.find(Snackbar), text="Undo"))
    settle(screen, ui)
    assert stored(container, schedule).enabled is not is_on


def test_a_menu_says_what_it_is_about(screen, container, ui):
    own = container.catalogue.save_schedule(replace(named(container, WASTE, "Veikko"), name="Morning round"))
    tab(screen, ui, "schedules")
    for about, words in (
        (named(container, KITS, "Aino"), [KITS, "Aino"]),
        (own, ["Morning round", f"{WASTE} · Veikko"]),
    ):
        screen.plan.row_action(about.id, "menu", ui.find(SchedulesPage))
        assert ui.texts(card_of(ui))[:2] == words
        screen.shell.dialogs.close_all()
        ui.advance(0.3)
    ui.tap(ui.find(MenuChip, ui.find(SchedulesPage), text="By next start"))
    assert ui.texts(card_of(ui))[0] == "Order of the schedules"


def test_the_menu_opens_a_schedule_for_editing(screen, container, ui):
    schedule = named(container, KITS, "Aino")
    menu(screen, ui, schedule, "Edit")
    assert screen.plan.form.editing == schedule.id


def test_run_now_starts_it_whatever_its_time_is(screen, container, ui):
    schedule = named(container, KITS, "Aino")
    before = container.history.open()
    menu(screen, ui, schedule, "Run now")
    assert (ui.find(AskSheet).title, container.history.open()) == (f"Run {KITS} on Aino now?", before)
    press(screen, ui, "Run now")
    newest = container.history.open()[-1]
    assert (newest.mission, newest.robot, newest.state) == (KITS, "Aino", State.WAITING)
    ui.skip(5)  # no robot answers
    ui.wait(lambda: ui.find_all(Snackbar))
    assert ui.find(Snackbar).text == f"{KITS}: no answer from Aino, tried until 14:53"


def test_run_now_is_not_offered_while_the_robot_is_stopped(screen, container, ui):
    schedule = named(container, KITS, "Aino")
    before = container.history.open()
    with standing(container, schedule.robot_id, FAILED):
        ui.wait(lambda: schedule.robot_id in screen.plan._facts.stopped)
        menu(screen, ui, schedule, "Aino is stopped")
    assert container.history.open() == before


def test_duplicate_fills_the_form_with_the_same_and_saves_another(screen, container, ui):
    schedule = named(container, KITS, "Aino")
    menu(screen, ui, schedule, "Duplicate")
    assert ui.find(FormSheet).view.title == "New schedule"
    save(screen, ui)
    copy = named(container, KITS, "Aino 2")
    assert (copy.recurrence, copy.between, copy.start) == (schedule.recurrence, schedule.between, schedule.start)


def test_delete_is_at_once_and_undo_brings_it_back(screen, container, ui):
    schedule = named(container, KITS, "Aino")
    menu(screen, ui, schedule, "Delete")
    assert schedule.id not in [s.id for s in schedules(container)]
    assert schedule.id not in [data.key for data in screen.plan.listed.rows]
    ui.tap(ui.find(root=ui.find(Snackbar), text="Undo"))
    settle(screen, ui)
    restored = container.repositories.schedules.get(container.db.read(), schedule.id)
    assert (restored.name, restored.recurrence, restored.next_at) == (
        schedule.name,
        schedule.recurrence,
        schedule.next_at,
    )


def listed(ui) -> list[str]:
    rows = sorted(ui.find_all(ScheduleRow), key=lambda line: -line.to_window(0, line.y)[1])
    return [line.item.title for line in rows]


def test_the_schedules_are_searched_sorted_and_narrowed_to_a_robot(screen, container, ui):
    tab(screen, ui, "schedules")
    page = ui.find(SchedulesPage)
    assert listed(ui)[0] == KITS
    ui.tap(ui.find(MenuChip, page, text="By next start"))
    ui.advance(0.3)
    take(screen, ui, "By name")
    assert [data.title for data in screen.plan.listed.rows] == sorted(month.SCHEDULED)
    ui.tap(ui.find(MenuChip, page, text="Robot"))
    ui.advance(0.3)
    ui.tap(ui.find(OptionRow, title="Veikko"))
    settle(screen, ui)
    assert listed(ui) == ["Collect empties", "Floor wash, hall A", WASTE]
    assert ui.find(MenuChip, page, text="Veikko").active
    ui.tap(ui.find(IconButton, page, icon="magnify"))
    ui.advance(0.2)
    ui.type(ui.find(SearchField, page), "first mon")  # of the rule
    ui.advance(0.2)
    assert listed(ui) == ["Floor wash, hall A"]
    screen.shell.go("logs")
    screen.shell.go("scheduler")
    settle(screen, ui)
    assert listed(ui) == ["Floor wash, hall A"]  # kept while the app runs
    ui.tap(ui.find(IconButton, page, icon="magnify"))
    settle(screen, ui)
    assert not ui.find_all(SearchField, page)
    assert len(listed(ui)) == 3  # without the field nothing is searched for


def test_ten_rows_are_seen_and_a_list_of_few_has_no_tools(screen, container, ui):
    tab(screen, ui, "schedules")
    heights = {line.height for line in ui.find_all(ScheduleRow)}
    assert heights == {60}
    assert ui.find(LongList, ui.find(SchedulesPage)).height >= 600
    for schedule in schedules(container)[:4]:
        container.catalogue.remove_schedule(schedule.id)
    settle(screen, ui)
    assert not [chip for chip in ui.find_all(MenuChip, ui.find(SchedulesPage)) if chip.visible]


def test_changes_made_elsewhere_show_at_once(screen, container, ui):
    schedule = named(container, KITS, "Aino")
    container.catalogue.remove_schedule(schedule.id)
    settle(screen, ui)
    assert schedule.id not in [data.key for data in screen.plan.listed.rows]


def test_without_a_robot_the_screen_leads_to_settings(screen, container, ui):
    for robot in container.catalogue.robots():
        container.catalogue.remove_robot(robot.id)
    settle(screen, ui)
    ui.advance(0.5)
    press(screen, ui, "Add your first robot")
    assert screen.shell.navigator.current == "settings"


def test_nothing_overlaps_or_is_too_small(screen, ui):
    choose(screen, ui, "Mission", KITS)
    kind(screen, ui, "Weekly")
    assert checks.problems(screen.shell.navigator.screen("scheduler")) == []
