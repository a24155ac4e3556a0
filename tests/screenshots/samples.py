"""An invented Friday afternoon in a Finnish plant: what the gallery shows."""
from __future__ import annotations

from app.screens.logs.kpi_view import DayBar, RobotBar, with_unit
from app.screens.scheduler.timeline import Bar, Lane
from app.services.robots.map_picture import Place

NAV = [("home", "Home", "home-variant-outline", "home-variant"), ("scheduler", "Scheduler", "calendar-clock-outline", "calendar-clock"),
       ("logs", "Logs", "text-box-outline", "text-box"), ("settings", "Settings", "cog-outline", "cog")]
CHIPS = [
    {"key": 1, "name": "Aino", "icon": "play-circle-outline", "tone": "accent", "battery": "78 %", "battery_icon": "battery-80",
     "selected": True},
    {"key": 2, "name": "Veikko", "icon": "check-circle-outline", "battery": "64 %", "battery_icon": "battery-60"},
    {"key": 3, "name": "Sisu", "icon": "lightning-bolt", "battery": "19 %", "battery_icon": "battery-charging-20",
     "battery_tone": "attention"},
    {"key": 4, "name": "Trukki hallissa 2", "icon": "alert-octagon", "tone": "fault"},
]
QUEUE = [
    {"key": 1, "icon": "play", "tone": "accent", "mission": "Deliver kits to line 2", "origin": "Run now · started 14:34", "loud": True},
    {"key": 2, "number": "1", "mission": "Collect empties", "origin": "Idle automation · since 14:36"},
    {"key": 3, "number": "2", "mission": "Bring pallet to dock", "origin": "Robot's own screen · since 14:37", "cancellable": False},
    {"key": 4, "number": "3", "mission": "Move coils to press", "origin": "Schedule Coils · since 14:37"},
    {"key": 5, "number": "4", "mission": "Waste to compactor", "origin": "Schedule Waste · since 14:37"},
]
PLANNED = [
    {"key": n, "time": at, "mission": mission, "note": note} for n, (at, mission, note) in enumerate([
        ("15:00", "Deliver kits to line 2", "Aino · in 22 min"), ("15:15", "Move coils to press", "Sisu · in 37 min"),
        ("15:30", "Collect empties", "Veikko · in 52 min"), ("16:00", "Deliver kits to line 2", "Aino · in 1 h 22 min")])]
FINISHED = [
    {"key": 1, "icon": "skip-next-circle", "tone": "attention", "abnormal": True, "mission": "Move coils to press", "when": "Sisu 14:30",
     "reason": "Skipped: Battery 12 % stayed under 30 % until 14:30"},
    {"key": 2, "icon": "check-circle-outline", "tone": "done", "mission": "Collect empties", "when": "Veikko 14:21",
     "reason": "Completed in 8 min 05 s"},
    {"key": 3, "icon": "alert-circle", "tone": "fault", "abnormal": True, "mission": "Bring pallet to dock", "when": "Veikko 13:52",
     "reason": "Failed: could not reach 'Dock 3' within 4 min"},
]
SCHEDULES = [
    {"key": 1, "mission": "Deliver kits to line 2", "rule": "Every hour 06–18, Mon–Fri", "next": "Aino · in 22 min", "last": "Completed",
     "icon": "check-circle-outline", "tone": "done", "selected": True},
    {"key": 2, "mission": "Waste to compactor", "rule": "Weekly Mon, Wed, Fri at 16:30", "next": "Veikko · in 1 h 52 min", "last": "Failed",
     "icon": "alert-circle", "tone": "fault"},
    {"key": 3, "mission": "Floor wash, hall A", "rule": "Monthly on the first Monday", "next": "Veikko · switched off", "last": "Completed",
     "icon": "check-circle-outline", "tone": "done", "on": False},
]
STEPS = [
    {"label": "Planned", "time": "13:30:00", "note": "Run now"}, {"label": "Submitted", "time": "13:30:02", "note": "1 attempt"},
    {"label": "Started", "time": "13:30:09", "note": "no wait"},
    {"label": "Failed", "time": "13:52:13", "note": "after 22 min", "tone": "fault", "last": True},
]
RUNS = [
    {"key": n, "icon": icon, "tone": tone, "outcome": outcome, "mission": mission, "reason": reason, "robot": robot, "trigger": trigger,
     "when": when, "took": took} for n, (icon, tone, outcome, mission, reason, robot, trigger, when, took) in enumerate([
         ("skip-next-circle", "attention", "Skipped", "Move coils to press", "Battery 12 % stayed under 30 % until 14:30", "Sisu",
          "Schedule", "14:15", "–"),
         ("check-circle-outline", "done", "Completed", "Collect empties", "Started on time, as long as usual", "Veikko", "Schedule",
          "14:12", "8 min 05 s"),
         ("alert-circle", "fault", "Failed", "Bring pallet to dock", "Could not reach 'Dock 3' within 4 min", "Veikko", "Run now", "13:30",
          "22 min 04 s")] * 40)]
KPIS = [
    {"key": 1, "label": "Success rate", "value": with_unit("98.1", "%"), "note": "405 of 413 ended runs",
     "history": [97.1, 97.8, 96.9, None, 97.9, 98.4, 98.1]},
    {"key": 2, "label": "Mean duration", "value": with_unit("6", "min ") + with_unit("12", "s"), "note": "405 completed runs",
     "history": [6.6, 6.4, 6.5, 6.3, 6.35, 6.1, 6.2]},
    {"key": 3, "label": "Missions per day", "value": "–", "note": "no recorded day", "history": []},
]
UTILISATION = [RobotBar("Aino", "46 %", "3 h 41 min", .46, .14), RobotBar("Veikko", "31 %", "2 h 29 min", .31, .11),
               RobotBar("Sisu", "22 %", "1 h 46 min", .22, .27)]
DAYS = [DayBar("Sa", 20, 0, 0, 0), DayBar("Su", 12, 0, 0, 1), DayBar("Mo", 74, 2, 1, 0), DayBar("Tu", 79, 1, 2, 1),
        DayBar("We", 76, 0, 1, 0), DayBar("Th", 82, 2, 1, 0), DayBar("Fr", 62, 3, 3, 0)]
LANES = [
    Lane("Aino", "MiR250", (Bar(1, .5, .62, state="past"), Bar(2, 1.55, 1.7, state="running"), Bar(3, 3, 3.12),
                            Bar(4, 6, 8.9, "Night stock count"))),
    Lane("Veikko", "MiR100", (Bar(5, .5, .87, state="failed"), Bar(6, 3.5, 4.5, "Waste"), Bar(7, 4.17, 5.3, "Collect empties"))),
    Lane("Sisu", "MiR1350", (Bar(8, 1.25, 1.5, state="skipped"), Bar(9, 2.25, 2.8, "Move coils to press"))),
]
TICKS = [(hour, "Sat 21 Nov" if hour == 11 else f"{(13 + hour) % 24:02d}:00", hour == 11) for hour in range(3, 24, 2)]
PLAN = {"walls": [(0, .335, .19, 0), (.26, .335, .06, 0), (.32, 0, 0, .335), (.74, .62, 0, .38)],
        "racks": [(.05, .66, .055, .26), (.37, .69, .24, .09), (.37, .08, .32, .11), (.86, .54, .09, .14)],
        "places": [Place("Kitting", .1625, .50), Place("Line 2", .905, .42), Place("Dock", .245, .12)]}
