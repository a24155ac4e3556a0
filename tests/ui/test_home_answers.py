"""Questions of a robot and instructions when it can't continue, on Home: each answer is sent once, and seen without scrolling."""

from __future__ import annotations

from collections.abc import Iterator

import pytest
from kivy.metrics import sp
from kivy.uix.label import Label
from kivy.uix.widget import Widget

from app.screens.frame.facts import OpenIssues
from app.screens.home.cards import Answers, PromptOption
from app.widgets import load_kv
from tests.screenshots.home import home, stopped
from tests.support import home_facts as sample
from tests.ui import checks
from tests.ui.window_sizes import Rig, window


def rows_of_answers(ui, width: float, *options: str) -> list[list[str]]:
    """By the row they are in."""
    load_kv("home/page")
    answers = ui.show(Answers(options=list(options), spacing=8), (width, 400))
    rows: dict[float, list[str]] = {}
    for button in reversed(answers.children):
        rows.setdefault(button.top, []).append(button.text)
    return list(rows.values())


@pytest.mark.parametrize(
    ("width", "options", "rows"),
    [
        (520, ("Yes", "No", "Skip this stop"), [["Yes", "No", "Skip this stop"]]),
        (
            360,
            ("Door 1, left", "Door 1, right", "Door 2, left", "Door 2, right"),
            [["Door 1, left", "Door 1, right"], ["Door 2, left", "Door 2, right"]],
        ),
        (
            360,
            ("Yes", "A long answer for which one line is too short"),
            [["Yes"], ["A long answer for which one line is too short"]],
        ),
        (360, ("Yes", "Yes"), [["Yes", "Yes"]]),
    ],
)
def test_answers_share_a_row_where_they_fit(ui, width, options, rows):
    assert rows_of_answers(ui, width, *options) == rows


def test_an_answer_is_sent_once(ui):
    load_kv("home/page")
    answers = ui.show(Answers(options=["Yes", "No"], spacing=8), (360, 100))
    sent = []
    answers.bind(on_answer=lambda _answers, option: sent.append(option))
    ui.tap(ui.find(PromptOption, text="No"))
    answers.busy = True
    ui.tap(ui.find(PromptOption, text="Yes"))
    assert sent == ["No"]


@pytest.fixture(params=["small", "small-large-text", "small-gloves", "large-text", "gloves"])
def usual(ui, request) -> Iterator[Rig]:
    """A usual window, with texts and banner as long as most are."""
    mode = request.param
    with window(
        ui, (1024, 600) if "small" in mode else (1280, 800), 1.3 if "large" in mode else 1.0, gloves="gloves" in mode
    ) as rig:
        yield rig


def test_the_answers_are_seen_without_scrolling(ui, usual):
    home(usual, sample.with_aino(sample.ASKING), issues=OpenIssues())
    ui.advance(0.5)
    answers = ui.find_all(PromptOption)
    assert [answer.text for answer in answers if checks.is_seen(answer)] == list(sample.ASKING.user_prompt.options)


def labels(ui, text: str) -> list[Widget]:
    return [label for label in ui.find_all(Label) if label.text == text]


def test_a_touch_right_after_another_question_answers_nothing(ui):
    load_kv("home/page")
    answers = ui.show(Answers(about="p1", options=["Yes", "No"], spacing=8), (360, 100))
    sent = []
    answers.bind(on_answer=lambda _answers, option: sent.append(option))
    ui.advance(1)
    answers.about = "p2"
    ui.advance(0.1)
    no = ui.find(PromptOption, text="No")
    ui.tap_at(*no.to_window(*no.center))
    assert sent == []
    ui.advance(1.1)
    ui.tap(ui.find(PromptOption, text="No"))
    assert sent == ["No"]


def test_instructions_at_an_emergency_stop_are_visible_without_scrolling(ui, usual):
    screen = home(usual, stopped(), issues=OpenIssues())
    ui.advance(0.5)
    [instruction] = labels(ui, screen.vm.view.card.note.problem)
    assert checks.is_seen(instruction)
    assert instruction.font_size >= sp(24)
