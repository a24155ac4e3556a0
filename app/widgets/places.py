"""Where everything that can be pressed stands: a touch counts only for what was there when the finger came down, and meant the same.
What has just moved there takes none either; what a finger has scrolled has not moved.

``places`` is global, like the window. Buttons register themselves (``kivymd_cures.buttons``). Another widget that takes touches says
that it ``stands``, calls ``watch`` once, and asks ``misses`` about each touch. What becomes another one in the same place gets another
``meaning``.
"""

import weakref

from kivy.clock import Clock
from kivy.core.window import Window
from kivy.metrics import dp
from kivy.uix.scrollview import ScrollView

from app.widgets.around import around

STILL = 0.5  # s a button has to stand where it is, unless it says how long it has to be ``still``
COMES = 0.5  # s in which one that has come finds its place
NOTHING = object()
MEANT = "when a finger came down, and what stood there and its meaning"  # key of touch.ud


class Place:
    """Of a button: its edges (px of the window), the same as if nothing were scrolled, its ``meaning`` if it has one, when it came, and
    until when it rests."""

    def __init__(self, button, before):
        now = Clock.get_time()
        page = next(around(button, ScrollView), None)
        scrolled = 0 if page is None else _top(page) - _top(page.children[0])
        left, bottom, right, top = self.edges = _edges(button)
        self.unscrolled = left, bottom + scrolled, right, top + scrolled
        self.meaning, self.still = _meaning(button), getattr(button, "still", STILL)
        self.came, self.until = (before.came, before.until) if before else (now, 0.0)
        if now - self.came > COMES and self._is_another(before):
            self.rest()

    def _is_another(self, before) -> bool:
        has_moved = _differ(before.edges, self.edges) and _differ(before.unscrolled, self.unscrolled)
        return has_moved or before.meaning != self.meaning

    def rest(self) -> None:
        self.until = Clock.get_time() + self.still


class Places:
    """Of the buttons in the window, as they were drawn last."""

    def __init__(self):
        self._known = weakref.WeakKeyDictionary()
        self._age = 0  # how often something has come or gone
        self._look = Clock.create_trigger(self._note)  # before the first touch after the frame that has moved something
        self.changed = Clock.create_trigger(lambda _dt: self._look(), -1)

    def watch(self, widget, *more) -> None:
        """From now on it is known when it moves; or what is in it, which ``more`` properties tell."""
        for name in ("pos", "size", "parent", *more):
            widget.fbind(name, self.changed)

    def come(self, widget, among_others: bool) -> None:
        """It is new, or used for another thing in another place; where others have stood, a tap may have been meant for them."""
        for part in widget.walk(restrict=True):
            self._known.pop(part, None)
            if among_others and getattr(part, "stands", False):
                self._known[part] = Place(part, None)
                self._known[part].rest()

    def change(self, around) -> None:
        """What is in it is about to change: whatever that moves has moved, also what has only just come."""
        for part in around.walk(restrict=True):
            if part in self._known:
                self._known[part].came = 0.0

    def begin(self, touch) -> None:
        """A finger has come down there."""
        x, y = touch.pos
        meant = weakref.WeakKeyDictionary()
        for button in _buttons():
            left, bottom, right, top = _edges(button)
            if left <= x <= right and bottom <= y <= top and not self._has_changed(button):
                meant[button] = _meaning(button)
        touch.ud[MEANT] = self._age, meant

    def let_go(self) -> None:
        """Something has come or gone: present touches press nothing, nor do those that a page that scrolls has still to hand on."""
        self._age += 1

    def is_another(self, widget, touch) -> bool:
        """Whether that touch wasn't meant for ``widget`` and what it is in, or one of them has become another since."""
        if MEANT not in touch.ud:
            return False
        age, meant = touch.ud[MEANT]
        return age != self._age or any(meant.get(each, NOTHING) != _meaning(each) for each in _standing(widget))

    def misses(self, widget, touch) -> bool:
        """Whether that touch is on ``widget``, but was meant for what stood there before."""
        return widget.collide_point(*touch.pos) and self.is_another(widget, touch)

    def _has_changed(self, button) -> bool:
        if self._is_still(button):
            return False
        self._known[button].meaning = _meaning(button)
        self._known[button].rest()  # longer for an impatient hand
        return True

    def _is_still(self, button) -> bool:
        """Also since the last frame."""
        place = self._known.get(button)
        return place is None or (Clock.get_time() >= place.until and place.meaning == _meaning(button))

    def has_just_moved(self, widget) -> bool:
        """Or what it is in has, or means something else."""
        return not all(map(self._is_still, around(widget.__self__)))  # kv has only proxies

    def _note(self, _dt):
        known = self._known
        self._known = weakref.WeakKeyDictionary({button: Place(button, known.get(button)) for button in _buttons()})


def _buttons():
    waiting = list(Window.children)
    while waiting:
        widget = waiting.pop()
        if widget.opacity:
            if getattr(widget, "stands", False):
                yield widget
            waiting += widget.children


def _standing(widget):
    return (each for each in around(widget) if getattr(each, "stands", False))


def _meaning(button):
    return getattr(button, "meaning", None)


def _edges(widget):
    left, bottom = widget.to_window(*widget.pos)
    return left, bottom, left + widget.width, bottom + widget.height


def _top(widget) -> float:
    return widget.to_window(widget.x, widget.top)[1]


def _differ(before, after) -> bool:
    """Whether both corners do: what has only grown still stands."""
    dx, dy, dx2, dy2 = (abs(a - b) > dp(8) for a, b in zip(before, after, strict=True))
    return (dx or dy) and (dx2 or dy2)


places = Places()
