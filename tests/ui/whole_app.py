"""The whole app in the window without a display: real services on a temporary database, real HTTP to simulated robots on this machine."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from datetime import datetime
from pathlib import Path

import requests
from kivy.core.window import Window

import mir_sim
from app.container import Container
from app.domain.models import Connection, Mission, Robot, RobotSnapshot
from app.domain.robot import RobotState, RobotStatus
from app.mir.credentials import Token
from app.screens.common.shell import Loudspeaker
from app.widgets.frame import TopBar
from app.widgets.tabs import TabButton
from app.window import application
from app.window.application import SchedulerApp
from tests.support.fleet_process import DistantFleet
from tests.ui.driver import Driver

USER, PASSWORD = "distributor", "distributor"
GUIDS = {mission.name: mission.guid for mission in mir_sim.MISSIONS}
POLL = 1  # s
BATTERY = 90.0  # %
application.INPUT_DEVICES = Path(
    "/nowhere/devices"
)  # whether the machine of the tests has a keyboard is nothing to them


def tab_shown(ui: Driver) -> str:
    """The word of the chosen tab in the top bar: on Home, the robot."""
    return next((button.tab.text for button in ui.find_all(TabButton, ui.find(TopBar)) if button.active), "")


class Plant:
    """A tablet and its robots. ``fleet.robots[n].control({...})`` does something to a robot."""

    def __init__(self, directory: Path, fleet: mir_sim.Fleet | DistantFleet) -> None:
        self.fleet = fleet
        self.container = Container.open(directory, with_window=True)
        self.container.catalogue.change_settings(poll_interval_seconds=POLL)

    def close(self) -> None:
        self.container.close()

    def add_robots(self) -> list[Robot]:
        return [
            self.container.catalogue.save_robot(Robot(robot.name, robot.url, USER), password=PASSWORD)
            for robot in self.fleet.robots
        ]

    def add_missions(self, *names: str, favourite: bool = True) -> list[Mission]:
        return [
            self.container.catalogue.save_mission(Mission(name, GUIDS[name], favourite=favourite)) for name in names
        ]

    def calm_down(self, ui: Driver) -> None:
        """Until every robot is ready, charged and without faults, nothing is under way, and the services know it."""
        for robot in self.fleet.robots:
            calm_down(robot)
        for execution in self.container.history.open():
            self.container.operator.cancel_execution(execution.id)
        began = self.container.clock.now()
        self.container.engine.request_cycle()
        ui.wait(lambda: self.is_at_rest(began))

    def is_at_rest(self, since: datetime) -> bool:
        """As read from all robots after that instant."""

        def rests(seen: RobotSnapshot) -> bool:
            return (
                seen.read_at is not None
                and seen.read_at >= since
                and seen.queue_read_at is not None
                and seen.queue_read_at >= since
                and seen.status is not None
                and seen.status.state is RobotState.READY
                and not seen.queue
            )

        container = self.container
        return not container.history.open() and all(
            rests(container.snapshots.get(robot.id)) for robot in container.catalogue.robots()
        )


@contextmanager
def standing(container: Container, robot_id: int, status: RobotStatus) -> Iterator[None]:
    """The robot was just read as ``status``; afterwards it is as silent as before."""
    snapshots, now = container.snapshots, container.clock.now()
    before = snapshots.get(robot_id)
    snapshots.update(robot_id, connection=Connection.CONNECTED, status=status, read_at=now)
    try:
        yield
    finally:
        snapshots.update(robot_id, connection=before.connection, status=before.status, read_at=before.read_at)


def api(robot: mir_sim.FleetRobot, method: str, path: str, **body: object) -> requests.Response:
    """A person at the robot's own interface."""
    answer = requests.request(
        method,
        f"{robot.url}/api/v2.0.0{path}",
        json=body or None,
        timeout=5,
        headers={"Authorization": Token.derive("admin", "admin").header},
    )
    answer.raise_for_status()
    return answer


def calm_down(robot: mir_sim.FleetRobot) -> None:
    """Nothing to do, nothing wrong, ready."""
    if not robot.state()["online"]:
        robot.control({"reboot_seconds": 0})
    robot.control(
        {
            "fault": None,
            "error": None,
            "emergency_stop": False,
            "user_prompt": None,
            "fail_next_mission": None,
            "battery": BATTERY,
        }
    )
    with robot.model.lock:
        robot.model.cancel_all()
        robot.model.clear_errors()
        robot.model.resume()


@contextmanager
def plant(directory: Path, *, robots: int = 1, time_scale: float = 1.0, start: bool = True) -> Iterator[Plant]:
    """Robots that answer and services that run, until the block ends."""
    with mir_sim.serve(robots=robots, time_scale=time_scale, battery=BATTERY) as fleet:
        site = Plant(directory, fleet)
        if start:
            site.container.runner.start()
        try:
            yield site
        finally:
            site.close()


@contextmanager
def shown(
    container: Container, ui: Driver, screen: str | None = "home", loudspeaker: Loudspeaker | None = None
) -> Iterator[SchedulerApp]:
    """The app on these services, in the window of ``ui``, opened on that screen (None: as the product is). Silent, unless
    it is given a loudspeaker."""
    app = SchedulerApp(container, first=screen, loudspeaker=loudspeaker)
    app._run_prepare()
    try:
        ui.advance(0.2)
        yield app
    finally:
        app.dispatch("on_stop")
        ui.advance()


def restart(app: SchedulerApp, ui: Driver, put_back: Callable[[], object]) -> None:
    """The first screen with nothing open above it, for the next test that shares the app: ``put_back`` is called when nothing is under way
    any more."""
    app.shell.go("home")
    ui.wait(lambda: app.shell.background.idle)
    app.shell.dialogs.close_all()
    put_back()
    ui.skip(1)
    ui.wait(lambda: app.shell.background.idle)
    app.shell.snackbars.clear()
    assert Window.children == [app.root]
