"""Figures of groups."""

from __future__ import annotations

from dataclasses import replace
from datetime import timedelta

import pytest

from app.database.execution_history import ExecutionFilter, ExecutionHistory
from app.database.groups import GroupRepository
from app.domain.execution import Reason, ReasonCode, State, Trigger
from app.domain.models import Group
from app.screens.logs import report_page
from app.services.history.figures import GroupFacts, line
from app.services.history.kpis import KpiFilter
from app.services.history.shift_report import ReportPeriod, ShiftReports
from tests.support.kpi_world import NOON


@pytest.fixture(autouse=True)
def hall(world):
    world.db.write(lambda c: GroupRepository().add(c, Group("Hall 1", (1, 2), id=7)))


def start(world, hours, *, bound=0.0, sent=1.0, queued=0.0, state=State.COMPLETED, **values):
    """A start of the group: its robot was chosen ``bound`` s after its instant, which had it ``sent`` s after that, and ``queued`` it."""
    at = NOON + timedelta(hours=hours)
    bound_at = at + timedelta(seconds=bound)
    return world.row(
        state,
        hours,
        **{
            "group_id": 7,
            "robot_group": "Hall 1",
            "bound_at": bound_at,
            "submitted_at": bound_at + timedelta(seconds=sent),
            "robot_delay_s": queued,
            "duration_s": 300.0,
            "ended_at": bound_at + timedelta(seconds=sent + queued + 300),
            **values,
        },
    )


def lost(world, hours, code, **values):
    reason = Reason(code)
    return world.row(
        reason.state, hours, group_id=7, robot_group="Hall 1", reason=reason, robot_id=None, robot="", **values
    )


def test_starts_within_a_minute_and_waits_for_a_robot(world):
    for number, bound in enumerate((0, 0, 0, 20, 50, 58.9, 60, 200, 400, 1000)):
        start(world, -number - 1, bound=bound)
    start(world, -11, bound=0, queued=60)  # chosen at once, but stood in its queue
    [found] = world.kpis.groups()
    assert (found.group, found.starts, found.in_time, len(found.waits)) == ("Hall 1", 11, 6, 11)
    assert (found.value("wait_half"), found.value("wait_most")) == (pytest.approx(50), pytest.approx(400))
    assert found.value("in_time") == pytest.approx(6 / 11)


def test_unrun_starts_count_unless_a_person_or_the_tablet_is_the_reason(world):
    start(world, -1)
    for code in (
        ReasonCode.NO_ROBOT,
        ReasonCode.FINISH_BY,
        ReasonCode.PLACE_BUSY,
        ReasonCode.BATTERY_LOW,
        ReasonCode.OVERLAP,
    ):
        lost(world, -2, code)
    for code in (
        ReasonCode.HOLD,
        ReasonCode.USER_CANCELLED,
        ReasonCode.SCHEDULE_CHANGED,
        ReasonCode.APP_DOWN,
        ReasonCode.ROBOT_REMOVED,
    ):
        lost(world, -3, code)
    start(world, -4, state=State.CANCELLED, reason=Reason(ReasonCode.USER_CANCELLED))  # while it ran
    [found] = world.kpis.groups()
    assert (found.starts, found.in_time, len(found.waits)) == (7, 2, 2)


def test_only_planned_starts_of_groups_in_the_period_and_on_the_robots_count(world):
    start(world, -1)
    start(world, -30, robot_id=2)
    start(world, -1, trigger=Trigger.MANUAL)
    world.row(State.COMPLETED, -1, submitted_at=NOON)
    kpis = world.kpis
    assert [one.starts for one in kpis.groups(KpiFilter(start=NOON - timedelta(days=1)))] == [1]
    assert [one.starts for one in kpis.groups(KpiFilter(robot_ids=(2,)))] == [1]
    assert kpis.groups(KpiFilter(robot_ids=())) == kpis.groups(KpiFilter(start=NOON + timedelta(days=1))) == []


def test_the_use_of_its_robots_and_how_far_apart_they_are(world):
    start(world, -1, duration_s=3600.0)
    start(world, -2, robot_id=2, robot="Aino", duration_s=1800.0)
    for robot_id in (1, 2):
        world.observe(robot_id, "2026-11-23", idle=7200.0)
    [found] = world.kpis.groups(robots=world.kpis.facts().robots)
    assert (dict(found.used), found.value("spread")) == ({"Bella": 0.5, "Aino": 0.25}, 0.25)
    assert line(found) == (
        "Hall 1: 2 of 2 within 1 min of plan · waited for a robot: half 0 s, nine of ten 0 s · use of its robots 25–50 %"
    )
    assert line(replace(found, used=(), waits=())) == "Hall 1: 2 of 2 within 1 min of plan"
    assert GroupFacts(1, "x").value("in_time") is None


