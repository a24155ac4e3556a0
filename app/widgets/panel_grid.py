"""Panels side by side: as many columns as fit, all of a row equally high. Only the visible ones exist, so that fifty cost what four do."""
from collections.abc import Hashable, Sequence
from dataclasses import dataclass

from kivy.clock import Clock
from kivy.factory import Factory
from kivy.metrics import dp
from kivy.properties import ListProperty, NumericProperty, ObjectProperty, StringProperty
from kivy.uix.boxlayout import BoxLayout
from kivy.uix.widget import Widget

from app.widgets.lists import Row
from app.widgets.long_list import LongList


@dataclass(frozen=True)
class Shelf:
    """Values of PanelShelf: ``panels`` with the names of their classes, and how many places there are side by side, px apart."""
    key: Hashable
    panels: Sequence[tuple[str, object]]
    columns: int
    spacing: float


class PanelGrid(LongList):
    """``panels`` are objects whose attributes are properties of the panel class, with a ``key`` each. Panel classes mix in
    ``RecycledRow``, fill their cell and set their least height in ``size_hint_min_y``; the class is ``panelclass``, or the class attribute
    ``panelclass`` of the values of one panel.

    ``panel_width`` is the least width of a panel. ``on_action(key, action, *values)`` comes from the panels.
    """
    panels = ListProperty()
    panelclass = StringProperty()
    panel_width = NumericProperty("400dp")

    def __init__(self, **kwargs):
        self._shelve = Clock.create_trigger(self._fill_shelves, -1)
        super().__init__(viewclass="PanelShelf", **kwargs)
        for name in ("panels", "panelclass", "panel_width", "width", "spacing"):
            self.fbind(name, self._shelve)
        self._shelve()

    def _come_to_rest(self, _dt):
        """Panels stay where they were left."""

    def _forget_spare(self):
        """Keep one, for what scrolls into sight, where not all are: a shelf is a whole row of panels, and other columns need other ones."""
        del self._spare[1 if len(self._live) < len(self._keys) else 0:]

    @property
    def columns(self) -> int:
        return max(1, int((self.width + self.spacing) // (max(dp(100), self.panel_width) + self.spacing)))

    @property
    def rows(self) -> list:
        return [panel for shelf in super().rows for panel in shelf.children if isinstance(panel, Row)]

    def keys_of(self, data) -> list:
        return [panel.key for shelf in data for _name, panel in shelf.panels]

    def _fill_shelves(self, _dt):
        if self.width < 2:
            return
        columns, usual, spacing = self.columns, self.panelclass, self.spacing
        panels = [(getattr(panel, "panelclass", usual), panel) for panel in self.panels]
        shelves = [panels[start:start + columns] for start in range(0, len(panels), columns)]
        self.data = [Shelf(shelf[0][1].key, shelf, columns, spacing) for shelf in shelves]


class PanelShelf(BoxLayout):
    """One row of panels; places without a panel stay free. Not a ``Row`` itself: a tap is on a panel, whose key counts."""
    key = ObjectProperty(None, allownone=True)
    host = ObjectProperty(None, allownone=True)
    panels = ListProperty()
    columns = NumericProperty(1)

    def __init__(self, **kwargs):
        super().__init__(**kwargs)
        self.size_hint_y = None
        self.bind(minimum_height=self.setter("height"))
        for name in ("panels", "columns"):
            self.fbind(name, self._show)

    take = Row.take

    def _show(self, *_):
        wanted = [Factory.get(name) for name, _panel in self.panels]
        wanted += [Widget] * (int(self.columns) - len(wanted))
        present = self.children[::-1]
        if [type(child) for child in present] != wanted:
            spare = {kind: [child for child in present if type(child) is kind] for kind in wanted}
            self.clear_widgets()
            for kind in wanted:
                self.add_widget(spare[kind].pop(0) if spare[kind] else kind())
        for view, (_name, panel) in zip(self.children[::-1], self.panels, strict=False):
            self._belong(view)
            view.take(panel)

    def on_host(self, *_):
        for view in self.children:
            if isinstance(view, Row):
                self._belong(view)

    def _belong(self, view):
        view.host, view.standing = self.host, getattr(self.host, "standing", None)
