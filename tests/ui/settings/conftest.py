"""One tablet with one app for all tests of a file about Settings; each begins with nothing configured."""

from __future__ import annotations

from collections.abc import Iterator, Mapping

import pytest

from app.window.application import SchedulerApp
from tests.ui.driver import Driver
from tests.ui.integrator import restart, tablet
from tests.ui.whole_app import Plant, shown


@pytest.fixture(scope="module")
def ui(shared_ui) -> Driver:
    return shared_ui


@pytest.fixture(scope="module")
def first_settings() -> Mapping[str, object]:
    """What a test begins with, where that is not the default."""
    return {}


@pytest.fixture(scope="module")
def shared_site(tmp_path_factory, first_settings) -> Iterator[Plant]:
    with pytest.MonkeyPatch.context() as patch, tablet(tmp_path_factory.mktemp("tablet"), patch) as site:
        site.container.catalogue.change_settings(**first_settings)
        site.first_settings = site.container.settings()
        yield site


@pytest.fixture(scope="module")
def shared_app(shared_site, ui) -> Iterator[SchedulerApp]:
    with shown(shared_site.container, ui, "settings") as running:
        yield running


@pytest.fixture
def first_screen() -> str:
    """What a test begins on."""
    return "settings"


@pytest.fixture(name="app")
def restarted_app(shared_site, shared_app, ui, first_screen) -> SchedulerApp:
    restart(shared_site, shared_app, ui, first_screen)
    return shared_app


@pytest.fixture
def site(shared_site, app) -> Plant:
    return shared_site
