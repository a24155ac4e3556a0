"""The exception calendar in an integrator's hands: by hand, by country, from a file; days off in the Scheduler."""

from __future__ import annotations

import threading
from collections.abc import Iterator
from datetime import date, datetime

import pytest

from app.domain.clock import SystemClock
from app.domain.models import DayException
from app.screens.settings.calendar import DaysSheet, EventsSheet
from app.screens.settings.files import FileSheet
from app.services.files.calendar_import import CalendarFiles
from app.widgets.buttons import CommandButton, IconButton, Segment, Toggle
from app.widgets.choices import OptionRow
from app.widgets.fields import Field, SearchField
from app.widgets.list_row import ListRow
from app.widgets.month import MonthDay
from app.widgets.pickers import DateSheet
from app.widgets.snackbar import Snackbar
from app.widgets.surfaces import Tap
from tests.support.effort import calls_of_this_thread
from tests.ui.integrator import choose, choose_row, enter, go, page, press, reveal, says, settings, undo

TODAY = date(2026, 11, 20)  # a Friday


@pytest.fixture(scope="module")
def first_settings():
    return {"timezone": "UTC"}


@pytest.fixture(scope="module", autouse=True)
def today() -> Iterator[None]:
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(SystemClock, "now", lambda _clock: datetime.fromisoformat("2026-11-20T12:38:00+00:00"))
        yield


@pytest.fixture
def app(app, ui):
    """With the calendar in sight."""
    go(ui, "constraints")
    ui.wait(
        lambda: ui.find_all(MonthDay, text="20", today=True) and app.shell.background.idle
    )  # the files' places move it
    return app


def tap(ui, kind, root=None, **values) -> None:
    widget = ui.find(kind, root=root, **values)
    if root is None:
        reveal(ui, widget)
    ui.tap(widget)


def entries(site) -> list[DayException]:
    return site.container.catalogue.day_exceptions()


def add_days(ui, name: str) -> DaysSheet:
    tap(ui, CommandButton, text="Add")
    sheet = ui.find(DaysSheet)
    enter(ui, sheet.ids.name_field, name)
    sheet.ids.name_field.focus = False
    return sheet


def supports(ui) -> list[str]:
    """What supports the entries of the month."""
    return [row.item.support for row in ui.find_all(ListRow) if isinstance(row.key, tuple)]


def test_closed_days_are_entered_changed_deleted_and_brought_back(site, app, ui):
    sheet = add_days(ui, "Summer break")
    ui.tap(ui.find(Field, root=sheet, label="Last day"))
    ui.tap(ui.find(MonthDay, root=ui.find(DateSheet), day=date(2026, 11, 27)))
    press(ui, "Set Fri 27 Nov", ui.find(DateSheet))
    press(ui, "Save", sheet)
    ui.wait(lambda: len(entries(site)) == 1)
    [stored] = entries(site)
    assert stored == DayException("Summer break", TODAY, date(2026, 11, 27), id=stored.id)
    ui.wait(lambda: supports(ui) == ["Fri 20 Nov – Fri 27 Nov"] and not ui.find_all(DaysSheet))
    assert [cell.item.text for cell in ui.find_all(MonthDay, status="closed")] == [str(day) for day in range(20, 28)]

    tap(ui, MonthDay, text="23")  # a day of it opens it
    sheet = ui.find(DaysSheet)
    assert (sheet.title, sheet.it.name) == ("Summer break", "Summer break")
    ui.tap(ui.find(Toggle, root=sheet))
    ui.wait(lambda: entries(site)[0].yearly)  # at once
    ui.wait(lambda: supports(ui) == ["Fri 20 Nov – Fri 27 Nov · every year"])
    ui.wait(lambda: ui.find_all(Tap, root=ui.find(Snackbar)))
    undo(ui)
    ui.wait(lambda: entries(site) == [stored] and not sheet.it.yearly)

    choose(ui, "Delete", sheet)
    ui.wait(lambda: entries(site) == [])
    ui.wait(lambda: not supports(ui))
    ui.wait(lambda: ui.find_all(Tap, root=ui.find(Snackbar)))
    undo(ui)
    ui.wait(lambda: [entry.name for entry in entries(site)] == ["Summer break"])


