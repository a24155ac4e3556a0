"""One app for all tests of a file about the Logs."""

from __future__ import annotations

import pytest

from tests.support.stored import Stored
from tests.ui.logbook import opened


@pytest.fixture(scope="module")
def ui(shared_ui):
    return shared_ui


@pytest.fixture(scope="module")
def container(shared_container):
    return shared_container


@pytest.fixture(scope="module")
def logs(container, ui):
    with opened(container, ui) as app:
        yield app


@pytest.fixture
def put_back(container):
    """What the test adds to the history is taken out of it again."""
    before = Stored(container)
    yield
    before.put_back()
