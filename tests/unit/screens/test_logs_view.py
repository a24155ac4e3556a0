"""The runs of the Logs in words: rows and filters."""

from dataclasses import replace
from datetime import UTC, date, datetime, timedelta
from zoneinfo import ZoneInfo

import pytest

from app.domain.execution import DurationEstimate, Execution, Reason, ReasonCode, State, Trigger, Wait
from app.domain.models import Robot
from app.domain.robot import MissionParameter
from app.screens.common.mission_names import MissionNames
from app.screens.logs import view
from app.screens.logs.facts import execution_filter, filters_with
from app.screens.logs.view import UNDER_WAY, Filters, Period

ZONE = ZoneInfo("Europe/Helsinki")
NOW = datetime(2026, 11, 20, 12, 38, tzinfo=UTC)
PLANNED = datetime(2026, 11, 20, 11, 30, tzinfo=UTC)  # 13:30 local
DONE = Execution(
    trigger=Trigger.SCHEDULED,
    robot_id=1,
    robot="Aino",
    mission="Deliver kits",
    mission_guid="g",
    planned_at=PLANNED,
    created_at=PLANNED,
    closes_at=PLANNED + timedelta(minutes=15),
    token="t",
    timezone="Europe/Helsinki",
    id=7,
    schedule_id=3,
    schedule="Kits",
    state=State.COMPLETED,
    attempts=1,
    queue_id=14026,
    submitted_at=PLANNED + timedelta(seconds=2),
    started_at=PLANNED + timedelta(seconds=9),
    ended_at=PLANNED + timedelta(seconds=387),
    duration_s=378.0,
    robot_delay_s=7.0,
)
FAILED = replace(
    DONE,
    state=State.FAILED,
    reason=Reason(ReasonCode.ROBOT_ABORTED, {"message": "Failed to reach goal position 'Dock 3'"}),
)
SKIPPED = replace(
    DONE,
    state=State.SKIPPED,
    attempts=0,
    queue_id=None,
    submitted_at=None,
    started_at=None,
    duration_s=None,
    robot_delay_s=None,
    reason=Reason(ReasonCode.BATTERY_LOW, {"battery": 12, "minimum": 30, "until": "2026-11-20T11:45:00+00:00"}),
)


GOAL = "a1c4e008-5d0f-11ef-93c1-0001297b6e20"
TO_DOCK = MissionNames({"g": (MissionParameter("goal", "Position", choices=((GOAL, "Dock 3"),), sets="position"),)})


# ---------------------------------------------------------------------- rows
def row(run, **more):
    return view.row(run, NOW, ZONE, **more)


def test_a_row_has_the_time_the_mission_the_robot_and_how_it_ended():
    item = row(replace(DONE, parameters={"goal": GOAL}), mission_names=TO_DOCK)
    assert (item.lead, item.title, item.place, item.meta) == ("13:30", "Deliver kits · Dock 3", "Aino", "6 min")
    assert (item.icon, item.tone, item.meta_tone) == ("check-circle-outline", "done", "")
    item = row(FAILED)
    assert (item.meta, item.tone, item.meta_tone) == ("Can't reach Dock 3", "fault", "fault")


@pytest.mark.parametrize(
    ("changes", "line"),
    [
        ({}, "6 min"),
        ({"submitted_at": PLANNED + timedelta(minutes=4)}, "6 min, started 4 min late"),
        ({"robot_delay_s": 300.0}, "6 min, started 5 min late"),
        ({"robot_delay_s": 300.0, "trigger": Trigger.MANUAL}, "6 min"),
    ],
)
def test_a_completed_run_says_how_long_it_took_and_whether_it_was_late(changes, line):
    assert view.outcome_line(replace(DONE, **changes), NOW, ZONE) == line


