"""The outline of a robot, in metres from its centre, as a text of JSON (recorded)."""

from __future__ import annotations

import json

_BACK_FRONT_SIDE = {"MiR100": (-0.454, 0.506, 0.32), "MiR200": (-0.454, 0.506, 0.32), "MiR250": (-0.39, 0.39, 0.305)}


def footprint_of(model: str) -> str:
    back, front, side = _BACK_FRONT_SIDE.get(model, _BACK_FRONT_SIDE["MiR250"])
    return json.dumps([[back, side], [front, side], [front, -side], [back, -side]], separators=(",", ":"))
