"""The Scheduler as an operator uses it: taps and typing on real services, at an invented plant on Friday 20 Nov 2026, 14:38."""
from __future__ import annotations

from datetime import date, datetime, time

import pytest

from app.models import Between, Overlap, ReasonCode, Schedule, State
from app.screens.scheduler_cards import FormCard
from app.services.mir.types import MissionParameter
from app.widgets.buttons import ChoiceChip, CommandButton, IconButton, Segment, Toggle
from app.widgets.dialogs import ChoiceDialog, MenuRow
from app.widgets.fields import FormField, PickField, SearchField, StepField
from app.widgets.pages import LowColumn
from app.widgets.pickers import DateDialog, DayCell
from app.widgets.plan_rows import DayLine, ScheduleLine
from app.widgets.rows import NextStart, OptionRow
from app.widgets.snackbar import Snackbar
from app.widgets.timeline import Timeline
from tests.support import month
from tests.ui import checks
from tests.ui.whole_app import shown

KITS, WASTE = "Deliver kits to line 2", "Waste to compactor"


@pytest.fixture
def container(tmp_path):
    container = month.plant(tmp_path)
    yield container
    container.close()


@pytest.fixture
def screen(container, ui):
    """The Scheduler on screen, everything read; nobody answers at the robots' addresses."""
    with shown(container, ui) as app:
        vm = app.shell.navigator.screen("scheduler").vm
        vm.form._robot_missions.learn_names = lambda _robot_id: False
        vm.form._robot_missions.parameters = lambda _robot_id, _guid: ()
        app.shell.go("scheduler")
        app.plan = vm
        settle(app, ui)
        yield app


def settle(app, ui) -> None:
    ui.advance(.3)
    ui.wait(lambda: app.shell.background.idle)
    ui.advance(.3)
    ui.wait(lambda: app.shell.background.idle)


def press(app, ui, word: str) -> None:
    ui.tap(ui.find(CommandButton, text=word))
    settle(app, ui)


def field(ui, label: str) -> PickField:
    return ui.find(PickField, label=label)


def choose(app, ui, label: str, option: str) -> None:
    """Tap a field and, in the list that opens, one option."""
    ui.tap(field(ui, label))
    ui.advance(.3)
    dialog = ui.find(ChoiceDialog)
    if dialog.searchable:
        ui.type(ui.find(SearchField, dialog), option)
        ui.advance(.2)
    ui.tap(ui.find(OptionRow, dialog, text=option))
    settle(app, ui)


def kind(app, ui, word: str) -> None:
    ui.tap(ui.find(Segment, text=word))
    settle(app, ui)


def pick_day(app, ui, label: str, day: date) -> None:
    ui.tap(field(ui, label))
    dialog = ui.find(DateDialog)
    dialog.year, dialog.month = day.year, day.month
    ui.advance(.1)
    ui.tap(ui.find(DayCell, dialog, day=day))
    press(app, ui, "Set")


def pick_time(app, ui, label: str, digits: str) -> None:
    """Typed on a keyboard, as a person would who has one."""
    ui.tap(field(ui, label))
    for digit in digits:
        ui.key(ord(digit), digit)
    press(app, ui, "Set")


def save_button(ui) -> CommandButton:
    return next(button for button in ui.find_all(CommandButton) if button.text in ("Save schedule", "Save changes"))


def save(app, ui) -> None:
    assert not save_button(ui).disabled, ui.find(FormCard).view.why
    ui.tap(save_button(ui))
    settle(app, ui)


def schedules(container) -> list[Schedule]:
    return container.repositories.schedules.all(container.db.read())


def named(container, mission: str, robot: str) -> Schedule:
    return next(schedule for schedule in schedules(container) if schedule.name == f"{mission} on {robot}")


def row(ui, schedule: Schedule) -> ScheduleLine:
    return ui.find(ScheduleLine, key=schedule.id)


# ---------------------------------------------------------------------- planning
def test_a_weekly_mission_is_planned_from_the_form_to_the_database(screen, container, ui):
    choose(screen, ui, "Mission", WASTE)
    choose(screen, ui, "Robot", "Sisu")
    kind(screen, ui, "Weekly")
    pick_day(screen, ui, "First day", date(2026, 11, 24))
    pick_time(screen, ui, "Time", "0630")
    for day in ("Mo", "We"):                                  # off; the working days were chosen
        ui.tap(ui.find(Segment, text=day))
    choose(screen, ui, "Battery ≥", "40 %")
    view = ui.find(FormCard).view
    assert view.sentence == "Every Tue, Thu, Fri at 06:30, not on non-working days, if battery ≥\N{NO-BREAK SPACE}40\N{NO-BREAK SPACE}%"
    assert [(start.day, start.time) for start in ui.find_all(NextStart)] == [
        ("Tue 24 Nov", "06:30"), ("Thu 26 Nov", "06:30"), ("Fri 27 Nov", "06:30"), ("Tue 1 Dec", "06:30"), ("Thu 3 Dec", "06:30")]
    save(screen, ui)
    saved = named(container, WASTE, "Sisu")
    assert (saved.start, saved.timezone, saved.recurrence, saved.minimum_battery_percent, saved.overlap) == (
        datetime(2026, 11, 24, 6, 30), month.ZONE, "FREQ=WEEKLY;BYDAY=TU,TH,FR", 40.0, Overlap.SKIP)
    assert ui.find(Snackbar).text == f"{WASTE} on Sisu is planned"
    assert field(ui, "Mission").value == "Choose a mission"   # ready for the next
    assert saved.id in [line["key"] for line in screen.plan.schedules]


