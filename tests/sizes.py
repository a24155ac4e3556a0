"""How large the code is, room by room: ``python -m tests.sizes``

A statement is one of Python's (``ast.stmt``) without docstrings and imports, so neither the formatter nor comments change its number. A
table of a hundred rows is one statement; nodes count what is in it: expressions, keywords, arguments and patterns.
"""

from __future__ import annotations

import ast
import subprocess
from collections import Counter
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
DEEP = ("app/services", "app/screens", "tests/services", "tests/ui", "tests/unit")  # their folders are rooms, too
COLUMNS = ("files", "lines", "statements", "functions", "classes", "nodes")
SCOPES = (ast.Module, ast.ClassDef, ast.FunctionDef, ast.AsyncFunctionDef)
NODES = (ast.expr, ast.keyword, ast.arg, ast.pattern, ast.comprehension)


def sizes(text: str) -> Counter[str]:
    """Of one module."""
    nodes = list(ast.walk(ast.parse(text)))

    def count(*kinds: type) -> int:
        return sum(isinstance(node, kinds) for node in nodes)

    docstrings = sum(isinstance(node, SCOPES) and ast.get_docstring(node, clean=False) is not None for node in nodes)
    return Counter(
        files=1,
        lines=text.count("\n"),
        statements=count(ast.stmt) - count(ast.Import, ast.ImportFrom) - docstrings,
        functions=count(ast.FunctionDef, ast.AsyncFunctionDef),
        classes=count(ast.ClassDef),
        nodes=count(*NODES),
    )


def room(name: str) -> str:
    """The folder under which a file is counted."""
    folders = name.split("/")[:-1]
    return "/".join(folders[: 3 if "/".join(folders[:2]) in DEEP else 2])


def main() -> None:
    listed = subprocess.run(["git", "ls-files", "*.py", "*.kv"], cwd=ROOT, capture_output=True, text=True, check=True)
    rooms: dict[str, Counter[str]] = {}
    totals: dict[str, Counter[str]] = {}
    for name in listed.stdout.split():
        text = (ROOT / name).read_text(encoding="utf-8")
        found = sizes(text) if name.endswith(".py") else Counter(files=1, lines=text.count("\n"))
        for table, key in ((rooms, room(name)), (totals, name.partition("/")[0])):
            table[key] = table.get(key, Counter()) + found
    print(f"{'':32}", *(f"{column:>11}" for column in COLUMNS))
    for table in (rooms, totals):
        for key, row in sorted(table.items()):
            print(f"{key:32}", *(f"{row[column]:11,}" for column in COLUMNS))
        print()


if __name__ == "__main__":
    main()
