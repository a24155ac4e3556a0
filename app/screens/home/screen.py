"""Home: what is going on, and the commands to the robot. The facts are read in the background, turned into words once a second."""

from __future__ import annotations

import uuid
from collections.abc import Callable, Mapping, Sequence
from dataclasses import fields, replace
from datetime import datetime
from typing import Any

from kivy.core.window import Window
from kivy.metrics import dp, sp

from app.domain.robot import MissionParameter
from app.i18n import _
from app.screens.common.missing_mission import fetch_option, or_fetch
from app.screens.common.presses import OfRobot, Presses
from app.screens.common.shell import Shell
from app.screens.common.started import StartReports, as_it_is, say_not_started
from app.screens.common.view_model import Changed, Refresher, ViewModel
from app.screens.home.cards import HomeColumn, HomeEmpty, HomeTall, HomeWide
from app.screens.home.commands import HomeCommands
from app.screens.home.facts import HomeFacts, HomeServices, OnRobot, read
from app.screens.home.fleet_model import FleetViewModel
from app.screens.home.fleet_page import FleetPage
from app.screens.home.learning import Learning
from app.screens.home.map import robots_on_map
from app.screens.home.map_dialog import MapDialog
from app.screens.home.pages import ALL_ROBOTS, NO_ROBOT, Pages
from app.screens.home.reset import ResetReport
from app.screens.home.run_dialog import RunDialog
from app.screens.home.run_now import MANY_GROUPS, Target, aimed, chosen_group, group_options, mission_options, start
from app.screens.home.view import present
from app.screens.home.waiting_model import WaitingModel
from app.services.live.changes import Topic
from app.widgets import load_kv
from app.widgets.tokens import tk


