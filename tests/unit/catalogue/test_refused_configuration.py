"""Configuration files that can't be taken: said with the place in the file, and nothing is changed."""

from __future__ import annotations

from typing import Any

import pytest

from app.domain.models import (
    InvalidInput,
)
from tests.unit.catalogue.configured import changed

BAD: list[tuple[str, Any, str, str]] = [
    ("format", "amr-scheduler/2", "format", "this app reads amr-scheduler/1"),
    ("unknown", 1, "file", "unknown key 'unknown'"),
    ("settings", [], "settings", "an object"),
    ("settings.colour", 1, "settings", "unknown key 'colour'"),
    ("settings.poll_interval_seconds", 0, "settings.poll_interval_seconds", "1 to 3600"),
    ("settings.poll_interval_seconds", 3601, "settings.poll_interval_seconds", "1 to 3600"),
    ("settings.poll_interval_seconds", "30", "settings.poll_interval_seconds", "1 to 3600"),
    ("settings.poll_interval_seconds", True, "settings.poll_interval_seconds", "1 to 3600"),
    ("settings.retry_limit", 21, "settings.retry_limit", "0 to 20"),
    ("settings.minimum_battery_percent", 101, "settings.minimum_battery_percent", "0 to 100"),
    ("settings.working_days", [], "settings.working_days", "at least one"),
    ("settings.working_days", ["MO", "XX"], "settings.working_days", "MO, TU"),
    ("settings.timezone", "Helsinki", "settings.timezone", "Europe/Helsinki"),
    ("settings.timezone", None, "settings.timezone", "Europe/Helsinki"),
    ("settings.start_window_minutes", 1441, "settings.start_window_minutes", "0 to 1440"),
    ("settings.unknown_outcome_quiet_seconds", 4, "settings.unknown_outcome_quiet_seconds", "5 to 600"),
    ("settings.history_limit", 0, "settings.history_limit", "from 1"),
    ("display", {"language": "xx"}, "display.language", "en or fi"),
    ("display", {"theme": "pink"}, "display.theme", "light or dark or contrast"),
    ("display", {"gloves": 1}, "display.gloves", "true or false"),
    ("display", {"font_scale_percent": 99}, "display.font_scale_percent", "100 or 115 or 130"),
    ("display", {"colour": 1}, "display", "unknown key 'colour'"),
    ("calendar", {"country": "XX"}, "calendar.country", "not known here"),
    ("calendar", {"country": "FI", "region": "BY"}, "calendar.region", "no region BY"),
    ("calendar", {"region": "BY"}, "calendar.region", "no region BY"),
    ("calendar", {"days": {}}, "calendar.days", "a list"),
    ("calendar", {"days": [{"name": "A"}]}, "calendar.days[0].first_day", "'first_day' is missing"),
    ("calendar", {"days": [{"name": "A", "first_day": "2026-02-30"}]}, "calendar.days[0].first_day", "no such date"),
    ("calendar", {"days": [{"name": "A", "first_day": "20261224"}]}, "calendar.days[0].first_day", "2026-12-24"),
    (
        "calendar",
        {"days": [{"name": "A", "first_day": "2026-12-24", "last_day": "2026-12-23"}]},
        "calendar.days[0].last_day",
        "before",
    ),
    ("calendar", {"days": [{"name": "A", "first_day": "2026-12-24"}] * 2001}, "calendar.days", "room for 2000"),
    ("missions.0.favourite", "yes", "missions[0].favourite", "true or false"),
    ("robots", {}, "robots", "a list"),
    ("robots.0", "R1", "robots[0]", "an object"),
    ("robots.0", {"address": "x"}, "robots[0].name", "'name' is missing"),
    ("robots.0", {"name": "R1"}, "robots[0].address", "'address' is missing"),
    ("robots.0.adress", "x", "robots[0]", "'adress'"),
    ("robots.0.name", "", "robots[0].name", "enter a name"),
    ("robots.0.name", "x" * 81, "robots[0].name", "at most 80"),
    ("robots.0.name", "a\tb", "robots[0].name", "control characters"),
    ("robots.0.name", "R2", "robots[1].name", "twice in the file"),
    ("robots.0.address", "http://x/api", "robots[0].address", "after the host"),
    ("robots.0.address", 5, "robots[0].address", "a text"),
    ("robots.0.address", "http://r2.local:8443", "robots[0].address", "this is the address of R2"),
    ("robots.0.username", "a:b", "robots[0].username", "colon"),
    ("robots.0.username", "", "robots[0].username", "user name"),
    ("robots.0.password", "", "robots[0].password", "can't be empty"),
    ("robots.0.password", 5, "robots[0].password", "a text"),
    ("robots.0.enabled", "yes", "robots[0].enabled", "true or false"),
    ("robots.0.certificate_sha256", "12", "robots[0].certificate_sha256", "64"),
    ("robots.0.idle.mission", "Nothing", "robots[0].idle.mission", "no mission Nothing for R1"),
    ("robots.0.idle.after_minutes", 4, "robots[0].idle.after_minutes", "5 to 30"),
    ("robots.0.idle.minutes", 4, "robots[0].idle", "'minutes'"),
    ("missions.0.guid", "", "missions[0].guid", "guid"),
    ("missions.0.robot", "R9", "missions[0].robot", "no robot R9"),
    ("missions.1.name", "Deliver", "missions[1].name", "twice in the file"),
    ("schedules.0.robot", "R9", "schedules[0].robot", "no robot R9"),
    ("schedules.0.mission", "Nothing", "schedules[0].mission", "no mission Nothing for R1"),
    ("schedules.0.start", "2026-02-30T06:30", "schedules[0].start", "no such date"),
    ("schedules.0.start", "2026-11-23T06:30:30", "schedules[0].start", "whole minutes"),
    ("schedules.0.start", "2026-11-23T06:30Z", "schedules[0].start", "without a zone"),
    ("schedules.0.start", "2026-11-23 06:30", "schedules[0].start", "2026-11-23T06:30"),
    ("schedules.0.start", 20261123, "schedules[0].start", "local time"),
    ("schedules.0.timezone", "EET/Moon", "schedules[0].timezone", "no time zone"),
    ("schedules.0.recurrence", "", "schedules[0].recurrence", "null"),
    ("schedules.0.recurrence", "RRULE:FREQ=DAILY", "schedules[0].recurrence", "without RRULE:"),
    ("schedules.0.recurrence", "FREQ=SECONDLY", "schedules[0].recurrence", "MINUTELY"),
    ("schedules.0.recurrence", "FREQ=MINUTELY;BYSETPOS=1", "schedules[0].recurrence", "BYSETPOS"),
    ("schedules.0.recurrence", "FREQ=MINUTELY;BYMONTH=2;BYMONTHDAY=30", "schedules[0].recurrence", "has no start"),
    ("schedules.0.recurrence", "FREQ=DAILY", "schedules[0].between", "a recurrence in minutes or hours"),
    ("schedules.0.between", {"from": "08:30"}, "schedules[0].between.to", "'to' is missing"),
    ("schedules.0.between", {"from": "16:45", "to": "08:30"}, "schedules[0].between", "end after it begins"),
    ("schedules.0.between", {"from": "8:30", "to": "16:45"}, "schedules[0].between.from", "08:30"),
    ("schedules.0.between", {"from": "24:00", "to": "24:00"}, "schedules[0].between.from", "08:30"),
    ("schedules.0.minimum_battery_percent", -1, "schedules[0].minimum_battery_percent", "0 to 100"),
    ("schedules.0.start_window_minutes", 1.5, "schedules[0].start_window_minutes", "0 to 1440"),
    ("schedules.0.overlap", "wait", "schedules[0].overlap", "skip or queue"),
    *(
        ("missions.0.usual_minutes", minutes, "missions[0].usual_minutes", "enter a whole number from 1 to 1440")
        for minutes in (0, 1441, 2.5, "12", True)
    ),
    ("schedules.0.priority", "high", "schedules[0].priority", "whole number"),
    ("schedules.0.parameters", [], "schedules[0].parameters", "parameters"),
    ("schedules.0.parameters", {"a": {}}, "schedules[0].parameters", "'a'"),
    ("schedules.1.name", "Morning", "schedules[1].name", "twice in the file"),
    (
        "schedules.1.start",
        "2026-11-25T06:30",
        "schedules[1].start",
        "2026-11-25 is a Wednesday, a day off",
    ),
]


