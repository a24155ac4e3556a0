"""The robot's credential. MiR wants ``Basic base64(user:hex sha256(password))``: that header value works without the
password, so it is as secret as one."""

from __future__ import annotations

import base64
import binascii
import hashlib
import re
from dataclasses import dataclass, field, replace
from typing import TypeVar

from app.domain.models import Fleet, FleetKind, InvalidInput, Robot
from app.mir.address import Address

Entered = TypeVar("Entered", Robot, Fleet)

PLACE = ("username", "address", "certificate_sha256")  # what a token belongs to, with the machine there

# Printed in MiR's manuals, each with the password that is the same in small letters; clients on robots send either spelling.
_PUBLISHED = ("distributor", "Distributor", "admin", "Admin")


API_KEY = "x-api-key"  # the header in which Fleet Enterprise wants its key, and what a token of such a key begins with


@dataclass(frozen=True, slots=True)
class Token:
    """The Authorization header value of one robot user, or API_KEY and a fleet's key, never shown by accident: ask for
    ``header``. An empty value sends no header."""

    header: str = field(default="", repr=False)

    @classmethod
    def derive(cls, user: str, password: str) -> Token:
        """From user name and password, which is forgotten at once. Raises InvalidInput for a user name that can't be one."""
        if not user:
            raise InvalidInput("username", "enter the robot's user name")
        if ":" in user:
            raise InvalidInput("username", "a user name can't contain a colon")
        digest = hashlib.sha256(password.encode("utf-8", "surrogatepass")).hexdigest()
        pair = f"{user}:{digest}".encode("utf-8", "surrogatepass")
        return cls("Basic " + base64.b64encode(pair).decode("ascii"))

    @classmethod
    def of_key(cls, key: str) -> Token:
        """From an API key of Fleet Enterprise, which is sent in a header of its own. Raises InvalidInput for a text that
        can't be one."""
        if not re.fullmatch(r"[!-~]{1,500}", key.strip()):
            raise InvalidInput("password", "an API key has letters, digits and signs, without spaces")
        return cls(f"{API_KEY} {key.strip()}")

    @classmethod
    def from_header(cls, header: str) -> Token:
        """From the stored header value; an empty one is the token of no user. Raises InvalidInput if the value is not
        valid."""
        if header:
            scheme, _, encoded = header.partition(" ")
            if scheme == API_KEY:
                return cls.of_key(encoded)
            try:
                pair = base64.b64decode(encoded, validate=True)
            except (binascii.Error, ValueError):
                pair = b""
            if scheme != "Basic" or b":" not in pair:
                raise InvalidInput("password", "the stored credentials can't be read: enter the password again")
        return cls(header)

    @property
    def headers(self) -> dict[str, str]:
        """What carries it in a request."""
        name, _, key = self.header.partition(" ")
        return {API_KEY: key} if name == API_KEY else {"Authorization": self.header} if self.header else {}

    @property
    def is_published_default(self) -> bool:
        """Whether this is one of the default users and passwords that MiR's manuals print."""
        return any(self == Token.derive(user, user.lower()) for user in _PUBLISHED)

    def __bool__(self) -> bool:
        return bool(self.header)


def with_token(entered: Entered, password: str | None, stored: Entered | None) -> Entered:
    """``entered`` as it is now, with normalised addresses, and with the token that may be sent there: that of the
    password (of Fleet Enterprise an API key) or, without one, that of the stored one; none if that belongs to another
    user, address, certificate or serial number, or another fleet. Without a token it is off and needs its password; one
    that only needed it is switched on. The only place where this is decided.

    Raises InvalidInput for a user name or key that can't be one.
    """
    token = _token_for(entered, password, stored)
    was_waiting = password is not None and stored is not None and stored.needs_password
    enabled = token is not None and (entered.enabled or was_waiting)
    return replace(entered, token=token, needs_password=token is None, enabled=enabled)


def _token_for(entered: Robot | Fleet, password: str | None, stored: Robot | Fleet | None) -> str | None:
    if password is not None:
        is_key = isinstance(entered, Fleet) and entered.kind is FleetKind.ENTERPRISE
        return (Token.of_key(password) if is_key else Token.derive(entered.username, password)).header
    return stored.token if stored is not None and _is_same_endpoint(entered, stored) else None


def _is_same_endpoint(entered: Robot | Fleet, stored: Robot | Fleet) -> bool:
    """Whether the credentials of one are valid for the other. A newly known machine makes no difference."""
    machine = "identity" if isinstance(stored, Fleet) else "serial_number"
    is_place = all(getattr(entered, name) == getattr(stored, name) for name in PLACE)
    return is_place and getattr(stored, machine) in (None, getattr(entered, machine))


def normalised(entered: Entered) -> Entered:
    """With its address and fingerprint as they are stored. Raises InvalidInput."""
    pin = entered.certificate_sha256
    return replace(
        entered,
        address=Address.parse(entered.address).url,
        certificate_sha256=normalise_fingerprint(pin) if pin else None,
    )


def normalise_fingerprint(text: str) -> str:
    """64 lower-case hex digits from a SHA-256 fingerprint as people copy it (colons, blanks, ``SHA256:``). Raises InvalidInput."""
    digits = re.sub(r"[\s:-]", "", re.sub(r"(?i)^\s*sha-?256\s*[:=]?", "", text)).lower()
    if not re.fullmatch(r"[0-9a-f]{64}", digits):
        raise InvalidInput("certificate_sha256", "a SHA-256 fingerprint has 64 hexadecimal digits")
    return digits
