"""The robot on its own map, as an operator sees it: simulated robots over real HTTP."""

from __future__ import annotations

import base64
import logging

import pytest
from kivy.core.window import Window
from kivy.metrics import sp

from app.screens.home.cards import PlaceMap
from app.screens.home.map import Marker
from app.widgets.robot_map import RobotMap, WholeMap
from app.window.key_focus import ESCAPE
from mir_sim import world
from tests.ui.home.operator import open_robot, run
from tests.ui.whole_app import api, plant, shown

MAP = f"/maps/{world.MAP_GUID}"


@pytest.fixture
def site(tmp_path):
    with plant(tmp_path, robots=2, time_scale=8.0) as site:
        site.aino = site.fleet.robots[0]
        site.add_robots()
        site.add_missions("Deliver")
        yield site


def at(ui) -> tuple[float, ...]:
    return tuple(ui.find(RobotMap).at)


def test_the_robot_drives_on_the_screen(site, ui):
    with shown(site.container, ui) as app:
        ui.wait(lambda: ui.find_all(RobotMap))
        chart = ui.find(RobotMap)
        assert app.shell.navigator.screen("home").vm.view.map.picture.name == world.MAP_NAME
        assert {"Home", "Dock", "Press"} <= {place.name for place in chart.places}
        assert chart.texture is not None
        assert chart.aspect == pytest.approx(world.HEIGHT / world.WIDTH, abs=0.05)
        start, ground = at(ui), chart.texture
        run(ui, "Deliver")
        ui.wait(lambda: at(ui) != start and chart.path)
        assert chart.label.endswith(" m")
        first = at(ui)
        ui.wait(lambda: at(ui) not in (start, first))
        x, y = at(ui)
        assert 0 < x < 1
        assert 0 < y < 1
        assert chart.texture is ground  # made once, while things move on it


def test_each_robot_has_its_own_position_and_an_offline_one_looks_so(site, ui):
    with shown(site.container, ui):
        ui.wait(lambda: ui.find_all(RobotMap))
        site.aino.control({"reboot_seconds": 600})
        ui.wait(lambda: "No answer" in ui.texts())
        assert ui.find(RobotMap).tone == "offline"
        assert ui.find(RobotMap).label.startswith("seen ")
        open_robot(ui, "Veikko")
        ui.wait(lambda: ui.find_all(RobotMap, tone="accent"))


def test_a_tap_opens_all_of_the_map_with_every_robot_on_it(site, ui):
    with shown(site.container, ui):
        ui.wait(lambda: ui.find_all(PlaceMap))
        ui.tap(ui.find(PlaceMap))
        ui.wait(lambda: len(ui.find(WholeMap).robots) == 2)
        chart = ui.find(WholeMap)
        assert (chart.texture is not None, chart.metres > 10) == (True, True)
        before = chart.robots[0]
        site.aino.control({"emergency_stop": True})
        ui.wait(lambda: chart.robots[0] != before)
        assert {robot.name for robot in chart.robots} >= {"Aino · Stopped"}
        ui.key(ESCAPE)
        ui.wait(lambda: not ui.find_all(WholeMap))


def test_a_known_map_is_shown_after_a_restart_although_the_robot_refuses_it(site, ui):
    with shown(site.container, ui) as app:
        ui.wait(lambda: ui.find_all(RobotMap) and app.shell.background.idle)
    api(site.aino, "DELETE", MAP)
    site.container.maps = type(site.container.maps)(
        site.container.db.path.parent / "maps",
        lambda robot_id: site.container.repositories.robots.get(site.container.db.read(), robot_id),
        site.container.make_client,
        site.container.clock,
    )
    with shown(site.container, ui):
        ui.wait(lambda: ui.find_all(RobotMap))


def test_a_robot_without_a_map_shows_none(site, ui):
    api(site.aino, "DELETE", MAP)
    with shown(site.container, ui) as app:
        ui.wait(lambda: "Ready" in ui.texts())
        ui.wait(
            lambda: not site.container.maps.is_due(app.shell.navigator.screen("home").vm.facts.robot.id, world.MAP_GUID)
        )
        ui.wait(lambda: app.shell.background.idle)
        assert not ui.find_all(RobotMap)


@pytest.mark.parametrize("picture", [b"GIF89a no picture at all", b"\x89PNG\r\n\x1a\n" + bytes(200)])
def test_garbage_for_a_map_is_no_map_and_one_line_in_the_log(site, ui, caplog, picture):
    field = "base_map" if "base_map" in api(site.aino, "GET", MAP).json() else "map"  # by the robot's software
    api(site.aino, "PUT", MAP, **{field: base64.b64encode(picture).decode()})
    with caplog.at_level(logging.WARNING), shown(site.container, ui) as app:
        ui.wait(lambda: "Ready" in ui.texts())
        ui.wait(lambda: any("map of Aino" in record.getMessage() for record in caplog.records))
        ui.wait(lambda: app.shell.background.idle)
        ui.advance(2)
        assert not ui.find_all(RobotMap)
    assert len([record for record in caplog.records if "map of Aino" in record.getMessage()]) == 1


class RecordedTexts:
    """Notes where it writes."""

    def text(self, words, x, y, *args, **kwargs):
        width = super().text(words, x, y, *args, **kwargs)
        self.written[words] = x, y, width
        return width

    def draw(self):
        self.written = {}
        super().draw()


class RecordedWhole(RecordedTexts, WholeMap):
    def draw(self):
        self.tones = []
        super().draw()

    def _robot(self, x, y, heading, tone):
        self.tones.append(tone)
        super()._robot(x, y, heading, tone)


def test_robots_close_together_show_the_first_on_top_without_overlapping_names(ui):
    home = [
        Marker(0.3, 0.5, 0, tone, name)
        for tone, name in (("fault", "Sisu · Stopped"), ("attention", "Veikko · Look at it"), ("accent", "Aino"))
    ]
    chart = RecordedWhole(
        robots=[*home, Marker(0.7, 0.5, 0, "accent", "Toivo")], size_hint=(None, None), size=(700, 400)
    )
    Window.add_widget(chart)
    ui.advance(0.1)
    assert chart.tones[-1] == "fault"
    assert set(chart.written) == {"Sisu · Stopped", "Veikko · Look at it", "Toivo"}  # the third has no room left
    assert abs(chart.written["Sisu · Stopped"][1] - chart.written["Veikko · Look at it"][1]) > sp(20)
