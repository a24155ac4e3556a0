"""A small Finnish catalogue with everything that a .po file may have."""

from __future__ import annotations

from pathlib import Path

from tests import catalogues

FINNISH = r"""
msgid ""
msgstr ""
"Content-Type: text/plain; charset=UTF-8\n"
"Plural-Forms: nplurals=2; plural=(n != 1);\n"

# a comment of the translator
#: app/screens/home/screen.py
msgid "Save"
msgstr "Tallenna"

#, python-brace-format
msgid "{n} robot"
msgid_plural "{n} robots"
msgstr[0] "{n} robotti"
msgstr[1] "{n} robottia"

msgctxt "run"
msgid "Failed"
msgstr "Epäonnistui"

msgid ""
"A text on "
"two lines: \"quoted\"\n"
msgstr "Kaksi riviä: \"lainattu\"\n"

#, fuzzy
msgid "Guessed"
msgstr "Arvattu"

msgid "Not yet"
msgstr ""

#~ msgid "Gone"
#~ msgstr "Poissa"
"""


def write_finnish(locale: Path) -> Path:
    """Put it into this directory of catalogues, and return that."""
    folder = locale / "fi" / "LC_MESSAGES"
    folder.mkdir(parents=True)
    (folder / "amr.po").write_text(FINNISH, encoding="utf-8")
    (folder / "amr.mo").write_bytes(catalogues.compiled(catalogues.read(folder / "amr.po")))
    return locale
