"""Cards of figures that can be asked what they mean."""
from kivy.properties import ListProperty, StringProperty
from kivy.uix.boxlayout import BoxLayout
from kivy.uix.gridlayout import GridLayout

from app.widgets.dialogs import FormDialog
from app.widgets.display import KpiCard
from app.widgets.lists import Row
from app.widgets.surfaces import Tap


class FigureCard(Row, Tap, KpiCard):
    """A KpiCard that can be tapped."""

    def on_release(self):
        self.act("explain")


class FigureGrid(GridLayout):
    """One FigureCard per dict of ``data``; a tap fires ``on_action(key, "explain")``. The cards of each row share its whole width."""
    data = ListProperty()

    __events__ = ("on_action",)

    def __init__(self, **kwargs):
        super().__init__(**kwargs)
        self.fbind("data", self._build)
        self._build()

    def on_action(self, key, action):
        """A card was tapped."""

    def _build(self, *_):
        while len(self.children) > len(self.data):
            self.remove_widget(self.children[0])
        while len(self.children) < len(self.data):
            self.add_widget(FigureCard(host=self))
        for card, data in zip(reversed(self.children), self.data, strict=True):
            card.take(data)

    def do_layout(self, *args):
        super().do_layout(*args)
        last = list(reversed(self.children[:len(self.children) % self.cols]))
        gap = self.spacing[0]
        wide = (self.width + gap) / max(1, len(last)) - gap
        for n, card in enumerate(last):
            card.x, card.width = self.x + n * (wide + gap), wide


class FactRow(Row, BoxLayout):
    """A label and, at its right, a value; ``note`` under the label."""
    label = StringProperty()
    value = StringProperty()
    note = StringProperty()


class FigureDialog(FormDialog):
    """What a figure means, and the numbers behind it: ``rows`` of FactRow."""
    text = StringProperty()
    rows = ListProperty()
