"""Hands and eyes of a test: virtual time, taps, typing, keys, and what can be seen.

def test_cancel(ui):
    row = ui.show(Factory.ListRow(item=Item(1, "Deliver")))
    ui.tap(row)
    assert "Deliver" in ui.texts()
"""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator

from kivy.base import EventLoop
from kivy.clock import Clock
from kivy.core.window import Window
from kivy.effects import kinetic, scroll
from kivy.input import motionevent
from kivy.uix.behaviors import button
from kivy.uix.label import Label
from kivy.uix.widget import Widget

from app.widgets.places import places
from app.widgets.rest import rest
from tests.ui.checks import parents

FRAME = 1 / 60
_WATCHERS = (kinetic, scroll, motionevent, button)  # kivy's modules that ask the wall clock how long a touch took


class VirtualTime:
    """Replaces the time source of kivy's Clock, so that animations and timeouts take no wall time and always the same frames.

    One instance per process: time that ran backwards between two tests would leave the later one waiting for ever.
    """

    _only: VirtualTime | None = None

    def __new__(cls):
        if cls._only is None:
            cls._only = self = super().__new__(cls)
            self.now = time.perf_counter()
            Clock.time = lambda: self.now
            Clock._max_fps = 0  # Clock.idle() must not sleep
            for module in _WATCHERS:  # a fling of 100 px in no wall time would be one of the speed of light
                module.time = lambda: self.now
        return cls._only


