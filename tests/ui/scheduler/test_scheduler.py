"""The form of the Scheduler as an operator uses it: taps and typing on real services."""

from __future__ import annotations

import threading
from dataclasses import replace
from datetime import date, datetime, time
from unittest.mock import Mock

import pytest

from app.domain.models import Between, Overlap
from app.domain.robot import MissionParameter
from app.mir.errors import Unreachable
from app.screens.common.mission_names import NOTHING_KNOWN
from app.screens.scheduler.cards import FormSheet, StartLine
from app.screens.scheduler.draft import Kind
from app.services.live.changes import Topic
from app.widgets.buttons import CommandButton, Segment
from app.widgets.choices import ChoiceSheet, OptionRow
from app.widgets.fields import Field, SearchField
from app.widgets.pickers import TimeCell
from app.widgets.snackbar import Snackbar
from tests.support import month
from tests.ui.checks import area, parents, visible_area
from tests.ui.planner import (
    KITS,
    WASTE,
    choose,
    field,
    kind,
    named,
    new,
    pick_day,
    pick_time,
    press,
    reveal,
    save,
    save_button,
    schedules,
    settle,
    stock,
)


def step(screen, ui, label: str, presses: str) -> str:
    """The value between minus and plus, after pressing them; the rarer fields are unfolded."""
    screen.plan.form.more = True
    settle(screen, ui)
    for icon in presses.split():
        reveal(ui, field(ui, label))
        ui.tap(ui.find(CommandButton, field(ui, label), icon=icon))
        settle(screen, ui)
    return f"{field(ui, label).value} {field(ui, label).unit}"


def remedy(screen, ui, word: str) -> None:
    """The button of a note."""
    button = ui.find(CommandButton, ui.find(FormSheet), text=word)
    reveal(ui, button)
    ui.tap(button)
    settle(screen, ui)


def unfold(screen, ui) -> None:
    """The rarer fields."""
    label = ui.find(text="Advanced")
    reveal(ui, label)
    ui.tap(label)
    settle(screen, ui)


# ---------------------------------------------------------------------- planning
def test_a_weekly_mission_is_planned_from_the_form_to_the_database(screen, container, ui):
    choose(screen, ui, "Mission", WASTE)
    choose(screen, ui, "Robot", "Sisu")
    kind(screen, ui, "Weekly")
    pick_day(screen, ui, "First day", date(2026, 11, 24))
    pick_time(screen, ui, "Time", 6, 30)
    for day in ("Mo", "We"):  # off; the working days were chosen
        ui.tap(ui.find(Segment, text=day))
    assert step(screen, ui, "Min. battery", "plus plus") == "40 %"
    assert ui.find(FormSheet).view.sentence == "Tue, Thu, Fri 06:30"
    assert [start.item.text for start in ui.find_all(StartLine)] == [
        "Tue 24 Nov · 06:30",
        "Thu 26 Nov · 06:30",
        "Fri 27 Nov · 06:30",
        "Tue 1 Dec · 06:30",
        "Thu 3 Dec · 06:30",
    ]
    save(screen, ui)
    saved = named(container, WASTE, "Sisu")
    assert (saved.start, saved.timezone, saved.recurrence, saved.minimum_battery_percent, saved.overlap) == (
        datetime(2026, 11, 24, 6, 30),
        month.ZONE,
        "FREQ=WEEKLY;BYDAY=TU,TH,FR",
        40.0,
        Overlap.SKIP,
    )
    assert ui.find(Snackbar).text == f"{WASTE} on Sisu is planned"
    assert not ui.find_all(FormSheet)
    assert saved.id in [line.key for line in screen.plan.listed.rows]
    screen.plan.edit(saved.id)
    settle(screen, ui)
    ui.tap_text("Undo")
    settle(screen, ui)
    assert saved.id not in [schedule.id for schedule in schedules(container)]
    assert not screen.plan.form.is_open


