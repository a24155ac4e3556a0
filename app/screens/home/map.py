"""Where the robot is, on its own map. Pure."""

from __future__ import annotations

from dataclasses import dataclass
from datetime import datetime
from operator import itemgetter

from app.domain.robot import RobotState, RobotStatus
from app.i18n import _
from app.screens.common import formats
from app.screens.common.robot_appearance import is_old
from app.screens.common.robot_groups import group_of, help_rank, look_of
from app.screens.home.facts import HomeFacts
from app.services.robots.map_picture import MapPicture, Place


@dataclass(frozen=True)
class MapView:
    """Without ``picture`` nothing is known. Points are fractions of the picture."""

    picture: MapPicture | None = None
    at: tuple[float, ...] = ()
    heading: float = 0.0
    tone: str = "accent"  # of the robot on the map
    path: tuple[tuple[float, ...], ...] = ()  # straight from the robot to its goal, if that is known
    label: str = ""  # at the goal how far it is, or at an old position when that was


NO_MAP = MapView()


@dataclass(frozen=True)
class Marker:
    """A robot on the map; x and y are fractions of the picture, ``heading`` in degrees anticlockwise from the right."""

    x: float
    y: float
    heading: float
    tone: str
    name: str


def robots_on_map(facts: HomeFacts, now: datetime) -> tuple[Marker, ...]:
    """All robots on the selected robot's map at their last position: those that need help first, then the selected one.
    Silent ones are grey."""
    found = []
    for robot in facts.robots:
        snapshot = facts.snapshots.get(robot.id)
        status = snapshot.status if snapshot else None
        if (
            facts.map is None
            or snapshot is None
            or status is None
            or status.position is None
            or status.map_id != facts.map_id
        ):
            continue
        if (at := facts.map.fraction(status.position.x, status.position.y)) is not None:
            old = is_old(snapshot, now, facts.settings)
            group = group_of(robot, snapshot, old, facts.settings)
            look = look_of(group)
            is_normal = look.tone == "neutral" and not old
            tone = "offline" if old else "accent" if is_normal else look.tone
            name = robot.name if is_normal else _("{robot} · {state}").format(robot=robot.name, state=look.word)
            marker = Marker(*at, facts.map.heading(status.position.orientation), tone, name)
            found.append(((help_rank(group), robot != facts.robot), marker))
    return tuple(marker for _rank, marker in sorted(found, key=itemgetter(0)))


def map_view(facts: HomeFacts, now: datetime, tone: str, old: bool) -> MapView:
    """``tone`` is that of the robot's state; ``old``: the state is out of date. NO_MAP unless robot and map are
    known."""
    picture, snapshot = facts.map, facts.snapshot
    status = snapshot.status
    if picture is None or status is None or status.position is None:
        return NO_MAP
    at = picture.fraction(status.position.x, status.position.y)
    if at is None:
        return NO_MAP
    goal = None if old else _goal(picture, status)
    label = _goal_words(goal, status) if goal is not None else ""
    if old and snapshot.read_at is not None:
        label = _("seen {time}").format(time=formats.day_and_time(snapshot.read_at, facts.settings.timezone, now))
    return MapView(
        picture,
        at,
        picture.heading(status.position.orientation),
        "offline" if old else "accent" if tone == "neutral" else tone,
        (at, (goal.x, goal.y)) if goal is not None else (),
        label,
    )


def _goal(picture: MapPicture, status: RobotStatus) -> Place | None:
    """The place that the robot says it drives to: "Moving to 'Line 2' (12.4 meters to goal)"."""
    if status.state is not RobotState.EXECUTING:
        return None
    named = [place for place in picture.places if f"'{place.name}'" in status.mission_text]
    return named[0] if len(named) == 1 else None


def _goal_words(goal: Place, status: RobotStatus) -> str:
    left = status.distance_to_next_target
    return goal.name if left is None else f"{goal.name} · {formats.number(left, 0, 'm')}"
