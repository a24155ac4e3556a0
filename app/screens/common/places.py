"""Where files go to or come from, in words: the Documents folder, sticks, shares."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from pathlib import Path

from app.i18n import _
from app.screens.common.shell import Shell
from app.services.files.exports import DataFiles
from app.services.files.places import Place, PlaceKind
from app.widgets.items import Option

ICONS = {
    PlaceKind.DOCUMENTS: "folder-outline",
    PlaceKind.USB: "usb-flash-drive-outline",
    PlaceKind.SHARE: "folder-network-outline",
    PlaceKind.TABLET: "tablet",
}


def place_word(place: Place) -> str:
    return {
        PlaceKind.DOCUMENTS: _("Documents"),
        PlaceKind.USB: _("USB: {name}").format(name=place.name),
        PlaceKind.SHARE: _("Share: {name}").format(name=place.name),
        PlaceKind.TABLET: _("This tablet"),
    }[place.kind]


def place_option(place: Place) -> Option:
    return Option(str(place.path), place_word(place), ICONS[place.kind])


def choose_place(shell: Shell, files: DataFiles, write: Callable[[Path], object]) -> None:
    """Look for places first."""
    shell.background.run(files.places, lambda places: write_to(shell, places, write), shell.say_problem)


def write_to(shell: Shell, places: Sequence[Place], write: Callable[[Path], object]) -> None:
    """``write(directory)``; asks which directory if a stick or a share is present."""
    if len(places) == 1:
        write(places[0].path)
    else:
        options = [place_option(place) for place in places]
        shell.dialogs.choose(_("Where to?"), options, lambda path: write(Path(path)))
