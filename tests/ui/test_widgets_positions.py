"""A position is chosen on the map: what a finger takes there, what is written, and where only the list is offered."""

from __future__ import annotations

from itertools import combinations
from random import Random

import pytest
from kivy.core.window import Window
from kivy.metrics import dp
from kivy.tests.common import UnitTestTouch
from kivy.uix.widget import Widget

from app.domain.robot import MissionParameter, Pose
from app.screens.common.overlays import Dialogs
from app.screens.common.parameters_view import fields_of
from app.screens.common.sheets import Sheets
from app.services.robots.map_picture import MapPicture, Place
from app.widgets.buttons import CommandButton, IconButton
from app.widgets.choices import ChoiceSheet
from app.widgets.fields import Field
from app.widgets.flow import ChoiceField, ParameterFields
from app.widgets.positions import OnMap, PositionSheet, PositionsMap, Spot
from app.widgets.rest import DOUBLE_TAP
from app.widgets.robot_map import touch_each_other
from app.widgets.sheet import Sheet
from app.widgets.tokens import tk
from app.window.key_focus import ARROWS, ENTER, TAB, KeyFocus
from tests.ui import checks

GOAL = MissionParameter(
    "goal",
    "Goal",
    "Reference",
    choices=(("g-1", "Dock 3"), ("g-2", "Press"), ("g-3", "Gate"), ("g-4", "Gate")),
    sets="position",
)
PLACES = (Place("Dock 3", 0.2, 0.5), Place("Press", 0.7, 0.5), Place("Gate", 0.5, 0.9), Place("Elsewhere", 0.5, 0.1))
UP, _DOWN, RIGHT, LEFT = ARROWS


def picture(places: tuple[Place, ...] = PLACES) -> MapPicture:
    return MapPicture("Hall", bytes(20 * 10), (20, 10), Pose(0, 0, 0), (40.0, 20.0), places)


def shown(ui, *wanted: MissionParameter) -> ParameterFields:
    """On a sheet."""
    ui.show(Widget())
    fields, sheet = ParameterFields(fields=fields_of(wanted), map=picture()), Sheet(title="Send")
    sheet.add_widget(fields)
    Sheets().show(sheet)
    ui.advance(0.1)
    return fields


@pytest.fixture
def fields(ui):
    return shown(ui, GOAL)


@pytest.fixture
def keys():
    keys = KeyFocus()
    keys.start()
    yield keys
    keys.stop()


def test_the_problem_of_a_value_disappears_once_another_is_entered(ui):
    speed = MissionParameter("speed", "Speed", "Float", default=1.5, maximum=2)
    fields = shown(ui, GOAL, speed)
    problems = {"goal": "Choose one", "speed": "At most 2"}
    fields.problems = problems
    goal, typed = ui.find(ChoiceField, fields), ui.find(Field, fields, kind="decimal")
    assert (goal.problem, typed.problem) == ("Choose one", "At most 2")
    goal.chosen = "g-1"
    assert (goal.problem, typed.problem) == ("", "At most 2")
    typed.text = "1.2"
    assert typed.problem == ""
    fields.problems = dict(problems)  # the same again
    assert (goal.problem, typed.problem) == ("Choose one", "At most 2")


def press(ui, *codes: int) -> None:
    for code in codes:
        ui.key_down(code)
        ui.advance(0.3)
        Window.dispatch("on_key_up", code)


def open_map(ui) -> PositionsMap:
    ui.tap(ui.find(CommandButton, text="On the map"))
    ui.advance(DOUBLE_TAP)
    return ui.find(PositionsMap)


def point(chart: PositionsMap, x: float, y: float, right: float = 0) -> tuple[float, float]:
    """A point of the window, ``right`` px right of a fraction of the map."""
    at = chart.to_window(*chart._point(x, y))
    return at[0] + right, at[1]


def test_a_tap_near_a_position_marks_it_and_it_is_chosen_when_that_is_confirmed(ui, fields):
    chart = open_map(ui)
    assert (chart.chosen, ui.find(PositionSheet).foot_off) == (None, "Tap a position")
    ui.tap_at(*point(chart, 0.2, 0.5, dp(20)))
    assert chart.chosen == "g-1"
    assert fields.values() == {"goal": None}
    ui.tap(ui.find(CommandButton, text="Choose Dock 3"))
    assert (fields.values(), ui.find(ChoiceField).value, ui.find_all(PositionSheet)) == ({"goal": "g-1"}, "Dock 3", [])
    assert open_map(ui).chosen == "g-1"


def test_the_nearest_wins_a_finger_may_slide_and_free_ground_is_no_position(ui, fields):
    fields.map = picture((Place("Dock 3", 0.5, 0.5), Place("Press", 0.52, 0.5)))
    chart = open_map(ui)
    between = (point(chart, 0.52, 0.5)[0] - point(chart, 0.5, 0.5)[0]) / 2
    assert between < tk.h_touch / 2
    ui.tap_at(*point(chart, 0.1, 0.1))
    assert chart.chosen is None
    finger = UnitTestTouch(*point(chart, 0.5, 0.5, between - 2))
    finger.touch_down()
    assert chart.chosen == "g-1"
    finger.touch_move(*point(chart, 0.5, 0.5, between + 2))
    finger.touch_up()
    assert chart.chosen == "g-2"