class Driver:
    def __init__(self, app=None) -> None:
        self.app = app
        self.window = Window
        self._time = VirtualTime()

    # ------------------------------------------------------------------ time
    def advance(self, seconds: float = 0.0) -> None:
        """Run the frames of ``seconds``, at least three, so that layouts settle. Only the last is drawn: in
        software each costs as much as all the rest of a frame."""
        frames = max(3, round(seconds / FRAME))
        window = EventLoop.window
        window.on_draw = window.on_flip = lambda *_args: None
        try:
            for _n in range(frames - 1):
                self._time.now += FRAME
                EventLoop.idle()
        finally:
            del window.on_draw, window.on_flip
        self._time.now += FRAME
        EventLoop.idle()

    def skip(self, seconds: float) -> None:
        """Let so much time pass at once: everything due in it happens now."""
        self._time.now += seconds
        self.advance()

    def frames_drawn(self, seconds: float) -> int:
        """Run the frames of ``seconds``; returns how many of them had something new to draw."""
        drawn: list[None] = []

        def note(_window: Window) -> None:
            drawn.append(None)

        Window.bind(on_draw=note)
        for _n in range(round(seconds / FRAME)):
            self._time.now += FRAME
            EventLoop.idle()
        Window.unbind(on_draw=note)
        return len(drawn)

    def wait(self, condition: Callable[[], object], seconds: float = 60.0) -> None:
        """Run frames until ``condition()`` holds that another thread brings about; AssertionError after ``seconds`` of wall time."""
        end, pause = time.monotonic() + seconds, 0.002
        while not condition():
            assert time.monotonic() < end, f"still not after {seconds} s: {condition}"
            self.advance()
            time.sleep(pause)
            pause = min(pause * 1.05, 0.02)  # what takes long needs no more frames than it takes to see it soon

    # ------------------------------------------------------------------ the stage
    def show(self, widget: Widget, size: tuple[float, float] | None = None) -> Widget:
        """Put ``widget`` alone on screen: filling it, or ``size`` large at the top left."""
        for child in list(Window.children):
            Window.remove_widget(child)
        Window.add_widget(widget)
        if size is not None:
            widget.size_hint = None, None
            widget.size = size
            widget.pos = 0, Window.height - size[1]
        self.advance()
        return widget

    # ------------------------------------------------------------------ hands
    def tap(self, widget: Widget, hold: float = 0.05) -> None:
        """Touch the middle of ``widget`` for ``hold`` seconds, once the page has stopped moving. It must be on
        screen."""
        self.press(widget)(hold)

    def press(self, widget: Widget) -> Callable[[float], None]:
        """Put a finger down on ``widget``; call what comes back to lift it after so many seconds."""
        from kivy.tests.common import UnitTestTouch

        while rest.is_on or any(
            getattr(part, "has_just_moved", False) or places.has_just_moved(part)
            for top in Window.children
            for part in (top, *top.children, widget, *parents(widget))
        ):
            self.advance()
        x, y = widget.to_window(*widget.center)
        on_screen = 0 <= x <= Window.width and 0 <= y <= Window.height
        assert on_screen, f"{widget} is not on screen: {x:.0f}, {y:.0f}"
        touch = UnitTestTouch(x, y)
        touch.touch_down()
        self.advance()

        def lift(after: float = 0.05) -> None:
            self.advance(after)
            touch.touch_up()
            self.advance(0.3)

        return lift

    def tap_at(self, x: float, y: float) -> None:
        """Touch a point of the window."""
        from kivy.tests.common import UnitTestTouch

        touch = UnitTestTouch(x, y)
        touch.touch_down()
        self.advance(0.05)
        touch.touch_up()
        self.advance(0.3)

    def tap_twice(self, place: tuple[float, float], gap: float, hold: float = 0.05) -> None:
        """A double tap on that point of the window: ``gap`` s from the beginning of the first to that of the second."""
        from kivy.tests.common import UnitTestTouch

        for pause in (gap - hold, 0.4):  # a page that scrolls hands on a tap a little later
            touch = UnitTestTouch(*place)
            touch.touch_down()
            self.advance(hold)
            touch.touch_up()
            self.advance(pause)

    def wheel(self, widget: Widget, notches: int, *, sideways: bool = False) -> None:
        """Turn the mouse's wheel over the middle of ``widget``: by so many notches downwards, or upwards (< 0); ``sideways`` to
        the right, or to the left."""
        from kivy.tests.common import UnitTestTouch

        for _n in range(abs(notches)):
            touch = UnitTestTouch(*widget.to_window(*widget.center))
            touch.profile = [*touch.profile, "button"]
            ways = ("scrollleft", "scrollright") if sideways else ("scrollup", "scrolldown")
            touch.button = ways[notches < 0]  # as kivy calls them, after what the page does
            touch.touch_down()
            touch.touch_up()
            self.advance()

    def drag(self, widget: Widget, dx: float, dy: float, steps: int = 10) -> None:
        """Drag from the middle of ``widget`` by that many px, and release after a moment of rest, so that nothing keeps
        moving."""
        from kivy.tests.common import UnitTestTouch

        x, y = widget.to_window(*widget.center)
        touch = UnitTestTouch(x, y)
        touch.touch_down()
        self.advance()
        for n in range(1, steps + 1):
            touch.touch_move(x + dx * n / steps, y + dy * n / steps)
            self.advance()
        self.advance(0.5)
        touch.touch_up()
        self.advance(1)

    def tap_text(self, text: str) -> None:
        """Tap what shows ``text``."""
        self.tap(self.find(text=text))

    def type(self, field: Widget, text: str) -> None:
        """Focus ``field`` (anything with ``focus``) and type ``text`` at its end."""
        field.focus = True
        self.advance(0.4)
        for character in text:
            Window.dispatch("on_textinput", character)
        self.advance(0.1)

    def key(self, code: int, text: str = "") -> None:
        """Press and release a key: 27 Esc, 13 Enter, 8 backspace."""
        self.key_down(code, text)
        Window.dispatch("on_key_up", code, 0)
        self.advance(0.3)

    def key_down(self, code: int, text: str = "", modifiers: tuple[str, ...] = ()) -> None:
        """As kivy's window reports a key, repeatedly while it is held."""
        if not Window.dispatch("on_key_down", code, 0, text, list(modifiers)):
            Window.dispatch("on_keyboard", code, 0, text, list(modifiers))

    # ------------------------------------------------------------------ eyes
    def seen(self, root: Widget | None = None) -> Iterator[Widget]:
        """What is shown, topmost first: not transparent, not without size."""
        for top in [root] if root is not None else list(Window.children):
            yield from self._walk(top)

    @staticmethod
    def _walk(top: Widget) -> Iterator[Widget]:
        waiting = [top]
        while waiting:
            widget = waiting.pop()
            if widget.opacity:
                yield widget
                waiting += widget.children  # the last of them was added first

    def find_all(self, kind: type | None = None, /, root: Widget | None = None, **values) -> list[Widget]:
        """All that is shown of class ``kind`` with those property values (a row's are also those of its item), in reading order of the
        tree."""
        missing = object()

        def value_of(widget: Widget, name: str) -> object:
            return getattr(widget, name, getattr(getattr(widget, "item", None), name, missing))

        return [
            widget
            for widget in self.seen(root)
            if (kind is None or isinstance(widget, kind))
            and all(value_of(widget, name) == value for name, value in values.items())
        ]

    def find(self, kind: type | None = None, /, root: Widget | None = None, **values) -> Widget:
        """The first such widget; raises LookupError without one."""
        found = self.find_all(kind, root, **values)
        if not found:
            raise LookupError(
                f"nothing shown is {kind.__name__ if kind else 'a widget'} with {values}; texts: {self.texts(root)}"
            )
        return found[0]

    def texts(self, root: Widget | None = None) -> list[str]:
        """All texts that can be read, icons left out."""
        return [
            widget.text
            for widget in self.seen(root)
            if isinstance(widget, Label) and widget.text and widget.font_name != "Icons" and widget.width > 1
        ]
