"""The page All robots: its robots, updated a few per frame, so that a poll of all of them blocks no frame."""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from datetime import datetime
from typing import Any

from kivy.clock import Clock
from kivy.core.window import Window
from kivy.event import EventDispatcher
from kivy.properties import BooleanProperty, ListProperty, ObjectProperty, StringProperty

from app.database.robots import Hold
from app.domain.execution import Execution, State
from app.domain.models import Group as RobotGroup
from app.domain.models import Robot, RobotSnapshot, Settings
from app.i18n import _
from app.screens.common import formats
from app.screens.common.robot_appearance import ANSWERS, is_old
from app.screens.common.robot_groups import FEW, NEEDS_HELP, Group, count_words, free_words, group_of, or_held
from app.screens.common.shell import Shell
from app.screens.common.view_model import Changed, ViewModel
from app.screens.home.facts import HomeFacts, HomeServices
from app.screens.home.fleet import (
    GROUPED_OVER,
    Cause,
    Look,
    Pane,
    causes,
    counts,
    halls_of,
    heading,
    heads,
    listed,
    look,
    minutes_left,
    more_than_on_wall,
    of_group,
    pane_of,
    to_do,
    troubles_in_words,
)
from app.screens.home.fleet_known import Known
from app.screens.home.waiting import waiting_rows, waiting_title
from app.screens.home.wall import Wall
from app.services.live.changes import Topic
from app.widgets import finger
from app.widgets.dock import dock
from app.widgets.items import Item
from app.widgets.menu import ESCAPE
from app.widgets.rest import BY_ITSELF, rest

PER_FRAME = 0.003  # s for looking at robots, and
NEW_PER_FRAME = 6  # cells that become others; the rest waits for the next frame
MOVING_PER_FRAME, NEW_WHILE_MOVING = 0.001, 1  # while it can't be read anyway
READ_EVERY = (
    5.0  # s, every robot while they are shown: by itself it is read more seldom, as one that nothing is asked of; and
)
READ_A_SECOND = 10  # robots at most
SEARCH = "search"  # what the list shows, instead of a group or a cause


class FleetState(EventDispatcher):
    """Read by kv. ``many``: enough robots for the page; ``is_shown``: it is shown instead of one robot."""

    many = BooleanProperty(False)
    is_shown = BooleanProperty(False)
    cells = ListProperty()  # of all robots, or of the open group
    above = ListProperty()  # heads of the groups before it, with its own (none: there are no groups), and
    below = ListProperty()  # after it
    counts = ListProperty()
    heading = StringProperty()  # where there is no list
    heading_icon = StringProperty()
    pane = ObjectProperty(Pane(), rebind=True)
    tight = BooleanProperty(False)  # the list has little width for its words
    searches = BooleanProperty(False)
    query = StringProperty()
    order = ObjectProperty(None, allownone=True)  # another one when the operator chose other cells
    moves = BooleanProperty(False)  # the cells are being scrolled
    wall = ObjectProperty(None, rebind=True, allownone=True)


@dataclass(frozen=True)
class Seen:
    """What a robot's look was made of: it is only made again if that changes."""

    snapshot: RobotSnapshot
    known: tuple[object, ...]
    look: Look


