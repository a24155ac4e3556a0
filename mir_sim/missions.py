"""The missions that every simulated robot has. Guids are fixed and the same on all robots, as on robots that share a site."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

from mir_sim.world import BY_NAME

DEFAULT_GROUP = "mirconst-guid-0000-0011-missiongroup"  # the group named "Missions" (recorded)


@dataclass(frozen=True)
class UserParameter:
    """A value to be given when the mission is queued; it is required when ``default`` is None. Without a ``guid`` each robot makes one."""

    input_name: str
    default: Any = None
    guid: str = ""


@dataclass(frozen=True)
class Action:
    """One action of a mission: MiR's action type and its parameters, each a plain value or a :class:`UserParameter`."""

    type: str
    parameters: dict[str, Any] = field(default_factory=dict)


@dataclass(frozen=True)
class Mission:
    """A ready-made mission."""

    name: str
    guid: str
    actions: tuple[Action, ...]
    description: str = ""


def move(station: str | UserParameter) -> Action:
    position = station if isinstance(station, UserParameter) else BY_NAME[station].guid
    return Action(
        "move",
        {
            "position": position,
            "cart_entry_position": "main",
            "main_or_entry_position": "main",
            "marker_entry_position": "entry",
            "retries": 10,
            "distance_threshold": 0.1,
        },
    )


def dock(station: str | UserParameter) -> Action:
    marker = station if isinstance(station, UserParameter) else BY_NAME[station].guid
    return Action(
        "docking",
        {
            "marker": marker,
            "marker_type": "mirconst-guid-0000-0001-marker000001",
            "retries": 10,
            "max_linear_speed": 0.25,
        },
    )


def wait(seconds: int | UserParameter) -> Action:
    return Action(
        "wait",
        {
            "time": seconds
            if isinstance(seconds, UserParameter)
            else f"00:{seconds // 60:02d}:{seconds % 60:02d}.000000"
        },
    )


def set_register(register: int, value: float) -> Action:
    return Action("set_plc_register", {"register": register, "action": "set", "value": value})


def prompt(question: str, timeout: str) -> Action:
    return Action(
        "prompt_user", {"question": question, "user_group": "mirconst-guid-0000-0003-user_groups0", "timeout": timeout}
    )


def charge(percentage: int, until_new_mission: bool) -> Action:
    return Action(
        "charging",
        {
            "minimum_time": "00:00:30.000000",
            "minimum_percentage": percentage,
            "charge_until_new_mission": until_new_mission,
        },
    )


def _built_in(number: int, name: str, *actions: Action) -> Mission:
    return Mission(name, f"mirconst-guid-0000-{number:04d}-actionlist00", actions)


def _asked(input_name: str, number: int) -> UserParameter:
    return UserParameter(input_name, guid=f"mirconst-guid-0000-{number:04d}-actlistparam")


def _guid(number: int) -> str:
    return f"3d7c7c{number:02x}-ce85-11ef-904a-000e8e9884eb"


MISSIONS: tuple[Mission, ...] = (
    Mission("Deliver", _guid(0x40), (move("Warehouse"), wait(10), move("Line 1"), wait(10)), "Warehouse to line 1"),
    Mission("Home", _guid(0x41), (move("Home"),), "Back to the home position"),
    Mission("Deliver kits to line 2", _guid(0x42), (move("Kitting"), wait(15), move("Line 2"), wait(15))),
    Mission(
        "Collect empties", _guid(0x43), (move("Line 1"), wait(10), move("Line 2"), wait(10), move("Empties"), wait(10))
    ),
    Mission(
        "Return to charger",
        _guid(0x44),
        (move("Charger entry"), dock("Charger"), charge(95, until_new_mission=True)),
        "Charges until the next mission",
    ),
    Mission("Bring pallet to dock", _guid(0x45), (move("Warehouse"), wait(20), dock("Dock"), wait(20))),
    Mission(
        "Move coils to press", _guid(0x46), (move("Coil store"), wait(20), move("Press"), wait(20), set_register(20, 1))
    ),
    Mission("Waste to compactor", _guid(0x47), (move("Line 1"), wait(10), move("Compactor"), wait(15))),
    Mission(
        "Charge to 80 %", _guid(0x48), (move("Charger entry"), dock("Charger"), charge(80, until_new_mission=False))
    ),
    Mission(
        "Go to position", _guid(0x49), (move(UserParameter("Position")),), "Drives to the position that is asked for"
    ),
    Mission("Wait at home", _guid(0x4A), (move("Home"), wait(UserParameter("Time", "00:01:00.000000")))),
    Mission(
        "Ask for release",
        _guid(0x4B),
        (move("Line 1"), prompt("Is the load secured?", "00:02:00.000000"), move("Dock")),
    ),
)

# Hidden missions that every robot has (recorded); they can be read but not changed.
# The parameters of three are known from clients; the others do nothing here.
BUILT_IN = {
    mission.guid: mission
    for mission in (
        _built_in(1, "Move", move(_asked("Position", 1))),
        _built_in(
            3,
            "GoToPositionPrototype",
            Action(
                "move_to_position",
                {
                    "x": _asked("X", 4),
                    "y": _asked("Y", 5),
                    "orientation": _asked("Orientation", 6),
                    "retries": 10,
                    "distance_threshold": 0.1,
                },
            ),
        ),
        _built_in(4, "ChargeAtStation"),
        _built_in(5, "Dock", dock(_asked("Marker", 23))),
        _built_in(6, "StageAtPosition"),
        _built_in(7, "PickupCart"),
        _built_in(8, "PlaceCart"),
    )
}
