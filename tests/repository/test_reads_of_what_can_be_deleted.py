"""Deleted objects stay in their table until they can't be restored: SQL reads through views without them."""

from __future__ import annotations

import re
from pathlib import Path

DATABASE = Path(__file__).resolve().parents[2] / "app/database"
READS = re.compile(
    r"(?<!DELETE )\b(?:FROM|JOIN)\s+(robots|robot_groups|places|missions|schedules|calendar_days|group_members|"
    r"mission_places|idle_rules|holds|check_ups)\b"
)
# Written for what may be put back, or kept for it.
WHOLE_TABLES = {
    ("activities.py", "robots"),
    ("check_ups.py", "robots"),
    ("groups.py", "robot_groups"),
    ("missions.py", "missions"),
    ("missions.py", "robots"),
    ("robots.py", "check_ups"),
    ("schedules.py", "schedules"),
}


def test_only_known_places_read_what_is_deleted():
    schema = set(DATABASE.glob("schema*.py"))
    found = {
        (path.name, table) for path in set(DATABASE.glob("*.py")) - schema for table in READS.findall(path.read_text())
    }
    assert found == WHOLE_TABLES
