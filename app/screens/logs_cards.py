"""The parts of the Logs as kv/logs.kv lays them out."""
from __future__ import annotations

from kivy.properties import BooleanProperty, ListProperty, NumericProperty, ObjectProperty, StringProperty
from kivy.uix.boxlayout import BoxLayout

from app.widgets import figures, robot_bars  # noqa: F401  (kv's Factory learns them)
from app.widgets.display import SectionCard


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


class RunsCard(SectionCard):
    """The executions with their filters."""
    rows = ListProperty()
    found = StringProperty()
    outcome = StringProperty()
    mission = StringProperty()
    trigger = StringProperty()
    narrows = BooleanProperty(False)
    searching = BooleanProperty(False)
    query = StringProperty()
    empty_title = StringProperty()
    empty_text = StringProperty()
