"""With the keyboard alone every target gets the ring, is visible with it, and is pressed by Enter; in the topmost dialog only."""

from __future__ import annotations

import pytest
from kivy.core.window import Window
from kivy.graphics import Color, SmoothLine
from kivy.uix.behaviors import ButtonBehavior
from kivy.uix.boxlayout import BoxLayout
from kivy.uix.floatlayout import FloatLayout
from kivy.uix.screenmanager import Screen
from kivy.uix.widget import Widget
from kivy.utils import get_hex_from_color

from app.screens.scheduler.axis import Band
from app.screens.scheduler.timeline import Bar, Lane
from app.widgets.buttons import CommandButton
from app.widgets.display import SectionCard
from app.widgets.fields import Field, FieldInput
from app.widgets.items import Item
from app.widgets.lanes import Lanes
from app.widgets.long_list import LongList
from app.widgets.panel_grid import PanelGrid
from app.widgets.scrolling import ScrollPage
from app.widgets.tokens import tk
from app.window.key_focus import ARROWS, ENTER, ESCAPE, SPACE, TAB
from tests.ui import checks
from tests.ui.ring import page_of, ring_at

UP, DOWN, RIGHT, LEFT = ARROWS


def test_tab_goes_round_and_back(ui, keys):
    ui.show(page_of("One", "Two", "Three"), (300, 300))
    seen = []
    for _press in range(4):
        ui.key(TAB)
        seen.append(keys.target.text)
    assert seen == ["One", "Two", "Three", "One"]
    Window.dispatch("on_keyboard", TAB, 0, "", ["shift"])
    assert keys.target.text == "Three"


def test_the_ring_does_not_lie_on_the_border_of_the_card(ui, keys):
    card = SectionCard(padding=4)
    card.add_widget(CommandButton(text="One", height=64))
    ui.show(card, (300, 72))
    before = set(Window.canvas.after.children)
    ui.key(TAB)
    line = next(part for part in Window.canvas.after.children if part not in before and isinstance(part, SmoothLine))
    points = line.points
    left, right = min(points[::2]), max(points[::2])
    bottom, top = min(points[1::2]), max(points[1::2])
    x, y = card.to_window(*card.pos)
    assert left - line.width > x + 2
    assert right + line.width < x + card.width - 2
    assert bottom - line.width > y + 2
    assert top + line.width < y + card.height - 2


def ring_lines(before) -> list[SmoothLine]:
    return [part for part in Window.canvas.after.children if part not in before and isinstance(part, SmoothLine)]


def test_a_widget_with_the_ring_is_scrolled_back_into_sight(ui, keys):
    """As the outcome of a test of the connection does to its button."""
    page = ScrollPage()
    above, button = Widget(size_hint_y=None, height=200), CommandButton(text="Test", height=64)
    for widget in (above, button):
        page.add_widget(widget)
    ui.show(page, (300, 300))
    ui.key(TAB)
    assert keys.target is button
    above.height = 400
    ui.advance(0.2)
    assert checks.is_seen(button)


class Area(ButtonBehavior, Widget):
    """A button that is pressed, of any height."""


@pytest.mark.parametrize("height", [280, 400])
def test_a_page_does_not_move_below_a_target_that_it_has_no_room_for(ui, keys, height):
    page = ScrollPage()
    above, area = Widget(size_hint_y=None, height=200), Area(size_hint_y=None, height=height)
    for widget in (above, area, Widget(size_hint_y=None, height=200)):
        page.add_widget(widget)
    ui.show(page, (300, 300))
    ui.key(TAB)
    assert keys.target is area
    above.height = 300
    ui.advance(0.5)
    places = []
    for _frame in range(6):
        ui.advance()
        places.append(area.to_window(*area.pos))
    assert len(set(places)) == 1


def test_the_ring_follows_the_card_that_it_is_kept_inside_of(ui, keys):
    """Its target's place alone doesn't say where it is: a filter that is cleared makes the card another size around it."""
    card = SectionCard(padding=4, size_hint=(None, None), size=(300, 72), pos=(0, 0))
    button = CommandButton(text="One", size_hint=(None, None), size=(292, 64), pos=(4, 4))
    card.add_widget(button)
    around = FloatLayout()
    around.add_widget(card)
    ui.show(around)
    before = set(Window.canvas.after.children)
    ui.key(TAB)
    narrow = max(ring_lines(before)[0].points[::2])
    card.width = 400
    ui.advance(0.1)
    button.size = 292, 64
    ui.advance(0.1)
    assert max(ring_lines(before)[0].points[::2]) > narrow


