"""Lists whose rows keep their identity while the data change.

Each row of ``data`` is a frozen dataclass, the ``item`` of its view; for lists that change with a ``key`` that
identifies the row. A moved list never turns a row under a finger into another one: each view belongs to a
key, and a view that is reused for another row ignores an earlier press.
"""

import math
from collections.abc import Callable, Sequence

from kivy.clock import Clock
from kivy.factory import Factory
from kivy.metrics import dp
from kivy.properties import (
    ListProperty,
    ObjectProperty,
    StringProperty,
)
from kivymd.uix.boxlayout import MDBoxLayout

from app.widgets.dock import dock
from app.widgets.events import Fires
from app.widgets.places import places

STILL = 1.0  # s a row has to stand where it is
MEASURED = 0.5  # s in which a row that has come finds its height
KEPT = 10.0  # s after a list was touched, in which its rows don't change places
SPARE = 4  # views that a list keeps for later rows


class Standing:
    """Where the rows of a list are, so that none slides under a finger. After a touch they keep their order for a
    while, even if the data change; ``sort_again`` is called when that is over. When rows come, go, grow or are sorted, those
    that are elsewhere than before rest: they take no touch for STILL s, and longer if the list is touched during it.
    While the user types, rows come and go because of that."""

    def __init__(self, sort_again: Callable[[], object]):
        self._ends = 0.0  # of the rest
        self._places = {}  # by key: where a row was before the last change, and until when it rests nevertheless
        self._keep = Clock.create_trigger(lambda _dt: sort_again(), KEPT)

    def touched(self) -> None:
        """A finger is on the list."""
        self._keep.cancel()
        self._keep()
        now = Clock.get_time()
        if now < self._ends:
            self._ends = now + STILL
            self._places = {
                key: (place, self._ends if until > now else 0.0) for key, (place, until) in self._places.items()
            }

    def sort_at_once(self) -> None:
        """Somebody has asked for another order."""
        self._keep.cancel()

    def in_order(self, data: Sequence, before: Sequence) -> list:
        """``data`` with the rows of ``before`` (keys) in their old order, if they still exist; new ones in their
        places."""
        by_key = {row.key: row for row in data} if self._keep.is_triggered and data and hasattr(data[0], "key") else {}
        kept = [by_key[key] for key in before if key in by_key]
        if not kept:
            return list(data)
        known = set(before)
        for place, row in enumerate(data):
            if row.key not in known:
                kept.insert(place, row)
        return kept

    def note(self, before, after, rows) -> None:
        """The keys of a list are about to change; ``rows`` are those that exist."""
        before, after = list(before), list(after)
        if not before or not after:
            self._ends = 0.0  # no row could have slid
        elif before != after:
            self._move(rows)

    def grown(self, row, rows) -> None:
        """The height of ``row`` has changed, and those below it are about to move."""
        if Clock.get_time() - row.came > MEASURED:
            self._move(rows)

    def _move(self, rows) -> None:
        if dock.field is None:
            self._places = {row.key: (row.to_window(*row.pos), self._rests_until(row)) for row in rows}
            self._ends = Clock.get_time() + STILL

    def has_left(self, row) -> bool:
        """Whether that row stands elsewhere than a moment ago."""
        return Clock.get_time() < self._rests_until(row)

    def _rests_until(self, row) -> float:
        then, until = self._places.get(row.key, ((-1e6, -1e6), 0.0))
        place = row.to_window(*row.pos)
        return self._ends if max(abs(a - b) for a, b in zip(place, then, strict=True)) > dp(8) else until


