"""Cards of figures that explain themselves when tapped."""
from kivy.clock import Clock
from kivy.metrics import dp
from kivy.properties import ListProperty, NumericProperty, StringProperty
from kivy.uix.boxlayout import BoxLayout

from app.widgets.dialogs import FormDialog
from app.widgets.display import KpiCard
from app.widgets.lists import Row


class FigureCard(Row, KpiCard):
    """A KpiCard that explains itself when tapped."""

    def on_release(self):
        self.act("explain")


class FigureGrid(BoxLayout):
    """One FigureCard per row of ``data``, ``cols`` beside each other; a tap fires ``on_action(key, "explain")``. The cards of each line
    share its whole width, those of the last one too, and are as high as the highest."""
    data = ListProperty()
    cols = NumericProperty(1)

    __events__ = ("on_action",)

    def __init__(self, **kwargs):
        self._cards: list[FigureCard] = []
        self._level_soon = Clock.create_trigger(self._level, -1)
        super().__init__(orientation="vertical", **kwargs)
        self.fbind("data", self._fill)
        self.fbind("cols", self._arrange)
        self.fbind("spacing", self._arrange)
        self._fill()

    def on_action(self, key, action):
        """A card was tapped."""

    def _fill(self, *_):
        if len(self._cards) != len(self.data):
            kept = self._cards[:len(self.data)]
            self._cards = kept + [FigureCard(host=self, pos_hint={"top": 1}) for _ in self.data[len(kept):]]
            for card in self._cards[len(kept):]:
                card.fbind("minimum_height", self._level_soon)
            self._arrange()
        for card, data in zip(self._cards, self.data, strict=True):
            card.take(data)

    def _arrange(self, *_):
        for row in self.children:
            row.clear_widgets()
        self.clear_widgets()
        for first in range(0, len(self._cards), self.cols):
            row = BoxLayout(size_hint_y=None, spacing=self.spacing)
            row.bind(minimum_height=row.setter("height"))
            self.add_widget(row)
            for card in self._cards[first:first + self.cols]:
                row.add_widget(card)
        self._level_soon()

    def _level(self, *_):
        for row in self.children:
            highest = max(dp(104), *(card.minimum_height for card in row.children))
            for card in row.children:
                card.least_height = highest


class FactRow(Row, BoxLayout):
    """A label and, at its right, a value; ``note`` under the label."""
    label = StringProperty()
    value = StringProperty()
    note = StringProperty()


class FigureDialog(FormDialog):
    """What a figure means, and the numbers behind it: ``rows`` of FactRow."""
    text = StringProperty()
    rows = ListProperty()
