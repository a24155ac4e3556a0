"""The Scheduler's words and bars from plain facts: timeline, days, list of schedules, form_view."""
from dataclasses import replace
from datetime import UTC, date, datetime, time, timedelta
from itertools import pairwise
from zoneinfo import ZoneInfo

import pytest

from app.domain.models import (
    DayException,
    DurationEstimate,
    Execution,
    InvalidInput,
    Mission,
    Overlap,
    Reason,
    ReasonCode,
    Robot,
    Schedule,
    Settings,
    State,
    Trigger,
)
from app.screens.common import execution_appearance
from app.screens.scheduler import bar_card, form_view, view
from app.screens.scheduler.draft import Draft, Kind
from app.screens.scheduler.facts import SchedulerFacts, Window
from app.screens.scheduler.form_view import Preview
from app.screens.scheduler.timeline import ASSUMED_S, moved, span_text, timeline, zoomed
from app.services.catalogue.preview import Concern, ConcernCode, Forecast
from app.services.live.holds import Hold
from app.services.planning.plan import PlannedRun
from app.services.planning.recurrence import Occurrence
from app.services.planning.working_days import WorkingCalendar

NOW = datetime(2026, 11, 20, 12, 38, tzinfo=UTC)                       # Friday, 14:38 in Helsinki
HELSINKI = ZoneInfo("Europe/Helsinki")
SETTINGS = Settings(timezone="Europe/Helsinki", minimum_battery_percent=30)
EVERY_DAY = replace(SETTINGS, working_days=("MO", "TU", "WE", "TH", "FR", "SA", "SU"))
AINO, VEIKKO = Robot("Aino", "http://a", id=1, model="MiR250"), Robot("Veikko", "http://b", id=2, enabled=False)
KITS, EMPTIES = Mission("Deliver kits", "g-kits", id=1), Mission("Collect empties", "g-empties", id=2)
HOURLY = Schedule("Kits", 1, 1, datetime(2026, 11, 2, 6, 0), "Europe/Helsinki", "FREQ=DAILY", id=7, next_at=NOW + timedelta(minutes=22))


def facts(**values):
    return SchedulerFacts(**{"settings": SETTINGS, "calendar": WorkingCalendar(values.get("settings", SETTINGS)), "robots": (AINO, VEIKKO),
                             "missions": (KITS, EMPTIES), "schedules": (HOURLY,), **values})


def planned(minutes, usual_s=420.0, schedule=HOURLY, robot=AINO, mission=KITS):
    return PlannedRun(NOW + timedelta(minutes=minutes), schedule, robot, mission, usual_s)


def execution(state, minutes_ago, **values):
    at = NOW - timedelta(minutes=minutes_ago)
    return Execution(**{"trigger": Trigger.SCHEDULED, "robot_id": 1, "robot": "Aino", "mission": "Deliver kits", "mission_guid": "g-kits",
                        "planned_at": at, "closes_at": at + timedelta(minutes=15), "created_at": at, "token": "t", "id": 70,
                        "timezone": "Europe/Helsinki", "state": state, **values})


# ---------------------------------------------------------------------- the timeline
def test_the_timeline_begins_at_a_full_local_hour_and_marks_now():
    shown = timeline(facts(), NOW)
    assert Window().start(NOW, facts().zone) == datetime(2026, 11, 20, 11, 0, tzinfo=UTC)     # 13:00 local
    assert shown.now == pytest.approx(1 + 38 / 60)
    assert shown.now_label == "14:38"
    assert (3.0, "16:00", False) in shown.ticks
    assert (59.0, "Mon 23 Nov", True) in shown.ticks
    assert (1.0, "", False) in shown.ticks or (1.0, "14:00", False) in shown.ticks


def test_where_starts_were_left_out_the_timeline_and_the_list_say_so():
    cut = facts(planned=tuple(planned(minutes) for minutes in range(10)), more={7: NOW + timedelta(minutes=10)})
    lane = timeline(cut, NOW).lanes[0]
    assert (lane.bars[-1].label, lane.bars[-1].key[0], lane.bars[-1].end) == ("and more starts", "zoom", 84.0)
    assert lane.bars[-1].start == pytest.approx(1 + 48 / 60)
    headings = [row.note for row in view.days(cut, NOW) if row.heading]
    assert headings[:2] == ["10 starts and more", "more starts than can be listed · not a working day"]
    assert [row.note for row in view.days(cut, NOW) if not row.heading] == ["10 starts until 14:47 and more"]


def test_there_is_a_lane_for_every_robot_and_one_that_is_off_says_so():
    lanes = timeline(facts(), NOW).lanes
    assert [(lane.name, lane.note) for lane in lanes] == [("Aino", "MiR250"), ("Veikko", "switched off")]


