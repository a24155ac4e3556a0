"""What Home asks the robots for: names of missions not entered here, names of positions, and maps."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from functools import partial

from app.screens.common.mission_names import MissionNameLookup
from app.screens.common.shell import Shell
from app.screens.home.facts import HomeFacts, HomeServices


class Learning:
    """``learnt()`` is called when something new is known."""

    def __init__(self, services: HomeServices, shell: Shell, learnt: Callable[[], object]) -> None:
        self._services, self._shell, self._learnt = services, shell, learnt
        self._is_learning_map = False
        self._given = MissionNameLookup(services.robot_missions, services.clock, shell, learnt)

    def look(self, facts: HomeFacts) -> None:
        """What these facts lack."""
        self._learn_names(facts)
        self._learn_map(facts)
        self._given.look(
            facts.robots,
            (
                *((run.robot_id, run.mission_guid, run.parameters) for run in (*facts.open, *facts.finished)),
                *((run.robot.id, run.mission.guid, run.schedule.parameters) for run in facts.planned),
            ),
        )

    def _learn_names(self, facts: HomeFacts) -> None:
        """Others run missions that were not entered here; the robot knows their names."""
        robot = facts.robot
        if robot is not None and any(facts.needs_name(item) for item in facts.queue):
            self.learn_names([robot.id])

    def learn_names(self, robot_ids: Iterable[int]) -> None:
        """Which missions these robots have."""
        for robot_id in robot_ids:
            self._shell.background.run(
                partial(self._services.robot_missions.learn_names, robot_id),
                lambda is_new: self._learnt() if is_new else None,
                lambda _problem: None,
                key=("home", "names", robot_id),
                apart="names",
            )

    def _learn_map(self, facts: HomeFacts) -> None:
        """One at a time; first the stored map, then the robot's answer."""
        robot, map_id, maps = facts.robot, facts.map_id, self._services.maps
        if robot is None or map_id is None or self._is_learning_map or not maps.is_due(robot.id, map_id):
            return
        self._is_learning_map = True

        def ended(_outcome: object) -> None:
            self._is_learning_map = False
            self._learnt()

        self._shell.background.run(lambda: maps.learn(robot.id, map_id), ended, ended, apart="maps")
