"""The catalogues of the texts:  ``python -m tests.catalogues extract | check``

``extract`` reads every text from the code, writes locale/amr.pot, brings each locale/<language>/LC_MESSAGES/amr.po up
to date and compiles it to the .mo file that the app reads: translations stay, new texts come in empty, texts that are
no longer used leave. ``check`` says what is missing, unused, outdated or has other placeholders, and exits 1.

Texts are the constants in ``_("…")``, ``ngettext``, ``pgettext`` and ``N_("…")`` (marked here, translated later) of
Python and in ``tr._("…")``, ``tr.n_``, ``tr.p_`` of kv. What is refused (``InvalidInput``), kept in parts
(``message``), found by a check-up (``amber``) and the tables named SENTENCES are rendered by msgid, too. Services that
get ``translate`` as an argument keep their sentences in tables; in such files every constant counts that is in
``translate("…")`` or looks like words: it begins with a capital, has a space or a placeholder.
"""

from __future__ import annotations

import ast
import io
import re
import sys
from collections.abc import Iterable, Iterator
from dataclasses import dataclass, field
from datetime import UTC, datetime
from functools import cache
from pathlib import Path
from string import Formatter
from typing import TypeGuard

from babel.messages.catalog import Catalog, Message
from babel.messages.mofile import write_mo
from babel.messages.pofile import read_po, write_po

from app.i18n import DOMAIN, LOCALE_DIR

ROOT = Path(__file__).resolve().parents[1]
MADE = datetime(2026, 1, 1, tzinfo=UTC)  # always: the same texts make the same files
# name of a function: which of its arguments are context, msgid, plural
CALLS = {
    "_": (None, 0, None),
    "N_": (None, 0, None),
    "gettext": (None, 0, None),
    "ngettext": (None, 0, 1),
    "pgettext": (0, 1, None),
    "n_": (None, 0, 1),
    "p_": (0, 1, None),
    "InvalidInput": (None, 1, None),
    "existing": (None, 2, None),
    "check_name_is_free": (None, 2, None),
    "InvalidAddress": (None, 0, None),
    "_wrong": (None, 0, None),
    "_as_written": (None, 2, None),
    "message": (None, 0, None),
    "DatabaseUnavailable": (None, 0, None),
    "DatabaseRefused": (None, 0, None),
}
EACH_ARGUMENT = ("green", "amber", "red")  # a finding of a check-up: what the robot does, and what that means
LIKE_WORDS = re.compile(r"(?![A-Z_0-9]+$)(?=.*[A-Za-z]{2})([A-Z]|.*[ {])", re.DOTALL)
KV_CALL = re.compile(r"\btr\.(?:_|n_|p_)\(")


@dataclass
class Text:
    """One text of the code."""

    msgid: str
    plural: str | None = None
    context: str | None = None
    places: list[str] = field(default_factory=list)

    @property
    def key(self) -> str:
        """As gettext joins them in a .mo file."""
        key = f"{self.context}\x04{self.msgid}" if self.context is not None else self.msgid
        return f"{key}\0{self.plural}" if self.plural is not None else key


class NotConstant(ValueError):
    """A text that is put together at run time cannot be translated."""


@cache
def texts_of_code(root: Path = ROOT) -> dict[str, Text]:
    """Every text by its key, in the order of files and lines, read once. Raises ``NotConstant``."""
    found: dict[str, Text] = {}
    for path in [*sorted((root / "app").rglob("*.py")), *sorted((root / "kv").rglob("*.kv")), root / "main.py"]:
        if path.exists():
            reader = _python_texts if path.suffix == ".py" else _kv_texts
            for line, text in reader(path):
                found.setdefault(text.key, text).places.append(f"{path.relative_to(root).as_posix()}:{line}")
    return found


def _python_texts(path: Path) -> Iterator[tuple[int, Text]]:
    tree = ast.parse(path.read_text(encoding="utf-8"))
    nodes = list(ast.walk(tree))
    found = list(_calls(nodes, path, 0))
    if any(isinstance(node, ast.arg) and node.arg == "translate" for node in nodes):
        found += _tables(tree)
    else:
        found += [text for node in nodes if _is_sentences(node) for text in _tables(node)]
    yield from sorted(found, key=lambda item: item[0])