def test_a_free_day_becomes_an_extra_working_day_and_says_so(site, app, ui):
    tap(ui, MonthDay, text="28")  # a Saturday
    sheet = ui.find(DaysSheet)
    assert sheet.it.is_working
    enter(ui, sheet.ids.name_field, "Inventory")
    press(ui, "Save", sheet)
    ui.wait(lambda: entries(site) and entries(site)[0].is_working)
    ui.wait(lambda: ui.find_all(MonthDay, text="28", status="extra"))
    assert supports(ui) == ["Sat 28 Nov · extra working day"]
    assert site.container.calendar().day_status(date(2026, 11, 28)).name == "Inventory"


def test_days_without_a_name_are_refused_at_the_field(site, app, ui):
    sheet = add_days(ui, " ")
    press(ui, "Save", sheet)
    ui.wait(lambda: sheet.ids.name_field.problem == "Enter a name")
    ui.tap(ui.find(Segment, root=sheet, text="Extra working days"))
    enter(ui, sheet.ids.name_field, "Fair")
    press(ui, "Save", sheet)
    ui.wait(lambda: [entry.name for entry in entries(site)] == ["Fair"])


def test_a_country_is_found_by_name_and_its_holidays_are_closed(site, app, ui):
    tap(ui, Field, label="Public holidays")
    ui.wait(lambda: ui.find_all(SearchField))
    ui.type(ui.find(SearchField), "Germ")
    ui.wait(lambda: [row.item.title for row in ui.find_all(OptionRow)] == ["Germany"])
    ui.tap(ui.find(OptionRow, title="Germany"))
    ui.wait(lambda: settings(site).holiday_country == "DE")
    ui.wait(lambda: ui.find(Field, label="Public holidays").value == "Germany")
    ui.wait(lambda: not ui.find(Field, label="Region").disabled)
    tap(ui, Field, label="Region")
    ui.wait(lambda: ui.find_all(SearchField))
    ui.type(ui.find(SearchField), "Bay")
    ui.wait(lambda: [row.item.title for row in ui.find_all(OptionRow)] == ["Bayern"])
    ui.tap(ui.find(OptionRow))
    ui.wait(lambda: settings(site).holiday_subdivision == "BY")
    tap(ui, IconButton, icon="chevron-right")
    ui.wait(lambda: says(ui, "December 2026"))
    ui.wait(lambda: supports(ui) == ["Fri 25 Dec · public holiday", "Sat 26 Dec · public holiday"])
    tap(ui, MonthDay, text="25")  # a working day in spite of the holiday
    sheet = ui.find(DaysSheet)
    assert (sheet.it.name, sheet.it.is_working) == ("Christmas Day", True)
    press(ui, "Save", sheet)
    ui.wait(lambda: ui.find_all(MonthDay, text="25", status="extra"))


EVENTS = (("Audit", "20261124", "20261126"), ("Meeting", "20261127T080000", "20261127T100000"))


def import_file(site, ui, *events: tuple[str, ...]) -> EventsSheet:
    """Returns the choice of their days."""
    write_file(site, *events)
    return import_again(ui)


def write_file(site, *events: tuple[str, ...]) -> None:
    """A file with these events: names, starts, ends."""
    body = [
        line
        for name, start, end in events
        for line in ("BEGIN:VEVENT", f"SUMMARY:{name}", f"DTSTART:{start}", f"DTEND:{end}", "END:VEVENT")
    ]
    (site.documents / "plant.ics").write_text("\r\n".join(["BEGIN:VCALENDAR", *body, "END:VCALENDAR"]))


def import_again(ui) -> EventsSheet:
    press(ui, "Import", open_import(ui))
    ui.wait(lambda: ui.find_all(EventsSheet))
    ui.advance(0.5)  # until it takes touches
    return ui.find(EventsSheet)


def open_import(ui) -> FileSheet:
    tap(ui, CommandButton, text="Import")
    ui.wait(lambda: ui.find_all(FileSheet) and ui.find(FileSheet).file)
    ui.advance(0.5)
    return ui.find(FileSheet)


