"""The simulated world: one production hall with stations along a main aisle.

Metres; x to the right, y up, origin in the lower left corner. Robots leave the aisle at a station's x and drive straight to it.
"""

from __future__ import annotations

from dataclasses import dataclass

from mir_sim.motion import Pose

WIDTH, HEIGHT = 40.0, 24.0
AISLE = 12.0

MAP_GUID = "20f7a3c1-5d0e-11ef-93c1-0001297b6e20"
SESSION_GUID = "85e7b2d4-5d0e-11ef-93c1-0001297b6e20"
MAP_NAME = "Production hall"
SESSION_NAME = "Main site"

# Position types as recorded on robots: 0 robot position, 20 charging station, 21 its entry, 11 VL marker, 5 shelf.
ROBOT, SHELF, VL_MARKER, CHARGER, CHARGER_ENTRY = 0, 5, 11, 20, 21
POSITION_TYPES = {
    ROBOT: "Robot position",
    1: "V-marker entry",
    SHELF: "Shelf position",
    7: "Charging station (MiR100/200)",
    8: "Charging station entry (MiR100/200)",
    9: "L-marker",
    VL_MARKER: "VL-marker",
    CHARGER: "Charging station",
    CHARGER_ENTRY: "Charging station entry",
    22: "Cart position",
    25: "Lift position",
    26: "Lift entry position",
    42: "Staging position",
}


@dataclass(frozen=True)
class Station:
    """A named position; ``parent`` is the guid of the marker that an entry position belongs to."""

    guid: str
    name: str
    pose: Pose
    type_id: int = ROBOT
    parent: str = ""


def _guid(number: int) -> str:
    return f"a1c4e{number:03d}-5d0f-11ef-93c1-0001297b6e20"


STATIONS = (
    Station(_guid(1), "Home", Pose(5.0, 9.0, 90.0)),
    Station(_guid(2), "Charger", Pose(2.0, 20.0, -90.0), CHARGER),
    Station(_guid(3), "Charger entry", Pose(2.0, 18.0, 90.0), CHARGER_ENTRY, _guid(2)),
    Station(_guid(4), "Warehouse", Pose(9.0, 19.0, 90.0)),
    Station(_guid(5), "Kitting", Pose(15.0, 17.5, 90.0)),
    Station(_guid(6), "Line 1", Pose(21.0, 18.0, 90.0)),
    Station(_guid(7), "Line 2", Pose(28.0, 18.0, 90.0)),
    Station(_guid(8), "Press", Pose(35.0, 17.0, 90.0)),
    Station(_guid(9), "Dock", Pose(13.0, 4.0, -90.0), VL_MARKER),
    Station(_guid(10), "Coil store", Pose(20.0, 5.0, -90.0)),
    Station(_guid(11), "Empties", Pose(27.0, 6.0, -90.0)),
    Station(_guid(12), "Compactor", Pose(36.0, 5.0, -90.0)),
)


@dataclass(frozen=True)
class Box:
    """A rectangle of the floor plan."""

    left: float
    bottom: float
    right: float
    top: float


# Racks and machines. The aisle and the path from it to each station are free, and so are all routes.
OBSTACLES = (
    Box(4.0, 14.0, 7.5, 23.0),
    Box(10.5, 14.0, 13.5, 23.0),
    Box(16.5, 14.0, 19.5, 23.0),
    Box(22.5, 14.0, 26.5, 23.0),
    Box(29.5, 14.0, 33.5, 23.0),
    Box(36.5, 14.0, 39.0, 23.0),
    Box(1.0, 1.0, 3.5, 10.0),
    Box(6.5, 1.0, 11.5, 10.0),
    Box(14.5, 1.0, 18.5, 10.0),
    Box(21.5, 1.0, 25.5, 10.0),
    Box(28.5, 1.0, 34.5, 10.0),
)
BY_NAME = {station.name: station for station in STATIONS}


def route(start: Pose, x: float, y: float) -> list[tuple[float, float]]:
    """Waypoints from a pose to a point: to the aisle, along it, and off it at the goal; straight when both have the same x."""
    if abs(start.x - x) < 0.5:
        return [(x, y)]
    return [(start.x, AISLE), (x, AISLE), (x, y)]
