"""The page of figures in words: five figures, what each means, why runs failed, values for the charts."""

from __future__ import annotations

from dataclasses import replace
from datetime import date, timedelta

import pytest

from app.domain.execution import ReasonCode
from app.screens.logs import key_figures, numbers
from app.screens.logs.figures import Figures
from app.screens.logs.key_figures import DayBar, Point, RobotBar
from app.screens.logs.numbers import FactLine, with_interval
from app.services.history.figures import FIGURES as TABLE
from app.services.history.figures import Delays, Facts, Figure, GroupFacts, Unit, causes
from app.services.planning.durations import Band, DayMedian, Trend

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
FIGURES = Figures(FACTS, Delays([4.0] * 2 + [65.0], [1.0], [3.0]), DAYS, before=DAYS)
EMPTY = Figures()


def plain(markup):
    return markup.replace("[size=18sp][font=Roboto]", "").replace("[/font][/size]", "")


# ---------------------------------------------------------------------- the cards
def test_five_figures_with_the_days_that_are_over():
    cards = key_figures.page(FIGURES).cards
    assert [(card.label, plain(card.value)) for card in cards] == [
        ("Success", "98.1 %"),
        ("Duration", "6 min 12 s"),
        ("Missions", "58 a day"),
        ("In use", "46 %"),
        ("On time", "97.9 %"),
    ]
    assert [card.history for card in cards] == [
        (None, 1.0, 1.0, 0.75, 1.0, 1.0),
        (None, *[360.0] * 5),
        (0.0, 1.0, 2.0, 3.0, 4.0, 5.0),
        (None, *[0.5] * 5),
        (None, *[0.9] * 5),
    ]
    assert cards[2].before == (1.0, 2.0, 3.0, 4.0, 5.0, 6.0)  # as many of the period before


@pytest.mark.parametrize("figures", [None, EMPTY])
def test_what_is_not_known_is_a_dash(figures):
    assert [(card.value, card.change) for card in key_figures.page(figures).cards] == [("–", "")] * 5


def test_shares_of_a_few_cases_are_not_shown():
    few = replace(FACTS, completed=4, failed=0, planned=4, ran=4)
    assert [key_figures.value_of(key, few) == "–" for key in TABLE] == [True, False, False, False, True]


@pytest.mark.parametrize(
    ("days", "completed", "words"),
    [
        (7, 398, "▲ 1.7 vs. last week"),
        (30, 413, "▼ 1.9 vs. month before"),
        (1, 405, "– vs. yesterday"),
    ],
)
def test_a_figure_is_set_against_as_long_before_which_only_the_first_names(days, completed, words):
    earlier = replace(FACTS, completed=completed, failed=413 - completed, completed_s=170_000.0)
    last = date(2026, 11, 20)
    figures = replace(FIGURES, first_day=last - timedelta(days=days - 1), last_day=last, earlier=earlier)
    success, duration, *_others = key_figures.page(figures).cards
    assert success.change == words
    assert duration.change == "▼ 47 s"
    assert {card.change for card in key_figures.page(replace(figures, earlier=None)).cards} == {""}


def test_a_long_history_is_condensed_to_few_points():
    assert key_figures.condense([float(n) for n in range(30)]) == tuple(1.0 + 3 * n for n in range(10))
    assert key_figures.condense([1.0, None]) == (1.0, None)
    assert key_figures.condense([]) == ()


def test_each_figure_of_the_table_has_a_card_and_an_explanation(monkeypatch):
    share = Figure(
        "Cancelled by people", Unit.SHARE, lambda facts: facts.cancelled / (facts.total or 1), "Of all that ended."
    )
    monkeypatch.setitem(TABLE, "cancelled", share)
    card = key_figures.page(FIGURES).cards[-1]
    assert (card.key, card.label, plain(card.value)) == ("cancelled", "Cancelled by people", "0.5 %")
    assert numbers.explanation("cancelled", FIGURES).text == "Of all that ended."


# ---------------------------------------------------------------------- why runs failed
def test_causes_are_ranked_against_the_most_frequent_and_find_their_runs():
    found = causes(
        [
            ("robot_aborted", "Failed to reach goal position 'Dock 3'", 4),
            ("robot_aborted", "Failed to reach goal position 'Dock 1'", 2),
            ("robot_aborted", "Qwerty 17 and 'x'", 1),
            ("retry_limit", None, 3),
        ]
    )
    rows = key_figures.cause_rows(found)
    assert [(row.number, row.label) for row in rows] == [
        ("6", "Can't reach Dock 3, Dock 1"),
        ("3", "Given up after too many attempts"),
        ("1", "Qwerty 'x' and 'x'"),
    ]
    assert [row.share for row in rows] == pytest.approx([1, 0.5, 1 / 6])
    assert [row.key.part for row in rows] == ["Failed to reach goal position", "", "Qwerty"]
    others = causes([(code, None, 1) for code in ("refused", "vanished")], most=1)
    assert key_figures.cause_rows(others)[-1].key is None


