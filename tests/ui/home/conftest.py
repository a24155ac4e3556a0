"""Home at two robots at rest."""

from __future__ import annotations

import pytest

from app.widgets.frame import Banner
from tests.support.stored import Stored
from tests.ui.home.operator import items, rows
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
            ui.wait(lambda: site.is_at_rest(began) and "Ready" in ui.texts())
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
    app.shell.sheets.give_up()
    ui.wait(
        lambda: (
            (app.root_vm.view.card.name, app.root_vm.view.card.state) == ("Aino", "Ready")
            and not ui.find_all(Banner)
            and not rows(ui)
            and not app.root_vm.foot_rests
        )
    )
    assert (items(ui, "run"), app.root_vm.busy) == ([], [])
    return app
