"""The tab of key figures: its page is read when it is shown, and leads to the runs that it counts."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Any

from kivy.properties import ObjectProperty

from app.screens.logs import key_figures, numbers
from app.screens.logs.figures import Figures, read_figures
from app.screens.logs.files import explain
from app.screens.logs.key_figures import FiguresPage
from app.screens.logs.part import LogsPart
from app.screens.logs.view import Filters


class FiguresTab(LogsPart[Figures]):
    page = ObjectProperty(FiguresPage(), rebind=True)

    def _start_reading(self) -> Callable[[], Figures]:
        services, filters, now, zone = self._services, self._logs.wanted, self._services.clock.now(), self._logs.zone
        return lambda: read_figures(services, filters, now, zone)

    def show(self) -> None:
        self.page = key_figures.page(self._facts)

    def explain(self, key: str) -> None:
        """What a figure means, and the numbers behind it."""
        if self._facts is not None:
            explain(self._shell, numbers.explanation(key, self._facts))

    def show_runs(self, **changes: Any) -> None:
        """Some of those that the figures count."""
        filters = self._logs.wanted
        self._logs.show_runs(replace(Filters(filters.period, filters.robot_id, group=filters.group), **changes))
