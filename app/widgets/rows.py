"""The row of an option to choose. ``key`` identifies it; the list fires ``on_action(key, "choose")``."""

from kivy.properties import BooleanProperty, StringProperty

from app.widgets.lists import Row
from app.widgets.surfaces import TonedTap


class OptionRow(Row, TonedTap):
    """One option of a list to choose from; ``mark`` shows a box that can be ticked. The ``tone`` is the icon's."""

    icon = StringProperty()
    text = StringProperty()
    note = StringProperty()
    selected = BooleanProperty(False)
    mark = BooleanProperty(False)

    def on_release(self):
        self.act("choose")
