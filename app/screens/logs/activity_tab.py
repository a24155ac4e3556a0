"""The tab of activity: lanes of what the robots did, read when it is shown."""

from __future__ import annotations

from collections.abc import Callable, Hashable

from kivy.properties import BooleanProperty, ListProperty, NumericProperty, StringProperty

from app.domain.activity import ActivitySpan
from app.i18n import _
from app.screens.common import formats
from app.screens.logs import activity
from app.screens.logs.activity import HOUR, ActivityFacts, Window
from app.screens.logs.files import explain
from app.screens.logs.part import LogsPart


class ActivityTab(LogsPart[ActivityFacts]):
    """``first`` and ``hours`` are the visible time, in hours from the same instant as the bars."""

    lanes = ListProperty()
    ticks = ListProperty()
    legend = ListProperty()
    first = NumericProperty(0, force_dispatch=True)  # a finger has moved the lanes
    hours = NumericProperty(8)
    length = StringProperty()  # of the time that the lanes show
    is_now = BooleanProperty(True)
    touched = False  # a finger moves the lanes now

    _window = Window()
    _open_group: Hashable = None

    def _wanted(self) -> object:
        return self._logs.wanted, self._window

    def _start_reading(self) -> Callable[[], ActivityFacts]:
        services, filters, window, now = self._services, self._logs.wanted, self._window, self._services.clock.now()
        return lambda: activity.read_activity(services, filters, window, now)

    def show(self) -> None:
        self.length, self.is_now = activity.window_word(self._window), self._window.end is None
        if (found := self._facts) is not None and not self.touched:
            self.lanes, self.ticks = activity.lanes(found, self._open_group), activity.ticks(found, self._logs.zone)
            self.legend = activity.legend(found)
            self.first, self.hours = 0, found.hour(found.end)

    def day_at(self, hour: float) -> str:
        """The day of that hour."""
        if self._facts is None:
            return ""
        return formats.wall_day((self._facts.start + hour * HOUR).astimezone(self._logs.zone).date())

    def show_bar(self, key: tuple[int, ActivitySpan]) -> None:
        """What a robot did, from when to when."""
        facts = self._facts
        if facts is not None and (found := activity.span_of(facts, key)) is not None:
            explain(self._shell, activity.span_details(*found, facts.end, self._logs.facts.settings.timezone))

    def finger_moved(self, first: float) -> None:
        """Show the time that begins at that hour."""
        if self._facts is not None:
            end = self._facts.end + first * HOUR
            self._look(Window(self._window.length, end).within(self._services.clock.now()))

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
