"""What is planned, as an operator uses it: the schedules that are there, the timeline and its list."""
from __future__ import annotations

from dataclasses import replace
from datetime import date, time, timedelta

import pytest
from kivy.metrics import dp
from kivy.tests.common import UnitTestTouch

from app.domain.models import ReasonCode, Robot, State
from app.screens.scheduler.cards import FormCard, HoursPart, SchedulesCard, TimeControls, TimelineLegend
from app.screens.scheduler.listed import QUIET_S
from app.services.live.changes import Topic
from app.widgets.buttons import CommandButton, IconButton, MenuChip, Toggle
from app.widgets.fields import SearchField
from app.widgets.long_list import LongList
from app.widgets.plan_rows import DayLine, ScheduleLine
from app.widgets.rows import OptionRow
from app.widgets.snackbar import Snackbar
from app.widgets.timeline import LONG, Timeline
from tests.support import month
from tests.ui import checks
from tests.ui.planner import (
    KITS,
    WASTE,
    card_of,
    choose,
    field,
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
    tap_bar,
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


def test_the_list_keeps_its_order_while_somebody_works_in_it(screen, container, ui):
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
    ui.skip(QUIET_S - 5)
    ui.wheel(ui.find(LongList, ui.find(SchedulesCard)), 1)            # still at it
    ui.skip(QUIET_S - 5)
    assert [key for key in order() if key != other.id] == before
    ui.skip(QUIET_S)
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


# ---------------------------------------------------------------------- upcoming
def test_the_timeline_has_a_lane_per_robot_and_a_planned_bar_says_what_it_is_and_leads_to_its_schedule(screen, container, ui):
    timeline = ui.find(Timeline)
    assert [lane.name for lane in timeline.lanes] == ["Aino", "Sisu", "Veikko"]
    tap_bar(ui, ("schedule", named(container, "Night stock count", "Aino").id))
    card = card_of(ui)
    start, usual, way = card.text.splitlines()
    assert way == "To change its time, press and hold its bar and drag it"
    assert (card.title, start) == ("Night stock count", "Aino · Fri 20 Nov 19:00–21:54")
    assert usual.startswith("Usually 2 h 54 min, nine of ten within 3 h")
    left, right = (card.to_window(x, 0)[0] for x in (card.x, card.right))
    assert left <= timeline.to_window(next(hit[2] for hit in timeline.boxes() if hit[4][:2] == (
        "schedule", named(container, "Night stock count", "Aino").id)), 0)[0] <= right + 1       # it hangs on the bar
    take(screen, ui, "Edit schedule")
    assert field(ui, "Mission").value == "Night stock count"


def test_a_past_bar_says_why_and_goes_to_its_story_in_the_logs(screen, ui):
    failed = next(bar for lane in ui.find(Timeline).lanes for bar in lane.bars if bar.state == "failed" and lane.name == "Veikko")
    tap_bar(ui, failed.key)
    assert "Failed to reach goal position 'Dock 3'" in card_of(ui).text
    take(screen, ui, "Open in Logs")
    assert screen.shell.navigator.current == "logs"
    assert screen.shell.navigator.screen("logs").vm.opened_run == failed.key[1]


def test_seven_days_are_a_list_that_opens_schedules(screen, ui):
    kind(screen, ui, "List")
    lines = ui.find_all(DayLine)
    assert lines[0].heading == "Today, Fri 20 Nov"
    count = next(line for line in lines if line.mission == "Night stock count")
    condition = "if battery ≥\N{NO-BREAK SPACE}30\N{NO-BREAK SPACE}%"
    assert ui.texts(count) == ["19:00", "Night stock count", "Aino", "ends ~21:54", condition]
    ui.tap(count)
    settle(screen, ui)
    assert ui.find(FormCard).view.mission == "Night stock count"
    assert screen.plan.mode == "days"                         # the form has room beside the list
    assert checks.problems(screen.shell.navigator.screen("scheduler")) == []


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


# ---------------------------------------------------------------------- a finger that rests on it
def rest(ui, x: float, y: float) -> UnitTestTouch:
    touch = UnitTestTouch(x, y)
    touch.touch_down()
    ui.advance(LONG + .3)
    return touch


def test_a_long_press_on_free_time_begins_a_schedule_of_that_robot_at_that_time(screen, container, ui):
    choose(screen, ui, "Mission", KITS)
    timeline = ui.find(Timeline)
    lane = next(n for n, lane in enumerate(timeline.lanes) if lane.name == "Sisu")
    y = timeline.top - 28 - timeline.lane_height * (lane + .5)
    rest(ui, *timeline.to_window(timeline.left_of(9 + 7.4 / 60), y)).touch_up()
    settle(screen, ui)
    draft = screen.plan.form.draft
    assert (container.catalogue.robot(draft.robot_id).name, draft.day, draft.at) == ("Sisu", date(2026, 11, 20), time(22, 5))
    assert field(ui, "Mission").value == KITS
    rest(ui, *timeline.to_window(timeline.left_of(.1), y)).touch_up()
    settle(screen, ui)
    assert ui.find(Snackbar).text == "That time has passed"
    assert screen.plan.form.draft == draft


def test_a_planned_start_that_is_dragged_is_changed_by_save_and_not_before(screen, container, ui):
    schedule = named(container, "Night stock count", "Aino")
    timeline = ui.find(Timeline)
    left, bottom, right, top, _key = next(hit for hit in timeline.boxes() if hit[4][:2] == ("schedule", schedule.id))
    x, y = timeline.to_window((left + right) / 2, (bottom + top) / 2)
    touch = rest(ui, x, y)
    touch.touch_move(x + timeline.left_of(10.5) - timeline.left_of(9), y)
    touch.touch_up()
    settle(screen, ui)
    assert field(ui, "Time").value == "20:30"
    assert ui.find(FormCard).view.skip_why == "Not saved yet. Saving moves all its starts like this one."     # beside Save, never scrolled
    assert named(container, "Night stock count", "Aino") == schedule
    save(screen, ui)
    assert screen.plan.form.draft.dragged is None
    assert named(container, "Night stock count", "Aino").start.time() == time(20, 30)


# ---------------------------------------------------------------------- many robots
def add_robots(container, count: int) -> None:
    def add(c) -> None:
        for n in range(count):
            container.repositories.robots.add(c, Robot(f"Robot {n}", f"http://10.0.0.{n}", "distributor", "token"))

    container.db.write(add)
    container.changes.publish(Topic.ROBOTS)


def test_many_robots_are_filtered_by_a_chip_and_those_with_nothing_planned_opened_by_a_tap(screen, container, ui):
    assert not ui.find_all(MenuChip, ui.find(TimeControls))           # few are all in sight
    add_robots(container, 20)
    settle(screen, ui)
    timeline = ui.find(Timeline)
    assert [lane.name or lane.line for lane in timeline.lanes] == ["Aino", "Sisu", "Veikko", "20 robots with nothing planned"]
    ui.find(HoursPart).scroll_y = 0
    ui.advance(.1)
    ui.tap_at(*timeline.to_window(timeline.x + 300, timeline.y + 20))
    settle(screen, ui)
    assert len(timeline.lanes) == 24
    tick(screen, ui, "Aino", "Robot 1")
    assert [lane.name for lane in timeline.lanes] == ["Aino", "Robot 1"]
    chip = ui.find(MenuChip, ui.find(TimeControls))
    assert (chip.text, chip.active) == ("2 robots", True)
    tick(screen, ui, "Aino", "Robot 1")
    assert (chip.text, chip.active, len(timeline.lanes)) == ("All robots", False, 24)


def test_among_many_robots_a_finger_still_scrolls_drags_and_rests(screen, container, ui):
    add_robots(container, 20)
    settle(screen, ui)
    if not ui.find(Timeline).lanes[3].is_open:
        screen.plan.open_idle()
        settle(screen, ui)
    timeline, page = ui.find(Timeline), ui.find(HoursPart)
    x, y = page.to_window(page.center_x, page.center_y)
    finger = UnitTestTouch(x, y)
    finger.touch_down()
    for n in range(1, 11):
        finger.touch_move(x, y + 20 * n)
        ui.advance()
    finger.touch_up()
    ui.advance(1)
    assert page.scroll_y < .9                                         # scrolled, and nothing else
    assert (screen.plan.follows, screen.plan.form.draft.at) == (True, time(15))
    lane = timeline.lanes[round((timeline.top - 28 - timeline.to_widget(x, y)[1]) / timeline.lane_height - .5)]
    rest(ui, x, y).touch_up()
    settle(screen, ui)
    assert (screen.plan.form.draft.robot_id, screen.plan.follows) == (lane.key, True)
    page.scroll_y = 1
    ui.advance(.2)
    schedule = named(container, "Night stock count", "Aino")
    left, bottom, right, top, _key = next(hit for hit in timeline.boxes() if hit[4][:2] == ("schedule", schedule.id))
    x, y = timeline.to_window((left + right) / 2, (bottom + top) / 2)
    touch = rest(ui, x, y)
    for n in range(1, 11):
        touch.touch_move(x + (timeline.left_of(10) - timeline.left_of(9)) * n / 10, y - 4 * n)
        ui.advance()
    touch.touch_up()
    settle(screen, ui)
    assert (page.scroll_y, screen.plan.follows, field(ui, "Time").value) == (1, True, "20:00")


def tick(screen, ui, *names: str) -> None:
    """Robots in the list that the chip opens."""
    ui.tap(ui.find(MenuChip, ui.find(TimeControls)))
    settle(screen, ui)
    for name in names:
        ui.tap(ui.find(OptionRow, text=name))
    press(screen, ui, "Show")


# ---------------------------------------------------------------------- the timeline's window
def test_the_timeline_is_zoomed_paged_and_brought_back_by_buttons(screen, ui):
    timeline, vm = ui.find(Timeline), screen.plan
    ui.tap(ui.find(IconButton, icon="magnify-plus-outline"))
    ui.wait(lambda: timeline.hours == 12 and "12 h" in ui.texts())
    for _ in range(3):
        ui.tap(ui.find(IconButton, icon="magnify-minus-outline"))
    ui.wait(lambda: timeline.hours == 96 and "4 days" in ui.texts())
    assert ui.find(CommandButton, text="Now").disabled            # it goes with the time
    ui.tap(ui.find(IconButton, icon="chevron-right"))
    ui.wait(lambda: timeline.now < timeline.first)
    assert not ui.find(CommandButton, text="Now").disabled
    left = vm.timeline.origin + timedelta(hours=timeline.first)
    ui.wait(lambda: max(tick for tick, _label, _strong in timeline.ticks) > timeline.first + 1.3 * timeline.hours)
    assert abs(vm.timeline.origin + timedelta(hours=timeline.first) - left) < timedelta(minutes=1)
    ui.tap(ui.find(CommandButton, text="Now"))
    ui.wait(lambda: timeline.first <= timeline.now <= timeline.first + timeline.hours)


def test_a_tap_on_the_break_of_a_weekend_unfolds_it_and_one_on_closed_time_folds_it_again(screen, ui):
    timeline = ui.find(Timeline)
    weekend, = (band for band in timeline.bands if band.kind == "folded")
    left, right = (timeline.left_of(hour) for hour in (weekend.start, weekend.end))
    assert right - left == pytest.approx(dp(72))
    ui.tap_at(*timeline.to_window((left + right) / 2, timeline.y + 20))
    settle(screen, ui)
    assert [(band.text, band.kind) for band in timeline.bands] == [
        ("Saturday: not a working day", "closed"), ("Sunday: not a working day", "closed")]
    assert timeline.left_of(weekend.start) == pytest.approx(left)
    ui.tap_at(*timeline.to_window(left + 100, timeline.y + 20))
    settle(screen, ui)
    assert weekend in timeline.bands


def test_the_legend_is_of_what_is_in_sight_and_moves_nothing(screen, ui):
    def in_sight() -> set[str]:
        chart = ui.find(Timeline)
        left, right = chart.left_of(chart.first), chart.right
        at = {bar.key: bar for lane in chart.lanes for bar in lane.bars}
        return {("typed" if at[key].typed else "assumed" if at[key].assumed else at[key].state)
                for box_left, _bottom, box_right, _top, key in chart.boxes() if box_right > left and box_left < right}

    def explained() -> set[str]:
        return {item.kind for item in ui.find(TimelineLegend).children} - {"overlap", "closed"}

    chart, heights = ui.find(Timeline), set()
    screen.plan.to_now()
    for dx in (0, .6, .6, .6, -.6, -.6, -.6, -.6, -.6):
        if dx:
            ui.drag(chart, dx * chart.width, 0)
        settle(screen, ui)
        ui.advance(.3)
        assert explained() == in_sight()
        heights.add((round(chart.height), round(chart.to_window(*chart.pos)[1])))
    assert len(heights) == 1
    for _n in range(3):
        screen.plan.zoom(False)
        settle(screen, ui)
        ui.advance(.3)
        assert explained() == in_sight()


def test_the_legend_does_not_change_under_a_finger(screen, ui):
    settle(screen, ui)
    legend, chart = ui.find(TimelineLegend), ui.find(Timeline)
    before, height = [*legend.children], legend.height
    touch = UnitTestTouch(*chart.to_window(chart.center_x, chart.y + 2))
    touch.touch_down()
    screen.plan.timeline = replace(screen.plan.timeline, legend=screen.plan.timeline.legend[:1])
    ui.advance(.3)
    assert legend.children == before
    touch.touch_move(touch.x, touch.y + dp(40))              # so that it is no tap
    touch.touch_up()
    ui.advance(.3)
    assert [item.text for item in reversed(legend.children)] == [item.text for item in legend.items]
    assert legend.height == height


def test_a_finger_drags_the_plan_and_what_comes_into_sight_is_read(screen, ui):
    timeline = ui.find(Timeline)
    first = screen.plan.timeline.origin + timedelta(hours=timeline.first)
    ui.drag(timeline, -timeline.width * .4, 0)
    now_first = screen.plan.timeline.origin + timedelta(hours=timeline.first)
    assert timedelta(hours=24 * .4) < now_first - first < timedelta(hours=24 * .4 / .7)        # the names take up to 30 %
    assert not ui.find(CommandButton, text="Now").disabled
    ui.wait(lambda: max(tick for tick, _label, _strong in timeline.ticks) > timeline.first + 30)
