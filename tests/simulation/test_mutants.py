"""The proof that the simulation would find a bug if there were one: each planted bug is found by the oracle and the seed in its table."""

from __future__ import annotations

import builtins
import dis

import pytest

from app.mir.errors import RobotError
from tests.simulation.mutants import fleets, groups, lost, twice, untrue, unwanted
from tests.simulation.mutants.fleets import FleetMutant
from tests.simulation.mutants.mutant import planted
from tests.support.examples import every_fourth
from tests.support.targets import ROBOT, TARGETS

ALL = (*twice.MUTANTS, *lost.MUTANTS, *unwanted.MUTANTS, *untrue.MUTANTS, *groups.MUTANTS)
QUICK = ("every failed start is sent again", ROBOT)


def test_each_of_them_has_a_name_of_its_own():
    assert len({mutant.name for mutant in ALL}) == len(ALL) >= 48


def test_each_of_them_can_be_planted():
    for mutant in ALL:
        with planted(mutant) as function:
            names = {each.argval for each in dis.get_instructions(function) if each.opname == "LOAD_GLOBAL"}
            assert names <= vars(builtins).keys() | function.__globals__.keys(), mutant.name


@pytest.mark.parametrize(
    ("mutant", "target"),
    [
        pytest.param(
            mutant,
            target,
            id=f"{mutant.name}, {target}",
            marks=() if (mutant.name, target) == QUICK else pytest.mark.long,
        )
        for mutant in ALL
        for target in TARGETS
        if not isinstance(mutant.at.get(target), str)  # why it isn't tried there
    ],
)
def test_a_planted_bug_is_found(mutant, target):
    found = mutant.find(target)
    assert any(mutant.oracle in problem for problem in found.violations), found.line(mutant.seed)


@pytest.mark.parametrize("mutant", every_fourth(fleets.MUTANTS), ids=[mutant.name for mutant in fleets.MUTANTS])
def test_a_bug_that_is_planted_in_the_code_of_fleets_is_found(mutant: FleetMutant, tmp_path):
    story, chosen = mutant.as_story(), (0,)
    directories = [tmp_path / "without", tmp_path / "with"]
    for each in directories:
        each.mkdir()
    story.play(directories[0], chosen)
    with planted(mutant), pytest.raises((AssertionError, RobotError, pytest.fail.Exception)):
        story.play(directories[1], chosen)
