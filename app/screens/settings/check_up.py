"""The check-up of a robot: what it will do, its progress, its findings. It continues while its dialog is closed; *Stop*
ends it."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import partial
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

from app.domain.check_up import Level, Progress, Report, Trial
from app.domain.message import Message
from app.domain.models import Robot
from app.i18n import _
from app.screens.common.places import choose_place
from app.screens.common.presses import Presses
from app.screens.common.problems import words_of
from app.screens.common.threads import Job
from app.screens.settings import check_up_page
from app.screens.settings import check_up_view as view
from app.screens.settings.page import PageContext
from app.screens.settings.view import NoticeView, asking_robot, done, went_wrong
from app.services.check_up.report import document
from app.services.check_up.trials import length_s
from app.widgets.dialogs import FormDialog
from app.widgets.lists import Row
from app.widgets.surfaces import Surface, Toned

SHOWN_EVERY = 0.5  # s; the progress comes from another thread


class CheckUp(EventDispatcher):
    """Of one robot. ``changed()`` is called when the robot's panel has something else to show."""

    title = StringProperty()
    part = OptionProperty("CheckUpBefore", options=("CheckUpBefore", "CheckUpRunning", "CheckUpReport"))
    outcome = ObjectProperty(NoticeView())
    # before
    begins = StringProperty()
    wants_trial = BooleanProperty(False)
    mission = StringProperty(view.OFFERED)
    mission_word = StringProperty()
    asking_missions = BooleanProperty(False)
    will_do = StringProperty()
    begin_word = StringProperty()
    can_begin = BooleanProperty(True)
    # while it runs
    doing = StringProperty()
    how_far = StringProperty()
    share = NumericProperty(0)
    stopping = BooleanProperty(False)
    # the report
    verdict = ObjectProperty(NoticeView())
    found = ListProperty()
    fine_findings = ListProperty()
    fine = StringProperty()
    shows_all = BooleanProperty(False)
    saving_page = BooleanProperty(False)
    saving_file = BooleanProperty(False)

    def __init__(self, context: PageContext, robot: Robot, changed: Callable[[], object]) -> None:
        super().__init__()
        self._context, self._robot, self._changed = context, robot, changed
        self._job: Job | None = None  # under way
        self._is_wanted = True  # read by its thread
        self._progress: Progress | None = None  # written by its thread
        self._report: Report | None = None  # that is shown
        self._tick = Clock.create_trigger(self._show_progress, SHOWN_EVERY, interval=True)
        self._dialog: CheckUpDialog | None = None
        self._presses = Presses()

    # ------------------------------------------------------------------ its dialog
    def open(self, report: Report | None) -> None:
        """Show the progress, else the findings, else what it would do."""
        self.title = _("Check-up of {robot}").format(robot=self._robot.name)
        if not self.is_running and report is not None:
            self._show_report(report)
        elif not self.is_running:
            self.run_again()
        self._dialog = CheckUpDialog(vm=self)
        self._dialog.bind(on_dismiss=self._closed)
        self._context.shell.dialogs.open(self._dialog)

    def _closed(self, dialog: CheckUpDialog, *_args: Any) -> None:
        if dialog is self._dialog:
            self._dialog = None

    def close(self) -> None:
        if self._dialog is not None:
            self._dialog.dismiss()

    @property
    def is_running(self) -> bool:
        return self._job is not None

    @property
    def standing(self) -> NoticeView | None:
        """What the robot's panel shows while it runs."""
        return view.under_way(self._progress) if self.is_running else None

    # ------------------------------------------------------------------ before
    def run_again(self) -> None:
        self.part, self.outcome, self.wants_trial, self.mission = "CheckUpBefore", NoticeView(), False, view.OFFERED
        self._announce()

    def choose_trial(self, wanted: bool) -> None:
        self.wants_trial, self.outcome = wanted, NoticeView()
        self._announce()

    def pick_mission(self) -> None:
        """Ask the robot for its own."""
        if self.asking_missions:
            return
        self.asking_missions, self.outcome = True, asking_robot()
        check_ups, robot = self._context.services.check_ups, self._robot
        self._context.run(lambda: check_ups.harmless_missions(robot.id), self._choose, self._not_asked)

    def _choose(self, names: Sequence[str]) -> None:
        self.asking_missions, self.outcome = False, NoticeView()
        if self._dialog is not None:
            self._context.shell.dialogs.choose(
                _("Mission"), view.mission_options(names), self._chosen, selected=self.mission
            )

    def _not_asked(self, problem: BaseException) -> None:
        self.asking_missions, self.outcome = False, view.refused(problem)

    def _chosen(self, mission: str) -> None:
        self.mission, self.outcome = mission, NoticeView()
        self._announce()

    @property
    def _trial(self) -> Trial | None:
        return Trial(self.mission or None) if self.wants_trial else None

    def _announce(self) -> None:
        """The service's own words of what will happen; nothing begins before they are shown."""
        trial, robot, check_ups = self._trial, self._robot, self._context.services.check_ups
        self.begins = view.begins(trial, length_s(trial))
        self.mission_word = view.mission_word(self.mission)
        self.begin_word = view.begin_word(robot, trial)
        self.will_do, self.can_begin = "", trial is None
        if trial is not None:
            self._context.run(
                lambda: check_ups.moves(robot.id, trial), self._announced, self._not_announced, key=("check-up", self)
            )

    def _announced(self, says: Message) -> None:
        if self.wants_trial:
            self.will_do, self.can_begin = words_of(says), True

    def _not_announced(self, problem: BaseException) -> None:
        self.outcome = view.refused(problem)

    # ------------------------------------------------------------------ while it runs
    def begin(self) -> None:
        if self.is_running or not self.can_begin:
            return
        trial, robot, check_ups = self._trial, self._robot, self._context.services.check_ups
        self.part, self.outcome, self.stopping = "CheckUpRunning", NoticeView(), False
        self._progress, self._is_wanted = None, True

        def show(progress: Progress) -> None:
            self._progress = progress

        # a thread of its own: it takes minutes
        self._job = self._context.run(
            lambda: check_ups.run(robot.id, trial, show, self._goes_on),
            self._ended,
            self._refused,
            apart=f"check-up {robot.id}",
        )
        self._show_progress()
        self._tick()
        self._changed()

    def _goes_on(self) -> bool:
        """Called by its thread: neither stopped nor is the app ending."""
        return self._is_wanted and not (self._job is not None and self._job.cancelled)

    def stop(self) -> None:
        """Changes on the robot are undone first."""
        self._is_wanted, self.stopping = False, True

    def _show_progress(self, *_args: Any) -> None:
        self.doing, self.how_far, self.share = view.progress_words(self._progress, stopping=self.stopping)

    def _over(self) -> bool:
        """Returns whether somebody sees it."""
        self._job = None
        self._tick.cancel()
        self._changed()
        return self._dialog is not None

    def _ended(self, report: Report) -> None:
        is_seen = self._over()
        self._show_report(report)
        self._context.refresh()
        if not is_seen:
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
        self._report, self.part, self.outcome, self.shows_all = report, "CheckUpReport", NoticeView(), False
        self.verdict = view.verdict(self._robot, report, self._zone)
        self.found = view.finding_views(report.findings, Level.RED, Level.AMBER)
        self.fine_findings = view.finding_views(report.findings, Level.GREEN)
        self.fine = view.fine(report.findings)

    @property
    def _zone(self) -> str:
        return str(self._context.facts.settings.timezone)

    def turn_all(self) -> None:
        """Show findings that are in order too, or hide them."""
        self.shows_all = not self.shows_all

    def save_page(self) -> None:
        report, zone, files = self._report, self._zone, self._context.services.files
        if report is not None:
            self._save(
                "saving_page",
                lambda directory: files.write_text(
                    check_up_page.page(report, zone), f"check-up {report.robot}", ".html", directory
                ),
            )

    def save_file(self) -> None:
        report, zone, files = self._report, self._zone, self._context.services.files
        if report is not None:
            self._save(
                "saving_file",
                lambda directory: files.write_text(
                    document(report, zone), f"check-up {report.robot}", ".json", directory
                ),
            )

    def _save(self, busy: str, work: Callable[[Path], Path]) -> None:
        """Ask for a place, write a file there and show its path; the property ``busy`` is True while it is written."""
        if not getattr(self, busy) and not self._presses.is_same(busy):
            choose_place(self._context.shell, self._context.services.files, partial(self._write, busy, work))

    def _write(self, busy: str, work: Callable[[Path], Path], directory: Path) -> None:
        setattr(self, busy, True)

        def written(path: Path) -> None:
            setattr(self, busy, False)
            self._presses.rest(busy)
            self.outcome = done(_("Written, without passwords"), str(path))

        def failed(problem: BaseException) -> None:
            setattr(self, busy, False)
            self.outcome = went_wrong(problem)

        self._context.run(partial(work, directory), written, failed)


class CheckUpDialog(FormDialog):
    """Shows a check-up in three parts, one after the other."""

    vm = ObjectProperty(None, rebind=True, allownone=True)


class CheckUpPart(BoxLayout):
    """A part of the dialog; ``card`` is the check-up."""

    card = ObjectProperty(None, rebind=True, allownone=True)


class CheckUpActions(BoxLayout):
    """The buttons of a part."""

    card = ObjectProperty(None, rebind=True, allownone=True)


class FindingRow(Row, Toned, Surface):
    """A finding: level and topic, the robot's behaviour, its meaning."""

    icon = StringProperty()
    word = StringProperty()
    text = StringProperty()
    note = StringProperty()
