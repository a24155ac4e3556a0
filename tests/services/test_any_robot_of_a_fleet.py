"""A start for any robot of a fleet says which robot the fleet chose for it."""

from __future__ import annotations

import csv
import io
import math
from dataclasses import replace
from datetime import timedelta
from types import SimpleNamespace

import pytest

from app.database.backups import back_up, restore
from app.database.fleets import FleetRepository
from app.database.robots import Accepted, RobotRepository
from app.domain.capabilities import OF_A_ROBOT
from app.domain.check_up import RobotProfile
from app.domain.execution import ReasonCode, State, Trigger, Wait
from app.domain.models import ANY_VEHICLE, Fleet, Group, Robot, Schedule
from app.domain.reasons import sentence, waiting_sentence
from app.domain.robot import RobotStatus
from app.mir.classic_vehicle import OF_A_VEHICLE, ClassicVehicle
from app.services.dispatch.duplicates import Duplicates
from app.services.dispatch.own_items import OwnItems
from app.services.files.history_export import write_history
from mir_sim.fleets.classic_orders import Shown
from mir_sim.fleets.enterprise import EnterpriseFleet
from mir_sim.fleets.enterprise_orders import Origin
from mir_sim.fleets.orders import OrderState
from mir_sim.site import DISTRIBUTOR
from tests.support.network import Fate
from tests.support.site import FLEET, GUIDS, USER, Site


@pytest.fixture
def site(tmp_path):
    site = Site(tmp_path, target="classic")
    site.hall = site.add_fleet()
    site.add_mission()
    yield site
    site.switch_off()


def add(site, vehicle):
    return site.container.catalogue.save_robot(Robot("Any of Hall", "", fleet=site.hall, vehicle=vehicle))


def planned(site, robot, window=60):
    """In two minutes."""
    start = (site.clock.now() + timedelta(minutes=2)).replace(tzinfo=None, second=0, microsecond=0)
    own = {"respect_working_days": False, "start_window_minutes": window}
    new = Schedule("S", robot_id=robot.id, mission_id=1, start=start, timezone="UTC", **own)
    site.container.catalogue.save_schedule(new)


def forget_identity(site):
    """As if the app had only ever known it by a user that all fleets have."""
    users = site.fleet.site.table("/users")
    row = next(row for row in users if row["username"] == USER)
    users.remove(row["guid"])
    users.add({**row, "guid": DISTRIBUTOR})
    site.hall = replace(site.hall, identity=None, profile=RobotProfile(None, None, token_field="description"))
    site.container.db.write(lambda c: FleetRepository().update(c, site.hall))


def run_one(site, vehicle):
    robot = add(site, vehicle)
    site.run(10)
    site.container.operator.run_now(robot.id, 1)
    site.run_until(lambda: [row.state for row in site.executions()] == [State.COMPLETED])
    return site.executions()[0]


def test_the_robot_that_has_it_is_written_once(site, monkeypatch):
    ask, names = ClassicVehicle.queue_item, iter(["R1"])

    def with_other_names(self, queue_id, token=""):
        item = ask(self, queue_id, token)
        return replace(item, vehicle_name=next(names, "R2")) if item.vehicle else item

    monkeypatch.setattr(ClassicVehicle, "queue_item", with_other_names)
    row = run_one(site, ANY_VEHICLE)
    assert (row.taken_by, row.ran_on) == ("R1", "Any of Hall (R1)")
    file = io.StringIO(newline="")
    write_history(site.container.db.read(), file)
    (cells,) = csv.DictReader(io.StringIO(file.getvalue()))
    assert (cells["robot"], cells["taken_by"]) == ("Any of Hall", "R1")


def test_a_robot_that_was_named_needs_no_other_name(site):
    row = run_one(site, site._vehicle_ids["R1"])
    assert (row.taken_by, row.ran_on) == ("", "Any of Hall")


