"""A double tap is one tap: after something in front of the page has appeared or disappeared, it and the page take no
touch for a moment.

``rest`` is global, like the window. Each change is reported once; ignored touches never make the moment longer. It is
counted from the next frame: a frame may take long, and a touch while it was drawn was meant for what was visible
before.
"""

import math

from kivy.clock import Clock
from kivy.core.window import Window
from kivy.metrics import dp
from kivy.uix.behaviors import FocusBehavior

from app.widgets.places import places

DOUBLE_TAP = 0.6  # s within which a second tap belongs to the first
SETTLES = 0.4  # s in which a touch was still meant for what was there before
BY_ITSELF = 1.0  # s, if the user did not ask for what has appeared: a tap on the page may be on its way
INSTANT = 0.001  # s: a frame that falls on the end comes after it
SPOT = 48  # dp: as far from the first tap as the second may be
EVERYWHERE = (float("-inf"), float("-inf"), float("inf"), float("inf"))
PRESSES = (13, 271, 32, 27)  # keys: Enter, that of the keypad, space, Esc


class Rest:
    """Where touches are ignored and until when, and until when keys that press or close."""

    def __init__(self):
        self._areas = []  # (until, left, bottom, right, top), s of kivy's clock and px of the window
        self._finger = 0.0, 0.0  # the place of the last touch that was not ignored
        self._keys_until = [0.0]
        self._down: set[int] = set()  # keys

    def watch(self) -> None:
        """Start; before anything else binds to the window's touches."""
        Window.bind(on_touch_down=self._touch_down, on_key_up=self._key_up, focus=self._forget_keys)
        self.ask_first()

    def ask_first(self) -> None:
        """Get the window's keys before all present listeners: the one bound last is asked first."""
        Window.unbind(on_key_down=self._key_down)
        Window.bind(on_key_down=self._key_down)

    @property
    def is_on(self) -> bool:
        """Whether some touch would be ignored now."""
        return any(Clock.get_time() < until for until, *_area in self._areas)

    # ------------------------------------------------------------------ what goes and comes
    def after_closing(self) -> None:
        """Something in front of the page has disappeared: no touch or key for what was behind it."""
        self._ignore(DOUBLE_TAP)
        self.ignore_keys(DOUBLE_TAP)

    def after_opening(self, seconds=SETTLES) -> None:
        """Something has appeared in front of the page: a second tap there, or a second Enter, is not meant for it."""
        self._ignore(seconds)
        self.ignore_keys(SETTLES)
        self.after_moving()

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

    # ------------------------------------------------------------------ touches
    def _ignore(self, seconds, area=EVERYWHERE) -> None:
        now = Clock.get_time()
        self._areas = [*(known for known in self._areas if known[0] > now), _from_next_frame(seconds, *area)]

    def _touch_down(self, _window, touch) -> bool:
        now, (x, y) = Clock.get_time(), touch.pos
        if any(
            now < until and left <= x <= right and bottom <= y <= top for until, left, bottom, right, top in self._areas
        ):
            FocusBehavior.ignored_touch.append(touch)  # else it would end the typing in a field
            return True
        self._finger = x, y
        places.begin(touch)
        return False

    # ------------------------------------------------------------------ keys
    def ignore_keys(self, seconds) -> None:
        """Something has come or gone: a second Enter or Esc is not meant for what is there now."""
        self._keys_until = _from_next_frame(seconds)
        self.ask_first()

    def _key_down(self, _window, key, *_args) -> bool:
        """One that is held presses once, though the system repeats it."""
        is_repeated = key in self._down
        self._down.add(key)
        return key in PRESSES and (is_repeated or Clock.get_time() < self._keys_until[0])

    def _key_up(self, _window, key, *_args) -> None:
        self._down.discard(key)

    def _forget_keys(self, *_args) -> None:
        """Another window learns that they are released."""
        self._down.clear()


def _from_next_frame(seconds: float, *area: float) -> list[float]:
    """Until when, and where: counted from when the present frame has been drawn, before touches that came while it was are handed on."""
    until = [math.inf, *area]

    def count(_dt):
        until[0] = Clock.get_time() - INSTANT + seconds

    Clock.schedule_once(count, 0)
    return until


rest = Rest()
