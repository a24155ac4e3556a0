"""The words of the Logs from plain values: rows, stories, filters, figures."""

from dataclasses import astuple, replace
from datetime import UTC, date, datetime, timedelta
from zoneinfo import ZoneInfo

import pytest

from app.database.executions import Replacement
from app.domain.models import DurationEstimate, Execution, Reason, ReasonCode, Robot, State, Trigger, Wait
from app.domain.robot import MissionParameter
from app.i18n import translator
from app.screens.common.mission_names import MissionNames
from app.screens.logs import kpi_view, view
from app.screens.logs.facts import execution_filter, period_with
from app.screens.logs.figures import Figures
from app.screens.logs.kpi_view import DayBar, FactLine
from app.screens.logs.view import UNDER_WAY, Filters, Period
from app.services.history.figures import Delays, Facts, Figure, Unit

ZONE = ZoneInfo("Europe/Helsinki")
NOW = datetime(2026, 11, 20, 12, 38, tzinfo=UTC)
PLANNED = datetime(2026, 11, 20, 11, 30, tzinfo=UTC)  # 13:30 local
USUAL = {(1, "g"): 360.0}
DONE = Execution(
    trigger=Trigger.SCHEDULED,
    robot_id=1,
    robot="Aino",
    mission="Deliver kits",
    mission_guid="g",
    planned_at=PLANNED,
    created_at=PLANNED,
    closes_at=PLANNED + timedelta(minutes=15),
    token="t",
    timezone="Europe/Helsinki",
    id=7,
    schedule_id=3,
    schedule="Kits",
    state=State.COMPLETED,
    attempts=1,
    queue_id=14026,
    submitted_at=PLANNED + timedelta(seconds=2),
    started_at=PLANNED + timedelta(seconds=9),
    ended_at=PLANNED + timedelta(seconds=387),
    duration_s=378.0,
    robot_delay_s=7.0,
)
FAILED = replace(
    DONE,
    state=State.FAILED,
    reason=Reason(ReasonCode.ROBOT_ABORTED, {"message": "Failed to reach goal position 'Dock 3'"}),
)
SKIPPED = replace(
    DONE,
    state=State.SKIPPED,
    attempts=0,
    queue_id=None,
    submitted_at=None,
    started_at=None,
    duration_s=None,
    robot_delay_s=None,
    reason=Reason(ReasonCode.BATTERY_LOW, {"battery": 12, "minimum": 30, "until": "2026-11-20T11:45:00+00:00"}),
)


GOAL = "a1c4e008-5d0f-11ef-93c1-0001297b6e20"
TO_DOCK = MissionNames({"g": (MissionParameter("goal", "Position", choices=((GOAL, "Dock 3"),), sets="position"),)})


# ---------------------------------------------------------------------- rows
def test_a_run_shows_its_values():
    run = replace(DONE, parameters={"goal": GOAL})
    row = view.row(run, NOW, ZONE, USUAL, opened=True, mission_names=TO_DOCK)
    assert (row.mission, row.message) == ("Deliver kits · Dock 3", "Position: Dock 3\nQueue item 14026 of the robot")
    cache = view.RowCache()
    assert [
        cache.rows([run], NOW, ZONE, USUAL, None, {}, {}, mission_names)[0].mission
        for mission_names in (MissionNames(), TO_DOCK)
    ] == [
        "Deliver kits",
        "Deliver kits · Dock 3",
    ]


def test_a_completed_run_says_when_how_long_and_only_what_was_unusual():
    row = view.row(DONE, NOW, ZONE, USUAL, opened=False)
    assert (row.outcome, row.tone, row.mission, row.robot, row.trigger) == (
        "Completed",
        "done",
        "Deliver kits",
        "Aino",
        "Schedule",
    )
    assert (row.when, row.took, row.reason) == ("13:30", "6 min 18 s", "")
    assert (row.steps, row.message) == ((), "")


