"""The window of the UI tests. Importing this file installs it, and only here: tests elsewhere never see kivy."""
from __future__ import annotations

from collections.abc import Iterator
from functools import cache

from tests.ui import headless

headless.install()

import pytest  # noqa: E402
from kivy.app import App  # noqa: E402
from kivy.base import EventLoop  # noqa: E402
from kivy.core.window import Window  # noqa: E402
from kivymd.app import MDApp  # noqa: E402
from materialyoucolor.hct.hct_solver import HctSolver  # noqa: E402

import app.widgets  # noqa: E402
from app import compat  # noqa: E402
from app.i18n import SOURCE_LANGUAGE, translator  # noqa: E402
from app.widgets.tokens import apply_theme  # noqa: E402
from tests.ui.driver import Driver  # noqa: E402

# KivyMD computes some thousand colours whenever an app starts, the same ones each time: half the time of a test.
HctSolver.solve_to_int = staticmethod(cache(HctSolver.solve_to_int))


class Stage(MDApp):
    """An app with nothing in it, for tests of widgets and single screens."""


@pytest.fixture(scope="session")
def stage() -> MDApp:
    compat.apply()
    app.widgets.load()
    Driver()                                 # virtual time from the first frame on
    return Stage()


@pytest.fixture
def ui(stage) -> Iterator[Driver]:
    """An empty window in the light theme, in English; whatever a test leaves behind is cleared away."""
    App._running_app = stage
    EventLoop.status = "started"
    apply_theme(stage.theme_cls, "light", gloves=False)
    translator.use(SOURCE_LANGUAGE)
    driver = Driver(stage)
    yield driver
    clear_window()
    App._running_app = None
    EventLoop.status = "idle"


def clear_window() -> None:
    for child in list(Window.children):
        close = getattr(child, "dismiss", None)
        if close is not None:
            close(force=True, animation=False)
        Window.remove_widget(child)
    Window.release_all_keyboards()