def test_a_planned_bar_is_as_long_as_the_mission_usually_takes():
    bar = timeline(facts(planned=(planned(22),)), NOW).lanes[0].bars[0]
    assert (bar.start, bar.end - bar.start) == (pytest.approx(2.0), pytest.approx(7 / 60))
    assert (bar.key, bar.label, bar.state) == (("schedule", 7, NOW + timedelta(minutes=22)), "Deliver kits", "planned")
    unknown = timeline(facts(planned=(planned(22, None),)), NOW).lanes[0].bars[0]
    assert unknown.end - unknown.start == pytest.approx(ASSUMED_S / 3600)


@pytest.mark.parametrize(("state", "look"), [(State.COMPLETED, "past"), (State.CANCELLED, "past"), (State.FAILED, "failed")])
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
    old = execution(State.COMPLETED, 900, started_at=NOW - timedelta(minutes=899), ended_at=NOW - timedelta(minutes=890))
    assert timeline(facts(past=(old,)), NOW).lanes[0].bars == ()


def test_days_without_work_are_closed_and_named():
    shown = timeline(facts(), NOW, Window(unfolded=frozenset({NOW + timedelta(days=1)})))
    assert shown.bands == ((11.0, 35.0, "Saturday: not a working day", "closed"), (35.0, 59.0, "Sunday: not a working day", "closed"))
    assert timeline(facts(settings=EVERY_DAY), NOW).bands == ()


def test_long_time_without_work_is_folded_with_its_ticks_and_as_much_other_time_is_read():
    shown = timeline(facts(), NOW)
    assert shown.bands == ((11.0, 59.0, "Sat–Sun, no work", "folded"),)
    assert not [tick for tick in shown.ticks if 11 <= tick.hour < 59]
    start, end = Window().span(NOW, HELSINKI, facts().calendar)
    assert (end - start).total_seconds() / 3600 == pytest.approx(2 * 24 + 48)      # half as much on either side, and the weekend


def test_only_what_is_long_and_empty_of_the_closed_time_is_folded():
    closed = timeline(facts(planned=(planned(17 * 60, 3600.0), planned(22 * 60, 3600.0))), NOW).bands
    at = 1 + 38 / 60 + 17                                              # Saturday, 07:38
    assert [(band.start, band.end) for band in closed if band.kind == "folded"] == [
        (11.0, pytest.approx(at)), (pytest.approx(at + 6), 59.0)]
    assert [(band.start, band.end, band.text) for band in closed if band.kind == "closed"] == [
        (pytest.approx(at), pytest.approx(at + 6), "Saturday: not a working day")]


def test_a_break_of_more_than_a_week_says_its_dates():
    shut = DayException("Summer", date(2026, 11, 21), date(2026, 12, 6))
    band, = timeline(facts(calendar=WorkingCalendar(SETTINGS, (shut,))), NOW).bands
    assert (band.text, band.end - band.start) == ("Sat 21 Nov–Sun 6 Dec, no work", 16 * 24)


def test_what_moves_with_the_time_shows_a_break_from_its_beginning():
    sunday = NOW + timedelta(days=2)
    shown = timeline(facts(), sunday)
    assert (shown.bands[0].kind, shown.first) == ("folded", shown.bands[0].start)
    assert shown.bands[0].start < shown.now < shown.bands[0].end


def test_moving_on_goes_over_what_is_folded():
    friday, weekend = NOW + timedelta(hours=6), (NOW + timedelta(hours=10), NOW + timedelta(hours=58))
    later = moved(Window(friday, 24), .5, NOW, HELSINKI, [weekend])
    assert later.left == friday + timedelta(hours=12 + 48)
    assert moved(later, -.5, NOW, HELSINKI, [weekend]).left == friday
    assert moved(Window(friday, 4), .5, NOW, HELSINKI, [weekend]).left == friday + timedelta(hours=2)


def test_a_clock_change_is_marked_and_the_hours_stay_true():
    night = datetime(2026, 10, 24, 20, 10, tzinfo=UTC)                 # 23:10 in Helsinki, clocks go back at 04:00
    shown = timeline(facts(settings=EVERY_DAY), night)
    change = next(hour for hour, label, strong in shown.ticks if label == "Clock change")
    assert Window().start(night, facts().zone) + timedelta(hours=change) == datetime(2026, 10, 25, 1, 0, tzinfo=UTC)


@pytest.mark.parametrize(("night", "change", "hours_between"), [
    (datetime(2026, 10, 3, 12, 10, tzinfo=UTC), datetime(2026, 10, 3, 15, 30, tzinfo=UTC), 23.5),
    (datetime(2027, 4, 3, 12, 10, tzinfo=UTC), datetime(2027, 4, 3, 15, 0, tzinfo=UTC), 24.5),
    (datetime(2027, 4, 3, 20, 10, tzinfo=UTC), datetime(2027, 4, 3, 15, 0, tzinfo=UTC), 24.5)])