@pytest.mark.parametrize(
    ("changes", "usual", "line"),
    [
        ({}, {}, ""),
        ({}, USUAL, ""),
        ({"duration_s": 600.0}, USUAL, "Longer than usual"),
        ({"duration_s": 60.0}, USUAL, "Shorter than usual"),
        ({"submitted_at": PLANNED + timedelta(minutes=4)}, USUAL, "Started 4 min late"),
        ({"robot_delay_s": 300.0}, {}, "Started 5 min late"),
        (
            {"submitted_at": PLANNED + timedelta(minutes=4), "duration_s": 600.0},
            USUAL,
            "Started 4 min late, longer than usual",
        ),
        ({"trigger": Trigger.MANUAL}, {}, ""),
        ({"trigger": Trigger.IDLE}, USUAL, ""),
        ({"trigger": Trigger.IDLE, "duration_s": 600.0}, USUAL, "Longer than usual"),
    ],
)
def test_the_reason_line_of_a_completed_run(changes, usual, line):
    assert view.reason_line(replace(DONE, **changes), ZONE, usual) == line


def test_a_failed_run_says_why_and_an_open_one_what_it_waits_for():
    assert view.reason_line(SKIPPED, ZONE, USUAL) == "Battery 12 % stayed under 30 % until 13:45"
    waiting = replace(
        SKIPPED, state=State.WAITING, reason=None, wait=Wait.BATTERY, wait_details={"battery": 12, "minimum": 30}
    )
    assert view.reason_line(waiting, ZONE, USUAL) == "Battery 12 % is under 30 %; waits until 13:45"
    assert view.row(SKIPPED, NOW, ZONE, USUAL, opened=False).took == "–"


def test_a_run_of_another_day_has_its_date():
    shown = [
        view.row(replace(DONE, planned_at=PLANNED - timedelta(days=days)), NOW, ZONE, USUAL, False).when
        for days in (1, 6, 7, 400)
    ]
    assert shown == ["Thu 13:30", "Sat 13:30", "13 Nov 13:30", "16 Oct 2025 14:30"]


# ---------------------------------------------------------------------- the story
def test_only_what_has_changed_is_built_again(monkeypatch):
    cache, made = view.RowCache(), []
    row = view.row
    monkeypatch.setattr(view, "row", lambda execution, *args: (made.append(execution.id), row(execution, *args))[1])
    runs = [replace(DONE, id=n) for n in range(5)]

    def rows(runs, now=NOW, usual=USUAL, opened=None):
        made.clear()
        found = cache.rows(runs, now, ZONE, usual, opened, {}, {})
        assert found == [row(run, now, ZONE, usual, run.id == opened) for run in runs]
        return list(made)

    assert rows(runs) == [0, 1, 2, 3, 4]
    assert rows([replace(run) for run in runs], NOW + timedelta(minutes=1)) == []
    assert rows([replace(FAILED, id=9), *runs]) == [9]
    assert rows([replace(FAILED, id=9), replace(FAILED, id=0), *runs[1:]]) == [0]
    assert rows(runs[1:], opened=3) == [3]
    assert rows(runs[1:]) == [3]
    assert rows(runs[1:], usual={}) == [1, 2, 3, 4]
    assert rows(runs[1:], NOW + timedelta(days=1), {}) == [1, 2, 3, 4]


@pytest.fixture
def finnish():
    yield lambda: translator.use("fi")
    translator.use("en")


def test_rows_are_built_again_in_another_language(finnish):
    """It is switched in Settings, which does not notify the Logs."""
    cache = view.RowCache()

    def outcomes():
        return [row.outcome for row in cache.rows([DONE], NOW, ZONE, USUAL, None, {}, {})]

    assert outcomes() == ["Completed"]
    finnish()
    assert outcomes() == ["Suoritettu"]


def test_a_story_has_four_steps_and_ends_in_its_outcome():
    row = view.row(FAILED, NOW, ZONE, USUAL, opened=True)
    assert [(step.label, step.time, step.note) for step in row.steps] == [
        ("Planned", "13:30:00", "Kits"),
        ("Submitted", "13:30:02", "1 attempt"),
        ("Started", "13:30:09", "after 7 s in the queue"),
        ("Failed", "13:36:27", "after 6 min 18 s"),
    ]
    assert [step.tone for step in row.steps] == ["neutral", "neutral", "neutral", "fault"]
    assert [step.last for step in row.steps] == [False, False, False, True]
    assert row.message == "Robot: Failed to reach goal position 'Dock 3' (queue item 14026)"


def test_a_completed_story_compares_with_the_usual_duration():
    assert view.story(DONE, ZONE, USUAL)[-1].note == "after 6 min 18 s, usually 6 min"
    assert view.message(DONE) == "Queue item 14026 of the robot"


