"""Dialogs on kivy's ModalView: Esc and Android's back button close the topmost one, and a closed dialog is freed (not so with KivyMD's).

A dialog's kv adds its content and, as a ``DialogActions`` box, its buttons; the content scrolls when the window is low:

    <RobotDialog>:                       # class RobotDialog(FormDialog)
        title: root.vm.title
        FormField:
            label: tr._("Name")
        DialogActions:
            CommandButton:
                text: tr._("Cancel")
                on_release: root.dismiss()
"""
from collections.abc import Hashable
from dataclasses import dataclass

from kivy.clock import Clock
from kivy.metrics import dp
from kivy.properties import (
    AliasProperty,
    BooleanProperty,
    ListProperty,
    NumericProperty,
    ObjectProperty,
    StringProperty,
)
from kivy.uix.modalview import ModalView

from app.widgets.dock import dock
from app.widgets.lists import Row
from app.widgets.surfaces import SeenBox, Surface, TonedTap

ESCAPE = 27                              # also Android's back button


class Overlay(ModalView):
    """A modal view that Esc closes even if a tap beside it doesn't (``auto_dismiss`` False, as in forms)."""
    dims = BooleanProperty(True)             # darkens what is behind it

    def __init__(self, **kwargs):
        super().__init__(**kwargs)
        self.fbind("pos", self._on_whole_pixels)

    def _on_whole_pixels(self, *_):
        """Keep off half pixels, where centring an odd height would put it: text and lines would be blurred."""
        if self.pos != [round(self.x), round(self.y)]:
            self.pos = round(self.x), round(self.y)

    def _handle_keyboard(self, _window, key, *_):
        if key == ESCAPE:
            self.dismiss()
            return True
        return False


class DialogActions(SeenBox):
    """The buttons at the bottom of a dialog; they share the width, the main one is on the right."""


class Dialog(Overlay):
    """Title, content, buttons. As high as ``body_height`` needs, at most as the window, or as what the on-screen keyboard leaves of it.

    Where that is too little, the buttons are ``tucked`` under the keyboard, so that the content can be scrolled to any field.
    """
    room = NumericProperty(0)                # px of the window above the keyboard
    tucked = NumericProperty(0)              # px under it
    title = StringProperty()
    panel_width = NumericProperty("560dp")
    body_height = NumericProperty(0)
    closable = BooleanProperty(False)        # a cross beside the title, for dialogs without buttons

    def __init__(self, **kwargs):
        super().__init__(**kwargs)
        for name in ("room", "tucked"):
            self.fbind(name, self._align_center)

    def _align_center(self, *_):
        """ModalView calls this whenever it would centre itself in the window."""
        if self._is_open:
            bottom = dock.height - self.tucked if self.tucked else self._window.height - (self.room + self.height) / 2
            self.pos = round((self._window.width - self.width) / 2), round(bottom)

    def add_widget(self, widget, *args, **kwargs):
        if "content" not in self.ids:
            return super().add_widget(widget, *args, **kwargs)
        if isinstance(widget, DialogActions):
            return self.ids.foot.add_widget(widget, *args, **kwargs)
        return self.add_content(widget, *args, **kwargs)

    def add_content(self, widget, *args, **kwargs):
        return self.ids.content.add_widget(widget, *args, **kwargs)


class FormDialog(Dialog):
    """A dialog whose content is one column that scrolls when there isn't enough room."""

    def add_content(self, widget, *args, **kwargs):
        target = self.ids.page if "page" in self.ids else self.ids.content
        return target.add_widget(widget, *args, **kwargs)


class ConfirmDialog(FormDialog):
    """A question about something that can't be undone: ``on_confirmed``, or ``on_declined`` however else it is closed."""
    text = StringProperty()
    confirm = StringProperty()
    decline = StringProperty()
    danger = BooleanProperty(False)

    __events__ = ("on_confirmed", "on_declined")

    def __init__(self, **kwargs):
        self._confirmed = False
        super().__init__(**kwargs)

    def on_confirmed(self):
        """The answer was yes."""

    def on_declined(self):
        """The answer was no: button, Esc, or beside the dialog."""

    def answer(self, yes: bool) -> None:
        self._confirmed = yes
        self.dismiss()

    def on_dismiss(self):
        self.dispatch("on_confirmed" if self._confirmed else "on_declined")


