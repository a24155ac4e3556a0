"""How often the window's loop turns. A turn costs 0.3 ms of processor time even with nothing to draw; for an idle
window that was nearly all. So the loop turns less often while the window is not in use and nothing in it moves."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager

IN_USE = 50  # turns a second, asked for: kivy makes a third more, 67
AT_REST = 15  # makes 20: the first touch waits 50 ms at most
REST = 0.5  # s without a frame or a sign of use; an animation draws each
SIGNS = (
    "on_draw",
    "on_mouse_down",
    "on_mouse_move",
    "on_touch_down",
    "on_touch_move",
    "on_touch_up",
    "on_key_down",
    "on_textinput",
    "on_cursor_enter",
)


def kivy_turns(per_second: int) -> None:
    """Kivy reads this number before it sleeps; once the clock exists it can't be changed in another way (kivy 2.3.1,
    clock.py)."""
    from kivy.clock import Clock

    Clock._max_fps = per_second


@contextmanager
def slow_at_rest(turn: Callable[[int], None] = kivy_turns) -> Iterator[None]:
    """Active while the block lasts. ``turn`` gets the number of turns per second; on the UI thread. A mouse button or a
    key counts before the loop sleeps again; Enter on the widget with the ring, which only ``KeyFocus`` sees, counts
    when it is drawn, a turn later. Kivy is imported late, as it is configured before."""
    from kivy.clock import Clock
    from kivy.core.window import Window

    rest = Clock.create_trigger(lambda _dt: turn(AT_REST), REST)

    def move(*_args: object) -> None:
        turn(IN_USE)
        rest.cancel()
        rest()

    for sign in SIGNS:
        Window.fbind(sign, move)
    move()
    try:
        yield
    finally:
        for sign in SIGNS:
            Window.funbind(sign, move)
        rest.cancel()
        turn(IN_USE)
