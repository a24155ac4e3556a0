"""Panels side by side, all of a row equally high. Only the visible ones exist, so that fifty cost as much as four."""

from collections.abc import Hashable
from dataclasses import dataclass

from kivy.clock import Clock
from kivy.factory import Factory
from kivy.properties import ListProperty, NumericProperty, ObjectProperty, StringProperty
from kivy.uix.boxlayout import BoxLayout

from app.widgets.children import refill
from app.widgets.long_list import LongList

SPARE = 2  # shelves kept for panels that scroll into sight


@dataclass(frozen=True)
class Shelf:
    """Values of PanelShelf: ``panels`` with the names of their classes, and how many places there are side by side, px apart."""

    key: Hashable
    panels: list[tuple[str, object]]
    columns: int
    spacing: float


class PanelGrid(LongList):
    """``panels`` are the items of the panels, with a ``key`` each. Panel classes mix in
    ``Row``, fill their cell and set their least height in ``size_hint_min_y``; the class is ``panelclass``, or the class attribute
    ``panelclass`` of the values of one panel; one that ``is_whole_row`` has no other beside it.

    ``on_action(key, action, *values)`` comes from the panels.
    """

    panels = ListProperty()
    panelclass = StringProperty()
    columns = NumericProperty(1)

    def __init__(self, **kwargs):
        self._shelve = Clock.create_trigger(self._fill_shelves, -1)
        super().__init__(viewclass="PanelShelf", **kwargs)
        self.bind(panels=self._shelve, panelclass=self._shelve, columns=self._shelve, spacing=self._shelve)
        self._shelve()

    def _forget_spare(self):
        """None if all are visible: a shelf is a whole row of panels, and another number of columns needs other
        shelves."""
        del self._spare[SPARE if len(self._live) < len(self._keys) else 0 :]

    def shown_order(self) -> list:
        """The panels keep their places, but not the shelves."""
        return list(self.data)

    def _sort_again(self):
        self._shelve()

    def _fill_shelves(self, _dt):
        columns, usual, spacing = int(self.columns), self.panelclass, self.spacing
        before = [panel.key for shelf in self.data for _name, panel in shelf.panels]
        panels = [(getattr(panel, "panelclass", usual), panel) for panel in self.kept.in_order(self.panels, before)]
        shelves: list[Shelf] = []
        for name, panel in panels:
            whole = getattr(panel, "is_whole_row", False)
            last = shelves[-1] if shelves else None
            if last is None or whole or last.columns == len(last.panels):
                shelves.append(Shelf(panel.key, [(name, panel)], 1 if whole else columns, spacing))
            else:
                last.panels.append((name, panel))
        self.data = shelves


class PanelShelf(BoxLayout):
    """One row of panels; places without a panel stay free. Not a ``Row`` itself: a tap is on a panel, whose key counts."""

    item = ObjectProperty()
    key = property(lambda self: self.item.key)
    host = None

    def __init__(self, **kwargs):
        super().__init__(**kwargs)
        self.size_hint_y = None
        self.bind(minimum_height=self.setter("height"))

    def take(self, shelf) -> None:
        """Show ``shelf``."""
        panels = shelf.panels + [("Widget", None)] * (shelf.columns - len(shelf.panels))
        values = [{"item": panel} if panel else {} for _name, panel in panels]
        kinds = enumerate(name for name, _panel in panels)
        views = refill(self, kinds, lambda kind: Factory.get(kind[1])(**values[kind[0]]))
        self.item, self.spacing = shelf, shelf.spacing
        for view, (_name, panel) in zip(views, shelf.panels, strict=False):
            view.host = self.host
            view.take(panel)
