"""No decision reads the history: what is sent does not depend on how much of it is kept (D5)."""

from __future__ import annotations

import tempfile
from dataclasses import replace
from datetime import UTC, datetime, timedelta
from pathlib import Path

import pytest
from hypothesis import Phase, example, given, settings
from hypothesis import strategies as st

from app.domain.models import Schedule, State
from tests.support.groups import Hall
from tests.support.network import Fate
from tests.support.seen import sent_at
from tests.support.site import Site


def start_at(text):
    return datetime.fromisoformat(f"2026-11-23T{text}")


class Plant:
    """Two robots, of which R2 works all the time, so that a short history soon forgets everything about R1."""

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


@pytest.fixture
def plant(tmp_path):
    plant = Plant(tmp_path, 1)
    yield plant
    plant.site.switch_off()


def test_a_start_that_ran_does_not_run_again_when_its_schedule_is_renamed(plant):
    """A one-time start is done, whether or not its row is still kept."""
    site, once = plant.site, plant.plan("Once", "06:05")
    site.run(720)
    site.container.catalogue.save_schedule(replace(once, name="Once more"))
    site.run(300)
    assert sent_at(site, "R1") == [300]


def test_a_skipped_start_stays_skipped_when_the_plan_is_made_anew(plant):
    """Skip next holds, whether or not its row is still kept."""
    site, daily = plant.site, plant.plan("Daily", "06:20", "FREQ=DAILY")
    site.container.pausing.skip_next(daily.id)
    site.run(720)
    site.container.catalogue.change_settings(working_days=("MO", "TU", "WE", "TH", "FR", "SA"))
    site.run(600)
    assert sent_at(site, "R1") == []


def test_a_skipped_start_stays_skipped_when_its_schedule_is_deleted_and_put_back(plant):
    """Undo gives back what was skipped, too."""
    site, daily = plant.site, plant.plan("Daily", "06:20", "FREQ=DAILY")
    site.container.pausing.skip_next(daily.id)
    site.run(720)
    removed = site.container.catalogue.remove_schedule(daily.id)
    site.run(10)
    site.container.catalogue.restore(removed)
    site.run(600)
    assert sent_at(site, "R1") == []


def test_a_start_skipped_beyond_others_stays_skipped(plant):
    """As when a clock that was ahead is set back: starts come before the skipped one then."""
    site, often = plant.site, plant.plan("Often", "06:01", "FREQ=MINUTELY;INTERVAL=8", start_window_minutes=1)
    site.clock.step(200)
    site.run(5)  # 06:01 counts as missed
    assert site.container.pausing.skip_next(often.id) == datetime(2026, 11, 23, 6, 9, tzinfo=UTC)
    site.clock.step(-200)
    site.run(1100)
    assert sent_at(site, "R1") == [60, 1020]


def test_the_idle_mission_runs_once_in_each_idle_period(plant):
    """A robot that nobody has used since stays where its idle mission has put it."""
    site = plant.site
    site.container.catalogue.save_idle_rule(plant.r1.id, plant.home.id, after_minutes=5)
    site.run(2400)
    assert len(sent_at(site, "R1")) == 1


def test_a_robot_that_loses_tokens_is_known_however_old_its_last_item_is(plant):
    """Whether a robot gives descriptions back is remembered of the robot, not read from old rows."""
    site = plant.site
    site.network.forgets_descriptions = True
    plant.plan("First", "06:05")
    plant.plan("Second", "06:15")
    site.run(600)
    site.network.next("POST", "/mission_queue", Fate.ANSWER_LOST, robot="R1")
    site.run(700)
    assert sent_at(site, "R1") == [300, 900]


# ---------------------------------------------------------------------- the same for everything a person may do
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
            c.pausing.skip_next(schedule.id)
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
            c.catalogue.set_schedule_enabled(schedule.id, False)
            c.catalogue.set_schedule_enabled(schedule.id, True)
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
        plant.site.container.catalogue.save_idle_rule(plant.r1.id, plant.home.id, after_minutes=5)
        plant.plan("Once", "06:05")
        plant.plan("Often", "06:08", "FREQ=MINUTELY;INTERVAL=12")
        for minutes, act, number in story:
            plant.site.run(60.0 * minutes)
            carry_out(plant, act, number)
        plant.site.run(300)
        posts = plant.posts()
        plant.site.switch_off()
        return posts


@settings(max_examples=4, phases=[Phase.explicit, Phase.generate])
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
    """Starts for any of three robots, some of which have to be done in time. R3's own ones make a short history forget all others."""

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