def test_a_dialog_that_opens_by_itself_takes_the_finger_off_the_map(ui, fields):
    chart = open_map(ui)
    finger = UnitTestTouch(*point(chart, 0.2, 0.5))
    finger.touch_down()
    menu = Dialogs().menu(chart, "Late starts", [], print)
    finger.touch_move(*point(chart, 0.7, 0.5))
    finger.touch_up()
    assert chart.chosen == "g-1"
    menu.dismiss()


HALL = (Place("Dock 3", 0.2, 0.5), Place("Press", 0.7, 0.5), Place("Gate", 0.5, 0.9), Place("Line", 0.45, 0.3))
ALONG = MissionParameter(
    "goal", "Goal", "Reference", choices=tuple((place.name, place.name) for place in HALL), sets="position"
)


def test_keys_move_between_positions_enter_marks_and_confirms(ui, fields, keys):
    fields.fields, fields.map = fields_of([ALONG]), picture(HALL)
    ui.advance(0.1)
    chart = open_map(ui)
    for _n in ("arrow", "cross", "position"):
        ui.key(TAB)
    press(ui, ENTER)
    marked = [chart.chosen]
    for arrow in (UP, RIGHT, LEFT, LEFT):
        ui.key(arrow)
        press(ui, ENTER)
        marked.append(chart.chosen)
    assert marked == ["Dock 3", "Gate", "Press", "Line", "Dock 3"]
    assert ui.find(PositionSheet).name == "Dock 3"
    ui.key(RIGHT)
    assert fields.values() == {"goal": None}
    press(ui, ENTER, ENTER)
    assert (fields.values(), ui.find_all(PositionSheet)) == ({"goal": "Line"}, [])


def test_tab_leads_to_the_marked_position_and_on_to_the_buttons(ui, fields, keys):
    fields.fields, fields.map = fields_of([ALONG]), picture(HALL)
    ui.advance(0.1)
    chart = open_map(ui)
    chart.chosen = "Press"
    ui.advance(0.1)
    for _n in ("arrow", "cross", "position"):
        ui.key(TAB)
    assert keys.target.event == ("on_spot", "Press")
    ui.key(TAB)
    assert keys.target.text == "Choose Press"
    press(ui, ENTER)
    assert fields.values() == {"goal": "Press"}


def test_every_position_of_a_crowd_is_reached_by_arrows(ui, keys):
    places = Random(5)
    chart = ui.show(
        PositionsMap(
            aspect=0.5, places=[Spot(n, places.uniform(0.02, 0.98), places.uniform(0.02, 0.98), "") for n in range(60)]
        )
    )
    ui.advance(0.1)
    ui.key(TAB)
    waiting, seen = [keys.target], {keys.target}
    while waiting:
        start = waiting.pop()
        for arrow in ARROWS:
            keys.target = start
            ui.key(arrow)
            if keys.target not in seen:
                seen.add(keys.target)
                waiting.append(keys.target)
    assert len(seen) == len(chart.places)


def test_the_arrow_chooses_nothing_and_leads_back_to_what_was_entered(ui, fields):
    chart = open_map(ui)
    ui.tap_at(*point(chart, 0.7, 0.5))
    ui.tap(ui.find(IconButton, ui.find(PositionSheet), icon="arrow-left"))
    assert (fields.values(), ui.find_all(PositionSheet)) == ({"goal": None}, [])
    assert checks.is_seen(fields)


def test_only_distinguishable_positions_are_on_the_map(ui, fields):
    """Equal names, and names that are not positions to choose, are only in the list."""
    assert [(place.key, place.name) for place in open_map(ui).places] == [("g-1", "Dock 3"), ("g-2", "Press")]


@pytest.mark.parametrize("known", [None, picture(()), picture(PLACES[2:])])
def test_without_a_map_that_has_them_there_is_only_the_list(ui, fields, known):
    fields.map = known
    ui.advance(0.1)
    assert not ui.find_all(OnMap)
    ui.tap(ui.find(ChoiceField))
    assert ui.find_all(ChoiceSheet)


def test_the_first_empty_field_is_reported_as_missing(ui, fields):
    text = MissionParameter("note", "Note", "String")
    fields.fields = fields_of([GOAL, text])
    assert fields.missing == "Choose Goal first"
    ui.find(ChoiceField).chosen = "g-2"
    assert fields.missing == "Enter Note first"
    ui.find(Field, kind="text").text = " x"
    assert fields.missing == ""


def test_names_do_not_lie_over_each_other_and_the_chosen_one_is_always_written(ui):
    crowd = [(n, 0.5 + n % 6 * 0.012, 0.5 + n // 6 * 0.012, f"Position {n}") for n in range(30)]
    chart = ui.show(PositionsMap(aspect=0.5, places=[Spot(*spot) for spot in crowd], chosen=17))
    plates = chart.plates()
    assert 17 in plates
    assert 4 < len(plates) < 30
    assert not any(touch_each_other(a, b) for a, b in combinations(plates.values(), 2))
    assert all(chart.x <= left and right <= chart.right for left, _low, right, _top in plates.values())
    chart.chosen = 18
    after = chart.plates()
    assert 18 in after
    assert all(plates[key] == plate for key, plate in after.items() if key in plates)  # none moves under the finger


def test_no_name_lies_over_the_scale_and_one_that_is_too_long_is_left_to_the_button(ui):
    spots = [Spot("corner", 0.98, 0.08, "Compactor"), Spot("long", 0.3, 0.3, 99 * "long ")]
    chart = ui.show(PositionsMap(aspect=Window.height / Window.width, metres=40, places=spots, chosen="long"))
    plates = chart.plates()
    assert list(plates) == ["corner"]
    assert not touch_each_other(plates["corner"], chart._scale_area())
