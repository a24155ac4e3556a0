"""Which robot of a group a planned start will probably get."""

from __future__ import annotations

from dataclasses import replace
from itertools import pairwise

import pytest
from hypothesis import given
from hypothesis import strategies as st

from app.services.allocation.choose import AHEAD, choose
from app.services.allocation.situation import Member, Situation, Start
from app.services.planning.forecast import ForecastSite, ForecastStart, forecast
from tests.support.examples import examples

NAMES = {1: "Aino", 2: "Sisu", 3: "Veikko", 4: "Onni"}
HALL = (1, 2, 3)


def taking(seconds=300.0, **of_robots):
    """Seconds that every mission takes; by the robot's name where it differs."""
    return lambda robot_id, _mission, *, slow=False: of_robots.get(NAMES[robot_id], seconds) * (1.2 if slow else 1.0)


def site(takes=None, **values):
    return ForecastSite(NAMES, takes or taking(), **values)


def kits(at, **values):
    members, closes = values.pop("members", HALL), at + values.pop("window", 900.0)
    return ForecastStart(0, "Kits", members, planned_s=at, closes_s=closes, **values)


def fixed(at, robot_id, **values):
    return ForecastStart(0, "Shift bus", (robot_id,), planned_s=at, is_fixed=True, **values)


def whose(found, number):
    return NAMES[found[number].robot_id] if number in found else None


def test_simultaneous_starts_go_to_different_robots_and_the_fourth_to_the_first_free():
    found = forecast([kits(0.0) for _ in range(4)], site(taking(Sisu=200.0)))
    assert sorted((whose(found, n), found[n].begins) for n in range(4)) == [
        ("Aino", 0.0),
        ("Sisu", 0.0),
        ("Sisu", 200.0),
        ("Veikko", 0.0),
    ]
    assert all(one.in_time for one in found.values())


def test_equal_robots_are_chosen_by_hours_since_midnight():
    wanted = [kits(0.0), kits(7200.0)]
    assert whose(forecast(wanted, site(hours={1: 2.0, 2: 3.0, 3: 1.0})), 0) == "Veikko"
    assert whose(forecast(wanted, site(hours={1: 2.0, 2: 3.0, 3: 1.0})), 1) == "Veikko"
    assert whose(forecast(wanted, site(hours={1: 2.0, 2: 3.0, 3: 1.0}, days=[3600.0])), 1) == "Aino"


def test_the_robot_that_a_fixed_start_wants_soon_is_left_to_it():
    found = forecast([kits(0.0, members=(1, 2)), fixed(60.0, 1)], site(taking(Aino=250.0)))
    assert (whose(found, 0), found[1].begins) == ("Sisu", 60.0)
    alone = forecast([kits(0.0, members=(1, 2)), fixed(AHEAD + 300, 1)], site(taking(Aino=250.0)))
    assert whose(alone, 0) == "Aino"


def test_a_start_without_a_free_robot_is_queued_at_the_end_of_its_window():
    found = forecast(
        [kits(0.0, members=(1, 2)), kits(0.0, members=(1, 2)), kits(10.0, members=(1, 2), window=60.0)], site()
    )
    assert (found[2].in_time, found[2].begins) == (False, 300.0)
    assert found[0].in_time


def test_a_robot_that_is_held_gets_nothing_until_that_ends():
    found = forecast(
        [kits(0.0, members=(1, 2)), kits(700.0, members=(1, 2))], site(taking(Aino=250.0), held={1: [(-10.0, 600.0)]})
    )
    assert [whose(found, n) for n in range(2)] == ["Sisu", "Aino"]
    assert forecast([kits(0.0)], site(held={robot_id: [(-1.0, 1e9)] for robot_id in HALL})) == {}
    [late] = forecast([kits(0.0, members=(1,))], site(held={1: [(-10.0, 600.0)]})).values()
    assert (late.begins, late.in_time) == (600.0, True)


