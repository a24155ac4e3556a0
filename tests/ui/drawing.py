"""What the tests of widgets share: recorded events, fingers on a chart, and what is drawn there."""

from __future__ import annotations

from kivy.graphics import Rectangle
from kivy.tests.common import UnitTestTouch

from app.screens.scheduler.timeline import Bar, Lane

LANES = [Lane("Aino", bars=(Bar("a", 1, 2), Bar("b", 1.5, 3, "Empties"))), Lane("Veikko", bars=(Bar("c", 20, 20.1),))]


def fired(widget, event: str) -> list[tuple]:
    calls: list[tuple] = []
    widget.bind(**{event: lambda _widget, *values: calls.append(values)})
    return calls


def hex_of(colour) -> str:
    return "#" + "".join(f"{round(channel * 255):02x}" for channel in colour[:3])


def fingers(chart, *paths):
    """Touches that move together: a list of points for each."""
    touches = [UnitTestTouch(*path[0]) for path in paths]
    for touch in touches:
        touch.touch_down()
    for step in zip(*(path[1:] for path in paths), strict=True):
        for touch, (x, y) in zip(touches, step, strict=True):
            touch.touch_move(x, y)
    for touch in touches:
        touch.touch_up()


def put_down(x, y):
    touch = UnitTestTouch(x, y)
    touch.touch_down()
    return touch


def instructions(group) -> list:
    return [group, *(one for child in getattr(group, "children", ()) for one in instructions(child))]


def textures(group) -> list:
    return [one.texture for one in instructions(group) if isinstance(one, Rectangle)]


def words_of(chart) -> list[tuple[float, object]]:
    """The visible names of bars and where they begin."""
    return [
        (one.pos[0] + chart._drawing.moved, one.texture)
        for one in instructions(chart._drawing._words)
        if isinstance(one, Rectangle)
    ]