class HomeViewModel(HomeCommands, ViewModel):
    """Reads the facts, shows them in words, and starts missions."""

    def __init__(self, services: HomeServices, shell: Shell) -> None:
        super().__init__()
        self._services, self._shell = services, shell
        self.fleet = FleetViewModel(services, shell, self.select_robot, self.command)
        self.fleet.fbind("is_shown", self._robot_left)
        self._reader = Refresher(shell, self._reading, self.take, self._not_read)
        self.facts = HomeFacts()
        self._started = StartReports(shell, as_it_is(services.history, services.holds))
        self._chosen: int | None = None
        self._asked_for: tuple[int, int] | None = None  # robot and mission whose parameters are shown
        self._wanted: Sequence[MissionParameter] = ()  # the parameters that it has
        self._is_asking = self._is_known = False  # the robot for them, and whether it has answered
        self._pressed: tuple[str, str] | None = None  # mission and robot or group for which Run was pressed
        self._seen_running: dict[OnRobot, datetime] = {}
        self._cancelling: set[OnRobot] = set()
        self._clearing: set[int] = set()  # ids of robots whose queues are being cleared
        self._reset = ResetReport(self._say)
        self._presses = Presses(self._update_busy)
        self._learning = Learning(services, shell, self._reader.request)
        self._target = Target()  # of Run now
        self.waiting = self.fleet.waiting = WaitingModel(services, shell, self._reader.request, self._started.follow)
        self._is_plan_old = True  # more than what the robots do has changed
        self._pausable: int | None = None  # id of the robot for which Pause is on screen

    # ------------------------------------------------------------------ reading
    def opened(self, robot_id: int | None = None) -> None:
        self.keep(self._shell.bus.subscribe(Changed, self._changed))
        self.keep(self._started.open())
        self._reset.forget()
        self.keep(self._reader.start())
        self.every(1, self._tick)
        self.fleet.open()
        self.keep(self.fleet.close)
        self._is_plan_old = True
        self._reader.read()
        if robot_id is not None:
            self.fleet.leave()
            self.select_robot(robot_id)

    def closed(self) -> None:
        self._run_no_more()

    def _robot_left(self, _fleet: FleetViewModel, shows_all: bool) -> None:
        if shows_all:
            self._run_no_more()

    def _changed(self, event: Changed) -> None:
        """Robots that are only chips are updated by the tick."""
        robot = self.facts.robot
        if event.topic is not Topic.SNAPSHOT:
            self._is_plan_old = True
        elif robot is not None and event.about != robot.id:
            return
        self._reader.request()

    def _tick(self) -> None:
        """Once a second."""
        robot = self.facts.robot
        others = {other.id: self._services.snapshots.get(other.id) for other in self.facts.robots if other is not robot}
        self.facts = replace(self.facts, snapshots={**self.facts.snapshots, **others})
        self._reset.look(self.facts)
        if self.waiting.is_old():
            self._is_plan_old = True
            self._reader.request()
        self._show()

    def retranslated(self) -> None:
        self._show()

    def _reading(self) -> Callable[[], HomeFacts]:
        known, seen_running = None if self._is_plan_old or self.facts.is_new else self.facts, self._seen_running
        self._is_plan_old = False
        return lambda: read(self._services, known, seen_running)

    def _reread(self) -> None:
        self._is_plan_old = True  # a dropped reading may have been the one with the answer
        self._reader.reread()

    def take(self, facts: HomeFacts) -> None:
        """Show what was read."""
        if "robot" in self.busy:  # the last choice is still being written
            facts = facts.about(self.facts.settings.selected_robot_id)
        self.facts = facts
        if self._target.group_id is not None and chosen_group(facts, self._target) is None:
            self._aim(Target())  # it was deleted
        self._note_running()
        self._learning.look(facts)
        self.waiting.take(facts)
        self._reset.look(facts)
        self.fleet.take(facts)
        self.loaded = True
        self._show()

    def _not_read(self, problem: BaseException) -> None:
        self._is_plan_old = True
        self._shell.say_problem(problem)

    def _note_running(self) -> None:
        """Since when this tablet has seen an item run; when our own began is stored with the execution."""
        facts, running = self.facts, self.facts.running
        seen = facts.on_robot(running) if running else None
        self._seen_running = {seen: self._seen_running.get(seen) or self._services.clock.now()} if seen else {}
        self._cancelling &= {
            (robot_id, item.id) for robot_id, snapshot in facts.snapshots.items() for item in snapshot.queue
        }
        self.facts = replace(
            self.facts,
            seen_running=self._seen_running,
            cancelling=frozenset(self._cancelling),
            clearing=frozenset(self._clearing),
            mission_names=self._shell.mission_names.known,
        )

    def _show(self) -> None:
        now = self._services.clock.now()
        view = present(replace(self.facts, reset_without_effect=self._reset.without_effect), now, self._chosen)
        view = replace(view, run=aimed(view.run, self.facts, self._target, now))
        robot_id = self._shell.navigator.robot_id = self.facts.robot.id if self.facts.robot is not None else None
        if robot_id is not None and robot_id == self._pausable and not view.controls.pauses:
            self._presses.rest(OfRobot("pause", robot_id))  # a finger about to press Pause must not resume
        self._pausable = robot_id if view.controls.pauses else None
        for field in fields(view):
            value = getattr(view, field.name)
            setattr(self, field.name, list(value) if isinstance(value, tuple) else value)
        self._update_busy()
        self._ask_parameters()

    # ------------------------------------------------------------------ which robot, which mission
    def select_robot(self, robot_id: int) -> None:
        """Select it for the whole app, where another one may have been selected since this screen was read."""
        is_shown = self.facts.robot is not None and robot_id == self.facts.robot.id
        self.facts = self.facts.about(robot_id)
        if not is_shown:
            self._aim(Target())
            self._chosen = None
            self._show()
        self._keep_selection()

    def _keep_selection(self) -> None:
        """Until the last choice is written, however fast they follow each other."""
        wanted = self.facts.settings.selected_robot_id
        self._act(
            "robot",
            lambda: self._services.catalogue.change_settings(selected_robot_id=wanted),
            lambda _done: None if self.facts.settings.selected_robot_id == wanted else self._keep_selection(),
        )

    def add_robot(self) -> None:
        self._shell.go("settings", section="robots", add=True)

    def open_run(self, execution_id: int) -> None:
        """Its story, in Logs."""
        self._shell.go("logs", execution_id=execution_id)

    def open_schedule(self, key: tuple[int, datetime]) -> None:
        """What a planned start comes from, in Scheduler."""
        self._shell.go("scheduler", schedule_id=key[0])

    def open_map(self) -> None:
        self._shell.dialogs.open(MapDialog(self, lambda: robots_on_map(self.facts, self._services.clock.now())))

    def pick_mission(self) -> None:
        self._shell.dialogs.choose(
            _("Mission to run"),
            mission_options(self.facts, self._target),
            or_fetch(self._shell, self.choose_mission),
            selected=self.run.mission_id,
            last=fetch_option(),
        )

    def choose_mission(self, mission_id: int) -> None:
        self._chosen = mission_id
        self._show()

    def choose_target(self, target: tuple[str, int]) -> None:
        """Of Run now: ("group", id), ("robot", id of the selected one), or the list of groups."""
        if target == MANY_GROUPS:
            self._shell.dialogs.choose(_("Run on"), group_options(self.facts), self.choose_target)
            return
        self._aim(Target(target[1]) if target[0] == "group" else Target())
        if (group := chosen_group(self.facts, self._target)) is not None:
            self._learning.learn_names(group.members)
        self._show()

    def go_first(self, wanted: bool) -> None:
        """Of Run now on a group: before everything else."""
        self._aim(replace(self._target, first=wanted))
        self._show()

    def _aim(self, target: Target) -> None:
        """What was pressed for another one is not run on this."""
        self._run_no_more()
        self._target, self.goes_first = target, target.first

    def _ask_parameters(self) -> None:
        """Ask the robot which parameters the chosen mission has."""
        robot, mission_id = self.facts.robot, self.run.mission_id
        wanted = (robot.id, mission_id) if robot is not None and mission_id is not None else None
        if wanted == self._asked_for:
            return
        self._asked_for = wanted
        self._run_no_more()
        self._take_parameters(wanted, None)
        self._ask_robot()

    def _ask_robot(self) -> None:
        robot, wanted = self.facts.robot, self._asked_for
        mission = next((m for m in self.facts.missions if wanted is not None and m.id == wanted[1]), None)
        if robot is None or mission is None:
            return
        self._is_asking = True

        def take(found: Sequence[MissionParameter]) -> None:
            self._shell.mission_names.take(mission.guid, found)
            self._take_parameters(wanted, found)

        self._shell.background.run(
            lambda: self._services.robot_missions.parameters(robot.id, mission.guid),
            take,
            lambda _problem: self._take_parameters(
                wanted, self._shell.mission_names.known.parameters.get(mission.guid)
            ),
            key=("home", "parameters"),
            apart="parameters",
        )

    def _take_parameters(self, asked_for: tuple[int, int] | None, found: Sequence[MissionParameter] | None) -> None:
        """From this robot or, if it does not answer, another one. None: no answer; Run asks again, and sends none if
        there is still no answer."""
        if asked_for != self._asked_for:
            return
        self._wanted, self.asks, self._is_known, self._is_asking = found or (), bool(found), found is not None, False
        if self._pressed is None:
            return
        if self.run.off:
            self._run_no_more(self.run.text)
            return
        self._end_waiting()
        if found is None:
            self._run({})
        else:
            self.run_now()

    def _wait_to_run(self) -> None:
        """Run was pressed before the mission's parameters are known."""
        self._pressed = self._aim_in_words()
        self._presses.begin("run")
        if not self._is_asking:
            self._ask_robot()

    def _end_waiting(self) -> None:
        self._pressed = None
        self._presses.end("run")

    def _run_no_more(self, why: str = "") -> None:
        """The mission of the pressed Run is no longer shown, or can't be run: it is not started, and a message says
        so."""
        if (pressed := self._pressed) is not None:
            self._end_waiting()
            say_not_started(self._shell, *pressed, why or _("The values that it asks for were not known yet"))

    def _aim_in_words(self) -> tuple[str, str]:
        """Mission and robot or group of Run now."""
        aim = chosen_group(self.facts, self._target) or self.facts.robot
        return self.run.mission, aim.name if aim is not None else ""

    # ------------------------------------------------------------------ what the operator presses
    def run_now(self) -> None:
        """At once, or as soon as it is known whether the mission has parameters; these are asked for first."""
        if self.run.off or self._presses.is_same("run"):
            return
        if not self._is_known and not self.card.old:
            self._wait_to_run()
        elif self._wanted:
            self._ask_for_values()
        else:
            self._run({})

    def _ask_for_values(self) -> None:
        """They run on what they were entered for, or not at all."""
        asked, pressed = (self._asked_for, self._target), self._aim_in_words()

        def entered(_dialog: RunDialog, values: Mapping[str, Any]) -> None:
            if asked == (self._asked_for, self._target):
                self._run(values)
            else:
                say_not_started(self._shell, *pressed, _("Robot, group or mission has changed since then"))

        dialog = RunDialog(self._wanted, vm=self)
        dialog.bind(on_run=entered)
        self._shell.dialogs.open(dialog)

    def _run(self, parameters: Mapping[str, Any]) -> None:
        """One press, one mission: the token is made here, and the button waits until the execution is on disk."""
        robot, run = self.facts.robot, self.run
        if robot is None or run.off or run.mission_id is None:
            return
        token, mission_id, target = str(uuid.uuid4()), run.mission_id, self._target
        is_held = self.facts.hold(robot.id, self._services.clock.now()) is not None
        is_silent = (
            target.group_id is None and self.card.old and not is_held
        )  # now: another robot may be shown when it is on disk

        def submit() -> None:
            self._act(
                "run",
                lambda: start(self._services.operator, target, robot.id, mission_id, parameters, token),
                lambda execution: self._started.follow(execution, is_silent),
            )

        if run.low_battery:
            self._shell.dialogs.confirm(
                _("Run {mission} anyway?").format(mission=run.mission), run.low_battery, _("Run"), submit
            )
        else:
            submit()

    def _update_busy(self) -> None:
        robot_id = self.facts.robot.id if self.facts.robot is not None else None
        self.busy = self._presses.names(robot_id)
        self.pause_rests = robot_id is not None and self._presses.is_same(OfRobot("pause", robot_id))


