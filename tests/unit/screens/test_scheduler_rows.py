"""The Scheduler's list of schedules and the cards of its bars from plain facts."""

from dataclasses import replace
from datetime import UTC, datetime, time, timedelta

import pytest

from app.database.robots import Hold
from app.domain.execution import Reason, ReasonCode, State
from app.domain.models import Between, Connection, Group, InvalidInput
from app.screens.common.mission_names import MissionNames
from app.screens.scheduler import bar_card, view
from app.screens.scheduler.timeline import ASSUMED_S, timeline
from tests.support.scheduler_facts import EMPTIES, HOURLY, KITS, NOW, execution, facts, planned


def test_the_values_of_missions_are_next_to_their_names():
    goal = {"goal": "a1c4e008-5d0f-11ef-93c1-0001297b6e20"}
    own, started = replace(HOURLY, parameters=goal), execution(State.COMPLETED, 300, parameters=goal)
    plan = facts(
        schedules=(own,),
        planned=(planned(22, schedule=own),),
        past=(started,),
        mission_names=MissionNames(names={goal["goal"]: "Dock 3"}),
    )
    rows = (
        *view.schedule_rows(plan, NOW),
        *view.schedule_rows(plan, NOW, view.Listing(query="dock 3")),
    )
    assert [row.title for row in rows] == 2 * ["Deliver kits · Dock 3"]
    cards = bar_card.start_card(plan, plan.planned[0], NOW), bar_card.run_card(plan, started, NOW)
    assert [card.title for card in cards] == 2 * ["Deliver kits · Dock 3"]
    assert "Deliver kits · Dock 3" in [bar.label for lane in timeline(plan, NOW).lanes for bar in lane.bars]
    assert {(robot, values["goal"]) for robot, _guid, values in plan.given_to()} == {(1, goal["goal"])}


def test_the_card_of_a_failed_run_says_why_in_our_words_and_the_robots():
    said = "Failed to reach goal position 'Dock 3'"
    failed = execution(State.FAILED, 300, reason=Reason(ReasonCode.ROBOT_ABORTED, {"message": said}))
    assert bar_card.run_card(facts(past=(failed,)), failed, NOW).text.splitlines()[-1] == f"Can't reach Dock 3 “{said}”"


@pytest.mark.parametrize(
    ("known", "text", "icon"),
    [
        ({}, "Run now", "play"),
        (
            {"holds": (Hold("Maintenance", NOW + timedelta(minutes=10), NOW),)},
            "Queue, on hold until 14:48",
            "hand-back-right-outline",
        ),
        ({"holds": (Hold("Maintenance", None, NOW),)}, "Queue, on hold", "hand-back-right-outline"),
        ({"holds": (Hold("Maintenance", None, NOW, robot_id=2),)}, "Run now", "play"),
        ({"own_hold": Hold(clock=True)}, "Queue, on hold", "hand-back-right-outline"),
        ({"own_hold": Hold(is_copy=True)}, "Nothing is sent from this tablet", "play"),
        ({"stopped": frozenset([1])}, "Aino is stopped", "play"),
        ({"silent": {1: Connection.UNREACHABLE}}, "Send when Aino answers", "timer-sand"),
    ],
)
def test_what_starts_it_now_says_what_it_does(known, text, icon):
    """In its menu and on the card of its bar, as Home does."""
    plan = facts(schedules=(HOURLY,), planned=(planned(22),), **known)
    for items in (view.schedule_menu(plan, HOURLY, NOW), bar_card.start_card(plan, plan.planned[0], NOW).items):
        [item] = [item for item in items if item.key == "run"]
        assert (item.off or item.text, item.icon) == (text, icon)
        assert bool(item.off) is (icon == "play" and text != "Run now")