def test_a_clock_that_is_changed_by_half_an_hour_moves_no_day_line(night, change, hours_between):
    lord_howe = ZoneInfo("Australia/Lord_Howe")
    shown = timeline(facts(settings=replace(EVERY_DAY, timezone="Australia/Lord_Howe")), night, Window(hours=48))
    at = {label: shown.origin + timedelta(hours=hour) for hour, label, _strong in shown.ticks}
    assert at["Clock change"] == change
    days = [shown.origin + timedelta(hours=hour) for hour, label, strong in shown.ticks if strong and label != "Clock change"]
    assert {day.astimezone(lord_howe).strftime("%H:%M") for day in days} == {"00:00"}
    assert hours_between in [(later - day) / timedelta(hours=1) for day, later in pairwise(days)]
    for hour, label, strong in shown.ticks:
        if label and not strong:
            assert (shown.origin + timedelta(hours=hour)).astimezone(lord_howe).strftime("%H:%M") == label


# ---------------------------------------------------------------------- window, zoom
def test_a_window_that_was_moved_stays_where_it_is():
    left = datetime(2026, 11, 22, 6, 20, tzinfo=UTC)
    shown = timeline(facts(), NOW, Window(left, 12))
    assert (shown.origin, shown.first, shown.hours, shown.span) == (left.replace(minute=0), pytest.approx(1 / 3), 12, "12 h")
    assert shown.now < 0
    assert moved(Window(left, 12), .5, NOW, HELSINKI) == Window(left + timedelta(hours=6), 12)


def test_zooming_goes_through_the_row_of_spans_around_the_middle():
    window = Window(datetime(2026, 11, 22, 6, 0, tzinfo=UTC), 24)
    nearer = zoomed(window, False, NOW, HELSINKI)
    assert nearer == Window(datetime(2026, 11, 22, 12, 0, tzinfo=UTC), 12)
    assert zoomed(nearer, True, NOW, HELSINKI) == window
    assert [zoomed(Window(None, hours), True, NOW, HELSINKI).hours for hours in (6, 7.3, 100, 168)] == [12, 12, 168, 168]
    assert [zoomed(Window(None, hours), False, NOW, HELSINKI).hours for hours in (6, 7.3, 100, 168)] == [6, 6, 96, 96]
    assert zoomed(Window(None, 24), True, NOW, HELSINKI).left is None                     # goes on following the time
    assert [span_text(hours) for hours in (6, 24, 47, 48, 168)] == ["6 h", "24 h", "47 h", "2 days", "7 days"]


def test_the_whisker_ends_where_nine_of_ten_runs_had_ended_and_unknown_lengths_say_so():
    run = replace(planned(22), slow_s=660.0)
    bar = timeline(facts(planned=(run,)), NOW).lanes[0].bars[0]
    assert (bar.late - bar.start, bar.assumed) == (pytest.approx(11 / 60), False)
    unknown = timeline(facts(planned=(planned(22, None),)), NOW).lanes[0].bars[0]
    assert (unknown.late, unknown.assumed) == (None, True)


def test_a_typed_length_says_so_and_has_no_whisker():
    run = PlannedRun(NOW + timedelta(minutes=22), HOURLY, AINO, KITS, 1500.0, 1500.0, typed=True)
    bar = timeline(facts(planned=(run,)), NOW).lanes[0].bars[0]
    assert (bar.typed, bar.end - bar.start) == (True, pytest.approx(25 / 60))
    assert (bar.late, bar.assumed) == (None, False)
    assert not timeline(facts(planned=(planned(22),)), NOW).lanes[0].bars[0].typed


@pytest.mark.parametrize(("known", "marked"), [
    ({"usual_s": {(1, "g-kits"): 1500.0}}, set()), ({"usual_s": {(1, "g-kits"): 1500.0}, "typed": frozenset({(1, "g-kits")})}, {"typed"}),
    ({}, {"assumed"})])
def test_what_waits_says_how_its_length_is_known_too(known, marked):
    bar = timeline(facts(past=(execution(State.QUEUED, 1),), **known), NOW).lanes[0].bars[0]
    assert {name for name in ("typed", "assumed") if getattr(bar, name)} == marked
    assert bar.end - bar.start == pytest.approx((ASSUMED_S if "assumed" in marked else 1500.0) / 3600)


@pytest.mark.parametrize(("usual", "words"), [
    (None, "How long it takes on Aino is not known yet: 5 min are assumed"),
    (DurationEstimate(1500.0, 1500.0, typed=True), "25 min as typed in Settings: no run was completed on Aino yet"),
    (DurationEstimate(400.0, 430.0, (400.0,)), "Usually 6 min 40 s, by its one run on Aino"),
    (DurationEstimate(400.0, 430.0, (390.0, 400.0, 430.0)), "Usually 6 min 40 s, by the last 3 runs on Aino")])
