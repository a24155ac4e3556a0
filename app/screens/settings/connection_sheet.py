"""The sheet that adds or edits something with a connection: a robot, a fleet. It tests the connection before it saves,
and never shows a saved password.

It asks if a certificate is unknown; nothing is sent before the user's answer.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import replace
from functools import partial
from typing import Any

from kivy.clock import Clock
from kivy.properties import BooleanProperty, OptionProperty, StringProperty

from app.domain.models import InvalidInput
from app.domain.robot import FleetIdentity, Identity
from app.i18n import _
from app.mir.errors import Unauthorized
from app.screens.common import formats
from app.screens.common.problems import sentence_of
from app.screens.settings import trust_view
from app.screens.settings.edit_sheet import EditSheet
from app.screens.settings.page import PageContext
from app.screens.settings.trust import TrustSheet
from app.screens.settings.view import NoticeView, has_unknown_certificate, nothing_sent, went_wrong
from app.widgets.scrolling import turn_to

ENDPOINT = ("address", "username", "certificate_sha256")  # what a password belongs to
OVER = ("passed", "failed")


class ConnectionSheet(EditSheet):
    """``test_state`` is about the connection as it is entered."""

    password = StringProperty()
    password_hint = StringProperty()
    has_user = BooleanProperty(True)  # otherwise the password is a key
    is_https = BooleanProperty(False)
    is_open = BooleanProperty(True)  # what is rarely changed is shown
    test_state = OptionProperty("untested", options=["untested", "testing", *OVER])
    fields = ("name", *ENDPOINT, "password")
    is_direct = True  # otherwise all of its connection is another one's
    kind_part = known_part = ""  # what it has before the address, and at its end once it is stored
    taken = ""  # what is said if another one has the name

    def __init__(self, context: PageContext, it: Any, **kwargs: Any) -> None:
        self._tested: tuple[str, ...] = ()  # the connection that was tested last
        self._found: Identity | FleetIdentity | None = None
        self._saves = False  # Save was pressed: it follows when the test has passed
        self._may_be_open = not it.address.startswith("https:")
        super().__init__(context, it, **kwargs)

    # ------------------------------------------------------------------ what each kind does
    @property
    def wanted(self) -> Mapping[str, str]:
        """What is said where the name or the user is left out, and while it is asked."""
        raise NotImplementedError

    def ask(self) -> Callable[[], Any]:
        """What asks the one that is entered who it is. It is called on another thread, and raises InvalidInput or
        RobotError."""
        raise NotImplementedError

    def found(self, said: Any) -> NoticeView:
        """What is shown of who answered."""
        raise NotImplementedError

    def is_no_other(self) -> bool:
        """Say at the address when another one is this machine, or when it can't be an address."""
        return True

    def needs_decision(self) -> bool:
        """Whether what answers is refused until a person has decided."""
        return False

    # ------------------------------------------------------------------ what is entered
    def shown(self, stored: Any) -> Any:
        return replace(
            stored,
            address=formats.address(stored.address),
            certificate_sha256=stored.certificate_sha256 or "",
            enabled=stored.enabled or stored.needs_password,  # which switches it on
        )

    def entered(self) -> Any:
        it, stored = self.it, self.stored or self._first
        address = it.address.strip()
        return replace(
            it,
            name=it.name.strip(),
            address=stored.address if address == formats.address(stored.address) else address,
            username=it.username.strip(),
            certificate_sha256=it.certificate_sha256.strip() or None if self.is_https else stored.certificate_sha256,
            enabled=it.enabled and not it.needs_password,
        )

    @property
    def connection(self) -> tuple[str, ...]:
        """Everything that a test depends on."""
        return (*(getattr(self.it, name) for name in ENDPOINT), self.password)

    def on_it(self, *_args: Any) -> None:
        """A test says nothing about another connection."""
        self.is_https = self.it.address.strip().lower().startswith("https:")
        if self.test_state in OVER and self._tested != self.connection:
            self.test_state, self.outcome = "untested", NoticeView()
        if self.it.needs_password:
            self.password_hint = _("needed to switch it on")
        elif self.stored is not None:
            self.password_hint = _("unchanged") if self.is_as_saved() else _("needed for this change")

    def on_password(self, *_args: Any) -> None:
        self.on_it()
        self.changed()

    def would_be_lost(self) -> bool:
        return super().would_be_lost() or bool(self.password)

    def is_as_saved(self) -> bool:
        """A stored password is for what is entered."""
        entered, stored = self.entered(), self.stored
        return (
            stored is not None
            and not stored.needs_password
            and all(getattr(entered, name) == getattr(stored, name) for name in ENDPOINT)
        )

    def on_outcome(self, *_args: Any) -> None:
        """In a low window, bring it in sight."""
        if self.outcome.text:
            Clock.schedule_once(lambda _dt: turn_to(self.ids.outcome), 0)

    # ------------------------------------------------------------------ what is pressed
    def on_other(self) -> None:
        self.test()

    def test(self) -> None:
        """Test the connection, without saving."""
        self.when_kept(lambda: self._begin(saves=False))

    def save(self) -> None:
        """Save a connection that has been tested; test it first if it has not. After a failed test the next press saves
        anyway."""
        self.when_kept(lambda: self._begin(saves=True))

    def _begin(self, *, saves: bool) -> None:
        """Say what is left out, or belongs to another one."""
        if self.busy:
            return
        self._saves, name = saves, self.entered().name
        self.changed()  # what an earlier press has said
        if saves and not name:
            self.problems["name"] = self.wanted["name"]
        elif saves and any(
            each.name == name and each.id != self.stored_id for each in getattr(self.context.facts, self.kind)
        ):
            self.refuse(InvalidInput("name", self.taken, name=name))
        elif self.is_no_other() and (not self._needs_test() or self._has_password()):
            self._go_on()

    def _needs_test(self) -> bool:
        return not self._saves or (
            self.it.enabled
            and self.test_state not in OVER
            and (bool(self.password) or not self.is_as_saved() or self.needs_decision())
        )

    def _has_password(self) -> bool:
        """A stored password belongs to the stored user. Without one it can only be saved if it is switched off."""
        entered, stored = self.entered(), self.stored
        if self.has_user and not entered.username:
            self.problems["username"] = self.wanted["username"]
        elif not self.password and (stored is None or stored.needs_password or stored.username != entered.username):
            self._want_password()
        return not {"username", "password"} & self.problems.keys()

    def _want_password(self) -> None:
        user = self.entered().username
        self.problems["password"] = (
            _("Enter the password of {user}").format(user=user) if self.has_user else _("Enter the API key")
        )

    def _go_on(self) -> None:
        """What was reached over https does not become unencrypted without a word."""
        if not (self._may_be_open or self.is_https):
            self.ask_to_trust(trust_view.no_encryption(), self._use_http)
        elif self._needs_test():
            self.try_it()
        else:
            self._save()

    def _use_http(self) -> None:
        self._may_be_open = True
        self._go_on()

    def ask_to_trust(self, question: trust_view.Question, agreed: Callable[[], object]) -> None:
        self.outcome = nothing_sent()
        self.context.shell.sheets.over(TrustSheet(question, agreed))

    # ------------------------------------------------------------------ test
    def try_it(self) -> None:
        """Ask who answers."""
        asked = self.connection
        self.test_state, self.outcome = "testing", NoticeView(self.wanted["asking"], icon="timer-sand")
        self.context.run(
            self.ask(), partial(self._answered, asked, self._passed), partial(self._answered, asked, self._failed)
        )

    def _answered(self, asked: tuple[str, ...], then: Callable[[Any], object], said: object) -> None:
        """About values that have changed since it says nothing. If the sheet was closed before the answer, nothing is saved
        and nothing is asked."""
        self.test_state, self.outcome = "untested", NoticeView()
        if asked == self.connection and self.parent is not None:
            self._tested = asked
            then(said)

    def _passed(self, said: Identity | FleetIdentity) -> None:
        self._found, self.test_state = said, "passed"
        self.outcome = self.found(said)
        if not self.is_no_other():
            self.outcome = NoticeView()
        elif self._saves:
            self._go_on()

    def _failed(self, problem: BaseException) -> None:
        if isinstance(problem, InvalidInput):
            self.refuse(problem)
            return
        self.test_state = "failed"
        if isinstance(problem, Unauthorized):
            refused = sentence_of(problem) if self.has_user else _("The fleet doesn't accept the API key")
            self.problems["password"] = refused
        else:
            self.outcome = went_wrong(problem)
            self.ask_about(problem)

    def ask_about(self, problem: BaseException) -> None:
        """Ask whether to trust what answered: of an unknown certificate the fingerprint is shown, for a person to
        compare."""
        asked, entered = self.connection, self.entered()

        def shown(found: str) -> None:
            if asked == self.connection and self.parent is not None:
                name, trusted = entered.name or self.it.address, entered.certificate_sha256 or ""
                self.ask_to_trust(trust_view.certificate(name, found, trusted), lambda: accepted(found))

        def accepted(found: str) -> None:
            self.enter(certificate_sha256=found)
            self.test_again()

        if has_unknown_certificate(problem):
            operator = self.context.services.operator
            self.context.run(lambda: operator.presented_fingerprint(entered.address), shown, self.refuse)

    def test_again(self) -> None:
        """With the password entered for the accepted machine; the stored one belongs to the previous one."""
        self.test_state, self.outcome = "untested", NoticeView()
        if self.stored is not None and not self.password:
            self._want_password()
        else:
            self.try_it()

    # ------------------------------------------------------------------ save
    def how(self) -> dict[str, Any]:
        return {"password": self.password or None}