def test_a_start_that_cannot_finish_in_time_gets_no_robot():
    assert forecast([kits(0.0, finish_s=299.0)], site()) == {}
    assert whose(forecast([kits(0.0, finish_s=301.0)], site()), 0) == "Aino"


def test_a_group_without_a_usable_robot_finds_none_and_delays_no_other():
    assert whose(forecast([kits(0.0, members=()), kits(0.0)], site()), 1) == "Aino"


def test_an_immediate_start_waits_at_the_robot_that_is_free_first():
    found = forecast([kits(0.0, members=(1, 2), at_once=True) for _ in range(3)], site(taking(Sisu=200.0)))
    assert sorted((whose(found, n), found[n].begins) for n in range(3)) == [
        ("Aino", 0.0),
        ("Sisu", 0.0),
        ("Sisu", 200.0),
    ]


def test_a_full_place_keeps_a_start_waiting_but_no_robot_from_another_one():
    wanted = [kits(0.0, places=("Dock",)), kits(0.0, places=("Dock",)), kits(0.0, places=("Dock",)), kits(0.0)]
    found = forecast(wanted, site(room={"Dock": 2}))
    assert [found[number].begins for number in range(4)] == [0.0, 0.0, 300.0, 0.0]
    assert forecast(wanted, site(room={"Dock": 2}, at_places={"Dock": [100.0, 200.0]}))[0].begins == 100.0


def test_a_place_is_used_also_by_robots_of_other_groups_and_of_none():
    wanted = [
        fixed(0.0, 4, places=("Dock",)),
        kits(10.0, members=(1, 2), places=("Dock",)),
        kits(10.0, members=(3,), places=("Dock",)),
    ]
    found = forecast(wanted, site(room={"Dock": 1}))
    assert [found[number].begins for number in range(3)] == [0.0, 300.0, 600.0]
    short = [replace(each, closes_s=200.0) for each in wanted]
    assert sorted(forecast(short, site(room={"Dock": 1}))) == [0]  # never in a queue, as the place is full


# ---------------------------------------------------------------------- for any plan
LASTS = st.integers(20, 1500)
ROOM = {"Dock": 2, "Gate": 1}


@st.composite
def plans(draw):
    """Some hours of starts of two groups that share a robot, and of fixed ones; how long robots take."""
    lasts = {(robot_id, mission): float(draw(LASTS)) for robot_id in NAMES for mission in ("Kits", "Waste")}
    wanted = []
    for at in sorted(draw(st.lists(st.integers(0, 7200), min_size=1, max_size=25))):
        mission, priority = draw(st.sampled_from(("Kits", "Waste"))), draw(st.integers(-1, 2))
        members = draw(st.sampled_from(((1, 2, 3), (3, 4), (1,), (2,), (4,))))
        is_fixed = len(members) == 1 and draw(st.booleans())
        finish = None if is_fixed or draw(st.booleans()) else at + float(draw(LASTS))
        places = draw(st.sampled_from(((), (), ("Dock",), ("Dock", "Gate"))))
        wanted.append(
            ForecastStart(
                0,
                mission,
                members,
                priority,
                float(at),
                at + 60.0 * draw(st.integers(1, 30)),
                finish,
                places=places,
                is_fixed=is_fixed,
            )
        )
    return wanted, lasts


def of(lasts):
    return site(lambda robot_id, mission, *, slow=False: lasts[robot_id, mission] * (1.3 if slow else 1.0), room=ROOM)


@examples(150)
@given(plans())
def test_each_robot_does_one_thing_at_a_time_on_time_and_only_its_own(plan):
    wanted, lasts = plan
    found = forecast(wanted, of(lasts))
    for robot_id in NAMES:
        runs = sorted((one.begins, one.ends) for one in found.values() if one.robot_id == robot_id)
        assert all(before[1] <= after[0] for before, after in pairwise(runs))
    for number, one in found.items():
        each = wanted[number]
        assert one.robot_id in each.members
        assert one.begins >= each.planned_s
        assert one.ends == one.begins + lasts[one.robot_id, each.mission]
        assert one.begins <= each.closes_s or each.is_fixed or not one.in_time
        assert each.finish_s is None or one.ends <= each.finish_s + 1e-6


