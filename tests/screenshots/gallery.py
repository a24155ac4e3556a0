"""All components on a few pages, with data of an invented Friday afternoon: what the screens are built from, seen by itself."""
from __future__ import annotations

from datetime import date, time

from kivy.lang import Builder

from app.widgets.dialogs import ChoiceDialog, ConfirmDialog, Menu
from app.widgets.display import with_unit
from app.widgets.pickers import DateDialog, TimeDialog
from app.widgets.snackbar import Snackbars
from tests.screenshots.registry import BOTH, GLOVES, LANDSCAPE, LARGE_TEXT, PORTRAIT, SMALL, picture

EVERY_SIZE = (*BOTH, SMALL, LARGE_TEXT, GLOVES)

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
UTILISATION = [("Aino", "46 %", .46, .14), ("Veikko", "31 %", .31, .11), ("Sisu", "22 %", .22, .27)]
DAYS = [("Sa", 20, 0, 0, 0), ("Su", 12, 0, 0, 1), ("Mo", 74, 2, 1, 0), ("Tu", 79, 1, 2, 1), ("We", 76, 0, 1, 0), ("Th", 82, 2, 1, 0),
        ("Fr", 62, 3, 3, 0)]
LANES = [
    {"name": "Aino", "note": "MiR250", "bars": [
        {"key": 1, "start": .5, "end": .62, "state": "past"}, {"key": 2, "start": 1.55, "end": 1.7, "state": "running"},
        {"key": 3, "start": 3, "end": 3.12}, {"key": 4, "start": 6, "end": 8.9, "label": "Night stock count"}]},
    {"name": "Veikko", "note": "MiR100", "bars": [
        {"key": 5, "start": .5, "end": .87, "state": "failed"}, {"key": 6, "start": 3.5, "end": 4.5, "label": "Waste"},
        {"key": 7, "start": 4.17, "end": 5.3, "label": "Collect empties"}]},
    {"name": "Sisu", "note": "MiR1350", "bars": [
        {"key": 8, "start": 1.25, "end": 1.5, "state": "skipped"}, {"key": 9, "start": 2.25, "end": 2.8, "label": "Move coils to press"}]},
]
TICKS = [(hour, "Sat 21 Nov" if hour == 11 else f"{(13 + hour) % 24:02d}:00", hour == 11) for hour in range(3, 24, 2)]
PLAN = {"walls": [(0, .335, .19, 0), (.26, .335, .06, 0), (.32, 0, 0, .335), (.74, .62, 0, .38)],
        "racks": [(.05, .66, .055, .26), (.37, .69, .24, .09), (.37, .08, .32, .11), (.86, .54, .09, .14)],
        "places": [(.1625, .50, "Kitting"), (.905, .42, "Line 2"), (.245, .12, "Dock")]}

