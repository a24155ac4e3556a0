"""The language of the texts: gettext catalogues, switched while the app runs, without kivy.

Python uses ``_("Save")`` and ``ngettext("{n} robot", "{n} robots", n).format(n=n)``; kv uses ``tr._("Save")`` (app/widgets/tr.py).
The texts in the code are the English ones. Other languages are ``locale/<language>/LC_MESSAGES/amr.po``; they are compiled in memory
when chosen, so that no outdated compiled file can lie next to them. ``python -m tests.catalogues`` extracts and checks them.
"""

from __future__ import annotations

import ast
import gettext
import io
import struct
from collections.abc import Callable, Iterator
from pathlib import Path

DOMAIN = "amr"
LOCALE_DIR = Path(__file__).resolve().parents[1] / "locale"
SOURCE_LANGUAGE = "en"
CONTEXT_MARK = "\x04"  # gettext's separator between context and msgid


class CatalogueError(ValueError):
    """A .po file that cannot be read; says file, line and what is wrong."""


def read_po(path: Path) -> dict[str, list[str]]:
    """msgid (with context and plural in gettext's own joining) -> translations, fuzzy and empty ones left out.

    The header is the entry of the empty msgid. Raises ``CatalogueError``.
    """
    messages: dict[str, list[str]] = {}
    for entry in po_entries(path):
        if entry.get("fuzzy") or "msgid" not in entry:
            continue
        key = entry["msgid"]
        if "msgctxt" in entry:
            key = entry["msgctxt"] + CONTEXT_MARK + key
        if "msgid_plural" in entry:
            key += "\0" + entry["msgid_plural"]
        forms = [entry[name] for name in sorted(n for n in entry if n.startswith("msgstr"))]
        if forms and all(forms):
            messages[key] = forms
    return messages


def po_entries(path: Path) -> Iterator[dict[str, str]]:
    """The entries of a .po file as {"msgctxt", "msgid", "msgid_plural", "msgstr" or "msgstr[n]", "fuzzy"}."""
    entry: dict[str, str] = {}
    field = ""
    for number, raw in enumerate(path.read_text(encoding="utf-8").splitlines(), 1):
        line = raw.strip()
        if not line or line.startswith("#~"):
            continue
        if line.startswith(("#", "msgctxt ", "msgid ")) and any(name.startswith("msgstr") for name in entry):
            yield entry
            entry = {}
        if line.startswith("#"):
            if line.startswith("#,") and "fuzzy" in line:
                entry["fuzzy"] = "yes"
            continue
        if not line.startswith('"'):
            field, _, line = line.partition(" ")
            if field.partition("[")[0] not in ("msgctxt", "msgid", "msgid_plural", "msgstr"):
                raise CatalogueError(f"{path}:{number}: expected msgid or msgstr, found {field!r}")
            entry[field] = ""
        try:
            entry[field] += ast.literal_eval(line.strip())
        except (ValueError, SyntaxError, KeyError) as problem:
            raise CatalogueError(f"{path}:{number}: not a quoted text: {line}") from problem
    if "msgid" in entry:
        yield entry


def compile_mo(messages: dict[str, list[str]]) -> bytes:
    """The binary catalogue (.mo, GNU gettext manual 10.3) of ``messages``."""
    pairs = sorted((key.encode(), "\0".join(forms).encode()) for key, forms in messages.items())
    keys_at = 7 * 4
    texts_at = keys_at + 16 * len(pairs)
    table, blob = [], b""
    for column in (0, 1):
        for pair in pairs:
            table += [len(pair[column]), texts_at + len(blob)]
            blob += pair[column] + b"\0"
    header = struct.pack("<7I", 0x950412DE, 0, len(pairs), keys_at, keys_at + 8 * len(pairs), 0, 0)
    return header + struct.pack(f"<{len(table)}I", *table) + blob


def translation(language: str, directory: Path = LOCALE_DIR) -> gettext.NullTranslations:
    """The texts of ``language``; English ones when it is English or has no catalogue. Its name may be a path: then it has none."""
    if language not in languages(directory):
        return gettext.NullTranslations()
    folder = directory / language / "LC_MESSAGES"
    if (source := folder / f"{DOMAIN}.po").exists():
        return gettext.GNUTranslations(io.BytesIO(compile_mo(read_po(source))))
    if (compiled := folder / f"{DOMAIN}.mo").exists():
        with compiled.open("rb") as file:
            return gettext.GNUTranslations(file)
    return gettext.NullTranslations()


def languages(directory: Path = LOCALE_DIR) -> list[str]:
    """Languages there are texts in, English first."""
    found = {
        path.parents[1].name for suffix in ("po", "mo") for path in directory.glob(f"*/LC_MESSAGES/{DOMAIN}.{suffix}")
    }
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
