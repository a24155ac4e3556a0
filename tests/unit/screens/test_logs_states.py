"""Bands of robots in words."""

from __future__ import annotations

from datetime import UTC, datetime, timedelta
from zoneinfo import ZoneInfo

import pytest

from app.domain.activity import ACTIVITIES, NO_DATA, ActivitySpan
from app.screens.logs import robot_states as states
from app.services.history.figures import Facts
from app.services.history.runs import RobotTimeline

ZONE = ZoneInfo("Europe/Helsinki")
START = datetime(2026, 11, 19, 22, 0, tzinfo=UTC)  # midnight in Helsinki


def facts(hours: float, *spans: tuple[str, float, float]) -> states.StatesFacts:
    timeline = RobotTimeline(
        1,
        "Aino",
        [
            ActivitySpan(what, START + timedelta(hours=start), START + timedelta(hours=end))
            for what, start, end in spans
        ],
    )
    return states.StatesFacts(START, START + timedelta(hours=hours), [timeline])


def test_a_day_has_hours_and_more_has_days():
    assert [tick.label for tick in states.ticks(facts(8), ZONE)] == [
        "Fri 20 Nov",
        *(f"{hour:02}:00" for hour in range(1, 8)),
    ]
    assert [tick.label for tick in states.ticks(facts(24), ZONE)] == [
        "Fri 20 Nov",
        *(f"{hour:02}:00" for hour in range(2, 24, 2)),
    ]
    night = facts(8).within(facts(8).start + timedelta(hours=2), timedelta(hours=4))
    assert [tick.label for tick in states.ticks(night, ZONE)] == ["Fri 20 Nov 02:00", "03:00", "04:00", "05:00"]
    assert [tick.label for tick in states.ticks(facts(72), ZONE)] == ["Fri 20 Nov", "Sat 21 Nov", "Sun 22 Nov"]
    assert [tick.label for tick in states.ticks(facts(20 * 24), ZONE)][:2] == ["20 Nov", "21 Nov"]


def test_the_night_of_a_clock_change_has_a_tick_for_each_midnight():
    start = datetime(2026, 10, 23, 21, 0, tzinfo=UTC)
    found = states.StatesFacts(start, start + timedelta(hours=73), [])
    assert [round(tick.place * 73) for tick in states.ticks(found, ZONE)] == [0, 24, 49]


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
    found = states.StatesFacts(start, start + timedelta(hours=6), [])
    shown = states.ticks(found, ZoneInfo(zone))
    assert [tick.label for tick in shown] == labels
    for tick in shown[1:]:
        assert found.moment(tick.place).astimezone(ZoneInfo(zone)).strftime("%H:%M") == tick.label


def test_the_share_on_missions_is_the_utilisation_of_the_figures():
    spans = facts(8, ("executing", 0, 1), ("idle", 1, 4), ("offline", 4, 6), (NO_DATA, 6, 8))
    figures = [
        Facts(robot_id=2, mission_s=1.0, observed_s=2.0),
        Facts(robot_id=1, mission_s=3600.0, observed_s=4 * 3600.0),
    ]
    [lane] = states.lanes(spans, figures)
    assert lane.note == "25 % on missions"
    assert lane.spans[0] == states.Span(0, 0.125, "executing")
    [lane] = states.lanes(
        spans, [Facts(robot_id=1, mission_s=3600.0, observed_s=3 * 3600.0)]
    )  # ignoring other activities
    assert lane.note == "33 % on missions"
    [lane] = states.lanes(facts(8, (NO_DATA, 0, 8)), [Facts(robot_id=1)])
    assert lane.note == "never observed"
    [lane] = states.lanes(spans, ())
    assert lane.note == ""


@pytest.mark.parametrize("activity", [*ACTIVITIES, NO_DATA])
def test_every_activity_has_a_word_and_details(activity):
    found = facts(8, (activity, 1, 2))
    timeline, span = states.span_at(found, 1, 1.5 / 8)
    details = states.span_details(timeline, span, found.end, "Europe/Helsinki")
    assert details.title == f"Aino: {states.word(activity)}"
    assert details.text.endswith(".")
    assert [line.value for line in details.lines] == ["01:00", "02:00", "1 h"]


def test_a_tap_outside_every_span_or_on_no_robot_finds_nothing():
    found = facts(8, ("idle", 1, 2))
    assert states.span_at(found, 1, 0.9) is None
    assert states.span_at(found, 2, 0.2) is None
    assert states.explanation(None).lines == ()
