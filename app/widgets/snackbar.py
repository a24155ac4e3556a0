"""Snackbars: short messages about what was done, with at most one button (Undo). The newest is shown; earlier ones are
below it and come back, so that a new one never removes an Undo or covers the page below the top bar."""

from collections.abc import Callable, Hashable, Iterable

from kivy.clock import Clock
from kivy.core.window import Window
from kivy.metrics import sp
from kivy.properties import BooleanProperty, NumericProperty, ObjectProperty, StringProperty
from kivy.uix.boxlayout import BoxLayout
from kivymd.uix.snackbar import MDSnackbar

from app.widgets.events import Fires
from app.widgets.places import places
from app.widgets.rest import rest
from app.widgets.surfaces import OnlySeen, Passive
from app.widgets.text import line_width

SECONDS = 4.0
UNDO_SECONDS = 8.0


class Message:
    """A text that is shown for ``seconds``, which run while it is on screen; ``on_action`` runs when its button is pressed. Ends earlier
    messages ``about`` any of the same, as they may be outdated."""

    def __init__(
        self,
        text: str,
        icon: str = "",
        action: str = "",
        on_action: Callable[[], object] | None = None,
        seconds: float = SECONDS,
        about: Iterable[Hashable | None] = (),
    ) -> None:
        self.text, self.icon, self.action, self.on_action = text, icon, action, on_action
        self.seconds = self.left = seconds
        self.about = frozenset(about) - {None}
        self._timer, self._since = None, 0.0

    @property
    def is_read(self) -> bool:
        """It has no button, and has been shown for at least half of its time."""
        return not self.action and self.left <= self.seconds / 2

    def repeats(self, other: "Message") -> bool:
        return not self.action and not other.action and self.text == other.text

    def ends(self, earlier: "Message") -> bool:
        """A button that can be pressed stays."""
        return self.repeats(earlier) or (not earlier.action and bool(self.about & earlier.about))

    def begin(self, over: Callable[["Message"], object]) -> None:
        """Run its time; ``over`` is called at its end."""
        self._since = Clock.get_time()
        self._timer = Clock.schedule_once(lambda _dt: over(self), self.left)

    def stop(self) -> None:
        if self._timer is not None:
            self._timer.cancel()
            self._timer, self.left = None, max(0.0, self.left - (Clock.get_time() - self._since))


class Snackbar(Fires, OnlySeen, Passive, MDSnackbar):
    """One message on screen; only its button takes touches. When it is shown, and for how long, is up to ``Snackbars``."""

    text = StringProperty()
    icon = StringProperty()
    action_text = StringProperty()
    words = NumericProperty(0)  # px, of the text on one line
    around = NumericProperty(0)  # px, next to it

    __events__ = ("on_action",)

    def add_widget(self, *args, **kwargs):
        """KivyMD has its text on one line that runs through the button, and makes room for that 0.2 s later."""
        super(MDSnackbar, self).add_widget(*args, **kwargs)

    def on_text(self, *_):
        self.words = line_width(self.text, "Roboto", sp(16))


class SnackbarStack(BoxLayout):
    """Holds the snackbar, on top of everything: in the top bar between the tabs and the time, where nothing can be pressed. In a tall
    window, and without the room there, it is at the foot of the page (``low``): right of the foot button of Home. A text with no room
    (``wide``) is as wide as a window without a top bar. An edge of those ``below`` it is visible."""

    below = NumericProperty(0)
    bar = ObjectProperty(None, allownone=True, rebind=True)
    wide = BooleanProperty(False)
    low = BooleanProperty(False)


class Snackbars:
    """The pile of messages; the newest is shown. A covered one keeps its remaining time until it is shown again, unless
    it has been read. Call it on the UI thread."""

    def __init__(self) -> None:
        self._pile: list[Message] = []
        self._shown: tuple[Message, Snackbar] | None = None
        self.stack: SnackbarStack | None = None

    def show(self, text: str, *, icon: str = "", seconds: float = SECONDS, about: Hashable | None = None) -> None:
        """Show a message, instead of earlier ones ``about`` the same."""
        self.post(Message(text, icon, seconds=seconds, about=[about]))

    def undo(self, text: str, word: str, undo: Callable[[], object], *, about: Hashable | None = None) -> None:
        """Show that something was removed, for 8 s with a button ``word`` that calls ``undo``."""
        self.post(Message(text, action=word, on_action=undo, seconds=UNDO_SECONDS, about=[about]))

    def post(self, message: Message) -> None:
        """The same words without a button are not shown twice: they become the newest, with their full time."""
        top = self._pile[-1] if self._pile else None
        if top is not None:
            top.stop()
        if top is not None and top.repeats(message):
            top.left, top.about = message.seconds, message.about
            top.begin(self._close)
            self._keep(lambda said: said is top or not message.ends(said))
        else:
            self._keep(lambda said: not message.ends(said) and not (said is top and said.is_read), message)

    def end(self, about: Hashable) -> None:
        """End messages about that."""
        self._keep(lambda said: about not in said.about)

    def clear(self) -> None:
        """Close all messages as if their time were over."""
        self._keep(lambda said: False)

    def rebuild(self) -> None:
        """Show them in the sizes of now."""
        self._take_off()
        self.stack = None
        self._show_newest()

    def _close(self, message: Message) -> None:
        self._keep(lambda said: said is not message)

    def _keep(self, wanted: Callable[[Message], bool], *more: Message) -> None:
        self._pile = [*filter(wanted, self._pile), *more]
        self._show_newest()

    def _show_newest(self) -> None:
        newest, shown = self._pile[-1] if self._pile else None, self._shown
        if shown is not None and shown[0] is not newest:
            if shown[0] not in self._pile:
                rest.after_leaving(shown[1])
            self._take_off()
        if newest is not None and self._shown is None:
            stack = self.stack = self.stack or SnackbarStack()
            bar = Snackbar(text=newest.text, icon=newest.icon, action_text=newest.action)
            bar.bind(on_action=lambda _bar: self._pressed(newest))
            bar.opacity = 1  # KivyMD's begins at 0
            Window.add_widget(stack)  # on top of what was opened since
            stack.add_widget(bar)
            places.come(bar, among_others=shown is not None or stack.wide or stack.low)
            self._shown = newest, bar
            newest.begin(self._close)
        if self.stack is not None:
            self.stack.below = max(0, len(self._pile) - 1)

    def _take_off(self) -> None:
        if self._shown is not None:
            message, bar = self._shown
            message.stop()
            self.stack.remove_widget(bar)
            Window.remove_widget(self.stack)
            self._shown = None

    def _pressed(self, message: Message) -> None:
        """Perhaps of one that was covered when the finger was down already."""
        if message in self._pile:
            self._close(message)
            if message.on_action is not None:
                message.on_action()

    @property
    def texts(self) -> list[str]:
        """The texts that are not over, oldest first; the last one is on screen."""
        return [said.text for said in self._pile]
