"""Menus and cards on KivyMD's dialog: Esc and Android's back button close the topmost one."""

from kivy.core.window import Window
from kivy.metrics import dp
from kivy.properties import BooleanProperty, ListProperty, NumericProperty, ObjectProperty, StringProperty
from kivy.uix.widget import Widget
from kivymd.uix.behaviors import MotionDialogBehavior
from kivymd.uix.dialog import MDDialog

from app.widgets.events import Fires
from app.widgets.lists import Row
from app.widgets.places import places
from app.widgets.rest import rest
from app.widgets.snackbar import SnackbarStack
from app.widgets.surfaces import TonedTap

ESCAPE = 27  # also Android's back button
ASIDE = 24  # dp from a side of a card to the middle of its arrow: clear of the round corners


class Still(MotionDialogBehavior):
    """In place of KivyMD's motion, that draws the window 24 times, with stretched letters."""

    def on_open(self, *_):
        self.opacity = 1

    def on_dismiss(self, *_):
        Window.remove_widget(self._scrim)
        Window.remove_widget(self)


class MenuRow(Row, TonedTap):
    """One command of a menu."""


class Menu(Fires, MDDialog, Still):
    """Commands below the widget ``anchor``, or above it without room, in the left half of the window from its left edge
    on: ``items`` have ``key``, ``text``, ``icon``, ``tone``, ``disabled``; fires ``on_choose(key)``. With a ``title``,
    and ``text`` under it, it is a card about the ``anchor``, with a ``tip`` (px of the window) that points at it from below
    or above, 0 where the card covers it. It lies on whole pixels: text and lines would be blurred elsewhere."""

    title = StringProperty()
    text = StringProperty()
    items = ListProperty()
    anchor = ObjectProperty(None)
    tip = NumericProperty(0)
    is_below = BooleanProperty(False)

    __events__ = ("on_choose",)

    def __init__(self, **kwargs):
        super().__init__(**kwargs)
        Window.unbind(on_resize=self.update_width)  # only bound while it is open
        self.bind(size=self._place)

    def update_width(self, *_):
        """Said in kv."""

    def open(self):
        Window.bind(on_keyboard=self._key, on_resize=self._place)  # the one bound last is asked first
        super().open()
        for stack in [top for top in Window.children if isinstance(top, SnackbarStack)]:
            Window.remove_widget(stack)  # messages stay on top
            Window.add_widget(stack)
        self._place()
        places.let_go()
        rest.after_opening()

    def dismiss(self, *_):
        if self._is_open:
            open_before = _open_menus()
            Window.unbind(on_keyboard=self._key, on_resize=self._place)
            super().dismiss()
            places.let_go()
            if _open_menus() == open_before[1:]:  # what is behind it can be reached now
                rest.after_closing()

    def chosen(self, key) -> None:
        self.dispatch("on_choose", key)
        self.dismiss()

    def _place(self, *_):
        if self._is_open:
            x, y = self._corner()
            self.pos = round(x), round(y)
            self._point()

    def _point(self):
        x, y = self.anchor.to_window(self.anchor.x, self.anchor.y)
        self.is_below = self.top <= y
        is_beside = self.is_below or self.y >= y + self.anchor.height
        middle = min(max(x + self.anchor.width / 2, self.x + dp(ASIDE)), self.right - dp(ASIDE))
        self.tip = round(middle) if self.title and is_beside else 0

    def _corner(self):
        edge = dp(8)
        x, y = self.anchor.to_window(self.anchor.x, self.anchor.y)
        middle = x + self.anchor.width / 2
        is_at_left = middle < Window.width / 2
        left = min(x, middle - dp(ASIDE)) if is_at_left else max(x + self.anchor.width, middle + dp(ASIDE)) - self.width
        below = y - edge - self.height
        above = y + self.anchor.height + edge
        bottom = below if below >= edge else min(above, Window.height - edge - self.height)
        return min(max(left, edge), Window.width - edge - self.width), max(edge, bottom)

    def _key(self, _window, key, *_args):
        if key == ESCAPE:
            self.dismiss()
        return key == ESCAPE

    def on_touch_down(self, touch):
        """No touch gets through, and none presses KivyMD's dialog card."""
        if self.collide_point(*touch.pos):
            Widget.on_touch_down(self, touch)
        else:
            self.dismiss()
        return True

    def on_touch_move(self, touch):
        super().on_touch_move(touch)
        return True

    def on_touch_up(self, touch):
        super().on_touch_up(touch)
        return True


def _open_menus() -> list[Menu]:
    """The topmost first."""
    return [top for top in Window.children if isinstance(top, Menu)]
