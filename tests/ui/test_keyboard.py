"""The keyboard on the screen without an app: its keys, and the field above it."""

from __future__ import annotations

import string

import pytest
from kivy.metrics import dp

from app.widgets.fields import Field, FieldInput
from app.widgets.keyboard import PAGES, BoardKey, DockedKeyboard
from app.widgets.tokens import tk
from tests.support.examples import at_night
from tests.ui import checks
from tests.ui.integrator import keyboard, tap_keys


@pytest.fixture(scope="module")
def ui(shared_ui):
    return shared_ui


@pytest.fixture
def gloves():
    tk.use("light", gloves=True)
    yield
    tk.use("light", gloves=False)


def bottom(field) -> float:
    return field.to_window(field.x, field.y)[1]


def test_the_field_is_lifted_above_it_and_all_is_put_down_again(ui):
    field = ui.show(Field(label="Name"), (400, 90))
    field.pos_hint, field.y = {}, 40
    ui.advance()
    keys = DockedKeyboard(lambda: True)
    keys.start()
    try:
        ui.tap(ui.find(FieldInput, field))
        assert bottom(ui.find(FieldInput, field)) >= keyboard(ui).top
        tap_keys(ui, "x")
        assert field.text == "x"
        tap_keys(ui, "done")
        ui.wait(lambda: not ui.find_all(DockedKeyboard))
        assert field.y == 40
    finally:
        keys.stop()


def test_all_of_ascii_can_be_typed_on_it():
    typed = {key for page in ("letters", "signs", "more") for row in PAGES[page] for key in row if len(key) == 1}
    upper = {key.upper() for row in PAGES["letters"] for key in row if len(key) == 1}
    assert set(string.printable) - set(string.whitespace) <= typed | upper
    ways = (
        {key for row in PAGES["letters"] for key in row} & set(PAGES),
        {key for row in PAGES["signs"] for key in row} & set(PAGES),
    )
    assert ways == ({"signs"}, {"more", "letters"})


def test_a_rare_sign_is_two_keys_away(ui):
    field = ui.show(Field(label="Password"), (400, 90))
    keys = DockedKeyboard(lambda: True)
    keys.start()
    try:
        ui.tap(ui.find(FieldInput, field))
        tap_keys(ui, "signs", "more", *"$^~|<>{}`", "signs", "1", "letters", "x")
        assert field.text == "$^~|<>{}`1x"
    finally:
        keys.stop()


def test_a_closed_keyboard_keeps_only_the_page_of_letters(ui):
    field = ui.show(Field(label="Password"), (400, 90))
    keys = DockedKeyboard(lambda: True)
    keys.start()
    try:
        ui.tap(ui.find(FieldInput, field))
        tap_keys(ui, "signs", "more", "$", "signs", "letters")
        letters = set(ui.find_all(BoardKey))
        tap_keys(ui, "signs", "done")
        ui.wait(lambda: not ui.find_all(DockedKeyboard))
        assert {key for row in keys.walk() for key in row.children if isinstance(key, BoardKey)} == set()
        assert list(keys._pages) == ["letters"]
        ui.tap(ui.find(FieldInput, field))
        assert set(ui.find_all(BoardKey)) == letters
    finally:
        keys.stop()


def test_the_keyboard_hides_when_a_real_one_types_and_returns_for_a_finger(ui):
    field = ui.show(Field(label="Name"), (400, 90))
    keys = DockedKeyboard(lambda: True)
    keys.start()
    try:
        ui.tap(ui.find(FieldInput, field))
        assert keyboard(ui)
        ui.key(ord("a"), "a")
        assert ui.find_all(DockedKeyboard) == []
        assert field.focus
        ui.advance(1)
        assert ui.find_all(DockedKeyboard) == []
        ui.tap(ui.find(FieldInput, field))
        assert keyboard(ui)
    finally:
        keys.stop()


@pytest.mark.parametrize(
    ("field", "signs"),
    [
        (lambda: Field(kind="decimal"), ["-", ","]),
        (lambda: Field(kind="int"), ["-"]),
        (lambda: Field(kind="count"), []),
        (lambda: Field(kind="step", minimum=1), []),
        (lambda: Field(kind="step", minimum=-5), ["-"]),
    ],
)
def test_the_number_pad_has_the_signs_that_the_field_can_use(ui, field, signs):
    ui.show(field(), (400, 90))
    keys = DockedKeyboard(lambda: True, lambda: ",")
    keys.start()
    try:
        inside = ui.find(FieldInput)
        ui.tap(inside)
        ui.wait(lambda: ui.find_all(DockedKeyboard))
        assert [
            key.text
            for row in reversed(keys.children)
            for key in reversed(row.children)
            if isinstance(key, BoardKey) and key.text and not key.text.isdecimal()
        ] == signs
        inside.select_all()
        inside.delete_selection()
        tap_keys(ui, "1", *(["decimal", "5"] if "," in signs else []))
        assert inside.text == ("1,5" if "," in signs else "1")
    finally:
        keys.stop()


def test_keys_of_a_narrow_window_are_still_48_wide(ui):
    keys = DockedKeyboard(lambda: True)
    keys._show_page("letters")
    ui.show(keys, size=(600, 4 * 52 + 3 * 8 + 16))
    ui.advance(0.1)
    assert min(key.width for key in ui.find_all(BoardKey)) >= 48


@pytest.mark.parametrize("page", ["letters", "signs", "more", "decimals", "integers", "digits"])
@pytest.mark.parametrize("width", [800, *at_night(1280)])
def test_every_key_is_for_gloves_in_both_orientations(ui, gloves, page, width):
    keys = DockedKeyboard(lambda: True)
    keys._show_page(page)
    ui.show(keys, size=(width, 4 * tk.h_touch + dp(3 * 8 + 16)))
    ui.advance(0.1)
    assert [line for line in checks.problems(keys) if "small target" not in line] == []  # eleven in a row are less wide
    assert min(key.height for key in ui.find_all(BoardKey)) >= 70
    assert min(key.width for key in ui.find_all(BoardKey)) >= 60
