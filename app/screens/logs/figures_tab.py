"""The tab of key figures: its page is read when it is shown, and leads to the runs that it counts."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import TYPE_CHECKING, Any

from kivy.event import EventDispatcher
from kivy.properties import ObjectProperty

from app.screens.common.shell import Shell
from app.screens.common.view_model import Refresher
from app.screens.logs import key_figures, numbers
from app.screens.logs.facts import LogsServices
from app.screens.logs.figures import Figures, read_figures
from app.screens.logs.files import explain
from app.screens.logs.key_figures import FiguresPage
from app.screens.logs.view import Filters

if TYPE_CHECKING:
    from app.screens.logs.screen import LogsViewModel


class FiguresTab(EventDispatcher):
    page = ObjectProperty(FiguresPage(), rebind=True)

    def __init__(self, services: LogsServices, shell: Shell, logs: LogsViewModel) -> None:
        super().__init__()
        self._services, self._shell, self._logs = services, shell, logs
        self._figures: Figures | None = None
        self.refresher = Refresher(shell, self._start_reading, self._take, wanted=lambda: logs.wanted)

    def _start_reading(self) -> Callable[[], Figures]:
        services, filters, now, zone = self._services, self._logs.wanted, self._services.clock.now(), self._logs.zone
        return lambda: read_figures(services, filters, now, zone)

    def _take(self, figures: Figures) -> None:
        self._figures = figures
        self.show()

    def show(self) -> None:
        self.page = key_figures.page(self._figures)

    def explain(self, key: str) -> None:
        """What a figure means, and the numbers behind it."""
        if self._figures is not None:
            explain(self._shell, numbers.explanation(key, self._figures))

    def show_runs(self, **changes: Any) -> None:
        """Some of those that the figures count."""
        filters = self._logs.wanted
        self._logs.show_runs(replace(Filters(filters.period, filters.robot_id, group=filters.group), **changes))
