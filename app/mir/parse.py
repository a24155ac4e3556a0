"""Convert a robot's JSON to the app's types, checking everything: wrong values raise Unreadable, missing ones are
None."""

from __future__ import annotations

import base64
import binascii
import json
import math
from collections.abc import Callable, Iterable
from datetime import UTC, datetime
from email.utils import parsedate_to_datetime
from typing import Any, TypeVar

from app.domain.json_parts import has_too_many_parts
from app.domain.message import Message, message
from app.domain.robot import (
    MapPosition,
    MissionInfo,
    Pose,
    QueueItem,
    QueueState,
    RobotMap,
    RobotProblem,
    RobotState,
    RobotStatus,
    UserPrompt,
)
from app.mir.errors import NotAMir, Unreadable
from app.mir.texts import clean, resolve

LARGEST_INT = 2**63 - 1
LARGEST_KEPT = 2**53  # bound of a stored number, positive or negative: the database is refused with one beyond it
LONGEST_LIST = 1000  # of things inside one object: errors, parameters
MOST_OPTIONS = 12  # of a prompt
LONGEST_ANSWER = 255  # characters of one (MiR's REST definition 3.5.4)
FARTHEST = 1e9  # m (and degrees); a place with coordinates beyond is not known
FULL_UP_TO = 105.0  # %, said of a full battery
_GZIP = b"\x1f\x8b"
_YEARS = range(1970, 2100)  # of time stamps; a clock that was never set begins in the first
_NOT_SET = datetime(1970, 1, 1)  # noqa: DTZ001  # how MiR Fleet writes "not set"

Object = dict[str, Any]
T = TypeVar("T")


# ---------------------------------------------------------------------- JSON
def loads(body: bytes) -> Any:
    """Strict JSON: UTF-8, no NaN or Infinity, no key twice, no integer beyond 64 bit, limited nesting, and no more
    parts than can be parsed without blocking other threads. Raises Unreadable."""
    if has_too_many_parts(body):
        raise Unreadable(problem=message("it has too many parts"))
    try:
        return json.loads(
            body.decode("utf-8-sig"),
            parse_constant=_no_constant,
            parse_int=_int,
            parse_float=_float,
            object_pairs_hook=_object,
        )
    except RecursionError:
        raise Unreadable(problem=message("it is nested too deep")) from None
    except UnicodeDecodeError:
        raise Unreadable(
            problem=message("it is compressed") if body[:2] == _GZIP else message("it is no UTF-8")
        ) from None
    except ValueError:
        raise Unreadable(problem=message("it is no JSON")) from None


def _no_constant(name: str) -> Any:
    raise Unreadable(problem=message("it has {name} where a number should be", name=name))


def _int(digits: str) -> int:
    if len(digits) > 20 or abs(number := int(digits)) > LARGEST_INT:
        raise Unreadable(problem=message("it has a number beyond 64 bit"))
    return number


def _float(digits: str) -> float:
    if not math.isfinite(number := float(digits)):
        raise Unreadable(problem=message("it has an infinite number"))
    return number


def _object(pairs: list[tuple[str, Any]]) -> Object:
    found = dict(pairs)
    if len(found) != len(pairs):
        raise Unreadable(problem=message("it has a key twice"))
    return found


# ---------------------------------------------------------------------- values
def object_(value: Any, what: Message) -> Object:
    if not isinstance(value, dict):
        raise Unreadable(problem=message("{what} is no JSON object", what=what))
    return value


def objects(value: Any, what: Message) -> list[Object]:
    if not isinstance(value, list):
        raise Unreadable(problem=message("{what} is no JSON list", what=what))
    if not all(isinstance(entry, dict) for entry in value):
        raise Unreadable(problem=message("{what} is no JSON object", what=message("an entry of {what}", what=what)))
    return value


def part(value: Object, name: str) -> Object:
    """An object inside of one; {} if it is none."""
    found = value.get(name)
    return found if isinstance(found, dict) else {}


def some_objects(value: Any) -> list[Object]:
    """Its objects; [] if it is not a list."""
    return [entry for entry in value[:LONGEST_LIST] if isinstance(entry, dict)] if isinstance(value, list) else []


def single(value: Any, what: Message) -> Object:
    """One object, where MiR's REST definition 3.5.4 says a list of them, as for /users/me."""
    return object_(value[0] if isinstance(value, list) and value else value, what)


def text_or_none(value: Any) -> str | None:
    """Identifiers: a cleaned text or a number written as one; None for anything else and for an empty one."""
    if isinstance(value, int) and not isinstance(value, bool):
        return str(value)
    return clean(value) or None


def int_or_none(value: Any) -> int | None:
    """Whole numbers, also when written as 5.0."""
    if isinstance(value, bool) or not isinstance(value, int | float) or not abs(value) <= LARGEST_KEPT:
        return None
    return int(value) if value == int(value) else None


