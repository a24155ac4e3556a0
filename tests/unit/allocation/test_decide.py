"""Which start gets which robot: the rules one by one, and what holds for any situation."""

from __future__ import annotations

from dataclasses import replace

import pytest
from hypothesis import given
from hypothesis import strategies as st

from app.domain.execution import DurationEstimate
from app.services.allocation.choose import (
    EVEN,
    FAILED,
    LAST_CALL,
    MOST_FAILED,
    PATIENCE,
    RESERVE,
    Advantage,
    choose,
    delay,
)
from app.services.allocation.situation import (
    CRITICAL,
    HIGH,
    LOW,
    NORMAL,
    SHORTEST_S,
    UNKNOWN_S,
    Ineligible,
    Member,
    PlannedStart,
    Situation,
    Start,
    remaining_duration,
    run_duration,
    weight,
)

AINO, SISU, VEIKKO = Member(1, "Aino"), Member(2, "Sisu"), Member(3, "Veikko")
ROBOTS = (AINO, SISU, VEIKKO)
ALL = (1, 2, 3)


def busy(robot: Member, seconds: float) -> Member:
    return replace(robot, is_free=False, free_s=seconds)


def lasts(robot_id: int, mission: str, *, slow: bool = False) -> float:
    return 400.0 if slow else 300.0


def situation(*starts: Start, robots=ROBOTS, duration=lasts, planned=()) -> Situation:
    return Situation({robot.id: robot for robot in robots}, starts, duration, planned)


def start(number: int = 1, **values) -> Start:
    return Start(number, "Deliver", **{"members": ALL} | values)


def assigned(*args, **values) -> dict[int, int | None]:
    return {decision.start.id: decision.robot_id for decision in choose(situation(*args, **values))}


# ---------------------------------------------------------------------- to whom
def test_equal_robots_are_chosen_by_hours_then_by_name():
    assert assigned(start()) == {1: AINO.id}
    assert assigned(start(), robots=(replace(AINO, hours=1.0), SISU, VEIKKO)) == {1: SISU.id}
    assert assigned(
        start(),
        duration=lambda robot_id, mission, slow=False: 300.0 + 2 * EVEN * (robot_id == 2),
        robots=(replace(AINO, hours=1.0), SISU, replace(VEIKKO, hours=3.0)),
    ) == {1: AINO.id}


@pytest.mark.parametrize(
    ("robots", "seconds", "planned", "why"),
    [
        ((AINO, SISU), {}, (), None),
        ((AINO, busy(SISU, 9.0)), {}, (), None),
        ((AINO, SISU), {1: 299.0}, (), Advantage.SOONEST),
        ((AINO, replace(SISU, hours=0.5)), {}, (), Advantage.LESS_RUN),
        ((AINO, replace(SISU, hours=2.0)), {1: 310.0}, (), Advantage.LESS_RUN),
        (
            (AINO, replace(SISU, hours=0.5)),
            {},
            (PlannedStart("Shift bus", (1,), 60.0, 300.0, CRITICAL, is_fixed=True),),
            Advantage.AHEAD,
        ),
    ],
)
def test_why_the_chosen_one_of_several_that_are_free(robots, seconds, planned, why):
    [decision] = choose(
        situation(
            start(),
            robots=robots,
            duration=lambda robot_id, *_args, slow=False: seconds.get(robot_id, 300.0),
            planned=planned,
        )
    )
    assert decision.robot_id is not None
    assert decision.advantage == why


def test_a_robot_that_gets_another_start_in_the_same_moment_is_free_no_more():
    first, second = choose(situation(start(1), start(2), robots=(AINO, SISU)))
    assert (first.robot_id, second.robot_id) == (AINO.id, SISU.id)
    assert [(option.robot_id, option.is_free, option.taken_by) for option in second.options] == [
        (SISU.id, True, ""),
        (AINO.id, False, "Deliver"),
    ]


