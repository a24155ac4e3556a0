"""The keyboard on the screen, in Settings by taps: a word into a text field, digits into a number field, and when it comes and goes."""

from __future__ import annotations

import pytest
from kivy.core.window import Window

from app.screens.settings.robot_sheet import RobotSheet
from app.widgets.buttons import CommandButton, Segment
from app.widgets.choices import ChoiceSheet
from app.widgets.dock import dock
from app.widgets.fields import Field, FieldInput, SearchField
from app.widgets.keyboard import BoardKey, DockedKeyboard, has_keyboard, lacks_keyboard
from app.window import application
from tests.ui import checks
from tests.ui.integrator import add, entry, go, key, keyboard, open_row, settings, tap_keys, titles

POWER_BUTTON = """I: Bus=0019 Vendor=0000 Product=0001 Version=0000
N: Name="Power Button"
H: Handlers=kbd event0
B: EV=3
B: KEY=10000000000000 0
"""
KEYBOARD = """I: Bus=0003 Vendor=046d Product=c31c Version=0110
N: Name="Logitech USB Keyboard"
H: Handlers=sysrq kbd event3 leds
B: EV=120013
"""


@pytest.fixture(scope="module")
def first_settings():
    return {"keyboard": "on"}


def robot_dialog(ui) -> RobotSheet:
    go(ui, "robots")
    add(ui, "Add robot")
    ui.advance(0.5)
    return ui.find(RobotSheet)


# ---------------------------------------------------------------------- typing
def test_a_word_is_typed_on_it_and_the_field_has_it(app, ui):
    dialog = robot_dialog(ui)
    field = dialog.ids.name_field
    ui.tap(ui.find(FieldInput, field))
    tap_keys(ui, "shift", *"äij", "backspace", *"ni", "space", "signs", "2", "letters", "å")
    assert field.text == "Äini 2å"
    assert field.focus
    tap_keys(ui, "done")
    assert not field.focus
    ui.wait(lambda: not ui.find_all(DockedKeyboard))
    assert dialog.it.name == "Äini 2å"


def test_number_fields_get_a_number_pad_and_commit_when_done(site, app, ui):
    go(ui, "scheduler")
    field = ui.find(Field, label="Retries when a robot can't be reached")
    ui.tap(ui.find(FieldInput, field))
    assert not ui.find_all(BoardKey, keyboard(ui), key="q")
    tap_keys(ui, "backspace", "backspace", "7")
    assert field.text == "7"
    tap_keys(ui, "done")
    ui.wait(lambda: settings(site).retry_limit == 7)
    ui.wait(lambda: not ui.find_all(DockedKeyboard))


def test_enter_ends_the_typing_in_a_search(app, ui):
    go(ui, "scheduler")
    ui.tap(ui.find(Field, label="Time zone").ids.line)
    ui.advance(1)
    search = ui.find(SearchField, ui.find(ChoiceSheet))
    ui.tap(ui.find(FieldInput, search))
    tap_keys(ui, *"hels", "done")
    ui.wait(lambda: not ui.find_all(DockedKeyboard), seconds=5)
    assert (search.text, search.focus) == ("hels", False)


def test_a_held_backspace_repeats(app, ui):
    dialog = robot_dialog(ui)
    field = dialog.ids.name_field
    ui.type(field, "Veikko the second")
    ui.tap(key(ui, "backspace"), hold=3)
    assert field.text == ""


@pytest.mark.parametrize("size", [(1280, 800), (1024, 600), (800, 1280), (600, 480)], ids="{0[0]}x{0[1]}".format)
def test_test_and_save_are_above_it_whatever_is_typed_into(site, app, ui, size):
    site.add_robots()
    go(ui, "robots")
    ui.wait(lambda: titles(ui))
    dialog, before = open_row(ui, "Aino"), Window.size
    ui.advance(0.5)
    Window.size = size
    try:
        for name in ("name", "password"):
            entry(dialog, name).focus = True
            ui.advance(0.5)
            for word in ("Test connection", "Save"):
                button = ui.find(CommandButton, dialog, text=word)
                assert checks.is_seen(button)
                assert button.to_window(*button.pos)[1] >= keyboard(ui).top
            assert "\n".join(checks.problems(dialog)) == ""
    finally:
        Window.size = before


