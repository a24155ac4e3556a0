"""A file to read or write: its place is chosen from those present, or typed."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import TypeVar

from kivy.event import EventDispatcher
from kivy.properties import BooleanProperty, ListProperty, ObjectProperty, StringProperty
from kivy.uix.boxlayout import BoxLayout

from app.i18n import _
from app.screens.common import formats
from app.screens.common.options import Option
from app.screens.common.places import place_option, place_word
from app.screens.common.presses import Presses
from app.screens.common.problems import sentence_of
from app.screens.settings.page import PageContext
from app.services.files.exports import DataFiles
from app.services.files.places import FoundFile, Place, found_in
from app.widgets import flow  # noqa: F401  (registers kivy classes)

T = TypeVar("T")
Offer = tuple[
    list[Place], Place, Path | None, list[FoundFile]
]  # the places, the shown one, the suggested name there, its files
ANOTHER = ""  # key of the place that is typed


class FileModel(EventDispatcher):
    """One action on a file: its path, its problem, whether it is running. With a ``stem`` the file is written, under a
    free name; without one it is read, and chosen from a list."""

    path = StringProperty()
    problem = StringProperty()
    busy = BooleanProperty(False)
    places = ListProperty()  # chips
    typed = BooleanProperty(False)  # the path is
    name = StringProperty()  # of the file
    note = StringProperty()  # its day and size

    def __init__(self, suffix: str, stem: str = "") -> None:
        super().__init__()
        self._suffix, self._stem = suffix, stem
        self._at: Path | None = None
        self._offer: Offer | None = None
        self._presses = Presses()

    def reached(self, context: PageContext, files: DataFiles) -> None:
        """Read the places, and suggest a free name, or the newest file."""
        self._context, self._files, self.problem = context, files, ""
        self._ask(lambda: None)

    def choose(self, place: str) -> None:
        """A place by its path, or ``ANOTHER``."""
        self.typed, self.problem = place == ANOTHER, ""
        if self.typed:
            self._show()
        else:
            self._at, self.path = Path(place), ""
            self._ask(self._list if not self._stem else lambda: None)

    def pick(self) -> None:
        """The file was tapped: choose from the present files, or type another name."""
        if self._stem:
            self.choose(ANOTHER)
        else:
            self._ask(self._list)

    def _list(self) -> None:
        if self._offer is not None and self._offer[3]:
            self._context.shell.dialogs.choose(
                place_word(self._offer[1]),
                [
                    Option(str(file.path), file.path.name, "file-document-outline", self._note(file))
                    for file in self._offer[3]
                ],
                self._picked,
                selected=self.path,
            )

    def _picked(self, path: str) -> None:
        self.path, self.problem = path, ""
        self._show()

    def _ask(self, then: Callable[[], object]) -> None:
        def shown(offer: Offer) -> None:
            self._offer = offer
            _places, _at, free, found = offer
            if not self.typed:
                self.path = str(free) if free else self.path or str(found[0].path if found else "")
            self._show()
            then()

        self._context.run(self._look, shown, key=("settings file", self), apart=self._apart)

    @property
    def _apart(self) -> str:
        """A share whose server is down may hang: this must not block anything else."""
        return f"files {ANOTHER if self.typed else self._at or ''}"

    def _look(self) -> Offer:
        places = self._files.places()
        place = next((place for place in places if place.path == self._at), places[0])
        if self._stem:
            return places, place, self._files.suggested(self._stem, self._suffix, place.path), []
        return places, place, None, found_in(place.path, self._suffix)

    def _show(self) -> None:
        if self._offer is None:
            return
        places, at, _free, found = self._offer
        self.places = [
            *(place_option(place, selected=not self.typed and place == at) for place in places),
            Option(ANOTHER, _("Another place"), "folder-edit-outline", selected=self.typed),
        ]
        file = next((file for file in found if str(file.path) == self.path), None)
        self.note = self._note(file) if file else _("File")
        self.name = Path(self.path).name or _("No file {suffix} there").format(suffix=self._suffix)

    def _note(self, file: FoundFile) -> str:
        """Day and size."""
        return _("{when} · {size} kB").format(
            when=formats.day_and_time(file.changed_at, self._context.facts.settings.timezone, self._context.now()),
            size=max(1, round(file.size / 1000)),
        )

    def run(self, context: PageContext, work: Callable[[str], T], done: Callable[[T], object]) -> bool:
        """Run ``work(path)`` in the background, then ``done(result)``, which returns False if nothing is done yet; a
        problem is shown at the field. Returns False while it runs, and for a second tap."""
        if self.busy or self._presses.is_same("run"):
            return False
        self.busy, self.problem = True, ""
        path = self.path

        def ended(result: T) -> None:
            self.busy = False
            if done(result) is not False:
                self._presses.rest("run")

        def failed(problem: BaseException) -> None:
            self.busy, self.problem = False, sentence_of(problem)

        context.run(lambda: work(path), ended, failed, apart=f"{self._apart}, {self._suffix} {self._stem}")
        return True


class FileRow(BoxLayout):
    """The place of a file, and the button that uses it: ``on_go``."""

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


class FilePart(BoxLayout):
    """The file of a row: typed or chosen."""

    card = ObjectProperty(None, rebind=True)