def test_a_saved_change_can_be_taken_back(screen, container, ui):
    before = stock(container)
    screen.plan.edit(before.id)
    screen.plan.form.set(minimum_battery_percent=40.0)
    elsewhere = container.catalogue.save_schedule(replace(before, enabled=False))
    settle(screen, ui)
    save(screen, ui)
    assert stock(container) == replace(elsewhere, minimum_battery_percent=40.0)
    ui.tap_text("Undo")
    settle(screen, ui)
    assert stock(container) == elsewhere


def test_an_empty_form_proposes_the_shown_robot_and_a_filled_one_keeps_its_own(screen, container, ui):
    aino, veikko = (
        next(robot.id for robot in container.catalogue.robots() if robot.name == name) for name in ("Aino", "Veikko")
    )
    new(screen, ui)
    assert field(ui, "Robot").value == "Aino"
    container.catalogue.change_settings(selected_robot_id=veikko)
    settle(screen, ui)
    assert field(ui, "Robot").value == "Veikko"
    choose(screen, ui, "Mission", WASTE)
    container.catalogue.change_settings(selected_robot_id=aino)
    settle(screen, ui)
    assert field(ui, "Robot").value == "Veikko"


def test_a_one_time_mission_is_planned(screen, container, ui):
    choose(screen, ui, "Mission", KITS)
    pick_time(screen, ui, "Time", 20, 15)
    assert ui.find(FormSheet).view.sentence == "Once, Fri 20 Nov 20:15"
    before = {schedule.id for schedule in schedules(container)}
    save(screen, ui)
    (new,) = (schedule for schedule in schedules(container) if schedule.id not in before)
    assert (new.start, new.recurrence) == (datetime(2026, 11, 20, 20, 15), None)
    assert new.next_at == datetime.fromisoformat("2026-11-20T18:15+00:00")


def test_every_so_many_minutes_between_two_times(screen, container, ui):
    choose(screen, ui, "Mission", "Bring pallet to dock")
    kind(screen, ui, "More")
    assert (field(ui, "Repeats").value, step(screen, ui, "Every", "plus plus plus")) == ("Minutes between", "45 min")
    pick_time(screen, ui, "From", 8, 30)
    pick_time(screen, ui, "To", 16, 45)
    save(screen, ui)
    saved = named(container, "Bring pallet to dock", "Aino")
    assert saved.recurrence == "FREQ=MINUTELY;INTERVAL=45;BYDAY=MO,TU,WE,TH,FR"
    assert saved.between == Between(time(8, 30), time(16, 45))


def test_monthly_on_the_first_monday(screen, container, ui):
    choose(screen, ui, "Mission", "Floor wash, hall A")
    kind(screen, ui, "More")
    choose(screen, ui, "Repeats", "Monthly, by weekday")
    choose(screen, ui, "Which", "first")
    choose(screen, ui, "Weekday", "Monday")
    assert [start.item.text for start in ui.find_all(StartLine)][:2] == ["Mon 7 Dec · 08:00", "Mon 4 Jan · 08:00"]
    save(screen, ui)
    assert named(container, "Floor wash, hall A", "Aino").recurrence == "FREQ=MONTHLY;BYDAY=1MO"


def test_monthly_on_a_day_or_the_last_one(screen, container, ui):
    choose(screen, ui, "Mission", "Floor wash, hall A")
    kind(screen, ui, "More")
    choose(screen, ui, "Repeats", "Monthly, by date")
    for word, day in (("17", 17), ("Last day", -1)):
        cell = ui.find(TimeCell, ui.find(FormSheet), text=word)
        assert ui.texts(cell) == [word]
        reveal(ui, cell)
        ui.tap(cell)
        settle(screen, ui)
        assert screen.plan.form.draft.month_day == day