def test_a_one_time_mission_is_planned(screen, container, ui):
    choose(screen, ui, "Mission", KITS)
    pick_time(screen, ui, "Time", "2015")
    assert ui.find(FormCard).view.sentence == "Once on Fri 20 Nov 2026 at 20:15, if battery ≥\N{NO-BREAK SPACE}30\N{NO-BREAK SPACE}%"
    before = {schedule.id for schedule in schedules(container)}
    save(screen, ui)
    new, = (schedule for schedule in schedules(container) if schedule.id not in before)
    assert (new.start, new.recurrence) == (datetime(2026, 11, 20, 20, 15), None)
    assert new.next_at == datetime.fromisoformat("2026-11-20T18:15+00:00")


def test_every_so_many_minutes_between_two_times(screen, container, ui):
    choose(screen, ui, "Mission", "Bring pallet to dock")
    kind(screen, ui, "Every …")
    stepper = ui.find(StepField, value=1)
    ui.find(Segment, text="minutes")
    ui.tap(ui.find(Segment, text="minutes"))
    stepper.text = "45"
    stepper.commit()
    pick_time(screen, ui, "From", "0830")
    pick_time(screen, ui, "Until", "1645")
    save(screen, ui)
    saved = named(container, "Bring pallet to dock", "Aino")
    assert saved.recurrence == "FREQ=MINUTELY;INTERVAL=45;BYDAY=MO,TU,WE,TH,FR"
    assert saved.between == Between(time(8, 30), time(16, 45))


def test_monthly_on_the_first_monday(screen, container, ui):
    choose(screen, ui, "Mission", "Floor wash, hall A")
    kind(screen, ui, "Monthly")
    kind(screen, ui, "By weekday")
    choose(screen, ui, "Which", "first")
    choose(screen, ui, "Weekday", "Monday")
    assert [start.day for start in ui.find_all(NextStart)][:2] == ["Mon 7 Dec", "Mon 4 Jan"]
    save(screen, ui)
    assert named(container, "Floor wash, hall A", "Aino").recurrence == "FREQ=MONTHLY;BYDAY=1MO"


def test_what_is_seldom_needed_stands_under_more(screen, container, ui):
    choose(screen, ui, "Mission", KITS)
    kind(screen, ui, "Daily")
    pick_time(screen, ui, "Time", "0600")
    ui.tap(ui.find(ChoiceChip, text="More"))
    reveal(ui, field(ui, "Last day"))
    pick_day(screen, ui, "Last day", date(2026, 12, 31))
    reveal(ui, field(ui, "Also at"))
    ui.tap(field(ui, "Also at"))
    ui.advance(.3)
    dialog = ui.find(ChoiceDialog)
    ui.type(ui.find(SearchField, dialog), "14:00")
    ui.advance(.2)
    ui.tap(ui.find(OptionRow, dialog, text="14:00"))
    press(screen, ui, "Set")
    name = ui.find(FormField, label="Name")
    ui.type(name, "Kits, twice")
    ui.key(13)
    settle(screen, ui)
    save(screen, ui)
    saved = next(schedule for schedule in schedules(container) if schedule.name == "Kits, twice")
    assert saved.recurrence == "FREQ=DAILY;BYHOUR=6,14;BYMINUTE=0;UNTIL=20261231"


def reveal(ui, widget) -> None:
    """Scroll the form's fields until it can be seen."""
    ui.advance(.2)
    ui.find(LowColumn, ui.find(FormCard)).scroll_to(widget, animate=False)
    ui.advance(.2)


# ---------------------------------------------------------------------- what can't be, and what is only odd
def test_nothing_can_be_saved_before_a_mission_is_chosen(screen, ui):
    assert save_button(ui).disabled
    assert "Choose a mission" in ui.texts(ui.find(FormCard))


