"""No decision reads the history: what is sent does not depend on how much of it is kept (D5)."""

from __future__ import annotations

import tempfile
from dataclasses import replace
from datetime import UTC, datetime, timedelta
from functools import partial
from pathlib import Path

import pytest
from hypothesis import Phase, example, given, settings
from hypothesis import strategies as st

from app.domain.execution import State
from app.domain.models import Schedule
from app.services.catalogue import group_edit
from tests.services.story import *
from tests.support.edits import skip_next
from tests.support.groups import Hall
from tests.support.network import Fate
from tests.support.seen import sent_at
from tests.support.site import Site


def start_at(text):
    return datetime.fromisoformat(f"2026-11-23T{text}")


class Plant:
    """Two robots. R2 works all the time, so that a short history soon forgets everything about R1."""

    def __init__(self, directory: Path, limit: int | None) -> None:
        self.site = site = Site(directory, robots=2, robot_speed=4.0)
        site.container.catalogue.change_settings(history_limit=limit, poll_interval_seconds=60)
        self.r1, self.r2 = site.add_robots()
        self.deliver, self.home = site.add_mission("Deliver"), site.add_mission("Home")
        self.other = self.plan("Other", "06:02", "FREQ=MINUTELY;INTERVAL=4", robot_id=self.r2.id)
        self.paused = self.plan("Paused", "06:01", "FREQ=MINUTELY;INTERVAL=2", robot_id=self.r2.id)
        site.container.pausing.pause(self.paused.id, datetime(2026, 12, 1, tzinfo=UTC))

    def plan(self, name, at, recurrence=None, **values):
        values = {"robot_id": self.r1.id, "mission_id": self.deliver.id, **values}
        return self.site.container.catalogue.save_schedule(
            Schedule(
                name=name,
                start=start_at(at),
                timezone="UTC",
                recurrence=recurrence,
                respect_working_days=True,
                **values,
            )
        )

    def posts(self):
        """What left for which robot, and when."""
        return [(round(post.at, 1), post.robot, post.mission_id) for post in self.site.network.posts()]


# By mission, user and number it is judged there which item is a start's, and so by which ones others have.
FORGETS_WHOSE = do(lambda s: setattr(s.network, "forgets_descriptions", True))


def finished(number):
    """Items of R1."""
    return true(lambda s: len([item for item in s.all_items() if item in s.queue("R1") and item.finished]) == number)


# R2 works all the time, so that the history, which keeps one row, soon forgets everything about R1.
FORGETTING = [
    set_up(history_limit=1, poll_interval_seconds=60),
    [plan("Other", "06:02", on=2, every=4), plan("Paused", "06:01", on=2, every=2)],
    do(lambda s: s.container.pausing.pause(2, BEGIN + timedelta(days=8))),
]
SKIPPED = [plan(at="06:20", rule="FREQ=DAILY"), skip(), 720]
PlantStory = partial(Story, robots=2, robot_speed=4.0, stays_open=True)


def sent_to_r1(*seconds):
    return true(lambda s: sent_at(s, "R1") == list(seconds))


test_forgotten = cases_of(
    PlantStory(
        "a start that ran does not run again when its schedule is renamed",
        FORGETTING,
        [plan(), 720, edit(name="More"), 300, sent_to_r1(300)],
    ),
    PlantStory(
        "a skipped start stays skipped when the plan is made again, or its schedule deleted and restored",
        [FORGETTING, SKIPPED],
        each(set_up(working_days=("MO", "TU", "WE", "TH", "FR", "SA")), [delete(), 10, undo()]),
        [600, sent_to_r1()],
    ),
    PlantStory(
        "a start skipped beyond others stays skipped",
        [FORGETTING, plan(at="06:01", every=8, window=1), clock(200), 5, skip()],  # 06:01 counts as missed
        [true(lambda s: s.noted[-1].minute == 9), clock(-200), 1100, sent_to_r1(60, 1020)],
    ),
    PlantStory(
        "the idle mission runs once in each idle period",
        [FORGETTING, rest(), 2400, true(lambda s: len(sent_at(s, "R1")) == 1)],
    ),
    PlantStory(
        "a robot that loses tokens is known, even by an old last item",
        [
            FORGETTING,
            FORGETS_WHOSE,
            plan(),
            plan("B", "06:15"),
            600,
            post(ANSWER_LOST, robot="R1"),
            700,
            sent_to_r1(300, 900),
        ],
    ),
    PlantStory(
        "an item of a start that is forgotten is not taken for a later one",
        [FORGETTING, FORGETS_WHOSE, set_up(poll_interval_seconds=600), plan(), plan("B", "06:10"), 598],
        [
            true(lambda s: "A" not in [row.schedule for row in s.executions()]),
            post(REFUSED, robot="R1"),
            120,
            finished(2),
        ],
    ),
    PlantStory(
        "nor the item of one that ran while the other waited for its second try",
        [FORGETTING, FORGETS_WHOSE, set_up(poll_interval_seconds=600), plan(battery=50, window=60), plan("B", "06:06")],
        [298, post(REFUSED, robot="R1"), 2.5, battery(30, "R1"), 600, finished(1), battery(90, "R1"), 240, finished(2)],
    ),
    Story(
        "nor if any robot of a group may have the other",
        [set_up(history_limit=1, poll_interval_seconds=600), FORGETS_WHOSE, plan(battery=50, window=60)],
        [plan(f"On {n} at {minute}", f"06:{minute}", on=n) for minute in (12, 13, 14) for n in (1, 2)],
        [299.5, post(REFUSED, count=2), 1, until(lambda s: len(s.row("A").tried) == 2, 30), battery(30), 780, runs(6)],
        [battery(90), 240, runs(7)],
        on="group",
        robots=2,
    ),
)


