"""What the robots did, in words for the lanes."""

from __future__ import annotations

from datetime import UTC, datetime, timedelta
from zoneinfo import ZoneInfo

import pytest

from app.database.activities import KEPT_FOR
from app.domain.activity import ACTIVITIES, NO_DATA, ActivitySpan
from app.domain.models import Group
from app.screens.logs import activity
from app.screens.logs.activity import HOUR, ActivityFacts, Window
from app.services.history.runs import RobotTimeline

ZONE = ZoneInfo("Europe/Helsinki")
START = datetime(2026, 11, 19, 22, 0, tzinfo=UTC)  # midnight in Helsinki


def facts(hours: float, *spans: tuple[str, float, float]) -> ActivityFacts:
    timeline = RobotTimeline(
        1,
        "Aino",
        [
            ActivitySpan(what, START + timedelta(hours=start), START + timedelta(hours=end))
            for what, start, end in spans
        ],
    )
    return ActivityFacts(START, START + timedelta(hours=hours), [timeline])


def test_a_day_has_hours_and_more_has_days():
    assert [label for _hour, label, _strong in activity.ticks(facts(8), ZONE)] == [
        "Fri 20 Nov",
        *(f"{hour:02}:00" for hour in range(1, 8)),
    ]
    assert [label for _hour, label, _strong in activity.ticks(facts(24), ZONE)] == [
        "Fri 20 Nov",
        *(f"{hour:02}:00" for hour in range(2, 24, 2)),
    ]
    assert [label for _hour, label, _strong in activity.ticks(facts(72), ZONE)] == [
        "Fri 20 Nov",
        "Sat 21 Nov",
        "Sun 22 Nov",
    ]
    assert [label for _hour, label, _strong in activity.ticks(facts(20 * 24), ZONE)][:2] == ["20 Nov", "21 Nov"]


def test_the_night_of_a_clock_change_has_a_tick_for_each_midnight():
    start = datetime(2026, 10, 23, 21, 0, tzinfo=UTC)
    found = ActivityFacts(start, start + timedelta(hours=73), [])
    assert [round(hour) for hour, _label, _strong in activity.ticks(found, ZONE)] == [0, 24, 49]


@pytest.mark.parametrize(
    ("zone", "start", "labels"),
    [
        (
            "Australia/Lord_Howe",
            datetime(2026, 10, 3, 13, 30, tzinfo=UTC),
            ["Sun 4 Oct", "01:00", "03:00", "04:00", "05:00", "06:00"],
        ),
        (
            "Australia/Lord_Howe",
            datetime(2027, 4, 3, 13, 0, tzinfo=UTC),
            ["Sun 4 Apr", "01:00", "02:00", "03:00", "04:00", "05:00"],
        ),
        (
            "Europe/Helsinki",
            datetime(2027, 3, 27, 22, 0, tzinfo=UTC),
            ["Sun 28 Mar", "01:00", "02:00", "04:00", "05:00", "06:00"],
        ),
        (
            "Europe/Helsinki",
            datetime(2026, 10, 24, 21, 0, tzinfo=UTC),
            ["Sun 25 Oct", "01:00", "02:00", "03:00", "03:00", "04:00"],
        ),
    ],
)
def test_ticks_stand_at_full_hours_of_the_wall_clock_also_when_it_is_changed(zone, start, labels):
    found = ActivityFacts(start, start + timedelta(hours=6), [])
    shown = activity.ticks(found, ZoneInfo(zone))
    assert [label for _hour, label, _strong in shown] == labels
    for hour, label, _strong in shown[1:]:
        assert (found.start + hour * HOUR).astimezone(ZoneInfo(zone)).strftime("%H:%M") == label


def test_lanes_say_how_much_their_robot_worked_and_what_it_did():
    spans = facts(8, ("executing", 0, 1), ("idle", 1, 4), ("offline", 4, 6), (NO_DATA, 6, 8))
    [lane] = activity.lanes(spans)
    assert lane.note == "25 % in use"  # of the time in which it answered
    assert lane.bars[0][1:5] == (0, 1, "Working", "executing")
    assert [text for _kind, text in activity.legend(spans)] == ["Working", "Ready", "No answer", "No data"]


def test_an_error_has_a_sign_where_there_is_no_room_for_its_word():
    [lane] = activity.lanes(facts(8, ("error", 0, 1), ("idle", 1, 8)))
    assert [(bar.label, bar.shorter) for bar in lane.bars] == [("Stopped", ("!", "")), ("Ready", ("",))]


def test_a_robot_that_was_not_seen_was_not_out_of_use():
    [lane] = activity.lanes(facts(8, ("offline", 0, 6), (NO_DATA, 6, 8)))
    assert lane.note == "–"


def test_more_than_twelve_robots_are_shown_by_groups_and_a_robot_only_once():
    ones = [RobotTimeline(n, f"Robot {n}", [ActivitySpan("paused", START, START + HOUR)]) for n in range(1, 15)]
    groups = [Group("Hall 1", (1, 2, 3), id=5), Group("Hall 2", (3, 4), id=6)]
    found = ActivityFacts(START, START + HOUR, ones, groups=groups)
    lanes = activity.lanes(found)
    assert [(lane.name, lane.line) for lane in lanes] == [
        ("Hall 1", "3 robots · 0 % in use"),
        ("Robot 1", ""),
        ("Robot 2", ""),
        ("Robot 3", ""),
        ("Hall 2", "1 robot · 0 % in use"),
        ("Without group", "10 robots · 0 % in use"),
    ]
    assert lanes[1].bars[0].label == "Paused"
    assert [lane.is_open for lane in lanes if lane.line] == [True, False, False]
    assert [lane.name for lane in activity.lanes(found, 6)][1:3] == ["Hall 2", "Robot 4"]


def test_the_window_moves_by_half_to_now_at_most_and_as_far_as_recordings_are_kept():
    now = START + 20 * HOUR
    assert Window().span(now) == (START + 12 * HOUR, now)
    earlier = Window().moved(False, now)
    assert earlier.span(now) == (START + 8 * HOUR, START + 16 * HOUR)
    assert earlier.moved(True, now) == Window()
    far = Window(end=now - KEPT_FOR).moved(False, now)
    assert far.span(now)[0] == now - KEPT_FOR


@pytest.mark.parametrize("kind", [*ACTIVITIES, NO_DATA])
def test_every_activity_has_a_word_and_details(kind):
    found = facts(8, (kind, 1, 2))
    timeline, span = activity.span_of(found, (1, found.timelines[0].spans[0]))
    details = activity.span_details(timeline, span, found.end, "Europe/Helsinki")
    assert details.title == f"Aino · {activity.word(kind)}"
    assert [line.value for line in details.lines] == ["01:00", "02:00", "1 h"]


def test_a_bar_of_several_means_the_longest_and_one_of_a_removed_robot_nothing():
    found = facts(8, ("error", 1, 2), ("idle", 2, 3), ("error", 3, 5), ("idle", 5, 6))
    drawn = ActivitySpan("error", START + HOUR, START + 6 * HOUR)
    _timeline, span = activity.span_of(found, (1, drawn))
    assert span == found.timelines[0].spans[2]
    assert activity.span_of(found, (2, drawn)) is None
