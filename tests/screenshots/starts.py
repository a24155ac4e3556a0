"""The Scheduler with starts at the same time, skipped ones, schedules with names of their own and one that is over."""

from __future__ import annotations

from dataclasses import replace
from datetime import UTC, datetime
from typing import Any

from app.container import Container
from app.domain.models import Schedule
from app.screens.logs.view import Period
from tests.screenshots.planning import EVERY_SIZE, Stand
from tests.screenshots.registry import BOTH, LARGE_TEXT, SMALL, picture
from tests.support import month
from tests.support.edits import skip_next

MONDAY = datetime(2026, 11, 23, 4, 0, tzinfo=UTC)  # 06:00 there


def alike(container: Container) -> None:
    """Two starts at the same time, one that a person has named, one that is skipped, and a one-time schedule that is over."""
    c, catalogue = container.db.read(), container.catalogue
    schedules = {schedule.name: schedule for schedule in container.repositories.schedules.all(c)}
    count, kits = schedules["Night stock count on Aino"], schedules["Deliver kits to line 2 on Aino"]
    catalogue.save_schedule(replace(count, id=0, name="Second count"))
    catalogue.save_schedule(replace(kits, name="Morning round"))
    once = catalogue.save_schedule(
        Schedule("", kits.robot_id, kits.mission_id, datetime(2026, 11, 20, 17, 30), month.ZONE)
    )
    skip_next(container, once.id)
    container.pausing.skip(kits.id, datetime(2026, 11, 20, 14, 0, tzinfo=UTC))


@picture("scheduler-over", sizes=(*BOTH, SMALL, LARGE_TEXT))
def over(studio: Any) -> Any:
    """The list of schedules with one that is over."""
    stand = Stand(studio, "scheduler", prepare=alike)
    stand.screen.choose_tab("schedules")
    return stand.settle()


@picture("scheduler-skipped", sizes=EVERY_SIZE)
def skipped(studio: Any) -> Any:
    """The form of a schedule with one future start skipped."""
    stand = Stand(studio, "scheduler", prepare=alike)
    stand.vm.edit(next(one.id for one in stand.vm._facts.schedules if one.name == "Morning round"))
    return stand.settle()


@picture("logs-skipped", sizes=EVERY_SIZE)
def skipped_ahead(studio: Any) -> Any:
    """The story of a start of another day that is skipped today."""

    def skip(container: Container) -> None:
        kits = next(one.id for one in container.catalogue.schedules() if one.name == "Deliver kits to line 2 on Aino")
        container.pausing.skip(kits, MONDAY)

    stand = Stand(studio, "logs", prepare=skip)
    stand.vm.set_filters(period=Period.ALL)
    stand.settle()
    stand.vm.open_story(next(row.key for row in stand.vm.rows if isinstance(row.key, int)))
    return stand.settle()