PAGES = """
#:import gallery tests.screenshots.gallery
<GalleryFrame@Frame>:
    title: "Home"
    date: "Fri 20 Nov 2026"
    clock: "14:38"
    robot: "Aino"
    link: "Connected · 2 s ago"
    link_icon: "wifi"
    items: gallery.NAV
    current: "home"

<GalleryHome@GalleryFrame>:
    alarm: "Aino stands still: emergency stop pressed"
    alarm_note: "Since 14:36 · release the red button on the robot, then press Reset on the robot"
    alarm_others: "+1 more"
    alarm_action: "Show Aino"
    ScrollPage:
        BoxLayout:
            orientation: "vertical" if root.height > root.width else "horizontal"
            size_hint_y: None
            height: self.minimum_height
            spacing: GAP
            SectionCard:
                size_hint_y: None
                height: self.minimum_height
                pos_hint: {"top": 1}
                spacing: S12
                ScrollRows:
                    direction: "x"
                    spacing: S8
                    size_hint_y: None
                    height: tk.h_action
                    viewclass: "RobotChip"
                    data: gallery.CHIPS
                BoxLayout:
                    size_hint_y: None
                    height: self.minimum_height
                    spacing: S12
                    ValueTile:
                        icon: "battery-80"
                        label: "Battery"
                        value: "78 %"
                        level: .78
                        mark: .3
                        note: "about 4 h 10 min left"
                    ValueTile:
                        icon: "lan-connect"
                        label: "Address"
                        value: "10.40.12.21"
                        note: "Not seen since 14:02"
                        note_icon: "wifi-off"
                        tone: "attention"
                        stale: True
                RobotMap:
                    size_hint_y: None
                    height: dp(140)
                    walls: gallery.PLAN["walls"]
                    racks: gallery.PLAN["racks"]
                    places: gallery.PLAN["places"]
                    at: .445, .5
                    path: [(.445, .50), (.66, .50), (.66, .765), (.80, .765)]
                BoxLayout:
                    size_hint_y: None
                    height: tk.h_action
                    spacing: S8
                    CommandButton:
                        size_hint_x: 1.3
                        style: "tonal"
                        icon: "pause"
                        text: "Pause"
                        large: True
                    CommandButton:
                        stacked: True
                        icon: "restore-alert"
                        text: "Reset errors"
                        disabled: True
                    CommandButton:
                        stacked: True
                        icon: "playlist-remove"
                        text: "Clear queue"
            SectionCard:
                size_hint_y: None
                height: self.minimum_height
                pos_hint: {"top": 1}
                CardHead:
                    title: "Queue"
                    note: "1 running, 2 waiting"
                Rows:
                    orientation: "vertical"
                    size_hint_y: None
                    height: self.minimum_height
                    viewclass: "QueueRow"
                    data: gallery.QUEUE[:3]
                CardHead:
                    title: "Next planned"
                    note: "all robots"
                Rows:
                    orientation: "vertical"
                    size_hint_y: None
                    height: self.minimum_height
                    viewclass: "PlanRow"
                    data: gallery.PLANNED[:2]
                CardHead:
                    title: "Just finished"
                    note: "all robots"
                Rows:
                    orientation: "vertical"
                    size_hint_y: None
                    height: self.minimum_height
                    viewclass: "DoneRow"
                    data: gallery.FINISHED

<GalleryForm@GalleryFrame>:
    current: "settings"
    title: "Settings"
    ScrollPage:
        BoxLayout:
            orientation: "vertical" if root.height > root.width else "horizontal"
            size_hint_y: None
            height: self.minimum_height
            spacing: GAP
            SectionCard:
                size_hint_y: None
                height: self.minimum_height
                pos_hint: {"top": 1}
                spacing: S16
                FormField:
                    label: "Name"
                    text: "Veikko"
                    help: "As people call it"
                FormField:
                    label: "Address"
                    hint: "10.40.12.22 or robot.local"
                    problem: "Nothing answers at 10.40.12.99: is it switched on, and on this network?"
                FormField:
                    label: "Password"
                    text: "secret"
                    password: True
                    help: "Never shown again"
                StepField:
                    label: "Ask robots every"
                    unit: "s"
                    value: 30
                    minimum: 1
                    maximum: 3600
                    help: "1–3600 s"
                StepField:
                    label: "Retry limit"
                    value: 10
                    text: "40"
                    maximum: 20
                    help: "0–20"
            SectionCard:
                size_hint_y: None
                height: self.minimum_height
                pos_hint: {"top": 1}
                spacing: S16
                PickField:
                    label: "Mission"
                    value: "Deliver kits to line 2"
                    icon: "magnify"
                PickField:
                    label: "First day"
                    value: "Sat 21 Nov 2026"
                    icon: "calendar-month"
                    problem: "Saturday is not a working day"
                SearchField:
                    hint: "Search missions"
                Segments:
                    size_hint_y: None
                    height: tk.h_touch
                    spacing: S8
                    options: [("once", "Once"), ("daily", "Daily"), ("weekly", "Weekly"), ("every", "Every …")]
                    selected: "weekly"
                BoxLayout:
                    size_hint_y: None
                    height: tk.h_touch
                    spacing: S8
                    ChoiceChip:
                        icon: "star"
                        text: "Collect empties"
                    ChoiceChip:
                        text: "All robots"
                        trailing: "chevron-down"
                        selected: True
                    Toggle:
                    Toggle:
                        active: True
                    Widget:
                Notice:
                    tone: "done"
                    icon: "check-circle"
                    text: "Veikko answers in 38 ms"
                    note: "MiR100 · serial 180003127 · software 2.13.4"
                Notice:
                    tone: "attention"
                    icon: "alert"
                    text: "Wed 25 Nov: still running then on Aino is Collect empties, 06:25–06:40"
                BoxLayout:
                    size_hint_y: None
                    height: tk.h_action
                    spacing: S8
                    CommandButton:
                        style: "danger"
                        text: "Clear"
                    CommandButton:
                        style: "plain"
                        icon: "delete-outline"
                        text: "Delete"
                    CommandButton:
                        style: "filled"
                        icon: "check"
                        text: "Save"
                        large: True
                BoxLayout:
                    size_hint_y: None
                    height: dp(32)
                    spacing: S8
                    StatusBadge:
                        icon: "wifi"
                        text: "Connected"
                    StatusBadge:
                        tone: "attention"
                        icon: "wifi-strength-2-alert"
                        text: "Slow · 9 s ago"
                    StatusBadge:
                        tone: "fault"
                        loud: True
                        icon: "alert-octagon"
                        text: "Emergency stop"
                    Widget:

<GalleryLists@GalleryFrame>:
    current: "scheduler"
    title: "Scheduler"
    BoxLayout:
        orientation: "vertical" if root.height > root.width else "horizontal"
        spacing: GAP
        SectionCard:
            CardHead:
                title: "Schedules"
                note: "2 of 3 on"
            ScrollRows:
                viewclass: "ScheduleRow"
                data: gallery.SCHEDULES
        SectionCard:
            size_hint_x: 1.6 if root.height < root.width else 1
            CardHead:
                title: "Runs"
                note: "120, newest first"
            LongList:
                viewclass: "LogRow"
                data: [{**row, "narrow": root.height > root.width, "opened": row["key"] == 1, "steps": gallery.STEPS, \
"message": "Robot: Failed to reach goal position 'Dock 3'. Queue item 14026."} for row in gallery.RUNS]

<GalleryCharts@GalleryFrame>:
    current: "logs"
    title: "Logs"
    ScrollPage:
        Rows:
            size_hint_y: None
            height: self.minimum_height
            spacing: GAP
            viewclass: "KpiCard"
            data: gallery.KPIS
        SectionCard:
            size_hint_y: None
            height: dp(208)
            padding: PAD, S8, PAD, S12
            BoxLayout:
                size_hint_y: None
                height: dp(36)
                spacing: S16
                Title:
                    fit: True
                    text: "Upcoming"
                Widget:
                LegendItem:
                    kind: "planned"
                    text: "Planned"
                LegendItem:
                    kind: "overlap"
                    text: "Overlap"
                LegendItem:
                    kind: "closed"
                    text: "No work"
            Timeline:
                lanes: gallery.LANES
                ticks: gallery.TICKS
                closed: [(11, 24, "Saturday: not a working day")]
                now: 1.63
                now_label: "14:38"
        BoxLayout:
            size_hint_y: None
            height: dp(220)
            spacing: GAP
            SectionCard:
                CardHead:
                    title: "Utilisation"
                UtilisationBars:
                    rows: gallery.UTILISATION
            SectionCard:
                CardHead:
                    title: "Outcomes per day"
                StackedBars:
                    days: gallery.DAYS

<GalleryEmpty@GalleryFrame>:
    robot: "No robot"
    link: ""
    link_icon: "robot-off-outline"
    link_tone: "offline"
    SectionCard:
        EmptyState:
            icon: "access-point-network"
            title: "Add your first robot"
            text: "Its address and a user that may start missions are enough. Then fetch its missions and say when they shall run."
            action: "Add robot"
            action_icon: "plus"
"""


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
    return studio.dialogs.open(TimeDialog(time(6, 30), title="Time", hour_word="Hour", minute_word="Minute", confirm="Set",
                                          decline="Cancel"))