def test_a_story_ends_where_the_run_ended():
    assert [step.label for step in view.story(SKIPPED, ZONE, USUAL)] == ["Planned", "Not run"]
    refused = replace(SKIPPED, state=State.FAILED, attempts=3, reason=Reason(ReasonCode.RETRY_LIMIT))
    assert [(step.label, step.time) for step in view.story(refused, ZONE, USUAL)] == [
        ("Planned", "13:30:00"),
        ("Tried", "3 attempts"),
        ("Failed", "13:36:27"),
    ]
    running = replace(DONE, state=State.EXECUTING, ended_at=None, duration_s=None, robot_delay_s=0.2)
    assert [(step.label, step.note) for step in view.story(running, ZONE, USUAL)][2:] == [
        ("Started", "no wait"),
        ("Working", "not ended yet"),
    ]
    assert view.message(SKIPPED) == ""


def test_one_row_for_missed_starts_says_how_many_and_is_planned_for_the_last():
    missed = replace(
        SKIPPED,
        state=State.MISSED,
        starts=2016,
        reason=Reason(
            ReasonCode.APP_DOWN, {"starts": 2016, "first": "2026-11-06T11:30:00+00:00", "last": PLANNED.isoformat()}
        ),
    )
    row = view.row(missed, NOW, ZONE, USUAL, opened=True)
    assert (row.reason, row.when) == ("Missed 2,016 starts, 6–20 November: the app was off or asleep", "13:30")
    assert (row.steps[0].time, row.steps[0].note) == ("13:30:00", "the last of 2,016 · Kits")


def test_a_story_says_that_a_person_had_it_started_on_another_robot():
    doubted, run = (
        replace(DONE, id=4, started_at=None, ended_at=None, duration_s=None, state=State.SUBMITTING),
        replace(DONE, id=5),
    )
    found = Replacement(4, "Aino", 5, "Veikko", PLANNED + timedelta(minutes=2))
    step = view.story(doubted, ZONE, USUAL, replacement=found)[2]
    assert (step.label, step.time, step.note) == ("Elsewhere", "13:32:00", "a person started it on Veikko instead")
    steps = view.story(run, ZONE, USUAL, replacement=found)
    assert [step.label for step in steps] == ["Planned", "Submitted", "Started", "Completed"]
    assert steps[0].note == view.story(run, ZONE, USUAL)[0].note + " · instead of the start on Aino"


def test_a_story_that_was_found_late_has_the_times_of_the_robot():
    """The tablet was off and saw the run only after it was over."""
    found = DONE.ended_at + timedelta(minutes=40)
    seen = replace(DONE, started_at=found, ended_at=found)
    assert [(step.label, step.time, step.note) for step in view.story(seen, ZONE, USUAL)][1:] == [
        ("Submitted", "13:30:02", "1 attempt"),
        ("Started", "13:30:09", "after 7 s in the queue"),
        ("Completed", "13:36:27", "after 6 min 18 s, usually 6 min · seen at 14:16:27"),
    ]
    started = replace(DONE, ended_at=found)  # it saw it start, and then was off
    assert [step.time for step in view.story(started, ZONE, USUAL)] == ["13:30:00", "13:30:02", "13:30:09", "13:36:27"]
    runs = replace(DONE, state=State.EXECUTING, started_at=found, ended_at=None, duration_s=None)
    assert [step.time for step in view.story(runs, ZONE, USUAL)] == ["13:30:00", "13:30:02", "13:30:09", "–"]


def test_a_story_over_several_days_has_their_dates():
    midnight = replace(
        DONE,
        planned_at=PLANNED + timedelta(hours=10, minutes=29),
        submitted_at=PLANNED + timedelta(hours=10, minutes=29),
        started_at=None,
        ended_at=PLANNED + timedelta(hours=10, minutes=31),
    )
    assert [step.time for step in view.story(midnight, ZONE, USUAL)] == [
        "Fri 20 Nov 23:59:00",
        "Fri 20 Nov 23:59:00",
        "Sat 21 Nov 00:01:00",
    ]
    tomorrow = PLANNED + timedelta(days=1)
    ahead = replace(
        SKIPPED, planned_at=tomorrow, ended_at=tomorrow, reason=Reason(ReasonCode.HOLD, {"skipped_at": NOW.isoformat()})
    )
    assert [(step.label, step.time) for step in view.story(ahead, ZONE, USUAL)] == [
        ("Planned", "Sat 21 Nov 13:30:00"),
        ("Not run", "Fri 20 Nov 14:38:00"),
    ]
    later_today = replace(ahead, planned_at=PLANNED + timedelta(hours=5), ended_at=PLANNED + timedelta(hours=5))
    assert [step.time for step in view.story(later_today, ZONE, USUAL)] == ["18:30:00", "14:38:00"]


