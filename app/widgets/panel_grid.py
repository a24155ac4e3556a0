"""Panels side by side: as many columns as fit, all of a row equally high, built a few per frame so that fifty don't hold up the window."""
from kivy.clock import Clock
from kivy.factory import Factory
from kivy.metrics import dp
from kivy.properties import BooleanProperty, ListProperty, NumericProperty, StringProperty
from kivy.uix.gridlayout import GridLayout

from app.widgets.lists import Row

AT_ONCE = 6                              # panels built in the first frame: what a screen shows


class PanelGrid(GridLayout):
    """One ``viewclass`` (with ``Row``) per dict of ``data``, kept by its ``key``; widgets added in kv stay behind them.

    ``panel_width`` is the least width of a panel. ``on_action(key, action, *values)`` comes from the panels.
    """
    viewclass = StringProperty()
    data = ListProperty()
    panel_width = NumericProperty("400dp")
    complete = BooleanProperty(True)     # every panel of ``data`` is built

    __events__ = ("on_action",)

    def __init__(self, **kwargs):
        self._views = {}
        self._tail = []
        self._go_on = Clock.create_trigger(self._build_more, 0)
        self._settle = Clock.create_trigger(self._columns, -1)
        super().__init__(size_hint_y=None, **kwargs)
        self.bind(minimum_height=self.setter("height"))
        for name in ("width", "panel_width"):
            self.fbind(name, self._settle)
        self.fbind("data", self._show)
        self._settle()

    def on_kv_post(self, base_widget):
        self._tail = self.children[::-1]
        self._show()

    def on_action(self, key, action, *values):
        """A panel was used."""

    def _columns(self, *_):
        gap = self.spacing[0] if isinstance(self.spacing, (list, tuple)) else self.spacing
        self.cols = max(1, int((self.width + gap) // (max(dp(100), self.panel_width) + gap)))

    def _show(self, *_):
        if not self.viewclass:
            return
        wanted = {row["key"]: row for row in self.data}
        for key in [key for key in self._views if key not in wanted]:
            self.remove_widget(self._views.pop(key))
        for key, view in self._views.items():
            Row.take(view, wanted[key])
        self._build(AT_ONCE)

    def _build_more(self, _dt):
        self._build(1)

    def _build(self, count):
        for row in self.data:
            if not count:
                break
            if row["key"] not in self._views:
                view = self._views[row["key"]] = Factory.get(self.viewclass)()
                view.host = self
                Row.take(view, row)
                count -= 1
        built = [self._views[row["key"]] for row in self.data if row["key"] in self._views]
        self.complete = len(built) == len(self.data)
        wanted = built + (self._tail if self.complete else [])
        present = self.children[::-1]
        if wanted[:len(present)] != present:
            self.clear_widgets()
            present = []
        for view in wanted[len(present):]:
            self.add_widget(view)
        if not self.complete:
            self._go_on()
