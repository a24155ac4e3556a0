"""The pages of the gallery, as kv."""

from __future__ import annotations

PAGES = """
#:import samples tests.screenshots.samples
<GalleryFrame@Frame>:
    title: "Home"
    clock: "14:38"
    items: samples.NAV
    current: "home"

<GalleryHome@GalleryFrame>:
    banner: samples.BANNER
    ScreenBase:
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
                    RobotMap:
                        size_hint_y: None
                        height: dp(140)
                        walls: samples.PLAN["walls"]
                        racks: samples.PLAN["racks"]
                        places: samples.PLAN["places"]
                        at: .445, .5
                        path: [(.445, .50), (.66, .50), (.66, .765), (.80, .765)]
                    BoxLayout:
                        size_hint_y: None
                        height: tk.h_field
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

<GalleryForm@GalleryFrame>:
    current: "settings"
    title: "Settings"
    ScreenBase:
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
                    Field:
                        label: "Name"
                        text: "Veikko"
                        help: "As people call it"
                    Field:
                        label: "Address"
                        hint: "10.40.12.22 or robot.local"
                        problem: "Nothing answers at 10.40.12.99: is it switched on, and on this network?"
                    Field:
                        label: "Password"
                        text: "secret"
                        password: True
                        help: "Never shown again"
                    Field:
                        kind: "step"
                        label: "Ask robots every"
                        unit: "s"
                        value: 30
                        minimum: 1
                        maximum: 3600
                        help: "1–3600 s"
                    Field:
                        kind: "step"
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
                    Field:
                        kind: "pick"
                        label: "Mission"
                        value: "Deliver kits to line 2"
                        icon: "magnify"
                    Field:
                        kind: "pick"
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
                        options: [("once", "Once"), ("daily", "Daily"), ("weekly", "Weekly"), ("every", "Interval")]
                        selected: "weekly"
                    StackLayout:
                        size_hint_y: None
                        height: self.minimum_height
                        spacing: S8
                        ChoiceChip:
                            icon: "star"
                            text: "Collect empties"
                        MenuChip:
                            text: "All robots"
                            active: True
                        Toggle:
                        Toggle:
                            active: True
                    Notice:
                        tone: "done"
                        icon: "check-circle"
                        text: "Veikko answers in 38 ms"
                        note: "MiR100 · serial 180003127 · software 2.13.4"
                    Notice:
                        tone: "attention"
                        icon: "alert"
                        text: "Wed 25 Nov: Collect empties is still running on Aino then, 06:25–06:40"
                    BoxLayout:
                        size_hint_y: None
                        height: tk.h_field
                        spacing: S8
                        CommandButton:
                            tone: "fault"
                            text: "Clear"
                        CommandButton:
                            style: "text"
                            icon: "delete-outline"
                            text: "Delete"
                        CommandButton:
                            style: "filled"
                            icon: "check"
                            text: "Save"
                            large: True

<GalleryLists@GalleryFrame>:
    current: "scheduler"
    title: "Scheduler"
    ScreenBase:
        BoxLayout:
            orientation: "vertical" if root.height > root.width else "horizontal"
            spacing: GAP
            SectionCard:
                Title:
                    text: "Schedules"
                ScrollRows:
                    viewclass: "ListRow"
                    data: samples.SCHEDULES
            SectionCard:
                size_hint_x: 1.6 if root.height < root.width else 1
                Title:
                    text: "Runs"
                LongList:
                    viewclass: "ListRow"
                    data: samples.runs()

<GalleryCharts@GalleryFrame>:
    current: "logs"
    title: "Logs"
    ScreenBase:
        ScrollPage:
            Rows:
                size_hint_y: None
                height: self.minimum_height
                spacing: GAP
                viewclass: "FigureCard"
                data: samples.KPIS
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
                Lanes:
                    lanes: samples.LANES
                    ticks: samples.TICKS
                    closed: [(11, 24, "Saturday: not a working day")]
                    now: 1.63
                    now_label: "14:38"
            BoxLayout:
                size_hint_y: None
                height: dp(220)
                spacing: GAP
                SectionCard:
                    Title:
                        text: "Utilisation"
                    RobotBars:
                        rows: samples.UTILISATION
                SectionCard:
                    Title:
                        text: "Outcomes per day"
                    StackedBars:
                        days: samples.DAYS

<GalleryEmpty@GalleryFrame>:
    ScreenBase:
        SectionCard:
            EmptyState:
                icon: "access-point-network"
                title: "Add your first robot"
                text: "Its address and a user that may start missions are enough. Then fetch its missions and say when they shall run."
                action: "Add robot"
                action_icon: "plus"
"""
