"""Stages for tests that are no stories."""

from __future__ import annotations

from collections.abc import Iterator

import pytest

from tests.services.stage import Stage


@pytest.fixture
def s(tmp_path) -> Iterator[Stage]:
    """One robot."""
    s = Stage(tmp_path, "robot", 1)
    yield s
    s.switch_off()


@pytest.fixture
def group(tmp_path) -> Iterator[Stage]:
    """Three robots of one group."""
    group = Stage(tmp_path, "group", 3)
    yield group
    group.switch_off()
