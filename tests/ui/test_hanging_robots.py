"""Robots that answer only their status and hang otherwise: commands to another robot do not wait for them."""

from __future__ import annotations

import pytest

from app.widgets.buttons import CommandButton
from app.widgets.frame import NavItem
from app.widgets.rest import DOUBLE_TAP
from tests.ui.integrator import titles
from tests.ui.whole_app import plant, shown

HANGING, LONGEST = 8, 4.0  # s; each of them is given up after 5 s


@pytest.fixture
def site(tmp_path):
    with plant(tmp_path, robots=1 + HANGING) as site:
        site.add_robots()
        yield site


def test_pausing_is_as_fast_after_a_visit_to_settings(site, ui):
    """Settings asks each robot for its missions; before, eight that hung kept the window from everything else for 10 s."""
    snapshots, robots = site.container.snapshots, site.container.catalogue.robots()
    with shown(site.container, ui) as app:
        ui.wait(lambda: "Ready" in ui.texts() and all(snapshots.get(robot.id).status for robot in robots))
        for robot in site.fleet.robots[1:]:
            robot.control(
                {"fault": {"kind": "hang", "method": "GET", "path": "/missions", "count": None, "seconds": 60}}
            )
        ui.tap(ui.find(NavItem, name="settings"))
        ui.wait(lambda: len(titles(ui)) > 0)
        ui.tap(ui.find(NavItem, name="home"))
        ui.tap_text(site.fleet.robots[0].name)
        ui.skip(DOUBLE_TAP)
        ui.tap(ui.find(CommandButton, text="Pause"))
        ui.wait(lambda: ui.find_all(CommandButton, text="Resume"), seconds=LONGEST)
        assert not app.shell.background.idle  # none of those has answered yet
        for robot in site.fleet.robots:
            robot.control({"fault": None})