@pytest.mark.parametrize(
    ("path", "value", "field", "problem"), BAD, ids=[f"{path}={value!r:.30}" for path, value, _, _ in BAD]
)
def test_an_invalid_value_is_reported_with_its_path_and_changes_nothing(tablet, path, value, field, problem):
    before = tablet.everything()
    with pytest.raises(InvalidInput) as caught:
        tablet.take(changed(path, value))
    assert caught.value.field == field
    assert problem in caught.value.text
    assert (
        field == "file" or caught.value.text.startswith(field) or caught.value.text.startswith(field.rpartition(".")[0])
    )
    assert "\n" not in caught.value.text
    assert tablet.everything() == before


@pytest.mark.parametrize(
    ("content", "problem"),
    [
        (b"", "line 1, column 1"),
        (b"{", "line 1"),
        (b"[]", "one JSON object"),
        (b"null", "one JSON object"),
        (b"{}", 'lacks "format"'),
        (b"\xff\xfe\x7b", "save it as UTF-8"),
        ('{"name": "Hyllyjä"}'.encode("windows-1252"), "byte 16.*save it as UTF-8"),
        (b'{"format": "amr-scheduler/1", "format": "x"}', "'format' appears twice"),
        (b'{"a": NaN}', "NaN"),
        (b'{"a": -Infinity}', "Infinity"),
        (b"[" * 10_000, "nested"),
        (b'{"a": ' + b"1" * 6000 + b"}", "number"),
        (b" " * (5 * 1024 * 1024 + 1), "larger than 5 MiB"),
    ],
    ids=range(13),
)
def test_a_file_that_is_no_configuration_is_refused_in_one_sentence(tablet, content, problem):
    with pytest.raises(InvalidInput, match=problem) as caught:
        tablet.take(content)
    assert caught.value.field in ("file", "format")
    assert "\n" not in caught.value.text
