"""The way from Save to the robot in docs/architecture.md leads through functions that there are, and stays short.

That a start takes this way is found by tests/ui/test_plan_to_log.py.
"""

from __future__ import annotations

import ast

from tests.support.way import ROOT, documented

MOST_STEPS = 25  # from function to function


def functions_of(module: str) -> set[str]:
    """With their classes, as "Engine.advance"."""
    tree = ast.parse((ROOT / module).read_text(encoding="utf-8"))
    of_classes = {
        f"{each.name}.{function.name}"
        for each in tree.body
        if isinstance(each, ast.ClassDef)
        for function in each.body
        if isinstance(function, ast.FunctionDef)
    }
    return of_classes | {each.name for each in tree.body if isinstance(each, ast.FunctionDef)}


def test_every_function_of_the_way_stands_where_the_picture_says() -> None:
    assert [each for each in documented() if each[0] not in functions_of(each[1])] == []


def test_the_way_has_no_more_steps_than_a_reader_can_follow() -> None:
    assert len(documented()) - 1 <= MOST_STEPS
