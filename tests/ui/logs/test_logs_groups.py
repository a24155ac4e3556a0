"""The Logs of a group: the filter shows what any of its robots could take, and the story says why which one came."""
from __future__ import annotations

from dataclasses import replace

import pytest

from app.domain.models import Group
from app.widgets.buttons import MenuChip
from app.widgets.dialogs import ChoiceDialog
from app.widgets.rows import LogRow, OptionRow
from tests.ui.logbook import settle, show_anew, tap


@pytest.fixture
def hall(logs, container, ui):
    """A group of all robots, one of whose runs is in the history."""
    group = container.catalogue.save_group(Group("Hall 1", tuple(robot.id for robot in container.catalogue.robots())))
    now, robots = container.clock.now(), container.catalogue.robots()
    run = replace(container.history.last_finished(1)[0], id=0, token="one-of-hall-1", mission="For any robot", planned_at=now,
                  created_at=now, closes_at=now, bound_at=now, group_id=group.id, robot_group="Hall 1", schedule_id=None,
                  choice={"robots": [{"robot": robots[0].name}, {"robot": robots[1].name, "out": "silent"}]})
    container.db.write(lambda c: container.repositories.executions.add(c, run))
    show_anew(logs, ui)
    yield group
    container.catalogue.remove_group(group.id)


def test_runs_of_a_group_are_found_and_say_why_that_robot_came(logs, container, hall, ui):
    everything = logs.logs.count_text
    tap(logs, ui, ui.find(MenuChip, text="All robots"))
    ui.wait(lambda: ui.find_all(ChoiceDialog))
    ui.advance(.3)
    ui.tap(ui.find(OptionRow, text="Any of Hall 1"))
    settle(logs, ui)
    assert logs.logs.count_text == "1 run, newest first" != everything
    row, = ui.find_all(LogRow)
    assert row.mission == "For any robot"
    tap(logs, ui, row)
    names = [robot.name for robot in container.catalogue.robots()]
    assert f"{names[0]}: free now; {names[1]} silent" in [step.note for step in ui.find(LogRow).steps]
    assert "Chosen" in [step.label for step in ui.find(LogRow).steps]
    tap(logs, ui, ui.find(MenuChip, text="Any of Hall 1"))
    ui.wait(lambda: ui.find_all(ChoiceDialog))
    ui.advance(.3)
    ui.tap(ui.find(OptionRow, text="All robots"))
    settle(logs, ui)
    assert logs.logs.count_text == everything
