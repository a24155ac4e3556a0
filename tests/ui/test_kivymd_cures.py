"""Each cure of app/widgets/kivymd_cures.py works. At another version of KivyMD: a cure without which its test is green can go."""

from __future__ import annotations

import gc
import re
import sys
import weakref
from collections.abc import Iterator
from pathlib import Path
from types import SimpleNamespace

import kivymd
import pytest
from kivy.base import EventLoop
from kivy.core.window import Window
from kivy.factory import Factory
from kivy.graphics import BorderImage, CanvasBase, Color, Fbo, RoundedRectangle
from kivy.input.providers.mouse import MouseMotionEventProvider
from kivy.lang import Builder
from kivy.metrics import sp
from kivy.tests.common import UnitTestTouch
from kivy.uix.behaviors import FocusBehavior
from kivy.uix.floatlayout import FloatLayout
from kivy.uix.widget import Widget
from kivymd.uix.boxlayout import MDBoxLayout
from kivymd.uix.button import MDButton, MDButtonText
from kivymd.uix.card import MDCard
from kivymd.uix.label import MDLabel

from app.widgets import kivymd_cures, shapes
from app.widgets.buttons import CommandButton
from app.widgets.scrolling import ScrollPage
from app.widgets.shapes import bordered_patch, over
from app.widgets.tokens import apply_theme, tk

RED, BLUE = (1, 0, 0, 1), (0, 0, 1, 1)
ROOT = Path(kivymd_cures.__file__).parents[2]


def test_the_cures_are_for_the_installed_version():
    assert kivymd.__version__ == kivymd_cures.KIVYMD_VERSION


def drawn(widget) -> list:
    """All that ``widget`` and its children draw, from the back to the front."""

    def within(canvas) -> Iterator:
        for instruction in canvas.children:
            if isinstance(instruction, CanvasBase):
                yield from within(instruction)
            else:
                yield instruction

    return list(within(widget.canvas))


def colours(widget) -> list[tuple]:
    return [
        tuple(round(part, 3) for part in instruction.rgba)
        for instruction in drawn(widget)
        if isinstance(instruction, Color)
    ]


def card(**values) -> MDCard:
    return MDCard(size_hint=(None, None), size=(200, 100), theme_bg_color="Custom", **values)


# ---------------------------------------------------------------------- leaks
class Lid(Widget):
    """Takes the end of each touch, as a dialog or the keyboard on the screen does."""

    def on_touch_up(self, touch):
        return touch.grab_current is None


def test_a_touch_that_scrolled_and_ended_above_something_else_is_not_kept(ui):
    page = Factory.ScrollPage()
    for n in range(40):
        page.add_widget(Factory.Body(text=f"Line {n}"))
    room = FloatLayout()
    room.add_widget(page)
    ui.show(room, (600, 400))
    touch = UnitTestTouch(*page.to_window(*page.center))
    touch.touch_down()
    for _n in range(5):
        touch.touch_move(touch.x, touch.y + 20)
        ui.advance()
    room.add_widget(Lid())
    touch.touch_up()
    ui.advance(1)
    assert page.scroll_y < 1
    kept = weakref.ref(touch)
    del touch
    gc.collect()
    assert kept() is None
    assert len(FocusBehavior.ignored_touch) == 0


def test_no_kv_reads_the_ids_of_another_widget():
    """kivy's table of bindings would hold them, and the widget, for ever. KivyMD's MDDialog and MDSegmentedButton do."""
    sources = {path.name: path.read_text(encoding="utf-8") for path in (ROOT / "kv").rglob("*.kv")}
    assert not [name for name, source in sources.items() if re.search(r"\bids\.\w+\.", source)]
    assert "\n<-Menu>" in sources["menu.kv"]  # an MDDialog without KivyMD's kv


def test_no_widget_follows_the_mouse(ui):
    before = len(Window.get_property_observers("mouse_pos"))
    ui.show(MDBoxLayout(MDLabel(text="Deliver"), MDCard()))
    assert len(Window.get_property_observers("mouse_pos")) == before


