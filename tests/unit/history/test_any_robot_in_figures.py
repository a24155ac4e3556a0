"""Whose a run is that was asked of any robot of a fleet: of the robot that took it; with none known, the fleet's."""

from __future__ import annotations

from datetime import timedelta

import pytest

from app.database.execution_history import ExecutionFilter, ExecutionHistory
from app.database.fleets import FleetRepository
from app.database.robots import RobotRepository
from app.domain.execution import State
from app.domain.models import ANY_VEHICLE, Fleet, Robot
from app.screens.logs import report_page
from app.screens.logs.key_figures import robot_bars
from app.services.history.kpis import KpiFilter
from app.services.history.runs import History
from app.services.history.shift_report import ReportPeriod, ShiftReports
from tests.support.kpi_world import NOON

BELLA, CARLA, ANY = 1, 3, 4


@pytest.fixture(autouse=True)
def runs(world):
    """Bella and Carla are of the fleet Hall, Aino is of none. Carla has a run of her own, and took one of any."""

    def work(c):
        hall = FleetRepository().add(c, Fleet("Hall", "http://hall"))
        robots = RobotRepository()
        robots.update(c, Robot("Bella", "", id=BELLA, fleet=hall, vehicle="1"))
        robots.add(c, Robot("Carla", "", id=CARLA, fleet=hall, vehicle="3"))
        robots.add(c, Robot("Whichever", "", id=ANY, fleet=hall, vehicle=ANY_VEHICLE))

    world.db.write(work)
    own = {"robot_id": CARLA, "robot": "Carla", "duration_s": 100.0}
    of_any = {"robot_id": ANY, "robot": "Whichever", "duration_s": 300.0, "submitted_at": NOON - timedelta(hours=3)}
    world.row(State.COMPLETED, -1, **own)
    world.row(State.COMPLETED, -2, **of_any, taken_by="Carla")
    world.row(State.FAILED, -2, **of_any, taken_by="Not in the plan")
    world.row(State.FAILED, -26, **of_any, taken_by="Carla", robot_delay_s=0.0)
    world.row(State.SKIPPED, -1, robot_id=ANY, robot="Whichever")


def numbers(facts):
    return {one.robot: (one.completed, one.failed, one.skipped, one.mission_s) for one in facts.robots}


def test_it_counts_for_the_robot_that_took_it_and_without_one_for_the_fleet(world):
    of_hall = {"Carla": (2, 1, 0, 700.0), "Hall": (0, 1, 1, 300.0)}
    facts = world.kpis.facts()
    assert numbers(facts) == {"Aino": (0,) * 3 + (0.0,), "Bella": (0,) * 3 + (0.0,), **of_hall}
    assert (facts.completed, facts.failed, facts.skipped, facts.mission_s) == (2, 2, 1, 1000.0)
    assert [(day.completed, day.failed) for day in world.kpis.per_day(KpiFilter(robot_ids=(CARLA,)))] == [
        (0, 1),
        (2, 0),
    ]


def test_all_figures_of_a_robot_have_what_it_took(world):
    wanted, kpis = KpiFilter(robot_ids=(CARLA,)), world.kpis
    facts = kpis.facts(wanted)
    assert (facts.completed, facts.failed, facts.recorded_days) == (2, 1, 2)
    assert [cause.number for cause in kpis.failures(wanted)] == [1]
    assert [run.taken_by for run in kpis.not_completed(wanted)] == ["Carla"]
    assert len(kpis.delays(wanted).starts) == 1
    assert kpis.failures(KpiFilter(robot_ids=(BELLA,))) == []


def test_what_was_asked_of_any_robot_can_be_shown_alone(world):
    facts = world.kpis.facts(KpiFilter(robot_ids=(ANY,)))
    assert (facts.completed, facts.failed, numbers(facts)) == (1, 2, {"Whichever": (1, 2, 1, 900.0)})


def test_what_stands_for_any_robot_is_no_robot_and_without_runs_no_line(world):
    report = ShiftReports(world.db, world.clock).make(ReportPeriod.SHIFT)
    lines = {line.label: line for line in report_page.on_screen(report).lines}
    assert "Hall" in lines
    assert lines["On missions"].note == "3 robots"
    assert ">Hall<" in report_page.page(report)
    assert [bar.robot for bar in robot_bars(report.facts.robots)] == ["Aino", "Bella", "Carla"]
    world.empty()
    assert list(numbers(world.kpis.facts())) == ["Aino", "Bella", "Carla"]


def test_it_is_among_the_runs_of_the_robot_that_took_it(world):
    found = History(world.db).last_ended(CARLA, NOON, 9)
    assert [(run.robot_id, run.taken_by) for run in found] == [(CARLA, ""), (ANY, "Carla"), (ANY, "Carla")]
    assert [run.robot_id for run in History(world.db).last_ended(CARLA, NOON, 1)] == [CARLA]
    assert len(History(world.db).last_ended(ANY, NOON, 9)) == 4
    listed = ExecutionHistory().counts(world.db.read(), ExecutionFilter(robot_ids=(CARLA,)))
    assert listed == {State.COMPLETED: 2, State.FAILED: 1}
