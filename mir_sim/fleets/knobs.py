"""How a fleet may differ from the faithful one, which the defaults are. What is faithful and not known is a guess, and a knob."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class EnterpriseKnobs:
    """Of Fleet Enterprise. Seconds are simulated ones.

    Attributes:
        version: one of ``enterprise_definition.VERSIONS``; it decides which operations and fields there are.
        posted: what POST /serial-order does: "created" answers 201; "accepted" answers 202, and the order is there later;
            "lost" answers 202, and the order never comes. Version 1.3.1 never answers 201.
        appears_seconds: the least and the most seconds until an accepted order is there.
        ids_kept: seconds for which the id of an ended order can't be used again; None: for ever.
        orders_kept: seconds for which an ended order can be read by its id; None: for ever.
        abort_seconds: for which an order is Aborting before the fleet ends it.
        patch_seconds: until a change of a robot takes effect.
        offline_robot: what is shown of a robot that is offline: "last", the last that was heard of it, or "identity".
    """

    version: str = "1.5.0"
    posted: str = "created"
    appears_seconds: tuple[float, float] = (0.0, 5.0)
    ids_kept: float | None = None
    orders_kept: float | None = None
    abort_seconds: float = 1.0
    patch_seconds: float = 1.0
    offline_robot: str = "last"
