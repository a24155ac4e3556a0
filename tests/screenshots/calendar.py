"""The exception calendar: its card in Settings, the dialog, and days off in the Scheduler."""

from __future__ import annotations

import os
from datetime import UTC, date, datetime

from app.domain.models import DayException
from tests.screenshots.registry import LANDSCAPE, picture
from tests.screenshots.settings import BOTH, EVERY_SIZE, Plant
from tests.support.edits import add_days

DAYS = (
    DayException("Inventory", date(2026, 11, 28), date(2026, 11, 28), is_working=True),
    DayException("Fire drill", date(2026, 11, 12), date(2026, 11, 12)),
    DayException("Summer break", date(2026, 7, 6), date(2026, 7, 19)),
)
FILE = "plant-2027.ics"
IN_FILE = """BEGIN:VCALENDAR
VERSION:2.0
PRODID:-//Plant//Calendar//EN
BEGIN:VEVENT
UID:1@plant
DTSTAMP:20261102T080000Z
SUMMARY:Christmas shutdown
DTSTART;VALUE=DATE:20261224
DTEND;VALUE=DATE:20270104
END:VEVENT
BEGIN:VEVENT
UID:2@plant
DTSTAMP:20261102T080000Z
SUMMARY:Summer break
DTSTART;VALUE=DATE:20270705
DTEND;VALUE=DATE:20270719
END:VEVENT
BEGIN:VEVENT
UID:3@plant
DTSTAMP:20261102T080000Z
SUMMARY:Four-day weeks
DTSTART;VALUE=DATE:20270604
RRULE:FREQ=WEEKLY;UNTIL=20270730
END:VEVENT
BEGIN:VEVENT
UID:4@plant
DTSTAMP:20261102T080000Z
SUMMARY:Fire drill
DTSTART:20270112T090000
DTEND:20270112T100000
END:VEVENT
BEGIN:VEVENT
UID:5@plant
DTSTAMP:20261102T080000Z
SUMMARY:Team meeting
DTSTART:20260105T090000
RRULE:FREQ=WEEKLY
END:VEVENT
END:VCALENDAR
"""


def furnish(container) -> None:
    add_days(container.catalogue, DAYS)
    container.catalogue.set_public_holidays("FI")


def opened(studio):
    """With a calendar file among the documents."""
    plant, documents = Plant(studio), studio.directory()
    file = documents / FILE
    file.write_text(IN_FILE.replace("\n", "\r\n"), encoding="utf-8")
    os.utime(file, (datetime(2026, 11, 2, 8, tzinfo=UTC).timestamp(),) * 2)
    plant.container.calendar_files._documents = documents
    furnish(plant.container)
    screen = plant.screen(studio, "constraints")
    page = next(widget for widget in screen.walk() if type(widget).__name__ == "ScrollPage")
    page.scroll_y = 0
    studio.driver.advance(0.3)
    return plant, screen


@picture("settings-calendar", sizes=EVERY_SIZE)
def calendar(studio):
    return opened(studio)[1]


@picture("settings-calendar-import", sizes=EVERY_SIZE)
def offer(studio):
    """The days of its file, as they are shown before they are taken."""
    plant, screen = opened(studio)
    sheets = plant.shell.sheets
    for _step in ("file", "days"):
        screen.page.calendar.import_days() if sheets.top is None else sheets.top.dispatch("on_done")
        studio.driver.wait(lambda: plant.shell.background.idle and sheets.top.items)
        studio.driver.advance(0.3)
    return screen


@picture("settings-calendar-days", sizes=BOTH)
def days(studio):
    _plant, screen = opened(studio)
    screen.page.calendar.choose_day(DAYS[0].first_day)
    studio.driver.advance(0.3)
    return screen


@picture("settings-calendar-country", sizes=(LANDSCAPE,))
def country(studio):
    plant, screen = opened(studio)
    screen.page.calendar.choose_country()
    studio.driver.wait(lambda: plant.shell.background.idle and studio.dialogs.top is not None)
    studio.driver.advance(0.3)
    return studio.dialogs.top