def test_a_day_without_work_is_refused_at_the_field_and_any_day_allows_it(screen, container, ui):
    choose(screen, ui, "Mission", KITS)
    pick_day(screen, ui, "Day", date(2026, 11, 21))
    assert field(ui, "Day").problem.startswith("Saturday is not a working day")
    assert save_button(ui).disabled
    ui.tap(ui.find(ChoiceChip, text="More"))
    reveal(ui, ui.find(Segment, text="Any day"))
    ui.tap(ui.find(Segment, text="Any day"))
    settle(screen, ui)
    assert field(ui, "Day").problem == ""
    save(screen, ui)
    assert any(schedule.start.date() == date(2026, 11, 21) and not schedule.respect_working_days for schedule in schedules(container))


def test_a_time_that_has_passed_is_refused_at_the_field(screen, ui):
    choose(screen, ui, "Mission", KITS)
    pick_time(screen, ui, "Time", "0800")
    assert field(ui, "Time").problem == "This time has passed: choose a later one"
    assert save_button(ui).disabled


def test_no_day_of_the_week_is_refused_under_the_days(screen, ui):
    choose(screen, ui, "Mission", KITS)
    kind(screen, ui, "Weekly")
    for day in ("Mo", "Tu", "We", "Th", "Fr"):
        ui.tap(ui.find(Segment, text=day))
    settle(screen, ui)
    assert "Choose at least one day" in ui.texts(ui.find(FormCard))
    assert save_button(ui).disabled


def test_a_name_that_is_taken_is_said_at_the_name(screen, container, ui):
    choose(screen, ui, "Mission", KITS)
    kind(screen, ui, "Daily")
    screen.plan.form.set(name=f"{KITS} on Aino")
    settle(screen, ui)
    ui.tap(save_button(ui))
    settle(screen, ui)
    assert ui.find(FormCard).view.problems == {"name": f"There is a schedule {KITS} on Aino already"}
    screen.plan.form.set(name="Another name")
    settle(screen, ui)
    save(screen, ui)
    assert any(schedule.name == "Another name" for schedule in schedules(container))


def test_a_meeting_with_another_run_is_warned_of_and_can_be_saved_all_the_same(screen, container, ui):
    choose(screen, ui, "Mission", KITS)
    choose(screen, ui, "Robot", "Veikko")
    kind(screen, ui, "Once")
    pick_time(screen, ui, "Time", "1640")
    view = ui.find(FormCard).view
    warning, = view.warnings
    assert warning.startswith(f"Fri 20 Nov: still running then on Veikko is {WASTE}, 16:30–17:")
    assert [start["icon"] for start in view.starts] == ["alert"]
    save(screen, ui)


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
    assert len(schedules(container)) == len(month.HABITS)


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
    assert next(data for data in screen.plan.schedules if data["key"] == number)["next"].endswith("switched off")
    screen.plan.switch(number, True)
    settle(screen, ui)
    assert container.repositories.schedules.get(container.db.read(), number).next_at is not None


def menu(app, ui, schedule: Schedule, word: str) -> None:
    ui.tap(ui.find(IconButton, row(ui, schedule), icon="dots-vertical"))
    ui.advance(.3)
    ui.tap(ui.find(MenuRow, text=word))
    settle(app, ui)


def test_skip_next_leaves_one_start_out_with_its_row(screen, container, ui):
    schedule = named(container, KITS, "Aino")
    menu(screen, ui, schedule, "Skip next")
    last = container.history.last_of_schedule(schedule.id)
    assert (last.state, last.reason.code, last.planned_at) == (State.SKIPPED, ReasonCode.HOLD, schedule.next_at)
    assert container.repositories.schedules.get(container.db.read(), schedule.id).next_at > schedule.next_at


def test_run_now_starts_it_whatever_its_time_is(screen, container, ui):
    schedule = named(container, KITS, "Aino")
    menu(screen, ui, schedule, "Run now")
    newest = container.history.open()[-1]
    assert (newest.mission, newest.robot, newest.state) == (KITS, "Aino", State.WAITING)
    assert f"{KITS} is on its way to Aino" in ui.find(Snackbar).text


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
    assert schedule.id not in [data["key"] for data in screen.plan.schedules]
    ui.tap(ui.find(root=ui.find(Snackbar), text="Undo"))
    settle(screen, ui)
    restored = container.repositories.schedules.get(container.db.read(), schedule.id)
    assert (restored.name, restored.recurrence, restored.next_at) == (schedule.name, schedule.recurrence, schedule.next_at)


# ---------------------------------------------------------------------- upcoming
def test_the_timeline_has_a_lane_per_robot_and_a_planned_bar_opens_its_schedule(screen, container, ui):
    timeline = ui.find(Timeline)
    assert [lane["name"] for lane in timeline.lanes] == ["Aino", "Sisu", "Veikko"]
    tap_bar(ui, ("schedule", named(container, "Night stock count", "Aino").id))
    settle(screen, ui)
    assert field(ui, "Mission").value == "Night stock count"


