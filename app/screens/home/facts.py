"""What Home needs to know at one moment, read on a background thread; view.py turns it into words."""

from __future__ import annotations

from collections.abc import Callable, Collection, Mapping
from dataclasses import dataclass, field, replace
from datetime import datetime, timedelta
from functools import cached_property

from app.database.robots import Hold
from app.domain.activity import NO_DATA, ActivitySpan, activity_of
from app.domain.clock import Clock
from app.domain.execution import DurationEstimate, Execution, State
from app.domain.models import Group, Mission, Robot, RobotSnapshot, Settings
from app.domain.robot import QueueItem, QueueState, RobotProblem, RobotState, RobotStatus
from app.screens.common.holding import hold_at, hold_of_run
from app.screens.common.mission_names import NOTHING_KNOWN, MissionNames
from app.screens.common.name_order import by_name
from app.services.catalogue.catalogue import Catalogue
from app.services.dispatch.engine import Engine
from app.services.history.runs import History, RobotStates
from app.services.live.alarms import Alarms
from app.services.live.holds import Holds
from app.services.live.mission_parameters import MissionParameters
from app.services.live.snapshots import Snapshots
from app.services.planning.plan import Plan
from app.services.planning.planned import PlannedRun
from app.services.planning.working_days import WorkingCalendar
from app.services.robots.commands import Operator
from app.services.robots.map_picture import MapPicture
from app.services.robots.maps import RobotMaps
from app.services.robots.missions import RobotMissions

NEXT_PLANNED, LAST_FINISHED = 10, 2  # of the selected robot
MOST_READ = 300  # starts of all robots, among which the next ones of the selected robot are looked for
LOOKED_BACK = timedelta(hours=12)  # for since when the robot has been in its state
PAUSED = "paused"  # the activity
LONGEST_QUEUE = 200  # items of a robot's queue that are shown; the others are counted

OnRobot = tuple[int, int]  # a robot's id and the number of an item in its queue: numbers repeat between robots

Standing = tuple[int, RobotState | None, tuple[RobotProblem, ...]]  # a robot's id, its state and errors


@dataclass(frozen=True)
class HomeServices:
    """What Home uses of the app."""

    alarms: Alarms
    calendar: Callable[[], WorkingCalendar]
    catalogue: Catalogue
    clock: Clock
    engine: Engine
    history: History
    holds: Holds
    maps: RobotMaps
    operator: Operator
    parameters: MissionParameters
    plan: Plan
    robot_missions: RobotMissions
    robot_states: RobotStates
    settings: Callable[[], Settings]
    snapshots: Snapshots


