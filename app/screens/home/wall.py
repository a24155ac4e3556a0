"""The wall view: where the app fills a screen that was left alone, the worst is shown in large letters."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from kivy.clock import Clock
from kivy.core.window import Window
from kivy.event import EventDispatcher
from kivy.properties import BooleanProperty, ListProperty, ObjectProperty, StringProperty
from kivymd.uix.boxlayout import MDBoxLayout

from app.widgets.children import refill

LEFT_ALONE = 120.0  # s without a touch or a key


class Wall(EventDispatcher):
    """Whether the wall view ``is_on``; ``clock`` is the time on it."""

    is_on = BooleanProperty(False)
    clock = StringProperty()

    def __init__(self) -> None:
        super().__init__()
        self.is_kiosk = bool(Window.fullscreen)
        self._used_at = 0.0  # s of kivy's clock

    def watch(self) -> Callable[[], None]:
        """Note touches and keys; returns what ends it."""
        handlers = {"on_touch_down": self._used, "on_key_down": self._used}
        Window.bind(**handlers)
        self._used()

        def end() -> None:
            Window.unbind(**handlers)
            self.is_on = False

        return end

    def look(self, may_come: bool) -> None:
        """Once a second: ``may_come`` on a screen that is filled, where nothing else would be hidden."""
        self.is_on = may_come and Clock.get_time() - self._used_at >= LEFT_ALONE

    def leave(self) -> None:
        self._used()
        self.is_on = False

    def _used(self, *_args: Any) -> None:
        self._used_at = Clock.get_time()


class WallRow(MDBoxLayout):
    """One of the worst, to be read from far away."""

    item = ObjectProperty(None, allownone=True)


class WallRows(MDBoxLayout):
    """A row for each of ``items``."""

    items = ListProperty()

    def on_items(self, *_: Any) -> None:
        refill(self, self.items, lambda item: WallRow(item=item))


class WallView(MDBoxLayout):
    """Large letters, instead of a page that was left alone for a while. A touch or a key only leaves it."""

    vm = ObjectProperty(None, rebind=True, allownone=True)

    def on_parent(self, _view: WallView, parent: Any) -> None:
        (Window.bind if parent is not None else Window.unbind)(on_key_down=self._leave)

    def on_touch_down(self, touch: Any) -> bool:
        touch.grab(self)
        return True

    def on_touch_move(self, _touch: Any) -> bool:
        return True

    def on_touch_up(self, touch: Any) -> bool:
        if touch.grab_current is self:
            touch.ungrab(self)
            self._leave()
        return True

    def _leave(self, *_: Any) -> bool:
        self.vm.wall.leave()
        return True
