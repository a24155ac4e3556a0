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
    """One FigureCard per row of ``data``, ``cols`` side by side; a tap fires ``on_action(key, "explain")``. The cards
    of each line share its whole width, those of the last one too. All are as high as the highest, and not lower than
    they were: other figures don't move what is below."""

    data = ListProperty()
    cols = NumericProperty(1)

    __events__ = ("on_action",)

    def __init__(self, **kwargs):
        self._cards: list[FigureCard] = []
        self._highest = self._kept = 0.0  # of the cards, now and before the last change of the data
        self._level_soon = Clock.create_trigger(self._level, -1)
        super().__init__(orientation="vertical", **kwargs)
        self.fbind("data", self._fill)
        self.fbind("cols", self._arrange)
        self.fbind("spacing", self._arrange)
        self.fbind("width", self._forget)
        self._fill()

    def on_action(self, key, action):
        """A card was tapped."""

    def _forget(self, *_):
        self._highest = self._kept = 0.0
        self._level_soon()

    def _fill(self, *_):
        self._kept = self._highest
        if len(self._cards) != len(self.data):
            kept = self._cards[: len(self.data)]
            self._cards = kept + [FigureCard(host=self, pos_hint={"top": 1}) for _ in self.data[len(kept) :]]
            for card in self._cards[len(kept) :]:
                card.fbind("minimum_height", self._level_soon)
            self._arrange()
        for card, data in zip(self._cards, self.data, strict=True):
            card.take(data)

    def _arrange(self, *_):
        self._forget()
        for row in self.children:
            row.clear_widgets()
        self.clear_widgets()
        for first in range(0, len(self._cards), self.cols):
            row = BoxLayout(size_hint_y=None, spacing=self.spacing)
            row.bind(minimum_height=row.setter("height"))
            self.add_widget(row)
            for card in self._cards[first : first + self.cols]:
                row.add_widget(card)

    def _level(self, *_):
        self._highest = max((dp(104), self._kept, *(card.minimum_height for card in self._cards)))
        for card in self._cards:
            card.least_height = self._highest


class FactRow(Row, BoxLayout):
    """A label and, at its right, a value; ``note`` under the label."""

    label = StringProperty()
    value = StringProperty()
    note = StringProperty()


class FigureDialog(FormDialog):
    """What a figure means, and the numbers behind it: ``rows`` of FactRow."""

    text = StringProperty()
    rows = ListProperty()
