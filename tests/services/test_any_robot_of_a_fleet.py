"""A start for any robot of a fleet says which robot the fleet chose for it; and what is said when a fleet is silent or has lost it."""

from __future__ import annotations

import csv
import io
import math
from dataclasses import replace
from types import SimpleNamespace

import pytest

from app.database.fleets import FleetRepository
from app.database.robots import Accepted, RobotRepository
from app.domain.activity import NO_DATA
from app.domain.capabilities import OF_A_ROBOT
from app.domain.check_up import RobotProfile
from app.domain.execution import Reason, ReasonCode, State, Wait
from app.domain.models import ANY_VEHICLE, Connection, Fleet, Group, Robot
from app.domain.reasons import sentence, waiting_sentence
from app.domain.robot import RobotStatus
from app.mir.classic_vehicle import OF_A_VEHICLE, ClassicVehicle
from app.services.dispatch.duplicates import Duplicates
from app.services.dispatch.own_items import OwnItems
from app.services.files.history_export import write_history
from mir_sim.fleets.classic_orders import Shown
from mir_sim.fleets.orders import OrderState
from mir_sim.site import DISTRIBUTOR
from tests.support.site import USER, Site


@pytest.fixture
def site(tmp_path):
    site = Site(tmp_path, target="classic")
    site.hall = site.add_fleet()
    site.add_mission()
    yield site
    site.switch_off()


def add(site, vehicle, name="Any of Hall"):
    return site.container.catalogue.save_robot(Robot(name, "", fleet=site.hall, vehicle=vehicle))


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
    row = site.ended(site.container.operator.run_now(robot.id, 1))
    assert row.state is State.COMPLETED
    return row


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
    group = save.save_group(Group("G", (robot.id,))) if of_group else None
    target = {"robot_id": None, "group_id": group.id} if group else {"robot_id": robot.id}
    site.plan_once(minutes=1, minimum_battery_percent=50.0, **target)
    site.run(90)
    assert (site.the_row().state is not State.WAITING) is (vehicle == ANY_VEHICLE)


def test_what_a_named_robot_has_is_not_cancelled_though_its_robot_is_not_shown_yet(site, monkeypatch):
    full = Shown.full
    monkeypatch.setattr(Shown, "full", lambda self: full(self) | {"robot_id": 0})
    monkeypatch.setattr(site.fleet.book, "_assign", lambda *_args, **_options: None)  # it lets orders wait
    add(site, ANY_VEHICLE)
    save = site.container.catalogue
    named = save.save_robot(Robot("Named", "", fleet=site.hall, vehicle=site._vehicle_ids["R1"]))
    site.plan_once(None, minutes=1, group_id=save.save_group(Group("G", (named.id,))).id)
    site.run_until(lambda: site.states() == [State.QUEUED])
    assert site.states(after=60) == [State.QUEUED]
    assert [order.state for order in site.fleet.book.open] == [OrderState.WAITING]


