"""The parts of the Scheduler as kv/scheduler/screen.kv lays them out."""
from __future__ import annotations

from kivy.properties import BooleanProperty, ListProperty, NumericProperty, ObjectProperty, OptionProperty, StringProperty
from kivy.uix.boxlayout import BoxLayout

from app.screens.scheduler.draft import Kind
from app.screens.scheduler.form_view import FormView
from app.screens.scheduler.timeline import TimelineView
from app.widgets import flow, plan_rows, slots, weekdays  # noqa: F401  (kv's Factory learns them)
from app.widgets.display import EmptyState, SectionCard
from app.widgets.lists import Row
from app.widgets.long_list import LongList
from app.widgets.pages import LowPage


class UpcomingCard(SectionCard):
    """The plan: bars of 24 hours per robot, or the starts of 7 days."""
    mode = OptionProperty("hours", options=("hours", "days"))
    timeline = ObjectProperty(TimelineView(), rebind=True)
    days = ListProperty()
    narrow = BooleanProperty(False)
    follows = BooleanProperty(True)      # what is shown goes with the time
    bars_height = NumericProperty(0)     # of all robots' lanes
    wanted = NumericProperty(0)          # height at which all robots up to four are seen


class TimeControls(BoxLayout):
    """Back, now, forward, nearer, further: what fingers do, as buttons."""
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
    """The form; ``view`` are its words, ``vm`` the FormModel that its fields call."""
    view = ObjectProperty(FormView(), rebind=True)
    more = BooleanProperty(False)
    saving = BooleanProperty(False)
    parameters = ListProperty()
    problems = ObjectProperty({})


class FormWarning(Row, BoxLayout):
    """A sentence beside the form; ``quiet``: what is still missing rather than wrong."""
    text = StringProperty()
    quiet = BooleanProperty(False)


class FormPart(BoxLayout):
    """Some fields of the form. ``card`` is given when it is made, so kv may read ``root.card.view``."""
    card = ObjectProperty(None, rebind=True)


class WeeklyFields(FormPart):
    """Which days."""


class EveryFields(FormPart):
    """How often, from when to when, on which days."""


class MonthDayFields(FormPart):
    """A day of the month."""


class MonthWeekdayFields(FormPart):
    """An n-th weekday of the month."""


class OtherFields(FormPart):
    """A rule that the form can't say."""


class FreeTime(FormPart):
    """The offer of a free time."""


class MoreFields(FormPart):
    """What is seldom needed."""


def fields_of_kind(kind: str, by_weekday: bool) -> str:
    """The part with the fields of that kind of recurrence; empty: it needs none."""
    monthly = "MonthWeekdayFields" if by_weekday else "MonthDayFields"
    return {Kind.WEEKLY: "WeeklyFields", Kind.EVERY: "EveryFields", Kind.MONTHLY: monthly, Kind.OTHER: "OtherFields"}.get(Kind(kind), "")