@pytest.mark.parametrize(
    ("expected", "note"),
    [
        (DurationEstimate(360.0, 400.0, (360.0,)), "not ended yet, usually 6 min"),
        (DurationEstimate(1500.0, 1500.0, typed=True), "not ended yet, 25 min as typed in Settings"),
    ],
)
def test_an_open_run_says_how_long_it_will_take_and_how_that_is_known(expected, note):
    running = replace(DONE, state=State.EXECUTING, ended_at=None, duration_s=None)
    row = view.row(running, NOW, ZONE, USUAL, opened=True, expected=expected)
    assert row.steps[-1].note == note


# ---------------------------------------------------------------------- filters
def test_periods_are_whole_local_days():
    assert view.period_start(Period.TODAY, NOW, ZONE) == datetime(2026, 11, 19, 22, 0, tzinfo=UTC)
    assert view.period_start(Period.WEEK, NOW, ZONE) == datetime(2026, 11, 13, 22, 0, tzinfo=UTC)
    assert view.period_start(Period.MONTH, NOW, ZONE) == datetime(
        2026, 10, 21, 21, 0, tzinfo=UTC
    )  # before the clock change
    assert view.period_start(Period.ALL, NOW, ZONE) is None


@pytest.mark.parametrize(
    ("ago", "period"),
    [
        (timedelta(hours=1), Period.TODAY),
        (timedelta(days=2), Period.WEEK),
        (timedelta(days=20), Period.MONTH),
        (timedelta(days=300), Period.ALL),
        (timedelta(hours=-3), Period.TODAY),
        (timedelta(hours=-10), Period.ALL),
    ],
)
def test_the_shortest_period_with_an_instant(ago, period):
    assert period_with(NOW - ago, NOW, ZONE) is period


def test_the_filters_become_those_of_the_history():
    filters = Filters(Period.TODAY, 2, ("failed", UNDER_WAY), "Deliver kits", (Trigger.IDLE,), " dock ")
    wanted = execution_filter(filters, NOW, ZONE)
    assert (wanted.robot_ids, wanted.mission, wanted.triggers, wanted.text) == (
        (2,),
        "Deliver kits",
        (Trigger.IDLE,),
        "dock",
    )
    assert set(wanted.states) == {State.FAILED, State.WAITING, State.SUBMITTING, State.QUEUED, State.EXECUTING}
    [not_run] = [option.key for option in view.outcome_options() if option.text == "Not run"]
    assert view.Filters(outcomes=(not_run,)).states == (State.SKIPPED, State.MISSED)
    assert (wanted.start, wanted.end) == (
        datetime(2026, 11, 19, 22, 0, tzinfo=UTC),
        datetime(2026, 11, 20, 22, 0, tzinfo=UTC),
    )
    everything = execution_filter(Filters(Period.ALL), NOW, ZONE)
    assert (everything.robot_ids, everything.states, everything.start, everything.end) == (None, None, None, None)


def test_chips_say_what_is_filters():
    assert (view.outcome_chip(Filters()), view.trigger_chip(Filters()), view.mission_chip(Filters())) == ("", "", "")
    assert view.outcome_chip(Filters(outcomes=("failed",))) == "Failed"
    assert view.outcome_chip(Filters(outcomes=("failed", "skipped"))) == "2 outcomes"
    assert view.trigger_chip(Filters(triggers=(Trigger.IDLE, Trigger.MANUAL))) == "Run now, Idle"
    assert view.mission_chip(Filters(mission="x" * 80)) == "One mission"
    assert view.robot_chip(Filters(robot_id=2), [Robot("Aino", "", id=1), Robot("Veikko", "", id=2)]) == "Veikko"
    assert view.robot_chip(Filters(), []) == "All robots"


