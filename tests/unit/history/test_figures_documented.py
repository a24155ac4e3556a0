"""The page of key figures says what the tables in the code say."""

from __future__ import annotations

from pathlib import Path

import pytest

from app.services.history.figures import DELAY_FIGURES, FIGURES, GROUP_FIGURES

PAGE = Path(__file__).parents[3] / "docs" / "kpis.md"
HEADINGS = {
    "Of a period, a day or a robot": FIGURES,
    "Of the newest 5,000 planned runs that started": DELAY_FIGURES,
    "Of a group of robots": GROUP_FIGURES,
}


def rows(heading):
    """Key, title, unit and definition in the table below a heading."""
    section = PAGE.read_text(encoding="utf-8").partition(f"## {heading}\n")[2].partition("\n## ")[0]
    lines = [line for line in section.splitlines() if line.startswith("| `")]
    return [[cell.strip().strip("`") for cell in line.strip("|").split("|")] for line in lines]


@pytest.mark.parametrize(("heading", "figures"), HEADINGS.items())
def test_every_figure_stands_in_its_table_with_its_definition(heading, figures):
    documented = rows(heading)
    assert [row[:3] for row in documented] == [[key, each.title, each.unit] for key, each in figures.items()]
    assert all(each.explain in ("", row[3]) for row, each in zip(documented, figures.values(), strict=True))
