"""The Scheduler's bars, lanes, ticks and its window from plain facts."""

from dataclasses import replace
from datetime import UTC, date, datetime, timedelta
from itertools import pairwise
from zoneinfo import ZoneInfo

import pytest

from app.database.robots import Hold
from app.domain.execution import DurationEstimate, Reason, ReasonCode, State
from app.domain.models import Connection, DayException, Group, Robot
from app.screens.scheduler.facts import Window
from app.screens.scheduler.timeline import (
    ASSUMED_S,
    MANY,
    moved,
    span_text,
    spanning,
    timeline,
    with_draft,
    with_moved,
)
from app.services.catalogue.preview import Concern, ConcernCode, Forecast
from app.services.planning.planned import PlannedRun
from app.services.planning.recurrence import Occurrence
from app.services.planning.working_days import WorkingCalendar
from tests.support.scheduler_facts import (
    EMPTIES,
    EVERY_DAY,
    HELSINKI,
    HOURLY,
    KITS,
    NOW,
    SETTINGS,
    execution,
    facts,
    planned,
)


def test_the_timeline_begins_at_a_full_local_hour_and_marks_now():
    shown = timeline(facts(), NOW)
    assert Window().start(NOW, facts().zone) == datetime(2026, 11, 20, 11, 0, tzinfo=UTC)  # 13:00 local
    assert shown.now == pytest.approx(1 + 38 / 60)
    assert shown.now_label == "14:38"
    assert (3.0, "16:00", False) in shown.ticks
    assert (59.0, "Mon 23 Nov", True) in shown.ticks
    assert (1.0, "", False) in shown.ticks or (1.0, "14:00", False) in shown.ticks


def test_a_year_that_begins_is_named():
    shown = timeline(facts(), NOW, Window(datetime(2026, 12, 31, 6, tzinfo=UTC), 48))
    assert [label for _hour, label, strong in shown.ticks if strong and "Jan" in label][:2] == [
        "Fri 1 Jan 2027",
        "Mon 4 Jan",
    ]


def test_missing_starts_are_marked():
    cut = facts(planned=tuple(planned(minutes) for minutes in range(10)), more={7: NOW + timedelta(minutes=10)})
    lane = timeline(cut, NOW).lanes[0]
    assert (lane.bars[-1].label, lane.bars[-1].key[0], lane.bars[-1].end) == ("and more starts", "zoom", 60.0)
    assert lane.bars[-1].start == pytest.approx(1 + 48 / 60)


def test_there_is_a_lane_for_every_robot_and_one_that_is_off_says_so():
    lanes = timeline(facts(), NOW).lanes
    assert [(lane.name, lane.note) for lane in lanes] == [("Aino", ""), ("Veikko", "off")]


def test_a_planned_bar_is_as_long_as_the_mission_usually_takes():
    bar = timeline(facts(planned=(planned(22),)), NOW).lanes[0].bars[0]
    assert (bar.start, bar.end - bar.start) == (pytest.approx(2.0), pytest.approx(7 / 60))
    assert (bar.key, bar.label, bar.state) == (("schedule", 7, NOW + timedelta(minutes=22)), "Deliver kits", "planned")
    unknown = timeline(facts(planned=(planned(22, None),)), NOW).lanes[0].bars[0]
    assert unknown.end - unknown.start == pytest.approx(ASSUMED_S / 3600)


@pytest.mark.parametrize(
    ("state", "look"), [(State.COMPLETED, "past"), (State.CANCELLED, "past"), (State.FAILED, "failed")]
)
def test_a_past_bar_lies_where_it_ran_in_the_colour_of_its_outcome(state, look):
    ran = execution(state, 38, started_at=NOW - timedelta(minutes=36), ended_at=NOW - timedelta(minutes=30))
    bar = timeline(facts(past=(ran,)), NOW).lanes[0].bars[0]
    assert (bar.key, bar.state) == (("execution", 70), look)
    assert (bar.start, bar.end) == (pytest.approx(62 / 60), pytest.approx(68 / 60))


def test_what_was_missed_is_drawn_no_longer_than_its_start_window():
    missed = execution(State.MISSED, 60, ended_at=NOW, reason=Reason(ReasonCode.APP_DOWN))
    bar = timeline(facts(past=(missed,)), NOW).lanes[0].bars[0]
    assert (bar.state, bar.end - bar.start) == ("skipped", pytest.approx(15 / 60))


