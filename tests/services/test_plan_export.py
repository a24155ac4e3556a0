"""The plan as an .ics file: to the letter of RFC 5545, read back by another hand, with UIDs that stay."""

from __future__ import annotations

import io
from datetime import UTC, date, datetime, timedelta

import icalendar
import pytest
from hypothesis import given
from hypothesis import strategies as st

from app.domain.execution import DurationEstimate
from app.domain.models import DayException, InvalidInput, Mission, Robot, Schedule
from app.services.files import plan_export
from app.services.files.plan_export import PlanFiles, write_plan
from app.services.planning.planned import PlannedRun
from tests.support.clock import VirtualClock

NOW = datetime(2026, 11, 20, 12, 38, tzinfo=UTC)  # Friday
INSTALL = "6f0f8a52-5f0e-4e6c-9d2f-000000000001"
NAMES = st.text(st.characters(exclude_categories=["Cc", "Cs", "Zl", "Zp"]), min_size=1, max_size=80)


@pytest.fixture
def clock():
    return VirtualClock(NOW)


@pytest.fixture
def container(container):
    container.first_start()
    container.catalogue.change_settings(timezone="Europe/Helsinki")
    container.catalogue.save_robot(Robot("Aino", "10.0.0.1", "user"), "secret")
    container.catalogue.save_mission(Mission("Deliver; kits, 2", "guid-1"))
    return container


@pytest.fixture
def files(container, tmp_path):
    return PlanFiles(container.db, container.catalogue, container.clock, container.plan, tmp_path)


def plan(container, **values):
    return container.catalogue.save_schedule(
        Schedule(
            **{
                "name": "Morning",
                "robot_id": 1,
                "mission_id": 1,
                "start": datetime(2026, 11, 23, 6, 30),
                "timezone": "Europe/Helsinki",
                "recurrence": "FREQ=DAILY",
                **values,
            }
        )
    )


def events_of(path):
    return icalendar.Calendar.from_ical(path.read_bytes()).events


def test_every_start_of_thirty_days_is_an_event(container, files, tmp_path):
    plan(container)
    done = files.export()
    assert (done.path, done.count, done.is_cut) == (
        tmp_path / "amr-scheduler-plan-2026-11-20.ics",
        20,
        False,
    )  # working days only
    found = events_of(done.path)
    first = found[0]
    assert first.start == datetime(2026, 11, 23, 4, 30, tzinfo=UTC)  # 06:30 in Helsinki
    assert first.end == datetime(2026, 11, 23, 4, 35, tzinfo=UTC)  # never ran: five minutes are assumed
    assert (first["SUMMARY"], first["DESCRIPTION"]) == (
        "Deliver; kits, 2 · Aino",
        "Morning: Every day at 06:30, on working days only",
    )
    assert first.DTSTAMP == NOW
    assert first["UID"].endswith("@amr-scheduler")
    assert len({event["UID"] for event in found}) == 20


def test_what_the_calendar_closes_and_what_is_paused_is_not_in_it(container, files):
    daily = plan(container)
    container.catalogue.save_days(DayException("Audit", date(2026, 11, 26), date(2026, 11, 27)))
    container.pausing.pause(daily.id, datetime(2026, 11, 24, 22, tzinfo=UTC))
    days = [f"{event.start:%Y%m%d}" for event in events_of(files.export().path)]
    assert days[:2] == ["20261125", "20261130"]


def test_the_same_start_has_the_same_uid_in_every_export(container, files):
    plan(container)
    first = [event["UID"] for event in events_of(files.export().path)]
    container.clock.step(3600)
    container.catalogue.change_settings(start_window_minutes=20)
    again = files.export()
    assert again.path.name == "amr-scheduler-plan-2026-11-20-2.ics"
    assert [event["UID"] for event in events_of(again.path)] == first


def test_without_schedules_it_is_an_empty_calendar(files):
    done = files.export()
    assert (done.count, events_of(done.path)) == (0, [])
    lines = done.path.read_bytes().split(b"\r\n")
    assert (lines[0], lines[1], lines[-2], lines[-1]) == (b"BEGIN:VCALENDAR", b"VERSION:2.0", b"END:VCALENDAR", b"")


@pytest.mark.long
def test_a_mission_every_minute_is_cut_and_says_so(container, files, monkeypatch):
    monkeypatch.setattr(plan_export, "MOST_EVENTS", 3000)  # more than the plan on screen would look through
    plan(container, recurrence="FREQ=MINUTELY", start=datetime(2026, 11, 20, 6, 0), respect_working_days=False)
    done = files.export()
    assert (done.count, done.is_cut, len(events_of(done.path))) == (3000, True, 3000)
    assert done.until == NOW + timedelta(minutes=2999)


def test_where_nothing_can_be_written_one_sentence_says_so(files, monkeypatch):
    monkeypatch.setattr(plan_export, "STEM", "nowhere/at/all")
    with pytest.raises(InvalidInput, match="there is no directory"):
        files.export()


USUAL = st.none() | st.floats(1, 90_000).map(lambda seconds: DurationEstimate(seconds, seconds))


@given(NAMES, NAMES, NAMES, st.datetimes(datetime(1971, 1, 1), datetime(2190, 1, 1)), USUAL)
def test_any_names_and_times_survive_and_every_line_is_to_the_letter(mission, robot, schedule, at, usual):
    at = at.replace(microsecond=0, tzinfo=UTC)
    rule = Schedule(schedule, 1, 1, datetime(2026, 11, 23, 6, 30), "UTC", id=7)
    run = PlannedRun(at, rule, Robot(robot, "http://a", id=1), Mission(mission, "g", id=1), usual)
    file = io.StringIO(newline="")
    write_plan(file, [run, run], INSTALL, NOW)
    text = file.getvalue()
    assert text.endswith("\r\n")
    assert all(len(part.encode()) <= 75 for part in text.split("\r\n"))
    assert "\r" not in text.replace("\r\n", "")
    assert "\n" not in text.replace("\r\n", "")
    event, same = icalendar.Calendar.from_ical(text).events
    assert event == same
    assert event["SUMMARY"] == f"{mission} · {robot}"
    assert event["DESCRIPTION"].startswith(f"{schedule}: ")
    assert event.start == at
    assert event.duration == timedelta(seconds=max(60, round(run.usual_s or 300)))
