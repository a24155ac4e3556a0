"""Which text input has the focus, for the on-screen keyboard, how high that one is, for dialogs, and where messages have room. ``dock`` is
global: what is built by kv has no other reference."""

from kivy.event import EventDispatcher
from kivy.properties import ListProperty, NumericProperty, ObjectProperty


class Dock(EventDispatcher):
    """``field`` is the text input that has the focus, or None; ``height`` in px of what the on-screen keyboard covers, 0 without it;
    ``free_bar`` in px from the left of the window to what can be pressed in the top bar, 0 without a bar; ``dialogs`` are those that are
    shown, the topmost last."""

    field = ObjectProperty(None, allownone=True)
    height = NumericProperty(0)
    free_bar = NumericProperty(0)
    dialogs = ListProperty()

    def entered(self, field) -> None:
        self.field = field

    def left(self, field) -> None:
        if self.field is field:
            self.field = None

    def leave(self, widget) -> None:
        """Take the focus from the field inside ``widget``, which goes: it would be kept with all that is around it."""
        around = self.field
        while around is not None and around is not widget:
            around = around.parent if around.parent is not around else None  # a window is its own parent
        if around is not None:
            self.field.focus = False


dock = Dock()