def test_the_form_says_how_long_it_takes_and_who_says_so(usual, words):
    assert shown(draft(), Preview(Forecast((start(23),), usual))).lasts == words
    assert shown(draft(), Preview()).lasts == ""


def test_bars_too_thin_to_be_told_apart_become_one_that_a_tap_zooms_into():
    runs = tuple(planned(10 * n, 60.0) for n in range(1, 40))
    seen = timeline(facts(planned=runs), NOW, Window(None, 12)).lanes[0].bars
    assert len(seen) == 39                                             # 10 min apart are distinguished on 12 h
    block, = timeline(facts(planned=runs), NOW, Window(None, 168)).lanes[0].bars
    assert block.label == "39 runs"
    assert block.key == ("zoom", pytest.approx((block.start + block.end) / 2), pytest.approx(380 / 60 + 1 / 60))
    overlapping = tuple(planned(n, 120.0) for n in range(1, 6))
    block, = timeline(facts(planned=overlapping), NOW, Window(None, 168)).lanes[0].bars
    assert block.end - block.start == pytest.approx(6 / 60)


@pytest.mark.parametrize("usual_s", [None, 300.0, 40.0, 2.0])
def test_runs_every_ten_minutes_are_one_block_however_short_they_are_known_to_be(usual_s):
    every_ten = tuple(planned(minutes, usual_s) for minutes in range(30, 330, 10))
    lane = timeline(facts(planned=every_ten), NOW).lanes[0]
    assert [(bar.label, bar.short) for bar in lane.bars] == [("30 runs", "30")]


def test_bars_of_two_days_do_not_become_one():
    """Every 10 min, day and night: one block would hide where days begin."""
    runs = tuple(planned(10 * n, 60.0) for n in range(300))
    blocks = timeline(facts(planned=runs), NOW, Window(None, 168)).lanes[0].bars
    assert [block.label for block in blocks] == ["57 runs", "144 runs", "99 runs"]


# ---------------------------------------------------------------------- many robots
FLEET = tuple(Robot(f"R{n:02d}", f"http://r{n}", id=n) for n in range(1, 51))


def lanes(window=None, **values):
    return timeline(facts(**{"robots": FLEET, "planned": (planned(22, robot=FLEET[7]), planned(30, robot=FLEET[30])), **values}), NOW,
                    window).lanes


def test_of_many_robots_those_with_nothing_planned_are_one_line_that_opens():
    shown = lanes()
    assert [(lane.name, lane.line) for lane in shown] == [("R08", ""), ("R31", ""), ("", "48 robots with nothing planned")]
    assert not shown[2].is_open
    opened = lanes(Window(idle_too=True))
    assert (len(opened), opened[2].is_open, opened[3].name) == (51, True, "R01")
    assert [lane.name for lane in lanes(robots=FLEET[:4], planned=())] == ["R01", "R02", "R03", "R04"]     # all are seen anyway


def test_lanes_are_those_of_the_robots_that_are_chosen():
    def shown(*robots):
        view = timeline(facts(robots=FLEET), NOW, Window(robots=frozenset(robots)))
        return [lane.name for lane in view.lanes if lane.name], view.robots, view.is_filtered

    assert shown(3) == (["R03"], "R03", True)
    assert shown(3, 5) == (["R03", "R05"], "2 robots", True)
    assert shown() == ([], "All robots", False)
    assert shown(99) == ([], "All robots", False)                      # it is not there any more
    assert timeline(facts(), NOW).robots == ""


EVERY_ZOOM = (6, 12, 24, 48, 96, 168)


@pytest.mark.parametrize("hours", EVERY_ZOOM)
@pytest.mark.parametrize("offset", [0.0, 1 / 3, 0.7])
def test_runs_that_touch_do_not_overlap_at_any_zoom(hours, offset):
    """One begins as the other ends, within the second that people see."""
    runs = tuple(planned(offset + 5 * n, 300.2) for n in range(40))
    assert timeline(facts(planned=runs), NOW, Window(None, hours)).lanes[0].overlaps == ()


@pytest.mark.parametrize("hours", EVERY_ZOOM)
def test_runs_that_overlap_do_so_at_every_zoom_and_only_as_long_as_they_do(hours):
    runs = (*(planned(10 * n, 60.0) for n in range(1, 12)), planned(55, 360.0, mission=EMPTIES))
    [(start, end)] = timeline(facts(planned=runs), NOW, Window(None, hours)).lanes[0].overlaps
    begins = NOW + timedelta(minutes=60) - timeline(facts(planned=runs), NOW, Window(None, hours)).origin
    assert (start * 3600, (end - start) * 3600) == (pytest.approx(begins.total_seconds()), pytest.approx(60))


