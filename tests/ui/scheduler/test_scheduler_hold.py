"""Holding back, pausing and resuming, and the plan as a file, by taps: at the invented plant on Friday 20 Nov 2026, 14:38."""

from __future__ import annotations

from datetime import UTC, date, datetime, time, timedelta

from icalendar import Calendar

from app.domain.execution import State
from app.domain.models import DayException
from app.screens.scheduler.cards import PlanPage, ScheduleRow
from app.screens.scheduler.hold import HoldSheet
from app.services.live.holds import Holds
from app.services.live.tablet import IS_COPY
from app.widgets.buttons import ChoiceChip, CommandButton, IconButton
from app.widgets.choices import ChoiceSheet, OptionRow
from app.widgets.fields import Field, FieldHelp
from app.widgets.frame import Frame
from app.widgets.lanes import Lanes
from app.widgets.long_list import LongList
from app.widgets.menu import MenuRow
from app.widgets.month import MonthDay
from app.widgets.pickers import DateSheet, TimeCell, TimeSheet
from app.widgets.sheet import FOOT_RESTS
from app.widgets.snackbar import Snackbar
from tests.support.edits import add_days
from tests.support.planner import insert_due
from tests.ui.checks import is_seen
from tests.ui.planner import (
    KITS,
    card_of,
    choose,
    menu,
    named,
    pick_day,
    press,
    rebuild_scheduler,
    row,
    save,
    settle,
    tab,
    take,
)

NOW = datetime(2026, 11, 20, 12, 38, tzinfo=UTC)


def chip(app, ui, word: str) -> None:
    ui.tap(ui.find(ChoiceChip, root=ui.find(HoldSheet), text=word))
    settle(app, ui)


def hold_all(app, ui) -> None:
    """The sheet, about all robots."""
    press(app, ui, "Hold")
    assert ui.find(HoldSheet).robot == "All robots"


def line(app, schedule) -> str:
    """When it starts next and why not earlier, as its row says."""
    row = next(row for row in app.plan.listed.rows if row.key == schedule.id)
    return " · ".join(filter(None, (row.lead, row.support.partition(" · ")[2])))


def reveal(ui, schedule) -> None:
    """Scroll down the list until its row is there."""
    schedules = next(parent for parent in ui.find(ScheduleRow).walk_reverse() if isinstance(parent, LongList))
    for n in range(11):
        schedules.scroll_y = 1 - n / 10
        ui.advance(0.3)
        if any(
            row.key == schedule.id and schedules.collide_point(*schedules.parent.to_widget(*row.to_window(*row.center)))
            for row in ui.find_all(ScheduleRow)
        ):
            return


# ---------------------------------------------------------------------- holding
def test_everything_is_held_with_a_reason_until_the_banner_releases_it(screen, container, ui):
    hold_all(screen, ui)
    chip(screen, ui, "Cleaning")
    ui.tap(ui.find(CommandButton, root=ui.find(HoldSheet), text="Hold"))
    settle(screen, ui)
    [hold] = container.holds.current()
    assert (hold.reason, hold.until, hold.robot_id) == ("Cleaning", container.clock.now() + timedelta(hours=1), None)
    assert ui.find(Snackbar).text == "All robots on hold until 15:38"
    frame = ui.find(Frame)
    ui.wait(lambda: frame.banner.text == "All robots on hold until 15:38 · Cleaning" and frame.has_banner)
    schedule = named(container, KITS, "Aino")
    assert line(screen, schedule) == "15:00 · not run: on hold until 15:38"
    again = Holds(container.db, container.clock, container.changes)  # as after a restart
    assert again.current() == [hold]
    ui.tap(ui.find(CommandButton, root=frame, text="Release"))
    settle(screen, ui)
    assert screen.shell.snackbars.texts == ["No longer on hold"]  # and not that nothing is sent
    ui.wait(lambda: not container.holds.current() and line(screen, schedule) == "15:00")
    ui.tap(ui.find(root=ui.find(Snackbar), text="Undo"))
    settle(screen, ui)
    [back] = container.holds.current()
    assert (back.reason, back.until, back.robot_id) == (hold.reason, hold.until, None)


def test_late_in_the_evening_a_time_is_proposed_that_is_still_to_come(screen, container, ui):
    container.clock.step((datetime(2026, 11, 20, 21, 16, tzinfo=UTC) - container.clock.now()).total_seconds())
    hold_all(screen, ui)
    chip(screen, ui, "Until a time")
    press(screen, ui, "Set Sat 21 Nov")
    press(screen, ui, "Set 01:00")
    assert ui.find(ChoiceChip, text="Until Sat 21 Nov 01:00").active
    chip(screen, ui, "Until Sat 21 Nov 01:00")
    ui.tap(ui.find(CommandButton, root=ui.find(DateSheet), text="Today"))
    press(screen, ui, "Set Fri 20 Nov")
    assert ui.find(TimeSheet).text == "23:59"


