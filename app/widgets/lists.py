"""Lists: rows that keep their identity while data changes, that scroll for more, and that rest on whole rows.

Each row of ``data`` is a frozen dataclass whose fields are properties of the row class (a dict of them does too) and, for lists that
change, ``key``: what the row stands for. A row a
finger is on never becomes another run because the list moved: views belong to keys, and a recycled view forgets its press.
"""
from kivy.animation import Animation
from kivy.clock import Clock
from kivy.effects.scroll import ScrollEffect
from kivy.factory import Factory
from kivy.metrics import dp
from kivy.properties import (
    BooleanProperty,
    ListProperty,
    NumericProperty,
    ObjectProperty,
    OptionProperty,
    StringProperty,
    VariableListProperty,
)
from kivy.uix.boxlayout import BoxLayout
from kivy.uix.floatlayout import FloatLayout
from kivy.uix.scrollview import ScrollView

MEANT = "row the finger came down on"    # key of touch.ud


class Row:
    """Mixin of row classes. ``act("cancel")`` tells the list, which fires ``on_action(key, "cancel")``; ``host`` is that list.

    A scroll view passes a short tap on only when the finger has left. If the list has moved until then, the tap was meant for another
    row than the one that now lies there, and is dropped.
    """
    key = ObjectProperty(None, allownone=True)
    host = ObjectProperty(None, allownone=True)

    def on_touch_down(self, touch):
        if self.collide_point(*touch.pos) and touch.ud.get(MEANT, self.key) != self.key:
            return True
        return super().on_touch_down(touch)

    def act(self, action: str, *values) -> None:
        if self.host is not None:
            self.host.dispatch("on_action", self.key, action, *values)

    def take(self, data) -> None:
        """Show ``data``; what earlier data set and this one leaves out goes back to its default."""
        values = values_of(data)
        for name in getattr(self, "_taken", set()) - values.keys():
            setattr(self, name, self.property(name).defaultvalue)
        for name, value in values.items():
            setattr(self, name, value)
        self._taken = set(values)


def values_of(row) -> dict:
    """The properties that a row of data sets, by name."""
    return row if isinstance(row, dict) else vars(row)


class Rows(BoxLayout):
    """One ``viewclass`` per dict of ``data``, all of them, in a box. For few rows; ``ScrollRows`` scrolls them.

    ``sight`` (left, bottom, right, top) is the part of it that is seen; rows outside it exist, but are not drawn. None: all is seen.
    """
    viewclass = StringProperty()
    data = ListProperty()
    host = ObjectProperty(None, allownone=True)
    sight = ObjectProperty(None, allownone=True)

    __events__ = ("on_action", "on_rows")

    def __init__(self, **kwargs):
        self._views = {}
        self._unseen = set()                 # views that are not drawn
        self._look = Clock.create_trigger(self._draw_seen, -1)
        super().__init__(**kwargs)
        self.fbind("data", self._build)
        self.fbind("viewclass", self._rebuild)
        self.fbind("sight", self._look)
        self._build()

    def on_action(self, key, action, *values):
        """A row was used."""

    def on_rows(self):
        """Rows came, went or moved."""

    def _rebuild(self, *_):
        self.clear_widgets()
        self._views = {}
        self._build()

    def _build(self, *_):
        if not self.viewclass:
            return
        old, self._views = self._views, {}
        for n, data in enumerate(self.data):
            key = values_of(data).get("key", n)
            if key in self._views:
                raise ValueError(f"two rows with the key {key!r}")
            view = old.pop(key, None) or Factory.get(self.viewclass)()
            view.host = self.host or self
            Row.take(view, data)
            self._views[key] = view
        for view in old.values():
            self.remove_widget(view)
        wanted = list(self._views.values())
        if wanted != self.children[::-1]:
            self.clear_widgets()
            self._unseen.clear()
            for view in wanted:
                self.add_widget(view)
        self._unseen.intersection_update(wanted)
        self.dispatch("on_rows")

    def do_layout(self, *args):
        super().do_layout(*args)
        self._draw_seen()

    def _draw_seen(self, *_):
        """What lies outside of what is seen would cost as much to draw as what lies inside."""
        if self.sight is None:
            return
        left, bottom, right, top = self.sight
        for view in self.children:
            is_seen = view.right > left and view.x < right and view.top > bottom and view.y < top
            if is_seen and view in self._unseen:
                self._unseen.remove(view)
                self.canvas.add(view.canvas)
            elif not is_seen and view not in self._unseen:
                self._unseen.add(view)
                self.canvas.remove(view.canvas)


class CalmScroll(ScrollView):
    """A scroll view that stops at its ends, and whose thin bar shows that there is more."""

    def __init__(self, **kwargs):
        kwargs.setdefault("effect_cls", ScrollEffect)
        super().__init__(**kwargs)

    def on_touch_down(self, touch):
        if MEANT not in touch.ud and self.collide_point(*touch.pos):
            place = self.to_window(*touch.pos)
            row = next((widget for widget in self.walk(restrict=True)
                        if isinstance(widget, Row) and widget.collide_point(*widget.parent.to_widget(*place))), None)
            if row is not None:
                touch.ud[MEANT] = row.key
        return super().on_touch_down(touch)


