"""What is entered of a connection, to a robot or to a fleet of robots."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from kivy.event import EventDispatcher
from kivy.properties import AliasProperty, BooleanProperty, ObjectProperty, StringProperty

from app.domain.models import Fleet, Robot
from app.screens.common import formats
from app.screens.settings.edit_sheet import EditSheet
from app.screens.settings.view import NoticeView

ENDPOINT = ("address", "username", "fingerprint")


def endpoint_of(stored: Robot | Fleet) -> tuple[str, str, str]:
    """What a stored password belongs to, as the sheet shows it."""
    return formats.address(stored.address), stored.username, stored.certificate_sha256 or ""


class ConnectionForm(EventDispatcher):
    """What is entered, one problem per field, and the result of the test."""

    name = StringProperty()
    address = StringProperty()
    username = StringProperty()
    password = StringProperty()
    fingerprint = StringProperty()
    enabled = BooleanProperty(True)
    has_user = BooleanProperty(True)  # otherwise the password is a key
    name_problem = StringProperty()
    address_problem = StringProperty()
    username_problem = StringProperty()
    password_problem = StringProperty()
    fingerprint_problem = StringProperty()
    password_hint = StringProperty()
    testing = BooleanProperty(False)
    about = ObjectProperty(NoticeView())  # what answers
    advanced = BooleanProperty(False)  # is unfolded

    def _is_https(self) -> bool:
        return self.address.strip().lower().startswith("https:") or bool(self.fingerprint_problem)

    is_https = AliasProperty(_is_https, None, bind=("address", "fingerprint_problem"))

    @property
    def endpoint(self) -> tuple[str, str, str]:
        """What is entered of ``endpoint_of``."""
        return self.address.strip(), self.username.strip(), self.fingerprint.strip()

    @property
    def connection(self) -> tuple[str, ...]:
        """Everything that a test depends on."""
        return self.address, self.username, self.password, self.fingerprint

    def follow(self, before: Robot | Fleet, now: Robot | Fleet, at_once: Sequence[str]) -> None:
        """What is stored has changed: show that where nothing else was entered. ``at_once``: what is saved when it is
        entered."""
        for name in at_once:
            if getattr(now, name) != getattr(before, name):
                setattr(self, name, getattr(now, name))
        for name, was, new in zip(ENDPOINT, endpoint_of(before), endpoint_of(now), strict=True):
            if was != new and getattr(self, name).strip() == was:
                setattr(self, name, new)


class FieldsSheet(EditSheet):
    """``vm`` is what is entered; a field ``x`` that may be refused has an ``x_problem``."""

    vm = ObjectProperty(None, rebind=True, allownone=True)

    def choose(self, **values: Any) -> None:
        """What is not typed."""
        for name, value in values.items():
            setattr(self.vm, name, value)
        self.keep()

    def says(self, field: str, problem: str) -> bool:
        if has_field := hasattr(self.vm, f"{field}_problem"):
            setattr(self.vm, f"{field}_problem", problem)
        return has_field
