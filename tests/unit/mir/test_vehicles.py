"""A robot of any fleet as a target, against the simulated fleet."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial

import pytest

from app.domain.models import ANY_VEHICLE
from app.domain.robot import QueueState, RobotState
from app.mir.errors import VehicleUnavailable
from mir_sim.faults import FaultKind
from tests.support.errors import raises
from tests.unit.mir.halls import ClassicHall, EnterpriseHall, Hall, token
from tests.unit.sim.asking import GUIDS

OTHER_ANSWERS = [
    partial(EnterpriseHall, version="1.4.2"),
    partial(EnterpriseHall, posted="accepted", appears_seconds=(0, 0)),
]
BOTH = pytest.mark.parametrize("make", [ClassicHall, EnterpriseHall])
ANY = pytest.mark.parametrize("make", [ClassicHall, EnterpriseHall, *OTHER_ANSWERS])


@pytest.fixture
def hall(make: Callable[[], Hall]) -> Hall:
    return make()


@ANY
def test_an_order_is_followed_to_its_end(hall: Hall) -> None:
    aino, own = hall.vehicle(), token()
    number = aino.enqueue(GUIDS["Home"], description=own)
    hall.pass_time(1.1)
    (item,) = aino.open_items()
    assert (item.id, item.description, item.vehicle) == (number, own, hall.ids[0])
    assert 0 < number < 2**53
    assert hall.run_until(aino, number, own, QueueState.EXECUTING)
    assert hall.run_until(aino, number, own, QueueState.DONE)
    done = aino.queue_item(number, own)
    assert (done.id, done.vehicle_name) == (number, "Aino")
    assert done.started <= done.finished
    assert aino.open_items() == []
    assert [item.id for item in aino.items_after(0, tokens=(own,))] == [number]


@ANY
@pytest.mark.parametrize("after", [0.0, 300.0], ids=["at once", "when it has ended"])
def test_an_order_whose_answer_is_lost_is_found_by_its_token(hall: Hall, after: float) -> None:
    aino = hall.vehicle()
    hall.run_one(aino)
    floor = aino.highest_queue_id() or 0
    own = hall.lose(aino, FaultKind.DROP_RESPONSE)
    hall.pass_time(after)
    (item,) = aino.items_after(floor, tokens=(own, token(), "no UUID"))
    assert item.description == own
    assert (item.state is QueueState.DONE) == (after > 0)


@BOTH
@pytest.mark.parametrize("runs", [False, True], ids=["waiting", "running"])
def test_one_order_is_cancelled_and_no_other(hall: Hall, runs: bool) -> None:
    aino, veikko, own, others = hall.vehicle(0), hall.vehicle(1), token(), token()
    number, other = (each.enqueue(GUIDS["Deliver"], description=of) for each, of in ((aino, own), (veikko, others)))
    if runs:
        hall.run_until(aino, number, own, QueueState.EXECUTING)
    aino.cancel(number, own)
    assert hall.run_until(aino, number, own, QueueState.ABORTED) is QueueState.ABORTED
    assert veikko.queue_item(other, others).state.is_open


@BOTH
def test_clearing_cancels_the_apps_own_orders_only(hall: Hall) -> None:
    aino, own, others = hall.vehicle(), token(), token()
    ours, theirs = (aino.enqueue(GUIDS["Deliver"], description=each) for each in (own, others))
    aino.clear_queue({ours: own, 999_999: token()})
    hall.pass_time(10.0)
    assert aino.queue_item(ours, own).state is QueueState.ABORTED
    assert aino.queue_item(theirs, others).state.is_open
    assert "DELETE /mission_scheduler" not in hall.transport.requests


@BOTH
def test_any_robot_is_chosen_by_the_fleet(hall: Hall) -> None:
    any_robot, own = hall.vehicle(ANY_VEHICLE), token()
    assert (any_robot.status().state, any_robot.status().battery_percentage) == (RobotState.READY, None)
    number = any_robot.enqueue(GUIDS["Home"], description=own)
    assert any_robot.queue_item(number, own).vehicle == ""
    assert [item.id for item in any_robot.open_items()] == [number]
    hall.run_until(any_robot, number, own, QueueState.EXECUTING)
    item = any_robot.queue_item(number, own)
    assert (item.vehicle, item.vehicle_name) in zip(hall.ids, ("Aino", "Veikko"), strict=True)
    hall.pass_time(1.1)
    assert [item.id for item in any_robot.open_items()] == [number]


@BOTH
def test_a_robot_that_the_fleet_does_not_have_any_more(hall: Hall) -> None:
    with raises(VehicleUnavailable, code="not_in_fleet"):
        hall.vehicle("77").status()
