"""What a mission was given, in words: never an identifier, and asked for at a robot that is switched on, seldom."""

from __future__ import annotations

from dataclasses import replace
from datetime import UTC, datetime
from types import SimpleNamespace

from app.domain.execution import Execution, Trigger
from app.domain.models import Mission, Robot, Schedule
from app.domain.robot import MissionParameter
from app.screens.common.mission_names import ASK_AGAIN_AFTER, MissionNameLookup, MissionNames, SharedMissionNames

DOCK, NOWHERE, MISSION = "a1c4e008-5d0f-11ef-93c1-0001297b6e20", "b2c4e008-5d0f-11ef-93c1-0001297b6e20", "m-1"
ASKED = (
    MissionParameter("goal", "Position", choices=((DOCK, "Dock 3"),), sets="position"),
    MissionParameter("gap", "Distance", unit="m"),
)
KNOWN = MissionNames({MISSION: ASKED}, {DOCK: "Dock 3"})
GO, HOME = Mission("Go to position", MISSION, id=3), Mission("Home", "m-2", id=4)
AINO, OFF = Robot("Aino", "http://aino", "user", id=1), Robot("Veikko", "http://veikko", "user", id=2, enabled=False)


def test_values_have_their_label_and_a_position_its_name():
    assert KNOWN.line(MISSION, {"goal": DOCK, "gap": 1.5}) == "Position: Dock 3 · Distance: 1.5 m"
    assert KNOWN.mission(GO, {"goal": DOCK, "gap": 1.5}) == "Go to position · Dock 3 · 1.5 m"


def test_the_name_of_a_position_is_known_for_any_mission_and_without_one_nothing_is_added():
    assert KNOWN.line("m-2", {"goal": DOCK}) == "goal: Dock 3"
    assert (KNOWN.line(MISSION, {}), KNOWN.mission(HOME, {})) == ("", "Home")


def test_runs_and_schedules_are_named_with_their_values():
    at = datetime(2026, 11, 20, 12, tzinfo=UTC)
    run = Execution(
        Trigger.MANUAL, 1, "Aino", "Go to position", MISSION, at, at, at, "t", "UTC", parameters={"goal": DOCK}
    )
    schedule = Schedule("Go to position on Aino", 1, 3, at.replace(tzinfo=None), "UTC", parameters={"goal": DOCK})
    assert KNOWN.run(run) == "Go to position · Dock 3"
    assert KNOWN.schedule(schedule, GO, AINO) == "Go to position · Dock 3 on Aino"
    assert KNOWN.schedule(replace(schedule, name="Evening round"), GO, AINO) == "Evening round"


def test_an_identifier_is_never_shown():
    assert KNOWN.line(MISSION, {"goal": NOWHERE}) == "Position: –"
    assert KNOWN.mission(GO, {"goal": NOWHERE}) == "Go to position"


def test_other_values_are_said_as_people_write_them():
    values = {"time": "00:05:00.000000", "count": 3, "loud": True, "note": "x" * 60}
    assert MissionNames().line(MISSION, values) == f"time: 00:05:00 · count: 3 · loud: Yes · note: {'x' * 60}"
    assert MissionNames().mission(Mission("Wait", MISSION), values) == f"Wait · 00:05:00 · 3 · Yes · {'x' * 32}…"


def test_what_is_stored_does_not_replace_what_is_known():
    names = SharedMissionNames()
    assert [names.take_stored(MISSION, stored) for stored in (None, ASKED, ASKED[:1])] == [None, ASKED, ASKED]


class Asking:
    """A robot whose answers come at once, or never."""

    def __init__(self, answers: bool = True) -> None:
        self.asked: list[tuple[int, str]] = []
        self.now, self.learnt, self._answers = 0.0, 0, answers
        self.mission_names = SharedMissionNames()
        shell = SimpleNamespace(background=self, mission_names=self.mission_names)
        self.names = MissionNameLookup(self, SimpleNamespace(monotonic=lambda: self.now), shell, self.count)

    def count(self) -> None:
        self.learnt += 1

    def parameters(self, robot_id: int, guid: str) -> tuple[MissionParameter, ...]:
        self.asked.append((robot_id, guid))
        if not self._answers:
            raise OSError
        return ASKED

    def run(self, work, done, failed, apart) -> None:
        try:
            done(work())
        except OSError as problem:
            failed(problem)


def test_a_robot_is_asked_once_for_what_is_shown():
    asking = Asking()
    starts = [
        *2 * [(1, MISSION, {"goal": DOCK})],
        (2, MISSION, {"goal": NOWHERE}),
        (None, MISSION, {"goal": NOWHERE}),
        (1, "m-2", {"count": 3}),
        (1, "m-3", {}),
    ]
    for _n in range(2):
        asking.names.look([AINO, OFF], starts)
    assert (asking.asked, asking.learnt) == ([(1, MISSION)], 1)
    assert asking.mission_names.known.line(MISSION, {"goal": DOCK}) == "Position: Dock 3"


def test_a_robot_that_did_not_answer_is_asked_again_but_seldom():
    asking = Asking(answers=False)
    for now in (0, 1, ASK_AGAIN_AFTER - 1, ASK_AGAIN_AFTER):
        asking.now = now
        asking.names.look([AINO], [(1, MISSION, {"goal": DOCK})])
    assert (len(asking.asked), asking.learnt) == (2, 0)