class HomeScreen(Pages):
    """Three columns in landscape; bands in portrait, and in a window too small for the columns; one column in a narrow
    one; all robots if there are many, until one is chosen; and an invitation without robots."""

    Services = HomeServices

    def __init__(self, services: HomeServices, shell: Shell, **kwargs: Any) -> None:
        load_kv("widgets/flow", "home/cards", "home/waiting", "home/screen", "home/fleet")
        super().__init__(vm=HomeViewModel(services, shell), **kwargs)
        for name in ("loaded", "has_robots"):
            self.vm.fbind(name, self._choose_layout)
        self.vm.fleet.fbind("is_shown", self._choose_layout)
        for name in ("portrait", "size"):
            self.fbind(name, self._choose_layout)
        self._choose_layout()

    def _choose_layout(self, *_: Any) -> None:
        if not self.vm.loaded:
            return
        layout = NO_ROBOT if not self.vm.has_robots else ALL_ROBOTS if self.vm.fleet.is_shown else self._fitting()
        kind = {NO_ROBOT: HomeEmpty, "column": HomeColumn, "tall": HomeTall, "wide": HomeWide, ALL_ROBOTS: FleetPage}[
            layout
        ]
        self.turn_to(layout, lambda: kind(vm=self.vm.fleet if layout == ALL_ROBOTS else self.vm))

    def place(self) -> dict[str, Any]:
        """All robots is where Home begins by itself."""
        robot = self.vm.facts.robot
        return {"robot_id": robot.id} if robot is not None and self.vm.fleet.many and not self.vm.fleet.is_shown else {}

    def _fitting(self) -> str:
        """By the window's height, not the screen's, which changes with every alarm: a field in use would be rebuilt."""
        if self.width < dp(660):
            return "column"
        around = dp(64 + 64 + 32) + dp(97)  # bars, margins, and a banner of two lines
        fixed = 2 * tk.h_action + dp(56) + sp(14)  # the robots' strip and the controls
        is_small = self.width < dp(890) or Window.height - around - fixed < sp(110)
        return "tall" if self.portrait or is_small else "wide"