def test_the_legend_explains_what_is_drawn_and_nothing_else():
    def kinds(**values):
        return [entry.kind for entry in timeline(facts(**values), NOW, Window(None, 6)).legend]

    assert kinds() == []
    assert kinds(planned=(planned(22),)) == ["planned"]
    assert kinds(planned=(planned(22, None), planned(24)), past=(execution(State.FAILED, 30, ended_at=NOW),)) == [
        "planned", "assumed", "failed", "overlap"]
    assert [entry.kind for entry in timeline(facts(), NOW).legend] == ["closed"]          # Saturday comes into sight


def test_what_has_ended_overlaps_with_nothing():
    ended = [execution(state, ago, id=n, ended_at=NOW) for n, (state, ago) in enumerate([(State.COMPLETED, 9), (State.SKIPPED, 8)])]
    assert timeline(facts(past=tuple(ended)), NOW).lanes[0].overlaps == ()


# ---------------------------------------------------------------------- the days
def test_the_week_has_a_heading_for_every_day():
    rows = [row for row in view.days(facts(planned=(planned(22),)), NOW) if row.heading]
    assert [row.heading for row in rows][:3] == ["Today, Fri 20 Nov", "Tomorrow, Sat 21 Nov", "Sun 22 Nov"]
    assert [row.note for row in rows][:2] == ["1 start", "nothing planned · not a working day"]
    assert len(rows) == 7


def test_many_starts_of_one_schedule_are_one_line():
    runs = (*(planned(22 + 60 * n) for n in range(5)), planned(50, schedule=replace(HOURLY, id=8), mission=EMPTIES))
    rows = [row for row in view.days(facts(planned=runs), NOW) if not row.heading]
    assert [(row.time, row.mission, row.note) for row in rows] == [
        ("15:00", "Deliver kits", "5 starts until 19:00"), ("15:28", "Collect empties", "in 50 min")]


def test_a_start_says_until_about_when_and_what_it_needs():
    own = replace(HOURLY, id=8, minimum_battery_percent=0.0)
    runs = (planned(22), planned(50, None, own), *(planned(60 + 60 * n, schedule=replace(HOURLY, id=9)) for n in range(4)))
    held = facts(planned=runs, holds=(Hold("Maintenance", NOW + timedelta(minutes=40), NOW),))
    rows = [row for row in view.days(held, NOW) if not row.heading]
    condition = "if battery ≥\N{NO-BREAK SPACE}30\N{NO-BREAK SPACE}%"
    assert [(row.time, row.until, row.condition) for row in rows] == [
        ("15:00", "until about 15:07", "skipped: held until 15:18"), ("15:28", "–", ""),
        ("15:38", "until about 18:45", "4 starts until 18:38")]
    assert next(row for row in view.days(facts(planned=runs), NOW) if row.time == "15:00").condition == condition


def test_schedules_are_listed_by_words_robot_and_name():
    other = replace(HOURLY, id=8, name="A later one", robot_id=2, next_at=NOW + timedelta(hours=3))
    given = facts(schedules=(HOURLY, other))

    def listed(**listing):
        return [row.key for row in view.schedule_rows(given, NOW, listing=view.Listing(**listing))]
    assert (listed(), listed(by_name=True)) == ([7, 8], [8, 7])
    assert (listed(robot_id=2), listed(robot_id=1)) == ([8], [7])
    assert (listed(query="LATER veikko"), listed(query="kits aino"), listed(query="nothing")) == ([8], [7], [])
    assert view.schedules_note(given, 2) == "Veikko · 1 of 1 on"


# ---------------------------------------------------------------------- the schedules
def test_schedules_are_in_the_order_of_their_starts_and_those_that_are_off_last():
    later = replace(HOURLY, id=8, name="Later", next_at=NOW + timedelta(hours=3))
    off = replace(HOURLY, id=9, name="Off", enabled=False, next_at=None)
    rows = view.schedule_rows(facts(schedules=(off, later, HOURLY)), NOW, selected=8)
    assert [(row.key, row.on, row.selected) for row in rows] == [(7, True, False), (8, True, True), (9, False, False)]
    assert [row.next for row in rows] == ["Aino · in 22 min", "Aino · in 3 h", "Aino · switched off"]


@pytest.mark.parametrize(("changes", "words"), [
    ({"robot_id": 2}, "Veikko · the robot is switched off"),
    ({"paused_until": NOW + timedelta(hours=2)}, "Aino · paused until 16:38"),
    ({"next_at": NOW + timedelta(days=3)}, "Aino · Mon 23 Nov 14:38"),
])
def test_a_schedule_says_when_or_why_not(changes, words):
    assert view.schedule_rows(facts(schedules=(replace(HOURLY, **changes),)), NOW)[0].next == words