def test_monthly_on_day_31_names_the_skipped_months_and_offers_the_last_day(screen, container, ui):
    choose(screen, ui, "Mission", "Floor wash, hall A")
    screen.plan.form.set(kind=Kind.MONTHLY, month_day=31)
    settle(screen, ui)
    assert "Not in February, April, June, September, November" in ui.texts()
    remedy(screen, ui, "Last day")
    assert not any(note.text.startswith("Not in") for note in screen.plan.form.view.notes)
    save(screen, ui)
    assert named(container, "Floor wash, hall A", "Aino").recurrence == "FREQ=MONTHLY;BYMONTHDAY=-1"


def test_the_less_common_fields_are_under_more(screen, container, ui):
    choose(screen, ui, "Mission", KITS)
    kind(screen, ui, "Daily")
    pick_time(screen, ui, "Time", 6, 0)
    unfold(screen, ui)
    reveal(ui, field(ui, "Last day"))
    pick_day(screen, ui, "Last day", date(2026, 12, 31))
    reveal(ui, field(ui, "Also at"))
    ui.tap(field(ui, "Also at"))
    ui.advance(0.3)
    dialog = ui.find(ChoiceSheet)
    ui.type(ui.find(SearchField, dialog), "14:00")
    ui.advance(0.2)
    ui.tap(ui.find(OptionRow, dialog, title="14:00"))
    press(screen, ui, "Set")
    name = ui.find(Field, label="Name")
    reveal(ui, name)
    ui.type(name, "Kits, twice")
    ui.key(13)
    settle(screen, ui)
    save(screen, ui)
    saved = next(schedule for schedule in schedules(container) if schedule.name == "Kits, twice")
    assert saved.recurrence == "FREQ=DAILY;BYHOUR=6,14;BYMINUTE=0;UNTIL=20261231"


def test_a_mission_that_asks_for_something_is_planned_with_the_answers(screen, container, ui, monkeypatch):
    count = MissionParameter("count", "Pallets", "integer", 2, 1, 8)
    monkeypatch.setattr(container.robot_missions, "parameters", lambda _robot_id, _guid: (count,))
    choose(screen, ui, "Mission", "Bring pallet to dock")
    pallets = ui.find(Field, kind="step", label="Pallets")
    pallets.text = "9"
    ui.tap(save_button(ui))
    settle(screen, ui)
    assert (pallets.outside, screen.plan.form.is_open) == (True, True)
    pallets.text = "2"
    ui.tap(ui.find(CommandButton, pallets, icon="plus"))
    save(screen, ui)
    assert dict(named(container, "Bring pallet to dock", "Aino").parameters) == {"count": 3}


@pytest.fixture(params=["its robot answers", "its robot is silent, another one has answered before"])
def asks_for_a_position(request, screen, container, monkeypatch):
    """The mission "Bring pallet to dock"."""
    goal = MissionParameter("goal", "Goal", "Reference", choices=(("g-1", "Dock 3"), ("g-2", "Press")), sets="position")
    if request.param == "its robot answers":
        monkeypatch.setattr(container.robot_missions, "parameters", lambda _robot_id, _guid: (goal,))
        return
    mission = next(mission for mission in container.catalogue.missions() if mission.name == "Bring pallet to dock")
    other = next(robot for robot in container.catalogue.robots() if robot.name == "Veikko")
    monkeypatch.setattr(container.parameters, "_answers", {})
    container.parameters.keep({(other.id, mission.guid): (goal,)})
    monkeypatch.setattr(screen.shell.mission_names, "known", NOTHING_KNOWN)
    monkeypatch.setattr(container.robot_missions, "parameters", Mock(side_effect=Unreachable(code="no_answer")))


@pytest.mark.usefixtures("asks_for_a_position")
def test_a_position_is_chosen_by_name_and_nothing_is_planned_without_one(screen, container, ui):
    choose(screen, ui, "Mission", "Bring pallet to dock")
    assert (ui.texts().count("Choose Goal first"), save_button(ui).disabled) == (1, True)
    ui.tap(field(ui, "Goal"))
    ui.tap(ui.find(OptionRow, title="Press"))
    assert field(ui, "Goal").value == "Press"
    assert ("Choose Goal first" in ui.texts(), save_button(ui).disabled) == (False, False)
    save(screen, ui)
    assert dict(named(container, "Bring pallet to dock", "Aino").parameters) == {"goal": "g-2"}