@dataclass(frozen=True)
class Choice:
    """Values of OptionRow."""
    key: Hashable
    text: str
    icon: str
    note: str
    selected: bool
    mark: bool


class ChoiceDialog(Dialog):
    """Choose one of many, or with ``multiple`` tick several and confirm. Long lists get a search field.

    ``options`` have ``key``, ``text``, ``note`` and ``icon``; ``selected`` the keys chosen. Fires ``on_choose(key)``, or
    with ``multiple`` ``on_choose_many(keys)`` in the options' order.
    """
    options = ListProperty()
    selected = ListProperty()
    multiple = BooleanProperty(False)
    query = StringProperty()
    hint = StringProperty()              # of the search field
    nothing = StringProperty()           # shown when the search finds nothing
    confirm = StringProperty()
    decline = StringProperty()
    search_from = NumericProperty(8)     # options
    shown = ListProperty()

    __events__ = ("on_choose", "on_choose_many")

    def __init__(self, **kwargs):
        self._refresh = Clock.create_trigger(self._show, -1)
        super().__init__(**kwargs)
        for name in ("options", "selected", "query", "multiple"):
            self.fbind(name, self._refresh)
        self._show()

    def on_choose(self, key):
        """One option was chosen; the dialog is closing."""

    def on_choose_many(self, keys):
        """The ticked options were confirmed."""

    def _searchable(self):
        return len(self.options) >= self.search_from

    searchable = AliasProperty(_searchable, None, bind=("options", "search_from"))

    def _show(self, *_):
        words = self.query.casefold().split()
        self.shown = [
            Choice(option.key, option.text, option.icon, option.note, option.key in self.selected, self.multiple) for option in self.options
            if all(word in f"{option.text} {option.note}".casefold() for word in words)]

    def chosen(self, key) -> None:
        """An option was tapped."""
        if self.multiple:
            self.selected = [k for k in self.selected if k != key] if key in self.selected else [*self.selected, key]
            return
        self.selected = [key]
        self.dispatch("on_choose", key)
        self.dismiss()

    def confirmed(self) -> None:
        self.dispatch("on_choose_many", [option.key for option in self.options if option.key in self.selected])
        self.dismiss()


class MenuRow(Row, TonedTap):
    """One command of a menu."""
    icon = StringProperty()
    text = StringProperty()

    def on_release(self):
        self.act("choose")


class Menu(Overlay):
    """Commands beside a widget: ``items`` have ``key``, ``text``, ``icon``, ``tone``, ``disabled``; fires ``on_choose(key)``."""
    items = ListProperty()
    anchor = ObjectProperty(None, allownone=True)

    __events__ = ("on_choose",)

    def on_choose(self, key):
        """A command was tapped; the menu is closing."""

    def open_at(self, widget, **kwargs) -> None:
        """Show the menu under ``widget``, or above it where there is no room, inside the window."""
        self.anchor = widget
        self.fbind("size", self._align_center)
        self.open(**kwargs)

    def _align_center(self, *_):
        """ModalView calls this whenever it would centre itself: stay at the anchor instead."""
        if not self._is_open or self.anchor is None:
            return
        edge = dp(8)
        x, y = self.anchor.to_window(self.anchor.x, self.anchor.y)
        left = x + self.anchor.width - self.width
        below = y - edge - self.height
        above = y + self.anchor.height + edge
        bottom = below if below >= edge else min(above, self._window.height - edge - self.height)
        self.pos = (min(max(left, edge), self._window.width - edge - self.width), max(edge, bottom))

    def chosen(self, key) -> None:
        self.dispatch("on_choose", key)
        self.dismiss()


class DialogPanel(Surface):
    """The visible sheet of a dialog."""
