"""What Home needs to know at one moment, read on a background thread; home_view turns it into words."""
from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from datetime import datetime
from typing import TYPE_CHECKING

from app.domain.models import Execution, Mission, Robot, RobotSnapshot, Settings
from app.domain.robot import QueueItem, QueueState
from app.services.planning.plan import PlannedRun
from app.services.robots.map_picture import MapPicture

if TYPE_CHECKING:
    from app.container import Container
    from app.services.robots.missions import RobotMissions

NEXT_PLANNED = LAST_FINISHED = 5


@dataclass(frozen=True)
class HomeFacts:
    settings: Settings = field(default_factory=Settings)
    robots: tuple[Robot, ...] = ()
    snapshots: Mapping[int, RobotSnapshot] = field(default_factory=dict)     # by robot
    missions: tuple[Mission, ...] = ()                  # that the selected robot can be asked for, favourites first
    open: tuple[Execution, ...] = ()                    # under way or waiting, of all robots
    planned: tuple[PlannedRun, ...] = ()
    finished: tuple[Execution, ...] = ()
    usual_s: Mapping[str, float] = field(default_factory=dict)               # by guid, on the selected robot
    typed: frozenset[str] = frozenset()                 # of these guids: no run has shown it yet
    names: Mapping[str, str] = field(default_factory=dict)                   # of missions by guid, as the selected robot calls them
    map: MapPicture | None = None                       # that the selected robot is on
    cancelling: frozenset[int] = frozenset()            # queue ids that the operator has just asked to be gone
    seen_running: Mapping[int, datetime] = field(default_factory=dict)       # by queue id: since when this tablet has seen it run

    @property
    def robot(self) -> Robot | None:
        """The selected one; the first while the chosen one is gone."""
        chosen = self.settings.selected_robot_id
        return next((robot for robot in self.robots if robot.id == chosen), self.robots[0] if self.robots else None)

    @property
    def snapshot(self) -> RobotSnapshot:
        robot = self.robot
        return RobotSnapshot(0) if robot is None else self.snapshots.get(robot.id) or RobotSnapshot(robot.id)

    @property
    def open_here(self) -> tuple[Execution, ...]:
        """Ours on the selected robot."""
        robot = self.robot
        return tuple(e for e in self.open if robot is not None and e.robot_id == robot.id)

    @property
    def running(self) -> QueueItem | None:
        """What the selected robot is at, whoever asked for it."""
        return next((item for item in self.snapshot.queue if item.state is QueueState.EXECUTING), None)

    @property
    def map_id(self) -> str | None:
        """Of the map that the selected robot is on."""
        return self.snapshot.status.map_id if self.snapshot.status else None

    def execution_of(self, item: QueueItem) -> Execution | None:
        """Ours behind an item of the selected robot's queue: by its number or, before that is written down, by the token it carries."""
        return next((e for e in self.open_here if e.queue_id == item.id or (e.queue_id is None and e.token == item.description)), None)

    @property
    def not_in_queue(self) -> tuple[Execution, ...]:
        """Ours that the queue, as it was last read, doesn't hold: waiting here, just handed over, or about to be seen as ended."""
        there = {ours.id for item in self.snapshot.queue if (ours := self.execution_of(item))}
        return tuple(e for e in self.open_here if e.id not in there)

    def name_of(self, item: QueueItem) -> str:
        """The mission of an item, as the people here call it, else as the robot does."""
        return self._known_name(item) or item.mission_id or "–"

    def needs_name(self, item: QueueItem) -> bool:
        """Whether only the robot can tell what it is."""
        return item.mission_id is not None and self._known_name(item) is None

    def _known_name(self, item: QueueItem) -> str | None:
        if ours := self.execution_of(item):
            return ours.mission
        return next((m.name for m in self.missions if m.guid == item.mission_id), self.names.get(item.mission_id or ""))


def read(container: Container, robot_missions: RobotMissions, seen_running: Mapping[int, datetime],
         known: HomeFacts | None = None) -> HomeFacts:
    """Read everything, or with ``known`` only what the robots do: the plan and the history are then as they were.

    Called off the UI thread: it asks the database, never a robot.
    """
    facts = known or _read_plan(container)
    facts = replace(facts, seen_running=seen_running,
                    snapshots={robot.id: container.snapshots.get(robot.id) for robot in facts.robots})
    robot = facts.robot
    if robot is None:
        return facts
    guids = {item.mission_id for item in facts.snapshot.queue if item.mission_id} | {e.mission_guid for e in facts.open_here}
    usual = {guid: found for guid in guids if (found := container.history.expected(robot.id, guid)) is not None}
    floor = container.maps.known(robot.id, facts.map_id) if facts.map_id else None
    return replace(facts, map=floor, names=robot_missions.names(robot.id),
                   usual_s={guid: one.median_s for guid, one in usual.items() if one.median_s},
                   typed=frozenset(guid for guid, one in usual.items() if one.typed))


def _read_plan(container: Container) -> HomeFacts:
    repositories, db = container.repositories, container.db.read()
    facts = HomeFacts(
        settings=container.settings(), robots=tuple(repositories.robots.all(db)), open=tuple(container.history.open()),
        planned=tuple(container.plan.next(NEXT_PLANNED)), finished=tuple(container.history.last_finished(LAST_FINISHED)))
    if facts.robot is None:
        return facts
    missions = repositories.missions.available_on(db, facts.robot.id)
    return replace(facts, missions=tuple(sorted(missions, key=lambda m: (not m.favourite, m.name.casefold()))))