class Row:
    """Mixin of row classes. ``act("cancel")`` notifies the list, which fires ``on_action(key, "cancel")``; ``host`` is
    that list. A tap on a row that can be pressed is the action "open".

    A scroll view forwards a short tap only after the finger has left. If the list has moved by then, another row is
    under the touch, and the tap is dropped; so is one on a row that has just replaced another (``standing``).
    """

    key = ObjectProperty(None, allownone=True)
    item = ObjectProperty(rebind=True)  # the row of data that is shown
    host = ObjectProperty(None, allownone=True)
    stands = True
    meaning = property(lambda self: self.key)
    standing = None
    came = math.inf  # when this view became the row's

    def __init__(self, **kwargs):
        self._pressed_key = None
        self._forget = Clock.create_trigger(lambda _dt: setattr(self, "_pressed_key", None))
        super().__init__(**kwargs)

    @property
    def has_just_moved(self) -> bool:
        return self.standing is not None and self.standing.has_left(self)

    def on_key(self, *_):
        places.changed()

    def on_touch_down(self, touch):
        if self.collide_point(*touch.pos):
            if self.has_just_moved or places.misses(self, touch):
                return True
            self._pressed_key = (self.key,)
        return super().on_touch_down(touch)

    def on_touch_up(self, touch):
        self._forget()  # after the release has reached the widget that grabbed the touch
        return super().on_touch_up(touch)

    def on_release(self):
        self.act("open")

    def act(self, action: str, *values) -> None:
        """A view that has become another row's since it was pressed does nothing."""
        if self._pressed_key not in (None, (self.key,)):
            return
        if self.standing is not None:
            self.standing.touched()
        if self.host is not None:
            self.host.dispatch("on_action", self.key, action, *values)

    def take(self, data) -> None:
        """Show ``data``."""
        self.key, self.item = getattr(data, "key", None), data


class RowPress:
    """Mixin of the buttons in a row, which get a ``name``. What is pressed is the action that the finger came down on,
    also if the button has become another one since."""

    name = StringProperty()
    meaning = property(lambda self: self.name)
    _pressed = ""

    def on_name(self, *_):
        places.changed()

    def on_touch_down(self, touch):
        if self.collide_point(*touch.pos):
            self._pressed = self.name
        return super().on_touch_down(touch)

    def on_touch_up(self, touch):
        is_taken = super().on_touch_up(touch)
        if touch.grab_current is self:
            self._pressed = ""
        return is_taken

    def on_release(self):
        self.parent.row.act(self._pressed or self.name, self)


class Rows(Fires, MDBoxLayout):
    """One ``viewclass`` per row of ``data`` in a box, for few rows. The view of a removed row is reused for a new one: building another
    would take 10 ms and leave garbage."""

    viewclass = StringProperty("ListRow")
    data = ListProperty()
    host = ObjectProperty(None, allownone=True)

    __events__ = ("on_action",)

    def __init__(self, **kwargs):
        self._views = {}
        self.standing = Standing(self._build)
        self._spare = []  # views whose rows were removed
        super().__init__(**kwargs)
        for name in ("data", "viewclass"):
            self.fbind(name, self._build)
        self._build()

    def on_touch_down(self, touch):
        if self.collide_point(*touch.pos):
            self.standing.touched()
        return super().on_touch_down(touch)

    def _build(self, *_):
        rows = {
            getattr(data, "key", n): data for n, data in enumerate(self.standing.in_order(self.data, list(self._views)))
        }
        if len(rows) != len(self.data):
            raise ValueError("two rows with one key")
        self.standing.note(self._views, rows, self._views.values())
        old, self._views = self._views, {}
        removed = [view for key, view in old.items() if key not in rows]
        self._spare += removed
        for key, data in rows.items():
            view = old.get(key) or (self._spare.pop() if self._spare else self._new_view(data))
            view.host, view.standing = self.host or self, self.standing
            if key not in old:
                view.came = Clock.get_time()
                places.forget(view)
            view.take(data)
            view.key = key  # data may have none
            self._views[key] = view
        del self._spare[SPARE:]
        shown = set(self._views.values())
        for view in removed:
            if view not in shown:
                self.remove_widget(view)
        wanted = list(self._views.values())
        if wanted != self.children[::-1]:
            self.clear_widgets()
            for view in wanted:
                self.add_widget(view)

    def _new_view(self, data):
        view = Factory.get(self.viewclass)(item=data)
        view.fbind("height", lambda *_: self.standing.grown(view, self._views.values()))
        return view