@pytest.mark.parametrize("vehicle", [ANY_VEHICLE, "1"])
@pytest.mark.parametrize("of_group", [False, pytest.param(True, marks=pytest.mark.long)])
def test_the_fleet_looks_after_the_batteries_of_those_it_chooses(site, vehicle, of_group):
    robot, save = add(site, vehicle), site.container.catalogue
    site.machines["R1"].set_battery(20.0)
    target = {"group_id": save.save_group(Group("G", (robot.id,))).id} if of_group else {"robot_id": robot.id}
    start = (site.clock.now() + timedelta(minutes=1)).replace(tzinfo=None, second=0, microsecond=0)
    plan = Schedule("S", None, 1, start, "UTC", minimum_battery_percent=50.0, respect_working_days=False)
    save.save_schedule(replace(plan, **target))
    site.run(90)
    (row,) = site.executions()
    assert (row.state is not State.WAITING) is (vehicle == ANY_VEHICLE)


def test_what_a_named_robot_has_is_not_cancelled_though_its_robot_is_not_shown_yet(site, monkeypatch):
    full = Shown.full
    monkeypatch.setattr(Shown, "full", lambda self: full(self) | {"robot_id": 0})
    monkeypatch.setattr(site.fleet.book, "_assign", lambda *_args, **_options: None)  # it lets orders wait
    add(site, ANY_VEHICLE)
    save = site.container.catalogue
    named = save.save_robot(Robot("Named", "", fleet=site.hall, vehicle=site._vehicle_ids["R1"]))
    group = save.save_group(Group("G", (named.id,)))
    start = (site.clock.now() + timedelta(minutes=1)).replace(tzinfo=None, second=0, microsecond=0)
    plan = Schedule("S", None, 1, start, "UTC", respect_working_days=False, group_id=group.id)
    save.save_schedule(plan)
    site.run_until(lambda: [row.state for row in site.executions()] == [State.QUEUED])
    site.run(60)
    assert [row.state for row in site.executions()] == [State.QUEUED]
    assert [order.state for order in site.fleet.book.open] == [OrderState.WAITING]


@pytest.mark.parametrize(
    ("of_fleet", "newest_known", "floor", "is_answer"),
    [(True, 5000, 4000, True), (True, None, 8000, False), (False, None, 8000, True)],
    ids=["since the last known order", "no order is known", "a robot by itself"],
)
def test_after_a_restore_a_fleet_is_searched_down_to_what_the_backup_knows(of_fleet, newest_known, floor, is_answer):
    """It may have got thousands of orders since."""
    searched, answered = [], []
    client = SimpleNamespace(
        capabilities=OF_A_VEHICLE if of_fleet else OF_A_ROBOT,
        status=RobotStatus,
        highest_queue_id=lambda: 9000,
        items_after=lambda floor, *_args, **_options: searched.append(floor) or [],
    )
    fleet = Fleet("Hall", "http://hall") if of_fleet else None
    context = SimpleNamespace(
        ledger=None,
        clock=SimpleNamespace(monotonic=lambda: 7.0),
        db=SimpleNamespace(read=lambda: None),
        robots=SimpleNamespace(
            last_accepted=lambda *_args: None,
            last_of_each=lambda *_args: [Accepted(newest_known, "")] if newest_known else [],
        ),
        restored_starts=SimpleNamespace(
            wants=lambda _robot: True,
            sought=frozenset,
            answer=lambda _robot, asked_at, _items, _tokens=None: answered.append(asked_at),
        ),
    )
    OwnItems(client, context, SimpleNamespace(robot=Robot("Aino", "", fleet=fleet, vehicle="1"))).answer()
    assert (searched, answered) == ([floor], [7.0 if is_answer else -math.inf])


def test_the_last_orders_of_a_fleet_are_those_of_all_its_robots(site):
    robots, repository, db = site.container.catalogue, RobotRepository(), site.container.db
    named = robots.save_robot(Robot("Named", "", fleet=site.hall, vehicle="1"))
    either = add(site, ANY_VEHICLE)
    direct = robots.save_robot(Robot("Direct", "http://10.0.0.2"))
    for number, robot in ((12, named), (5, either), (20, direct)):
        db.write(lambda c, robot=robot, number=number: repository.note_accepted(c, robot.id, Accepted(number, "token")))
    found = {
        each: [last.queue_id for last in repository.last_of_each(db.read(), each.id)]
        for each in (named, either, direct)
    }
    assert list(found.values()) == [[12, 5], [5, 12], [20]]


