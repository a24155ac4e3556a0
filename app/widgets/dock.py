"""Which text input has the focus, for the on-screen keyboard. ``dock`` is global: fields are built by kv and have no other reference."""
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
