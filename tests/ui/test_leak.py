"""Screens and dialogs leave nothing behind: a tablet on the wall runs for months."""
from __future__ import annotations

import pytest

from tests.support import month
from tests.ui.wear import Wear, widgets
from tests.ui.whole_app import shown

WARM = 36                                # rounds: all there is has been built once
ROUNDS = 60


@pytest.mark.long
def test_sixty_rounds_leave_no_widget_and_nothing_that_holds_one(tmp_path, ui):
    container = month.plant(tmp_path)
    with shown(container, ui) as app:
        wear = Wear(app, ui)
        wear.rounds(WARM)
        before, kinds = wear.counts(), widgets()
        wear.rounds(ROUNDS)
        after, more = wear.counts(), widgets() - kinds
    container.close()
    # the dialog that was open last may linger; what leaks grows with every round
    growth = {name: count - before[name] for name, count in after.items() if count - before[name] >= ROUNDS}
    assert growth == {}, f"and of widgets: {dict(more)}"
