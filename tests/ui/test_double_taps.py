"""A double tap is one tap: when the first tap opens or closes something, the second does not reach what is then under
the finger.

Menus of tests/screenshots are tapped twice at their buttons, outside and at a grid of points, above something that would take
any touch; the ``long`` test does that in every picture.
"""

from __future__ import annotations

import contextlib
from collections.abc import Iterator
from itertools import cycle

import pytest
from kivy.core.window import Window
from kivy.event import EventDispatcher
from kivy.uix.behaviors import ButtonBehavior
from kivy.uix.widget import Widget

from app.widgets.menu import Menu
from app.widgets.rest import DOUBLE_TAP
from tests.screenshots.registry import Picture
from tests.ui.walk import Walk

GAPS = (0.15, 0.3, 0.45, 0.58)  # s from the beginning of a tap to that of the next
ALIKE = 2  # of buttons of one class in a menu
GRID = 7  # points in each direction
PARTS = 8


class Beneath(ButtonBehavior, Widget):
    """Fills the window and takes every touch."""


class Presses:
    """The buttons that were pressed although the menus had changed since the last tap began."""

    def __init__(self, monkeypatch: pytest.MonkeyPatch) -> None:
        self.wrong: list[str] = []
        self.before: list[Menu] | None = None

        def dispatch(widget: Widget, event: str, *values: object) -> object:
            if event == "on_release" and self.before is not None and self.has_changed:
                self.wrong.append(f"{type(widget).__name__} {getattr(widget, 'text', '')}".strip())
            with contextlib.suppress(
                AttributeError
            ):  # a picture's services are stand-ins: what no picture needs they lack
                return EventDispatcher.dispatch(widget, event, *values)
            return None

        monkeypatch.setattr(ButtonBehavior, "dispatch", dispatch, raising=False)

    @property
    def has_changed(self) -> bool:
        return self.before != menus()


def menus() -> list[Menu]:
    return [top for top in Window.children if isinstance(top, Menu)]


def lay_beneath(top: Menu) -> None:
    """Put something that takes touches right behind that menu."""
    above = [*Window.children[: Window.children.index(top) + 1], top._scrim]
    for child in above:
        Window.remove_widget(child)
    for child in (Beneath(), *reversed(above)):
        if child.parent is None:
            Window.add_widget(child)


def middles(top: Menu, ui) -> Iterator[tuple[float, float]]:
    """The middles of its buttons; of similar ones only a few."""
    seen: dict[object, int] = {}
    for widget in ui.seen(top):
        if isinstance(widget, ButtonBehavior) and widget is not top and not widget.disabled and min(widget.size) > 1:
            kind = type(widget), getattr(widget, "text", "") if not hasattr(widget, "host") else ""
            seen[kind] = seen.get(kind, 0) + 1
            x, y = widget.to_window(*widget.center)
            if seen[kind] <= ALIKE and 0 < x < Window.width and 0 < y < Window.height:
                yield x, y


def grid(top: Menu) -> Iterator[tuple[float, float]]:
    for column in range(GRID):
        for row in range(GRID):
            yield top.x + top.width * (column + 0.5) / GRID, top.y + top.height * (row + 0.5) / GRID


@pytest.fixture
def presses(monkeypatch) -> Presses:
    return Presses(monkeypatch)


def double_tapped(ui, walk: Walk, presses: Presses, picture: Picture) -> list[str]:
    """What the second taps have pressed in and behind the topmost menu of that picture, built again each time one of them has changed
    which menus are open."""
    found: list[str] = []
    left, gaps = None, cycle(GAPS)
    while left is None or left:
        with walk.built(picture):
            ui.skip(DOUBLE_TAP)
            if not menus():
                return []
            top = menus()[0]
            lay_beneath(top)
            ui.advance()
            if left is None:
                left = [(1, 1), *middles(top, ui), *grid(top)]
            presses.before = menus()
            while left and not presses.has_changed:
                place, gap = left.pop(), next(gaps)
                ui.tap_twice(place, gap)
                found += [
                    f"{picture.name}, {type(top).__name__} at {place} after {gap} s: {press}" for press in presses.wrong
                ]
                presses.wrong.clear()
            presses.before = None
    return found


@pytest.mark.long
def test_the_second_tap_on_a_menu_presses_nothing(ui, walk, presses):
    picture = next(picture for picture in walk.pictures if picture.name == "dialog-menu")
    found = double_tapped(ui, walk, presses, picture)
    assert not found, "\n".join(["", *found])


@pytest.mark.long
@pytest.mark.parametrize("part", range(PARTS))
def test_nor_does_it_anywhere_on_any_menu(ui, walk, presses, part):
    found = [line for picture in walk.pictures[part::PARTS] for line in double_tapped(ui, walk, presses, picture)]
    assert not found, "\n".join(["", *found])
