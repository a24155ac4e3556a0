"""The Scheduler of an invented month, in every state a person meets."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from datetime import UTC, date, datetime, time, timedelta
from typing import Any

from kivy.tests.common import UnitTestTouch

from app.container import Container
from app.domain.models import Connection, Group, Schedule
from app.domain.robot import MissionParameter
from app.screens.common.shell import Shell, pick
from app.screens.common.view_model import Background, Navigator, Snackbars, UiBus
from app.screens.frame.facts import OpenIssues
from app.screens.logs.screen import LogsScreen
from app.screens.scheduler.draft import Kind, Unit
from app.screens.scheduler.screen import SchedulerScreen
from app.services.suggestions.late_schedules import Cause, Finding
from app.services.suggestions.suggestions import Advice, Change, Suggestion
from app.services.suggestions.suggestions import Kind as ChangeKind
from app.widgets.lanes import LONG
from tests.screenshots.frame import framed, sheets_of
from tests.screenshots.home import POSITION, show_issues
from tests.screenshots.registry import BOTH, GLOVES, LANDSCAPE, LARGE_TEXT, SHARP, SMALL, SMALL_LARGE_TEXT, picture
from tests.support import fleet_facts, month
from tests.support import home_facts as sample

EVERY_SIZE = (*BOTH, SMALL, SHARP, LARGE_TEXT, SMALL_LARGE_TEXT, GLOVES)
STATUSES = {"Aino": sample.EXECUTING, "Sisu": sample.CHARGING, "Veikko": sample.READY}
MANY = (sample.READY, sample.EXECUTING, sample.EXECUTING, sample.CHARGING)  # by number, of more robots
SCREENS = {"scheduler": SchedulerScreen, "logs": LogsScreen}


class Stand:
    """A screen in its frame, on the services of the month."""

    def __init__(
        self,
        studio: Any,
        name: str,
        furnished: bool = True,
        prepare: Callable[[Container], object] = lambda _container: None,
    ) -> None:
        self.studio = studio
        self.container = month.plant(studio.directory(), furnished)
        prepare(self.container)
        robots = {robot.id: robot for robot in self.container.catalogue.robots()}
        for robot in robots.values():
            self.container.snapshots.update(
                robot.id,
                connection=Connection.CONNECTED,
                status=STATUSES[robot.name] if robot.name in STATUSES else MANY[robot.id % len(MANY)],
                read_at=self.container.clock.now(),
            )
        bus = UiBus()
        self.background = Background(bus)
        frame = framed(name)
        issues = OpenIssues(self.container.alarms.open(), self.container.holds.current())
        show_issues(
            frame,
            issues,
            robots,
            self.container.settings(),
            name,
        )
        sheets = sheets_of(studio, frame)
        self.shell = Shell(Navigator(None, {}), studio.dialogs, Snackbars(), bus, self.background, sheets=sheets)
        kind = SCREENS[name]
        self.screen = kind(kind.Model(pick(kind.Services, self.container), self.shell))
        frame.add_widget(self.screen)
        studio.show(frame)
        if name == "scheduler":  # no robots have these addresses
            self.container.robot_missions.learn_names = lambda _robot_id: False
            self.container.robot_missions.parameters = lambda _robot_id, _guid: ()
        for close in (self.container.close, self.background.close, self.screen.hidden):  # the last one first
            studio.afterwards(close)
        self.screen.shown()
        self.settle()

    @property
    def vm(self) -> Any:
        return self.screen.vm

    def settle(self) -> Any:
        """Everything asked for has come."""
        self.studio.driver.advance(0.4)
        self.studio.driver.wait(lambda: self.background.idle)
        self.studio.driver.advance(0.4)
        return self.screen

    def mission(self, name: str) -> int:
        return next(mission.id for mission in self.vm._facts.missions if mission.name == name)

    def schedule(self, mission: str) -> Any:
        return next(schedule for schedule in self.vm._facts.schedules if schedule.mission_id == self.mission(mission))


# ---------------------------------------------------------------------- the Scheduler
def planning(studio: Any, prepare: Callable[[Container], object] = lambda _container: None, **values: Any) -> Stand:
    """The form with a mission."""
    stand = Stand(studio, "scheduler", prepare=prepare)
    stand.vm.begin()
    values = {"day": date(2026, 11, 23), "at": time(6, 30), **values}
    stand.vm.form.set(mission_id=stand.mission("Deliver kits to line 2"), **values)
    stand.settle()
    return stand


@picture("scheduler-plan", sizes=EVERY_SIZE)
def plan(studio: Any) -> Any:
    return Stand(studio, "scheduler").settle()


@picture("scheduler-schedules", sizes=EVERY_SIZE)
def schedules(studio: Any) -> Any:
    stand = Stand(studio, "scheduler")
    stand.screen.choose_tab("schedules")
    return stand.settle()


@picture("scheduler", sizes=EVERY_SIZE)
def weekly(studio: Any) -> Any:
    stand = planning(studio, kind=Kind.WEEKLY, minimum_battery_percent=40.0)
    robot = next(robot.id for robot in stand.vm._facts.robots if robot.name == "Veikko")
    stand.vm.form.set(robot_id=robot)
    return stand.settle()


def crowd(hours: float) -> Callable[[Any], Any]:
    """Every 5 minutes on working days, together with what overlaps with it, at so many hours."""

    def build(studio: Any) -> Any:
        def ahead(container: Container) -> None:
            c = container.db.read()
            missions = {mission.name: mission.id for mission in container.repositories.missions.all(c)}
            robots = {robot.name: robot.id for robot in container.repositories.robots.all(c)}
            container.catalogue.save_schedule(
                Schedule(
                    "",
                    robots["Veikko"],
                    missions["Coils to store"],
                    datetime(2026, 11, 20, 0, 0),
                    month.ZONE,
                    "FREQ=MINUTELY;INTERVAL=5",
                )
            )

        stand = Stand(studio, "scheduler", prepare=ahead)
        stand.vm.show_span(hours)
        return stand.settle()

    return build


picture("scheduler-crowd", sizes=(LANDSCAPE,))(crowd(24.0))
picture("scheduler-crowd-week", sizes=(LANDSCAPE,))(crowd(168.0))


def fifty(container: Container) -> None:
    """Enough robots to scroll, all but the first in two halls; a third of them with missions."""
    halls: tuple[list[int], list[int]] = ([], [])

    def furnish(c: Any) -> None:
        missions, r = container.repositories.missions.all(c), container.repositories
        known = {robot.name for robot in r.robots.all(c)}
        for n, one in enumerate(fleet_facts.robots(50), 1):
            if one.name in known:
                continue
            robot = r.robots.add(c, replace(one, id=None))
            halls[n > 26].append(robot.id)
            if n % 3 == 0:
                start = datetime(2026, 11, 20, 15 + n % 5, n)
                r.schedules.add(
                    c,
                    Schedule(
                        f"S{n}",
                        robot.id,
                        missions[n % len(missions)].id,
                        start,
                        month.ZONE,
                        changed_at=month.NOW,
                        next_at=start.replace(tzinfo=UTC) - timedelta(hours=2),
                    ),
                )

    container.db.write(furnish)
    for n, members in enumerate(halls, 2):
        container.catalogue.save_group(Group(f"Hall {n}", tuple(members)))


@picture("scheduler-fifty", sizes=EVERY_SIZE)
def fifty_robots(studio: Any) -> Any:
    return Stand(studio, "scheduler", prepare=fifty).settle()


@picture("scheduler-once-refused", sizes=BOTH)
def refused(studio: Any) -> Any:
    stand = planning(studio)
    stand.vm.form.set(day=date(2026, 11, 21))
    return stand.settle()


@picture("scheduler-every", sizes=BOTH)
def every(studio: Any) -> Any:
    return planning(studio, kind=Kind.EVERY, every=30, unit=Unit.MINUTES).settle()


@picture("scheduler-monthly", sizes=BOTH)
def monthly(studio: Any) -> Any:
    return planning(studio, kind=Kind.MONTHLY, by_weekday=True, nth=1, month_weekday="MO").settle()


@picture("scheduler-monthly-short", sizes=BOTH)
def monthly_short(studio: Any) -> Any:
    """On a day that not every month has."""
    return planning(studio, kind=Kind.MONTHLY, month_day=31).settle()


@picture("scheduler-more", sizes=(*BOTH, GLOVES))
def more(studio: Any) -> Any:
    stand = planning(studio, kind=Kind.DAILY, more_hours=(14, 22), last_day=date(2027, 1, 31))
    stand.vm.form.more = True
    stand.settle()
    stand.shell.sheets.top.ids.page.scroll_y = 0
    return stand.settle()


@picture("scheduler-parameters", sizes=(LANDSCAPE,))
def parameters(studio: Any) -> Any:
    stand = planning(studio)
    places = (("K1", "Kitting 1"), ("K2", "Kitting 2"))
    stand.vm.form.parameters._take(
        (
            MissionParameter("place", "Pick-up place", choices=places, default="K1"),
            MissionParameter("count", "Pallets", "integer", 2, 1, 8),
            MissionParameter("goal", "Goal", choices=(("g", "Dock 3"),), sets="position"),
            MissionParameter("charge", "Charge", "integer", 50, 0, 100, unit="%"),
        ),
    )
    stand.settle()
    stand.vm.form.save()
    return stand.settle()


@picture("scheduler-position", sizes=EVERY_SIZE)
def position(studio: Any) -> Any:
    stand = planning(studio)
    stand.vm.form.parameters._take(POSITION)
    return stand.settle()


@picture("scheduler-edit", sizes=BOTH)
def edit(studio: Any) -> Any:
    stand = Stand(studio, "scheduler")
    stand.vm.edit(stand.schedule("Waste to compactor").id)
    return stand.settle()


@picture("scheduler-menu", sizes=(LANDSCAPE,))
def menu(studio: Any) -> Any:
    stand = Stand(studio, "scheduler")
    stand.screen.choose_tab("schedules")
    stand.settle()
    row = next(widget for widget in stand.screen.walk() if type(widget).__name__ == "ScheduleRow")
    stand.vm._menu(row.key, row.children[0])
    return studio.dialogs.top


def card_at(look: str) -> Callable[[Any], Any]:
    """The card of the longest bar of that look that is seen."""

    def build(studio: Any) -> Any:
        stand = Stand(studio, "scheduler")
        chart = next(widget for widget in stand.screen.walk() if type(widget).__name__ == "Lanes")
        seen = {box[4] for box in chart.boxes() if box[0] < chart.right}
        bar = max(
            (bar for lane in chart.lanes for bar in lane.bars if bar.state == look and bar.key in seen),
            key=lambda bar: bar.end - bar.start,
        )
        stand.vm.open_bar(bar.key, chart.place_of(bar.key))
        return studio.dialogs.top

    return build


@picture("scheduler-unfolded", sizes=(LANDSCAPE,))
def unfolded(studio: Any) -> Any:
    stand = Stand(studio, "scheduler")
    stand.vm.fold(20.0)
    return stand.settle()


@picture("scheduler-dragged", sizes=BOTH)
def dragged(studio: Any) -> Any:
    """A planned bar was dragged an hour and a half later: what does that mean?"""
    stand = Stand(studio, "scheduler")
    studio.driver.advance(1.1)  # what has just come takes no finger until then
    chart = next(widget for widget in stand.screen.walk() if type(widget).__name__ == "Lanes")
    left, bottom, right, top, _key = max(
        (box for box in chart.boxes() if box[4][0] == "schedule" and box[2] < chart.center_x),
        key=lambda box: box[2] - box[0],
    )
    touch = UnitTestTouch(*chart.to_window((left + right) / 2, (bottom + top) / 2))
    touch.touch_down()
    studio.driver.advance(LONG + 0.1)
    touch.touch_move(touch.x + chart.left_of(1.5) - chart.left_of(0), touch.y)
    studio.driver.advance(0.1)
    touch.touch_up()
    return stand.settle()


picture("scheduler-bar-planned", sizes=BOTH)(card_at("planned"))
picture("scheduler-bar-failed", sizes=BOTH)(card_at("failed"))


@picture("scheduler-mission", sizes=BOTH)
def mission(studio: Any) -> Any:
    stand = Stand(studio, "scheduler")
    stand.vm.new()
    return studio.dialogs.top


@picture("scheduler-time", sizes=BOTH)
def pick_time(studio: Any) -> Any:
    stand = planning(studio)
    stand.vm.form.pick_time("at")
    return stand.settle()


@picture("scheduler-weekend", sizes=(LANDSCAPE,))
def weekend(studio: Any) -> Any:
    """A ticked day that is no working day."""
    return planning(studio, kind=Kind.WEEKLY, weekdays=("TH", "FR", "SA")).settle()


@picture("scheduler-midnight", sizes=(LANDSCAPE,))
def midnight(studio: Any) -> Any:
    return planning(
        studio, kind=Kind.EVERY, every=30, unit=Unit.MINUTES, at=time(22, 0), until_time=time(2, 0)
    ).settle()


@picture("scheduler-first", sizes=BOTH)
def first(studio: Any) -> Any:
    def clear(container: Container) -> None:
        for schedule in container.repositories.schedules.all(container.db.read()):
            container.catalogue.remove_schedule(schedule.id)

    return Stand(studio, "scheduler", prepare=clear).settle()


@picture("scheduler-empty")
def empty(studio: Any) -> Any:
    return Stand(studio, "scheduler", furnished=False).settle()


def with_hall(container: Container) -> None:
    """All robots in one group, which has the kits of this evening, and more of them than robots at one time."""
    catalogue, c = container.catalogue, container.db.read()
    missions = {mission.name: mission.id for mission in container.repositories.missions.all(c)}
    hall = catalogue.save_group(Group("Hall 1", tuple(robot.id for robot in catalogue.robots())))
    for name, at, priority in (
        ("Deliver kits to line 2", time(16, 30), 2),
        ("Waste to compactor", time(19, 0), -1),
        ("Night stock count", time(21, 0), 0),
    ):
        catalogue.save_schedule(
            Schedule(
                "",
                None,
                missions[name],
                datetime.combine(date(2026, 11, 20), at),
                month.ZONE,
                group_id=hall.id,
                priority=priority,
            )
        )


@picture("scheduler-group", sizes=EVERY_SIZE)
def group(studio: Any) -> Any:
    """A schedule for any robot of a group, and the forecast of those that there are."""
    values = {"group_id": 1, "robot_id": None, "at": time(7, 30), "priority": 1, "kind": Kind.DAILY}
    return planning(studio, with_hall, **values).settle()


@picture("scheduler-group-bar", sizes=(*BOTH, SMALL))
def group_bar(studio: Any) -> Any:
    stand = Stand(studio, "scheduler", prepare=with_hall)
    number = next(
        schedule.id for schedule in stand.vm._facts.schedules if schedule.group_id and schedule.start.hour == 16
    )
    run = next(run for run in stand.vm._facts.planned if run.schedule.id == number)
    stand.vm.open_bar(("schedule", number, run.at), next(w for w in stand.screen.walk() if type(w).__name__ == "Lanes"))
    return stand.settle()


def advice(stand: Stand) -> Advice:
    """Suggestions about a schedule that was late on most days and about one that an earlier suggestion changed."""
    facts = stand.vm._facts
    late = next(
        schedule
        for schedule in facts.schedules
        if schedule.robot_id and schedule.mission_id == stand.mission("Collect empties")
    )
    moved = replace(late, start=late.start + timedelta(minutes=20))
    return Advice(
        (
            Suggestion(
                Finding(late.id, 20, 16, 540.0, Cause.BUSY, "Waste to compactor"),
                late,
                "Veikko",
                (
                    Change(ChangeKind.TIME, moved, "Veikko", shift_s=1200.0),
                    Change(ChangeKind.GROUP, replace(late, robot_id=None, group_id=1), group="Hall 1"),
                ),
            ),
        ),
        (),
    )


@picture("scheduler-suggestions", sizes=(*BOTH, SMALL_LARGE_TEXT))
def suggestions(studio: Any) -> Any:
    stand = Stand(studio, "scheduler", prepare=with_hall)
    stand.vm.advice._take(advice(stand))
    stand.screen.choose_tab("suggestions")
    return stand.settle()
