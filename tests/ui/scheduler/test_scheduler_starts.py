"""Starts that are skipped or lie on each other, the day that the timeline shows, schedules with names of their own or that are over."""

from __future__ import annotations

from dataclasses import replace
from datetime import UTC, datetime, time, timedelta
from zoneinfo import ZoneInfo

from app.domain.models import Schedule
from app.screens.scheduler.cards import FormCard, StartChip
from app.widgets.buttons import CommandButton, IconButton, Toggle
from app.widgets.dialogs import MenuRow
from app.widgets.rows import OptionRow
from app.widgets.snackbar import Snackbar
from app.widgets.timeline import Timeline
from tests.support import month
from tests.ui.planner import KITS, card_of, named, press, row, settle, take, tap_bar


def test_any_planned_start_can_be_left_out_from_its_bar_and_taken_again(screen, container, ui):
    schedule = named(container, KITS, "Aino")
    second = [run.at for run in container.plan.next(20) if run.schedule.id == schedule.id][1]
    for end in ("Undo", "Start it after all"):
        tap_bar(ui, ("schedule", schedule.id, second))
        card_of(ui)
        take(screen, ui, "Skip this one")
        assert ui.find(Snackbar).text == "The start of Deliver kits to line 2 on Aino is skipped: 16:00"
        starts = [run.at for run in container.plan.next(20) if run.schedule.id == schedule.id]
        assert (starts[0], second in starts) == (schedule.next_at, False)
        assert second not in [
            bar.key[2] for lane in ui.find(Timeline).lanes for bar in lane.bars if bar.key[0] == "schedule"
        ]
        if end == "Undo":
            ui.tap(ui.find(root=ui.find(Snackbar), text=end))
        else:  # after the message was closed
            bar = next(bar for lane in ui.find(Timeline).lanes for bar in lane.bars if bar.label == f"Not run: {KITS}")
            tap_bar(ui, bar.key)
            assert "Skipped by a person on 20 Nov 2026 14:38" in card_of(ui).text
            take(screen, ui, end)
            assert (
                screen.shell.snackbars.texts[-1]
                == "The start of Deliver kits to line 2 on Aino is planned again: 16:00"
            )
        settle(screen, ui)
        assert [run.at for run in container.plan.next(20) if run.schedule.id == schedule.id][1] == second


def test_skipping_and_taking_back_have_one_place_on_the_card(screen, container, ui):
    """Each tap is at the place of the one before."""
    schedule = named(container, KITS, "Aino")
    second = [run.at for run in container.plan.next(20) if run.schedule.id == schedule.id][1]
    key, place, places, said = ("schedule", schedule.id, second), None, [], []
    for _tap in range(4):
        tap_bar(ui, key)
        card = card_of(ui)
        first, *others = ui.find_all(MenuRow, card)
        place = place or first.to_window(*first.center)
        said.append((first.text, *(row.text for row in others)))
        places.append([row.to_window(*row.center) for row in (first, *others)])
        ui.tap_at(*place)
        settle(screen, ui)
        skipped = next(
            (bar.key for lane in ui.find(Timeline).lanes for bar in lane.bars if bar.label == f"Not run: {KITS}"), None
        )
        key = skipped or ("schedule", schedule.id, second)
    assert said == 2 * [
        ("Skip this one", "Edit schedule", "Run now"),
        ("Start it after all", "Edit schedule", "Open in Logs"),
    ]
    heights = [[round(y) for _x, y in rows] for rows in places]
    assert all(abs(y - before) < 24 for rows in heights for y, before in zip(rows, heights[0], strict=True))


def test_a_start_that_was_planned_again_by_mistake_is_skipped_again_by_undo(screen, container, ui):
    schedule = named(container, KITS, "Aino")
    at = container.pausing.skip_next(schedule.id)
    screen.plan.actions.unskip(schedule, at)
    settle(screen, ui)
    assert at in [run.at for run in container.plan.next(20) if run.schedule.id == schedule.id]
    ui.tap(ui.find(root=ui.find(Snackbar), text="Undo"))
    settle(screen, ui)
    assert at not in [run.at for run in container.plan.next(20) if run.schedule.id == schedule.id]


