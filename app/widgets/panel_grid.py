"""Panels side by side: as many columns as fit, all of a row equally high. Only the visible ones exist, so that fifty cost what four do."""
from kivy.clock import Clock
from kivy.factory import Factory
from kivy.metrics import dp
from kivy.properties import ListProperty, NumericProperty, ObjectProperty, StringProperty
from kivy.uix.boxlayout import BoxLayout
from kivy.uix.widget import Widget

from app.widgets.lists import Row
from app.widgets.long_list import LongList


class PanelGrid(LongList):
    """``panels`` = dicts of the panel class's properties, each with its ``key``. ``panelclass`` mixes in ``RecycledRow``, fills its cell
    and says by ``size_hint_min_y`` how high it must be; a panel of another class has its own ``panelclass`` in its dict.

    ``panel_width`` is the least width of a panel. ``on_action(key, action, *values)`` comes from the panels.
    """
    panels = ListProperty()
    panelclass = StringProperty()
    panel_width = NumericProperty("400dp")

    def __init__(self, **kwargs):
        self._shelve = Clock.create_trigger(self._fill_shelves, -1)
        super().__init__(viewclass="PanelShelf", **kwargs)
        self._resting = False                # a panel is a large thing: one that is cut says better that there is more than an empty place
        for name in ("panels", "panelclass", "panel_width", "width", "spacing"):
            self.fbind(name, self._shelve)
        self._shelve()

    def _come_to_rest(self, _dt):
        """Panels stay where they were left."""

    @property
    def columns(self) -> int:
        return max(1, int((self.width + self.spacing) // (max(dp(100), self.panel_width) + self.spacing)))

    def _fill_shelves(self, _dt):
        if self.width < 2:
            return
        panels = [{"panelclass": self.panelclass, **panel} for panel in self.panels]
        shelves = [panels[start:start + self.columns] for start in range(0, len(panels), self.columns)]
        self.data = [{"key": shelf[0]["key"], "panels": shelf, "columns": self.columns, "spacing": self.spacing} for shelf in shelves]


class PanelShelf(BoxLayout):
    """One row of panels; places without a panel stay free. Not a ``Row`` itself: a tap is meant for a panel, whose key it must keep."""
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
        wanted = [Factory.get(panel["panelclass"]) for panel in self.panels]
        wanted += [Widget] * (int(self.columns) - len(wanted))
        present = self.children[::-1]
        if [type(child) for child in present] != wanted:
            spare = {kind: [child for child in present if type(child) is kind] for kind in wanted}
            self.clear_widgets()
            for kind in wanted:
                self.add_widget(spare[kind].pop(0) if spare[kind] else kind())
        for view, panel in zip(self.children[::-1], self.panels, strict=False):
            view.host = self.host
            view.take({name: value for name, value in panel.items() if name != "panelclass"})

    def on_host(self, *_):
        for view in self.children:
            if isinstance(view, Row):
                view.host = self.host
