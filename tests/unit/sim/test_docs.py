"""Every command and every program in docs/simulator.md does what the page says."""

from __future__ import annotations

import re
import shlex
import time
from dataclasses import fields
from pathlib import Path

import pytest
import requests

import mir_sim

PAGE = Path(__file__).parents[3] / "docs" / "simulator.md"
TEXT = PAGE.read_text(encoding="utf-8")


def blocks(language: str) -> list[str]:
    return re.findall(rf"```{language}\n(.*?)```", TEXT, re.DOTALL)


def commands() -> list[tuple[str, list[str]]]:
    """Each curl line of the page, with the texts that its answer must contain."""
    found: list[tuple[str, list[str]]] = []
    for line in "".join(blocks("curl")).splitlines():
        if line.startswith("# "):
            found[-1][1].append(line[2:])
        else:
            found.append((line, []))
    return found


def run(command: str, robot: str, fleet: str, login: str) -> str:
    """What curl does with the few options that the page uses."""
    assert not re.search(r"'[^']*\$[^']*'", command), "a shell puts nothing in place of a name within single quotes"
    words = shlex.split(command.replace("$ROBOT", robot).replace("$FLEET", fleet).replace("$LOGIN", login))
    assert words.pop(0) == "curl"
    method, headers, data, auth, url = "", {}, None, None, ""
    while words:
        match words.pop(0):
            case "-X":
                method = words.pop(0)
            case "-u":
                user, _, secret = words.pop(0).partition(":")
                auth = (user, secret)
            case "-H":
                name, _, value = words.pop(0).partition(": ")
                headers[name] = value
            case "-d":
                data = words.pop(0)
            case word:
                assert not url
                url = word
    response = requests.request(
        method or ("GET" if data is None else "POST"), url, headers=headers, data=data, auth=auth, timeout=5
    )
    return response.content.decode("utf-8", "replace")


def test_the_curl_lines_answer_as_the_page_says() -> None:
    login = re.search(r"^LOGIN=(.*)$", TEXT, re.MULTILINE)
    with mir_sim.serve(robots=1, fleet="classic", software="3.5.4") as served:
        addresses = served.robots[0].url, served.above.url, login[1]
        for command, expected in commands():
            answer, ends = run(command, *addresses), time.monotonic() + 5
            while (
                " -d " not in command
                and not all(fragment in answer for fragment in expected)
                and time.monotonic() < ends
            ):
                answer = run(command, *addresses)  # what was cancelled while it ran ends a moment later
            for fragment in expected:
                assert fragment in answer, command
    assert len(commands()) > 15


@pytest.mark.parametrize("program", blocks("python"))
def test_the_programs_run(program: str) -> None:
    exec(compile(program, str(PAGE), "exec"), {})


def test_the_page_names_every_option_and_every_fault() -> None:
    from mir_sim.__main__ import parser
    from mir_sim.faults import FaultKind

    options = {
        option
        for action in parser()._actions
        for option in action.option_strings
        if option.startswith("--") and option != "--help"
    }
    assert all(f"`{option}`" in TEXT for option in options)
    assert all(f"`{kind}`" in TEXT for kind in FaultKind)
    assert all(mission.name in TEXT for mission in mir_sim.MISSIONS)


def test_the_page_names_every_knob_of_fleets() -> None:
    from mir_sim.fleets.knobs import ClassicKnobs, EnterpriseKnobs

    known = (*fields(ClassicKnobs), *fields(EnterpriseKnobs))
    assert [one.name for one in known if f"| `{one.name}` |" not in TEXT] == []
