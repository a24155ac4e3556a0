"""The shift report: figures of the KPI service, a page without other files, and nothing in it but text where text was meant."""

from __future__ import annotations

import re
from dataclasses import replace
from datetime import UTC, datetime, timedelta
from html import unescape

import pytest

from app.domain.execution import Reason, ReasonCode, State, Trigger
from app.domain.models import Alarm, Priority
from app.i18n import translator
from app.screens.common.mission_names import MissionNames
from app.screens.logs import report_page
from app.services.history.kpis import KpiFilter
from app.services.history.shift_report import LINES, SHIFT, ReportPeriod, ShiftReports, bounds, split_lines
from tests.support import month
from tests.support.html_page import Strict
from tests.support.kpi_world import HELSINKI, NOON, World

EVIL = "<script>alert('x')</script> & \"Deliver\""


@pytest.fixture
def world(tmp_path):
    world = World(tmp_path)
    yield world
    world.db.close()


@pytest.fixture
def container(tmp_path):
    container = month.plant(tmp_path / "data")
    yield container
    container.close()


# ---------------------------------------------------------------------- its period
@pytest.mark.parametrize(
    ("period", "start", "end"),
    [
        (ReportPeriod.SHIFT, NOON - SHIFT, NOON),
        (ReportPeriod.TODAY, datetime(2026, 11, 22, 22, tzinfo=UTC), NOON),
        (ReportPeriod.YESTERDAY, datetime(2026, 11, 21, 22, tzinfo=UTC), datetime(2026, 11, 22, 22, tzinfo=UTC)),
        (ReportPeriod.WEEK, datetime(2026, 11, 16, 22, tzinfo=UTC), NOON),
    ],
)
def test_a_period_begins_at_a_local_midnight_or_eight_hours_ago(period, start, end):
    assert bounds(period, NOON, HELSINKI) == (start, end)


def test_yesterday_of_a_clock_change_has_25_hours():
    start, end = bounds(ReportPeriod.YESTERDAY, datetime(2026, 10, 26, 12, tzinfo=UTC), HELSINKI)
    assert end - start == timedelta(hours=25)


# ---------------------------------------------------------------------- its figures
@pytest.mark.parametrize("period", list(ReportPeriod))
@pytest.mark.parametrize("robot_id", [None, 1])
def test_its_figures_are_those_of_the_kpi_service(container, period, robot_id):
    report = ShiftReports(container.db, container.clock).make(period, robot_id)
    until = None if report.end == container.clock.now() else report.end
    wanted = KpiFilter(report.start, until, None if robot_id is None else (robot_id,))
    kpis = container.kpis
    assert (report.facts, report.delays) == (kpis.facts(wanted), kpis.delays(wanted))
    assert report.causes == kpis.failures(wanted)
    days = kpis.per_day(wanted)
    assert (report.facts.skipped, report.facts.missed) == (
        sum(day.skipped for day in days),
        sum(day.missed for day in days),
    )
    assert len(report.runs) + report.more_runs == sum(day.total - day.completed for day in days)
    texts = " ".join(Strict(report_page.page(report)).cells).replace("\N{NO-BREAK SPACE}", " ")
    assert f"{report.facts.completed} of {report.facts.completed + report.facts.failed} ended runs" in texts
    for robot in report.facts.robots:
        assert robot.robot in texts


def test_on_the_screen_it_has_the_same_figures_robots_and_runs(container):
    report = ShiftReports(container.db, container.clock).make(ReportPeriod.WEEK)
    shown = report_page.on_screen(report)
    lines = {line.label: line for line in shown.lines}
    assert (
        f"{report.facts.completed} of {report.facts.completed + report.facts.failed} ended runs"
        in lines["Success rate"].note
    )
    assert {robot.robot for robot in report.facts.robots} <= lines.keys()
    assert {run.mission for run in report.runs} <= lines.keys()
    assert f"and {report.more_runs} more in the log" in lines or not report.more_runs


