from collections.abc import Iterator, Mapping
from typing import Any

import pytest
import requests
import responses as responses_library

from app.mir.address import Address
from app.mir.client import RobotClient
from app.mir.credentials import Token
from app.mir.transport import API, Response, Timeouts

TOKEN = Token.derive("distributor", "distributor")
ROBOT = "http://robot.test"


class MockedTransport:
    """Carries requests to the ``responses`` library, which answers them; what really goes over a socket is tested in test_sockets.py."""

    def send(self, method: str, path: str, *, query: Mapping[str, str] | None = None, json: Any = None, timeout: Timeouts) -> Response:
        body = {} if json is None else {"json": json}
        answer = requests.request(method, f"{ROBOT}{API}{path}", params=query, allow_redirects=False, timeout=timeout.total, **body)
        return Response(answer.status_code, answer.content, dict(answer.headers))

    def close(self) -> None:
        pass


@pytest.fixture
def responses() -> Iterator[responses_library.RequestsMock]:
    """The robot's answers, without sockets."""
    with responses_library.RequestsMock() as mock:
        yield mock


@pytest.fixture
def robot(responses: responses_library.RequestsMock) -> Iterator[RobotClient]:
    client = RobotClient(Address.parse(ROBOT), TOKEN, transport=MockedTransport())
    yield client
    client.close()
