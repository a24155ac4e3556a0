"""The top bar and the banner, whatever the screen. Reads robots, alarms and holds in the background, ticks once a second."""
from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

from kivy.clock import Clock

from app.domain.models import Execution, Robot, RobotSnapshot, Settings
from app.i18n import _, translator
from app.screens.common.alarms_view import Act, Here, bell, is_shelved
from app.screens.common.shell import Shell
from app.screens.frame.alarm_list import AlarmList, LateStartsDialog
from app.screens.frame.view import BannerView, OpenIssues, banner, late_starts, open_issues, robot_option, top_bar
from app.services.live.changes import Topic
from app.widgets import finger
from app.widgets.frame import Frame

NAVIGATION = (("home", "home-variant-outline", "home-variant"), ("scheduler", "calendar-clock-outline", "calendar-clock"),
              ("logs", "text-box-outline", "text-box"), ("settings", "cog-outline", "cog"))

if TYPE_CHECKING:
    from app.container import Container


def screen_word(name: str) -> str:
    return {"home": _("Home"), "scheduler": _("Scheduler"), "logs": _("Logs"), "settings": _("Settings")}[name]


@dataclass(frozen=True)
class FrameFacts:
    """What the frame needs to know at one moment."""
    settings: Settings = field(default_factory=Settings)
    robots: Mapping[int, Robot] = field(default_factory=dict)
    issues: OpenIssues = field(default_factory=OpenIssues)

    @property
    def robot(self) -> Robot | None:
        """The selected one; the first while the chosen one is gone."""
        return self.robots.get(self.settings.selected_robot_id or 0) or next(iter(self.robots.values()), None)


def read(container: Container) -> FrameFacts:
    """Called off the UI thread."""
    robots = {robot.id: robot for robot in container.repositories.robots.all(container.db.read())}
    holds = sorted(container.holds.standing(), key=lambda hold: hold.robot_id is not None)        # that of all robots first
    return FrameFacts(container.settings(), robots,
                      OpenIssues(container.alarms.standing(), holds, late_starts(container.history.open())))


