"""Fields: typing, committing, problems said at the field."""

from __future__ import annotations

import pytest
from kivy.core.window import Window
from kivy.uix.widget import Widget
from kivy.utils import get_hex_from_color
from kivymd.uix.textfield import MDTextField

from app.widgets.buttons import CommandButton, IconButton
from app.widgets.fields import Field, FieldInput, SearchField
from app.widgets.scrolling import ScrollPage
from app.widgets.text import Ico, Large
from app.widgets.tokens import THEMES, apply_theme, tk
from tests.ui.checks import contrast_ratio

ENTER, ESCAPE = 13, 27


def commits_of(field) -> list:
    values: list = []
    field.bind(on_commit=lambda _field, value: values.append(value))
    return values


def test_typing_commits_once_when_the_field_is_left(ui):
    field = ui.show(Field(label="Name"), (400, 120))
    values = commits_of(field)
    ui.type(field, "Veikko")
    assert field.text == "Veikko"
    assert values == []
    field.focus = False
    ui.advance(0.1)
    assert values == ["Veikko"]
    field.focus = True
    ui.advance(0.1)
    field.focus = False
    ui.advance(0.1)
    assert values == ["Veikko"]


def test_help_is_there_while_there_is_some(ui):
    field = ui.show(Field(label="Name"), (400, 120))
    without = field.height
    assert ui.find_all(Ico, field) == []
    field.help = "As it is called on the floor"
    ui.advance(0.1)
    assert field.height >= without + ui.find(text=field.help).height
    field.problem = "A robot is called that"
    ui.advance(0.1)
    assert ui.find(text=field.problem)
    assert ui.find(Ico, field).icon == "alert-circle"
    field.help = field.problem = ""
    ui.advance(0.1)
    assert ui.find_all(Ico, field) == []
    assert field.height == without


def test_enter_commits_and_says_so(ui):
    field = ui.show(Field(), (400, 120))
    values = commits_of(field)
    entered: list[str] = []
    field.bind(on_enter=lambda f: entered.append(f.text))
    ui.type(field, "10.0.0.7")
    ui.find(FieldInput).dispatch("on_text_validate")
    assert values == ["10.0.0.7"]
    assert entered == ["10.0.0.7"]


def test_values_set_by_the_view_model_do_not_count_as_typed(ui):
    field = ui.show(Field(), (400, 120))
    values = commits_of(field)
    field.show("Aino")
    field.focus = True
    ui.advance(0.1)
    field.focus = False
    ui.advance(0.1)
    assert values == []
    assert ui.find(FieldInput).text == "Aino"


def test_a_problem_takes_the_place_of_the_help_and_turns_the_frame_red(ui):
    field = ui.show(Field(help="Its host name or IP"), (400, 120))
    assert "Its host name or IP" in ui.texts()
    field.problem = "Nothing answers there"
    ui.advance()
    assert "Nothing answers there" in ui.texts()
    assert "Its host name or IP" not in ui.texts()
    assert list(ui.find(FieldInput).line_color) == list(tk.fault)
    field.problem = ""
    ui.advance()
    assert list(ui.find(FieldInput).line_color) == list(tk.outline)


@pytest.mark.parametrize("theme", THEMES)
def test_typed_text_can_be_read_and_the_frame_shows_the_focus(ui, theme):
    field = ui.show(Field(text="Aino"), (400, 120))
    line = ui.find(MDTextField)
    quiet = list(line.line_color), line.line_width
    apply_theme(ui.app.theme_cls, theme)  # live
    field.focus = True
    ui.advance(0.1)
    text, ground, cursor = (
        get_hex_from_color(colour[:3]) for colour in (line.foreground_color, line.md_bg_color, line.cursor_color)
    )
    assert contrast_ratio(text, ground) >= (7 if theme == "contrast" else 4.5)
    assert contrast_ratio(cursor, ground) >= 3
    assert list(line.line_color) == list(tk.accent)
    assert line.line_width == tk.select_w > quiet[1]
    apply_theme(ui.app.theme_cls, "light")
    field.focus = False
    ui.advance(0.1)
    assert (list(line.line_color), line.line_width) == quiet


