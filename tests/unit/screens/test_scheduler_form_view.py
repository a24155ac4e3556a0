"""The Scheduler's form from plain facts."""

from dataclasses import replace
from datetime import UTC, date, datetime, time

import pytest

from app.database.robots import Hold
from app.domain.execution import DurationEstimate
from app.domain.models import InvalidInput, Mission
from app.screens.common.mission_names import MissionNames
from app.screens.scheduler import form_view
from app.screens.scheduler.draft import Draft, Kind, Unit
from app.screens.scheduler.form_notes import Preview
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
    assert (empty.title, empty.mission, empty.why, empty.wrong_field) == (
        "New schedule",
        "Choose a mission",
        "Choose a mission",
        "",
    )


def test_the_form_shows_what_is_chosen():
    chosen = shown(draft(minimum_battery_percent=40.0))
    assert (chosen.mission, chosen.robot, chosen.day, chosen.time) == (
        "Deliver kits",
        "Aino",
        "Mon 23 Nov",
        "06:30",
    )
    assert chosen.days[0] == ("MO", "Mo")
    assert (chosen.battery, chosen.window, chosen.why) == (40, 15, "")
    assert shown(draft()).battery == 30  # inherited
    assert shown(draft(minimum_battery_percent=0.0)).battery == 0


def test_a_robot_that_has_not_said_what_the_mission_needs_is_a_warning_and_no_obstacle():
    unknown = shown(draft(), Preview(Forecast((start(23),)), silent="Aino"))
    assert (unknown.why, unknown.warning) == (
        "",
        "Aino has not said which values this mission needs. Nothing is sent without them",
    )


def test_saving_does_not_wait_for_the_answer_of_the_services():
    assert shown(draft(), Preview()).why == ""


def test_a_one_time_start_on_a_day_without_work_is_refused_at_the_day():
    saturday = shown(draft(day=date(2026, 11, 21)))
    assert saturday.problem_at("day") == saturday.why == "Saturday is a day off"
    assert [[option.text for option in note.remedies] for note in saturday.notes] == [["Mon 23 Nov", "Run anyway"]]
    assert saturday.problem_at("time") == ""
    assert not shown(draft(day=date(2026, 11, 21), respect_working_days=False)).why


def test_a_one_time_start_in_the_past_is_refused_at_the_time():
    assert shown(draft(day=date(2026, 11, 20), at=time(8)), Preview(Forecast())).problem_at("time") == (
        "This time has passed"
    )


def test_what_the_services_refuse_is_shown_at_its_field():
    refused = shown(
        draft(), Preview(Forecast(), InvalidInput("name", "there is a schedule {name} already", name="Kits"))
    )
    assert (refused.wrong_field, refused.why) == ("name", "There is a schedule Kits already")
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
    assert [(row.text, row.icon) for row in form.starts][1:3] == [
        ("Tue 24 Nov · 06:30", ""),
        ("Wed 25 Nov · 06:30", "alert"),
    ]
    assert [note.text for note in form.notes] == ["Overlaps Collect empties, 06:25"]
    assert form.why == ""


def test_schedules_of_one_mission_differ_by_their_values():
    known = facts(schedules=(TO_DOCK,), mission_names=MissionNames(names={DOCK: "Dock 3", PRESS: "Press"}))
    concern = Concern(
        ConcernCode.OVERLAP,
        start(25).instant,
        {"schedule_id": 7, "mission": "Deliver kits", "start": start(25).instant, "end": start(25, 4, 40).instant},
    )
    (note,) = form_view.present(known, draft(), Preview(Forecast((start(25),), None, (concern,))), NOW).notes
    assert note.text == "Overlaps Deliver kits · Dock 3, 06:30"
    assert menu_title(known, TO_DOCK) == ("Deliver kits · Dock 3", "Aino")
    assert known.called(TO_DOCK) == "Deliver kits · Dock 3 on Aino"
    kept = Draft.of(TO_DOCK), draft(entered={"goal": PRESS}), draft(name="Late")
    assert [form_view.called(known, each) for each in kept] == [
        "Deliver kits · Dock 3 on Aino",
        "Deliver kits · Press",
        "Late",
    ]


def test_the_starts_in_a_hold_are_marked():
    forecast = Forecast(tuple(start(day) for day in range(23, 28)), DurationEstimate(420.0, 420.0))
    held = facts(holds=(Hold("Maintenance", start(24, 12).instant, NOW),))
    form = form_view.present(held, draft(kind=Kind.DAILY), Preview(forecast), NOW)
    assert [(row.text, row.icon) for row in form.starts] == [
        *((f"{day} · 06:30 · not run", "hand-back-right-outline") for day in ("Mon 23 Nov", "Tue 24 Nov")),
        *((f"{day} · 06:30", "") for day in ("Wed 25 Nov", "Thu 26 Nov", "Fri 27 Nov")),
    ]


