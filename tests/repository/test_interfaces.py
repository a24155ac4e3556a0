"""docs/interfaces.md says what the code does: options, keys, defaults, columns, states, codes, simulator commands."""

from __future__ import annotations

import json
import re
from pathlib import Path

import pytest

import main
from app.domain.models import STATE_OF_REASON, ReasonCode, Settings, State, Trigger
from app.services.catalogue.configuration import document
from app.services.catalogue.validation import WHOLE_NUMBERS
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


def test_the_keys_of_the_configuration_file() -> None:
    known = (
        {f"settings.{key}" for key in document.SETTINGS}
        | {f"display.{key}" for key in document.DISPLAY}
        | {f"calendar.{key}" for key in document.CALENDAR}
        | {f"calendar.days[].{key}" for key in document.DAY}
        | {f"robots[].{key}" for key in document.ROBOT}
        | {f"groups[].{key}" for key in document.GROUP}
        | {f"places[].{key}" for key in document.PLACE}
        | {f"missions[].{key}" for key in document.MISSION}
        | {f"schedules[].{key}" for key in document.SCHEDULE}
    )
    assert set(keys()) == known
    always = {f"{name}[].{key}" for name, identity in document.IDENTITY.items() for key in identity}
    assert {key for key, cells in keys().items() if cells[0] == "yes"} == always
    assert {key for key, cells in keys().items() if cells[0] == "new"} == {
        f"{name}[].{key}" for name, required in document.REQUIRED.items() for key in required
    } - always


def test_the_example_is_a_configuration() -> None:
    example = re.search(r"```json\n(.*?)```", PAGE, re.DOTALL)
    assert example is not None
    read = document.read(example[1].encode())
    assert (len(read.robots), len(read.groups), len(read.places), len(read.missions), len(read.schedules)) == (
        1,
        1,
        1,
        2,
        2,
    )
    assert set(json.loads(example[1])["settings"]) == set(document.SETTINGS)
    assert set(json.loads(example[1])["display"]) == set(document.DISPLAY)
    assert set(json.loads(example[1])["calendar"]) == set(document.CALENDAR)


@pytest.mark.parametrize("name", sorted(document.DISPLAY))
def test_the_defaults_of_the_display(name: str) -> None:
    assert keys()[f"display.{name}"][1] == str(getattr(Settings(), name)).lower()


@pytest.mark.parametrize("name", sorted(document.SETTINGS))
def test_the_defaults_of_the_settings(name: str) -> None:
    default = getattr(Settings(), name)
    words = {"working_days": "MO–FR", "timezone": "the tablet's"}
    assert keys()[f"settings.{name}"][1] == words.get(name, "null" if default is None else str(default))


@pytest.mark.parametrize(
    "name", sorted(name for name in document.SETTINGS if name in WHOLE_NUMBERS and name != "history_limit")
)
def test_the_ranges_of_the_settings(name: str) -> None:
    low, high = WHOLE_NUMBERS[name]
    assert keys()[f"settings.{name}"][2].startswith(f"{low}–{high}")


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
