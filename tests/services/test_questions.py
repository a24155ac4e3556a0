"""A robot's question is an alarm of high priority, with its answers, until it is answered or withdrawn."""

from __future__ import annotations

import pytest

from app.domain.models import Priority
from app.screens.common.alarms_view import alarm_note
from app.services.live.alarms import alarm_sentence
from mir_sim.control import COMMANDS
from tests.support.edits import switch_robot

LOADED = {"question": "Loaded?", "options": ["Yes", "No"], "timeout": 600}


def questions(site):
    return [alarm for alarm in site.container.alarms.open() if alarm.code == "question"]


def active(site, after=0.0):
    site.run(after)
    return [alarm_sentence(alarm) for alarm in questions(site) if alarm.cleared_at is None]


@pytest.fixture
def machine(site):
    return site.machines["R1"]


def ask(machine, prompt):
    COMMANDS["user_prompt"](prompt)(machine)


def answer(site, text):
    prompt = site.container.snapshots.get(1).status.user_prompt
    site.container.operator.answer_prompt(1, prompt.guid, text)


def test_a_question_is_an_alarm_until_it_is_answered(site, machine):
    site.run(10)
    ask(machine, LOADED)
    site.run(40)
    [alarm] = questions(site)
    assert (alarm.priority, alarm.details["answers"], alarm_sentence(alarm)) == (
        Priority.HIGH,
        ["Yes", "No"],
        "R1 asks: Loaded?",
    )
    answer(site, "Yes")
    assert active(site, after=40) == []
    assert questions(site) == []  # nothing is left to acknowledge


def past_notes(site):
    settings, now = site.container.settings(), site.clock.now()
    for alarm in questions(site):
        site.container.alarms.acknowledge(alarm.id)
    return [alarm_note(alarm, settings, now) for alarm in site.container.alarms.past(10)[0]]


def test_the_past_alarm_says_what_was_answered(site, machine):
    """By the question: one that came in its place was not answered."""
    site.run(10)
    ask(machine, LOADED)
    site.run(40)
    answer(site, "No")
    site.run(40)
    assert " · answered: No · " in past_notes(site)[0]
    ask(machine, {**LOADED, "question": "Empty?", "timeout": 60})
    site.run(120)
    newest, before = past_notes(site)
    assert " · not answered here · " in newest
    assert " · answered: No · " in before


def test_another_question_is_a_new_alarm_although_the_first_was_acknowledged(site, machine):
    ask(machine, LOADED)
    site.run(40)
    site.container.alarms.acknowledge(questions(site)[0].id)
    ask(machine, {**LOADED, "question": "Empty?"})
    assert active(site, after=40) == ["R1 asks: Empty?"]
    assert questions(site)[-1].acknowledged_at is None


def test_one_that_runs_out_is_over(site, machine):
    ask(machine, {**LOADED, "timeout": 60})
    assert active(site, after=40) == ["R1 asks: Loaded?"]
    assert active(site, after=120) == []


def test_a_robot_that_is_switched_off_asks_nothing(site, machine):
    ask(machine, LOADED)
    site.run(40)
    switch_robot(site.container.catalogue, 1, False)
    assert active(site, after=120) == []
    switch_robot(site.container.catalogue, 1, True)
    assert active(site, after=60) == ["R1 asks: Loaded?"]