@pytest.mark.parametrize(
    ("members", "has_it", "text"),
    [
        ((), True, "Hall 1 has no robot"),
        ((2,), True, "No robot of Hall 1 is switched on"),
        ((1, 2), False, "No robot of Hall 1 has this mission"),
        ((1, 2), True, "Run now"),
    ],
)
def test_what_no_robot_can_take_now_is_not_offered(members, has_it, text):
    of_hall = replace(HOURLY, robot_id=None, group_id=3)
    plan = facts(
        schedules=(of_hall,),
        groups=(Group("Hall 1", members, id=3),),
        names={1: {KITS.guid if has_it else EMPTIES.guid: ""}},
    )
    item = view.run_item(plan, of_hall, NOW)
    assert item.off == ("" if text == "Run now" else text)
    assert view.run_item(facts(), replace(HOURLY, robot_id=2), NOW).off == "Veikko is switched off"


def test_schedules_are_listed_by_words_robot_and_name():
    other = replace(HOURLY, id=8, name="A later one", robot_id=2, next_at=NOW + timedelta(hours=3))
    plan = facts(schedules=(HOURLY, other))

    def listed(**listing):
        return [row.key for row in view.schedule_rows(plan, NOW, view.Listing(**listing))]

    assert (listed(), listed(by_name=True)) == ([7, 8], [8, 7])
    assert (listed(target=2), listed(target=1)) == ([8], [7])
    assert (listed(query="LATER veikko"), listed(query="kits aino"), listed(query="nothing")) == ([8], [7], [])
    assert (listed(mission_id=1), listed(mission_id=2)) == ([7, 8], [])
    assert [option.text for option in view.mission_options(plan)] == ["All missions", "Deliver kits"]


# ---------------------------------------------------------------------- the schedules
def test_schedules_are_in_the_order_of_their_starts_and_those_that_are_off_last():
    later = replace(HOURLY, id=8, name="Later", next_at=NOW + timedelta(hours=3))
    off = replace(HOURLY, id=9, name="Off", enabled=False, next_at=None)
    rows = view.schedule_rows(facts(schedules=(off, later, HOURLY)), NOW)
    assert [(row.key, row.on, row.lead) for row in rows] == [(7, True, "15:00"), (8, True, "17:38"), (9, False, "–")]
    assert [(row.place, row.meta, row.look) for row in rows][1:] == [("Aino", "", "plain"), ("Aino", "Off", "faint")]


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"robot_id": 2}, ("15:00", "Veikko", "Daily 06:00 · the robot is switched off")),
        ({"next_at": NOW + timedelta(days=3)}, ("Mon 14:38", "Aino", "Daily 06:00")),
        ({"next_at": NOW + timedelta(days=30)}, ("Sun 20 Dec 14:38", "Aino", "Daily 06:00")),
    ],
)
def test_a_schedule_says_when_or_why_not(changes, words):
    [row] = view.schedule_rows(facts(schedules=(replace(HOURLY, **changes),)), NOW)
    assert (row.lead, row.place, row.support) == words


def test_a_schedule_without_a_value_that_its_mission_needs_says_so_before_its_time():
    plan = facts(planned=(planned(22),), refused={7: InvalidInput("parameters", "{name} is missing", name="Pallets")})
    [row] = view.schedule_rows(plan, NOW)
    assert row.support == "Daily 06:00 · a value is missing or wrong"
    [bar] = timeline(plan, NOW).lanes[0].bars
    assert bar.state == "refused"
    assert "Pallets is missing" in bar_card.start_card(plan, plan.planned[0], NOW).text.splitlines()


ONCE = replace(HOURLY, id=9, start=datetime(2026, 11, 20, 6, 30), recurrence=None, next_at=None)
MORNING = datetime(2026, 11, 20, 4, 30, tzinfo=UTC)  # 06:30 in Helsinki


def row_of(schedule, last=None):
    """Its row, and which place it has among others: one that starts, one that is off."""
    off = replace(HOURLY, id=8, enabled=False, next_at=None)
    plan = facts(schedules=(schedule, off, HOURLY), last={schedule.id: last} if last else {})
    rows = view.schedule_rows(plan, NOW)
    place = [row.key for row in rows].index(schedule.id)
    if rows[place].support.endswith("over"):
        assert view.schedule_rows(plan, NOW, view.Listing(by_name=True))[-1] == rows[place]
    return rows[place], place


