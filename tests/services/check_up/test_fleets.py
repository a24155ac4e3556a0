"""Check-ups of fleets: what they find, and that nothing of them runs or is left."""

from __future__ import annotations

import itertools
from dataclasses import replace
from datetime import timedelta

import pytest

from app.domain.check_up import Level, Topic, Trial
from app.domain.message import render
from app.domain.models import ANY_VEHICLE, Group, InvalidInput, Mission, Robot, Schedule
from app.mir.enterprise_past import LISTED_FOR
from app.mir.errors import ConnectionLost
from app.mir.transport import Response
from app.services.catalogue.preview import ConcernCode
from app.services.check_up.journal import HOLD
from mir_sim.fleets.base import GO_HOME as HOME
from mir_sim.fleets.enterprise_orders import Origin
from tests.support.check_up_fleet import MISSION, ROBOT, CheckedFleet
from tests.support.check_up_site import Killed
from tests.support.findings import says
from tests.support.recorded_robot import START

KINDS = ("classic", "enterprise")
OWN_KEY = Origin.of_key("Scheduler").api_key_guid
LOST = ConnectionLost(address="10.0.0.9")


@pytest.fixture
def kind():
    return "classic"


@pytest.fixture
def site(tmp_path, kind):
    return CheckedFleet(tmp_path, kind)


def levels(report):
    """Of the findings of the trial, by topic; the worst of each."""
    found = {}
    for each in report.findings:
        if each.topic.is_tried and found.get(each.topic.value) != Level.RED:
            found[each.topic.value] = each.level
    return found


def check_nothing_is_left(site):
    assert (site.open_orders(), site.runs(), site.check_ups.left_behind()) == ([], [], [])


@pytest.mark.parametrize(
    ("kind", "knobs", "profile"),
    [
        ("classic", {}, {"token_field": "description", "has_search": True, "order_status": 201, "gives_id": True}),
        ("classic", {"search": 404, "answer": "whole"}, {"has_search": False, "gives_id": True}),
        ("classic", {"delete_ended": 404, "history": 0, "earliest_start": "utc"}, {"has_search": True}),
        pytest.param("classic", {"delete_ended": 400, "answer": "whole"}, {"gives_id": True}, marks=pytest.mark.long),
        (
            "classic",
            {"state_words": {"Pending": "Odottaa", "Aborted": "Keskeytetty"}},
            {"item_states": {"Odottaa": "Pending", "Keskeytetty": "Aborted"}},
        ),
        ("enterprise", {}, {"token_field": "id", "order_status": 201}),
        ("enterprise", {"posted": "accepted"}, {"token_field": "id", "order_status": 202}),
        ("enterprise", {"version": "1.4.2", "ids_kept": 0.0}, {"software": "1.4.2", "own_key": OWN_KEY}),
    ],
)
def test_one_order_shows_what_the_app_may_rely_on(tmp_path, kind, knobs, profile):
    site = CheckedFleet(tmp_path, kind, **knobs)
    assert site.fleet.known is None
    report = site.trial()
    assert set(levels(report).values()) == {Level.GREEN}
    known = site.fleet.known
    assert {name: getattr(known, name) for name in profile} == profile
    assert site.check_ups.report(site.id) == report
    check_nothing_is_left(site)


@pytest.mark.parametrize(
    ("kind", "knobs", "topic", "begins"),
    [
        ("classic", {"description": "none"}, Topic.RECOGNISED, "Neither a mark nor a user of its own"),
        ("enterprise", {"orders_kept": 0.0}, Topic.CANCELLED, "An order that has ended can't be found"),
        ("enterprise", {"posted": "lost"}, Topic.ORDER, "It took an order, but does not show it"),
    ],
)
def test_a_fleet_on_which_a_start_could_be_lost_gets_none_by_itself(tmp_path, kind, knobs, topic, begins):
    site = CheckedFleet(tmp_path, kind, **knobs)
    red = [each for each in site.trial().findings if each.topic is topic and each.level is Level.RED]
    assert render(red[0].says).startswith(begins)
    assert site.fleet.known is None
    site.clean_up()
    check_nothing_is_left(site)


