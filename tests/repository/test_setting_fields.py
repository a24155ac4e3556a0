"""The number fields of the Settings screen go as far as the configuration file does, and say so."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

from app.services.catalogue import fields
from app.services.catalogue.checks import Number

PAGES = Path(__file__).parents[2] / "kv" / "settings"
SAID = re.compile(r"setting: \"(\w+)\"\n[^$]*?help: tr\._\(\"(\d+) to (\d+)")
RANGES = {field.key: field.check for field in fields.SETTINGS if isinstance(field.check, Number)}
FOUND = SAID.findall((PAGES / "scheduler.kv").read_text(encoding="utf-8"))
LEAST_OF_ZERO = {"start_window_minutes"}  # 0 minutes are taken for 1


def test_every_number_of_the_table_has_its_field_on_the_screen() -> None:
    assert {key for key, _low, _high in FOUND} == RANGES.keys()


@pytest.mark.parametrize(("key", "low", "high"), FOUND)
def test_a_number_field_says_its_range(key: str, low: str, high: str) -> None:
    assert (int(low), int(high)) == (max(RANGES[key].low, key in LEAST_OF_ZERO), RANGES[key].high)


def test_minutes_of_an_idle_rule_go_as_far_as_in_a_file() -> None:
    minutes = next(field.check for field in fields.IDLE if field.key == "after_minutes")
    page = (PAGES / "idle.kv").read_text(encoding="utf-8")
    (low, high) = re.findall(r"minimum: (\d+)\s+maximum: (\d+)", page)[0]
    assert minutes == Number(int(low), int(high))