def _tables(tree: ast.AST) -> Iterator[tuple[int, Text]]:
    """Constants that look like words, except docstrings, parts of f-strings, and raised or logged ones, which are for
    developers."""
    passed_over = {id(node.value) for node in ast.walk(tree) if isinstance(node, ast.Expr)}
    for node in ast.walk(tree):
        if isinstance(node, ast.JoinedStr | ast.Raise) or _logs(node):
            passed_over |= {id(part) for part in ast.walk(node)}
    translated = {id(part) for node in ast.walk(tree) if _translates(node) for part in node.args}
    for node in ast.walk(tree):
        if (
            isinstance(node, ast.Constant)
            and isinstance(node.value, str)
            and id(node) not in passed_over
            and (id(node) in translated or LIKE_WORDS.match(node.value))
        ):
            yield node.lineno, Text(node.value)


def _is_sentences(node: ast.AST) -> bool:
    targets = node.targets if isinstance(node, ast.Assign) else [node.target] if isinstance(node, ast.AnnAssign) else []
    return any(isinstance(target, ast.Name) and target.id == "SENTENCES" for target in targets)


def _translates(node: ast.AST) -> TypeGuard[ast.Call]:
    return isinstance(node, ast.Call) and isinstance(node.func, ast.Name) and node.func.id == "translate"


def _logs(node: ast.AST) -> bool:
    return (
        isinstance(node, ast.Call)
        and isinstance(node.func, ast.Attribute)
        and isinstance(node.func.value, ast.Name)
        and node.func.value.id in ("log", "logger")
    )


def _kv_texts(path: Path) -> Iterator[tuple[int, Text]]:
    """kv values are Python expressions; each line with a call is read as one, from the call to its closing bracket."""
    for number, line in enumerate(path.read_text(encoding="utf-8").splitlines(), 1):
        for match in KV_CALL.finditer(line):
            yield from _calls(
                ast.walk(ast.parse(_to_closing_bracket(line[match.start() :], path, number))), path, number - 1
            )


def _to_closing_bracket(source: str, path: Path, number: int) -> str:
    for end in (n + 1 for n, character in enumerate(source) if character == ")"):
        try:
            ast.parse(source[:end])
        except SyntaxError:
            continue
        return source[:end]
    raise NotConstant(f"{path}:{number}: the call of tr must stand on one line")


def _calls(nodes: Iterable[ast.AST], path: Path, offset: int) -> Iterator[tuple[int, Text]]:
    for node in nodes:
        if not isinstance(node, ast.Call):
            continue
        name = (
            node.func.id
            if isinstance(node.func, ast.Name)
            else node.func.attr
            if isinstance(node.func, ast.Attribute)
            else ""
        )
        if name in EACH_ARGUMENT:
            for part in (each for argument in node.args for each in _choices(argument)):
                if isinstance(part, ast.Constant):
                    yield node.lineno + offset, Text(part.value)
        if name not in CALLS or (path.suffix == ".py" and isinstance(node.func, ast.Attribute)):
            continue
        context, msgid, plural = (None if n is None else _constant(node, n, path) for n in CALLS[name])
        place = CALLS[name][1]
        if msgid is None and isinstance(node.args[place] if len(node.args) > place else None, ast.Name | ast.Attribute):
            continue  # _(word) of a word that is marked elsewhere
        if msgid is None:
            raise NotConstant(f"{path}:{node.lineno + offset}: not a constant text")
        yield node.lineno + offset, Text(msgid, plural, context)


def _choices(argument: ast.expr) -> Iterator[ast.expr]:
    """What it may be, where a condition decides."""
    if isinstance(argument, ast.IfExp):
        yield from (*_choices(argument.body), *_choices(argument.orelse))
    else:
        yield argument


def _constant(call: ast.Call, n: int, path: Path) -> str | None:
    argument = call.args[n] if n < len(call.args) else None
    return argument.value if isinstance(argument, ast.Constant) and isinstance(argument.value, str) else None


