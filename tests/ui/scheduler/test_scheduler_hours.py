"""The timeline and its list, as an operator uses them."""

from __future__ import annotations

from dataclasses import replace
from datetime import UTC, date, datetime, time, timedelta

import pytest
from kivy.metrics import dp
from kivy.tests.common import UnitTestTouch

from app.domain.models import Robot, Schedule
from app.screens.scheduler.cards import FormCard, HoursPart, TimeControls, TimelineLegend
from app.screens.scheduler.timeline import IDLE
from app.services.live.changes import Topic
from app.widgets.buttons import CommandButton, IconButton, MenuChip
from app.widgets.plan_rows import DayLine
from app.widgets.rows import OptionRow
from app.widgets.snackbar import Snackbar
from app.widgets.timeline import LONG, Timeline
from tests.support import month
from tests.ui import checks
from tests.ui.planner import (
    KITS,
    card_of,
    choose,
    field,
    kind,
    named,
    press,
    save,
    settle,
    take,
    tap_bar,
)

pytestmark = pytest.mark.long


# ---------------------------------------------------------------------- upcoming
def test_the_timeline_has_a_lane_per_robot_and_a_planned_bar_leads_to_its_schedule(screen, container, ui):
    timeline = ui.find(Timeline)
    assert [lane.name for lane in timeline.lanes] == ["Aino", "Sisu", "Veikko"]
    tap_bar(ui, ("schedule", named(container, "Night stock count", "Aino").id))
    card = card_of(ui)
    start, usual, way = card.text.splitlines()
    assert way == "To change its time, press and hold its bar and drag it"
    assert (card.title, start) == ("Night stock count", "Aino · Fri 20 Nov 19:00–21:54")
    assert usual.startswith("Usually 2 h 54 min, nine of ten within 3 h")
    left, right = (card.to_window(x, 0)[0] for x in (card.x, card.right))
    assert (
        left
        <= timeline.to_window(
            next(
                hit[2]
                for hit in timeline.boxes()
                if hit[4][:2] == ("schedule", named(container, "Night stock count", "Aino").id)
            ),
            0,
        )[0]
        <= right + 1
    )  # it hangs on the bar
    take(screen, ui, "Edit schedule")
    assert field(ui, "Mission").value == "Night stock count"


def test_a_past_bar_says_why_and_goes_to_its_story_in_the_logs(screen, ui):
    failed = next(
        bar for lane in ui.find(Timeline).lanes for bar in lane.bars if bar.state == "failed" and lane.name == "Veikko"
    )
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
    assert screen.plan.mode == "days"  # the form has room next to the list
    assert checks.problems(screen.shell.navigator.screen("scheduler")) == []


# ---------------------------------------------------------------------- a finger that rests on it
def rest(ui, x: float, y: float) -> UnitTestTouch:
    touch = UnitTestTouch(x, y)
    touch.touch_down()
    ui.advance(LONG + 0.3)
    return touch


def test_a_long_press_on_free_time_begins_a_schedule_of_that_robot_at_that_time(screen, container, ui):
    choose(screen, ui, "Mission", KITS)
    timeline = ui.find(Timeline)
    lane = next(n for n, lane in enumerate(timeline.lanes) if lane.name == "Sisu")
    y = timeline.top - 28 - timeline.lane_height * (lane + 0.5)
    rest(ui, *timeline.to_window(timeline.left_of(9 + 7.4 / 60), y)).touch_up()
    settle(screen, ui)
    draft = screen.plan.form.draft
    assert (container.catalogue.robot(draft.robot_id).name, draft.day, draft.at) == (
        "Sisu",
        date(2026, 11, 20),
        time(22, 5),
    )
    assert field(ui, "Mission").value == KITS
    rest(ui, *timeline.to_window(timeline.left_of(0.1), y)).touch_up()
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
    assert (
        ui.find(FormCard).view.skip_why == "Not saved yet. Saving moves all its starts like this one."
    )  # next to Save, never scrolled
    assert named(container, "Night stock count", "Aino") == schedule
    save(screen, ui)
    assert screen.plan.form.draft.dragged is None
    assert named(container, "Night stock count", "Aino").start.time() == time(20, 30)


def test_a_dragged_start_that_was_skipped_is_not_said_to_start(screen, container, ui):
    kits, at = named(container, KITS, "Aino"), datetime(2026, 11, 20, 15, 0, tzinfo=UTC)
    once = container.catalogue.save_schedule(
        Schedule("", kits.robot_id, kits.mission_id, datetime(2026, 11, 20, 17, 0), month.ZONE)
    )
    settle(screen, ui)
    screen.plan.move_start(("schedule", once.id, at), 9.0)
    settle(screen, ui)

    def said() -> list[str]:
        view = screen.plan.form.view
        return [
            text for text in (view.skip_why, *(row.text for row in view.warnings)) if text.startswith("Not saved yet")
        ]

    assert said() == ["Not saved yet. Until then it starts as before."]
    container.pausing.skip(once.id, at)
    settle(screen, ui)
    assert said() == ["Not saved yet. Until then it is skipped."]


# ---------------------------------------------------------------------- many robots
def add_robots(container, count: int) -> None:
    def add(c) -> None:
        for n in range(count):
            container.repositories.robots.add(c, Robot(f"Robot {n}", f"http://10.0.0.{n}", "distributor", "token"))

    container.db.write(add)
    container.changes.publish(Topic.ROBOTS)