def test_from_field_to_field_of_the_robot_dialog_it_stays(app, ui):
    dialog = robot_dialog(ui)
    names = ("name", "address", "username", "password")
    for name in names:
        ui.tap(ui.find(FieldInput, entry(dialog, name)))
        tap_keys(ui, name[0])
        assert entry(dialog, name).text == name[0]
    assert [entry(dialog, name).text for name in names] == ["n", "a", "u", "p"]


def test_a_field_stays_under_the_finger_that_brings_it_back(app, ui):
    dialog = robot_dialog(ui)
    address = ui.find(FieldInput, entry(dialog, "address"))
    ui.tap(address)
    keyboard(ui)
    ui.key(97, "a")  # a real keyboard types
    ui.wait(lambda: not ui.find_all(DockedKeyboard))
    ui.advance(0.3)
    lift, place = ui.press(address), dialog.y
    ui.advance(0.2)
    assert dialog.y == place
    lift(0.1)
    assert dock.field is address
    ui.wait(lambda: ui.find_all(DockedKeyboard))


# ---------------------------------------------------------------------- hidden again
def test_escape_closes_it_and_then_the_dialog_of_its_field(app, ui):
    dialog = robot_dialog(ui)
    ui.tap(ui.find(FieldInput, dialog.ids.name_field))
    keyboard(ui)
    ui.key(27)
    ui.wait(lambda: not ui.find_all(DockedKeyboard))
    assert ui.find_all(RobotSheet) == [dialog]
    assert dock.field is None
    ui.key(27)
    ui.wait(lambda: not ui.find_all(RobotSheet))


def test_the_keyboard_closes_with_the_dialog_of_its_field(app, ui):
    dialog = robot_dialog(ui)
    ui.tap(ui.find(FieldInput, dialog.ids.name_field))
    keyboard(ui)
    app.shell.sheets.close(app.shell.sheets.top)
    ui.wait(lambda: not ui.find_all(DockedKeyboard))
    assert dock.field is None


def test_the_keyboard_closes_at_a_tap_elsewhere(app, ui):
    dialog = robot_dialog(ui)
    ui.tap(ui.find(FieldInput, dialog.ids.name_field))
    keyboard(ui)
    ui.tap_at(*dialog.to_window(dialog.center_x, dialog.top - 30))
    ui.wait(lambda: not ui.find_all(DockedKeyboard))


# ---------------------------------------------------------------------- when
def test_the_keyboard_is_chosen_in_settings(site, app, ui):
    go(ui, "display")
    ui.tap(ui.find(Segment, text="Never"))
    ui.wait(lambda: settings(site).keyboard == "off")
    dialog = robot_dialog(ui)
    ui.tap(ui.find(FieldInput, dialog.ids.name_field))
    ui.advance(0.5)
    assert not ui.find_all(DockedKeyboard)
    app.shell.sheets.close(app.shell.sheets.top)


@pytest.mark.parametrize(
    ("devices", "comes"), [(POWER_BUTTON, True), (POWER_BUTTON + "\n" + KEYBOARD, False), (None, False)]
)
def test_the_keyboard_appears_by_itself_only_without_a_real_one(site, app, ui, tmp_path, monkeypatch, devices, comes):
    path = tmp_path / "devices"
    if devices is not None:
        path.write_text(devices)
    monkeypatch.setattr(application, "INPUT_DEVICES", path)
    site.container.catalogue.change_settings(keyboard="auto")
    dialog = robot_dialog(ui)
    ui.tap(ui.find(FieldInput, dialog.ids.name_field))
    ui.advance(0.5)
    assert bool(ui.find_all(DockedKeyboard)) is comes


def test_a_keyboard_is_known_by_its_repeat_and_its_lights():
    assert has_keyboard(KEYBOARD)
    assert not has_keyboard(POWER_BUTTON)
    assert not has_keyboard("")


@pytest.mark.parametrize(
    ("digitizer", "laptop", "docked", "lacks"),
    [(0xC1, 0, 0, True), (0xC1, 1, 0, False), (0xC1, 0, 1, False), (0, 0, 0, False), (2, 0, 0, False)],
)
def test_windows_says_whether_a_tablet_has_a_keyboard(digitizer, laptop, docked, lacks):
    assert lacks_keyboard({94: digitizer, 0x2003: laptop, 0x2004: docked}.get) is lacks