@pytest.mark.parametrize("theme", ["light", "dark", "contrast"])
def test_the_ring_is_seen_on_every_ground(ui, keys, theme):
    """It has two colours, so that one stands out on a card and one on a red banner."""
    tk.theme = theme
    ui.show(page_of("One"), (300, 300))
    before = list(Window.canvas.after.children)
    ui.key(TAB)
    colours = [part.rgba for part in Window.canvas.after.children if part not in before and isinstance(part, Color)]
    grounds = [
        getattr(tk, name)
        for name in ("bg", "surface", "fault_solid", "attention_solid", "neutral_solid", "accent", "accent_bg")
    ]
    for ground in grounds:
        assert (
            max(
                checks.contrast_ratio(get_hex_from_color(colour)[:7], get_hex_from_color(ground)[:7])
                for colour in colours
            )
            >= 4.5
        )


def test_the_ring_is_drawn_while_keys_are_used(ui, keys):
    ui.show(page_of("One", "Two"), (300, 300))
    before = ring_at()
    ui.key(TAB)
    assert ring_at() > before
    ui.key(ESCAPE)
    assert ring_at() == before
    ui.key(TAB)
    ui.tap_text("Two")
    assert ring_at() == before
    assert keys.target is None


def test_the_ring_rests_while_a_field_that_its_button_opened_takes_the_keys(ui, keys):
    page = page_of("Search")
    field = Field(label="Words")
    page.add_widget(field)
    ui.show(page, (300, 300))
    before = ring_at()
    ui.key(TAB)
    assert ring_at() > before
    field.focus = True
    ui.advance(0.1)
    assert ring_at() == before
    field.focus = False
    ui.advance(0.1)
    assert ring_at() > before


@pytest.mark.parametrize("key", [ENTER, SPACE])
def test_enter_presses_what_has_the_ring_once(ui, keys, key):
    page = ui.show(page_of("One", "Two"), (300, 300))
    calls: list[str] = []
    for button in ui.find_all(CommandButton, page):
        button.bind(on_release=lambda button: calls.append(button.text))
    ui.key(key)
    ui.key(TAB)
    ui.key(TAB)
    ui.key(key)
    assert calls == ["Two"]
    keys.target.busy = True
    ui.key(key)
    assert calls == ["Two"]


def test_a_key_that_is_held_presses_once(ui, keys):
    page = ui.show(page_of("One"), (300, 300))
    calls: list[str] = []
    ui.find(CommandButton, page).bind(on_release=lambda button: calls.append(button.text))
    ui.key(TAB)
    for _repeat in range(5):
        ui.key_down(ENTER)
        ui.advance(0.5)
    assert calls == ["One"]
    Window.dispatch("on_key_up", ENTER, 0)
    ui.key(ENTER)
    assert calls == ["One", "One"]


def test_enter_ends_a_field_and_leaves_its_place_in_the_round(ui, keys):
    page = page_of()
    page.found = None  # a property of that name is no search
    for widget in (Field(label="Name"), CommandButton(text="Save")):
        page.add_widget(widget)
    ui.show(page, (300, 300))
    ui.key(TAB)
    field = ui.find(FieldInput)
    Window.dispatch("on_key_down", ENTER, 0, "", [])
    field.focus = False  # as kivy's field does
    Window.dispatch("on_keyboard", ENTER, 0, "", [])
    Window.dispatch("on_key_up", ENTER, 0)
    ui.key(TAB)
    assert keys.target.text == "Save"


def test_tab_into_a_field_selects_what_is_in_it(ui, keys):
    field = ui.show(Field(label="Minutes", text="15"), (300, 90))
    ui.key(TAB)
    assert ui.find(FieldInput, field).selection_text == "15"


