"""The Scheduler's form from plain facts."""

from dataclasses import replace
from datetime import UTC, date, datetime, time

import pytest

from app.database.robots import Hold
from app.domain.models import DurationEstimate, InvalidInput, Mission, Overlap
from app.screens.common.mission_names import MissionNames
from app.screens.scheduler import form_view
from app.screens.scheduler.draft import Draft, Kind
from app.screens.scheduler.form_view import Preview
from app.screens.scheduler.view import menu_title
from app.services.catalogue.preview import Concern, ConcernCode, Forecast
from app.services.planning.recurrence import Occurrence
from tests.support.scheduler_facts import EMPTIES, HOURLY, KITS, NOW, facts


def draft(**values):
    return Draft(
        **{
            "day": date(2026, 11, 23),
            "at": time(6, 30),
            "timezone": "Europe/Helsinki",
            "mission_id": 1,
            "robot_id": 1,
            **values,
        }
    )


DOCK, PRESS = "a1c4e008-5d0f-11ef-93c1-0001297b6e20", "b2c4e008-5d0f-11ef-93c1-0001297b6e20"
TO_DOCK = replace(HOURLY, name="Deliver kits on Aino", parameters={"goal": DOCK})


def start(day, hour=4, minute=30, moved=False):
    instant = datetime(2026, 11, day, hour, minute, tzinfo=UTC)
    return Occurrence(instant, datetime(2026, 11, day, hour + 2, minute), moved)


def shown(chosen, preview=None):
    return form_view.present(facts(), chosen, preview or Preview(Forecast((start(23),))), NOW)


def test_an_empty_form_asks_for_a_mission_without_looking_wrong():
    empty = shown(draft(mission_id=None), Preview())
    assert (empty.title, empty.mission, empty.save_off, empty.why, empty.wrong_field) == (
        "New schedule",
        "Choose a mission",
        True,
        "Choose a mission",
        "",
    )


def test_the_form_shows_what_is_chosen():
    chosen = shown(draft(kind=Kind.WEEKLY, weekdays=("MO", "WE"), minimum_battery_percent=40.0, overlap=Overlap.QUEUE))
    assert (chosen.mission, chosen.robot, chosen.day, chosen.time) == (
        "Deliver kits",
        "Aino",
        "Mon 23 Nov 2026",
        "06:30",
    )
    assert [chip.key for chip in chosen.day_chips if chip.selected] == ["MO", "WE"]
    assert (chosen.battery, chosen.window, chosen.overlap, chosen.save_off) == ("40 %", "15 min", "Queue", False)
    assert shown(draft()).battery == "30 %"  # inherited
    assert shown(draft(minimum_battery_percent=0.0)).battery == "Any"


def test_saving_waits_for_the_answer_of_the_services():
    assert shown(draft(), Preview()).save_off


def test_a_one_time_start_on_a_day_without_work_is_refused_at_the_day():
    saturday = shown(draft(day=date(2026, 11, 21)))
    assert saturday.save_off
    assert saturday.problem_at("day") == "Saturday is not a working day: choose another day, or any day under More"
    assert saturday.problem_at("time") == ""
    assert not shown(draft(day=date(2026, 11, 21), respect_working_days=False)).save_off


def test_a_one_time_start_in_the_past_is_refused_at_the_time():
    assert shown(draft(day=date(2026, 11, 20), at=time(8)), Preview(Forecast())).problem_at("time") == (
        "This time has passed: choose a later one"
    )


def test_what_the_services_refuse_is_shown_at_its_field():
    refused = shown(
        draft(), Preview(Forecast(), InvalidInput("name", "there is a schedule {name} already", name="Kits"))
    )
    assert (refused.wrong_field, refused.why, refused.save_off) == ("name", "There is a schedule Kits already", True)
    assert form_view.form_field(InvalidInput("recurrence", "x")) == "kind"
    assert form_view.form_field(InvalidInput("something else", "x")) == ""


def test_the_next_starts_are_shown_and_those_with_a_warning_marked():
    concern = Concern(
        ConcernCode.OVERLAP,
        start(25).instant,
        {"mission": "Collect empties", "start": start(25, 4, 25).instant, "end": start(25, 4, 40).instant},
    )
    forecast = Forecast(tuple(start(day) for day in range(23, 28)), DurationEstimate(420.0, 420.0), (concern,))
    form = shown(draft(kind=Kind.DAILY), Preview(forecast))
    assert [(row.text, row.kind) for row in form.starts][1:3] == [("Tue 24 · 06:30", ""), ("Wed 25 · 06:30", "alert")]
    assert [(row.line, row.text) for row in form.warnings] == [
        ("1 overlap: Collect empties", "Wed 25 Nov: Collect empties is still running on Aino then, 06:25–06:40")
    ]
    assert not form.save_off


