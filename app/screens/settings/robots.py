"""Settings, Robots: a panel per robot with Test connection and Edit, and the way to add one."""
from __future__ import annotations

from datetime import datetime
from typing import Any

from kivy.event import EventDispatcher
from kivy.properties import BooleanProperty, ListProperty, OptionProperty, StringProperty

from app.domain.models import Robot
from app.screens.settings.facts import SettingsFacts
from app.screens.settings.missions_view import robot_removal_sentence
from app.screens.settings.page import Desk, SettingsPage
from app.screens.settings.robot_dialog import RobotDialog
from app.screens.settings.view import NoticeView, asking_robot, connection_found, robot_panels, went_wrong
from app.widgets.lists import RecycledRow
from app.widgets.surfaces import Surface, TonedSurface
from app.widgets.tokens import TONES


class RobotPanel(RecycledRow, TonedSurface):
    """A robot's data sheet. Actions: "test", "edit"."""
    name = StringProperty()
    model = StringProperty()
    address = StringProperty()
    software = StringProperty("–")
    serial = StringProperty("–")
    missions = StringProperty("–")
    missions_tone = OptionProperty("neutral", options=TONES)
    missions_icon = StringProperty()
    badge = StringProperty()
    badge_icon = StringProperty()
    testing = BooleanProperty(False)
    result = StringProperty()
    result_note = StringProperty()
    result_tone = OptionProperty("neutral", options=TONES)
    result_icon = StringProperty()


class AddPanel(RecycledRow, Surface):
    """The place of the next robot. Action: "add"."""
    first = BooleanProperty(False)


class RobotsModel(EventDispatcher):
    panels = ListProperty()


class RobotsPage(SettingsPage):
    def __init__(self, desk: Desk, **kwargs: Any) -> None:
        self._results: dict[int, NoticeView] = {}        # of tests on this visit
        self._asked: set[int] = set()
        super().__init__(desk, RobotsModel(), **kwargs)

    def show(self, facts: SettingsFacts, now: datetime) -> None:
        self.vm.panels = [*({**row, **self._result(row["key"])} for row in robot_panels(facts, now)),
                          {"key": "add", "panelclass": "AddPanel", "first": not facts.robots}]

    def reached(self, **intent: Any) -> None:
        self._results.clear()
        if intent.get("add"):
            self.add()
        elif robot := self.desk.facts.robot(intent.get("robot_id")):
            self.edit(robot)

    def _result(self, robot_id: int) -> dict[str, Any]:
        notice = self._results.get(robot_id) or NoticeView()
        return {"testing": robot_id in self._asked, "result": notice.text, "result_note": notice.note, "result_tone": notice.tone,
                "result_icon": notice.icon}

    # ------------------------------------------------------------------ what is pressed
    def act(self, key: Any, action: str) -> None:
        robot = self.desk.facts.robot(key)
        if action == "add":
            self.add()
        elif robot is not None:
            {"test": self.test, "edit": self.edit}[action](robot)

    def add(self) -> None:
        self._open(None)

    def edit(self, robot: Robot) -> None:
        self._open(robot)

    def test(self, robot: Robot) -> None:
        if robot.id in self._asked:
            return
        self._asked.add(robot.id)
        self._tell(robot, asking_robot())
        self.desk.work(
            lambda: self.desk.container.operator.test_connection(robot.address, robot.username, None, robot_id=robot.id,
                                                                 certificate_sha256=robot.certificate_sha256),
            lambda identity: self._answered(robot, connection_found(identity, robot)),
            lambda problem: self._answered(robot, went_wrong(problem)))

    # ------------------------------------------------------------------ inside
    def _answered(self, robot: Robot, notice: NoticeView) -> None:
        self._asked.discard(robot.id)
        self._tell(robot, notice)

    def _tell(self, robot: Robot, notice: NoticeView) -> None:
        self._results[robot.id] = notice
        self.show(self.desk.facts, self.desk.now())

    def _open(self, robot: Robot | None) -> None:
        dialog = RobotDialog(self.desk, robot)
        dialog.bind(on_remove=lambda _dialog, robot: self.remove(robot))
        self.desk.shell.dialogs.open(dialog)

    def remove(self, robot: Robot) -> None:
        """At once; its schedules go with it and come back with Undo."""
        catalogue, text = self.desk.container.catalogue, robot_removal_sentence(self.desk.facts, robot)

        def removed(what: Any) -> None:
            self.desk.refresh()
            self.desk.offer_undo(text, lambda: self.desk.work(lambda: catalogue.restore(what), lambda _none: self.desk.refresh()))
        self.desk.work(lambda: catalogue.remove_robot(robot.id), removed)
