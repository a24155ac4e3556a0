"""What runs use of a robot's battery, and which starts of a group a robot does not get for it."""

from __future__ import annotations

from dataclasses import replace
from datetime import timedelta

import pytest

from app.domain.drain import ENOUGH_RUNS
from app.domain.models import State
from tests.support.groups import Hall

EVERY = 240.0  # s between starts; each takes a minute and a half
NEARLY_EMPTY = 8.9  # %: enough for a run at 10 %/h, and not at 40


class Worn(Hall):
    """R1 uses 40 % an hour while it runs; the others are switched off until they are wanted."""

    def __init__(self, directory, limit: int | None = None) -> None:
        super().__init__(directory, robots=2)
        self.container.catalogue.change_settings(history_limit=limit)
        self.only("R1")
        self.at(1.0, self._use_more)

    def _use_more(self) -> None:
        machine = self.machines["R1"]
        if machine.run is not None:
            machine.set_battery(machine.battery.at(machine.now) - 30.0 / 3600)
        self.at(1.0, self._use_more)

    def run_often(self, times: int) -> None:
        """So many runs on R1, beginning at 06:05, plugged in between."""
        self.plan(recurrence=f"FREQ=MINUTELY;INTERVAL=4;COUNT={times}")
        self.run(300.0 - 20.0)
        for _time in range(times):
            self.machines["R1"].set_battery(80.0)
            self.run(EVERY)

    def plan_soon(self, **values) -> None:
        """B, in two minutes."""
        self.plan("B", f"{self.clock.now() + timedelta(minutes=2):%Y-%m-%dT%H:%M}", **values)

    @property
    def drain(self):
        """Of R1."""
        robot_id = self.robot("R1").id
        return self.container.repositories.robots.drains(self.container.db.read(), [robot_id])[robot_id]


@pytest.fixture
def worn(tmp_path):
    worn = Worn(tmp_path)
    yield worn
    worn.switch_off()


def test_what_runs_used_and_took_is_learned_and_outlives_a_restart_and_an_undone_removal(worn):
    def lasts():
        [mission] = worn.container.catalogue.missions()
        return worn.container.history.expected(worn.robot("R1").id, mission.guid)

    worn.run_often(3)
    learned, long = worn.drain, lasts()
    assert (learned.runs, learned.percent / learned.hours) == (3, pytest.approx(39.0, abs=1.5))
    worn.power_cut(5)
    worn.container.catalogue.restore(worn.container.catalogue.remove_robot(worn.robot("R1").id))
    assert (worn.drain, lasts()) == (learned, long)
    assert long is not None


# ---------------------------------------------------------------------- what teaches nothing
def taught(worn):
    """How many runs did; there was one, and it ended well."""
    assert [run.state for run in worn.executions()] == [State.COMPLETED]
    return worn.drain.runs


def test_a_run_during_which_the_app_was_started_again(worn):
    worn.at(330.0, lambda: worn.power_cut(5))
    worn.run_often(1)
    assert taught(worn) == 0


@pytest.mark.parametrize(("silent", "runs"), [((310.0, 340.0), 1), ((330.0, 400.0), 0)])
def test_a_run_whose_end_nobody_saw(worn, silent, runs):
    """A robot that is silent while it runs says afterwards what it used."""
    begins, ends = silent
    worn.at(begins, lambda: worn.network.down.add("R1"))
    worn.at(ends, worn.network.down.clear)
    worn.run_often(1)
    assert taught(worn) == runs


@pytest.mark.parametrize("happens", ["suspend", "step"])
def test_a_run_during_which_the_tablet_slept_or_its_clock_was_set(worn, happens):
    worn.at(330.0, lambda: getattr(worn if happens == "suspend" else worn.clock, happens)(20.0))
    worn.run_often(1)
    assert taught(worn) == 0


def test_a_run_that_ended_with_more_than_it_began_with(worn):
    worn.at(340.0, lambda: worn.machines["R1"].set_battery(95.0))
    worn.run_often(1)
    assert taught(worn) == 0