ONCE = replace(HOURLY, id=9, start=datetime(2026, 11, 20, 6, 30), recurrence=None, next_at=None)
MORNING = datetime(2026, 11, 20, 4, 30, tzinfo=UTC)                    # 06:30 in Helsinki


def row_of(schedule, last=None):
    """Its row, and which place it has among others: one that starts, one that is off."""
    off = replace(HOURLY, id=8, enabled=False, next_at=None)
    given = facts(schedules=(schedule, off, HOURLY), last={schedule.id: last} if last else {})
    rows = view.schedule_rows(given, NOW)
    assert view.schedules_note(given) == ("1 of 3 on" if not last or not last.state.is_open else "2 of 3 on")
    place = [row.key for row in rows].index(schedule.id)
    assert not rows[place].over or view.schedule_rows(given, NOW, listing=view.Listing(by_name=True))[-1] == rows[place]
    return rows[place], place


@pytest.mark.parametrize(("state", "words"), [
    (State.COMPLETED, "Over · ran Fri 20 Nov 06:31"), (State.FAILED, "Over · failed Fri 20 Nov 06:31"),
    (State.CANCELLED, "Over · cancelled Fri 20 Nov 06:31"), (State.SKIPPED, "Over · skipped Fri 20 Nov 06:30"),
    (State.MISSED, "Over · missed Fri 20 Nov 06:30")])
def test_a_one_time_schedule_that_is_over_says_what_became_of_it_and_comes_last(state, words):
    ran = state not in (State.SKIPPED, State.MISSED)
    last = execution(state, 0, planned_at=MORNING, started_at=MORNING + timedelta(minutes=1) if ran else None)
    row, place = row_of(ONCE, last)
    assert (row.over, row.next, row.last, place) == (True, words, "", 2)
    assert (row.icon, row.rule) == (execution_appearance.LOOKS[state][0], "Aino · Once on Fri 20 Nov 2026 at 06:30")


def test_what_is_over_without_a_row_says_when_it_was_due_or_that_it_was_off():
    assert row_of(ONCE)[0].next == "Over · was due Fri 20 Nov 06:30"
    assert row_of(replace(ONCE, enabled=False))[0].next == "Over · was switched off"
    earlier = execution(State.COMPLETED, 0, planned_at=MORNING - timedelta(days=1))      # before it was set to another time
    assert row_of(replace(ONCE, enabled=False), earlier)[0].next == "Over · was switched off"
    assert row_of(replace(HOURLY, id=9, next_at=None))[0].next == "Over"
    assert row_of(replace(HOURLY, id=9, next_at=None), earlier)[0].next == "Over · ran Thu 19 Nov 06:30"


def test_what_still_runs_or_may_be_switched_on_is_not_over():
    row, _place = row_of(ONCE, execution(State.EXECUTING, 0, planned_at=MORNING))
    assert (row.over, row.last) == (False, "Running")
    tomorrow = replace(ONCE, enabled=False, start=datetime(2026, 11, 21, 6, 30))
    assert not view.schedule_rows(facts(schedules=(tomorrow,)), NOW)[0].over
    assert not view.schedule_rows(facts(schedules=(replace(HOURLY, enabled=False, next_at=None),)), NOW)[0].over


def test_a_name_of_its_own_is_shown_and_one_made_of_mission_and_robot_is_not():
    made, own = replace(HOURLY, name="Deliver kits on Aino 2"), replace(HOURLY, id=8, name="Morning round")
    rows = view.schedule_rows(facts(schedules=(made, own)), NOW)
    assert [(row.mission, row.name) for row in rows] == [("Deliver kits", ""), ("Deliver kits", "Morning round")]
    days = view.days(facts(planned=(planned(22, schedule=made), planned(30, schedule=own))), NOW)
    assert [(row.mission, row.name) for row in days if row.time] == [("Deliver kits", ""), ("Deliver kits", "Morning round")]
    assert bar_card.start_card(facts(), planned(30, schedule=own)).text.splitlines()[0] == "Morning round"


def test_a_start_that_is_skipped_stays_on_the_timeline_and_can_be_taken_again():
    ahead = execution(State.SKIPPED, -120, schedule_id=7, reason=Reason(ReasonCode.HOLD), ended_at=NOW)
    given = facts(past=(ahead,), skips=frozenset({(7, ahead.planned_at)}))
    bar, = timeline(given, NOW).lanes[0].bars
    assert (bar.label, bar.state, bar.end - bar.start) == ("Skipped: Deliver kits", "skipped", pytest.approx(ASSUMED_S / 3600))
    assert [item.key for item in bar_card.run_card(given, ahead, NOW).items] == ["again", "log", "edit"]
    assert [item.key for item in bar_card.run_card(facts(past=(ahead,)), ahead, NOW).items] == ["log", "edit"]


