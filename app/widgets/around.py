"""Where a widget is in the tree."""

from collections.abc import Iterator
from typing import Any

from kivy.uix.widget import Widget


def around(widget: Any, kind: type = Widget) -> Iterator[Any]:
    """``widget`` and all that it is in, from the inside out, without the window: those of that kind."""
    while isinstance(widget, Widget):
        if isinstance(widget, kind):
            yield widget
        widget = widget.parent
