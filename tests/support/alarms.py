"""Alarms with all possible parts of their sentences, around the moment of ``home_facts``."""

from __future__ import annotations

from typing import Any

from app.domain.models import Alarm
from app.services.live.alarms import EVENTS, SENTENCES
from tests.support.home_facts import ago


def alarm(code: str, key: str = "robot:1", **values: Any) -> Alarm:
    """Raised two minutes ago; an event comes cleared, as the service raises it."""
    details = {
        "robot": "Aino",
        "mission": "Deliver",
        "reason": "why",
        "problem": "it broke",
        "found": "2",
        "expected": "1",
        "count": 3,
        "queue_id": 7,
        "seconds": 40,
        "start": ago(hours=2).isoformat(),
        "end": ago(hours=1).isoformat(),
    }
    cleared = ago(minutes=2) if code in EVENTS else None
    fields = {"raised_at": ago(minutes=2), "details": details, "id": 1, "cleared_at": cleared, **values}
    return Alarm(code, key, SENTENCES[code][0], **fields)
