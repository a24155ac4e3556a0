"""The check-up of a robot or a fleet: what it will do, its progress, its findings. It continues while its sheet is closed; *Stop*
ends it."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

from kivy.clock import Clock
from kivy.event import EventDispatcher
from kivy.properties import (
    BooleanProperty,
    ListProperty,
    NumericProperty,
    ObjectProperty,
    OptionProperty,
    StringProperty,
)
from kivy.uix.boxlayout import BoxLayout
from kivy.uix.widget import Widget

from app.domain.check_up import Progress, Report, Trial
from app.domain.models import Fleet, Robot
from app.i18n import _
from app.screens.common.places import write_to
from app.screens.common.problems import words_of
from app.screens.common.threads import Job
from app.screens.settings import check_up_page
from app.screens.settings import check_up_view as view
from app.screens.settings.edit_sheet import SettingsSheet
from app.screens.settings.page import PageContext
from app.screens.settings.view import NoticeView, done, went_wrong
from app.services.check_up.fleet_check_ups import FleetCheckUps
from app.services.check_up.report import document
from app.services.check_up.service import CheckUps
from app.widgets.items import Option

SHOWN_EVERY = 0.5  # s; the progress comes from another thread
WAITS_S = 6.0  # without a step, until it says so


def key_of(target: Robot | Fleet) -> int | str:
    """In ``context.check_ups``."""
    return f"fleet {target.id}" if isinstance(target, Fleet) else target.id


def standing_of(context: PageContext, target: Robot | Fleet) -> NoticeView:
    """How its check-up stands, or how far it is. A fleet's robot is checked up with its fleet."""
    if isinstance(target, Robot) and target.fleet is not None:
        return NoticeView()
    facts, running = context.facts, context.check_ups.get(key_of(target))
    is_left = isinstance(target, Robot) and target.id in facts.left_behind
    return (running and running.standing) or view.standing(
        target, facts.report(target), context.now(), facts.settings.timezone, is_left=is_left
    )


def open_check_up(context: PageContext, target: Robot | Fleet) -> None:
    """That which runs, else the newest findings, else a new one."""
    key = key_of(target)
    reports = filter(None, (context.ended_early.get(key), context.facts.report(target)))
    report = max(reports, key=lambda each: each.began_at, default=None)
    (context.check_ups.get(key) or CheckUp(context, target)).open(report)