@dataclass(frozen=True)
class HomeFacts:
    settings: Settings = field(default_factory=Settings)
    robots: tuple[Robot, ...] = ()
    groups: tuple[Group, ...] = ()
    snapshots: Mapping[int, RobotSnapshot] = field(default_factory=dict)  # by robot
    entered: tuple[Mission, ...] = ()  # for the selected robot, favourites first
    missions: tuple[Mission, ...] = ()  # those of them that it can be asked for
    is_new: bool = False  # the robot was selected a moment ago, and its missions are still to be read
    all_missions: tuple[Mission, ...] = ()  # where there are groups
    known: Mapping[int, Collection[str]] = field(
        default_factory=dict
    )  # guids of missions by robot, as far as they have been read
    open: tuple[Execution, ...] = ()  # under way or waiting, of all robots
    planned: tuple[PlannedRun, ...] = ()  # on the selected robot, as far as is known
    refused: frozenset[int] = frozenset()  # schedules whose values no robot takes
    finished: tuple[Execution, ...] = ()  # the last ones of the selected robot to end, newest first
    expected: Mapping[str, DurationEstimate] = field(default_factory=dict)  # by guid, on the selected robot
    names: Mapping[str, str] = field(default_factory=dict)  # of missions by guid, as the selected robot calls them
    has_alarms: bool = False  # that are open, shelved ones among them
    holds: tuple[Hold, ...] = ()  # of all robots or of one
    mission_names: MissionNames = NOTHING_KNOWN  # what is known of the values that missions get
    calendar: WorkingCalendar = field(default_factory=lambda: WorkingCalendar(Settings()))
    map: MapPicture | None = None  # that the selected robot is on
    cancelling: frozenset[OnRobot] = frozenset()  # items that the operator has just cancelled
    answered: frozenset[str] = frozenset()  # questions (guids) just answered, which robots may still show
    clearing: frozenset[int] = frozenset()  # ids of robots whose queues the operator is just having cleared
    reset_without_effect: frozenset[Standing] = frozenset()  # errors that stand although they were reset
    seen_running: Mapping[OnRobot, datetime] = field(
        default_factory=dict
    )  # since when this tablet has seen an item run
    activities: tuple[ActivitySpan, ...] = ()  # the selected robot's, up to now

    @property
    def has_reset_no_effect(self) -> bool:
        return standing(self.snapshot) in self.reset_without_effect

    @property
    def robot(self) -> Robot | None:
        """The selected robot; the first if the selected one was deleted."""
        chosen = self.settings.selected_robot_id
        return next((robot for robot in self.robots if robot.id == chosen), self.robots[0] if self.robots else None)

    @property
    def snapshot(self) -> RobotSnapshot:
        robot = self.robot
        return RobotSnapshot(0) if robot is None else self.snapshots.get(robot.id) or RobotSnapshot(robot.id)

    @cached_property
    def open_here(self) -> tuple[Execution, ...]:
        """Ours on the selected robot."""
        robot = self.robot
        return tuple(e for e in self.open if robot is not None and e.robot_id == robot.id)

    def about(self, robot_id: int | None) -> HomeFacts:
        """With that robot selected: for a different one, only what all robots do has been read yet."""
        chosen = replace(self, settings=replace(self.settings, selected_robot_id=robot_id))
        if chosen.robot == self.robot:
            return chosen
        return replace(
            chosen,
            entered=(),
            missions=(),
            is_new=True,
            planned=(),
            finished=(),
            expected={},
            names={},
            map=None,
            activities=(),
        )

    def hold(self, robot_id: int, at: datetime) -> Hold | None:
        """The hold that stops a start on that robot at that instant."""
        return hold_at(self.holds, robot_id, at)

    def hold_of(self, run: PlannedRun) -> Hold | None:
        """The hold that stops a planned start at its instant; for a group, on all of its robots."""
        return hold_of_run(self.holds, run, self.robots)

    @property
    def queue(self) -> tuple[QueueItem, ...]:
        """The selected robot's queue as shown, with the running mission first."""
        return self.snapshot.queue[:LONGEST_QUEUE]

    def on_robot(self, item: QueueItem) -> OnRobot:
        """An item of the selected robot's queue."""
        return self.robot.id if self.robot is not None else 0, item.id

    @property
    def running(self) -> QueueItem | None:
        """What the selected robot executes, also for others."""
        return next((item for item in self.snapshot.queue if item.state is QueueState.EXECUTING), None)

    @property
    def map_id(self) -> str | None:
        """Of the map that the selected robot is on."""
        return self.snapshot.status.map_id if self.snapshot.status else None

    @cached_property
    def _ours(self) -> Mapping[int | str, Execution]:
        """On the selected robot, by queue id or, before that is stored, by the token that the item carries. A fleet
        numbers the orders of all its robots together, and one for any of them appears on the robot that takes it."""
        robot = self.robot
        mates = {each.id for each in self.robots if robot and robot.fleet and each.fleet_id == robot.fleet_id}
        ours = [e for e in self.open if e.robot_id in mates] if mates else self.open_here
        return {e.token if e.queue_id is None else e.queue_id: e for e in reversed(ours)}

    def execution_of(self, item: QueueItem) -> Execution | None:
        """Ours behind an item of the selected robot's queue."""
        return self._ours.get(item.id) or self._ours.get(item.description)

    def status_of(self, item: QueueItem) -> RobotStatus | None:
        """Of the robot that has an item of the selected one's queue: a fleet's orders are on its robots."""
        fleet = self.robot.fleet_id if self.robot is not None and item.vehicle else None
        has_it = (each.id for each in self.robots if fleet and (each.fleet_id, each.vehicle) == (fleet, item.vehicle))
        found = self.snapshots.get(next(has_it, 0))
        return (found or self.snapshot).status

    @cached_property
    def not_in_queue(self) -> tuple[Execution, ...]:
        """The app's starts that are not in the queue as last read: waiting here, just sent, or just ended."""
        found = {ours.id for item in self.snapshot.queue if (ours := self.execution_of(item))}
        return tuple(e for e in self.open_here if e.id not in found)

    def is_missing(self, run: Execution) -> bool:
        """Whether it runs, and the selected robot's queue, which was read since, does not have it."""
        read_at, sent_at = self.snapshot.queue_read_at, run.submitted_at
        is_read = read_at is not None and sent_at is not None and sent_at < read_at
        return is_read and run.state is State.EXECUTING and run in self.not_in_queue

    def guid_of(self, item: QueueItem) -> str:
        """Of its mission, "" if the robot gives none."""
        ours = self.execution_of(item)
        return ours.mission_guid if ours else item.mission_id or ""

    def running_since(self, item: QueueItem) -> datetime | None:
        """Of ours as the history has it, of others since this tablet saw it run."""
        ours = self.execution_of(item)
        return ours.started_at if ours and ours.started_at else self.seen_running.get(self.on_robot(item))

    def working_since(self, item: QueueItem, now: datetime) -> datetime | None:
        """``running_since``, moved on by as long as the robot has been paused."""
        since, read_at, status = self.running_since(item), self.snapshot.read_at, self.snapshot.status
        if since is None or read_at is None or status is None:
            return since
        is_paused = activity_of(status) == PAUSED
        spans = [span for span in self.activities if span.activity == PAUSED and span.end > since]
        paused = sum((span.end - max(since, span.start) for span in spans), timedelta())
        if self.activities and self.activities[-1].activity == PAUSED:  # stored only once a minute
            paused += max(timedelta(), (now if is_paused else read_at) - self.activities[-1].end)
        elif is_paused:
            paused += now - max(since, read_at)
        return since + paused

    def state_since(self) -> datetime | None:
        """Since when the selected robot has been doing what it does; None: not known, or only for a moment."""
        status, last = self.snapshot.status, self.activities[-1] if self.activities else None
        return last.start if status is not None and last is not None and last.activity == activity_of(status) else None

    def name_of(self, item: QueueItem) -> str:
        """The mission of an item by its name here, else by the robot's; the app's with their values."""
        if ours := self.execution_of(item):
            return self.mission_names.run(ours)
        return self._known_name(item) or item.mission_id or "–"

    def needs_name(self, item: QueueItem) -> bool:
        """Whether only the robot knows its name."""
        return item.mission_id is not None and self._known_name(item) is None

    @cached_property
    def _mission_names(self) -> Mapping[str, str]:
        return {mission.guid: mission.name for mission in reversed(self.missions)}

    def _known_name(self, item: QueueItem) -> str | None:
        if ours := self.execution_of(item):
            return ours.mission
        guid = item.mission_id or ""
        return self._mission_names.get(guid) or self.names.get(guid)


