"""Where fields tell that they are typed into. ``dock`` is the one of this process, for the fields' sake: kv builds them, and they know
nobody."""
from kivy.event import EventDispatcher
from kivy.properties import ObjectProperty


class Dock(EventDispatcher):
    """``field`` is the text input that has the focus, or None."""
    field = ObjectProperty(None, allownone=True)

    def entered(self, field) -> None:
        self.field = field

    def left(self, field) -> None:
        if self.field is field:
            self.field = None


dock = Dock()