class CheckUp(EventDispatcher):
    """Of one robot or fleet. While it runs it is in ``context.check_ups``: pages may be built again."""

    title = StringProperty()
    part = OptionProperty("CheckUpBefore", options=("CheckUpBefore", "CheckUpRunning", "CheckUpReport"))
    outcome = ObjectProperty(NoticeView())
    foot = StringProperty()  # the words of the buttons
    second = StringProperty()
    foot_off = StringProperty()  # why it can't begin
    busy = BooleanProperty(False)
    # before
    begins = StringProperty()
    reads = StringProperty()
    of_fleet = BooleanProperty(False)  # which is tried with one of its robots
    vehicle = StringProperty()
    wants_trial = BooleanProperty(False)
    mission = StringProperty(view.OFFERED)
    mission_word = StringProperty()
    asking_missions = BooleanProperty(False)
    will_do = StringProperty()
    can_begin = BooleanProperty(True)
    # while it runs
    doing = StringProperty()
    how_far = StringProperty()
    share = NumericProperty(0)
    stopping = BooleanProperty(False)
    # the report
    verdict = ObjectProperty(NoticeView(), rebind=True)
    found = ListProperty()

    def __init__(self, context: PageContext, target: Robot | Fleet) -> None:
        super().__init__(of_fleet=isinstance(target, Fleet), reads=view.reads(target))
        self._context, self._target = context, target
        services = context.services
        self._service: CheckUps | FleetCheckUps = (
            services.fleet_check_ups if isinstance(target, Fleet) else services.check_ups
        )
        self._job: Job | None = None  # under way
        self._is_wanted = True  # read by its thread
        self._progress: Progress | None = None  # written by its thread
        self._heard: tuple[Progress | None, float] = None, 0.0  # the last one that was shown, and since when
        self._report: Report | None = None  # that is shown
        self._tick = Clock.create_trigger(self._show_progress, SHOWN_EVERY, interval=True)
        self._opened: set[str] = set()  # findings whose meaning is shown
        self.bind(**dict.fromkeys(("part", "wants_trial", "can_begin", "outcome", "stopping"), self._name_buttons))

    # ------------------------------------------------------------------ its sheet
    def open(self, report: Report | None) -> None:
        """Show the progress, else the findings, else what it would do."""
        self.title = _("Check-up of {robot}").format(robot=self._target.name)
        if not self.is_running and report is not None:
            self._show_report(report)
        elif not self.is_running:
            self.run_again()
        self._name_buttons()
        self._context.shell.sheets.over(CheckUpSheet(vm=self))

    @property
    def _is_seen(self) -> bool:
        sheet = self._context.shell.sheets.top
        return isinstance(sheet, CheckUpSheet) and sheet.vm is self

    def _name_buttons(self, *_args: Any) -> None:
        is_before = self.part == "CheckUpBefore"
        self.foot, self.second = {
            "CheckUpBefore": (
                view.begin_word(self._target, self._trial),
                _("Only read") if self.wants_trial else _("Run trial"),
            ),
            "CheckUpRunning": (_("Stop"), ""),
            "CheckUpReport": (_("Run trial"), _("Check again")) if self._was_heard else (_("Check again"), ""),
        }[self.part]
        self.foot_off = "" if self.can_begin or not is_before else self.outcome.text or view.not_yet(self._target)
        self.busy = self.stopping and self.part == "CheckUpRunning"

    def press(self) -> None:
        """The button at the foot."""
        if self.part == "CheckUpBefore":
            self.begin()
        elif self.part == "CheckUpRunning":
            self.stop()
        elif self._was_heard:
            self.run_again()
            self.choose(wants_trial=True)
        else:
            self.press_other()

    def press_other(self) -> None:
        """The button next to it."""
        if self.part == "CheckUpBefore":
            self.choose(wants_trial=not self.wants_trial)
        else:
            self.run_again()
            self.begin()

    @property
    def _was_heard(self) -> bool:
        """A robot that did not answer to the end is read again before it is tried."""
        return self._report is not None and self._report.is_complete

    @property
    def is_running(self) -> bool:
        return self._job is not None

    @property
    def standing(self) -> NoticeView | None:
        """What the robot's row says while it runs."""
        return view.under_way(self._progress) if self.is_running else None

    # ------------------------------------------------------------------ before
    def run_again(self) -> None:
        """A fleet that is only read is no more known than before."""
        self.part, self.outcome, self.wants_trial = "CheckUpBefore", NoticeView(), self.of_fleet
        self.mission, self.vehicle = view.OFFERED, ""
        self._announce()

    def choose(self, **values: Any) -> None:
        """Whether it tries a mission, which one, and of a fleet with which robot."""
        for name, value in values.items():
            setattr(self, name, value)
        self.outcome = NoticeView()
        self._announce()

    def pick_mission(self) -> None:
        """Ask the robot or the fleet for its own."""
        self._pick(
            "mission",
            _("Mission"),
            lambda: self._service.harmless_missions(self._target.id),
            lambda names: view.mission_options(names, of_fleet=self.of_fleet),
        )

    def pick_vehicle(self) -> None:
        """Ask the fleet for its robots."""
        self._pick(
            "vehicle",
            _("Robot"),
            lambda: self._context.services.fleet_check_ups.robots(self._target.id),
            lambda names: [Option(name, name, "robot-outline") for name in names],
        )

    def _pick(
        self, what: str, title: str, ask: Callable[[], Sequence[str]], options: Callable[[Sequence[str]], list[Option]]
    ) -> None:
        if self.asking_missions:
            return
        self.asking_missions, self.outcome = True, view.asking(self._target)

        def found(names: Sequence[str]) -> None:
            self.asking_missions, self.outcome = False, NoticeView()
            if self._is_seen:
                self._context.shell.dialogs.choose(
                    title, options(names), lambda key: self.choose(**{what: key}), selected=getattr(self, what)
                )

        def failed(problem: BaseException) -> None:
            self.asking_missions = False
            self._not_now(problem)

        self._context.run(ask, found, failed)

    def _not_now(self, problem: BaseException) -> None:
        self.outcome = view.refused(problem)

    @property
    def _trial(self) -> Trial | None:
        return Trial(self.mission or None, self.vehicle) if self.wants_trial else None

    def _announce(self) -> None:
        """The service's own words of what will happen; nothing begins before they are shown."""
        trial, target, check_ups = self._trial, self._target, self._service
        self.begins = view.begins(trial, check_ups.length_s(trial), of_fleet=self.of_fleet)
        self.mission_word = self.mission if self.of_fleet else view.mission_word(self.mission)
        self.will_do, self.can_begin = "", trial is None
        if trial is not None and (not self.of_fleet or (trial.mission and trial.robot)):
            self.will_do, self.can_begin = words_of(check_ups.moves(target.name, trial)), True

    # ------------------------------------------------------------------ while it runs
    def begin(self) -> None:
        if self.is_running or not self.can_begin:
            return
        trial, target, check_ups = self._trial, self._target, self._service
        self.part, self.outcome, self.stopping = "CheckUpRunning", NoticeView(), False
        self._progress, self._is_wanted, self._heard = None, True, (None, Clock.get_time())

        def show(progress: Progress) -> None:
            self._progress = progress

        # a thread of its own: it takes minutes
        self._job = self._context.run(
            lambda: check_ups.run(target.id, trial, show, self._goes_on),
            self._ended,
            self._refused,
            apart=f"check-up {key_of(target)}",
        )
        self._context.check_ups[key_of(target)] = self
        self._show_progress()
        self._tick()
        self._context.show()

    def _goes_on(self) -> bool:
        """Called by its thread: neither stopped nor is the app ending."""
        return self._is_wanted and not (self._job is not None and self._job.cancelled)

    def stop(self) -> None:
        """Changes on the robot are undone first."""
        self._is_wanted, self.stopping = False, True

    def _show_progress(self, *_args: Any) -> None:
        if self._progress is not self._heard[0]:
            self._heard = self._progress, Clock.get_time()
        self.doing, self.how_far, self.share = view.progress_words(self._target, self._progress, stopping=self.stopping)
        if (waited_s := Clock.get_time() - self._heard[1]) >= WAITS_S:
            self.how_far = view.waits(self._target, waited_s)

    def _over(self) -> bool:
        """Returns whether somebody sees it."""
        self._job = None
        self._tick.cancel()
        del self._context.check_ups[key_of(self._target)]
        self._context.show()
        return self._is_seen

    def _ended(self, report: Report) -> None:
        is_seen = self._over()
        self._show_report(report)
        self._context.refresh()
        if not is_seen:
            if not report.is_complete:  # it is stored nowhere else
                self._context.ended_early[key_of(self._target)] = report
            said = view.ended_sentence(report)
            self._context.say(said.text, said.icon)

    def _refused(self, problem: BaseException) -> None:
        """Where it was pressed, else where it is visible."""
        is_seen = self._over()
        self.part, self.outcome = "CheckUpBefore", view.refused(problem)
        if not is_seen:
            self._context.shell.say_problem(problem)

    # ------------------------------------------------------------------ the report
    def _show_report(self, report: Report) -> None:
        self._report, self.part, self.outcome, self._opened = report, "CheckUpReport", NoticeView(), set()
        self.verdict = view.verdict(self._target, report, self._zone)
        self._show_findings()

    def _show_findings(self) -> None:
        if self._report is not None:
            self.found = view.finding_items(self._report.findings, self._opened)

    def turn(self, key: str) -> None:
        """Show what a finding means, or hide it."""
        self._opened ^= {key}
        self._show_findings()

    @property
    def _zone(self) -> str:
        return str(self._context.facts.settings.timezone)

    def menu(self, button: Widget) -> None:
        """Where the report goes."""
        items = [
            Option(".html", _("Save report to print"), "printer-outline"),
            Option(".json", _("Save file for support"), "file-export-outline"),
        ]
        self._context.shell.dialogs.menu(button, "", items, self._save)

    def _save(self, ending: str) -> None:
        """Ask for a place, write a file there and show its path."""
        report, zone, context = self._report, self._zone, self._context
        if report is None:
            return
        text, files = {".html": check_up_page.page, ".json": document}[ending], context.services.files

        def written(path: Path) -> None:
            self.outcome = done(_("Written, without passwords"), str(path))

        def failed(problem: BaseException) -> None:
            self.outcome = went_wrong(problem)

        def write(directory: Path) -> None:
            name = f"check-up {report.robot}"
            context.run(lambda: files.write_text(text(report, zone), name, ending, directory), written, failed)

        context.run(files.places, lambda places: write_to(context.shell, places, write))


class CheckUpSheet(SettingsSheet):
    """Shows a check-up in three parts, one after the other, in the place of the page."""

    vm = ObjectProperty(None, rebind=True, allownone=True)


class CheckUpPart(BoxLayout):
    """A part of the sheet; ``card`` is the check-up."""

    card = ObjectProperty(None, rebind=True, allownone=True)
