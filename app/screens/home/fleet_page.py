"""The widgets of the page All robots, as kv/home/fleet.kv lays them out."""

from __future__ import annotations

from typing import Any

from kivy.metrics import sp
from kivy.properties import BooleanProperty, ListProperty, NumericProperty, ObjectProperty, StringProperty
from kivy.uix.boxlayout import BoxLayout
from kivy.uix.stacklayout import StackLayout

from app.screens.common.formats import NOTHING
from app.screens.home.fleet_model import FleetState
from app.widgets import panel_grid  # noqa: F401  (registers kivy classes)
from app.widgets.lists import RecycledRow
from app.widgets.surfaces import TonedTap
from app.widgets.text import Body, line_width
from app.widgets.tokens import late_color, tk

CLEAR = (0, 0, 0, 0)
LONGEST_END = 5  # characters of a name's last word that are always shown


class Painted(TonedTap):
    """Normal is grey; abnormal is tinted, solid when ``loud``, so that it is the first thing seen."""

    loud = BooleanProperty(False)
    back = late_color(CLEAR)
    ink = late_color((0, 0, 0, 1))  # of what must be read first
    ink2 = late_color((0, 0, 0, 1))
    edge = late_color(CLEAR)

    def __init__(self, **kwargs: Any) -> None:
        super().__init__(**kwargs)
        self.fbind("loud", self.retone)

    def retone(self, *_: Any) -> None:
        super().retone()
        if self.tone == "neutral":
            self.back, self.ink, self.ink2, self.edge = tk.surface, tk.ink, tk.ink2, tk.line
        elif self.loud:
            self.back, self.ink, self.ink2, self.edge = self.solid, self.solid_ink, self.solid_ink, self.solid
        else:
            self.back, self.ink, self.ink2, self.edge = self.tint, self.tint_ink, self.tint_ink, self.fg


class OneLine(Body):
    """A text that never changes the height of a tile: what doesn't fit is in the robot's Home."""

    most_lines = NumericProperty(1)


class FarLine(OneLine):
    """A text to read from a distance: in the largest of SIZES, up to ``most`` sp, in which it fits."""

    SIZES = (24, 20, 16)
    font_name = StringProperty("RobotoMedium")
    most = NumericProperty(SIZES[-1])

    def __init__(self, **kwargs: Any) -> None:
        super().__init__(**kwargs)
        for name in ("text", "width", "most"):
            self.fbind(name, self._choose)

    def _choose(self, *_: Any) -> None:
        sizes = [size for size in self.SIZES if size <= self.most]
        while len(sizes) > 1 and line_width(self.text, self.font_name, sp(sizes[0])) > self.width:
            del sizes[0]
        self.font_size = f"{sizes[0]}sp"


class NameLine(FarLine):
    """A robot's name: a long one keeps its end, as "Pallet truck 7" and "Pallet truck 8" differ only there."""

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


class FleetTile(RecycledRow, Painted):
    """One robot; a tap is "open". ``late``: its mission takes much longer than usual."""

    name = StringProperty()
    word = StringProperty()
    icon = StringProperty()
    detail = StringProperty()
    late = BooleanProperty(False)
    battery = StringProperty("–")
    battery_icon = StringProperty("battery-unknown")
    battery_tone = StringProperty("neutral")
    battery_ink = late_color((0, 0, 0, 1))
    detail_ink = late_color((0, 0, 0, 1))

    def retone(self, *_: Any) -> None:
        super().retone()
        is_normal = self.tone == "neutral"
        self.battery_ink = getattr(tk, self.battery_tone) if is_normal else self.ink2
        self.detail_ink = tk.attention if self.late and is_normal else self.ink2

    on_battery_tone = on_late = retone

    def on_release(self) -> None:
        self.act("open")


class LargeTile(FleetTile):
    """Up to twenty robots: all in words."""


class SmallTile(FleetTile):
    """For more than twenty robots: name, group, battery, one line. If it needs a person, name and group are as large as
    possible, and the battery is in that line."""

    is_calm = BooleanProperty(True)
    most = NumericProperty(16)

    def with_battery(self, battery: str, detail: str) -> str:
        """In one line; without an unknown battery."""
        return " · ".join(text for text in (battery, detail) if text not in ("", NOTHING))


class CountChip(Painted):
    """How many robots are in one group; a tap shows only those."""

    key = ObjectProperty(None, allownone=True)
    icon = StringProperty()
    text = StringProperty()
    selected = BooleanProperty(False)


class Counts(StackLayout):
    """A chip per entry of ``data``; a tap fires ``on_choose(key)``. As high as its rows; one row of all is ``row_width`` px wide."""

    data = ListProperty()
    in_a_row = BooleanProperty(False)
    row_width = NumericProperty(0)

    __events__ = ("on_choose",)

    def __init__(self, **kwargs: Any) -> None:
        self._chips: dict[object, CountChip] = {}
        super().__init__(**kwargs)
        self.fbind("data", self._build)

    def on_choose(self, key: object) -> None:
        """A chip was tapped."""

    def _build(self, *_: Any) -> None:
        if [count.key for count in self.data] != list(self._chips):
            self.clear_widgets()
            self._chips = {count.key: self._chips.get(count.key) or self._new(count.key) for count in self.data}
            for chip in self._chips.values():
                self.add_widget(chip)
        self._measure()
        for count in self.data:
            chip = self._chips[count.key]
            for name, value in vars(count).items():
                setattr(chip, name, value)

    def height_in(self, width: float, _row_width: float) -> float:
        """How high they are in as many rows as they take in ``width`` px; what their own widths are, ``row_width`` follows."""
        rows, taken = 1, 0.0
        for chip in reversed(self.children):
            if taken and taken + chip.width > width:
                rows, taken = rows + 1, 0.0
            taken += chip.width + self.spacing[0]
        return float(sum(chip.height for chip in self.children[:1]) * rows + self.spacing[1] * (rows - 1))

    def _measure(self, *_: Any) -> None:
        self.row_width = sum(chip.width for chip in self.children) + self.spacing[0] * max(0, len(self.children) - 1)

    def _new(self, key: object) -> CountChip:
        chip = CountChip()
        chip.fbind("width", self._measure)
        chip.bind(on_release=lambda _chip: self.dispatch("on_choose", key))
        return chip


class FleetPage(BoxLayout):
    """The counts above the tiles; ``vm`` is a FleetViewModel."""

    vm = ObjectProperty(FleetState(), rebind=True)
