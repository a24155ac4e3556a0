from collections.abc import Iterator

import pytest
import responses as responses_library

from app.mir.address import Address
from app.mir.client import RobotClient
from app.mir.credentials import Token

TOKEN = Token.derive("distributor", "distributor")
ROBOT = "http://robot.test"


@pytest.fixture
def responses() -> Iterator[responses_library.RequestsMock]:
    """The robot's answers, in the place of sockets; those are in tests/integration/mir."""
    with responses_library.RequestsMock() as mock:
        yield mock


@pytest.fixture
def robot(responses: responses_library.RequestsMock) -> Iterator[RobotClient]:
    client = RobotClient(Address.parse(ROBOT), TOKEN)
    yield client
    client.close()