def test_one_that_could_not_be_done_in_time_there_leaves_nothing_to_what_is_planned():
    hours = replace(AINO, hours=3.0)
    [decision] = choose(
        situation(
            start(finish_s=305.0),
            robots=(hours, SISU, replace(VEIKKO, hours=4.0)),
            duration=lambda robot_id, *_args, slow=False: {1: 300.0, 2: 310.0, 3: 290.0}[robot_id],
        )
    )
    assert (decision.robot_id, decision.advantage) == (AINO.id, Advantage.LESS_RUN)
    assert [option.robot_id for option in decision.options if decision.start.is_too_late(option.done_s)] == [SISU.id]


def test_a_busy_robot_is_waited_for_only_if_it_is_done_much_sooner():
    def fast_aino(robot_id, mission, slow=False):
        return 100.0 if robot_id == AINO.id else 100.0 + PATIENCE + 60.0

    assert assigned(start(), robots=(busy(AINO, 59.0), SISU), duration=fast_aino) == {1: None}
    assert assigned(start(), robots=(busy(AINO, 61.0), SISU), duration=fast_aino) == {1: SISU.id}


def test_hours_run_never_have_a_start_wait_for_another_robot():
    tired = replace(AINO, hours=12.0)
    assert assigned(start(), robots=(tired, busy(SISU, 1.0), replace(busy(VEIKKO, 1.0), hours=3.0))) == {1: AINO.id}
    assert assigned(start(), robots=(tired, replace(SISU, hours=9.0), replace(VEIKKO, hours=10.0))) == {1: SISU.id}


def failed(robot: Member, times: int = 1) -> Member:
    return replace(robot, failures=times)


@pytest.mark.parametrize("times", [1, 3, 1000])
def test_a_robot_that_failed_is_taken_after_those_that_are_free(times):
    assert assigned(start(1), start(2), robots=(failed(AINO, times), SISU, VEIKKO)) == {1: SISU.id, 2: VEIKKO.id}
    far_and_tired = replace(SISU, hours=20.0)
    assert assigned(
        start(),
        robots=(failed(AINO, times), far_and_tired),
        duration=lambda robot_id, *_args, slow=False: 300.0 + 100.0 * (robot_id == SISU.id),
    ) == {1: SISU.id}


def test_with_no_other_it_gets_every_start():
    assert assigned(start(), robots=(failed(AINO, 1000),)) == {1: AINO.id}
    assert assigned(start(), robots=(failed(AINO, 1000), replace(SISU, ineligible=Ineligible.HELD))) == {1: AINO.id}
    assert assigned(start(finish_s=301.0), robots=(failed(AINO, 3), busy(SISU, 60.0))) == {1: AINO.id}
    soon = PlannedStart("Shift bus", ALL, 60.0, 300.0, CRITICAL)
    assert assigned(start(), robots=(failed(AINO, 3),), planned=(soon,)) == assigned(
        start(), robots=(AINO,), planned=(soon,)
    )


def test_a_busy_robot_is_waited_for_rather_but_not_for_ever():
    longest = MOST_FAILED * FAILED - PATIENCE
    assert assigned(start(), robots=(failed(AINO, 3), busy(SISU, longest - 1))) == {1: None}
    assert assigned(start(), robots=(failed(AINO, 3), busy(SISU, longest + 1))) == {1: AINO.id}


def test_failures_are_no_other_reason_for_the_choice():
    """Sisu would be done later than Aino, which failed, and ran no less than Veikko, which is farther away."""
    [decision] = choose(
        situation(
            start(), robots=(failed(AINO), SISU, VEIKKO), duration=lambda robot_id, *_args, slow=False: 100.0 * robot_id
        )
    )
    assert (decision.robot_id, decision.advantage) == (SISU.id, None)
    [decision] = choose(situation(start(), robots=(failed(AINO), SISU, replace(VEIKKO, hours=1.0))))
    assert (decision.robot_id, decision.advantage) == (SISU.id, Advantage.LESS_RUN)


