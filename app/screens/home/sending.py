"""The sheets in which the robot of the page is sent: one mission with its values, and all missions."""

from __future__ import annotations

import uuid
from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING, Any

from kivy.properties import BooleanProperty, ListProperty, NumericProperty, ObjectProperty, StringProperty

from app.domain.execution import DurationEstimate
from app.domain.models import Mission, Robot
from app.domain.robot import MissionParameter
from app.i18n import _
from app.screens.common.missing_mission import FETCH, or_fetch
from app.screens.common.parameters_view import Problems, changed, fields_of, values_of
from app.screens.common.presses import OfRobot
from app.screens.common.shell import Shell
from app.screens.home.facts import HomeServices
from app.screens.home.send import SendView, all_missions, send_view
from app.widgets.items import Item
from app.widgets.sheet import Finds, Sheet

if TYPE_CHECKING:
    from app.screens.home.screen import HomeViewModel


class HomeSheet(Sheet):
    """In which the robot is sent."""

    sending = ObjectProperty()

    def on_parent(self, sheet: Sheet, place: Any) -> None:
        super().on_parent(sheet, place)
        if place is not None:
            self.sending.show()


class SendSheet(HomeSheet):
    """What a mission needs, and when it starts. All that was entered is here: closed, it can be had back when another one was open."""

    robot_id = NumericProperty()
    mission = ObjectProperty()
    group_id = NumericProperty(None, allownone=True)  # None: the robot of the page
    parameters = ObjectProperty(())
    view = ObjectProperty(SendView(), rebind=True)
    fields = ListProperty()
    problems = ObjectProperty({}, force_dispatch=True)  # by name of the parameter
    entered = ObjectProperty({})

    def take(self, found: Sequence[MissionParameter] | None) -> None:
        """What the mission asks for; what was entered stays."""
        if found is not None and tuple(found) != tuple(self.parameters):
            self.parameters, self.fields, self.problems = found, fields_of(found, self.entered), {}

    def enter(self, values: Mapping[str, Any]) -> None:
        """A field was changed: the values of all of them."""
        self.entered, self.draft = changed(self.parameters, values), True


class AllMissionsSheet(Finds, HomeSheet):
    """All missions of the robot, with a search."""

    scrolls = BooleanProperty(False)
    query = StringProperty()
    rows = ListProperty()

    def on_query(self, *_args: object) -> None:
        self.sending.show()

    def found(self) -> list[Item]:
        """What Enter may choose."""
        return [row for row in self.rows if row.opens and row.key != FETCH]

    def chosen(self, key: object) -> None:
        """A row, by a tap or Enter."""
        self.sending.choose(key)


class Sending:
    """Opens the sheets over the page of ``home``'s robot; they close when another robot is shown, one had back shows its own."""

    def __init__(self, services: HomeServices, shell: Shell, home: HomeViewModel) -> None:
        self._services, self._shell, self._home = services, shell, home
        self.usual: Mapping[str, DurationEstimate | None] = {}

    # ------------------------------------------------------------------ opening
    def open(self, mission_id: int) -> None:
        """The sheet of one mission: nothing is sent before its button is pressed."""
        robot, shown = self._home.facts.robot, self._home.facts.missions
        mission = next((mission for mission in shown if mission.id == mission_id), None)
        if robot is None or mission is None:
            return
        names, guid = self._shell.mission_names, mission.guid
        sheet = SendSheet(sending=self, robot_id=robot.id, mission=mission, title=mission.name)
        sheet.take(names.known.parameters.get(guid))
        sheet.busy = not self._home.view.card.old  # the robot is asked
        self._put(sheet)
        self._shell.background.run(
            lambda: self._services.parameters.said_before(robot.id, guid),
            lambda found: sheet.take(names.take_stored(guid, found)),
        )
        self._shell.background.run(
            lambda: self._services.robot_missions.parameters(robot.id, guid),
            lambda found: self.learned(sheet, found),
            lambda _problem: self.learned(sheet, None),
            apart="parameters",
        )

    def open_all(self) -> None:
        """The sheet of all missions."""
        self._put(AllMissionsSheet(sending=self, title=self._home.view.send_title))

    def _put(self, sheet: HomeSheet) -> None:
        self._shell.sheets.show(sheet)
        self._read_usual()

    def close(self, but: int | None = None) -> None:
        """What was entered, or asked, is for the robot that was shown: for another one than ``but``."""
        top = self._shell.sheets.top
        if not isinstance(top, SendSheet) or top.robot_id != but:
            self._shell.sheets.give_up()

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

    def learned(self, sheet: SendSheet, found: Sequence[MissionParameter] | None) -> None:
        """The robot's answer; None: it gave none."""
        if found is not None:
            self._shell.mission_names.take(sheet.mission.guid, found)
        sheet.take(found)
        sheet.busy = False
        self.show()

    def show(self) -> None:
        """Once a second, as the page, and when a sheet appears."""
        home, sheet = self._home, self._shell.sheets.top
        robot = home.facts.robot
        if isinstance(sheet, AllMissionsSheet) and robot is not None:
            sheet.rows = all_missions(home.facts, robot, self.usual, sheet.query)
        elif isinstance(sheet, SendSheet):
            if sheet.robot_id not in {each.id for each in home.facts.robots}:  # it was deleted
                self._shell.sheets.close(sheet)
            elif robot is None or robot.id != sheet.robot_id or home.fleet.is_shown:  # the sheet was had back
                home.fleet.leave()
                home.select_robot(sheet.robot_id)
                self._read_usual()
            elif not home.facts.is_new:
                self._show_one(sheet, robot)

    def _show_one(self, sheet: SendSheet, robot: Robot) -> None:
        facts, groups = self._home.facts, self._home.facts.groups
        if sheet.mission.id not in {each.id for each in facts.missions}:  # it was deleted
            self._shell.sheets.give_up()
            return
        if not any(group.id == sheet.group_id and robot.id in group.members for group in groups):
            sheet.group_id = None  # the group was deleted
        now = self._services.clock.now()
        view = send_view(facts, robot, self._home.view.card, sheet.mission, sheet.group_id, self.usual, now)
        asking = _("Asking {robot} …").format(robot=robot.name) if sheet.busy else ""
        sheet.view = replace(view, off=view.off or asking)

    # ------------------------------------------------------------------ what the operator presses
    def choose(self, key: object) -> None:
        """A row of all missions."""
        or_fetch(self._shell, self.open)(key)

    def aim(self, sheet: SendSheet, group_id: int | None) -> None:
        sheet.group_id = group_id
        members = next((group.members for group in self._home.facts.groups if group.id == group_id), ())
        self._home.learning.learn_names(members)
        self.show()

    def run(self, sheet: SendSheet, entered: Mapping[str, Any]) -> None:
        """Send it with these values of its fields."""
        if sheet.view.off:
            return
        try:
            values = values_of(sheet.parameters, entered)
        except Problems as problems:
            sheet.problems = dict(problems.by_name)
            return
        if self._submit(sheet.mission, sheet.group_id, values):
            self._shell.sheets.close(sheet)

    def _submit(self, mission: Mission, group_id: int | None, values: Mapping[str, Any]) -> bool:
        """One press, one mission: the token is made here. False: the same one of that robot is not on disk yet."""
        robot, token, operator = self._home.facts.robot, str(uuid.uuid4()), self._services.operator
        if robot is None:
            return False
        start, target = (operator.run_now, robot.id) if group_id is None else (operator.run_on_any, group_id)
        return self._home.act_once(
            OfRobot(("run", mission.id), robot.id),
            lambda: start(target, mission.id, values, token),
            self._home.started.follow,
        )
