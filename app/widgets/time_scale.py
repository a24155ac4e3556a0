"""Hours as a timeline draws them: folded time takes little room, however long it is."""

from bisect import bisect_right
from collections.abc import Iterable


class TimeScale:
    """``folds`` [(from, to)] in hours, without overlaps; each takes ``width`` hours of room, or less if it is shorter.
    ``drawn(hour)`` is the place of an hour, in hours of room from hour 0; ``hour(drawn)`` the opposite."""

    def __init__(self, folds: Iterable[tuple[float, float]] = (), width: float = 0.0) -> None:
        self._folds: list[tuple[float, float, float, float]] = []  # from, to, and the same as drawn
        self._starts: list[float] = []
        for start, end in sorted(folds):
            drawn = self.drawn(start)
            self._starts.append(start)
            self._folds.append((start, end, drawn, drawn + min(width, end - start)))

    def drawn(self, hour: float) -> float:
        n = bisect_right(self._starts, hour)
        return _through(hour, *self._folds[n - 1]) if n else hour

    def hour(self, drawn: float) -> float:
        n = bisect_right(self._folds, drawn, key=lambda fold: fold[2])
        if not n:
            return drawn
        start, end, drawn_start, drawn_end = self._folds[n - 1]
        return _through(drawn, drawn_start, drawn_end, start, end)


def _through(value: float, start: float, end: float, to_start: float, to_end: float) -> float:
    """From one scale to the other: beyond ``end`` both continue in the same way."""
    if value >= end or end == start:
        return to_end + value - end
    return to_start + (value - start) * (to_end - to_start) / (end - start)
