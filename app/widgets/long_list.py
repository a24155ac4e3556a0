"""A list of thousands of rows; only the visible ones exist as widgets.

Not kivy's RecycleView: that one reassigns its views whenever a height changes, so that rows which set their own height
(a reason on two lines, an opened row) never settle, and a pressed view may become another row. Here views belong to
keys, heights are remembered per key, and the visible rows stay in place when rows are added above.

A frame of scrolling costs only the rows that become visible, for any length of the list: each view is inside a ``Seat``
that is moved without a new layout of its content, and positions are calculated only below a row whose height changes.
"""

from bisect import bisect_left, bisect_right
from itertools import accumulate

from kivy.clock import Clock
from kivy.factory import Factory
from kivy.metrics import dp
from kivy.properties import BooleanProperty, ListProperty, NumericProperty, ObjectProperty, StringProperty
from kivy.uix.relativelayout import RelativeLayout

from app.widgets.events import Fires
from app.widgets.lists import KeptOrder
from app.widgets.places import places
from app.widgets.scrolling import CalmScroll


class Seat(RelativeLayout):
    """Holds a view and is moved instead of it; as large as the view."""

    def __init__(self, view, **kwargs):
        self.view = view
        super().__init__(size_hint=(None, None), **kwargs)
        self.add_widget(view)
        view.fbind("size", self._fit)
        places.watch(self)
        self._fit()

    def _fit(self, *_):
        self.size = self.view.size


