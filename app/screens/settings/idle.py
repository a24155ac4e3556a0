"""Settings, Idle automation: per robot a mission that starts when the robot has had nothing to do for some minutes."""
from __future__ import annotations

from datetime import datetime
from typing import Any

from kivy.event import EventDispatcher
from kivy.properties import BooleanProperty, ListProperty, NumericProperty, StringProperty

from app.domain.models import IdleRule, Robot
from app.i18n import _
from app.screens.common.problems import sentence_of
from app.screens.settings.facts import SettingsFacts
from app.screens.settings.missions_view import idle_panels, mission_options
from app.screens.settings.page import Desk, SettingsPage
from app.widgets.lists import RecycledRow
from app.widgets.surfaces import Surface


class IdlePanel(RecycledRow, Surface):
    """One robot's rule. Actions: "switch" (wanted), "mission", "minutes" (number)."""
    name = StringProperty()
    active = BooleanProperty(False)
    mission = StringProperty("–")
    minutes = NumericProperty(10)
    note = StringProperty()
    problem = StringProperty()


class IdleModel(EventDispatcher):
    panels = ListProperty()
    has_robots = BooleanProperty(True)


class IdlePage(SettingsPage):
    def __init__(self, desk: Desk, **kwargs: Any) -> None:
        self._problems: dict[int, str] = {}
        self._minutes: dict[int, int] = {}               # chosen before there is a mission, and so before there is a rule
        super().__init__(desk, IdleModel(), **kwargs)
        self._list, self._empty = self.ids.idle_list.__self__, self.ids.no_robots.__self__
        self.vm.bind(has_robots=self._arrange)
        self._arrange()

    def _arrange(self, *_args: Any) -> None:
        self.show_one(self._list if self.vm.has_robots else self._empty, (self._list, self._empty))

    def add_robot(self) -> None:
        self.desk.shell.go("settings", section="robots", add=True)

    def show(self, facts: SettingsFacts, now: datetime) -> None:
        self.vm.panels = [{**row, "minutes": self._minutes.get(row["key"], row["minutes"]), "problem": self._problems.get(row["key"], "")}
                          for row in idle_panels(facts)]
        self.vm.has_robots = bool(facts.robots)

    def reached(self, **intent: Any) -> None:
        self._problems.clear()

    # ------------------------------------------------------------------ what is changed
    def act(self, robot_id: int, action: str, *values: Any) -> None:
        robot = self.desk.facts.robot(robot_id)
        if robot is None:
            return
        if action == "mission":
            self._choose_mission(robot)
        elif action == "switch":
            self._switch(robot, values[0])
        elif robot.idle is None:
            self._minutes[robot.id] = values[0]
        else:
            self._save(robot, robot.idle.mission_id, values[0], robot.idle.enabled)

    def _switch(self, robot: Robot, wanted: bool) -> None:
        if robot.idle is not None:
            self._save(robot, robot.idle.mission_id, robot.idle.after_minutes, wanted)
        elif wanted:
            self._choose_mission(robot)                  # a rule without a mission can't be

    def _choose_mission(self, robot: Robot) -> None:
        options = mission_options(self.desk.facts, robot)
        if not options:
            self._tell(robot, _("There are no missions yet: add them under Missions"))
            return
        idle = robot.idle or IdleRule(0, self._minutes.get(robot.id, IdleRule(0).after_minutes))
        self.desk.shell.dialogs.choose(
            _("Idle mission of {robot}").format(robot=robot.name), options,
            lambda mission_id: self._save(robot, mission_id, idle.after_minutes, idle.enabled), selected=idle.mission_id or None)

    def _save(self, robot: Robot, mission_id: int, minutes: int, enabled: bool) -> None:
        self._problems.pop(robot.id, None)
        self._minutes.pop(robot.id, None)
        self.desk.work(
            lambda: self.desk.container.catalogue.save_idle_rule(robot.id, mission_id, after_minutes=minutes, enabled=enabled),
            lambda _saved: self.desk.refresh(), lambda problem: self._refused(robot, problem))

    def _refused(self, robot: Robot, problem: BaseException) -> None:
        self._tell(robot, sentence_of(problem))

    def _tell(self, robot: Robot, problem: str) -> None:
        self._problems[robot.id] = problem
        self.show(self.desk.facts, self.desk.now())