def test_each_start_in_an_unchanged_form_can_be_skipped(screen, container, ui):
    schedule = named(container, KITS, "Aino")
    screen.plan.edit(schedule.id)
    settle(screen, ui)
    assert [start.text for start in ui.find_all(StartChip)][:3] == [
        "Fri 20 · 15:00",
        "Fri 20 · 16:00",
        "Fri 20 · 17:00",
    ]
    press(screen, ui, "Skip a start")
    assert screen.shell.dialogs.top.title == "Skip which start of Deliver kits to line 2 on Aino?"
    ui.tap(ui.find(OptionRow, text="Fri 20 · 17:00"))
    settle(screen, ui)
    assert screen.shell.dialogs.top is None
    assert ui.find(Snackbar).text == "The start of Deliver kits to line 2 on Aino is skipped: 17:00"
    assert [start.text for start in ui.find_all(StartChip)][:3] == [
        "Fri 20 · 15:00",
        "Fri 20 · 16:00",
        "Fri 20 · 17:00 · skipped",
    ]
    ui.tap(ui.find(root=ui.find(Snackbar), text="Undo"))
    settle(screen, ui)
    assert [start.text for start in ui.find_all(StartChip)][2] == "Fri 20 · 17:00"
    screen.plan.form.set(at=time(6, 30))  # not a start yet
    settle(screen, ui)
    assert ui.find(CommandButton, text="Skip a start").disabled
    assert "Save the changes first, then skip a start" in ui.texts(ui.find(FormCard))
    screen.plan.form.set(at=schedule.start.time())
    settle(screen, ui)
    assert not ui.find(CommandButton, text="Skip a start").disabled
    assert "Save the changes first, then skip a start" not in ui.texts(ui.find(FormCard))
    container.catalogue.switch_schedule(schedule.id, False)
    settle(screen, ui)
    assert not ui.find_all(CommandButton, text="Skip a start")  # there is none


def test_the_form_says_which_starts_are_skipped_and_takes_them_back(screen, container, ui):
    def shown() -> list[str]:
        settle(screen, ui)
        return [start.text for start in ui.find_all(StartChip)][:4]

    schedule = named(container, KITS, "Aino")
    screen.plan.edit(schedule.id)
    assert shown() == ["Fri 20 · 15:00", "Fri 20 · 16:00", "Fri 20 · 17:00", "Fri 20 · 18:00"]
    container.pausing.skip(schedule.id, schedule.next_at + timedelta(hours=1))
    assert shown() == ["Fri 20 · 15:00", "Fri 20 · 16:00 · skipped", "Fri 20 · 17:00", "Fri 20 · 18:00"]
    chip = ui.find_all(StartChip)[1]
    assert (chip.kind, chip.ids.badge_text.text) == ("skip-next", "[s]Fri 20 · 16:00[/s] skipped")
    press(screen, ui, "Skip or restore a start")
    assert screen.shell.dialogs.top.title == "Skip or restore which start of Deliver kits to line 2 on Aino?"
    assert [(option.text, option.note) for option in ui.find_all(OptionRow)][:3] == [
        ("Fri 20 · 15:00", ""),
        ("Fri 20 · 16:00", "skipped: start it after all"),
        ("Fri 20 · 17:00", ""),
    ]
    ui.tap(ui.find(OptionRow, text="Fri 20 · 16:00"))
    assert shown()[1] == "Fri 20 · 16:00"
    assert ui.find(Snackbar).text == "The start of Deliver kits to line 2 on Aino is planned again: 16:00"
    assert ui.find(CommandButton, text="Skip a start")


def test_the_only_start_that_is_skipped_is_started_after_all_from_the_form(screen, container, ui):
    robot = named(container, KITS, "Aino")
    once = container.catalogue.save_schedule(
        Schedule("Morning round", robot.robot_id, robot.mission_id, datetime(2026, 11, 20, 14, 50), month.ZONE)
    )
    container.pausing.skip_next(once.id)
    settle(screen, ui)
    screen.plan.edit(once.id)
    settle(screen, ui)
    assert [start.text for start in ui.find_all(StartChip)] == ["Fri 20 · 14:50 · skipped"]
    press(screen, ui, "Skip or restore a start")
    ui.tap(ui.find(OptionRow, text="Fri 20 · 14:50"))
    settle(screen, ui)
    assert [start.text for start in ui.find_all(StartChip)] == ["Fri 20 · 14:50"]


