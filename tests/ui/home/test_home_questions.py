"""Questions of a robot, on its card, in the banner and in a dialog: on real services and a simulated robot."""

from __future__ import annotations

import threading

import pytest
from kivy.utils import get_hex_from_color

from app.domain.models import THEMES
from app.mir.errors import Rejected
from app.screens.home.cards import PromptOption
from app.widgets.buttons import CommandButton
from app.widgets.frame import Banner
from app.widgets.places import places
from app.widgets.tokens import tk
from tests.ui import checks
from tests.ui.home.operator import loud, press


def ask(home, question: str) -> None:
    home.aino.control({"user_prompt": {"question": question, "options": ["Yes", "No"], "timeout": 600}})


def answer_sent(home) -> bool:
    return any("Answer sent" in text for text in home.shell.snackbars.texts)


def test_a_question_of_the_robot_is_answered_from_the_tablet(home, ui):
    home.aino.control({"user_prompt": {"question": "Is the load secured?", "options": ["Yes", "No"], "timeout": 60}})
    ui.wait(lambda: "Is the load secured?" in ui.texts())
    press(ui, "Yes")
    ui.wait(lambda: "Answer sent to Aino: Yes" in home.shell.snackbars.texts)
    ui.wait(lambda: "Is the load secured?" not in ui.texts())


@pytest.mark.parametrize("theme", THEMES)
def test_no_answer_is_louder_than_another_and_each_can_be_read(home, ui, theme):
    tk.use(theme)
    ask(home, "Is the load secured?")
    ui.wait(lambda: ui.find_all(PromptOption))
    assert loud(ui) == []
    looks = {
        (tuple(button.back), tuple(button.front), button.large, round(button.width))
        for button in ui.find_all(PromptOption)
    }
    [(fill, words, large, _width)] = looks
    fill, words = (get_hex_from_color(colour[:3]) for colour in (fill, words))
    assert (large, checks.contrast_ratio(fill, words) >= 4.5) == (True, True)


def test_a_question_is_an_alarm_that_leads_to_its_answers(home, ui):
    home.shell.go("scheduler")
    home.aino.control({"user_prompt": {"question": "Is the load secured?", "options": ["Yes", "No"], "timeout": 600}})
    ui.wait(
        lambda: (
            ui.find_all(Banner, text="Aino asks: Is the load secured?") and not places.has_just_moved(ui.find(Banner))
        )
    )
    press(ui, "Answer")
    assert home.shell.navigator.current == "home"
    ui.wait(lambda: ui.find_all(PromptOption, text="Yes"))
    press(ui, "Yes")
    ui.wait(lambda: any("Answer sent to Aino: Yes" in text for text in home.shell.snackbars.texts))
    ui.wait(lambda: all(alarm.cleared_at for alarm in home.site.container.alarms.open() if alarm.code == "question"))


def test_a_finger_on_its_way_to_one_question_answers_no_other_one(home, ui):
    ask(home, "Is the aisle free?")
    ui.wait(lambda: "Is the aisle free?" in ui.texts())
    lift = ui.press(ui.find(CommandButton, text="No"))
    ask(home, "Release pallet 7?")
    ui.wait(lambda: "Release pallet 7?" in ui.texts())
    lift(0.05)
    no = ui.find(CommandButton, text="No")
    ui.tap_at(*no.to_window(*no.center))  # at once, as if the question before still stood there
    ui.wait(lambda: home.shell.background.idle)
    assert not answer_sent(home)
    ui.advance(1)
    press(ui, "No")
    ui.wait(lambda: answer_sent(home))


@pytest.mark.parametrize(
    ("since", "said"),
    [
        (None, "Aino: The question has been answered or withdrawn"),
        ("Release pallet 7?", "Aino asks something else now"),
    ],
)
def test_a_late_answer_says_what_became_of_the_question_once_it_was_read(home, ui, monkeypatch, since, said):
    ask(home, "Is the aisle free?")
    ui.wait(lambda: "Is the aisle free?" in ui.texts())
    services, (robot, *_others) = home.site.container, home.root_vm.facts.robots
    answer, go, asked = services.operator.answer_prompt, threading.Event(), services.snapshots.get(robot.id).status
    monkeypatch.setattr(services.operator, "answer_prompt", lambda *args: go.wait(30) and answer(*args))
    press(ui, "Yes")
    home.aino.control({"user_prompt": since and {"question": since, "options": ["Yes", "No"], "timeout": 600}})
    ui.wait(lambda: services.snapshots.get(robot.id).status.user_prompt != asked.user_prompt)
    go.set()
    ui.wait(lambda: home.shell.snackbars.texts)
    assert home.shell.snackbars.texts == [said]


def test_a_robot_that_takes_no_answer_to_what_it_asks_is_not_said_to_ask_no_more(home, ui, monkeypatch):
    ask(home, "Is the aisle free?")
    ui.wait(lambda: "Is the aisle free?" in ui.texts())

    def refuse(*_args: object) -> None:
        raise Rejected(status=400, address="r1", reason="Not now")

    monkeypatch.setattr(home.site.container.operator, "answer_prompt", refuse)
    press(ui, "Yes")
    ui.wait(lambda: home.shell.snackbars.texts)
    assert home.shell.snackbars.texts == ["Answer: Aino refused: Not now (status 400)"]
