from collections.abc import Iterator

import pytest
import responses as responses_library

from app.services.mir.address import Address
from app.services.mir.client import RobotClient
from app.services.mir.credentials import Token

TOKEN = Token.derive("distributor", "distributor")


@pytest.fixture
def responses() -> Iterator[responses_library.RequestsMock]:
    """The robot's answers, without sockets."""
    with responses_library.RequestsMock() as mock:
        yield mock


@pytest.fixture
def robot(responses: responses_library.RequestsMock) -> Iterator[RobotClient]:
    client = RobotClient(Address.parse("http://robot.test"), TOKEN)
    yield client
    client.close()
