"""A robot, or a proxy before it, that sends our credentials back: they get into no alarm, log, export or database."""

from __future__ import annotations

import base64
import io
import json
import logging
import sqlite3
from collections.abc import Callable
from dataclasses import astuple
from typing import Any

import pytest

from app.container import Container
from app.domain.execution import State
from app.domain.models import Mission, Robot
from app.mir.client import RobotClient
from app.mir.credentials import Token
from app.mir.errors import RobotError
from app.mir.texts import clean, resolve
from app.services.files.history_export import write_history
from tests.hostile.capture import Seen, capture
from tests.hostile.credentials import look
from tests.unit.mir.answers import MISSION, STATUS, answered

USER, PASSWORD = "distributor", "a secret"
HEADER = Token.derive(USER, PASSWORD).header
PAIR = base64.b64decode(HEADER.removeprefix("Basic ")).decode()
SECRETS = (HEADER.removeprefix("Basic "), PAIR.partition(":")[2])
WRITTEN: dict[str, Callable[[str], str]] = {
    "as it is": lambda text: text,
    "within a sentence": lambda text: f"The proxy saw '{text}', and more after it.",
    "with signs that are not shown": "\u200b".join,
    "after signs that are not shown": lambda text: "\x7f" * (80_000 - len(text) + 20) + text,
    "on several lines": lambda text: f"first\r\n{text}\r\nlast",
    "after a long text": lambda text: "many words " * 45 + text,
}
TEMPLATES: dict[str, Callable[[str], str]] = {
    "in two parts": lambda text: json.dumps({"message": "%(a)s%(b)s", "args": {"a": text[:30], "b": text[30:]}}),
    "after signs that are not shown": lambda text: json.dumps({"message": "\x7f" * (2000 - len(text) + 30) + text}),
}
however = pytest.mark.parametrize("written", WRITTEN.values(), ids=WRITTEN.keys())


def assert_hidden(text: str) -> None:
    """No part of a secret that would help in guessing the rest."""
    for secret in SECRETS:
        assert not [
            start for start in range(0, len(secret) - 16) if secret[start : start + 16] in text.replace("\u200b", "")
        ], text


@however
@pytest.mark.parametrize("secret", [HEADER, PAIR, PAIR.upper()], ids=["header", "pair", "in capitals"])
@pytest.mark.parametrize("limit", [40, 80, 255, 300, 500])
def test_no_text_has_it_whatever_its_limit(written: Any, secret: str, limit: int) -> None:
    for text in (clean(written(secret), limit), resolve(written(secret), limit)):
        assert len(text) <= limit
        assert_hidden(text.lower() if secret.isupper() else text)


@pytest.mark.parametrize("written", TEMPLATES.values(), ids=TEMPLATES.keys())
@pytest.mark.parametrize("limit", [40, 80, 255, 300, 500])
def test_nor_has_a_template_that_is_filled_in(written: Any, limit: int) -> None:
    for secret in (HEADER, PAIR):
        assert_hidden(resolve(written(secret), limit))


def test_the_rest_of_a_text_stays() -> None:
    assert (
        clean(f"no such user {PAIR}, ask 3d7c7c40-ce85-11ef-904a-000e8e9884eb")
        == "no such user distributor:***, ask 3d7c7c40-ce85-11ef-904a-000e8e9884eb"
    )
    assert clean(f"got Authorization: {HEADER}!") == "got Authorization: Basic ***!"


def client(status: int, body: bytes, headers: dict[str, str]) -> RobotClient:
    return answered(status, body, headers, Token.from_header(HEADER))


@however
@pytest.mark.parametrize("status", [302, 400, 500, 503])
@pytest.mark.parametrize("secret", [HEADER, PAIR], ids=["header", "pair"])
def test_an_error_does_not_have_it_either(written: Any, status: int, secret: str) -> None:
    body = json.dumps({"error_code": secret, "error_human": written(secret)}).encode()
    with pytest.raises(RobotError) as error:
        client(status, body, {"Location": "x" * 20 + written(secret)}).missions()
    assert_hidden(f"{error.value!r}{error.value}{vars(error.value)}")


@pytest.mark.parametrize(
    "escape",
    [lambda text: text, lambda text: "".join(f"\\u{ord(sign):04x}" for sign in text)],
    ids=["plain", "escaped"],
)
def test_a_status_does_not_have_it(escape: Callable[[str], str]) -> None:
    echo = {
        "robot_name": "T",
        "mission_text": "T",
        "state_text": "T",
        "errors": [{"code": 1, "description": "T", "module": "T"}],
        "user_prompt": {"guid": "1", "question": "T", "options": ["T"], "user_group": "T"},
    }
    body = json.dumps({**STATUS, **echo}).replace('"T"', f'"{escape(HEADER)}"').encode()
    status = client(200, body, {"Robot-Version": HEADER}).status()
    assert "Basic ***" in status.mission_text
    assert_hidden(str(astuple(status)))


def test_a_run_leaves_it_nowhere(container: Container, caplog: pytest.LogCaptureFixture) -> None:
    caplog.set_level(logging.DEBUG)
    with capture() as machine:
        robot = container.catalogue.save_robot(Robot("Aino", machine.url, USER), PASSWORD)
        mission = container.catalogue.save_mission(Mission("Deliver", MISSION))
        answer = machine.answer

        def echo(one: Seen) -> tuple[int, Any]:
            match one.method, one.path:
                case "GET", "/mission_queue/7":
                    return 200, {
                        "id": 7,
                        "state": "Aborted",
                        "mission_id": MISSION,
                        "description": "",
                        "message": one.authorization,
                    }
                case _, "/status":
                    return 200, {
                        **STATUS,
                        "serial_number": "A-1",
                        "state_id": 12,
                        "errors": [{"code": 1, "description": f"no {HEADER}"}],
                    }
                case "GET", "/missions":
                    return 400, {"error_code": "x", "error_human": f"no such user {PAIR}"}
            return answer(one)

        machine.answer = echo  # type: ignore[method-assign]
        worker = container.make_worker(robot)
        look(worker)
        run = container.operator.run_now(robot.id, mission.id)
        for _ in range(3):
            look(worker)
        with pytest.raises(RobotError) as error:
            container.operator.fetch_missions(robot.id)
        worker.close()
        ended = container.ledger.get(run.id)
        exported = io.StringIO()
        write_history(container.db.read(), exported)
        written = [
            line
            for line in sqlite3.connect(container.db.path).iterdump()
            if not line.startswith('INSERT INTO "robots"')
        ]
        shown = f"{ended.reason}{container.alarms.open()}{error.value}{exported.getvalue()}{caplog.text}{written}"
    assert ended.state is State.FAILED
    assert "robot_error" in shown
    assert "Basic ***" in shown
    assert_hidden(shown)
