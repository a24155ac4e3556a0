"""Home: what is going on, and the commands to the robot. The facts are read in the background, turned into words once a second."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Any

from kivy.core.window import Window
from kivy.metrics import dp, sp
from kivy.properties import BooleanProperty, ListProperty, StringProperty
from kivy.uix.widget import Widget

from app.i18n import _, languages, translator
from app.screens.common import formats
from app.screens.common.group_starts import GroupStarts, robots_for
from app.screens.common.presses import Commands, Presses
from app.screens.common.robot_appearance import why_not
from app.screens.common.shell import PROBLEM_SECONDS, Shell
from app.screens.common.started import StartReports
from app.screens.common.view_model import Changed, Refresher, ScreenBase, ViewModel
from app.screens.home.card import battery_words, can_reset
from app.screens.home.cards import HomeEmpty, HomeLow, HomeSmall, HomeTall, HomeWide, MapPage
from app.screens.home.commands import HomeCommands, ResetReport, foot_of
from app.screens.home.facts import HomeFacts, HomeServices, read
from app.screens.home.fleet_model import READ_EVERY, FleetViewModel
from app.screens.home.fleet_page import FleetPage
from app.screens.home.learning import Learning
from app.screens.home.map import robots_on_map
from app.screens.home.sending import Sending
from app.screens.home.view import ALL_ROBOTS, present, tabs
from app.screens.home.waiting import others_for
from app.services.live.changes import Topic
from app.widgets import load_kv
from app.widgets.items import Option
from app.widgets.rest import rest

NO_ROBOT, MAP = "empty", "map"
LAYOUTS = {
    ALL_ROBOTS: FleetPage,
    NO_ROBOT: HomeEmpty,
    "small": HomeSmall,
    "low": HomeLow,
    "tall": HomeTall,
    "wide": HomeWide,
    MAP: MapPage,
}


class HomeViewModel(HomeCommands, ViewModel):
    """Reads the facts and shows them in words."""

    tabs = ListProperty()
    shows_map = BooleanProperty(False)

    def __init__(self, services: HomeServices, shell: Shell) -> None:
        super().__init__()
        self._services, self._shell = services, shell
        self.sheets = shell.sheets
        self.fleet = FleetViewModel(services, shell, self.select_robot, self.command, self.act_on_start)
        self.fleet.fbind("is_shown", self._robot_left)
        self._reader = Refresher(shell, self._reading, self.take, self._not_read)
        self.facts = HomeFacts()
        self.started = StartReports(self, shell, services.history)
        self._reset = ResetReport(
            lambda text: shell.snackbars.show(text, icon="alert-circle-outline", seconds=PROBLEM_SECONDS)
        )
        self._presses = Presses(self._update_busy)
        self.act_once = Commands(shell, self._reread, self._presses).run
        self.learning = Learning(services, shell, self._reader.request)
        self._group_starts = GroupStarts(
            services.operator,
            services.catalogue,
            shell,
            self._reader.request,
            self.started.follow,
            lambda number: next((row for row in self.facts.open if row.id == number), None),
        )
        self._is_plan_old = True  # more than what the robots do has changed
        self._foot = (0, "")  # robot, and what the button on screen does
        self.sending = Sending(services, shell, self)
        self.fbind("room", lambda *_args: self._show())

    # ------------------------------------------------------------------ reading
    def opened(self, robot_id: int | None = None) -> None:
        self.keep(self._shell.bus.subscribe(Changed, self._changed))
        self.every(READ_EVERY, self._read_again)
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

    def _robot_left(self, _fleet: FleetViewModel, shows_all: bool) -> None:
        self.shows_map = False
        if shows_all:
            self.sending.close()

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
        self._show()

    def _read_again(self) -> None:
        """What changes without an event: which robots are free of the fleet whose any robot is shown, and for what starts of groups
        wait."""
        if any(run.group_id is not None and run.queue_id is None for run in self.facts.open):
            self._is_plan_old = True
            self._reader.request()
        robot = self.facts.robot
        for each in self.facts.robots:
            if robot is not None and robot.is_any and each.fleet_id == robot.fleet_id:
                self._services.engine.poll(each.id)

    def retranslated(self) -> None:
        self._show()

    def _reading(self) -> Callable[[], HomeFacts]:
        known, seen_running = None if self._is_plan_old or self.facts.is_new else self.facts, self.facts.seen_running
        self._is_plan_old = False
        return lambda: read(self._services, known, seen_running)

    def _reread(self) -> None:
        self._is_plan_old = True  # a dropped reading may have been the one with the answer
        self._reader.reread()

    def take(self, facts: HomeFacts) -> None:
        """Show what was read."""
        if "robot" in self.busy:  # the last choice is still being written
            facts = facts.about(self.facts.settings.selected_robot_id)
        self.facts = self._with_own(facts)
        self.learning.look(facts)
        self._reset.look(facts)
        self.fleet.take(self.facts)
        self.loaded = True
        self._show()

    def _not_read(self, problem: BaseException) -> None:
        self._is_plan_old = True
        self._shell.say_problem(problem)

    def _with_own(self, facts: HomeFacts) -> HomeFacts:
        """With what this tablet alone knows: since when it has seen an item run (when our own began is stored with the
        execution), and what was pressed."""
        before, running = self.facts, facts.running
        seen = facts.on_robot(running) if running else None
        queued = {(robot_id, item.id) for robot_id, snapshot in facts.snapshots.items() for item in snapshot.queue}
        return replace(
            facts,
            answered=before.answered,
            seen_running={seen: before.seen_running.get(seen) or self._services.clock.now()} if seen else {},
            cancelling=before.cancelling & queued,
            clearing=frozenset(each.id for each in facts.robots if "clear" in self._presses.names(each.id)),
            mission_names=self._shell.mission_names.known,
        )

    def _show(self) -> None:
        now = self._services.clock.now()
        facts = replace(self.facts, reset_without_effect=self._reset.without_effect)
        self.view = present(facts, now, self.room)
        robot_id = self._shell.navigator.robot_id = self.facts.robot.id if self.facts.robot is not None else None
        was, self._foot = self._foot, (robot_id or 0, self.view.card.foot.action)
        if was[0] == robot_id and was != self._foot:
            self._presses.rest(foot_of(robot_id))  # a finger about to press it must not do what it does now
        self.tabs = tabs(self.facts, robot_id, now)
        if self.shows_map:
            self.robots_on_map = list(robots_on_map(self.facts, now))
        self._update_busy()
        self.sending.show()

    # ------------------------------------------------------------------ which robot
    def select_robot(self, robot_id: int) -> None:
        """Select it for the whole app, where another one may have been selected since this screen was read."""
        is_shown = self.facts.robot is not None and robot_id == self.facts.robot.id
        self.facts = self.facts.about(robot_id)
        if not is_shown:
            self.shows_map = False
            self.sending.close(but=robot_id)
            self._show()
        self._keep_selection()

    def _keep_selection(self) -> None:
        """Until the last choice is written, however fast they follow each other."""
        wanted = self.facts.settings.selected_robot_id
        self.act_once(
            "robot",
            lambda: self._services.catalogue.change_settings(selected_robot_id=wanted),
            lambda _done: None if self.facts.settings.selected_robot_id == wanted else self._keep_selection(),
        )

    def go_to_settings(self, section: str, **intent: Any) -> None:
        self._shell.go("settings", section=section, **intent)

    @property
    def can_restore(self) -> bool:
        return self._shell.restore is not None

    def other_language(self, *_present: object) -> str:
        """In its own word."""
        return formats.language_name(_other_language())

    def change_language(self) -> None:
        wanted = _other_language()
        self._shell.background.run(lambda: self._services.catalogue.change_settings(language=wanted))

    # ------------------------------------------------------------------ what the operator presses
    def act(self, key: tuple[Any, ...], name: str) -> None:
        """A row of Today was used."""
        match key[0], name:
            case "planned", "open":
                self._shell.go("scheduler", schedule_id=key[1])
            case _, "open":
                self._shell.go("logs", execution_id=key[1])
            case "waiting", _:
                self.act_on_start(key[1], name)
            case _, "cancel":
                self.cancel((key[0], key[1]))

    def act_on_start(self, execution_id: int, name: str) -> None:
        """One that waits for a robot, of Today or of the list of all robots, or that a silent robot may have."""
        facts, robot = self.facts, self.facts.robot
        row = next((row for row in facts.open if row.id == execution_id), None)
        if robot is None or row is None:
            return
        match name:
            case "cancel":
                self._group_starts.cancel(row)
            case "give" if row.robot_id is not None:
                self._group_starts.start_on_another(row, others_for(facts, row))
            case "give":
                now = self._services.clock.now()
                options = robots_for(row, facts.robots, facts.groups, facts.holds, facts.settings, now)
                self._group_starts.give(row, options)
            case "here" if row.robot_id is not None:
                self._group_starts.start_also(row, robot.id, robot.name)
            case "here":
                self._group_starts.assign(row, robot.id)

    def show_more(self, anchor: Widget) -> None:
        """What is seldom done to the queue."""
        items = [
            Option(
                "clear", _("Clear queue"), "playlist-remove", off="" if self.view.clear_count else _("Nothing to clear")
            )
        ]
        seen = self.facts.snapshot
        if self.view.card.foot.action == "pause" and not self.view.card.old and can_reset(seen.status):
            items.append(Option("reset", _("Reset errors"), "restore", off=why_not(seen.capabilities.clear_error)))
        calls: dict[str, Callable[[], object]] = {"clear": self.clear_queue, "reset": self.reset_errors}
        self._shell.dialogs.menu(anchor, _("Queue"), items, lambda key: calls[key]())

    def show_battery(self, anchor: Widget) -> None:
        self._shell.dialogs.menu(
            anchor, _("Battery"), [], lambda _key: None, battery_words(self.facts, self.view.card.old)
        )

    def open_map(self) -> None:
        self.shows_map = True
        self._show()

    def _update_busy(self) -> None:
        robot_id = self.facts.robot.id if self.facts.robot is not None else None
        self.busy = self._presses.names(robot_id)
        self.foot_rests = robot_id is not None and self._presses.is_same(foot_of(robot_id))


def _other_language() -> str:
    return next(language for language in languages() if language != translator.language)


class HomeScreen(ScreenBase):
    """One robot, in the ``layout`` for the window; its map; all robots if there are many, until one is chosen; and an invitation without
    robots. All robots and one other layout are both kept, so that either is shown at once, as it was left."""

    layout = StringProperty()
    Services, Model = HomeServices, HomeViewModel

    def __init__(self, vm: HomeViewModel, **kwargs: Any) -> None:
        self._pages: dict[str, Widget] = {}  # by layout
        load_kv("home/page", "home/fleet", "home/sending")
        super().__init__(vm=vm, **kwargs)
        vm.bind(**dict.fromkeys(("loaded", "view", "shows_map"), self._choose_layout))
        vm.fleet.bind(is_shown=self._choose_layout)
        vm.bind(tabs=self._show_tabs)
        self.bind(tall=self._choose_layout, low=self._choose_layout, size=self._choose_layout)
        self._choose_layout()

    def on_parent(self, _screen: Widget, parent: Any) -> None:
        self.vm.sheets.spared = self.robot_card if parent is not None else lambda: None

    def robot_card(self) -> Widget | None:
        """It has the button that nothing may cover."""
        card = self.children[0].ids.get("card") if self.children else None
        return card.__self__ if card is not None else None

    def _choose_layout(self, *_: Any) -> None:
        if not self.vm.loaded:
            return
        width, height = Window.size
        is_upright = width < min(height, dp(1000))
        is_small = height < (dp(1000) if is_upright else sp(460)) or width < sp(610 if is_upright else 750)
        one = "small" if is_small else "tall" if is_upright else "low" if self.low else "wide"
        layout = NO_ROBOT if not self.vm.view.has_robots else ALL_ROBOTS if self.vm.fleet.is_shown else one
        if self.vm.shows_map and layout == one:
            layout = MAP
        if layout != self.layout:
            self._turn_to(layout)
        self.can_go_back = layout == MAP
        self._show_tabs()

    def _turn_to(self, layout: str) -> None:
        if ALL_ROBOTS in (layout, self.layout) and self.layout not in ("", NO_ROBOT):
            rest.after_opening()  # the second tap on a robot presses nothing of its page
        self.layout = layout
        if layout not in self._pages:
            self._pages = {name: page for name, page in self._pages.items() if ALL_ROBOTS in (name, layout)}
            self._pages[layout] = LAYOUTS[layout](vm=self.vm.fleet if layout == ALL_ROBOTS else self.vm)
        self.clear_widgets()
        self.add_widget(self._pages[layout])

    def _show_tabs(self, *_: Any) -> None:
        robot = self.vm.facts.robot
        self.tabs = self.vm.tabs
        self.tab = ALL_ROBOTS if self.vm.fleet.is_shown else robot.id if robot is not None else None

    def choose_tab(self, key: Any) -> None:
        """All robots, or one of them."""
        if key == ALL_ROBOTS:
            self.vm.fleet.come_back()
        else:
            self.vm.fleet.leave()
            self.vm.select_robot(key)

    def go_back(self) -> None:
        self.vm.shows_map = False
