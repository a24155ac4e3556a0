"""What a person presses twice, or too late: a start is run on another robot once, and only what was seen is skipped."""

from __future__ import annotations

from dataclasses import replace
from datetime import datetime

import pytest

from app.domain import choice
from app.domain.models import InvalidInput, ReasonCode, Schedule, State
from app.domain.reasons import sentence, waiting_sentence
from app.services.dispatch.ledger import Ledger
from tests.support.network import Fate
from tests.support.seen import outcomes

AT = "2026-11-23T06:05"
LONG = {"start_window_minutes": 60}


def next_of(site, schedule: Schedule) -> datetime:
    return site.container.repositories.schedules.get(site.container.db.read(), schedule.id).next_at


# ---------------------------------------------------------------------- started on another robot
def it_is_at_a_robot_that_fell_silent(hall) -> str:
    """A start is on a robot, which nobody knows: its answer was lost, and it does not answer any more. Returns the robot's name."""
    hall.plan(start_window_minutes=10)
    hall.network.next("POST", "/mission_queue", Fate.ANSWER_LOST)
    hall.run(300)
    first: str = hall.run_of().robot
    hall.network.down.add(first)
    hall.run(20)
    return first


def in_doubt_at_a_silent_robot(hall):
    """That never had it."""
    hall.plan(**LONG)
    hall.network.next("POST", "/mission_queue", Fate.LOST)
    hall.run(302)
    hall.network.down.add(hall.run_of().robot)
    hall.run(8)
    row = hall.run_of()
    assert row.state is State.SUBMITTING
    return row


@pytest.mark.parametrize("then", ["soon", "when it is given up", "when the app was started again"])
def test_what_was_started_on_another_robot_is_not_once_more(hall, then):
    row = in_doubt_at_a_silent_robot(hall)
    hall.container.operator.start_on_another(row.id, None, "pressed")
    hall.run(30)
    if then == "when it is given up":
        hall.run(3700)
        assert hall.run_of().reason.code is ReasonCode.UNKNOWN_OUTCOME
    elif then == "when the app was started again":
        hall.switch_off(cleanly=False)
        hall.switch_on()
    assert hall.container.operator.start_on_another(row.id, None, "pressed").token == "pressed", (
        "the same press, arrived twice"
    )
    with pytest.raises(InvalidInput, match="started on another robot already"):
        hall.container.operator.start_on_another(row.id, None)
    hall.run(600)
    assert len(hall.items()) == 1, outcomes(hall)


def test_the_history_knows_what_was_started_instead_of_what(hall):
    row = in_doubt_at_a_silent_robot(hall)
    history = hall.container.history
    assert history.elsewhere([row]) == {}
    hall.container.operator.start_on_another(row.id, None, "pressed")
    hall.run(30)
    other = hall.container.ledger.by_token("pressed")
    (found,) = set(history.elsewhere([row]).values())
    assert (found.id, found.robot, found.other, found.other_robot) == (row.id, row.robot, other.id, other.robot)
    assert history.elsewhere([other])[other.id] == found, "also where the list holds only one of them"


def test_nor_when_its_outcome_is_unknown_for_good(hall):
    row = in_doubt_at_a_silent_robot(hall)
    hall.run(3700)
    assert hall.run_of().reason.code is ReasonCode.UNKNOWN_OUTCOME
    hall.container.operator.start_on_another(row.id, None)
    with pytest.raises(InvalidInput, match="started on another robot already"):
        hall.container.operator.start_on_another(row.id, None)


def test_two_presses_at_once_start_it_once(hall, monkeypatch):
    """The second one has read the row before the first one wrote."""
    row, add = in_doubt_at_a_silent_robot(hall), Ledger.add

    def after_another(ledger, *args):
        monkeypatch.setattr(Ledger, "add", add)
        hall.container.operator.start_on_another(row.id, None)
        return add(ledger, *args)

    monkeypatch.setattr(Ledger, "add", after_another)
    with pytest.raises(InvalidInput, match="started on another robot already"):
        hall.container.operator.start_on_another(row.id, None)
    hall.run(30)
    assert len(hall.items()) == 1, outcomes(hall)


@pytest.mark.parametrize(
    ("how", "why"),
    [
        (
            lambda hall, schedule: hall.container.catalogue.set_schedule_enabled(schedule.id, False),
            "changed, switched off or deleted",
        ),
        (
            lambda hall, schedule: hall.container.pausing.pause(
                schedule.id, datetime.fromisoformat("2026-11-25T00:00+00:00")
            ),
            "paused since",
        ),
    ],
)
def test_what_is_not_wanted_any_more_is_not_started_on_another_robot(hall, how, why):
    row = in_doubt_at_a_silent_robot(hall)
    how(hall, hall.container.catalogue.schedules()[0])
    with pytest.raises(InvalidInput, match=why):
        hall.container.operator.start_on_another(row.id, None)
    assert len(hall.executions()) == 1


def test_of_what_was_started_on_another_robot_it_is_said_that_it_is_not_sent_again(hall):
    row = in_doubt_at_a_silent_robot(hall)
    hall.run(30)
    snapshot = hall.container.snapshots.get(row.robot_id)
    assert choice.stuck_since(row, snapshot) is not None
    hall.container.operator.start_on_another(row.id, None)
    row = hall.container.ledger.get(row.id)
    assert choice.stuck_since(row, snapshot) is None
    assert waiting_sentence(row) == "Not sent again; the robot is asked whether it has it"


