"""Home: what is going on, and the hands on it. The facts are read in the background, the words made by home_view once a second."""
from __future__ import annotations

import uuid
from collections.abc import Callable, Hashable, Mapping
from dataclasses import fields, replace
from datetime import datetime
from typing import TYPE_CHECKING, Any

from kivy.clock import Clock
from kivy.properties import StringProperty

from app.domain.models import Execution
from app.domain.robot import MissionParameter
from app.i18n import _, ngettext
from app.mir.errors import Rejected
from app.screens.common.parameters_view import Problems, fields_of, values_of
from app.screens.common.shell import Shell
from app.screens.common.view_model import ScreenBase, ViewModel
from app.screens.home.cards import HomeEmpty, HomeState, HomeTall, HomeWide
from app.screens.home.facts import HomeFacts, read
from app.screens.home.view import present
from app.services.live.changes import Topic
from app.services.robots.missions import RobotMissions
from app.widgets import load_kv

DOUBLE_TAP = 1.0                         # s within which a gloved finger's second tap on Run is the same press
GONE = (404, 410)                        # what a robot answers about an item that it no longer has

if TYPE_CHECKING:
    from app.container import Container


class HomeViewModel(HomeState, ViewModel):
    """Reads the facts, makes the words, and does what is pressed."""

    def __init__(self, container: Container, shell: Shell) -> None:
        super().__init__()
        self._container, self._shell = container, shell
        self._robot_missions = RobotMissions(lambda robot_id: container.repositories.robots.get(container.db.read(), robot_id),
                                             container.make_client, container.clock)
        self._facts = HomeFacts()
        self._chosen: int | None = None
        self._asked_for: tuple[int, int] | None = None        # robot and mission whose parameters are shown
        self._wanted: tuple[MissionParameter, ...] = ()
        self._seen_running: dict[int, datetime] = {}
        self._cancelling: set[int] = set()
        self._rest_until = 0.0
        self._reading = self._stale = self._learning_map = False
        self._all_anew = True                                 # more than what the robots do has changed
        self._refresh = Clock.create_trigger(lambda _dt: self._read(), 0)

    # ------------------------------------------------------------------ reading
    def opened(self, robot_id: int | None = None) -> None:
        self.keep(self._container.changes.subscribe(self._heard))
        self._all_anew = True
        self.every(1, self._tick)
        self._read()
        if robot_id is not None:
            self.select_robot(robot_id)

    def _heard(self, topic: Topic, about: int | None) -> None:
        """On the publisher's thread. Of the robots that are only chips the tick tells what they say."""
        robot = self._facts.robot
        if topic is not Topic.SNAPSHOT:
            self._all_anew = True
        elif robot is not None and about != robot.id:
            return
        self._refresh()

    def _tick(self) -> None:
        """A second has passed."""
        facts, robot = self._facts, self._facts.robot
        others = {other.id: self._container.snapshots.get(other.id) for other in facts.robots if other is not robot}
        self._facts = replace(facts, snapshots={**facts.snapshots, **others})
        self._show()

    def closed(self) -> None:
        self._refresh.cancel()

    def retranslated(self) -> None:
        self._show()

    def _read(self) -> None:
        """One reading at a time; what changes meanwhile asks for one more."""
        if not self.is_open:
            return
        if self._reading:
            self._stale = True
            return
        self._reading, self._stale = True, False
        known = None if self._all_anew else self._facts
        self._all_anew = False
        seen = dict(self._seen_running)
        self._shell.background.run(lambda: read(self._container, self._robot_missions, seen, known), self._take, self._not_read)

    def _take(self, facts: HomeFacts) -> None:
        self._reading = False
        if self._stale:
            self._refresh()
        chosen_robot = self._facts.settings.selected_robot_id
        if "robot" in self.busy:                              # the choice of a moment ago is on its way to the database
            facts = replace(facts, settings=replace(facts.settings, selected_robot_id=chosen_robot))
        self._facts = facts
        self._note_running()
        self._learn_names()
        self._learn_map()
        self.loaded = True
        self._show()

    def _not_read(self, problem: BaseException) -> None:
        self._reading, self._all_anew = False, True
        self._shell.say_problem(problem)

    def _note_running(self) -> None:
        """Since when this tablet has seen an item run; our own executions have it in the ledger."""
        now = self._container.clock.now()
        running = self._facts.running
        present_ids = {running.id} if running else set()
        self._seen_running = {item: since for item, since in self._seen_running.items() if item in present_ids}
        for item in present_ids:
            self._seen_running.setdefault(item, now)
        self._cancelling &= {item.id for item in self._facts.snapshot.queue}
        self._facts = replace(self._facts, seen_running=dict(self._seen_running), cancelling=frozenset(self._cancelling))

    def _learn_names(self) -> None:
        """Others run missions that nobody entered here; the robot knows their names."""
        robot, facts = self._facts.robot, self._facts
        if robot is not None and any(facts.needs_name(item) for item in facts.snapshot.queue):
            self._shell.background.run(lambda: self._robot_missions.learn_names(robot.id),
                                       lambda new: self._refresh() if new else None, lambda _problem: None, key=("home", "names"))

    def _learn_map(self) -> None:
        """One at a time; what is kept comes first, then what the robot says."""
        robot, map_id, maps = self._facts.robot, self._facts.map_id, self._container.maps
        if robot is None or map_id is None or self._learning_map or not maps.is_due(robot.id, map_id):
            return
        self._learning_map = True

        def ended(_outcome: object) -> None:
            self._learning_map = False
            self._refresh()

        self._shell.background.run(lambda: maps.learn(robot.id, map_id), ended, ended)

    def _show(self) -> None:
        view = present(self._facts, self._container.clock.now(), self._chosen)
        for field in fields(view):
            value = getattr(view, field.name)
            setattr(self, field.name, list(value) if isinstance(value, tuple) else value)
        self._ask_parameters()

    # ------------------------------------------------------------------ which robot, which mission
    def select_robot(self, robot_id: int) -> None:
        """The whole app looks at this robot from now on."""
        if robot_id == getattr(self._facts.robot, "id", None):
            return
        settings = replace(self._facts.settings, selected_robot_id=robot_id)
        self._facts = replace(self._facts, settings=settings, missions=(), usual_s={}, names={}, map=None)
        self._chosen = None
        self._show()
        self._act("robot", lambda: self._container.catalogue.change_settings(selected_robot_id=robot_id), lambda _settings: self._refresh())

    def add_robot(self) -> None:
        self._shell.go("settings", section="robots", add=True)

    def open_run(self, execution_id: int) -> None:
        """Its story, in Logs."""
        self._shell.go("logs", execution_id=execution_id)

    def open_schedule(self, key: tuple[int, datetime]) -> None:
        """What a planned start comes from, in Scheduler."""
        self._shell.go("scheduler", schedule_id=key[0])

    def pick_mission(self) -> None:
        options = [{"key": m.id, "text": m.name, "icon": "star" if m.favourite else "star-outline"} for m in self._facts.missions]
        self._shell.dialogs.choose(_("Mission to run"), options, self.choose_mission, selected=self.run.mission_id)

    def choose_mission(self, mission_id: int) -> None:
        self._chosen = mission_id
        self._show()

    def _ask_parameters(self) -> None:
        """Ask the robot once what the chosen mission wants to be told; without an answer it is sent as it is."""
        robot, mission_id = self._facts.robot, self.run.mission_id
        wanted = (robot.id, mission_id) if robot is not None and mission_id is not None else None
        if wanted == self._asked_for:
            return
        self._asked_for = wanted
        self._take_parameters(())
        mission = next((m for m in self._facts.missions if m.id == mission_id), None)
        if robot is None or mission is None:
            return
        self._shell.background.run(lambda: self._robot_missions.parameters(robot.id, mission.guid),
                                   lambda found: self._take_parameters(tuple(found)), lambda _problem: None, key=("home", "parameters"))

    def _take_parameters(self, found: tuple[MissionParameter, ...]) -> None:
        self._wanted = found
        self.problems = {}
        self.parameters = fields_of(found)

    # ------------------------------------------------------------------ what the operator presses
    def run_now(self, entered: Mapping[str, Any]) -> None:
        """One press, one mission: the token is minted here, and the button waits until the row is on disk."""
        robot, run = self._facts.robot, self.run
        if robot is None or run.off or run.mission_id is None or "run" in self.busy or Clock.get_time() < self._rest_until:
            return
        try:
            parameters = values_of(self._wanted, entered)
        except Problems as problems:
            self.problems = dict(problems.by_name)
            return
        self.problems = {}
        token, mission_id = str(uuid.uuid4()), run.mission_id

        def submit() -> None:
            self._act("run", lambda: self._container.operator.run_now(robot.id, mission_id, parameters, token), self._started)
            self._rest_until = Clock.get_time() + DOUBLE_TAP

        if run.low_battery:
            self._shell.dialogs.confirm(_("Run {mission} all the same?").format(mission=run.mission), run.low_battery, _("Run"), submit)
        else:
            submit()

    def _started(self, execution: Execution) -> None:
        self._say(_("{mission} is on its way to {robot}").format(mission=execution.mission, robot=execution.robot), "play")

    def pause_or_resume(self) -> None:
        robot, controls, operator = self._facts.robot, self.controls, self._container.operator
        if robot is None or "pause" in self.busy:
            return
        if controls.pauses:
            self._act("pause", lambda: operator.pause(robot.id),
                      lambda _none: self._say(_("{robot} pauses").format(robot=robot.name), "pause"))
        else:
            self._act("pause", lambda: operator.resume(robot.id),
                      lambda _none: self._say(_("{robot} goes on").format(robot=robot.name), "play"))

    def reset_errors(self) -> None:
        robot = self._facts.robot
        if robot is not None and "reset" not in self.busy:
            self._act("reset", lambda: self._container.operator.reset_errors(robot.id), lambda _none: self._say(
                _("The errors of {robot} are reset; Resume lets it go on").format(robot=robot.name), "check"))

    def clear_queue(self) -> None:
        """Asked first: what is aborted can't be brought back."""
        robot, count = self._facts.robot, self.controls.clear_count
        if robot is None or not count or "clear" in self.busy:
            return
        title = ngettext("Clear {n} mission from the queue of {robot}?", "Clear {n} missions from the queue of {robot}?", count)
        text = _("Everything in its queue goes, whoever put it there; what runs is ended.")

        def clear() -> None:
            self._act("clear", lambda: self._container.operator.clear_queue(robot.id),
                      lambda _none: self._say(_("The queue of {robot} is cleared").format(robot=robot.name), "playlist-remove"))

        self._shell.dialogs.confirm(title.format(n=count, robot=robot.name), text, _("Clear queue"), clear, danger=True)

    def cancel(self, key: tuple[str, int]) -> None:
        """One row of the queue: ours by the execution, others' by the item."""
        robot, operator = self._facts.robot, self._container.operator
        if robot is None or key in self.busy:
            return
        kind, number = key
        name = next((row["mission"] for row in self.queue if row["key"] == key), "")
        if kind == "item":
            self._cancelling.add(number)
            self._facts = replace(self._facts, cancelling=frozenset(self._cancelling))
        self._act(key, lambda: operator.cancel_execution(number) if kind == "execution" else operator.cancel_item(robot.id, number),
                  lambda _row: self._say(_("{mission} is cancelled").format(mission=name), "close"),
                  lambda problem: self._not_cancelled(problem, number, name))
        self._show()

    def _not_cancelled(self, problem: BaseException, number: int, name: str) -> None:
        self._cancelling.discard(number)
        if isinstance(problem, Rejected) and problem.status in GONE:
            self._say(_("{mission} had already ended").format(mission=name), "information-outline")
        else:
            self._shell.say_problem(problem)
        self._refresh()

    def answer(self, option: str) -> None:
        robot, prompt = self._facts.robot, self.prompt
        if robot is not None and prompt.guid and "answer" not in self.busy:
            said = _("{robot} was told: {answer}").format(robot=robot.name, answer=option)
            self._act("answer", lambda: self._container.operator.answer_prompt(robot.id, prompt.guid, option),
                      lambda _none: self._say(said, "comment-check-outline"))

    # ------------------------------------------------------------------ inside
    def _act(self, name: Hashable, work: Callable[[], Any], done: Callable[[Any], object],
             failed: Callable[[BaseException], object] | None = None) -> None:
        """Do it elsewhere; the button is busy until its outcome is on screen."""
        self.busy = [*self.busy, name]

        def ended(tell: Callable[[Any], object], outcome: Any) -> None:
            self.busy = [other for other in self.busy if other != name]
            tell(outcome)
            self._refresh()

        self._shell.background.run(work, lambda outcome: ended(done, outcome),
                                   lambda problem: ended(failed or self._shell.say_problem, problem))

    def _say(self, text: str, icon: str) -> None:
        self._shell.snackbars.show(text, icon=icon)


class HomeScreen(ScreenBase):
    """Three columns in landscape, bands in portrait, and an invitation while there is no robot."""
    layout = StringProperty()

    def __init__(self, container: Container, shell: Shell, **kwargs: Any) -> None:
        load_kv("widgets/flow", "home/cards", "home/screen")
        super().__init__(vm=HomeViewModel(container, shell), **kwargs)
        for name in ("loaded", "has_robots"):
            self.vm.fbind(name, self._choose_layout)
        self.fbind("portrait", self._choose_layout)
        self._choose_layout()

    def _choose_layout(self, *_: Any) -> None:
        if not self.vm.loaded:
            return
        layout = "empty" if not self.vm.has_robots else "tall" if self.portrait else "wide"
        if layout != self.layout:
            self.layout = layout
            self.clear_widgets()
            self.add_widget({"empty": HomeEmpty, "tall": HomeTall, "wide": HomeWide}[layout](vm=self.vm))
