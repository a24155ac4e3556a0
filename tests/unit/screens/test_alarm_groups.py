"""One cause, one line: robots that fall silent together share one, and nothing else does."""

from __future__ import annotations

from dataclasses import replace
from datetime import timedelta

import pytest

from app.domain.execution import Reason, ReasonCode
from app.domain.message import message
from app.domain.models import Alarm, Robot
from app.domain.reasons import to_store
from app.mir.errors import SENTENCES
from app.screens.common.alarm_groups import APART, alarm_item, group_note, group_text, together
from app.screens.common.alarms_view import Act, alarm_text
from app.screens.frame.facts import OpenIssues
from app.screens.frame.view import banner, open_lines
from tests.support.alarms import alarm
from tests.support.home_facts import NOW, SETTINGS, ago


def silent(n: int, apart: timedelta = timedelta(seconds=20), code: str = "no_answer", **values) -> list[Alarm]:
    """``n`` robots, one after the other, the first 36 minutes ago."""

    def details(i: int) -> dict:
        return {"robot": f"R{i}", "problem": message(SENTENCES[code], address=f"10.1.1.{i}", seconds=5)}

    return [
        alarm("unreachable", f"robot:{i}", id=i, raised_at=ago(minutes=36) + i * apart, details=details(i), **values)
        for i in range(1, n + 1)
    ]


def failed(
    n: int, robot: str = "Aino", code: str = "execution_failed", reason: Reason | None = None, **values
) -> list[Alarm]:
    """As many schedules of one robot, the last a minute ago."""
    reason = reason or Reason(
        ReasonCode.WINDOW_CLOSED,
        {"until": "2026-11-20T12:15:00+00:00", "problem": message(SENTENCES["no_answer"], address="10.1.1.7")},
    )
    return [
        alarm(
            code,
            f"schedule:{i}",
            id=i,
            raised_at=ago(minutes=n + 1 - i),
            last_at=ago(minutes=n + 1 - i),
            details={"robot": robot, "robot_id": len(robot), "mission": f"M{i}", "reason": to_store(reason)},
            **values,
        )
        for i in range(1, n + 1)
    ]


def broken(
    message: str = "Failed to reach goal position 'Dock'", apart: timedelta = timedelta(seconds=4), **values
) -> list[Alarm]:
    """Aino's error, the mission that it ended as it says so, ``apart`` before, and another's."""
    reason = to_store(Reason(ReasonCode.ROBOT_ABORTED, {"message": message}))
    details = {"robot": "Aino", "robot_id": 1, "mission": "Deliver", "reason": reason}
    at = ago(minutes=2)
    return [
        alarm(
            "execution_failed", "schedule:1", id=1, raised_at=at - apart, last_at=at - apart, details=details, **values
        ),
        alarm(
            "robot_error",
            "robot:1",
            id=2,
            raised_at=at,
            last_at=at,
            details={"robot": "Aino", "problem": "Failed to reach goal position 'Dock'"},
            **values,
        ),
        alarm(
            "execution_failed",
            "schedule:2",
            id=3,
            raised_at=at,
            last_at=at,
            details={**details, "robot": "Veikko", "robot_id": 2},
            **values,
        ),
    ]


def sizes(alarms) -> list[int]:
    return sorted(map(len, together(alarms, NOW)))


ROBOTS = {1: Robot("Aino", "http://10.1.1.1", "u", id=1)}


def item(group, **values):
    return alarm_item(tuple(group), ROBOTS, SETTINGS, NOW, **values)


@pytest.mark.long
def test_many_that_fall_silent_together_are_one_line_on_the_page_and_in_the_banner():
    issues = OpenIssues(silent(14))
    [group] = open_lines(issues.alarms, NOW)
    row, view = item(group), banner(issues, {}, SETTINGS, NOW, "logs")
    assert (row.lead, row.whole, view.text) == ("14:02", "14 robots · No answer", "14 robots: no answer")
    assert row.support == "R1, R2, R3 … · All at the same minute. Is the access point on?"
    assert (view.action, view.act, view.about) == ("Show", Act.GO, {"screen": "alarms", "unfold": 1})
    assert (row.key, [action.text or action.name for action in row.actions]) == (
        ("group", 1),
        ["Acknowledge 14", "fold", "menu"],
    )


def of_hall_2(alarms: list[Alarm]) -> list[Alarm]:
    """Not they fail, but their fleet."""
    return [replace(each, details={**each.details, "fleet": "Hall 2"}) for each in alarms]


