"""The page All robots: its robots, updated a few per frame, so that a poll of all of them blocks no frame."""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

from kivy.clock import Clock
from kivy.core.window import Window
from kivy.event import EventDispatcher
from kivy.properties import BooleanProperty, ListProperty, ObjectProperty, StringProperty

from app.database.robots import Hold
from app.domain.models import Execution, Robot, RobotSnapshot, Settings, State
from app.domain.robot import QueueItem, QueueState, RobotState
from app.i18n import _
from app.screens.common.robot_appearance import is_old
from app.screens.common.robot_groups import FEW, Group, group_of, help_words, or_held
from app.screens.common.shell import Shell
from app.screens.common.view_model import Changed, ViewModel
from app.screens.home.facts import HomeFacts, HomeServices
from app.screens.home.fleet import (
    LARGE_UP_TO,
    ROOMY_UP_TO,
    Count,
    Look,
    RobotTile,
    Work,
    all_well,
    arranged,
    counts,
    robot_tile,
    work,
)
from app.screens.home.waiting_model import NO_WAITING
from app.services.live.changes import Topic
from app.widgets import finger
from app.widgets.dialogs import ESCAPE
from app.widgets.dock import dock

PER_FRAME = 0.003  # s for looking at robots, and
NEW_PER_FRAME = 6  # tiles that become others; the rest waits for the next frame
EMPTY_FOR = 60.0  # s, after which a filter without robots ends
MOVING_PER_FRAME, NEW_WHILE_MOVING = 0.001, 1  # while it can't be read anyway
Running = tuple[int, int]  # robot, and the item of its queue that it executes


class FleetState(EventDispatcher):
    """Read by kv. ``many``: enough robots for the page; ``is_shown``: it is shown instead of one robot."""

    many = BooleanProperty(False)
    is_shown = BooleanProperty(False)
    tiles = ListProperty()
    large = BooleanProperty(True)
    roomy = BooleanProperty(False)  # small tiles have room next to them
    counts = ListProperty()
    is_well = BooleanProperty(False)
    needy_first = BooleanProperty(False)
    only = ObjectProperty(None, allownone=True)  # the group that is shown; None: all
    empty = StringProperty()
    moves = BooleanProperty(False)  # the list of tiles is being scrolled
    waiting = ObjectProperty(NO_WAITING, rebind=True)  # for a robot
    way_back = StringProperty()  # from one robot to all


@dataclass(frozen=True)
class Known:
    """A running mission: its name (empty: unknown), and its duration in s (None: unknown)."""

    mission: str
    usual_s: float | None = None


@dataclass(frozen=True)
class Seen:
    """A tile and its values: the tile is only rebuilt if they change."""

    robot: Robot
    snapshot: RobotSnapshot
    old: bool
    doing: Work | None
    holds: tuple[Hold, ...]
    group: Group
    tile: RobotTile