@pytest.mark.parametrize("limit", [1, None])
def test_how_long_a_robot_runs_is_known_however_short_the_history(tmp_path, limit):
    """Its battery is enough for a mission that it ran four times, of which the history keeps nothing."""
    floor = Floor(tmp_path, limit)
    floor.only("R1", "R3")
    floor.plan("Learn", recurrence="FREQ=MINUTELY;INTERVAL=3;COUNT=4", robot_id=floor.robot("R1").id, group_id=None)
    floor.container.catalogue.edit(lambda edit: edit.save_group(replace(floor.group, members=floor.group.members[:2])))
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


@settings(max_examples=4, phases=[Phase.explicit, Phase.generate])
@example(story=[(9, "off", 3), (9, "nearly empty", 1), (1, "nearly empty", 2)])
@example(story=[(12, "removed and put back", 1), (3, "off", 2), (1, "restart", 1)])
@given(
    story=st.lists(st.tuples(st.integers(1, 9), st.sampled_from(GROUP_ACTS), st.integers(1, 3)), min_size=2, max_size=6)
)
def test_with_a_history_of_one_row_and_of_all_robots_of_a_group_are_sent_the_same(story):
    """The same missions to the same robots, though which one depends on how long they take and on how much each has run."""
    short, long = posts_of_group(story, 1), posts_of_group(story, None)
    assert [(robot, mission) for robot, _at, mission in short] == [(robot, mission) for robot, _at, mission in long]
    assert [at for _robot, at, _mission in short] == pytest.approx([at for _robot, at, _mission in long], abs=1.0)


# ---------------------------------------------------------------------- robots that forget whose an item is
@pytest.fixture
def forgetful(plant):
    """By mission, user and number it is judged there which item is a start's, and so by which ones others have."""
    plant.site.network.forgets_descriptions = True
    plant.site.container.catalogue.change_settings(poll_interval_seconds=600)
    return plant


def missions_of(plant):
    plant.site.machines["R1"].catch_up()
    return len([item for item in plant.site.machines["R1"].queue if item.finished])


def test_an_item_of_a_start_that_is_forgotten_is_not_taken_for_a_later_one(forgetful):
    """The later one's first try was refused, and before its second one the robot is asked what it has of it."""
    site = forgetful.site
    forgetful.plan("Earlier", "06:05")
    forgetful.plan("Later", "06:10")
    site.run(598)
    assert "Earlier" not in [row.schedule for row in site.executions()]
    site.network.next("POST", "/mission_queue", Fate.REFUSED, robot="R1")
    site.run(120)
    assert missions_of(forgetful) == 2


def test_nor_is_that_of_one_that_ran_while_the_other_waited_for_its_second_try(forgetful):
    site = forgetful.site
    forgetful.plan("Waits", "06:05", minimum_battery_percent=50, start_window_minutes=60)
    forgetful.plan("Runs", "06:06")
    site.run(298)
    site.network.next("POST", "/mission_queue", Fate.REFUSED, robot="R1")
    site.run(2.5)
    site.machines["R1"].set_battery(30)
    site.run(600)
    assert missions_of(forgetful) == 1
    site.machines["R1"].set_battery(90)
    site.run(240)
    assert missions_of(forgetful) == 2


def test_nor_where_any_robot_of_a_group_may_have_the_other(tmp_path):
    """It was given back by one that refused the connection, and waits for none in particular."""
    hall = Hall(tmp_path, robots=2)
    hall.container.catalogue.change_settings(history_limit=1, poll_interval_seconds=600)
    hall.network.forgets_descriptions = True
    hall.plan("Waits", "2026-11-23T06:05", minimum_battery_percent=50, start_window_minutes=60)
    for minute in (12, 13, 14):
        for name in hall.machines:
            hall.plan(
                f"Runs on {name} at {minute}", f"2026-11-23T06:{minute}", group_id=None, robot_id=hall.robot(name).id
            )
    hall.run(299.5)
    hall.network.next("POST", "/mission_queue", Fate.REFUSED, count=2)
    hall.run(1)
    hall.run_until(lambda: len(hall.run_of("Waits").tried) == 2, within=30)
    for machine in hall.machines.values():
        machine.set_battery(30)
    hall.run(780)
    assert len(hall.items()) == 6
    for machine in hall.machines.values():
        machine.set_battery(90)
    hall.run(240)
    assert len(hall.items()) == 7
    hall.switch_off()