# ---------------------------------------------------------------------- .po and .mo files
def template(root: Path = ROOT) -> Catalog:
    """Every text of the code, with the files that it stands in."""
    catalogue = Catalog(header_comment="# Written by: python -m tests.catalogues extract", creation_date=MADE)
    for text in texts_of_code(root).values():
        catalogue.add(
            (text.msgid, text.plural) if text.plural is not None else text.msgid,
            context=text.context,
            locations=[(file, 0) for file in sorted({place.rpartition(":")[0] for place in text.places})],
            flags=["python-brace-format"] if "{" in text.msgid else [],
        )
    return catalogue


def read(path: Path) -> Catalog:
    """A .po file, or the template, which has no language. Raises ``babel.messages.pofile.PoFileError``, which says
    where."""
    language = path.parents[1].name if path.suffix == ".po" else None
    with path.open("rb") as file:
        return read_po(file, locale=language, abort_invalid=True)


def compiled(catalogue: Catalog) -> bytes:
    """As a .mo file."""
    file = io.BytesIO()
    write_mo(file, catalogue)
    return file.getvalue()


def extract(directory: Path = LOCALE_DIR, root: Path = ROOT) -> Catalog:
    """Write the template, bring every language up to date and compile it."""
    texts = template(root)
    _write(directory / f"{DOMAIN}.pot", texts)
    for path in po_files(directory):
        catalogue = read(path)
        catalogue.update(texts, no_fuzzy_matching=True, update_header_comment=True)
        _write(path, catalogue)
        path.with_suffix(".mo").write_bytes(compiled(catalogue))
    return texts


def _write(path: Path, catalogue: Catalog) -> None:
    with path.open("wb") as file:
        write_po(file, catalogue, width=0, omit_header=not catalogue.locale, ignore_obsolete=True, include_lineno=False)


def po_files(directory: Path = LOCALE_DIR) -> list[Path]:
    return sorted(directory.glob(f"*/LC_MESSAGES/{DOMAIN}.po"))


# ---------------------------------------------------------------------- checks
def placeholders(text: str) -> set[str]:
    """Names in braces."""
    return {name for _literal, name, _spec, _conversion in Formatter().parse(text) if name is not None}


def problems(directory: Path = LOCALE_DIR, root: Path = ROOT) -> list[str]:
    """Sentences about what is wrong with the catalogues."""
    texts = texts_of_code(root)
    found = []
    for path in po_files(directory):
        language, catalogue = path.parents[1].name, read(path)
        translated = {
            key_of(entry): entry for entry in catalogue if entry.id and all(forms_of(entry)) and not entry.fuzzy
        }
        found += [
            f"{language}: missing {text.msgid!r} ({text.places[0]})"
            for key, text in texts.items()
            if key not in translated
        ]
        found += [f"{language}: unused {key!r}" for key in translated if key not in texts]
        for key in translated.keys() & texts.keys():
            text = texts[key]
            allowed = placeholders(text.msgid) | placeholders(text.plural or "")
            for form in forms_of(translated[key]):
                if placeholders(form) - allowed or (text.plural is None and placeholders(form) != allowed):
                    found.append(f"{language}: other placeholders in {form!r} than in {text.msgid!r}")
    return found


def outdated(directory: Path = LOCALE_DIR) -> list[Path]:
    """The .mo files that don't have what their .po files have."""
    return [mo for po in po_files(directory) if (mo := po.with_suffix(".mo")).read_bytes() != compiled(read(po))]


def forms_of(entry: Message) -> tuple[str, ...]:
    return entry.string if isinstance(entry.string, tuple) else (entry.string,)


def key_of(entry: Message) -> str:
    """That of its ``Text``."""
    msgid, plural = entry.id if isinstance(entry.id, tuple) else (entry.id, None)
    return Text(msgid, plural, entry.context).key


def main(arguments: list[str]) -> int:
    match arguments:
        case ["extract"]:
            print(f"{len(extract())} texts")
        case ["check"]:
            found = problems() + [f"{path} is outdated: run `extract`" for path in outdated()]
            print("\n".join(found) or "catalogues are complete")
            return bool(found)
        case _:
            print(__doc__, file=sys.stderr)
            return 2
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
