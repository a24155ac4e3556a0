"""What Home remembers between two readings: errors that were reset, and what has just been handed to a robot."""

from __future__ import annotations

from dataclasses import replace
from datetime import timedelta
from types import SimpleNamespace

import pytest

from app.domain.execution import State
from app.screens.common.mission_names import NOTHING_KNOWN
from app.screens.common.presses import OfRobot, Presses
from app.screens.home import commands
from app.screens.home.commands import HomeCommands, ResetReport
from app.screens.home.screen import HomeViewModel
from app.widgets.items import Item
from tests.support import fleet_facts
from tests.support.home_facts import AINO, FACTS, FAILED, NOW, READY, execution, with_aino


@pytest.mark.parametrize(
    "over", [lambda report: report.look(with_aino(READY)), lambda report: report.forget()], ids=["gone", "left"]
)
def test_an_error_that_returns_later_is_no_failed_reset(monkeypatch, over):
    """Also when it is read again later: its cause may have been removed since."""
    monkeypatch.setattr(commands, "READ_WITHIN", 0.0)
    report, failed = ResetReport(lambda *_said: None), with_aino(FAILED)
    report.begin(AINO, NOW - timedelta(minutes=5))
    report.look(failed)
    assert replace(failed, reset_without_effect=report.without_effect).has_reset_no_effect
    over(report)
    report.look(failed)
    assert not replace(failed, reset_without_effect=report.without_effect).has_reset_no_effect


def test_while_a_start_of_a_group_waits_its_reason_is_read_again():
    """A robot that hangs publishes no change on which it would be read."""
    handed = replace(execution(60, AINO, "Kits", State.SUBMITTING), group_id=5, robot_group="Hall 1")
    read: list[None] = []
    page = SimpleNamespace(
        facts=replace(FACTS, open=(handed,)), _reader=SimpleNamespace(request=lambda: read.append(None))
    )
    HomeViewModel._read_again(page)
    assert (len(read), page._is_plan_old) == (1, True)
    page.facts = replace(FACTS, open=(replace(handed, queue_id=7),))
    HomeViewModel._read_again(page)
    assert len(read) == 1


@pytest.mark.parametrize(("selected", "asked"), [(fleet_facts.ANY.id, [10, 11, 12]), (11, [])])
def test_while_any_robot_of_a_fleet_is_shown_its_robots_are_read_again(selected, asked):
    facts = fleet_facts.of_fleet(READY, READY)
    polled: list[int] = []
    page = SimpleNamespace(
        facts=replace(facts.about(selected), robots=(*facts.robots, AINO)),
        _services=SimpleNamespace(engine=SimpleNamespace(poll=polled.append)),
    )
    HomeViewModel._read_again(page)
    assert polled == asked


def test_a_question_that_a_robot_shows_long_after_its_answer_is_asked_again(ui):
    said = SimpleNamespace(snackbars=SimpleNamespace(show=lambda *_args, **_named: None))
    page = SimpleNamespace(
        facts=FACTS,
        _presses=Presses(),
        _shell=said,
        act_once=lambda _key, _work, done, _failed: done(None),
    )
    HomeCommands.answer_of(page, AINO, "q-1", "Yes")
    assert page.facts.answered == {"q-1"}
    ui.advance(commands.ASKED_UNTIL + 0.1)
    assert page.facts.answered == set()


def test_what_stays_after_clear_queue_is_not_being_cancelled():
    page = SimpleNamespace(
        facts=FACTS, _presses=Presses(), _shell=SimpleNamespace(mission_names=SimpleNamespace(known=NOTHING_KNOWN))
    )
    page._services = SimpleNamespace(clock=SimpleNamespace(now=lambda: NOW))
    key = OfRobot("clear", AINO.id)
    page._presses.begin(key)
    assert HomeViewModel._with_own(page, FACTS).clearing == {AINO.id}
    page._presses.rest(key)  # it is done, and read a moment later
    page._presses.end(key)
    assert HomeViewModel._with_own(page, FACTS).clearing == set()


@pytest.mark.parametrize(
    ("taken_by", "text"), [("MiR 2", "MiR 2 stops where it is."), ("", "Its robot stops where it is.")]
)
def test_stopping_a_mission_names_the_robot_that_the_fleet_chose(taken_by, text):
    known = fleet_facts.with_any_run()
    run = replace(known.open[0], taken_by=taken_by)
    key, asked = ("execution", run.id), []
    shell = SimpleNamespace(sheets=SimpleNamespace(ask=lambda _title, text, *_rest: asked.append(text)))
    view_model = SimpleNamespace(
        facts=replace(known.about(fleet_facts.ANY.id), open=(run,)),
        view=SimpleNamespace(today=(Item(key, "Kits"),)),
        _row=lambda _key: Item(key, "Kits"),
        _presses=SimpleNamespace(is_same=lambda _press: False),
        _shell=shell,
    )
    HomeCommands.cancel(view_model, key)
    assert asked == [text]
