"""Fleet Enterprise forgets orders that have ended, soon or when it likes: a start that it may have had is not sent again."""

from __future__ import annotations

from dataclasses import replace

import pytest

from app.database.backups import back_up, restore
from app.domain.execution import ReasonCode, State, Trigger
from app.domain.reasons import sentence
from mir_sim.fleets.enterprise import EnterpriseFleet
from mir_sim.fleets.enterprise_orders import Origin
from tests.support.network import Fate
from tests.support.site import FLEET, GUIDS, Site

UNKNOWN = (State.FAILED, ReasonCode.UNKNOWN_OUTCOME)


@pytest.mark.parametrize(
    ("version", "kept", "away"), [("1.5.0", 60.0, 400.0), ("1.4.2", 60.0, 400.0), ("1.5.0", 120.0, 1200.0)]
)
def test_a_start_that_a_fleet_may_have_forgotten_is_not_sent_again(enterprise, version, kept, away):
    """Its answer was lost, and the fleet was away for longer than it shows orders that have ended."""
    site, robot = enterprise(version=version, ids_kept=kept, orders_kept=kept)
    site.plan_once(robot.id)
    site.network.next("POST", "/mission_queue", Fate.ANSWER_LOST)
    site.run_until(lambda: len(list(site.fleet.phases())) == 1)
    site.run(0.5)
    site.network.down.update([*site.machines, FLEET])
    site.run(away)
    site.fleet.catch_up()
    assert list(site.fleet.phases()) == []
    site.network.down.clear()
    site.run_until(lambda: site.the_row().attempts > 1 or not site.the_row().state.is_open)
    (row,) = site.executions()
    assert (row.state, row.reason.code) == UNKNOWN
    assert row.reason.details["problem"]["msgid"].endswith("the fleet may no longer show it")


@pytest.mark.parametrize(("kept", "runs"), [(60.0, 1), (None, 1)])
def test_a_run_that_a_fleet_has_forgotten_is_not_repeated_after_a_restore(enterprise, tmp_path, kept, runs):
    site, robot = enterprise(ids_kept=kept, orders_kept=kept)
    site.plan_once(robot.id)
    back_up(site.container.db.path, tmp_path / "before.db")
    site.run_until(lambda: site.executions() and not site.the_row().state.is_open)
    site.run(120)
    site.switch_off()
    restore(tmp_path / "before.db", site.container.db.path, site.clock.now())
    site.switch_on()
    site.run(1200)
    assert len(site.queue("R1")) == runs


def killed(enterprise, window, fate=None, after=0.5):
    """The app, some seconds after it has sent a start to a fleet with software before 1.5."""
    site, robot = enterprise(version="1.4.2")
    site.plan_once(robot.id, start_window_minutes=window)
    if fate is not None:
        site.network.next("POST", "/mission_queue", fate)
    site.run_until(lambda: site.executions() and site.the_row().attempts)
    site.run(after)
    site.switch_off(cleanly=False)
    return site


@pytest.mark.parametrize("window", [60, 600])
def test_what_ended_while_the_app_was_off_is_soon_given_up_where_it_can_not_be_found(enterprise, monkeypatch, window):
    """Nothing tells the app's orders from those of others."""
    monkeypatch.setattr(Site, "_own_key", None)
    site = killed(enterprise, window, Fate.ANSWER_LOST)
    site.clock.advance(300)
    site.switch_on()
    site.run(300)
    (row,) = site.executions()
    assert (row.state, row.reason.code, len(site.queue("R1"))) == (*UNKNOWN, 1)
    assert sentence(row.reason, "UTC").endswith(
        "does not show what became of it: whether an ended order is the app's can't be told"
    )
    assert not any(alarm.code == "not_a_robot" for alarm in site.container.alarms.open())


@pytest.mark.parametrize("off", [300, 7200])
@pytest.mark.parametrize(("fate", "after"), [(Fate.ANSWER_LOST, 0.5), (None, 0.5), (None, 5.0)])
def test_what_ended_while_the_app_was_off_is_found(enterprise, fate, after, off):
    site = killed(enterprise, 600, fate, after)
    site.clock.advance(off)
    site.switch_on()
    site.run(300)
    assert (site.the_row().state, len(site.queue("R1"))) == (State.COMPLETED, 1)


@pytest.mark.parametrize(("others", "state", "runs"), [(0, State.COMPLETED, 1), (2, State.FAILED, 0)])
def test_what_did_not_arrive_before_the_app_was_killed_is_sent_again_only_if_that_is_certain(
    enterprise, others, state, runs
):
    """Other orders of the app for the same mission and robot have ended since."""
    site = killed(enterprise, 600, Fate.LOST)
    for _ in range(others):
        order = site.fleet.order_of_somebody(GUIDS["Deliver"], site.fleet.vehicles[0])
        order.origin = Origin.of_key("Scheduler")
        site.clock.advance(100)
        site.fleet.catch_up()
    site.clock.advance(60)
    site.switch_on()
    site.run(400)
    assert (site.the_row().state, len(site.queue("R1")) - others) == (state, runs)


