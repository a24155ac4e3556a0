"""Settings, Data: configuration and history as files, backups. Every action shows the path of its file."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

from kivy.event import EventDispatcher
from kivy.properties import BooleanProperty, ObjectProperty, StringProperty

from app.domain.message import Message
from app.i18n import _
from app.screens.common.options import Option
from app.screens.settings.files import FileModel
from app.screens.settings.page import SettingsPage
from app.screens.settings.view import NoticeView, backup_options, backups_phrase, done, import_result, went_wrong
from app.services.catalogue.configuration.importing import DeletesRuns
from app.services.files.places import FoundFile


class DataModel(EventDispatcher):
    export_configuration = ObjectProperty(rebind=True)
    import_configuration = ObjectProperty(rebind=True)
    export_log = ObjectProperty(rebind=True)
    log_for_excel = BooleanProperty(False)
    configuration_outcome = ObjectProperty(NoticeView())
    log_outcome = ObjectProperty(NoticeView())
    backup_outcome = ObjectProperty(NoticeView())
    backups = StringProperty()
    backing_up = BooleanProperty(False)
    restoring = BooleanProperty(False)
    can_restore = BooleanProperty(False)
    restore_hint = StringProperty()

    def __init__(self) -> None:
        super().__init__(
            export_configuration=FileModel(".json", "amr-scheduler"),
            import_configuration=FileModel(".json"),
            export_log=FileModel(".csv", "amr-scheduler-log"),
        )


class DataPage(SettingsPage):
    Model = DataModel

    def show(self) -> None:
        vm, facts, can_restore = self.vm, self.context.facts, self.context.shell.restore is not None
        vm.backups = backups_phrase(facts, self.context.now())
        vm.can_restore = can_restore and bool(facts.backups)
        vm.restore_hint = "" if can_restore else _("The person in charge of this tablet can restore one")

    @property
    def is_busy(self) -> bool:
        vm = self.vm
        files = (vm.export_configuration, vm.import_configuration, vm.export_log)
        return bool(vm.backing_up or vm.restoring or any(file.busy for file in files))

    def reached(self, **intent: Any) -> None:
        vm = self.vm
        vm.configuration_outcome = vm.log_outcome = vm.backup_outcome = NoticeView()
        for file in (vm.export_configuration, vm.import_configuration, vm.export_log):
            file.reached(self.context, self.context.services.files)
        self.context.refresh()  # backups are files too: others may add and delete them

    # ------------------------------------------------------------------ files
    def export_configuration(self) -> None:
        if self.vm.export_configuration.run(
            self.context, self.context.services.files.export_configuration, self._configuration_written
        ):
            self.vm.configuration_outcome = NoticeView()

    def import_configuration(self, *, may_delete: bool = False) -> None:
        files = self.context.services.files
        if self.vm.import_configuration.run(
            self.context, lambda path: files.import_configuration(path, may_delete=may_delete), self._configuration_read
        ):
            self.vm.configuration_outcome = NoticeView()

    def export_log(self) -> None:
        files, for_excel = self.context.services.files, self.vm.log_for_excel
        if self.vm.export_log.run(
            self.context, lambda path: files.export_history(path, for_excel=for_excel), self._log_written
        ):
            self.vm.log_outcome = NoticeView()

    def _configuration_written(self, path: Path) -> None:
        self.vm.configuration_outcome = done(_("Configuration written, without passwords"), str(path))
        for file in (
            self.vm.export_configuration,
            self.vm.import_configuration,
        ):  # the next name is free, and this one is there
            file.reached(self.context, self.context.services.files)

    def _configuration_read(self, found: Sequence[Message] | DeletesRuns) -> bool:
        """Whether it was imported: what it deletes is asked first."""
        if isinstance(found, DeletesRuns):
            self.ask_to_delete(
                found.count,
                _(
                    "The file lowers the number of runs that are kept to {limit}. The oldest ones beyond that are deleted for ever."
                ).format(limit=found.limit),
                _("Import and delete"),
                lambda: self.import_configuration(may_delete=True),
            )
            return False
        self.vm.configuration_outcome = import_result(found)
        self.context.refresh()
        return True

    def _log_written(self, path: Path) -> None:
        self.vm.log_outcome = done(_("Log written"), str(path))
        self.vm.export_log.reached(self.context, self.context.services.files)

    # ------------------------------------------------------------------ backups
    def back_up(self) -> None:
        if not self.vm.backing_up:
            self.vm.backing_up = True
            self.context.run(self.context.services.files.back_up_now, self._backed_up, self._failed)

    def _backed_up(self, backup: FoundFile) -> None:
        self.vm.backing_up = False
        self.vm.backup_outcome = done(_("Backup made"), str(backup.path))
        self.context.refresh()

    def _failed(self, problem: BaseException) -> None:
        self.vm.backing_up = self.vm.restoring = False
        self.vm.backup_outcome = went_wrong(problem)

    def restore(self) -> None:
        """Choose a backup, then confirm: everything since the backup is replaced."""
        self.context.shell.dialogs.choose(_("Restore which backup?"), self._backup_options(), self._confirm)

    def _backup_options(self) -> list[Option]:
        return backup_options(self.context.facts, self.context.now())

    def _confirm(self, path: str) -> None:
        when = next((option.text for option in self._backup_options() if option.key == path), path)
        self.context.shell.dialogs.confirm(
            _("Restore the backup of {when}?").format(when=when),
            _(
                "Settings, robots, missions, schedules and history return to that state, the robots' passwords and the PIN "
                "for Settings too. The present database is kept as a file, but no longer shown. The app restarts."
            ),
            _("Restore"),
            lambda: self._check(Path(path)),
            danger=True,
        )

    def _check(self, path: Path) -> None:
        """Report a backup that can't be used before anything is stopped."""
        self.vm.restoring = True
        self.context.run(
            lambda: self.context.services.files.check_backup(path), lambda _none: self._restore(path), self._failed
        )

    def _restore(self, path: Path) -> None:
        self.vm.restoring = False
        if self.context.shell.restore is not None:
            self.context.shell.restore(path)
