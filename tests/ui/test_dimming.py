"""The screen at night: dark when left alone, and the touch or key that makes it bright does nothing else."""

from __future__ import annotations

from dataclasses import replace
from datetime import UTC, datetime

import pytest
from kivy.core.window import Window
from kivy.tests.common import UnitTestTouch

from app.domain.models import Settings
from app.screens.frame.dimming import LEFT_ALONE, Dimming, is_night
from app.widgets.buttons import CommandButton
from app.widgets.fields import Field, FieldInput
from app.widgets.frame import TopBar
from tests.support.clock import VirtualClock
from tests.ui.whole_app import shown


@pytest.mark.parametrize(
    ("begins", "ends", "hours"),
    [
        (None, 6, []),
        (22, 6, [22, 23, 0, 1, 2, 3, 4, 5]),
        (0, 5, [0, 1, 2, 3, 4]),
        (13, 15, [13, 14]),
        (6, 6, list(range(24))),
    ],
)
def test_the_hours_of_the_night_are_those_of_the_settings(begins, ends, hours):
    settings = replace(Settings(timezone="Europe/Helsinki"), dim_from=begins, dim_until=ends)
    instants = [datetime(2026, 11, 23, hour, 59, tzinfo=UTC) for hour in range(24)]
    assert sorted((now.hour + 2) % 24 for now in instants if is_night(settings, now)) == sorted(hours)


@pytest.fixture
def dimming(ui):
    dimming = Dimming(VirtualClock())
    dimming.start()
    yield dimming
    dimming.stop()


def leave_alone(dimming: Dimming) -> None:
    dimming._clock.advance(LEFT_ALONE)
    dimming.look(True)


@pytest.fixture
def button(ui) -> CommandButton:
    return ui.show(CommandButton(text="Run"))


@pytest.fixture
def pressed(button) -> list[str]:
    """What the button has taken."""
    taken: list[str] = []
    button.bind(on_press=lambda _button: taken.append("down"), on_release=lambda _button: taken.append("up"))
    return taken


def test_the_touch_that_makes_it_bright_presses_nothing_and_the_next_one_does(ui, dimming, button, pressed):
    leave_alone(dimming)
    assert dimming.is_dark
    ui.tap_at(*button.center)
    assert not dimming.is_dark
    ui.advance(1)
    assert pressed == []
    ui.tap_at(*button.center)
    assert pressed == ["down", "up"]


def test_a_finger_that_moves_after_waking_it_presses_nothing_either(ui, dimming, button, pressed):
    leave_alone(dimming)
    touch = UnitTestTouch(*button.pos)
    touch.touch_down()
    ui.advance(1)
    touch.touch_move(*button.center)
    touch.touch_up()
    ui.advance(1)
    assert pressed == []


def test_a_letter_that_makes_it_bright_is_not_typed(ui, dimming):
    field = ui.find(FieldInput, ui.show(Field(label="Name"), (400, 120)))
    ui.type(field, "a")
    leave_alone(dimming)
    for letter in "bc":
        Window.dispatch("on_key_down", ord(letter), 0, "", [])
        Window.dispatch("on_textinput", letter)
        Window.dispatch("on_key_up", ord(letter), 0)
    assert field.text == "ac"


def test_a_key_that_makes_it_bright_does_nothing_else(ui, dimming, pressed, keys):
    heard: list[int] = []
    Window.bind(on_keyboard=(hear := lambda _window, key, *_args: heard.append(key)))
    leave_alone(dimming)
    ui.key(13)
    assert (dimming.is_dark, heard) == (False, [])
    ui.advance(1)
    ui.key(13)
    Window.unbind(on_keyboard=hear)
    assert heard == [13]


def test_it_stays_bright_while_it_is_used_by_day_and_at_a_new_alarm(dimming, ui):
    leave_alone(dimming)
    dimming.look(False)  # an alarm has come
    assert not dimming.is_dark
    dimming.look(True)  # and was seen by a person
    assert dimming.is_dark
    ui.tap_at(10, 10)
    dimming._clock.advance(LEFT_ALONE - 1)
    dimming.look(True)
    assert not dimming.is_dark


def test_it_is_as_large_as_the_window_when_that_turns(dimming, ui):
    before = tuple(Window.size)
    leave_alone(dimming)
    Window.size = 800, 1280
    ui.advance()
    assert dimming._cover.size == (800, 1280)
    Window.size = before


@pytest.mark.long
def test_the_app_dims_at_night_and_an_alarm_makes_it_bright_until_it_is_acknowledged(container, ui):
    container.catalogue.change_settings(dim_from=0, dim_until=0)
    for alarm in container.alarms.open():
        container.alarms.acknowledge(alarm.id)
    with shown(container, ui) as app:
        dimming = app._frame._dimming
        ui.wait(lambda: ui.find(TopBar).clock)

        def rest() -> None:
            container.clock.advance(LEFT_ALONE)
            ui.advance(1.1)

        ui.wait(lambda: app._frame._is_read)
        rest()
        assert dimming.is_dark
        container.alarms.raise_("network_lost", "tablet")
        ui.wait(lambda: not dimming.is_dark)
        rest()
        assert not dimming.is_dark
        container.alarms.acknowledge(container.alarms.open()[0].id)
        ui.wait(lambda: dimming.is_dark)
