"""Settings, Data: configuration and history as files, backups. Every action shows the path of its file."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import partial
from pathlib import Path
from typing import Any

from kivy.event import EventDispatcher
from kivy.properties import BooleanProperty, ListProperty, ObjectProperty

from app.domain.message import Message
from app.i18n import _
from app.screens.common import formats
from app.screens.settings.files import FileSheet
from app.screens.settings.page import PageContext, SettingsPage
from app.screens.settings.view import NoticeView, data_items, done, import_result, went_wrong
from app.services.catalogue.configuration.importing import DeletesRuns
from app.services.files.places import FoundFile


class DataModel(EventDispatcher):
    items = ListProperty()
    outcome = ObjectProperty(NoticeView())
    backing_up = BooleanProperty(False)


class DataPage(SettingsPage):
    Model = DataModel

    def __init__(self, context: PageContext) -> None:
        super().__init__(context)
        self._files = context.services.files
        self._sheet: FileSheet | None = None  # the last one

    def show(self) -> None:
        self.vm.items = data_items(
            self.context.facts,
            self.context.now(),
            can_restore=self.context.shell.restore is not None,
            backing_up=self.vm.backing_up,
        )

    @property
    def is_busy(self) -> bool:
        return bool(self.vm.backing_up or (self._sheet is not None and self._sheet.running))

    def reached(self, **intent: Any) -> None:
        self.vm.outcome = NoticeView()
        self.context.refresh()  # backups are files too: others may add and delete them
        if intent.get("restore"):
            self.restore()

    def act(self, _key: str, action: str, *_values: Any) -> None:
        actions: dict[str, Callable[[], object]] = {
            "export": self.export_configuration,
            "import": self.import_configuration,
            "excel": partial(self.export_log, for_excel=True),
            "commas": self.export_log,
            "back_up": self.back_up,
            "restore": self.restore,
        }
        actions[action]()

    # ------------------------------------------------------------------ files
    def export_configuration(self) -> None:
        sheet = self._write(_("Configuration"), ".json", "amr-scheduler")
        sheet.bind(on_done=lambda sheet: sheet.run(self._files.export_configuration, self._configuration_written))

    def export_log(self, *, for_excel: bool = False) -> None:
        sheet = self._write(_("Runs"), ".csv", "amr-scheduler-log")
        sheet.bind(
            on_done=lambda sheet: sheet.run(partial(self._files.export_history, for_excel=for_excel), self._log_written)
        )

    def import_configuration(self) -> None:
        sheet = self._open(
            FileSheet(self.context, self._files.places, ".json", what=_("Configuration"), foot=_("Import"))
        )
        sheet.bind(on_done=self._import)

    def _write(self, what: str, suffix: str, stem: str) -> FileSheet:
        return self._open(
            FileSheet(
                self.context, self._files.places, suffix, stem, self._files.suggested, what=what, foot=_("Export")
            )
        )

    def _open(self, sheet: FileSheet) -> FileSheet:
        self.vm.outcome, self._sheet = NoticeView(), sheet
        self.context.shell.sheets.show(sheet)
        return sheet

    def _configuration_written(self, path: Path) -> None:
        self.vm.outcome = done(_("Configuration written, without passwords"), str(path))

    def _log_written(self, path: Path) -> None:
        self.vm.outcome = done(_("Log written"), str(path))

    def _import(self, sheet: FileSheet, *, may_delete: bool = False) -> None:
        def read(found: Sequence[Message] | DeletesRuns) -> bool:
            """Whether it was imported: what it deletes is asked first."""
            if isinstance(found, DeletesRuns):
                self.ask_to_delete(
                    found.count,
                    _(
                        "The file lowers the number of runs that are kept to {limit}. The oldest ones beyond that are deleted for ever."
                    ).format(limit=found.limit),
                    _("Import and delete"),
                    lambda: self._import(sheet, may_delete=True),
                )
                return False
            self.vm.outcome = import_result(found)
            self.context.refresh()
            return True

        sheet.run(lambda path: self._files.import_configuration(path, may_delete=may_delete), read)

    # ------------------------------------------------------------------ backups
    def back_up(self) -> None:
        if not self.vm.backing_up:
            self.vm.backing_up, self.vm.outcome = True, NoticeView()
            self.show()
            self.context.run(self._files.back_up_now, self._backed_up, self._failed)

    def _backed_up(self, backup: FoundFile) -> None:
        self.vm.backing_up = False
        access = _("It gives access to the robots, and stays until somebody deletes it.")
        self.vm.outcome = done(_("Backup made"), f"{backup.path}\n{access}")
        self.context.refresh()

    def _failed(self, problem: BaseException) -> None:
        self.vm.backing_up, self.vm.outcome = False, went_wrong(problem)

    def restore(self) -> None:
        """Choose a backup, then confirm: everything since the backup is replaced."""
        sheet = self._open(
            FileSheet(self.context, self._files.backup_places, ".db", what=_("Backup"), foot=_("Restore"))
        )
        sheet.bind(on_done=self._confirm)

    def _confirm(self, sheet: FileSheet) -> None:
        self.context.shell.dialogs.confirm(
            _("Restore the backup of {when}?").format(when=self._when(sheet.path)),
            _(
                "Settings, robots, missions, schedules and history return to that state, the robots' passwords and the PIN "
                "for Settings too. The present database is kept as a file, but no longer shown. The app restarts."
            ),
            _("Restore"),
            lambda: sheet.run(self._checked, self._restore),
            danger=True,
        )

    def _when(self, path: str) -> str:
        facts = self.context.facts
        at = next((backup.changed_at for backup in facts.backups if str(backup.path) == path), None)
        return formats.day_and_time(at, facts.settings.timezone, self.context.now()) if at else Path(path).name

    def _checked(self, path: str) -> Path:
        """Report a backup that can't be used before anything is stopped."""
        self._files.check_backup(Path(path))
        return Path(path)

    def _restore(self, path: Path) -> None:
        if self.context.shell.restore is not None:
            self.context.shell.restore(path)
