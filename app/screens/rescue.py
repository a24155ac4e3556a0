"""The pages shown instead of the app. While its database is damaged: the newest good backup or another one, and Restore. While it can't
start for another reason: which one.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from datetime import UTC, datetime
from pathlib import Path
from typing import Any, Generic, TypeVar

from kivy.clock import Clock
from kivy.properties import BooleanProperty, ListProperty, StringProperty
from kivy.uix.boxlayout import BoxLayout

from app.database.backups import backups_of, settings_in
from app.database.errors import DatabaseDamaged
from app.domain.message import Message, message
from app.i18n import SOURCE_LANGUAGE, _
from app.screens.common import formats
from app.screens.common.places import place_word
from app.screens.common.problems import sentence_of, words_of
from app.screens.common.threads import Background, UiBus
from app.services.files.places import FoundFile, Place, PlaceKind, found_in, mounted
from app.widgets import load_kv
from app.widgets.display import EmptyState
from app.widgets.items import Action, Item

T = TypeVar("T")
TRIED_EVERY = 10.0  # s


@dataclass(frozen=True)
class Damage(Generic[T]):
    """``restore`` puts a backup in place and returns the services opened on it, off the UI thread. It raises Failure with one
    sentence. ``language`` is the one that was last set."""

    found: DatabaseDamaged
    restore: Callable[[Path], T]
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

    def page(self, bus: UiBus, done: Callable[[T], object]) -> RescuePage[T]:
        return RescuePage(self, bus, done)


@dataclass(frozen=True)
class NotStarted(Generic[T]):
    """``start`` returns the services or raises, off the UI thread."""

    problem: Exception
    start: Callable[[], T]
    language: str = SOURCE_LANGUAGE

    def page(self, bus: UiBus, done: Callable[[T], object]) -> NotStartedPage[T]:
        return NotStartedPage(self, bus, done)


class NotStartedPage(EmptyState, Generic[T]):
    """Tries again from time to time: a disk may have room again. ``done(services)`` when they run."""

    def __init__(self, found: NotStarted[T], bus: UiBus, done: Callable[[T], object]) -> None:
        super().__init__(icon="alert-circle-outline", title=_("The app can't start"))
        self._start, self._done = found.start, done
        self._background = Background(bus, workers=1)
        self._failed(found.problem)

    def _failed(self, problem: BaseException) -> None:
        self.text = f"{sentence_of(problem)}\n\n{_('Nothing is sent. Robots continue with what they have.')}"
        Clock.schedule_once(lambda _dt: self._background.run(self._start, self._started, self._failed), TRIED_EVERY)

    def _started(self, services: T) -> None:
        self._background.close()
        self._done(services)


class RescuePage(BoxLayout, Generic[T]):
    """Nothing is scheduled while it is shown. ``done(services)`` when the restored ones run."""

    sentence = StringProperty()
    backup = StringProperty()  # path of the chosen one
    when = StringProperty()  # it was made
    items = ListProperty()  # the chosen backup, or all to choose from
    problem = StringProperty()
    working = BooleanProperty(False)
    explains = BooleanProperty(False)  # what is damaged

    def __init__(self, damage: Damage[T], bus: UiBus, done: Callable[[T], object], **kwargs: Any) -> None:
        load_kv("rescue")
        self._damage, self._done = damage, done
        self._background = Background(bus, workers=1)
        super().__init__(sentence=words_of(damage.sentence), **kwargs)
        if damage.found.backup is None:
            self.items = [Item("", _("No good backup on this tablet"), look="tint", tone="attention", opens=False)]
        else:
            self._choose(str(damage.found.backup))
            action = Action("another", _("Choose another"), style="text")
            support = f"{self.when}, {place_word(Place(PlaceKind.TABLET, Path()))}"
            self.items = [
                Item("", _("Newest good backup"), support, icon="backup-restore", opens=False, actions=(action,))
            ]

    def press(self) -> None:
        """The button: restore the chosen backup; without one, look for some."""
        if self.backup:
            self.restore()
        else:
            self.act("", "another")

    def act(self, path: str, action: str, *_values: object) -> None:
        if action == "another":
            self.working, self.problem = True, ""
            self._background.run(self._look, self._looked, self._failed)
        else:
            self._choose(path)
            self.items = [replace(item, look="chosen" if item.key == path else "plain") for item in self.items]

    def restore(self) -> None:
        """One press restores the backup that the page names."""
        if self.working or not self.backup:
            return
        self.working, self.problem = True, ""
        path = Path(self.backup)
        self._background.run(lambda: self._damage.restore(path), self._restored, self._failed)

    def _look(self) -> list[Item]:
        """All backups: those of this tablet, then those on sticks and shares."""
        here = Place(PlaceKind.TABLET, Path())
        files = [(here, FoundFile.at(path)) for path in backups_of(self._damage.found.path)]
        files += [(place, file) for place in mounted() for file in found_in(place.path, ".db")]
        return [
            Item(
                str(file.path),
                self._when(file.path),
                f"{place_word(place)} · {file.path.name}",
                icon="backup-restore",
                look="chosen" if str(file.path) == self.backup else "plain",
            )
            for place, file in files
        ]

    def _looked(self, items: list[Item]) -> None:
        self.working = False
        if items:
            self.items = items
        else:
            self.problem = _("No backup here, on a stick or a share")

    def _choose(self, path: str) -> None:
        self.backup, self.when = path, self._when(Path(path))

    @staticmethod
    def _when(path: Path) -> str:
        """When it was made, in the time zone that was set then."""
        try:
            made = FoundFile.at(path).changed_at
        except (OSError, ValueError, OverflowError):
            return path.name
        return formats.day_and_time(made, settings_in(path).timezone, datetime.now(UTC))

    def _restored(self, services: T) -> None:
        self._background.close()
        self._done(services)

    def _failed(self, problem: BaseException) -> None:
        self.working = False
        self.problem = sentence_of(problem)

    def losses(self, when: str) -> list[Item]:
        """What a restore means."""
        if not when:
            return []
        return [
            Item(icon, text, icon=icon, opens=False, strong=False)
            for icon, text in (
                ("history", _("Lost: what was done after {when}").format(when=when)),
                ("key-outline", _("Passwords and PIN as they were then")),
                ("file-outline", _("The damaged data is kept as a file")),
            )
        ]
