"""Dialogs and menus on KivyMD's dialog: Esc and Android's back button close the topmost one, and none is larger than the window.

A dialog's kv adds its content and, as a ``DialogActions`` box, its buttons; the content scrolls when the window is low:

    <NameDialog>:                       # class NameDialog(Dialog)
        title: root.vm.title
        DialogText:
            text: root.vm.text
        DialogActions:
            CommandButton:
                text: tr._("Keep")
                on_release: root.dismiss()
"""

from kivy.animation import Animation
from kivy.core.window import Window
from kivy.metrics import dp
from kivy.properties import (
    BooleanProperty,
    ListProperty,
    NumericProperty,
    ObjectProperty,
    StringProperty,
)
from kivy.uix.widget import Widget
from kivymd.uix.behaviors import MotionDialogBehavior
from kivymd.uix.dialog import MDDialog, MDDialogButtonContainer, MDDialogHeadlineText, MDDialogSupportingText
from kivymd.uix.dialog.dialog import MDDialogScrim

from app.widgets.buttons import CommandButton
from app.widgets.dock import dock
from app.widgets.lists import Row
from app.widgets.rest import rest
from app.widgets.snackbar import SnackbarStack
from app.widgets.surfaces import OnlySeen, TonedTap
from app.widgets.text import Body, ScreenTitle

ESCAPE = 27  # also Android's back button


class Fade(MotionDialogBehavior):
    """In place of KivyMD's motion, that draws the window 24 times, with stretched letters. A duration of 0 s opens and closes at once."""

    show_duration = NumericProperty(0.1)  # s
    hide_duration = NumericProperty(0.1)

    def on_open(self, *_):
        self._fade(1, self.show_duration)

    def on_dismiss(self, *_):
        self._fade(0, self.hide_duration)

    def _fade(self, opacity, duration):
        for widget in (self, self._scrim):
            Animation.stop_all(widget, "opacity")
            if duration:
                fade = Animation(opacity=opacity, d=duration)
                fade.bind(on_complete=self._faded)
                fade.start(widget)
            else:
                widget.opacity = opacity
                self._faded(None, widget)

    @staticmethod
    def _faded(_animation, widget):
        if not widget.opacity:
            Window.remove_widget(widget)


class Overlay(MDDialog, Fade):
    """KivyMD's dialog, which keys close even if a tap outside doesn't (``auto_dismiss`` False, as in forms). It lies on
    whole pixels: text and lines would be blurred elsewhere."""

    def __init__(self, **kwargs):
        super().__init__(**kwargs)
        Window.unbind(on_resize=self.update_width)  # only bound while it is open
        self.fbind("size", self._place)

    def update_width(self, *_):
        """Said in kv."""

    def open(self):
        self._scrim = MDDialogScrim(color=self.scrim_color, opacity=0)
        self.on_scrim_color()
        Window.bind(on_keyboard=self._key, on_resize=self._place)  # the one bound last is asked first
        super().open()
        for stack in [top for top in Window.children if isinstance(top, SnackbarStack)]:
            Window.remove_widget(stack)  # messages stay on top
            Window.add_widget(stack)
        self._place()
        rest.let_go()
        rest.after_opening()

    def dismiss(self, *_):
        if self._is_open:
            open_before = _open_overlays()
            dock.leave(self)
            Window.unbind(on_keyboard=self._key, on_resize=self._place)
            super().dismiss()
            rest.let_go()
            if _open_overlays() == open_before[1:]:  # what is behind it can be reached now
                rest.after_closing()

    @property
    def is_open(self) -> bool:
        """Not while it fades away."""
        return self._is_open

    def on_scrim_color(self, *_):
        if self._scrim:
            self._scrim.color, self._scrim.alpha = self.scrim_color, self.scrim_color[3]

    def corner(self) -> tuple[float, float]:
        """Where its lower left corner belongs, px."""
        return (Window.width - self.width) / 2, (Window.height - self.height) / 2

    def _place(self, *_):
        if self._is_open:
            x, y = self.corner()
            self.pos = round(x), round(y)

    def takes_key(self, key: int, text: str) -> bool:
        """A key was pressed while nothing above this takes keys; whether it was for this dialog."""
        if key == ESCAPE:
            self.dismiss()
        return key == ESCAPE

    def _key(self, _window, key, _scancode=None, text=None, *_modifiers):
        return self.takes_key(key, text or "")

    def on_touch_down(self, touch):
        """No touch gets through, and none presses KivyMD's dialog card."""
        if self._is_open and self.collide_point(*touch.pos):
            Widget.on_touch_down(self, touch)
        elif self.auto_dismiss:
            self.dismiss()
        return True

    def on_touch_move(self, touch):
        super().on_touch_move(touch)
        return True

    def on_touch_up(self, touch):
        super().on_touch_up(touch)
        return True


