"""The default run stays as quick as it is."""

from __future__ import annotations

from tests import budget


def test_the_default_run_takes_no_longer_than_it_may() -> None:
    """`uv run pytest` is for every change: what takes long is marked ``long`` and has a quick sibling."""
    spent = budget.read()
    longest = sorted(spent, key=lambda name: -spent[name])[:10]
    assert sum(spent.values()) <= budget.LIMIT, {name: spent[name] for name in longest}


def test_every_file_of_tests_has_its_figure() -> None:
    known, files = set(budget.read()), budget.test_files()
    to_measure = sorted(files - known) or [
        "tests/repository/test_budget.py"
    ]  # any run drops files that no longer exist
    assert known == files, f"uv run pytest {' '.join(to_measure)} --write-budget"
