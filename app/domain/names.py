"""Characters that a name may have: visible ones. Invisible characters and those that change the direction of writing
would make two different names look alike; many marks on one letter would be drawn over the next letters.

Categories are Unicode's (UAX 44). The joiners of UAX 31, section 2.3, stay in scripts that use them: inside a word of
Arabic or Indic letters, inside an emoji.
"""

from __future__ import annotations

import re
import unicodedata
from collections.abc import Iterator
from itertools import count

LONGEST = 80  # characters
MOST_MARKS = 3  # on one letter: no script in use needs more

_UNWANTED = frozenset({"Cc", "Cf", "Cs", "Co", "Cn", "Zl", "Zp"})
_MARKS = frozenset({"Mn", "Me"})  # drawn on the character before them
_FIRST_MARK = "\u0300"
_BLANK = frozenset("\u034f\u115f\u1160\u17b4\u17b5\u2800\u3164\uffa0")  # letters, marks and a symbol that show nothing
# Of one of several pictures of the character before; of a symbol only they are seen.
_SELECTORS = frozenset(map(chr, (*range(0xFE00, 0xFE10), *range(0xE0100, 0xE01F0), 0x180B, 0x180C, 0x180D, 0x180F)))
_RARE = _BLANK | _SELECTORS
_NOT_UTF_8 = re.compile("[\udc80-\udcff]")  # bytes, as Python keeps them in the name of a file (PEP 383)
_JOINERS = frozenset("\u200c\u200d")
_WITHOUT_JOINERS = ("LATIN ", "GREEK ", "CYRILLIC ", "CJK ", "HANGUL ", "HIRAGANA ", "KATAKANA ")


def normal(text: str) -> str:
    """In composed form (NFC), without the space around it."""
    return unicodedata.normalize("NFC", text.strip())


def unwanted(text: str) -> str:
    """The first character that a name can't contain; "" if there is none."""
    return next((character for n, character in enumerate(text) if not _may_stand(text, n)), "")


def has_visible(text: str) -> bool:
    """Whether there is a letter, a digit, a mark of punctuation or a symbol."""
    return any(unicodedata.category(character)[0] in "LNPS" and character not in _BLANK for character in text)


def is_mark(character: str) -> bool:
    """Whether it is drawn on the previous letter, such as an accent."""
    return unicodedata.category(character) in _MARKS and character not in _RARE


def cleaned(text: str, longest: int = LONGEST) -> str:
    """A valid name made of a text from a robot or a file: on one line, cut to the longest allowed; "" if nothing is
    left."""
    line = " ".join("".join(" " if unicodedata.category(c) in ("Cc", "Zl", "Zp") else c for c in text).split())
    name = visible(normal(visible(line)))[:longest].rstrip().rstrip("".join(_JOINERS))
    return name if has_visible(name) else ""


def visible(text: str) -> str:
    """Without all that can't be part of a name."""
    if text.isprintable() and (text.isascii() or (_RARE.isdisjoint(text) and not _has_marks(text))):
        return text
    seen = "".join(c for c in text if c in _JOINERS or not _is_unwanted(c))
    return "".join(c for n, c in enumerate(seen) if _may_stand(seen, n))


def of_file(name: str) -> str:
    """The name or path of a file as text that can be stored and shown: bytes in it that are no UTF-8 are read as Windows-1252."""
    text = _NOT_UTF_8.sub(lambda found: bytes([ord(found[0]) - 0xDC00]).decode("windows-1252", "replace"), name)
    return text.encode("utf-8", "replace").decode()


def generated(mission: str, robot: str) -> Iterator[str]:
    """ "<mission> on <robot>", then the same with 2, 3 … at the end; never longer than allowed."""
    return (_generated(mission, robot, number) for number in count(1))


def _generated(mission: str, robot: str, number: int) -> str:
    ending = f" {number}" if number > 1 else ""
    return cleaned(f"{mission} on {robot}", LONGEST - len(ending)) + ending


def is_generated(name: str, mission: str, robot: str) -> bool:
    """Whether ``generated`` makes this name."""
    number = name.rpartition(" ")[2]
    is_numbered = number.isascii() and number.isdecimal() and len(number) < 4
    return name in (_generated(mission, robot, 1), _generated(mission, robot, int(number)) if is_numbered else "")


def own_schedule_name(name: str, mission: str, robot: str) -> str:
    """``name`` as a person typed it; "" where ``generated`` makes it: its number would read as part of the robot's name."""
    return "" if is_generated(name, mission, robot) else name


def _is_unwanted(character: str) -> bool:
    return unicodedata.category(character) in _UNWANTED or character in _BLANK


def _has_marks(text: str) -> bool:
    return max(text) >= _FIRST_MARK and any(unicodedata.category(character) in _MARKS for character in text)


def _has_too_many_marks(text: str, n: int) -> bool:
    """Whether it is a mark on a letter that has the most already."""
    return n >= MOST_MARKS and all(
        unicodedata.category(character) in _MARKS for character in text[n - MOST_MARKS : n + 1]
    )


def _may_stand(text: str, n: int) -> bool:
    if _has_too_many_marks(text, n):
        return False
    if text[n] in _SELECTORS:
        return n > 0 and unicodedata.category(text[n - 1]) == "So"
    if text[n] not in _JOINERS:
        return not _is_unwanted(text[n])
    return 0 < n < len(text) - 1 and _writes_with_joiners(text[n - 1]) and _writes_with_joiners(text[n + 1])


def _writes_with_joiners(character: str) -> bool:
    return (
        unicodedata.category(character) in ("Lo", "Lm", "Mn", "Mc", "So", "Sk")
        and character not in _BLANK
        and not unicodedata.name(character, "").startswith(_WITHOUT_JOINERS)
    )
