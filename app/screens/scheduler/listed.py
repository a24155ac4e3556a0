"""The list of schedules: which of them, and in which order, as long as the app runs. While somebody works in it, no row changes places."""
from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from datetime import datetime
from typing import Any

from kivy.clock import Clock
from kivy.event import EventDispatcher
from kivy.properties import BooleanProperty, ListProperty, ObjectProperty, StringProperty
from kivy.uix.widget import Widget

from app.i18n import _
from app.screens.common.options import MenuItem
from app.screens.common.shell import Shell
from app.screens.scheduler import view
from app.screens.scheduler.facts import SchedulerFacts

TOOLS_FROM = 5                           # schedules, from which on they can be searched
QUIET_S = 30.0                           # after the last touch, until rows may change places


class ScheduleList(EventDispatcher):
    """``rows`` is what is shown; ``has_tools``: there are enough of them to be searched, sorted and narrowed to a robot."""
    rows = ListProperty()
    note = StringProperty()
    empty = StringProperty()             # said once it is known that there are none
    listing = ObjectProperty(view.Listing(), rebind=True)
    has_tools = BooleanProperty(False)
    searching = BooleanProperty(False)

    def __init__(self, shell: Shell, now: Callable[[], datetime]) -> None:
        super().__init__()
        self._shell, self._now = shell, now
        self._facts: SchedulerFacts | None = None
        self._editing: int | None = None
        self._quiet = Clock.create_trigger(lambda _dt: self._show_again(), QUIET_S)
        self.fbind("listing", lambda *_args: self.renew())

    def keep(self) -> None:
        """Somebody works in the list: the rows stay in their order for a while."""
        self._quiet.cancel()
        self._quiet()

    def renew(self) -> None:
        """The list is looked at anew, or another one: in its order."""
        self._quiet.cancel()
        self._show_again()

    def _show_again(self) -> None:
        if self._facts is not None:
            self.show(self._facts, self._editing)

    def show(self, facts: SchedulerFacts, editing: int | None) -> None:
        self._facts, self._editing = facts, editing
        self.has_tools = len(facts.schedules) >= TOOLS_FROM
        listing = self.listing if self.has_tools else view.Listing()
        rows = view.schedule_rows(facts, self._now(), editing, listing)
        self.rows = _in_order(rows, [row.key for row in self.rows]) if self._quiet.is_triggered else rows
        self.note, self.empty = view.schedules_note(facts, listing.target), view.schedules_empty(facts)

    def set(self, **values: Any) -> None:
        self.listing = replace(self.listing, **values)

    def toggle_search(self) -> None:
        """Closing the search also clears it."""
        self.searching = not self.searching
        if not self.searching:
            self.set(query="")

    def choose_robot(self) -> None:
        if self._facts is None:
            return
        self._shell.dialogs.choose(_("Schedules of"), view.robot_options(self._facts), lambda target: self.set(target=target or None),
                                   selected=self.listing.target or 0)

    def choose_order(self, anchor: Widget) -> None:
        items = [MenuItem(False, _("By next start"), "sort-clock-ascending-outline"),
                 MenuItem(True, _("By name"), "sort-alphabetical-ascending")]
        self._shell.dialogs.menu(anchor, _("Order of the schedules"), items, lambda by_name: self.set(by_name=by_name))


def _in_order(rows: Sequence[view.ScheduleItem], before: Sequence[int]) -> list[view.ScheduleItem]:
    """As they stood ``before``; new ones where they belong."""
    by_key = {row.key: row for row in rows}
    kept = [by_key[key] for key in before if key in by_key]
    for place, row in enumerate(rows):
        if row.key not in before:
            kept.insert(place, row)
    return kept
