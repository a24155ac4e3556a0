from __future__ import annotations

from datetime import UTC, datetime, timedelta

import pytest

from app.domain.message import render
from app.services.dispatch.plausibility import clock_problem

NOW = datetime(2026, 11, 23, 12, 0, tzinfo=UTC)
YESTERDAY, TOMORROW = NOW - timedelta(days=1), NOW + timedelta(days=1)


@pytest.mark.parametrize(("heartbeat", "offsets", "plausible"), [
    (None, [], True),
    (YESTERDAY, [], True),
    (TOMORROW, [], False),
    (NOW + timedelta(seconds=30), [], True),              # a few seconds lost over a restart
    (TOMORROW, [1.0], False),                             # one robot proves nothing
    (TOMORROW, [1.0, -2.0], True),                        # two that agree with the tablet do
    (YESTERDAY, [3600.0], True),
    (YESTERDAY, [3600.0, 3601.0], False),
    (YESTERDAY, [3600.0, 1.0], True),                     # no majority
    (YESTERDAY, [-3600.0, -3600.0, 1.0, None], False),
    (YESTERDAY, [599.0, 599.0], True),
])
def test_when_the_tablets_clock_is_believed(heartbeat, offsets, plausible):
    assert (clock_problem(NOW, heartbeat, offsets) is None) is plausible


def test_the_sentence_says_by_how_much():
    assert "60 min ahead of it" in render(clock_problem(NOW, None, [3600.0, 3602.0]))
    assert "60 min behind it" in render(clock_problem(NOW, None, [-3600.0, -3602.0]))
