"""What Settings says of check-ups, and the page that is printed of one."""

from __future__ import annotations

from dataclasses import replace
from datetime import UTC, datetime, timedelta

import pytest

from app.domain.check_up import Finding, Level, Progress, Report, RobotProfile, Topic, Trial
from app.domain.message import message
from app.domain.models import InvalidInput, Robot
from app.i18n import translator
from app.mir.errors import Unreachable
from app.screens.settings import check_up_page, check_up_view
from app.screens.settings.check_up_view import standing
from app.services.check_up.trial import tokens
from tests.support.html_page import Strict

ZONE = "Europe/Helsinki"
NOW = datetime(2026, 11, 24, 8, 20, tzinfo=UTC)
AINO = Robot(
    "Aino", "http://10.40.12.21", "scheduler", id=1, serial_number="200104012", model="MiR250", software="3.5.4"
)
HTTP = Finding(Topic.CERTIFICATE, Level.AMBER, "It is asked over http", "Change its address to https")
CLOCK = Finding(
    Topic.CLOCK, Level.AMBER, message("Its clock is {seconds} s ahead of the tablet's", seconds=42), "Set it"
)
LOAD = Finding(Topic.LOAD, Level.RED, message("It booted when it was asked {n} times within 10 s", n=31), "Ask it less")
MAPS = Finding(Topic.MAPS, Level.GREEN, "It drives on the map Hall 1")


def report(*findings: Finding, **values) -> Report:
    fields = {
        "robot": "Aino",
        "address": AINO.address,
        "model": "MiR250",
        "began_at": NOW - timedelta(days=1),
        "took_s": 95.0,
        "findings": findings,
        "profile": RobotProfile("200104012", "3.5.4"),
    }
    return Report(**{**fields, **values})


def line(robot: Robot, found: Report | None) -> tuple[str, str]:
    notice = standing(robot, found, NOW, ZONE)
    assert notice.icon
    return notice.text, notice.tone


@pytest.mark.parametrize(
    ("found", "shown"),
    [
        (None, ("Never checked up", "neutral")),
        (report(MAPS), ("Checked up Mon 23 Nov: all fine", "neutral")),
        (report(MAPS, HTTP, CLOCK), ("Checked up Mon 23 Nov: 2 notes", "action")),
        (report(HTTP, LOAD), ("Checked up Mon 23 Nov: 1 problem, 1 note", "fault")),
        (report(MAPS, began_at=NOW - timedelta(hours=2)), ("Checked up today: all fine", "neutral")),
        (report(MAPS, began_at=NOW - timedelta(days=365)), ("Checked up Mon 24 Nov 2025: all fine", "neutral")),
    ],
)
def test_a_robot_says_when_it_was_checked_up_and_how_it_stands(found, shown):
    assert line(AINO, found) == shown


def test_another_machine_or_other_software_needs_another_check_up():
    assert line(replace(AINO, software="3.8.1"), report(LOAD)) == (
        "Software is 3.8.1 now: check it up again",
        "attention",
    )
    assert line(replace(AINO, serial_number="9"), report(MAPS)) == (
        "It is another machine now: check it up",
        "attention",
    )


def test_an_unfinished_restore_of_the_robot_is_shown_first():
    notice = standing(AINO, report(MAPS), NOW, ZONE, is_left=True)
    assert (notice.text, notice.tone) == ("Changes of a check-up must still be undone there", "attention")


def test_as_many_missions_are_named_as_are_queued():
    assert len(tokens()) == check_up_view.QUEUED


def test_why_it_cannot_run_now_is_not_an_error():
    later = check_up_view.refused(
        InvalidInput("robot", "{robot} is on hold: check up when it is released", robot="Aino")
    )
    assert (later.text, later.tone) == ("Aino is on hold: check up when it is released", "attention")
    assert check_up_view.refused(Unreachable(code="no_answer", address="10.40.12.21")).tone == "fault"


