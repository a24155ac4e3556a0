"""The number fields of the Settings screen go as far as the configuration file does."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

from app.services.catalogue import fields
from app.services.catalogue.checks import Number

PAGES = Path(__file__).parents[2] / "kv" / "settings"
FIELD = re.compile(r"minimum: (\d+)\s+maximum: (\d+)\s[^$]*?on_commit: root\.(?:step|act)\(\"(\w+)\"")
BY_KEY = {field.key: field.check for field in fields.SETTINGS} | {
    "minutes": next(field.check for field in fields.IDLE if field.key == "after_minutes")
}
FOUND = [
    (key, int(low), int(high))
    for page in ("scheduler.kv", "idle.kv")
    for low, high, key in FIELD.findall((PAGES / page).read_text(encoding="utf-8"))
]
WITHOUT_END = {"history_limit"}  # has no upper end that a person would type
LEAST_OF_ZERO = {"start_window_minutes"}  # 0 minutes are taken for 1


def test_all_number_fields_are_found() -> None:
    numbers = {field.key for field in fields.SETTINGS if isinstance(field.check, Number)}
    assert {key for key, _low, _high in FOUND} == numbers | {"minutes"} | WITHOUT_END


@pytest.mark.parametrize(("key", "low", "high"), FOUND)
def test_a_number_field_has_the_range_of_its_setting(key: str, low: int, high: int) -> None:
    check = BY_KEY[key]
    if isinstance(check, Number):
        assert (low, high) == (max(check.low, key in LEAST_OF_ZERO), check.high)