def test_a_closed_field_leaves_nothing_at_the_theme(ui):
    def followers() -> int:
        return sum(len(theme.get_property_observers(name)) for name in theme.properties())

    theme = ui.app.theme_cls
    ui.show(Field(label="Name"), (400, 120))
    before = followers()
    for _n in range(5):
        ui.show(Field(label="Name"), (400, 120))
    assert followers() == before


def test_help_lies_under_the_frame_and_counts_in_the_height(ui):
    field = ui.show(Field(label="Name", help="word " * 60))
    field.size_hint_x, field.width = None, 300
    ui.advance()
    frame = ui.find(FieldInput)
    assert frame.height == tk.h_field
    assert field.height > tk.h_field + 100
    assert frame.y > field.y + 50


def test_a_password_is_hidden_until_the_eye_is_pressed(ui):
    field = ui.show(Field(password=True), (400, 120))
    ui.type(field, "secret")
    line = ui.find(FieldInput)
    assert line.password
    eye = ui.find(IconButton)
    assert (eye.right, eye.center_y) == (field.right, line.center_y)
    ui.tap(eye)
    assert not line.password
    assert field.text == "secret"


def test_a_shortened_text_is_reported_until_it_fits(ui):
    field = ui.show(Field(label="Name", help="Of the robot", max_length=5), (400, 120))
    ui.type(field, "Aino")
    assert ui.texts(field) == ["Name", "Of the robot"]
    ui.find(FieldInput).insert_text(" 2 at the press")  # pasted
    ui.advance(0.1)
    assert field.text == "Aino "
    assert ui.texts(field)[-1] == "5 characters at most: the rest was cut"
    ui.find(FieldInput).do_backspace()
    ui.advance(0.1)
    assert ui.texts(field)[-1] == "Of the robot"


@pytest.mark.parametrize("kind", ["count", "int", "decimal", "steps"])
@pytest.mark.parametrize("typed", ["10,5", "1.5", "-3", "1a2", "1_5", "1e3"])
def test_a_number_field_leaves_nothing_out_of_what_is_typed(ui, kind, typed):
    field = ui.show(Field(kind="step", optional=True) if kind == "steps" else Field(kind=kind), (400, 120))
    ui.type(field, typed)
    field.focus = False
    ui.advance(0.1)
    assert field.text == ui.find(FieldInput).text == typed


def test_search_can_be_emptied(ui):
    field = ui.show(SearchField(hint="Search"), (400, 56))
    ui.type(field, "coil")
    assert field.text == "coil"
    ui.tap(ui.find(IconButton))
    assert field.text == ""


def test_a_pick_field_opens_something(ui):
    field = ui.show(Field(kind="pick", label="Mission", value="Deliver"), (300, 90))
    taps: list[int] = []
    field.bind(on_release=lambda *_: taps.append(1))
    ui.tap_text("Deliver")
    assert taps == [1]
    field.problem = "Choose a mission"
    ui.advance()
    assert "Choose a mission" in ui.texts()


def step_field(ui, **kwargs) -> Field:
    return ui.show(Field(kind="step", **kwargs), (360, 140))


def test_a_large_number_is_read_in_groups_and_typed_without(ui):
    field = step_field(ui, value=100_000, maximum=1_000_000, unit="runs")
    assert "100,000 runs" in ui.texts()
    assert field.text == "100000"


@pytest.mark.parametrize("value", [7, 8])
def test_a_typed_number_is_shown_as_it_was_read(ui, value):
    field = step_field(ui, value=value)
    field.text = "007"
    field.commit()
    assert (field.value, field.text) == (7, "7")


def test_steps_go_to_multiples_and_stop_at_the_ends(ui):
    field = step_field(ui, value=32, minimum=1, maximum=41, step=10)
    values = commits_of(field)
    minus, plus = ui.find_all(CommandButton)
    ui.tap(plus)
    ui.tap(plus)
    assert values == [40, 41]
    assert plus.disabled
    for _n in range(5):
        ui.tap(minus)
    assert values[2:] == [40, 30, 20, 10, 1]
    assert minus.disabled


def test_a_held_button_of_a_step_is_one_step(ui):
    field = step_field(ui, value=0, maximum=100)
    values = commits_of(field)
    ui.press(ui.find_all(CommandButton)[1])(1.05)
    ui.advance(1)
    assert values == [1]


