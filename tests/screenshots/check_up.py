"""The check-up of a robot in Settings: before it, while it runs, what it found of simulated robots, and how the robots stand."""

from __future__ import annotations

import tempfile
from dataclasses import replace
from datetime import timedelta
from functools import cache
from pathlib import Path

from app.database.check_ups import CheckUpRepository
from app.domain.check_up import Progress, Report, Trial
from app.domain.message import message
from app.services.check_up.service import CheckUps
from mir_sim import Profile, deviant
from mir_sim.profile import Reboots
from tests.screenshots.registry import picture
from tests.screenshots.settings import EVERY_SIZE, NOW, Plant
from tests.support.check_up_site import CheckedRobot

KINDS = {
    "good": Profile(),
    "odd": replace(deviant("german-states"), clock_offset=-42.0, reboots=Reboots(30, 10.0, 20.0)),
}
SOFTWARE = "3.5.4"


@cache
def found(kind: str, software: str = SOFTWARE, trial: Trial | None = None) -> Report:
    """By a check-up of a robot of that kind."""
    with tempfile.TemporaryDirectory(prefix="amr-pictures-") as directory:
        robot = CheckedRobot(Path(directory), KINDS[kind], software=software)
        try:
            return robot.check_ups.run(robot.id, trial)
        finally:
            robot.container.close()


class Checked(Plant):
    """``reports`` by the name of the robot."""

    def __init__(self, studio, **reports: Report) -> None:
        super().__init__(studio)
        container, check_ups = self.container, CheckUpRepository()
        for robot in container.catalogue.robots():
            if report := reports.get(robot.name):
                stored = replace(
                    report,
                    robot=robot.name,
                    address=robot.address,
                    model=robot.model,
                    began_at=NOW - timedelta(days=1),
                    profile=replace(report.profile, serial_number=robot.serial_number),
                )
                container.db.write(lambda c, robot=robot, stored=stored: check_ups.put(c, robot.id, stored))

    def opened(self, studio, name: str = "Aino"):
        """The check-up of a robot, with its sheet open."""
        from app.screens.settings.check_up import open_check_up

        self.shown = self.screen(studio)
        page = self.shown.page
        studio.afterwards(self.shell.sheets.give_up)
        robot = next(robot for robot in page.context.facts.robots if robot.name == name)
        open_check_up(page.context, robot)
        self.settle(studio)
        return self.shell.sheets.top.vm

    def settle(self, studio):
        studio.driver.wait(lambda: self.shell.background.idle)
        studio.driver.advance(0.2)
        return self.shown


def all_checked(studio) -> Checked:
    return Checked(studio, Aino=found("good"), Sisu=found("odd", trial=Trial()), Veikko=found("good", "2.14.7"))


@picture("check-up-robots", sizes=EVERY_SIZE)
def robots(studio):
    return all_checked(studio).screen(studio)


@picture("check-up-before", sizes=EVERY_SIZE)
def before(studio):
    plant = Checked(studio)
    plant.opened(studio)
    return plant.shown


@picture("check-up-trial", sizes=EVERY_SIZE)
def trial(studio):
    plant = Checked(studio)
    plant.opened(studio).choose(wants_trial=True)
    return plant.settle(studio)


@picture("check-up-long-name", sizes=EVERY_SIZE)
def long_name(studio):
    plant = Checked(studio)
    catalogue = plant.container.catalogue
    catalogue.save_robot(
        replace(
            catalogue.robots()[0], name="Aino of the goods receiving department, hall 2, between the docks 14 and 17"
        )
    )
    plant.opened(studio, catalogue.robots()[0].name).choose(wants_trial=True)
    return plant.settle(studio)


@picture("check-up-refused", sizes=EVERY_SIZE)
def refused(studio):
    plant = Checked(studio)
    plant.clock.advance((plant.container.catalogue.schedules()[0].next_at - NOW).total_seconds() - 120)
    check_up = plant.opened(studio)
    check_up.choose(wants_trial=True)
    plant.settle(studio)
    check_up.begin()
    return plant.settle(studio)


@picture("check-up-running", sizes=EVERY_SIZE)
def running(studio):
    plant = Checked(studio)
    check_up = plant.opened(studio)
    check_up.choose(wants_trial=True)
    plant.settle(studio)
    check_up.part = "CheckUpRunning"
    check_up._progress = Progress(message("Measuring how fast it answers"), 35.0, CheckUps.length_s(Trial()))
    check_up._show_progress()
    return plant.settle(studio)


@picture("check-up-good", sizes=EVERY_SIZE)
def good(studio):
    plant = Checked(studio, Aino=found("good", trial=Trial()))
    plant.opened(studio)
    return plant.settle(studio)


@picture("check-up-report", sizes=EVERY_SIZE)
def report(studio):
    plant = all_checked(studio)
    check_up = plant.opened(studio, "Sisu")
    check_up.turn(check_up.found[0].key)
    return plant.settle(studio)
