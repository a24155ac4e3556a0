"""The whole map of the selected robot, with all robots on it."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from kivy.clock import Clock
from kivy.properties import ListProperty, ObjectProperty

from app.screens.home.cards import NO_STATE, HomeState
from app.screens.home.map import Marker
from app.widgets import load_kv
from app.widgets.dialogs import Dialog
from app.widgets.robot_map import ground


class MapDialog(Dialog):
    """As large as the window; ``find`` says once a second where the robots are."""

    vm = ObjectProperty(NO_STATE, rebind=True)
    texture = ObjectProperty(None, allownone=True)
    robots = ListProperty()

    def __init__(self, vm: HomeState, find: Callable[[], tuple[Marker, ...]], **kwargs: Any) -> None:
        load_kv("home/map_dialog")
        self._find, self._picture = find, None
        super().__init__(vm=vm, **kwargs)
        self._look()
        self._tick = Clock.schedule_interval(self._look, 1)

    def _look(self, *_: Any) -> None:
        picture = self.vm.map.picture
        if picture is not None and picture is not self._picture:
            self._picture, self.texture = picture, ground(picture)
        self.robots = self._find()

    def on_dismiss(self, *_: Any) -> None:
        self._tick.cancel()