class FleetViewModel(FleetState, ViewModel):
    """Gets robots and runs from Home by ``take``, their states from the snapshots; ``open_robot(id)`` selects one."""

    def __init__(self, services: HomeServices, shell: Shell, open_robot: Callable[[int], object]) -> None:
        super().__init__()
        self._services, self._shell, self._open_robot = services, shell, open_robot
        self._settings, self._alarms = Settings(), 0
        self._holds: tuple[Hold, ...] = ()
        self._robots: Mapping[int, Robot] = {}  # in their places
        self._ours: Mapping[
            tuple[int, int | str], Execution
        ] = {}  # by robot and queue id, or token before that is stored
        self._followed: Mapping[int, int] = {}  # the queue id of the last item seen to begin, by robot
        self._known: dict[Running, Known] = {}
        self._unknown: dict[Running, str] = {}  # guid of the mission
        self._is_asking = False
        self._seen: dict[int, Seen] = {}
        self._counted: tuple[Mapping[int, Group], Look, int] | None = None  # groups, look and alarms, shown by:
        self._counts: list[Count] = []
        self._help, self._is_well = "", False  # how many need a person, whether nothing needs one
        self._waiting: dict[int, None] = {}  # robots to be looked at, in that order
        self._is_behind = True  # the page is not up to date
        self._is_withheld = False  # because of a finger on the screen
        self._is_first = True
        self._empty_since: float | None = None  # since when no robot is as the filter wants
        self._soon = Clock.create_trigger(self._look_at_some, 0)
        self.fbind("is_shown", shell.navigator.setter("all_robots"))

    def opened(self, *_args: Any, **_intent: Any) -> None:
        self.keep(self._shell.bus.subscribe(Changed, self._changed))
        self.keep(self._soon.cancel)
        Window.bind(on_keyboard=self._key)
        self.keep(lambda: Window.unbind(on_keyboard=self._key))
        self.every(1, self._tick)
        self._shell.navigator.all_robots = self.is_shown
        self._empty_since = None  # still shown from when the page was left
        self._tick()

    def retranslated(self) -> None:
        self._seen, self._counted = {}, None
        self._tick()

    # ------------------------------------------------------------------ what is known
    def take(self, facts: HomeFacts) -> None:
        """What Home has read."""
        self._settings, self._alarms, self._holds = facts.settings, facts.alarms, facts.holds
        self._robots = {robot.id: robot for robot in facts.robots}
        self._ours = {
            (e.robot_id, e.token if e.queue_id is None else e.queue_id): e for e in facts.open if e.robot_id is not None
        }
        self._followed = {
            e.robot_id: e.queue_id for e in facts.open if e.state is State.EXECUTING and e.robot_id and e.queue_id
        }
        self._seen = {robot_id: seen for robot_id, seen in self._seen.items() if robot_id in self._robots}
        self._waiting = dict.fromkeys(self._robots)
        self._is_behind = True
        self.many, self.large = len(self._robots) > FEW, len(self._robots) <= LARGE_UP_TO
        self.roomy = not self.large and len(self._robots) <= ROOMY_UP_TO
        self.is_shown = self.many and (self.is_shown or self._is_first)
        self._is_first = False
        if self.many:
            while len(self._seen) < len(self._robots):  # the first look shows all of them
                self._look_at(self._next())
            self._show()
            self._soon()

    def _changed(self, event: Changed) -> None:
        if event.topic is Topic.SNAPSHOT and event.about is not None and event.about in self._robots:
            self._waiting[event.about] = None
            self._soon()

    def _tick(self) -> None:
        """Once a second: update times, and mark old states."""
        self._waiting |= dict.fromkeys(self._robots)
        self._soon()
        self._end_empty_filter()

    def _end_empty_filter(self) -> None:
        """Show all robots again when the filter has matched none for EMPTY_FOR: on a wall screen the chip is not
        tapped."""
        now = Clock.get_time()
        if self.only is None or self.tiles:
            self._empty_since = None
        elif self._empty_since is None:
            self._empty_since = now
        elif now - self._empty_since >= EMPTY_FOR:
            self.only = None
            self._is_behind = True

    # ------------------------------------------------------------------ looking
    def _look_at_some(self, _dt: float) -> None:
        if not self.many:
            return
        if self._is_withheld:
            self._show()
            if self._is_withheld:  # else all changes would appear at once when the finger leaves
                self._soon()
                return
        seconds, most_new = (MOVING_PER_FRAME, NEW_WHILE_MOVING) if self.moves else (PER_FRAME, NEW_PER_FRAME)
        end, new = time.perf_counter() + seconds, 0
        while self._waiting and new < most_new and time.perf_counter() < end:
            new += self._look_at(self._next())
        if self._waiting:
            self._soon()
        self._learn()
        if self._is_behind:
            self._show()

    def _next(self) -> int:
        robot_id = next(iter(self._waiting))
        del self._waiting[robot_id]
        return robot_id

    def _look_at(self, robot_id: int) -> bool:
        """Whether its tile is another one now."""
        robot, snapshot, now = (
            self._robots[robot_id],
            self._services.snapshots.get(robot_id),
            self._services.clock.now(),
        )
        old = is_old(snapshot, now, self._settings)
        doing = None if old else self._doing(robot_id, snapshot)
        seen = self._seen.get(robot_id)
        holds = tuple(hold for hold in self._holds if hold.covers(robot_id, now))
        if (
            seen
            and (seen.robot, seen.old, seen.doing, seen.holds) == (robot, old, doing, holds)
            and seen.snapshot is snapshot
        ):
            return False
        group = or_held(group_of(robot, snapshot, old, self._settings), holds, robot, now)
        tile = robot_tile(robot, snapshot, doing, group, old, self._settings, now)
        self._seen[robot_id] = Seen(robot, snapshot, old, doing, holds, group, tile)
        is_new = seen is None or (seen.group, seen.tile) != (group, tile)
        self._is_behind |= is_new
        return is_new

    def _doing(self, robot_id: int, snapshot: RobotSnapshot) -> Work | None:
        item, status = self._running(robot_id, snapshot), snapshot.status
        if item is None:  # a mission started by others is only in its status until the queue is read
            return Work(status.mission_text) if status is not None and status.state is RobotState.EXECUTING else None
        ours, known = self._ours_of(robot_id, item), self._known.get((robot_id, item.id))
        if known is None:
            if guid := ours.mission_guid if ours else item.mission_id:
                self._unknown[robot_id, item.id] = guid
            return Work(self._shell.mission_names.known.run(ours) if ours else status.mission_text if status else "")
        if ours is None:
            return Work(known.mission or (status.mission_text if status else ""))
        elapsed = (self._services.clock.now() - ours.started_at).total_seconds() if ours.started_at else None
        return work(self._shell.mission_names.known.run(ours), elapsed, known.usual_s)

    def _running(self, robot_id: int, snapshot: RobotSnapshot) -> QueueItem | None:
        """By its status, as the queue of a robot that is not on screen is only read at polls; without a number there,
        by its queue or the followed run."""
        number = snapshot.status.mission_queue_id if snapshot.status else None
        is_it = (
            (lambda item: item.state is QueueState.EXECUTING) if number is None else (lambda item: item.id == number)
        )
        found = next(filter(is_it, snapshot.queue), None)
        number = self._followed.get(robot_id) if number is None else number
        return found if found is not None or number is None else QueueItem(number, QueueState.EXECUTING)

    def _ours_of(self, robot_id: int, item: QueueItem) -> Execution | None:
        return self._ours.get((robot_id, item.id)) or self._ours.get((robot_id, item.description))

    def _learn(self) -> None:
        """Names and usual durations of what runs, asked once for each run, as the database takes its time."""
        if self._is_asking or not self._unknown or not self.is_open:
            return
        self._is_asking = True
        wanted, self._unknown, services = self._unknown, {}, self._services

        def learnt(found: Mapping[Running, Known]) -> None:
            self._is_asking = False
            running = {
                (robot_id, item.id)
                for robot_id, seen in self._seen.items()
                if (item := self._running(robot_id, seen.snapshot)) is not None
            }
            self._known = {run: known for run, known in {**self._known, **found}.items() if run in running}
            self._waiting |= dict.fromkeys(robot_id for robot_id, _item in found if robot_id in self._robots)
            self._soon()

        def not_learnt(_problem: BaseException) -> None:
            self._is_asking = False

        self._shell.background.run(lambda: _learn(services, wanted), learnt, not_learnt)

    # ------------------------------------------------------------------ showing
    def _show(self, by_hand: bool = False) -> None:
        """Nothing moves under a finger, unless the user has just requested it."""
        look = Look(self.only, self.needy_first)
        groups = {robot_id: seen.group for robot_id, seen in self._seen.items()}
        if (groups, look, self._alarms) != self._counted:
            self._counted, self._counts = (groups, look, self._alarms), list(counts(groups, look))
            self._help, self._is_well = help_words(groups.values()), all_well(groups, self._alarms)
        self._is_withheld = not by_hand and finger.is_down() and (look != Look() or self._counts != self.counts)
        if self._is_withheld:
            return
        self._is_behind = False
        self.way_back = _("All robots · {help}").format(help=self._help) if self._help else _("All robots")
        if self.is_shown:
            self.counts, self.is_well = self._counts, self._is_well
            self.tiles = arranged(
                [self._seen[robot_id].tile for robot_id in self._robots if robot_id in self._seen], groups, look
            )
            self.empty = (
                _("No robot is like this now. Tap the chip with the cross to see all.") if self.only is not None else ""
            )

    # ------------------------------------------------------------------ what the operator presses
    def show_only(self, group: Group | None) -> None:
        """Show only the robots of ``group``; all of them if it is already the filter, or None."""
        self.only = None if group is self.only else group
        self._show(by_hand=True)

    def sort(self) -> None:
        """Show those that need a person first, or each in its place again."""
        self.needy_first = not self.needy_first
        self._show(by_hand=True)

    def open_robot(self, robot_id: int) -> None:
        """Its Home, in the place of the page."""
        self.leave()
        self._open_robot(robot_id)

    def leave(self) -> None:
        """Show one robot; what is looked at first, too."""
        self.is_shown = self._is_first = False

    def _key(self, _window: Any, key: int, *_args: Any) -> bool:
        """Esc and Android's back button lead from one robot to all. Open dialogs and menus go first."""
        goes_back = (
            key == ESCAPE and self.many and not self.is_shown and self._shell.dialogs.top is None and dock.field is None
        )
        if goes_back:
            self.come_back()
        return goes_back

    def come_back(self) -> None:
        """Open the page as it was left."""
        self.is_shown = self.many
        self._show(by_hand=True)


def _learn(services: HomeServices, wanted: Mapping[Running, str]) -> dict[Running, Known]:
    """Off the UI thread: what the database knows, never a robot."""
    names = {mission.guid: mission.name for mission in services.catalogue.missions()}
    found = {}
    for (robot_id, item_id), guid in wanted.items():
        expected = services.history.expected(robot_id, guid) if guid else None
        name = names.get(guid) or services.robot_missions.names(robot_id).get(guid) or ""
        found[robot_id, item_id] = Known(name, expected.median_s if expected else None)
    return found