def test_the_list_says_how_many_it_has_and_what_to_do_when_it_is_empty():
    assert view.count_text(423, Filters()) == "423 runs, newest first"
    assert view.count_text(3, Filters(text="dock")) == "3 found, newest first"
    assert view.empty_texts(Filters(Period.ALL))[0] == "Nothing has run yet"
    assert view.empty_texts(Filters(text="dock"))[0] == "Nothing found"
    assert not Filters(Period.TODAY, 1).narrow_list


# ---------------------------------------------------------------------- figures
AINO = Facts(405, 8, 2, mission_s=150_000.0, observed_s=326_000.0, charging_s=46_000.0, robot_id=1, robot="Aino")
FACTS = Facts(
    405,
    8,
    2,
    timed=405,
    completed_s=150_660.0,
    mission_s=150_000.0,
    planned=380,
    ran=372,
    not_run={ReasonCode.BATTERY_LOW: 6, ReasonCode.HOLD: 2},
    recorded_days=7,
    observed_s=326_000.0,
    robots=(AINO, Facts(robot_id=2, robot="Veikko")),
)
DAYS = tuple(
    Facts(
        completed=n,
        failed=1 if n == 3 else 0,
        skipped=1,
        missed=1,
        timed=n,
        completed_s=360.0 * n,
        planned=10 if n else 0,
        ran=9 if n else 0,
        recorded_days=1,
        mission_s=360.0,
        observed_s=720.0 if n else 0.0,
        day=date(2026, 11, 14 + n),
    )
    for n in range(7)
)
FIGURES = Figures(FACTS, Delays([4.0] * 2 + [65.0], [1.0], [3.0]), DAYS)
EMPTY = Figures()
FIGURE_KEYS = list(kpi_view.FIGURES)


def plain(markup):
    return markup.replace("[size=18sp][font=Roboto]", "").replace("[/font][/size]", "")


def test_five_cards_each_with_its_count():
    cards = kpi_view.cards(FIGURES)
    assert [(card.label, plain(card.value), card.note) for card in cards] == [
        ("Success rate", "98.1 %", "405 of 413 ended runs"),
        ("Mean duration", "6 min 12 s", "405 completed runs"),
        ("Missions per day", "58", "7 recorded days"),
        ("Utilisation", "46 %", "of 3 d 18 h observed"),
        ("Schedule adherence", "97.9 %", "372 of 380 planned"),
    ]
    assert cards[0].history == (None, 1.0, 1.0, 0.75, 1.0, 1.0, 1.0)
    assert cards[1].history == (None, 360.0, 360.0, 360.0, 360.0, 360.0, 360.0)
    assert cards[2].history == (0.0, 1.0, 2.0, 3.0, 4.0, 5.0, 6.0)
    assert cards[3].history == (None, *[0.5] * 6)
    assert cards[4].history == (None, *[0.9] * 6)


@pytest.mark.parametrize(
    ("days", "before", "words"),
    [
        (7, 398, "+1.7 points against the 7 days before"),
        (30, 413, "−1.9 points against the 30 days before"),
        (1, 405, "Same as yesterday at this time"),
        (7, 405, "As in the 7 days before"),
        (1, 413, "−1.9 points against yesterday at this time"),
    ],
)
def test_a_figure_is_set_against_the_same_days_before(days, before, words):
    earlier = replace(FACTS, completed=before, failed=413 - before)
    figures = replace(
        FIGURES, first_day=date(2026, 11, 20) - timedelta(days=days - 1), last_day=date(2026, 11, 20), earlier=earlier
    )
    assert kpi_view.cards(figures)[0].change == words
    assert kpi_view.cards(replace(figures, earlier=None))[0].change == ""


@pytest.mark.parametrize(
    ("kept", "first", "words", "period"),
    [
        (date(2026, 11, 15), date(2026, 10, 22), "Runs kept since Sun 15 Nov", "Thu 22 Oct – Fri 20 Nov"),
        (date(2026, 10, 22), date(2026, 10, 22), "", "Thu 22 Oct – Fri 20 Nov"),
        (date(2026, 11, 15), None, "Runs kept since Sun 15 Nov", "Sun 15 Nov – Fri 20 Nov"),
        (date(2025, 3, 2), None, "Runs kept since Sun 2 Mar 2025", "Sun 2 Mar 2025 – Fri 20 Nov"),
        (None, None, "", "up to Fri 20 Nov"),
    ],
)
def test_a_period_that_begins_before_the_history_says_so(kept, first, words, period):
    figures = replace(FIGURES, first_day=first, last_day=date(2026, 11, 20), kept_since=kept)
    assert kpi_view.reach(figures) == words
    assert kpi_view.reach(figures, narrow_list=True) == " · ".join(
        filter(None, ("Figures also count the runs left out", words))
    )
    assert kpi_view.period_line(figures) == FactLine("Period", period, words)