def test_a_skipped_start_that_its_rule_has_no_more_leaves_the_timeline(screen, container, ui):
    def skipped() -> list[str]:
        settle(screen, ui)
        return [bar.label for lane in ui.find(Timeline).lanes for bar in lane.bars if bar.label.startswith("Not run")]

    schedule = named(container, "Night stock count", "Aino")
    container.pausing.skip(schedule.id, schedule.next_at)
    assert skipped() == ["Not run: Night stock count"]
    container.catalogue.save_schedule(replace(schedule, start=schedule.start.replace(hour=20)))
    assert skipped() == []


def test_the_list_still_says_how_it_last_went_when_a_start_to_come_is_skipped(screen, container, ui):
    schedule = named(container, KITS, "Aino")
    before = next(data for data in screen.plan.listed.rows if data.key == schedule.id)
    container.pausing.skip_next(schedule.id)
    settle(screen, ui)
    after = next(data for data in screen.plan.listed.rows if data.key == schedule.id)
    assert (before.last, after.last, before.next, after.next) == (
        "Completed",
        "Completed",
        "Aino · in 22 min",
        "Aino · in 1 h 22 min",
    )


def test_arrows_of_the_card_reach_each_start_at_the_same_time(screen, container, ui):
    schedule = named(container, "Night stock count", "Aino")
    other = container.catalogue.save_schedule(replace(schedule, id=0, name="Second count"))
    settle(screen, ui)
    tap_bar(ui, ("schedule", other.id))
    card, said = card_of(ui), []
    for _ in range(3):
        said.append((card.text.splitlines()[0], next(text for text in ui.texts(card) if text in ("1 of 2", "2 of 2"))))
        ui.tap(ui.find(IconButton, card, icon="chevron-right"))
        ui.advance(0.2)
    assert {said[0][0], said[1][0]} == {"Second count", "Aino · Fri 20 Nov 19:00–21:54"}
    assert ([at for _name, at in said], said[2]) == (["1 of 2", "2 of 2", "1 of 2"], said[0])
    wanted = schedule if said[1][0].startswith("Aino") else other  # the one that is shown now
    take(screen, ui, "Edit schedule")
    assert screen.plan.form.editing == wanted.id


def test_a_bar_that_lies_on_no_other_has_no_arrows(screen, container, ui):
    tap_bar(ui, ("schedule", named(container, "Night stock count", "Aino").id))
    card = card_of(ui)
    assert not ui.find_all(IconButton, card)
    assert "1 of 1" not in ui.texts(card)


def test_the_timeline_names_the_day_that_it_shows(screen, ui):
    timeline, vm = ui.find(Timeline), screen.plan
    assert timeline.day_text(timeline.first) == "Fri 20 Nov"
    vm.zoom(False)
    vm.zoom(False)
    for _ in range(9):
        vm.page(True)
    settle(screen, ui)
    assert timeline.hours == 6
    assert vm.timeline.origin + timedelta(hours=timeline.first) > month.NOW + timedelta(hours=24)
    day = (vm.timeline.origin + timedelta(hours=timeline.first)).astimezone(ZoneInfo(month.ZONE))
    assert timeline.day_text(timeline.first) == f"{day:%a} {day.day} Nov" != "Fri 20 Nov"
    next_year = datetime(2027, 3, 16, 12, tzinfo=UTC)
    assert timeline.day_text((next_year - vm.timeline.origin) / timedelta(hours=1)) == "Tue 16 Mar 2027"


def test_a_one_time_schedule_that_is_over_is_last_greyed_and_has_no_switch(screen, container, ui):
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
    assert row(ui, once).name == "Morning round"
    assert "Morning round · Deliver kits to line 2" in ui.texts(row(ui, once))
    assert ui.find_all(Toggle, row(ui, once))
    container.pausing.skip_next(once.id)
    settle(screen, ui)
    *_others, last = screen.plan.listed.rows
    assert (last.key, last.over, last.next) == (once.id, True, "Over · not run Fri 20 Nov 14:50")
    screen.plan.listed.set(query="morning")
    settle(screen, ui)
    line = row(ui, once)
    assert (line.height, ui.find_all(Toggle, line)) == (72, [])
    assert "Over · not run Fri 20 Nov 14:50" in ui.texts(line)
