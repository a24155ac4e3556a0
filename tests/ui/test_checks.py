"""The checks of the walk find planted faults and accept what is visible."""

from __future__ import annotations

import pytest
from kivy.lang import Builder

from tests.ui import checks

HIDDEN = {
    "a transparent button": "Button:\n            opacity: 0",
    "a transparent button that is off": "Button:\n            opacity: 0\n            disabled: True",
    "in a transparent box": "BoxLayout:\n            opacity: 0\n            Button:",
    "a label of a box that is off": "BoxLayout:\n            opacity: 0\n            disabled: True\n            Label:",
    "a field that leaves a box without height": "BoxLayout:\n            size_hint_y: None\n            height: 0\n"
    "            FieldInput:\n                size_hint: None, None\n"
    "                size: 90, 50",
    "a list beside its box": "FloatLayout:\n            ScrollView:\n                size_hint: None, None\n                size: 90, 50\n"
    "                pos: self.parent.right + 20, self.parent.y",
}
SEEN = {
    "a button": "Button:",
    "a button that is off": "Button:\n            disabled: True\n            opacity: .5",
    "a command that is hidden": "CommandButton:\n            text: 'Go'\n            opacity: 0",
    "a command that is hidden and off": "IconButton:\n            icon: 'close'\n            opacity: 0\n            disabled: True",
    "what a box holds back": "Surface:\n            opacity: 0\n            disabled: True\n            Button:",
    "a command without a width": "CommandButton:\n            text: 'Go'\n            disabled: True\n"
    "            size_hint_x: None\n            width: 0",
    "what is scrolled away": "ScrollView:\n            BoxLayout:\n                size_hint_y: None\n                height: 4000\n"
    "                orientation: 'vertical'\n                Button:\n                Button:",
}


def laid_out(ui, part: str):
    root = Builder.load_string(
        f"FloatLayout:\n    BoxLayout:\n        size_hint: None, None\n        size: 300, 200\n"
        f"        pos: 100, 100\n        {part}"
    )
    ui.show(root)
    ui.advance(0.1)
    return root


@pytest.mark.parametrize("part", HIDDEN.values(), ids=HIDDEN)
def test_hidden_widgets_that_keep_touches_are_found(ui, part):
    found = list(checks.swallowed_touches(laid_out(ui, part)))
    assert len(found) == 1
    assert "keeps touches at" in found[0]


@pytest.mark.parametrize("part", SEEN.values(), ids=SEEN)
def test_visible_widgets_and_those_that_pass_touches_are_no_fault(ui, part):
    assert list(checks.swallowed_touches(laid_out(ui, part))) == []


@pytest.mark.parametrize(
    "hidden",
    [
        "opacity: 0",
        "opacity: 0\n        disabled: True",
        "opacity: 0\n        busy: True",
        "disabled: True\n        width: 0\n        size_hint_x: None\n        pos: 400, 300",
    ],
)
def test_a_hidden_command_lets_the_touch_through_to_what_lies_under_it(ui, hidden):
    pressed = []
    root = Builder.load_string(f"FloatLayout:\n    Button:\n    CommandButton:\n        text: 'Go'\n        {hidden}")
    ui.show(root)
    ui.advance(0.1)
    command, under = root.children
    under.bind(on_release=lambda _button: pressed.append("under"))
    command.bind(on_release=lambda _button: pressed.append("hidden"))
    ui.tap_at(*command.center)
    assert pressed == ["under"]


def test_fields_that_are_not_level_are_found(ui):
    root = laid_out(
        ui,
        """MDGridLayout:
            cols: 2
            Field:
                kind: "step"
                label: 'Left'
                help: 'several lines of help ' * 9
            Field:
                kind: "step"
                label: 'Right'""",
    )
    assert [found for found in checks.problems(root) if "level" in found]
