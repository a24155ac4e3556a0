"""The Logs of a group: the filter shows what any of its robots could take, and the story says why which one came."""

from __future__ import annotations

from dataclasses import replace
from datetime import timedelta
from itertools import pairwise
from pathlib import Path

import pytest

from app.domain.models import Group, State, Trigger
from app.screens.logs.cards import GroupCard
from app.screens.logs.of_groups import OfGroup
from app.widgets.buttons import CommandButton, MenuChip, Segment
from app.widgets.dialogs import ChoiceDialog
from app.widgets.rows import LogRow, OptionRow, StoryStep
from app.widgets.snackbar import Snackbar
from tests.support.stored import Stored
from tests.ui.logbook import reset_logs, settle, tap


@pytest.fixture
def hall(logs, container, ui):
    """A group of all robots, one of whose runs is in the history."""
    stored = Stored(container)
    group = container.catalogue.save_group(Group("Hall 1", tuple(robot.id for robot in container.catalogue.robots())))
    now, robots = container.clock.now(), container.catalogue.robots()
    run = replace(
        container.history.last_finished(1)[0],
        id=0,
        token="one-of-hall-1",
        mission="For any robot",
        trigger=Trigger.MANUAL,
        state=State.COMPLETED,
        reason=None,
        ended_at=now,
        duration_s=60.0,
        planned_at=now,
        created_at=now,
        closes_at=now,
        bound_at=now,
        group_id=group.id,
        robot_group="Hall 1",
        schedule_id=None,
        choice={"robots": [{"robot": robots[0].name}, {"robot": robots[1].name, "out": "silent"}]},
    )
    container.db.write(lambda c: container.repositories.executions.add(c, run))
    reset_logs(logs, ui)
    yield group
    stored.put_back()


def test_runs_of_a_group_are_found_and_say_why_that_robot_came(logs, container, hall, ui):
    everything = logs.logs.count_text
    tap(logs, ui, ui.find(MenuChip, text="All robots"))
    ui.wait(lambda: ui.find_all(ChoiceDialog))
    ui.advance(0.3)
    ui.tap(ui.find(OptionRow, text="Any of Hall 1"))
    settle(logs, ui)
    assert logs.logs.count_text == "1 run, newest first" != everything
    assert {card.key: card.note for card in logs.logs.kpis}["success"].startswith("1 of 1 ended run")
    (row,) = ui.find_all(LogRow)
    assert row.mission == "For any robot"
    tap(logs, ui, row)
    names = [robot.name for robot in container.catalogue.robots()]
    assert f"{names[0]}: free now; {names[1]}: no answer" in [step.note for step in ui.find(LogRow).steps]
    assert ui.find(LogRow).steps[0].note.endswith(" · any of Hall 1")
    assert "Chosen" in [step.label for step in ui.find(LogRow).steps]
    steps = sorted(ui.find_all(StoryStep), key=lambda step: step.x)
    assert all(right.x - max(words.right for words in left.children) >= 8 for left, right in pairwise(steps))
    tap(logs, ui, ui.find(MenuChip, text="Any of Hall 1"))
    ui.wait(lambda: ui.find_all(ChoiceDialog))
    ui.advance(0.3)
    ui.tap(ui.find(OptionRow, text="All robots"))
    settle(logs, ui)
    assert logs.logs.count_text == everything


def test_the_shift_report_is_of_the_group_that_is_looked_at(logs, hall, ui, tmp_path, monkeypatch):
    monkeypatch.setattr("app.services.files.exports.platformdirs.user_documents_path", lambda: tmp_path)
    logs.logs.set_filters(group=OfGroup(hall.name, hall.members))
    settle(logs, ui)
    tap(logs, ui, ui.find(CommandButton, text="Report"))
    dialog = ui.find(ChoiceDialog)
    assert dialog.title == "Shift report, Any of Hall 1"
    tap(logs, ui, ui.find(OptionRow, dialog, text="7 days"))
    page = (
        Path(ui.find(Snackbar).text.removeprefix("Report written to "))
        .read_text(encoding="utf-8")
        .replace("\N{NO-BREAK SPACE}", " ")
    )
    assert "Any of Hall 1" in page
    assert "1 of 1 ended run" in page
    logs.logs.set_filters(group=None)
    settle(logs, ui)


def test_the_figures_of_a_group_have_a_card_where_there_are_any(logs, container, hall, ui):
    tap(logs, ui, ui.find(Segment, text="Figures"))
    assert not ui.find_all(GroupCard)  # a run by hand is not a planned start
    now, run = container.clock.now(), container.history.last_finished(1)[0]
    planned = replace(
        run,
        id=0,
        token="planned-of-hall-1",
        trigger=Trigger.SCHEDULED,
        planned_at=now - timedelta(minutes=9),
        submitted_at=now - timedelta(minutes=9),
        started_at=now - timedelta(minutes=9),
        ended_at=now - timedelta(minutes=5),
        group_id=hall.id,
        robot_group="Hall 1",
        schedule_id=None,
    )
    container.db.write(lambda c: container.repositories.executions.add(c, planned))
    reset_logs(logs, ui, "figures")
    ui.wait(lambda: ui.find_all(GroupCard))
    card = ui.find(GroupCard)
    assert (card.title, card.note) == ("Any of Hall 1", "1 start")
    assert "Started within 1 min of plan" in [row.label for row in card.rows]
