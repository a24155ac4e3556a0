"""Which text input has the focus, for the on-screen keyboard, and how high that one is, for dialogs. ``dock`` is global: fields are built
by kv and have no other reference."""
from kivy.event import EventDispatcher
from kivy.properties import NumericProperty, ObjectProperty


class Dock(EventDispatcher):
    """``field`` is the text input that has the focus, or None; ``height`` in px of what the on-screen keyboard covers, 0 without it."""
    field = ObjectProperty(None, allownone=True)
    height = NumericProperty(0)

    def entered(self, field) -> None:
        self.field = field

    def left(self, field) -> None:
        if self.field is field:
            self.field = None


dock = Dock()