def test_a_group_that_was_removed_keeps_its_name_and_figures(world):
    start(world, -1)
    world.observe(1, "2026-11-23", idle=7200.0)
    world.db.write(lambda c: GroupRepository().remove(c, 7, world.clock.now()))
    [found] = world.kpis.groups(robots=world.kpis.facts().robots)
    assert (found.group, found.starts, [robot for robot, _share in found.used]) == ("Hall 1", 1, ["Bella"])


def test_the_shift_report_has_the_groups_of_its_period(world):
    start(world, -1)
    reports = ShiftReports(world.db, world.clock)
    assert [one.starts for one in reports.make(ReportPeriod.SHIFT).groups] == [1]
    assert reports.make(ReportPeriod.YESTERDAY).groups == []


# ---------------------------------------------------------------------- the runs of a group alone
def hall_and_others(world):
    """Hall 1: three runs, by plan and by hand, one failure and two without a robot. Others: runs of the same robots."""
    of_hall = {"robot_group": "Hall 1", "group_id": 7}
    world.row(
        State.COMPLETED, -2, duration_s=100.0, submitted_at=NOON - timedelta(hours=2), robot_delay_s=30.0, **of_hall
    )
    world.row(State.COMPLETED, -26, duration_s=300.0, robot_id=2, robot="Aino", **of_hall)
    world.row(State.COMPLETED, -3, duration_s=200.0, trigger=Trigger.MANUAL, schedule_id=None, **of_hall)
    world.row(State.FAILED, -1, **of_hall)
    world.row(State.FAILED, -4, robot_id=None, robot="", reason=Reason(ReasonCode.NO_ROBOT), **of_hall)
    world.row(State.SKIPPED, -5, robot_id=None, robot="", reason=Reason(ReasonCode.FINISH_BY), **of_hall)
    for hours in range(1, 6):
        world.row(
            State.COMPLETED,
            -hours,
            duration_s=1000.0,
            mission_guid="other",
            robot_delay_s=900.0,
            submitted_at=NOON - timedelta(hours=hours),
        )
        world.row(State.FAILED, -hours, robot_group="Office", group_id=8)
    return KpiFilter(robot_ids=(1, 2), group="Hall 1")


def test_the_figures_of_a_group_are_of_the_runs_that_its_list_has(world):
    wanted, kpis = hall_and_others(world), world.kpis
    thesis, days = kpis.facts(wanted), kpis.per_day(wanted)
    assert (thesis.completed, thesis.failed, thesis.completed_s, thesis.timed, thesis.recorded_days) == (
        3,
        2,
        600.0,
        3,
        2,
    )
    listed = sum(ExecutionHistory().counts(world.db.read(), ExecutionFilter(group="Hall 1")).values())
    assert sum(day.total for day in days) == thesis.completed + thesis.failed + 1 == listed
    assert [(day.completed, day.failed, day.skipped) for day in days] == [(1, 0, 0), (2, 2, 1)]
    assert (kpis.facts(wanted).planned, kpis.facts(wanted).ran) == (5, 3)
    assert (len(kpis.delays(wanted).starts), kpis.delays(wanted).value("delay_half")) == (1, 30.0)
    assert {cause.code: cause.number for cause in kpis.failures(wanted)} == {
        ReasonCode.ROBOT_ABORTED: 1,
        ReasonCode.NO_ROBOT: 1,
    }
    assert len(kpis.not_completed(wanted)) == 3
    assert [(trend.guid, trend.count) for trend in kpis.trends(wanted)] == [("g", 3)]


def test_figures_of_a_group_include_all_work_of_its_robots(world):
    wanted = hall_and_others(world)
    assert world.kpis.facts(wanted).robots == world.kpis.facts(KpiFilter(robot_ids=(1, 2))).robots


def test_starts_that_ended_without_a_robot_count_on_their_day_and_by_reason(world):
    hall_and_others(world)
    assert sum(day.total for day in world.kpis.per_day()) == 16
    assert ReasonCode.NO_ROBOT in {cause.code for cause in world.kpis.failures()}


def test_the_shift_report_of_a_group_is_of_its_runs(world):
    wanted = hall_and_others(world)
    report = ShiftReports(world.db, world.clock).make(ReportPeriod.WEEK, group="Hall 1", members=wanted.robot_ids)
    assert (report.group, report.facts.completed, report.facts.failed, report.facts.skipped, len(report.runs)) == (
        "Hall 1",
        3,
        2,
        1,
        3,
    )
    assert report.more_runs == 0
    assert [(group.group, group.starts) for group in report.groups] == [("Hall 1", 5)]
    assert "Any of Hall 1" in report_page.page(report)
    assert len(report.timelines) == 2
