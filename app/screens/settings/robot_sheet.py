"""The sheet that adds or edits a robot. It tests the connection before it saves, and never shows a saved password.

It asks if another machine answers, or one without its serial number or with an unknown certificate; nothing is sent
before the user's answer.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Any

from kivy.clock import Clock

from app.domain import names
from app.domain.models import Connection, HandOver, InvalidInput, Robot
from app.domain.robot import Identity
from app.i18n import _
from app.mir.credentials import Token
from app.mir.errors import AnotherRobot, SerialNumberHidden, Unauthorized
from app.screens.common import formats
from app.screens.common.problems import sentence_of
from app.screens.settings import trust_view
from app.screens.settings.groups_view import hand_over_names
from app.screens.settings.page import PageContext
from app.screens.settings.robot_known import KnownRobotSheet, RobotForm, endpoint_of
from app.screens.settings.trust import TrustSheet
from app.screens.settings.view import (
    NoticeView,
    asking_robot,
    connection_found,
    has_unknown_certificate,
    needs_decision,
    nothing_sent,
    went_wrong,
)
from app.services.catalogue import validation

FIELDS = ("name", "address", "username", "password", "fingerprint")


class RobotSheet(KnownRobotSheet):
    """Its connection is saved once it has been tested. ``open_check_up(robot)`` shows how its check-up stands."""

    def __init__(
        self,
        context: PageContext,
        robot: Robot | None = None,
        open_check_up: Callable[[Robot], object] = lambda _robot: None,
        **kwargs: Any,
    ) -> None:
        self.open_check_up = open_check_up
        self._tested: tuple[str, ...] | None = None  # the connection whose test is over, passed or failed
        self._found: Identity | None = None
        self._new_serial: str | None = None  # of the machine that was accepted as the new robot
        self._by_address = False  # it was agreed that only the address identifies it
        self._may_be_open = robot is None or not robot.address.startswith("https:")
        form = RobotForm(hand_overs=[(str(key), word) for key, word in hand_over_names().items()])
        if robot is not None:
            form.name, form.enabled, form.hand_over = robot.name, robot.enabled or robot.needs_password, robot.hand_over
            form.address, form.username, form.fingerprint = endpoint_of(robot)
            form.password_hint = self._password_hint(robot, True)
        super().__init__(context, robot, form, **kwargs)
        if robot is not None and context.facts.snapshot(robot.id).connection is Connection.UNAUTHORIZED:
            form.password_problem = _("{robot} refuses this user or password").format(robot=robot.name)
        form.fbind("outcome", self._reveal, "outcome")
        form.fbind("outcome", self._name_buttons)
        for name in FIELDS:
            form.fbind(name, self._edited, name)
            form.fbind(
                f"{name}_problem", self._reveal, "fingerprint_slot" if name == "fingerprint" else f"{name}_field"
            )
        self._entered_first = form.name, *form.connection
        for name in FIELDS:
            form.fbind(name, lambda *_args: setattr(self, "draft", self._would_be_lost()))
        self.show_facts()

    def _would_be_lost(self) -> bool:
        """When the sheet closes."""
        form, stored = self.vm, self.stored
        if stored is None:
            return (form.name, *form.connection) != self._entered_first
        return bool(form.password) or form.endpoint != endpoint_of(stored)

    def show_facts(self) -> None:
        """What is known of the robot now."""
        super().show_facts()
        self._name_buttons()

    def _reveal(self, what: str, _form: RobotForm, said: str | NoticeView) -> None:
        """In a low window, bring the last message in sight."""
        if said if isinstance(said, str) else said.text:
            Clock.schedule_once(lambda _dt: self.ids.page.scroll_to(self.ids[what]), 0)

    def _name_buttons(self, *_args: Any) -> None:
        """What was refused is tested again first; a failed test can be passed over."""
        self._tests_first, test = True, _("Test connection")
        if self._tested is not None and self._found is None:
            self.foot, self.second = test, _("Save anyway")
        elif self._tested is None and self._needs_decision():
            self.foot, self.second = test, ""
        else:
            self._tests_first, self.foot, self.second = False, _("Save"), test

    def _edited(self, name: str, *_args: Any) -> None:
        """A field being corrected is no longer red, and an earlier test doesn't apply to new values."""
        setattr(self.vm, f"{name}_problem", "")
        if name == "name":
            return
        self.vm.username_problem = self.vm.password_problem = ""  # they are about the connection as a whole
        if self.stored is not None:
            self.vm.password_hint = self._password_hint(self.stored, self._is_as_saved())
        if self._tested is not None:
            self._tested, self._found = None, None
            self.vm.outcome = NoticeView()
        if name == "address":
            self.vm.fingerprint_problem, self._new_serial, self._by_address = "", None, False
        self._name_buttons()

    @staticmethod
    def _password_hint(robot: Robot, is_as_saved: bool) -> str:
        if robot.needs_password:
            return _("needed to switch it on")
        return _("unchanged") if is_as_saved else _("needed for this change")

    # ------------------------------------------------------------------ what is pressed
    def test(self) -> None:
        """Test the connection, without saving."""
        if not self.vm.testing and self._is_no_other() and self._has_password():
            self._if_it_may_be_open(lambda: self._ask(lambda: None))

    def on_done(self) -> None:
        """The button at the foot."""
        (self.test if self._tests_first else self.save)()

    def on_other(self) -> None:
        """The button next to it."""
        (self.save if self._tests_first else self.test)()

    def save(self) -> None:
        """Save a connection that has been tested; test it first if it has not. After a failed test the next press saves
        anyway."""
        form = self.vm
        if form.saving or form.testing:
            return
        if not form.name.strip():
            form.name_problem = _("Give the robot a name")
        elif self._is_taken(form.name.strip()):
            self.refuse(InvalidInput("name", "there is a robot {name} already", name=form.name.strip()))
        elif not self._is_no_other():
            return
        elif (
            not form.enabled
            or form.connection == self._tested
            or (self._is_as_saved() and not form.password and not self._new_serial and not self._needs_decision())
        ):
            self._if_it_may_be_open(super().save)
        elif self._has_password():
            then = super().save
            self._if_it_may_be_open(lambda: self._ask(then))

    def _is_as_saved(self) -> bool:
        """A stored password is for what is entered."""
        stored = self.stored
        return stored is not None and not stored.needs_password and self.vm.endpoint == endpoint_of(stored)

    def _is_taken(self, name: str) -> bool:
        return any(
            robot.name == name and (self.stored is None or robot.id != self.stored.id)
            for robot in self.context.facts.robots
        )

    def _needs_decision(self) -> bool:
        """Whether the answering machine is refused until a person has decided."""
        return self.stored is not None and not self._new_serial and needs_decision(self.context.facts, self.stored)

    def _if_it_may_be_open(self, then: Callable[[], object]) -> None:
        """A robot that was reached over https does not become an unencrypted one without a word."""
        if self._may_be_open or self.vm.is_https:
            then()
            return

        def agreed() -> None:
            self._may_be_open = True
            then()

        self._ask_to_trust(trust_view.no_encryption(), agreed)

    def _ask_to_trust(self, question: trust_view.Question, agreed: Callable[[], object]) -> None:
        sheets = self.context.shell.sheets
        self.vm.outcome = nothing_sent()
        sheets.over(TrustSheet(sheets, question, agreed))

    # ------------------------------------------------------------------ test
    def _has_password(self) -> bool:
        """A stored password belongs to the stored user. Without one only a robot that is switched off can be saved."""
        form, stored = self.vm, self.stored
        form.username_problem = form.password_problem = ""  # of an earlier press
        is_known = stored is not None and not stored.needs_password and stored.username == form.username.strip()
        if not form.username.strip():
            form.username_problem = _("Enter the robot's user name")
        elif not form.password and not is_known:
            form.password_problem = _("Enter the password of {user}").format(user=form.username.strip())
        return not (form.username_problem or form.password_problem)

    def _ask(self, then: Callable[[], object]) -> None:
        form, robot, password, by_address = self.vm, self.entered(), self.vm.password or None, self._by_address
        asked = form.connection
        form.testing, self._tested = True, None
        form.outcome = asking_robot()
        self.context.run(
            lambda: self.context.services.operator.test_connection(robot, password, by_address=by_address),
            lambda identity: self._answered(asked, lambda: self._passed(asked, identity, then)),
            lambda problem: self._answered(asked, lambda: self._failed(asked, problem, then)),
        )

    def _answered(self, asked: tuple[str, ...], then: Callable[[], object]) -> None:
        """About values that have changed since it says nothing."""
        form = self.vm
        form.testing, form.outcome = False, NoticeView()
        if asked == form.connection:
            self._if_open(then)

    def _if_open(self, then: Callable[[], object]) -> None:
        """If the sheet was closed before the robot's answer, nothing is saved and nothing is asked."""
        if self.parent is not None:
            then()

    def _passed(self, asked: tuple[str, ...], identity: Identity, then: Callable[[], object]) -> None:
        form = self.vm
        self._tested, self._found = asked, identity
        form.outcome = connection_found(
            identity, Token.derive(form.username.strip(), form.password).is_published_default
        )
        if not form.name.strip() and identity.name:
            form.name = names.cleaned(identity.name)
            if identity.name.endswith("…"):  # added by the client where it cuts
                cut = _("Name cut at {n} characters").format(n=names.LONGEST)
                form.outcome = replace(form.outcome, note="\n".join(filter(None, (form.outcome.note, cut))))
        if self._is_no_other():
            then()
        else:
            form.outcome = NoticeView()

    def _is_no_other(self, serial_number: str | None = None) -> bool:
        """Say at the address when another robot is this machine, or when it can't be an address."""
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

    def _failed(self, asked: tuple[str, ...], problem: BaseException, then: Callable[[], object]) -> None:
        """``then`` follows if a person trusts what answers."""
        form = self.vm
        if isinstance(problem, InvalidInput):
            self.refuse(problem)
        elif isinstance(problem, Unauthorized):
            self._tested, self._found = asked, None
            form.password_problem = sentence_of(problem)
            self._name_buttons()
        else:
            self._tested, self._found = asked, None
            form.outcome = went_wrong(problem)
            if isinstance(problem, AnotherRobot) and self.stored is not None:
                self._ask_about_robot(self.stored, problem, then)
            elif isinstance(problem, SerialNumberHidden) and self.stored is not None:
                self._ask_about_address(self.stored, problem, then)
            elif has_unknown_certificate(problem):
                self._ask_about_certificate(asked, then)

    # ------------------------------------------------------------------ another machine, another certificate
    def _ask_about_robot(self, robot: Robot, problem: AnotherRobot, then: Callable[[], object]) -> None:
        def accepted() -> None:
            self._new_serial = problem.params["found"]
            self._test_again(then)

        if not self._is_no_other(problem.params["found"]):
            self.vm.outcome = NoticeView()
            return
        question = trust_view.another_robot(robot, problem, has_password=bool(self.vm.password))
        self._ask_to_trust(question, accepted)

    def _ask_about_address(self, robot: Robot, problem: SerialNumberHidden, then: Callable[[], object]) -> None:
        def accepted() -> None:
            self._by_address = True
            self._ask(then)

        self._ask_to_trust(trust_view.hidden_number(robot, problem), accepted)

    def _ask_about_certificate(self, asked: tuple[str, ...], then: Callable[[], object]) -> None:
        """Show the fingerprint of what answers, for a person to compare."""

        def shown(found: str) -> None:
            if asked == self.vm.connection:
                name = self.vm.name.strip() or asked[0].strip()
                self._ask_to_trust(trust_view.certificate(name, found, asked[3].strip()), lambda: accepted(found))

        def accepted(found: str) -> None:
            self.vm.fingerprint = found
            self._test_again(then)

        self.context.run(
            lambda: self.context.services.operator.presented_fingerprint(asked[0].strip()),
            lambda found: self._if_open(lambda: shown(found)),
            self.refuse,
        )

    def _test_again(self, then: Callable[[], object]) -> None:
        """With the password entered for the accepted machine; the stored one belongs to the previous one."""
        form = self.vm
        self._tested, form.outcome = None, NoticeView()
        if self.stored is not None and not form.password:
            form.password_problem = _("Enter the password of {user}").format(user=form.username.strip())
        else:
            self._ask(then)

    # ------------------------------------------------------------------ save
    def how(self) -> dict[str, Any]:
        return {"password": self.vm.password or None, "is_tested": self._has_answered()}

    def _has_answered(self) -> bool:
        """Whether the connection as it is entered was tested with success."""
        return self._found is not None and self._tested == self.vm.connection

    def entered(self) -> Robot:
        form = self.vm
        robot = self.stored or Robot("", "")
        pin = form.fingerprint.strip() or None if form.is_https else robot.certificate_sha256
        address = form.address.strip()
        entered = replace(
            robot,
            name=form.name.strip(),
            address=robot.address if address == formats.address(robot.address) else address,
            username=form.username.strip(),
            enabled=form.enabled,
            certificate_sha256=pin,
            serial_number=self._new_serial or robot.serial_number,
            hand_over=HandOver(form.hand_over),
        )
        found = self._found
        if found is not None and self._has_answered():
            entered = replace(
                entered,
                serial_number=found.serial_number or entered.serial_number,
                model=found.model,
                software=found.software,
                identified_by=found.identified_by,
            )
        return entered

    def refuse(self, problem: BaseException) -> None:
        """The services have another name for the fingerprint."""
        if isinstance(problem, InvalidInput) and problem.field == "certificate_sha256":
            self.vm.saving, self.vm.fingerprint_problem = False, sentence_of(problem)
        else:
            super().refuse(problem)
