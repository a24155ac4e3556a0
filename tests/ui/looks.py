"""What the design of a page promises, counted from its widgets: words, nested lists, sizes of text, small targets, filled buttons."""

from __future__ import annotations

import re
from collections.abc import Iterator

from kivy.metrics import Metrics, dp
from kivy.uix.label import Label
from kivy.uix.scrollview import ScrollView
from kivy.uix.widget import Widget

from app.widgets.buttons import CommandButton
from app.widgets.text import Ico
from tests.ui.checks import name_of, parents, shown, takes_presses, visible_area

SIZES = {14, 16, 18, 24, 40}  # sp
TOUCH = 48  # dp


def labels(root: Widget) -> Iterator[Label]:
    """Every text that can be seen; icons are none."""
    for widget, above in shown(root):
        if isinstance(widget, Label) and not isinstance(widget, Ico) and widget.text.strip():
            area = visible_area(widget, (*parents(root), *above))
            if area is not None and area[2] - area[0] > 1 and area[3] - area[1] > 1:
                yield widget


def words(root: Widget) -> list[str]:
    """All that can be read without scrolling; numbers and signs are no words."""
    texts = [re.sub(r"\[/?[a-z]+(=[^]]*)?]", "", label.text) if label.markup else label.text for label in labels(root)]
    return [word for text in texts for word in re.findall(r"[^\W\d_][\w’'-]*", text)]


def scrolls(root: Widget) -> list[str]:
    """Scroll views in a scroll view that scrolls, too."""
    views = [widget for widget, _above in shown(root) if isinstance(widget, ScrollView)]
    return [name_of(view) for view in views if any(isinstance(outer, ScrollView) for outer in parents(view))]


def sizes(root: Widget) -> set[int]:
    """Sizes of text in sp at the usual font scale."""
    return {round(label.font_size / dp(1) / Metrics.fontscale) for label in labels(root)}


def targets(root: Widget) -> list[str]:
    """What can be pressed and is smaller than ``TOUCH`` either way."""
    return [
        name_of(widget)
        for widget, _above in shown(root)
        if takes_presses(widget) and min(widget.width, widget.height) < dp(TOUCH) - 1
    ]


def filled(root: Widget) -> list[str]:
    """The texts of the filled buttons."""
    return [
        widget.text for widget, _above in shown(root) if isinstance(widget, CommandButton) and widget.style == "filled"
    ]
