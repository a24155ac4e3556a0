"""Settings, Data: configuration and history as files, backups. Every action shows the path of its file."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import partial
from pathlib import Path
from typing import Any

from kivy.event import EventDispatcher
from kivy.properties import BooleanProperty, ListProperty, ObjectProperty, StringProperty

from app.domain.message import Message
from app.i18n import _
from app.screens.common import formats
from app.screens.common.problems import sentence_of
from app.screens.settings.edit_sheet import SettingsSheet
from app.screens.settings.files import FileSheet
from app.screens.settings.page import PageContext, SettingsPage
from app.screens.settings.view import (
    NoticeView,
    changes_phrase,
    data_items,
    done,
    import_items,
    import_result,
    went_wrong,
)
from app.services.catalogue.configuration.importing import DeletesRuns
from app.services.files.places import FoundFile


class DataModel(EventDispatcher):
    items = ListProperty()
    outcome = ObjectProperty(NoticeView())


class ImportSheet(SettingsSheet):
    """What a file changes."""

    scrolls = BooleanProperty(False)
    items = ListProperty()
    problem = StringProperty()


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
        )

    @property
    def is_busy(self) -> bool:
        return bool(self._sheet is not None and self._sheet.running)

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
        """Choose a file, then see what it changes."""
        sheet = self._open(
            FileSheet(self.context, self._files.places, ".json", what=_("Configuration"), foot=_("Show changes"))
        )
        sheet.bind(on_done=lambda sheet: sheet.run(self._files.preview_import, partial(self._previewed, sheet)))

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

    def _previewed(self, sheet: FileSheet, found: tuple[Sequence[Message], DeletesRuns | None]) -> bool:
        """Whether there is nothing to import."""
        lines, deletes = found
        if not lines:
            self.vm.outcome = done(_("The file contains nothing new"))
            return True
        changes = ImportSheet(title=changes_phrase(lines), items=import_items(lines, deletes))
        changes.bind(on_done=lambda changes: self._import(changes, sheet, may_delete=deletes is not None))
        self.context.shell.sheets.over(changes)
        return False

    def _import(self, changes: ImportSheet, sheet: FileSheet, *, may_delete: bool) -> None:
        """Back up first: that is the way back."""
        path, sheets = sheet.path, self.context.shell.sheets

        def work() -> tuple[Sequence[Message] | DeletesRuns, FoundFile]:
            backup = self._files.back_up_now("before-import")
            return self._files.import_configuration(path, may_delete=may_delete), backup

        def imported(found: tuple[Sequence[Message] | DeletesRuns, FoundFile]) -> None:
            lines, backup = found
            self.vm.outcome = went_wrong(lines) if isinstance(lines, DeletesRuns) else import_result(lines, backup)
            self.context.refresh()
            for each in (changes, sheet):
                sheets.close(each)

        def failed(problem: BaseException) -> None:
            changes.busy, changes.problem = False, sentence_of(problem)
            if sheets.top is not changes:
                self.context.shell.say_problem(problem)

        changes.busy, changes.problem = True, ""
        self.context.run(work, imported, failed, apart="import")

    # ------------------------------------------------------------------ backups
    def back_up(self) -> None:
        sheet = self._open(
            FileSheet(
                self.context,
                self._files.backup_places,
                ".db",
                "amr-scheduler-backup",
                self._files.suggested,
                what=_("Backup"),
                foot=_("Back up"),
            )
        )
        sheet.bind(on_done=lambda sheet: sheet.run(self._files.back_up_to, self._backed_up))

    def _backed_up(self, backup: FoundFile) -> None:
        access = _("It gives access to the robots, and stays until somebody deletes it.")
        self.vm.outcome = done(_("Backup made"), f"{backup.path}\n{access}")
        self.context.refresh()

    def restore(self) -> None:
        """Choose a backup, then confirm: everything since the backup is replaced."""
        sheet = self._open(
            FileSheet(self.context, self._files.backup_places, ".db", what=_("Backup"), foot=_("Restore"))
        )
        sheet.bind(on_done=self._confirm)

    def _confirm(self, sheet: FileSheet) -> None:
        self.context.shell.sheets.ask(
            _("Restore the backup of {when}?").format(when=self._when(sheet.path)),
            _(
                "Settings, robots, missions, schedules and history return to that state, the robots' passwords and the PIN "
                "for Settings too. The present database is kept as a file, but no longer shown. The app restarts."
            ),
            _("Restore"),
            lambda: sheet.run(self._checked, self._restore),
            _("Keep"),
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