@pytest.mark.parametrize(
    ("version", "kept", "away"), [("1.5.0", 60.0, 400.0), ("1.4.2", 60.0, 400.0), ("1.5.0", 120.0, 1200.0)]
)
def test_a_start_that_a_fleet_may_have_forgotten_is_not_sent_again(tmp_path, version, kept, away):
    """Its answer was lost, and the fleet was away for longer than it shows orders that have ended."""
    site = Site(tmp_path, target="enterprise")
    site.fleet.knobs = replace(site.fleet.knobs, version=version, ids_kept=kept, orders_kept=kept)
    (robot,) = site.add_robots()
    site.add_mission()
    site.run(10)
    planned(site, robot)
    site.network.next("POST", "/mission_queue", Fate.ANSWER_LOST)
    site.run_until(lambda: len(list(site.fleet.phases())) == 1)
    site.run(0.5)
    site.network.down.update([*site.machines, FLEET])
    site.run(away)
    site.fleet.catch_up()
    assert list(site.fleet.phases()) == []
    site.network.down.clear()
    site.run_until(lambda: site.executions()[0].attempts > 1 or not site.executions()[0].state.is_open)
    (row,) = site.executions()
    assert (row.state, row.reason.code) == (State.FAILED, ReasonCode.UNKNOWN_OUTCOME)
    assert row.reason.details["problem"]["msgid"].endswith("the fleet may no longer show it")
    site.switch_off()


@pytest.mark.parametrize(("kept", "runs"), [(60.0, 1), (None, 1)])
def test_a_run_that_a_fleet_has_forgotten_is_not_repeated_after_a_restore(tmp_path, kept, runs):
    site = Site(tmp_path, target="enterprise")
    site.fleet.knobs = replace(site.fleet.knobs, ids_kept=kept, orders_kept=kept)
    (robot,) = site.add_robots()
    site.add_mission()
    site.run(10)
    planned(site, robot)
    back_up(site.container.db.path, tmp_path / "before.db")
    site.run_until(lambda: site.executions() and not site.executions()[0].state.is_open)
    site.run(120)
    site.switch_off()
    restore(tmp_path / "before.db", site.container.db.path, site.clock.now())
    site.switch_on()
    site.run(1200)
    assert len(site.queue("R1")) == runs
    site.switch_off()


@pytest.mark.parametrize(("identity", "is_certain"), [("a user", True), (None, False)])
def test_a_start_in_doubt_is_not_repeated_at_a_fleet_that_may_be_another_one(identity, is_certain):
    client = SimpleNamespace(capabilities=OF_A_VEHICLE)
    context = SimpleNamespace(
        ledger=None,
        clock=SimpleNamespace(monotonic=lambda: 7.0),
        db=SimpleNamespace(read=lambda: None),
        robots=SimpleNamespace(last_of_each=lambda *_args: []),
    )
    robot = Robot("Any", "", fleet=Fleet("Hall", "http://hall", identity=identity), vehicle=ANY_VEHICLE)
    seen = SimpleNamespace(robot=robot, began_again_at=-math.inf, read_highest=lambda _floor: 1)
    about = OwnItems(client, context, seen)
    row = SimpleNamespace(queue_floor=1)
    assert (about.why_uncertain(row, is_taken=False, may_change_robot=False) == "") is is_certain


@pytest.mark.parametrize("runs", [False, True], ids=["waiting", "running"])
def test_what_another_user_cancels_at_the_fleet_is_cancelled_before_it_began(site, runs):
    robot = add(site, ANY_VEHICLE)
    site.run(10)
    if not runs:
        site.stranger_queues()
        site.run(5)
    site.container.operator.run_now(robot.id, 1)
    site.run_until(lambda: [row.state for row in site.executions()] == [State.EXECUTING if runs else State.QUEUED])
    site.fleet.book.cancel(site.fleet.book.open[-1], site.fleet.now)
    site.run_until(lambda: not site.executions()[0].state.is_open)
    (row,) = site.executions()
    assert (row.reason.code, dict(row.reason.details)) == (
        ReasonCode.ROBOT_ABORTED if runs else ReasonCode.USER_CANCELLED,
        {"fleet": True},
    )