# ---------------------------------------------------------------------- what is drawn
@pytest.mark.parametrize("size", [(200, 100), (0, 0)])
def test_a_card_or_a_button_makes_no_frame_buffer_even_when_pressed(ui, size):
    button = MDButton(
        MDButtonText(text="Run"), theme_width="Custom", theme_height="Custom", size_hint=(None, None), size=size
    )
    for widget in (MDCard(ripple_behavior=True, style="elevated", size_hint=(None, None), size=size), button):
        ui.show(widget)
        widget.dispatch("on_press")
        ui.advance(0.1)
        assert not [shape for shape in drawn(widget) if isinstance(shape, Fbo) or type(shape).__name__ == "BoxShadow"]


def test_corners_are_smooth(ui):
    box = ui.show(MDBoxLayout(md_bg_color=RED, line_color=BLUE, line_width=2, radius=12))
    shapes = [shape for shape in drawn(box) if isinstance(shape, BorderImage | RoundedRectangle)]
    assert [(type(shape), shape.texture) for shape in shapes] == [
        (BorderImage, bordered_patch((12,) * 4, 2, RED, BLUE)[0])
    ]


def test_a_border_is_painted_over_its_fill():
    assert over((0, 0, 1, 0.5), RED) == (0.5, 0, 0.5, 1)
    assert over((0, 0, 1, 0), (1, 0, 0, 0.5)) == (1, 0, 0, 0.5)
    assert over((0, 0, 1, 0.5), (1, 0, 0, 0.5)) == pytest.approx((1 / 3, 0, 2 / 3, 0.75))
    assert over((0, 0, 1, 0), (1, 0, 0, 0)) == (1, 0, 0, 0)  # its neighbours do not bleed into another colour


class Canned:
    """A texture that notes what is blitted, and who wants to hear that the graphics were lost."""

    def __init__(self, size: tuple[int, int], **_format: str) -> None:
        self.size, self.blitted, self.observers = size, [], []

    def blit_buffer(self, data: bytes, **_format: str) -> None:
        self.blitted.append(data)

    def add_reload_observer(self, observer) -> None:
        self.observers.append(observer)


