"""A random finger finds nothing that raises, and no error in the log. 20,000 acts and memory: ``python -m tests.ui.monkey``."""

from __future__ import annotations

import pytest

from tests.ui import monkey


@pytest.mark.long
@pytest.mark.parametrize("seed", [1, 2])
def test_a_random_finger_raises_nothing(tmp_path, ui, seed):
    errors, _growth = monkey.play(tmp_path, ui, acts=400, seed=seed)
    assert errors == []
