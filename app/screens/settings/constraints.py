"""Settings, Conditions: the minimum battery, the working days of the week, and the calendar of exceptions to them."""

from __future__ import annotations

from kivy.properties import ListProperty, NumericProperty

from app.domain.models import WEEKDAYS
from app.i18n import _
from app.screens.settings.calendar import CalendarPart
from app.screens.settings.page import PageContext, ValuesPage
from app.screens.settings.view import weekday_names


class ConstraintsPage(ValuesPage):
    battery = NumericProperty(0)
    day_names = ListProperty()
    days = ListProperty()

    def __init__(self, context: PageContext) -> None:
        super().__init__(context)
        self.calendar = CalendarPart(self)
        self.ids.page.add_widget(self.calendar)

    def show(self) -> None:
        super().show()
        self.battery = self.settings.minimum_battery_percent or 0
        self.day_names, self.days = list(weekday_names().items()), list(self.settings.working_days)
        self.calendar.show()

    def toggle_day(self, day: str) -> None:
        chosen = {*self.days} ^ {day}
        if chosen:
            self.set("working_days", tuple(day for day in WEEKDAYS if day in chosen))
        else:
            self.problems["working_days"] = _("At least one day must stay a working day")
            self.property("days").dispatch(self)  # the row shows it again
