"""Seven chips for the days of the week, of which any number is chosen."""
from kivy.properties import ListProperty
from kivy.uix.boxlayout import BoxLayout

from app.widgets.buttons import Segment


class WeekdayChips(BoxLayout):
    """``data`` = [{"key", "text", "selected"}, …] as wide as the row; a tap fires ``on_choose(key)`` and changes nothing by itself."""
    data = ListProperty()

    __events__ = ("on_choose",)

    def __init__(self, **kwargs):
        super().__init__(**kwargs)
        self.fbind("data", self._build)
        self._build()

    def on_choose(self, key):
        """A day was tapped."""

    def _build(self, *_):
        if [row["key"] for row in self.data] != [chip.key for chip in reversed(self.children)]:
            self.clear_widgets()
            for row in self.data:
                chip = Segment(key=row["key"])
                chip.bind(on_release=lambda chip: self.dispatch("on_choose", chip.key))
                self.add_widget(chip)
        for chip, row in zip(reversed(self.children), self.data, strict=True):
            chip.text, chip.selected = row["text"], row["selected"]
