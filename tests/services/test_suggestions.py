"""Suggestions from four weeks of the ledger: found, worded, answered, suppressed, and their results."""

from __future__ import annotations

from dataclasses import replace
from datetime import UTC, datetime, time, timedelta

import pytest

from app.database.activities import ActivityRepository
from app.domain.activity import ActivitySpan
from app.domain.execution import Reason, ReasonCode, State, Trigger
from app.domain.models import Group, Mission, Robot, Schedule
from app.services.suggestions.late_schedules import Cause
from app.services.suggestions.suggestions import Kind, action, sentence
from tests.support.clock import VirtualClock
from tests.support.edits import switch_robot
from tests.support.history import add_run

NOW = datetime(2026, 11, 20, 20, 0, tzinfo=UTC)  # Friday evening


def plan(container):
    """Three robots, two of them in a group, and two schedules of the first: the kits come ten minutes after the
    waste."""
    for number, name in enumerate(("Aino", "Sisu", "Veikko"), 1):
        container.catalogue.save_robot(Robot(name, f"10.0.0.{number}", "scheduler"), "secret")
    for name in ("Kits to line 2", "Waste to compactor"):
        container.catalogue.save_mission(Mission(name, guid(name)))
    container.catalogue.save_group(Group("Hall 1", (1, 2)))
    container.catalogue.save_schedule(Schedule("Kits", 1, 1, datetime(2026, 10, 12, 7, 30), "UTC", "FREQ=DAILY"))
    container.catalogue.save_schedule(Schedule("Waste", 1, 2, datetime(2026, 10, 12, 7, 15), "UTC", "FREQ=DAILY"))


@pytest.fixture
def clock():
    return VirtualClock(NOW - timedelta(days=40))


@pytest.fixture
def container(container, clock):
    plan(container)
    clock.advance((NOW - clock.now()).total_seconds())
    return container


def guid(mission):
    return mission.lower().replace(" ", "-")


def ran(container, mission, at, begins, ends, **values):
    times = {"closes_at": at + timedelta(minutes=30), "submitted_at": at, "started_at": begins, "ended_at": ends}
    times |= {"duration_s": (ends - begins).total_seconds(), "robot_delay_s": (begins - at).total_seconds()}
    add_run(container, at, mission=mission, mission_guid=guid(mission), **times, **values)


def save_long_ago(container, schedule):
    container.clock.advance(-40 * 86_400)
    saved = container.catalogue.save_schedule(schedule)
    container.clock.advance(40 * 86_400)
    return saved


def mornings(last=NOW, count=20):
    """The working days up to then, newest first."""
    days = (last.replace(hour=0) - timedelta(days=n) for n in range(60))
    return [day for day in days if day.weekday() < 5][:count]


def at(day, minute):
    return day + timedelta(minutes=minute)


def kits(container, day, wait=0, planned=450):
    """They begin so many minutes after they were planned, at 07:30."""
    begins = at(day, planned + wait)
    values = {"schedule_id": 1, "trigger": Trigger.SCHEDULED, "schedule": "Kits"}
    ran(container, "Kits to line 2", at(day, planned), begins, begins + timedelta(minutes=5), **values)


def usually_late(container, days=None, wait=9):
    """The waste, of 07:15, takes longer than it should; the kits wait for it."""
    for day in mornings() if days is None else days:
        ran(container, "Waste to compactor", at(day, 435), at(day, 435), at(day, 450 + wait))
        kits(container, day, wait)


@pytest.fixture
def late(container):
    """Its kits are usually late."""
    usually_late(container)
    return container


@pytest.fixture
def suggestion(late):
    return only(late)


def only(container):
    [suggestion] = container.suggestions.compute().suggestions
    return suggestion


def kinds(container):
    """Of the changes that are proposed, and where they lead."""
    return [(change.kind, change.robot or change.group) for change in only(container).changes]


def test_what_often_came_late_is_said_with_its_cause_and_when_or_where_it_is_free(container, suggestion):
    assert (
        sentence(suggestion)
        == "Kits was late in 20 of its last 20 starts, typically 9 min: Aino was busy with Waste to compactor"
    )
    assert [action(change) for change in suggestion.changes] == [
        "Move to 07:40",
        "Use Sisu",
        "Any of Hall 1",
    ]
    assert container.suggestions.latest is not None


def test_each_change_is_a_schedule_that_can_be_saved_as_it_is(container, suggestion):
    drafts = [change.draft for change in suggestion.changes]
    assert container.catalogue.schedules()[0].start.time() == time(7, 30)  # nothing is changed by computing
    assert [(draft.id, draft.start.time(), draft.robot_id, draft.group_id) for draft in drafts] == [
        (1, time(7, 40), 1, None),
        (1, time(7, 30), 2, None),
        (1, time(7, 30), None, 1),
    ]
    for draft in drafts:
        assert container.catalogue.save_schedule(draft).id == 1