class FleetViewModel(FleetState, ViewModel):
    """Gets robots and runs from Home by ``take``, their states from the snapshots; ``open_robot(id)`` selects one, and
    ``command(robot, name, helps)`` sends one of Home's commands; ``helps``: the robot still needs it.
    ``act_on_start(id, name)`` is for a start that waits for a robot."""

    def __init__(
        self,
        services: HomeServices,
        shell: Shell,
        open_robot: Callable[[int], object],
        command: Callable[[Robot, str, bool], object],
        act_on_start: Callable[[int, str], object],
    ) -> None:
        super().__init__()
        self._services, self._shell = services, shell
        self._open_robot, self._command, self._act_on_start = open_robot, command, act_on_start
        self._starts: tuple[Item, ...] = ()  # that wait for a robot
        self._settings, self._has_alarms = Settings(), False
        self._holds: tuple[Hold, ...] = ()
        self._groups: tuple[RobotGroup, ...] = ()
        self._robots: Mapping[int, Robot] = {}  # in their places
        self._halls: Mapping[int, int] = {}  # the place of each robot's group, if they are too many for one page
        self._open_hall: int | None = None
        self._runs: Mapping[int, Execution] = {}  # under way, by robot
        self._known = Known(services, shell, self._learnt)
        self._seen: dict[int, Seen] = {}
        self._chosen: Group | Cause | str | None = None  # what the list shows instead of all that needs a person
        self._waiting: dict[int, None] = {}  # robots to be looked at, in that order
        self._is_behind = True  # the page is not up to date
        self._is_withheld = False  # because of a finger on the screen
        self._is_first = True
        self._read_at = 0.0  # s of kivy's clock
        self.wall = Wall()
        self._soon = Clock.create_trigger(self._look_at_some, 0)
        self.fbind("is_shown", shell.navigator.setter("all_robots"))
        for name in ("query", "tight"):
            self.fbind(name, lambda *_args: self._show(by_hand=True))

    def opened(self, *_args: Any, **_intent: Any) -> None:
        self.keep(self._shell.bus.subscribe(Changed, self._changed))
        self.keep(self._soon.cancel)
        Window.bind(on_keyboard=self._key)
        self.keep(lambda: Window.unbind(on_keyboard=self._key))
        self.keep(self.wall.watch())
        self.every(1, self._tick)
        self._shell.navigator.all_robots = self.is_shown
        self.keep(self._known.open())
        self._chosen, self.searches, self.query = None, False, ""  # an old choice would hide who needs a person
        self.retranslated()

    def retranslated(self) -> None:
        self._seen = {}
        self._look_at_all()
        self._tick()

    # ------------------------------------------------------------------ what is known
    def take(self, facts: HomeFacts) -> None:
        """What Home has read."""
        self._settings, self._has_alarms, self._holds, self._groups = (
            facts.settings,
            facts.has_alarms,
            facts.holds,
            facts.groups,
        )
        self._robots = {robot.id: robot for robot in facts.robots}
        self._halls = halls_of(self._robots, facts.groups) if len(self._robots) > GROUPED_OVER and facts.groups else {}
        self._runs = {e.robot_id: e for e in facts.open if e.state is State.EXECUTING and e.robot_id is not None}
        self._starts = waiting_rows(facts)
        self._known.keep_runs({e.id for e in facts.open})
        self._seen = {robot_id: seen for robot_id, seen in self._seen.items() if robot_id in self._robots}
        self._waiting = {robot_id: None for robot_id in self._waiting if robot_id in self._robots}
        self._is_behind = True
        self.many = len(self._robots) > FEW
        self.is_shown = self.many and (self.is_shown or self._is_first)
        self._is_first = False
        if self.many:
            self._look_at_all()
            self._show()
            self._tick()

    def _look_at_all(self) -> None:
        """At those that were not looked at yet, so that the first look shows all of them."""
        for robot_id in [robot_id for robot_id in self._robots if self.many and robot_id not in self._seen]:
            self._look_at(robot_id)

    def _changed(self, event: Changed) -> None:
        if event.topic is Topic.SNAPSHOT and event.about is not None and event.about in self._robots:
            self._waiting[event.about] = None
            self._soon()

    def _tick(self) -> None:
        """Once a second: update times, and mark old states."""
        self._waiting |= dict.fromkeys(self._robots)
        self._soon()
        if self.is_shown and Clock.get_time() - self._read_at >= max(READ_EVERY, len(self._robots) / READ_A_SECOND):
            self._read_at = Clock.get_time()
            self._services.engine.request_cycle()
            self._known.ask_again()
        self.wall.clock = formats.clock_time(self._services.clock.now(), self._settings.timezone)
        is_covered = self._shell.dialogs.top is not None or self._shell.sheets.top is not None
        self.wall.look(self.wall.is_kiosk and self.is_shown and not is_covered)
        if self.wall.is_on and self._chosen is not None:
            self.show_only(None)

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
            new += self._look_at(next(iter(self._waiting)))
        if self._waiting:
            self._soon()
        if self._is_behind:
            self._show()

    def _look_at(self, robot_id: int) -> bool:
        """Whether it looks different now."""
        self._waiting.pop(robot_id, None)
        robot, snapshot, now = (
            self._robots[robot_id],
            self._services.snapshots.get(robot_id),
            self._services.clock.now(),
        )
        seen, old = self._seen.get(robot_id), is_old(snapshot, now, self._settings)
        left = None if old else self._left(robot_id, snapshot, now)
        holds = tuple(hold for hold in self._holds if hold.covers(robot_id, now))
        free = free_words(robot, self._robots.values(), self._services.snapshots.get, self._settings, now)
        now_known = (robot, old, left, holds, free)
        if seen and seen.snapshot is snapshot and seen.known == now_known:
            return False
        group = or_held(group_of(robot, snapshot, old, self._settings), holds, robot, now)
        new = look(robot, snapshot, group, old, self._settings, left, free=free)
        new = replace(new, since=self._began(new, snapshot, seen.look if seen else None, now))
        self._seen[robot_id] = Seen(snapshot, now_known, new)
        is_new = seen is None or seen.look != new
        self._is_behind |= is_new
        if seen is not None and new.group is Group.STOPPED is not seen.look.group and dock.field is None:
            self._chosen, self.searches = None, False  # it is the worst of all that needs a person
        return is_new

    def _began(self, new: Look, snapshot: RobotSnapshot, before: Look | None, now: datetime) -> datetime | None:
        """Since when it needs a person, as far as that is known."""
        if new.group is Group.SILENT:
            return snapshot.read_at if snapshot.connection in ANSWERS else snapshot.since
        if new.group not in NEEDS_HELP:
            self._known.ended(new.robot.id)
            return None
        is_same = before is not None and (before.group, before.cell.icon) == (new.group, new.cell.icon)
        if before is not None and before.is_known and not is_same:
            self._known.began(new.robot.id, now)
        return self._known.since(new.robot.id)

    def _learnt(self) -> None:
        self._seen = {
            robot_id: seen
            for robot_id, seen in self._seen.items()
            if seen.look.since is not None or seen.look.group not in NEEDS_HELP
        }
        self._look_at_all()
        self._tick()

    def _left(self, robot_id: int, snapshot: RobotSnapshot, now: datetime) -> int | None:
        """How many minutes the robot's run still takes; of others' it is not known when they began."""
        run, number = self._runs.get(robot_id), snapshot.status.mission_queue_id if snapshot.status else None
        if run is None or run.started_at is None or number not in (None, run.queue_id):
            return None
        usual = self._known.usual(run)
        return minutes_left(usual.left_s((now - run.started_at).total_seconds())) if usual and usual.median_s else None

    # ------------------------------------------------------------------ showing
    def _show(self, by_hand: bool = False) -> None:
        """Nothing moves under a finger, unless the user has just requested it."""
        looks = [self._seen[robot_id].look for robot_id in self._robots if robot_id in self._seen]
        groups = [each.group for each in looks if not each.robot.is_any]
        pane, shown = self._pane(looks), counts(groups, self._chosen if isinstance(self._chosen, Group) else None)
        self._is_withheld = not by_hand and finger.is_down() and (pane, list(shown)) != (self.pane, self.counts)
        if self._is_withheld:
            return
        self._is_behind = False
        if not self.is_shown:
            return
        if bool(pane.title) != bool(self.pane.title) and not by_hand:
            rest.after_opening(BY_ITSELF)  # all cells move, and buttons come in their places
        self.counts, self.pane = list(shown), pane
        self.heading, self.heading_icon = heading(looks, self._has_alarms)
        self._show_cells(looks)

    def _show_cells(self, looks: list[Look]) -> None:
        if not self._halls:
            self.above, self.cells, self.below = [], [each.cell for each in looks], []
            return
        if self._open_hall not in self._halls.values():
            needy = sorted((each for each in looks if each.group in NEEDS_HELP), key=lambda each: each.rank)
            self._open_hall = self._halls[needy[0].robot.id] if needy else min(self._halls.values())
        all_heads = heads(looks, self._halls, self._groups, self._open_hall)
        at = next(n for n, head in enumerate(all_heads) if head.is_open)
        cells = [each.cell for each in looks if self._halls[each.robot.id] == self._open_hall]
        above, below = list(all_heads[: at + 1]), list(all_heads[at + 1 :])
        self.above, self.cells, self.below = above, cells, below

    def _pane(self, looks: list[Look]) -> Pane:
        chosen, zone, now = self._chosen, self._settings.timezone, self._services.clock.now()
        if chosen == SEARCH:
            wanted = self.query.casefold().strip()
            rows = listed(each for each in looks if wanted in each.robot.name.casefold())
            return Pane(_("Search"), "" if rows else _("Nothing found"), rows, True)
        if isinstance(chosen, Group) and (same := of_group(looks, chosen)):
            return Pane(count_words(chosen, len(same)), "", listed(same), True)
        if isinstance(chosen, tuple) and (same := causes(looks, zone).get(chosen, [])):
            return pane_of(same, chosen[2])
        self._chosen = None
        halls = {robot: self._groups[n].name for robot, n in self._halls.items() if n < len(self._groups)}
        rows = to_do(looks, self._settings, now, halls, self.tight)
        return Pane(
            troubles_in_words(looks) or waiting_title(len(self._starts)),
            "",
            rows + self._starts,
            more=more_than_on_wall(looks, zone),
        )

    # ------------------------------------------------------------------ what the operator presses
    def show_only(self, chosen: Group | Cause | str | None) -> None:
        """List the robots of a group or of a cause, or those that are searched for; what needs a person if these are
        listed already, or None."""
        self._chosen = None if chosen == self._chosen else chosen
        self.searches = self._chosen == SEARCH
        self.query = ""
        self._show(by_hand=True)

    def act(self, key: Any, name: str) -> None:
        """A row of the list was used."""
        if isinstance(key, tuple) and key[0] == "start":
            self._act_on_start(key[1], name)
        elif isinstance(key, tuple):
            self.show_only(key)
        elif (seen := self._seen.get(key)) is None:
            return
        elif name == "open":
            self.open_robot(key)
        else:
            self._command(seen.look.robot, name, name == seen.look.remedy)

    def open_cell(self, key: Any) -> None:
        """Of a robot, or of a group of them."""
        if isinstance(key, tuple):
            self._open_hall = self.order = key[1]
            self._show(by_hand=True)
        else:
            self.open_robot(key)

    def open_robot(self, robot_id: int) -> None:
        """Its Home, in the place of the page."""
        self.leave()
        self._open_robot(robot_id)

    def leave(self) -> None:
        """Show one robot; what is looked at first, too."""
        self.is_shown = self._is_first = False

    def _key(self, _window: Any, key: int, *_args: Any) -> bool:
        """Esc and Android's back button lead from one robot to all, and there to all that needs a person. Open dialogs
        and menus go first."""
        if key != ESCAPE or not self.many or self._shell.dialogs.top is not None or dock.field is not None:
            return False
        if self.is_shown and self._chosen is None:
            return False
        if self.is_shown:
            self.show_only(None)
        else:
            self.come_back()
        return True

    def come_back(self) -> None:
        """Open the page as it was left."""
        self.is_shown = self.many
        self._show(by_hand=True)
