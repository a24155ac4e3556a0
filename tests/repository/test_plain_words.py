"""Names, docstrings, comments, pages and texts on screen use usual words: neither operators nor readers need a glossary.

The words below were the private vocabulary of this code; each has its usual ones with it.
"""

from __future__ import annotations

import ast
import io
import re
import tokenize
from collections.abc import Iterator
from pathlib import Path

from tests import catalogues

ROOT = Path(__file__).parents[2]
FOLDERS = ("app", "mir_sim", "tests", "main.py")
PAGES = ("README.md", "CHANGELOG.md", "CONTRIBUTING.md", "SECURITY.md", "docs")
# in docstrings, comments, pages and texts on screen: what to write instead
PHRASES = {
    r"nobody|anybody": "no one, not; anyone; or name who",
    r"whoever|whomever": "who, anyone who; or name who",
    r"anew|once more": "again",
    r"meanwhile": "since, during it",
    r"by now": "now, already",
    r"of which": "two sentences",
    r"(?:put|puts|set|sets) right": "correct, solve, handle",
    r"(?:is|are|was|were) told": "is reported, is shown, gets",
    r"in vain": "without effect",
    r"has got": "has",
    r"but for": "except",
    r"all the same": "still, anyway",
    r"(?:held|keep|keeps|kept) back": "hold, held",
    r"lets? go": "release, free",
    r"(?:take|takes|taken) back": "withdraw, undo",
    r"(?:came|comes|become|becomes) of": "result, outcome",
    r"goes on|go on|went on": "continue",
}
# as a word in a name
NAMES = {
    "anew": "again",
    "nobody": "no_one",
    "whoever": "who",
    "meanwhile": "since",
    "told": "reported, shown, received",
}
ALLOWED = {"test_plain_words.py", "reliability.md"}
# quoted, or words of another meaning
EXCEPTIONS = re.compile(r"goes on and off|go on the map|'Nobody'")


BANNED = re.compile("|".join(rf"\b(?:{phrase})\b" for phrase in PHRASES), re.IGNORECASE)
# In small letters, which are searched much sooner than letters of any kind.
SUSPICIOUS = re.compile("|".join(PHRASES).replace(" ", r"\s+(?:# )?"))
SUSPICIOUS_NAMES = re.compile("|".join(NAMES))


def files(folders: tuple[str, ...], suffix: str, suspicious: re.Pattern[str]) -> Iterator[tuple[str, str]]:
    """Path and text of those that may use one of the words."""
    for folder in folders:
        for path in sorted((ROOT / folder).rglob(f"*{suffix}")) or [ROOT / folder]:
            text = path.read_text(encoding="utf-8")
            if path.name not in ALLOWED and suspicious.search(text.lower()):
                yield str(path.relative_to(ROOT)), text


def tokens(source: str) -> Iterator[tokenize.TokenInfo]:
    return tokenize.generate_tokens(io.StringIO(source).readline)


def prose_of(source: str) -> Iterator[str]:
    """Docstrings and comments of a module."""
    yield " ".join(token.string.lstrip("# ") for token in tokens(source) if token.type == tokenize.COMMENT)
    for node in ast.walk(ast.parse(source)):
        if isinstance(node, ast.Module | ast.ClassDef | ast.FunctionDef | ast.AsyncFunctionDef):
            yield ast.get_docstring(node) or ""


def texts() -> Iterator[tuple[str, str]]:
    """Each with where it is."""
    for where, source in files(FOLDERS, ".py", SUSPICIOUS):
        yield from ((where, text) for text in prose_of(source))
    for where, source in files(("kv",), ".kv", SUSPICIOUS):
        yield where, " ".join(line.partition("# ")[2] for line in source.splitlines())
    yield from files(PAGES, ".md", SUSPICIOUS)
    for entry in catalogues.read(ROOT / "locale" / "amr.pot"):
        yield "on screen", catalogues.key_of(entry)


def test_no_text_uses_a_private_phrase() -> None:
    found = [
        f"{where}: …{text[max(0, match.start() - 40) : match.end() + 40]}…"
        for where, source in texts()
        for text in [EXCEPTIONS.sub("", " ".join(source.split()))]
        for match in BANNED.finditer(text)
    ]
    assert not found, f"write: {PHRASES}\n" + "\n".join(found)


def test_no_name_uses_a_private_word() -> None:
    names = {
        f"{where}: {token.string}"
        for where, source in files(FOLDERS, ".py", SUSPICIOUS_NAMES)
        for token in tokens(source)
        if token.type == tokenize.NAME and set(token.string.lower().split("_")) & set(NAMES)
    }
    assert not names, f"write: {NAMES}\n" + "\n".join(sorted(names))