def test_a_surface_comes_back_when_a_tablet_has_lost_its_graphics(monkeypatch):
    monkeypatch.setattr(shapes, "Texture", SimpleNamespace(create=Canned))
    texture, edge = bordered_patch.__wrapped__((12,) * 4, 2, RED, BLUE)
    (side,) = set(texture.size)
    [painted] = texture.blitted
    rows = [painted[start : start + 4 * side] for start in range(0, len(painted), 4 * side)]
    assert (edge, len(rows)) == (13, side)
    middle = [tuple(rows[side // 2][4 * n : 4 * n + 4]) for n in range(side)]
    assert [middle[0], middle[1], middle[2]] == [(0, 0, 255, 255), (0, 0, 255, 255), (255, 0, 0, 255)]
    assert rows[0][3] == 0  # the corner
    for observer in texture.observers:
        observer(texture)
    assert texture.blitted == [painted, painted]


def test_a_pressed_widget_shows_it_under_its_border(ui):
    pressed = ui.show(card(md_bg_color=RED, theme_line_color="Custom", line_color=BLUE, line_width=2))
    lift = ui.press(pressed)
    assert [colour[:3] for colour in colours(pressed)] == [
        RED[:3],
        tuple(round(part, 3) for part in tk.ink[:3]),
        BLUE[:3],
    ]
    lift()
    ui.advance()
    assert colours(pressed) == [(1, 1, 1, 1)]


def test_a_label_has_one_background_and_a_smooth_one(ui):
    label = ui.show(MDLabel(text="Deliver", md_bg_color=RED, radius=12))
    ui.advance(0.2)
    assert colours(label).count(RED) == 1
    assert [type(shape) for shape in drawn(label) if isinstance(shape, BorderImage | RoundedRectangle)] == [BorderImage]


def test_a_background_follows_its_widget(ui):
    box = MDBoxLayout(md_bg_color=RED, radius=12)
    ui.show(box, (200, 100))
    box.size = 120, 60
    box.md_bg_color = BLUE
    ui.advance()
    patch = next(shape for shape in drawn(box) if isinstance(shape, BorderImage))
    assert (tuple(patch.size), tuple(patch.pos), colours(box)) == ((120, 60), tuple(box.pos), [BLUE])


def test_a_clear_widget_draws_and_binds_nothing_for_its_background(ui):
    box = ui.show(MDBoxLayout())
    assert drawn(box) == []
    bound = len(box.get_property_observers("size"))
    box.md_bg_color = RED
    ui.advance()
    assert colours(box) == [RED]
    assert len(box.get_property_observers("size")) == bound + 1


def test_the_background_of_a_relative_layout_moves_with_it(ui):
    button = MDButton(
        MDButtonText(text="Run"), style="filled", pos=(40, 30), size_hint=(None, None), theme_width="Custom"
    )
    ui.show(MDBoxLayout(button))
    patch = next(shape for shape in drawn(button) if isinstance(shape, BorderImage))
    assert tuple(patch.pos) == (0, 0)
    kinds = [type(instruction).__name__ for instruction in button.canvas.children]
    assert kinds[:2] == ["CanvasBase", "Canvas"]  # after what moves the layout's own drawing to its place


# ---------------------------------------------------------------------- touch
@pytest.mark.parametrize(("theme", "depth"), [("light", 0.12), ("contrast", 0.22)])
def test_the_state_layer_follows_the_finger_and_lies_under_the_text(ui, theme, depth):
    apply_theme(ui.app.theme_cls, theme)
    pressed = card(md_bg_color=RED)
    pressed.add_widget(MDLabel(text="Deliver", text_color=BLUE))
    ui.show(pressed)
    lift = ui.press(pressed)
    layer = tuple(round(part, 3) for part in (*tk.ink[:3], depth))
    assert colours(pressed)[:2] == [RED, layer]
    lift()
    ui.advance(1)
    assert pressed.state_layer_color == [0, 0, 0, 0]
    assert tuple(pressed.md_bg_color) == RED
    assert colours(pressed)[0] == RED


def test_a_card_without_a_fill_shows_the_touch_too(ui):
    pressed = ui.show(card(md_bg_color=(0, 0, 0, 0)))
    lift = ui.press(pressed)
    assert pressed.state_layer_color[3] > 0
    assert len(colours(pressed)) == 1
    lift()


def test_a_widget_can_be_created_disabled(ui):
    disabled = ui.show(card(disabled=True, md_bg_color=RED))
    ui.press(disabled)()
    assert disabled.state == "normal"


def test_a_press_that_ends_in_a_disabled_button_leaves_no_tint(ui):
    pressed = ui.show(card(md_bg_color=RED))
    lift = ui.press(pressed)
    pressed.disabled = True
    lift()
    assert pressed.state_layer_color[3] == 0


# ---------------------------------------------------------------------- theme and type
def test_roles_are_the_tokens(ui):
    for theme in ("light", "dark", "contrast", "light"):
        apply_theme(ui.app.theme_cls, theme)
        theme_cls = ui.app.theme_cls
        assert theme_cls.theme_style == ("Dark" if theme == "dark" else "Light")
        assert (
            theme_cls.primaryColor,
            theme_cls.surfaceContainerLowColor,
            theme_cls.inverseSurfaceColor,
            theme_cls.disabledTextColor,
        ) == (tk.accent, tk.surface, tk.snack, tk.disabled)


def test_kivymds_own_switch_of_the_theme_keeps_the_tokens(ui):
    ui.app.theme_cls.theme_style = "Dark"
    ui.app.theme_cls.set_colors()
    assert ui.app.theme_cls.primaryColor == tk.accent


def test_a_label_follows_no_property_that_stays_at_its_default(ui):
    for label in (Factory.Body(text="Deliver"), Factory.Ico(icon="star"), MDLabel(text="Deliver")):
        for name in kivymd_cures.LEFT_AT_DEFAULTS:
            assert not label.get_property_observers(name), name
        assert label.get_property_observers("text")


def test_missing_sides_are_drawn_as_before(ui):
    label = Factory.Body(text="Deliver")
    for name in kivymd_cures.LEFT_AT_DEFAULTS - {"outline_color", "disabled_outline_color"}:  # of no outline
        assert (getattr(label, name) or None) == (label._label.options.get(name) or None), name


def test_a_changed_text_leaves_the_texture_alone_that_may_still_be_drawn(ui):
    label = ui.show(MDLabel(text="Aino"))
    before = label.texture
    label.text = "Sisu"
    ui.advance()
    assert label.texture.size == before.size
    assert label.texture is not before


def test_no_text_sets_what_labels_do_not_follow():
    sets = re.compile(rf"\b({'|'.join(kivymd_cures.LEFT_AT_DEFAULTS)})\s*(?::|=(?!=))")
    files = [*ROOT.glob("app/**/*.py"), *ROOT.glob("kv/**/*.kv")]
    assert len(files) > 100
    assert {path.name: found for path in files if (found := sets.findall(path.read_text(encoding="utf-8")))} == {}


def names_of(widget) -> list[dict]:
    """The names in each kv expression that follows the ``text`` of ``widget``."""
    return [
        args[0][-1]
        for _callback, args, *_rest in widget.get_property_observers("text", args=True)
        if args and len(args[0]) == 5
    ]


def test_an_expression_has_a_copy_of_no_name_that_means_the_same_everywhere(ui):
    field = Builder.load_string("""
Body:
    id: field
    text: "Deliver"
    hint: tr._("Save") if field.text else ""
    font_size: dp(20) if self.text else sp(10)
""")
    found = names_of(field)
    assert len(found) == 2
    assert field.font_size == 20
    for names in found:
        assert not {"dp", "sp", "tk", "tr", "app"} & set(names)
        assert (names["tk"], names.get("tk"), names.get("nobody")) == (tk, tk, None)
        with pytest.raises(KeyError):
            _ = names["nobody"]
    field.text = ""
    assert (field.hint, field.font_size) == ("", sp(10))


def test_no_id_is_spelt_as_a_common_name():
    ids = {
        name
        for path in ROOT.glob("kv/**/*.kv")
        for name in re.findall(r"^\s+id: *(\w+)", path.read_text(encoding="utf-8"), re.MULTILINE)
    }
    assert len(ids) > 50
    assert ids & set(kivymd_cures.global_idmap) == set()


class Unwritten:
    """A value that must not be printed."""

    def __repr__(self) -> str:
        raise AssertionError("written out")


def test_values_of_expressions_are_not_printed(ui):
    box = Builder.load_string("""
Widget:
    given: None
    found: (self.given,)
""")
    value = Unwritten()
    box.given = value
    assert box.found == (value,)


def test_a_part_whose_root_was_collected_is_not_updated(ui):
    """Somebody may still hold it when the language is switched."""
    root = Builder.load_string("""
BoxLayout:
    Label:
        text: str(self.width) + str(root.opacity)
""")
    (part,) = root.children
    root.clear_widgets()
    del root
    gc.collect()
    part.width = 77  # no ReferenceError


def test_nothing_pulls_in_cairo(ui):
    assert "cairo" not in sys.modules


@pytest.fixture
def mouse():
    provider = MouseMotionEventProvider("mouse", "disable_hover")
    provider.start()
    EventLoop.add_input_provider(provider)
    yield
    EventLoop.remove_input_provider(provider)
    provider.stop()


def test_a_swipe_within_one_frame_scrolls_and_presses_nothing(ui, mouse):
    """As panels send it that act as a mouse."""
    pressed, page = [], ScrollPage()
    buttons = [CommandButton(text="Run", on_release=pressed.append) for _n in range(40)]
    for button in buttons:
        page.add_widget(button)
    ui.show(page, Window.size)
    ui.advance(0.5)

    def at(button) -> tuple[float, float]:
        """Its middle, from the top."""
        x, y = button.to_window(*button.center)
        return x, Window.height - y

    (x, ends), (_x, begins) = at(buttons[2]), at(buttons[8])
    Window.dispatch("on_mouse_down", x, begins, "left", [])
    for y in (begins - 60, begins - 120, ends):
        Window.dispatch("on_mouse_move", x, y, [])
    Window.dispatch("on_mouse_up", x, ends, "left", [])
    ui.advance(1)
    assert (pressed, page.scroll_y < 1) == ([], True)