@pytest.mark.parametrize("alarms", [of_hall_2(silent(2)), of_hall_2(silent(10, apart=timedelta(minutes=4)))])
def test_a_silent_fleet_is_one_line_whenever_its_robots_notice_it(alarms):
    [group] = open_lines(alarms, NOW)
    row, view = item(group), banner(OpenIssues(alarms), {}, SETTINGS, NOW, "logs")
    assert (row.whole, view.text) == ("Hall 2 · No answer", "Hall 2: no answer")
    assert row.support.endswith(" · Is the fleet's server on?")


def test_another_fleet_is_said_of_the_fleet():
    details = {"robot": "R1", "fleet": "Hall 2", "found": "Hall 3", "expected": "Hall 2"}
    [group] = together([alarm("wrong_robot", "robot:1", details=details)], NOW)
    assert item(group).whole == "Hall 2 · Another fleet answers"
    assert alarm_text(group[0], SETTINGS, NOW) == (
        "Another fleet answers at the address of Hall 2: Hall 3 instead of Hall 2, nothing is sent"
    )


def test_errors_that_a_fleet_cannot_reset_say_why():
    [group] = together([alarm("robot_error", "robot:1", details={"robot": "Aino", "problem": "Spindle"})], NOW)
    (reset,) = [action for action in item(group, why_no_reset="Reset at the robot.").actions if action.name == "reset"]
    assert reset.off == "Reset at the robot."


@pytest.mark.parametrize(
    ("alarms", "expected"),
    [
        (silent(2), [1, 1]),  # these may have failed themselves
        (silent(5, apart=APART + timedelta(seconds=1)), [1] * 5),
        ([*silent(3), *silent(3, acknowledged_at=NOW)], [3, 3]),
        ([*silent(3), *silent(4, cleared_at=NOW)], [3, 4]),
        ([*silent(3), *silent(3, shelved_until=NOW + timedelta(hours=1))], [3, 3]),
        ([*silent(3), *silent(3, code="refused")], [3, 3]),
        ([*silent(2), *silent(2, code="refused")], [1] * 4),
        ([*silent(2), *silent(2, code="timed_out")], [4]),
        (failed(6), [6]),
        (broken(), [1, 2]),
        (broken(""), [1, 2]),  # it did not say why
        (broken("The path is blocked"), [1, 1, 1]),
        (broken(apart=APART + timedelta(seconds=1)), [1, 1, 1]),
        ([replace(each, acknowledged_at=NOW) if each.code == "robot_error" else each for each in broken()], [1, 1, 1]),
        (
            [replace(each, shelved_until=NOW + timedelta(hours=1)) if each.id == 1 else each for each in broken()],
            [1, 1, 1],
        ),
        ([replace(each, details={"robot_id": ["hostile"], "reason": ["hostile"]}) for each in broken()], [1, 1, 1]),
        ([replace(each, key="hostile", details={**each.details, "robot_id": None}) for each in broken()], [1, 1, 1]),
        (failed(2), [1, 1]),
        ([*failed(3), *failed(3, "Veikko")], [3, 3]),
        ([*failed(3), *failed(3, reason=Reason(ReasonCode.UNAUTHORIZED))], [3, 3]),
        ([*failed(3), *failed(4, acknowledged_at=NOW)], [3, 4]),
        ([*failed(3), *failed(3, code="execution_skipped")], [3, 3]),
        ([replace(each, details={"robot_id": ["hostile"], "reason": ["hostile"]}) for each in failed(3)], [1] * 3),
        ([replace(each, details={"robot_id": 1, "reason": {"code": ["hostile"]}}) for each in failed(3)], [3]),
        ([alarm("robot_error", f"robot:{n}", id=n) for n in range(1, 5)], [4]),
    ],
)
def test_alarms_of_another_cause_or_state_have_their_own_line(alarms, expected):
    assert sizes(alarms) == expected


def test_alarms_shelved_one_after_the_other_share_a_line():
    shelved = [
        replace(each, shelved_until=NOW + timedelta(hours=4, milliseconds=n)) for n, each in enumerate(silent(12))
    ]
    assert sizes(shelved) == [12]


def test_an_alarm_that_came_back_is_with_those_that_fell_silent_now():
    again = replace(silent(1)[0], id=9, raised_at=ago(hours=20), last_at=ago(minutes=35), count=2)
    assert sizes([again, *silent(2)]) == [3]


