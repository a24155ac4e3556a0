"""Sheets that ask for one value, in the place of the sheet that needs it or beside the page; and the choice from a list."""

from kivy.clock import Clock
from kivy.properties import (
    AliasProperty,
    BooleanProperty,
    ListProperty,
    ObjectProperty,
    StringProperty,
)

from app.widgets.items import Item
from app.widgets.list_row import ListRow
from app.widgets.sheet import Finds, Sheet

SEARCHED_FROM = 8  # options


class Picker(Sheet):
    """Fires ``on_pick(value)``. Another one takes its place; it goes with the sheet that it is for."""

    is_question = is_picker = True

    __events__ = ("on_pick",)


class OptionRow(ListRow):
    """An option; a tap chooses it."""


class ChoiceSheet(Finds, Picker):
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
    shown = ListProperty()

    def __init__(self, **kwargs):
        self._refresh = Clock.create_trigger(self._show, -1)
        super().__init__(**kwargs)
        self.bind(options=self._refresh, selected=self._refresh, query=self._refresh, multiple=self._refresh)
        self._show()

    def _searchable(self):
        return len(self.options) >= SEARCHED_FROM

    searchable = AliasProperty(_searchable, None, bind=("options",))

    def _show(self, *_):
        words = self.query.casefold().split()
        self.shown = [
            option
            for option in self.options
            if all(word in f"{option.text} {option.note}".casefold() for word in words)
        ]
        self.all_shown = {option.key for option in self.shown} <= set(self.selected)

    def rows(self, shown, selected, last) -> list[Item]:
        chosen = set(selected)
        return [self._row(option, option.key in chosen) for option in shown] + ([self._row(last, None)] if last else [])

    def _row(self, option, is_chosen: bool | None) -> Item:
        is_one = bool(is_chosen) and not self.multiple
        return Item(
            option.key,
            option.text,
            option.note,
            icon=option.icon,
            tone=option.tone,
            look="chosen" if is_one else "plain",
            meta_icon="check" if is_one else "",
            ticked=is_chosen if self.multiple else None,
        )

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
        shown = [option.key for option in self.shown]
        self.selected = [key for key in self.selected if key not in shown] + ([] if self.all_shown else shown)
        self.draft = True

    def on_back(self):
        """What was ticked is taken along to the sheet that asked for it."""
        if self.draft and not self.foot_off:
            self.on_done()
        else:
            super().on_back()

    def on_done(self):
        selected = set(self.selected)
        self.dispatch("on_pick", [option.key for option in self.options if option.key in selected])