@pytest.mark.parametrize(
    ("starts", "robots", "found"),
    [
        pytest.param([start(number) for number in (1, 2, 3, 4)], ROBOTS, [1, 2, 3, None], id="one each"),
        pytest.param(
            [
                start(1, planned_s=-60),
                start(2, planned_s=-50, finish_s=500.0),
                start(3, priority=HIGH),
                start(4, priority=LOW, planned_s=-900),
            ],
            ROBOTS,
            [3, 2, 1, None],
            id="by priority, then by the time to be done, then by waiting",
        ),
        pytest.param(
            [start(number) for number in (1, 2, 3)],
            (failed(AINO), SISU, VEIKKO),
            [2, 3, 1],
            id="after one failure no start waits for a robot that has just begun",
        ),
        pytest.param(
            [start(1)], (failed(AINO, 2), failed(SISU, 1)), [2], id="of failed robots the one that failed least"
        ),
        pytest.param(
            [start(1, at_once=True, members=(1, 2))],
            (busy(AINO, 900.0), busy(SISU, 200.0)),
            [2],
            id="a group that hands over at once waits for no free robot",
        ),
    ],
)
def test_who_gets_which(starts, robots, found):
    assert assigned(*starts, robots=robots) == dict(enumerate(found, 1))


# ---------------------------------------------------------------------- who can't
@pytest.mark.parametrize(
    ("robot", "why"),
    [
        (replace(AINO, ineligible=Ineligible.SILENT), Ineligible.SILENT),
        (replace(AINO, battery=None), Ineligible.LOW_BATTERY),
        (replace(AINO, battery=19.9), Ineligible.LOW_BATTERY),
    ],
)
def test_a_robot_that_cannot_is_passed_by_and_it_is_said_why(robot, why):
    [decision] = choose(situation(start(minimum_battery=20.0), robots=(robot, replace(SISU, battery=80.0))))
    assert (decision.robot_id, list(decision.ineligible)) == (SISU.id, [(AINO.id, why)])


def test_a_robot_keeps_a_reserve_of_battery_at_the_end_of_the_run():
    """Half an hour at 10 % an hour uses 5 %."""
    robots = (replace(AINO, battery=RESERVE + 4.9), replace(SISU, battery=RESERVE + 5.1))
    [decision] = choose(situation(start(), robots=robots, duration=lambda *_args, slow=False: 1800.0))
    assert (decision.robot_id, list(decision.ineligible)) == (SISU.id, [(AINO.id, Ineligible.TOO_LITTLE_BATTERY)])


def test_a_robot_that_lacks_the_mission_or_has_refused_it_is_passed_by():
    [decision] = choose(
        situation(
            start(tried={2: Ineligible.TRIED}),
            duration=lambda robot_id, mission, slow=False: 300.0 if robot_id > 1 else None,
        )
    )
    assert (decision.robot_id, list(decision.ineligible)) == (
        VEIKKO.id,
        [(1, Ineligible.LACKS_MISSION), (2, Ineligible.TRIED)],
    )


def test_the_battery_at_the_end_of_a_run_is_estimated():
    enough = replace(AINO, battery=RESERVE + 10 * 300 / 3600)
    assert assigned(replace(start(), members=(1,)), robots=(enough,)) == {1: 1}
    assert assigned(replace(start(), members=(1,)), robots=(replace(enough, battery=enough.battery - 0.01),)) == {
        1: None
    }


# ---------------------------------------------------------------------- when
def test_before_its_window_closes_a_start_is_queued_at_the_robot_free_first():
    robots = (busy(AINO, 900.0), busy(SISU, 200.0))
    two = replace(start(), members=(1, 2))
    assert assigned(replace(two, closes_s=LAST_CALL + 0.1), robots=robots) == {1: None}
    [decision] = choose(situation(replace(two, closes_s=LAST_CALL), robots=robots))
    assert (decision.robot_id, decision.is_last_call) == (SISU.id, True)


def test_a_start_that_cannot_finish_in_time_is_not_begun():
    [decision] = choose(situation(start(finish_s=299.0)))
    assert (decision.robot_id, decision.too_late) == (None, True)
    assert assigned(start(finish_s=300.0)) == {1: 1}


