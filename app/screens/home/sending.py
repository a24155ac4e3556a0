"""The sheets in which the robot of the page is sent: one mission with its values, and all missions."""

from __future__ import annotations

import uuid
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

from kivy.event import EventDispatcher
from kivy.properties import BooleanProperty, ListProperty, ObjectProperty, StringProperty

from app.domain.models import DurationEstimate, Mission
from app.domain.robot import MissionParameter
from app.screens.common.missing_mission import or_fetch
from app.screens.common.parameters_view import Problems, fields_of, values_of
from app.screens.common.presses import OfRobot
from app.screens.common.shell import Shell
from app.screens.home.facts import HomeServices
from app.screens.home.send import SendView, Target, all_missions, send_view, start
from app.widgets.flow import Chip
from app.widgets.sheet import Sheet

if TYPE_CHECKING:
    from app.screens.home.screen import HomeViewModel


class SendState(EventDispatcher):
    """Read by kv."""

    view = ObjectProperty(SendView(), rebind=True)
    mission_name = StringProperty()
    fields = ListProperty()
    problems = ObjectProperty({}, force_dispatch=True)  # by name of the parameter
    map = ObjectProperty(None, allownone=True)
    goes_first = BooleanProperty(False)
    is_asking = BooleanProperty(False)  # the robot for the mission's parameters
    is_changed = BooleanProperty(False)  # something was entered
    send_title = StringProperty()
    rows = ListProperty()  # of all missions
    query = StringProperty()


class HomeSheet(Sheet):
    """In which the robot is sent."""

    state = ObjectProperty(SendState(), rebind=True)


class SendSheet(HomeSheet):
    """What a mission needs, and when it starts."""

    @staticmethod
    def first_chips(can_be: bool, chosen: bool, words: str) -> list[Chip]:
        """A start on a group can be put before everything else."""
        return [Chip("first", words, "chevron-double-up", chosen)] if can_be else []


class AllMissionsSheet(HomeSheet):
    """All missions of the robot, with a search."""

    scrolls = BooleanProperty(False)


class Sending(SendState):
    """Opens the sheets over the page of ``home``'s robot; they close when another robot is shown."""

    def __init__(self, services: HomeServices, shell: Shell, home: HomeViewModel) -> None:
        super().__init__()
        self._services, self._shell, self._home = services, shell, home
        self._sheet: HomeSheet | None = None
        self._mission: Mission | None = None
        self._target = Target()
        self._parameters: Sequence[MissionParameter] = ()
        self.usual: Mapping[str, DurationEstimate | None] = {}
        self.fbind("query", lambda *_args: self.show())

    # ------------------------------------------------------------------ opening
    def open(self, mission_id: int) -> None:
        """The sheet of one mission: nothing is sent before its button is pressed."""
        robot, shown = self._home.facts.robot, self._home.facts.missions
        mission = next((mission for mission in shown if mission.id == mission_id), None)
        if robot is None or mission is None:
            return
        known = self._shell.mission_names.known.parameters.get(mission.guid) or ()
        self._mission, self._target, self.goes_first = mission, Target(), False
        self.mission_name, self.is_changed, self.is_asking = mission.name, False, not self._home.card.old
        self._parameters, self.fields, self.problems = known, fields_of(known), {}
        self._put(SendSheet(state=self))
        self._shell.background.run(
            lambda: self._services.robot_missions.parameters(robot.id, mission.guid),
            lambda found: self.learned(mission, found),
            lambda _problem: self.learned(mission, known),
            key=("home", "parameters"),
            apart="parameters",
        )

    def open_all(self) -> None:
        """The sheet of all missions."""
        self.query, self._mission, self.send_title = "", None, self._home.send_title
        self._put(AllMissionsSheet(state=self))

    def _put(self, sheet: HomeSheet) -> None:
        self._sheet = sheet
        self._shell.sheets.show(sheet)
        self._read_usual()
        self.show()

    def close(self) -> None:
        """What was entered, or asked, is for the robot that was shown."""
        self._shell.sheets.give_up()
        self._sheet = self._mission = None

    # ------------------------------------------------------------------ what is known
    def _read_usual(self) -> None:
        """How long its missions take on the robot, in the background."""
        robot, facts, history = self._home.facts.robot, self._home.facts, self._services.history
        if robot is None:
            return
        guids = {mission.guid for mission in facts.entered} | {facts.guid_of(item) for item in facts.snapshot.queue}
        guids |= {run.mission_guid for run in facts.not_in_queue}

        def take(found: Mapping[str, DurationEstimate | None]) -> None:
            self.usual = found
            self.show()

        self._shell.background.run(
            lambda: {guid: history.expected(robot.id, guid) for guid in guids if guid},
            take,
            self._shell.say_problem,
            key=("home", "durations"),
        )

    def learned(self, mission: Mission, found: Sequence[MissionParameter]) -> None:
        """From this robot or, if it does not answer, another one."""
        if found:
            self._shell.mission_names.take(mission.guid, found)
        if mission is self._mission:
            self.is_asking = False
            if tuple(found) != tuple(self._parameters):  # else what was entered stays
                self._parameters, self.fields, self.problems = found, fields_of(found), {}
            self.show()

    def show(self) -> None:
        """Once a second, as the page."""
        facts, mission = self._home.facts, self._mission
        robot = facts.robot
        if robot is None or self._sheet is None or self._sheet is not self._shell.sheets.top:
            return
        if mission is None:
            self.rows = all_missions(facts, robot, self.usual, self.query)
            return
        if mission.id not in {each.id for each in facts.missions}:  # it was deleted
            self.close()
            return
        if not any(group.id == self._target.group_id and robot.id in group.members for group in facts.groups):
            self._target, self.goes_first = Target(), False  # the robot itself, or the group was deleted
        now = self._services.clock.now()
        self.view = send_view(facts, robot, self._home.card, mission, self._target, self.usual, now)
        self.map = self._home.map.picture

    # ------------------------------------------------------------------ what the operator presses
    def choose(self, key: object) -> None:
        """A row of all missions."""
        or_fetch(self._shell, self.open)(key)

    def aim(self, group_id: int | None) -> None:
        self._target = Target(group_id, self.goes_first and group_id is not None)
        self.goes_first = self._target.first
        members = next((group.members for group in self._home.facts.groups if group.id == group_id), ())
        self._home.learning.learn_names(members)
        self.show()

    def go_first(self) -> None:
        self._target = Target(self._target.group_id, not self._target.first)
        self.goes_first = self._target.first

    def run(self, entered: Mapping[str, Any]) -> None:
        """Send it with these values of its fields."""
        mission, target = self._mission, self._target
        if mission is None or self.view.off or self.is_asking:
            return
        try:
            values = values_of(self._parameters, entered)
        except Problems as problems:
            self.problems = dict(problems.by_name)
            return
        if self._submit(mission, target, values):
            self._sheet = self._mission = None
            self._shell.sheets.close()

    def _submit(self, mission: Mission, target: Target, values: Mapping[str, Any]) -> bool:
        """One press, one mission: the token is made here. False: the same one of that robot is not on disk yet."""
        robot, token = self._home.facts.robot, str(uuid.uuid4())
        if robot is None:
            return False
        is_held = self._home.facts.hold(robot.id, self._services.clock.now()) is not None
        is_silent = target.group_id is None and self._home.card.old and not is_held
        return self._home.act_once(
            OfRobot(("run", mission.id), robot.id),
            lambda: start(self._services.operator, target, robot.id, mission.id, values, token),
            lambda execution: self._home.started.follow(execution, is_silent),
        )
