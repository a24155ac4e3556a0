"""Sheets that ask for one value, in the place of the sheet that needs it or beside the page; and the choice from a list."""

from collections.abc import Hashable
from dataclasses import dataclass

from kivy.clock import Clock
from kivy.properties import (
    AliasProperty,
    BooleanProperty,
    ListProperty,
    NumericProperty,
    ObjectProperty,
    StringProperty,
)

from app.widgets.sheet import Sheet


class Picker(Sheet):
    """Fires ``on_pick(value)``. Another one takes its place; it goes with the sheet that it is for."""

    is_question = is_picker = True

    __events__ = ("on_pick",)

    def on_pick(self, value):
        """That was chosen."""

    def takes_key(self, key: int, text: str) -> bool:
        """A key was pressed; whether it was for this one."""
        return False

    def _key(self, _window, key, _scancode=None, text=None, *_modifiers):
        return self.takes_key(key, text or "") or super()._key(_window, key)


@dataclass(frozen=True)
class Choice:
    """Values of OptionRow."""

    key: Hashable
    text: str
    icon: str
    note: str
    selected: bool
    mark: bool
    tone: str


class ChoiceSheet(Picker):
    """Choose one of many, or with ``multiple`` tick several and confirm. Long lists get a search field.

    ``options`` have ``key``, ``text``, ``note``, ``icon`` and ``tone``; ``selected`` the keys chosen. Picks the key, or with ``multiple``
    the keys in the options' order; it ``needs_one`` or not. If it ``can_all``, a button ticks all that the search shows, or none of them.
    The ``last`` option is for users who do not find what they want: every search shows it.
    """

    scrolls = BooleanProperty(False)
    last = ObjectProperty(None, allownone=True)
    needs_one = BooleanProperty(False)
    can_all = BooleanProperty(False)
    all_shown = BooleanProperty(False)  # all that are shown are ticked
    options = ListProperty()
    selected = ListProperty()
    multiple = BooleanProperty(False)
    query = StringProperty()
    confirm = StringProperty()
    search_from = NumericProperty(8)  # options
    shown = ListProperty()

    def __init__(self, **kwargs):
        self._refresh = Clock.create_trigger(self._show, -1)
        super().__init__(**kwargs)
        for name in ("options", "selected", "query", "multiple"):
            self.fbind(name, self._refresh)
        self._show()

    def _searchable(self):
        return len(self.options) >= self.search_from

    searchable = AliasProperty(_searchable, None, bind=("options", "search_from"))

    def _show(self, *_):
        words, selected = self.query.casefold().split(), set(self.selected)
        self.shown = [
            self._choice(option, option.key in selected)
            for option in self.options
            if all(word in f"{option.text} {option.note}".casefold() for word in words)
        ]
        self.all_shown = all(choice.selected for choice in self.shown)

    def _choice(self, option, is_selected) -> Choice:
        return Choice(option.key, option.text, option.icon, option.note, is_selected, self.multiple, option.tone)

    def rows(self, shown, last) -> list[Choice]:
        return shown if last is None else [*shown, self._choice(last, False)]

    def found(self) -> list:
        """The options that match the typed text."""
        self._show()
        return self.shown

    def chosen(self, key) -> None:
        """An option was tapped."""
        if self.multiple:
            self.selected = [k for k in self.selected if k != key] if key in self.selected else [*self.selected, key]
            self.draft = True
        else:
            self.selected = [key]
            self.dispatch("on_pick", key)

    def on_other(self):
        """Tick all shown options, or none if all are ticked."""
        shown = {choice.key: choice for choice in self.shown}
        self.selected = [key for key in self.selected if key not in shown] + ([] if self.all_shown else list(shown))
        self.draft = True

    def on_done(self):
        selected = set(self.selected)
        self.dispatch("on_pick", [option.key for option in self.options if option.key in selected])