@pytest.mark.long
@pytest.mark.parametrize(("forth", "back"), [((TAB, ()), (TAB, ("shift",))), ((DOWN, ()), (UP, ()))])
def test_every_row_of_a_long_list_is_reached_in_its_order_and_all_of_it_seen(ui, keys, forth, back):
    rows = LongList(viewclass="OptionRow", data=[Item(n, f"Option {n}", icon="star") for n in range(40)])
    ui.show(rows, (400, 300))
    ui.key(TAB)
    seen = []
    for key, modifiers in (*[forth] * 39, *[back] * 39):
        seen.append(keys.target.key)
        bottom, top = (keys.target.to_window(0, y)[1] for y in (keys.target.y, keys.target.top))
        assert rows.to_window(*rows.pos)[1] - 1 <= bottom < top <= rows.to_window(0, rows.top)[1] + 1
        ui.key_down(key, modifiers=modifiers)
        Window.dispatch("on_key_up", key, 0)
        ui.advance(0.5)
    assert seen == [*range(39), *range(39, 0, -1)]
    assert keys.target.key == 0


def test_a_widget_disabled_while_it_has_the_ring_keeps_its_place(ui, keys):
    page = ui.show(page_of("One", "Two", "Three"), (300, 300))
    ui.key(TAB)
    ui.key(TAB)
    ui.find(CommandButton, page, text="Two").disabled = True
    ui.key(ENTER)
    ui.key(TAB)
    assert keys.target.text == "Three"


def test_a_reached_widget_is_scrolled_into_sight(ui, keys):
    ui.show(page_of(*map(str, range(12))), (300, 200))
    for _press in range(12):
        ui.key(TAB)
        whole, seen = checks.area(keys.target), checks.visible_area(keys.target, checks.parents(keys.target))
        assert seen == pytest.approx(whole, abs=1)


def test_arrows_go_to_the_nearest_on_that_side(ui, keys):
    grid = BoxLayout(spacing=8)
    grid.add_widget(page_of("a", "b"))
    grid.add_widget(page_of("c", "d"))
    ui.show(grid, (600, 300))
    seen = []
    for key in (TAB, RIGHT, DOWN, LEFT, UP, UP):
        ui.key(key)
        seen.append(keys.target.text)
    assert seen == ["a", "c", "d", "b", "a", "a"]


def at(word: str, x: float, y: float, width: float) -> CommandButton:
    return CommandButton(text=word, pos=(x, y), size_hint=(None, None), size=(width, 48))


def test_down_goes_to_the_nearest_below_before_a_better_aligned_one_further_down(ui, keys):
    """The bell, a banner's wide button, and More below it; a wide field, two in one row, and a chip below the right one."""
    page = FloatLayout()
    for button in (
        at("Bell", 500, 344, 48),
        at("Answer", 380, 272, 160),
        at("More", 490, 200, 70),
        at("Mission", 40, 136, 230),
        at("Robot", 280, 136, 280),
        at("Monthly", 520, 72, 60),
    ):
        page.add_widget(button)
    ui.show(page, (600, 400))
    keys._go(ui.find(CommandButton, text="Bell"))
    seen = []
    for _press in range(4):
        ui.key(DOWN)
        seen.append(keys.target.text)
    assert seen == ["Answer", "More", "Robot", "Monthly"]
    ui.key(UP)
    ui.key(LEFT)
    assert keys.target.text == "Mission"


def test_a_little_to_the_side_is_near(ui, keys):
    page = FloatLayout()
    for button in (at("One", 0, 200, 100), at("Beside", 110, 140, 100), at("Below", 0, 20, 100)):
        page.add_widget(button)
    ui.show(page, (300, 300))
    ui.key(TAB)
    ui.key(DOWN)
    assert keys.target.text == "Beside"


def test_a_disabled_or_hidden_button_is_passed_over(ui, keys):
    page = ui.show(page_of("One", "Two", "Three", "Four"), (300, 400))
    ui.find(CommandButton, page, text="Two").disabled = True
    ui.find(CommandButton, page, text="Three").opacity = 0
    assert [target.text for target in keys.targets()] == ["One", "Four"]