def test_an_end_that_has_passed_is_refused_in_sight_each_time(screen, container, ui):
    hold_all(screen, ui)
    sheet = ui.find(HoldSheet)
    sheet._time_chosen(date(2026, 11, 20), time(14, 0))
    sheet.padding = 0, 0, 0, 200  # a low window
    ui.advance(0.3)
    for _n in range(2):
        sheet.ids.page.scroll_y = 1
        ui.advance(FOOT_RESTS)
        assert sheet.ids.page.do_scroll_y
        ui.tap(ui.find(CommandButton, root=sheet, text="Hold"))
        settle(screen, ui)
        assert is_seen(ui.find(FieldHelp, sheet, text="Choose a time in the future"))
    assert container.holds.current() == []


def test_one_robot_is_held_until_a_time_that_is_picked(screen, container, ui):
    press(screen, ui, "Hold")
    dialog = ui.find(HoldSheet)
    ui.tap(ui.find(Field, root=dialog, label="What to hold"))
    ui.tap(ui.find(OptionRow, root=ui.find(ChoiceSheet), title="Veikko"))
    settle(screen, ui)
    ui.type(dialog.ids.reason_field, "Wheel change")
    chip(screen, ui, "Until a time")
    ui.tap(ui.find(MonthDay, root=ui.find(DateSheet), day=date(2026, 11, 23)))
    press(screen, ui, "Set Mon 23 Nov")
    for cell in ("06", "30"):
        ui.tap(ui.find(TimeCell, text=cell))
    settle(screen, ui)
    assert ui.find(ChoiceChip, root=dialog, text="Until Mon 23 Nov 06:30").active
    ui.tap(ui.find(CommandButton, root=dialog, text="Hold"))
    settle(screen, ui)
    [hold] = container.holds.current()
    veikko = next(robot for robot in container.repositories.robots.all(container.db.read()) if robot.name == "Veikko")
    assert (hold.robot_id, hold.reason, hold.until) == (
        veikko.id,
        "Wheel change",
        datetime(2026, 11, 23, 4, 30, tzinfo=UTC),
    )
    ui.wait(lambda: ui.find(Frame).banner.text.startswith("Veikko on hold until "))


def test_the_plan_says_until_when_everything_is_held_and_the_banner_releases_it(screen, container, ui):
    container.holds.hold("Maintenance", container.clock.now() + timedelta(hours=3))
    settle(screen, ui)
    assert [band.text for band in ui.find(Lanes).bands if band.kind == "held"] == ["On hold until 17:38 · Maintenance"]
    assert not [button for button in ui.find_all(CommandButton, text="Hold") if button.visible]
    ui.wait(lambda: ui.find_all(CommandButton, root=ui.find(Frame), text="Release"))
    press(screen, ui, "Release")
    assert container.holds.current() == []
    ui.wait(lambda: not [band for band in ui.find(Lanes).bands if band.kind == "held"])
    assert ui.find(CommandButton, text="Hold").visible


def test_a_reason_may_be_cleared_and_a_hold_have_no_end(screen, container, ui):
    hold_all(screen, ui)
    chip(screen, ui, "Audit")
    chip(screen, ui, "Audit")
    chip(screen, ui, "No end")
    ui.tap(ui.find(CommandButton, root=ui.find(HoldSheet), text="Hold"))
    settle(screen, ui)
    [hold] = container.holds.current()
    assert (hold.reason, hold.until) == ("", None)


def test_the_sheet_begins_with_all_robots_or_the_only_one_in_the_plan(screen, container, ui):
    def begins_with() -> str:
        press(screen, ui, "Hold")
        robot: str = ui.find(HoldSheet).robot
        screen.shell.sheets.close(screen.shell.sheets.top)
        ui.advance(0.3)
        return robot

    aino = named(container, KITS, "Aino").robot_id
    assert begins_with() == "All robots"  # though one is selected on Home
    screen.plan._robots_chosen([aino])  # the timeline shows only this one
    settle(screen, ui)
    assert begins_with() == "Aino"
    for robot in container.catalogue.robots():
        if robot.id != aino:
            container.catalogue.remove_robot(robot.id)
    settle(screen, ui)
    assert begins_with() == "All robots"  # which is the only one