def changed(container, **values):
    usually_late(container)
    container.catalogue.save_schedule(replace(container.catalogue.schedules()[0], **values))


@pytest.mark.parametrize(
    "prepare",
    [
        lambda container: usually_late(container, mornings(count=9)),
        lambda container: usually_late(container, wait=4),
        lambda container: changed(container, enabled=False),
        lambda container: changed(container, start=datetime(2026, 10, 12, 7, 40)),
    ],
)
def test_too_few_late_starts_one_that_is_off_and_one_that_has_just_been_changed_are_left_alone(container, prepare):
    prepare(container)
    assert container.suggestions.compute().suggestions == ()


def test_a_robot_that_is_off_or_lacks_the_mission_is_not_proposed(late):
    switch_robot(late.catalogue, 3, False)
    late.catalogue.save_group(replace(late.catalogue.groups()[0], members=(1, 3)))
    assert kinds(late) == [(Kind.TIME, "Aino"), (Kind.ROBOT, "Sisu")]


@pytest.mark.parametrize(
    ("activity", "cause"), [("executing", Cause.OTHER), ("offline", Cause.SILENT), ("error", Cause.STOPPED)]
)
def test_what_the_robot_was_seen_doing_is_a_cause_where_none_of_ours_ran(container, activity, cause):
    for day in mornings():
        kits(container, day, wait=9)
    spans = [ActivitySpan(activity, at(day, 440), at(day, 459)) for day in mornings()]
    container.db.write(lambda c: ActivityRepository().save(c, 1, spans))
    [suggestion] = container.suggestions.compute().suggestions
    assert suggestion.finding.cause is cause
    assert "Aino" in sentence(suggestion)


def test_the_edges_of_the_apps_runs_belong_to_no_one_else(late):
    spans = [ActivitySpan("executing", at(day, 434.5), at(day, 464.8)) for day in mornings()]
    late.db.write(lambda c: ActivityRepository().save(c, 1, spans))
    [suggestion] = late.suggestions.compute().suggestions
    assert suggestion.finding.cause is Cause.BUSY
    assert action(suggestion.changes[0]) == "Move to 07:40"


def test_starts_that_were_skipped_count_but_not_those_that_a_person_or_the_tablet_left_out(container):
    def lost(code):
        for day in mornings():
            values = {"state": State.SKIPPED, "reason": Reason(code), "ended_at": at(day, 480)}
            add_run(container, at(day, 450), trigger=Trigger.SCHEDULED, schedule_id=1, **values)
        found = container.suggestions.compute().suggestions
        container.db.write(lambda c: c.execute("DELETE FROM executions"))
        return [one.finding.cause for one in found]

    assert lost(ReasonCode.BATTERY_LOW) == [Cause.BATTERY]
    assert lost(ReasonCode.OVERLAP) != []
    assert lost(ReasonCode.HOLD) == lost(ReasonCode.APP_DOWN) == lost(ReasonCode.USER_CANCELLED) == []


def test_at_most_three_at_once(container):
    daily = container.catalogue.schedules()[0]
    for number in range(2, 6):
        save_long_ago(container, replace(daily, id=None, name=f"Kits {number}"))
    for day in mornings():
        ran(container, "Waste to compactor", at(day, 435), at(day, 435), at(day, 459))
        for number in range(1, 6):
            begins = at(day, 458 + number)
            ran(
                container,
                f"Kits {number}",
                at(day, 450),
                begins,
                begins + timedelta(minutes=1),
                schedule_id=number,
                trigger=Trigger.SCHEDULED,
            )
    assert len(container.suggestions.compute().suggestions) == 3


# ---------------------------------------------------------------------- answers
def test_not_now_is_silent_for_60_days_unless_it_doubles_and_can_be_undone(container, clock):
    usually_late(container, mornings()[10:])
    for day in mornings()[:10]:
        kits(container, day)
    suggestions = container.suggestions
    [half] = suggestions.compute().suggestions
    assert (half.finding.late, half.finding.starts) == (10, 20)
    answer = suggestions.dismiss(half)
    assert suggestions.latest is None
    assert suggestions.compute().suggestions == ()
    suggestions.undo(answer)
    assert len(suggestions.compute().suggestions) == 1
    suggestions.dismiss(half)
    clock.advance(59 * 86_400)
    usually_late(container, mornings(clock.now(), 19))
    assert len(suggestions.compute().suggestions) == 1  # all of them: it has doubled
    container.db.write(lambda c: c.execute("DELETE FROM executions"))
    usually_late(container, mornings(clock.now(), 19)[1::2])
    for day in mornings(clock.now(), 19)[::2]:
        kits(container, day)
    assert suggestions.compute().suggestions == ()
    clock.advance(2 * 86_400)
    assert len(suggestions.compute().suggestions) == 1


