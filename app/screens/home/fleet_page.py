"""The widgets of the page All robots, as kv/home/fleet.kv lays them out."""

from __future__ import annotations

import math
from typing import Any

from kivy.core.window import Window
from kivy.metrics import dp, sp
from kivy.properties import BooleanProperty, ListProperty, NumericProperty, ObjectProperty, StringProperty
from kivy.uix.boxlayout import BoxLayout
from kivymd.uix.boxlayout import MDBoxLayout

from app.screens.home.fleet import columns
from app.screens.home.fleet_model import FleetState
from app.screens.home.wall import WallView
from app.widgets import load_kv
from app.widgets.children import refill
from app.widgets.display import SectionCard
from app.widgets.dock import is_low, is_tall
from app.widgets.lists import Row
from app.widgets.panel_grid import PanelGrid
from app.widgets.rest import rest
from app.widgets.surfaces import Tap, Toned, TonedTap
from app.widgets.text import BodyStrong
from app.widgets.tokens import late_color, tk

CLEAR = (0, 0, 0, 0)
LONGEST_END = 5  # characters of a name's last word that are always shown


class NameLine(BodyStrong):
    """A robot's name on one line: a long one keeps its end, as "Pallet truck 7" and "Pallet truck 8" differ only there."""

    def _broken(self, width: float) -> str:
        text: str = self.text
        self._label.resolve_font_name()
        if self._label.get_extents(text)[0] <= width:
            return text
        head, _space, tail = text.rpartition(" ")
        tail = tail[-LONGEST_END:]
        head = head or text[: -len(tail)]
        while head and self._label.get_extents(f"{head}… {tail}")[0] > width:
            head = head[:-1]
        return f"{head.rstrip()}… {tail}"


class RobotCell(Row, TonedTap):
    """One robot in its place. A ``wide`` one has its name beside the icon, and its fact below."""

    host = ObjectProperty(None, allownone=True, rebind=True)
    wide = BooleanProperty(False)
    back = late_color(CLEAR)
    ink = late_color((0, 0, 0, 1))
    ink2 = late_color((0, 0, 0, 1))
    edge = late_color(CLEAR)

    def retone(self, *_: Any) -> None:
        """Normal is grey; the rest is tinted, solid when ``loud``, so that it is seen first."""
        super().retone()
        if self.tone == "neutral":
            self.back, self.ink, self.ink2, self.edge = tk.surface, tk.ink, tk.ink2, tk.line
        elif self.item.loud:
            self.back, self.ink, self.ink2, self.edge = self.solid, self.solid_ink, self.solid_ink, self.solid
        else:
            self.back, self.ink, self.ink2, self.edge = self.tint, self.tint_ink, self.tint_ink, self.fg

    on_item = retone


class FleetPart(Toned, MDBoxLayout):
    """How many robots of a group are in one state."""

    icon = StringProperty()
    text = StringProperty()


class FleetParts(MDBoxLayout):
    """One for each of ``parts``."""

    parts = ListProperty()

    def on_parts(self, *_: Any) -> None:
        for shown, part in zip(refill(self, range(len(self.parts)), lambda _n: FleetPart()), self.parts, strict=True):
            shown.icon, shown.text, shown.tone = part.icon, part.text, part.tone


class FleetHead(Row, Tap):
    """The head of a group of robots; a tap shows its cells instead of another group's."""


class FleetGrid(PanelGrid):
    """The cells: the fewest columns that show all without scrolling. ``wide``: the page is theirs alone."""

    wide = BooleanProperty(False)
    low = BooleanProperty(False)
    is_grouped = BooleanProperty(False)

    def __init__(self, **kwargs: Any) -> None:
        super().__init__(**kwargs)
        self.bind(size=self._shelve, wide=self._shelve, low=self._shelve, is_grouped=self._shelve)

    @property
    def _least(self) -> tuple[float, float]:
        """Width and height of a cell: "Robot 44" fits at any size of text, and where there are hundreds "Robot 118"."""
        if self.wide:
            return sp(150), sp(72)
        return sp(96 if self.is_grouped else 88), max(tk.h_touch, sp(56 if self.low else 68))

    @property
    def _cells(self) -> int:
        return sum(not hasattr(panel, "is_whole_row") for panel in self.panels)

    def _fill_shelves(self, dt: float) -> None:
        if self.width < 2:
            return
        self.columns = columns(self._cells, self.width, self.height, self._least, sp(230), self.spacing)
        rows = max(1, math.ceil(self._cells / self.columns))
        self.row_height = min(dp(120), max(self._least[1], (self.height + self.spacing) // rows - self.spacing))
        super()._fill_shelves(dt)


class FleetPane(SectionCard):
    """What needs a person; ``vm`` is a FleetViewModel."""

    vm = ObjectProperty(FleetState(), rebind=True)
    needed = NumericProperty(0)  # px of height


class FleetPage(BoxLayout):
    """What needs a person beside the cells, in a tall window above them; ``vm`` is a FleetViewModel."""

    vm = ObjectProperty(FleetState(), rebind=True)
    low = BooleanProperty(False)  # as a screen's
    tall = BooleanProperty(False)
    pane_width = NumericProperty(0)
    scrolls_heads = BooleanProperty(False)  # where all would leave the cells little room

    def __init__(self, **kwargs: Any) -> None:
        self._wall: WallView | None = None
        super().__init__(**kwargs)
        self.fbind("size", self._fit)
        self.vm.wall.bind(is_on=self._show_wall)
        self.vm.bind(above=self._choose_tightness)
        self._fit()

    def _fit(self, *_: Any) -> None:
        self.low, self.tall = is_low(Window.height), is_tall(*Window.size)
        self.pane_width = self.width if self.tall else dp(392 if self.low else 472)
        self._choose_tightness()

    def _choose_tightness(self, *_: Any) -> None:
        self.vm.tight = self.pane_width < sp(472 if self.vm.above else 360)

    def _show_wall(self, *_: Any) -> None:
        if self.vm.wall.is_on and self._wall is None:
            load_kv("home/wall")
            self._wall = WallView(vm=self.vm)
            Window.add_widget(self._wall)
        elif not self.vm.wall.is_on and self._wall is not None:
            Window.remove_widget(self._wall)
            self._wall = None
            rest.after_closing()