def test_a_run_during_which_the_battery_was_unknown(worn):
    machine = worn.machines["R1"]
    worn.at(320.0, lambda: machine.press_emergency_stop(True))
    worn.at(330.0, lambda: machine.press_emergency_stop(False))
    worn.at(331.0, machine.resume)
    worn.run_often(1)
    assert taught(worn) == 0


def test_a_mission_that_brings_the_robot_to_its_charger(worn):
    """As its actions on the robot say, whatever its battery did."""
    [mission] = worn.container.catalogue.missions()
    worn.container.catalogue.save_mission(replace(mission, charges=True))
    worn.run_often(1)
    assert taught(worn) == 0


def test_a_run_that_was_seen_charging(worn):
    """Though it ended with less than it began with, and nobody has asked the robot what the mission does."""
    machine, home = worn.machines["R1"], worn.add_mission("Return to charger")
    worn.plan(mission_id=home.id)
    worn.run(500.0)
    assert worn.run_of().state is State.EXECUTING
    machine.set_battery(50.0)
    worn.stranger_queues()  # which ends it
    worn.run(30.0)
    assert taught(worn) == 0


def test_runs_of_the_machine_that_was_there_before(worn):
    """Settings has been told that another one has its place now."""
    robot = worn.robot("R1")
    worn.run_often(1)
    assert worn.drain.runs == 1
    worn.container.catalogue.save_robot(replace(robot, serial_number="another"), password="distributor")
    assert worn.drain.runs == 0


# ---------------------------------------------------------------------- what it is good for
@pytest.mark.parametrize("runs", [ENOUGH_RUNS - 1, ENOUGH_RUNS])
def test_a_robot_that_is_known_to_use_much_is_passed_by_with_little_left(worn, runs):
    worn.run_often(runs)
    worn.machines["R1"].set_battery(NEARLY_EMPTY)
    worn.plan_soon()
    worn.run(140.0)
    run = worn.run_of("B")
    if runs < ENOUGH_RUNS:
        assert (run.state, run.robot) == (State.EXECUTING, "R1")
        return
    assert (run.state, run.wait_details["robots"][0]) == (
        State.WAITING,
        {"robot": "R1", "out": "too_little_battery", "battery": 9},
    )
    worn.switch("R2", on=True)
    worn.run(30.0)
    run = worn.run_of("B")
    assert (run.state, run.robot) == (State.EXECUTING, "R2")
    assert run.choice["robots"][1]["out"] == "too_little_battery"


def test_without_groups_nothing_but_what_is_known_changes(worn):
    """A schedule on one robot starts whatever that uses."""
    worn.run_often(ENOUGH_RUNS)
    worn.machines["R1"].set_battery(NEARLY_EMPTY)
    worn.plan_soon(robot_id=worn.robot("R1").id, group_id=None)
    worn.run(140.0)
    assert worn.run_of("B").state is State.EXECUTING


def posts_of(directory, limit):
    directory.mkdir()
    worn = Worn(directory, limit)
    worn.run_often(ENOUGH_RUNS + 1)
    worn.machines["R1"].set_battery(NEARLY_EMPTY)
    worn.plan_soon()
    worn.at(150.0, lambda: worn.switch("R2", on=True))
    worn.run(300.0)
    posts, kept = (
        [(round(post.at, 1), post.robot, post.mission_id) for post in worn.network.posts()],
        len(worn.executions()),
    )
    worn.switch_off()
    return posts, kept


def test_with_a_history_of_one_row_and_of_all_it_is_known_alike(tmp_path):
    """What was learned is kept with the robot: the same starts leave for the same robots at the same moments."""
    (short, one), (long, many) = posts_of(tmp_path / "one", 1), posts_of(tmp_path / "all", None)
    assert (one, many) == (1, ENOUGH_RUNS + 2)
    assert short == long
    assert [robot for _at, robot, _mission in short] == ["R1"] * (ENOUGH_RUNS + 1) + ["R2"]