def test_without_mark_a_user_of_its_own_is_enough(tmp_path):
    site = CheckedFleet(tmp_path, description="mission")

    def as_own_user(method, path, answer):
        return Response(answer.status, answer.body.replace(b"mirconst-guid", b"guid"), answer.headers)

    site.asked.meddle = as_own_user
    assert levels(site.trial())["recognised"] is Level.AMBER
    assert site.fleet.known.token_field == ""


def test_an_order_that_would_begin_at_once_is_cancelled_and_reported(tmp_path):
    site = CheckedFleet(tmp_path, earliest_start="ignored")
    assert levels(site.trial())["order"] is Level.RED
    assert site.fleet.known is not None  # the app keeps the times itself
    check_nothing_is_left(site)


def test_reading_alone_changes_nothing_and_keeps_what_is_known(site):
    site.check_ups.run(site.id)
    assert (site.asked.writes, site.fleet.known) == ([], None)
    site.trial()
    known = site.fleet.known
    site.check_ups.run(site.id)
    assert site.fleet.known == known is not None


@pytest.mark.parametrize(("kind", "secret"), [("classic", "password"), ("enterprise", "API key")])
def test_over_http_it_says_what_can_be_read(site, kind, secret):
    said = f"It is asked over http: anyone on the network can read the {secret}"
    assert says(site.trial(), Topic.CERTIFICATE) == (Level.AMBER, said)


def test_what_is_agreed_to_says_that_the_order_should_not_run(site):
    said = render(site.check_ups.moves("Hall", Trial(MISSION, ROBOT)))
    assert said.startswith(f"Hall gets one order: {MISSION} for {ROBOT}, not before tomorrow.")
    assert "should not run" in said
    assert "cancelled at once" in said
    assert MISSION in site.check_ups.harmless_missions(site.id)


def test_the_robots_of_a_fleet_are_offered_by_their_names_in_the_app(site):
    """Two fleets may each have a robot of that name."""
    assert list(site.check_ups.robots(site.id)) == [f"{ROBOT} (Hall)", "Celia (Hall)"]
    (bella,) = [
        each.id for each in site.asked.client(_any_of(site.fleet)).identify_fleet().vehicles if each.name == ROBOT
    ]
    site.container.catalogue.save_robot(Robot("Bella 2", "", fleet=site.fleet, vehicle=bella))
    assert list(site.check_ups.robots(site.id)) == ["Bella 2", "Celia (Hall)"]
    for name in ("Celia (Hall)", "Bella 2"):
        assert site.check_ups.run(site.id, Trial(MISSION, name)).is_complete
    check_nothing_is_left(site)


def test_until_a_fleet_is_checked_up_a_new_schedule_says_that_nothing_is_sent(site):
    save = site.container.catalogue
    either = save.save_robot(_any_of(site.fleet, "Any")).id
    own = save.save_robot(Robot("Aino", "10.0.0.8", "scheduler"), "secret").id
    mission = save.save_mission(Mission("Kits", "g-kits")).id
    both, alone = [save.save_group(Group(f"Group of {len(each)}", each)).id for each in ((either, own), (either,))]

    def said(robot_id=None, group_id=None):
        tomorrow = (START + timedelta(days=1)).replace(tzinfo=None)
        draft = Schedule("", robot_id, mission, tomorrow, "UTC", group_id=group_id)
        found = site.container.forecasts.of(draft).concerns
        return [each.details["fleet"] for each in found if each.code is ConcernCode.NOT_CHECKED_UP]

    assert [said(either), said(group_id=alone), said(group_id=both), said(own)] == [["Hall"], ["Hall"], [], []]
    site.trial()
    assert said(either) == said(group_id=alone) == []


def _any_of(fleet, name=""):
    return Robot(name, "", vehicle=ANY_VEHICLE).within(fleet)