def test_no_two_levels_share_an_icon_or_a_word():
    seen = [check_up_view.appearance(level) for level in Level]
    assert (
        len({look.icon for look in seen})
        == len({look.word for look in seen})
        == len({look.tone for look in seen})
        == len(Level)
    )


def test_the_worst_comes_first_and_a_tap_shows_what_it_means():
    rows = check_up_view.finding_items((MAPS, HTTP, LOAD, CLOCK))
    assert [(row.support, row.tone, row.opens) for row in rows] == [
        ("Load", "fault", True),
        ("Encryption", "action", True),
        ("Clock", "action", True),
        ("Maps", "neutral", False),
    ]
    assert (rows[0].title, rows[0].note) == ("It booted when it was asked 31 times within 10 s", "")
    opened = check_up_view.finding_items((MAPS, HTTP, LOAD, CLOCK), {rows[0].key})
    assert [row.note for row in opened] == ["Ask it less", "", "", ""]


def test_the_verdict_says_whether_anything_was_queued_and_whether_it_came_to_its_end():
    read = check_up_view.verdict(AINO, report(MAPS), ZONE)
    assert read.note == "Mon 23 Nov 10:20 · 1 min 35 s\nOnly read: no mission was queued"
    tried = check_up_view.verdict(AINO, report(MAPS, mission="Wait"), ZONE)
    assert (tried.text, tried.tone) == ("All fine", "neutral")
    assert "Tried with the mission Wait" in tried.note
    cut = check_up_view.verdict(AINO, report(MAPS, is_complete=False), ZONE)
    assert "no answer to the end" in cut.note
    assert cut.tone == "attention"


def test_the_button_names_what_it_does():
    assert check_up_view.begin_word(AINO, None) == "Check up"
    assert check_up_view.begin_word(AINO, Trial()) == "Queue 4 missions on Aino"


def test_progress_is_in_seconds_and_never_above_the_total():
    words = check_up_view.progress_words(AINO, Progress(message("Reading its queue"), 18.0, 95.0))
    assert words == ("Reading its queue", "18 s of about 1 min 35 s", 18 / 95)
    assert check_up_view.progress_words(AINO, Progress("", 100.0, 95.0))[2] == 1.0
    assert check_up_view.progress_words(AINO, Progress("", 1.0, 0.0))[2] == 0.0
    assert "being undone" in check_up_view.progress_words(AINO, Progress("", 1.0, 95.0), stopping=True)[0]


# ---------------------------------------------------------------------- the page
def test_the_page_has_the_machine_and_every_finding_the_worst_first():
    cells = Strict(check_up_page.page(report(MAPS, HTTP, LOAD), ZONE)).cells
    text = " ".join(cells).replace("\N{NO-BREAK SPACE}", " ")
    assert "MiR250 · serial 200104012 · software 3.5.4 · 10.40.12.21" in text
    assert "Made Mon 23 Nov 2026 10:20, Europe/Helsinki" in text
    assert "1 problem, 1 note" in text
    assert text.index("asked 31 times within 10 s") < text.index("asked over http") < text.index("map Hall 1")
    assert [cell for cell in cells if cell in ("Problem", "Note", "Fine")] == [
        "Problem",
        "Note",
        "Fine",
    ]


def test_texts_of_a_robot_are_escaped_on_the_page():
    evil = "<script>alert('x')</script> & \"Aino\""
    page = check_up_page.page(
        report(Finding(Topic.LANGUAGE, Level.AMBER, evil, evil), robot=evil, model=evil, mission=evil), ZONE
    )
    assert "<script" not in page
    assert (
        sum(evil in cell for cell in Strict(page).cells) == 6
    )  # title, heading, machine, mission, and the two of the finding


def test_the_page_is_in_the_language_of_the_app():
    translator.use("fi")
    try:
        page = check_up_page.page(report(MAPS), ZONE)
    finally:
        translator.use("en")
    assert '<html lang="fi">' in page
    assert "Check-up" not in page
