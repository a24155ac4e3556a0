"""An invented Friday afternoon in a Finnish plant: what the gallery shows."""

from __future__ import annotations

from dataclasses import replace
from datetime import UTC, date, datetime
from types import SimpleNamespace

from app.screens.logs.key_figures import Card, DayBar, RobotBar, with_unit
from app.screens.scheduler.timeline import Bar, Lane
from app.services.robots.map_picture import Place
from app.widgets.items import Action, Item

FRIDAY = datetime(2026, 11, 20, 12, 38, tzinfo=UTC)
NAV = [
    ("home", "Home", "home-variant-outline", "home-variant"),
    ("scheduler", "Scheduler", "calendar-clock-outline", "calendar-clock"),
    ("logs", "Logs", "text-box-outline", "text-box"),
    ("settings", "Settings", "cog-outline", "cog"),
]
MENU = (Action("menu", icon="dots-vertical"),)
SCHEDULES = [
    Item(
        1,
        "Deliver kits to line 2",
        "Hourly 06–18, Mon–Fri",
        lead="15:00",
        place="Aino",
        meta="14:05",
        actions=MENU,
        on=True,
    ),
    Item(
        2,
        "Waste to compactor",
        "Mon, Wed, Fri 16:30",
        lead="16:30",
        place="Veikko",
        meta="Failed",
        actions=MENU,
        on=True,
    ),
    Item(
        3,
        "Floor wash, hall A",
        "Daily 22:00",
        lead="–",
        place="Veikko",
        meta="Off",
        actions=MENU,
        on=False,
        look="faint",
    ),
]


def runs() -> list[Item]:
    """The second is chosen."""
    rows = [
        Item(n, mission, place=robot, meta=why, lead=time, icon=icon, tone=tone)
        for n, (icon, tone, mission, why, robot, time) in enumerate(
            [
                ("skip-next-circle", "attention", "Move coils to press", "Battery 12 %, needs 30 %", "Sisu", "14:15"),
                ("check-circle-outline", "done", "Collect empties", "8 min", "Veikko", "14:12"),
                ("alert-circle", "fault", "Bring pallet to dock", "Can't reach Dock 3", "Veikko", "13:30"),
            ]
            * 40
        )
    ]
    rows[1] = replace(rows[1], look="chosen")
    return rows


KPIS = [
    Card("success", "Success", with_unit("98.1", "%"), "▼ 1.9 vs. last week", (97.1, 97.8, 96.9, None, 97.9, 98.4)),
    Card("duration", "Duration", with_unit("6", "min"), "▲ 1 min", (6.6, 6.4, 6.5, 6.3, 6.35, 6.1)),
    Card("per_day", "Missions"),
]
UTILISATION = [
    RobotBar(1, "Aino", "46 %", 0.46, 0.14),
    RobotBar(2, "Veikko", "31 %", 0.31, 0.11),
    RobotBar(3, "Sisu", "22 %", 0.22, 0.27),
]
DAYS = [
    DayBar(date(2026, 11, 14 + n), label, label, *numbers)
    for n, (label, *numbers) in enumerate(
        [
            ("Sat", 20, 0, 0),
            ("Sun", 12, 0, 0),
            ("Mon", 74, 2, 1),
            ("Tue", 79, 1, 2),
            ("Wed", 76, 0, 1),
            ("Thu", 82, 2, 1),
            ("Today", 62, 3, 3),
        ]
    )
]
LANES = [
    Lane(
        "Aino",
        "MiR250",
        (
            Bar(1, 0.5, 0.62, state="past"),
            Bar(2, 1.55, 1.7, state="running"),
            Bar(3, 3, 3.12),
            Bar(4, 6, 8.9, "Night stock count"),
        ),
    ),
    Lane(
        "Veikko",
        "MiR100",
        (Bar(5, 0.5, 0.87, state="failed"), Bar(6, 3.5, 4.5, "Waste"), Bar(7, 4.17, 5.3, "Collect empties")),
        ((4.17, 4.5),),
    ),
    Lane("Sisu", "MiR1350", (Bar(8, 1.25, 1.5, state="skipped"), Bar(9, 2.25, 2.8, "Move coils to press"))),
]
TICKS = [(hour, "Sat 21 Nov" if hour == 11 else f"{(13 + hour) % 24:02d}:00", hour == 11) for hour in range(3, 24, 2)]
PLAN = {
    "walls": [(0, 0.335, 0.19, 0), (0.26, 0.335, 0.06, 0), (0.32, 0, 0, 0.335), (0.74, 0.62, 0, 0.38)],
    "racks": [(0.05, 0.66, 0.055, 0.26), (0.37, 0.69, 0.24, 0.09), (0.37, 0.08, 0.32, 0.11), (0.86, 0.54, 0.09, 0.14)],
    "places": [Place("Kitting", 0.1625, 0.50), Place("Line 2", 0.905, 0.42), Place("Dock", 0.245, 0.12)],
}

BANNER = SimpleNamespace(
    text="Aino: emergency stop", icon="alert-octagon", tone="fault", action="Show", act="show_robot", about=1
)
