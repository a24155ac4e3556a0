"""The parts of the Logs as kv/logs.kv lays them out."""
from __future__ import annotations

from typing import Any

from kivy.clock import Clock
from kivy.properties import BooleanProperty, ListProperty, NumericProperty, ObjectProperty, StringProperty
from kivy.uix.boxlayout import BoxLayout

from app.widgets import figures, pages, robot_bars, slots  # noqa: F401  (kv's Factory learns them)
from app.widgets.display import SectionCard
from app.widgets.fields import SearchField

SETTLED = 0.35               # s in which rows have found their height and the list its rest


class FilterBar(BoxLayout):
    """Period, robot, export."""
    vm = ObjectProperty(None, allownone=True)
    period = StringProperty()
    periods = ListProperty()
    robot = StringProperty()
    all_robots = BooleanProperty(True)
    exporting = BooleanProperty(False)
    empty = BooleanProperty(True)


class UtilisationCard(SectionCard):
    """Bars of all robots."""
    rows = ListProperty()
    note = StringProperty()
    wanted = NumericProperty(0)


class OutcomesCard(SectionCard):
    """How runs ended, day by day."""
    days = ListProperty()


class RunsSearch(SearchField):
    """What is searched for; ``card`` is the RunsCard."""
    card = ObjectProperty(None, rebind=True)


class RunsCard(SectionCard):
    """The executions with their filters. ``told`` is the one whose story is told: it stays in sight, also when it has grown."""
    rows = ListProperty()
    told = ObjectProperty(None, allownone=True)
    found = StringProperty()
    outcome = StringProperty()
    mission = StringProperty()
    trigger = StringProperty()
    narrows = BooleanProperty(False)
    searching = BooleanProperty(False)
    query = StringProperty()
    empty_title = StringProperty()
    empty_text = StringProperty()

    def __init__(self, **kwargs: Any) -> None:
        self._bring_soon = Clock.create_trigger(self._bring_into_sight, SETTLED)
        super().__init__(**kwargs)
        self.fbind("told", self._bring_soon)

    def _bring_into_sight(self, _dt: float) -> None:
        """A list that rests on whole rows has no place for a row that has become too high where it stood."""
        runs = self.ids.runs
        row = next((row for row in runs.views if row.key == self.told), None)
        if self.told is not None and (row is None or row.to_window(0, row.y)[1] < runs.to_window(0, runs.y)[1] - 1):
            runs.show(self.told)