def test_a_file_that_is_read_late_asks_nothing_on_another_screen(site, app, ui, monkeypatch):
    read, is_there = CalendarFiles.read, threading.Event()
    monkeypatch.setattr(CalendarFiles, "read", lambda *args: is_there.wait(20) and read(*args))
    write_file(site, *EVENTS)
    press(ui, "Import", open_import(ui))
    app.shell.go("home")
    is_there.set()
    ui.wait(lambda: app.shell.background.idle)
    assert app.shell.sheets.top is None


def test_the_days_of_a_calendar_file_are_shown_and_taken_as_ticked(site, app, ui):
    sheet = import_file(site, ui, *EVENTS, ("Old", "20200101", "20200102"))
    assert (sheet.title, sheet.notes) == ("1 of 2 chosen", "1 past event left out")
    assert [(item.title, item.support, item.ticked) for item in sheet.items] == [
        ("Whole days", "", None),
        ("Audit", "Tue 24 Nov 2026 – Wed 25 Nov 2026", True),
        ("With times of day", "", None),
        ("Meeting", "Fri 27 Nov 2026", False),
    ]
    assert entries(site) == []
    press(ui, "Make these days off", sheet)
    ui.wait(lambda: says(ui, "2 days off imported"))
    assert [(entry.name, entry.source) for entry in entries(site)] == [("Audit", "plant.ics")]
    sheet = import_again(ui)
    assert (sheet.title, sheet.foot_off) == ("0 of 1 chosen", "Choose days")
    assert sheet.notes == "1 event is in the calendar already\n1 past event left out"
    choose_row(ui, sheet, "Meeting")
    press(ui, "Make these days off", sheet)
    ui.wait(lambda: [entry.name for entry in entries(site)] == ["Audit", "Meeting"])
    sheet = open_import(ui)
    press(ui, "Import", sheet)
    ui.wait(lambda: sheet.problem.startswith("The file contains nothing new\n"))


def test_an_import_can_be_undone_at_once(site, app, ui):
    sheet = import_file(site, ui, *EVENTS)
    press(ui, "All", sheet)
    press(ui, "Make these days off", sheet)
    ui.wait(lambda: ui.find_all(Snackbar) and ui.find_all(Tap, root=ui.find(Snackbar)))
    assert len(entries(site)) == 2
    undo(ui)
    ui.wait(lambda: entries(site) == [])


def test_a_file_that_is_left_alone_changes_nothing(site, app, ui):
    ui.tap(ui.find(IconButton, import_file(site, ui, *EVENTS), icon="close"))
    ui.wait(lambda: not ui.find_all(EventsSheet))
    assert entries(site) == []


def test_two_thousand_days_are_shown_and_ticked_without_waiting(site, app, ui):
    sheet = import_file(
        site, ui, *((f"Day {n}", f"{2027 + n // 300}{n // 25 % 12 + 1:02}{n % 25 + 1:02}", "") for n in range(2000))
    )
    assert sheet.title == "2000 of 2000 chosen"
    with calls_of_this_thread() as calls:
        press(ui, "None", sheet)
        choose_row(ui, sheet, "Day 0")
    assert calls.number < 500_000
    press(ui, "Make these days off", sheet)
    ui.wait(lambda: len(entries(site)) == 1)


def test_a_file_that_is_no_calendar_is_refused_at_the_field(site, app, ui):
    (site.documents / "noise.ics").write_bytes(b"\x00\xff nothing")
    sheet = open_import(ui)
    press(ui, "Import", sheet)
    ui.wait(lambda: "is not a calendar file (.ics)" in sheet.problem)
    assert entries(site) == []


def test_turning_the_month_stops_at_the_ends_of_the_calendar(site, app, ui):
    part = page(app).calendar
    part.turn(12 * 1000)
    assert part.month_title == "December 2199"
    part.turn(-12 * 1000)
    assert part.month_title == "January 1970"
    part.turn(1)
    assert part.month_title == "February 1970"
