"""Settings, Robots: a panel per robot with Test connection and Edit, and the way to add one."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any, ClassVar

from kivy.event import EventDispatcher
from kivy.properties import BooleanProperty, ListProperty, ObjectProperty, OptionProperty, StringProperty

from app.domain.models import Robot
from app.i18n import _
from app.screens.settings import removals
from app.screens.settings.check_up import CheckUp
from app.screens.settings.check_up_view import standing
from app.screens.settings.groups import GroupsPart
from app.screens.settings.groups_view import group_panels
from app.screens.settings.page import PageContext, SettingsPage
from app.screens.settings.robot_dialog import RobotDialog
from app.screens.settings.view import NoticeView, asking_robot, connection_found, failed_test, robot_panels
from app.widgets.display import SectionCard
from app.widgets.lists import RecycledRow
from app.widgets.surfaces import Surface, Toned
from app.widgets.text import Ico
from app.widgets.tokens import TONES


class RobotPanel(RecycledRow, Toned, SectionCard):
    """A robot's data sheet. Actions: "check up", "test", "edit"."""

    name = StringProperty()
    model = StringProperty()
    address = StringProperty()
    serial = StringProperty("–")
    identified_by = StringProperty("–")
    missions = StringProperty("–")
    missions_tone = OptionProperty("neutral", options=TONES)
    missions_icon = StringProperty()
    has_default_password = BooleanProperty(False)
    badge = StringProperty()
    badge_icon = StringProperty()
    testing = BooleanProperty(False)
    result = ObjectProperty(NoticeView(), rebind=True)
    check_up = ObjectProperty(NoticeView(), rebind=True)
    check_up_word = StringProperty()


class StandingIcon(Toned, Ico):
    """Of what a check-up came to."""


class AddPanel(RecycledRow, Surface):
    """The button that adds a robot, after the panels. Action: "add"."""

    first = BooleanProperty(False)


@dataclass(frozen=True)
class AddPanelView:
    """Values of AddPanel; ``first``: no robot exists yet."""

    first: bool
    key: str = "add"
    panelclass: ClassVar[str] = "AddPanel"


class RobotsModel(EventDispatcher):
    panels = ListProperty()
    part = OptionProperty("robots", options=("robots", "groups"))


class RobotsPage(SettingsPage):
    Model = RobotsModel

    def __init__(self, context: PageContext) -> None:
        super().__init__(context)
        self._results: dict[int, tuple[Robot, NoticeView]] = {}  # of tests on this visit, with what was tested
        self._asked: set[int] = set()
        self._groups = GroupsPart(context)
        self._check_ups: dict[int, CheckUp] = {}  # by robot id

    @property
    def parts(self) -> list[tuple[str, str]]:
        """One robot alone has no groups."""
        facts = self.context.facts
        return [("robots", _("Robots")), ("groups", _("Groups"))] if len(facts.robots) > 1 or facts.groups else []

    def show(self) -> None:
        facts = self.context.facts
        self._groups.show()
        if self.parts and self.vm.part == "groups":
            self.vm.panels = group_panels(facts)
            return
        self.vm.part = "robots"
        panels = [
            replace(
                panel,
                testing=panel.key in self._asked,
                result=self._result(facts.robot(panel.key)),
                **self._check_up(panel.key),
            )
            for panel in robot_panels(facts, self.context.now())
        ]
        self.vm.panels = [*panels, AddPanelView(first=not panels)]

    @property
    def is_busy(self) -> bool:
        return bool(self._asked) or any(check_up.is_running for check_up in self._check_ups.values())

    def reached(self, **intent: Any) -> None:
        self._results.clear()
        if intent:
            self.turn_to("groups" if intent.get("groups") else "robots")
        if intent.get("add"):
            self._open(None)
        elif robot := self.context.facts.robot(intent.get("robot_id")):
            self._open(robot)

    # ------------------------------------------------------------------ what is pressed
    def act(self, key: Any, action: str) -> None:
        if self.vm.part == "groups":
            self._groups.act(key, action)
            return
        robot = self.context.facts.robot(key)
        if action == "test" and robot is not None:
            self._test(robot)
        elif action == "check up" and robot is not None:
            self._open_check_up(robot)
        elif action == "add" or robot is not None:
            self._open(robot)

    def _test(self, robot: Robot) -> None:
        if robot.id in self._asked:
            return
        self._asked.add(robot.id)
        self._show_result(robot, asking_robot())
        self.context.run(
            lambda: self.context.services.operator.test_connection(robot),
            lambda identity: self._answered(robot, connection_found(identity)),
            lambda problem: self._answered(robot, failed_test(problem)),
        )

    def _answered(self, robot: Robot, notice: NoticeView) -> None:
        self._asked.discard(robot.id)
        self._show_result(robot, notice)

    def _show_result(self, robot: Robot, notice: NoticeView) -> None:
        self._results[robot.id] = robot, notice
        self.show()

    def _result(self, robot: Robot | None) -> NoticeView:
        """That of the last test, while the connection is the one that was tested."""
        if robot is None or robot.id not in self._results:
            return NoticeView()
        tested, notice = self._results[robot.id]
        return notice if _connection(robot) == _connection(tested) else NoticeView()

    # ------------------------------------------------------------------ check-ups
    def _check_up(self, robot_id: int) -> dict[str, Any]:
        """The robot's state; during a check-up, its progress."""
        facts, running = self.context.facts, self._check_ups.get(robot_id)
        robot, report = facts.robot(robot_id), facts.reports.get(robot_id)
        if robot is None:
            return {}
        stands = (running and running.standing) or standing(
            robot, report, self.context.now(), facts.settings.timezone, is_left=robot.id in facts.left_behind
        )
        return {
            "check_up": stands,
            "check_up_word": _("Check-up") if report or (running and running.is_running) else _("Check up"),
        }

    def _open_check_up(self, robot: Robot) -> None:
        """That which runs, else a new one."""
        check_up = self._check_ups.get(robot.id)
        if check_up is None or not check_up.is_running:
            check_up = self._check_ups[robot.id] = CheckUp(self.context, robot, self.show)
        check_up.open(self.context.facts.reports.get(robot.id))

    # ------------------------------------------------------------------ adding, editing, deleting
    def _open(self, robot: Robot | None) -> None:
        dialog = RobotDialog(self.context, robot)
        dialog.bind(on_remove=lambda _dialog, robot: self._remove(robot))
        self.context.shell.dialogs.open(dialog)

    def _remove(self, robot: Robot) -> None:
        """Ask first: more than the robot goes. Undo brings it all back."""
        self.context.shell.dialogs.confirm(
            _("Delete {robot}?").format(robot=robot.name),
            removals.robot_question(self.context.facts, robot),
            _("Delete robot"),
            lambda: self.context.remove(
                lambda: self.context.services.catalogue.remove_robot(robot.id),
                removals.robot_sentence(self.context.facts, robot),
            ),
            danger=True,
        )


def _connection(robot: Robot) -> tuple[str | None, ...]:
    """What a test of it depends on."""
    return robot.address, robot.username, robot.token, robot.certificate_sha256