def test_what_runs_reaches_to_its_usual_end_or_to_now():
    running = execution(State.EXECUTING, 4, started_at=NOW - timedelta(minutes=4))
    bar = timeline(facts(past=(running,), usual_s={(1, "g-kits"): 420.0}), NOW).lanes[0].bars[0]
    assert bar.end == pytest.approx(timeline(facts(), NOW).now + 3 / 60)
    late = timeline(facts(past=(running,), usual_s={(1, "g-kits"): 60.0}), NOW)
    assert late.lanes[0].bars[0].end == pytest.approx(late.now)


def test_what_ended_before_the_window_is_not_drawn():
    old = execution(
        State.COMPLETED, 900, started_at=NOW - timedelta(minutes=899), ended_at=NOW - timedelta(minutes=890)
    )
    assert timeline(facts(past=(old,)), NOW).lanes[0].bars == ()


def test_days_without_work_are_closed_and_named():
    shown = timeline(facts(), NOW, Window(unfolded=frozenset({NOW + timedelta(days=1)})))
    assert shown.bands == (
        (11.0, 35.0, "Saturday: day off", "closed"),
        (35.0, 59.0, "Sunday: day off", "closed"),
    )
    assert timeline(facts(settings=EVERY_DAY), NOW).bands == ()


def test_long_closed_time_is_folded_and_as_much_other_time_is_read():
    shown = timeline(facts(), NOW)
    assert shown.bands == ((11.0, 59.0, "Sat–Sun, days off", "folded"),)
    assert not [tick for tick in shown.ticks if 11 <= tick.hour < 59]
    start, end = Window().span(NOW, HELSINKI, facts().calendar)
    assert (end - start).total_seconds() / 3600 == pytest.approx(
        2 * 8 + 48
    )  # half as much on either side, and the weekend


def test_only_what_is_long_and_empty_of_the_closed_time_is_folded():
    closed = timeline(facts(planned=(planned(17 * 60, 3600.0), planned(22 * 60, 3600.0))), NOW).bands
    at = 1 + 38 / 60 + 17  # Saturday, 07:38
    assert [(band.start, band.end) for band in closed if band.kind == "folded"] == [
        (11.0, pytest.approx(at)),
        (pytest.approx(at + 6), 59.0),
    ]
    assert [(band.start, band.end, band.text) for band in closed if band.kind == "closed"] == [
        (pytest.approx(at), pytest.approx(at + 6), "Saturday: day off")
    ]


def test_a_break_of_more_than_a_week_says_its_dates():
    shut = DayException("Summer", date(2026, 11, 21), date(2026, 12, 6))
    (band,) = timeline(facts(calendar=WorkingCalendar(SETTINGS, (shut,))), NOW).bands
    assert (band.text, band.end - band.start) == ("Sat 21 Nov–Sun 6 Dec, days off", 16 * 24)


def test_what_moves_with_the_time_shows_a_break_from_its_beginning():
    sunday = NOW + timedelta(days=2)
    shown = timeline(facts(), sunday)
    assert (shown.bands[0].kind, shown.first) == ("folded", shown.bands[0].start)
    assert shown.bands[0].start < shown.now < shown.bands[0].end


def test_moving_on_goes_over_what_is_folded():
    friday, weekend = NOW + timedelta(hours=6), (NOW + timedelta(hours=10), NOW + timedelta(hours=58))
    later = moved(Window(friday, 24), 0.5, NOW, HELSINKI, [weekend])
    assert later.left == friday + timedelta(hours=12 + 48)
    assert moved(later, -0.5, NOW, HELSINKI, [weekend]).left == friday
    assert moved(Window(friday, 4), 0.5, NOW, HELSINKI, [weekend]).left == friday + timedelta(hours=2)


def test_back_from_a_folded_day_leads_to_what_was_before_it():
    sunday, weekend = NOW + timedelta(hours=46), (NOW + timedelta(hours=10), NOW + timedelta(hours=58))
    before = moved(Window(), -0.5, sunday, HELSINKI, [weekend])
    assert before.left == weekend[0] - timedelta(hours=4)
    assert moved(before, 0.5, sunday, HELSINKI, [weekend]).left == weekend[1]


def test_a_clock_change_is_marked_and_the_hours_stay_true():
    night = datetime(2026, 10, 24, 20, 10, tzinfo=UTC)  # 23:10 in Helsinki, clocks go back at 04:00
    shown = timeline(facts(settings=EVERY_DAY), night)
    change = next(hour for hour, label, strong in shown.ticks if label == "Clock change")
    assert Window().start(night, facts().zone) + timedelta(hours=change) == datetime(2026, 10, 25, 1, 0, tzinfo=UTC)


