"""What the page of one robot shows: the facts of one moment in words. Pure; called once a second, so that times run on."""

from __future__ import annotations

from dataclasses import dataclass, field
from datetime import datetime

from app.domain.models import RobotSnapshot
from app.i18n import _
from app.screens.common.robot_appearance import is_old, silent_fleet, state_appearance, trouble_of
from app.screens.common.robot_groups import FEW, NEEDS_HELP, group_of, help_rank, look_of
from app.screens.home.card import Card, card
from app.screens.home.facts import HomeFacts
from app.screens.home.map import NO_MAP, MapView, map_view
from app.screens.home.send import tiles
from app.screens.home.today import today
from app.widgets.items import Item, Option, Tab

ALL_ROBOTS = "fleet"  # key of the tab


@dataclass(frozen=True)
class HomeView:
    """Of no robot, until there is one."""

    has_robots: bool = False
    card: Card = field(default_factory=Card)
    map: MapView = NO_MAP
    send_title: str = ""
    tiles: tuple[Option, ...] = ()
    today: tuple[Item, ...] = ()
    clear_count: int = 0  # missions that Clear queue would remove


def present(facts: HomeFacts, now: datetime, room: float = 7.0) -> HomeView:
    """``room``: how many rows of the list are in sight."""
    robot = facts.robot
    if robot is None:
        return HomeView()
    shown = card(facts, robot, now)
    return HomeView(
        has_robots=True,
        card=shown,
        map=map_view(facts, now, shown.tone, shown.old),
        send_title=_("Send {robot}").format(robot=robot.name),
        tiles=tiles(facts),
        today=today(facts, robot, now, room),
        clear_count=_cleared(facts) if robot.enabled else 0,
    )


def _cleared(facts: HomeFacts) -> int:
    """How many missions Clear queue would remove."""
    clears_all = facts.snapshot.capabilities.own_queue
    return len(facts.snapshot.queue) + len(facts.not_in_queue) if clears_all else len(facts.open_here)


def tabs(facts: HomeFacts, opened: int | None, now: datetime) -> list[Tab]:
    """Up to three robots by name; of more, all of them, with the colour of the worst and how many need a person, and the one ``opened``
    last. An icon is coloured when something is not normal."""
    found, groups, troubles = [], [], set()
    for robot in facts.robots:
        snapshot = facts.snapshots.get(robot.id) or RobotSnapshot(robot.id)
        old = is_old(snapshot, now, facts.settings)
        state, group = state_appearance(robot, snapshot, old), group_of(robot, snapshot, old, facts.settings)
        if group in NEEDS_HELP:
            groups.append(group)
            troubles.add(trouble_of(robot, silent_fleet(robot, snapshot)))
        found.append(Tab(robot.id, robot.name, state.icon, state.tone if group in NEEDS_HELP else ""))
    if len(found) <= FEW:
        return found
    tone = look_of(min(groups, key=help_rank)).tone if groups else ""
    every = Tab(ALL_ROBOTS, _("All robots"), "view-grid-outline", tone, len(troubles))
    return [every, *(tab for tab in found if tab.key == opened)]