def test_nor_is_it_sent_again_when_its_robot_was_deleted_and_is_put_back(hall):
    row = in_doubt_at_a_silent_robot(hall)
    hall.container.operator.start_on_another(row.id, None)
    hall.run(30)
    removed = hall.container.catalogue.remove_robot(row.robot_id)
    hall.run(5)
    hall.network.down.clear()
    hall.container.catalogue.restore(removed)
    hall.run(900)
    assert len(hall.items()) == 1, outcomes(hall)


@pytest.mark.parametrize("how", ["off", "out of the group"])
def test_any_other_robot_of_which_none_is_left_says_so(hall, how):
    row = in_doubt_at_a_silent_robot(hall)
    others = [name for name in hall.machines if name != row.robot]
    for name in others:
        hall.hold(name)
    new = hall.container.operator.start_on_another(row.id, None)
    hall.run(10)
    if how == "off":
        for name in others:
            hall.switch(name, on=False)
    else:
        hall.container.catalogue.save_group(replace(hall.group, members=(row.robot_id,)))
    hall.run(30)
    new = hall.container.ledger.get(new.id)
    assert (new.state, sentence(new.reason, "UTC")) == (State.CANCELLED, "No other robot of Hall is switched on")


@pytest.mark.parametrize("own", [True, False])
def test_started_on_another_while_the_connection_of_its_next_try_is_made(hall, own):
    """The quiet time is over and it is tried again (by R1, or of a group by R2), as a person who has the dialog open agrees: that try is
    not sent."""
    hall.plan(**(LONG | ({"robot_id": hall.robot("R1").id, "group_id": None} if own else {})))
    hall.network.next("POST", "/mission_queue", Fate.LOST)
    hall.run(310)
    row = hall.run_of()
    assert row.state is State.SUBMITTING
    pressed = []

    def press(_robot, met):
        if met.method == "POST" and not pressed:
            now = hall.run_of()
            target = next(hall.robot(n) for n in ("R3", "R2") if n not in (row.robot, now.robot))
            pressed.append(hall.container.operator.start_on_another(row.id, target.id))

    hall.network.next("POST", "/mission_queue", Fate.SLOW, 0.1)
    hall.network.met = press
    hall.run(600)
    assert pressed
    assert len(hall.items()) == 1, outcomes(hall)


@pytest.mark.parametrize("what", ["cancelled before it was sent", "refused"])
def test_where_that_came_to_nothing_it_may_be_started_on_a_third_one(hall, what):
    row = in_doubt_at_a_silent_robot(hall)
    second, third = (hall.robot(name) for name in hall.machines if name != row.robot)
    if what == "refused":
        hall.lose_mission(second.name)
    else:
        hall.hold(second.name)
    new = hall.container.operator.start_on_another(row.id, second.id)
    hall.run(5)
    if what != "refused":
        hall.container.operator.cancel_execution(new.id)
    hall.run(60)
    assert hall.items() == []
    hall.container.operator.start_on_another(row.id, third.id)
    with pytest.raises(InvalidInput):
        hall.container.operator.start_on_another(row.id, second.id)
    hall.run(60)
    assert len(hall.items()) == 1


@pytest.mark.parametrize("given_up", [False, True])
def test_a_robot_that_has_it_after_all_is_an_alarm_that_names_both(hall, given_up):
    """It runs twice, as was said before: nobody has to find that out by himself."""
    first = it_is_at_a_robot_that_fell_silent(hall)
    new = hall.container.operator.start_on_another(hall.run_of().id, None)
    hall.run(900 if given_up else 30)
    assert (hall.run_of().state is State.FAILED) is given_up
    assert "started_twice" not in hall.alarms()
    hall.network.down.clear()
    hall.run(120)
    (told,) = (alarm for alarm in hall.container.alarms.open() if alarm.code == "started_twice")
    assert (told.details["robot"], told.details["other"]) == (first, hall.container.ledger.get(new.id).robot)


# ---------------------------------------------------------------------- skip
def test_skip_skips_the_start_that_was_seen_though_an_earlier_one_is_there_by_now(site, plan):
    schedule = plan(AT, "FREQ=HOURLY")
    pausing = site.container.pausing
    first = pausing.skip_next(schedule.id, schedule.next_at)
    seen = next_of(site, schedule)
    pausing.unskip(schedule.id, first)
    assert pausing.skip_next(schedule.id, seen) == seen
    assert next_of(site, schedule) == first
    with pytest.raises(InvalidInput, match="skipped already"):
        pausing.skip_next(schedule.id, seen)


@pytest.mark.parametrize("moved", ["2026-11-23T06:02", "2026-11-23T06:20"])
def test_skip_of_what_was_seen_skips_nothing_where_that_is_not_planned_any_more(site, plan, moved):
    schedule = plan(AT, "FREQ=HOURLY")
    site.container.catalogue.save_schedule(replace(schedule, start=datetime.fromisoformat(moved)))
    with pytest.raises(InvalidInput, match="no such start any more"):
        site.container.pausing.skip_next(schedule.id, schedule.next_at)


@pytest.mark.parametrize("rule", [None, "FREQ=HOURLY"])
def test_skip_pressed_twice_says_that_it_is_skipped(site, plan, rule):
    schedule = plan(AT, rule)
    site.container.pausing.skip_next(schedule.id, schedule.next_at)
    with pytest.raises(InvalidInput, match="skipped already"):
        site.container.pausing.skip_next(schedule.id, schedule.next_at)
