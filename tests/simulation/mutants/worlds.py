"""Worlds that lead to one kind of bug: only what it needs happens there, and often."""

from __future__ import annotations

from dataclasses import replace

from tests.simulation.profile import Profile


def world(acts: str, events: str, per_hour: tuple[float, float], **site: object) -> Profile:
    """``per_hour``: acts and events."""
    acts_per_hour, events_per_hour = per_hour
    often = Profile(acts_per_hour=acts_per_hour, events_per_hour=events_per_hour, fault_rate=0.0, crash_rate=0.0)
    return often.only(acts, events, site={"fleet": "normal", **site})


CALM = Profile(acts_per_hour=0, events_per_hour=0, rough_s=900, calm_s=900).only(
    fault_rate=0.0, crash_rate=0.0, site={"every_minutes": 3}
)
CLOCKS = replace(
    world("move switch_schedule delete plan_once", "big_step medium_step power_cut", (15, 6)),
    rough_s=2400.0,
    calm_s=1200.0,
    site={},
)
# A clock is trusted unproven when the app starts with a wrong one and no robot answers.
UNPROVEN = replace(
    world("", "big_step power_cut outage", (15, 120), every_minutes=3, robots=1, poll_interval=120, retry_limit=20),
    longest_outage=300.0,
)
ABSENCES = replace(
    world("pause skip", "power_cut", (12, 6), every_minutes=3, history_limit=None), rough_s=2400.0, calm_s=1200.0
)
PEOPLE = replace(
    world(
        "change_mission switch_schedule switch_robot delete pause skip hold cancel clear run_now plan_once working_days",
        "lost_request outage slow_answers low_battery",
        (60, 20),
        quiet_s=90,
    ),
    fault_rate=Profile.fault_rate,
)
EDITED_IN_DOUBT = world("change_mission", "lost_request", (120, 40), quiet_s=90, every_minutes=3)
HELD_STARTS = world("hold_start", "outage", (60, 20), quiet_s=90, every_minutes=3)
LOST = world("run_now", "lost_request very_late_request", (15, 40), every_minutes=3)
MOVED_STARTS = world("move_start switch_schedule move other_robot change_mission", "", (60, 0), every_minutes=10)
MOVED_BESIDE = world("move_start", "robot_pauses", (60, 30), every_minutes=5)
FLAT_ROBOTS = world("change_battery", "low_battery", (20, 12), every_minutes=5, robots=2, poll_interval=30)
OUTAGES = replace(world("", "outage", (15, 30), every_minutes=3, retry_limit=10, poll_interval=30), longest_outage=90.0)
CANCELS = world("cancel", "outage lost_request", (60, 30), quiet_s=90, every_minutes=3)
EDITS = world("change_mission", "outage", (60, 20), quiet_s=90, every_minutes=3)
UNDONE = replace(world("switch_schedule other_robot move", "", (20, 0), every_minutes=3), edits_undone=0.3)
PAUSES = world("pause", "outage", (60, 20), every_minutes=3)
HELD_ROBOTS = world("hold release", "outage", (60, 20), every_minutes=3)
CRASHES = replace(world("run_now", "lost_request", (15, 15), every_minutes=3), crash_rate=0.01)
ROBOTS = replace(
    world(
        "run_now idle_rule",
        "another_robot robot_pauses mission_fails person_queues person_cancels poison low_battery very_late_request",
        (15, 30),
        every_minutes=5,
    ),
    fault_rate=Profile.fault_rate,
)
LATE_AND_PAUSED = world(
    "run_now",
    "very_late_request robot_pauses",
    (15, 30),
    every_minutes=3,
    poll_interval=10,
    quiet_s=90,
    history_limit=None,
)
# Polls are so rare that what arrives late has run before it is seen.
LATE_AND_IDLE = world(
    "idle_rule", "very_late_request person_queues", (20, 30), every_minutes=60, robots=4, poll_interval=120, quiet_s=90
)
BACK = world("back_up run_now", "restore outage", (30, 12), every_minutes=3, history_limit=None)
BACK_AND_ELSEWHERE = world(
    "back_up other_robot", "restore outage", (60, 12), every_minutes=3, history_limit=None, robots=3
)
SHORT = world("plan_once switch_schedule rename skip working_days idle_rule run_now", "", (80, 0), history_limit=1)
WINDOW = replace(world("hold", "power_cut nap outage", (15, 12), with_window=True, every_minutes=3), longest_off=600.0)
FORGETFUL = world("", "lost_request", (15, 40), every_minutes=3, fleet="forgetful")
FORGETFUL_WITH_FAULTS = replace(FORGETFUL, fault_rate=0.05)
SOME_FAULTS = replace(world("", "", (0, 0), every_minutes=3), fault_rate=0.1)
