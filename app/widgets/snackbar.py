"""Snackbars: short messages about what was done, with at most one button (Undo). Several are shown at once, so that a new one never
hides an undo."""
from collections import deque
from collections.abc import Callable
from dataclasses import dataclass

from kivy.animation import Animation
from kivy.clock import Clock
from kivy.core.window import Window
from kivy.properties import BooleanProperty, StringProperty
from kivy.uix.boxlayout import BoxLayout
from kivymd.uix.snackbar import MDSnackbar

from app.widgets.surfaces import OnlySeen, Passive

AT_ONCE = 3
SECONDS = 4.
UNDO_SECONDS = 8.


@dataclass
class Message:
    """A text that is shown for ``seconds``, or until it is closed by hand (None); ``on_action`` runs when the button is pressed, ``on_end``
    if it wasn't."""
    text: str
    icon: str = ""
    action: str = ""
    on_action: Callable[[], object] | None = None
    on_end: Callable[[], object] | None = None
    seconds: float | None = SECONDS


class Snackbar(OnlySeen, Passive, MDSnackbar):
    """One message on screen; only its button and its cross take touches. When it is shown, and for how long, is up to ``Snackbars``."""
    text = StringProperty()
    icon = StringProperty()
    action_text = StringProperty()
    closable = BooleanProperty(False)

    __events__ = ("on_action", "on_close")

    def add_widget(self, *args, **kwargs):
        """KivyMD has its text on one line that runs through the button, and makes room for that 0.2 s later."""
        super(MDSnackbar, self).add_widget(*args, **kwargs)

    def on_action(self):
        """The button was pressed."""

    def on_close(self):
        """The cross was pressed."""


class SnackbarStack(BoxLayout):
    """Holds the snackbars, on top of everything: in the top bar over the screen's name and the time, where nobody presses anything; further
    ones below."""

    def on_touch_down(self, touch):
        return any(child.collide_point(*touch.pos) and child.dispatch("on_touch_down", touch) for child in self.children)


class Snackbars:
    """The queue of messages: three are shown at once, the others wait. Call it on the UI thread."""

    def __init__(self) -> None:
        self._waiting: deque[Message] = deque()
        self._shown: dict[Snackbar, tuple[Message, object]] = {}
        self.stack: SnackbarStack | None = None

    def show(self, text: str, *, icon: str = "", seconds: float = SECONDS) -> None:
        """Show a message."""
        self.post(Message(text, icon=icon, seconds=seconds))

    def undo(self, text: str, word: str, undo: Callable[[], object], ended: Callable[[], object] | None = None, *,
             stays: bool = False) -> None:
        """Show that something was removed, for 8 s with a button ``word`` that calls ``undo``; ``ended`` runs if it wasn't pressed. It may
        stay until it is closed."""
        self.post(Message(text, action=word, on_action=undo, on_end=ended, seconds=None if stays else UNDO_SECONDS))

    def post(self, message: Message) -> None:
        if self._is_said(message):
            return
        staying = [bar for bar, (shown, _timer) in self._shown.items() if shown.seconds is None]
        if message.seconds is None and len(staying) == AT_ONCE - 1:        # others need a place, too
            self._close(staying[0], pressed=False)
        self._waiting.append(message)
        self._show_next()

    def _is_said(self, message: Message) -> bool:
        """Whether that can be read already; it then can be for as long as if it had just come."""
        if message.action:
            return False
        for shown, timer in self._shown.values():
            if (shown.text, shown.action) == (message.text, ""):
                timer.cancel()
                timer()
                return True
        return any((waiting.text, waiting.action) == (message.text, "") for waiting in self._waiting)

    def clear(self) -> None:
        """Close all messages, waiting ones as well, as if their time were over."""
        while self._waiting:
            self._end(self._waiting.popleft())
        for bar in list(self._shown):
            self._close(bar, pressed=False)

    def _show_next(self) -> None:
        while self._waiting and len(self._shown) < AT_ONCE:
            message = self._waiting.popleft()
            bar = Snackbar(text=message.text, icon=message.icon, action_text=message.action, closable=message.seconds is None, opacity=0)
            bar.bind(on_action=self._pressed, on_close=self._dismissed)
            timer = Clock.create_trigger(lambda _dt, bar=bar: self._close(bar, pressed=False), message.seconds or 0)
            if message.seconds is not None:
                timer()
            self._shown[bar] = message, timer
            self._place().add_widget(bar)
            Animation(opacity=1, d=.15).start(bar)

    def _place(self) -> SnackbarStack:
        if self.stack is None:
            self.stack = SnackbarStack()
        Window.remove_widget(self.stack)        # on top of what was opened since
        Window.add_widget(self.stack)
        return self.stack

    def _pressed(self, bar: Snackbar) -> None:
        self._close(bar, pressed=True)

    def _dismissed(self, bar: Snackbar) -> None:
        self._close(bar, pressed=False)

    def _close(self, bar: Snackbar, pressed: bool) -> None:
        if bar not in self._shown:
            return
        message, timer = self._shown.pop(bar)
        timer.cancel()
        Animation.cancel_all(bar)               # one that never ends keeps it
        self.stack.remove_widget(bar)
        if not self._shown:
            Window.remove_widget(self.stack)
        if pressed and message.on_action is not None:
            message.on_action()
        elif not pressed:
            self._end(message)
        self._show_next()

    @staticmethod
    def _end(message: Message) -> None:
        if message.on_end is not None:
            message.on_end()

    @property
    def texts(self) -> list[str]:
        """The texts on screen, oldest first."""
        return [message.text for message, _timer in self._shown.values()]


