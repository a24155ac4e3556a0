"""One app for all tests of a file about the Logs."""
from __future__ import annotations

import pytest

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
