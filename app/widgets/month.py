"""A month whose days show whether they are working days, days off (of the week or of the calendar) or extra working days; a day can
be tapped."""

from kivy.factory import Factory
from kivy.metrics import dp
from kivy.properties import ListProperty, ObjectProperty, StringProperty
from kivy.uix.boxlayout import BoxLayout
from kivymd.icon_definitions import md_icons

from app.widgets.chart import Chart
from app.widgets.children import refill
from app.widgets.events import Fires
from app.widgets.items import Day
from app.widgets.surfaces import Tap
from app.widgets.tokens import tk


class DayFace(Chart):
    """A day of a month in one drawing, as a month has 42 of them. Hatched if it is a day off, with a border if
    that is an exception; its number, and an icon next to it."""

    item = ObjectProperty(Day())
    watch = ("item",)

    def draw(self):
        box, status = (*self.pos, *self.size), self.item.status
        if status in ("free", "closed"):
            self.box(*box, tk.closed)
            self.hatch(*box, tk.hatch)
        if status == "closed":
            self.box(*box, tk.ink3, ring=1)
        elif status == "extra":
            self.box(*box, tk.accent_bg)
            self.box(*box, tk.accent, ring=1)
        if self.item.chosen:
            self.box(*box, tk.accent_solid, min(self.size) / 2)
        self._draw_number()

    def _draw_number(self):
        day, extra = self.item, self.item.status == "extra"
        sign = md_icons[day.icon] if day.icon else ""
        ink = (
            tk.solid_ink
            if day.chosen
            else tk.disabled
            if day.off
            else tk.accent_on
            if extra
            else tk.accent
            if day.today
            else tk.ink
            if day.status == "work"
            else tk.ink2
        )
        room = dp(2) + self.width_of(sign, 14, "Icons") if sign else 0
        left = self.center_x - (self.width_of(day.text, 16, "RobotoMedium") + room) / 2
        left += dp(2) + self.text(day.text, left, self.center_y, ink, 16, font="RobotoMedium")
        self.text(sign, left, self.center_y, tk.accent_on if extra else tk.ink2, 14, font="Icons")


class MonthDay(Tap):
    """Shows a Day."""

    item = ObjectProperty(Day(), rebind=True)


class MonthGrid(Fires, BoxLayout):
    """``days`` are Days in weeks of seven, ``weekdays`` the seven short names. ``on_day(day)``, ``on_turn(months)``."""

    title = StringProperty()
    weekdays = ListProperty([""] * 7)
    days = ListProperty()

    __events__ = ("on_day", "on_turn")

    def on_weekdays(self, *_):
        refill(self.ids.names.__self__, self.weekdays, lambda name: Factory.WeekdayName(text=name))

    def on_days(self, *_):
        cells = refill(self.ids.days.__self__, range(len(self.days)), lambda _n: MonthDay(on_release=self._tapped))
        for cell, day in zip(cells, self.days, strict=True):
            cell.item = day
            cell.disabled = day.day is None or day.off

    def _tapped(self, cell):
        self.dispatch("on_day", cell.item.day)
