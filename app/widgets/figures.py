"""Cards of figures that explain themselves when tapped."""

from kivy.properties import ListProperty, NumericProperty, StringProperty
from kivy.uix.boxlayout import BoxLayout

from app.widgets.dialogs import FormDialog
from app.widgets.lists import Row
from app.widgets.surfaces import Tap


class FigureCard(Row, Tap):
    """A figure (with markup: the unit is smaller), how it has changed, and its history as a small chart; a tap is the action "explain"."""

    label = StringProperty()
    value = StringProperty()
    change = StringProperty()
    history = ListProperty()
    before = ListProperty()
    least_span = NumericProperty(0)

    def on_release(self):
        self.act("explain")


class FigureGrid(BoxLayout):
    """One FigureCard per row of ``data``, ``cols`` side by side; a tap fires ``on_action(key, "explain")``. The cards
    of each line share its whole width, those of the last one too."""

    data = ListProperty()
    cols = NumericProperty(1)

    __events__ = ("on_action",)

    def __init__(self, **kwargs):
        self._cards: list[FigureCard] = []
        super().__init__(orientation="vertical", **kwargs)
        for name, then in (("data", self._fill), ("cols", self._arrange), ("spacing", self._arrange)):
            self.fbind(name, then)
        self._fill()

    def on_action(self, key, action):
        """A card was tapped."""

    def _fill(self, *_):
        if len(self._cards) != len(self.data):
            self._cards = [FigureCard(host=self) for _ in self.data]
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
            for card in self._cards[first : first + self.cols]:
                row.add_widget(card)


class FactRow(Row, BoxLayout):
    """A label and, at its right, a value; ``note`` under the label."""

    label = StringProperty()
    value = StringProperty()
    note = StringProperty()


class FigureDialog(FormDialog):
    """What a figure means, and the numbers behind it: ``rows`` of FactRow."""

    text = StringProperty()
    rows = ListProperty()
