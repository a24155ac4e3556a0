"""What is only looked at: cards, badges, tiles, facts, empty states. Texts come ready from the view models."""
from kivy.properties import (
    BooleanProperty,
    ListProperty,
    NumericProperty,
    ObjectProperty,
    StringProperty,
)
from kivy.uix.boxlayout import BoxLayout

from app.widgets.surfaces import Surface, Toned, TonedSurface


class SectionCard(Surface):
    """A card; subclasses find their view model in ``vm``."""
    vm = ObjectProperty(None, rebind=True, allownone=True)


class CardHead(BoxLayout):
    """Title of a card and a quiet note at its right; ``least`` high."""
    title = StringProperty()
    note = StringProperty()
    least = NumericProperty("40dp")


class Tile(Surface):
    """A quiet block inside a card."""


class StatusBadge(TonedSurface):
    """Icon, word and colour of a state; ``loud`` only for a fault that needs a person now."""
    icon = StringProperty()
    text = StringProperty()
    loud = BooleanProperty(False)


class Disc(TonedSurface):
    """A round icon, or a number where there is no icon."""
    icon = StringProperty()
    text = StringProperty()
    loud = BooleanProperty(False)


class ValueTile(TonedSurface):
    """A live value with its age: a stale one turns grey and its note says since when. ``level`` 0..1 draws a bar, -1 none."""
    icon = StringProperty()
    label = StringProperty()
    value = StringProperty("–")
    note = StringProperty()
    note_icon = StringProperty()
    level = NumericProperty(-1)
    level_tone = StringProperty("accent")
    mark = NumericProperty(-1)
    stale = BooleanProperty(False)


class KpiCard(Surface):
    """A figure (markup: units small), how many rows it rests on, and its history as a small line."""
    label = StringProperty()
    value = StringProperty()
    note = StringProperty()
    history = ListProperty()


def with_unit(value: str, unit: str) -> str:
    """Markup of a KPI value with its unit set smaller behind it."""
    return f"{value}[size=18sp][font=Roboto] {unit}[/font][/size]"


class EmptyState(BoxLayout):
    """Says what is missing and offers the way: ``on_release`` when the button is pressed. Without ``action`` there is no button."""
    icon = StringProperty()
    title = StringProperty()
    text = StringProperty()
    action = StringProperty()
    action_icon = StringProperty()

    __events__ = ("on_release",)

    def on_release(self):
        """The button was pressed."""


class Fact(Toned, BoxLayout):
    """Label above value, as in a robot's data sheet."""
    label = StringProperty()
    value = StringProperty("–")
    icon = StringProperty()


class Notice(TonedSurface):
    """A block of one tone with icon, sentence and further words: the result of a test, a warning in a form."""
    icon = StringProperty()
    text = StringProperty()
    note = StringProperty()


class LegendItem(BoxLayout):
    """A swatch drawn like what it explains, and its word."""
    text = StringProperty()
    kind = StringProperty("planned")
