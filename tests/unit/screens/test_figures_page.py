"""The page of figures in words."""

from __future__ import annotations

from datetime import date

import pytest

from app.domain.models import ReasonCode
from app.screens.logs import more_view as view
from app.screens.logs.figures import Figures, MoreFigures
from app.screens.logs.kpi_view import with_interval
from app.services.history.figures import Delays, Facts, causes
from app.services.planning.durations import Band, DayMedian, Trend


@pytest.mark.parametrize(
    ("ran", "planned", "text"),
    [
        (0, 0, "Nothing was planned"),
        (23, 25, "92.0 % of 25 planned (75–98 %)"),
        (25, 25, "100 % of 25 planned (87–100 %)"),
        (90, 94, "95.7 % of 94 planned"),
    ],
)
def test_adherence_with_its_count_and_with_few_cases_how_far_it_holds(ran, planned, text):
    assert view.adherence_head(Facts(planned=planned, ran=ran)) == text


def test_an_interval_is_shown_for_few_cases_only():
    assert with_interval("23 of 25", 23, 25) == "23 of 25 (75–98 %)"
    assert with_interval("30 of 30", 30, 30) == "30 of 30"
    assert with_interval("none", 0, 0) == "none"


def test_reasons_of_not_running_with_their_share_of_what_was_planned():
    rows = view.adherence_rows(Facts(planned=50, ran=47, not_run={ReasonCode.BATTERY_LOW: 2, ReasonCode.APP_DOWN: 1}))
    assert [(row.label, row.value, row.note) for row in rows] == [
        ("Battery stayed under the minimum for its whole start window", "2", "4.0 %"),
        ("The app was off or asleep", "1", "2.0 %"),
    ]


def test_each_cause_has_its_own_share_and_what_the_robot_named():
    found = causes(
        [
            ("robot_aborted", "No way to 'Dock 3'", 4),
            ("robot_aborted", "No way to 'Dock 1'", 2),
            ("retry_limit", None, 3),
            ("refused", None, 1),
        ]
    )
    rows = view.cause_rows(found)
    assert [(row.value, row.note) for row in rows] == [("6", "60 %"), ("3", "30 %"), ("1", "10 %")]
    assert [row.share for row in rows] == pytest.approx([0.6, 0.3, 0.1])
    assert (rows[0].label, rows[0].detail, rows[1].detail) == ("No way to …", "Dock 3 ×4, Dock 1 ×2", "")
    assert view.cause_summary(found) == "The first 2 reasons make up 90 % of all failures."
    assert view.cause_head(found) == "10 failed runs"


def test_no_words_where_all_reasons_are_needed():
    assert view.cause_summary(causes([("refused", None, 5)])) == ""
    assert view.cause_summary([]) == "No run failed."


@pytest.mark.parametrize(
    ("median", "beginning", "tone"),
    [
        (100, "As usual", "neutral"),
        (107, "A little longer", "neutral"),
        (93, "A little shorter", "neutral"),
        (121, "Clearly longer", "attention"),
        (79, "Clearly shorter", "neutral"),
    ],
)
def test_a_median_is_set_against_the_usual_band(median, beginning, tone):
    trend = Trend("g", "Deliver", 3, median, Band(50, 80, 100, 120), [DayMedian(date(2026, 11, 16), 3, median)])
    [row] = view.trend_rows([trend], date(2026, 11, 14), date(2026, 11, 18))
    assert row.note.startswith(beginning)
    assert row.note.endswith("1 min 40 s (1 min 20 s to 2 min)")
    assert row.tone == tone
    assert row.points == (view.Point(0.5, median),)
    assert bool(row.icon) == ("Clearly" in beginning)


def test_without_a_history_before_nothing_is_called_usual():
    trend = Trend("g", "Deliver", 1, 60.0, None, [DayMedian(date(2026, 11, 16), 1, 60.0)])
    [row] = view.trend_rows([trend], None, None)
    assert (row.note, row.band, row.points) == ("No earlier period to compare with", None, (view.Point(0, 60.0),))


def test_a_chart_of_durations_says_its_scale_and_its_days_and_leaves_gaps_open():
    days = [DayMedian(date(2026, 11, day), 1, 60.0 * day) for day in (16, 17, 19)]
    [row] = view.trend_rows([Trend("g", "Deliver", 3, 1020.0, None, days)], date(2026, 11, 14), date(2026, 11, 20))
    assert (row.scale, row.days) == (("16 min", "19 min"), ("Sat 14 Nov", "Fri 20 Nov"))
    assert [point.joined for point in row.points] == [False, True, False]


@pytest.mark.parametrize(("waited", "drawn"), [(1.0, 0.0), (40.0, 0.2)])
def test_a_share_that_is_hardly_anything_is_a_sentence_and_no_bar(waited, drawn):
    delays = Delays([5, 5, 9], [1], [4], [160.0 if drawn else 249.0], waited)
    page = view.page(Figures(delays=delays), MoreFigures())
    assert page.queue_share == drawn
    assert page.waiting.text.startswith("Of the time from submission to end, ")


def test_waiting_against_running_in_words():
    delays = Delays([5, 5, 9], [1], [4], [80.0, 80.0], 40.0)
    assert view.waiting_text(delays) == "Of the time from submission to end, 20.0 % was waiting in the queue."
    assert [row.value for row in view.delay_rows(delays)] == ["5 s", "9 s", "4 s", "1 min 20 s"]
    assert view.delay_rows(Delays()) == ()