# ---------------------------------------------------------------------- the same for everything a person may do
# An example takes a second: the default run has those that are written here.
IS_QUICK = settings.default.max_examples <= 12
FEW = settings(
    max_examples=settings.default.max_examples // 12,
    phases=[Phase.explicit] if IS_QUICK else [Phase.explicit, Phase.generate],
)
NUMBERS = st.integers(0, 1)
ACTS = (
    "rename",
    "skip",
    "working days",
    "delete and undo",
    "off and on",
    "pause",
    "resume",
    "restart",
    "answer lost",
    "lost",
)


def carry_out(plant: Plant, act: str, number: int) -> None:
    """What a person does, or what happens, to the schedule of that number on R1."""
    site, c = plant.site, plant.site.container
    on_r1 = [schedule for schedule in c.catalogue.schedules() if schedule.robot_id == plant.r1.id]
    schedule = on_r1[number % len(on_r1)]
    match act:
        case "rename":
            c.catalogue.save_schedule(replace(schedule, name=schedule.name + "'"))
        case "skip" if schedule.next_at is not None:
            skip_next(c, schedule.id)
        case "working days":
            changed = (
                ("MO", "TU", "WE", "TH", "FR", "SA")
                if len(c.settings().working_days) == 5
                else ("MO", "TU", "WE", "TH", "FR")
            )
            c.catalogue.change_settings(working_days=changed)
        case "delete and undo":
            c.catalogue.restore(c.catalogue.remove_schedule(schedule.id))
        case "off and on":
            c.catalogue.switch_schedule(schedule.id, False)
            c.catalogue.switch_schedule(schedule.id, True)
        case "pause":
            c.pausing.pause(schedule.id, site.clock.now() + timedelta(minutes=7))
        case "resume":
            c.pausing.resume(schedule.id)
        case "restart":
            site.power_cut(5)
        case "answer lost" | "lost":
            site.network.next(
                "POST", "/mission_queue", Fate.ANSWER_LOST if act == "answer lost" else Fate.LOST, robot="R1"
            )


def posts_of(story, limit, forgets):
    with tempfile.TemporaryDirectory() as directory:
        plant = Plant(Path(directory), limit)
        plant.site.network.forgets_descriptions = forgets
        plant.site.container.catalogue.change_idle_rule(plant.r1.id, mission_id=plant.home.id, after_minutes=5)
        plant.plan("Once", "06:05")
        plant.plan("Often", "06:08", "FREQ=MINUTELY;INTERVAL=12")
        for minutes, act, number in story:
            plant.site.run(60.0 * minutes)
            carry_out(plant, act, number)
        plant.site.run(300)
        posts = plant.posts()
        plant.site.switch_off()
        return posts


@FEW
@example(story=[(12, "rename", 1)], forgets=False)
@example(story=[(1, "skip", 0), (6, "working days", 0)], forgets=False)
@given(
    story=st.lists(st.tuples(st.integers(1, 9), st.sampled_from(ACTS), NUMBERS), min_size=2, max_size=5),
    forgets=st.booleans(),
)
def test_with_a_history_of_one_row_and_of_all_the_same_is_sent(story, forgets):
    """Two sites that differ only in how much history they keep send the same missions to the same robots at the same moments."""
    assert posts_of(story, 1, forgets) == posts_of(story, None, forgets)


