"""What the tests of the Logs share: the screen on real services at an invented plant, and a reader's hands."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from datetime import timedelta

from kivy.uix.scrollview import ScrollView

from app.container import Container
from app.database.execution_history import ExecutionFilter
from app.domain.execution import State
from app.screens.common.mission_names import NOTHING_KNOWN
from app.screens.logs.cards import RunsList
from app.screens.logs.view import Filters
from app.widgets.list_row import ListRow
from app.widgets.tabs import TabButton
from tests.ui.checks import whole_rows
from tests.ui.driver import Driver
from tests.ui.whole_app import shown

TABS = {"runs": "Runs", "figures": "Key figures", "activity": "Activity"}


@contextmanager
def opened(container: Container, ui: Driver, part: str = "") -> Iterator[object]:
    """The Logs on screen, everything read; ``part`` is the key of a tab."""
    with shown(container, ui, "logs") as app:
        app.logs = app.shell.navigator.screen("logs").vm
        settle(app, ui)
        if part:
            choose_tab(app, ui, part)
        yield app


def reset_logs(app, ui: Driver, part: str = "runs") -> None:
    """What one test has chosen and opened must not be there for the next one that uses the same app."""
    app.shell.dialogs.close_all()
    app.shell.snackbars.clear()
    app.shell.mission_names.known = NOTHING_KNOWN
    app.shell.go("logs")
    app.logs.close_story()
    app.logs.searching, app.logs.query = False, ""
    app.logs.activity.move(0)
    app.logs.choose_part(part)
    app.logs.set_filters(**vars(Filters()))
    settle(app, ui)
    for scrolled in ui.find_all(ScrollView):
        scrolled.scroll_y = 1
    ui.advance(0.1)


def settle(app, ui: Driver) -> None:
    for _reading in range(2):  # figures and stories are read after the runs
        ui.advance(0.4)
        ui.wait(lambda: app.shell.background.idle)
    ui.advance(0.1)


def tap(app, ui: Driver, widget) -> None:
    ui.tap(widget)
    settle(app, ui)


def choose_tab(app, ui: Driver, part: str) -> None:
    tap(app, ui, next(button for button in ui.find_all(TabButton) if button.tab.text == TABS[part]))


def runs_of(app) -> list:
    """The items of the list without the names of days."""
    return [item for item in app.logs.rows if item.opens]


def rows(ui: Driver) -> list[ListRow]:
    """The runs in sight, from the top."""
    return [view for view in whole_rows(ui.find(RunsList)) if view.item.opens]


def failures(container) -> ExecutionFilter:
    """The failures of the last days."""
    return ExecutionFilter(states=(State.FAILED,), start=container.clock.now() - timedelta(days=5))