def test_another_figure_is_one_more_row(monkeypatch):
    half = Figure("Half", Unit.SHARE, lambda facts: facts.completed / facts.total, "Of all that ended.")
    monkeypatch.setitem(kpi_view.FIGURES, "half", half)
    card = kpi_view.cards(Figures(Facts(completed=1, skipped=1), days=[Facts(completed=1)] * 2))[-1]
    assert (card.label, plain(card.value), card.history) == ("Half", "50.0 %", (1.0, 1.0))
    assert kpi_view.explanation("half", Figures()).text == "Of all that ended."


def test_without_anything_recorded_every_figure_is_a_dash():
    assert [(card.value, card.note) for card in kpi_view.cards(EMPTY)] == [
        ("–", "no run has ended"),
        ("–", "no completed run"),
        ("–", "no recorded day"),
        ("–", "never observed"),
        ("–", "nothing was planned"),
    ]


def test_a_long_history_is_condensed_to_few_points():
    assert kpi_view.condense([float(n) for n in range(31)]) == (*(1.0 + 3 * n for n in range(10)), 30.0)
    assert kpi_view.condense([1.0, None]) == (1.0, None)
    assert kpi_view.condense([None] * 29 + [4.0])[-2:] == (None, 4.0)  # today is not mixed with days that have ended
    assert kpi_view.condense([]) == ()


def test_each_figure_of_the_table_has_a_card_with_history_change_and_explanation(monkeypatch):
    share = Figure(
        "Cancelled by people", Unit.SHARE, lambda facts: facts.cancelled / (facts.total or 1), "Of all that ended."
    )
    monkeypatch.setitem(kpi_view.FIGURES, "cancelled", share)
    figures = replace(
        FIGURES, first_day=date(2026, 11, 14), last_day=date(2026, 11, 20), earlier=replace(FACTS, cancelled=10)
    )
    card = kpi_view.cards(figures)[-1]
    assert (card.key, card.label, plain(card.value)) == ("cancelled", "Cancelled by people", "0.5 %")
    assert (len(card.history), card.change) == (7, "−1.9 points against the 7 days before")
    assert kpi_view.explanation("cancelled", figures).text == "Of all that ended."


@pytest.mark.parametrize("key", FIGURE_KEYS)
def test_every_figure_can_be_explained(key):
    for figures in (FIGURES, EMPTY):
        found = kpi_view.explanation(key, figures)
        assert found.title
        assert found.text.endswith((".", ":"))
        assert all(line.label and line.value for line in found.lines)


def test_adherence_names_the_reasons_and_few_cases_their_interval():
    rows = {line.label: line.value for line in kpi_view.explanation("adherence", FIGURES).lines}
    assert rows["Planned"] == "380"
    assert rows["Battery stayed under the minimum for its whole start window"] == "6"
    assert rows["Start delay, median and 90 %"] == "4 s, 1 min 05 s"
    few = replace(FIGURES, facts=replace(FACTS, completed=9, failed=1))
    assert FactLine("Few cases: probably between", "60 % and 98 %") in kpi_view.explanation("success", few).lines
    assert "Few cases: probably between" not in [line.label for line in kpi_view.explanation("success", FIGURES).lines]


def test_bars_compare_robots_and_days():
    aino, veikko = kpi_view.utilisation_bars(FIGURES)
    assert astuple(aino) == ("Aino", "46 %", "1 d 17 h", pytest.approx(0.46, abs=0.01), pytest.approx(0.141, abs=0.01))
    assert veikko == kpi_view.RobotBar("Veikko", "–", "–", 0.0, 0.0)
    assert kpi_view.total_note(FIGURES) == "1 d 17 h total"
    assert kpi_view.outcome_days(DAYS)[3] == DayBar("Tu", 3, 2, 1, 0, "Tue 17 Nov")
    assert kpi_view.outcome_days(DAYS * 3)[3].label == "17"
