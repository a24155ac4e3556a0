"""The page shown instead of the app while its database is damaged: the problem, and Restore."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, Generic, TypeVar

from kivy.properties import BooleanProperty, StringProperty
from kivy.uix.boxlayout import BoxLayout

from app.database.errors import DatabaseDamaged
from app.domain.message import Message, message
from app.i18n import SOURCE_LANGUAGE, _
from app.screens.common.problems import sentence_of, words_of
from app.screens.common.threads import Background, UiBus
from app.widgets import load_kv

T = TypeVar("T")


@dataclass(frozen=True)
class Damage(Generic[T]):
    """``restore`` puts the newest good backup in place and returns the services opened on it, off the UI thread. It raises Failure with one
    sentence. ``language`` is the one that was last set."""

    found: DatabaseDamaged
    restore: Callable[[], T]
    language: str = SOURCE_LANGUAGE

    @property
    def sentence(self) -> Message:
        """The text of the commands, without the restore command if there is a button for it."""
        found = self.found
        if found.backup is None:
            return found.message
        kept = message(", kept as {path}", path=found.kept_as) if found.kept_as else ""
        return message(
            "The database {path} is damaged ({problem}){kept}", path=found.path, problem=found.problem, kept=kept
        )


class RescuePage(BoxLayout, Generic[T]):
    """Nothing is scheduled while it is shown. ``done(services)`` when the restored ones run."""

    sentence = StringProperty()
    backup = StringProperty()
    problem = StringProperty()
    working = BooleanProperty(False)

    def __init__(self, damage: Damage[T], bus: UiBus, done: Callable[[T], object], **kwargs: Any) -> None:
        load_kv("rescue")
        self._damage, self._done = damage, done
        self._background = Background(bus, workers=1)
        backup = damage.found.backup
        super().__init__(sentence=words_of(damage.sentence), backup=backup.name if backup else "", **kwargs)

    def restore(self) -> None:
        """One press restores the backup that the page names."""
        if self.working or not self.backup:
            return
        self.working, self.problem = True, ""
        self._background.run(self._damage.restore, self._restored, self._failed)

    def _restored(self, services: T) -> None:
        self._background.close()
        self._done(services)

    def _failed(self, problem: BaseException) -> None:
        self.working = False
        self.problem = sentence_of(problem)

    def hint(self) -> str:
        if not self.backup:
            return ""
        return (
            _("Restore replaces it by {backup}. Everything that happened after that backup is lost.").format(
                backup=self.backup
            )
            + " "
            + _("The PIN of Settings and the robots' passwords will be those of that time.")
        )