# ---------------------------------------------------------------------- groups, which robot gets a start among it
NEARLY_EMPTY = (
    8.5  # %: enough for the minutes that the missions take, and not for what is believed of one that never ran
)


class Floor(Hall):
    """Starts for any of three robots, some with a time limit. R3's own ones make a short history forget all others."""

    def __init__(self, directory: Path, limit: int | None) -> None:
        super().__init__(directory, robots=3)
        self.container.catalogue.change_settings(history_limit=limit)
        self.empties, self.home = self.add_mission("Collect empties"), self.add_mission("Home")
        self.plan(
            "Home",
            "2026-11-23T06:01",
            recurrence="FREQ=MINUTELY;INTERVAL=3",
            mission_id=self.home.id,
            robot_id=self.robot("R3").id,
            group_id=None,
        )
        self.run(5)
        self.learn_stops()

    def charge(self, name: str, percent: float) -> None:
        self.machines[name].set_battery(percent)

    def happen(self, act: str, number: int) -> None:
        """What a person or the robot of that number does."""
        name = f"R{number}"
        match act:
            case "nearly empty":
                self.charge(name, NEARLY_EMPTY)
            case "charged":
                self.charge(name, 80.0)
            case "off" | "on":
                self.switch(name, on=act == "on")
            case "busy":
                self.stranger_queues("Collect empties", robot=name)
            case "removed and put back":
                self.container.catalogue.restore(self.container.catalogue.remove_robot(self.robot(name).id))
            case "restart":
                self.power_cut(5)

    def posts(self) -> list[tuple[str, float, str]]:
        """What left for which robot, and when, robot by robot: one's requests overtake another's by milliseconds."""
        return sorted((post.robot, post.at, post.mission_id) for post in self.network.posts())


@CHARGED
@pytest.mark.parametrize("limit", [1, None])
def test_how_long_a_robot_runs_is_known_however_short_the_history(tmp_path, limit):
    """Its battery is enough for a mission that it ran four times, though the history has none of these runs."""
    floor = Floor(tmp_path, limit)
    floor.only("R1", "R3")
    floor.plan("Learn", recurrence="FREQ=MINUTELY;INTERVAL=3;COUNT=4", robot_id=floor.robot("R1").id, group_id=None)
    floor.container.catalogue.edit(
        lambda edit: group_edit.save(edit, replace(floor.group, members=floor.group.members[:2]))
    )
    floor.plan("Low", "2026-11-23T06:24")
    floor.run(1430)
    floor.charge("R1", NEARLY_EMPTY)
    floor.run(20)
    low, kept = floor.run_of("Low"), len(floor.executions(State.COMPLETED))
    floor.switch_off()
    assert (low.state, low.robot, kept == 1) == (State.EXECUTING, "R1", limit == 1)


GROUP_ACTS = ("nearly empty", "charged", "off", "on", "busy", "removed and put back", "restart")


def posts_of_group(story, limit):
    with tempfile.TemporaryDirectory() as directory:
        floor = Floor(Path(directory), limit)
        floor.plan("Deliver", "2026-11-23T06:02", recurrence="FREQ=MINUTELY;INTERVAL=4")
        floor.plan("Urgent", "2026-11-23T06:11", recurrence="FREQ=MINUTELY;INTERVAL=5", finish_by_minutes=3)
        floor.plan(
            "Empties",
            "2026-11-23T06:05",
            recurrence="FREQ=MINUTELY;INTERVAL=7",
            mission_id=floor.empties.id,
            finish_by_minutes=6,
        )
        for minutes, act, number in story:
            floor.run(60.0 * minutes)
            floor.happen(act, number)
        floor.run(600)
        posts = floor.posts()
        floor.switch_off()
        return posts


@FEW
@example(story=[(9, "off", 3), (9, "nearly empty", 1), (1, "nearly empty", 2)])
@example(story=[(12, "removed and put back", 1), (3, "off", 2), (1, "restart", 1)])
@pytest.mark.long
@given(
    story=st.lists(st.tuples(st.integers(1, 9), st.sampled_from(GROUP_ACTS), st.integers(1, 3)), min_size=2, max_size=6)
)
def test_with_a_history_of_one_row_and_of_all_robots_of_a_group_are_sent_the_same(story):
    """The same missions to the same robots, though which one depends on how long they take and on how much each has run."""
    short, long = posts_of_group(story, 1), posts_of_group(story, None)
    assert [(robot, mission) for robot, _at, mission in short] == [(robot, mission) for robot, _at, mission in long]
    assert [at for _robot, at, _mission in short] == pytest.approx([at for _robot, at, _mission in long], abs=1.0)
