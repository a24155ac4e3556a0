"""How a fleet differs from the faithful one, where that is a fact; and what it does where no one has seen it.

The defaults are what was recorded or documented, otherwise the guess that is the least surprising.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import asdict, dataclass, field, fields, replace
from typing import Any, TypeVar

from mir_sim import checks
from mir_sim.checks import WrongValue

K = TypeVar("K")


def choice(*values: Any) -> Any:
    """A knob with these positions. The first one is the default."""

    def check(value: Any, name: str) -> Any:
        if not any(value == one and type(value) is type(one) for one in values):
            raise WrongValue(f"{name} must be one of {', '.join(map(str, values))}.")
        return value

    return field(default=values[0], metadata={"check": check})


def switch(default: bool) -> Any:
    """A knob that is on or off."""
    return field(default=default, metadata={"check": checks.boolean})


def number(low: float, high: float, default: float | None = None) -> Any:
    """A knob with a number, or None."""

    def check(value: Any, name: str) -> float | None:
        return None if value is None else checks.number(value, name, low, high)

    return field(default=default, metadata={"check": check})


def seconds(default: float) -> Any:
    """A knob with seconds, up to an hour."""
    return field(default=default, metadata={"check": lambda value, name: checks.number(value, name, 0, 3600)})


def _words(value: Any, name: str) -> dict[str, str]:
    known = ("Pending", "Outbound", "Executing", "Done", "Aborted", "Invalid")
    if not isinstance(value, dict):
        raise WrongValue(f"{name} must be an object of states and the words for them.")
    return {
        checks.one_of(state, f"each key of {name}", known): checks.text(own, f"{name}.{state}")
        for state, own in value.items()
    }


def changed(knobs: K, document: Any) -> K:
    """The same knobs with those of a parsed JSON object in other positions. Raises WrongValue."""
    known = {one.name: one.metadata["check"] for one in fields(knobs)}  # type: ignore[arg-type]
    if not isinstance(document, dict):
        raise WrongValue("knobs must be an object.")
    for name in document:
        if name not in known:
            raise WrongValue(f"There is no knob {name!r}; known are {', '.join(known)}.")
    return replace(knobs, **{name: known[name](value, name) for name, value in document.items()})  # type: ignore[type-var]


def shown(knobs: Any) -> dict[str, Any]:
    """The positions of all knobs."""
    return asdict(knobs)


@dataclass(frozen=True)
class ClassicKnobs:
    """Knobs of a classic fleet.

    Attributes:
        description: what an order has as such: the text that was posted, the description of its mission, or nothing.
        description_on_robot: the same of the item in the robot's queue.
        answer: what the answer to a POST of an order has: id, state and url, or the whole order, as software 3.x answers.
        outbound: whether an order that its robot hasn't begun is Outbound; otherwise it is still Pending.
        earliest_start: how a time without zone is read that an order has as its earliest start; or none has an effect.
        parameters: whether the values of an order are in an object, as the definition has them, or in a list, or not shown.
        state_words: other words for states of orders.
        search: status code of POST …/search.
        delete_ended: status code of a DELETE of an order that has ended.
        waiting_after_reboot: whether orders that no robot has yet are there after a reboot.
        ids_after_reboot: whether ids of orders that were lost are given again.
        order_of_robots: whether a reboot changes the order of the list of robots.
        status: whether /status is one object, or a list of one, as MiR's definition has it.
        robots: whether the list of robots has all their fields without being asked for them.
        serial_numbers: whether robots have theirs.
        demands_language: whether requests without the header Accept-Language are refused.
        charging_below: percent of battery below which the fleet sends a robot without orders to the charger.
        staging_after: simulated seconds after which it sends a robot without orders home.
        box: the status code with which a security box on the way answers in place of the fleet.
    """

    description: str = choice("posted", "mission", "none")
    description_on_robot: str = choice("mission", "posted", "none")
    answer: str = choice("short", "whole")
    outbound: bool = switch(True)
    earliest_start: str = choice("local", "utc", "ignored")
    parameters: str = choice("object", "list", "none")
    state_words: Mapping[str, str] = field(default_factory=dict, metadata={"check": _words})
    search: int = choice(200, 201, 404)
    delete_ended: int = choice(204, 404, 400)
    waiting_after_reboot: str = choice("kept", "lost")
    ids_after_reboot: str = choice("new", "reused")
    order_of_robots: str = choice("changed", "kept")
    status: str = choice("object", "list")
    robots: str = choice("whole", "short")
    serial_numbers: bool = switch(True)
    demands_language: bool = switch(False)
    charging_below: float | None = number(0, 100)
    staging_after: float | None = number(0, 1e6)
    box: int | None = choice(None, 470)


@dataclass(frozen=True)
class EnterpriseKnobs:
    """Knobs of Fleet Enterprise. Seconds are simulated ones.

    Attributes:
        version: decides which operations and fields there are.
        posted: what POST /serial-order does: "created" answers 201; "accepted" answers 202, and the order is there later;
            "lost" answers 202, and the order never comes. Version 1.3.1 never answers 201.
        appears_seconds: the least and the most seconds until an accepted order is there.
        ids_kept: seconds for which the id of an ended order can't be used again; None: for ever.
        orders_kept: seconds for which an ended order can be read by its id; None: for ever.
        abort_seconds: for which an order is Aborting before the fleet ends it.
        patch_seconds: until a change of a robot takes effect.
        offline_robot: what is shown of a robot that is offline: the last that was heard of it, or only who it is.
        waiting_after_reboot: whether orders that no robot has yet are there after a reboot.
        charging_below: percent of battery below which the fleet sends a robot without orders to the charger.
    """

    version: str = choice("1.5.0", "1.4.2", "1.3.1")
    posted: str = choice("created", "accepted", "lost")
    appears_seconds: tuple[float, float] = field(default=(0.0, 5.0), metadata={"check": checks.span})
    ids_kept: float | None = number(0, 1e7)
    orders_kept: float | None = number(0, 1e7)
    abort_seconds: float = seconds(1.0)
    patch_seconds: float = seconds(1.0)
    offline_robot: str = choice("last", "identity")
    waiting_after_reboot: str = choice("kept", "lost")
    charging_below: float | None = number(0, 100)
