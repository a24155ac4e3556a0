"""The window's shape, the focused text input (for the on-screen keyboard), the keyboard's height (for dialogs), and the room for
messages. ``dock`` is global: widgets built by kv have no other reference."""

from kivy.event import EventDispatcher
from kivy.metrics import dp
from kivy.properties import BooleanProperty, NumericProperty, ObjectProperty

from app.widgets.around import around


def is_tall(width, height) -> bool:
    """Of a window in px: one column, above the bar with the screens. A window that lies on its side has it only where a rail would
    leave too little."""
    return width < dp(840 if height > width else 700)


def is_low(height) -> bool:
    """Of a window in px: there is no height to spare."""
    return height < dp(700)


class Dock(EventDispatcher):
    """``field`` is the focused text input, or None; ``height`` in px of the area under the on-screen keyboard, 0 without it; between
    ``free_left`` and ``free_right`` (px) nothing in the top bar can be pressed, 0 without a bar; ``floor`` is the
    height of the bar with the screens at the bottom of a tall window;
    ``question`` is the sheet that asks, and has the keys alone; while there is any,
    ``has_sheet``, the page has no filled button of its own."""

    field = ObjectProperty(None, allownone=True)
    height = NumericProperty(0)
    free_left = NumericProperty(0)
    free_right = NumericProperty(0)
    floor = NumericProperty(0)
    question = ObjectProperty(None, allownone=True)
    has_sheet = BooleanProperty(False)

    def entered(self, field) -> None:
        self.field = field

    def left(self, field) -> None:
        if self.field is field:
            self.field = None

    def leave(self, widget) -> None:
        """Take the focus from the field inside ``widget``, which is removed: otherwise the field and everything around
        it would stay in memory."""
        if widget in around(self.field):
            self.field.focus = False


dock = Dock()
