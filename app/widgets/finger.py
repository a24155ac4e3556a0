"""Whether a finger is on the screen: changes that move widgets wait until it is lifted, so that a tap ends where it
began."""

from kivy.base import EventLoop
from kivy.clock import Clock

LONGEST = 2.0  # s: a hand that rests on the screen must not suppress an alarm
ASKED = "first asked about"  # key of touch.ud; kivy's own times of a touch are wall clock times


def is_down() -> bool:
    """Whether to wait for a finger on the screen, LONGEST seconds at most from the first question about it."""
    now = Clock.get_time()
    asked = [touch.ud.setdefault(ASKED, now) for touch in EventLoop.touches if touch.is_touch]
    return any(now - first < LONGEST for first in asked)