def test_save_is_off_until_it_is_known_what_the_mission_asks_for(screen, container, ui, monkeypatch):
    note, asked = MissionParameter("note", "Note", "String"), threading.Event()
    monkeypatch.setattr(container.robot_missions, "parameters", lambda _robot_id, _guid: asked.wait(30) and (note,))
    monkeypatch.setattr(screen.shell.mission_names, "known", NOTHING_KNOWN)
    new(screen, ui)
    ui.tap(field(ui, "Mission"))
    ui.tap(ui.find(OptionRow, title="Bring pallet to dock"))
    ui.wait(lambda: "Asking Aino …" in ui.texts())
    assert save_button(ui).disabled
    asked.set()
    ui.wait(lambda: ui.find_all(Field, label="Note"))
    assert "Enter Note first" in ui.texts()


def test_parameters_known_from_another_robot_are_asked_for_at_a_silent_one(screen, container, ui, monkeypatch):
    silent = next(robot.id for robot in container.catalogue.robots() if robot.name == "Aino")

    def parameters(robot_id: int, _guid: str) -> tuple[MissionParameter, ...]:
        if robot_id == silent:
            raise Unreachable(code="no_answer", address="10.40.12.21")
        return (MissionParameter("note", "Note", "String"),)

    monkeypatch.setattr(container.robot_missions, "parameters", parameters)
    monkeypatch.setattr(screen.shell.mission_names, "known", NOTHING_KNOWN)
    choose(screen, ui, "Mission", "Bring pallet to dock")
    assert not ui.find_all(Field, label="Note")
    for robot in ("Veikko", "Aino"):
        choose(screen, ui, "Robot", robot)
        ui.wait(lambda: ui.find_all(Field, label="Note"))


def test_missions_that_the_robot_lacks_are_not_offered_for_it(screen, container, ui, monkeypatch):
    mission = next(mission for mission in container.catalogue.missions() if mission.name == KITS)
    monkeypatch.setattr(container.robot_missions, "names", lambda _robot_id: {mission.guid: KITS})
    container.changes.publish(Topic.MISSIONS)
    settle(screen, ui)
    new(screen, ui)
    ui.tap(field(ui, "Mission"))
    assert [row.item.title for row in ui.find_all(OptionRow)] == [KITS, "Not in the list? Fetch it from a robot"]


def test_the_limits_of_settings_hold_unless_others_are_chosen(screen, container, ui):
    choose(screen, ui, "Mission", KITS)
    pick_time(screen, ui, "Time", 20, 15)
    assert step(screen, ui, "May start late", "minus minus minus") == "1 min"
    assert step(screen, ui, "May start late", "plus plus plus plus") == "20 min"
    assert step(screen, ui, "Min. battery", "minus") == "25 %"
    assert step(screen, ui, "Min. battery", "plus") == "30 %"
    ui.type(field(ui, "May start late"), "45")  # behind the 20
    ui.tap(save_button(ui))
    settle(screen, ui)
    assert (screen.plan.form.is_open, "1 to 1440" in ui.texts()) == (True, True)
    field(ui, "May start late").text = ""
    ui.type(field(ui, "May start late"), "45")
    waits = ui.find(Segment, text="Waits")
    reveal(ui, waits)
    ui.tap(waits)
    settle(screen, ui)
    save(screen, ui)
    saved = next(schedule for schedule in schedules(container) if schedule.start == datetime(2026, 11, 20, 20, 15))
    assert (saved.minimum_battery_percent, saved.start_window_minutes, saved.overlap) == (None, 45, Overlap.QUEUE)


