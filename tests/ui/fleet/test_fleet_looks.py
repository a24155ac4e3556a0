"""What the design promises of the page of all robots, on the plant of the pictures."""

from __future__ import annotations

from dataclasses import replace

import pytest

from app.screens.frame.facts import OpenIssues
from app.screens.home.fleet_page import FleetPage, NameLine, RobotCell
from app.widgets.list_row import ListRow
from tests.screenshots.fleet import fleet
from tests.support import fleet_facts as sample
from tests.ui import checks
from tests.ui.looks import SIZES, filled, labels, scrolls, sizes, targets, words
from tests.ui.window_sizes import window

WIDE, LOW, TALL = (1280, 800), (1024, 600), (800, 1280)
MOST_WORDS = {"trouble": 110, "well": 130}
FACTS = {
    "trouble": sample.facts(50),
    "well": sample.facts(50, well=True),
    "outage": sample.outage(50),
    "many": replace(sample.facts(200), groups=sample.halls(200)),
}


@pytest.mark.parametrize("facts", FACTS)
@pytest.mark.parametrize(
    ("size", "scale", "language"),
    [(WIDE, 1.0, "en"), (WIDE, 1.3, "fi"), (LOW, 1.0, "en"), (LOW, 1.3, "fi"), (TALL, 1.0, "fi")],
)
def test_it_keeps_to_the_design(ui, size, scale, language, facts):
    with window(ui, size, scale, language) as rig:
        fleet(rig, FACTS[facts])
        ui.advance(0.5)
        page = ui.find(FleetPage)
        assert "\n".join(checks.problems(page)) == ""
        assert (scrolls(page), targets(page), filled(page)) == ([], [], [])
        assert sizes(page) <= SIZES
        cut = [label.text for label in labels(page) if "…" in label._label.text and not isinstance(label, NameLine)]
        assert cut == []
        assert len(words(page)) <= MOST_WORDS.get(facts, 130)


@pytest.mark.parametrize(
    ("size", "scale"), [(WIDE, 1.0), (WIDE, 1.3), (LOW, 1.0), (LOW, 1.3), (TALL, 1.0), (TALL, 1.3)]
)
def test_a_short_name_is_whole_at_any_size_of_text(ui, size, scale):
    with window(ui, size, scale, "en") as rig:
        fleet(rig, FACTS["trouble"])
        ui.advance(0.5)
        names = [line for line in ui.find_all(NameLine) if line.text.startswith("Robot ")]
        assert names
        assert [line._label.text for line in names] == [line.text for line in names]


@pytest.mark.parametrize(("facts", "rows"), [("trouble", 6), ("well", 0)])
def test_all_fifty_and_all_that_needs_a_person_are_seen_at_once(ui, facts, rows):
    with window(ui, WIDE, 1.0, "en") as rig:
        fleet(rig, FACTS[facts], issues=OpenIssues())
        ui.advance(0.5)
        assert [checks.is_seen(row) for row in ui.find_all(ListRow)] == [True] * rows
        assert len([cell for cell in ui.find_all(RobotCell) if checks.is_seen(cell)]) == 50