@pytest.mark.parametrize(
    ("night", "change", "hours_between"),
    [
        (datetime(2026, 10, 3, 12, 10, tzinfo=UTC), datetime(2026, 10, 3, 15, 30, tzinfo=UTC), 23.5),
        (datetime(2027, 4, 3, 12, 10, tzinfo=UTC), datetime(2027, 4, 3, 15, 0, tzinfo=UTC), 24.5),
        (datetime(2027, 4, 3, 20, 10, tzinfo=UTC), datetime(2027, 4, 3, 15, 0, tzinfo=UTC), 24.5),
    ],
)
def test_a_clock_that_is_changed_by_half_an_hour_moves_no_day_line(night, change, hours_between):
    lord_howe = ZoneInfo("Australia/Lord_Howe")
    shown = timeline(facts(settings=replace(EVERY_DAY, timezone="Australia/Lord_Howe")), night, Window(hours=48))
    at = {label: shown.origin + timedelta(hours=hour) for hour, label, _strong in shown.ticks}
    assert at["Clock change"] == change
    days = [
        shown.origin + timedelta(hours=hour)
        for hour, label, strong in shown.ticks
        if strong and label != "Clock change"
    ]
    assert {day.astimezone(lord_howe).strftime("%H:%M") for day in days} == {"00:00"}
    assert hours_between in [(later - day) / timedelta(hours=1) for day, later in pairwise(days)]
    for hour, label, strong in shown.ticks:
        if label and not strong:
            assert (shown.origin + timedelta(hours=hour)).astimezone(lord_howe).strftime("%H:%M") == label


# ---------------------------------------------------------------------- window, zoom
def test_a_window_that_was_moved_stays_where_it_is():
    left = datetime(2026, 11, 22, 6, 20, tzinfo=UTC)
    shown = timeline(facts(), NOW, Window(left, 12))
    assert (shown.origin, shown.first, shown.hours, shown.span) == (
        left.replace(minute=0),
        pytest.approx(1 / 3),
        12,
        "12 h",
    )
    assert shown.now < 0
    assert moved(Window(left, 12), 0.5, NOW, HELSINKI) == Window(left + timedelta(hours=6), 12)


def test_another_span_keeps_the_middle():
    window = Window(datetime(2026, 11, 22, 6, 0, tzinfo=UTC), 24)
    nearer = spanning(window, 8, NOW, HELSINKI)
    assert nearer == Window(datetime(2026, 11, 22, 14, 0, tzinfo=UTC), 8)
    assert spanning(nearer, 24, NOW, HELSINKI) == window
    assert spanning(Window(None, 24), 6, NOW, HELSINKI) == Window(None, 6)  # still follows the time
    assert [span_text(hours) for hours in (6, 24, 47, 48, 168)] == ["6 h", "24 h", "47 h", "2 days", "7 days"]


def test_bars_too_thin_to_distinguish_become_one_that_a_tap_zooms_into():
    runs = tuple(planned(10 * n, 60.0) for n in range(1, 40))
    seen = timeline(facts(planned=runs), NOW, Window(None, 6)).lanes[0].bars
    assert len(seen) == 39  # 10 min apart are distinguished on 6 h
    (block,) = timeline(facts(planned=runs), NOW, Window(None, 168)).lanes[0].bars
    assert (block.label, *block.shorter) == (
        "Deliver kits · 39 runs",
        "39 runs",
        "39",
    )
    assert block.key == ("zoom", pytest.approx((block.start + block.end) / 2), pytest.approx(380 / 60 + 1 / 60))
    overlapping = tuple(planned(n, 120.0) for n in range(1, 6))
    (block,) = timeline(facts(planned=overlapping), NOW, Window(None, 168)).lanes[0].bars
    assert block.end - block.start == pytest.approx(6 / 60)


@pytest.mark.parametrize("usual_s", [None, 300.0, 40.0, 2.0])
def test_runs_every_ten_minutes_are_one_block_however_short_they_are_known_to_be(usual_s):
    every_ten = tuple(planned(minutes, usual_s) for minutes in range(30, 330, 10))
    lane = timeline(facts(planned=every_ten), NOW).lanes[0]
    assert [bar.label for bar in lane.bars] == ["Deliver kits · 30 runs"]


def test_bars_of_two_days_do_not_become_one():
    """Every 10 min, day and night: one block would hide where days begin."""
    runs = tuple(planned(10 * n, 60.0) for n in range(300))
    blocks = timeline(facts(planned=runs), NOW, Window(None, 168)).lanes[0].bars
    assert [block.label for block in blocks] == [f"Deliver kits · {n} runs" for n in (57, 144, 99)]