@pytest.mark.parametrize(
    ("identity", "vehicle", "serials", "is_sent"),
    [
        ("own user", ANY_VEHICLE, True, True),
        (None, ANY_VEHICLE, True, False),
        (None, "1", True, True),
        pytest.param(None, "1", False, False, marks=pytest.mark.long),
        ("own user", "1", False, True),
    ],
)
def test_no_order_goes_to_a_fleet_that_could_be_another_one(site, identity, vehicle, serials, is_sent):
    """With a built-in user of it only a robot's serial number tells it."""
    if identity is None:
        site.identity = None
        forget_identity(site)
    site.fleet.knobs = replace(site.fleet.knobs, serial_numbers=serials)
    robot = add(site, vehicle)
    site.run(10)
    site.container.operator.run_now(robot.id, 1)
    planned(site, robot)
    site.run(150)
    assert bool(site.network.posts()) is is_sent
    if not is_sent:
        assert {row.wait for row in site.executions()} == {Wait.CHECK_UP}
        said = waiting_sentence(site.executions()[0], "UTC")
        assert said.startswith(
            "Another fleet with the user distributor could get it: give the app a user of its own at Fleet, waits"
        )
        site.run_until(lambda: site.executions()[0].reason is not None)
        assert sentence(site.executions()[0].reason, "UTC").endswith(
            "no user of its own at the fleet Fleet, so another could get it"
        )


def test_a_fleet_without_users_that_is_not_known_yet_is_only_said_to_need_a_check_up(tmp_path):
    site = Site(tmp_path, target="enterprise")
    site.identity = None
    site.hall = site.add_fleet()
    mission = site.add_mission()
    site.run(10)
    site.container.operator.run_now(add(site, ANY_VEHICLE).id, mission.id)
    site.run(10)
    said = waiting_sentence(site.executions()[0], "UTC")
    assert said.startswith("The fleet Fleet has to be checked up first, waits")
    site.switch_off()


def started(tmp_path, window, fate=None, after=0.5):
    """Fleet software before 1.5. A start is sent, and after some seconds the app is killed."""
    site = Site(tmp_path, target="enterprise")
    site.fleet.knobs = replace(site.fleet.knobs, version="1.4.2")
    (robot,) = site.add_robots()
    site.add_mission()
    site.run(10)
    planned(site, robot, window)
    if fate is not None:
        site.network.next("POST", "/mission_queue", fate)
    site.run_until(lambda: site.executions() and site.executions()[0].attempts)
    site.run(after)
    site.switch_off(cleanly=False)
    return site


@pytest.mark.parametrize("window", [60, 600])
def test_what_ended_while_the_app_was_off_is_soon_given_up_where_it_can_not_be_found(tmp_path, monkeypatch, window):
    """Nothing tells the app's orders from those of others."""
    monkeypatch.setattr(Site, "_own_key", None)
    site = started(tmp_path, window, Fate.ANSWER_LOST)
    site.clock.advance(300)
    site.switch_on()
    site.run(300)
    (row,) = site.executions()
    assert (row.state, row.reason.code, len(site.queue("R1"))) == (State.FAILED, ReasonCode.UNKNOWN_OUTCOME, 1)
    assert sentence(row.reason, "UTC").endswith(
        "does not show what became of it: whether an ended order is the app's can't be told"
    )
    assert not any(alarm.code == "not_a_robot" for alarm in site.container.alarms.open())
    site.switch_off()


@pytest.mark.parametrize("runs", [False, True], ids=["waiting", "running"])
def test_what_a_fleet_can_not_cancel_is_not_tried(runs):
    asked, can = [], replace(OF_A_VEHICLE, cancel_running=False)
    client = SimpleNamespace(capabilities=can, cancel=lambda queue_id, _token: asked.append(queue_id))
    about = Duplicates(client, SimpleNamespace(ledger=None), SimpleNamespace())
    assert about.cancel(7, SimpleNamespace(token=""), runs=runs) is not runs
    assert asked == ([] if runs else [7])


