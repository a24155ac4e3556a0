"""The proof that the simulation would find a bug if there were one: each planted bug is found by the oracle and the seed in its table."""

from __future__ import annotations

import pytest

from app.mir.errors import RobotError
from tests.simulation.__main__ import simulate
from tests.simulation.fleet_mutants import FLEET_MUTANTS, FleetMutant
from tests.simulation.group_mutants import GROUP_MUTANTS
from tests.simulation.mutants import AT_CLASSIC_FLEETS, MUTANTS, planted

ALL = (*MUTANTS, *GROUP_MUTANTS)
QUICK = ("every failed start is sent again",)


def test_each_of_them_has_a_name_of_its_own():
    assert len({mutant.name for mutant in ALL}) == len(ALL) >= 48


def test_each_of_them_can_be_planted():
    for mutant in ALL:
        with planted(mutant):
            pass


@pytest.mark.parametrize(
    "mutant",
    [pytest.param(mutant, id=mutant.name, marks=() if mutant.name in QUICK else pytest.mark.long) for mutant in ALL],
)
def test_a_planted_bug_is_found(mutant):
    assert_found(mutant, "robot")


@pytest.mark.long
@pytest.mark.parametrize("name", AT_CLASSIC_FLEETS)
def test_a_planted_bug_is_found_through_a_classic_fleet(name):
    """Fleet Enterprise takes an id only once, so that there a bug that repeats starts does no harm."""
    assert_found(next(mutant for mutant in MUTANTS if mutant.name == name), "classic")


def assert_found(mutant, target):
    with planted(mutant):
        found = simulate(mutant.seed, mutant.hours, mutant.profile.through(target), mutant.oracle)
    assert any(mutant.oracle in problem for problem in found.violations), found.line(mutant.seed)


@pytest.mark.parametrize("mutant", [pytest.param(mutant, id=mutant.name) for mutant in FLEET_MUTANTS])
def test_a_bug_that_is_planted_in_the_code_of_fleets_is_found(mutant: FleetMutant, tmp_path):
    story, chosen = mutant.as_story(), (0,)
    directories = [tmp_path / "without", tmp_path / "with"]
    for each in directories:
        each.mkdir()
    story.play(directories[0], chosen)
    with planted(mutant.bug), pytest.raises((AssertionError, RobotError, pytest.fail.Exception)):
        story.play(directories[1], chosen)
