"""A month of days that each say what they are: worked, free, closed, extra. For choosing a day to do something with."""
from kivy.properties import BooleanProperty, ListProperty, ObjectProperty, OptionProperty, StringProperty
from kivy.uix.boxlayout import BoxLayout

from app.widgets.chart import Chart
from app.widgets.surfaces import Tap
from app.widgets.tokens import tk

LOOKS = ("work", "free", "closed", "extra")


class DayGround(Chart):
    """What lies behind the number of a day: hatched where no work is done, framed where an exception says so."""
    look = OptionProperty("work", options=LOOKS)
    watch = ("look",)

    def draw(self):
        box = (*self.pos, *self.size)
        if self.look in ("free", "closed"):
            self.box(*box, tk.closed)
            self.hatch(*box, tk.hatch)
        if self.look == "closed":
            self.box(*box, tk.ink3, ring=1)
        elif self.look == "extra":
            self.box(*box, tk.accent_bg)
            self.box(*box, tk.accent, ring=1)


class MonthDay(Tap):
    """A day; empty text = a day of another month."""
    day = ObjectProperty(None, allownone=True)
    text = StringProperty()
    look = OptionProperty("work", options=LOOKS)
    icon = StringProperty()
    today = BooleanProperty(False)


class MonthGrid(BoxLayout):
    """``days`` = the properties of MonthDay in weeks of seven, ``weekdays`` the seven short names. ``on_day(day)``, ``on_turn(months)``."""
    title = StringProperty()
    weekdays = ListProperty([""] * 7)
    days = ListProperty()

    __events__ = ("on_day", "on_turn")

    def on_kv_post(self, base_widget):
        self.fbind("days", self._show)
        self._show()

    def on_day(self, day):
        """A day was tapped."""

    def on_turn(self, months):
        """Another month is wanted: so many further."""

    def _show(self, *_):
        grid = self.ids.days
        while len(grid.children) > len(self.days):
            grid.remove_widget(grid.children[0])
        while len(grid.children) < len(self.days):
            cell = MonthDay()
            cell.bind(on_release=lambda cell: self.dispatch("on_day", cell.day))
            grid.add_widget(cell)
        for cell, data in zip(reversed(grid.children), self.days, strict=True):
            for name, value in data.items():
                setattr(cell, name, value)
            cell.disabled = cell.day is None
