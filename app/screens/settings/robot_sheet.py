"""The sheet that adds or edits a robot. It also asks if another machine answers, or one without its serial number; nothing
is sent before the user's answer. One that is reached through a fleet has its address and password from there.
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Mapping
from dataclasses import replace
from functools import partial
from typing import Any

from kivy.properties import BooleanProperty, ListProperty, StringProperty

from app.domain import names
from app.domain.models import Connection, Fleet, Group, InvalidInput, Robot
from app.domain.robot import Identity
from app.i18n import _
from app.mir.credentials import Token
from app.mir.errors import AnotherRobot, SerialNumberHidden
from app.screens.common.start_now import why_not
from app.screens.settings import removals, trust_view, view
from app.screens.settings.check_up import open_check_up
from app.screens.settings.connection_sheet import ConnectionSheet
from app.screens.settings.groups_view import hand_over_names
from app.screens.settings.page import PageContext
from app.screens.settings.view import NoticeView
from app.services.catalogue import group_edit, validation
from app.services.catalogue.edit import Edit, Removed
from app.widgets.items import Option


class RobotSheet(ConnectionSheet):
    """Its name, use and hand-over are saved at once, its connection once it has been tested. ``open_fleet(fleet)`` shows
    its fleet."""

    kind = "robots"
    at_once = ("name", "enabled", "hand_over")
    known_part = "RobotKnown"
    taken = "there is a robot {name} already"

    groups = StringProperty()
    has_groups = BooleanProperty(False)  # there are some
    idle = StringProperty()  # empty: it is never idle
    is_open = BooleanProperty(False)
    advanced_row = ListProperty()
    hand_overs = ListProperty()

    def __init__(
        self,
        context: PageContext,
        robot: Robot | None = None,
        open_fleet: Callable[[Fleet], object] = lambda _fleet: None,
    ) -> None:
        self.open_fleet = open_fleet
        self._agreed_address = ""  # it was agreed that only this address identifies it
        problems = {}
        if robot is not None and context.facts.snapshot(robot.id).connection is Connection.UNAUTHORIZED:
            problems["password"] = _("{robot} refuses this user or password").format(robot=robot.name)
        self.is_direct = robot is None or robot.fleet is None
        super().__init__(context, robot or Robot("", ""), problems=problems, hand_overs=list(hand_over_names().items()))

    @property
    def wanted(self) -> Mapping[str, str]:
        return {
            "name": _("Give the robot a name"),
            "username": _("Enter the robot's user name"),
            "asking": _("Asking the robot …"),
        }

    # ------------------------------------------------------------------ what is shown
    def show_facts(self) -> None:
        """What is known of the robot now."""
        super().show_facts()
        facts, robot = self.context.facts, self.stored
        if robot is not None:
            self.about = view.robot_note(facts, robot, self.context.now())
            self.groups = ", ".join(group.name for group in facts.groups if robot.id in group.members)
            self.has_groups = bool(facts.groups)
            self.idle = "" if robot.is_any else view.idle_phrase(facts, robot)
        self.advanced_row = [view.advanced_item(self.it.hand_over, is_open=self.is_open)]

    def turn_advanced(self) -> None:
        self.is_open = not self.is_open
        self.show_facts()

    # ------------------------------------------------------------------ menu
    def more(self) -> list[Option]:
        context, robot = self.context, self.stored
        check_up = Option(lambda: open_check_up(context, robot), _("Check up"), "clipboard-check-outline")
        fetch = partial(context.shell.go, "settings", section="missions", fetch_from=robot.id)
        off = why_not(robot, (), None)
        return [
            *([check_up] if robot.fleet is None else []),  # others are checked up with their fleet
            Option(fetch, _("Fetch missions"), "download-outline", off=off),
        ]

    def question(self) -> str:
        return removals.robot_question(self.context.facts, self.stored)

    def delete(self, it: Robot) -> Removed:
        return self.context.services.catalogue.remove_robot(it.id)

    # ------------------------------------------------------------------ groups, idle automation
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
                    group = edit.the(Group, group_id)
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

    # ------------------------------------------------------------------ test
    def enter(self, **values: Any) -> None:
        """A machine was accepted for the address where it answered."""
        if values.get("address", self.it.address) != self.it.address:
            values["serial_number"] = (self.stored or self._first).serial_number
        super().enter(**values)

    @property
    def _is_accepted(self) -> bool:
        """Another machine, as the new robot."""
        return self.stored is not None and self.it.serial_number != self.stored.serial_number

    def is_as_saved(self) -> bool:
        return super().is_as_saved() and not self._is_accepted

    def needs_decision(self) -> bool:
        return (
            self.stored is not None and not self._is_accepted and view.needs_decision(self.context.facts, self.stored)
        )

    def ask(self) -> Callable[[], Identity]:
        robot, password, operator = self.entered(), self.password or None, self.context.services.operator
        by_address = self._agreed_address == robot.address
        return lambda: operator.test_connection(robot, password, by_address=by_address)

    def found(self, said: Identity) -> NoticeView:
        """A robot without a name gets its own."""
        entered = self.entered()
        shown = view.connection_found(said, Token.derive(entered.username, self.password).is_published_default)
        if not entered.name and said.name:
            self.enter(name=names.cleaned(said.name))
            if said.name.endswith("…"):  # added by the client where it cuts
                cut = _("Name cut at {n} characters").format(n=names.LONGEST)
                shown = replace(shown, note="\n".join(filter(None, (shown.note, cut))))
        return shown

    def is_no_other(self, serial_number: str | None = None) -> bool:
        entered, stored = self.entered(), self.stored
        entered = replace(entered, serial_number=serial_number or entered.serial_number)
        if stored is not None and (entered.address, entered.serial_number) == (stored.address, stored.serial_number):
            return True
        try:
            validation.check_is_no_other(entered, self.context.facts.robots)
        except InvalidInput as problem:
            self.refuse(problem)
            return False
        return True

    # ------------------------------------------------------------------ another machine
    def ask_about(self, problem: BaseException) -> None:
        if isinstance(problem, AnotherRobot) and self.stored is not None:
            self._ask_about_robot(self.stored, problem)
        elif isinstance(problem, SerialNumberHidden) and self.stored is not None:
            self.ask_to_trust(trust_view.hidden_number(self.stored, problem), self._go_by_address)
        else:
            super().ask_about(problem)

    def _ask_about_robot(self, robot: Robot, problem: AnotherRobot) -> None:
        found = problem.params["found"]

        def accepted() -> None:
            self.enter(serial_number=found)
            self.test_again()

        if self.is_no_other(found):
            question = trust_view.another_robot(robot, problem, has_password=bool(self.password))
            self.ask_to_trust(question, accepted)
        else:
            self.outcome = NoticeView()

    def _go_by_address(self) -> None:
        self._agreed_address = self.entered().address
        self.try_it()

    # ------------------------------------------------------------------ save
    def how(self) -> dict[str, Any]:
        return {**super().how(), "is_tested": self.test_state == "passed"}

    def entered(self) -> Robot:
        entered: Robot = super().entered()
        found = self._found
        if self.test_state == "passed" and isinstance(found, Identity):
            entered = replace(
                entered,
                serial_number=found.serial_number or entered.serial_number,
                model=found.model,
                software=found.software,
                identified_by=found.identified_by,
            )
        return entered