def test_many_robots_are_filtered_by_a_chip_and_those_with_nothing_planned_opened_by_a_tap(screen, container, ui):
    assert not ui.find_all(MenuChip, ui.find(TimeControls))  # few are all in sight
    add_robots(container, 20)
    settle(screen, ui)
    timeline = ui.find(Timeline)
    assert [lane.name or lane.line for lane in timeline.lanes] == [
        "Aino",
        "Sisu",
        "Veikko",
        "20 robots with nothing planned",
    ]
    ui.find(HoursPart).scroll_y = 0
    ui.advance(0.1)
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
        screen.plan.open_line(IDLE)
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
    assert page.scroll_y < 0.9  # scrolled, and nothing else
    assert (screen.plan.follows, screen.plan.form.draft.at) == (True, time(15))
    lane = timeline.lanes[round((timeline.top - 28 - timeline.to_widget(x, y)[1]) / timeline.lane_height - 0.5)]
    rest(ui, x, y).touch_up()
    settle(screen, ui)
    assert (screen.plan.form.draft.robot_id, screen.plan.follows) == (lane.key, True)
    page.scroll_y = 1
    ui.advance(0.2)
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
    assert ui.find(IconButton, icon="magnify-minus-outline").x < ui.find(IconButton, icon="magnify-plus-outline").x
    ui.tap(ui.find(IconButton, icon="magnify-plus-outline"))
    ui.wait(lambda: timeline.hours == 12 and "12 h" in ui.texts())
    for _ in range(3):
        ui.tap(ui.find(IconButton, icon="magnify-minus-outline"))
    ui.wait(lambda: timeline.hours == 96 and "4 days" in ui.texts())
    assert ui.find(CommandButton, text="Now").disabled  # it goes with the time
    ui.tap(ui.find(IconButton, icon="chevron-right"))
    ui.wait(lambda: timeline.now < timeline.first)
    assert not ui.find(CommandButton, text="Now").disabled
    left = vm.timeline.origin + timedelta(hours=timeline.first)
    ui.wait(lambda: max(tick for tick, _label, _strong in timeline.ticks) > timeline.first + 1.3 * timeline.hours)
    assert abs(vm.timeline.origin + timedelta(hours=timeline.first) - left) < timedelta(minutes=1)
    ui.tap(ui.find(CommandButton, text="Now"))
    ui.wait(lambda: timeline.first <= timeline.now <= timeline.first + timeline.hours)


def test_tapping_the_break_unfolds_a_weekend_and_tapping_closed_time_folds_it(screen, ui):
    timeline = ui.find(Timeline)
    (weekend,) = (band for band in timeline.bands if band.kind == "folded")
    left, right = (timeline.left_of(hour) for hour in (weekend.start, weekend.end))
    assert right - left == pytest.approx(dp(72))
    ui.tap_at(*timeline.to_window((left + right) / 2, timeline.y + 20))
    settle(screen, ui)
    assert [(band.text, band.kind) for band in timeline.bands] == [
        ("Saturday: not a working day", "closed"),
        ("Sunday: not a working day", "closed"),
    ]
    assert timeline.left_of(weekend.start) == pytest.approx(left)
    ui.tap_at(*timeline.to_window(left + 100, timeline.y + 20))
    settle(screen, ui)
    assert weekend in timeline.bands


def test_the_legend_is_of_what_is_in_sight_and_moves_nothing(screen, ui):
    def in_sight() -> set[str]:
        chart = ui.find(Timeline)
        left, right = chart.left_of(chart.first), chart.right
        at = {bar.key: bar for lane in chart.lanes for bar in lane.bars}
        return {
            ("typed" if at[key].typed else "assumed" if at[key].assumed else at[key].state)
            for box_left, _bottom, box_right, _top, key in chart.boxes()
            if box_right > left and box_left < right
        }

    def explained() -> set[str]:
        return {item.kind for item in ui.find(TimelineLegend).children} - {"overlap", "closed"}

    chart, heights = ui.find(Timeline), set()
    screen.plan.to_now()
    for dx in (0, 0.6, 0.6, 0.6, -0.6, -0.6, -0.6, -0.6, -0.6):
        if dx:
            ui.drag(chart, dx * chart.width, 0)
        settle(screen, ui)
        ui.advance(0.3)
        assert explained() == in_sight()
        heights.add((round(chart.height), round(chart.to_window(*chart.pos)[1])))
    assert len(heights) == 1
    for _n in range(3):
        screen.plan.zoom(False)
        settle(screen, ui)
        ui.advance(0.3)
        assert explained() == in_sight()


def test_the_legend_does_not_change_under_a_finger(screen, ui):
    settle(screen, ui)
    legend, chart = ui.find(TimelineLegend), ui.find(Timeline)
    before, height = [*legend.children], legend.height
    touch = UnitTestTouch(*chart.to_window(chart.center_x, chart.y + 2))
    touch.touch_down()
    screen.plan.timeline = replace(screen.plan.timeline, legend=screen.plan.timeline.legend[:1])
    ui.advance(0.3)
    assert legend.children == before
    touch.touch_move(touch.x, touch.y + dp(40))  # so that it is not a tap
    touch.touch_up()
    ui.advance(0.3)
    assert [item.text for item in reversed(legend.children)] == [item.text for item in legend.items]
    assert legend.height == height


def test_a_finger_drags_the_plan_and_what_comes_into_sight_is_read(screen, ui):
    timeline = ui.find(Timeline)
    first = screen.plan.timeline.origin + timedelta(hours=timeline.first)
    ui.drag(timeline, -timeline.width * 0.4, 0)
    now_first = screen.plan.timeline.origin + timedelta(hours=timeline.first)
    assert timedelta(hours=24 * 0.4) < now_first - first < timedelta(hours=24 * 0.4 / 0.7)  # the names take up to 30 %
    assert not ui.find(CommandButton, text="Now").disabled
    ui.wait(lambda: max(tick for tick, _label, _strong in timeline.ticks) > timeline.first + 30)
