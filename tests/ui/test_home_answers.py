"""Questions of a robot and instructions when it can't continue, on Home: each answer is sent once, and seen without scrolling."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

import pytest
from kivy.metrics import sp
from kivy.tests.common import UnitTestTouch
from kivy.uix.label import Label
from kivy.uix.widget import Widget

from app.domain.robot import RobotProblem, RobotState
from app.i18n import _
from app.screens.frame.facts import OpenIssues
from app.screens.home.cards import Answers, Bands, HomeState, PromptOption, PromptPanel, RobotStrip
from app.screens.home.view import PromptView
from app.widgets import load_kv
from app.widgets.buttons import CommandButton
from app.widgets.frame import AlarmBanner, Frame, TopBar
from tests.screenshots.home import ALARMS, ERROR, QUESTION, SILENT, home, stopped
from tests.support import home_facts as sample
from tests.ui import checks
from tests.ui.window_sizes import Rig, reach, window


def rows_of_answers(ui, width: float, *options: str) -> list[list[str]]:
    """By the row they are in."""
    load_kv("home/cards")
    answers = ui.show(Answers(options=list(options), spacing=8), (width, 400))
    rows: dict[float, list[str]] = {}
    for button in reversed(answers.children):
        rows.setdefault(button.top, []).append(button.text)
    return list(rows.values())


@pytest.mark.parametrize(
    ("width", "options", "rows"),
    [
        (360, ("Yes", "No", "Skip this stop"), [["Yes", "No", "Skip this stop"]]),
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
    load_kv("home/cards")
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


@pytest.mark.parametrize("minutes", [1, 20])
def test_the_answers_are_seen_without_scrolling(ui, usual, minutes):
    """Also when its alarm is not acknowledged."""
    home(
        usual,
        sample.with_aino(sample.ASKING),
        issues=OpenIssues([replace(QUESTION, raised_at=sample.ago(minutes=minutes))]),
    )
    ui.advance(0.5)
    assert ui.find(AlarmBanner).urgent == (minutes > 5)
    answers = ui.find_all(PromptOption)
    assert [answer.text for answer in answers if checks.is_seen(answer)] == list(sample.ASKING.user_prompt.options)


def labels(ui, text: str) -> list[Widget]:
    return [label for label in ui.find_all(Label) if label.text == text]


BROKEN = replace(sample.FAILED, errors=(RobotProblem(9000, "Scanner broken", "Safety", resettable=False),))
PAUSED = replace(sample.EXECUTING, state=RobotState.PAUSE)
# What a robot waits for: its status, the alarm, and where the next step is.
NEEDS = {
    "asks": (sample.ASKING, QUESTION, lambda ui, _view: ui.find_all(PromptOption)),
    "error": (sample.FAILED, ERROR, lambda ui, _view: ui.find_all(CommandButton, text=_("Reset errors"))),
    "paused": (PAUSED, SILENT, lambda ui, _view: ui.find_all(CommandButton, text=_("Resume"))),
    "stopped": (sample.STOPPED, ALARMS[0], lambda ui, view: labels(ui, view.card.mission.name)),
    "broken": (BROKEN, ERROR, lambda ui, view: labels(ui, view.card.mission.name)),
}


@pytest.mark.parametrize(
    ("gloves", "robots", "minutes"), [(False, 3, 20), (True, 24, 1)], ids=["", "gloves"]
)  # 20: a larger banner
@pytest.mark.parametrize(("scale", "language"), [(1.0, "en"), (1.3, "fi")])
@pytest.mark.parametrize("size", [(600, 480), (800, 480), (1024, 600)], ids="{0[0]}x{0[1]}".format)
def test_the_question_of_a_robot_is_visible_in_a_low_window(ui, size, scale, language, gloves, robots, minutes):
    others = tuple(
        replace(sample.VEIKKO, id=100 + n, name=f"Robot {n}") for n in range(robots - len(sample.FACTS.robots))
    )
    for name, (status, alarm, steps) in NEEDS.items():
        with window(ui, size, scale, language, gloves=gloves) as rig:
            facts = sample.with_aino(status)
            screen = home(
                rig,
                replace(facts, robots=facts.robots + others),
                issues=OpenIssues([replace(alarm, raised_at=sample.ago(minutes=minutes))]),
            )
            screen.vm.fleet.leave()
            ui.advance(0.5)
            found = steps(ui, screen.vm)
            assert found, name
            assert [checks.is_seen(step) for step in found] == [True] * len(found), name
            assert "\n".join(checks.problems(ui.find(Frame))) == ""
            reach(ui, ui.find(RobotStrip))


@pytest.mark.parametrize("size", [(600, 480), (800, 480)], ids="{0[0]}x{0[1]}".format)
def test_opening_a_robot_shows_its_question_however_far_the_page_was_scrolled(ui, size):
    with window(ui, size) as rig:
        screen = home(rig, sample.FACTS)
        ui.advance(0.5)
        page = ui.find(Bands)
        page.scroll_y = 1 - 150 / (page.ids.bands.height - page.height)
        screen.vm.take(sample.with_aino(sample.FAILED))
        ui.advance(0.5)
        assert checks.is_seen(ui.find(CommandButton, text="Reset errors"))
        screen.vm.take(sample.FACTS)
        ui.advance(0.5)
        reach(ui, ui.find(CommandButton, text=screen.vm.run.text))  # below the robot's card
        at = page.scroll_y
        screen.vm.take(sample.with_aino(sample.FAILED))
        ui.advance(0.5)
        assert page.scroll_y == pytest.approx(at)


@pytest.mark.parametrize("size", [(600, 480), (800, 480)], ids="{0[0]}x{0[1]}".format)
def test_a_tap_meant_for_another_robot_answers_no_new_question(ui, size):
    with window(ui, size) as rig:
        screen = home(rig, sample.FACTS)
        ui.advance(1)
        sent = []
        screen.vm.answer = sent.append
        x, y = ui.find(RobotStrip).to_window(*ui.find(RobotStrip).center)
        screen.vm.take(sample.with_aino(sample.ASKING))
        ui.advance(0.1)
        answer = ui.find_all(PromptOption)[0]
        assert checks.area(answer)[1] < y + 60
        taken, bar = [], ui.find(TopBar)
        bar.bind(on_touch_down=lambda _bar, _touch: taken.append("top bar"))
        touch = UnitTestTouch(*bar.center)
        touch.touch_down()
        touch.touch_up()
        assert taken == ["top bar"]  # only what has moved takes none
        ui.tap(answer)
        assert sent == []
        ui.advance(1)
        ui.tap(answer)
        assert sent == [answer.text]
        screen.vm.take(sample.FACTS)
        ui.advance(0.1)
        assert ui.find(RobotStrip).to_window(*ui.find(RobotStrip).center) == pytest.approx((x, y))


def test_a_question_stands_at_the_top_of_a_panel_that_is_higher_than_it_needs(ui):
    load_kv("home/cards")
    panel = ui.show(PromptPanel(vm=HomeState(prompt=PromptView("p1", "Is the aisle free?", ("Yes", "No")))), (400, 400))
    ui.advance()
    assert panel.top - ui.find(text="Is the aisle free?").top < 24


def test_instructions_at_an_emergency_stop_are_visible_without_scrolling(ui, usual):
    screen = home(usual, stopped(), issues=OpenIssues(ALARMS))
    ui.advance(0.5)
    [instruction] = labels(ui, screen.vm.card.mission.name)
    assert checks.is_seen(instruction)
    assert instruction.font_size >= sp(20)  # as large as a value