def test_when_they_answer_again_the_line_says_from_when_to_when():
    row = item(silent(3, cleared_at=ago(minutes=8)))
    assert (row.lead, row.whole, row.support) == ("14:02", "3 robots · No answer", "Over since 14:30 · R1, R2, R3")


def test_robots_with_the_same_error_within_a_minute_are_one_line():
    """A flood of them too: what to do, and one button that acknowledges all."""

    def errors(n: int, text: str = "Failed to reach goal position 'Dock 3'") -> list[Alarm]:
        return [
            alarm(
                "robot_error", f"robot:{i}", id=i, raised_at=ago(seconds=i), details={"robot": f"R{i}", "problem": text}
            )
            for i in range(1, n + 1)
        ]

    row = item(open_lines(errors(3), NOW)[0])
    assert (row.whole, row.tone) == ("3 robots · Can't reach Dock 3", "fault")
    assert row.support == "R3, R2, R1 · Clear the way. Then reset. “Failed to reach goal position 'Dock 3'”"
    assert [action.text or action.name for action in row.actions] == ["Acknowledge 3", "fold", "menu"]
    assert sizes([*errors(3), *errors(3, "Failed to reach goal position 'Dock 4'")]) == [3, 3]
    assert sizes(errors(2)) == [1, 1]


def test_a_shelved_group_comes_back_by_its_button():
    row = item(silent(3, shelved_until=NOW + timedelta(hours=1)))
    assert (row.tone, [action.name for action in row.actions]) == ("neutral", ["unshelve", "fold"])


@pytest.mark.parametrize(
    ("code", "advice"),
    [
        ("timed_out", "All at the same minute. Is the access point on?"),
        ("refused", "Are they starting? Are their ports right?"),
        ("unknown_name", "Enter the robots' addresses in numbers instead."),
        ("busy", "Is it switched on?"),
    ],
)
def test_the_line_says_what_to_do_about_the_cause_that_the_problems_have_in_common(code, advice):
    assert group_note(tuple(silent(3, code=code)), SETTINGS, NOW) == f"R1, R2, R3 · {advice}"


def test_missions_that_one_robot_failed_are_one_line_with_their_number_and_reason():
    alarms = [replace(each, count=2) for each in failed(4)]
    [group] = open_lines(alarms, NOW)
    assert item(group).whole == "Aino · 8 missions failed"
    assert item(group).support == (
        "Its start window closed at 14:15: Aino doesn't answer. Is it switched on and on this network? · "
        "last 14:37 · M1, M2, M3 …"
    )
    assert group_text(tuple(failed(3, code="execution_skipped")), SETTINGS, NOW) == "Aino: 3 missions were not run"


def test_an_error_and_the_mission_that_it_ended_are_one_line_led_by_the_error():
    group, _veikko = open_lines(broken(), NOW)
    row, view = item(group), banner(OpenIssues(broken()), ROBOTS, SETTINGS, NOW, "logs")
    assert (view.text, view.tone) == ("Aino: Can't reach Dock", "fault")
    assert (view.action, view.act, view.about) == ("Show", Act.GO, {"screen": "home", "robot_id": 1})
    assert (row.whole, row.tone) == ("Aino · Can't reach Dock", "fault")
    assert row.support == (
        "Mission failed: Deliver · Clear the way. Then reset. “Failed to reach goal position 'Dock'”"
    )
    assert [action.name for action in row.actions] == ["acknowledge", "reset", "fold", "menu"]


def test_when_the_error_is_over_the_mission_leads_and_it_is_still_one_line():
    alarms = [replace(each, cleared_at=ago(minutes=1)) if each.code == "robot_error" else each for each in broken()]
    row = item(next(group for group in open_lines(alarms, NOW) if len(group) == 2))
    assert row.whole == "Aino · Deliver failed"
    assert (row.support, row.tone) == ("Can't reach Dock · Over since 14:37", "attention")


def test_several_missions_that_it_ended_are_named():
    first, error, _other = broken()
    several = [
        error,
        *(
            replace(first, id=10 + n, key=f"schedule:{n}", details={**first.details, "mission": f"M{n}"})
            for n in range(2)
        ),
    ]
    [group] = open_lines(several, NOW)
    assert item(group).support.startswith("Missions failed: M0, M1 · ")
    over = [replace(each, cleared_at=ago(minutes=1)) for each in several]
    assert item(open_lines(over, NOW)[0]).whole == "Aino · 2 missions failed"


def test_the_group_is_as_urgent_as_the_most_urgent_in_it():
    assert len(open_lines([alarm("backup_failed", "backup", id=40), *silent(3)], NOW)[0]) == 3
