"""A double tap is one tap: after something in front of the page has appeared or disappeared, it and the page take no
touch for a moment.

``rest`` is global, like the window. Each change is reported once; ignored touches never make the moment longer. It is
counted from the next frame: a frame may take long, and a touch while it was drawn was meant for what was visible
before.
"""

import math
import weakref

from kivy.base import EventLoop
from kivy.clock import Clock
from kivy.core.window import Window
from kivy.metrics import dp
from kivy.uix.behaviors import ButtonBehavior, FocusBehavior
from kivy.uix.scrollview import ScrollView

from app.widgets.places import places

DOUBLE_TAP = 0.6  # s within which a second tap belongs to the first
SETTLES = 0.4  # s in which a touch was still meant for what was there before
BY_ITSELF = 1.0  # s, if the user did not ask for what has appeared: a tap on the page may be on its way
INSTANT = 0.001  # s: a frame that falls on the end comes after it
SPOT = 48  # dp: as far from the first tap as the second may be
SHORT = 1.0  # s: a page that scrolls hands on a tap a little after the finger has left
EVERYWHERE = (float("-inf"), float("-inf"), float("inf"), float("inf"))
PRESSES = (13, 271, 32)  # keys: Enter, that of the keypad, space
MOVES = (9, 273, 274, 275, 276)  # Tab and arrows, which only move the ring


class Rest:
    """Where touches are ignored and until when, and which keys; never Tab and the arrows."""

    def __init__(self):
        self._areas = []  # (until, left, bottom, right, top), s of kivy's clock and px of the window
        self._finger = 0.0, 0.0  # the place of the last touch that was not ignored
        self._touches = []  # (when it came down, weak reference to it)
        self._keys_until = 0.0
        self._takes_letters = False  # what has come takes them at once
        self._down: dict[int, int] = {}  # keys that are down: how often each was reported since it was pressed
        self._ignored: set[int] = set()  # those that do nothing until they are released

    def watch(self) -> None:
        """Start; before anything else binds to the window's touches."""
        Window.bind(on_touch_down=self._touch_down, on_key_up=self._key_up, focus=self._forget_keys)
        self.ask_first()

    def ask_first(self) -> None:
        """Get the window's keys before all present listeners: the one bound last is asked first."""
        handlers = {"on_key_down": self._key_down, "on_textinput": self._typed}
        Window.unbind(**handlers)
        Window.bind(**handlers)

    @property
    def is_on(self) -> bool:
        """Whether some touch would be ignored now."""
        return any(Clock.get_time() < until for until, *_area in self._areas)

    # ------------------------------------------------------------------ what goes and comes
    def after_closing(self) -> None:
        """Something in front of the page has disappeared: no touch or key for what was behind it."""
        self._ignore(DOUBLE_TAP)
        self.keys_after_closing()

    def keys_after_closing(self) -> None:
        """None for what is behind it."""
        self._ignore_keys(DOUBLE_TAP, takes_letters=False)

    def after_opening(self, seconds=SETTLES) -> None:
        """Something has appeared in front of the page: a second tap there, or a second Enter, is not meant for it, but
        typed text is."""
        self._ignore(seconds)
        self.keys_after_opening()
        self.after_moving()

    def keys_after_opening(self) -> None:
        """A second Enter is not meant for it."""
        self._ignore_keys(SETTLES, takes_letters=True)

    def after_moving(self) -> None:
        """Something else is where the finger was."""
        x, y, far = *self._finger, dp(SPOT)
        self._ignore(DOUBLE_TAP, (x - far, y - far, x + far, y + far))

    def after_leaving(self, widget, seconds=DOUBLE_TAP) -> None:
        """That has disappeared, and covered only what it lay on."""
        self._ignore(seconds, (*widget.to_window(*widget.pos), *widget.to_window(widget.right, widget.top)))

    def after_pressing(self, widget) -> None:
        """That disappears; if it was touched last, something else may now be under the finger."""
        if widget.collide_point(*widget.to_widget(*self._finger)):
            self.after_moving()

    def let_go(self) -> None:
        """Present touches press nothing, except the one being handled. Widgets that track touches themselves have a
        ``let_go(touch)``."""
        now = Clock.get_time()
        just_left = [reference() for began, reference in self._touches if now - began < SHORT]
        for touch in {id(touch): touch for touch in (*EventLoop.touches, *just_left) if touch is not None}.values():
            if touch.grab_current is None:
                _let_go(touch)

    # ------------------------------------------------------------------ touches
    def _ignore(self, seconds, area=EVERYWHERE) -> None:
        now, ignored = Clock.get_time(), [math.inf, *area]
        self._areas = [known for known in self._areas if known[0] > now] + [ignored]

        def count(now):
            ignored[0] = now + seconds

        from_next_frame(count)

    def _touch_down(self, _window, touch) -> bool:
        now, (x, y) = Clock.get_time(), touch.pos
        if any(
            now < until and left <= x <= right and bottom <= y <= top for until, left, bottom, right, top in self._areas
        ):
            FocusBehavior.ignored_touch.append(touch)  # else it would end the typing in a field
            return True
        self._finger = x, y
        places.begin(touch)
        self._touches = [(began, known) for began, known in self._touches if now - began < SHORT] + [
            (now, weakref.ref(touch))
        ]
        return False

    # ------------------------------------------------------------------ keys
    def is_held(self, key: int) -> bool:
        """Whether the key that has just been reported was down before: the system repeats it."""
        return self._down.get(key, 0) > 1

    def _ignore_keys(self, seconds, takes_letters) -> None:
        """Ignore keys that are down now until they are released: the system may begin to repeat them later."""
        self._keys_until, self._takes_letters = math.inf, takes_letters

        def count(now):
            self._keys_until = now + seconds

        from_next_frame(count)
        self._ignored.update(key for key in self._down if key not in MOVES)
        self.ask_first()

    def _key_down(self, _window, key, *_args) -> bool:
        self._down[key] = self._down.get(key, 0) + 1
        if Clock.get_time() < self._keys_until and (key in PRESSES if self._takes_letters else key not in MOVES):
            self._ignored.add(key)
        return key in self._ignored

    def _typed(self, *_args) -> bool:
        return Clock.get_time() < self._keys_until and not self._takes_letters

    def _key_up(self, _window, key, *_args) -> None:
        self._down.pop(key, None)
        self._ignored.discard(key)

    def _forget_keys(self, *_args) -> None:
        """Another window learns that they are released."""
        self._down.clear()
        self._ignored.clear()


def from_next_frame(count) -> None:
    """Call ``count`` with the time when the present frame has been drawn, before touches that came while it was are handed on."""
    Clock.schedule_once(lambda _dt: count(Clock.get_time() - INSTANT), 0)


def _let_go(touch) -> None:
    for reference in touch.grab_list[:]:
        widget = reference()
        if isinstance(widget, ButtonBehavior):
            touch.ungrab(widget)
            widget.state = "normal"
        elif isinstance(widget, ScrollView) and (drag := touch.ud.get(widget._get_uid())):
            drag["mode"] = "scroll"  # no tap
        elif hasattr(widget, "let_go"):
            widget.let_go(touch)


rest = Rest()
