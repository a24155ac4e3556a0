"""The command ``python -m mir_sim``."""

from __future__ import annotations

import signal
import subprocess
import sys
from collections.abc import Iterator
from contextlib import contextmanager

import pytest
import requests

from mir_sim import DEVIANTS
from mir_sim.__main__ import main
from tests.unit.sim.asking import HEADERS

BOUND = 60.0


@contextmanager
def started(*arguments: str, robots: int = 1) -> Iterator[tuple[subprocess.Popen[str], list[list[str]]]]:
    """The process until the block ends, and the words of its first lines."""
    with subprocess.Popen(
        [sys.executable, "-m", "mir_sim", "--robots", str(robots), *arguments],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
    ) as process:
        try:
            yield process, [process.stdout.readline().split() for _ in range(robots)]
        finally:
            process.kill()


@pytest.mark.parametrize("ending", [signal.SIGINT, signal.SIGTERM])
def test_it_says_when_each_robot_is_ready_and_stops_cleanly(ending: signal.Signals) -> None:
    options = ("--port", "0", "--time-scale", "50", "--seed", "7", "--software", "2.14.7", "--history", "5")
    with started(*options, robots=2) as (process, lines):
        assert [(word, name) for word, name, _ in lines] == [("ready", "Aino"), ("ready", "Veikko")]
        for _, name, url in lines:
            response = requests.get(f"{url}/api/v2.0.0/status", timeout=5)
            assert (response.json()["robot_name"], response.headers["Robot-Version"]) == (name, "2.14.7")
            assert len(requests.get(f"{url}/sim", timeout=5).json()["queue"]) == 5
        held = requests.post(f"{lines[0][2]}/sim", json={"fault": {"kind": "hang"}}, timeout=5)
        assert held.status_code == 200
        with pytest.raises(requests.ReadTimeout):
            requests.get(f"{lines[0][2]}/api/v2.0.0/status", timeout=0.2)
        process.send_signal(ending)
        _, stderr = process.communicate(timeout=BOUND)
    assert (process.returncode, stderr) == (0, "")


def first_robot(*arguments: str) -> tuple[str, str]:
    """The serial number of a new process's only robot, and what the process said on stderr."""
    with started("--port", "0", *arguments) as (process, [[_ready, _name, url]]):
        number = requests.get(f"{url}/api/v2.0.0/status", timeout=5).json()["serial_number"]
        process.terminate()
        return number, process.communicate(timeout=BOUND)[1]


@pytest.mark.long
def test_without_a_seed_robots_are_random_and_the_seed_is_printed() -> None:
    (first, says), (second, _) = first_robot(), first_robot()
    assert first != second
    seed = says.split("--seed ")[1].split()[0]
    assert first_robot("--seed", seed) == (first, "")


def test_ports_follow_each_other() -> None:
    for first in range(47_310, 47_400, 3):
        with started("--port", str(first), robots=3) as (_process, lines):
            if lines[0]:  # else another process has one of these ports
                break
    assert [line[2] for line in lines] == [f"http://127.0.0.1:{first + number}" for number in range(3)]


@pytest.mark.parametrize(
    ("arguments", "says"),
    [
        (["--time-scale", "0"], "--time-scale"),
        (["--time-scale", "1001"], "--time-scale"),
        (["--time-scale", "nan"], "--time-scale"),
        (["--robots", "0"], "--robots"),
        (["--robots", "many"], "--robots"),
        (["--port", "65536"], "--port"),
        (["--port", "65535", "--robots", "3"], "65535"),
        (["--software", "9.9"], "--software"),
        (["--chaos", "2"], "--chaos"),
        (["--timezone", "Mars/Crater"], "Mars/Crater"),
        (["--speed", "1"], "--speed"),
        (["--history", "-1"], "--history"),
        (["--seed", "x"], "--seed"),
        (["--deviant", "odd"], "no-search"),
        (["--certificate", "no-such-file"], "no-such-file"),
        (["--profile", "no-such-file"], "no-such-file"),
        (["--deviant", "fleet", "--profile", "x"], "--profile"),
    ],
)
def test_wrong_options_are_one_line_and_exit_2(
    arguments: list[str], says: str, capsys: pytest.CaptureFixture[str]
) -> None:
    with pytest.raises(SystemExit) as ended:
        main(arguments)
    said = capsys.readouterr()
    assert (ended.value.code, said.out) == (2, "")
    assert said.err.count("\n") == 1
    assert says in said.err


def test_a_process_that_cannot_start_says_so_in_one_line_and_ends() -> None:
    program = [sys.executable, "-m", "mir_sim", "--host", "no-such-host.invalid"]
    done = subprocess.run(program, capture_output=True, text=True, timeout=BOUND, check=False)
    assert (done.returncode, done.stdout) == (2, "")
    assert done.stderr.count("\n") == 1
    assert "no-such-host" in done.stderr


@pytest.mark.parametrize("how", ["--deviant", "--profile"])
def test_robots_differ_as_a_profile_says_and_the_options_win(how: str) -> None:
    which = "other-zone" if how == "--deviant" else str(DEVIANTS["other-zone"])
    with started("--port", "0", "--software", "3.8.1", how, which) as (_process, [[_ready, _name, url]]):
        response = requests.get(f"{url}/api/v2.0.0/platform/timezone", headers=HEADERS, timeout=5)
    assert (response.json(), response.headers["Robot-Version"]) == ({"value": "Asia/Tokyo"}, "3.8.1")
