"""Seven chips for the days of the week; any number can be chosen."""

from kivy.properties import ListProperty
from kivy.uix.gridlayout import GridLayout

from app.widgets.buttons import Segment
from app.widgets.tokens import tk


class WeekdayChips(GridLayout):
    """``data`` have ``key``, ``text`` and ``selected``; in two rows if one is too narrow for fingers. A tap only fires
    ``on_choose(key)``."""

    data = ListProperty()

    __events__ = ("on_choose",)

    def __init__(self, **kwargs):
        super().__init__(cols=7, **kwargs)
        self.fbind("data", self._build)
        self.fbind("width", self._fit)
        self._build()

    def on_choose(self, key):
        """A day was tapped."""

    def _fit(self, *_):
        self.cols = 7 if self.width >= 7 * tk.h_touch + 6 * self.spacing[0] else 4

    def _build(self, *_):
        if [option.key for option in self.data] != [chip.key for chip in reversed(self.children)]:
            self.clear_widgets()
            for option in self.data:
                chip = Segment(key=option.key, size_hint_y=None, height=tk.h_touch)
                chip.bind(on_release=lambda chip: self.dispatch("on_choose", chip.key))
                self.add_widget(chip)
        for chip, option in zip(reversed(self.children), self.data, strict=True):
            chip.text, chip.selected = option.text, option.selected
