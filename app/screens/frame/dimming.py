"""The screen at night: dark when it was left alone, and bright again with the first touch or key, which does nothing else."""

from __future__ import annotations

from datetime import datetime
from typing import Any

from kivy.core.window import Window
from kivy.graphics import Color, InstructionGroup, Rectangle

from app.domain.clock import Clock
from app.domain.models import Settings
from app.screens.common.formats import local
from app.widgets.rest import rest

LEFT_ALONE = 120.0  # s without a touch or a key
DARKNESS = 0.88  # of black over everything


def is_night(settings: Settings, now: datetime) -> bool:
    """Whether the screen may be dimmed now, by the hours of the settings."""
    begins, ends, hour = settings.dim_from, settings.dim_until, local(now, settings.timezone).hour
    if begins is None:
        return False
    return begins <= hour < ends if begins < ends else hour >= begins or hour < ends


class Dimming:
    """Active from ``start`` to ``stop``."""

    def __init__(self, clock: Clock) -> None:
        self._clock = clock
        self._used_at = 0.0  # s of the monotonic clock
        self._shade: InstructionGroup | None = None  # while it is dark
        self._waking: Any = None  # the touch or the key that made it bright, until it is lifted
        self._signs = dict.fromkeys(
            ("on_touch_down", "on_touch_move", "on_touch_up", "on_key_down", "on_textinput"), self._used
        )
        self._guards = {
            "on_touch_down": self._woken_by_touch,
            "on_touch_move": self._is_waking,
            "on_touch_up": self._is_waking,
            "on_key_down": self._woken_by_key,
            "on_key_up": self._is_lifted,
            "on_textinput": self._is_typed_by_it,
        }

    @property
    def is_dark(self) -> bool:
        return self._shade is not None

    def start(self) -> None:
        Window.bind(**self._signs)
        self._used()

    def stop(self) -> None:
        self._brighten()
        Window.unbind(**self._signs)
        Window.unbind(**self._guards)

    def look(self, may_dim: bool) -> None:
        """Once a second. ``may_dim``: it is night, and no alarm waits for a person."""
        if not may_dim:
            self._brighten()
        elif not self.is_dark and self._clock.monotonic() - self._used_at >= LEFT_ALONE:
            self._darken()

    # ------------------------------------------------------------------ the shade
    def _darken(self) -> None:
        self._shade = InstructionGroup()
        self._shade.add(Color(0, 0, 0, DARKNESS))
        self._cover = Rectangle(size=Window.size)
        self._shade.add(self._cover)
        Window.canvas.after.add(self._shade)
        Window.bind(size=self._resized)
        Window.unbind(**self._guards)
        Window.bind(**self._guards)  # the one bound last is asked first

    def _resized(self, _window: Any, size: tuple[float, float]) -> None:
        self._cover.size = size

    def _brighten(self) -> None:
        if self._shade is not None:
            Window.unbind(size=self._resized)
            Window.canvas.after.remove(self._shade)
            self._shade = None

    # ------------------------------------------------------------------ touches and keys
    def _used(self, *_args: Any) -> None:
        self._used_at = self._clock.monotonic()

    def _woken_by_touch(self, _window: Any, touch: Any) -> bool:
        if self.is_dark:
            self._waking = touch
            self._wake()
            return True
        return False

    def _is_waking(self, _window: Any, touch: Any) -> bool:
        return touch is self._waking

    def _woken_by_key(self, _window: Any, key: int, *_args: Any) -> bool:
        if self.is_dark:
            self._waking = key
            self._wake()
            return True
        if key != self._waking:  # the one that was lifted over another window
            self._waking = None
        return False

    def _is_typed_by_it(self, *_args: Any) -> bool:
        """The letter of a key comes after the key."""
        return isinstance(self._waking, int)

    def _is_lifted(self, _window: Any, key: int, *_args: Any) -> None:
        if key == self._waking:
            self._waking = None

    def _wake(self) -> None:
        self._used()
        self._brighten()
        rest.after_closing()  # the second tap of two
