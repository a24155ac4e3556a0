"""Lists whose rows keep their identity while the data change.

Each row of ``data`` is a frozen dataclass, the ``item`` of its view; for lists that change with a ``key`` that
identifies the row. A moved list never turns a row under a finger into another one: each view belongs to a
key, and a view that is reused for another row ignores an earlier press.
"""

from collections.abc import Callable, Sequence

from kivy.clock import Clock
from kivy.factory import Factory
from kivy.properties import (
    ListProperty,
    ObjectProperty,
    StringProperty,
)
from kivymd.uix.boxlayout import MDBoxLayout

from app.widgets.dock import dock
from app.widgets.events import Fires, Late
from app.widgets.places import places

STILL = 1.0  # s a row has to stand where it is
KEPT = 10.0  # s after a list was touched, in which its rows don't change places
SPARE = 4  # views that a list keeps for later rows


class KeptOrder:
    """The order of the rows of a list. After a touch they keep it for a while, even if the data change, so that none slides
    under a finger; ``sort_again`` is called when that is over."""

    def __init__(self, sort_again: Callable[[], object]):
        self._keep = Clock.create_trigger(lambda _dt: sort_again(), KEPT)

    def touched(self) -> None:
        """A finger is on the list."""
        self._keep.cancel()
        self._keep()

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


class Row:
    """Mixin of row classes. ``act("cancel")`` notifies the list, which fires ``on_action(key, "cancel")``; ``host`` is
    that list. A tap on a row that can be pressed is the action "open".

    A row where another was a moment ago takes no tap (``places``); for a shorter time while somebody types: rows come and go because of
    that.
    """

    key = ObjectProperty(None, allownone=True)
    item = ObjectProperty(rebind=True)  # the row of data that is shown
    host = ObjectProperty(None, allownone=True)
    stands = True
    meaning = property(lambda self: self.key)
    still = property(lambda _self: STILL if dock.field is None else STILL / 2)

    def on_key(self, *_):
        places.changed()

    def on_release(self):
        self.act("open")

    def act(self, action: str, *values) -> None:
        if self.host is not None:
            self.host.kept.touched()
            self.host.dispatch("on_action", self.key, action, *values)

    def take(self, data) -> None:
        """Show ``data``."""
        self.key, self.item = getattr(data, "key", None), data


class RowPress:
    """Mixin of the buttons in a row, which get the ``name`` of their action."""

    name = StringProperty()
    meaning = property(lambda self: self.name)

    def on_name(self, *_):
        places.changed()

    def on_release(self):
        self.parent.row.act(self.name, self)


class Rows(Fires, Late, MDBoxLayout):
    """One ``viewclass`` per row of ``data`` in a box, for few rows. The view of a removed row is reused for a new one: building another
    would take 10 ms and leave garbage."""

    viewclass = StringProperty("ListRow")
    data = ListProperty()

    __events__ = ("on_action",)

    def __init__(self, **kwargs):
        self._views = {}
        self.kept = KeptOrder(self.on_data)
        self._spare = []  # views whose rows were removed
        super().__init__(**kwargs)

    def on_touch_down(self, touch):
        if self.collide_point(*touch.pos):
            self.kept.touched()
        return super().on_touch_down(touch)

    def on_data(self, *_):
        rows = {
            getattr(data, "key", n): data for n, data in enumerate(self.kept.in_order(self.data, list(self._views)))
        }
        if len(rows) != len(self.data):
            raise ValueError("two rows with one key")
        places.change(self)
        old, self._views = self._views, {}
        removed = [view for key, view in old.items() if key not in rows]
        self._spare += removed
        for key, data in rows.items():
            view = old.get(key) or (self._spare.pop() if self._spare else Factory.get(self.viewclass)(item=data))
            view.host = self
            if key not in old:
                places.come(view, among_others=bool(old))
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

    on_viewclass = on_data
