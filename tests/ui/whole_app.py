"""The whole app in the window without a display: real services on a temporary database, real HTTP to simulated robots on this machine."""
from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import mir_sim
from app.container import Container
from app.domain.models import Mission, Robot
from app.window import application
from app.window.application import SchedulerApp
from tests.ui.driver import Driver

USER, PASSWORD = "distributor", "distributor"
GUIDS = {mission.name: mission.guid for mission in mir_sim.MISSIONS}
POLL = 1                                 # s
application.INPUT_DEVICES = Path("/nowhere/devices")    # whether the machine of the tests has a keyboard is nothing to them


class Plant:
    """A tablet and its robots. ``fleet.robots[n].control({...})`` does something to a robot."""

    def __init__(self, directory: Path, fleet: mir_sim.Fleet) -> None:
        self.fleet = fleet
        self.container = Container.open(directory, with_window=True)
        self.container.catalogue.change_settings(poll_interval_seconds=POLL)

    def add_robots(self) -> list[Robot]:
        return [self.container.catalogue.save_robot(Robot(robot.name, robot.url, USER), password=PASSWORD) for robot in self.fleet.robots]

    def add_missions(self, *names: str, favourite: bool = True) -> list[Mission]:
        return [self.container.catalogue.save_mission(Mission(name, GUIDS[name], favourite=favourite)) for name in names]


@contextmanager
def plant(directory: Path, *, robots: int = 1, time_scale: float = 1.0, start: bool = True) -> Iterator[Plant]:
    """Robots that answer and services that run, until the block ends."""
    with mir_sim.serve(robots=robots, time_scale=time_scale, battery=90.0) as fleet:
        site = Plant(directory, fleet)
        if start:
            site.container.runner.start()
        try:
            yield site
        finally:
            site.container.close()


@contextmanager
def shown(container: Container, ui: Driver, screen: str = "home") -> Iterator[SchedulerApp]:
    """The app on these services, in the window of ``ui``, opened on that screen."""
    app = SchedulerApp(container, animate=False, first=screen)
    app._run_prepare()
    try:
        ui.advance(.2)
        yield app
    finally:
        app.dispatch("on_stop")
        ui.advance()