@pytest.mark.parametrize(
    ("state", "words"),
    [
        (State.COMPLETED, "06:33"),
        (State.FAILED, "Failed"),
        (State.CANCELLED, "Cancelled"),
        (State.SKIPPED, "Not run"),
        (State.MISSED, "Not run"),
    ],
)
def test_a_one_time_schedule_that_is_over_shows_its_outcome_and_comes_last(state, words):
    last = execution(state, 0, planned_at=MORNING, ended_at=MORNING + timedelta(minutes=3))
    row, place = row_of(ONCE, last)
    assert (row.lead, row.meta, row.look, place) == ("–", words, "faint", 2)
    assert (row.place, row.support) == ("Aino", "Once, Fri 20 Nov 06:30 · over")


def test_what_is_over_without_a_row_says_so_and_whether_it_is_off():
    assert (row_of(ONCE)[0].support, row_of(ONCE)[0].meta) == ("Once, Fri 20 Nov 06:30 · over", "")
    assert row_of(replace(ONCE, enabled=False))[0].meta == "Off"
    assert row_of(replace(HOURLY, id=9, next_at=None))[0].support == "Daily 06:00 · over"


def test_what_still_runs_or_may_be_switched_on_is_not_over():
    row, _place = row_of(ONCE, execution(State.EXECUTING, 0, planned_at=MORNING))
    assert (row.look, row.meta) == ("plain", "Working")
    tomorrow = replace(ONCE, enabled=False, start=datetime(2026, 11, 21, 6, 30))
    for off in (tomorrow, replace(HOURLY, enabled=False, next_at=None)):
        assert view.schedule_rows(facts(schedules=(off,)), NOW)[0].meta == "Off"


def test_a_name_of_its_own_is_shown_and_one_made_of_mission_and_robot_is_not():
    made, own = replace(HOURLY, name="Deliver kits on Aino 2"), replace(HOURLY, id=8, name="Morning round")
    rows = view.schedule_rows(facts(schedules=(made, own)), NOW)
    assert [(row.title, row.aside) for row in rows] == [("Deliver kits", ""), ("Deliver kits", "Morning round")]
    assert bar_card.start_card(facts(), planned(30, schedule=own), NOW).text.splitlines()[0] == "Morning round"


@pytest.mark.parametrize(
    ("where", "said"),
    [
        ({"moved_from": NOW - timedelta(hours=3)}, "Moved from 11:38"),
        ({"moved_from": NOW + timedelta(minutes=22), "robot_id": 2}, "Moved from Aino"),
        ({"moved_from": NOW - timedelta(days=1), "robot_id": 2}, "Moved from Aino · Thu 19 Nov 14:38"),
    ],
)
def test_the_card_of_a_start_that_was_moved_says_where_it_was(where, said):
    run = planned(22, schedule=replace(HOURLY, id=8, recurrence=None, moved_of=7, **where))
    assert bar_card.start_card(facts(), run, NOW).text.splitlines()[2] == said


@pytest.mark.parametrize(
    ("reason", "minutes", "line"),
    [("Maintenance", 30, "On hold until 15:08: Maintenance"), ("", 30, "On hold until 15:08"), ("", None, "On hold")],
)
def test_the_card_of_a_start_says_until_when_it_is_on_hold_and_why(reason, minutes, line):
    until = NOW + timedelta(minutes=minutes) if minutes else None
    plan = facts(holds=(Hold(reason, until, NOW),))
    assert line in bar_card.start_card(plan, planned(22), NOW).text.splitlines()


def test_a_start_can_be_given_to_another_robot_where_one_is_in_use():
    def offered(plan):
        items = {item.key: item for item in bar_card.start_card(plan, planned(22), NOW).items}
        return items["robot"].off

    aino, veikko = facts().robots
    assert offered(facts(robots=(aino, veikko))) == "No other robot is switched on"
    assert offered(facts(robots=(aino, replace(veikko, enabled=True)))) == ""


