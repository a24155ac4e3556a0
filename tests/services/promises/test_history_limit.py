"""No decision reads the history: what is sent does not depend on how much of it is kept (D5)."""
from __future__ import annotations

import tempfile
from dataclasses import replace
from datetime import UTC, datetime, timedelta
from pathlib import Path

import pytest
from hypothesis import Phase, example, given, settings
from hypothesis import strategies as st

from app.domain.models import Schedule
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
        return self.site.container.catalogue.save_schedule(Schedule(
            name=name, start=start_at(at), timezone="UTC", recurrence=recurrence, respect_working_days=True, **values))

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
    site.run(5)                                               # 06:01 counts as missed
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
ACTS = ("rename", "skip", "working days", "delete and undo", "off and on", "pause", "resume", "restart", "answer lost", "lost")


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
            changed = ("MO", "TU", "WE", "TH", "FR", "SA") if len(c.settings().working_days) == 5 else ("MO", "TU", "WE", "TH", "FR")
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
            site.network.next("POST", "/mission_queue", Fate.ANSWER_LOST if act == "answer lost" else Fate.LOST, robot="R1")


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
@given(story=st.lists(st.tuples(st.integers(1, 9), st.sampled_from(ACTS), NUMBERS), min_size=2, max_size=5), forgets=st.booleans())
def test_with_a_history_of_one_row_and_of_all_the_same_is_sent(story, forgets):
    """Two sites that differ only in how much history they keep send the same missions to the same robots at the same moments."""
    assert posts_of(story, 1, forgets) == posts_of(story, None, forgets)

