"""Settings, Robots: a row per robot, fleet or group, which opens its sheet, and the way to add one."""

from __future__ import annotations

from typing import Any

from kivy.event import EventDispatcher
from kivy.properties import BooleanProperty, ListProperty, OptionProperty, StringProperty
from kivy.uix.widget import Widget

from app.domain.models import Fleet, Robot
from app.i18n import _
from app.screens.settings.check_up import open_check_up, standing_of
from app.screens.settings.find import FindSheet
from app.screens.settings.fleet_sheet import FleetSheet
from app.screens.settings.fleets_view import ICON as FLEET_ICON
from app.screens.settings.fleets_view import fleet_items
from app.screens.settings.groups import GroupSheet
from app.screens.settings.groups_view import group_items
from app.screens.settings.page import SettingsPage
from app.screens.settings.robot_sheet import RobotSheet
from app.screens.settings.view import NOT_TRUSTED, robot_items
from app.widgets.items import Option


class RobotsModel(EventDispatcher):
    items = ListProperty()
    add_word = StringProperty()
    nothing = StringProperty()  # said while there is none
    part = OptionProperty("robots", options=("robots", "groups"))
    is_alone = BooleanProperty(True)  # no sheet is beside the page


class RobotsPage(SettingsPage):
    Model = RobotsModel

    @property
    def parts(self) -> list[tuple[str, str]]:
        """One robot alone has no groups."""
        facts = self.context.facts
        return [("robots", _("Robots")), ("groups", _("Groups"))] if len(facts.robots) > 1 or facts.groups else []

    def show(self) -> None:
        context, facts = self.context, self.context.facts
        self.vm.is_alone = context.shell.sheets.top is None
        if self.parts and self.vm.part == "groups":
            self.vm.items, self.vm.add_word = group_items(facts, context.opened("groups")), _("Add group")
            self.vm.nothing = _("No groups yet")
            return
        of_robots, of_fleets = (
            {each.id: standing_of(context, each) for each in targets} for targets in (facts.robots, facts.fleets)
        )
        self.vm.part, self.vm.add_word = "robots", _("Add")
        self.vm.nothing = _("No robots yet")
        self.vm.items = [
            *fleet_items(facts, of_fleets, context.opened("fleets")),
            *robot_items(facts, context.now(), of_robots, context.opened("robots")),
        ]

    def reached(self, **intent: Any) -> None:
        if intent:
            self.turn_to("groups" if intent.get("groups") else "robots")
        if intent.get("add"):
            self._open(None)
        elif intent.get("find"):
            self.find()
        elif fleet := self.context.facts.fleet(intent.get("fleet_id")):
            self._open_fleet(fleet)
        elif robot := self.context.facts.robot(intent.get("check_up")):
            open_check_up(self.context, robot)
        elif robot := self.context.facts.robot(intent.get("robot_id")):
            self._open(robot)

    # ------------------------------------------------------------------ what is pressed
    def open(self, key: Any) -> None:
        """A row was tapped."""
        facts = self.context.facts
        if self.vm.part == "groups":
            self.context.shell.sheets.show(GroupSheet(self.context, facts.group(key)))
        elif isinstance(key, tuple):
            self._open_fleet(facts.fleet(key[1]))
        else:
            self._open(facts.robot(key))
        self.show()

    def add(self, button: Widget) -> None:
        """Ask what: a robot, a fleet, or what answers in the network."""
        if self.vm.part == "groups":
            self.open(None)
            return
        items = [
            Option(lambda: self.open(None), _("Add robot"), "robot-outline"),
            Option(lambda: self.open(("fleet", None)), _("Add fleet"), FLEET_ICON),
            Option(self.find, _("Find robots"), "radar"),
        ]
        self.context.shell.dialogs.menu(button, "", items, lambda act: act())

    def find(self) -> None:
        def add(address: str, name: str) -> None:
            sheet = self._open(None)
            sheet.enter(address=address, name=name)

        self.context.shell.sheets.show(FindSheet(self.context, add))
        self.show()

    def _open(self, robot: Robot | None) -> RobotSheet:
        sheet = RobotSheet(self.context, robot, lambda fleet: self.open(("fleet", fleet.id)))
        self.context.shell.sheets.show(sheet)
        if robot is not None and sheet.is_direct and self.context.facts.snapshot(robot.id).connection in NOT_TRUSTED:
            sheet.test()  # shows what answers, and asks
        return sheet

    def _open_fleet(self, fleet: Fleet | None) -> None:
        self.context.shell.sheets.show(FleetSheet(self.context, fleet))