def float_or_none(value: Any) -> float | None:
    if isinstance(value, bool) or not isinstance(value, int | float) or not abs(value) <= LARGEST_KEPT:
        return None
    return float(value)


def instant(value: Any) -> datetime | None:
    """A robot's time stamp as a naive time of its clock; one with an offset becomes UTC, so that differences stay right."""
    if not isinstance(value, str) or len(value) > 40:
        return None
    try:
        found = datetime.fromisoformat(value)
        if found.tzinfo is not None:
            found = found.astimezone(UTC).replace(tzinfo=None)
    except (ValueError, OverflowError):
        return None
    return found if found != _NOT_SET and found.year in _YEARS else None


def http_date(value: str | None) -> datetime | None:
    """An HTTP ``Date`` header, aware UTC; None for an impossible year, which no calendar can compute with."""
    if not value or len(value) > 60:
        return None
    try:
        found = parsedate_to_datetime(value)
        found = found.replace(tzinfo=UTC) if found.tzinfo is None else found.astimezone(UTC)
    except (ValueError, TypeError, IndexError, OverflowError):
        return None
    return found if found.year in _YEARS else None


def battery(value: Any) -> float | None:
    """Percent, 0–100. After a full charge some robots report slightly more, which is full. The emergency stop makes it
    −1; that and anything else out of range is unknown."""
    percent = float_or_none(value)
    return min(percent, 100.0) if percent is not None and 0.0 <= percent <= FULL_UP_TO else None


def not_negative(value: Any) -> float | None:
    number = float_or_none(value)
    return number if number is not None and number >= 0 else None


def own_path(value: Any) -> str:
    """The path of a ``url`` value, which begins with /v2.0.0 (recorded on robots), at times with /api in front. "" for
    anything else."""
    url = clean(value, 300).removeprefix("/api")
    return url.removeprefix("/v2.0.0") if url.startswith("/v2.0.0/") else ""


# ---------------------------------------------------------------------- status
def status(
    value: Any, *, software: str | None = None, date: datetime | None = None, elapsed_s: float = 0.0
) -> RobotStatus:
    """Raises NotAMir if it is not a status."""
    if not isinstance(value, dict) or not ("state_id" in value or "state_text" in value):
        raise NotAMir(code="no_status")
    return RobotStatus(
        state=_robot_state(int_or_none(value.get("state_id")), clean(value.get("state_text"))),
        state_text=clean(value.get("state_text")),
        mission_text=resolve(value.get("mission_text")),
        mission_queue_id=int_or_none(value.get("mission_queue_id")),
        battery_percentage=battery(value.get("battery_percentage")),
        battery_time_remaining_s=not_negative(value.get("battery_time_remaining")),
        robot_name=clean(value.get("robot_name"), 80),
        robot_model=clean(value.get("robot_model"), 80),
        serial_number=text_or_none(value.get("serial_number")),
        errors=tuple(_problem(entry) for entry in some_objects(value.get("errors"))),
        user_prompt=user_prompt(value.get("user_prompt")),
        position=_pose(value.get("position")),
        map_id=text_or_none(value.get("map_id")),
        distance_to_next_target=not_negative(value.get("distance_to_next_target")),
        moved=not_negative(value.get("moved")),
        uptime_s=not_negative(value.get("uptime")),
        software=software,
        date=date,
        elapsed_s=elapsed_s,
    )


def _robot_state(state_id: int | None, text: str) -> RobotState:
    """By its number; by its text only if it has no number."""
    if state_id is not None:
        return RobotState(state_id) if state_id in set(RobotState) else RobotState.UNKNOWN
    return _STATE_TEXTS.get(text.replace(" ", "").casefold(), RobotState.UNKNOWN)


_STATE_TEXTS = {state.name.replace("_", "").casefold(): state for state in RobotState}


def _problem(value: Object) -> RobotProblem:
    return RobotProblem(
        int_or_none(value.get("code")),
        resolve(value.get("description")),
        clean(value.get("module"), 80),
        resettable=value.get("non_resettable") is not True,
    )


def user_prompt(value: Any) -> UserPrompt | None:
    if not isinstance(value, dict) or not (guid := text_or_none(value.get("guid"))):
        return None
    options = value.get("options")
    options = options if isinstance(options, list) else []
    usable = [option.strip() for option in options[:MOST_OPTIONS] if _is_usable(option)]
    return UserPrompt(
        guid,
        resolve(value.get("question")),
        tuple(usable),
        not_negative(value.get("timeout")),
        len(options) - len(usable),
    )


def _is_usable(option: Any) -> bool:
    """Answers that would be shown or sent in a changed form are not offered."""
    return isinstance(option, str) and 0 < len(option) <= LONGEST_ANSWER and clean(option) == option.strip() != ""


def _pose(value: Any, x: str = "x", y: str = "y") -> Pose | None:
    if not isinstance(value, dict):
        return None
    numbers = [float_or_none(value.get(name)) for name in (x, y, "orientation")]
    known = [number for number in numbers if number is not None and abs(number) <= FARTHEST]
    return Pose(*known) if len(known) == len(numbers) else None


