"""The check-up of a robot in Settings: before it, while it runs, what it found of simulated robots, and how the robots stand."""
from __future__ import annotations

from dataclasses import replace
from datetime import timedelta
from functools import cache

from app.domain.check_up import Progress, Report
from app.domain.message import message
from app.services.check_up.reading import length_s, read_robot
from mir_sim import deviant
from tests.screenshots.registry import picture
from tests.screenshots.settings import EVERY_SIZE, NOW, Plant
from tests.support.asked_robot import AskedRobot

WORST = "reboots-under-load"


@cache
def found(name: str = "") -> Report:
    """By reading a robot of that kind; faithful without a name."""
    robot = AskedRobot(deviant(name) if name else None)
    look = robot.look()
    identity = read_robot(look)
    return Report("Aino", "http://10.40.12.21", "MiR250", NOW - timedelta(days=1), length_s(), tuple(look.findings),
                  look.profile(identity.serial_number, identity.software))


class Checked(Plant):
    """``reports`` by the name of the robot."""
    def __init__(self, studio, **reports: Report) -> None:
        super().__init__(studio)
        container = self.container
        for robot in container.catalogue.robots():
            if report := reports.get(robot.name):
                profile = replace(report.profile, serial_number=robot.serial_number)
                stored = replace(report, robot=robot.name, address=robot.address, model=robot.model, profile=profile)
                container.db.write(lambda c, robot=robot, stored=stored: container.check_ups._check_ups.put(c, robot.id, stored))

    def dialog(self, studio, name: str = "Aino"):
        """The check-up of a robot, and the dialog about it."""
        page = self.screen(studio).page
        robot = next(robot for robot in page.context.facts.robots if robot.name == name)
        page.act(robot.id, "check up")
        studio.driver.wait(lambda: self.shell.background.idle)
        studio.driver.advance(.2)
        return page._check_ups[robot.id]


@picture("check-up-robots", sizes=EVERY_SIZE)
def robots(studio):
    plant = Checked(studio, Aino=with_software(found(), "3.5.4"), Sisu=with_software(found(WORST), "3.5.4"), Veikko=found())
    return plant.screen(studio)


def with_software(report: Report, software: str) -> Report:
    return replace(report, profile=replace(report.profile, software=software))


@picture("check-up-before", sizes=EVERY_SIZE)
def before(studio):
    Checked(studio).dialog(studio)
    return studio.dialogs.top


@picture("check-up-trial", sizes=EVERY_SIZE)
def trial(studio):
    plant = Checked(studio)
    check_up = plant.dialog(studio)
    check_up.choose_trial(True)
    studio.driver.wait(lambda: plant.shell.background.idle)
    studio.driver.advance(.2)
    return studio.dialogs.top


@picture("check-up-running", sizes=EVERY_SIZE)
def running(studio):
    check_up = Checked(studio).dialog(studio)
    check_up.part = "CheckUpRunning"
    check_up._progress = Progress(message("Measuring how soon it answers"), 35.0, length_s())
    check_up._show_progress()
    studio.driver.advance(.2)
    return studio.dialogs.top


@picture("check-up-good", sizes=EVERY_SIZE)
def good(studio):
    Checked(studio, Aino=with_software(found(), "3.5.4")).dialog(studio)
    return studio.dialogs.top


@picture("check-up-report", sizes=EVERY_SIZE)
def report(studio):
    Checked(studio, Aino=with_software(found(WORST), "3.5.4")).dialog(studio)
    return studio.dialogs.top
