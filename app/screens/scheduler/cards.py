"""The parts of the Scheduler as kv/scheduler/screen.kv lays them out."""

from __future__ import annotations

from typing import Any

from kivy.clock import Clock
from kivy.properties import (
    BooleanProperty,
    ListProperty,
    NumericProperty,
    ObjectProperty,
    OptionProperty,
    StringProperty,
)
from kivy.uix.boxlayout import BoxLayout
from kivy.uix.widget import Widget

from app.screens.scheduler.form_view import SKIPPED, FormView
from app.screens.scheduler.timeline import TimelineView
from app.screens.scheduler.view import Listing
from app.widgets import finger, flow, plan_rows, weekdays  # noqa: F401  (registers kivy classes)
from app.widgets.buttons import CommandButton
from app.widgets.display import EmptyState, LegendItems, SectionCard, StatusBadge
from app.widgets.fields import SearchField
from app.widgets.lists import Row
from app.widgets.long_list import LongList
from app.widgets.pages import LowPage, turn_to
from app.widgets.surfaces import Tap


class PlanExport(CommandButton):
    """Writes the plan as a calendar file."""

    vm = ObjectProperty(None, allownone=True, rebind=True)


class PlanHold(CommandButton):
    """Holds everything, or one robot; releases everything."""

    vm = ObjectProperty(None, allownone=True, rebind=True)


class PartsLine(BoxLayout):
    """In a low window: which part of the Scheduler is shown."""

    screen = ObjectProperty(None, allownone=True, rebind=True)
    pages = ListProperty()  # what is next to the plan


class UpcomingCard(SectionCard):
    """The plan: bars for each robot, or the starts of 7 days."""

    paged = BooleanProperty(False)  # its head is the line of parts
    mode = OptionProperty("hours", options=("hours", "days"))
    timeline = ObjectProperty(TimelineView(), rebind=True)
    days = ListProperty()
    narrow = BooleanProperty(False)
    held = BooleanProperty(False)  # nothing is sent to any robot
    follows = BooleanProperty(True)  # what is shown moves with the time
    bars_height = NumericProperty(0)  # of all robots' lanes
    around = NumericProperty(0)  # height of all but the lanes
    room = NumericProperty(0)  # height that the form and the schedules leave
    lanes = NumericProperty(2)  # that are seen, each of them whole


class TimelineLegend(LegendItems):
    """Below the timeline: at one width it never gets lower, and it changes only without a finger on the screen."""

    most = NumericProperty(0)  # height of most lines so far

    def __init__(self, **kwargs: Any) -> None:
        self._build_later = Clock.create_trigger(self._build, 0.1)
        self._measure = Clock.create_trigger(lambda _dt: setattr(self, "most", self.minimum_height))
        super().__init__(**kwargs)
        self.fbind("width", self._measure)

    def on_minimum_height(self, *_args: object) -> None:
        self.most = max(self.most, self.minimum_height)

    def _build(self, *args: object) -> None:
        if self.items and finger.is_down():
            self._build_later()
        else:
            super()._build(*args)


class UpcomingHead(BoxLayout):
    """The card's title, and the actions for the plan."""

    card = ObjectProperty(None, rebind=True)


class TimeControls(BoxLayout):
    """Back, now, forward, zoom in, zoom out: what fingers do, as buttons."""

    card = ObjectProperty(None, rebind=True)
    roomy = BooleanProperty(True)


class HoursPart(LowPage):
    """The timeline; many robots scroll."""

    card = ObjectProperty(None, rebind=True)


class DaysPart(LongList):
    """The list of days."""

    card = ObjectProperty(None, rebind=True)


class SchedulerEmpty(EmptyState):
    """No robot exists yet."""


class SchedulesCard(SectionCard):
    """The list of schedules; with many of them it can be searched (``tools``), sorted, and narrowed to one robot."""

    rows = ListProperty()
    note = StringProperty()
    tools = BooleanProperty(False)
    searching = BooleanProperty(False)
    listing = ObjectProperty(Listing(), rebind=True)
    empty = StringProperty()

    def __init__(self, **kwargs: Any) -> None:
        self._edited: object = None
        self._tapped: object = None  # the row whose tap is being answered
        self._reveal = Clock.create_trigger(self._bring_in_sight, 0.05)  # when the rows are there
        super().__init__(**kwargs)

    def on_rows(self, *_: object) -> None:
        """What is edited may have been chosen elsewhere."""
        before, self._edited = self._edited, next((row.key for row in self.rows if row.selected), None)
        if self._edited not in (None, before):
            self._reveal()

    def _bring_in_sight(self, _dt: float) -> None:
        """A tapped row stays under the finger, even if only a part of it is visible."""
        rows, tapped, self._tapped = self.ids.schedule_rows, self._tapped, None
        if self._edited != tapped or tapped not in [row.key for row in rows.views]:
            rows.reveal(self._edited)

    def row_action(self, key: int, action: str, *values: object) -> None:
        self._tapped = key if action == "edit" else None
        self.vm.row_action(key, action, *values)


class SchedulesSearch(SearchField):
    """The search field of the schedules. Opening it gives it the focus; a restored search does not."""

    card = ObjectProperty(None, allownone=True, rebind=True)

    def on_kv_post(self, _base: Widget) -> None:
        self.focus = not self.text


class FormCard(SectionCard):
    """The form; ``view`` is what it shows, ``vm`` the FormModel that its fields call. A field with a new problem comes in sight."""

    view = ObjectProperty(FormView(), rebind=True)
    more = BooleanProperty(False)
    stacked = BooleanProperty(False)  # the preview below the fields
    low = BooleanProperty(False)  # without room for these, each is as high as it needs, and the page scrolls
    saving = BooleanProperty(False)
    parameters = ListProperty()
    problems = ObjectProperty({})
    map = ObjectProperty(None, allownone=True)  # on which positions can be chosen

    def __init__(self, **kwargs: Any) -> None:
        self._wrong_field = ""
        self._reveal = Clock.create_trigger(self._bring_in_sight, 0.05)  # once the field exists and shows it
        super().__init__(**kwargs)
        self.fbind("view", self._see_problem)

    def _see_problem(self, *_: object) -> None:
        if self.view.wrong_field not in ("", self._wrong_field):
            self._reveal()
        self._wrong_field = self.view.wrong_field

    def _bring_in_sight(self, _dt: float) -> None:
        said = next(
            (
                widget
                for widget in self.ids.fields.walk(restrict=True)
                if getattr(widget, "faulty", False) and widget.height
            ),
            None,
        )
        if said is not None:
            turn_to(said)


class StartChip(StatusBadge):
    """One of the next starts; ``kind`` is the icon of what is in its way. The time of a skipped one is crossed out."""

    kind = StringProperty()

    def on_kv_post(self, base_widget: object) -> None:
        if self.kind == SKIPPED:
            when, _dot, word = self.text.rpartition(" · ")
            self.ids.badge_text.markup, self.ids.badge_text.text = True, f"[s]{when}[/s] {word}"


class StartChips(LegendItems):
    """The next starts side by side."""

    entry = StartChip


class FormWarning(Row, Tap):
    """A ``line`` beside the form; a tap shows the whole sentence, and again the line."""

    line = StringProperty()
    text = StringProperty()
    quiet = BooleanProperty(False)
    opened = BooleanProperty(False)

    def on_text(self, *_: object) -> None:
        self.opened = False

    def on_release(self) -> None:
        self.opened = not self.opened


class FormPart(BoxLayout):
    """Some fields of the form, listed in kv. ``card`` is set at creation, so kv may read ``root.card.view``."""

    card = ObjectProperty(None, rebind=True)
