"""What is said of a mission that a person has just started or given to a robot: once, when it is known."""
from __future__ import annotations

from dataclasses import replace

import pytest

from app.domain.models import Execution, State, Wait
from app.screens.common.overlays import Dialogs
from app.screens.common.shell import Shell
from app.screens.common.started import StartReports
from app.screens.common.threads import Changed, UiBus
from app.screens.common.view_model import Navigator
from app.services.live.changes import Topic
from app.widgets.snackbar import Snackbars
from tests.support.home_facts import AINO, execution

UNBOUND = replace(execution(7, AINO, "Kits", State.WAITING), robot_id=None, robot="", group_id=5, robot_group="Hall 1", wait=Wait.ROBOT,
                  wait_details={"group": "Hall 1"})
BOUND = replace(UNBOUND, robot_id=1, robot="Aino", wait=Wait.DUE, wait_details={}, choice={"robots": [{"robot": "Aino"}]})
SENT = replace(BOUND, state=State.QUEUED, queue_id=31)
REFUSED = replace(UNBOUND, tried={"2": {"tries": 1, "robot": "Veikko", "code": "unknown_mission", "problem": ""}})


class AtOnce:
    """Work in the background that takes no time."""

    @staticmethod
    def run(work, done, _failed, key=None) -> None:
        done(work())


class World:
    """A ledger with one row, and who follows it."""

    def __init__(self, ui) -> None:
        self.row: Execution | None = None
        self.bus, self.ui = UiBus(), ui
        self.shell = Shell(Navigator(None, {}), Dialogs(animate=False), Snackbars(), self.bus, AtOnce())
        self.reports = StartReports(self.shell, lambda _key: self.row)

    def becomes(self, row: Execution) -> None:
        self.row = row
        self.bus.publish(Changed(Topic.EXECUTIONS))
        self.ui.advance()

    @property
    def told(self) -> list[str]:
        return self.shell.snackbars.texts


@pytest.fixture
def world(ui):
    ui.advance()                             # the clock may not have ticked for long
    made = World(ui)
    close = made.reports.open()
    yield made
    close()


def test_a_start_of_a_group_that_soon_has_a_robot_is_not_said_to_wait(world, ui):
    world.row = UNBOUND
    world.reports.follow(UNBOUND)
    assert world.told == []
    ui.advance(.3)
    world.becomes(BOUND)
    assert world.told == []
    world.becomes(SENT)
    assert world.told == ["Kits is sent to Aino. Aino: free now"]
    ui.advance(2)
    assert world.told == ["Kits is sent to Aino. Aino: free now"]


def test_one_that_still_has_none_after_a_moment_is_said_to_wait_once(world, ui):
    world.row = UNBOUND
    world.reports.follow(UNBOUND)
    ui.advance(1.2)
    [told] = world.told
    assert told.startswith("Kits is not sent yet. Waits for a robot of Hall 1 until ")
    world.becomes(UNBOUND)
    assert world.told == [told]


def test_a_robot_that_refuses_what_it_was_given_is_named(world, ui):
    world.row = BOUND
    world.reports.follow(BOUND)
    world.becomes(REFUSED)
    ui.advance(1.2)
    [told] = world.told
    assert told.startswith("Kits is not sent yet. Veikko refused it: The robot has no such mission: ")


def test_what_one_refused_and_another_took_tells_both(world, ui):
    world.row = REFUSED
    world.reports.follow(REFUSED)
    world.becomes(replace(SENT, tried=REFUSED.tried))
    [told] = world.told
    assert told.startswith("Kits is sent to Aino. Veikko refused it: The robot has no such mission")
    assert told.endswith("; given to Aino")


HELD = replace(BOUND, wait=Wait.HOLD, wait_details={"hold": "Maintenance"})


def test_what_was_held_and_is_released_is_not_said_to_wait_any_more(world, ui):
    world.row = HELD
    world.reports.follow(HELD)
    [told] = world.told
    assert told.startswith("Kits is not sent to Aino yet. ")
    ui.advance(2)
    world.becomes(BOUND)                                      # released, on its way
    world.becomes(SENT)
    assert world.told == ["Kits is sent to Aino. Aino: free now"]


def test_what_was_held_and_is_cancelled_is_not_said_to_wait_any_more(world, ui):
    world.row = HELD
    world.reports.follow(HELD)
    world.becomes(replace(HELD, state=State.CANCELLED))
    assert world.told == []
    assert world.reports._followed == world.reports._said == {}


def test_long_after_that_was_read_nothing_more_is_said(world, ui):
    world.row = HELD
    world.reports.follow(HELD)
    ui.advance(60)
    world.becomes(SENT)
    assert world.told == []