def test_a_typed_number_outside_the_range_is_red_and_not_taken(ui):
    field = step_field(ui, value=30, minimum=1, maximum=3600)
    values = commits_of(field)
    field.text = "9999"
    field.focus = True
    ui.advance(0.1)
    assert "1 to 3600" in ui.texts()
    field.focus = False
    ui.advance(0.1)
    assert values == []
    assert field.outside
    assert list(ui.find(FieldInput).line_color) == list(tk.fault)
    field.text = "60"
    field.commit()
    assert values == [60]
    assert not field.outside


@pytest.mark.parametrize("typed", ["10,5", "1.5", "1_5", "fifteen"])
def test_text_that_is_no_whole_number_is_reported_and_refused(ui, typed):
    field = step_field(ui, value=30, minimum=1, maximum=3600, help="1 to 3600 s")
    values = commits_of(field)
    field.text = ""
    ui.type(field, typed)
    field.focus = False
    ui.advance(0.1)
    assert (field.value, values, field.outside) == (30, [], True)
    assert "A whole number is needed" in ui.texts()
    field.text = "0"
    ui.advance(0.1)
    assert (field.outside, "1 to 3600 s" in ui.texts(), "A whole number is needed" in ui.texts()) == (True, True, False)


def test_a_field_that_is_switched_off_shows_its_value(ui):
    field = step_field(ui, value=30)
    field.text = "1.5"
    field.disabled = True
    assert (field.text, field.outside) == ("30", False)


@pytest.mark.parametrize(("optional", "value"), [(True, None), (False, 30)])
def test_an_empty_number_is_none_only_where_it_may_be(ui, optional, value):
    field = step_field(ui, value=30, optional=optional)
    field.text = ""
    field.commit()
    assert field.value == value
    assert field.outside is not optional


def test_the_range_may_come_after_the_value(ui):
    field = step_field(ui, value=40)
    assert not field.outside
    field.maximum = 20
    assert field.outside


def test_a_narrow_pick_field_breaks_no_word(ui):
    field = ui.show(Field(kind="pick", label="Battery ≥", value="No minimum"), (126, 90))
    assert ui.find(Large, field).lines == 2


# ---------------------------------------------------------------------- numbers are replaced
NUMBERS = {
    "steps": lambda: Field(kind="step", value=1, maximum=600),
    "whole": lambda: Field(kind="int", text="1"),
    "decimal": lambda: Field(kind="decimal", text="1"),
}


@pytest.mark.parametrize("typed_on", ["a keyboard", "the screen"])
@pytest.mark.parametrize("kind", list(NUMBERS))
def test_typing_replaces_a_number_that_was_tapped(ui, kind, typed_on):
    page = ScrollPage()
    page.add_widget(field := NUMBERS[kind]())
    page.add_widget(lower := Widget(size_hint_y=None, height=0))
    ui.show(page, (400, 300))
    inside = ui.find(FieldInput)
    for hold, height in ((0.05, 0), (0.4, 0), (0.05, 900)):  # a page that scrolls hands taps on later
        field.text, lower.height = "1", height
        ui.advance()
        ui.tap(inside, hold)
        for digit in "30":
            if typed_on == "a keyboard":
                Window.dispatch("on_textinput", digit)
            else:
                inside.insert_text(digit)  # as the keys of ours do
        assert inside.text == "30"
        inside.focus = False
        ui.advance(0.5)


def test_another_tap_puts_the_cursor_into_a_number(ui):
    field = ui.show(Field(kind="step", value=13, maximum=600), (400, 120))
    inside = ui.find(FieldInput)
    ui.tap(inside)
    ui.advance(1)
    ui.tap_at(inside.to_window(inside.right - 4, 0)[0], inside.to_window(0, inside.center_y)[1])
    Window.dispatch("on_textinput", "5")
    assert field.text == "135"


def test_a_text_that_is_tapped_stays(ui):
    field = ui.show(Field(text="Aino"), (400, 120))
    inside = ui.find(FieldInput)
    ui.tap_at(inside.right - 40, inside.center_y)
    Window.dispatch("on_textinput", "2")
    assert field.text == "Aino2"