def test_a_run_says_why_it_did_not_run_and_an_open_one_what_it_waits_for():
    assert view.outcome_line(SKIPPED, NOW, ZONE) == "Battery 12 % stayed under 30 % until 13:45"
    assert view.outcome_line(replace(SKIPPED, reason=None), NOW, ZONE) == "Not run"
    waiting = replace(
        SKIPPED, state=State.WAITING, reason=None, wait=Wait.BATTERY, wait_details={"battery": 12, "minimum": 30}
    )
    assert view.outcome_line(waiting, NOW, ZONE) == "Battery 12 % is under 30 %, waits until 13:45"


def test_a_run_under_way_says_how_long_it_will_take_if_that_is_known():
    running = replace(DONE, state=State.EXECUTING, started_at=NOW - timedelta(minutes=4), ended_at=None)
    known = DurationEstimate(360.0, 400.0, (360.0,))
    assert view.outcome_line(running, NOW, ZONE, known) == "Working, about 2 min left"
    assert view.outcome_line(running, NOW + timedelta(minutes=4), ZONE, known) == "Working"
    assert view.outcome_line(running, NOW, ZONE) == "Working"


def test_rows_stand_below_the_names_of_their_days():
    runs = [replace(DONE, id=n, planned_at=PLANNED - timedelta(days=days)) for n, days in enumerate((0, 0, 1, 400))]
    items = view.listed(runs, False, NOW, ZONE, {})
    assert [item.title for item in items if item.look == "head"] == ["Today", "Yesterday", "Thu 16 Oct 2025"]
    assert [item.key for item in items if item.opens] == [0, 1, 2, 3]
    assert len({item.key for item in items}) == len(items)


def test_problems_of_one_cause_are_one_row_with_their_number():
    dock_1 = Reason(ReasonCode.ROBOT_ABORTED, {"message": "Failed to reach goal position 'Dock 1'"})
    runs = [replace(FAILED, id=1), replace(FAILED, id=2, reason=dock_1), replace(FAILED, id=3), replace(SKIPPED, id=4)]
    found = [(run.id, number) for run, number in view.folded(runs, ZONE)]
    assert found == [(1, 2), (2, 1), (4, 1)]
    items = [item for item in view.listed(runs, True, NOW, ZONE, {}) if item.opens]
    assert [(item.key, item.title) for item in items] == [
        (1, "Can't reach Dock 3 ×2"),
        (2, "Deliver kits"),
        (4, "Deliver kits"),
    ]
    assert view.like_of(runs[3], ZONE).words == "Battery stayed under the minimum for its whole start window"
    assert Filters(outcomes=view.PROBLEMS).folds
    assert not Filters(outcomes=view.PROBLEMS, like=view.like_of(runs[0], ZONE)).folds


# ---------------------------------------------------------------------- filters
def test_periods_are_whole_local_days():
    assert Filters(Period.TODAY).span(NOW, ZONE)[0] == datetime(2026, 11, 19, 22, 0, tzinfo=UTC)
    assert Filters(Period.WEEK).span(NOW, ZONE)[0] == datetime(2026, 11, 13, 22, 0, tzinfo=UTC)
    assert Filters(Period.MONTH).span(NOW, ZONE)[0] == datetime(
        2026, 10, 21, 21, 0, tzinfo=UTC
    )  # before the clock change
    assert Filters(Period.ALL).span(NOW, ZONE) == (None, None)
    assert Filters(Period.WEEK, day=date(2026, 11, 19)).span(NOW, ZONE) == (
        datetime(2026, 11, 18, 22, 0, tzinfo=UTC),
        datetime(2026, 11, 19, 22, 0, tzinfo=UTC),
    )


@pytest.mark.parametrize(
    ("ago", "period", "day"),
    [
        (timedelta(hours=1), Period.TODAY, None),
        (timedelta(days=2), Period.TODAY, date(2026, 11, 18)),
        (timedelta(days=2), Period.WEEK, None),
        (timedelta(days=20), Period.WEEK, date(2026, 10, 31)),
        (timedelta(days=300), Period.ALL, None),
        (timedelta(hours=-3), Period.TODAY, None),
        (timedelta(hours=-10), Period.MONTH, date(2026, 11, 21)),
    ],
)
def test_a_run_that_the_period_lacks_is_shown_with_its_day(ago, period, day):
    assert filters_with(NOW - ago, NOW, ZONE, period) == Filters(period, day=day)


