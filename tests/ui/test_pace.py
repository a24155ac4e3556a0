"""The loop runs less often while the window is not used and nothing moves, and at full speed as soon as either begins."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path
from types import SimpleNamespace

import pytest
from kivy.animation import Animation
from kivy.clock import Clock
from kivy.core.window import Window
from kivy.uix.widget import Widget

from app.widgets.buttons import CommandButton
from app.window import window
from app.window.key_focus import ENTER, KeyFocus
from app.window.pace import AT_REST, IN_USE, REST, slow_at_rest
from tests.ui.drawing import put_down

ROOT = Path(__file__).parents[2]
LOOP = """
import time
from tests.ui import headless
headless.install()
from kivy.base import EventLoop
from kivy.clock import Clock
from kivy.uix.widget import Widget
from app.window.pace import AT_REST, slow_at_rest

EventLoop.window.add_widget(Widget())
with slow_at_rest():
    began = time.monotonic()
    while Clock._max_fps != AT_REST and time.monotonic() < began + 30:
        EventLoop.idle()
    began, turns = time.monotonic(), 0
    while time.monotonic() < began + 1:
        EventLoop.idle()
        turns += 1
print(turns)
"""


@pytest.fixture
def turns(ui):
    """The frame rates that the loop was set to."""
    rates: list[int] = []
    ui.show(Widget())
    with slow_at_rest(rates.append):
        yield rates
    assert rates[-1] == IN_USE
    rates.clear()
    Window.dispatch("on_mouse_move", 10, 10, [])
    ui.advance(2 * REST)
    assert rates == []  # it is no longer adjusted


def rest(ui, turns) -> None:
    ui.advance(2 * REST)
    assert turns[-1] == AT_REST


def test_the_loop_slows_down_after_a_while(ui, turns):
    ui.frames_drawn(0.8 * REST)
    assert turns[-1] == IN_USE
    ui.frames_drawn(0.4 * REST)
    assert turns[-1] == AT_REST


def test_a_frame_that_is_drawn_wakes_it(ui, turns):
    rest(ui, turns)
    Window.canvas.ask_update()
    ui.frames_drawn(0.1)
    assert turns[-1] == IN_USE
    rest(ui, turns)


def test_an_animation_keeps_it_awake(ui, turns):
    moving = Widget()
    ui.show(moving)
    rest(ui, turns)
    Animation(opacity=0, d=4 * REST).start(moving)
    for _part in range(7):
        ui.frames_drawn(REST / 2)
        assert turns[-1] == IN_USE


@pytest.mark.parametrize(
    ("sign", "of_what"),
    [
        ("on_mouse_down", (10, 10, "left", [])),
        ("on_mouse_move", (10, 10, [])),
        ("on_key_down", (97, 4, "a", [])),
        ("on_cursor_enter", ()),
    ],
)
def test_a_sign_of_use_wakes_it_before_it_sleeps_again(ui, turns, sign, of_what):
    rest(ui, turns)
    Window.dispatch(sign, *of_what)
    assert turns[-1] == IN_USE


def test_a_finger_that_only_rests_on_the_glass_wakes_it(ui, turns):
    rest(ui, turns)
    finger = put_down(100, 100)
    assert turns[-1] == IN_USE
    rest(ui, turns)
    finger.touch_up()
    assert turns[-1] == IN_USE


def test_enter_on_what_has_the_ring_wakes_it_as_it_is_drawn(ui, turns):
    button, keys = ui.show(CommandButton(text="Save")), KeyFocus()
    keys.start()  # as the app does, after the loop's own
    try:
        keys.target = button
        rest(ui, turns)
        ui.key_down(ENTER)
        assert ui.frames_drawn(2 / AT_REST)
        assert turns[-1] == IN_USE
    finally:
        keys.stop()


def test_the_window_runs_so(ui, monkeypatch):
    seen: list[int] = []
    monkeypatch.setattr(window.signal, "signal", lambda *_args: None)
    of_tests = Clock._max_fps
    try:
        window._run(SimpleNamespace(run=lambda: seen.append(Clock._max_fps)))
    finally:
        Clock._max_fps = of_tests
    assert seen == [IN_USE]


def test_kivys_loop_obeys_the_frame_rate():
    """In its own process, in real time. Only a slow machine is slower than this."""
    output = subprocess.run(
        [sys.executable, "-c", LOOP], cwd=ROOT, check=True, capture_output=True, text=True, timeout=90
    ).stdout
    assert float(output.splitlines()[-1]) <= 1.5 * AT_REST < IN_USE
