"""docs/commissioning.md says of every amber and red finding that a check-up can have what to do, and the pictures that it shows exist."""

from __future__ import annotations

import ast
import re
from collections.abc import Iterator
from pathlib import Path
from typing import NamedTuple

import pytest

from app.domain.check_up import Level, Topic
from app.domain.message import render
from app.services.check_up.probes import STEPS
from app.services.check_up.report import LEVELS, TOPICS
from app.services.check_up.trial_probes import TRIED

ROOT = Path(__file__).parents[2]
GUIDE = ROOT / "docs" / "commissioning.md"
PROBES = {look.__name__: topic for topic, look in [*TRIED, *(probe for *_, probes in STEPS for probe in probes)]}
CODE = sorted((ROOT / "app" / "services" / "check_up").glob("*.py"))


class CodeFinding(NamedTuple):
    """A finding as in the code; ``topic`` None: not given there."""

    topic: Topic | None
    level: Level
    says: str


def findings() -> Iterator[CodeFinding]:
    for path in CODE:
        tree = ast.parse(path.read_text(encoding="utf-8"))
        parents = {child: node for node in ast.walk(tree) for child in ast.iter_child_nodes(node)}
        functions = {node.name: node for node in ast.walk(tree) if isinstance(node, ast.FunctionDef)}
        for node in ast.walk(tree):
            if isinstance(node, ast.Call) and ast.unparse(node.func) in ("amber", "red"):
                around = list(enclosing(node, parents))
                function = next((each for each in around if isinstance(each, ast.FunctionDef)), tree)
                for text in texts(node.args[0], function, functions):
                    yield CodeFinding(topic_of(around), Level(ast.unparse(node.func)), text)


def enclosing(node: ast.AST, parents: dict[ast.AST, ast.AST]) -> Iterator[ast.AST]:
    while node in parents:
        node = parents[node]
        yield node


def topic_of(around: list[ast.AST]) -> Topic | None:
    """Of the probe that has it, or with which it is added."""
    for node in around:
        if isinstance(node, ast.FunctionDef) and node.name in PROBES:
            return PROBES[node.name]
        if isinstance(node, ast.Call) and ast.unparse(node.func).endswith("session.add"):
            name = ast.unparse(node.args[0])
            return Topic[name.removeprefix("Topic.")] if name.startswith("Topic.") else None
    return None


def texts(node: ast.expr, function: ast.AST, functions: dict[str, ast.FunctionDef]) -> Iterator[str]:
    """The sentences that an expression may be."""
    if isinstance(node, ast.Constant):
        yield node.value
    elif isinstance(node, ast.IfExp):
        yield from texts(node.body, function, functions)
        yield from texts(node.orelse, function, functions)
    elif isinstance(node, ast.Name):
        values = [
            each.value
            for each in ast.walk(function)
            if isinstance(each, ast.Assign) and ast.unparse(each.targets[0]) == node.id
        ]
        for value in values:
            yield from texts(value, function, functions)
    elif isinstance(node, ast.Call) and isinstance(node.func, ast.Name) and node.func.id == "message":
        assert isinstance(node.args[0], ast.Constant)
        yield node.args[0].value
    elif isinstance(node, ast.Call) and isinstance(node.func, ast.Name):
        for returned in ast.walk(functions[node.func.id]):
            if isinstance(returned, ast.Return) and returned.value is not None:
                yield from texts(returned.value, functions[node.func.id], functions)


def as_written(text: str) -> str:
    """With "…" in place of what differs from robot to robot."""
    return re.sub(r"\{\w+\}", "…", text)


def rows() -> list[list[str]]:
    """The cells of the tables of findings: topic, level, sentence, what to do."""
    lines = GUIDE.read_text(encoding="utf-8").splitlines()
    cells = [[cell.strip() for cell in line.strip("| ").split(" | ")] for line in lines if line.startswith("| ")]
    return [row for row in cells if len(row) == 4]


@pytest.fixture(scope="module")
def found() -> set[CodeFinding]:
    return set(findings())


def test_the_findings_are_found(found):
    assert len(found) > 40
    assert {finding.level for finding in found} == {Level.AMBER, Level.RED}
    assert all(finding.says for finding in found)


def test_each_has_a_line_that_says_what_to_do(found):
    for finding in found:
        topic, level = render(TOPICS[finding.topic]) if finding.topic else "", render(LEVELS[finding.level])
        its = [row for row in rows() if row[2] == as_written(finding.says) and row[1] == level and topic in row[0]]
        assert [len(row[3]) > 5 for row in its] == [True], finding


def test_no_line_is_about_a_finding_that_does_not_exist(found):
    known = {as_written(finding.says) for finding in found}
    assert [row for row in rows()[1:] if row[2] not in known and row[0] != "topic"] == []


def test_every_picture_that_it_shows_exists_and_has_words():
    shown = re.findall(r"!\[([^\]]*)\]\(([^)]*)\)", GUIDE.read_text(encoding="utf-8"))
    assert len(shown) >= 8
    assert [path for words, path in shown if not words or not (GUIDE.parent / path).is_file()] == []