# ---------------------------------------------------------------------- the charts
def test_bars_of_robots_and_days():
    aino, veikko = key_figures.robot_bars(FACTS.robots)
    assert (aino.key, aino.robot, aino.share) == (1, "Aino", "46 %")
    assert (aino.busy, aino.charging) == (pytest.approx(0.46, abs=0.01), pytest.approx(0.141, abs=0.01))
    assert veikko == RobotBar(2, "Veikko", "–", 0.0, 0.0)
    days = key_figures.outcome_days(DAYS)
    assert days[3] == DayBar(date(2026, 11, 17), "Tue", "17 Nov", 3, 2, 1)
    assert days[-1].label == "Today"
    assert key_figures.outcome_days(DAYS * 3)[3].label == "17"


def test_a_chart_of_durations_says_its_scale_and_its_days_and_leaves_gaps_open():
    days = [DayMedian(date(2026, 11, day), 1, 60.0 * day) for day in (16, 17, 19)]
    figures = Figures(
        trends=[Trend("g", "Deliver", 3, 1020.0, None, days)], first_day=date(2026, 11, 14), last_day=date(2026, 11, 20)
    )
    [row] = key_figures.page(figures).trends
    assert (row.value, row.scale, row.days) == ("17 min", ("16 min", "19 min"), ("Sat 14 Nov", "Fri 20 Nov"))
    assert [point.joined for point in row.points] == [False, True, False]
    assert (row.band, row.tone) == (None, "neutral")


def test_missions_of_one_name_on_several_robots_have_a_row_each():
    days = [DayMedian(date(2026, 11, 16), 3, 60.0)]
    rows = key_figures.page(Figures(trends=[Trend(guid, "Deliver", 3, 60.0, None, days) for guid in ("a", "b")])).trends
    assert len({row.key for row in rows}) == 2


@pytest.mark.parametrize(("median", "tone"), [(100, "neutral"), (121, "attention"), (79, "neutral")])
def test_a_mission_that_has_become_clearly_longer_is_marked(median, tone):
    trend = Trend("g", "Deliver", 3, median, Band(50, 80, 100, 120), [DayMedian(date(2026, 11, 16), 3, median)])
    [row] = key_figures.page(Figures(trends=[trend])).trends
    assert (row.tone, row.points) == (tone, (Point(0.0, median),))


# ---------------------------------------------------------------------- what they mean
@pytest.mark.parametrize("key", list(TABLE))
def test_every_figure_can_be_explained(key):
    for figures in (FIGURES, EMPTY):
        found = numbers.explanation(key, figures)
        assert found.title
        assert found.text.endswith((".", ":"))
        assert all(line.label and line.value for line in found.lines)


def test_on_time_names_the_reasons_and_few_cases_their_interval():
    rows = {line.label: line.value for line in numbers.explanation("adherence", FIGURES).lines}
    assert rows["Planned"] == "380"
    assert rows["Battery stayed under the minimum for its whole start window"] == "6"
    assert rows["Start delay, median and 90 %"] == "4 s, 1 min 05 s"
    few = replace(FIGURES, facts=replace(FACTS, completed=9, failed=1))
    assert FactLine("Few cases: probably between", "60 % and 98 %") in numbers.explanation("success", few).lines
    assert "Few cases: probably between" not in [line.label for line in numbers.explanation("success", FIGURES).lines]


def test_on_time_has_the_figures_of_groups():
    group = GroupFacts(5, "Hall 1", 104, 96, [0.4] * 5 + [25.0], [("Aino", 0.5), ("Sisu", 0.25)])
    lines = numbers.explanation("adherence", replace(FIGURES, groups=[group, GroupFacts(6, "Hall 2")])).lines
    assert [(line.label, line.value) for line in lines if line.note == "Any of Hall 1"] == [
        ("Started within 1 min of plan", "92 %"),
        ("Waited for a robot, half within", "0 s"),
        ("Nine of ten within", "25 s"),
        ("Spread of use", "25 points"),
    ]
    assert "Any of Hall 2" not in {line.note for line in lines}


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
    assert numbers.period_line(figures) == FactLine("Period", period, words)


def test_an_interval_is_shown_for_few_cases_only():
    assert with_interval("23 of 25", 23, 25) == "23 of 25 (75–98 %)"
    assert with_interval("30 of 30", 30, 30) == "30 of 30"
    assert with_interval("none", 0, 0) == "none"
