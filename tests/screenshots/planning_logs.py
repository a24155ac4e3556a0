"""Logs of an invented month, in every state a person meets."""

from __future__ import annotations

from datetime import timedelta
from typing import Any

from app.container import Container
from app.database.activities import ActivityRepository
from app.domain.activity import ActivitySpan
from app.domain.models import Group, Robot
from app.screens.logs.view import PROBLEMS, Period
from tests.screenshots.planning import EVERY_SIZE, Stand
from tests.screenshots.registry import BOTH, LANDSCAPE, picture


@picture("logs", sizes=EVERY_SIZE)
def logs(studio: Any) -> Any:
    return Stand(studio, "logs").settle()


@picture("logs-story", sizes=EVERY_SIZE)
def story(studio: Any) -> Any:
    stand = Stand(studio, "logs")
    stand.vm.row_action(next(run.id for run in stand.vm.facts.rows if run.state == "failed"))
    return stand.settle()


@picture("logs-problems", sizes=BOTH)
def problems(studio: Any) -> Any:
    stand = Stand(studio, "logs")
    stand.vm.set_filters(period=Period.MONTH, outcomes=PROBLEMS)
    return stand.settle()


@picture("logs-search", sizes=BOTH)
def search(studio: Any) -> Any:
    stand = Stand(studio, "logs")
    stand.vm.toggle_search()
    stand.vm.set_filters(outcomes=("failed", "cancelled"), mission="Move coils to press")
    return stand.settle()


@picture("logs-empty", sizes=BOTH)
def logs_empty(studio: Any) -> Any:
    return Stand(studio, "logs", furnished=False).settle()


@picture("logs-figures", sizes=EVERY_SIZE)
def logs_figures(studio: Any) -> Any:
    stand = Stand(studio, "logs")
    stand.vm.choose_part("figures")
    return stand.settle()


@picture("logs-figures-below", sizes=BOTH)
def logs_figures_below(studio: Any) -> Any:
    screen = logs_figures(studio)
    next(widget for widget in screen.walk() if type(widget).__name__ == "ScrollPage").scroll_y = 0
    studio.driver.advance(0.2)
    return screen


@picture("logs-figure", sizes=BOTH)
def figure(studio: Any) -> Any:
    stand = Stand(studio, "logs")
    stand.vm.choose_part("figures")
    stand.settle()
    stand.vm.figures.explain("adherence")
    return stand.shell.sheets.top


@picture("logs-activity", sizes=EVERY_SIZE)
def logs_activity(studio: Any) -> Any:
    stand = Stand(studio, "logs")
    stand.vm.choose_part("activity")
    return stand.settle()


def fifty(container: Container) -> None:
    """Robots in three halls, each with eight hours of its own."""
    robots = [
        container.catalogue.save_robot(Robot(f"Robot {n}", f"10.0.0.{n}", "user"), "secret") for n in range(1, 51)
    ]
    for hall in range(3):
        members = tuple(robot.id for robot in robots[17 * hall : 17 * (hall + 1)])
        container.catalogue.save_group(Group(f"Hall {hall + 1}", members))
    kinds = ("executing", "idle", "charging", "idle", "executing", "paused", "idle", "offline", "executing", "error")
    for n, robot in enumerate(robots):
        at, spans = container.clock.now() - timedelta(hours=8), []
        for k in range(24):
            end = at + timedelta(minutes=8 + (n * 7 + k * 5) % 23)
            spans.append(ActivitySpan(kinds[(n + k) % len(kinds)], at, min(end, container.clock.now())))
            at = end
        kept = [span for span in spans if span.start < span.end]
        container.db.write(lambda c, robot=robot, kept=kept: ActivityRepository().save(c, robot.id, kept))


@picture("logs-activity-fifty", sizes=(LANDSCAPE,))
def logs_activity_fifty(studio: Any) -> Any:
    stand = Stand(studio, "logs", furnished=False, prepare=fifty)
    stand.vm.choose_part("activity")
    return stand.settle()


@picture("logs-activity-span", sizes=(LANDSCAPE,))
def logs_activity_span(studio: Any) -> Any:
    stand = Stand(studio, "logs")
    stand.vm.choose_part("activity")
    stand.settle()
    stand.vm.activity.show_bar(stand.vm.activity.lanes[0].bars[-1].key)
    return stand.shell.sheets.top


@picture("logs-report", sizes=BOTH)
def logs_report(studio: Any) -> Any:
    stand = Stand(studio, "logs")
    stand.vm.files.report()
    return studio.dialogs.top
