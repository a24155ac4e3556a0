"""Starts that are skipped or lie on each other, the day that the timeline shows, schedules with names of their own or that are over."""

from __future__ import annotations

from dataclasses import replace
from datetime import UTC, datetime, timedelta
from zoneinfo import ZoneInfo

from app.domain.models import Schedule
from app.screens.scheduler.cards import StartLine
from app.widgets.buttons import IconButton
from app.widgets.lanes import Lanes
from app.widgets.snackbar import Snackbar
from tests.support import month
from tests.support.edits import skip_next
from tests.ui.planner import KITS, card_of, named, row, settle, tab, take, tap_bar


def test_any_planned_start_can_be_left_out_from_its_bar_and_taken_again(screen, container, ui):
    schedule = named(container, KITS, "Aino")
    second = [run.at for run in container.plan.next(20) if run.schedule.id == schedule.id][1]
    for end in ("Undo", "Start it after all"):
        tap_bar(ui, ("schedule", schedule.id, second))
        card_of(ui)
        take(screen, ui, "Skip")
        assert ui.find(Snackbar).text == "The start of Deliver kits to line 2 on Aino is skipped: 16:00"
        starts = [run.at for run in container.plan.next(20) if run.schedule.id == schedule.id]
        assert (starts[0], second in starts) == (schedule.next_at, False)
        assert second not in [
            bar.key[2] for lane in ui.find(Lanes).lanes for bar in lane.bars if bar.key[0] == "schedule"
        ]
        if end == "Undo":
            ui.tap(ui.find(root=ui.find(Snackbar), text=end))
        else:  # after the message was closed
            bar = next(
                bar
                for lane in ui.find(Lanes).lanes
                for bar in lane.bars
                if bar.state == "skipped" and bar.label == KITS
            )
            tap_bar(ui, bar.key)
            assert "Skipped by a person on 20 Nov 2026 14:38" in card_of(ui).text
            take(screen, ui, end)
            assert (
                screen.shell.snackbars.texts[-1]
                == "The start of Deliver kits to line 2 on Aino is planned again: 16:00"
            )
        settle(screen, ui)
        assert [run.at for run in container.plan.next(20) if run.schedule.id == schedule.id][1] == second


def test_a_start_that_was_planned_again_by_mistake_is_skipped_again_by_undo(screen, container, ui):
    schedule = named(container, KITS, "Aino")
    at = skip_next(container, schedule.id)
    screen.plan.actions.unskip(schedule, at)
    settle(screen, ui)
    assert at in [run.at for run in container.plan.next(20) if run.schedule.id == schedule.id]
    ui.tap(ui.find(root=ui.find(Snackbar), text="Undo"))
    settle(screen, ui)
    assert at not in [run.at for run in container.plan.next(20) if run.schedule.id == schedule.id]


def test_the_form_says_which_starts_are_skipped(screen, container, ui):
    schedule = named(container, KITS, "Aino")
    screen.plan.edit(schedule.id)
    container.pausing.skip(schedule.id, schedule.next_at + timedelta(hours=1))
    settle(screen, ui)
    lines = ui.find_all(StartLine)[:3]
    assert [line.item.text for line in lines] == [
        "Fri 20 Nov · 15:00",
        "Fri 20 Nov · 16:00 · not run",
        "Fri 20 Nov · 17:00",
    ]
    assert lines[1].item.icon == "skip-next"


def test_a_moved_start_that_is_skipped_stays_in_the_plan_and_can_start_after_all(screen, container, ui):
    schedule = named(container, KITS, "Aino")
    veikko = next(robot for robot in container.catalogue.robots() if robot.name == "Veikko")
    at = schedule.next_at
    local = at.astimezone(ZoneInfo(month.ZONE)).replace(tzinfo=None)
    moved = container.moving.move(schedule.id, at, local, robot_id=veikko.id)
    container.pausing.skip(moved.after.id, at)
    settle(screen, ui)
    bar = next(bar for lane in ui.find(Lanes).lanes for bar in lane.bars if (bar.state, bar.label) == ("skipped", KITS))
    tap_bar(ui, bar.key)
    card_of(ui)
    take(screen, ui, "Start it after all")
    settle(screen, ui)
    again = [run for run in container.plan.next(20) if run.schedule.id == moved.after.id]
    assert [(run.robot.name, run.at) for run in again] == [("Veikko", at)]


def test_a_skipped_start_that_its_rule_has_no_more_leaves_the_timeline(screen, container, ui):
    def skipped() -> list[str]:
        settle(screen, ui)
        return [bar.label for lane in ui.find(Lanes).lanes for bar in lane.bars if bar.state == "skipped" and bar.label]

    schedule = named(container, "Night stock count", "Aino")
    container.pausing.skip(schedule.id, schedule.next_at)
    assert skipped() == ["Night stock count"]
    container.catalogue.save_schedule(replace(schedule, start=schedule.start.replace(hour=20)))
    assert skipped() == []


def test_the_list_still_says_how_it_last_went_when_a_start_to_come_is_skipped(screen, container, ui):
    schedule = named(container, KITS, "Aino")
    before = next(data for data in screen.plan.listed.rows if data.key == schedule.id)
    skip_next(container, schedule.id)
    settle(screen, ui)
    after = next(data for data in screen.plan.listed.rows if data.key == schedule.id)
    assert (before.meta, before.lead, after.lead) == (after.meta, "15:00", "16:00")


def test_a_bar_that_lies_on_no_other_has_no_arrows(screen, container, ui):
    tap_bar(ui, ("schedule", named(container, "Night stock count", "Aino").id))
    card = card_of(ui)
    assert not ui.find_all(IconButton, card)
    assert "1 of 1" not in ui.texts(card)


def test_the_timeline_names_the_day_that_it_shows(screen, ui):
    timeline, vm = ui.find(Lanes), screen.plan
    assert timeline.day_text(timeline.first) == ""  # today
    vm.show_span(6)
    for _ in range(9):
        vm.page(True)
    settle(screen, ui)
    assert timeline.hours == 6
    assert vm.timeline.origin + timedelta(hours=timeline.first) > month.NOW + timedelta(hours=24)
    day = (vm.timeline.origin + timedelta(hours=timeline.first)).astimezone(ZoneInfo(month.ZONE))
    assert timeline.day_text(timeline.first) == f"{day:%a} {day.day} Nov" != "Fri 20 Nov"
    next_year = datetime(2027, 3, 16, 12, tzinfo=UTC)
    assert timeline.day_text((next_year - vm.timeline.origin) / timedelta(hours=1)) == "Tue 16 Mar 2027"


def test_a_one_time_schedule_that_is_over_is_last_and_greyed(screen, container, ui):
    once = container.catalogue.save_schedule(
        Schedule(
            "Morning round",
            named(container, KITS, "Aino").robot_id,
            named(container, KITS, "Aino").mission_id,
            datetime(2026, 11, 20, 14, 50),
            month.ZONE,
        )
    )
    settle(screen, ui)
    tab(screen, ui, "schedules")
    assert row(ui, once).item.aside == "Morning round"
    skip_next(container, once.id)
    settle(screen, ui)
    *_others, last = screen.plan.listed.rows
    assert (last.key, last.look, last.meta) == (once.id, "faint", "Not run")
    screen.plan.listed.set(query="morning")
    settle(screen, ui)
    line = row(ui, once)
    assert "Once, Fri 20 Nov 14:50 · over" in ui.texts(line)
