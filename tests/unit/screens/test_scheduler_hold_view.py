"""Holding and pausing in words: chips, ends, the present hold, and how held starts are shown."""

from dataclasses import replace
from datetime import UTC, datetime, timedelta

import pytest

from app.database.robots import Hold
from app.domain.execution import DurationEstimate, Execution, State, Trigger
from app.domain.models import Connection, Group, Mission, Robot, Schedule, Settings
from app.screens.scheduler import hold_view, view
from app.screens.scheduler.facts import SchedulerFacts
from app.screens.scheduler.timeline import timeline
from app.services.planning.planned import PlannedRun

NOW = datetime(2026, 11, 20, 12, 38, tzinfo=UTC)  # Friday, 14:38 in Helsinki
ZONE = "Europe/Helsinki"
AINO, VEIKKO = Robot("Aino", "http://a", id=1), Robot("Veikko", "http://b", id=2)
KITS = Mission("Kits", "g", id=1)
HOURLY = Schedule(
    "Kits", 1, 1, datetime(2026, 11, 2, 6, 0), ZONE, "FREQ=DAILY", id=7, next_at=NOW + timedelta(minutes=22)
)
HOLD = Hold("Maintenance", NOW + timedelta(hours=1), NOW - timedelta(minutes=36))


def facts(**values):
    return SchedulerFacts(
        **{
            "settings": Settings(timezone=ZONE),
            "robots": (AINO, VEIKKO),
            "missions": (KITS,),
            "schedules": (HOURLY,),
            "holds": (HOLD,),
            **values,
        }
    )


def planned(minutes, robot=AINO):
    return PlannedRun(NOW + timedelta(minutes=minutes), HOURLY, robot, KITS, DurationEstimate(420.0, 420.0))


# ---------------------------------------------------------------------- the dialog
def test_starts_for_a_group_go_to_its_other_robots_while_one_is_held():
    here = facts(groups=(Group("Hall 1", (1, 2), id=1), Group("Alone", (3,), id=2)))
    assert hold_view.what_follows(here, 1).endswith(" continue. Starts for a group go to its other robots.")
    assert all(hold_view.what_follows(here, robot_id).endswith(" continue.") for robot_id in (3, hold_view.ALL))


def test_a_reason_that_is_offered_is_stored_in_english():
    assert [chip.text for chip in hold_view.reason_chips("Audit") if chip.selected] == ["Audit"]
    assert hold_view.reason_of(" Audit ") == "Audit"
    assert hold_view.reason_of("fire  drill") == "fire drill"


@pytest.mark.parametrize(
    ("choice", "end"),
    [
        ("hour", NOW + timedelta(hours=1)),
        ("day", datetime(2026, 11, 20, 22, 0, tzinfo=UTC)),
        ("chosen", NOW + timedelta(days=3)),
        ("open", None),
    ],
)
def test_the_end_that_is_chosen(choice, end):
    assert hold_view.end_of(choice, NOW + timedelta(days=3), ZONE, NOW) == end


def test_a_time_that_was_picked_is_shown_on_its_chip():
    chips = hold_view.end_chips(hold_view.CHOSEN, NOW + timedelta(hours=2), ZONE, NOW)
    assert [chip.text for chip in chips if chip.selected] == ["Until 16:38"]
    assert [chip.text for chip in hold_view.end_chips(hold_view.HOUR, None, ZONE, NOW)] == [
        "1 hour",
        "Rest of the day",
        "Until a time",
        "No end",
    ]


@pytest.mark.parametrize(
    ("robot", "until", "text"),
    [
        (None, None, "All robots on hold"),
        ("Aino", None, "Aino on hold"),
        (None, NOW + timedelta(hours=1), "All robots on hold until 15:38"),
        ("Aino", datetime(2026, 11, 22, 22, 0, tzinfo=UTC), "Aino on hold until Mon 23 Nov"),
    ],
)
def test_what_is_said_when_it_is_set(robot, until, text):
    assert hold_view.held_message(robot, until, ZONE, NOW) == text


