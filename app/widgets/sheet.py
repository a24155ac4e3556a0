"""Sheets: cards that lie beside the page, or over a part of it, in the frame. Nothing is dimmed; what is not covered can be used."""

from kivy.clock import Clock
from kivy.core.window import Window
from kivy.metrics import dp
from kivy.properties import BooleanProperty, NumericProperty, OptionProperty, StringProperty
from kivy.uix.floatlayout import FloatLayout
from kivymd.uix.card import MDCard

from app.widgets.dock import dock, is_low, is_tall
from app.widgets.events import Fires
from app.widgets.menu import ESCAPE
from app.widgets.places import places
from app.widgets.rest import DOUBLE_TAP, SETTLES, rest
from app.widgets.surfaces import Passive

EDGES = ("right", "bottom", "full")
PARTS = ("head", "body", "foot")
BARE = 200  # dp of height, under which they would leave the body none
GAP = dp(8)  # to what it spares
# s without a press at the foot: after one there, after the button that was touched last has another meaning now, and
# after a page of the sheet has opened or closed; when the sheet goes, what it covered rests as long
FOOT_RESTS = 1.0


class SheetPlace(FloatLayout):
    """The part of the frame in which the page and sheets are. ``taken``: px at its right that a sheet takes from the page."""

    taken = NumericProperty(0)


