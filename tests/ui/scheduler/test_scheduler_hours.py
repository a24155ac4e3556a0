"""The timeline and its list, as an operator uses them."""

from __future__ import annotations

from dataclasses import replace
from datetime import UTC, date, datetime, time, timedelta

import pytest
from kivy.metrics import dp
from kivy.tests.common import UnitTestTouch

from app.domain.models import Between, Robot
from app.screens.scheduler.cards import FreeButton, PlanPage
from app.screens.scheduler.draft import Kind
from app.services.live.changes import Topic
from app.widgets.buttons import CommandButton, IconButton, MenuChip
from app.widgets.choices import OptionRow
from app.widgets.lanes import LONG, Lanes
from app.widgets.pickers import TimeCell
from app.widgets.snackbar import Snackbar
from tests.ui.planner import (
    KITS,
    card_of,
    choose,
    field,
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
    timeline = ui.find(Lanes)
    assert [lane.name for lane in timeline.lanes] == ["Aino", "Sisu", "Veikko"]
    tap_bar(ui, ("schedule", named(container, "Night stock count", "Aino").id))
    card = card_of(ui)
    start, usual = card.text.splitlines()
    assert (card.title, start) == ("Night stock count", "Aino · Fri 20 Nov 19:00–21:54")
    assert usual.startswith("Usually 2 h 54 min, nine of ten within 3 h")
    take(screen, ui, "Edit")
    assert field(ui, "Mission").value == "Night stock count"


def test_a_past_bar_says_why_and_goes_to_its_story_in_the_logs(screen, ui):
    failed = next(
        bar for lane in ui.find(Lanes).lanes for bar in lane.bars if bar.state == "failed" and lane.name == "Veikko"
    )
    tap_bar(ui, failed.key)
    assert "Failed to reach goal position 'Dock 3'" in card_of(ui).text
    take(screen, ui, "Open in Logs")
    assert screen.shell.navigator.current == "logs"
    assert screen.shell.navigator.screen("logs").vm.story.run == failed.key[1]


# ---------------------------------------------------------------------- a finger that rests on it
def rest(ui, x: float, y: float) -> UnitTestTouch:
    touch = UnitTestTouch(x, y)
    touch.touch_down()
    ui.advance(LONG + 0.3)
    return touch


def spot(timeline, name: str, hour: float) -> tuple[float, float]:
    """In the lane of a robot, in window px."""
    lane = next(n for n, lane in enumerate(timeline.lanes) if lane.name == name)
    return timeline.to_window(timeline.left_of(hour), timeline._drawing.frame.middle(lane))


def test_a_tap_on_free_time_offers_a_schedule_of_that_robot_at_that_time(screen, container, ui):
    timeline = ui.find(Lanes)
    ui.tap_at(*spot(timeline, "Sisu", 5 + 7.4 / 60))
    settle(screen, ui)
    ui.tap(ui.find(FreeButton, text="18:05"))
    settle(screen, ui)
    draft = screen.plan.form.draft
    assert (container.catalogue.robot(draft.robot_id).name, draft.day, draft.at) == (
        "Sisu",
        date(2026, 11, 20),
        time(18, 5),
    )
    assert (screen.plan.form.is_open, screen.plan.free) == (True, None)
    ui.advance(1)
    ui.tap_at(*spot(timeline, "Sisu", 0.2))
    settle(screen, ui)
    assert screen.plan.free is None  # that time has passed


def drag(screen, ui, schedule, hours: float) -> None:
    timeline = ui.find(Lanes)
    left, bottom, right, top, _key = next(hit for hit in timeline.boxes() if hit[4][:2] == ("schedule", schedule.id))
    x, y = timeline.to_window(min(left + 20, (left + right) / 2), (bottom + top) / 2)
    touch = rest(ui, x, y)
    touch.touch_move(x + timeline.left_of(hours) - timeline.left_of(0), y)
    touch.touch_up()
    settle(screen, ui)


def bars_of(ui, schedule) -> list[str]:
    return [bar.state for lane in ui.find(Lanes).lanes for bar in lane.bars if bar.key[:2] == ("schedule", schedule.id)]


def test_a_start_that_is_dragged_stays_there_dashed_until_a_button_says_what_moves(screen, container, ui):
    """One drag, one tap."""
    schedule = named(container, "Night stock count", "Aino")
    drag(screen, ui, schedule, -1.5)
    assert screen.plan.moving.title == "Night stock count on Aino → 17:30"
    assert bars_of(ui, schedule)[0] == "was"
    assert named(container, "Night stock count", "Aino") == schedule
    press(screen, ui, "All starts")
    assert named(container, "Night stock count", "Aino").start.time() == time(17, 30)
    assert bars_of(ui, schedule)[0] == "planned"
    ui.tap(ui.find(root=ui.find(Snackbar), text="Undo"))
    settle(screen, ui)
    assert named(container, "Night stock count", "Aino").start == schedule.start


def test_what_moves_with_a_dragged_start_of_many_is_said_before_and_after(screen, container, ui):
    """Earlier ones, too."""
    night = named(container, "Night stock count", "Aino")
    rule = "FREQ=MINUTELY;INTERVAL=30"
    often = container.catalogue.save_schedule(
        replace(night, start=datetime(2026, 11, 20, 8, 0), recurrence=rule, between=Between(time(8), time(16)))
    )
    settle(screen, ui)
    at = datetime(2026, 11, 20, 13, 0, tzinfo=UTC)
    screen.plan.move_start(
        ("schedule", often.id, at), (at + timedelta(minutes=10) - screen.plan.timeline.origin) / timedelta(hours=1)
    )
    settle(screen, ui)
    assert screen.plan.moving.note == "was 15:00 · All starts: Every 30 min 08:10–16:10"
    assert [button.text for button in ui.find_all(CommandButton) if "15:00" in button.text] == [
        "Keep 15:00",
        "Only 15:00",
    ]
    press(screen, ui, "All starts")
    assert "is changed: Every 30 min 08:10–16:10" in ui.find(Snackbar).text


def test_a_start_moved_before_is_said_to_go_where_all_starts_go(screen, container, ui):
    often = container.catalogue.save_schedule(
        replace(
            named(container, "Night stock count", "Aino"),
            start=datetime(2026, 11, 20, 8, 0),
            recurrence="FREQ=MINUTELY;INTERVAL=30",
            between=Between(time(8), time(16)),
        )
    )
    at, minute = datetime(2026, 11, 20, 13, 0, tzinfo=UTC), timedelta(minutes=1)
    container.moving.move(often.id, at + 30 * minute, datetime(2026, 11, 20, 15, 40))
    settle(screen, ui)
    for minutes, words in ((10, "08:10–16:10, also those moved or skipped before"), (30, "08:30–16:30")):
        hour = (at + minutes * minute - screen.plan.timeline.origin) / timedelta(hours=1)
        screen.plan.move_start(("schedule", often.id, at), hour)
        assert screen.plan.moving.note == f"was 15:00 · All starts: Every 30 min {words}"


def test_a_start_goes_to_another_robot_by_its_card_and_back(screen, container, ui):
    schedule = named(container, "Night stock count", "Aino")
    tap_bar(ui, ("schedule", schedule.id))
    card_of(ui)
    take(screen, ui, "Other robot")
    ui.tap(ui.find(OptionRow, title="Sisu"))
    settle(screen, ui)
    [run] = [run for run in container.plan.next(40) if run.schedule.moved_of == schedule.id]
    assert (run.robot.name, ui.find(Snackbar).text) == ("Sisu", "Night stock count on Aino is moved to Sisu · 19:00")
    ui.tap(ui.find(root=ui.find(Snackbar), text="Undo"))
    settle(screen, ui)
    assert not [run for run in container.plan.next(40) if run.schedule.moved_of]


def test_a_start_does_not_go_to_a_robot_without_its_mission(screen, container, ui, monkeypatch):
    schedule = named(container, "Night stock count", "Aino")
    sisu = next(robot for robot in container.catalogue.robots() if robot.name == "Sisu")
    monkeypatch.setattr(container.robot_missions, "names", lambda robot_id: {"x": "X"} if robot_id == sisu.id else {})
    screen.plan._refresher.read()
    settle(screen, ui)
    tap_bar(ui, ("schedule", schedule.id))
    card_of(ui)
    take(screen, ui, "Other robot")
    row = ui.find(OptionRow, title="Sisu")
    assert "does not have the mission" in row.item.support
    ui.tap(row)
    settle(screen, ui)
    assert ui.find(Snackbar).text == "Sisu does not have the mission Night stock count"
    assert not [run for run in container.plan.next(40) if run.schedule.moved_of]


def test_what_was_edited_while_the_question_is_open_stays(screen, container, ui):
    schedule = named(container, "Night stock count", "Aino")
    drag(screen, ui, schedule, -1.5)
    container.catalogue.save_schedule(replace(schedule, priority=1))
    settle(screen, ui)
    press(screen, ui, "All starts")
    moved = container.catalogue.schedule(schedule.id)
    assert (moved.start.time(), moved.priority) == (time(17, 30), 1)


def test_a_start_that_is_not_there_any_more_moves_no_others(screen, container, ui):
    schedule = named(container, "Night stock count", "Aino")
    drag(screen, ui, schedule, -1.5)
    edited = container.catalogue.save_schedule(replace(schedule, start=schedule.start.replace(hour=21)))
    settle(screen, ui)
    press(screen, ui, "All starts")
    assert container.catalogue.schedule(schedule.id).start == edited.start
    assert "no longer has this start" in ui.find(Snackbar).text


@pytest.mark.parametrize(
    ("edit", "hour", "is_refused"), [({"priority": 1}, 19, False), ({"start": datetime(2026, 11, 20, 21, 0)}, 21, True)]
)
def test_undo_of_all_starts_loses_no_edit_made_since(screen, container, ui, edit, hour, is_refused):
    schedule = named(container, "Night stock count", "Aino")
    drag(screen, ui, schedule, -1.5)
    press(screen, ui, "All starts")
    moved = container.catalogue.schedule(schedule.id)
    edited = container.catalogue.save_schedule(replace(moved, **edit))  # elsewhere
    ui.tap(ui.find(root=ui.find(Snackbar), text="Undo"))
    settle(screen, ui)
    stored = container.catalogue.schedule(schedule.id)
    assert (stored.start.hour, stored.priority) == (hour, edited.priority)
    assert any("was changed again" in text for text in screen.shell.snackbars.texts) is is_refused


def test_what_is_saved_after_a_move_is_undone_without_the_move(screen, container, ui):
    schedule = named(container, "Night stock count", "Aino")
    drag(screen, ui, schedule, -1.5)
    press(screen, ui, "All starts")
    moved = container.catalogue.schedule(schedule.id)
    screen.plan.edit(schedule.id)
    screen.plan.form.set(priority=1)
    settle(screen, ui)
    save(screen, ui)
    assert screen.shell.snackbars.texts == ["Night stock count on Aino is changed"]
    ui.tap_text("Undo")
    settle(screen, ui)
    assert container.catalogue.schedule(schedule.id) == moved != schedule


def test_a_start_that_is_dragged_can_be_kept(screen, container, ui):
    schedule = named(container, "Night stock count", "Aino")
    drag(screen, ui, schedule, -1.5)
    press(screen, ui, "Keep 19:00")
    assert (screen.plan.moving, bars_of(ui, schedule)[0]) == (None, "planned")
    assert named(container, "Night stock count", "Aino") == schedule


def test_only_the_start_that_was_dragged_is_moved(screen, container, ui):
    """One drag, one tap."""
    schedule = named(container, "Night stock count", "Aino")
    drag(screen, ui, schedule, -1.5)
    press(screen, ui, "Only 19:00")
    assert container.catalogue.schedule(schedule.id).start == schedule.start
    begins = [run.at.hour for run in container.plan.next(40) if "Night stock count" in run.schedule.name][:2]
    assert begins == [15, 17]  # UTC: 17:30 today, 19:00 after that
    ui.tap(ui.find(root=ui.find(Snackbar), text="Undo"))
    settle(screen, ui)
    assert bars_of(ui, schedule)[0] == "planned"


def test_a_start_that_was_dragged_goes_there_though_the_plan_was_paged_since(screen, container, ui):
    schedule = named(container, "Night stock count", "Aino")
    drag(screen, ui, schedule, -1.5)
    for _page in range(5):
        screen.plan.page(True)
        settle(screen, ui)
    press(screen, ui, "Only 19:00")
    begins = [run.at for run in container.plan.next(40) if "Night stock count" in run.schedule.name][:2]
    assert [f"{at:%d %H:%M}" for at in begins] == ["20 15:30", "23 17:00"]


def test_the_card_of_a_start_asks_for_its_new_time(screen, container, ui):
    schedule = named(container, "Night stock count", "Aino")
    tap_bar(ui, ("schedule", schedule.id))
    card_of(ui)
    take(screen, ui, "Move")
    for part, word in ((0, "20"), (-1, "15")):  # both are an hour and a minute
        ui.tap(ui.find_all(TimeCell, text=word)[part])
    settle(screen, ui)
    assert screen.plan.moving.title == "Night stock count on Aino → 20:15"


def test_the_plan_jumps_to_the_draft_and_shows_it_dashed(screen, container, ui):
    choose(screen, ui, "Mission", KITS)
    screen.plan.form.set(day=date(2026, 11, 25), at=time(6, 30))
    settle(screen, ui)
    timeline = ui.find(Lanes)
    [draft] = [bar for lane in timeline.lanes for bar in lane.bars if bar.state == "draft"]
    assert timeline.first <= draft.start < timeline.first + timeline.hours
    press(screen, ui, "Today")
    screen.plan.form.put_aside()
    settle(screen, ui)
    assert "draft" not in {bar.state for lane in timeline.lanes for bar in lane.bars}


def test_a_draft_that_is_refused_is_not_in_the_plan(screen, container, ui):
    choose(screen, ui, "Mission", KITS)
    found = []
    for day in (date(2026, 11, 27), date(2026, 11, 28)):  # a Friday, a Saturday
        screen.plan.form.set(day=day, at=time(6, 30))
        settle(screen, ui)
        found.append(any(bar.state == "draft" for lane in ui.find(Lanes).lanes for bar in lane.bars))
    assert found == [True, False]


def test_the_form_counts_the_overlaps_that_the_plan_shows(screen, container, ui):
    choose(screen, ui, "Mission", KITS)
    screen.plan.form.set(kind=Kind.EVERY, every=30, day=date(2026, 11, 23), at=time(6, 0), until_time=time(18))
    settle(screen, ui)
    screen.plan.show_span(24)
    settle(screen, ui)
    drawing = ui.find(Lanes)._drawing
    drafts = [one for lane in drawing.lanes for one in drawing.placed_of(lane) if one.bar.state == "draft"]
    shown = sum(one.overlaps for one in drafts)
    assert shown > 5
    assert any(note.text.startswith(f"{shown} overlaps with") for note in screen.plan.form.view.notes)


# ---------------------------------------------------------------------- many robots
def add_robots(container, count: int) -> None:
    def add(c) -> None:
        for n in range(count):
            container.repositories.robots.add(c, Robot(f"Robot {n}", f"http://10.0.0.{n}", "distributor", "token"))

    container.db.write(add)
    container.changes.publish(Topic.ROBOTS)


def test_many_robots_are_filtered_by_a_chip(screen, container, ui):
    assert robots_chip(ui) is None  # few are all in sight
    add_robots(container, 20)
    settle(screen, ui)
    timeline = ui.find(Lanes)
    assert len(timeline.lanes) == 23
    tick(screen, ui, "Aino", "Robot 1")
    assert [lane.name for lane in timeline.lanes] == ["Aino", "Robot 1"]
    chip = robots_chip(ui)
    assert (chip.text, chip.active) == ("2 robots", True)
    tick(screen, ui, "Aino", "Robot 1")
    assert (chip.text, chip.active, len(timeline.lanes)) == ("All robots", False, 23)


def tick(screen, ui, *names: str) -> None:
    """Robots in the list that the chip opens."""
    ui.tap(robots_chip(ui))
    settle(screen, ui)
    for name in names:
        ui.tap(ui.find(OptionRow, title=name))
    press(screen, ui, "Show")


def robots_chip(ui) -> MenuChip | None:
    return next((chip for chip in ui.find_all(MenuChip, ui.find(PlanPage)) if chip.text.endswith("obots")), None)


# ---------------------------------------------------------------------- the timeline's window
def test_the_plan_is_zoomed_paged_and_brought_back_by_buttons(screen, ui):
    timeline, vm = ui.find(Lanes), screen.plan
    ui.tap(ui.find(MenuChip, ui.find(PlanPage), text="8 h"))
    ui.advance(0.3)
    take(screen, ui, "24 h")
    assert (timeline.hours, vm.timeline.span) == (24, "24 h")
    ui.tap(ui.find(IconButton, icon="chevron-right"))
    ui.wait(lambda: timeline.now < timeline.first)
    left = vm.timeline.origin + timedelta(hours=timeline.first)
    ui.wait(lambda: max(tick for tick, _label, _strong in timeline.ticks) > timeline.first + 1.3 * timeline.hours)
    assert abs(vm.timeline.origin + timedelta(hours=timeline.first) - left) < timedelta(minutes=1)
    press(screen, ui, "Today")
    ui.wait(lambda: timeline.first <= timeline.now <= timeline.first + timeline.hours)


def test_tapping_the_break_unfolds_a_weekend_and_tapping_closed_time_folds_it(screen, ui):
    screen.plan.show_span(24)
    settle(screen, ui)
    ui.advance(0.5)
    timeline = ui.find(Lanes)
    (weekend,) = (band for band in timeline.bands if band.kind == "folded")
    left, right = (timeline.left_of(hour) for hour in (weekend.start, weekend.end))
    assert right - left == pytest.approx(dp(72))
    ui.tap_at(*timeline.to_window((left + right) / 2, timeline._drawing.frame.middle(1)))
    settle(screen, ui)
    assert [(band.text, band.kind) for band in timeline.bands] == [
        ("Saturday: day off", "closed"),
        ("Sunday: day off", "closed"),
    ]
    assert timeline.left_of(weekend.start) == pytest.approx(left)
    ui.tap_at(*timeline.to_window(left + 100, timeline._drawing.frame.middle(1)))
    settle(screen, ui)
    assert weekend in timeline.bands


def test_a_finger_drags_the_plan_and_what_comes_into_sight_is_read(screen, ui):
    timeline = ui.find(Lanes)
    first = screen.plan.timeline.origin + timedelta(hours=timeline.first)
    ui.drag(timeline, -timeline.width * 0.4, 0)
    now_first = screen.plan.timeline.origin + timedelta(hours=timeline.first)
    assert timedelta(hours=8 * 0.4) < now_first - first < timedelta(hours=8 * 0.4 / 0.7)  # the names take up to 30 %
    ui.wait(lambda: max(tick for tick, _label, _strong in timeline.ticks) > timeline.first + 10)
