"""The parts of the Scheduler as kv/scheduler/screen.kv lays them out."""
from __future__ import annotations

from kivy.properties import BooleanProperty, ListProperty, NumericProperty, ObjectProperty, OptionProperty, StringProperty
from kivy.uix.boxlayout import BoxLayout

from app.screens.scheduler.form_view import FormView
from app.screens.scheduler.timeline import TimelineView
from app.widgets import flow, plan_rows, slots, weekdays  # noqa: F401  (registers kivy classes)
from app.widgets.display import EmptyState, SectionCard
from app.widgets.lists import Row
from app.widgets.long_list import LongList
from app.widgets.pages import LowPage


class UpcomingCard(SectionCard):
    """The plan: bars for each robot, or the starts of 7 days."""
    mode = OptionProperty("hours", options=("hours", "days"))
    timeline = ObjectProperty(TimelineView(), rebind=True)
    days = ListProperty()
    narrow = BooleanProperty(False)
    held = BooleanProperty(False)        # nothing is sent to any robot
    follows = BooleanProperty(True)      # what is shown moves with the time
    bars_height = NumericProperty(0)     # of all robots' lanes
    around = NumericProperty(0)          # height of all but the lanes
    wanted = NumericProperty(0)          # height at which all robots up to four are seen
    least = NumericProperty(0)           # up to three


class TimeControls(BoxLayout):
    """Back, now, forward, zoom in, zoom out: what fingers do, as buttons."""
    card = ObjectProperty(None, rebind=True)


class HoursPart(LowPage):
    """The timeline; many robots scroll."""
    card = ObjectProperty(None, rebind=True)


class DaysPart(LongList):
    """The list of days."""
    card = ObjectProperty(None, rebind=True)


class SchedulerEmpty(EmptyState):
    """There is no robot to plan for."""


class SchedulesCard(SectionCard):
    """The list of schedules."""
    rows = ListProperty()
    note = StringProperty()


class FormCard(SectionCard):
    """The form; ``view`` is what it shows, ``vm`` the FormModel that its fields call."""
    view = ObjectProperty(FormView(), rebind=True)
    more = BooleanProperty(False)
    saving = BooleanProperty(False)
    parameters = ListProperty()
    problems = ObjectProperty({})


class FormWarning(Row, BoxLayout):
    """A sentence beside the form; ``quiet``: something is missing rather than wrong."""
    text = StringProperty()
    quiet = BooleanProperty(False)


class FormPart(BoxLayout):
    """Some fields of the form; which there are is in kv. ``card`` is given when it is made, so kv may read ``root.card.view``."""
    card = ObjectProperty(None, rebind=True)
