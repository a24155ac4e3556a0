"""Spans of what a robot did: recorded look by look, stored and read without gaps; against plain recounts."""

from __future__ import annotations

from datetime import datetime, timedelta
from itertools import pairwise

import pytest
from hypothesis import given
from hypothesis import strategies as st

from app.database.activities import ActivityRepository
from app.domain.activity import ACTIVITIES, NO_DATA, ActivitySpan, SpanRecorder, as_drawn, without_gaps
from app.services.history.runs import RobotStates
from tests.support.examples import examples
from tests.support.kpi_world import NOON, World

GAP = 90.0


def at(minutes: float) -> datetime:
    return NOON + timedelta(minutes=minutes)


def span(activity: str, start: float, end: float) -> ActivitySpan:
    return ActivitySpan(activity, at(start), at(end))


def looks(recorder: SpanRecorder, *seen: tuple[float, str]) -> None:
    """Look at these seconds after noon; both clocks agree."""
    for seconds, activity in seen:
        recorder.saw(activity, NOON + timedelta(seconds=seconds), 1000 + seconds, GAP)


# ---------------------------------------------------------------------- recorded
@pytest.fixture
def recorder() -> SpanRecorder:
    return SpanRecorder()


def test_something_else_begins_where_the_last_look_was(recorder):
    looks(recorder, (0, "idle"), (60, "idle"))
    recorder.take()
    assert not recorder.has_changed
    looks(recorder, (90, "executing"), (120, "executing"))
    assert recorder.has_changed
    assert recorder.take() == [span("idle", 0, 1), span("executing", 1, 2)]


@pytest.mark.parametrize("step", [-3600, 3600])
def test_a_clock_that_is_set_begins_a_new_span(recorder, step):
    looks(recorder, (0, "idle"), (60, "idle"))
    for seconds in (90, 120):
        recorder.saw("idle", NOON + timedelta(seconds=seconds + step), 1000 + seconds, GAP)
    assert recorder.take() == [span("idle", 0, 1), span("idle", 1.5 + step / 60, 2 + step / 60)]


@given(st.lists(st.tuples(st.floats(0.5, 200), st.sampled_from(ACTIVITIES)), max_size=60))
def test_spans_hold_the_same_seconds_as_a_recount(seen):
    recorder, seconds, stored = SpanRecorder(), 0.0, {}
    expected: dict[str, float] = {}
    for n, (passed, activity) in enumerate(seen):
        seconds += passed
        looks(recorder, (seconds, activity))
        if n and passed <= GAP:
            expected[activity] = expected.get(activity, 0.0) + passed
        if n % 3 == 0:
            stored.update({one.start: one for one in recorder.take()})
    stored.update({one.start: one for one in recorder.take()})
    found: dict[str, float] = {}
    for one in stored.values():
        found[one.activity] = found.get(one.activity, 0.0) + one.seconds
    assert found == pytest.approx(expected, abs=0.01)
    ordered = sorted(stored.values(), key=lambda one: one.start)
    assert all(first.end <= second.start for first, second in pairwise(ordered))


# ---------------------------------------------------------------------- read
STORED = st.lists(
    st.tuples(st.sampled_from(ACTIVITIES), st.integers(-20, 80), st.integers(1, 30)),
    max_size=15,
    unique_by=lambda one: one[1],
)


@given(STORED)
def test_a_period_is_covered_without_gaps(stored):
    spans = [span(activity, start, start + length) for activity, start, length in stored]
    found = without_gaps(spans, at(0), at(60))
    assert (found[0].start, found[-1].end) == (at(0), at(60))
    assert all(first.end == second.start and first.activity != second.activity for first, second in pairwise(found))
    for minute in range(60):
        begun = [one for one in spans if one.start <= at(minute)]
        last = max(begun, key=lambda one: one.start, default=None)
        expected = last.activity if last is not None and at(minute) < last.end else NO_DATA
        assert next(one.activity for one in found if one.start <= at(minute) < one.end) == expected


@given(STORED, st.integers(1, 12))
def test_a_drawing_keeps_its_edges_and_every_error(stored, columns):
    spans = without_gaps([span(activity, start, start + length) for activity, start, length in stored], at(0), at(60))
    drawn = as_drawn(spans, columns)
    assert len(drawn) <= max(columns, 1)
    assert (drawn[0].start, drawn[-1].end) == (at(0), at(60))
    assert all(first.end == second.start for first, second in pairwise(drawn))
    for one in spans:
        if one.activity == "error":
            assert any(other.activity == "error" and other.start < one.end and one.start < other.end for other in drawn)


# ---------------------------------------------------------------------- stored
@examples(40)
@given(stored=STORED)
def test_a_period_is_read_back_unchanged(tmp_path_factory, stored):
    world = World(tmp_path_factory.mktemp("spans"))
    spans = [(activity, at(start), at(start + length)) for activity, start, length in stored]
    world.db.write(lambda c: ActivityRepository().save(c, 1, spans))
    world.db.write(lambda c: ActivityRepository().save(c, 2, [("error", at(0), at(60))]))
    aino, bella = RobotStates(world.db).timelines(at(0), at(60))
    world.db.close()
    ordered = sorted(spans, key=lambda one: one[1])
    expected = [
        ActivitySpan(*one) for n, one in enumerate(ordered) if n + 1 == len(ordered) or ordered[n + 1][1] > at(0)
    ]
    assert list(bella.spans) == without_gaps(expected, at(0), at(60))
    assert (aino.robot, dict(aino.seconds)) == ("Aino", {"error": 3600})
