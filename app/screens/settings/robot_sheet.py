"""The sheet that adds or edits a robot. It tests the connection before it saves, and never shows a saved password.

It asks if another machine answers, or one without its serial number or with an unknown certificate; nothing is sent
before the user's answer.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Any

from kivy.clock import Clock
from kivy.event import EventDispatcher
from kivy.properties import AliasProperty, BooleanProperty, ListProperty, ObjectProperty, StringProperty
from kivy.uix.widget import Widget

from app.domain import names
from app.domain.models import Connection, HandOver, InvalidInput, Robot
from app.domain.robot import Identity
from app.i18n import _
from app.mir.credentials import Token
from app.mir.errors import AnotherRobot, SerialNumberHidden
from app.screens.common.options import MenuItem
from app.screens.common.problems import sentence_of
from app.screens.settings.page import PageContext
from app.screens.settings.view import (
    NoticeView,
    asking_robot,
    certificate_question,
    connection_found,
    has_unknown_certificate,
    hidden_number_question,
    new_robot_question,
    plain_address,
    robot_note,
    went_wrong,
)
from app.services.catalogue import validation
from app.widgets.items import Item
from app.widgets.sheet import Sheet

FIELDS = ("name", "address", "username", "password", "fingerprint")
NEED_DECISION = (Connection.WRONG_ROBOT, Connection.OTHER_CERTIFICATE, Connection.UNTRUSTED, Connection.UNAUTHORIZED)
FIELD_OF = {"certificate_sha256": "fingerprint"}  # where the services have another name for it


class RobotForm(EventDispatcher):
    """What is entered, one problem per field, and the result of the test."""

    title = StringProperty()
    name = StringProperty()
    address = StringProperty()
    username = StringProperty()
    password = StringProperty()
    fingerprint = StringProperty()
    enabled = BooleanProperty(True)
    in_order = BooleanProperty(False)  # its starts wait here until it is free, the important ones first
    name_problem = StringProperty()
    address_problem = StringProperty()
    username_problem = StringProperty()
    password_problem = StringProperty()
    fingerprint_problem = StringProperty()
    password_hint = StringProperty()
    outcome = ObjectProperty(NoticeView())
    testing = BooleanProperty(False)
    saving = BooleanProperty(False)
    save_word = StringProperty()
    is_known = BooleanProperty(False)
    about = ObjectProperty(NoticeView())  # what answers
    check_up = ListProperty()  # a row

    def _is_https(self) -> bool:
        return self.address.strip().lower().startswith("https:") or bool(self.fingerprint_problem)

    is_https = AliasProperty(_is_https, None, bind=("address", "fingerprint_problem"))

    @property
    def endpoint(self) -> tuple[str, ...]:
        """What a stored password belongs to."""
        return self.address.strip(), self.username.strip(), self.fingerprint.strip()

    @property
    def connection(self) -> tuple[str, ...]:
        """Everything that a test depends on."""
        return self.address, self.username, self.password, self.fingerprint


class RobotSheet(Sheet):
    """``on_remove(robot)`` fires when Delete was chosen, the sheet is closed then; ``on_check_up(robot)`` when its check-up was.
    ``standing(robot)`` is how that stands."""

    vm = ObjectProperty(None, rebind=True, allownone=True)

    __events__ = ("on_remove", "on_check_up")

    def __init__(
        self,
        context: PageContext,
        robot: Robot | None = None,
        standing: Callable[[Robot], NoticeView] = lambda _robot: NoticeView(),
        **kwargs: Any,
    ) -> None:
        self._context, self._robot, self._standing = context, robot, standing
        self._tested: tuple[str, ...] | None = None  # the connection whose test is over, passed or failed
        self._found: Identity | None = None
        self._new_serial: str | None = None  # of the machine that was accepted as the new robot
        self._by_address = False  # it was agreed that only the address identifies it
        self._may_be_open = robot is None or not robot.address.startswith("https:")
        form = RobotForm(save_word=_("Save robot"), title=_("Add robot"))
        if robot is not None:
            form.title, form.is_known = robot.name, True
            form.name, form.address, form.username = robot.name, plain_address(robot.address), robot.username
            form.fingerprint, form.enabled = robot.certificate_sha256 or "", robot.enabled
            form.password_hint = self._password_hint(robot, True)
            form.enabled = robot.enabled or robot.needs_password
            form.in_order = robot.hand_over is HandOver.WHEN_FREE
        self._as_saved = form.connection if robot is not None and not robot.needs_password else None
        self._saved_endpoint = form.endpoint if self._as_saved else None
        super().__init__(vm=form, **kwargs)
        form.fbind("outcome", self._reveal, "outcome")
        for name in ("outcome", "name_problem"):
            form.fbind(name, self._name_save)
        for name in FIELDS:
            form.fbind(name, self._edited, name)
            form.fbind(f"{name}_problem", self._reveal, f"{name}_field")
        self._entered_first = self._values()
        for name in (*FIELDS, "enabled", "in_order"):
            form.fbind(name, lambda *_args: setattr(self, "draft", self._values() != self._entered_first))
        self.show_facts()

    def on_remove(self, robot: Robot) -> None:
        """Delete was chosen."""

    def on_check_up(self, robot: Robot) -> None:
        """Its check-up was tapped."""

    def _values(self) -> tuple[object, ...]:
        return tuple(getattr(self.vm, name) for name in (*FIELDS, "enabled", "in_order"))

    def show_facts(self) -> Robot | None:
        """What is known of the robot now; returns it."""
        context, robot = self._context, self._robot and self._context.facts.robot(self._robot.id)
        if robot is not None:
            stands = self._standing(robot)
            self.vm.about = robot_note(context.facts, robot, context.now())
            self.vm.check_up = [
                Item(
                    "check up", _("Check-up"), stands.text, icon=stands.icon, tone=stands.tone, support_tone=stands.tone
                )
            ]
        return robot

    def _reveal(self, what: str, _form: RobotForm, said: str | NoticeView) -> None:
        """In a low window, bring the last message in sight."""
        if said if isinstance(said, str) else said.text:
            Clock.schedule_once(lambda _dt: self.ids.page.scroll_to(self.ids[what]), 0)

    def _name_save(self, *_args: Any) -> None:
        """A failed test can be passed over; a name that is taken can't."""
        is_failed = self._tested is not None and self._found is None
        self.vm.save_word = _("Save anyway") if is_failed and not self.vm.name_problem else _("Save robot")

    def _edited(self, name: str, *_args: Any) -> None:
        """A field being corrected is no longer red, and an earlier test doesn't apply to new values."""
        setattr(self.vm, f"{name}_problem", "")
        if name == "name":
            return
        self.vm.username_problem = self.vm.password_problem = ""  # they are about the connection as a whole
        if self._robot is not None:
            self.vm.password_hint = self._password_hint(self._robot, self.vm.endpoint == self._saved_endpoint)
        if self._tested is not None:
            self._tested, self._found = None, None
            self.vm.outcome = NoticeView()
        if name == "address":
            self.vm.fingerprint_problem, self._new_serial, self._by_address = "", None, False

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

    def save(self) -> None:
        """Save a connection that has been tested; test it first if it has not. After a failed test the next press saves
        anyway."""
        form = self.vm
        if form.saving or form.testing:
            return
        if not form.name.strip():
            form.name_problem = _("Give the robot a name")
        elif self._is_taken(form.name.strip()):
            self._show_problem(InvalidInput("name", "there is a robot {name} already", name=form.name.strip()))
        elif not self._is_no_other():
            return
        elif (
            not form.enabled
            or form.connection == self._tested
            or (form.connection == self._as_saved and not self._needs_decision())
        ):
            self._if_it_may_be_open(self._save)
        elif self._has_password():
            self._if_it_may_be_open(self._test_and_save)

    def _is_taken(self, name: str) -> bool:
        return any(
            robot.name == name and (self._robot is None or robot.id != self._robot.id)
            for robot in self._context.facts.robots
        )

    def _needs_decision(self) -> bool:
        """Whether the answering machine is refused until a person has decided: saving tests it, and asks."""
        return self._robot is not None and self._context.facts.snapshot(self._robot.id).connection in NEED_DECISION

    def on_dots(self, button: Widget) -> None:
        self._context.shell.dialogs.menu(
            button,
            "",
            [MenuItem("delete", _("Delete robot"), "delete-outline", tone="fault")],
            lambda _key: self.remove(),
        )

    def open_check_up(self) -> None:
        if self._robot is not None:
            self.dispatch("on_check_up", self._robot)

    def remove(self) -> None:
        if self._robot is not None:
            self._context.shell.sheets.close()
            self.dispatch("on_remove", self._robot)

    def _if_it_may_be_open(self, then: Callable[[], object]) -> None:
        """A robot that was reached over https does not become an unencrypted one without a word."""
        if self._may_be_open or self.vm.is_https:
            then()
            return

        def agreed() -> None:
            self._may_be_open = True
            then()

        self._context.shell.dialogs.confirm(
            _("Connect without encryption?"),
            _("So far this robot is reached over https. Over http, anyone on the network can read its password."),
            _("Use http"),
            agreed,
            danger=True,
        )

    # ------------------------------------------------------------------ test
    def _has_password(self) -> bool:
        """A stored password belongs to the stored user. Without one only a robot that is switched off can be saved."""
        form, stored = self.vm, self._robot
        form.username_problem = form.password_problem = ""  # of an earlier press
        is_known = stored is not None and not stored.needs_password and stored.username == form.username.strip()
        if not form.username.strip():
            form.username_problem = _("Enter the robot's user name")
        elif not form.password and not is_known:
            form.password_problem = _("Enter the password of {user}").format(user=form.username.strip())
        return not (form.username_problem or form.password_problem)

    def _test_and_save(self) -> None:
        self.vm.saving = True
        self._ask(self._save_after_test)

    def _ask(self, then: Callable[[], object]) -> None:
        form, robot, password, by_address = self.vm, self._entered(), self.vm.password or None, self._by_address
        asked = form.connection
        form.testing, self._tested = True, None
        form.outcome = asking_robot()
        self._context.run(
            lambda: self._context.services.operator.test_connection(robot, password, by_address=by_address),
            lambda identity: self._if_open(lambda: self._passed(asked, identity, then)),
            lambda problem: self._if_open(lambda: self._failed(asked, problem)),
        )

    def _if_open(self, then: Callable[[], object]) -> None:
        """If the sheet was closed before the robot's answer, nothing is saved and nothing is asked."""
        if self.parent is not None:
            then()

    def _passed(self, asked: tuple[str, ...], identity: Identity, then: Callable[[], object]) -> None:
        form = self.vm
        form.testing = False
        if asked != form.connection:
            form.saving = False
            form.outcome = NoticeView()
            return
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
            form.saving, form.outcome = False, NoticeView()

    def _is_no_other(self, serial_number: str | None = None) -> bool:
        """Say at the address when another robot is this machine, or when it can't be an address."""
        entered, stored = self._entered(), self._robot
        entered = replace(entered, serial_number=serial_number or entered.serial_number)
        if stored is not None and (entered.address, entered.serial_number) == (
            plain_address(stored.address),
            stored.serial_number,
        ):
            return True
        try:
            validation.check_is_no_other(entered, self._context.facts.robots)
        except InvalidInput as problem:
            self._show_problem(problem)
            return False
        return True

    def _failed(self, asked: tuple[str, ...], problem: BaseException) -> None:
        form = self.vm
        form.testing = form.saving = False
        if asked != form.connection:
            form.outcome = NoticeView()
        elif isinstance(problem, InvalidInput):
            form.outcome = NoticeView()
            self._show_problem(problem)
        else:
            self._tested, self._found = asked, None
            form.outcome = went_wrong(problem)
            if isinstance(problem, AnotherRobot) and self._robot is not None:
                self._ask_about_robot(self._robot, problem)
            elif isinstance(problem, SerialNumberHidden) and self._robot is not None:
                self._ask_about_address(self._robot, problem)
            elif has_unknown_certificate(problem):
                self._ask_about_certificate(asked)

    def _save_after_test(self) -> None:
        self.vm.saving = False
        self._save()

    # ------------------------------------------------------------------ another machine, another certificate
    def _ask_about_robot(self, robot: Robot, problem: AnotherRobot) -> None:
        def accepted() -> None:
            self._new_serial, self._as_saved = problem.params["found"], None
            self._test_again()

        if not self._is_no_other(problem.params["found"]):
            self.vm.outcome = NoticeView()
            return
        self._context.shell.dialogs.confirm(
            _("Is this the new {robot}?").format(robot=robot.name),
            new_robot_question(problem, has_password=bool(self.vm.password)),
            _("This is the new {robot}").format(robot=robot.name),
            accepted,
        )

    def _ask_about_address(self, robot: Robot, problem: SerialNumberHidden) -> None:
        def accepted() -> None:
            self._by_address = True
            self.test()

        self._context.shell.dialogs.confirm(
            _("Send the password anyway?"),
            hidden_number_question(robot, problem),
            _("Send the password"),
            accepted,
            danger=True,
        )

    def _ask_about_certificate(self, asked: tuple[str, ...]) -> None:
        """Show the fingerprint of what answers, for a person to compare."""

        def shown(found: str) -> None:
            if asked == self.vm.connection:
                self._context.shell.dialogs.confirm(
                    _("Trust this certificate?"),
                    certificate_question(asked[0].strip(), found, asked[3]),
                    _("Trust it"),
                    lambda: accepted(found),
                )

        def accepted(found: str) -> None:
            self.vm.fingerprint = found
            self._test_again()

        self._context.run(
            lambda: self._context.services.operator.presented_fingerprint(asked[0].strip()),
            lambda found: self._if_open(lambda: shown(found)),
            self._show_problem,
        )

    def _test_again(self) -> None:
        """With the password entered for the accepted machine; the stored one belongs to the previous one."""
        form = self.vm
        self._tested, form.outcome = None, NoticeView()
        if self._robot is not None and not form.password:
            form.password_problem = _("Enter the password of {user}").format(user=form.username.strip())
        else:
            self.test()

    # ------------------------------------------------------------------ save
    def _save(self) -> None:
        form = self.vm
        form.saving = True
        robot, password, is_tested = self._entered(), form.password or None, self._has_answered()
        self._context.run(
            lambda: self._context.services.catalogue.save_robot(robot, password, is_tested=is_tested),
            self._saved,
            self._refused,
        )

    def _has_answered(self) -> bool:
        """Whether the connection as it is entered was tested with success."""
        return self._found is not None and self._tested == self.vm.connection

    def _entered(self) -> Robot:
        form = self.vm
        robot = self._robot or Robot("", "")
        pin = form.fingerprint.strip() or None if form.is_https else robot.certificate_sha256
        entered = replace(
            robot,
            name=form.name.strip(),
            address=form.address.strip(),
            username=form.username.strip(),
            enabled=form.enabled,
            certificate_sha256=pin,
            serial_number=self._new_serial or robot.serial_number,
            hand_over=HandOver.WHEN_FREE if form.in_order else HandOver.AT_ONCE,
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

    def _saved(self, robot: Robot) -> None:
        self.vm.saving = False
        self._context.shell.sheets.close()
        self._context.was_saved("robots", robot)
        self._context.say((_("{robot} saved") if self._robot else _("{robot} added")).format(robot=robot.name))

    def _refused(self, problem: BaseException) -> None:
        self.vm.saving = False
        self._show_problem(problem)

    def _show_problem(self, problem: BaseException) -> None:
        """At the field it is about; without a field, in the place of the test's result."""
        field = getattr(problem, "field", "")
        field = FIELD_OF.get(field, field)
        if field in FIELDS:
            setattr(self.vm, f"{field}_problem", sentence_of(problem))
        else:
            self.vm.outcome = went_wrong(problem)
