"""A robot that does something else at every poll: its band in Logs is drawn in one pass over what was stored of it."""

from __future__ import annotations

from datetime import UTC, datetime, timedelta
from typing import Any

from app.domain.activity import ActivitySpan, as_drawn

START, POLL, SPANS, COLUMNS = datetime(2026, 11, 23, tzinfo=UTC), timedelta(seconds=2), 20_000, 600


class Counted(list[ActivitySpan]):
    """Notes how many of its entries are read or copied."""

    read = 0

    def __getitem__(self, index: Any) -> Any:
        found = super().__getitem__(index)
        self.read += len(found) if isinstance(index, slice) else 1
        return found


def test_each_span_is_read_a_few_times_however_many_there_are():
    activities = ("idle", "executing", "paused")
    spans = Counted(ActivitySpan(activities[n % 3], START + n * POLL, START + (n + 1) * POLL) for n in range(SPANS))
    drawn = as_drawn(spans, COLUMNS)
    assert spans.read < 4 * (SPANS + COLUMNS)  # 600 times as many before: twelve robots held the window for seconds
    assert (drawn[0].start, drawn[-1].end) == (START, START + SPANS * POLL)