def test_a_schedule_shows_how_it_last_went():
    row = view.schedule_rows(facts(last={7: execution(State.SKIPPED, 60)}), NOW)[0]
    assert (row.icon, row.tone, row.last) == ("skip-next-circle", "attention", "Skipped")
    assert view.schedules_note(facts()) == "1 of 1 on"
    assert view.schedules_note(facts(schedules=())) == ""
    assert view.schedules_empty(facts()) == ""
    assert view.schedules_empty(facts(schedules=())).startswith("No schedule yet.")


# ---------------------------------------------------------------------- the form
def draft(**values):
    return Draft(**{"day": date(2026, 11, 23), "at": time(6, 30), "timezone": "Europe/Helsinki", "mission_id": 1, "robot_id": 1, **values})


def start(day, hour=4, minute=30, moved=False):
    instant = datetime(2026, 11, day, hour, minute, tzinfo=UTC)
    return Occurrence(instant, datetime(2026, 11, day, hour + 2, minute), moved)


def shown(chosen, preview=None):
    return form_view.present(facts(), chosen, preview or Preview(Forecast((start(23),))), NOW)


def test_an_empty_form_asks_for_a_mission_without_looking_wrong():
    empty = shown(draft(mission_id=None), Preview())
    assert (empty.title, empty.mission, empty.save_off, empty.why, empty.wrong_field) == (
        "New schedule", "Choose a mission", True, "Choose a mission", "")


def test_the_form_shows_what_is_chosen():
    chosen = shown(draft(kind=Kind.WEEKLY, weekdays=("MO", "WE"), minimum_battery_percent=40.0, overlap=Overlap.QUEUE))
    assert (chosen.mission, chosen.robot, chosen.day, chosen.time) == ("Deliver kits", "Aino", "Mon 23 Nov 2026", "06:30")
    assert [chip.key for chip in chosen.day_chips if chip.selected] == ["MO", "WE"]
    assert (chosen.battery, chosen.window, chosen.overlap, chosen.save_off) == ("40 %", "15 min", "Queue", False)
    assert shown(draft()).battery == "30 %"                             # inherited
    assert shown(draft(minimum_battery_percent=0.0)).battery == "No minimum"


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
        "This time has passed: choose a later one")


def test_what_the_services_refuse_is_shown_at_its_field():
    refused = shown(draft(), Preview(Forecast(), InvalidInput("name", "there is a schedule {name} already", name="Kits")))
    assert (refused.wrong_field, refused.why, refused.save_off) == ("name", "There is a schedule Kits already", True)
    assert form_view.form_field(InvalidInput("recurrence", "x")) == "kind"
    assert form_view.form_field(InvalidInput("something else", "x")) == ""


def test_the_next_starts_are_shown_and_those_with_a_warning_marked():
    concern = Concern(ConcernCode.OVERLAP, start(25).instant,
                      {"mission": "Collect empties", "start": start(25, 4, 25).instant, "end": start(25, 4, 40).instant})
    forecast = Forecast(tuple(start(day) for day in range(23, 28)), DurationEstimate(420.0, 420.0), (concern,))
    form = shown(draft(kind=Kind.DAILY), Preview(forecast))
    assert [(row.text, row.kind) for row in form.starts][1:3] == [("Tue 24 · 06:30", ""), ("Wed 25 · 06:30", "alert")]
    assert [(row.line, row.text) for row in form.warnings] == [
        ("1 overlap: Collect empties", "Wed 25 Nov: Collect empties is still running on Aino then, 06:25–06:40")]
    assert not form.save_off


def test_the_starts_in_a_hold_are_marked():
    forecast = Forecast(tuple(start(day) for day in range(23, 28)), DurationEstimate(420.0, 420.0))
    held = facts(holds=(Hold("Maintenance", start(24, 12).instant, NOW),))
    form = form_view.present(held, draft(kind=Kind.DAILY), Preview(forecast), NOW)
    assert [(row.text, row.kind) for row in form.starts] == [
        *((f"{day} · 06:30 · skipped", "hand-back-right-outline") for day in ("Mon 23", "Tue 24")),
        *((f"{day} · 06:30", "") for day in ("Wed 25", "Thu 26", "Fri 27"))]


def test_a_schedule_that_is_off_may_be_set_to_a_later_time_but_not_to_a_past_one():
    stored = replace(HOURLY, recurrence=None, enabled=False)
    off = Preview(Forecast((), None, (Concern(ConcernCode.SWITCHED_OFF),)))
    later = shown(replace(Draft.of(stored), day=date(2026, 11, 23)), off)
    assert (later.why, later.save_off, later.starts) == ("", False, ())
    assert shown(replace(Draft.of(stored), day=date(2026, 11, 20), at=time(8)), off).problem_at("time")


