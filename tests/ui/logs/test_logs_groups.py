"""The Logs of a group: the filter shows what any of its robots could take, and the story says why which one came."""

from __future__ import annotations

from dataclasses import replace
from datetime import timedelta
from pathlib import Path

import pytest

from app.domain.execution import State, Trigger
from app.domain.models import Group
from app.screens.logs.of_groups import OfGroup
from app.widgets.buttons import ChoiceChip, CommandButton
from app.widgets.choices import ChoiceSheet, OptionRow
from app.widgets.figure_charts import FigureCard, FigureSheet
from app.widgets.snackbar import Snackbar
from tests.support.history import last_ended
from tests.support.stored import Stored
from tests.ui.logbook import choose_tab, reset_logs, rows, runs_of, settle, tap


@pytest.fixture
def hall(logs, container, ui):
    """A group of all robots, one of whose runs is in the history."""
    stored = Stored(container)
    group = container.catalogue.save_group(Group("Hall 1", tuple(robot.id for robot in container.catalogue.robots())))
    now, robots = container.clock.now(), container.catalogue.robots()
    run = replace(
        last_ended(container, 1)[0],
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
    container.db.write(lambda c: container.repositories.executions.add_each_once(c, [run])[0])
    reset_logs(logs, ui)
    yield group
    stored.put_back()


def test_runs_of_a_group_are_found_and_say_why_that_robot_came(logs, container, hall, ui):
    logs.logs.choose_robot()
    settle(logs, ui)
    tap(logs, ui, ui.find(OptionRow, ui.find(ChoiceSheet), title="Any of Hall 1"))
    [item] = runs_of(logs)
    assert item.title == "For any robot"
    tap(logs, ui, rows(ui)[0])
    names = [robot.name for robot in container.catalogue.robots()]
    steps = {step.title: step.support for step in logs.logs.story.words.steps}
    assert steps["Chosen"] == f"{names[0]}: free now · {names[1]}: no answer"
    assert steps["Planned"].endswith(" · any of Hall 1")
    tap(logs, ui, ui.find(ChoiceChip, text="Any of Hall 1"))
    assert len(runs_of(logs)) > 1


def test_the_shift_report_is_of_the_group_that_is_looked_at(logs, hall, ui, tmp_path, monkeypatch):
    monkeypatch.setattr("app.services.files.exports.platformdirs.user_documents_path", lambda: tmp_path)
    logs.logs.set_filters(group=OfGroup(hall.name, hall.members))
    choose_tab(logs, ui, "figures")
    tap(logs, ui, ui.find(CommandButton, text="Shift report"))
    dialog = ui.find(ChoiceSheet)
    assert dialog.title == "Shift report, Any of Hall 1"
    tap(logs, ui, ui.find(OptionRow, dialog, title="7 days"))
    page = (
        Path(ui.find(Snackbar).text.removeprefix("Report written to "))
        .read_text(encoding="utf-8")
        .replace("\N{NO-BREAK SPACE}", " ")
    )
    assert "Any of Hall 1" in page
    assert "1 of 1 ended run" in page
    logs.logs.set_filters(group=None)
    settle(logs, ui)


def test_the_figures_of_a_group_are_among_the_numbers_of_what_ran_on_time(logs, container, hall, ui):
    now, run = container.clock.now(), last_ended(container, 1)[0]
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
    container.db.write(lambda c: container.repositories.executions.add_each_once(c, [planned])[0])
    reset_logs(logs, ui, "figures")
    tap(logs, ui, ui.find(FigureCard, label="On time"))
    lines = [(line.title, line.meta) for line in ui.find(FigureSheet).rows if line.support == "Any of Hall 1"]
    assert lines[0][0] == "Started within 1 min of plan"