# ---------------------------------------------------------------------- queue
_QUEUE_STATES = {
    "pending": QueueState.PENDING,
    "executing": QueueState.EXECUTING,
    "starting": QueueState.EXECUTING,
    "done": QueueState.DONE,
    "aborted": QueueState.ABORTED,
    "abort": QueueState.ABORTING,
}
_QUEUE_ITEM = message("the queue item")


def queue_id(value: Any) -> int:
    """The ``id`` of a queue item, the one thing to rely on in the answer of a POST. Raises Unreadable."""
    number = object_(value, _QUEUE_ITEM).get("id")
    if isinstance(number, bool) or not isinstance(number, int) or not 0 <= number <= LARGEST_KEPT:
        raise Unreadable(problem=message("the queue item has no number"))
    return number


def queue_state(value: Object) -> QueueState:
    return _QUEUE_STATES.get(clean(value.get("state"), 40).casefold(), QueueState.UNKNOWN)


def has_all_fields(value: Object) -> bool:
    """Lists often have only id, state and url."""
    return "mission_id" in value and "description" in value


def queue_item(value: Any) -> QueueItem:
    """Raises Unreadable without id or state."""
    item = listed_item(value)
    if not item.state_text:
        raise Unreadable(problem=message("the queue item has no state"))
    return item


def listed_item(value: Any) -> QueueItem:
    """One of a list: also without a state, as its description shows whose it is. Raises Unreadable without id."""
    number = queue_id(value)
    parameters = value.get("parameters")
    return QueueItem(
        id=number,
        state=queue_state(value),
        state_text=clean(value.get("state"), 40),
        mission_id=text_or_none(value.get("mission_id")),
        message=resolve(value.get("message")),
        description=clean(value.get("description")),
        priority=int_or_none(value.get("priority")),
        parameters=tuple(parameters[:LONGEST_LIST]) if isinstance(parameters, list) else (),
        ordered=instant(value.get("ordered")),
        started=instant(value.get("started")),
        finished=instant(value.get("finished")),
        created_by_name=clean(value.get("created_by_name"), 80),
        vehicle=clean(value.get("vehicle"), 80),
        vehicle_name=clean(value.get("vehicle_name"), 80),
    )


# ---------------------------------------------------------------------- missions, map
def mission_info(value: Object) -> MissionInfo | None:
    guid = text_or_none(value.get("guid"))
    return MissionInfo(guid, clean(value.get("name"), 255) or guid) if guid else None


def mission(value: Any) -> Object:
    """Raises Unreadable for something else."""
    found = object_(value, message("the mission"))
    if text_or_none(found.get("guid")) is None:
        raise Unreadable(problem=message("the mission has no guid"))
    return found


def map_position(value: Object, map_id: str | None) -> MapPosition | None:
    guid = text_or_none(value.get("guid"))
    if guid is None:
        return None
    return MapPosition(
        guid,
        clean(value.get("name"), 255),
        int_or_none(value.get("type_id")),
        text_or_none(value.get("map_id")) or map_id,
        _pose(value, "pos_x", "pos_y"),
    )


def position(value: Any) -> MapPosition:
    """Raises Unreadable for something else."""
    found = map_position(object_(value, message("the position")), None)
    if found is None:
        raise Unreadable(problem=message("the position has no guid"))
    return found


def robot_map(value: Any) -> RobotMap:
    """The picture is ``map`` on software 2.x and ``base_map`` on 3.x. Raises Unreadable if it is no PNG."""
    found = object_(value, message("the map"))
    encoded = next((found[key] for key in ("base_map", "map") if isinstance(found.get(key), str) and found[key]), "")
    try:
        png = base64.b64decode(encoded.partition(",")[2] if encoded.startswith("data:") else encoded)
    except (binascii.Error, ValueError):
        png = b""
    if not png.startswith(b"\x89PNG\r\n\x1a\n"):
        raise Unreadable(problem=message("the map has no PNG picture"))
    x, y, theta = (float_or_none(found.get(f"origin_{axis}")) or 0.0 for axis in ("x", "y", "theta"))
    resolution = float_or_none(found.get("resolution"))
    return RobotMap(
        text_or_none(found.get("guid")) or "",
        clean(found.get("name"), 255),
        png,
        resolution if resolution is not None and 0 < resolution < 10 else 0.05,
        Pose(x, y, theta),
    )


def listed(value: Any, what: Message, read: Callable[[Object], T | None], most: float = math.inf) -> list[T]:
    """The entries of a list that can be read; one without an identity is skipped."""
    entries = objects(value, what)
    if len(entries) > most:
        raise Unreadable(problem=message("{what} has more than {n} entries", what=what, n=most))
    found: Iterable[T | None] = map(read, entries)
    return [entry for entry in found if entry is not None]
