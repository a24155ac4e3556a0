"""Robots that only write down what they are sent, and a tablet."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import ExitStack
from pathlib import Path

import pytest

from app.container import Container
from tests.hostile.capture import capture
from tests.hostile.credentials import Listen


@pytest.fixture
def listen() -> Iterator[Listen]:
    with ExitStack() as stack:
        yield lambda *args, **settings: stack.enter_context(capture(*args, **settings))


@pytest.fixture
def tablet(tmp_path: Path) -> Iterator[Container]:
    container = Container.open(tmp_path)
    yield container
    container.close()