class FrameController:
    """Fills the Frame widget and does what its bar and banner ask for."""

    def __init__(self, container: Container, shell: Shell, frame: Frame) -> None:
        self._container, self._shell, self._frame = container, shell, frame
        self._facts = FrameFacts()
        self._banner = BannerView()
        self._reading = self._stale = False
        self._alarms = AlarmList(container, shell, self._do)
        self._late: LateStartsDialog | None = None
        self._late_seen: frozenset[int] = frozenset()         # executions whose list the operator has closed
        self._refresh = Clock.create_trigger(lambda _dt: self._read(), 0)
        self._release: list[Callable[[], object]] = []

    # ------------------------------------------------------------------ life
    def start(self) -> None:
        frame = self._frame
        frame.bind(on_go=self._go, on_pick_robot=self._pick_robot, on_solve=self._press_banner, on_list_alarms=self._show_alarms)
        self._shell.navigator.bind(current=self._went)
        self._release = [self._container.changes.subscribe(self._heard),
                         translator.subscribe(self._retranslated), Clock.schedule_interval(lambda _dt: self._show(), 1).cancel]
        self._retranslated()
        self._read()

    def stop(self) -> None:
        for release in self._release:
            release()
        self._release = []
        self._refresh.cancel()

    def _heard(self, topic: Topic, _about: int | None) -> None:
        """On the publisher's thread. Snapshots are looked at every second anyway."""
        if topic is not Topic.SNAPSHOT:
            self._refresh()

    def _retranslated(self) -> None:
        self._frame.items = [(name, screen_word(name), icon, selected) for name, icon, selected in NAVIGATION]
        self._went()
        self._show()

    def _went(self, *_: Any) -> None:
        current = self._shell.navigator.current
        self._frame.current = current
        self._frame.title = screen_word(current) if current else ""
        self._show()

    # ------------------------------------------------------------------ reading and showing
    def _read(self) -> None:
        if not self._release:                # stopped
            return
        if self._reading:
            self._stale = True
            return
        self._reading, self._stale = True, False
        self._shell.background.run(lambda: read(self._container), self._take, self._not_read)

    def _take(self, facts: FrameFacts) -> None:
        self._reading = False
        if self._stale:
            self._refresh()
        before, self._facts = self._facts.robot, facts
        if facts.robot and (before is None or before.id != facts.robot.id):
            self._container.loop.watch(facts.robot.id)
        self._show()
        self._alarms.changed()
        self._show_late_starts()

    def _not_read(self, problem: BaseException) -> None:
        self._reading = False
        self._shell.say_problem(problem)

    def _show(self) -> None:
        facts, frame, now = self._facts, self._frame, self._container.clock.now()
        robot = facts.robot
        bar = top_bar(robot, self._snapshot(robot), facts.settings, now)
        frame.date, frame.clock, frame.robot, frame.link = bar.date, bar.clock, bar.robot, bar.link
        frame.link_icon, frame.link_tone = bar.icon, bar.tone
        if not finger.is_down():             # else a second later: the banner moves all that is below it
            self._show_banner(banner(facts.issues, facts.robots, facts.settings, now,
                                     Here(self._shell.navigator.current, robot.id if robot else None)))
        standing = len(open_issues(facts.issues, facts.robots, facts.settings, now))
        shelved = sum(is_shelved(alarm, now) for alarm in facts.issues.alarms)
        frame.bell_icon, frame.bell_count = bell(standing, shelved)
        self._alarms.show(facts.issues, facts.robots, facts.settings)
        if self._late is not None:
            self._late.show(facts.issues.late_starts, facts.settings, now)

    def _show_banner(self, view: BannerView) -> None:
        self._banner, frame = view, self._frame
        frame.alarm, frame.alarm_note, frame.alarm_icon, frame.alarm_tone = view.text, view.note, view.icon, view.tone
        frame.alarm_others, frame.alarm_action = view.others, view.action

    def _snapshot(self, robot: Robot | None) -> RobotSnapshot | None:
        return self._container.snapshots.get(robot.id) if robot else None

    # ------------------------------------------------------------------ the bar
    def _go(self, _frame: Frame, name: str) -> None:
        if name != self._shell.navigator.current:
            self._shell.go(name)

    def _pick_robot(self, _frame: Frame) -> None:
        """The same choice from every screen; without a robot the way to the first one."""
        facts = self._facts
        if not facts.robots:
            self._shell.go("settings", section="robots", add=True)
            return
        selected = facts.robot.id if facts.robot else None
        options = [robot_option(robot, self._container.snapshots.get(robot.id), facts.settings, self._container.clock.now())
                   for robot in facts.robots.values()]
        self._shell.dialogs.choose(_("Robot"), options, self._select_robot, selected=selected)

    def _select_robot(self, robot_id: int) -> None:
        self._shell.background.run(lambda: self._container.catalogue.change_settings(selected_robot_id=robot_id),
                                   lambda _settings: self._refresh(), self._shell.say_problem)

    # ------------------------------------------------------------------ the banner
    def _press_banner(self, _frame: Frame) -> None:
        self._do(self._banner.act, self._banner.about)

    def _do(self, act: Act, about: int | None) -> None:
        """What a button of the banner or of the list asks for."""
        container, work = self._container, None
        match act:
            case Act.SHOW_ROBOT:
                self._shell.go("home", robot_id=about)
            case Act.ROBOT_SETTINGS:
                self._shell.go("settings", section="robots", robot_id=about)
            case Act.DATA_SETTINGS:
                self._shell.go("settings", section="data")
            case Act.LOGS:
                self._shell.go("logs")
            case Act.SHOW_RUN:
                self._shell.go("logs", execution_id=about)
            case Act.SCHEDULE_RUN if about is not None:
                self._shell.background.run(lambda: container.history.last_of_schedule(about), self._show_run, self._shell.say_problem)
            case Act.ACKNOWLEDGE if about is not None:
                work = lambda: container.alarms.acknowledge(about)  # noqa: E731
            case Act.HOLD:
                self._hold_late_starts()
            case Act.RELEASE:
                work = lambda: container.holds.release(about)  # noqa: E731
        if work is not None:
            self._shell.background.run(work, lambda _none: self._refresh(), self._shell.say_problem)

    def _show_run(self, execution: Execution | None) -> None:
        """Its story; all of them when the history has it no more."""
        self._shell.go("logs", execution_id=execution.id if execution else None)

    def _hold_late_starts(self) -> None:
        """Nothing goes out until somebody releases it; what waits too long is skipped, as for every hold."""
        reason = _("Late starts after the app was off")

        def held(_none: object) -> None:
            self._shell.snackbars.show(_("Nothing is sent until it is released"), icon="hand-back-right-outline")
            self._refresh()

        self._shell.background.run(lambda: self._container.holds.hold(reason), held, self._shell.say_problem)

    def _show_alarms(self, _frame: Frame) -> None:
        self._alarms.open()

    def _show_late_starts(self) -> None:
        """Opens by itself: a robot must not start because somebody plugged the tablet in."""
        waiting = frozenset(e.id for e in self._facts.issues.late_starts)
        if self._late is not None and not waiting:
            self._late.dismiss()
        elif self._late is None and waiting - self._late_seen:
            self._late = LateStartsDialog(hold=self._hold_late_starts)
            self._late.bind(on_dismiss=self._late_closed)
            self._shell.dialogs.open(self._late)
            self._show()

    def _late_closed(self, _dialog: LateStartsDialog) -> None:
        self._late = None
        self._late_seen = frozenset(e.id for e in self._facts.issues.late_starts)
