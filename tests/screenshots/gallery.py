"""All components on a few pages, with data of an invented Friday afternoon: what the screens are built from, seen by itself."""

from __future__ import annotations

from datetime import date, time

from kivy.lang import Builder

from app.screens.common.options import MenuItem, Option
from app.widgets.dialogs import ChoiceDialog, ConfirmDialog, Menu
from app.widgets.list_row import RowIcon
from app.widgets.pickers import DateDialog, TimeDialog
from app.widgets.snackbar import Snackbars
from tests.screenshots.gallery_pages import PAGES
from tests.screenshots.registry import BOTH, GLOVES, LANDSCAPE, LARGE_TEXT, PORTRAIT, SMALL, picture
from tests.screenshots.samples import NAV

__all__ = ["NAV"]  # for pictures that show the frame too

EVERY_SIZE = (*BOTH, SMALL, LARGE_TEXT, GLOVES)


def page(studio, name: str):
    from kivy.factory import Factory

    if "GalleryFrame" not in Factory.classes:
        Builder.load_string(PAGES, filename="gallery")
    return studio.show(Factory.get(name)())


@picture("gallery-home", sizes=EVERY_SIZE)
def home(studio):
    return page(studio, "GalleryHome")


@picture("gallery-form", sizes=EVERY_SIZE)
def form(studio):
    return page(studio, "GalleryForm")


@picture("gallery-lists", sizes=EVERY_SIZE)
def lists(studio):
    return page(studio, "GalleryLists")


@picture("gallery-charts", sizes=EVERY_SIZE)
def charts(studio):
    return page(studio, "GalleryCharts")


@picture("gallery-empty")
def empty(studio):
    return page(studio, "GalleryEmpty")


@picture("gallery-time", sizes=EVERY_SIZE)
def time_dialog(studio):
    page(studio, "GalleryForm")
    return studio.dialogs.open(
        TimeDialog(time(6, 30), title="Time", hour_word="Hour", minute_word="Minute", confirm="Set", decline="Cancel")
    )


@picture("gallery-date", sizes=EVERY_SIZE)
def date_dialog(studio):
    page(studio, "GalleryForm")
    return studio.dialogs.open(
        DateDialog(
            title="First day",
            today=date(2026, 11, 20),
            chosen=date(2026, 11, 23),
            first=date(2026, 11, 20),
            months=["November"] * 12,
            weekdays=["Mo", "Tu", "We", "Th", "Fr", "Sa", "Su"],
            today_word="Today",
            confirm="Set",
            decline="Cancel",
        )
    )


@picture("gallery-choice", sizes=EVERY_SIZE)
def choice_dialog(studio):
    page(studio, "GalleryForm")
    options = [
        Option(n, f"Mission {n}", "star" if n < 2 else "star-outline", "" if n % 3 else "on Aino only")
        for n in range(30)
    ]
    return studio.dialogs.open(ChoiceDialog(title="Mission", options=options, selected=[2], hint="Search"))


@picture("gallery-checklist", sizes=(LANDSCAPE, PORTRAIT))
def checklist(studio):
    page(studio, "GalleryForm")
    options = [
        Option(n, name) for n, name in enumerate(("Deliver kits to line 2", "Collect empties", "Waste to compactor"))
    ]
    return studio.dialogs.open(
        ChoiceDialog(
            title="Missions on Aino",
            options=options,
            selected=[1],
            multiple=True,
            confirm="Add missions",
            decline="Cancel",
        )
    )


@picture("gallery-confirm", sizes=EVERY_SIZE)
def confirm(studio):
    page(studio, "GalleryHome")
    return studio.dialogs.open(
        ConfirmDialog(
            title="Clear the queue of Aino?",
            text="3 missions will be cancelled, also the one that is running.",
            confirm="Clear queue",
            decline="Keep",
            danger=True,
        )
    )


@picture("gallery-menu", sizes=BOTH)
def menu(studio):
    page(studio, "GalleryLists")
    return studio.dialogs.open(
        Menu(
            anchor=studio.driver.find_all(RowIcon)[0],
            title="Deliver kits to line 2",
            text="Aino",
            items=[
                MenuItem("run", "Run now", "play"),
                MenuItem("skip", "Skip next", "skip-next"),
                MenuItem("copy", "Duplicate", "content-copy", disabled=True),
                MenuItem("delete", "Delete", "delete-outline", "fault"),
            ],
        )
    )


@picture("gallery-snackbar", sizes=BOTH)
def snackbar(studio):
    page(studio, "GalleryLists")
    bars = Snackbars()
    bars.show("Deliver kits to line 2 is in the queue of Aino", icon="check-circle-outline")
    bars.undo("Schedule deleted: Waste to compactor", "Undo", lambda: None)
    studio.driver.advance(0.3)
    return bars.stack
