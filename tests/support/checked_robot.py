"""A simulated robot with the app that knows it, on a virtual clock: for check-ups, and what is to be as it was after them."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from app.container import Container
from app.database.connection import Database
from app.domain.models import Robot
from app.services.check_up.service import CheckUps
from mir_sim import Profile, SimulatedRobot
from tests.support.asked_robot import ZONE, AskedRobot

ENDED = ("Done", "Aborted")


class CheckedRobot:
    """``id``: of the robot in the app."""

    def __init__(self, directory: Path, profile: Profile | None = None, **values: Any) -> None:
        self.asked = AskedRobot(profile, **values)
        self._directory = directory
        self.open()
        self.container.db.write(lambda c: self.container.repositories.settings.save(c, timezone=ZONE))
        robot = Robot("Aino", "http://10.0.0.1", "distributor", serial_number=self.machine.serial_number)
        self.id = self.container.catalogue.save_robot(robot, password="distributor").id

    @property
    def machine(self) -> SimulatedRobot:
        return self.asked.machine

    @property
    def check_ups(self) -> CheckUps:
        return self.container.check_ups

    def open(self) -> None:
        """The app is started (again)."""
        db = Database.open(self._directory / "amr-scheduler.db", clock=self.asked.clock, threaded=False, durable=False)
        self.container = Container(db, self.asked.clock, make_client=self.asked.client)
        self.container.first_start()

    def as_it_is(self) -> dict[str, Any]:
        """What a trial changes on the robot, and has to put back."""
        self.machine.catch_up()
        site = self.machine.site
        return {
            "missions": sorted(row["guid"] for row in site.table("/missions")),
            "is_paused": self.machine.paused,
            "actions": len(list(site.table("/missions/{mission_id}/actions"))),
            "state": self.machine.state.name,
            "open": [item.id for item in self.machine.queue if str(item.state) not in ENDED],
        }
