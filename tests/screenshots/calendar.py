"""The exception calendar: its card in Settings, the dialog, and closed days in the Scheduler."""
from __future__ import annotations

from datetime import date

from app.domain.models import DayException
from app.screens.settings.calendar import DaysDialog
from app.screens.settings.view import done
from tests.screenshots.registry import LANDSCAPE, picture
from tests.screenshots.settings import BOTH, EVERY_SIZE, Plant

DAYS = (DayException("Inventory", date(2026, 11, 28), date(2026, 11, 28), is_working=True),
        DayException("Fire drill", date(2026, 11, 12), date(2026, 11, 12)),
        DayException("Christmas shutdown", date(2026, 12, 24), date(2027, 1, 3), yearly=True, source="plant-2026.ics"),
        DayException("Summer break", date(2026, 7, 6), date(2026, 7, 19)))


def furnish(container) -> None:
    container.catalogue.add_days(DAYS)
    container.catalogue.set_public_holidays("FI")


def opened(studio, months: int = 0):
    plant = Plant(studio)
    furnish(plant.container)
    screen = plant.screen(studio, "constraints")
    part = screen.page.calendar
    part.turn(months)
    part.file.path = "/home/operator/Documents/plant-2027.ics"
    page = next(widget for widget in screen.walk() if type(widget).__name__ == "ScrollPage")
    page.scroll_y = 0
    studio.driver.advance(.3)
    return plant, screen


@picture("settings-calendar", sizes=EVERY_SIZE)
def calendar(studio):
    return opened(studio)[1]


@picture("settings-calendar-december", sizes=BOTH)
def december(studio):
    _plant, screen = opened(studio, 1)
    screen.page.calendar.outcome = done("14 closed days imported", "Summer break: Mon 6 Jul – Sun 19 Jul")
    page = next(widget for widget in screen.walk() if type(widget).__name__ == "ScrollPage")
    studio.driver.advance(.2)
    page.scroll_y = 0
    studio.driver.advance(.3)
    return screen


@picture("settings-calendar-days", sizes=BOTH)
def days(studio):
    plant = Plant(studio)
    screen = plant.screen(studio, "constraints")
    return studio.dialogs.open(DaysDialog(screen.vm.context, DAYS[3]))


@picture("settings-calendar-country", sizes=(LANDSCAPE,))
def country(studio):
    plant, screen = opened(studio)
    screen.page.calendar.choose_country()
    studio.driver.wait(lambda: plant.shell.background.idle and studio.dialogs.top is not None)
    studio.driver.advance(.3)
    return studio.dialogs.top
