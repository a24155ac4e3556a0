"""From the form to the log: a mission planned by taps starts by itself on a simulated robot and is in the Logs with its figures."""

from __future__ import annotations

import time
from datetime import UTC, datetime, timedelta
from pathlib import Path

import pytest

import mir_sim
from app.container import Container
from app.domain.execution import State
from app.domain.models import Mission, Robot
from app.screens.home.cards import TodayRow
from app.widgets.buttons import CommandButton
from app.widgets.choices import ChoiceSheet, OptionRow
from app.widgets.fields import Field
from app.widgets.figure_charts import FigureCard
from app.widgets.frame import NavItem
from app.widgets.list_row import ListRow
from app.widgets.pickers import TimeCell
from app.widgets.sheet import FOOT_RESTS
from app.widgets.tabs import TabButton
from tests.support.history import last_ended
from tests.support.way import Way, documented
from tests.ui.whole_app import GUIDS, PASSWORD, USER, shown


class ShiftedClock:
    """The tablet's clock, at a time of the test's choosing."""

    def __init__(self, now: datetime) -> None:
        self._ahead = now - datetime.now(UTC)

    def now(self) -> datetime:
        return datetime.now(UTC) + self._ahead

    def monotonic(self) -> float:
        return time.monotonic()

    def leap_to(self, now: datetime) -> None:
        self._ahead = now - datetime.now(UTC)


@pytest.fixture
def way(monkeypatch) -> Way:
    return Way(monkeypatch)


@pytest.fixture
def site(tmp_path: Path):
    with mir_sim.serve(robots=1, time_scale=20.0, battery=90.0) as fleet:
        container = Container.open(
            tmp_path, ShiftedClock(datetime(2026, 11, 23, 6, 29, 1, tzinfo=UTC)), with_window=True
        )
        container.catalogue.change_settings(timezone="UTC", poll_interval_seconds=1)
        container.catalogue.save_robot(Robot(fleet.robots[0].name, fleet.robots[0].url, USER), password=PASSWORD)
        container.catalogue.save_mission(Mission("Home", GUIDS["Home"]))
        yield container
        container.close()


def go(ui, name: str) -> None:
    ui.tap(ui.find(NavItem, name=name))
    ui.advance(0.3)


def plan_home(app, site, ui) -> None:
    """By taps: the mission Home at 06:30, on the only robot; ends with *Save*."""
    go(ui, "scheduler")
    ui.wait(lambda: app.shell.background.idle and ui.find_all(CommandButton, text="New"))
    ui.tap(ui.find(CommandButton, text="New"))
    ui.wait(lambda: ui.find_all(ChoiceSheet))
    ui.advance(0.3)
    ui.tap(ui.find(OptionRow, title="Home"))
    ui.advance(0.5)
    ui.tap(ui.find(Field, label="Time"))
    ui.advance(0.5)
    for hour_or_minute in ("06", "30"):
        ui.tap(ui.find(TimeCell, text=hour_or_minute))
    ui.advance(FOOT_RESTS)
    ui.wait(lambda: not ui.find(CommandButton, text="Save").disabled)
    ui.advance(0.5)
    ui.tap(ui.find(CommandButton, text="Save"))
    ui.wait(lambda: site.repositories.schedules.all(site.db.read()))
    ui.wait(lambda: app.shell.sheets.top is None)
    ui.advance(FOOT_RESTS)


def let_it_begin(site) -> None:
    """The instant is 3 s away, and robots are asked."""
    site.clock.leap_to(datetime(2026, 11, 23, 6, 30, tzinfo=UTC) - timedelta(seconds=3))
    site.holds.confirm_clock()  # the robot lives in another year
    site.runner.start()


def test_a_planned_mission_starts_by_itself_and_is_found_in_the_log(site, ui):
    with shown(site, ui) as app:
        plan_home(app, site, ui)
        go(ui, "home")
        ui.wait(lambda: [row.item.lead for row in ui.find_all(TodayRow) if row.item.title == "Home"] == ["06:30"])

        let_it_begin(site)
        ui.wait(lambda: last_ended(site, 1), seconds=60)
        (execution,) = last_ended(site, 1)
        assert (execution.state, execution.mission, execution.attempts) == (State.COMPLETED, "Home", 1)
        assert timedelta(0) <= execution.submitted_at - execution.planned_at < timedelta(seconds=30)

        go(ui, "logs")
        logs = app.shell.navigator.screen("logs").vm
        ui.wait(lambda: [item.tone for item in logs.rows if item.opens] == ["done"])
        item = logs.rows[1]
        assert (item.title, item.place, item.lead) == ("Home", "Aino", "06:30")
        ui.wait(lambda: ui.find_all(ListRow, key=item.key))
        ui.tap(ui.find(ListRow, key=item.key))
        ui.wait(lambda: [step.title for step in logs.story.words.steps] == ["Planned", "Sent", "Started", "Completed"])
        assert "usually" not in logs.story.words.steps[-1].support  # no other run to compare it with

        site.operator.run_now(execution.robot_id, site.catalogue.missions()[0].id)
        ui.wait(lambda: [item.tone for item in logs.rows if item.opens] == ["done"] * 2, seconds=60)
        ui.wait(lambda: "usually" in logs.story.words.steps[-1].support)
        ui.tap(next(button for button in ui.find_all(TabButton) if button.tab.text == "Key figures"))
        ui.wait(lambda: ui.find_all(FigureCard, label="Success", value="–"))  # two runs are too few


def test_the_documented_way_from_save_to_the_robot_is_that_of_the_code(way, site, ui):
    site.db.write(way.watch)
    with shown(site, ui) as app:
        plan_home(app, site, ui)
        let_it_begin(site)
        ui.wait(lambda: any(run.queue_id for run in site.history.open()), seconds=60)
    functions = way.functions()
    assert documented() == functions, "\n".join(f"{name:40}{module}" for name, module in functions)
