"""What the robots did, in words for the lanes."""

from __future__ import annotations

from dataclasses import replace
from datetime import UTC, datetime, timedelta
from zoneinfo import ZoneInfo

import pytest

from app.database.activities import KEPT_FOR
from app.domain.activity import ACTIVITIES, NO_DATA, ActivitySpan
from app.domain.models import Group
from app.screens.logs import activity
from app.screens.logs.activity import HOUR, ActivityFacts, Window
from app.services.history.figures import Facts
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
    assert [tick.label for tick in activity.ticks(facts(8), ZONE)] == [
        "Fri 20 Nov",
        *(f"{hour:02}:00" for hour in range(1, 8)),
    ]
    assert [tick.label for tick in activity.ticks(facts(24), ZONE)] == [
        "Fri 20 Nov",
        *(f"{hour:02}:00" for hour in range(2, 24, 2)),
    ]
    assert [tick.label for tick in activity.ticks(facts(72), ZONE)] == ["Fri 20 Nov", "Sat 21 Nov", "Sun 22 Nov"]
    assert [tick.label for tick in activity.ticks(facts(20 * 24), ZONE)][:2] == ["20 Nov", "21 Nov"]


def test_the_night_of_a_clock_change_has_a_tick_for_each_midnight():
    start = datetime(2026, 10, 23, 21, 0, tzinfo=UTC)
    found = ActivityFacts(start, start + timedelta(hours=73), [])
    assert [round(tick.place * 73) for tick in activity.ticks(found, ZONE)] == [0, 24, 49]


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
    assert [tick.label for tick in shown] == labels
    for tick in shown[1:]:
        assert found.moment(tick.place).astimezone(ZoneInfo(zone)).strftime("%H:%M") == tick.label


def test_lanes_have_the_figure_of_their_robot_and_words_in_their_bands():
    spans = facts(8, ("executing", 0, 1), ("idle", 1, 4), ("offline", 4, 6), (NO_DATA, 6, 8))
    figures = [
        Facts(robot_id=2, mission_s=1.0, observed_s=2.0),
        Facts(robot_id=1, mission_s=3600.0, observed_s=4 * 3600.0),
    ]
    [lane] = activity.lanes(replace(spans, figures=figures))
    assert lane.note == "25 % in use"
    assert lane.spans[0] == activity.Span(0, 0.125, "executing", "Working")
    assert [entry.text for entry in activity.legend(spans)] == ["Working", "Ready", "No answer", "No data"]
    [lane] = activity.lanes(replace(spans, figures=[Facts(robot_id=1)]))
    assert lane.note == "–"  # never observed


def test_more_than_twelve_robots_are_shown_by_groups_and_a_robot_only_once():
    ones = [RobotTimeline(n, f"Robot {n}", [ActivitySpan("paused", START, START + HOUR)]) for n in range(1, 15)]
    groups = [Group("Hall 1", (1, 2, 3), id=5), Group("Hall 2", (3, 4), id=6)]
    found = ActivityFacts(START, START + HOUR, ones, groups=groups)
    lanes = activity.lanes(found)
    assert [lane.name for lane in lanes] == [
        "Hall 1 · 3 robots",
        "Robot 1",
        "Robot 2",
        "Robot 3",
        "Hall 2 · 1 robot",
        "Without group · 10 robots",
    ]
    assert lanes[1].spans[0].text == "Paused"
    assert [lane.is_open for lane in lanes if lane.is_open is not None] == [True, False, False]
    assert [lane.name for lane in activity.lanes(found, 6)][1:3] == ["Hall 2 · 1 robot", "Robot 4"]


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
    timeline, span = activity.span_at(found, 1, 1.5 / 8)
    details = activity.span_details(timeline, span, found.end, "Europe/Helsinki")
    assert details.title == f"Aino · {activity.word(kind)}"
    assert [line.value for line in details.lines] == ["01:00", "02:00", "1 h"]


def test_a_tap_outside_every_span_or_on_no_robot_finds_nothing():
    found = facts(8, ("idle", 1, 2))
    assert activity.span_at(found, 1, 0.9) is None
    assert activity.span_at(found, 2, 0.2) is None