def test_an_accepted_one_that_is_undone_is_found_again_until_the_schedule_is_changed(container, suggestion, clock):
    container.catalogue.save_schedule(suggestion.changes[0].draft)
    answer = container.suggestions.accept(suggestion, suggestion.changes[0])
    clock.advance(5)
    restored = container.catalogue.save_schedule(suggestion.schedule)
    container.suggestions.undo_change(answer, suggestion.schedule, restored)
    assert container.suggestions.compute().suggestions[0].finding == suggestion.finding
    clock.advance(5)
    container.catalogue.save_schedule(replace(suggestion.schedule, start=suggestion.schedule.start.replace(minute=20)))
    assert container.suggestions.compute().suggestions == ()


def test_after_one_was_accepted_later_starts_count_and_it_is_reported_after_two_weeks(container, suggestion, clock):
    change = suggestion.changes[0]
    container.catalogue.save_schedule(change.draft)
    container.suggestions.accept(suggestion, change)
    assert container.suggestions.compute().suggestions == ()
    clock.advance(13 * 86_400)
    for number, day in enumerate(mornings(clock.now(), 9)):
        kits(container, day, wait=9 if number == 4 else 0, planned=455)
    assert container.suggestions.compute().results == ()
    clock.advance(2 * 86_400)
    [result] = container.suggestions.compute().results
    assert (result.late, result.starts, result.before.late, result.before.starts) == (1, 9, 20, 20)
    clock.advance(60 * 86_400)
    assert container.suggestions.compute().results == ()


@pytest.mark.parametrize(
    "wrong",
    [
        "starts = 0",
        "answered_at = 'soon'",
        "answered_at = '2026-11-20'",
        "option = '['",
        "option = '[]'",
    ],
)
def test_an_answer_that_cannot_be_read_keeps_nothing_silent_and_ends_nothing(container, suggestion, wrong):
    container.suggestions.dismiss(suggestion)
    container.db.write(lambda c: c.execute(f"UPDATE suggestion_answers SET {wrong}"))
    assert len(container.suggestions.compute().suggestions) == 1


def test_rows_without_a_readable_instant_are_omitted(late):
    late.db.write(
        lambda c: ActivityRepository().save(c, 1, [ActivitySpan("error", at(mornings()[0], 1), at(mornings()[0], 2))])
    )
    late.db.write(lambda c: c.execute("UPDATE activity_spans SET ended_at = 'soon'"))
    late.db.write(lambda c: c.execute("UPDATE executions SET planned_at = '2026-11-19 soon' WHERE id IN (1, 2)"))
    assert only(late).finding.starts == 19


def test_answers_of_long_ago_are_not_kept(container, suggestion, clock):
    container.suggestions.dismiss(suggestion)
    clock.advance(181 * 86_400)
    container.suggestions.dismiss(suggestion)
    assert container.db.read().execute("SELECT count(*) FROM suggestion_answers").fetchone()[0] == 1


def test_a_schedule_several_times_a_day_is_moved_by_minutes_and_one_with_given_hours_not_at_all(container):
    hourly = save_long_ago(container, replace(container.catalogue.schedules()[0], recurrence="FREQ=HOURLY;INTERVAL=24"))
    usually_late(container)
    assert [action(change) for change in only(container).changes] == [
        "Move 10 min later",
        "Use Sisu",
        "Any of Hall 1",
    ]
    save_long_ago(container, replace(hourly, recurrence="FREQ=DAILY;BYHOUR=7,9"))
    assert Kind.TIME not in dict(kinds(container))


def test_another_time_is_proposed_only_where_something_that_is_planned_is_in_the_way(late):
    """Here the waste is started by hand, at any time."""
    late.catalogue.remove_schedule(2)
    assert kinds(late) == [(Kind.ROBOT, "Sisu"), (Kind.GROUP, "Hall 1")]


def test_a_robot_that_is_busy_then_is_not_proposed(late):
    late.catalogue.save_schedule(Schedule("Sweep", 2, 2, datetime(2026, 11, 21, 7, 30), "UTC", "FREQ=DAILY"))
    assert kinds(late) == [(Kind.TIME, "Aino"), (Kind.ROBOT, "Veikko")]


def test_where_nothing_is_free_nothing_is_said(late):
    late.catalogue.remove_schedule(2)
    for robot_id in (2, 3):
        switch_robot(late.catalogue, robot_id, False)
    assert late.suggestions.compute().suggestions == ()
