"""Widgets that only show something: cards, badges, tiles, facts, empty states. Their texts come from the view models."""

from kivy.properties import BooleanProperty, ListProperty, ObjectProperty, StringProperty
from kivy.uix.boxlayout import BoxLayout
from kivy.uix.stacklayout import StackLayout
from kivymd.uix.card import MDCard

from app.widgets.chart import Chart
from app.widgets.children import refill
from app.widgets.events import Fires
from app.widgets.lanes_bars import paint_look
from app.widgets.lanes_frame import colours
from app.widgets.surfaces import OnlySeen, Passive, TonedSurface
from app.widgets.tokens import tk


class SectionCard(OnlySeen, Passive, MDCard):
    """A card; ``vm`` is its view model."""

    vm = ObjectProperty(None, rebind=True, allownone=True)


class Disc(TonedSurface):
    """A round icon, or a number without an icon."""

    icon = StringProperty()
    text = StringProperty()
    loud = BooleanProperty(False)


class RowsCard(SectionCard):
    """With rows up to its edges, which don't stick out of its round corners."""


class EmptyState(Fires, BoxLayout):
    """Says what is missing, with a button that leads on: ``on_release``. Without ``action`` there is no button. Without
    enough room it scrolls."""

    icon = StringProperty()
    title = StringProperty()
    text = StringProperty()
    action = StringProperty()
    action_icon = StringProperty()

    __events__ = ("on_release",)


class Fact(BoxLayout):
    """Label above value, as in a robot's data sheet."""

    label = StringProperty()
    value = StringProperty("–")


class Notice(TonedSurface):
    """A block of one tone with icon, sentence and details: the result of a test, a warning in a form."""

    icon = StringProperty()
    text = StringProperty()
    note = StringProperty()


class Swatch(Chart):
    """One legend square, drawn like the thing it explains: the state of a bar of lanes, closed time, or a colour."""

    kind = StringProperty("accent")
    watch = ("kind",)

    def draw(self):
        if (look := colours().get(self.kind)) is not None:
            paint_look(self.kind, look, [(*self.pos, *self.size)])
        elif self.kind == "closed":
            self.box(*self.pos, *self.size, tk.closed)
            self.hatch(*self.pos, *self.size, tk.hatch)
            self.box(*self.pos, *self.size, tk.hatch, ring=1)
        else:
            self.box(*self.pos, *self.size, getattr(tk, self.kind))


class LegendItem(BoxLayout):
    """An entry of a chart's legend: a swatch and its label."""

    text = StringProperty()
    kind = StringProperty("accent")


class LegendItems(StackLayout):
    """Entries of a legend side by side, on as many lines as they need: ``items`` are (kind, text)."""

    items = ListProperty()

    def on_items(self, *_):
        refill(self, self.items, lambda item: LegendItem(kind=item[0], text=item[1]))