@picture("gallery-date", sizes=EVERY_SIZE)
def date_dialog(studio):
    page(studio, "GalleryForm")
    return studio.dialogs.open(DateDialog(
        title="First day", today=date(2026, 11, 20), chosen=date(2026, 11, 23), first=date(2026, 11, 20), months=["November"] * 12,
        weekdays=["Mo", "Tu", "We", "Th", "Fr", "Sa", "Su"], today_word="Today", confirm="Set", decline="Cancel"))


@picture("gallery-choice", sizes=EVERY_SIZE)
def choice_dialog(studio):
    page(studio, "GalleryForm")
    options = [{"key": n, "text": f"Mission {n}", "note": "" if n % 3 else "on Aino only", "icon": "star" if n < 2 else "star-outline"}
               for n in range(30)]
    return studio.dialogs.open(ChoiceDialog(title="Mission", options=options, selected=[2], hint="Search"))


@picture("gallery-checklist", sizes=(LANDSCAPE, PORTRAIT))
def checklist(studio):
    page(studio, "GalleryForm")
    options = [{"key": n, "text": name} for n, name in enumerate(("Deliver kits to line 2", "Collect empties", "Waste to compactor"))]
    return studio.dialogs.open(ChoiceDialog(title="Missions on Aino", options=options, selected=[1], multiple=True, confirm="Add missions",
                                            decline="Cancel"))


@picture("gallery-confirm", sizes=EVERY_SIZE)
def confirm(studio):
    page(studio, "GalleryHome")
    return studio.dialogs.open(ConfirmDialog(
        title="Clear the queue of Aino?", text="3 missions will be cancelled, also the one that is running.", confirm="Clear queue",
        decline="Keep", danger=True))


@picture("gallery-menu", sizes=BOTH)
def menu(studio):
    page(studio, "GalleryLists")
    menu = Menu(items=[{"key": "run", "text": "Run now", "icon": "play"}, {"key": "skip", "text": "Skip next", "icon": "skip-next"},
                       {"key": "copy", "text": "Duplicate", "icon": "content-copy", "disabled": True},
                       {"key": "delete", "text": "Delete", "icon": "delete-outline", "tone": "fault"}])
    dots = studio.driver.find(icon="dots-vertical")
    menu.open_at(dots, animation=False)
    return menu


@picture("gallery-snackbar", sizes=BOTH)
def snackbar(studio):
    page(studio, "GalleryLists")
    bars = Snackbars()
    bars.show("Deliver kits to line 2 is in the queue of Aino", icon="check-circle-outline")
    bars.undo("Schedule deleted: Waste to compactor", "Undo", lambda: None)
    studio.driver.advance(.3)
    return bars.stack