@pytest.mark.parametrize("off", [300, 7200])
@pytest.mark.parametrize(("fate", "after"), [(Fate.ANSWER_LOST, 0.5), (None, 0.5), (None, 5.0)])
def test_what_ended_while_the_app_was_off_is_found(tmp_path, fate, after, off):
    site = started(tmp_path, 600, fate, after)
    site.clock.advance(off)
    site.switch_on()
    site.run(300)
    (row,) = site.executions()
    assert (row.state, len(site.queue("R1"))) == (State.COMPLETED, 1)
    site.switch_off()


@pytest.mark.parametrize(("others", "state", "runs"), [(0, State.COMPLETED, 1), (2, State.FAILED, 0)])
def test_what_did_not_arrive_before_the_app_was_killed_is_sent_again_only_if_that_is_certain(
    tmp_path, others, state, runs
):
    """Other orders of the app for the same mission and robot have ended since."""
    site = started(tmp_path, 600, Fate.LOST)
    for _ in range(others):
        order = site.fleet.order_of_somebody(GUIDS["Deliver"], site.fleet.vehicles[0])
        order.origin = Origin.of_key("Scheduler")
        site.clock.advance(100)
        site.fleet.catch_up()
    site.clock.advance(60)
    site.switch_on()
    site.run(400)
    (row,) = site.executions()
    assert (row.state, len(site.queue("R1")) - others) == (state, runs)
    site.switch_off()


def test_another_start_of_the_same_mission_is_not_taken_for_one_that_did_not_arrive(tmp_path):
    """Of software before 1.5. It was started a minute before, by a person, and ran."""
    site = Site(tmp_path, target="enterprise")
    site.fleet.knobs = replace(site.fleet.knobs, version="1.4.2")
    (robot,) = site.add_robots()
    site.add_mission()
    site.run(10)
    planned(site, robot, 600)
    site.container.operator.run_now(robot.id, 1)
    site.run_until(lambda: site.executions()[0].state is State.COMPLETED)
    site.network.next("POST", "/mission_queue", Fate.LOST)
    site.run_until(lambda: len(site.executions()) == 2 and all(row.attempts for row in site.executions()))
    site.run(0.5)
    site.switch_off(cleanly=False)
    site.clock.advance(60)
    site.switch_on()
    site.run(400)
    (lost,) = [row for row in site.executions() if row.trigger is Trigger.SCHEDULED]
    assert (lost.state, len(site.queue("R1"))) == (State.FAILED, 1)
    site.switch_off()


@pytest.mark.parametrize(("kept", "state"), [(None, State.COMPLETED), (60.0, State.FAILED)])
def test_a_new_fleet_that_shows_an_earlier_order_would_show_a_later_one(tmp_path, monkeypatch, kept, state):
    """No order had ended when it was checked up. The request for its second robot is lost, and then the link; the history has one row."""
    monkeypatch.setattr(Site, "_ended_shown_s", 0.0)
    site = Site(tmp_path, target="enterprise", robots=2)
    site.fleet.knobs = replace(site.fleet.knobs, ids_kept=kept, orders_kept=kept)
    first, second = site.add_robots()
    site.container.catalogue.change_settings(history_limit=1)
    site.add_mission()
    site.run(10)
    run_now(site, first)
    site.run(200)
    site.network.next("POST", "/mission_queue", Fate.LOST)
    row = site.container.operator.run_now(second.id, 1)
    site.run_until(lambda: site.container.ledger.get(row.id).state is State.SUBMITTING)
    site.run(0.5)
    site.network.down.update([*site.machines, FLEET])
    site.run(100)
    site.network.down.clear()
    row = ended(site, row)
    assert (row.state, len(site.queue("R2"))) == (state, 1 if kept is None else 0)
    site.switch_off()


def test_a_start_that_a_fleet_was_asked_for_all_the_time_and_has_not_shown_did_not_arrive(tmp_path, monkeypatch):
    """The fleet's first one; it forgets orders soon."""
    monkeypatch.setattr(Site, "_ended_shown_s", 0.0)
    site = Site(tmp_path, target="enterprise")
    site.fleet.knobs = replace(site.fleet.knobs, orders_kept=60.0)
    (robot,) = site.add_robots()
    site.add_mission()
    site.run(10)
    site.network.next("POST", "/mission_queue", Fate.LOST)
    assert (run_now(site, robot).state, len(site.queue("R1"))) == (State.COMPLETED, 1)
    site.switch_off()