def test_robots_are_kept_free_for_what_matters_more():
    assert assigned(start(1, keep_free=1), start(2, keep_free=1), start(3, keep_free=1)) == {1: 1, 2: 2, 3: None}
    assert assigned(start(1, keep_free=3, priority=HIGH)) == {1: 1}


# ---------------------------------------------------------------------- looking ahead
def planned_start(seconds: float, members=ALL, priority: int = CRITICAL, *, is_fixed: bool = False) -> PlannedStart:
    return PlannedStart("Shift bus", members, seconds, 300.0, priority, is_fixed)


def test_in_a_group_of_one_robot_an_equal_start_later_keeps_it_from_nothing():
    def long_ones(_robot_id, _mission, *, slow=False):
        return 600.0 if slow else 300.0

    alone = replace(start(), members=(1,))
    for is_fixed, robot_id in ((False, AINO.id), (True, None)):
        later = planned_start(120.0, (1,), alone.priority, is_fixed=is_fixed)
        assert assigned(alone, robots=(AINO,), duration=long_ones, planned=[later]) == {1: robot_id}


def test_the_last_free_robot_is_kept_for_what_matters_more():
    """The shift bus at 06:55 must not wait because a low one took the last robot at 06:53."""
    robots = (AINO, busy(SISU, 1800.0), busy(VEIKKO, 1800.0))
    [decision] = choose(situation(start(priority=LOW), robots=robots, planned=[planned_start(120.0)]))
    assert (decision.robot_id, decision.waits_for_planned) == (None, planned_start(120.0))
    assert assigned(start(priority=LOW), robots=robots, planned=[planned_start(500.0)]) == {1: AINO.id}  # done before
    assert assigned(start(priority=CRITICAL), robots=robots, planned=[planned_start(120.0)]) == {
        1: AINO.id
    }  # no less important
    assert assigned(start(priority=LOW, closes_s=1.0), robots=robots, planned=[planned_start(120.0)]) == {1: AINO.id}


def test_delays_are_counted_again_after_a_start_has_its_place():
    """With those of the first, which waits, the third would not have been kept from Veikko."""
    starts = [start(n, priority=LOW, members=ids) for n, ids in ((1, (2, 3)), (2, (1,)), (3, (3,)))]
    robots, planned = (busy(AINO, 120.0), SISU, VEIKKO), [planned_start(at) for at in (60.0, 300.0, 300.0)]
    assert assigned(*starts, robots=robots, planned=planned) == {1: None, 2: None, 3: None}


def test_a_fixed_start_is_protected_whatever_its_priority():
    two = replace(start(priority=HIGH), members=(1, 2))
    assert assigned(two, robots=(AINO, SISU), planned=[planned_start(60.0, (AINO.id,), LOW, is_fixed=True)]) == {
        1: SISU.id
    }


def test_delay_leaves_the_robot_that_is_free_last_in_time_to_what_comes():
    free = {1: 0.0, 2: 100.0, 3: 500.0}
    assert delay([planned_start(120.0), planned_start(120.0)], free) == 0.0
    assert delay([planned_start(120.0)] * 3, free) == weight(CRITICAL) * 300.0
    assert delay([planned_start(120.0, (3,), NORMAL, is_fixed=True)], free) == 380.0


# ---------------------------------------------------------------------- estimates
def test_the_remaining_time_comes_from_longer_runs():
    known = DurationEstimate(200.0, 300.0, (100.0, 200.0, 300.0))
    assert [remaining_duration(known, elapsed) for elapsed in (0.0, 150.0, 250.0, 400.0)] == [200.0, 100.0, 50.0, 30.0]
    assert remaining_duration(DurationEstimate(600.0, 600.0, typed=True), 200.0) == 400.0
    assert (remaining_duration(None, 100.0), remaining_duration(None, 1e6)) == (200.0, 45.0)


