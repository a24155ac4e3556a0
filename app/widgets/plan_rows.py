"""Rows of long lists about the plan: a start in the next days, a schedule."""

from kivy.properties import BooleanProperty, StringProperty

from app.widgets.lists import RecycledRow
from app.widgets.rows import ScheduleRow
from app.widgets.surfaces import Tap


class DayLine(RecycledRow, Tap):
    """A heading of a day (``heading``), or a start on it: time, mission, its schedule's entered name, robot, how soon;
    with room for ``columns``, its end instead, and its battery needs. A tap on a start fires "open"."""

    columns = BooleanProperty(False)
    until = StringProperty()
    condition = StringProperty()
    heading = StringProperty()
    time = StringProperty()
    mission = StringProperty()
    name = StringProperty()
    robot = StringProperty()
    note = StringProperty()

    def on_release(self):
        if not self.heading:
            self.act("open")


class ScheduleLine(RecycledRow, ScheduleRow):
    """ScheduleRow in a LongList."""
