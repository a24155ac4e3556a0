"""The table of transitions in docs/architecture.md is that of the code."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from app.domain.execution import OPEN_STATES, State
from app.services.executions.apply import RULES, Check, Effect

DOCUMENT = Path(__file__).parents[2] / "docs" / "architecture.md"
HEAD = "| event | in | becomes | checked again | written with it |\n|---|---|---|---|---|\n"


def states(found: Sequence[State]) -> str:
    names = {tuple(State): "any", OPEN_STATES: "any open one"}
    return names.get(tuple(found), ", ".join(found)) or "–"


def texts(found: Sequence[Check | Effect]) -> str:
    """The first sentences of their docstrings."""
    says = [(each.__doc__ or "").split(".")[0] for each in found]
    return "; ".join(text[:1].lower() + text[1:] for text in says) or "–"


def table() -> str:
    rows = [
        (
            f"**{event.name.lower()}**: {event}",
            states(rule.sources),
            states(rule.targets),
            texts(rule.checks),
            texts(rule.effects),
        )
        for event, rule in RULES.items()
    ]
    return HEAD + "".join(f"| {' | '.join(row)} |\n" for row in rows)


def test_the_documented_table_of_transitions_is_that_of_the_code() -> None:
    assert table() in DOCUMENT.read_text(encoding="utf-8"), f"docs/architecture.md needs:\n\n{table()}"