def context_of(robots, **values):
    """Of a worker whose items are asked about, with this instead of the robots' repository."""
    clock, db = SimpleNamespace(monotonic=lambda: 7.0), SimpleNamespace(read=lambda: None)
    return SimpleNamespace(ledger=None, clock=clock, db=db, robots=robots, **values)


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
    context = context_of(
        SimpleNamespace(
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
    found = [repository.last_of_each(db.read(), each.id) for each in (named, either, direct)]
    assert [[last.queue_id for last in each] for each in found] == [[12, 5], [5, 12], [20]]


@pytest.mark.parametrize(("identity", "is_certain"), [("a user", True), (None, False)])
def test_a_start_in_doubt_is_not_repeated_at_a_fleet_that_may_be_another_one(identity, is_certain):
    context = context_of(SimpleNamespace(last_of_each=lambda *_args: []))
    robot = Robot("Any", "", fleet=Fleet("Hall", "http://hall", identity=identity), vehicle=ANY_VEHICLE)
    seen = SimpleNamespace(robot=robot, began_again_at=-math.inf, read_highest=lambda _floor: 1)
    about = OwnItems(SimpleNamespace(capabilities=OF_A_VEHICLE), context, seen)
    assert (
        about.why_uncertain(SimpleNamespace(queue_floor=1), is_taken=False, may_change_robot=False) == ""
    ) is is_certain


@pytest.mark.parametrize("runs", [False, True], ids=["waiting", "running"])
def test_what_another_user_cancels_at_the_fleet_is_cancelled_before_it_began(site, runs):
    robot = add(site, ANY_VEHICLE)
    site.run(10)
    if not runs:
        site.stranger_queues()
        site.run(5)
    site.container.operator.run_now(robot.id, 1)
    site.run_until(lambda: site.states() == [State.EXECUTING if runs else State.QUEUED])
    site.fleet.book.cancel(site.fleet.book.open[-1], site.fleet.now)
    site.run_until(lambda: not site.the_row().state.is_open)
    code = ReasonCode.ROBOT_ABORTED if runs else ReasonCode.USER_CANCELLED
    assert site.the_row().reason == Reason(code, {"fleet": True})


@pytest.mark.parametrize(
    ("identity", "vehicle", "serials", "is_sent"),
    [
        ("own user", ANY_VEHICLE, True, True),
        (None, ANY_VEHICLE, True, False),
        pytest.param(None, "1", True, True, marks=pytest.mark.long),
        pytest.param(None, "1", False, False, marks=pytest.mark.long),
        pytest.param("own user", "1", False, True, marks=pytest.mark.long),
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
    site.plan_once(robot.id)
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


@pytest.mark.parametrize("runs", [False, True], ids=["waiting", "running"])
def test_what_a_fleet_can_not_cancel_is_not_tried(runs):
    asked, can = [], replace(OF_A_VEHICLE, cancel_running=False)
    client = SimpleNamespace(capabilities=can, cancel=lambda queue_id, _token: asked.append(queue_id))
    about = Duplicates(client, SimpleNamespace(ledger=None), SimpleNamespace())
    assert about.cancel(7, SimpleNamespace(token=""), runs=runs) is not runs
    assert asked == ([] if runs else [7])


def test_a_fleet_without_users_that_is_not_known_yet_is_only_said_to_need_a_check_up(tmp_path):
    site = Site(tmp_path, target="enterprise")
    site.identity = None
    site.hall = site.add_fleet()
    mission = site.add_mission()
    site.run(10)
    site.container.operator.run_now(add(site, ANY_VEHICLE).id, mission.id)
    site.run(10)
    assert waiting_sentence(site.the_row(), "UTC").startswith("The fleet Fleet has to be checked up first, waits")
    site.switch_off()


# ---------------------------------------------------------------------- silent, or without the order
def test_a_silent_fleet_differs_from_a_robot_that_it_has_lost(site):
    named = add(site, site._vehicle_ids["R1"], "R1")
    either = add(site, ANY_VEHICLE, "Hall")
    site.run(10)
    site.fleet.cut_off({"R1"})
    site.run(120)
    snapshots = site.container.snapshots
    assert (snapshots.get(named.id).connection, snapshots.get(named.id).fleet_failed) == (Connection.UNREACHABLE, False)
    assert snapshots.get(either.id).connection is Connection.CONNECTED
    site.fleet.restart(300)
    site.run(120)
    assert [snapshots.get(robot.id).fleet_failed for robot in (either, named)] == [True, True]
    assert [alarm.details.get("fleet") for alarm in site.container.alarms.open()] == [site.hall.name, None]


def test_an_order_that_its_fleet_has_lost_is_said_in_words_of_fleets(site):
    robot = add(site, ANY_VEHICLE, "Hall")
    site.run(10)
    site.stranger_queues()
    site.run(5)
    site.container.operator.run_now(robot.id, 1)
    site.run_until(lambda: site.states() == [State.QUEUED])
    site.fleet.restart(5, forgets_waiting=True)
    site.run_until(lambda: not site.executions()[0].state.is_open)
    assert sentence(site.executions()[0].reason, "UTC") == "The fleet no longer has this order"


def test_the_robot_that_took_an_order_has_its_name_of_the_plan(site):
    either = add(site, ANY_VEHICLE, "Hall")
    for name, number in site._vehicle_ids.items():
        add(site, number, f"{name} of Hall")  # its name at the fleet is another robot's here
    site.run(10)
    site.container.operator.run_now(either.id, 1)
    site.run_until(lambda: site.states() == [State.COMPLETED])
    assert site.executions()[0].taken_by.endswith(" of Hall")


def test_only_robots_have_times_in_use(site):
    either, named = add(site, ANY_VEHICLE, "Hall"), add(site, site._vehicle_ids["R1"], "R1")
    began = site.clock.now()
    site.run(300)
    found = site.container.robot_states.timelines(began, site.clock.now(), [either.id, named.id])
    known = {one.robot_id: any(span.activity != NO_DATA for span in one.spans) for one in found}
    assert known == {named.id: True}


def test_only_missions_that_people_made_are_fetched(site):
    found = site.container.operator.fetch_missions(add(site, ANY_VEHICLE, "Hall").id)
    names = [mission.name for mission in found]
    assert "Deliver" in names
    assert not {"ChargeAtStation", "GoToPositionPrototype", "Move"} & set(names)
