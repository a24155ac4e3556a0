"""The list of schedules: its filter and order, kept while the app runs."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from datetime import datetime
from typing import Any

from kivy.event import EventDispatcher
from kivy.properties import BooleanProperty, ListProperty, ObjectProperty, StringProperty
from kivy.uix.widget import Widget

from app.i18n import _
from app.screens.common.shell import Shell
from app.screens.scheduler import view
from app.screens.scheduler.facts import SchedulerFacts
from app.widgets.items import Option

TOOLS_FROM = 5  # schedules, from which on they can be searched


class ScheduleList(EventDispatcher):
    """``rows`` are those shown; ``has_tools``: enough of them for search, sorting and a filter by robot."""

    rows = ListProperty()
    is_empty = BooleanProperty(False)  # it is known that there are none
    robot = StringProperty()  # words of the chips
    mission = StringProperty()
    listing = ObjectProperty(view.Listing(), rebind=True)
    has_tools = BooleanProperty(False)
    searching = BooleanProperty(False)

    def __init__(self, shell: Shell, now: Callable[[], datetime]) -> None:
        super().__init__()
        self._shell, self._now = shell, now
        self._facts = SchedulerFacts()

    def on_listing(self, *_args: object) -> None:
        """Another filter or order."""
        if self._facts.robots:  # else nothing was read yet
            self.show(self._facts)

    def show(self, facts: SchedulerFacts) -> None:
        self._facts = facts
        self.has_tools = len(facts.schedules) >= TOOLS_FROM
        listing = self.listing if self.has_tools else view.Listing()
        self.rows = view.schedule_rows(facts, self._now(), listing)
        self.is_empty = not facts.schedules
        chosen = facts.group(listing.target[1]) if isinstance(listing.target, tuple) else facts.robot(listing.target)
        mission = facts.mission(listing.mission_id)
        self.robot, self.mission = chosen.name if chosen else _("Robot"), mission.name if mission else _("Mission")

    def set(self, **values: Any) -> None:
        self.listing = replace(self.listing, **values)

    def toggle_search(self) -> None:
        """Closing the search also clears it."""
        self.searching = not self.searching
        if not self.searching:
            self.set(query="")

    def choose_robot(self) -> None:
        self._shell.dialogs.choose(
            _("Schedules of"),
            view.robot_options(self._facts),
            lambda target: self.set(target=target or None),
            selected=self.listing.target or 0,
        )

    def choose_mission(self) -> None:
        self._shell.dialogs.choose(
            _("Schedules of"),
            view.mission_options(self._facts),
            lambda mission: self.set(mission_id=mission or None),
            selected=self.listing.mission_id or 0,
        )

    def choose_order(self, anchor: Widget) -> None:
        items = [
            Option(False, _("By next start"), "sort-clock-ascending-outline"),
            Option(True, _("By name"), "sort-alphabetical-ascending"),
        ]
        self._shell.dialogs.menu(anchor, _("Order of the schedules"), items, lambda by_name: self.set(by_name=by_name))