@pytest.mark.parametrize(("concern", "text"), [
    (Concern(ConcernCode.PAUSED, details={"until": datetime(2026, 11, 22, 22, 0, tzinfo=UTC)}), "Paused: no start before Mon 23 Nov"),
    (Concern(ConcernCode.SWITCHED_OFF), "Switched off: nothing starts"),
    (Concern(ConcernCode.OVERLAP, start(25).instant,
             {"mission": "Waste", "start": start(25, 4, 31).instant, "end": start(25, 4, 40).instant}),
     "Wed 25 Nov: Waste starts on Aino before this run ends, 06:31–06:40"),
    (Concern(ConcernCode.DAY_OFF, details={"day": date(2026, 11, 21)}), "Sat 21 Nov is not a working day, so it begins later"),
    (Concern(ConcernCode.MISSION_MISSING, details={"mission": "Waste", "robot": "Aino"}), "Aino does not have the mission Waste"),
    (Concern(ConcernCode.ROBOT_OFF, details={"robot": "Veikko"}), "Veikko is switched off in Settings: nothing will be sent"),
    (Concern(ConcernCode.NO_START), "No start is left"),
    (Concern(ConcernCode.CLOCK_CHANGE, start(25).instant, {"nominal": datetime(2026, 11, 25, 3, 30), "twice": False}),
     "Wed 25 Nov: there is no 03:30 that night, it starts at 06:30"),
    (Concern(ConcernCode.CLOCK_CHANGE, start(25).instant, {"nominal": datetime(2026, 11, 25, 3, 30), "twice": True}),
     "Wed 25 Nov: 03:30 comes twice that night, it starts the first time"),
])
def test_every_concern_is_one_sentence(concern, text):
    warning, = shown(draft(kind=Kind.DAILY), Preview(Forecast((start(23),), None, (concern,)))).warnings
    assert warning.text == text
    assert len(warning.line or text) < 40


def test_the_missions_offered_are_those_the_robot_can_be_asked_for():
    own = Mission("Deliver kits", "g-own", id=3, robot_id=1)
    foreign = Mission("Charge", "g-charge", id=4, robot_id=2)
    known = facts(missions=(KITS, replace(EMPTIES, favourite=True), own, foreign))
    assert [row.key for row in form_view.mission_options(known, 1)] == [2, 3]
    assert [row.note for row in form_view.mission_options(known, 1)] == ["", "only on Aino"]
    assert {row.key for row in form_view.mission_options(known, None)} == {1, 2, 3, 4}
    assert {row.icon for row in form_view.mission_options(known, None)} == {"star", "star-outline"}      # a flag is every mission's


def test_numbers_are_stepped_to_and_the_setting_is_the_first_chip():
    windows, battery, days = (form_view.steps(facts(), draft(), name) for name in (
        "start_window_minutes", "minimum_battery_percent", "month_day"))
    assert [word for _key, word in windows.chips] == ["As in Settings: 15 min", "1 min", "5 min", "30 min", "1 h", "2 h"]
    assert [word for _key, word in battery.chips] == ["As in Settings: 30 %", "No minimum", "10 %", "20 %", "50 %"]
    assert days.chips == ((1, "1"), (15, "15"), (-1, "the last day"))
    assert [(one.number(None), one.number(37)) for one in (windows, battery)] == [(15, 37), (30, 37)]
    assert (days.number(-1), days.number(17)) == (31, 17)
    assert {(one.label, one.unit) for one in (windows, battery, days)} == {
        ("Or any other", "min"), ("Or any other", "%"), ("Or any other", "")}
    assert (windows.help, windows.minimum, windows.number(0)) == ("1 to 1440 min", 1, 1)      # that is what 0 min are taken for
    assert battery.help == "0 to 100 %"


def test_what_is_chosen_has_its_chip_though_settings_say_the_same():
    windows, battery = (form_view.steps(facts(), draft(start_window_minutes=15, minimum_battery_percent=30), name) for name in (
        "start_window_minutes", "minimum_battery_percent"))
    assert (15, "15 min") in windows.chips
    assert (30, "30 %") in battery.chips
    none = form_view.steps(facts(settings=replace(facts().settings, minimum_battery_percent=None)), draft(), "minimum_battery_percent")
    assert [word for _key, word in none.chips][:2] == ["As in Settings: none", "10 %"]


def test_other_times_of_the_day_are_whole_hours():
    assert [row.key for row in form_view.also_options(draft())] == [hour for hour in range(24) if hour != 6]
