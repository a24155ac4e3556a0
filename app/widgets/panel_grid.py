"""Panels side by side: as many columns as fit, all of a row equally high. Only the visible ones exist, so that fifty
cost as much as four. The next ones are made (with ``ahead``) and filled in advance, a few panels a frame: a whole row
at once is forty texts, 8 ms in the middle of a fling.
"""

from collections.abc import Hashable
from dataclasses import dataclass

from kivy.clock import Clock
from kivy.factory import Factory
from kivy.metrics import dp
from kivy.properties import BooleanProperty, ListProperty, NumericProperty, ObjectProperty, StringProperty
from kivy.uix.boxlayout import BoxLayout
from kivy.uix.widget import Widget

from app.widgets.lists import Row
from app.widgets.long_list import LongList

SPARE = 2  # shelves kept for panels that scroll into sight
AHEAD = 3  # panels of the next one that are filled in a frame


@dataclass(frozen=True)
class Shelf:
    """Values of PanelShelf: ``panels`` with the names of their classes, and how many places there are side by side, px apart."""

    key: Hashable
    panels: list[tuple[str, object]]
    columns: int
    spacing: float


class PanelGrid(LongList):
    """``panels`` are objects whose attributes are properties of the panel class, with a ``key`` each. Panel classes mix in
    ``RecycledRow``, fill their cell and set their least height in ``size_hint_min_y``; the class is ``panelclass``, or the class attribute
    ``panelclass`` of the values of one panel; one that ``is_whole_row`` has no other beside it.

    ``panel_width`` is the least width of a panel. ``on_action(key, action, *values)`` comes from the panels.
    """

    panels = ListProperty()
    panelclass = StringProperty()
    panel_width = NumericProperty("400dp")
    ahead = BooleanProperty(False)  # make a shelf for panels before they scroll into sight

    def __init__(self, **kwargs):
        self._shelve = Clock.create_trigger(self._fill_shelves, -1)
        self._prepare = Clock.create_trigger(self._prepare_some, 0)
        self._first, self._goes_down = 0, True  # the first shelf in sight, and where the list was moved last
        self._coming = 0  # the shelf that comes next
        super().__init__(viewclass="PanelShelf", **kwargs)
        for name in ("panels", "panelclass", "panel_width", "width", "spacing"):
            self.fbind(name, self._shelve)
        self._shelve()

    def _come_to_rest(self):
        """Panels stay where they were left."""

    def _forget_spare(self):
        """None if all are visible: a shelf is a whole row of panels, and another number of columns needs other
        shelves."""
        del self._spare[SPARE if len(self._live) < len(self._keys) else 0 :]

    def _populate(self, shown):
        super()._populate(shown)
        if shown.start != self._first:
            self._first, self._goes_down = shown.start, shown.start > self._first
        self._coming = shown.stop if self._goes_down else shown.start - 1
        self._prepare()

    def _prepare_some(self, _dt):
        """Once a frame, however often rows are placed in it."""
        if self.ahead and not self._spare and len(self._live) < len(self._keys):
            self._spare.append(self._new_seat())
        if self._spare and 0 <= self._coming < len(self.data):
            shelf = self.data[self._coming]
            views = [seat.view for seat in self._spare]
            next((view for view in views if view.key == shelf.key), views[0]).prepare(shelf)

    @property
    def columns(self) -> int:
        return max(1, int((self.width + self.spacing) // (max(dp(100), self.panel_width) + self.spacing)))

    @property
    def rows(self) -> list:
        return [panel for shelf in super().rows for panel in shelf.children if isinstance(panel, Row)]

    def keys_of(self, data) -> list:
        return [panel.key for shelf in data for _name, panel in shelf.panels]

    def shown_order(self) -> list:
        """The panels keep their places, but not the shelves."""
        return list(self.data)

    def _sort_again(self):
        self._shelve()

    def _fill_shelves(self, _dt):
        if self.width < 2:
            return
        columns, usual, spacing = self.columns, self.panelclass, self.spacing
        panels = [
            (getattr(panel, "panelclass", usual), panel) for panel in self.standing.in_order(self.panels, self._known)
        ]
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

    key = ObjectProperty(None, allownone=True)
    host = ObjectProperty(None, allownone=True)
    panels = ListProperty()
    columns = NumericProperty(1)

    def __init__(self, **kwargs):
        self._left = []  # views, and what they have not taken yet
        self._is_being_prepared = False
        super().__init__(**kwargs)
        self.size_hint_y = None
        self.bind(minimum_height=self.setter("height"))
        for name in ("panels", "columns"):
            self.fbind(name, self._show)

    def take(self, shelf) -> None:
        """Show ``shelf``."""
        Row.take(self, shelf)
        self._fill()

    def prepare(self, shelf) -> None:
        """Take some of what will be taken soon, out of sight."""
        self._is_being_prepared = True
        Row.take(self, shelf)
        self._is_being_prepared = False
        self._fill(AHEAD)

    def _show(self, *_):
        wanted = [Factory.get(name) for name, _panel in self.panels]
        wanted += [Widget] * (int(self.columns) - len(wanted))
        present = self.children[::-1]
        if [type(child) for child in present] != wanted:
            spare = {kind: [child for child in present if type(child) is kind] for kind in wanted}
            self.clear_widgets()
            for kind in wanted:
                self.add_widget(spare[kind].pop(0) if spare[kind] else kind())
        self._left = list(zip(self.children[::-1], (panel for _name, panel in self.panels), strict=False))
        if not self._is_being_prepared:
            self._fill()

    def _fill(self, most=None):
        for view, panel in self._left[:most]:
            self._belong(view)
            view.take(panel)
        del self._left[:most]

    def on_host(self, *_):
        for view in self.children:
            if isinstance(view, Row):
                self._belong(view)

    def _belong(self, view):
        view.host, view.standing = self.host, getattr(self.host, "standing", None)
