"""The window of the UI tests. Importing this file installs it, and nothing else does: other tests never import kivy."""

from __future__ import annotations

import gc
import time
from collections import Counter
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from tests.ui import headless

headless.install()

import pytest  # noqa: E402
from kivy.app import App  # noqa: E402
from kivy.base import EventLoop  # noqa: E402
from kivy.core.window import Window  # noqa: E402
from kivy.uix.widget import Widget  # noqa: E402
from kivymd.app import MDApp  # noqa: E402
from kivymd.uix.dialog import MDDialog  # noqa: E402

import app.widgets  # noqa: E402
from app.container import Container  # noqa: E402
from app.i18n import SOURCE_LANGUAGE, translator  # noqa: E402
from app.services.robots.missions import RobotMissions  # noqa: E402
from app.widgets.dock import dock  # noqa: E402
from app.widgets.tokens import apply_theme  # noqa: E402
from app.window.application import SchedulerApp  # noqa: E402
from app.window.key_focus import KeyFocus  # noqa: E402
from tests.support import month  # noqa: E402
from tests.ui.driver import Driver  # noqa: E402
from tests.ui.integrator import tablet  # noqa: E402
from tests.ui.whole_app import Plant, shown  # noqa: E402

PENDING = 200.0  # s of virtual time, longer than any animation and than kivy's caches keep what they drew
LET_GO_WITHIN = 20.0  # s, in which threads of the test before end
SCREENS = {"container", "shared_container", "site", "shared_site", "app", "shared_app", "small", "usual", "rig"}
LOOKS = {"size", "scale", "language", "theme", "gloves"}
_shown_before: list[str] = []  # the last test that had the window


@pytest.hookimpl(tryfirst=True)
def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """What the default run leaves to the night: all but the first test of a file that shows whole screens, in a window of some size or with
    services behind them, as each takes up to a second, a third of it to clear the screens away."""
    ours = [item for item in items if item.nodeid.startswith("tests/ui/") and isinstance(item, pytest.Function)]
    shown: set[Path] = set()
    for item in ours:
        parameters = item.callspec.params if hasattr(item, "callspec") else {}
        if item.get_closest_marker("long") or (SCREENS.isdisjoint(item.fixturenames) and LOOKS.isdisjoint(parameters)):
            continue
        if item.path in shown:
            item.add_marker(pytest.mark.long)
        shown.add(item.path)


def living_widgets() -> Counter[str]:
    """After a collection of garbage, by class."""
    gc.collect()
    return Counter(type(thing).__name__ for thing in gc.get_objects() if issubclass(type(thing), Widget))


class Stage(MDApp):
    """An app with nothing in it, for tests of widgets and single screens."""


@pytest.fixture(scope="session")
def stage() -> MDApp:
    app.widgets.load()
    Driver()  # virtual time from the first frame on
    gc.freeze()
    return Stage()


@pytest.fixture(scope="module", autouse=True)
def kept_to_the_end() -> None:
    """Before a module's objects are made: objects of modules and caches need not be searched for widgets after each
    test."""
    if not living_widgets():
        gc.freeze()


@pytest.fixture
def ui(stage, calm, request) -> Iterator[Driver]:
    """An empty window in the light theme, in English; anything that a test leaves behind is removed."""
    with _window(stage, request.node.nodeid, request.session) as driver:
        yield driver


@pytest.fixture
def keys(ui) -> Iterator[KeyFocus]:
    """By keyboard: the ring, and what has it."""
    keys = KeyFocus()
    keys.start()
    yield keys
    keys.stop()


@pytest.fixture(scope="module")
def shared_ui(stage, calm, request) -> Iterator[Driver]:
    """The same for all tests of a module; none of them may use ``ui``."""
    with _window(stage, request.node.nodeid, request.session) as driver:
        yield driver


@contextmanager
def _window(stage: MDApp, user: str, session: pytest.Session) -> Iterator[Driver]:
    _nothing_left(stage, user, session)
    App._running_app = stage
    EventLoop.status = "started"
    apply_theme(stage.theme_cls, "light", gloves=False)
    translator.use(SOURCE_LANGUAGE)
    driver = Driver(stage)
    yield driver
    clear_window()
    Window.property("focus").dispatch(Window)  # as when another window comes to the front: no key is held
    for _event in range(3):  # what was to happen, the animation that this began, and the caches
        driver.skip(PENDING)
    dock.free_left = dock.free_right = dock.floor = 0
    dock.question, dock.has_sheet = None, False
    App._running_app = None
    EventLoop.status = "idle"


def _nothing_left(stage: MDApp, user: str, session: pytest.Session) -> None:
    """No widget of the previous test may be alive: a leak in a test is one in the app. After a failure the traceback
    may keep some."""
    ends = time.monotonic() + LET_GO_WITHIN
    while (alive := living_widgets()) and not session.testsfailed and time.monotonic() < ends:
        Driver(stage).advance()  # a thread that ends hands its result to the next frame
        time.sleep(0.01)
    assert not alive or session.testsfailed, f"{_shown_before} left alive: {dict(alive)}"
    _shown_before[:] = [user]


@pytest.fixture(scope="package")
def calm() -> Iterator[None]:
    """Python does not look for garbage by itself: whenever it likes, that takes a third of the time of these tests."""
    gc.disable()
    yield
    gc.enable()


@pytest.fixture
def container(tmp_path) -> Iterator[Container]:
    """Services at an invented plant with a month behind it, on Friday 20 Nov 2026, 14:38; nothing runs there."""
    container = month.plant(tmp_path / "data")
    yield container
    container.close()


@pytest.fixture(scope="module")
def shared_container(tmp_path_factory) -> Iterator[Container]:
    """One for all tests of a module, which leave it unchanged."""
    container = month.plant(tmp_path_factory.mktemp("data"))
    yield container
    container.close()


@pytest.fixture
def site(tmp_path, monkeypatch) -> Iterator[Plant]:
    """A tablet with an empty database, and two robots that answer."""
    with tablet(tmp_path, monkeypatch) as site:
        yield site


@pytest.fixture
def first_screen() -> str:
    """What ``app`` opens."""
    return "home"


@pytest.fixture(name="app")
def app_of_site(site, ui, first_screen) -> Iterator[SchedulerApp]:
    """The app on ``site``."""
    with shown(site.container, ui, first_screen) as running:
        yield running


@pytest.fixture(scope="module")
def walk(stage):
    """All pictures, to be built one after the other."""
    from tests.ui.walk import Walk  # imports every page

    walk = Walk()
    yield walk
    walk.close()


@pytest.fixture(scope="module")
def silent_robots() -> Iterator[None]:
    """No robots have these addresses, and none is asked for its missions."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(RobotMissions, "learn_names", lambda _self, _robot_id: False)
        patch.setattr(RobotMissions, "parameters", lambda _self, _robot_id, _guid: ())
        yield


def clear_window() -> None:
    for child in list(Window.children):
        if isinstance(child, MDDialog):
            child.dismiss()  # releases the window's keys
        Window.remove_widget(child)
    Window.release_all_keyboards()
