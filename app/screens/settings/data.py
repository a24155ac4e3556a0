"""Settings, Data: configuration and history as files, backups. Every action says where its file is."""
from __future__ import annotations

from collections.abc import Callable, Sequence
from datetime import datetime
from pathlib import Path
from typing import Any

from kivy.event import EventDispatcher
from kivy.properties import BooleanProperty, ObjectProperty, StringProperty
from kivy.uix.boxlayout import BoxLayout
from kivy.uix.widget import Widget

from app.domain.message import Message
from app.i18n import _
from app.screens.common.problems import sentence_of
from app.screens.settings.facts import SettingsFacts
from app.screens.settings.page import Desk, OutcomeModel, SettingsPage
from app.screens.settings.view import NoticeView, backup_options, backups_phrase, import_result, went_wrong
from app.services.files.exports import Backup

EXPORT_CONFIGURATION, IMPORT_CONFIGURATION, EXPORT_LOG = "export_configuration", "import_configuration", "export_log"
STEMS = {EXPORT_CONFIGURATION: ("amr-scheduler", ".json"), EXPORT_LOG: ("amr-scheduler-log", ".csv")}


class FileModel(EventDispatcher):
    """One file action: its path, what is wrong with it, whether it is under way."""
    path = StringProperty()
    problem = StringProperty()
    busy = BooleanProperty(False)


class DataModel(EventDispatcher):
    export_configuration = ObjectProperty(rebind=True)
    import_configuration = ObjectProperty(rebind=True)
    export_log = ObjectProperty(rebind=True)
    configuration_outcome = ObjectProperty(rebind=True)
    log_outcome = ObjectProperty(rebind=True)
    backup_outcome = ObjectProperty(rebind=True)
    backups = StringProperty()
    has_backups = BooleanProperty(False)
    backing_up = BooleanProperty(False)
    restoring = BooleanProperty(False)
    can_restore = BooleanProperty(False)
    restore_hint = StringProperty()


