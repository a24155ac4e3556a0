"""The page that is shown instead of the app while its database is damaged: what happened, and Restore."""
from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Generic, TypeVar

from kivy.properties import BooleanProperty, StringProperty
from kivy.uix.boxlayout import BoxLayout

from app.domain.message import Message
from app.i18n import SOURCE_LANGUAGE, _
from app.screens.common.problems import sentence_of, words_of
from app.screens.common.threads import Background, UiBus
from app.widgets import load_kv

T = TypeVar("T")


@dataclass(frozen=True)
class Damage(Generic[T]):
    """``sentence`` is the one that the commands print, in its parts; ``backup`` the newest good one, if there is any; ``restore`` puts it
    in place and returns the services opened on it, off the UI thread. It raises Failure with one sentence. ``language`` is the one that
    was last set."""
    sentence: Message
    backup: Path | None
    restore: Callable[[], T]
    language: str = SOURCE_LANGUAGE


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
        super().__init__(sentence=words_of(damage.sentence), backup=damage.backup.name if damage.backup else "", **kwargs)

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
        return (_("Restore puts {backup} in its place; what happened after it is lost.").format(backup=self.backup) + " "
                + _("The PIN of Settings and the robots' passwords will be those of that time."))
