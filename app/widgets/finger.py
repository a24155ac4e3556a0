"""A finger on the screen. What would move the things under it waits until it has left: no tap ends on something else, or nowhere."""
from kivy.base import EventLoop
from kivy.clock import Clock

LONGEST = 2.0                            # s; who rests a hand on the screen must not keep an alarm away
ASKED = "first asked about"              # key of touch.ud; kivy's own times of a touch are the wall clock's


def is_down() -> bool:
    """Whether to wait for a finger on the screen, LONGEST seconds at most from the first question about it."""
    now = Clock.get_time()
    asked = [touch.ud.setdefault(ASKED, now) for touch in EventLoop.touches if touch.is_touch]
    return any(now - first < LONGEST for first in asked)
