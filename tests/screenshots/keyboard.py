"""The keyboard on the screen, under a dialog's field and under a number field."""

from __future__ import annotations

from typing import Any

from app.screens.settings.robot_sheet import RobotSheet
from app.widgets.fields import Field
from app.widgets.keyboard import DockedKeyboard
from tests.screenshots.registry import BOTH, GLOVES, LARGE_TEXT, SMALL, picture
from tests.screenshots.settings import Plant

SIZES = (*BOTH, SMALL, LARGE_TEXT, GLOVES)


def typed_into(studio: Any, field: Any) -> Any:
    """The keyboard under ``field``; it goes with the picture, or dialogs of later ones would lie above it."""
    keyboard = DockedKeyboard(lambda: True)
    keyboard.start()
    studio.afterwards(keyboard.stop)
    field.focus = True
    studio.driver.advance(0.3)
    keyboard._watch.cancel()
    return keyboard


@picture("keyboard", sizes=SIZES)
def letters(studio: Any) -> Any:
    context = Plant(studio).screen(studio).vm.context
    dialog = RobotSheet(context)
    studio.afterwards(context.shell.sheets.give_up)
    context.shell.sheets.show(dialog)
    studio.driver.advance(0.2)
    field: Field = dialog.ids.connection.children[0].ids.username_field
    return typed_into(studio, field)


@picture("keyboard-numbers", sizes=SIZES)
def numbers(studio: Any) -> Any:
    screen = Plant(studio).screen(studio, "scheduler")
    field = next(widget for widget in screen.walk() if isinstance(widget, Field) and widget.kind == "step")
    return typed_into(studio, field)