def standing(snapshot: RobotSnapshot) -> Standing:
    """A key for what stops the robot, to recognise it."""
    status = snapshot.status
    return snapshot.robot_id, status.state if status else None, status.errors if status else ()


def read(
    services: HomeServices, known: HomeFacts | None = None, seen_running: Mapping[OnRobot, datetime] | None = None
) -> HomeFacts:
    """Read everything, or with ``known`` only what the robots do, with plan and history from ``known``.

    Called off the UI thread: it asks the database, never a robot.
    """
    facts = replace(known or _read_plan(services), seen_running=seen_running or {}, activities=())
    facts = replace(
        facts,
        snapshots={robot.id: services.snapshots.get(robot.id) for robot in facts.robots},
        known={robot.id: services.robot_missions.names(robot.id) for robot in facts.robots} if facts.groups else {},
        holds=tuple(services.holds.all_active()),
    )
    robot = facts.robot
    if robot is None:
        return facts
    running = facts.running
    now = services.clock.now()
    since = facts.running_since(running) if running else None
    expected = services.history.expected(robot.id, facts.guid_of(running)) if running else None
    return replace(
        facts,
        map=services.maps.known(robot.id, facts.map_id) if facts.map_id else None,
        missions=tuple(services.robot_missions.offered(robot.id, facts.entered)),
        names=services.robot_missions.names(robot.id),
        expected={facts.guid_of(running): expected} if running and expected else {},
        activities=_activities(services, robot, min(since or now, now - LOOKED_BACK)),
    )


def _activities(services: HomeServices, robot: Robot, since: datetime) -> tuple[ActivitySpan, ...]:
    found = services.robot_states.timelines(since, services.clock.now(), [robot.id])
    return tuple(span for one in found for span in one.spans if span.activity != NO_DATA)


def _read_plan(services: HomeServices) -> HomeFacts:
    facts = HomeFacts(
        has_alarms=bool(services.alarms.open()),
        settings=services.settings(),
        calendar=services.calendar(),
        robots=by_name(services.catalogue.robots()),
        groups=by_name(services.catalogue.groups()),
        open=tuple(services.history.open()),
        refused=frozenset(services.catalogue.refused()),
    )
    if facts.groups:
        facts = replace(facts, all_missions=tuple(services.catalogue.missions()))
    robot = facts.robot
    if robot is None:
        return facts
    entered = services.catalogue.missions_of(robot.id)
    ahead = services.plan.next(min(MOST_READ, NEXT_PLANNED * len(facts.robots)))
    return replace(
        facts,
        entered=tuple(sorted(entered, key=lambda m: (not m.favourite, m.name.casefold()))),
        planned=tuple(run for run in ahead if run.robot.id == robot.id)[:NEXT_PLANNED],
        finished=tuple(services.history.last_ended(robot.id, services.clock.now(), LAST_FINISHED)),
    )
