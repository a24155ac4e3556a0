"""Logs of an invented month, in every state a person meets."""

from __future__ import annotations

from typing import Any

from app.i18n import _
from tests.screenshots.planning import EVERY_SIZE, Stand
from tests.screenshots.registry import BOTH, LANDSCAPE, picture


@picture("logs", sizes=EVERY_SIZE)
def logs(studio: Any) -> Any:
    stand = Stand(studio, "logs")
    stand.vm.toggle(
        next(row.key for row in stand.vm.rows if row.outcome == _("Working"))
    )  # seen with all that is newer
    return stand.settle()


@picture("logs-month", sizes=BOTH)
def logs_month(studio: Any) -> Any:
    stand = Stand(studio, "logs")
    stand.vm.choose_period("month")
    return stand.settle()


@picture("logs-search", sizes=BOTH)
def search(studio: Any) -> Any:
    stand = Stand(studio, "logs")
    stand.vm.toggle_search()
    stand.vm.set_filters(outcomes=("failed", "skipped"), mission="Move coils to press")
    return stand.settle()


@picture("logs-nothing", sizes=(LANDSCAPE,))
def nothing(studio: Any) -> Any:
    stand = Stand(studio, "logs")
    stand.vm.set_filters(outcomes=("missed",))
    return stand.settle()


@picture("logs-outcomes", sizes=BOTH)
def outcomes(studio: Any) -> Any:
    stand = Stand(studio, "logs")
    stand.vm.choose_outcomes()
    return studio.dialogs.top


@picture("logs-figure", sizes=BOTH)
def figure(studio: Any) -> Any:
    stand = Stand(studio, "logs")
    stand.vm.explain("adherence")
    return studio.dialogs.top


@picture("logs-utilisation", sizes=(LANDSCAPE,))
def utilisation(studio: Any) -> Any:
    stand = Stand(studio, "logs")
    stand.vm.explain("utilisation")
    return studio.dialogs.top


@picture("logs-empty", sizes=BOTH)
def logs_empty(studio: Any) -> Any:
    stand = Stand(studio, "logs", furnished=False)
    stand.vm.choose_period("all")
    return stand.settle()


@picture("logs-figures", sizes=EVERY_SIZE)
def logs_figures(studio: Any) -> Any:
    stand = Stand(studio, "logs")
    stand.vm.choose_period("month")
    stand.vm.choose_part("figures")
    return stand.settle()


@picture("logs-figures-below", sizes=BOTH)
def logs_figures_below(studio: Any) -> Any:
    screen = logs_figures(studio)
    next(widget for widget in screen.walk() if type(widget).__name__ == "LowColumn").scroll_y = 0
    studio.driver.advance(0.2)
    return screen


@picture("logs-causes", sizes=(LANDSCAPE,))
def causes(studio: Any) -> Any:
    stand = Stand(studio, "logs")
    stand.vm.choose_part("figures")
    stand.settle()
    stand.vm.explain("causes")
    return studio.dialogs.top


@picture("logs-robots", sizes=EVERY_SIZE)
def logs_robots(studio: Any) -> Any:
    stand = Stand(studio, "logs")
    stand.vm.choose_part("robots")
    return stand.settle()


@picture("logs-robots-today", sizes=BOTH)
def logs_robots_today(studio: Any) -> Any:
    stand = Stand(studio, "logs")
    stand.vm.choose_period("today")
    stand.vm.choose_part("robots")
    return stand.settle()


@picture("logs-robot-span", sizes=(LANDSCAPE,))
def logs_robot_span(studio: Any) -> Any:
    stand = Stand(studio, "logs")
    stand.vm.choose_part("robots")
    stand.settle()
    stand.vm.show_moment(stand.vm.lanes[0].key, 0.93)
    return studio.dialogs.top


@picture("logs-report", sizes=BOTH)
def logs_report(studio: Any) -> Any:
    stand = Stand(studio, "logs")
    stand.vm.choose_report()
    return studio.dialogs.top


@picture("logs-failed", sizes=BOTH)
def logs_failed(studio: Any) -> Any:
    stand = Stand(studio, "logs")
    stand.vm.set_filters(outcomes=("failed",))
    stand.settle()
    stand.vm.toggle(stand.vm.rows[0].key)
    return stand.settle()
