"""The keyboard on the screen leaves the field in use in sight: in every dialog with fields, in small windows, and from field to field."""

from __future__ import annotations

from collections.abc import Iterator

import pytest
from kivy.core.window import Window

from app.screens.common.overlays import Dialogs
from app.screens.common.sheets import Sheets
from app.widgets.buttons import CommandButton
from app.widgets.fields import Field, FieldInput
from app.widgets.items import Option
from app.widgets.keyboard import DockedKeyboard
from app.widgets.sheet import Sheet
from tests.support.examples import at_night
from tests.ui import checks

TAB = 9
SIZES = ((600, 480), (800, 480), (1280, 800))
DIALOGS = (
    "robot-sheet-new",
    "robot-sheet-problems",
    "mission-dialog",
    "settings-calendar-days",
    "scheduler-hold",
    "alarms-note",
)


@pytest.fixture(params=[SIZES[0], *at_night(*SIZES[1:])], ids="{0[0]}x{0[1]}".format)
def keys(ui, request) -> Iterator[DockedKeyboard]:
    before = Window.size
    Window.size = request.param
    keys = DockedKeyboard(lambda: True)
    keys.start()
    yield keys
    keys.stop()
    Window.size = before


def long_form() -> Sheet:
    sheet = Sheet(title="A form")
    for n in range(8):
        sheet.add_widget(Field(label=f"Field {n}", help="What to enter here"))
    return Sheets().show(sheet)


def assert_in_sight(keys: DockedKeyboard, field: FieldInput) -> None:
    whole, seen = checks.area(field), checks.visible_area(field, checks.parents(field))
    assert seen == pytest.approx(whole, abs=2), f"{checks.name_of(field)} is cut off"
    assert keys.top <= whole[1]
    assert whole[3] <= Window.height


def assert_free(keys: DockedKeyboard, dialog: Sheet) -> None:
    """Its buttons, if it has any, are above the keyboard."""
    foot = dialog.ids.foot if isinstance(dialog, Sheet) else dialog.ids.button_container
    buttons = [button for button in foot.walk(restrict=True) if isinstance(button, CommandButton) and button.is_seen]
    assert all(button.to_window(*button.pos)[1] >= keys.top for button in buttons)
    assert buttons or not dialog.foot


def fields_of(ui, dialog: Sheet) -> list[FieldInput]:
    return [field for field in ui.find_all(FieldInput, dialog) if not field.disabled and field.width > 1]


@pytest.mark.long
@pytest.mark.parametrize("name", DIALOGS)
def test_every_field_of_the_apps_dialogs_is_above_the_keyboard(ui, walk, name):
    picture = next(picture for picture in walk.pictures if picture.name == name)
    keys, before = DockedKeyboard(lambda: True), Window.size
    try:
        picture.build(walk._studio)
        ui.advance(0.3)
        keys.start()
        for Window.size in SIZES:
            ui.advance(0.3)
            form = walk._studio.dialogs.top or ui.find(Sheet)
            fields = fields_of(ui, form)
            assert fields
            for field in (*fields, fields[0]):
                field.focus = True
                ui.advance(0.4)
                assert_in_sight(keys, field)
                assert_free(keys, form)
            field.focus = False
            ui.advance(0.4)
    finally:
        keys.stop()
        walk._studio.clear()
        Window.size = before


def test_the_focused_field_is_above_the_keyboard(ui, keys):
    dialog = long_form()
    ui.advance(0.3)
    fields = fields_of(ui, dialog)
    assert fields
    high = dialog.height
    for field in (*fields, fields[0]):
        field.focus = True
        ui.advance(0.4)
        assert_in_sight(keys, field)
    field.focus = False
    ui.advance(0.4)
    assert dialog.height == high


def test_the_search_field_of_a_choice_is_above_the_keyboard(ui, keys):
    picker = Dialogs().choose("Mission", [Option(n, f"Mission {n}") for n in range(30)], print)
    ui.advance(0.3)
    [field] = fields_of(ui, picker)
    field.focus = True
    ui.advance(0.4)
    assert_in_sight(keys, field)


def test_tab_of_a_real_keyboard_leads_through_a_form_in_sight(ui, keys):
    dialog = long_form()
    ui.advance(0.3)
    first, *_others = fields = fields_of(ui, dialog)
    first.focus = True
    ui.advance(0.4)
    for field in fields[1:]:
        ui.key(TAB)
        ui.advance(0.4)
        assert field.focus
        assert checks.is_seen(field)
    assert not ui.find_all(DockedKeyboard)


def test_a_form_can_be_scrolled_to_its_last_field_while_the_keyboard_is_there(ui, keys):
    dialog = long_form()
    ui.advance(0.3)
    first, *_others, last = fields_of(ui, dialog)
    first.focus = True
    ui.advance(0.4)
    dialog.ids.page.scroll_y = 0
    ui.advance(0.2)
    assert_in_sight(keys, last)
    ui.tap(last)
    assert last.focus
    ui.advance(0.4)
    assert_in_sight(keys, last)
