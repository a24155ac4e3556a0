"""What workers record of robots' work, on a whole site: it is what is shown, and costs few writes."""

from __future__ import annotations

import pytest

from app.database.activities import ActivityRepository
from app.domain.activity import NO_DATA
from app.domain.execution import State
from app.services.history.runs import RobotStates

POLL = 30.0


@pytest.fixture
def saves(monkeypatch) -> list[int]:
    """How many spans each write had."""
    found: list[int] = []
    save = ActivityRepository.save

    def counted(self, c, robot_id, spans):
        found.append(len(spans))
        save(self, c, robot_id, spans)

    monkeypatch.setattr(ActivityRepository, "save", counted)
    return found


def seen(site, start):
    [timeline] = RobotStates(site.container.db).timelines(start, site.clock.now())
    return timeline


def test_a_mission_shows_as_a_span_between_idle_ones(site, plan, saves):
    start = site.clock.now()
    plan("2026-11-23T06:05")
    site.run_until(lambda: site.executions(State.COMPLETED))
    site.run(300)
    [run] = site.executions()
    timeline = seen(site, start)
    spans = [span for span in timeline.spans if span.activity != NO_DATA]
    assert [span.activity for span in spans] == ["idle", "executing", "idle"]
    assert abs((spans[1].start - run.started_at).total_seconds()) <= POLL
    assert abs((spans[1].end - run.ended_at).total_seconds()) <= POLL
    assert timeline.seconds["executing"] == pytest.approx(
        site.container.kpis.facts().robots[0].observed_s - timeline.seconds["idle"], abs=2 * POLL
    )
    minutes = (site.clock.now() - start).total_seconds() / 60
    assert len(saves) <= minutes + 5  # once a minute, and when something changed


def test_an_hour_of_idleness_is_one_row(site, saves):
    start = site.clock.now()
    site.run(3600)
    stored = ActivityRepository().between(site.container.db.read(), 1, start, site.clock.now())
    assert [activity for activity, *_ in stored] == ["idle"]
    assert len(saves) <= 62


def test_an_absent_robot_is_offline_and_an_app_that_was_off_knows_nothing(site):
    start = site.clock.now()
    site.run(300)
    site.network.down.add("R1")
    site.run(600)
    site.network.down.clear()
    site.run(300)
    site.switch_off()
    site.clock.advance(1800)
    site.switch_on()
    site.run(300)
    timeline = seen(site, start)
    order = [span.activity for span in timeline.spans if span.seconds > 2 * POLL]
    assert order == ["idle", "offline", "idle", NO_DATA, "idle"]
    assert timeline.seconds["offline"] == pytest.approx(600, abs=2 * POLL)
    assert timeline.seconds[NO_DATA] == pytest.approx(1800, abs=3 * POLL)