def test_robots_can_be_chosen_one_by_one():
    assert [(row.key, row.text) for row in hold_view.robot_options(facts())] == [
        (0, "All robots"),
        (1, "Aino"),
        (2, "Veikko"),
    ]
    assert (hold_view.robot_name(facts(), 0), hold_view.robot_name(facts(), 2)) == ("All robots", "Veikko")


# ---------------------------------------------------------------------- what is held
def test_starts_within_a_hold_look_held_and_later_ones_do_not():
    bars = timeline(facts(planned=(planned(22), planned(82))), NOW).lanes[0].bars
    assert [(bar.label, bar.state) for bar in bars] == [("Kits", "held"), ("Kits", "planned")]
    hold = timeline(facts(), NOW).bands[-1]
    assert (hold.start, hold.end) == (pytest.approx(1 + 2 / 60), pytest.approx(2 + 38 / 60))
    assert (hold.text, hold.kind) == ("On hold until 15:38 · Maintenance", "held")
    endless = timeline(facts(holds=(replace(HOLD, until=None, reason=""),)), NOW).bands[-1]
    assert (endless.text, endless.kind) == ("On hold", "held")


def test_a_hold_of_one_robot_is_on_its_lane_only():
    one = facts(holds=(replace(HOLD, robot_id=2),), planned=(planned(22), planned(22, VEIKKO)))
    lanes = timeline(one, NOW).lanes
    assert [lane.bars[0].state for lane in lanes] == ["planned", "held"]
    assert timeline(one, NOW).bands == timeline(facts(holds=()), NOW).bands
    assert [lane.note for lane in lanes] == ["", "On hold until 15:38"]


def test_what_waits_because_of_a_hold_looks_held():
    closes = NOW + timedelta(minutes=15)
    waiting = Execution(
        Trigger.SCHEDULED, 1, "Aino", "Kits", "g", NOW, closes, NOW, "t", ZONE, state=State.WAITING, id=9
    )
    [bar] = timeline(facts(past=(waiting,)), NOW).lanes[0].bars
    assert (bar.label, bar.state) == ("Kits", "held")


def test_lists_say_until_when_it_is_held():
    assert why(facts()) == "not run: on hold until 15:38"  # at 15:00, 15 min late at most
    in_time = replace(HOURLY, start_window_minutes=39)
    assert why(facts(schedules=(in_time,))) == "on hold until 15:38"
    open_end = facts(holds=(replace(HOLD, until=None),))
    assert why(open_end) == "on hold"
    monday = replace(open_end.schedules[0], next_at=open_end.schedules[0].next_at + timedelta(days=3))
    assert why(replace(open_end, schedules=(monday,))) == "on hold"


@pytest.mark.parametrize(
    ("connection", "words"),
    [
        (Connection.UNREACHABLE, "No answer"),
        (Connection.UNAUTHORIZED, "Wrong password"),
        (Connection.OTHER_CERTIFICATE, "Another certificate"),
    ],
)
def test_what_is_planned_for_a_robot_that_gives_no_answer_to_trust_says_why(connection, words):
    silent = facts(holds=(), planned=(planned(22),), silent={1: connection})
    assert (view.schedule_rows(silent, NOW)[0].lead, why(silent)) == ("15:00", words)
    assert timeline(silent, NOW).lanes[0].note == words
    assert words not in why(replace(silent, holds=(HOLD,)))  # which matters more: nothing is sent even if it answers


def why(shown) -> str:
    """What the first row says of its next start, after its rule."""
    return view.schedule_rows(shown, NOW)[0].support.partition(" · ")[2]


# ---------------------------------------------------------------------- pausing
def test_a_paused_schedule_says_until_when_and_is_listed_at_its_next_start():
    paused = replace(HOURLY, id=8, name="A", paused_until=datetime(2026, 11, 22, 22, 0, tzinfo=UTC))
    later = replace(HOURLY, id=9, next_at=NOW + timedelta(hours=5))
    after_pause = {8: datetime(2026, 11, 23, 4, 0, tzinfo=UTC)}
    rows = view.schedule_rows(facts(holds=(), schedules=(paused, later), after_pause=after_pause), NOW)
    assert [(row.key, row.lead, row.support) for row in rows] == [
        (9, "19:38", "Daily 06:00"),
        (8, "Mon 06:00", "Daily 06:00 · paused until Mon 23 Nov"),
    ]
