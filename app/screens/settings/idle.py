"""Settings, When idle: per robot a mission that starts when the robot has had nothing to do for some minutes."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from functools import partial
from typing import Any

from kivy.properties import BooleanProperty, ListProperty, NumericProperty, ObjectProperty, StringProperty

from app.domain.models import Connection, IdleRule, Robot
from app.domain.parameters import missing
from app.domain.robot import MissionParameter
from app.i18n import _
from app.screens.common.problems import sentence_of
from app.screens.common.shell import PROBLEM_SECONDS
from app.screens.settings.missions_view import idle_items, idle_mission, mission_options
from app.screens.settings.page import PageContext, SettingsPage
from app.widgets.sheet import Sheet


class IdleSheet(Sheet):
    """One robot's rule, saved at once: its mission, and after how many minutes it starts."""

    page = ObjectProperty(None)
    robot_id = NumericProperty(0)
    mission = StringProperty()
    minutes = NumericProperty(10)
    problem = StringProperty()
    has_rule = BooleanProperty(False)


class IdlePage(SettingsPage):
    items = ListProperty()

    def __init__(self, context: PageContext) -> None:
        super().__init__(context)
        self._problems: dict[int, str] = {}

    def show(self) -> None:
        facts, sheet = self.context.facts, self.context.shell.sheets.top
        robot = facts.robot(sheet.robot_id) if isinstance(sheet, IdleSheet) else None
        self.items = idle_items(facts, self._problems, robot.id if robot else None)
        if robot is not None and sheet is not None:
            sheet.title, sheet.mission, sheet.has_rule = robot.name, idle_mission(facts, robot), robot.idle is not None
            sheet.minutes = (robot.idle or IdleRule(0)).after_minutes
            sheet.problem = self._problems.get(robot.id, "")

    def reached(self, **intent: Any) -> None:
        self._problems.clear()

    # ------------------------------------------------------------------ what is changed
    def act(self, robot_id: int, action: str, *values: Any) -> None:
        robot = self.context.facts.robot(robot_id)
        if robot is None:
            return
        if action == "open":
            self.context.shell.sheets.show(IdleSheet(page=self, robot_id=robot.id))
            self.show()
        elif action == "minutes":
            self._save(robot, after_minutes=values[0])
        elif action == "mission" or (values[0] and robot.idle is None):
            self._choose_mission(robot)  # a rule can't be switched on without a mission
        elif robot.idle is not None and values[0]:
            self._save_if_it_asks_nothing(robot, robot.idle.mission_id, enabled=True)
        elif robot.idle is not None:
            self._save(robot, enabled=False)

    def _choose_mission(self, robot: Robot) -> None:
        options = mission_options(self.context.facts, robot)
        if not options:
            self._show_problem(robot, _("There are no missions yet: add them under Missions"))
            return
        self.context.shell.dialogs.choose(
            _("Idle mission of {robot}").format(robot=robot.name),
            options,
            partial(self._save_if_it_asks_nothing, robot),
            selected=robot.idle.mission_id if robot.idle is not None else None,
        )

    def _save_if_it_asks_nothing(self, robot: Robot, mission_id: int, **changes: Any) -> None:
        """An idle mission gets no values, so missions with parameters are refused. If the robot doesn't answer, another
        one's answer counts; of several choices the last one, even if answers are late."""
        mission, mission_names = self.context.facts.mission(mission_id), self.context.shell.mission_names
        guid = mission.guid if mission is not None else ""
        answers = mission is not None and self.context.facts.snapshot(robot.id).connection is Connection.CONNECTED

        def take(asked: Sequence[MissionParameter]) -> None:
            labels = missing(asked)
            if mission is not None and labels:
                self._refuse(
                    robot,
                    _("{mission} asks for {values}, which only a schedule or Run now can give").format(
                        mission=mission.name, values=", ".join(labels)
                    ),
                )
            else:
                self._save(robot, mission_id=mission_id, **changes)

        def known() -> Sequence[MissionParameter]:
            return mission_names.known.parameters.get(guid, ())

        def ask() -> Sequence[MissionParameter]:
            return self.context.services.robot_missions.parameters(robot.id, guid)

        self.context.run(
            ask if answers else known,
            take,
            lambda _problem: take(known()),
            key=("idle", robot.id),
            apart="parameters" if answers else "",
        )

    def _save(self, robot: Robot, **changes: Any) -> None:
        """Change this of the stored rule, as the one shown may be older. A new mission can be undone."""
        self._problems.pop(robot.id, None)
        catalogue, before = self.context.services.catalogue, robot.idle
        changed = replace(robot, idle=replace(before or IdleRule(0), **changes))
        self.context.change(
            lambda: catalogue.change_idle_rule(robot.id, **changes),
            lambda problem: self._show_problem(robot, sentence_of(problem)),
            undo=(
                _("{robot}: idle mission changed").format(robot=robot.name),
                lambda: catalogue.idle_rule_back(robot.id, before, changes),
            )
            if "mission_id" in changes
            else None,
            shown=lambda facts: facts.having("robots", changed),
        )

    def _refuse(self, robot: Robot, why: str) -> None:
        """Shown as a message too if the user has moved on."""
        self._show_problem(robot, why)
        if self.context.is_late:
            self.context.shell.snackbars.show(
                f"{robot.name}: {why}", icon="alert-circle-outline", seconds=PROBLEM_SECONDS
            )

    def _show_problem(self, robot: Robot, problem: str) -> None:
        self._problems[robot.id] = problem
        self.show()