def test_a_robot_is_observed_for_the_period_at_most(container):
    """The observed time is kept by whole days; a shift uses the spans."""
    report = ShiftReports(container.db, container.clock).make(ReportPeriod.SHIFT)
    for robot in report.facts.robots:
        seconds = next(one for one in report.timelines if one.robot_id == robot.robot_id).seconds
        assert robot.observed_s == pytest.approx(8 * 3600 - seconds.get("offline", 0) - seconds.get("no_data", 0))


def test_late_starts_are_counted(world):
    for n, late in enumerate((5, 61, 400)):
        at = NOON - timedelta(hours=n)
        world.row(State.COMPLETED, -n, submitted_at=at + timedelta(seconds=late - 1), robot_delay_s=1.0)
    world.row(State.COMPLETED, submitted_at=NOON + timedelta(hours=1), trigger=Trigger.MANUAL, robot_delay_s=1.0)
    assert world.kpis.delays().late == 2


def test_alarms_of_the_period_and_of_the_robot(container):
    now = container.clock.now()
    for code, key, hours, ended in (
        ("unreachable", "robot:1", 3, 2),
        ("unreachable", "robot:2", 2, None),
        ("app_was_off", "app", 1, 1),
        ("robot_error", "robot:1", 40, 39),
    ):
        cleared = None if ended is None else now - timedelta(hours=ended)
        alarm = Alarm(
            code,
            key,
            Priority.MEDIUM,
            now - timedelta(hours=hours),
            {"robot": "Aino", "problem": EVIL},
            last_at=now - timedelta(hours=hours),
            cleared_at=cleared,
        )
        container.db.write(lambda c, alarm=alarm: container.repositories.alarms.raise_once(c, alarm))
    reports = ShiftReports(container.db, container.clock)
    assert [alarm.key for alarm in reports.make(ReportPeriod.SHIFT).alarms] == ["app", "robot:2", "robot:1"]
    assert [alarm.key for alarm in reports.make(ReportPeriod.SHIFT, 1).alarms] == ["app", "robot:1"]
    assert len(reports.make(ReportPeriod.WEEK, 1).alarms) == 3
    Strict(report_page.page(reports.make(ReportPeriod.WEEK)))


# ---------------------------------------------------------------------- one page
@pytest.mark.parametrize(
    ("runs", "alarms", "expected"),
    [
        (0, 0, (0, 0)),
        (3, 2, (3, 2)),
        (40, 0, (12, 0)),
        (0, 40, (0, 12)),
        (40, 40, (6, 6)),
        (40, 2, (10, 2)),
        (2, 40, (2, 10)),
        (6, 7, (6, 6)),
    ],
)
def test_runs_and_alarms_share_the_lines_of_a_page(runs, alarms, expected):
    assert split_lines(runs, alarms, 12) == expected


def test_much_trouble_is_cut_to_one_page_and_the_rest_counted(container):
    now = container.clock.now()
    failed = next(run for run in container.kpis.not_completed() if run.state is State.FAILED)
    for n in range(30):
        at = now - timedelta(minutes=5 * n + 20)
        row = replace(failed, id=0, token=f"again {n}", planned_at=at, ended_at=at + timedelta(minutes=1))
        alarm = Alarm("unreachable", f"robot:1:{n}", Priority.MEDIUM, at, {"robot": "Aino"}, last_at=at)
        container.db.write(
            lambda c, row=row, alarm=alarm: (
                container.repositories.executions.add_each_once(c, [row])[0],
                container.repositories.alarms.raise_once(c, alarm),
            )
        )
    report = ShiftReports(container.db, container.clock).make(ReportPeriod.SHIFT)
    robots = len(report.facts.robots)
    assert len(report.runs) == len(report.alarms) == (LINES - 2 * robots) // 2
    cells = Strict(report_page.page(report)).cells
    assert f"and {report.more_runs} more in the log" in cells
    assert f"and {30 - len(report.alarms)} more" in cells
    assert report.more_alarms == 30 - len(report.alarms)


