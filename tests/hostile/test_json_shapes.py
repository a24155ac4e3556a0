"""JSON that would hold up every thread while it is parsed: refused by the number of its parts, before."""

from __future__ import annotations

import json

import pytest

from app.domain.json_parts import MOST_AT_ONCE, MOST_PARTS, has_too_many_parts
from app.domain.models import InvalidInput
from app.mir import parse
from app.mir.errors import Unreadable
from app.services.catalogue.configuration import document

N = MOST_AT_ONCE
DECOY = '"}"'  # a string that looks like the end of an object

TOO_MANY = {
    "numbers": "[" + "0," * N + "0]",
    "strings": "[" + '"ab",' * N + "0]",
    "empty lists": "[" + "[]," * N + "0]",
    "nested lists": "[" + ("[" * 500 + "]" * 500 + ",") * (N // 500) + "0]",
    "keys of one object": "{" + ",".join(f'"k{n}":0' for n in range(N + 1)) + "}",
    "nested objects": "[" + ('{"a":' * 500 + "0" + "}" * 500 + ",") * (MOST_PARTS // 500) + "0]",
    "empty objects": "[" + "{}," * (MOST_PARTS // 2) + "0]",
    "decoys among values": "[" + f"{DECOY},0," * (N // 2) + "0]",
    "decoys among keys": "{" + ",".join(f'"k{n}":{DECOY}' for n in range(N + 1)) + "}",
    "decoys behind a quotation mark": "[" + r'"\"}{\\",' * N + "0]",
    "decoys in a string without end": "[" + "0," * N + '"' + "}" * N,
    "one decoy before them": '["' + "}" * N + '",' + "0," * N + "0]",
    "more behind real objects": "[" + "{}," * 1000 + "0," * N + "0]",
    "no JSON": "," * (N + 1),
}

QUEUE_ITEM = {"id": 1, "state": "Done", "url": "/v2.0.0/mission_queue/1"}
WHOLE_ITEM = {f"key{number}": "2026-11-23T06:00:00" for number in range(15)} | {"parameters": []}
SCHEDULE = {
    "name": "S",
    "robot": "R",
    "mission": "M",
    "start": "2026-11-25T06:30",
    "timezone": "Europe/Helsinki",
    "enabled": True,
    "recurrence": "FREQ=WEEKLY;BYDAY=MO,TU,WE,TH,FR",
    "minimum_battery_percent": 30,
    "respect_working_days": True,
    "between": None,
    "start_window_minutes": 15,
    "overlap": "skip",
    "priority": 0,
    "parameters": {"text": "a, b"},
}


@pytest.mark.parametrize("text", TOO_MANY.values(), ids=TOO_MANY.keys())
def test_too_many_parts_are_not_parsed(text, monkeypatch):
    monkeypatch.setattr(json, "loads", lambda *_args, **_options: pytest.fail("parsed"))
    with pytest.raises(Unreadable, match="it has too many parts"):
        parse.loads(text.encode())
    with pytest.raises(InvalidInput, match="the file has too many parts"):
        document.read(text.encode())


@pytest.mark.parametrize(
    "value",
    [
        [QUEUE_ITEM] * 100_000,
        [WHOLE_ITEM] * 10_000,
        [{"guid": "g", "name": "n, m", "url": "/v2.0.0/missions/g"}] * 2000,
        {"schedules": [SCHEDULE] * 10_000},
        [0] * (N - 1),
        dict.fromkeys(map(str, range(N - 1)), "}"),
    ],
    ids=["short queue items", "whole queue items", "missions", "schedules", "a list", "an object"],
)
def test_ordinary_json_is_parsed(value):
    content = json.dumps(value).encode()
    assert not has_too_many_parts(content)
    assert parse.loads(content) == value


def test_a_long_text_is_one_part():
    for text in ("A" * (8 << 20), "\\/" * (4 << 20), "}" * (8 << 20)):
        assert not has_too_many_parts(f'{{"map": "{text}"}}'.encode())
