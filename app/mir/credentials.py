"""The robot's credential. MiR wants ``Basic base64(user:hex sha256(password))``: that header value works without the
password, so it is as secret as one."""

from __future__ import annotations

import base64
import binascii
import hashlib
import re
from dataclasses import dataclass, field

from app.domain.models import Fleet, FleetKind, InvalidInput, Robot

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


def token_for(robot: Robot, password: str | None, stored: Robot | None) -> str | None:
    """The token that may be sent to ``robot`` as entered now, with normalised addresses: that of the password or,
    without one, that of the stored robot; None if that belongs to another user, address, certificate or serial number.
    The only place where this is decided.

    Raises InvalidInput for a user name that can't be one.
    """
    if password is not None:
        return Token.derive(robot.username, password).header
    return stored.token if stored is not None and is_same_endpoint(robot, stored) else None


def token_for_fleet(fleet: Fleet, password: str | None, stored: Fleet | None) -> str | None:
    """The same for a fleet; the ``password`` of Fleet Enterprise is an API key."""
    if password is not None:
        is_key = fleet.kind is FleetKind.ENTERPRISE
        return (Token.of_key(password) if is_key else Token.derive(fleet.username, password)).header
    is_same = stored is not None and all(
        getattr(fleet, name) == getattr(stored, name) for name in ("username", "address", "certificate_sha256")
    )
    is_known = stored is not None and stored.identity in (None, fleet.identity)
    return stored.token if stored is not None and is_same and is_known else None


def is_same_endpoint(robot: Robot, stored: Robot) -> bool:
    """Whether the credentials of one are valid for the other. A newly known serial number makes no difference."""
    return (robot.username, robot.address, robot.certificate_sha256) == (
        stored.username,
        stored.address,
        stored.certificate_sha256,
    ) and stored.serial_number in (None, robot.serial_number)


def normalise_fingerprint(text: str) -> str:
    """64 lower-case hex digits from a SHA-256 fingerprint as people copy it (colons, blanks, ``SHA256:``). Raises InvalidInput."""
    digits = re.sub(r"[\s:-]", "", re.sub(r"(?i)^\s*sha-?256\s*[:=]?", "", text)).lower()
    if not re.fullmatch(r"[0-9a-f]{64}", digits):
        raise InvalidInput("certificate_sha256", "a SHA-256 fingerprint has 64 hexadecimal digits")
    return digits
