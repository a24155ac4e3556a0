"""Robots that only write down what they are sent, and tablets."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import ExitStack
from pathlib import Path

import pytest

from app.container import Container
from tests.hostile.capture import Capture, capture
from tests.hostile.credentials import Listen
from tests.support.site import Site


@pytest.fixture
def listen() -> Iterator[Listen]:
    with ExitStack() as stack:
        yield lambda *args, **settings: stack.enter_context(capture(*args, **settings))


@pytest.fixture
def machine(listen: Listen) -> Capture:
    return listen()


@pytest.fixture
def thief(listen: Listen) -> Capture:
    return listen()


@pytest.fixture
def container(tmp_path: Path) -> Iterator[Container]:
    container = Container.open(tmp_path)
    yield container
    container.close()


@pytest.fixture
def site(tmp_path: Path) -> Iterator[Site]:
    """One robot, and no mission."""
    site = Site(tmp_path)
    site.add_robots()
    yield site
    site.switch_off()
