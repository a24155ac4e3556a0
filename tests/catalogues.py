"""The catalogues of the texts:  ``python -m tests.catalogues extract | check | compile [DIR]``

``extract`` reads every text from the code, writes locale/amr.pot and brings each locale/<language>/LC_MESSAGES/amr.po up to date:
translations stay, new texts come in empty, texts that are gone leave. ``check`` says what is missing, unused or has other placeholders,
and exits 1. ``compile`` writes .mo files for packagers; the app itself reads the .po files.

Texts are the constants in ``_("…")``, ``ngettext``, ``pgettext`` and ``N_("…")`` (marked here, translated later) of Python and in
``tr._("…")``, ``tr.n_``, ``tr.p_`` of kv. What is refused (``InvalidInput``), kept in parts (``message``) and the tables named SENTENCES
are rendered by msgid, too.
Services that get ``translate`` handed in keep their sentences in tables; of such files every constant counts that is in
``translate("…")``, or that reads like words: it begins with a capital, has a space or a placeholder.
"""

from __future__ import annotations

import ast
import re
import sys
from collections.abc import Iterable, Iterator
from dataclasses import dataclass, field
from functools import cache
from pathlib import Path
from string import Formatter
from typing import TypeGuard

from app.i18n import CONTEXT_MARK, DOMAIN, LOCALE_DIR, compile_mo, languages, po_entries, read_po

ROOT = Path(__file__).resolve().parents[1]
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
    "InvalidAddress": (None, 0, None),
    "_wrong": (None, 0, None),
    "message": (None, 0, None),
    "DatabaseUnavailable": (None, 0, None),
    "DatabaseRefused": (None, 0, None),
}
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
        key = f"{self.context}{CONTEXT_MARK}{self.msgid}" if self.context is not None else self.msgid
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
    """Constants that read like words, but for docstrings, parts of f-strings, and what is raised or logged, which is for developers."""
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
        if name not in CALLS or (path.suffix == ".py" and isinstance(node.func, ast.Attribute)):
            continue
        context, msgid, plural = (None if n is None else _constant(node, n, path) for n in CALLS[name])
        place = CALLS[name][1]
        if msgid is None and isinstance(node.args[place] if len(node.args) > place else None, ast.Name | ast.Attribute):
            continue  # _(word) of a word that is marked elsewhere
        if msgid is None:
            raise NotConstant(f"{path}:{node.lineno + offset}: not a constant text")
        yield node.lineno + offset, Text(msgid, plural, context)


def _constant(call: ast.Call, n: int, path: Path) -> str | None:
    argument = call.args[n] if n < len(call.args) else None
    return argument.value if isinstance(argument, ast.Constant) and isinstance(argument.value, str) else None


# ---------------------------------------------------------------------- .po files
def quoted(text: str) -> str:
    return '"' + text.replace("\\", "\\\\").replace('"', '\\"').replace("\n", "\\n") + '"'


def write_po(path: Path, texts: dict[str, Text], translated: dict[str, list[str]], header: str) -> None:
    lines = ['msgid ""', 'msgstr ""', *(quoted(line + "\n") for line in header.strip().splitlines()), ""]
    for text in texts.values():
        lines.append("#: " + " ".join(sorted({place.rpartition(":")[0] for place in text.places})))
        if "{" in text.msgid:
            lines.append("#, python-brace-format")
        if text.context is not None:
            lines.append(f"msgctxt {quoted(text.context)}")
        lines.append(f"msgid {quoted(text.msgid)}")
        forms = translated.get(text.key, ["", ""] if text.plural is not None else [""])
        if text.plural is not None:
            lines.append(f"msgid_plural {quoted(text.plural)}")
            lines += [f"msgstr[{n}] {quoted(form)}" for n, form in enumerate(forms)]
        else:
            lines.append(f"msgstr {quoted(forms[0])}")
        lines.append("")
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text("\n".join(lines), encoding="utf-8")


HEADER = """Content-Type: text/plain; charset=UTF-8
Content-Transfer-Encoding: 8bit
Language: {language}
Plural-Forms: nplurals=2; plural=(n != 1);"""


def extract(directory: Path = LOCALE_DIR, root: Path = ROOT) -> dict[str, Text]:
    """Write the template and bring every language up to date."""
    texts = texts_of_code(root)
    write_po(directory / f"{DOMAIN}.pot", texts, {}, HEADER.format(language=""))
    for path in sorted(directory.glob(f"*/LC_MESSAGES/{DOMAIN}.po")):
        translated = read_po(path)
        header = translated.pop("", [HEADER.format(language=path.parents[1].name)])[0]
        write_po(path, texts, translated, header)
    return texts


# ---------------------------------------------------------------------- checks
def placeholders(text: str) -> set[str]:
    """Names in braces."""
    return {name for _literal, name, _spec, _conversion in Formatter().parse(text) if name is not None}


def problems(directory: Path = LOCALE_DIR, root: Path = ROOT) -> list[str]:
    """Sentences about what is wrong with the catalogues."""
    texts = texts_of_code(root)
    found = []
    for language in languages(directory)[1:]:
        path = directory / language / "LC_MESSAGES" / f"{DOMAIN}.po"
        translated = read_po(path)
        translated.pop("", None)
        keys = [entry["msgid"] for entry in po_entries(path)]
        found += [
            f"{language}: twice {key!r}"
            for key in sorted({k for k in keys if keys.count(k) > 1} - {""})
            if not any(text.context for text in texts.values() if text.msgid == key)
        ]
        found += [
            f"{language}: missing {text.msgid!r} ({text.places[0]})"
            for key, text in texts.items()
            if key not in translated
        ]
        found += [f"{language}: unused {key!r}" for key in translated if key not in texts]
        for key in translated.keys() & texts.keys():
            text = texts[key]
            allowed = placeholders(text.msgid) | placeholders(text.plural or "")
            for form in translated[key]:
                if placeholders(form) - allowed or (text.plural is None and placeholders(form) != allowed):
                    found.append(f"{language}: other placeholders in {form!r} than in {text.msgid!r}")
    return found


def compile_all(target: Path, directory: Path = LOCALE_DIR) -> None:
    """Write <target>/<language>/LC_MESSAGES/amr.mo of every language."""
    for path in directory.glob(f"*/LC_MESSAGES/{DOMAIN}.po"):
        out = target / path.relative_to(directory).with_suffix(".mo")
        out.parent.mkdir(parents=True, exist_ok=True)
        out.write_bytes(compile_mo(read_po(path)))


def main(arguments: list[str]) -> int:
    match arguments:
        case ["extract"]:
            print(f"{len(extract())} texts")
        case ["check"]:
            found = problems()
            print("\n".join(found) or "catalogues are complete")
            return bool(found)
        case ["compile"] | ["compile", _]:
            compile_all(Path(arguments[1]) if len(arguments) > 1 else LOCALE_DIR)
        case _:
            print(__doc__, file=sys.stderr)
            return 2
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
