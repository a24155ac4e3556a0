"""What can be pressed tells by its shape what it is: no two roles have the same corners, fill, outline, height and line below."""

from __future__ import annotations

from collections.abc import Callable
from itertools import combinations
from typing import NamedTuple

import pytest
from kivy.factory import Factory
from kivy.uix.widget import Widget

from app.widgets.buttons import ChoiceChip, CommandButton, Segment, Segments, Toggle
from app.widgets.display import SectionCard
from app.widgets.fields import Field, FieldInput
from app.widgets.list_row import Item, ListRow, RowMark
from app.widgets.scrolling import ScrollPage
from app.widgets.sheet import Sheet
from app.widgets.tokens import tk


class Look(NamedTuple):
    corners: tuple[int, ...]  # px, at most half of the height
    fill: tuple[float, ...]
    outline: tuple[float, ...]  # empty without one
    height: int
    divided: bool  # a line to the next one


def look_of(widget: Widget, divided: bool = False) -> Look:
    radius = (
        [4] * 4 if isinstance(widget, FieldInput) else widget.radius
    )  # a line that is typed into draws its own corners
    corners = tuple(int(min(corner, widget.height / 2)) for corner in radius)
    fill, width = tuple(widget.md_bg_color), getattr(widget, "line_width", 0)
    line = tuple(widget.line_color) if width and widget.line_color[3] else ()
    return Look(corners, fill if fill[3] else (), line if line != fill else (), round(widget.height), divided)


def row(**values) -> Callable[[], Widget]:
    return lambda: Factory.RowColumn(viewclass="ListRow", data=[Item(1, "Row", **values)])


ROLES: dict[str, tuple[Callable[[], Widget], type[Widget], dict]] = {
    "filled button": (lambda: CommandButton(style="filled", text="Save"), CommandButton, {}),
    "tonal button": (lambda: CommandButton(style="tonal", text="Pause"), CommandButton, {}),
    "outlined button": (lambda: CommandButton(text="Cancel"), CommandButton, {}),
    "text button": (lambda: CommandButton(style="text", text="Cancel"), CommandButton, {}),
    "risky button": (lambda: CommandButton(tone="fault", text="Restore"), CommandButton, {}),
    "answer": (lambda: CommandButton(tone="action", text="Yes"), CommandButton, {}),
    "button that is off": (lambda: CommandButton(style="filled", text="Resume", disabled=True), CommandButton, {}),
    "one of a few": (lambda: Segments(options=[(1, "Once"), (2, "Daily"), (3, "Weekly")]), Segment, {"key": 2}),
    "day": (lambda: Segments(options=[(1, "Mo"), (2, "Tu")], several=True, selected=[]), Segment, {"key": 2}),
    "filter chip": (lambda: ChoiceChip(text="All robots"), ChoiceChip, {}),
    "filter that is set": (lambda: ChoiceChip(text="7 days", active=True), ChoiceChip, {}),
    "field": (lambda: Field(label="Mission"), FieldInput, {}),
    "row": (row(), ListRow, {}),
    "chosen row": (row(look="chosen"), ListRow, {}),
    "head of rows": (row(look="head"), ListRow, {}),
    "box to tick": (row(ticked=False), RowMark, {}),
    "card": (SectionCard, SectionCard, {}),
}


def shown(ui, name: str) -> Look:
    make, kind, values = ROLES[name]
    page = ScrollPage()
    page.add_widget(make())
    ui.show(page, (300, 300))
    role = ui.find(kind, **values)
    if kind is CommandButton:
        role.height = 48
    ui.advance(0.1)
    return look_of(role, divided=kind is ListRow)


@pytest.mark.parametrize("theme", ["light", "dark"])
def test_no_two_roles_look_alike(ui, theme):
    tk.use(theme)
    looks = {name: shown(ui, name) for name in ROLES}
    assert [pair for pair in combinations(looks, 2) if looks[pair[0]] == looks[pair[1]]] == []


@pytest.mark.parametrize(
    ("name", "corner", "height"),
    [
        ("filled button", 24, 48),
        ("filter chip", 8, 48),
        ("field", 4, 56),
        ("row", 0, 56),
        ("head of rows", 0, 36),
        ("box to tick", 6, 28),
        ("one of a few", 8, 48),
    ],
)
def test_a_role_has_its_corners_and_height(ui, name, corner, height):
    found = shown(ui, name)
    assert (found.corners[0], found.height) == (corner, height)


def test_the_parts_of_a_sheet_are_one_filled_button_and_one_cross(ui):
    ui.show(sheet := Sheet(title="Aino", foot="Save"))
    ui.advance(0.1)
    filled = [button for button in ui.find_all(CommandButton, sheet) if button.style == "filled"]
    assert [(button.text, button.height) for button in filled] == [("Save", 72)]


def test_a_switch_is_no_button(ui):
    toggle = ui.show(Toggle(), (56, 48))
    assert look_of(toggle).fill == ()