def test_the_filters_become_those_of_the_history():
    filters = Filters(Period.TODAY, 2, ("failed", UNDER_WAY), "Deliver kits", (Trigger.IDLE,), " dock ")
    wanted = execution_filter(filters, NOW, ZONE)
    assert (wanted.robot_ids, wanted.mission, wanted.triggers, wanted.text) == (
        (2,),
        "Deliver kits",
        (Trigger.IDLE,),
        "dock",
    )
    assert set(wanted.states) == {State.FAILED, State.WAITING, State.SUBMITTING, State.QUEUED, State.EXECUTING}
    [not_run] = [option.key for option in view.outcome_options() if option.text == "Not run"]
    assert view.Filters(outcomes=(not_run,)).states == (State.SKIPPED, State.MISSED)
    assert (wanted.start, wanted.end) == (
        datetime(2026, 11, 19, 22, 0, tzinfo=UTC),
        datetime(2026, 11, 20, 22, 0, tzinfo=UTC),
    )
    everything = execution_filter(Filters(Period.ALL), NOW, ZONE)
    assert (everything.robot_ids, everything.states, everything.start, everything.end) == (None, None, None, None)


def test_runs_like_one_are_found_by_its_message_or_its_reason():
    wanted = execution_filter(Filters(Period.ALL, like=view.like_of(FAILED, ZONE)), NOW, ZONE)
    assert (wanted.text, wanted.reasons) == ("Failed to reach goal position 'Dock 3'", ())
    wanted = execution_filter(Filters(Period.ALL, like=view.like_of(SKIPPED, ZONE)), NOW, ZONE)
    assert wanted.reasons == (ReasonCode.BATTERY_LOW,)
    assert view.like_of(DONE, ZONE) is None
    kind = view.like_kind("Can't reach Dock 1", ReasonCode.ROBOT_ABORTED, "Failed to reach … within … s")
    assert kind.part == "Failed to reach"


def test_what_narrows_the_list_is_named_and_can_be_cleared():
    robots = [Robot("Aino", "", id=1), Robot("Veikko", "", id=2)]
    filters = Filters(
        Period.WEEK,
        2,
        view.PROBLEMS,
        "Kits",
        (Trigger.IDLE, Trigger.MANUAL),
        day=date(2026, 11, 19),
        like=view.like_of(FAILED, ZONE),
    )
    chips = {chip.key: chip.text for chip in view.set_filters(filters, robots)}
    assert chips == {
        "outcomes": "Problems",
        "robot": "Veikko",
        "mission": "Kits",
        "triggers": "Run now, Idle",
        "day": "Thu 19 Nov",
        "like": "Can't reach Dock 3",
    }
    for key in chips:
        filters = view.cleared(filters, key)
    assert filters == Filters()
    assert view.set_filters(Filters(outcomes=("failed",)), robots) == []  # its number is marked
    assert view.robot_word(Filters(), robots) == "All robots"


def test_nothing_is_counted_before_the_first_run_has_ended():
    assert view.counts({}, Filters()) == []


def test_the_numbers_of_outcomes_mark_the_one_that_is_asked_for():
    numbers = {State.COMPLETED: 96, State.FAILED: 4, State.SKIPPED: 2, State.MISSED: 1, State.CANCELLED: 7}
    chips = view.counts(numbers, Filters(outcomes=("skipped",)))
    assert [(chip.text, chip.selected) for chip in chips] == [
        ("96 completed", False),
        ("4 failed", False),
        ("3 not run", True),
    ]


def test_an_empty_list_says_whether_anything_has_run():
    assert view.empty_text(Filters(Period.ALL)) == "Nothing has run yet"
    assert view.empty_text(Filters(text="dock")) == "Nothing found"
    assert view.empty_text(Filters()) == "Nothing ran in this time"
