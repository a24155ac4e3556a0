"""When a schedule runs: ``rule`` reads an RRULE, ``dates`` computes its dates, ``times`` the times of day of a
sub-daily one, ``instants`` combines both."""

from app.services.planning.recurrence.dates import months_of
from app.services.planning.recurrence.instants import (
    Occurrence,
    check_has_instants,
    next_occurrence,
    occurrences,
    passed_occurrences,
    to_utc,
)
from app.services.planning.recurrence.rule import Frequency, Recurrence

__all__ = [
    "Frequency",
    "Occurrence",
    "Recurrence",
    "check_has_instants",
    "months_of",
    "next_occurrence",
    "occurrences",
    "passed_occurrences",
    "to_utc",
]
