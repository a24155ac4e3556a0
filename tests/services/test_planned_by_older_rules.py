"""Starts planned by rules of an older version, or with older zone data, follow the present ones: nothing twice, nothing
lost."""

from __future__ import annotations

from datetime import UTC, datetime, timedelta

import pytest

from app.domain import rules
from app.domain.execution import Reason, ReasonCode, State
from app.domain.models import Schedule
from tests.support.site import Site

MONDAY = datetime(2026, 11, 23, tzinfo=UTC)  # 02:00 in Helsinki, where it is winter
HOUR = timedelta(hours=1)


def at(hour: int) -> datetime:
    """A full hour of Helsinki on that day."""
    return MONDAY + (hour - 2) * HOUR


@pytest.fixture
def site(tmp_path):
    site = Site(tmp_path, now=at(4))
    site.add_robots()
    site.add_mission("Deliver")
    site.container.catalogue.change_settings(poll_interval_seconds=1800)  # days soon pass
    yield site
    site.switch_off()


def skip(site, c, schedule, at):
    """As a person does in advance: the row in the history, and the note in the plan."""
    repositories, now = site.container.repositories, site.clock.now()
    robot, mission = repositories.robots.get(c, schedule.robot_id), repositories.missions.get(c, schedule.mission_id)
    row = rules.scheduled(
        schedule, robot, mission, repositories.settings.load(c), repositories.settings.install_id(c), at, now
    )
    repositories.executions.add_once(c, rules.ended(row, Reason(ReasonCode.HOLD, {"skipped_at": now.isoformat()}), at))
    repositories.schedules.skip(c, schedule.id, at)


def restarted(
    site, schedule, next_at, planned_through, changed_at=datetime(2026, 5, 2, tzinfo=UTC), skipped=(), held=()
):
    """The next instant after a start on what an older version has stored."""
    saved = site.container.catalogue.save_schedule(schedule)
    site.container.db.write(lambda c: [skip(site, c, saved, at) for at in skipped])
    site.container.db.write(lambda c: [site.container.repositories.schedules.hold(c, saved.id, at) for at in held])
    values = [each and each.isoformat(timespec="microseconds") for each in (next_at, planned_through, changed_at)]
    site.container.db.write(
        lambda c: c.execute("UPDATE schedules SET next_at = ?, planned_through = ?, changed_at = ?", values)
    )
    site.switch_off()
    site.switch_on()
    return site.container.repositories.schedules.get(site.container.db.read(), saved.id).next_at


def every_eight_hours():
    return Schedule(
        "S", 1, 1, datetime(2026, 5, 2, 6), "Europe/Helsinki", "FREQ=HOURLY;INTERVAL=8", respect_working_days=False
    )


@pytest.mark.parametrize(
    ("last", "stored", "hour"),
    [
        (at(-3), at(5), 6),  # 21 and 05 o'clock in elapsed time are 22 and 06
        (at(5), at(13), 14),
    ],
)
def test_each_start_takes_the_place_of_the_one_by_the_old_rule(site, last, stored, hour):
    assert restarted(site, every_eight_hours(), stored, last) == at(hour)


def test_one_that_has_never_come_counts_from_when_it_was_changed(site):
    assert restarted(site, every_eight_hours(), at(5), None, changed_at=at(4)) == at(6)


def test_what_is_planned_right_stays(site):
    assert restarted(site, every_eight_hours(), at(6), at(-2)) == at(6)


def test_what_was_due_while_the_app_was_off_is_not_lost(site):
    """Two days ago; each start since then gets its row."""
    assert restarted(site, every_eight_hours(), at(5 - 48), at(-3 - 48)) == at(6 - 48)


@pytest.mark.long
def test_a_day_that_was_closed_since_stays_due(site):
    schedule = Schedule("S", 1, 1, datetime(2026, 5, 2, 6), "Europe/Helsinki", "FREQ=DAILY")
    sunday = at(6) - 24 * HOUR
    assert restarted(site, schedule, sunday, None) == sunday


def test_other_zone_data(site):
    """An hour later by the old ones: in winter Vancouver was 8 h behind UTC until 2026."""
    schedule = Schedule(
        "S", 1, 1, datetime(2026, 5, 2, 6), "America/Vancouver", "FREQ=DAILY", respect_working_days=False
    )
    assert restarted(site, schedule, MONDAY + 14 * HOUR, MONDAY - 10 * HOUR) == MONDAY + 13 * HOUR


@pytest.mark.long
def test_a_single_start_follows_the_zone_data_too(site):
    schedule = Schedule("S", 1, 1, datetime(2026, 12, 1, 6), "America/Vancouver", respect_working_days=False)
    assert restarted(site, schedule, datetime(2026, 12, 1, 14, tzinfo=UTC), None) == datetime(
        2026, 12, 1, 13, tzinfo=UTC
    )


def started(site, after=0.0):
    """When R1 got its missions, and what was skipped."""
    site.run(after)
    return (
        [row.planned_at for row in site.executions() if row.state is State.COMPLETED],
        [row.planned_at for row in site.executions() if row.state is State.SKIPPED],
    )


def test_a_skipped_start_stays_skipped_at_its_new_time(site):
    assert restarted(site, every_eight_hours(), at(13), at(-3), skipped=[at(5)]) == at(14)
    assert started(site, after=14 * 3600) == ([at(14)], [at(6)])


@pytest.mark.long
def test_several_skipped_starts_in_a_row_stay_so(site):
    assert restarted(site, every_eight_hours(), at(21), at(-3), skipped=[at(5), at(13)]) == at(22)


@pytest.mark.long
def test_a_skip_that_moved_can_be_undone(site):
    restarted(site, every_eight_hours(), at(13), at(-3), skipped=[at(5)])
    site.container.pausing.unskip(1, at(6))
    assert started(site, after=4 * 3600) == ([at(6)], [])


def test_a_start_that_is_held_stays_so_at_its_new_time(site):
    restarted(site, every_eight_hours(), at(5), at(-3), held=[at(5)])
    site.run(2.1 * 3600)
    assert [(row.planned_at, row.state, row.held) for row in site.executions()] == [(at(6), State.WAITING, True)]


@pytest.mark.long
def test_a_skip_after_the_last_start_of_the_rule_moves_back(site):
    schedule = Schedule(
        "S", 1, 1, datetime(2026, 5, 2, 6), "America/Vancouver", "FREQ=DAILY;UNTIL=20261124", respect_working_days=False
    )
    first, last = MONDAY + 13 * HOUR, MONDAY + 37 * HOUR
    assert restarted(site, schedule, first + HOUR, MONDAY - 10 * HOUR, skipped=[last + HOUR]) == first
    assert started(site, after=48 * 3600) == ([first], [last])


@pytest.mark.long
def test_what_an_edit_left_behind_is_not_taken_for_a_skip_of_a_schedule_that_is_planned_right(site):
    assert restarted(site, every_eight_hours(), at(6), at(-2), skipped=[at(13)]) == at(6)
    assert started(site, after=12 * 3600)[0] == [at(6), at(14)]