class DataPage(SettingsPage):
    def __init__(self, desk: Desk, **kwargs: Any) -> None:
        # the window can close the services, put a backup in place and go on; where it can't, the command does
        self._restore: Callable[[Path], object] | None = desk.shell.restore
        model = DataModel(**{name: FileModel() for name in (EXPORT_CONFIGURATION, IMPORT_CONFIGURATION, EXPORT_LOG)},
                          configuration_outcome=OutcomeModel(), log_outcome=OutcomeModel(), backup_outcome=OutcomeModel())
        super().__init__(desk, model, **kwargs)

    def show(self, facts: SettingsFacts, now: datetime) -> None:
        vm = self.vm
        vm.backups, vm.has_backups = backups_phrase(facts, now), bool(facts.backups)
        vm.can_restore = self._restore is not None and vm.has_backups
        vm.restore_hint = "" if self._restore is not None else \
            _("To go back to one, close the app and enter: python main.py --restore-backup FILE")

    def reached(self, **intent: Any) -> None:
        for name in (EXPORT_CONFIGURATION, IMPORT_CONFIGURATION, EXPORT_LOG):
            getattr(self.vm, name).problem = ""
        for outcome in (self.vm.configuration_outcome, self.vm.log_outcome, self.vm.backup_outcome):
            outcome.tell(NoticeView())
        self._suggest()

    def _suggest(self) -> None:
        """Names that are free, and the file that was most likely brought to be imported; looking at the disk is no work for the window."""
        files = self.desk.files
        self.desk.work(lambda: ({name: files.suggested(*stem) for name, stem in STEMS.items()}, files.newest_configuration()),
                       lambda found: self._suggested(*found), key="settings suggestions")

    def _suggested(self, targets: dict[str, Path], newest: Path | None) -> None:
        for name, path in targets.items():
            getattr(self.vm, name).path = str(path)
        if not self.vm.import_configuration.path and newest is not None:
            self.vm.import_configuration.path = str(newest)

    # ------------------------------------------------------------------ files
    def export_configuration(self) -> None:
        self._run(EXPORT_CONFIGURATION, self.desk.files.export_configuration, self._configuration_written)

    def import_configuration(self) -> None:
        self._run(IMPORT_CONFIGURATION, self.desk.files.import_configuration, self._configuration_taken)

    def export_log(self) -> None:
        self._run(EXPORT_LOG, self.desk.files.export_history, self._log_written)

    def _run(self, name: str, work: Callable[[str], Any], done: Callable[[Any], object]) -> None:
        file = getattr(self.vm, name)
        if file.busy:
            return
        file.busy, file.problem = True, ""
        path = file.path

        def ended(result: Any) -> None:
            file.busy = False
            done(result)

        def failed(problem: BaseException) -> None:
            file.busy = False
            file.problem = sentence_of(problem)
        self.desk.work(lambda: work(path), ended, failed)

    def _configuration_written(self, path: Path) -> None:
        self.vm.configuration_outcome.tell(NoticeView(_("Configuration written, without passwords"), str(path), "done", "check-circle"))
        self._suggest()

    def _configuration_taken(self, lines: Sequence[Message]) -> None:
        self.vm.configuration_outcome.tell(import_result(lines))
        self.desk.refresh()

    def _log_written(self, path: Path) -> None:
        self.vm.log_outcome.tell(NoticeView(_("Log written"), str(path), "done", "check-circle"))
        self._suggest()

    # ------------------------------------------------------------------ backups
    def back_up(self) -> None:
        if self.vm.backing_up:
            return
        self.vm.backing_up = True
        self.desk.work(self.desk.files.back_up_now, self._backed_up, self._not_backed_up)

    def _backed_up(self, backup: Backup) -> None:
        self.vm.backing_up = False
        self.vm.backup_outcome.tell(NoticeView(_("Backup made"), str(backup.path), "done", "check-circle"))
        self.desk.refresh()

    def _not_backed_up(self, problem: BaseException) -> None:
        self.vm.backing_up = self.vm.restoring = False
        self.vm.backup_outcome.tell(went_wrong(problem))

    def restore(self) -> None:
        """Which one, then whether really: what happened since the backup is gone then."""
        self.desk.shell.dialogs.choose(_("Restore which backup?"), backup_options(self.desk.facts, self.desk.now()), self._chosen)

    def _chosen(self, path: str) -> None:
        text = next((row["text"] for row in backup_options(self.desk.facts, self.desk.now()) if row["key"] == path), path)
        self.desk.shell.dialogs.confirm(
            _("Go back to {when}?").format(when=text),
            _("Robots, missions, schedules and history become as they were then; what has happened since is kept aside as a file, "
              "but not shown any more. The app starts again."),
            _("Restore"), lambda: self._confirmed(Path(path)), danger=True)

    def _confirmed(self, path: Path) -> None:
        """A backup that can't be used is told before anything is stopped."""
        self.vm.restoring = True
        self.desk.work(lambda: self.desk.files.check_backup(path), lambda _none: self._go_back(path), self._not_backed_up)

    def _go_back(self, path: Path) -> None:
        self.vm.restoring = False
        if self._restore is not None:
            self._restore(path)


class WithOutcome(BoxLayout):
    """Something that is used, with the outcome below it."""
    model = ObjectProperty(None, rebind=True, allownone=True)

    def add_widget(self, widget: Widget, *args: Any, **kwargs: Any) -> None:
        """Whatever kv adds stands above the outcome, which comes first with the class's own rule."""
        super().add_widget(widget, index=1 if self.children else 0)


class FileRow(BoxLayout):
    """A path and the button that uses it: ``on_go``."""
    label = StringProperty()
    icon = StringProperty()
    action = StringProperty()
    model = ObjectProperty(None, rebind=True, allownone=True)

    __events__ = ("on_go",)

    def on_go(self) -> None:
        """The button was pressed, or Enter in the field."""

    def entered(self, text: str) -> None:
        if self.model is not None and text != self.model.path:
            self.model.path, self.model.problem = text, ""
