"""The widgets of the Logs that kv/logs lays out."""

from __future__ import annotations

from typing import Any

from kivy.clock import Clock
from kivy.properties import BooleanProperty, ListProperty, ObjectProperty, StringProperty
from kivy.uix.boxlayout import BoxLayout
from kivy.uix.stacklayout import StackLayout
from kivy.uix.widget import Widget

from app.widgets import activity_bands, figure_charts, figures, pages  # noqa: F401  (registers kivy classes)
from app.widgets.buttons import CommandButton
from app.widgets.display import SectionCard
from app.widgets.fields import SearchField
from app.widgets.lists import Row
from app.widgets.long_list import LongList

LAYOUT_S = 0.35  # until rows have found their height and the list is at rest


class LogsBody(BoxLayout):
    """What is below the five figures: one part of ``PARTS``; the others do not exist."""

    vm = ObjectProperty(None, rebind=True, allownone=True)
    part = StringProperty()

    def on_vm(self, *_: Any) -> None:
        if (
            self.vm is not None
            and self.part in PARTS
            and not any(type(child) is PARTS[self.part] for child in self.children)
        ):
            self.clear_widgets()
            self.add_widget(PARTS[self.part](vm=self.vm))

    on_part = on_vm


class LogsFilters(StackLayout):
    """Period and robot, for every part; ``card`` is the view model."""

    card = ObjectProperty(None, rebind=True)


class RunsFilters(LogsFilters):
    """And those of the list of runs."""


class ExportButton(CommandButton):
    """Writes the runs that are listed; ``card`` is the view model."""

    card = ObjectProperty(None, rebind=True, allownone=True)


class LogsPart(BoxLayout):
    """Base of the parts."""

    vm = ObjectProperty(None, rebind=True, allownone=True)


class RunsPart(LogsPart):
    """The runs as a list."""


class FiguresPart(LogsPart):
    """Charts and further figures in cards, two columns (one in portrait)."""


class RobotsPart(LogsPart):
    """What the robots did, as bands."""


PARTS = {"runs": RunsPart, "figures": FiguresPart, "robots": RobotsPart}


class MoreCard(SectionCard):
    """A figure with its words; the button in its head explains it: ``vm.explain(key)``."""

    title = StringProperty()
    note = StringProperty()
    about = StringProperty()


class Ranking(BoxLayout):
    """A text, and reasons as ranked bars (RankRow)."""

    text = StringProperty()
    rows = ListProperty()


class LineLegend(BoxLayout):
    """What the drawn band means."""

    text = StringProperty()
    shown = BooleanProperty(True)


class GroupCard(Row, SectionCard):
    """The figures of a group."""

    title = StringProperty()
    note = StringProperty()
    rows = ListProperty()


class RunsSearch(SearchField):
    """The search field of the runs; ``card`` is the view model. Opening it gives it the focus; a restored search does
    not."""

    card = ObjectProperty(None, rebind=True)

    def on_kv_post(self, _base: Widget) -> None:
        self.focus = not self.text


class RunsList(LongList):
    """The runs. ``opened_run`` is the key of the row that shows its story: it is scrolled into sight, also when it has grown."""

    opened_run = ObjectProperty(None, allownone=True)

    def __init__(self, **kwargs: Any) -> None:
        self._scroll_soon = Clock.create_trigger(self._scroll_to_opened, LAYOUT_S)
        self._turn_page_soon = Clock.create_trigger(self._turn_page, LAYOUT_S)
        self._is_pending = False  # opened, but perhaps not in the list yet: it is still being read
        super().__init__(**kwargs)
        self.fbind("opened_run", self._opened)
        self.fbind("data", self._data_changed)

    def _opened(self, *_args: object) -> None:
        self._is_pending = self.opened_run is not None
        self._scroll_soon()

    def _data_changed(self, *_args: object) -> None:
        if self._is_pending:
            self._scroll_soon()

    def _scroll_to_opened(self, _dt: float) -> None:
        """A row that has grown may end below the edge of the list."""
        if not self._is_pending or all(row.key != self.opened_run for row in self.data):
            return
        self._is_pending = False
        view = self._view_of_opened()
        if view is None or view.to_window(0, view.y)[1] < self.to_window(0, self.y)[1] - 1:
            self.show(self.opened_run)
        self._turn_page_soon()

    def _turn_page(self, _dt: float) -> None:
        """In a low window the list itself may be below the fold."""
        if (view := self._view_of_opened()) is not None:
            pages.turn_to(view)

    def _view_of_opened(self) -> Widget | None:
        return next((view for view in self.views if view.key == self.opened_run), None)