def test_schedules_of_one_mission_differ_by_their_values():
    known = facts(schedules=(TO_DOCK,), mission_names=MissionNames(names={DOCK: "Dock 3", PRESS: "Press"}))
    concern = Concern(
        ConcernCode.OVERLAP,
        start(25).instant,
        {"schedule_id": 7, "mission": "Deliver kits", "start": start(25).instant, "end": start(25, 4, 40).instant},
    )
    (warning,) = form_view.present(known, draft(), Preview(Forecast((start(25),), None, (concern,))), NOW).warnings
    assert warning.line == "1 overlap: Deliver kits · Dock 3"
    assert warning.text == "Wed 25 Nov: Deliver kits · Dock 3 starts on Aino at the same time, 06:30–06:40"
    assert menu_title(known, TO_DOCK) == ("Deliver kits · Dock 3", "Aino")
    assert known.called(TO_DOCK) == "Deliver kits · Dock 3 on Aino"
    kept = Draft.of(TO_DOCK), draft(entered={"goal": PRESS}), draft(name="Late")
    assert [form_view.draft_option(known, each).text for each in kept] == [
        "Deliver kits · Dock 3 on Aino",
        "Deliver kits · Press",
        "Late",
    ]


def test_the_starts_in_a_hold_are_marked():
    forecast = Forecast(tuple(start(day) for day in range(23, 28)), DurationEstimate(420.0, 420.0))
    held = facts(holds=(Hold("Maintenance", start(24, 12).instant, NOW),))
    form = form_view.present(held, draft(kind=Kind.DAILY), Preview(forecast), NOW)
    assert [(row.text, row.kind) for row in form.starts] == [
        *((f"{day} · 06:30 · skipped", "hand-back-right-outline") for day in ("Mon 23", "Tue 24")),
        *((f"{day} · 06:30", "") for day in ("Wed 25", "Thu 26", "Fri 27")),
    ]


def test_a_schedule_that_is_off_may_be_set_to_a_later_time_but_not_to_a_past_one():
    stored = replace(HOURLY, recurrence=None, enabled=False)
    off = Preview(Forecast((), None, (Concern(ConcernCode.SWITCHED_OFF),)))
    later = shown(replace(Draft.of(stored), day=date(2026, 11, 23)), off)
    assert (later.why, later.save_off, later.starts) == ("", False, ())
    assert shown(replace(Draft.of(stored), day=date(2026, 11, 20), at=time(8)), off).problem_at("time")


@pytest.mark.parametrize(
    ("concern", "text"),
    [
        (
            Concern(ConcernCode.PAUSED, details={"until": datetime(2026, 11, 22, 22, 0, tzinfo=UTC)}),
            "Paused: no start before Mon 23 Nov",
        ),
        (Concern(ConcernCode.SWITCHED_OFF), "Switched off: nothing starts"),
        (
            Concern(
                ConcernCode.OVERLAP,
                start(25).instant,
                {"mission": "Waste", "start": start(25, 4, 31).instant, "end": start(25, 4, 40).instant},
            ),
            "Wed 25 Nov: Waste starts on Aino before this run ends, 06:31–06:40",
        ),
        (
            Concern(ConcernCode.DAY_OFF, details={"day": date(2026, 11, 21)}),
            "Sat 21 Nov is not a working day, so it begins later",
        ),
        (
            Concern(ConcernCode.MISSION_MISSING, details={"mission": "Waste", "robot": "Aino"}),
            "Aino does not have the mission Waste",
        ),
        (
            Concern(ConcernCode.MISSION_MISSING, details={"mission": "Waste", "group": "Hall"}),
            "No robot of Hall has the mission Waste",
        ),
        (
            Concern(ConcernCode.ROBOT_OFF, details={"robot": "Veikko"}),
            "Veikko is switched off in Settings: nothing will be sent",
        ),
        (Concern(ConcernCode.NO_START), "No more starts"),
        (
            Concern(ConcernCode.WEEKDAYS_OFF, details={"weekdays": (5, 6), "all": True}),
            "Saturday, Sunday: not a working day, so it never starts",
        ),
        (
            Concern(ConcernCode.WEEKDAYS_OFF, details={"weekdays": (5,), "all": False}),
            "Saturday: not a working day, so nothing starts then",
        ),
        (
            Concern(
                ConcernCode.CLOCK_CHANGE, start(25).instant, {"nominal": datetime(2026, 11, 25, 3, 30), "twice": False}
            ),
            "Wed 25 Nov: there is no 03:30 that night, it starts at 06:30",
        ),
        (
            Concern(
                ConcernCode.CLOCK_CHANGE, start(25).instant, {"nominal": datetime(2026, 11, 25, 3, 30), "twice": True}
            ),
            "Wed 25 Nov: 03:30 comes twice that night, it starts at the first",
        ),
    ],
)
def test_every_concern_is_one_sentence(concern, text):
    (warning,) = shown(draft(kind=Kind.DAILY), Preview(Forecast((start(23),), None, (concern,)))).warnings
    assert warning.text == text
    assert len(warning.line or text) < 40


