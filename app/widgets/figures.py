"""Cards of figures that explain themselves when tapped."""

from kivy.properties import ListProperty, NumericProperty, StringProperty

from app.widgets.lists import Row
from app.widgets.sheet import Sheet
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


class FigureSheet(Sheet):
    """What a figure means, and the numbers behind it: ``rows`` are Items."""

    text = StringProperty()
    rows = ListProperty()