def test_a_block_of_several_missions_names_none():
    runs = tuple(planned(60 + 2 * n + n % 3, 60.0, mission=(KITS, EMPTIES)[n % 2]) for n in range(6))
    (block,) = timeline(facts(planned=runs), NOW, Window(None, 168)).lanes[0].bars
    assert (block.label, *block.shorter) == ("6 runs", "6")


# ---------------------------------------------------------------------- many robots
FLEET = tuple(Robot(f"R{n:02d}", f"http://r{n}", id=n) for n in range(1, 51))


def lanes(window=None, **values):
    return timeline(
        facts(**{"robots": FLEET, "planned": (planned(22, robot=FLEET[7]), planned(30, robot=FLEET[30])), **values}),
        NOW,
        window,
    ).lanes


def test_each_robot_has_its_lane_with_something_planned_or_not():
    assert [lane.name for lane in lanes()] == [robot.name for robot in FLEET]


HALLS = (Group("Hall 1", tuple(range(1, 11)), id=3), Group("Hall 2", (5, 11, 12), id=4), Group("Yard", (13, 40), id=5))


def starts(count: int) -> tuple[PlannedRun, ...]:
    return tuple(planned(22 + number, robot=robot) for number, robot in enumerate(FLEET[:count]))


def test_robots_of_a_group_share_one_line_that_opens():
    """A robot of two groups is in the first."""
    failed = execution(State.FAILED, 60, robot_id=2, robot="R02")
    plan = {"groups": HALLS, "planned": starts(MANY + 1), "past": (failed,)}
    assert [(lane.name, lane.line) for lane in lanes(Window(opened=""), **plan)][:4] == [
        ("Hall 1", "10 robots · 10 starts · 1 failed run"),
        ("Hall 2", "2 robots · 2 starts"),
        ("Yard", "2 robots · 1 start"),
        ("R14", ""),
    ]
    opened = lanes(**plan)  # the first one is
    assert [lane.name for lane in opened[1:11]] == [f"R{n:02d}" for n in range(1, 11)]
    assert [lane.is_open for lane in opened if lane.line] == [True, False, False]
    second = lanes(Window(opened=opened[11].key), **plan)
    assert [lane.name for lane in second if lane.is_open] == ["Hall 2"]
    chosen = lanes(Window(robots=frozenset(range(1, 31))), **plan)
    assert [lane.name for lane in chosen[:13]] == [
        f"R{n:02d}" for n in range(1, 14)
    ]  # who chooses robots wants to see them
    few = lanes(**plan | {"robots": FLEET[:MANY], "planned": starts(MANY)})
    assert [lane.name for lane in few] == [f"R{n:02d}" for n in range(1, MANY + 1)]


def test_the_line_of_a_group_counts_what_is_seen_of_it():
    line = lanes(
        Window(hours=6, opened=""),
        groups=HALLS,
        planned=(
            *starts(MANY + 1),
            planned(24, robot=FLEET[0]),
            planned(6 * 60, robot=FLEET[1]),
            planned(6 * 60 + 1, robot=FLEET[1]),
            planned(6 * 60, robot=FLEET[10]),
            planned(6 * 60 + 1, robot=FLEET[10]),
        ),
    )
    assert [lane.line for lane in line][:2] == [
        "10 robots · 11 starts · 1 overlap",
        "2 robots · 2 starts",
    ]


def test_the_line_of_a_group_says_that_more_starts_were_not_computed():
    """It never says that nothing is planned because there is too much."""
    hourly = tuple(replace(HOURLY, id=robot.id, robot_id=robot.id) for robot in FLEET[: MANY + 1])
    lines = {
        "groups": HALLS,
        "schedules": hourly,
        "more": {schedule.id: NOW + timedelta(hours=1) for schedule in hourly},
    }
    shut = Window(opened="")
    assert [lane.line for lane in lanes(shut, **lines, planned=starts(5))][:2] == [
        "10 robots · 5 starts · and more starts",
        "2 robots · and more starts",
    ]
    later = lines | {
        "planned": (),
        "more": {schedule.id: NOW + timedelta(hours=6) for schedule in hourly},
    }  # beyond what is seen
    assert [lane.line for lane in lanes(replace(shut, hours=6), **later)][:2] == [
        "10 robots · nothing planned",
        "2 robots · nothing planned",
    ]


