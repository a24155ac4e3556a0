"""Settings, Conditions: the minimum battery, the working days of the week, and the calendar of exceptions to them."""

from __future__ import annotations

from typing import Any

from kivy.event import EventDispatcher
from kivy.properties import ListProperty, NumericProperty, StringProperty

from app.domain.models import WEEKDAYS
from app.i18n import _
from app.screens.common.problems import sentence_of
from app.screens.settings.calendar import CalendarPart
from app.screens.settings.page import PageContext, SettingsPage
from app.screens.settings.view import weekday_names


class ConstraintsModel(EventDispatcher):
    battery = NumericProperty(0)
    battery_problem = StringProperty()
    day_names = ListProperty()
    days = ListProperty()
    days_problem = StringProperty()


class ConstraintsPage(SettingsPage):
    Model = ConstraintsModel

    def __init__(self, context: PageContext) -> None:
        super().__init__(context)
        self.calendar = CalendarPart(context)
        self.ids.page.add_widget(self.calendar)

    def show(self) -> None:
        vm, settings = self.vm, self.context.facts.settings
        vm.battery = settings.minimum_battery_percent or 0
        vm.day_names, vm.days = list(weekday_names().items()), list(settings.working_days)
        self.calendar.show()

    def reached(self, **intent: Any) -> None:
        self.vm.battery_problem = self.vm.days_problem = ""
        self.calendar.reached()

    # ------------------------------------------------------------------ what is changed
    def step_battery(self, percent: int) -> None:
        self.context.save_at_rest("battery", lambda: self.set_battery(percent))

    def set_battery(self, percent: int) -> None:
        """0 %: no constraint."""
        self.vm.battery_problem = ""
        self.context.pass_over("battery")
        self.context.save(self._battery_refused, minimum_battery_percent=percent or None)

    def _battery_refused(self, problem: BaseException) -> None:
        self.vm.battery_problem = sentence_of(problem)

    def toggle_day(self, day: str) -> None:
        chosen = set(self.context.facts.settings.working_days) ^ {day}
        if not chosen:
            self.vm.days_problem = _("At least one day must stay a working day")
            self.vm.property("days").dispatch(self.vm)  # the row shows it again
            return
        self.vm.days_problem = ""
        self.context.save(self._days_refused, working_days=tuple(day for day in WEEKDAYS if day in chosen))

    def _days_refused(self, problem: BaseException) -> None:
        self.vm.days_problem = sentence_of(problem)
