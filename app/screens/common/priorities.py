"""The words of priorities: whole numbers, larger ones go first."""

from __future__ import annotations

from app.i18n import _
from app.services.allocation.situation import CRITICAL, HIGH, LOW, NORMAL

LEVELS = (LOW, NORMAL, HIGH, CRITICAL)


def level(priority: int) -> int:
    """The one of the four levels that a number belongs to."""
    return max(LOW, min(priority, CRITICAL))


def word(priority: int) -> str:
    return {LOW: _("Low"), NORMAL: _("Normal"), HIGH: _("High"), CRITICAL: _("Critical")}[level(priority)]