class ScrollPage(CalmScroll):
    """A page that scrolls: children go into one column as wide as the page, as high as they need."""
    padding = VariableListProperty([0, 0, 0, 0])
    spacing = NumericProperty("16dp")
    content_height = NumericProperty(0)      # of the column, with its padding

    def add_widget(self, widget, *args, **kwargs):
        column = self.ids.get("column")
        if column is None:
            return super().add_widget(widget, *args, **kwargs)
        return column.add_widget(widget, *args, **kwargs)

    def clear_widgets(self, *args, **kwargs):
        self.ids.column.clear_widgets(*args, **kwargs)


class ScrollRows(FloatLayout):
    """``Rows`` that scroll and rest on whole rows, for up to some dozens. ``empty_text`` stands where there is nothing.

    ``on_action(key, action, *values)`` comes from the rows. ``direction`` "x" is a strip whose rows share the width while they fit; when
    they don't, an arrow at each end turns the page, for gloves.
    """
    viewclass = StringProperty()
    data = ListProperty()
    spacing = NumericProperty(0)
    direction = OptionProperty("y", options=("x", "y"))
    empty_text = StringProperty()
    whole = BooleanProperty(True)
    view_height = NumericProperty(0)
    paged = BooleanProperty(False)       # a strip that does not fit

    __events__ = ("on_action",)

    def __init__(self, **kwargs):
        self._fit = Clock.create_trigger(self._fit_whole, -1)
        self._rest = Clock.create_trigger(self._snap, .15)
        self._held = False
        super().__init__(**kwargs)
        for name in ("height", "spacing", "whole", "direction"):
            self.fbind(name, self._fit)

    def on_kv_post(self, base_widget):
        self.ids.rows.bind(on_rows=self._fit, height=self._fit)
        self.ids.scroll.bind(scroll_y=self._moved, on_scroll_start=self._hold, on_scroll_stop=self._release)
        self._fit()

    def on_action(self, key, action, *values):
        """A row was used."""

    def show(self, key) -> None:
        """Scroll until the row of ``key`` can be seen."""
        view = self.ids.rows._views.get(key)
        if view is not None:
            self.ids.scroll.scroll_to(view, padding=0, animate=False)

    def in_sight(self, scroll_x, scroll_y, scroll, rows) -> tuple[float, float, float, float]:
        """The part of the rows, whose size is ``rows``, that is seen in a scroll view of size ``scroll``."""
        left, bottom = scroll_x * max(0, rows[0] - scroll[0]), scroll_y * max(0, rows[1] - scroll[1])
        return left, bottom, left + scroll[0], bottom + scroll[1]

    def turn(self, direction: int) -> None:
        """Show the next (1) or the previous (-1) part of a strip; a row that was cut at the edge comes whole."""
        scroll, rows = self.ids.scroll, self.ids.rows
        hidden = rows.width - scroll.width
        if hidden > 0:
            step = max(scroll.width - dp(140), scroll.width / 2) / hidden
            Animation(scroll_x=min(1., max(0., scroll.scroll_x + direction * step)), d=.2, t="out_quad").start(scroll)

    def _fit_whole(self, *_):
        """The view is as high as the whole rows that fit from the top; a row too high for the place alone is the exception."""
        if not self.whole or self.direction == "x":
            self.view_height = self.height
            return
        used = best = 0
        for view in reversed(self.ids.rows.children):
            used += view.height + (self.spacing if used else 0)
            if used > self.height + 1:
                break
            best = used
        else:
            best = self.height
        self.view_height = best or self.height

    def _hold(self, *_):
        self._held = True

    def _release(self, *_):
        self._held = False
        self._rest()

    def _moved(self, *_):
        self._rest.cancel()
        if not self._held:
            self._rest()

    def _snap(self, _dt):
        scroll, rows = self.ids.scroll, self.ids.rows
        hidden = rows.height - scroll.height
        if self._held or not self.whole or self.direction == "x" or hidden < 1:
            return
        above = (1 - scroll.scroll_y) * hidden
        edges = [rows.top - view.top for view in rows.children]
        edge = min([*edges, hidden], key=lambda candidate: abs(candidate - above))
        if abs(edge - above) > 1 and edge <= hidden:
            Animation(scroll_y=1 - edge / hidden, d=.12, t="out_quad").start(scroll)


class RecycledRow(Row):
    """Mixin of row classes of ``LongList``. A view that became another row between press and release does nothing."""

    def __init__(self, **kwargs):
        self._pressed_key = None
        self._forget = Clock.create_trigger(self._forget_press)
        super().__init__(**kwargs)

    def on_touch_down(self, touch):
        if self.collide_point(*touch.pos):
            self._pressed_key = (self.key,)
        return super().on_touch_down(touch)

    def on_touch_up(self, touch):
        self._forget()                       # after the release has reached whoever grabbed the touch
        return super().on_touch_up(touch)

    def act(self, action, *values):
        if self._pressed_key in (None, (self.key,)):
            super().act(action, *values)

    def _forget_press(self, _dt):
        self._pressed_key = None