def test_a_schedule_that_is_off_may_be_set_to_a_later_time_but_not_to_a_past_one():
    stored = replace(HOURLY, recurrence=None, enabled=False)
    off = Preview(Forecast((), None, (Concern(ConcernCode.SWITCHED_OFF),)))
    later = shown(replace(Draft.of(stored), day=date(2026, 11, 23)), off)
    assert (later.why, later.starts) == ("", ())
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
            "Overlaps Waste, 06:31",
        ),
        (
            Concern(ConcernCode.DAY_OFF, details={"day": date(2026, 11, 21)}),
            "Begins after Sat 21 Nov, a day off",
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
            "Veikko is switched off",
        ),
        (
            Concern(ConcernCode.NOT_CHECKED_UP, details={"fleet": "Hall 2"}),
            "Nothing is sent until the fleet Hall 2 is checked up",
        ),
        (Concern(ConcernCode.NO_START), "No more starts"),
        (
            Concern(ConcernCode.WEEKDAYS_OFF, details={"weekdays": (5, 6), "all": True}),
            "Saturday, Sunday: day off, so it never starts",
        ),
        (
            Concern(ConcernCode.WEEKDAYS_OFF, details={"weekdays": (5,), "all": False}),
            "Saturday: day off, so nothing starts then",
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
    (note,) = shown(draft(kind=Kind.DAILY), Preview(Forecast((start(23),), None, (concern,)))).notes
    assert note.text == text


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


def test_other_times_of_the_day_are_whole_hours():
    assert [row.key for row in form_view.also_options(draft())] == [hour for hour in range(24) if hour != 6]


def test_ticked_days_that_are_no_working_days_are_said_in_the_sentence_and_among_the_starts():
    weekend = draft(kind=Kind.WEEKLY, weekdays=("TH", "FR", "SA"), day=date(2026, 11, 23))
    form = shown(weekend, Preview(Forecast((start(26), start(27)))))
    assert form.sentence == "Thu–Sat 06:30, not Sat"
    assert [row.text for row in form.starts] == ["Thu 26 Nov · 06:30", "Fri 27 Nov · 06:30"]
    off = Concern(ConcernCode.WEEKDAYS_OFF, details={"weekdays": (5,), "all": False})
    last = Occurrence(start(30).instant, start(30).nominal)
    form = shown(weekend, Preview(Forecast((start(26), start(27), last), None, (off,))))
    assert [row.text for row in form.starts][2] == "Sat 28 Nov · day off"
    [note] = form.notes
    assert [option.text for option in note.remedies] == ["Run anyway"]
    anyway = shown(replace(weekend, **dict(note.remedies[0].key)), Preview(Forecast((start(26),))))
    assert (anyway.sentence, anyway.notes, anyway.advanced) == ("Thu–Sat 06:30", (), "any day")


def test_an_interval_over_midnight_is_refused_with_a_way_out():
    night = draft(kind=Kind.EVERY, every=30, at=time(22), until_time=time(2))
    form = shown(night, Preview())
    assert form.problem_at("until_time") == "It must end after it begins. Over midnight: make two schedules"
    [note] = form.notes
    assert [option.text for option in note.remedies] == ["Until 23:59", "Day and night"]
    for option in note.remedies:
        assert not shown(replace(night, **dict(option.key))).why


@pytest.mark.parametrize(
    ("values", "sentence", "is_much"),
    [
        ({"every": 30, "at": time(6), "until_time": time(18)}, "Every 30 min 06–18: 25 a day", False),
        ({"every": 5, "at": time(6), "until_time": time(18)}, "Every 5 min 06–18: 145 a day", True),
        ({"every": 2, "unit": Unit.HOURS, "all_day": True}, "Every 2 h", False),
    ],
)
def test_an_interval_says_how_many_starts_a_day_it_makes(values, sentence, is_much):
    form = shown(draft(kind=Kind.EVERY, respect_working_days=False, **values))
    assert (form.sentence, form.is_much) == (sentence, is_much)


def test_a_day_that_not_every_month_has_is_said_and_the_last_day_offered():
    form = shown(draft(kind=Kind.MONTHLY, month_day=31))
    [note] = form.notes
    assert note.text == "Not in February, April, June, September, November"
    assert shown(replace(draft(kind=Kind.MONTHLY), **dict(note.remedies[0].key))).notes == ()


def test_an_overlap_offers_the_nearest_free_time():
    details = {"mission": "Waste", "start": start(25, 4, 31).instant, "end": start(25, 4, 40).instant}
    concern = Concern(ConcernCode.OVERLAP, start(25).instant, details)
    [note] = shown(draft(), Preview(Forecast((start(25),), None, (concern,), datetime(2026, 11, 25, 7, 20)))).notes
    assert [(option.text, dict(option.key)) for option in note.remedies] == [("Move to 07:20", {"at": time(7, 20)})]
