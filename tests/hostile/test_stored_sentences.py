"""Sentences in a backup that somebody prepared: a kilobyte of them became gigabytes on the screen that shows the alarms."""

from __future__ import annotations

import json
from dataclasses import replace
from datetime import UTC, datetime

import pytest

from app.domain.execution import Reason, ReasonCode
from app.domain.message import LONGEST, render
from app.domain.reasons import sentence
from app.services.live.alarms import LONGEST_DETAIL, LONGEST_SHOWN, alarm_of, alarm_sentence

NOW = datetime(2026, 11, 23, 6, tzinfo=UTC)
TOO_WIDE = 10**12  # characters: no machine has the memory


def nested(times: int, depth: int) -> dict[str, object]:
    """A sentence with the same part many times, which has the same part many times."""
    found: dict[str, object] = {"msgid": "x" * 100, "params": {}}
    for _ in range(depth):
        found = {"msgid": "{a}" * times, "params": {"a": found}}
    return found


HOSTILE = {
    "a width": {"msgid": f"{{a:>{TOO_WIDE}}}", "params": {"a": 1}},
    "a width in a parameter": {"msgid": "{a:>{b}}", "params": {"a": 1, "b": TOO_WIDE}},
    "a precision": {"msgid": f"{{a:.{TOO_WIDE}f}}", "params": {"a": 1.5}},
    "an attribute": {"msgid": "{a.__class__.__mro__}", "params": {"a": 1}},
    "parts of parts": nested(60, 6),
    "without end": {"msgid": "x" * 100_000, "params": {}},
    "with a text without end": {"msgid": "{a}" * 30_000, "params": {"a": "x" * 50_000}},
    "bottomless": nested(1, 300),
}
hostile = pytest.mark.parametrize("what", HOSTILE.values(), ids=HOSTILE.keys())


@hostile
def test_no_sentence_is_longer_than_anybody_reads(what):
    assert len(render(what)) <= LONGEST
    assert len(json.dumps(what)) <= 150_000


@hostile
def test_nor_is_that_of_an_alarm_or_a_reason(what):
    alarm = replace(alarm_of("robot_error", "robot:1", NOW, {"robot": "R1"}), details={"robot": "R1", "problem": what})
    assert len(alarm_sentence(alarm)) <= LONGEST_SHOWN + 10
    assert len(sentence(Reason(ReasonCode.REFUSED, {"problem": what}), "UTC")) <= LONGEST


@pytest.mark.parametrize(
    "code",
    [f"{{robot:>{TOO_WIDE}}}", "{", "x" * 90_000, "{robot.__class__}"],
    ids=["a width", "a brace", "long", "an attribute"],
)
def test_an_unknown_alarm_code_is_not_a_template(code):
    alarm = replace(alarm_of("robot_error", "robot:1", NOW, {"robot": "R1"}), code=code)
    assert alarm_sentence(alarm)[: LONGEST_DETAIL - 1] == code[: LONGEST_DETAIL - 1]


def test_sentences_of_this_app_are_as_they_were():
    assert (
        render({"msgid": "{part!r} is {what:.2f}, {{not}} {missing}", "params": {"part": "a", "what": 1.5}})
        == "'a' is 1.50, {not} ?"
    )
