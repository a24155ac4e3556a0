"""The way to a mission's first stop: of equal robots the nearer one comes, and it is said how far away it is."""

from __future__ import annotations

from dataclasses import replace
from datetime import timedelta

import pytest

from app.database.missions import StopRepository
from app.domain import choice
from app.domain.models import HandOver
from app.domain.robot import Spot, Stop
from app.services.catalogue import group_edit
from mir_sim.motion import Pose
from mir_sim.world import BY_NAME, MAP_GUID
from tests.support.groups import Hall
from tests.support.network import Fate
from tests.support.site import GUIDS

WAREHOUSE, LINE = BY_NAME["Warehouse"], BY_NAME["Line 1"]
DELIVER = (
    Stop(WAREHOUSE.guid, "Warehouse", Spot(MAP_GUID, 9.0, 19.0)),
    Stop(LINE.guid, "Line 1", Spot(MAP_GUID, 21.0, 18.0)),
)
NEAR, FAR = Pose(9.0, 12.0, 0.0), Pose(36.0, 12.0, 0.0)  # 7 m and 27.9 m from the warehouse


@pytest.fixture
def hall(tmp_path):
    hall = Hall(tmp_path, robots=2)
    hall.run(5)
    yield hall
    hall.switch_off()


def stops(hall, name="Deliver"):
    return StopRepository().all(hall.container.db.read()).get(GUIDS[name], ())


def put(hall, **poses):
    for name, pose in poses.items():
        hall.machines[name].relocate(pose, MAP_GUID)


def gain_experience(hall):
    for pose in (NEAR, FAR, FAR):
        put(hall, R2=pose)
        hall.run(5)
        hall.container.operator.run_now(hall.robot("R2").id, 1)
        hall.run(200)
    put(hall, R1=FAR, R2=FAR)


@pytest.fixture
def experienced(hall):
    """The stops are known, and three runs of the mission are behind R2, one from near and two from far. So of equals R1 is chosen: it has
    run less."""
    hall.learn_stops()
    gain_experience(hall)


def next_minute(hall):
    """And the beginning of it from now."""
    hall.run(60 - hall.clock.now().second)
    return f"{hall.clock.now() + timedelta(minutes=1):%Y-%m-%dT%H:%M}"


def planned(hall, minutes=1):
    hall.plan("A", f"{hall.clock.now() + timedelta(minutes=minutes):%Y-%m-%dT%H:%M}")
    hall.run(60 * minutes + 3)
    return hall.run_of()


def metres(row):
    return choice.chosen(row.choice, "UTC")


def test_what_a_mission_drives_to_is_read_from_a_robot_and_kept(hall):
    assert stops(hall) == ()
    hall.learn_stops()
    assert stops(hall) == DELIVER
    hall.switch_off()
    hall.switch_on()
    assert stops(hall) == DELIVER


def test_a_position_that_is_moved_or_a_mission_that_is_changed_is_read_again_in_time(hall):
    hall.learn_stops()
    for machine in hall.machines.values():
        machine.site.table("/positions").get(WAREHOUSE.guid)["pos_x"] = 1.0
    hall.learn_stops()
    assert stops(hall) == DELIVER
    hall.container.catalogue.change_settings(poll_interval_seconds=1800)  # half a day soon passes
    hall.run(13 * 3600)
    hall.learn_stops()
    assert stops(hall)[0].spot == Spot(MAP_GUID, 1.0, 19.0)


def test_a_position_that_is_a_parameter_or_missing_is_unknown(hall):
    hall.add_mission("Go to position")
    hall.network.next("GET", "/positions/" + LINE.guid, Fate.NOT_FOUND)
    hall.learn_stops()
    assert stops(hall, "Go to position") == (Stop(),)
    assert stops(hall) == (DELIVER[0], Stop(LINE.guid))


def test_the_nearer_of_two_robots_comes_and_says_so(experienced, hall):
    put(hall, R2=NEAR)
    row = planned(hall)
    assert (row.robot, metres(row)) == (
        "R2",
        "R2: free now, 7 m away, will be done soonest, about 06:12 · R1: free now, 28 m away",
    )


def test_a_nearer_robot_that_gets_another_start_is_said_to(experienced, hall):
    put(hall, R2=NEAR)
    hall.plan("B", f"{hall.clock.now() + timedelta(minutes=1):%Y-%m-%dT%H:%M}")
    planned(hall)
    [farther] = [row for row in hall.executions() if row.robot == "R1" and row.group_id]
    assert metres(farther) == "R1: free now, 28 m away · Deliver is being sent to R2"


def test_without_positions_the_first_comes_and_nothing_is_said_of_metres(hall):
    gain_experience(hall)
    put(hall, R2=NEAR)
    row = planned(hall)
    assert (row.robot, metres(row)) == ("R1", "R1: free now, has run less today · R2: free now")


def test_on_another_map_no_way_is_known(experienced, hall):
    for machine in hall.machines.values():
        machine.site.table("/maps").add(
            machine.site.table("/maps").get(MAP_GUID) | {"guid": "another-map", "name": "Upstairs"}
        )
    hall.machines["R2"].relocate(NEAR, "another-map")
    row = planned(hall)
    assert (row.robot, metres(row)) == ("R1", "R1: free now, 28 m away, has run less today · R2: free now")


def at_once(hall):
    hall.container.catalogue.edit(lambda edit: group_edit.save(edit, replace(hall.group, hand_over=HandOver.AT_ONCE)))


def test_where_a_robot_says_nonsense_of_its_position_it_is_not_known(experienced, hall):
    put(hall, R1=Pose(1e308, -1e308, 0.0), R2=Pose(20_000.0, 0.0, 0.0))
    row = planned(hall)
    assert (row.robot, metres(row)) == ("R1", "R1: free now, has run less today · R2: free now")


def test_a_busy_robot_comes_from_where_its_last_mission_ends(hall):
    """Both are equally busy for an unknown time. R2 will be the nearer one."""
    compactor, home = (hall.add_mission(name) for name in ("Waste to compactor", "Home"))
    hall.learn_stops()
    at_once(hall)
    gain_experience(hall)
    hall.plan("A", at=next_minute(hall))
    hall.run(50)
    hall.container.operator.run_now(hall.robot("R1").id, compactor.id)
    hall.container.operator.run_now(hall.robot("R2").id, home.id)
    hall.run(12)
    assert (hall.run_of().robot, "m away" in metres(hall.run_of())) == ("R2", False)


def test_a_start_that_is_given_back_shows_the_way_of_its_new_robot(hall):
    hall.learn_stops()
    put(hall, R1=NEAR, R2=FAR)
    hall.run(5)
    hall.network.down |= {"R1"}
    hall.plan()
    hall.run(310)
    assert (hall.run_of().robot, hall.run_of().choice["robots"][0]) == ("R2", {"robot": "R2", "metres": 28})