@pytest.mark.parametrize("trial", [Trial(MISSION), Trial(MISSION, "No such robot"), Trial("No such one", ROBOT)])
def test_a_trial_needs_a_mission_and_a_robot_of_the_fleet(site, trial):
    try:
        report = site.check_ups.run(site.id, trial)
        assert not report.is_complete
        assert levels(report)["order"] is Level.AMBER
    except InvalidInput:
        assert not (trial.mission and trial.robot)
    assert site.asked.writes == []
    assert site.fleet.known is None


# ---------------------------------------------------------------------- cut off
def writes_at(site):
    """Numbers of the first request that changes something, and of the last request."""
    first = next(n for n, request in enumerate(site.asked.requests, 1) if request in site.asked.writes)
    return first, len(site.asked.requests)


@pytest.mark.parametrize(
    ("kind", "knobs", "is_long"),
    [
        ("classic", {"description": "none"}, False),
        ("enterprise", {}, False),
        *(
            pytest.param(kind, knobs, True, marks=pytest.mark.long)
            for kind, knobs in (
                ("classic", {}),
                ("classic", {"description": "none"}),
                ("enterprise", {"posted": "accepted"}),
            )
        ),
    ],
)
def test_killed_at_any_moment_the_order_is_deleted_at_the_next_start(tmp_path, kind, knobs, is_long):
    """Before or after the fleet has handled a request, from the order on."""
    whole = CheckedFleet(tmp_path / "whole", kind, **knobs)
    whole.trial()
    first, of = writes_at(whole)
    moments = [(first, True), (first + 5, False)]
    if is_long:
        moments = [(number, is_handled) for number in range(first, of + 1) for is_handled in (True, False)]
    left = []
    for number, is_handled in moments:
        site = CheckedFleet(tmp_path / f"{number}{is_handled}", kind, **knobs)
        site.kill_at(number, is_handled=is_handled)
        with pytest.raises(Killed):
            site.trial()
        left += site.open_orders()
        site.start_again()
        site.clean_up()
        check_nothing_is_left(site)
        site.container.db.close()
    assert left


@pytest.mark.parametrize("kind", KINDS)
def test_an_order_whose_answer_is_lost_is_found_and_deleted(site):
    count = itertools.count()
    site.asked.gives(LOST, lambda method, path: method == "POST" and "search" not in path and next(count) == 0)
    site.trial()
    check_nothing_is_left(site)


@pytest.mark.parametrize("kind", KINDS)
def test_a_person_stops_it(site):
    assert not site.trial(is_wanted=lambda: not site.asked.writes).is_complete
    assert (site.check_ups.report(site.id), site.fleet.known) == (None, None)
    check_nothing_is_left(site)


def test_what_can_not_be_deleted_is_an_alarm_until_it_is(site):
    def lose_deletions(method, path):
        if method == "DELETE":
            raise LOST

    site.asked.before = lose_deletions
    assert levels(site.trial())["left"] is Level.RED
    assert [alarm.code for alarm in site.container.alarms.open()] == ["check_up_left"]
    with pytest.raises(InvalidInput, match="not been undone"):
        site.trial()
    site.asked.behave()
    site.clean_up()
    assert site.open_orders() == []
    assert [alarm.cleared_at is None for alarm in site.container.alarms.open()] == [False]


def test_the_alarm_ends_with_a_fleet_that_is_removed(site):
    site.container.alarms.raise_("check_up_left", f"fleet:{site.id}", robot="Hall", problem="it does not answer")
    site.container.catalogue.remove_fleet(site.id)
    assert [alarm.cleared_at is None for alarm in site.container.alarms.open()] == [False]