@examples(150)
@given(plans())
def test_only_what_cannot_be_done_in_time_or_waits_for_a_place_gets_no_robot(plan):
    wanted, lasts = plan
    found = forecast(wanted, of(lasts))
    in_groups = {robot_id for each in wanted if not each.is_fixed for robot_id in each.members}
    lost = [
        each for number, each in enumerate(wanted) if number not in found and not in_groups.isdisjoint(each.members)
    ]
    assert all((each.finish_s is not None or each.places) and not each.is_fixed for each in lost)


@examples(150)
@given(plans())
def test_a_start_of_a_group_begins_only_where_there_is_room_at_its_places(plan):
    wanted, lasts = plan
    found = forecast(wanted, of(lasts))
    for number, one in found.items():
        for name in wanted[number].places if one.in_time and not wanted[number].is_fixed else ():
            there = sum(
                name in wanted[other].places
                and each.ends > one.begins
                and (wanted[other].planned_s if wanted[other].is_fixed else each.begins) <= one.begins
                for other, each in found.items()
            )
            assert there <= ROOM[name]


@examples(150)
@given(plans(), st.integers(0, 24))
def test_each_choice_is_the_one_of_the_decision_code_at_that_moment(plan, last):
    """The newest start of a plan, where nothing else waits: the robots as the starts before it leave them."""
    wanted, lasts = plan
    wanted = [
        *wanted[:last],
        replace(
            wanted[last % len(wanted)],
            planned_s=9000.0,
            closes_s=9900.0,
            finish_s=None,
            is_fixed=False,
            members=(1, 2, 3),
            places=(),
        ),
    ]
    found = forecast(wanted, of(lasts))
    earlier = [found[number] for number in range(len(wanted) - 1) if number in found]
    if any(one.begins >= 9000.0 for one in earlier):
        return
    free = {
        robot_id: max((one.ends - 9000.0 for one in earlier if one.robot_id == robot_id), default=-1.0)
        for robot_id in HALL
    }
    hours = {
        robot_id: sum(one.ends - one.begins for one in earlier if one.robot_id == robot_id) / 3600 for robot_id in HALL
    }
    members = {
        robot_id: Member(
            robot_id, NAMES[robot_id], free[robot_id] <= 0, max(0.0, free[robot_id]), hours=hours[robot_id]
        )
        for robot_id in HALL
    }
    start = Start(0, wanted[-1].mission, HALL, wanted[-1].priority)
    [decision] = choose(Situation(members, [start], of(lasts).duration))
    mine = found[len(wanted) - 1]
    if decision.robot_id is None:
        assert mine.begins > 9000.0
    else:
        assert (mine.robot_id, mine.begins) == (decision.robot_id, 9000.0)


@examples(60)
@given(plans())
def test_the_forecast_of_the_first_hour_is_the_same_however_far_it_reaches(plan):
    wanted, lasts = plan
    near = [each for each in wanted if each.planned_s <= 3600 + AHEAD]
    first = [
        number for number, each in enumerate(near) if each.planned_s <= 3600 and not each.is_fixed
    ]  # those only where a group needs them
    long, short = forecast(wanted, of(lasts)), forecast(near, of(lasts))
    assert [long.get(number) for number in first if long.get(number) and long[number].begins <= 3600] == [
        short.get(number) for number in first if long.get(number) and long[number].begins <= 3600
    ]


@pytest.mark.long
def test_a_forecast_of_far_too_many_starts_is_cut_short():
    assert 0 < len(forecast([kits(number * 1.0, window=3600.0) for number in range(6000)], site())) < 500


@pytest.mark.parametrize("window", [60.0, 901.1, 1e6 + 0.3])
def test_a_last_call_is_heard_whatever_its_instant_rounds_to(window):
    found = forecast([fixed(0.0, 1), kits(0.1, members=(1,), window=window)], site(taking(window * 2)))
    assert found[1].begins == window * 2
