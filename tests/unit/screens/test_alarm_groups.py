"""One cause, one line: robots that fall silent together share one, and nothing else does."""
from __future__ import annotations

from dataclasses import replace
from datetime import timedelta

import pytest

from app.domain.models import Alarm
from app.screens.common.alarm_groups import APART, group_entry, group_note, group_text, together
from app.screens.common.alarms_view import Act
from app.screens.frame.facts import OpenIssues
from app.screens.frame.view import banner, issue_entry, open_issues
from tests.support.alarms import alarm
from tests.support.home_facts import NOW, SETTINGS, ago


def silent(n: int, apart: timedelta = timedelta(seconds=20), **values) -> list[Alarm]:
    """``n`` robots, one after the other, the first 36 minutes ago."""
    return [alarm("unreachable", f"robot:{i}", id=i, raised_at=ago(minutes=36) + i * apart, details={"robot": f"R{i}"}, **values)
            for i in range(1, n + 1)]


def sizes(alarms) -> list[int]:
    return sorted(map(len, together(alarms, NOW)))


def test_many_that_fall_silent_together_are_one_line_in_list_and_banner():
    issues = OpenIssues(silent(14))
    [issue] = open_issues(issues, {}, SETTINGS, NOW)
    assert issue.view.text == "Wi-Fi: 14 robots unreachable since 14:02"
    assert issue.view.note == "is the access point on, and this tablet on its network? · R1, R2, R3 …"
    assert (issue.view.action, issue.view.act, issue.view.about) == ("Show all", Act.SHOW_ALARMS, 1)
    assert banner(issues, {}, SETTINGS, NOW) == issue.view
    entry = issue_entry(issue, {}, SETTINGS, NOW)
    assert (entry.key, entry.text, entry.action, entry.fold) == (("group", 1), issue.view.text, "Acknowledge", "chevron-down")
    assert issue_entry(issue, {}, SETTINGS, NOW, unfolded=True).fold == "chevron-up"


@pytest.mark.parametrize(("alarms", "expected"), [
    (silent(2), [1, 1]),                                                             # these may have failed themselves
    (silent(5, apart=APART + timedelta(seconds=1)), [1] * 5),
    ([*silent(3), *silent(3, acknowledged_at=NOW)], [3, 3]),
    ([*silent(3), *silent(4, cleared_at=NOW)], [3, 4]),
    ([*silent(3), *silent(3, shelved_until=NOW + timedelta(hours=1))], [3, 3]),
    ([alarm("robot_error", f"robot:{n}", id=n) for n in range(1, 5)], [1] * 4)])
def test_what_has_another_cause_or_state_has_a_line_of_its_own(alarms, expected):
    assert sizes(alarms) == expected


def test_what_is_shelved_one_after_the_other_is_one_line():
    shelved = [replace(each, shelved_until=NOW + timedelta(hours=4, milliseconds=n)) for n, each in enumerate(silent(12))]
    assert sizes(shelved) == [12]


def test_an_alarm_that_came_back_is_with_those_that_fell_silent_now():
    again = replace(silent(1)[0], id=9, raised_at=ago(hours=20), last_at=ago(minutes=35), count=2)
    assert sizes([again, *silent(2)]) == [3]


def test_when_they_answer_again_the_line_says_from_when_to_when():
    group = tuple(silent(3, cleared_at=ago(minutes=8)))
    assert group_text(group, SETTINGS, NOW) == "Wi-Fi: 3 robots were unreachable from 14:02"
    assert group_note(group, SETTINGS, NOW) == "Over since 14:30 · R1, R2, R3"


def test_a_shelved_group_comes_back_by_its_button():
    entry = group_entry(tuple(silent(3, shelved_until=NOW + timedelta(hours=1))), SETTINGS, NOW, unfolded=False)
    assert (entry.tone, entry.action, entry.has_menu) == ("neutral", "Unshelve", False)


def test_the_group_is_as_urgent_as_the_most_urgent_in_it():
    first = open_issues(OpenIssues([alarm("backup_failed", "backup", id=40), *silent(3)]), {}, SETTINGS, NOW)[0]
    assert len(first.alarms) == 3