@pytest.mark.parametrize("kind", KINDS)
def test_the_plan_waits_while_an_order_of_a_trial_may_be_there(site):
    """Also after the app was killed. A person's hold stays."""
    save, holds = site.container.catalogue.save_robot, site.container.holds
    bella, celia = (
        save(Robot(name, "", fleet=site.fleet, vehicle=id_there)) for name, id_there in ((ROBOT, "71"), ("Celia", "72"))
    )
    holds.hold("Cleaning", robot_id=celia.id)
    held = []
    site.asked.before = lambda method, path: held.append(holds.active(bella.id)) if method == "DELETE" else None
    site.trial()
    assert {hold.reason for hold in held} == {HOLD}
    assert [hold.reason for hold in holds.all_active()] == ["Cleaning"]
    kill_after_the_order(site)
    assert site.container.holds.active(bella.id).reason == HOLD
    site.clean_up()
    assert [hold.reason for hold in site.container.holds.all_active()] == ["Cleaning"]


def test_a_fleet_is_not_removed_while_an_order_of_a_trial_may_be_there(site):
    """Nor once an import has switched it off."""
    kill_after_the_order(site)
    site.container.catalogue.save_fleet(replace(site.fleet, enabled=False))
    with pytest.raises(InvalidInput, match=r"can be removed in \d+ h$"):
        site.container.catalogue.remove_fleet(site.id)
    site.clean_up()
    site.container.catalogue.remove_fleet(site.id)
    check_nothing_is_left(site)


@pytest.mark.parametrize("ahead", [pytest.param(400, marks=pytest.mark.long), -400])
def test_a_fleet_that_is_gone_for_good_can_be_removed_when_the_order_of_its_trial_would_have_begun(site, ahead):
    """By so many days its clock is wrong."""
    site.machine.clock.offset += ahead * 86_400.0
    kill_after_the_order(site)
    with pytest.raises(InvalidInput, match="may still have the order of its check-up"):
        site.container.catalogue.remove_fleet(site.id)
    site.asked.clock.advance(2 * 86_400.0)
    site.container.catalogue.remove_fleet(site.id)
    assert site.container.catalogue.fleets() == []


def test_the_app_on_copied_data_tries_nothing(site):
    kill_after_the_order(site)
    site.container.holds.is_copy = "this data is a copy"
    with pytest.raises(InvalidInput, match="copy"):
        site.check_ups.put_back(site.id)
    with pytest.raises(InvalidInput, match="copy"):
        site.trial()
    assert len(site.open_orders()) == 1


def kill_after_the_order(site):
    """The app, when the fleet has taken the order of a trial."""

    def die(method, path):
        if site.asked.writes:
            raise Killed

    site.asked.writes.clear()
    site.asked.before = die
    with pytest.raises(Killed):
        site.trial()
    site.start_again()


@pytest.mark.parametrize("version", ["1.5.0", "1.4.2"])
@pytest.mark.parametrize(("kept", "shown"), [(None, 3600.0), (60.0, 0.0), (4000.0, 3600.0)])
def test_it_is_found_out_for_how_long_orders_that_have_ended_are_shown(tmp_path, version, kept, shown):
    """The last order of somebody else ended an hour before."""
    site = CheckedFleet(tmp_path, "enterprise", version=version, orders_kept=kept)
    site.machine.abort(site.machine.order_of_somebody(HOME, site.machine.vehicles[0]))
    site.asked.clock.advance(3600.0)
    site.machine.catch_up()
    report = site.trial()
    known = site.fleet.known
    assert known.ended_shown_s == pytest.approx(min(shown, LISTED_FOR) if version == "1.4.2" else shown, abs=60.0)
    assert says(report, Topic.QUEUE)[0] is (Level.GREEN if shown else Level.AMBER)
    site.asked.clock.advance(1000.0)
    site.check_ups.run(site.id)  # which tries nothing
    assert (site.fleet.known.ended_shown_s > known.ended_shown_s + 900) is (kept is None and version == "1.5.0")


def test_an_order_that_ended_days_ago_is_found(tmp_path):
    site = CheckedFleet(tmp_path, "enterprise")
    site.machine.abort(site.machine.order_of_somebody(HOME, site.machine.vehicles[0]))
    site.asked.clock.advance(3 * 86400)
    site.machine.catch_up()
    site.trial()
    assert site.fleet.known.ended_shown_s == pytest.approx(3 * 86400, abs=120)
