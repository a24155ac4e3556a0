"""The newer zone data count: the system's, or those that come with the app."""

from __future__ import annotations

import os
import subprocess
import sys
import zoneinfo
from datetime import UTC, datetime

import pytest
import tzdata

from app.domain.clock import use_newest_zone_data
from tests.support.zone_files import file_of_rule, put

PACIFIC = "PST8PDT,M3.2.0,M11.1.0"  # Vancouver until 2026: in winter 8 h behind; since then 7 h all year
SIX = datetime(2026, 12, 1, 6, 0)


@pytest.fixture
def zones(tmp_path):
    """A system's directory, and the hour in UTC at which it is six in Vancouver."""
    path = zoneinfo.TZPATH
    put(tmp_path, "America/Vancouver", file_of_rule(PACIFIC))

    def hour(*directories) -> int:
        zoneinfo.reset_tzpath(to=[str(directory) for directory in directories or [tmp_path]])
        use_newest_zone_data()
        return SIX.replace(tzinfo=zoneinfo.ZoneInfo("America/Vancouver")).astimezone(UTC).hour

    yield hour
    zoneinfo.reset_tzpath(to=path)
    zoneinfo.ZoneInfo.clear_cache()


@pytest.mark.parametrize(
    ("file", "text", "hour"),
    [
        ("tzdata.zi", "# version 2025b\n# redo", 13),
        ("tzdata.zi", "# version 2026a\n", 13),
        ("tzdata.zi", "# version 2026za\n", 14),
        ("tzdata.zi", "# version 2027a-dirty\n", 14),
        ("tzdata.zi", f"# version {tzdata.IANA_VERSION}\n", 14),  # as old as the app's own: the system's
        ("+VERSION", "2025c\n", 13),
        ("+VERSION", "2031a\n", 14),
        ("+VERSION", "", 13),
        ("zone.tab", "nothing says how old these are", 13),
    ],
)
def test_the_newer_data_count(tmp_path, zones, file, text, hour):
    put(tmp_path, file, text)
    assert zones() == hour


def test_the_newer_of_two_directories_counts(tmp_path, zones):
    old, new = tmp_path / "old", tmp_path / "new"
    put(old, "tzdata.zi", "# version 2020a\n")
    put(old, "America/Vancouver", file_of_rule("MST7"))
    put(new, "tzdata.zi", "# version 2031a\n")
    put(new, "America/Vancouver", file_of_rule("AST4"))
    assert zones(old, new) == 10


def test_a_start_is_planned_by_the_newer_data_in_a_process_of_its_own(tmp_path):
    """For any first import."""
    put(tmp_path, "tzdata.zi", "# version 2025b\n")
    put(tmp_path, "America/Vancouver", file_of_rule(PACIFIC))
    program = """
from datetime import UTC, datetime
from app.services.planning.recurrence import next_occurrence
from app.services.planning.working_days import WorkingCalendar
from app.domain.models import Schedule
schedule = Schedule("S", 1, 1, datetime(2026, 11, 1, 6), "America/Vancouver", "FREQ=DAILY", respect_working_days=False)
print(next_occurrence(schedule, datetime(2026, 12, 1, tzinfo=UTC), None))
"""
    done = subprocess.run(
        [sys.executable, "-c", program],
        env={**os.environ, "PYTHONTZPATH": str(tmp_path)},
        text=True,
        capture_output=True,
        check=True,
    )
    assert done.stdout == "2026-12-01 13:00:00+00:00\n"