def _open_overlays() -> list[Overlay]:
    """The topmost first."""
    return [top for top in Window.children if isinstance(top, Overlay) and top.is_open]


class DialogTitle(ScreenTitle, MDDialogHeadlineText):
    """What a dialog is about."""


class DialogText(Body, MDDialogSupportingText):
    """What is asked or explained, under the title."""


class DialogActions(OnlySeen, MDDialogButtonContainer):
    """The buttons at the bottom of a dialog; they share the width, the main one is on the right."""

    def on_kv_post(self, _base_widget):
        for button in self.children:
            if isinstance(button, CommandButton):
                button.size_hint_y = 1


class Dialog(Overlay):
    """Title, content, buttons. As high as its content, which is one column that scrolls, at most as the window, or as the room above the
    on-screen keyboard."""

    low = BooleanProperty(False)  # the window has no height to spare
    head_height = NumericProperty(0)  # px, of the title
    room = NumericProperty(0)  # px of the window above the keyboard
    title = StringProperty()
    panel_width = NumericProperty("560dp")
    closable = BooleanProperty(False)  # a cross next to the title, for dialogs without buttons

    def __init__(self, **kwargs):
        super().__init__(**kwargs)
        self.fbind("room", self._place)

    def corner(self):
        x, _y = super().corner()
        return x, Window.height - (self.room + self.height) / 2

    def add_widget(self, widget, *args, **kwargs):
        if "button_container" in self.ids and not isinstance(widget, MDDialogButtonContainer):
            return self.ids.page.add_widget(widget, *args, **kwargs)
        return super().add_widget(widget, *args, **kwargs)


class ConfirmDialog(Dialog):
    """A question about something that can't be undone: ``on_confirmed``, or ``on_declined`` if it is closed in another
    way."""

    text = StringProperty()
    confirm = StringProperty()
    decline = StringProperty()

    __events__ = ("on_confirmed", "on_declined")

    def __init__(self, **kwargs):
        self._confirmed = False
        super().__init__(**kwargs)

    def on_confirmed(self):
        """The answer was yes."""

    def on_declined(self):
        """Dismissed: by a button, Esc, or a tap outside."""

    def answer(self, yes: bool) -> None:
        self._confirmed = yes
        self.dismiss()

    def on_dismiss(self):
        self.dispatch("on_confirmed" if self._confirmed else "on_declined")


class MenuRow(Row, TonedTap):
    """One command of a menu."""

    icon = StringProperty()
    text = StringProperty()

    def on_release(self):
        self.act("choose")


class Menu(Overlay):
    """Commands below the widget ``anchor``, or above it without room, in the left half of the window from its left edge
    on: ``items`` have ``key``, ``text``, ``icon``, ``tone``, ``disabled``; fires ``on_choose(key)``. With a ``title``,
    and ``text`` under it, it is a card about the ``anchor``; of several ``cards`` (with ``title``, ``text``, ``items``)
    it shows the one ``at`` that place, and arrows that lead to the others."""

    cards = ListProperty()
    at = NumericProperty(0)
    title = StringProperty()
    text = StringProperty()
    items = ListProperty()
    anchor = ObjectProperty(None)

    __events__ = ("on_choose",)

    def __init__(self, **kwargs):
        super().__init__(**kwargs)
        self.fbind("at", self._turned)
        if self.cards:
            self._turned()

    def on_choose(self, key):
        """A command was tapped; the menu is closing."""

    def turn(self, by: int) -> None:
        """To the next card (1) or the one before (-1), round and round."""
        self.at = (self.at + by) % len(self.cards)

    def _turned(self, *_):
        card = self.cards[self.at]
        self.title, self.text, self.items = card.title, card.text, list(card.items)

    def corner(self):
        edge = dp(8)
        x, y = self.anchor.to_window(self.anchor.x, self.anchor.y)
        is_at_left = x + self.anchor.width / 2 < Window.width / 2
        left = x if is_at_left else x + self.anchor.width - self.width
        below = y - edge - self.height
        above = y + self.anchor.height + edge
        bottom = below if below >= edge else min(above, Window.height - edge - self.height)
        return min(max(left, edge), Window.width - edge - self.width), max(edge, bottom)

    def chosen(self, key) -> None:
        self.dispatch("on_choose", key)
        self.dismiss()