def test_the_line_of_a_group_says_which_of_its_robots_get_nothing():
    """What their lanes would say; a hold of all robots is a band over everything."""
    holds = (Hold(since=NOW, robot_id=2), Hold(until=NOW - timedelta(hours=1), robot_id=3), Hold(since=NOW))
    shown = lanes(
        Window(opened=""),
        groups=HALLS,
        planned=starts(MANY + 1),
        holds=holds,
        silent={1: Connection.UNREACHABLE, 40: Connection.UNREACHABLE},
    )
    assert [lane.line for lane in shown[:2]] == [
        "10 robots · 10 starts · 1 on hold · 1 no answer",
        "2 robots · 2 starts",
    ]


def test_lanes_are_those_of_the_robots_that_are_chosen():
    def shown(*robots):
        view = timeline(facts(robots=FLEET), NOW, Window(robots=frozenset(robots)))
        return [lane.name for lane in view.lanes if lane.name], view.robots, view.is_filtered

    assert shown(3) == (["R03"], "R03", True)
    assert shown(3, 5) == (["R03", "R05"], "2 robots", True)
    everyone = [robot.name for robot in FLEET], "All robots", False
    assert shown() == everyone
    assert shown(99) == everyone  # it is not there any more
    assert timeline(facts(), NOW).robots == ""


EVERY_ZOOM = (6, 12, 24, 48, 96, 168)


@pytest.mark.parametrize("hours", EVERY_ZOOM)
@pytest.mark.parametrize("offset", [0.0, 1 / 3, 0.7])
def test_runs_that_touch_do_not_overlap_at_any_zoom(hours, offset):
    """One begins as the other ends, within the displayed second."""
    runs = tuple(planned(offset + 5 * n, 300.2) for n in range(40))
    assert timeline(facts(planned=runs), NOW, Window(None, hours)).lanes[0].overlaps == ()


@pytest.mark.parametrize("hours", EVERY_ZOOM)
def test_runs_that_overlap_do_so_at_every_zoom_and_only_as_long_as_they_do(hours):
    runs = (*(planned(10 * n, 60.0) for n in range(1, 12)), planned(55, 360.0, mission=EMPTIES))
    [(start, end)] = timeline(facts(planned=runs), NOW, Window(None, hours)).lanes[0].overlaps
    begins = NOW + timedelta(minutes=60) - timeline(facts(planned=runs), NOW, Window(None, hours)).origin
    assert (start * 3600, (end - start) * 3600) == (pytest.approx(begins.total_seconds()), pytest.approx(60))


def test_what_has_ended_overlaps_with_nothing():
    ended = [
        execution(state, ago, id=n, ended_at=NOW)
        for n, (state, ago) in enumerate([(State.COMPLETED, 9), (State.SKIPPED, 8)])
    ]
    assert timeline(facts(past=tuple(ended)), NOW).lanes[0].overlaps == ()


# ---------------------------------------------------------------------- what is not saved yet
def test_a_draft_is_dashed_in_its_lane_and_its_schedule_as_it_was():
    plan = timeline(facts(planned=(planned(22), planned(52, mission=EMPTIES, schedule=replace(HOURLY, id=8)))), NOW)
    at = NOW + timedelta(minutes=50)
    forecast = Forecast((Occurrence(at, at),), DurationEstimate(600, 600), (Concern(ConcernCode.OVERLAP, at),))
    drawn = with_draft(plan, 1, 7, forecast, "Deliver kits")
    assert [(bar.label, bar.state) for bar in drawn.lanes[0].bars] == [
        ("", "was"),
        ("Deliver kits", "draft"),
        ("Collect empties", "planned"),
    ]
    assert len(drawn.lanes[0].overlaps) == 1
    assert drawn.lanes[1] == plan.lanes[1]
    assert with_draft(plan, 1, None, Forecast(), "") == plan


def test_a_draft_that_the_form_does_not_warn_of_is_no_overlap_in_the_plan():
    """A start for any robot of a group, foreseen on this one, takes another robot then."""
    plan = timeline(facts(planned=(planned(52),)), NOW)
    at = NOW + timedelta(minutes=50)
    drawn = with_draft(plan, 1, None, Forecast((Occurrence(at, at),)), "Collect empties")
    assert (len(drawn.lanes[0].bars), drawn.lanes[0].overlaps) == (2, ())


def test_a_start_that_was_dragged_is_dashed_where_it_was_dropped():
    plan = timeline(facts(planned=(planned(22),)), NOW)
    [bar] = plan.lanes[0].bars
    was, moved = with_moved(plan, bar.key, 5.0).lanes[0].bars
    assert (was.start, was.state, moved.start, moved.state) == (bar.start, "was", 5.0, "draft")
    assert moved.end - moved.start == pytest.approx(bar.end - bar.start)
    assert with_moved(plan, "another", 5.0) == plan
