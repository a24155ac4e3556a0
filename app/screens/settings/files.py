"""The sheet that asks where a file goes, or which one is read: from the places that are there, or typed."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, TypeVar

from kivy.properties import BooleanProperty, ListProperty, StringProperty

from app.i18n import _
from app.screens.common.places import ICONS, place_word
from app.screens.common.problems import sentence_of
from app.screens.settings.page import PageContext
from app.screens.settings.view import file_note
from app.services.files.places import FoundFile, Place, found_in
from app.widgets.items import Item
from app.widgets.sheet import Sheet

T = TypeVar("T")
ANOTHER = ""  # key of the place that is typed


@dataclass(frozen=True)
class _Offer:
    """``at``: the place that is shown; ``free``: the name of a new file there; ``found``: its files."""

    places: list[Place]
    at: Place
    free: str
    found: list[FoundFile]


class FileSheet(Sheet):
    """With a ``stem`` a file is written, with a free name of that; without one it is chosen, newest first. ``then(sheet)`` is its button,
    which calls ``run``."""

    scrolls = BooleanProperty(False)
    what = StringProperty()
    items = ListProperty()
    file = StringProperty()  # its name in the place, or its path
    problem = StringProperty()
    typed = BooleanProperty(False)  # the path is
    writes = BooleanProperty(False)
    running = BooleanProperty(False)

    def __init__(
        self,
        context: PageContext,
        places: Callable[[], list[Place]],
        suffix: str,
        then: Callable[[FileSheet], object],
        stem: str = "",
        **kwargs: Any,
    ) -> None:
        self._context, self._places, self._suffix, self._stem = context, places, suffix, stem
        self._at: Path | None = None  # the place that was tapped
        self._offer: _Offer | None = None
        super().__init__(title=_("Where?") if stem else _("Where from?"), writes=bool(stem), **kwargs)
        self.bind(on_done=then)
        self._look()

    @property
    def path(self) -> str:
        at = self._at or (self._offer and self._offer.at.path)
        return self.file if self.typed or at is None or not self.file else str(at / self.file)

    @property
    def _apart(self) -> str:
        """A share whose server is down may hang: this must not delay anything else."""
        return f"files {ANOTHER if self.typed else self._at or ''}"

    # ------------------------------------------------------------------ what is chosen
    def choose(self, key: str) -> None:
        """A place or a file by its path, or ``ANOTHER``."""
        self.problem = ""
        if self._offer is not None and any(str(file.path) == key for file in self._offer.found):
            self.file = key
        elif key == ANOTHER:
            self.file, self.typed = self.path, True
        else:
            self.file, self.typed, self._at = "", False, Path(key)
            self._look()
        self._show()

    def named(self, text: str) -> None:
        """Typed as the file's name, or as its path."""
        if text != self.file:
            self.file, self.problem = text, ""
            self._show()

    def _look(self) -> None:
        files = self._context.services.files

        def look() -> _Offer:
            places = self._places()
            at = next((place for place in places if place.path == self._at), places[0])
            if self.writes:
                return _Offer(places, at, files.suggested(self._stem, self._suffix, at.path).name, [])
            return _Offer(places, at, "", found_in(at.path, self._suffix))

        def shown(offer: _Offer) -> None:
            self._offer = offer
            if not self.typed:
                self.file = offer.free or next((str(file.path) for file in offer.found), "")
            self._show()

        self._context.run(look, shown, key=("settings file", self), apart=self._apart)

    def _show(self) -> None:
        offer = self._offer
        if offer is None:
            return
        at, is_there = self._at or offer.at.path, self._at in (None, offer.at.path)
        items = [self._place(place, not self.typed and place.path == at) for place in offer.places]
        another = Item(ANOTHER, _("Another place"), icon="folder-edit-outline")
        items.append(self._marked(another, self.typed))
        if not self.typed and is_there:
            items += [self._file(file) for file in offer.found]
        self.items = items
        self.foot_off = (
            ""
            if self.file
            else _("No file {suffix} there").format(suffix=self._suffix)
            if is_there
            else _("Looking for files")
        )

    @staticmethod
    def _marked(item: Item, is_chosen: bool) -> Item:
        return replace(item, look="chosen", meta_icon="check") if is_chosen else item

    def _place(self, place: Place, is_chosen: bool) -> Item:
        return self._marked(Item(str(place.path), place_word(place), icon=ICONS[place.kind]), is_chosen)

    def _file(self, file: FoundFile) -> Item:
        facts = self._context.facts
        note = file_note(file, facts.settings.timezone, self._context.now())
        return self._marked(
            Item(str(file.path), file.path.name, note, icon="file-document-outline"), str(file.path) == self.file
        )

    # ------------------------------------------------------------------ what is done with it
    def run(self, work: Callable[[str], T], done: Callable[[T], object]) -> None:
        """Run ``work(path)`` in the background, then ``done(result)``, and close unless that returns False; a problem is
        shown here."""
        if self.running or not self.file:
            return
        self.running, self.problem = True, ""
        path, sheets = self.path, self._context.shell.sheets

        def ended(result: T) -> None:
            self.running = False
            if done(result) is not False:
                sheets.close(self)

        def failed(problem: BaseException) -> None:
            self.running, self.problem = False, sentence_of(problem)
            if sheets.top is not self:
                self._context.shell.say_problem(problem)

        self._context.run(lambda: work(path), ended, failed, apart=f"{self._apart}, {self._suffix} {self._stem}")
