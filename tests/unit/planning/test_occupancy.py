"""When more runs want something than there is room for, against counting minute by minute."""

from __future__ import annotations

from datetime import UTC, datetime, timedelta

from hypothesis import given
from hypothesis import strategies as st

from app.domain.conflicts import ConflictCode
from app.services.planning.conflicts import Resource, crowded_hours
from app.services.planning.occupancy import Occupancy, Span, merged
from tests.support.examples import examples

NOW = datetime(2026, 11, 23, 7, 30, tzinfo=UTC)


def at(minutes):
    return NOW + timedelta(minutes=minutes)


def span(begins, ends):
    return Span(at(begins), at(ends))


def test_an_hour_is_crowded_by_the_runs_that_begin_in_it():
    """Two robots may be there for 120 minutes; these runs take 15 + 30 + 45."""
    spans = [span(-30, -15), span(-20, 10), span(29, 74), span(30, 70), span(-31, 0)]
    [hour] = crowded_hours(Resource(ConflictCode.PLACE_FULL, 2, {"place": "Dock 2", "place_id": 1}, spans))
    assert (hour.at, hour.details["percent"]) == (at(-30), 75)


SPANS = st.lists(
    st.tuples(st.integers(0, 120), st.integers(0, 40)).map(lambda one: span(one[0], one[0] + one[1])), max_size=12
)


@examples(100)
@given(SPANS, st.integers(0, 4), st.integers(0, 120), st.integers(1, 60))
def test_crowds_are_those_of_a_plain_count(spans, room, begins, lasts):
    occupancy = Occupancy(spans)
    count = [sum(one.begins <= at(minute) < one.ends for one in spans) for minute in range(-1, 200)]
    assert [occupancy.at(at(minute)) for minute in range(-1, 200)] == count
    assert occupancy.most(at(begins), at(begins + lasts)) == max(count[begins + 1 : begins + lasts + 1])
    crowded = [minute for minute, number in enumerate(count, -1) if number > room]
    found = list(occupancy.overloads(room))
    assert sorted(crowded) == [
        minute for crowd in found for minute in range(-1, 200) if crowd.at <= at(minute) < crowd.until
    ]
    assert all(crowd.number == occupancy.at(crowd.at) > room for crowd in found)
    within = [minute for minute in crowded if begins <= minute < begins + lasts]
    first = occupancy.first_overload(room, at(begins), at(begins + lasts))
    assert (first and first.at) == (at(within[0]) if within else None)


@examples(60)
@given(SPANS)
def test_joined_spans_cover_the_same_minutes_each_once(spans):
    occupancy, one = Occupancy(spans), Occupancy(merged(spans))
    assert [min(1, occupancy.at(at(minute))) for minute in range(200)] == [one.at(at(minute)) for minute in range(200)]