# ---------------------------------------------------------------------- pausing
def test_a_schedule_is_paused_for_some_days_and_resumed(screen, container, ui):
    schedule = named(container, KITS, "Aino")
    menu(screen, ui, schedule, "Pause until a day")
    ui.tap(ui.find(MonthDay, root=ui.find(DateSheet), day=date(2026, 11, 23)))
    press(screen, ui, "Set Mon 23 Nov")
    stored = container.repositories.schedules.get(container.db.read(), schedule.id)
    assert stored.paused_until == datetime(2026, 11, 22, 22, 0, tzinfo=UTC)
    assert "is paused until Mon 23 Nov" in ui.find(Snackbar).text
    assert line(screen, schedule) == "Mon 06:00 · paused until Mon 23 Nov"
    reveal(ui, schedule)
    menu(screen, ui, schedule, "Resume now")
    assert container.repositories.schedules.get(container.db.read(), schedule.id).paused_until is None
    ui.wait(lambda: line(screen, schedule) == "15:00")


def test_a_start_within_a_pause_until_a_picked_day_is_skipped(screen, container, ui):
    schedule = named(container, KITS, "Aino")
    menu(screen, ui, schedule, "Pause until a day")
    ui.tap(ui.find(MonthDay, root=ui.find(DateSheet), day=date(2026, 11, 21)))
    press(screen, ui, "Set Sat 21 Nov")
    assert container.repositories.schedules.get(container.db.read(), schedule.id).is_paused(NOW)
    container.clock.step(30 * 60)
    insert_due(container)
    assert container.history.last_of_schedule(schedule.id).state is State.SKIPPED
    settle(screen, ui)
    assert line(screen, schedule) == "Mon 06:00 · paused until Sat 21 Nov"


# ---------------------------------------------------------------------- the plan as a file
def test_the_plan_is_written_as_a_calendar_file_and_says_where(screen, container, ui, tmp_path, monkeypatch):
    monkeypatch.setattr("platformdirs.user_documents_path", lambda: tmp_path)
    ui.tap(ui.find(IconButton, ui.find(PlanPage), icon="dots-vertical"))
    card_of(ui)
    take(screen, ui, "Export")
    screen.plan.export()  # a glove that trembles
    [path] = tmp_path.glob("*.ics")
    count = len(Calendar.from_ical(path.read_bytes()).events)
    assert count > 50
    ui.wait(lambda: ui.find(Snackbar).text == f"{count} starts of the next 30 days written to {path}")


# ---------------------------------------------------------------------- the exception calendar
def test_closed_days_are_hatched_and_the_form_refuses_them_by_name(screen, container, ui):
    """Saturday becomes a working day, Monday is closed: the plan and the form say so at once."""
    add_days(
        container.catalogue,
        [
            DayException("Fair", date(2026, 11, 21), date(2026, 11, 21), is_working=True),
            DayException("Stocktaking", date(2026, 11, 23), date(2026, 11, 23)),
        ],
    )
    settle(screen, ui)
    assert not [words for *_hours, words, _kind in ui.find(Lanes).bands if words.startswith("Saturday")]
    choose(screen, ui, "Mission", KITS)
    pick_day(screen, ui, "Day", date(2026, 11, 23))
    assert ui.find(Field, label="Day").problem == "Day off: Stocktaking"
    pick_day(screen, ui, "Day", date(2026, 11, 21))
    save(screen, ui)
    assert any(
        schedule.start.date() == date(2026, 11, 21) and schedule.respect_working_days
        for schedule in container.repositories.schedules.all(container.db.read())
    )
    container.catalogue.save_days(DayException("Power cut", date(2026, 11, 20), date(2026, 11, 20)))
    screen.plan.to_now()
    settle(screen, ui)
    assert "Power cut: day off" in [band.text for band in ui.find(Lanes).bands]
    assert [(band.end, band.text) for band in ui.find(Lanes).bands if band.kind == "folded"][:1] == [
        (11.0, "Fri, day off")
    ]


def test_the_menu_of_a_schedule_says_that_a_copy_sends_nothing_too(screen, container, ui, monkeypatch):
    monkeypatch.setattr(container.holds, "is_copy", IS_COPY)
    rebuild_scheduler(screen, ui)
    tab(screen, ui, "schedules")
    ui.advance(1)
    ui.tap(ui.find(IconButton, row(ui, named(container, "Collect empties", "Veikko")), icon="dots-vertical"))
    ui.advance(0.3)
    off = [row.item.off for row in ui.find_all(MenuRow) if row.disabled]
    assert off == ["Nothing is sent from this tablet"]
