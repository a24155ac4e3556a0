"""When an alarm makes a sound: a new one of high priority, and again every 5 min until a person has acknowledged or shelved it, or it is
over. Pure."""

from __future__ import annotations

from collections.abc import Iterable
from datetime import datetime, timedelta

from app.domain.models import Alarm, Priority
from app.screens.common.alarms_view import can_be_handled, is_over, is_shelved

PATIENCE = timedelta(minutes=5)  # time for a person to come


def needs_attention(alarm: Alarm, now: datetime) -> bool:
    """Of high priority and unacknowledged."""
    return (
        alarm.priority is Priority.HIGH
        and alarm.acknowledged_at is None
        and not is_over(alarm)
        and not is_shelved(alarm, now)
    )


class Sounding:
    """Remembers which alarms have sounded, by the monotonic clock: the wall clock may be set back."""

    def __init__(self) -> None:
        self._sounded: dict[tuple[str, str, int], float] = {}  # by code, key and how often it has come

    def is_due(self, alarms: Iterable[Alarm], now: datetime, monotonic: float) -> bool:
        """Whether to sound now; counts as sounded. ``monotonic`` in s."""
        calling = {(alarm.code, alarm.key, alarm.count): alarm for alarm in alarms if needs_attention(alarm, now)}
        due = [
            key
            for key, alarm in calling.items()
            if key not in self._sounded
            or (can_be_handled(alarm) and monotonic - self._sounded[key] >= PATIENCE.total_seconds())
        ]
        self._sounded = {key: monotonic if key in due else self._sounded[key] for key in calling}
        return bool(due)
