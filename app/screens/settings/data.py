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
from app.screens.common.shell import PROBLEM_SECONDS
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
)
from app.services.catalogue.configuration.importing import DeletesRuns
from app.services.files.places import FoundFile


class DataModel(EventDispatcher):
    items = ListProperty()
    outcome = ObjectProperty(NoticeView())


class ImportSheet(SettingsSheet):
    """What a file changes."""

    scrolls = BooleanProperty(False)
    found = ObjectProperty()  # its changes, and which runs they delete
    items = ListProperty()
    problem = StringProperty()

    def on_found(self, _sheet: ImportSheet, found: tuple[Sequence[Message], DeletesRuns | None]) -> None:
        self.title, self.items = changes_phrase(found[0]), import_items(*found)


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
        def written(path: Path) -> None:
            self.vm.outcome = done(_("Configuration written, without passwords"), str(path))

        self._open(
            self._files.places,
            ".json",
            lambda sheet: sheet.run(self._files.export_configuration, written),
            "amr-scheduler",
            what=_("Configuration"),
            foot=_("Export"),
        )

    def export_log(self, *, for_excel: bool = False) -> None:
        def written(path: Path) -> None:
            self.vm.outcome = done(_("Log written"), str(path))

        self._open(
            self._files.places,
            ".csv",
            lambda sheet: sheet.run(partial(self._files.export_history, for_excel=for_excel), written),
            "amr-scheduler-log",
            what=_("Runs"),
            foot=_("Export"),
        )

    def import_configuration(self) -> None:
        """Choose a file, then see what it changes."""
        self._open(
            self._files.places,
            ".json",
            lambda sheet: sheet.run(self._files.preview_import, partial(self._previewed, sheet)),
            what=_("Configuration"),
            foot=_("Show changes"),
        )

    def _open(self, *args: Any, **kwargs: Any) -> None:
        self.vm.outcome, self._sheet = NoticeView(), FileSheet(self.context, *args, **kwargs)
        self.context.shell.sheets.show(self._sheet)

    def _previewed(self, sheet: FileSheet, found: tuple[Sequence[Message], DeletesRuns | None]) -> bool:
        """Whether there is nothing to import."""
        if not found[0]:
            self.vm.outcome = done(_("The file contains nothing new"))
            return True
        changes = ImportSheet(found=found)
        changes.bind(on_done=lambda changes: self._import(changes, sheet))
        self.context.shell.sheets.over(changes)
        return False

    def _import(self, changes: ImportSheet, sheet: FileSheet) -> None:
        """Back up first: that is the way back. Runs that have come beyond the limit since the preview are shown first."""
        path, sheets, (lines, shown) = sheet.path, self.context.shell.sheets, changes.found

        def work() -> tuple[Sequence[Message], FoundFile]:
            _lines, deletes = self._files.preview_import(path)
            if deletes and not shown:
                raise deletes
            backup = self._files.back_up_now("before-import")
            return self._files.import_configuration(path, may_delete=shown is not None), backup

        def imported(found: tuple[Sequence[Message], FoundFile]) -> None:
            self.vm.outcome = import_result(*found)
            self.context.refresh()
            for each in (changes, sheet):
                sheets.close(each)

        def failed(problem: BaseException) -> None:
            changes.busy, changes.problem = False, sentence_of(problem)
            if isinstance(problem, DeletesRuns):
                changes.found = lines, problem
                changes.problem = changes.items[0].title
            if sheets.top is not changes:
                said = _("Not imported: {problem}").format(problem=changes.problem)
                self.context.shell.snackbars.show(said, icon="alert-circle-outline", seconds=PROBLEM_SECONDS)

        changes.busy, changes.problem = True, ""
        self.context.run(work, imported, failed, apart="import")

    # ------------------------------------------------------------------ backups
    def back_up(self) -> None:
        def backed_up(backup: FoundFile) -> None:
            access = _("It gives access to the robots, and stays until somebody deletes it.")
            self.vm.outcome = done(_("Backup made"), f"{backup.path}\n{access}")
            self.context.refresh()

        self._open(
            self._files.backup_places,
            ".db",
            lambda sheet: sheet.run(self._files.back_up_to, backed_up),
            "amr-scheduler-backup",
            what=_("Backup"),
            foot=_("Back up"),
        )

    def restore(self) -> None:
        """Choose a backup, then confirm: everything since the backup is replaced."""
        self._open(self._files.backup_places, ".db", self._confirm, what=_("Backup"), foot=_("Restore"))

    def _confirm(self, sheet: FileSheet) -> None:
        def checked(path: str) -> Path:
            """Report a backup that can't be used before anything is stopped."""
            self._files.check_backup(Path(path))
            return Path(path)

        self.context.shell.sheets.ask(
            _("Restore the backup of {when}?").format(when=self._when(sheet.path)),
            _(
                "Settings, robots, missions, schedules and history return to that state, the robots' passwords and the PIN "
                "for Settings too. The present database is kept as a file, but no longer shown. The app restarts."
            ),
            _("Restore"),
            lambda: sheet.run(checked, self._restore),
            _("Keep"),
        )

    def _when(self, path: str) -> str:
        facts = self.context.facts
        at = next((backup.changed_at for backup in facts.backups if str(backup.path) == path), None)
        return formats.day_and_time(at, facts.settings.timezone, self.context.now()) if at else Path(path).name

    def _restore(self, path: Path) -> None:
        if self.context.shell.restore is not None:
            self.context.shell.restore(path)
