"""The language of the texts: gettext catalogues, switched while the app runs, without kivy.

Python uses ``_("Save")`` and ``ngettext("{n} robot", "{n} robots", n).format(n=n)``; kv uses ``tr._("Save")`` (app/widgets/tr.py).
The texts in the code are the English ones. Other languages are ``locale/<language>/LC_MESSAGES/amr.mo``, which
``python -m tests.catalogues extract`` compiles from the .po file next to each.
"""

from __future__ import annotations

import gettext
from collections.abc import Callable
from pathlib import Path

DOMAIN = "amr"
LOCALE_DIR = Path(__file__).resolve().parents[1] / "locale"
SOURCE_LANGUAGE = "en"


def translation(language: str, directory: Path = LOCALE_DIR) -> gettext.NullTranslations:
    """The texts of ``language``; English ones if it is English or has no catalogue. A name that is a path has no
    catalogue."""
    if language not in languages(directory)[1:]:
        return gettext.NullTranslations()
    with (directory / language / "LC_MESSAGES" / f"{DOMAIN}.mo").open("rb") as file:
        return gettext.GNUTranslations(file)


def languages(directory: Path = LOCALE_DIR) -> list[str]:
    """Languages there are texts in, English first."""
    found = {path.parents[1].name for path in directory.glob(f"*/LC_MESSAGES/{DOMAIN}.mo")}
    return [SOURCE_LANGUAGE, *sorted(found - {SOURCE_LANGUAGE})]


class Translator:
    """The present language, and callbacks for when it changes."""

    def __init__(self) -> None:
        self.language = SOURCE_LANGUAGE
        self._texts: gettext.NullTranslations = gettext.NullTranslations()
        self._observers: list[Callable[[], object]] = []

    def use(self, language: str, directory: Path = LOCALE_DIR) -> None:
        """Switch to ``language``; call it on the UI thread, as observers redraw."""
        self._texts = translation(language, directory)
        self.language = language
        for observer in list(self._observers):
            observer()

    def subscribe(self, observer: Callable[[], object]) -> Callable[[], None]:
        """Call ``observer`` after each switch; returns what ends it."""
        self._observers.append(observer)
        return lambda: self._observers.remove(observer) if observer in self._observers else None

    def gettext(self, message: str) -> str:
        return self._texts.gettext(message) if message else ""

    def ngettext(self, one: str, many: str, n: int) -> str:
        return self._texts.ngettext(one, many, n)

    def pgettext(self, context: str, message: str) -> str:
        """For short words that differ between languages by their place ("Failed" of a run, of a robot)."""
        return self._texts.pgettext(context, message)


translator = Translator()  # a process has one language
_ = translator.gettext
ngettext = translator.ngettext
pgettext = translator.pgettext
