"""The robot on its own map, as an operator sees it: simulated robots over real HTTP."""

from __future__ import annotations

import base64
import logging

import pytest
from kivy.core.window import Window
from kivy.metrics import dp, sp

from app.screens.home.cards import PlaceMap, RobotMessage, RobotPlace
from app.screens.home.map import Marker
from app.services.robots.map_picture import Place
from app.widgets.robot_map import RobotMap, WholeMap
from app.widgets.rows import RobotChip
from mir_sim import world
from tests.ui.home.operator import run
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
    with shown(site.container, ui):
        ui.wait(lambda: ui.find_all(RobotMap))
        chart = ui.find(RobotMap)
        assert chart.name == world.MAP_NAME
        assert {"Home", "Dock", "Press"} <= {place.name for place in chart.places}
        assert chart.texture is not None
        assert chart.aspect == pytest.approx(world.HEIGHT / world.WIDTH, abs=0.05)
        start, ground = at(ui), chart.texture
        run(ui, "Deliver")
        ui.wait(lambda: at(ui) != start and chart.path)
        texts = ui.texts()
        assert any(text.startswith("Moving to '") for text in texts)
        first = at(ui)
        ui.wait(lambda: at(ui) not in (start, first))
        x, y = at(ui)
        assert 0 < x < 1
        assert 0 < y < 1
        assert chart.texture is ground  # made once, while things move on it


def test_each_robot_has_its_own_position_and_an_offline_one_looks_so(site, ui):
    with shown(site.container, ui):
        ui.wait(lambda: ui.find_all(RobotMap) and len(ui.find_all(RobotChip)) == 2)
        site.aino.control({"reboot_seconds": 600})
        ui.wait(lambda: "No answer" in ui.texts())
        assert ui.find(RobotMap).tone == "offline"
        assert any("127.0.0.1" in text for text in ui.texts(ui.find(RobotPlace)))
        ui.tap(ui.find(RobotChip, name="Veikko"))
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
        ui.key(27)
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


def test_a_robot_without_a_map_leaves_the_place_to_its_words(site, ui):
    api(site.aino, "DELETE", MAP)
    with shown(site.container, ui) as app:
        ui.wait(lambda: "Ready" in ui.texts())
        ui.wait(
            lambda: not site.container.maps.is_due(app.shell.navigator.screen("home").vm.facts.robot.id, world.MAP_GUID)
        )
        ui.wait(lambda: app.shell.background.idle)
        assert not ui.find_all(RobotMap)
        assert ui.find_all(RobotMessage)
        assert any("Waiting for new missions" in text for text in ui.texts())


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
        assert ui.find_all(RobotMessage)
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


class RecordedPlace(RecordedTexts, PlaceMap):
    pass


class RecordedWhole(RecordedTexts, WholeMap):
    def draw(self):
        self.tones = []
        super().draw()

    def _robot(self, x, y, heading, tone):
        self.tones.append(tone)
        super()._robot(x, y, heading, tone)


@pytest.mark.parametrize("at", [(0.9, 0.1), (0.97, 0.12), (0.8, 0.15)])
def test_no_name_of_a_place_is_under_the_icon_that_enlarges_the_map(ui, at):
    places = [Place("Compactor", *at), Place("Home", 0.2, 0.5)]
    chart = RecordedPlace(places=places, size_hint=(None, None), size=(350, 135))
    Window.add_widget(chart)
    ui.advance(0.1)
    assert "Home" in chart.written
    if "Compactor" in chart.written:
        x, y, width = chart.written["Compactor"]
        assert x + width / 2 <= chart.right - dp(34) or y - sp(9) >= chart.y + dp(34)


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
