"""Each row is followed by itself: one item that can't be read holds up no other, and every item that has ended ends its row (D7)."""

from __future__ import annotations

import pytest

from app.domain.models import Overlap, ReasonCode, State
from app.mir.errors import RobotError
from tests.support.network import Fate
from tests.support.seen import items, outcomes, reason, states


def spoil(site, how, item=1, robot="R1"):
    """From now on that item can't be read."""
    if how == "500":
        site.network.unreadable.add((robot, item))
    else:
        site.network.shown[(robot, item)] = {"state": None}


def about_the_item(site):
    """Alarms of something else than robots and executions in general."""
    return [(alarm.code, alarm.count) for alarm in site.container.alarms.open()]


@pytest.mark.parametrize(("how", "others"), [("500", 1), ("null", 1), ("500", 4), ("null", 4)])
def test_one_item_that_can_t_be_read_holds_up_no_other(site, plan, how, others):
    """The rows behind it are followed to their ends."""
    plan("2026-11-23T06:05", name="a spoilt", priority=9)
    for number in range(others):
        plan("2026-11-23T06:05", name=f"b {number}")
    site.run(310)
    spoil(site, how)
    site.run(120.0 * others + 300)
    assert states(site) == ["Done"] * (1 + others)
    assert [row.state for row in site.executions() if row.schedule != "a spoilt"] == [State.COMPLETED] * others


@pytest.mark.parametrize("how", ["500", "null"])
def test_an_item_that_can_t_be_read_is_told_once_and_ends_unknown_when_the_list_says_that_it_is_over(site, plan, how):
    """While it runs one alarm says that it can't be read; when the robot's list of open items has it no more, its outcome is unknown."""
    plan("2026-11-23T06:05")
    site.run(320)
    spoil(site, how)
    site.run(30)
    assert states(site) == ["Executing"]
    assert [row.state for row in site.executions()] == [State.EXECUTING]
    [(_code, count)] = about_the_item(site)
    assert count == 1
    site.run(600)
    assert states(site) == ["Done"]
    [row] = site.executions()
    assert (row.state, reason(row).code) == (State.FAILED, ReasonCode.UNKNOWN_OUTCOME)


@pytest.mark.parametrize("how", ["500", "null"])
def test_an_item_that_can_be_read_again_is_followed_on(site, plan, how):
    """What a robot says again is believed again."""
    plan("2026-11-23T06:05")
    site.run(320)
    spoil(site, how)
    site.run(30)
    site.network.unreadable.clear()
    site.network.shown.clear()
    site.run(300)
    assert outcomes(site) == [(State.COMPLETED, None, 1)]


@pytest.mark.parametrize("how", ["500", "null"])
def test_a_stranger_s_item_that_can_t_be_read_stops_nothing(site, plan, how):
    """Neither dispatch nor idle automation nor tracking depends on other people's items."""
    schedule = plan("2026-11-23T06:05")
    site.container.catalogue.save_idle_rule(schedule.robot_id, schedule.mission_id, after_minutes=5)
    site.run(280)
    site.stranger_queues("Deliver")
    spoil(site, how)
    site.run(1220)
    assert [row.state for row in site.executions()] == [State.COMPLETED] * 2


@pytest.mark.parametrize("how", ["500", "null"])
def test_an_unknown_outcome_is_found_beside_a_stranger_s_item_that_can_t_be_read(site, plan, how):
    """Our token is found among items of which one makes no sense."""
    plan("2026-11-23T06:05")
    site.network.next("POST", "/mission_queue", Fate.ANSWER_LOST)
    site.run(300.1)
    spoil(site, how, item=site.stranger_queues("Deliver"))
    site.run(600)
    assert outcomes(site) == [(State.COMPLETED, None, 1)]


@pytest.mark.parametrize("word", ["Done", "Aborted"])
def test_an_item_that_has_ended_with_an_unknown_word_ends_its_row_with_that_word(site, plan, word):
    """Newer software may have words of its own: what has ended is over, and the reason says how in the robot's word."""
    site.network.words[word] = "Superseded"
    plan("2026-11-23T06:05")
    site.run(320)
    if word == "Aborted":
        site.machines["R1"].controller.cancel(items(site)[0])
    site.run(400)
    [row] = site.executions()
    assert (row.state, reason(row).code) == (State.FAILED, ReasonCode.ROBOT_ABORTED)
    assert "Superseded" in str(dict(reason(row).details))


def test_an_unknown_word_of_an_item_that_goes_on_ends_nothing(site, plan):
    """Only what has ended is over."""
    site.network.words["Executing"] = "Negotiating"
    plan("2026-11-23T06:05")
    site.run(350)
    assert states(site) == ["Executing"]
    assert [row.state.is_open for row in site.executions()] == [True]
    site.run(300)
    assert outcomes(site) == [(State.COMPLETED, None, 1)]


def test_an_item_that_can_t_be_read_does_not_keep_its_robot_from_new_starts(site, plan):
    """The next start of the same schedule goes out."""
    plan("2026-11-23T06:05", "FREQ=MINUTELY;INTERVAL=10", overlap=Overlap.QUEUE)
    site.run(310)
    spoil(site, "500")
    site.run(650)
    assert states(site) == ["Done", "Executing"]


@pytest.mark.parametrize("by", ["run", "item"])
def test_what_the_robot_refused_to_cancel_is_not_cancelled_later(site, plan, by):
    """A person was told so."""
    for _n in range(2):
        plan("2026-11-23T06:05", start_window_minutes=60)
    site.run(304)
    row = site.executions()[1]
    assert row.state is State.QUEUED
    site.network.next("DELETE", f"/mission_queue/{row.queue_id}", Fate.NOT_FOUND)
    operator = site.container.operator
    with pytest.raises(RobotError):
        operator.cancel_execution(row.id) if by == "run" else operator.cancel_item(row.robot_id, row.queue_id)
    site.run(600)
    assert [row.state for row in site.executions()] == [State.COMPLETED] * 2, (outcomes(site), len(items(site)))