def test_a_few_runs_of_one_robot_say_less_than_those_of_its_group():
    own, group = DurationEstimate(100.0, 100.0, (100.0,) * 2), DurationEstimate(250.0, 280.0, (250.0,) * 9)
    typed = DurationEstimate(60.0, 60.0, typed=True)
    assert (
        run_duration(own, group),
        run_duration(own, group, slow=True),
        run_duration(own, None),
        run_duration(None, None),
    ) == (
        250.0,
        280.0,
        100.0,
        UNKNOWN_S,
    )
    assert run_duration(typed, group) == 60.0


def test_a_farther_way_than_that_of_the_other_robots_takes_longer():
    known = DurationEstimate(100.0, 130.0, (100.0,) * 5)
    assert (run_duration(known, None, 40.0), run_duration(known, None, 40.0, slow=True)) == (160.0, 190.0)
    assert (run_duration(known, None, -20.0), run_duration(known, None, -900.0)) == (70.0, SHORTEST_S)
    assert run_duration(None, None, 40.0) == UNKNOWN_S + 60.0


# ---------------------------------------------------------------------- any situation
members = st.builds(
    Member,
    st.integers(1, 4),
    st.sampled_from("ABCD"),
    st.booleans(),
    st.floats(0, 900),
    st.none() | st.floats(0, 100),
    st.floats(0, 12),
    st.none() | st.sampled_from(Ineligible),
)
starts = st.builds(
    Start,
    st.integers(1, 30),
    st.just("Deliver"),
    st.sets(st.integers(1, 4), min_size=1).map(tuple),
    st.integers(-3, 5),
    st.floats(-900, 0),
    st.floats(0, 900),
    st.none() | st.floats(-60, 900),
    st.none() | st.floats(0, 100),
    st.dictionaries(st.integers(1, 4), st.sampled_from(Ineligible)),
    st.integers(0, 3),
)
comings = st.builds(
    PlannedStart,
    st.just("Bus"),
    st.sets(st.integers(1, 4), min_size=1).map(tuple),
    st.floats(0, 600),
    st.floats(20, 600),
    st.integers(-1, 2),
)


@given(
    st.lists(members, min_size=4, max_size=4),
    st.lists(starts, max_size=8, unique_by=lambda s: s.id),
    st.lists(comings, max_size=5),
)
def test_only_who_can_gets_a_start_and_a_free_robot_at_most_one(robots, waiting, later):
    robots = [
        replace(robot, id=number, free_s=0.0 if robot.is_free else robot.free_s)
        for number, robot in enumerate(robots, 1)
    ]
    found = choose(situation(*waiting, robots=robots, planned=sorted(later, key=lambda each: each.planned_s)))
    assert sorted(decision.start.id for decision in found) == sorted(each.id for each in waiting)
    by_id = {robot.id: robot for robot in robots}
    given_now = [decision for decision in found if decision.robot_id is not None]
    for decision in given_now:
        robot, wanted = by_id[decision.robot_id], decision.start
        assert robot.id in wanted.members
        assert robot.id not in wanted.tried
        assert robot.ineligible is None
        assert wanted.minimum_battery is None or robot.battery >= wanted.minimum_battery
        assert robot.is_free or decision.is_last_call
    usual = [decision.robot_id for decision in given_now if not decision.is_last_call]
    assert len(usual) == len(set(usual))
    assert found == choose(situation(*waiting, robots=robots, planned=sorted(later, key=lambda each: each.planned_s)))


@pytest.mark.parametrize("elsewhere", [(), (PlannedStart("Elsewhere", (9,), 1.0, 300.0, CRITICAL, is_fixed=True),)])
def test_starts_planned_for_other_robots_reserve_none_of_these(elsewhere):
    """The reason says for which start a robot is kept."""
    own = PlannedStart("Own", (AINO.id,), 20.0, 300.0, NORMAL, is_fixed=True)
    [decision] = choose(
        situation(start(members=(AINO.id,)), robots=(AINO, Member(9, "Zed")), planned=(*elsewhere, own))
    )
    assert (decision.robot_id, decision.waits_for_planned) == (None, own)