def test_a_mission_that_may_start_on_a_low_battery_inherits_no_minimum(screen, container, ui):
    mission = next(
        mission for mission in container.repositories.missions.all(container.db.read()) if mission.name == KITS
    )
    container.catalogue.save_mission(replace(mission, on_low_battery=True))
    settle(screen, ui)
    choose(screen, ui, "Mission", KITS)
    assert step(screen, ui, "Min. battery", "") == "0 %"


# ---------------------------------------------------------------------- what can't be, and what is only odd
def test_nothing_can_be_saved_before_a_mission_is_chosen(screen, ui):
    new(screen, ui)
    assert save_button(ui).disabled
    assert "Choose a mission" in ui.texts(ui.find(FormSheet))


def test_a_day_without_work_is_refused_at_the_field_and_any_day_allows_it(screen, container, ui):
    choose(screen, ui, "Mission", KITS)
    pick_day(screen, ui, "Day", date(2026, 11, 21))
    assert field(ui, "Day").problem == "Saturday is a day off"
    assert save_button(ui).disabled
    remedy(screen, ui, "Run anyway")
    assert field(ui, "Day").problem == ""
    save(screen, ui)
    assert any(
        schedule.start.date() == date(2026, 11, 21) and not schedule.respect_working_days
        for schedule in schedules(container)
    )


def test_a_time_that_has_passed_is_refused_at_the_field(screen, ui):
    choose(screen, ui, "Mission", KITS)
    pick_time(screen, ui, "Time", 8, 0)
    assert field(ui, "Time").problem == "This time has passed"
    assert save_button(ui).disabled


def test_no_day_of_the_week_is_refused_under_the_days(screen, ui):
    choose(screen, ui, "Mission", KITS)
    kind(screen, ui, "Weekly")
    for day in ("Mo", "Tu", "We", "Th", "Fr"):
        ui.tap(ui.find(Segment, text=day))
    settle(screen, ui)
    assert "Choose at least one day" in ui.texts(ui.find(FormSheet))
    assert save_button(ui).disabled


def test_a_name_that_is_taken_is_said_at_the_name(screen, container, ui):
    choose(screen, ui, "Mission", KITS)
    kind(screen, ui, "Daily")
    screen.plan.form.set(name=f"{KITS} on Aino")
    settle(screen, ui)
    ui.tap(save_button(ui))
    settle(screen, ui)
    assert ui.texts(ui.find(FormSheet)).count(f"There is a schedule {KITS} on Aino already") == 1
    assert screen.plan.form.more  # where it can be mended
    said = ui.find(Field, label="Name")
    assert visible_area(said, parents(said)) == pytest.approx(area(said), abs=2)
    screen.plan.form.set(name="Another name")
    settle(screen, ui)
    save(screen, ui)
    assert any(schedule.name == "Another name" for schedule in schedules(container))


def test_an_overlap_is_a_warning_and_can_be_saved(screen, container, ui):
    choose(screen, ui, "Mission", KITS)
    choose(screen, ui, "Robot", "Veikko")
    kind(screen, ui, "Once")
    pick_time(screen, ui, "Time", 16, 40)
    view = ui.find(FormSheet).view
    (note,) = view.notes  # one low battery in a month does not count
    assert note.text == f"Overlaps {WASTE}, 16:30"
    assert [start.icon for start in view.starts] == ["alert"]
    save(screen, ui)


def test_a_free_time_is_offered_where_runs_would_overlap_and_a_tap_takes_it(screen, container, ui):
    meets = named(container, "Collect empties", "Veikko")
    new(screen, ui)
    form = screen.plan.form
    form.set(mission_id=meets.mission_id, robot_id=meets.robot_id, day=date(2026, 11, 23), at=time(6, 10))
    ui.wait(lambda: any(note.remedies for note in form.view.notes))
    offer = form.view.notes[0].remedies[0].text
    remedy(screen, ui, offer)
    assert form.view.time == offer.removeprefix("Move to ")
    assert not any("Collect empties" in note.text for note in form.view.notes)
