"""The tab of activity: lanes of what the robots did, read when it is shown."""

from __future__ import annotations

from collections.abc import Callable, Hashable
from typing import TYPE_CHECKING

from kivy.event import EventDispatcher
from kivy.properties import BooleanProperty, ListProperty, ObjectProperty, StringProperty

from app.i18n import _
from app.screens.common.shell import Shell
from app.screens.common.view_model import Refresher
from app.screens.logs import activity
from app.screens.logs.activity import ActivityFacts, Window
from app.screens.logs.facts import LogsServices
from app.screens.logs.files import explain

if TYPE_CHECKING:
    from app.screens.logs.screen import LogsViewModel


class ActivityTab(EventDispatcher):
    lanes = ListProperty()
    ticks = ListProperty()
    legend = ListProperty()
    mark = ObjectProperty(None, allownone=True)  # the band whose details are shown
    length = StringProperty()  # of the time that the lanes show
    when = StringProperty()
    is_now = BooleanProperty(True)

    def __init__(self, services: LogsServices, shell: Shell, logs: LogsViewModel) -> None:
        super().__init__()
        self._services, self._shell, self._logs = services, shell, logs
        self._window = Window()
        self._facts: ActivityFacts | None = None
        self._open_group: Hashable = None
        self.refresher = Refresher(shell, self._start_reading, self._take)

    def _start_reading(self) -> Callable[[], tuple[object, ActivityFacts]]:
        services, filters, window, now = self._services, self._logs.wanted, self._window, self._services.clock.now()
        return lambda: ((filters, window), activity.read_activity(services, filters, window, now))

    def _take(self, found: tuple[object, ActivityFacts]) -> None:
        wanted, facts = found
        if wanted == (self._logs.wanted, self._window):
            self._facts = facts
            self.show()

    def show(self) -> None:
        self.length, self.is_now = activity.window_word(self._window), self._window.end is None
        if (found := self._facts) is not None:
            self.lanes, self.ticks = activity.lanes(found, self._open_group), activity.ticks(found, self._logs.zone)
            self.legend, self.when = activity.legend(found), activity.when(found, self._logs.zone)

    def show_moment(self, robot_id: int, place: float) -> None:
        """What a robot did at ``place`` 0..1 of the time, from when to when."""
        facts = self._facts
        found = activity.span_at(facts, robot_id, place) if facts else None
        if facts is not None and found is not None:
            self.mark = robot_id, facts.place(found[1].start), facts.place(found[1].end)
            dialog = explain(self._shell, activity.span_details(*found, facts.end, self._logs.facts.settings.timezone))
            dialog.bind(on_dismiss=lambda _dialog: setattr(self, "mark", None))

    def show_group(self, key: Hashable) -> None:
        self._open_group = key
        self.show()

    def move(self, by: int) -> None:
        """The time before (-1) or after (1); 0: now."""
        now = self._services.clock.now()
        self._look(self._window.moved(by > 0, now) if by else Window(self._window.length))

    def choose_length(self) -> None:
        self._shell.dialogs.choose(
            _("Time"),
            activity.window_options(),
            lambda length: self._look(Window(length, self._window.end)),
            selected=self._window.length,
        )

    def _look(self, window: Window) -> None:
        self._window = window
        self.show()
        self.refresher.reread()