def tap_bar(ui, key) -> None:
    timeline = ui.find(Timeline)
    x, y, right, top, _key = next(hit for hit in timeline._hits if hit[4] == key)
    ui.tap_at(*timeline.to_window((x + right) / 2, (y + top) / 2))


def test_a_past_bar_goes_to_its_story_in_the_logs(screen, ui):
    failed = next(bar for lane in ui.find(Timeline).lanes for bar in lane["bars"] if bar["state"] == "failed" and lane["name"] == "Veikko")
    tap_bar(ui, failed["key"])
    settle(screen, ui)
    assert screen.shell.navigator.current == "logs"
    assert screen.shell.navigator.screen("logs").vm.told == failed["key"][1]


def test_seven_days_are_a_list_that_opens_schedules(screen, ui):
    kind(screen, ui, "7 days")
    lines = ui.find_all(DayLine)
    assert lines[0].heading == "Today, Fri 20 Nov"
    assert not ui.find_all(FormCard)
    ui.tap(next(line for line in lines if line.mission == "Night stock count"))
    settle(screen, ui)
    assert ui.find(FormCard).view.mission == "Night stock count"


def test_what_changes_elsewhere_shows_at_once(screen, container, ui):
    schedule = named(container, KITS, "Aino")
    container.catalogue.remove_schedule(schedule.id)
    settle(screen, ui)
    assert schedule.id not in [data["key"] for data in screen.plan.schedules]


def test_without_a_robot_the_screen_leads_to_settings(tmp_path, ui):
    container = month.plant(tmp_path, furnished=False)
    try:
        with shown(container, ui) as app:
            app.shell.go("scheduler")
            settle(app, ui)
            press(app, ui, "Add your first robot")
            assert app.shell.navigator.current == "settings"
    finally:
        container.close()


def test_nothing_overlaps_or_is_too_small(screen, ui):
    choose(screen, ui, "Mission", KITS)
    kind(screen, ui, "Weekly")
    assert checks.problems(screen.shell.navigator.screen("scheduler")) == []


def test_a_mission_that_asks_for_something_is_planned_with_the_answers(screen, container, ui):
    screen.plan.form._robot_missions.parameters = lambda _robot_id, _guid: (MissionParameter("count", "Pallets", "integer", 2, 1, 8),)
    choose(screen, ui, "Mission", "Bring pallet to dock")
    pallets = ui.find(FormField, label="Pallets")
    pallets.text = "9"
    ui.tap(save_button(ui))
    settle(screen, ui)
    assert pallets.problem == "It must be 1 to 8"
    pallets.text = "3"
    save(screen, ui)
    assert dict(named(container, "Bring pallet to dock", "Aino").parameters) == {"count": 3}


def test_the_limits_of_settings_hold_unless_others_are_chosen(screen, container, ui):
    choose(screen, ui, "Mission", KITS)
    pick_time(screen, ui, "Time", "2015")
    choose(screen, ui, "Late up to", "30 min")
    choose(screen, ui, "Battery ≥", "No minimum")
    choose(screen, ui, "Battery ≥", "As in Settings")
    choose(screen, ui, "If running", "Queue it")
    save(screen, ui)
    saved = next(schedule for schedule in schedules(container) if schedule.start == datetime(2026, 11, 20, 20, 15))
    assert (saved.minimum_battery_percent, saved.start_window_minutes, saved.overlap) == (None, 30, Overlap.QUEUE)


def test_in_a_low_window_the_page_scrolls_and_its_fields_and_lists_still_take_taps(screen, container, ui):
    from app.screens.scheduler import SchedulerScreen
    screen.shell.go("home")
    low = ui.show(SchedulerScreen(container, screen.shell), (976, 440))
    low.shown()
    screen.plan = low.vm
    low.vm.form._robot_missions.learn_names = lambda _robot_id: False
    low.vm.form._robot_missions.parameters = lambda _robot_id, _guid: ()
    settle(screen, ui)
    page = low.ids.page
    assert page.do_scroll_y
    choose(screen, ui, "Mission", KITS)
    page.scroll_y = 0
    ui.advance(.3)
    kind(screen, ui, "Daily")
    ui.advance(.5)
    assert low.vm.form.draft.kind == "daily"
    edge = low.to_window(*low.pos)[1]
    line = next(line for line in ui.find_all(ScheduleLine) if edge + 40 < line.to_window(*line.center)[1] < edge + 400
                and line.to_window(*line.center)[0] < low.right)          # rows that find no room stand beside the list
    number = line.key
    ui.tap(ui.find(Toggle, line))
    ui.advance(.5)
    settle(screen, ui)
    assert not container.repositories.schedules.get(container.db.read(), number).enabled
    low.hidden()
