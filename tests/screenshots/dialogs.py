"""The dialogs that all screens share."""

from __future__ import annotations

from datetime import date, time
from typing import Any

from app.i18n import _
from app.widgets.items import Option
from tests.screenshots.frame import framed, sheets_of
from tests.screenshots.registry import BOTH, GLOVES, LARGE_TEXT, SMALL, picture
from tests.support import home_facts as sample

EVERY_SIZE = (*BOTH, SMALL, LARGE_TEXT, GLOVES)
OPTIONS = [
    Option(n, mission.name, "star" if n < 2 else "star-outline", f"{n} min")
    for n, mission in enumerate(sample.FACTS.missions * 6)
]


def over_settings(studio: Any) -> Any:
    frame = framed("settings")
    studio.show(frame)
    sheets_of(studio, frame)
    return studio.dialogs


@picture("dialog-time", sizes=EVERY_SIZE)
def time_of_day(studio: Any) -> Any:
    return over_settings(studio).pick_time(_("Hold until"), time(6, 30), print)


@picture("dialog-date", sizes=EVERY_SIZE)
def day(studio: Any) -> Any:
    today = date(2026, 11, 20)
    return over_settings(studio).pick_date(_("Hold until"), date(2026, 11, 23), print, today=today, first=today)


@picture("dialog-choice", sizes=EVERY_SIZE)
def choice(studio: Any) -> Any:
    return over_settings(studio).choose(_("Mission"), OPTIONS, print, selected=2)


@picture("dialog-checklist", sizes=BOTH)
def checklist(studio: Any) -> Any:
    return over_settings(studio).choose_many(_("Missions"), OPTIONS[:3], _("Add"), print, selected=[1])


@picture("dialog-confirm", sizes=EVERY_SIZE)
def question(studio: Any) -> Any:
    return over_settings(studio).sheets.ask(
        _("Clear queue"),
        _("Missions of others go too. A running one is cancelled."),
        _("Clear queue"),
        print,
        _("Keep"),
    )


@picture("dialog-menu", sizes=BOTH)
def menu(studio: Any) -> Any:
    dialogs = over_settings(studio)
    items = [
        Option("run", _("Run now"), "play", off=_("{robot} is stopped").format(robot="Aino")),
        Option("copy", _("Duplicate"), "content-copy"),
        Option("delete", _("Delete"), "delete-outline", tone="fault"),
    ]
    return dialogs.menu(studio.shown.ids.bar, sample.KITS.name, items, print)
