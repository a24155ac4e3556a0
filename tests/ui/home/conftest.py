"""Home at two robots at rest."""

from __future__ import annotations

import pytest

from app.screens.home.cards import FinishedRow, RobotHead
from app.widgets.frame import AlarmBanner, TopBar
from app.widgets.rows import RobotChip
from tests.support.stored import Stored
from tests.ui.home.operator import rows
from tests.ui.whole_app import plant, restart, shown


@pytest.fixture(scope="module")
def ui(shared_ui):
    return shared_ui


@pytest.fixture(scope="module")
def app(tmp_path_factory, ui):
    """Two robots and three missions, after both robots have answered."""
    with plant(tmp_path_factory.mktemp("plant"), robots=2) as site:
        site.add_robots()
        site.add_missions("Deliver", "Home", "Collect empties")
        with shown(site.container, ui) as app:
            app.site, app.aino, began = site, site.fleet.robots[0], site.container.clock.now()
            ui.wait(
                lambda: site.is_at_rest(began) and any("Ready" in ui.texts(head) for head in ui.find_all(RobotHead))
            )
            app.stored, app.root_vm = Stored(site.container), app.shell.navigator.screen("home").vm
            yield app


@pytest.fixture
def home(app, ui):
    """At robots at rest, with no run, alarm or hold behind it."""

    def put_back() -> None:
        app.site.calm_down(ui)
        app.stored.put_back()
        app.site.container.parameters._answers.clear()  # what an earlier test learned from the robots

    restart(app, ui, put_back)
    app.root_vm.choose_mission(None)
    ui.wait(
        lambda: (
            "Ready" in ui.texts(ui.find(RobotHead)) and ui.find(TopBar).robot == "Aino" and not ui.find_all(AlarmBanner)
        )
    )
    assert (len(ui.find_all(RobotChip)), rows(ui), ui.find_all(FinishedRow), app.root_vm.busy) == (2, [], [], [])
    return app
