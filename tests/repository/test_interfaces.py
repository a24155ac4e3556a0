"""docs/interfaces.md says what the code does: options, keys, defaults, columns, states, codes, simulator commands."""

from __future__ import annotations

import dataclasses
import json
import re
from pathlib import Path

import pytest

import main
from app.domain.execution import STATE_OF_REASON, ReasonCode, State, Trigger
from app.domain.models import DayException, Fleet, Group, Mission, Place, Robot, Schedule, Settings
from app.services.catalogue import fields
from app.services.catalogue.checks import Number
from app.services.catalogue.configuration import document
from app.services.catalogue.fields import Field, Fields
from app.services.files.history_export import COLUMNS
from mir_sim.control import COMMANDS
from mir_sim.faults import FaultKind

PAGE = (Path(__file__).parents[2] / "docs" / "interfaces.md").read_text(encoding="utf-8")


def section(title: str) -> str:
    return PAGE.split(f"\n## {title}\n")[1].split("\n## ")[0]


def rows(text: str) -> list[list[str]]:
    """The cells of a section's tables, without their headers."""
    body = re.sub(r"^\|.*\|\n\|[-|]+\|\n", "", text, flags=re.MULTILINE)
    return [[cell.strip() for cell in line.strip("|").split("|")] for line in body.splitlines() if line.startswith("|")]


def code_in(text: str) -> list[str]:
    return re.findall(r"`([^`]+)`", text)


def keys() -> dict[str, list[str]]:
    return {cells[0].strip("`"): cells[1:] for cells in rows(section("Configuration file"))}


def test_every_option_of_the_command_line_is_there_and_no_other() -> None:
    said = set(re.findall(r"main\.py[^`]*?(--[a-z-]+)", section("Commands"))) | {"--parameter", "--data-dir"}
    options = {
        option for action in main.parser()._actions for option in action.option_strings if option.startswith("--")
    }
    assert said == options


TABLES: dict[str, tuple[type, Fields]] = {
    "settings": (Settings, fields.SETTINGS),
    "display": (Settings, fields.DISPLAY),
    "calendar": (Settings, fields.CALENDAR),
    "calendar.days[]": (DayException, fields.DAY),
    "fleets[]": (Fleet, fields.FLEET),
    "robots[]": (Robot, fields.ROBOT),
    "groups[]": (Group, fields.GROUP),
    "places[]": (Place, fields.PLACE),
    "missions[]": (Mission, fields.MISSION),
    "schedules[]": (Schedule, fields.SCHEDULE),
}
CASES = [(f"{place}.{field.key}", kind, field) for place, (kind, table) in TABLES.items() for field in table]
WITHOUT_PLAIN_DEFAULT = {  # they depend on something else, or are written in another way
    "settings.working_days": "MO–FR",
    "settings.timezone": "the tablet's",
    "calendar.country": "null",
    "calendar.region": "null",
    "calendar.days": "[]",
    "calendar.days[].last_day": "`first_day`",
    "calendar.days[].source": "null",
    "fleets[].username": "empty",
    "fleets[].password": "",
    "robots[].username": "empty",
    "robots[].password": "",
    "robots[].vehicle": "empty",
    "groups[].robots": "",
    "missions[].places": "[]",
    "schedules[].name": '"<mission> on <robot>"',
    "schedules[].robot": "",
    "schedules[].group": "",
    "schedules[].timezone": "`settings.timezone`",
    "schedules[].parameters": "{}",
}
ALTERNATIVES = {
    "robots[].address": "new, or `fleet`",
    "schedules[].robot": "new, or `group`",
    "schedules[].group": "new, or `robot`",
}


def test_the_keys_of_the_configuration_file() -> None:
    assert set(keys()) == {key for key, _kind, _field in CASES}


@pytest.mark.parametrize(("key", "kind", "field"), CASES, ids=[key for key, _kind, _field in CASES])
def test_what_is_required_of_a_file_its_defaults_and_ranges(key: str, kind: type, field: Field) -> None:
    required, default, values = keys()[key]
    assert required == ALTERNATIVES.get(key, field.required)
    if key in WITHOUT_PLAIN_DEFAULT:
        assert default == WITHOUT_PLAIN_DEFAULT[key]
    else:
        stored = {each.name: each.default for each in dataclasses.fields(kind)}[field.attribute]
        is_word = isinstance(stored, str) and not key.startswith(("settings.", "display."))
        shown = "" if stored is dataclasses.MISSING else json.dumps(stored)
        assert default == (shown if is_word else shown.strip('"'))
    if isinstance(field.check, Number):
        assert re.search(rf"\b{field.check.low}–{field.check.high}\b", values) or field.key in ("keep_free", "priority")


def test_the_example_is_a_configuration() -> None:
    example = re.search(r"```json\n(.*?)```", PAGE, re.DOTALL)
    lists = document.read(example[1].encode()).lists
    assert [len(lists[name]) for name in ("robots", "groups", "places", "missions", "schedules")] == [1, 1, 1, 2, 2]
    assert set(json.loads(example[1])["settings"]) == {field.key for field in fields.SETTINGS}
    assert set(json.loads(example[1])["display"]) == {field.key for field in fields.DISPLAY}
    assert set(json.loads(example[1])["calendar"]) == {field.key for field in fields.CALENDAR}


def test_the_columns_states_and_triggers_of_the_history() -> None:
    text = section("Execution history")
    assert ",".join(COLUMNS) in code_in(text)
    assert code_in(re.search(r"- `trigger`: (.*)", text)[1]) == list(Trigger)  # type: ignore[index]
    assert code_in(re.search(r"- `state`: (.*)", text)[1]) == list(State)  # type: ignore[index]


def test_the_reason_codes_and_the_states_they_end_in() -> None:
    said = {ReasonCode(code.strip("`")): State(state) for state, code, _cause in rows(section("Reason codes"))}
    assert said == STATE_OF_REASON


def test_the_commands_and_faults_of_the_simulator() -> None:
    text = section("Simulator control")
    assert set(re.findall(r'^\| `\{"(\w+)"', text, re.MULTILINE)) == set(COMMANDS)
    assert [cells[0].strip("`") for cells in rows(text)[len(COMMANDS) :]] == list(FaultKind)