def test_tab_leaves_a_field_for_the_button_after_it(ui, keys):
    page = page_of()
    for widget in (Field(label="Name"), CommandButton(text="Save")):
        page.add_widget(widget)
    ui.show(page, (300, 300))
    ui.key(TAB)
    field = ui.find(FieldInput)
    assert field.focus
    Window.dispatch("on_key_down", TAB, 0, "", [])
    assert not field.focus
    assert keys.target.text == "Save"
    Window.dispatch("on_keyboard", TAB, 0, "", ["shift"])
    assert field.focus


def panels(ui) -> None:
    """Forty in two columns; eight are visible."""
    ui.show(
        PanelGrid(panelclass="OptionRow", panels=[Item(n, f"Panel {n}") for n in range(40)], columns=2, spacing=8),
        (500, 260),
    )


@pytest.mark.long
def test_every_panel_of_a_grid_is_reached(ui, keys):
    panels(ui)
    reached = []
    for _press in range(40):
        ui.key(TAB)
        reached.append(keys.target.key)
    for _press in range(39):
        Window.dispatch("on_keyboard", TAB, 0, "", ["shift"])
        ui.advance(0.1)
        reached.append(keys.target.key)
    assert reached == [*range(40), *range(38, -1, -1)]


@pytest.mark.long
def test_arrows_stay_in_their_column_of_a_grid(ui, keys):
    panels(ui)
    ui.key(TAB)
    ui.key(RIGHT)
    down = [keys.target.key]
    for _press in range(19):
        ui.key(DOWN)
        down.append(keys.target.key)
    assert down == list(range(1, 40, 2))
    for _press in range(19):
        ui.key(UP)
    assert keys.target.key == 1


def test_bars_of_a_timeline_are_reached_by_tab_and_arrows_and_opened_by_enter(ui, keys):
    ahead = (Bar("a", 2, 3), Bar("b", 8, 9), Bar("c", 12, 13))
    lanes = [
        Lane("Aino", bars=(Bar("past", 0, 1), *ahead)),
        Lane("Veikko", bars=(Bar("d", 8, 9), Bar("far", 40, 41))),
        Lane("Hall 1", key="hall", line="3 robots"),
    ]
    chart = Lanes(
        lanes=lanes, bands=[Band(15, 39, "Sat, day off", "folded")], now=1.5, hours=24, size_hint_y=None, height=160
    )
    page = page_of("Before")
    page.add_widget(chart)
    ui.show(page, (800, 400))
    opened, lines, folds = [], [], []
    chart.bind(
        on_bar=lambda _chart, key: opened.append(key),
        on_lane=lambda _chart, key: lines.append(key),
        on_fold=lambda _chart, hour: folds.append(hour),
    )

    def press(*codes: int) -> None:
        for code in codes:
            ui.key(code)
        ui.key_down(ENTER)
        ui.advance(0.3)
        Window.dispatch("on_key_up", ENTER)

    press(TAB, TAB)  # what has not ended yet
    press(RIGHT)
    press(DOWN)
    press(UP, RIGHT)
    assert opened == ["a", "b", "d", "c"]
    press(RIGHT)
    assert folds == [15]
    press(TAB, TAB)
    assert (lines, opened) == (["hall"], ["a", "b", "d", "c"])
    assert ring_at() > 0
    chart.lanes = lanes[1:]
    ui.advance(0.2)
    assert "a" not in [seat.event[1] for seat in chart.seats()]


def test_where_what_had_the_ring_goes_away_what_is_nearest_there_has_it(ui, keys):
    bars = [Bar("a", 2, 3), Bar("b", 8, 9), Bar("c", 12, 13)]
    chart = Lanes(lanes=[Lane("Aino", bars=tuple(bars))], now=1.5, hours=24, size_hint_y=None, height=80)
    page, screen = page_of("Before"), Screen()
    page.add_widget(chart)
    screen.add_widget(page)
    ui.show(screen, (800, 400))
    for key in (TAB, TAB, RIGHT):
        ui.key(key)
    assert keys.target.event[1] == "b"
    chart.lanes = [Lane("Aino", bars=(bars[0], bars[2]))]
    ui.advance(0.1)
    assert keys.target.event[1] == "c"
    screen.clear_widgets()
    ui.advance(0.1)
    assert keys.target is None
