"""The sheet that adds or edits something with a connection: a robot, a fleet. It tests the connection before it saves,
and never shows a saved password.

It asks if a certificate is unknown; nothing is sent before the user's answer.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import replace
from typing import Any

from kivy.clock import Clock
from kivy.properties import StringProperty

from app.domain.models import InvalidInput
from app.domain.robot import FleetIdentity, Identity
from app.i18n import _
from app.mir.errors import Unauthorized
from app.screens.common import formats
from app.screens.common.problems import sentence_of
from app.screens.settings import trust_view
from app.screens.settings.connection_form import ConnectionForm, FieldsSheet, endpoint_of
from app.screens.settings.page import PageContext
from app.screens.settings.trust import TrustSheet
from app.screens.settings.view import (
    NoticeView,
    asking_robot,
    has_unknown_certificate,
    nothing_sent,
    went_wrong,
)

FIELDS = ("name", "address", "username", "password", "fingerprint")


class ConnectionSheet(FieldsSheet):
    """``kind_part``, ``known_part``: what it has between name and address, and at its end once it is stored."""

    kind_part = StringProperty()
    known_part = StringProperty()
    taken = ""  # what is said if another one has the name

    def __init__(self, context: PageContext, stored: Any, form: ConnectionForm, **kwargs: Any) -> None:
        self._tested: tuple[str, ...] | None = None  # the connection whose test is over, passed or failed
        self._found: Identity | FleetIdentity | None = None
        self._may_be_open = stored is None or not stored.address.startswith("https:")
        if stored is not None:
            form.name, form.enabled = stored.name, stored.enabled or stored.needs_password
            form.address, form.username, form.fingerprint = endpoint_of(stored)
            form.password_hint = self._password_hint(stored, True)
        super().__init__(context, stored, vm=form, **kwargs)
        self.fbind("outcome", self._reveal, "outcome")
        self.fbind("outcome", self._name_buttons)
        for name in FIELDS:
            form.fbind(name, self._edited, name)
            form.fbind(
                f"{name}_problem", self._reveal, "fingerprint_slot" if name == "fingerprint" else f"{name}_field"
            )
        self._entered_first = form.name, *form.connection
        self.show_facts()
        self._name_buttons()

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

    def refused(self, problem: BaseException, then: Callable[[], object]) -> None:
        """Ask whether to trust what answered, after which ``then`` follows."""

    # ------------------------------------------------------------------ what is shown
    def _would_be_lost(self) -> bool:
        """When the sheet closes."""
        form, stored = self.vm, self.stored
        if stored is None:
            return (form.name, *form.connection) != self._entered_first
        return bool(form.password) or form.endpoint != endpoint_of(stored)

    def _reveal(self, what: str, _form: ConnectionForm, said: str | NoticeView) -> None:
        """In a low window, bring the last message in sight."""
        if said if isinstance(said, str) else said.text:
            Clock.schedule_once(lambda _dt: self.ids.page.scroll_to(self.ids[what]), 0)

    def _name_buttons(self, *_args: Any) -> None:
        """A failed test can be passed over. Neither button leaves its place."""
        has_failed = self._tested is not None and self._found is None
        self.foot, self.second = _("Save anyway") if has_failed else _("Save"), _("Test connection")

    def _edited(self, name: str, *_args: Any) -> None:
        """A field being corrected is no longer red, and an earlier test doesn't apply to new values."""
        self.draft = self._would_be_lost()
        setattr(self.vm, f"{name}_problem", "")
        if name == "name":
            return
        self.vm.username_problem = self.vm.password_problem = ""  # they are about the connection as a whole
        if self.stored is not None:
            self.vm.password_hint = self._password_hint(self.stored, self.is_as_saved())
        if self._tested is not None:
            self._tested, self._found = None, None
            self.outcome = NoticeView()
        if name == "address":
            self.vm.fingerprint_problem = ""
        self._name_buttons()

    @staticmethod
    def _password_hint(stored: Any, is_as_saved: bool) -> str:
        if stored.needs_password:
            return _("needed to switch it on")
        return _("unchanged") if is_as_saved else _("needed for this change")

    # ------------------------------------------------------------------ what is pressed
    def test(self) -> None:
        """Test the connection, without saving."""
        if not self.vm.testing and self.is_no_other() and self._has_password():
            self._if_it_may_be_open(lambda: self.try_it(lambda: None))

    def on_other(self) -> None:
        self.test()

    def save(self) -> None:
        """Save a connection that has been tested; test it first if it has not. After a failed test the next press saves
        anyway."""
        form = self.vm
        if self.saving or form.testing:
            return
        if not form.name.strip():
            form.name_problem = self.wanted["name"]
        elif self._is_taken(form.name.strip()):
            self.refuse(InvalidInput("name", self.taken, name=form.name.strip()))
        elif not self.is_no_other():
            return
        elif (
            not form.enabled
            or form.connection == self._tested
            or (self.is_as_saved() and not form.password and not self.needs_decision())
        ):
            self._if_it_may_be_open(super().save)
        elif self._has_password():
            then = super().save
            self._if_it_may_be_open(lambda: self.try_it(then))

    def is_as_saved(self) -> bool:
        """A stored password is for what is entered."""
        stored = self.stored
        return stored is not None and not stored.needs_password and self.vm.endpoint == endpoint_of(stored)

    def _is_taken(self, name: str) -> bool:
        return any(
            each.name == name and (self.stored is None or each.id != self.stored.id)
            for each in getattr(self.context.facts, self.kind)
        )

    def _if_it_may_be_open(self, then: Callable[[], object]) -> None:
        """What was reached over https does not become unencrypted without a word."""
        if self._may_be_open or self.vm.is_https:
            then()
            return

        def agreed() -> None:
            self._may_be_open = True
            then()

        self.ask_to_trust(trust_view.no_encryption(), agreed)

    def ask_to_trust(self, question: trust_view.Question, agreed: Callable[[], object]) -> None:
        sheets = self.context.shell.sheets
        self.outcome = nothing_sent()
        sheets.over(TrustSheet(sheets, question, agreed))

    # ------------------------------------------------------------------ test
    def _has_password(self) -> bool:
        """A stored password belongs to the stored user. Without one it can only be saved if it is switched off."""
        form, stored = self.vm, self.stored
        form.username_problem = form.password_problem = ""  # of an earlier press
        is_known = stored is not None and not stored.needs_password and stored.username == form.username.strip()
        if form.has_user and not form.username.strip():
            form.username_problem = self.wanted["username"]
        elif not form.password and not is_known:
            form.password_problem = self._password_wanted()
        return not (form.username_problem or form.password_problem)

    def _password_wanted(self) -> str:
        user = self.vm.username.strip()
        return _("Enter the password of {user}").format(user=user) if self.vm.has_user else _("Enter the API key")

    def try_it(self, then: Callable[[], object]) -> None:
        """Ask who answers; ``then`` follows if that is right."""
        form = self.vm
        asked = form.connection
        form.testing, self._tested = True, None
        self.outcome = replace(asking_robot(), text=self.wanted["asking"])
        self.context.run(
            self.ask(),
            lambda said: self._answered(asked, lambda: self._passed(asked, said, then)),
            lambda problem: self._answered(asked, lambda: self._failed(asked, problem, then)),
        )

    def _answered(self, asked: tuple[str, ...], then: Callable[[], object]) -> None:
        """About values that have changed since it says nothing."""
        form = self.vm
        form.testing, self.outcome = False, NoticeView()
        if asked == form.connection:
            self._if_open(then)

    def _if_open(self, then: Callable[[], object]) -> None:
        """If the sheet was closed before the answer, nothing is saved and nothing is asked."""
        if self.parent is not None:
            then()

    def _passed(self, asked: tuple[str, ...], said: Any, then: Callable[[], object]) -> None:
        self._tested, self._found = asked, said
        self.outcome = self.found(said)
        if self.is_no_other():
            then()
        else:
            self.outcome = NoticeView()

    def _failed(self, asked: tuple[str, ...], problem: BaseException, then: Callable[[], object]) -> None:
        """``then`` follows if a person trusts what answers."""
        form = self.vm
        if isinstance(problem, InvalidInput):
            self.refuse(problem)
            return
        self._tested, self._found = asked, None
        if isinstance(problem, Unauthorized):
            form.password_problem = sentence_of(problem) if form.has_user else _("The fleet doesn't accept the API key")
            self._name_buttons()
            return
        self.outcome = went_wrong(problem)
        if has_unknown_certificate(problem):
            self._ask_about_certificate(asked, then)
        else:
            self.refused(problem, then)

    def _ask_about_certificate(self, asked: tuple[str, ...], then: Callable[[], object]) -> None:
        """Show the fingerprint of what answers, for a person to compare."""

        def shown(found: str) -> None:
            if asked == self.vm.connection:
                name = self.vm.name.strip() or asked[0].strip()
                self.ask_to_trust(trust_view.certificate(name, found, asked[3].strip()), lambda: accepted(found))

        def accepted(found: str) -> None:
            self.vm.fingerprint = found
            self.test_again(then)

        self.context.run(
            lambda: self.context.services.operator.presented_fingerprint(asked[0].strip()),
            lambda found: self._if_open(lambda: shown(found)),
            self.refuse,
        )

    def test_again(self, then: Callable[[], object]) -> None:
        """With the password entered for the accepted machine; the stored one belongs to the previous one."""
        form = self.vm
        self._tested, self.outcome = None, NoticeView()
        if self.stored is not None and not form.password:
            form.password_problem = self._password_wanted()
        else:
            self.try_it(then)

    # ------------------------------------------------------------------ save
    def how(self) -> dict[str, Any]:
        return {"password": self.vm.password or None}

    def has_answered(self) -> bool:
        """Whether the connection as it is entered was tested with success."""
        return self._found is not None and self._tested == self.vm.connection

    def entered_connection(self, new: Any) -> dict[str, Any]:
        """What ``entered`` has of it; ``new``: one without values."""
        form, stored = self.vm, self.stored or new
        address = form.address.strip()
        return {
            "name": form.name.strip(),
            "address": stored.address if address == formats.address(stored.address) else address,
            "username": form.username.strip(),
            "enabled": form.enabled,
            "certificate_sha256": form.fingerprint.strip() or None if form.is_https else stored.certificate_sha256,
        }

    def refuse(self, problem: BaseException) -> None:
        """The services have another name for the fingerprint."""
        if isinstance(problem, InvalidInput) and problem.field == "certificate_sha256":
            self.saving, self.vm.fingerprint_problem = False, sentence_of(problem)
        else:
            super().refuse(problem)
