"""A site with one group of robots."""

from __future__ import annotations

from datetime import datetime

from app.domain.models import Group, Schedule
from app.services.catalogue import group_edit
from tests.support.edits import switch_robot
from tests.support.site import GUIDS, Site


class Hall(Site):
    """``robots`` of one group; "Deliver" is mission 1. Starts are planned five minutes from the beginning."""

    def __init__(self, directory, robots: int = 3, **values) -> None:
        super().__init__(directory, robots=robots, **values)
        self.add_mission("Deliver")
        members = tuple(robot.id for robot in self.add_robots())
        self.group = self.container.catalogue.edit(lambda edit: group_edit.save(edit, Group("Hall", members)))

    def plan(self, name: str = "A", at: str = "2026-11-23T06:05", **values) -> Schedule:
        where = {"robot_id": None, "group_id": self.group.id} | values
        return self.container.catalogue.save_schedule(
            Schedule(
                name, mission_id=where.pop("mission_id", 1), start=datetime.fromisoformat(at), timezone="UTC", **where
            )
        )

    def items(self) -> list:
        return [item for name in self.machines for item in self.queue(name)]

    def run_of(self, schedule: str = "A"):
        return next(row for row in self.executions() if row.schedule == schedule)

    def robot(self, name: str):
        return next(robot for robot in self.container.catalogue.robots() if robot.name == name)

    def switch(self, name: str, on: bool) -> None:
        switch_robot(self.container.catalogue, self.robot(name).id, on)

    def only(self, *names: str) -> None:
        """The others are switched off."""
        for name in self.machines:
            if name not in names:
                self.switch(name, on=False)

    def hold(self, name: str | None) -> None:
        self.container.holds.hold("cleaning", None, None if name is None else self.robot(name).id)

    def alarms(self) -> list[str]:
        return [alarm.code for alarm in self.container.alarms.open()]

    def learn_stops(self) -> None:
        """Positions of missions, as answering robots report them."""
        reader = self.container.mission_actions
        reader.ask(reader.to_ask())

    def lose_mission(self, name: str) -> None:
        self.machines[name].site.table("/missions").remove(GUIDS["Deliver"])