def test_the_card_of_a_run_that_was_moved_says_when_it_was_planned():
    started = execution(State.EXECUTING, 5, schedule_id=8, moved_from=NOW - timedelta(hours=3))
    assert "Moved from 11:38" in bar_card.run_card(facts(), started, NOW).text.splitlines()


def test_a_start_that_is_skipped_stays_on_the_timeline_and_can_be_taken_again():
    ahead = execution(State.SKIPPED, -120, schedule_id=7, reason=Reason(ReasonCode.HOLD), ended_at=NOW)
    plan = facts(past=(ahead,), skips=frozenset({(7, ahead.planned_at)}))
    (bar,) = timeline(plan, NOW).lanes[0].bars
    assert (bar.label, bar.state, bar.end - bar.start) == (
        "Deliver kits",
        "skipped",
        pytest.approx(ASSUMED_S / 3600),
    )
    assert [item.key for item in bar_card.run_card(plan, ahead, NOW).items] == ["again", "edit", "log"]
    paused = replace(plan, schedules=(replace(HOURLY, paused_until=NOW + timedelta(days=1)),))
    for elsewhere in (paused, facts(past=(ahead,))):
        assert [item.key for item in bar_card.run_card(elsewhere, ahead, NOW).items] == ["log", "edit"]


@pytest.mark.parametrize(
    ("changes", "keys"),
    [
        ({}, ["skip", "pause"]),
        ({"paused_until": NOW + timedelta(days=1)}, ["resume"]),
        ({"enabled": False, "next_at": None}, []),
        ({"next_at": None}, []),
    ],
)
def test_a_menu_offers_what_can_be_done_with_the_next_starts(changes, keys):
    menu = view.schedule_menu(facts(), replace(HOURLY, **changes), NOW)
    assert [item.key for item in menu] == ["edit", "run", *keys, "duplicate", "delete"]


def test_a_schedule_shows_how_it_last_went():
    row = view.schedule_rows(facts(last={7: execution(State.SKIPPED, 60)}), NOW)[0]
    assert (row.meta_icon, row.meta_tone, row.meta) == ("skip-next-circle", "attention", "Not run")
    ran = execution(State.COMPLETED, 60, ended_at=NOW - timedelta(minutes=33))
    row = view.schedule_rows(facts(last={7: ran}), NOW)[0]
    assert (row.meta_tone, row.meta) == ("neutral", "14:05")


@pytest.mark.parametrize(
    ("rule", "words"),
    [
        ("FREQ=WEEKLY;BYDAY=MO,TU,WE,TH,FR", "Mon–Fri 06:30"),
        ("FREQ=WEEKLY;BYDAY=MO,WE,SA,SU", "Mon, Wed, Sat, Sun 06:30"),
        ("FREQ=DAILY;BYHOUR=6,15;BYMINUTE=30", "Daily 06:30, 15:30"),
        ("FREQ=DAILY;UNTIL=20261231", "Daily 06:30 until Thu 31 Dec"),
        ("FREQ=HOURLY;BYDAY=MO,TU,WE,TH,FR", "Hourly, Mon–Fri"),
        ("FREQ=MINUTELY;INTERVAL=30", "Every 30 min"),
        ("FREQ=MONTHLY;BYMONTHDAY=-1", "Every month on the last day at 06:30"),
    ],
)
def test_a_rule_is_said_in_few_words(rule, words):
    schedule = replace(HOURLY, start=datetime(2026, 11, 2, 6, 30), recurrence=rule)
    assert view.short_rule(schedule) == words
    if rule.startswith("FREQ=HOURLY"):
        between = replace(schedule, between=Between(time(6), time(18, 30)))
        assert view.short_rule(between) == "Hourly 06–18:30, Mon–Fri"


def test_the_times_of_a_rule_in_another_zone_say_which():
    there = replace(HOURLY, timezone="America/New_York")
    row, other = view.schedule_rows(facts(schedules=(HOURLY, replace(there, id=99))), NOW)
    assert ["America/New York" in each.support for each in (row, other)] == [each.key == 99 for each in (row, other)]
