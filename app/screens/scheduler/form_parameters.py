"""The values that the mission in the Scheduler's form needs: its robot is asked which they are."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from typing import Any

from kivy.clock import Clock
from kivy.event import EventDispatcher
from kivy.properties import ListProperty, ObjectProperty, StringProperty

from app.domain.models import Robot
from app.domain.robot import MissionParameter
from app.screens.common.parameters_view import Problems, changed, fields_of, values_of
from app.screens.common.shell import Shell
from app.screens.scheduler.draft import Draft
from app.screens.scheduler.facts import SchedulerFacts, SchedulerServices

ROBOT_ANSWERS_WITHIN = 3.0  # s for which Save is off


class FormParameters(EventDispatcher):
    """Of the mission in ``draft()``. Until the robot answers they are as it or another one has said before, or those that the
    schedule has values for. ``learned()`` is called when more is known about robots' missions."""

    fields = ListProperty()
    problems = ObjectProperty({})  # one sentence by name
    asking = StringProperty()  # its robot, while nothing is known about the mission, but not for long
    silent = StringProperty()  # its robot, from then on until it answers

    def __init__(
        self,
        services: SchedulerServices,
        shell: Shell,
        draft: Callable[[], Draft],
        learned: Callable[[], object],
    ) -> None:
        super().__init__()
        self._services, self._shell, self._draft, self._learned = services, shell, draft, learned
        self._parameters: Sequence[MissionParameter] = ()
        self._asked: tuple[int, str] | None = None  # robot, and guid of the mission
        self._has_failed = False  # the last time that the robot was asked
        self._wait_no_longer = Clock.create_trigger(self._stop_waiting, ROBOT_ANSWERS_WITHIN)

    def show(self) -> None:
        """In the language of now, with what was entered."""
        self.problems = {}
        self.fields = fields_of(self._parameters, self._draft().entered)

    def entered(self, values: Mapping[str, Any]) -> dict[str, Any]:
        """Of what is in the fields."""
        return changed(self._parameters, values)

    def values(self) -> dict[str, Any] | None:
        """As the robot wants them; None if one can't be: its field says why."""
        self.problems = {}
        try:
            fields = fields_of(self._parameters, self._draft().entered)
            return values_of(self._parameters, {field.name: field.default for field in fields})
        except Problems as problems:
            self.problems = dict(problems.by_name)
            return None

    # ------------------------------------------------------------------ what robots are asked
    def forget(self) -> None:
        """Ask again."""
        self._asked = None

    def _stop_waiting(self, *_args: object) -> None:
        self.silent, self.asking = self.asking or self.silent, ""

    def ask(self, facts: SchedulerFacts, *, again: bool = False) -> None:
        """Once for a robot and a mission, or ``again`` if that has failed. Of a group the first robot that is switched on: a
        mission's parameters are the same on all."""
        draft = self._draft()
        members = [robot for robot in facts.members(draft.group_id) if robot.enabled]
        robot = facts.robot(draft.robot_id) if draft.group_id is None else next(iter(members), None)
        mission, known = facts.mission(draft.mission_id), self._shell.mission_names.known.parameters
        asked = (robot.id if robot else 0, mission.guid if mission else "")
        if asked != self._asked:
            self._asked, self.asking, self.silent, self.fields = asked, "", "", []
            self._take(known.get(asked[1], ()))
            if robot is not None and mission is not None and mission.guid not in known:
                self.asking = robot.name
                self._wait_no_longer.cancel()
                self._wait_no_longer()
                self._shell.background.run(
                    lambda: self._services.parameters.said_before(*asked),
                    lambda found: self._answered(asked, self._shell.mission_names.take_stored(asked[1], found)),
                )
        elif not (again and self._has_failed):
            return
        if robot is not None and mission is not None:
            self._request(asked)
            self._learn_names([member for member in members if member is not robot])

    def _request(self, asked: tuple[int, str]) -> None:
        self._has_failed = False

        def answered(found: Sequence[MissionParameter]) -> None:
            self._shell.mission_names.take(asked[1], found)
            self._answered(asked, found)

        def failed(_problem: BaseException) -> None:
            self._has_failed = True
            self._stop_waiting()

        self._shell.background.run(
            lambda: self._parameters_of(*asked),
            answered,
            failed,
            key=("scheduler", "parameters"),
            apart="parameters",
        )

    def _answered(self, asked: tuple[int, str], found: Sequence[MissionParameter] | None) -> None:
        if found is not None and asked == self._asked:
            self.asking = self.silent = ""
            self._take(found)
            self._learned()  # it may not have the mission at all

    def _parameters_of(self, robot_id: int, guid: str) -> Sequence[MissionParameter]:
        self._services.robot_missions.learn_names(robot_id)
        return self._services.robot_missions.parameters(robot_id, guid)

    def _learn_names(self, robots: Sequence[Robot]) -> None:
        """The others of a group: perhaps none has the mission."""
        if robots:
            self._shell.background.run(
                lambda: sum(self._services.robot_missions.learn_names(robot.id) for robot in robots),
                lambda new: self._learned() if new else None,
                lambda _problem: None,
                key=("scheduler", "names"),
                apart="names",
            )

    def _take(self, found: Sequence[MissionParameter]) -> None:
        """Their values are those of the schedule."""
        kept = self._draft().parameters
        self._parameters = [replace(p, default=kept[p.name]) if p.name in kept else p for p in found] or [
            MissionParameter(name, type="integer" if type(value) is int else "", default=value)
            for name, value in kept.items()
        ]
        self.show()
