"""Where files go to or come from, in words: the Documents folder, sticks, shares."""
from __future__ import annotations

from app.i18n import _
from app.screens.common.options import Option
from app.services.files.places import Place, PlaceKind

ICONS = {PlaceKind.DOCUMENTS: "folder-outline", PlaceKind.USB: "usb-flash-drive-outline", PlaceKind.SHARE: "folder-network-outline"}


def place_word(place: Place) -> str:
    return {PlaceKind.DOCUMENTS: _("Documents"), PlaceKind.USB: _("USB: {name}").format(name=place.name),
            PlaceKind.SHARE: _("Share: {name}").format(name=place.name)}[place.kind]


def place_option(place: Place, *, selected: bool = False) -> Option:
    return Option(str(place.path), place_word(place), ICONS[place.kind], selected=selected)
