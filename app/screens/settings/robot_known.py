"""The sheet of a robot, the part that is saved at once: its name, use, groups and hand-over; and its menu."""

from __future__ import annotations

from collections.abc import Callable, Collection
from dataclasses import replace
from typing import Any

from kivy.properties import BooleanProperty, ListProperty, StringProperty
from kivy.uix.widget import Widget

from app.domain.models import Fleet, HandOver, Robot
from app.i18n import _
from app.screens.settings import removals
from app.screens.settings.connection_form import ConnectionForm, FieldsSheet
from app.screens.settings.edit_sheet import ask_and_delete
from app.screens.settings.groups_view import hand_over_names
from app.screens.settings.page import PageContext
from app.screens.settings.view import advanced_item, idle_phrase, robot_note
from app.services.catalogue import group_edit
from app.services.catalogue.edit import Edit
from app.widgets.items import Option

AT_ONCE = ("name", "enabled", "hand_over")


class RobotForm(ConnectionForm):
    hand_over = StringProperty(HandOver.AT_ONCE)
    hand_overs = ListProperty()
    groups = StringProperty()
    has_groups = BooleanProperty(False)  # there are some
    idle = StringProperty()
    can_be_idle = BooleanProperty(True)
    advanced_row = ListProperty()
    fleet = StringProperty()  # that it is reached through


def robot_form(robot: Robot | None) -> RobotForm:
    form = RobotForm(hand_overs=[(str(key), word) for key, word in hand_over_names().items()])
    if robot is not None:
        form.hand_over = robot.hand_over
    return form


class KnownRobotSheet(FieldsSheet):
    """Also adds a robot, which has none of this yet."""

    kind = "robots"

    open_check_up: Callable[[Robot], object] = staticmethod(lambda _robot: None)

    def show_facts(self) -> None:
        """What is known of the robot now."""
        facts, form = self.context.facts, self.vm
        robot = facts.robot(self.stored_id)
        if robot is not None and not self.saving:
            form.follow(self.stored, robot, AT_ONCE)
            self.stored = robot
            form.about = robot_note(facts, robot, self.context.now())
            form.groups = ", ".join(group.name for group in facts.groups if robot.id in group.members)
            form.has_groups = bool(facts.groups)
            form.idle, form.can_be_idle = idle_phrase(facts, robot), not robot.is_any
        form.advanced_row = [advanced_item(HandOver(form.hand_over), is_open=form.advanced)]
        super().show_facts()

    def turn_advanced(self) -> None:
        self.vm.advanced = not self.vm.advanced
        self.show_facts()

    def on_dots(self, button: Widget) -> None:
        robot, go = self.stored, self.context.shell.go
        check_up = Option("check up", _("Check up"), "clipboard-check-outline")
        items = [
            *([check_up] if robot.fleet is None else []),  # others are checked up with their fleet
            Option("fetch", _("Fetch missions"), "download-outline", disabled=not robot.enabled),
            Option("delete", _("Delete"), "delete-outline", tone="fault"),
        ]
        acts: dict[str, Callable[[], object]] = {
            "check up": lambda: self.open_check_up(robot),
            "fetch": lambda: go("settings", section="missions", fetch_from=robot.id),
            "delete": self.remove,
        }
        self.context.shell.dialogs.menu(button, "", items, lambda key: acts[key]())

    def remove(self) -> None:
        context, robot = self.context, self.stored
        ask_and_delete(
            context,
            robot,
            lambda: context.services.catalogue.remove_robot(robot.id),
            removals.robot_question(context.facts, robot),
        )

    def refuse(self, problem: BaseException) -> None:
        """Show as it is what was not saved; a refused name stays, to be corrected."""
        super().refuse(problem)
        if self.stored is not None:
            self.vm.enabled = self.stored.enabled or self.stored.needs_password
            self.vm.hand_over = self.stored.hand_over

    def settled(self) -> Robot:
        form = self.vm
        enabled = form.enabled if not self.stored.needs_password else self.stored.enabled
        robot: Robot = self.stored
        return replace(robot, name=form.name.strip(), enabled=enabled, hand_over=HandOver(form.hand_over))

    def pick_groups(self) -> None:
        groups, robot_id = self.context.facts.groups, self.stored.id
        self.context.shell.dialogs.choose_many(
            _("Groups"),
            [Option(group.id, group.name, "account-group-outline") for group in groups],
            _("Set"),
            self._join,
            selected=[group.id for group in groups if robot_id in group.members],
        )

    def _join(self, chosen: Collection[int]) -> None:
        """Be a member of these groups only."""
        context, robot = self.context, self.stored
        before = {group.id for group in context.facts.groups if robot.id in group.members}
        turned = before ^ set(chosen)

        def save(joined: Collection[int]) -> None:
            def work(edit: Edit) -> None:
                for group_id in turned:
                    group = edit.the_group(group_id)
                    members = {*group.members, robot.id} if group_id in joined else {*group.members} - {robot.id}
                    group_edit.save(edit, replace(group, members=tuple(members)))

            context.services.catalogue.edit(work)

        def saved(_none: object) -> None:
            context.refresh()
            text = _("{name} saved").format(name=robot.name)
            context.shell.offer_undo(text, lambda: save(before), context.refresh, behind="settings", about=self)

        if turned:
            context.run(lambda: save(chosen), saved)

    def go_idle(self) -> None:
        self.context.shell.go("settings", section="idle", robot_id=self.stored.id)


class VehicleSheet(KnownRobotSheet):
    """Of a robot that is reached through a fleet, which has its address and password: all of it is saved at once.
    ``open_fleet(fleet)`` shows the fleet."""

    at_once = True

    def __init__(
        self, context: PageContext, robot: Robot, open_fleet: Callable[[Fleet], object], **kwargs: Any
    ) -> None:
        self._open_fleet = open_fleet
        form = robot_form(robot)
        form.name, form.enabled = robot.name, robot.enabled or robot.needs_password
        super().__init__(context, robot, vm=form, **kwargs)
        form.fbind("name", lambda *_args: setattr(form, "name_problem", ""))
        self.show_facts()

    def show_facts(self) -> None:
        super().show_facts()
        if self.stored.fleet is not None:
            self.vm.fleet = self.stored.fleet.name

    def open_fleet(self) -> None:
        self._open_fleet(self.stored.fleet)
