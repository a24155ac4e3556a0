"""Holding starts: the sheet, what is held on the timeline and in the list; a paused schedule; a day off."""

from __future__ import annotations

from datetime import date, time, timedelta
from typing import Any

from app.container import Container
from app.domain.models import DayException
from app.screens.common.shell import pick
from app.screens.scheduler.draft import Kind, Unit
from app.screens.scheduler.facts import SchedulerServices
from app.screens.scheduler.hold import HoldSheet
from tests.screenshots.planning import Stand
from tests.screenshots.registry import BOTH, LANDSCAPE, SMALL, picture
from tests.support import home_facts as sample


def hold(container: Container) -> None:
    now, held = container.clock.now(), sample.HOLD
    container.clock.step((held.since - now).total_seconds())
    container.holds.hold(held.reason, held.until)
    container.clock.step((now - held.since).total_seconds())
    schedules = container.repositories.schedules.all(container.db.read())
    container.pausing.pause(schedules[0].id, now.replace(hour=22, minute=0) + timedelta(days=2))
    container.catalogue.save_days(DayException("Stocktaking", date(2026, 11, 21), date(2026, 11, 22)))


@picture("scheduler-held", sizes=(*BOTH, SMALL))
def held(studio: Any) -> Any:
    return Stand(studio, "scheduler", prepare=hold).settle()


@picture("scheduler-held-form", sizes=BOTH)
def held_form(studio: Any) -> Any:
    stand = Stand(studio, "scheduler", prepare=hold)
    stand.vm.begin()
    stand.vm.form.set(
        mission_id=stand.mission("Waste to compactor"),
        day=date(2026, 11, 20),
        at=time(16, 40),
        kind=Kind.EVERY,
        every=30,
        unit=Unit.MINUTES,
        until_time=time(20, 0),
    )
    return stand.settle()


@picture("scheduler-hold", sizes=BOTH)
def sheet(studio: Any) -> Any:
    stand = Stand(studio, "scheduler", prepare=hold)
    opened = HoldSheet(pick(SchedulerServices, stand.container), stand.shell, stand.vm._facts)
    opened.choose_reason("Audit")
    stand.shell.sheets.show(opened)
    return stand.settle()


@picture("scheduler-pause", sizes=(LANDSCAPE,))
def pause(studio: Any) -> Any:
    stand = Stand(studio, "scheduler")
    stand.vm.actions.pause(stand.schedule("Waste to compactor"))
    return studio.dialogs.top