class LongList(Fires, CalmScroll):
    """``data`` as in ``lists``, each row with a ``key``; row classes mix in ``Row`` and set their own height.

    ``on_action(key, action, *values)`` comes from the rows, ``on_end`` when the last rows become visible (load the next
    page).
    """

    viewclass = StringProperty("ListRow")
    data = ListProperty()
    order = ObjectProperty(None, allownone=True)  # another one where somebody has asked for another order
    spacing = NumericProperty(0)
    row_height = NumericProperty("64dp")  # assumed for rows that were never visible
    empty_text = StringProperty()
    content_height = NumericProperty(0)  # of all rows; ``row_height`` for those that were never visible
    moves = BooleanProperty(False)  # whether it is being scrolled, or was a moment ago

    __events__ = ("on_action", "on_end")

    def __init__(self, **kwargs):
        self.kept = KeptOrder(self._sort_again)
        self._has_changed = False  # since its rows were placed
        self._rows: list = []  # the data in the order in which they are shown
        self._keys: list = []
        self._places: dict = {}  # of keys in the list
        self._tops: list[float] = [0.0]  # of each row, from the top of the content; the last is the whole height
        self._heights: dict = {}
        self._changed_from: int | None = 0  # from this row on the tops are not yet those of the present heights
        self._live: dict[object, Seat] = {}
        self._spare: list[Seat] = []
        self._anchor: tuple | None = None  # (key of the first visible row, px of it above the edge); None: at the top
        self._width = 0
        self._moving = False
        self._rest = Clock.create_trigger(self._stand_still, 0.2)
        self._arrange = Clock.create_trigger(self._place_rows, -1)
        self._content = RelativeLayout(size_hint_y=None, height=0)
        self._content.bind(height=self.setter("content_height"))
        super().__init__(**kwargs)
        self.add_widget(self._content)
        self.bind(size=self._arrange, empty_text=self._arrange, viewclass=self._arrange)
        self.bind(spacing=self._recalculate, row_height=self._recalculate)
        self.bind(data=self._changed, order=self._ordered, scroll_y=self._scrolled)
        self._changed()

    def show(self, key) -> None:
        """Scroll until the row of ``key`` is at the top, as far as the list goes."""
        if key in self._places:
            self._anchor = key, 0.0
            self._arrange()

    @property
    def views(self) -> list:
        """The rows that exist now, from the top."""
        return [seat.view for seat in sorted(self._live.values(), key=lambda seat: -seat.y)]

    def reveal(self, key) -> None:
        """Scroll until that row is completely visible, and no further."""
        if key not in self._places:
            return
        self._calculate()
        n, above = self._places[key], (1 - self.scroll_y) * max(0.0, self._content.height - self.height)
        least = self._tops[n] + self._height_of(key) - self.height  # what the upper edge shows then
        if self._tops[n] < above - 1:
            self.show(key)
        elif least > above + 1:
            self.show(self._keys[min(n, bisect_left(self._tops, least - 1))])

    def next_key(self, key, by: int):
        """The key of the row ``by`` rows below (< 0: above) that of ``key``; None beyond the ends."""
        n = self._places.get(key, -1) + by
        return self._keys[n] if key in self._places and 0 <= n < len(self._keys) else None

    # ------------------------------------------------------------------ what is where
    def shown_order(self) -> list:
        """The data in the order in which they are shown."""
        return self.kept.in_order(self.data, self._keys)

    def _sort_again(self):
        self._changed()

    def _ordered(self, *_):
        self.kept.sort_at_once()
        self._sort_again()

    def on_touch_down(self, touch):
        if self.collide_point(*touch.pos):
            self.kept.touched()
        return super().on_touch_down(touch)

    def _changed(self, *_):
        self._rows = self.shown_order()
        before, self._keys = self._keys, [row.key for row in self._rows]
        self._has_changed = bool(before)
        places.change(self)
        self._places = {key: n for n, key in enumerate(self._keys)}
        if len(self._places) != len(self._keys):
            raise ValueError("two rows with one key")
        if self._anchor is not None and self._anchor[0] in set(before) - set(
            self._keys
        ):  # the first visible one was removed
            after = before[before.index(self._anchor[0]) :]
            self._anchor = next(((key, 0.0) for key in after if key in self._places), None)
        for key, seat in self._live.items():
            if key in self._places:
                seat.view.take(self._rows[self._places[key]])
        self._recalculate()

    def _recalculate(self, *_):
        self._changed_from = 0
        self._arrange()

    def _scrolled(self, *_):
        if not self._moving:
            above = (1 - self.scroll_y) * max(0, self._content.height - self.height)
            n = min(bisect_right(self._tops, above + 0.5), len(self._keys)) - 1
            self._anchor = (self._keys[n], above - self._tops[n]) if above > 1 and n >= 0 else None
            self.moves = True
            self._rest.cancel()
            self._rest()
            self._arrange()

    def _stand_still(self, _dt):
        """Nothing has moved for a moment."""
        self.moves = False

    def _height_of(self, key) -> float:
        return self._heights.get(key, self.row_height)

    def _place_rows(self, _dt):
        if self.width < 2:
            return
        if self.width != self._width:  # other line breaks, other heights
            self._width = self.width
            self._heights.clear()
            self._changed_from = 0
        self._calculate()
        above = self._hold_place()
        first = max(0, bisect_right(self._tops, above) - 1)
        last = min(len(self._keys), bisect_left(self._tops, above + self.height))
        self._populate(range(first, last))
        self._say_empty()
        if self._keys and last >= len(self._keys) and self._content.height > self.height:
            self.dispatch("on_end")

    def _calculate(self):
        first = self._changed_from
        if first is not None:
            known, guess, spacing = self._heights, self.row_height, self.spacing
            heights = (known.get(key, guess) + spacing for key in self._keys[first:])
            self._tops[first:] = accumulate(heights, initial=self._tops[first])
            self._moving = True  # kivy adjusts scroll_y to the new height: this is not scrolling by the user
            self._content.height = max(0, self._tops[-1] - (spacing if self._keys else 0))
            self._moving = False
            self._changed_from = None

    def _hold_place(self) -> float:
        """Keep the anchor row in place; returns the px of content above the upper edge."""
        hidden = max(0.0, self._content.height - self.height)
        above = 0.0
        if self._anchor is not None and self._anchor[0] in self._places:
            above = min(hidden, self._tops[self._places[self._anchor[0]]] + self._anchor[1])
        if hidden and abs((1 - self.scroll_y) * hidden - above) > 0.5:
            self._moving = True
            self.scroll_y = 1 - above / hidden
            self._moving = False
        return above

    def _populate(self, shown: range):
        """Create or reuse views for the rows ``shown``."""
        wanted = {self._keys[n]: n for n in shown}
        self._spare += [self._live.pop(key) for key in [key for key in self._live if key not in wanted]]
        for key, n in wanted.items():
            seat = self._live.get(key)
            if seat is None:
                seat = self._live[key] = self._seat_for(self._rows[n])
                places.come(seat, among_others=self._has_changed)
                seat.view.take(self._rows[n])
                if seat.parent is None:
                    self._content.add_widget(seat)
            view = seat.view
            view.width = self.width
            seat.pos = 0, self._content.height - self._tops[n] - view.height
            if self._heights.get(key) != view.height:
                self._heights[key] = view.height
                self._changed_from = n if self._changed_from is None else min(n, self._changed_from)
                self._arrange()
        for seat in self._spare:
            if seat.parent is not None:
                self._content.remove_widget(seat)
        self._forget_spare()
        self._has_changed = False

    def _seat_for(self, data) -> Seat:
        """One that shows that row already has the least to do."""
        same = (seat for seat in self._spare if seat.view.key == data.key)
        seat = next(same, self._spare[-1] if self._spare else None)
        if seat is None:
            return self._new_seat(data)
        self._spare.remove(seat)
        return seat

    def _forget_spare(self):
        """Keep as many as fit: a larger window, or rows without their height yet, needed more."""
        if self._spare and self._heights:
            usual = sum(self._heights.values()) / len(self._heights) + self.spacing
            del self._spare[max(0, int(self.height / usual) + 2 - len(self._live)) :]

    def _new_seat(self, data):
        view = Factory.get(self.viewclass)(item=data, size_hint=(None, None), width=self.width)
        view.host = self
        view.fbind("height", self._arrange)
        return Seat(view)

    def _say_empty(self):
        labels = [child for child in self._content.children if not isinstance(child, Seat)]
        wanted = bool(self.empty_text) and not self._keys
        if wanted and not labels:
            labels = [Factory.Body(size_hint_x=None, halign="center", padding=dp(16))]
            labels[0].fbind("height", self._arrange)  # which follows its text later
            self._content.add_widget(labels[0])
        for label in labels:
            if wanted:
                label.text, label.width = self.empty_text, self.width - dp(12)  # rows leave the bar that much, too
                self._content.height = label.height + dp(16)
            else:
                self._content.remove_widget(label)