def test_another_start_of_the_same_mission_is_not_taken_for_one_that_did_not_arrive(enterprise):
    """Of software before 1.5. It was started a minute before, by a person, and ran."""
    site, robot = enterprise(version="1.4.2")
    site.plan_once(robot.id, start_window_minutes=600)
    site.container.operator.run_now(robot.id, 1)
    site.run_until(lambda: site.the_row().state is State.COMPLETED)
    site.network.next("POST", "/mission_queue", Fate.LOST)
    site.run_until(lambda: len(site.executions()) == 2 and all(row.attempts for row in site.executions()))
    site.run(0.5)
    site.power_cut(60)
    site.run(400)
    (lost,) = [row for row in site.executions() if row.trigger is Trigger.SCHEDULED]
    assert (lost.state, len(site.queue("R1"))) == (State.FAILED, 1)


@pytest.mark.parametrize(("kept", "state"), [(None, State.COMPLETED), (60.0, State.FAILED)])
def test_a_new_fleet_that_shows_an_earlier_order_would_show_a_later_one(enterprise, monkeypatch, kept, state):
    """No order had ended when it was checked up. The request for its second robot is lost, and then the link; the history has one row."""
    monkeypatch.setattr(Site, "_ended_shown_s", 0.0)
    site, first, second = enterprise(robots=2, ids_kept=kept, orders_kept=kept)
    site.container.catalogue.change_settings(history_limit=1)
    site.ended(site.container.operator.run_now(first.id, 1))
    site.run(200)
    site.network.next("POST", "/mission_queue", Fate.LOST)
    row = site.container.operator.run_now(second.id, 1)
    site.run_until(lambda: site.container.ledger.get(row.id).state is State.SUBMITTING)
    site.run(0.5)
    site.without_link(100)
    assert (site.ended(row).state, len(site.queue("R2"))) == (state, 1 if kept is None else 0)


def test_a_start_that_a_fleet_was_asked_for_all_the_time_and_has_not_shown_did_not_arrive(enterprise, monkeypatch):
    """The fleet's first one; it forgets orders soon."""
    monkeypatch.setattr(Site, "_ended_shown_s", 0.0)
    site, robot = enterprise(orders_kept=60.0)
    site.network.next("POST", "/mission_queue", Fate.LOST)
    assert (site.ended(site.container.operator.run_now(robot.id, 1)).state, len(site.queue("R1"))) == (
        State.COMPLETED,
        1,
    )


def lost_until_it_has_ended(site, robot, fate):
    site.network.next("POST", "/mission_queue", fate)
    row = site.container.operator.run_now(robot.id, 1)
    site.run_until(lambda: len(site.queue("R1")) == 1)
    site.without_link(120)
    return site.ended(row)


@pytest.mark.parametrize("version", ["1.5.0", "1.4.2"])
def test_a_start_that_a_fleet_refuses_as_one_that_it_has_is_not_sent_again_and_again(enterprise, version):
    """Its answer was lost, and then the link until it had ended. The fleet knows its id for longer than it shows it."""
    site, robot = enterprise(version=version)
    site.fleet.knobs = replace(site.fleet.knobs, orders_kept=20.0)
    row = lost_until_it_has_ended(site, robot, Fate.ANSWER_LOST)
    assert (row.state, row.reason.code, len(site.network.posts("R1"))) == (*UNKNOWN, 2)


@pytest.mark.parametrize("fate", [Fate.FINE, Fate.ANSWER_LOST])
def test_a_start_of_which_a_fleet_shows_only_that_it_had_it_has_an_unknown_outcome(enterprise, monkeypatch, fate):
    phase = EnterpriseFleet.phase

    def active_phase(fleet, id_):
        found = phase(fleet, id_)
        return found if found and found[0].ended is None else None

    monkeypatch.setattr(EnterpriseFleet, "phase", active_phase)
    site, robot = enterprise()
    row = lost_until_it_has_ended(site, robot, fate)
    assert (row.state, row.reason.code, len(site.queue("R1"))) == (*UNKNOWN, 1)


@pytest.mark.long
def test_the_age_of_a_start_after_a_kill_counts_from_its_attempt(enterprise):
    """It was held for more than an hour, and lost a moment before the app was killed."""
    site, robot = enterprise()
    site.plan_once(robot.id, start_window_minutes=600)
    site.container.holds.hold("a person")
    site.run(3900)
    site.container.holds.release()
    site.network.next("POST", "/mission_queue", Fate.LOST)
    site.run_until(lambda: site.the_row().state is State.SUBMITTING)
    site.run(0.5)
    site.power_cut(20)
    site.run(600)
    assert (site.the_row().state, len(site.queue("R1"))) == (State.COMPLETED, 1)


def test_a_start_is_as_old_as_its_request_though_the_tablet_slept_during_that(enterprise, monkeypatch):
    """Its answer was lost, and it has run in that time; the fleet has forgotten it."""
    monkeypatch.setattr(Site, "_ended_shown_s", 0.0)
    site, robot = enterprise(orders_kept=60.0, ids_kept=60.0)
    site.network.interrupt = lambda where: where == "after POST /mission_queue" and site.clock.advance(600.0)
    site.network.next("POST", "/mission_queue", Fate.ANSWER_LOST)
    row = site.ended(site.container.operator.run_now(robot.id, 1))
    assert (row.state, row.reason.code, len(site.queue("R1"))) == (*UNKNOWN, 1)