def test_a_failure_is_named_with_its_values(world):
    dock = "a1c4e008-5d0f-11ef-93c1-0001297b6e20"
    world.row(
        State.FAILED, -1, mission="Go to position", parameters={"goal": dock}, reason=Reason(ReasonCode.ROBOT_ABORTED)
    )
    report = ShiftReports(world.db, world.clock).make(ReportPeriod.SHIFT)
    assert "Go to position · Dock 3" in Strict(report_page.page(report, MissionNames(names={dock: "Dock 3"}))).cells


# ---------------------------------------------------------------------- its page
def rows_under(page: str, title: str) -> list[list[str]]:
    """Cells of the table with that heading, its head first."""
    section = next(part for part in page.split("<section>") if f"<h2>{title}</h2>" in part)
    return [
        [unescape(re.sub("<[^>]+>", "", cell)) for cell in re.findall("<t[hd][^>]*>(.*?)</t[hd]>", row)]
        for row in re.findall("<tr[^>]*>(.*?)</tr>", section)
    ]


def test_failed_and_cancelled_runs_are_separate_for_each_robot(container):
    report = ShiftReports(container.db, container.clock).make(ReportPeriod.WEEK)
    head, *rows = rows_under(report_page.page(report), "Robots")
    table = {row[0]: dict(zip(head, row, strict=True)) for row in rows if len(row) == len(head)}
    for robot in report.facts.robots:
        line = table[robot.robot]
        numbers = [robot.completed, robot.failed, robot.cancelled]
        assert [line[name] for name in ("Completed", "Failed", "Cancelled")] == [str(number) for number in numbers]


def test_deviations_of_a_robot_are_below_it_over_the_whole_width(container):
    report = ShiftReports(container.db, container.clock).make(ReportPeriod.WEEK)
    page = report_page.page(report)
    below = [row[1] for row in rows_under(page, "Robots") if len(row) == 2]
    assert len(below) == len(report.facts.robots)
    assert all("Charging\N{NO-BREAK SPACE}" in text for text in below)  # a number is never separated from its unit
    assert page.count('<tr class="more"><td></td><td colspan="7">') == len(below)


def test_values_times_and_names_never_break(container):
    page = report_page.page(ShiftReports(container.db, container.clock).make(ReportPeriod.WEEK))
    assert ".figure b { font-size: 14pt; line-height: 1.2; white-space: nowrap }" in page
    assert "td.short { white-space: nowrap }" in page
    section = page.split("<h2>Not completed</h2>")[1].split("</table>")[0]
    row = section.split("<tr>")[2]
    assert [kind or "" for kind in re.findall(r'<td(?: class="(\w+)")?>', row)] == [
        "short",
        "short",
        "some",
        "short",
        "",
    ]


def test_a_mission_named_like_a_script_stays_text(world):
    world.row(State.FAILED, -1, mission=EVIL, robot=EVIL, reason=Reason(ReasonCode.ROBOT_ABORTED, {"message": EVIL}))
    world.clock.advance(3600)
    page = report_page.page(ShiftReports(world.db, world.clock).make(ReportPeriod.SHIFT))
    found = Strict(page)
    assert "script" not in found.elements
    assert EVIL in found.cells
    assert "<script" not in page


def test_the_page_stands_alone(container):
    page = report_page.page(ShiftReports(container.db, container.clock).make(ReportPeriod.WEEK))
    found = Strict(page)
    assert {"script", "link", "img", "iframe", "object"}.isdisjoint(found.elements)
    assert not [name for name, _ in found.attributes if name in ("src", "href") or name.startswith("on")]
    assert "url(" not in page
    assert "@import" not in page
    assert "://" not in page
    assert "@media print" in page
    assert "size: A4" in page


@pytest.fixture
def finnish():
    translator.use("fi")
    yield
    translator.use("en")


def test_it_speaks_the_language_of_the_app(container, finnish):
    page = report_page.page(ShiftReports(container.db, container.clock).make(ReportPeriod.TODAY))
    assert '<html lang="fi">' in page
    assert "Vuororaportti" in Strict(page).cells


def test_an_empty_shift_says_so(world):
    found = Strict(report_page.page(ShiftReports(world.db, world.clock).make(ReportPeriod.SHIFT)))
    assert {"Nothing ran.", "There was none.", "–"} <= set(found.cells)
