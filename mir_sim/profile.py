"""How one robot differs from the faithful one: a profile, read from a JSON file. Those in ``profiles/`` are built in, as deviants."""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path
from typing import Any

from mir_sim import checks, definition
from mir_sim.checks import WrongValue
from mir_sim.mission_queue import USER_ABORT, ItemState, QueueItem
from mir_sim.missions import MISSIONS

CANCELLED = "Cancelled"  # key of ``item_states`` for items that a user has ended; faithful robots call them Aborted
ITEM_ANSWERS = ("list", "search", "item", "order")
_sample = QueueItem(0, "", "", "", "")
ITEM_FIELDS = tuple(_sample.full() | _sample.summary())
PARAMETERS = ("whitelist", "sort_by", "limit", "offset", "filters")


@dataclass(frozen=True)
class Reboots:
    """More than ``requests`` within ``within_seconds`` make the robot reboot and be offline for ``offline_seconds``, simulated ones all."""

    requests: int
    within_seconds: float
    offline_seconds: float


@dataclass(frozen=True)
class FleetOrders:
    """Every so many simulated seconds a fleet queues the mission with this guid, unless its last order is still pending."""

    mission: str
    every_seconds: float


@dataclass(frozen=True)
class Profile:
    """What can differ; the defaults are the faithful robot.

    Attributes: about: the difference in one sentence. timezone, clock_offset, clock_drift: zone of the clock, seconds
    that it is ahead, and that it gains per day. search: whether POST …/search exists. ignores: parameters of lists
    without effect, of ``PARAMETERS``. page_limit: most entries of an answer, for any ``limit``; None: any number.
    fields: by kind of answer (``ITEM_ANSWERS`` and "status") the only fields it has. Without ``whitelist`` it has all
    of them. order_status: status code of a POST to the queue that succeeded. description_field: the name under which
    items have their description. description_text: what they have as such; {description} is the one given, {mission}
    the name of the mission. item_states: own words for states of items, by ``ItemState`` and ``CANCELLED``. texts: own
    words within all other texts that people read, by phrase. latency: least and most simulated seconds until an answer;
    it is handled at once.
    """

    about: str = ""
    software: str = "3.5.4"
    model: str = "MiR250"
    timezone: str = "Europe/Copenhagen"
    clock_offset: float = 0.0
    clock_drift: float = 0.0
    search: bool = True
    ignores: frozenset[str] = frozenset()
    page_limit: int | None = None
    fields: Mapping[str, frozenset[str]] = field(default_factory=dict)
    order_status: int = 201
    description_field: str = "description"
    description_text: str = "{description}"
    item_states: Mapping[str, str] = field(default_factory=dict)
    texts: Mapping[str, str] = field(default_factory=dict)
    latency: tuple[float, float] | None = None
    reboots: Reboots | None = None
    fleet: FleetOrders | None = None

    @cached_property
    def has_words_for_items(self) -> bool:
        """Whether some field of a queue item differs from the definition."""
        described = (self.description_field, self.description_text)
        return bool(self.item_states or self.texts) or described != (
            FAITHFUL.description_field,
            FAITHFUL.description_text,
        )

    def only(self, kind: str, values: dict[str, Any]) -> dict[str, Any]:
        """The fields that an answer of this kind has of those of the faithful robot."""
        fields = self.fields.get(kind)
        return values if fields is None else {name: value for name, value in values.items() if name in fields}

    def text(self, english: str) -> str:
        """A text for people in the robot's own words."""
        return self._phrases.sub(lambda found: self.texts[found[0]], english) if self.texts else english

    @cached_property
    def _phrases(self) -> re.Pattern[str]:
        return re.compile("|".join(re.escape(phrase) for phrase in sorted(self.texts, key=len, reverse=True)))

    def state_of(self, item: QueueItem) -> str:
        """The state of an item in the robot's own words."""
        if item.state is ItemState.ABORTED and item.message == USER_ABORT and CANCELLED in self.item_states:
            return self.item_states[CANCELLED]
        return self.item_states.get(item.state, str(item.state))

    def description_of(self, item: QueueItem, mission: str) -> str:
        values = {"{description}": item.description, "{mission}": mission}
        return re.sub(r"\{(?:description|mission)\}", lambda found: values[found[0]], self.description_text)


FAITHFUL = Profile()


# ---------------------------------------------------------------------- reading
def _names(value: Any, name: str, known: tuple[str, ...]) -> frozenset[str]:
    if not isinstance(value, list):
        raise WrongValue(f"{name} must be a list of names.")
    return frozenset(checks.one_of(one, f"each of {name}", known) for one in value)


