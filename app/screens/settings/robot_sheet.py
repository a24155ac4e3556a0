"""The sheet that adds or edits a robot that is reached directly. It also asks if another machine answers, or one without
its serial number; nothing is sent before the user's answer.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import replace
from typing import Any

from app.domain import names
from app.domain.models import Connection, HandOver, InvalidInput, Robot
from app.domain.robot import Identity
from app.i18n import _
from app.mir.credentials import Token
from app.mir.errors import AnotherRobot, SerialNumberHidden
from app.screens.settings import trust_view
from app.screens.settings.connection_sheet import ConnectionSheet
from app.screens.settings.page import PageContext
from app.screens.settings.robot_known import KnownRobotSheet, robot_form
from app.screens.settings.view import NoticeView, asking_robot, connection_found, needs_decision
from app.services.catalogue import validation


class RobotSheet(KnownRobotSheet, ConnectionSheet):
    """Its connection is saved once it has been tested. ``open_check_up(robot)`` shows how its check-up stands."""

    taken = "there is a robot {name} already"

    def __init__(
        self,
        context: PageContext,
        robot: Robot | None = None,
        open_check_up: Callable[[Robot], object] = lambda _robot: None,
        **kwargs: Any,
    ) -> None:
        self.open_check_up = open_check_up
        self._new_serial: str | None = None  # of the machine that was accepted as the new robot
        self._by_address = False  # it was agreed that only the address identifies it
        form = robot_form(robot)
        if robot is not None and context.facts.snapshot(robot.id).connection is Connection.UNAUTHORIZED:
            form.password_problem = _("{robot} refuses this user or password").format(robot=robot.name)
        super().__init__(context, robot, form, known_part="RobotKnown", **kwargs)

    @property
    def wanted(self) -> Mapping[str, str]:
        return {
            "name": _("Give the robot a name"),
            "username": _("Enter the robot's user name"),
            "asking": asking_robot().text,
        }

    def _edited(self, name: str, *args: Any) -> None:
        if name == "address":
            self._new_serial, self._by_address = None, False
        super()._edited(name, *args)

    def is_as_saved(self) -> bool:
        return super().is_as_saved() and not self._new_serial

    def needs_decision(self) -> bool:
        return self.stored is not None and not self._new_serial and needs_decision(self.context.facts, self.stored)

    # ------------------------------------------------------------------ test
    def ask(self) -> Callable[[], Identity]:
        robot, password, by_address = self.entered(), self.vm.password or None, self._by_address
        operator = self.context.services.operator
        return lambda: operator.test_connection(robot, password, by_address=by_address)

    def found(self, said: Identity) -> NoticeView:
        """A robot without a name gets its own."""
        form = self.vm
        shown = connection_found(said, Token.derive(form.username.strip(), form.password).is_published_default)
        if not form.name.strip() and said.name:
            form.name = names.cleaned(said.name)
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
    def refused(self, problem: BaseException, then: Callable[[], object]) -> None:
        if isinstance(problem, AnotherRobot) and self.stored is not None:
            self._ask_about_robot(self.stored, problem, then)
        elif isinstance(problem, SerialNumberHidden) and self.stored is not None:
            self._ask_about_address(self.stored, problem, then)

    def _ask_about_robot(self, robot: Robot, problem: AnotherRobot, then: Callable[[], object]) -> None:
        def accepted() -> None:
            self._new_serial = problem.params["found"]
            self.test_again(then)

        if not self.is_no_other(problem.params["found"]):
            self.outcome = NoticeView()
            return
        question = trust_view.another_robot(robot, problem, has_password=bool(self.vm.password))
        self.ask_to_trust(question, accepted)

    def _ask_about_address(self, robot: Robot, problem: SerialNumberHidden, then: Callable[[], object]) -> None:
        def accepted() -> None:
            self._by_address = True
            self.try_it(then)

        self.ask_to_trust(trust_view.hidden_number(robot, problem), accepted)

    # ------------------------------------------------------------------ save
    def how(self) -> dict[str, Any]:
        return {**super().how(), "is_tested": self.has_answered()}

    def entered(self) -> Robot:
        robot = self.stored or Robot("", "")
        entered = replace(
            robot,
            **self.entered_connection(robot),
            serial_number=self._new_serial or robot.serial_number,
            hand_over=HandOver(self.vm.hand_over),
        )
        found = self._found
        if isinstance(found, Identity) and self.has_answered():
            entered = replace(
                entered,
                serial_number=found.serial_number or entered.serial_number,
                model=found.model,
                software=found.software,
                identified_by=found.identified_by,
            )
        return entered