def test_the_missions_offered_are_those_the_robot_can_be_asked_for():
    own = Mission("Deliver kits", "g-own", id=3, robot_id=1)
    foreign = Mission("Charge", "g-charge", id=4, robot_id=2)
    known = facts(missions=(KITS, replace(EMPTIES, favourite=True), own, foreign))
    assert [row.key for row in form_view.mission_options(known, 1)] == [2, 3]
    assert [row.note for row in form_view.mission_options(known, 1)] == ["", "only on Aino"]
    assert {row.key for row in form_view.mission_options(known, None)} == {1, 2, 3, 4}
    assert {row.icon for row in form_view.mission_options(known, None)} == {
        "star",
        "star-outline",
    }  # a flag is every mission's


def test_numbers_are_stepped_to_and_the_setting_is_the_first_chip():
    windows, battery, days = (
        form_view.steps(facts(), draft(), name)
        for name in ("start_window_minutes", "minimum_battery_percent", "month_day")
    )
    assert [word for _key, word in windows.chips] == [
        "As in Settings: 15 min",
        "1 min",
        "5 min",
        "30 min",
        "1 h",
        "2 h",
    ]
    assert [word for _key, word in battery.chips] == ["As in Settings: 30 %", "No minimum", "10 %", "20 %", "50 %"]
    assert days.chips == ((1, "1"), (15, "15"), (-1, "the last day"))
    assert [(one.number(None), one.number(37)) for one in (windows, battery)] == [(15, 37), (30, 37)]
    assert (days.number(-1), days.number(17)) == (31, 17)
    assert {(one.label, one.unit) for one in (windows, battery, days)} == {
        ("Or any other", "min"),
        ("Or any other", "%"),
        ("Or any other", ""),
    }
    assert (windows.help, windows.minimum, windows.number(0)) == (
        "1 to 1440 min",
        1,
        1,
    )  # that is what 0 min are taken for
    assert battery.help == "0 to 100 %"


def test_what_is_chosen_has_its_chip_though_settings_say_the_same():
    windows, battery = (
        form_view.steps(facts(), draft(start_window_minutes=15, minimum_battery_percent=30), name)
        for name in ("start_window_minutes", "minimum_battery_percent")
    )
    assert (15, "15 min") in windows.chips
    assert (30, "30 %") in battery.chips
    none = form_view.steps(
        facts(settings=replace(facts().settings, minimum_battery_percent=None)), draft(), "minimum_battery_percent"
    )
    assert [word for _key, word in none.chips][:2] == ["As in Settings: none", "10 %"]


@pytest.mark.parametrize("minutes", [0, 1])
def test_one_minute_has_one_chip_where_settings_say_it_too(minutes):
    found = form_view.steps(
        facts(settings=replace(facts().settings, start_window_minutes=minutes)), draft(), "start_window_minutes"
    )
    assert [word for _key, word in found.chips][:2] == ["As in Settings: 1 min", "5 min"]


def test_other_times_of_the_day_are_whole_hours():
    assert [row.key for row in form_view.also_options(draft())] == [hour for hour in range(24) if hour != 6]


@pytest.mark.parametrize(
    ("usual", "words"),
    [
        (None, "Its duration on Aino is not known yet: 5 min are assumed"),
        (DurationEstimate(1500.0, 1500.0, typed=True), "25 min as typed in Settings: no run was completed on Aino yet"),
        (DurationEstimate(400.0, 430.0, (400.0,)), "Usually 6 min 40 s, by its one run on Aino"),
        (DurationEstimate(400.0, 430.0, (390.0, 400.0, 430.0)), "Usually 6 min 40 s, by the last 3 runs on Aino"),
    ],
)
def test_the_form_says_how_long_it_takes_and_who_says_so(usual, words):
    assert shown(draft(), Preview(Forecast((start(23),), usual))).lasts == words
    assert shown(draft(), Preview()).lasts == ""
