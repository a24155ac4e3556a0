"""The widgets of the Logs that kv/logs lays out."""

from __future__ import annotations

from typing import Any

from kivy.clock import Clock
from kivy.factory import Factory
from kivy.properties import BooleanProperty, ListProperty, ObjectProperty, StringProperty
from kivy.uix.boxlayout import BoxLayout
from kivy.uix.stacklayout import StackLayout
from kivy.uix.widget import Widget

from app.widgets import figure_charts, figures, lanes, list_row, pages, swatch  # noqa: F401  (registers kivy classes)
from app.widgets.buttons import MenuChip
from app.widgets.display import SectionCard
from app.widgets.fields import SearchField
from app.widgets.lists import Row
from app.widgets.long_list import LongList
from app.widgets.surfaces import TonedTap


class LogsPart(BoxLayout):
    """Base of the parts."""

    vm = ObjectProperty(None, rebind=True, allownone=True)


class RunsPart(LogsPart):
    """The runs as a list, and the story of one."""


class FiguresPart(LogsPart):
    """Five figures, causes, charts: one page that scrolls."""


class ActivityPart(LogsPart):
    """What the robots did, as lanes."""


PARTS = {"runs": RunsPart, "figures": FiguresPart, "activity": ActivityPart}


class LogsBody(BoxLayout):
    """The part of the present tab; the others do not exist."""

    vm = ObjectProperty(None, rebind=True, allownone=True)
    part = StringProperty()

    def on_vm(self, *_: Any) -> None:
        kind = PARTS.get(self.part)
        if self.vm is not None and kind and not any(type(child) is kind for child in self.children):
            self.clear_widgets()
            self.add_widget(kind(vm=self.vm))

    on_part = on_vm


class RunsCard(SectionCard):
    """The card of the runs."""

    is_wide = BooleanProperty(False)


class ChipLine(StackLayout):
    """A row widget of ``kind`` for each of ``data``, on as many lines as they need; ``on_action(key, action)`` is a tap on one."""

    kind = StringProperty()
    data = ListProperty()

    __events__ = ("on_action",)

    def __init__(self, **kwargs: Any) -> None:
        super().__init__(**kwargs)
        self.fbind("data", self._build)
        self.fbind("kind", self._build)

    def on_action(self, key: str, action: str) -> None:
        """A chip was tapped."""

    def _build(self, *_args: object) -> None:
        if not self.kind:
            return
        if [chip.key for chip in self.children[::-1]] != [data.key for data in self.data]:
            self.clear_widgets()
            for _data in self.data:
                self.add_widget(Factory.get(self.kind)(host=self))
        for chip, data in zip(self.children[::-1], self.data, strict=True):
            chip.take(data)


class OutcomeChip(Row, TonedTap):
    """How many runs ended so; a tap ("filter") shows them alone."""

    icon = StringProperty()
    text = StringProperty()
    active = BooleanProperty(False)

    def on_release(self) -> None:
        self.act("filter")


class SetFilter(Row, MenuChip):
    """A filter that is set; a tap ("clear") ends it."""

    def on_release(self) -> None:
        self.act("clear")


class FigureSection(SectionCard):
    """A part of the figures; ``text`` is in the place of what is not known."""

    title = StringProperty()
    text = StringProperty()


class RunsSearch(SearchField):
    """The search field of the runs; ``card`` is the view model. Opening it gives it the focus; a restored search does
    not."""

    card = ObjectProperty(None, rebind=True)

    def on_kv_post(self, _base: Widget) -> None:
        self.focus = not self.text


class RunsList(LongList):
    """The runs. The row of ``opened_run`` is scrolled into sight, once it is in the list."""

    opened_run = ObjectProperty(None, allownone=True)

    def __init__(self, **kwargs: Any) -> None:
        self._is_pending = False  # opened, but perhaps not in the list yet: it is still being read
        self._reveal_soon = Clock.create_trigger(self._reveal, 0)
        super().__init__(**kwargs)
        self.fbind("opened_run", self._opened)
        self.fbind("data", self._reveal_soon)

    def _opened(self, *_args: object) -> None:
        self._is_pending = self.opened_run is not None
        self._reveal_soon()

    def _reveal(self, _dt: float) -> None:
        if self._is_pending and any(row.key == self.opened_run for row in self.data):
            self._is_pending = False
            self.reveal(self.opened_run)