@pytest.mark.parametrize("version", ["1.5.0", "1.4.2"])
def test_a_start_that_a_fleet_refuses_as_one_that_it_has_is_not_sent_again_and_again(tmp_path, version):
    """Its answer was lost, and then the link until it had ended. The fleet knows its id for longer than it shows it."""
    site = Site(tmp_path, target="enterprise")
    site.fleet.knobs = replace(site.fleet.knobs, version=version)
    (robot,) = site.add_robots()
    site.add_mission()
    site.run(10)
    site.fleet.knobs = replace(site.fleet.knobs, orders_kept=20.0)
    row = lost_until_it_has_ended(site, robot, Fate.ANSWER_LOST)
    said = (row.state, row.reason.code, len(site.network.posts("R1")))
    assert said == (State.FAILED, ReasonCode.UNKNOWN_OUTCOME, 2)
    site.switch_off()


@pytest.mark.parametrize("fate", [Fate.FINE, Fate.ANSWER_LOST])
def test_a_start_of_which_a_fleet_shows_only_that_it_had_it_has_an_unknown_outcome(tmp_path, monkeypatch, fate):
    phase = EnterpriseFleet.phase

    def active_phase(fleet, id_):
        found = phase(fleet, id_)
        return found if found and found[0].ended is None else None

    monkeypatch.setattr(EnterpriseFleet, "phase", active_phase)
    site = Site(tmp_path, target="enterprise")
    (robot,) = site.add_robots()
    site.add_mission()
    site.run(10)
    row = lost_until_it_has_ended(site, robot, fate)
    assert (row.state, row.reason.code, len(site.queue("R1"))) == (State.FAILED, ReasonCode.UNKNOWN_OUTCOME, 1)
    site.switch_off()


def lost_until_it_has_ended(site, robot, fate):
    site.network.next("POST", "/mission_queue", fate)
    row = site.container.operator.run_now(robot.id, 1)
    site.run_until(lambda: len(site.queue("R1")) == 1)
    site.network.down.update([*site.machines, FLEET])
    site.run(120)
    site.network.down.clear()
    return ended(site, row)


@pytest.mark.long
def test_the_age_of_a_start_after_a_kill_counts_from_its_attempt(tmp_path):
    """It was held for more than an hour, and lost a moment before the app was killed."""
    site = Site(tmp_path, target="enterprise")
    (robot,) = site.add_robots()
    site.add_mission()
    site.run(10)
    planned(site, robot, 600)
    site.container.holds.hold("a person")
    site.run(3900)
    site.container.holds.release()
    site.network.next("POST", "/mission_queue", Fate.LOST)
    site.run_until(lambda: site.executions()[0].state is State.SUBMITTING)
    site.run(0.5)
    site.switch_off(cleanly=False)
    site.clock.advance(20)
    site.switch_on()
    site.run(600)
    (row,) = site.executions()
    assert (row.state, len(site.queue("R1"))) == (State.COMPLETED, 1)
    site.switch_off()


def test_a_start_is_as_old_as_its_request_though_the_tablet_slept_during_that(tmp_path, monkeypatch):
    """Its answer was lost, and it has run in that time; the fleet has forgotten it."""
    monkeypatch.setattr(Site, "_ended_shown_s", 0.0)
    site = Site(tmp_path, target="enterprise")
    site.fleet.knobs = replace(site.fleet.knobs, orders_kept=60.0, ids_kept=60.0)
    (robot,) = site.add_robots()
    site.add_mission()
    site.run(10)
    site.network.interrupt = lambda where: where == "after POST /mission_queue" and site.clock.advance(600.0)
    site.network.next("POST", "/mission_queue", Fate.ANSWER_LOST)
    row = run_now(site, robot)
    assert (row.state, row.reason.code, len(site.queue("R1"))) == (State.FAILED, ReasonCode.UNKNOWN_OUTCOME, 1)
    site.switch_off()


def run_now(site, robot):
    return ended(site, site.container.operator.run_now(robot.id, 1))


def ended(site, row):
    site.run_until(lambda: not site.container.ledger.get(row.id).state.is_open)
    return site.container.ledger.get(row.id)