def _object(
    value: Any, name: str, known: Mapping[str, Callable[[Any, str], Any]], *, complete: bool = False
) -> dict[str, Any]:
    """An object whose keys are known, each with its checked value; null is as if it were left out."""
    if not isinstance(value, dict):
        raise WrongValue(f"{name} must be an object.")
    for key in value:
        if key not in known:
            raise WrongValue(f"{name} has no {key!r}; known are {', '.join(known)}.")
    if complete and (missing := [key for key in known if value.get(key) is None]):
        raise WrongValue(f"{name} lacks {', '.join(missing)}.")
    prefix = "" if name == WHOLE else f"{name}."
    return {key: known[key](one, f"{prefix}{key}") for key, one in value.items() if one is not None}


def _seconds(least: float = 0.0, most: float = 1e6) -> Callable[[Any, str], float]:
    return lambda value, name: checks.number(value, name, least, most)


def _fields(value: Any, name: str) -> dict[str, frozenset[str]]:
    known: dict[str, Callable[[Any, str], Any]] = {
        kind: lambda one, its: _names(one, its, ITEM_FIELDS) for kind in ITEM_ANSWERS
    }
    return _object(value, name, {**known, "status": lambda one, its: _names(one, its, _status_fields())})


def _status_fields() -> tuple[str, ...]:
    known: dict[str, None] = {"allowed_methods": None}
    for version in definition.SOFTWARE:
        operation = definition.load(version).operation("get", "/status")
        known |= dict.fromkeys(definition.load(version).properties(operation.schema if operation else None))
    return tuple(known)


def _any_text(value: Any, name: str) -> str:
    return "" if value == "" else checks.text(value, name)


def _description_field(value: Any, name: str) -> str:
    if value in ITEM_FIELDS and value != FAITHFUL.description_field:
        raise WrongValue(f"{name} must not be {value!r}, which items have already.")
    return checks.text(value, name)


def _phrases(value: Any, name: str) -> dict[str, str]:
    if not isinstance(value, dict) or "" in value:
        raise WrongValue(f"{name} must be an object of phrases and what is said instead of each.")
    return {phrase: _any_text(own, f"{name}[{phrase!r}]") for phrase, own in value.items()}


def _fleet(value: Any, name: str) -> FleetOrders:
    guids = {mission.name: mission.guid for mission in MISSIONS}
    orders = _object(
        value,
        name,
        {"mission": lambda one, its: guids[checks.one_of(one, its, guids)], "every_seconds": _seconds(1.0)},
        complete=True,
    )
    return FleetOrders(**orders)


def _reboots(value: Any, name: str) -> Reboots:
    return Reboots(
        **_object(
            value,
            name,
            {
                "requests": lambda one, its: checks.whole(one, its, 1),
                "within_seconds": _seconds(1.0),
                "offline_seconds": _seconds(),
            },
            complete=True,
        )
    )


WHOLE = "A profile"
REPORT = "report"  # key for other findings of the client that wrote the file; anything
KEYS: dict[str, Callable[[Any, str], Any]] = {
    "about": _any_text,
    "software": lambda value, name: checks.one_of(value, name, definition.SOFTWARE),
    "model": checks.text,
    "timezone": checks.zone,
    "clock_offset": _seconds(-1e6),
    "clock_drift": _seconds(-3600.0, 3600.0),
    "search": checks.boolean,
    "ignores": lambda value, name: _names(value, name, PARAMETERS),
    "page_limit": lambda value, name: checks.whole(value, name, 1),
    "fields": _fields,
    "order_status": lambda value, name: checks.whole(value, name, 200, 299),
    "description_field": _description_field,
    "description_text": _any_text,
    "item_states": lambda value, name: _object(value, name, dict.fromkeys((*ItemState, CANCELLED), checks.text)),
    "texts": _phrases,
    "latency": checks.span,
    "reboots": _reboots,
    "fleet": _fleet,
    REPORT: lambda value, name: value,
}


def profile_of(document: Any) -> Profile:
    """The profile of a parsed JSON document. Raises WrongValue."""
    return Profile(**{name: value for name, value in _object(document, WHOLE, KEYS).items() if name != REPORT})


def read(path: Path) -> Profile:
    """Read a profile file. Raises WrongValue."""
    return checks.read_json(path, profile_of)


DEVIANTS = {path.stem: path for path in sorted((Path(__file__).parent / "profiles").glob("*.json"))}


def deviant(name: str) -> Profile:
    """A profile that is built in. Raises WrongValue."""
    return read(DEVIANTS[checks.one_of(name, "The deviant", DEVIANTS)])