class Sheet(Fires, Passive, MDCard):
    """Title, body, and at most one filled button at its ``foot``. Children are its body: they scroll, unless it ``scrolls`` not, as with a
    list of its own.

    Where it lies depends on the window: in a wide one at its ``edge``, at the right ``span`` px wide and, if it ``shrinks`` the page,
    beside it; in a low one over all but the ``keeps`` px at the left; in a tall one at its ``tall_edge``. It ends above the on-screen
    keyboard. What its ``stack`` spares of the page it never covers: it lies beside that, or below or above it.

    X and Esc fire ``on_close``, the buttons ``on_done``, ``on_other``, ``on_dots(button)`` and, with ``can_go_back``, ``on_back``.
    ``foot_off`` says why its button can't be pressed. With a ``draft`` its closing can be undone, with the
    message ``lost``. One that ``is_question`` takes the place
    of another one, and has the keys alone; one that ``is_picker`` asks for a value of the sheet below it.
    """

    is_question = is_picker = False

    edge = OptionProperty("right", options=EDGES)
    tall_edge = OptionProperty("full", options=EDGES)
    at = OptionProperty("right", options=EDGES)  # where it is now
    bare = BooleanProperty(False)  # without head, with a low foot: no more room above the on-screen keyboard
    span = NumericProperty("420dp")
    keeps = NumericProperty(0)
    shrinks = BooleanProperty(True)
    scrolls = BooleanProperty(True)
    title = StringProperty()
    foot = StringProperty()
    foot_icon = StringProperty()
    foot_style = StringProperty("filled")
    foot_off = StringProperty()
    second = StringProperty()
    second_tone = StringProperty("neutral")
    busy = BooleanProperty(False)
    second_busy = BooleanProperty(False)
    menu = BooleanProperty(False)
    closable = BooleanProperty(True)
    can_go_back = BooleanProperty(False)
    draft = BooleanProperty(False)
    lost = StringProperty()
    content_height = NumericProperty(0)  # px of the body
    around = NumericProperty(0)  # px of head and foot

    __events__ = ("on_close", "on_done", "on_other", "on_dots", "on_back")

    def __init__(self, **kwargs):
        self.stack = None  # the Sheets that show it
        self._rests_until = 0.0
        self._is_at_foot = False  # the last touch or press
        self._spared = None
        self._arrange = Clock.create_trigger(self.arrange, -1)
        self._arrange_later = Clock.create_trigger(self.arrange)  # after the page, which may get another layout
        super().__init__(**kwargs)
        self.bind(
            **dict.fromkeys(
                ("edge", "tall_edge", "span", "keeps", "shrinks", "content_height", "around"), self._arrange
            )
        )

    def add_widget(self, widget, *args, **kwargs):
        if len(self.children) < len(PARTS):
            return super().add_widget(widget, *args, **kwargs)
        return (self.ids.page if self.scrolls else self.ids.body).add_widget(widget, *args, **kwargs)

    def lie_as(self, other):
        """In the place of that one."""
        for name in ("edge", "tall_edge", "keeps", "shrinks"):
            setattr(self, name, getattr(other, name))
        self.span = max(self.span, other.span)

    def on_close(self):
        """X or Esc."""
        self.stack.dismiss(self)

    def press_button(self, event):
        """A button of the foot. A double tap is one press, though the button may mean something else by then."""
        if Clock.get_time() >= self._rests_until:
            self._is_at_foot = True
            self._rest_foot()
            self.dispatch(event)

    def _rest_foot(self):
        self._rests_until = Clock.get_time() + FOOT_RESTS

    def on_foot(self, *_):
        """What the finger was on last means something else: a late tap presses nothing."""
        if self._is_at_foot:
            self._rest_foot()

    on_second = on_foot

    def on_can_go_back(self, *_):
        """A page of it has opened or closed, and its foot means something else: a late tap presses nothing."""
        if self.parent is not None:
            self._rest_foot()

    def on_back(self):
        """The arrow in front of the title."""
        self.stack.close(self)

    def on_parent(self, _sheet, place):
        dock.has_sheet = place is not None
        if place is None:
            return
        place.bind(**self._followed(place))
        dock.bind(height=self._arrange)
        Window.bind(on_keyboard=self._key)
        self.arrange()
        places.let_go()
        rest.after_leaving(self)  # a second tap is not meant for it
        if self.is_question:
            rest.ignore_keys(SETTLES)

    def _followed(self, place) -> dict:
        return dict.fromkeys(("size",) if place is Window else ("size", "pos"), self._arrange_later)

    def leave(self, foot: bool = True) -> None:
        """Take it from its place; its widgets stay, so that it can be shown again. ``foot``: that may have been pressed."""
        place = self.parent
        places.let_go()
        rest.after_leaving(self, FOOT_RESTS if self.foot and foot else DOUBLE_TAP)
        rest.ignore_keys(DOUBLE_TAP)
        dock.leave(self)
        dock.unbind(height=self._arrange)
        Window.unbind(on_keyboard=self._key)
        place.unbind(**self._followed(place))
        self._follow_spared(None)
        place.remove_widget(self)
        if place is not Window:
            place.taken = 0

    def arrange(self, *_):
        """Take its part of the place."""
        place = self.parent
        if place is None:
            return
        (x, y), (width, height) = ((0, 0), Window.size) if place is Window else (place.pos, place.size)
        spared = self.stack and self.stack.spared()
        self._follow_spared(spared)
        narrow, low = is_tall(*Window.size), is_low(Window.height)
        self.at = self.tall_edge if narrow else self.edge
        bottom = max(y, dock.height)
        top = y + height
        self.width = width
        if self.at == "right":
            self.width = width - self.keeps if low and self.keeps else min(self.span, width)
        self.height = top - bottom if self.at != "bottom" else min(top - bottom, self.around + self.content_height)
        self.bare = top - bottom < dp(BARE) and dock.height > 0
        self.pos = x + width - self.width, bottom
        if place is not Window:
            beside = self.at == "right" and self.shrinks and not (low and self.keeps) and spared is None
            place.taken = self.width if beside else 0
        if spared is not None:
            self._spare(spared, place)

    def _follow_spared(self, spared):
        if spared is not self._spared:
            for name in ("pos", "size"):
                if self._spared is not None:
                    self._spared.funbind(name, self._arrange)
                if spared is not None:
                    spared.fbind(name, self._arrange)
            self._spared = spared

    def _spare(self, spared, place):
        left, bottom = place.to_widget(*spared.to_window(*spared.pos))
        right, top = left + spared.width, bottom + spared.height
        if spared.width <= place.width / 2:
            self.x, self.width = right + GAP, place.right - right - GAP
        elif bottom > place.center_y:
            self.height = min(self.height, bottom - GAP - self.y)
        else:
            self.y = max(top + GAP, dock.height)
            self.height = place.top - self.y

    def takes_key(self, key: int, text: str) -> bool:
        """A key was pressed; whether it was for this one."""
        return False

    def _key(self, _window, key, _scancode=None, text=None, *_modifiers):
        if key == ESCAPE and self.closable:
            self.dispatch("on_close")
        return self.takes_key(key, text or "") or key == ESCAPE

    def on_touch_down(self, touch):
        self._is_at_foot = self.ids.foot.collide_point(*touch.pos)
        return super().on_touch_down(touch) or self.collide_point(*touch.pos)


class Finds:
    """Mixin of a sheet with a search: Down leads from its field to the first of the rows that are ``found``, and Enter
    to ``chosen`` of the only one."""

    def found(self) -> list:
        """The rows, each with its ``key``."""
        raise NotImplementedError

    def chosen(self, key) -> None:
        """As by a tap on its row."""
        raise NotImplementedError


class AskSheet(Sheet):
    """A question before what can't be undone, as high as its ``text``: its foot is the safe answer, ``second`` does it."""

    is_question = True

    text = StringProperty()

    def takes_key(self, key: int, text: str) -> bool:
        """Esc is the safe answer."""
        if key == ESCAPE and not self.closable:
            self.dispatch("on_close")
        return key == ESCAPE
