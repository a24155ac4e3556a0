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
from app.widgets.rest import rest
from app.widgets.surfaces import OnlySeen, Passive
from app.widgets.text import line_width

SECONDS = 4.0
UNDO_SECONDS = 8.0
SETTLES = 0.5  # s after one has replaced another, or covered a button, in which a touch was meant for that


class Message:
    """A text that is shown for ``seconds``, which run while it is on screen; ``on_action`` runs when its button is pressed. Ends earlier
    messages ``about`` any of the same, as they may be outdated. ``bar`` is the snackbar that showed it last."""

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
        self.bar: Snackbar | None = None
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
    settles_at = 0.0

    @property
    def has_just_moved(self) -> bool:
        """Whether one has just replaced something else: a touch there is not meant for it."""
        return Clock.get_time() < self.settles_at

    def on_touch_down(self, touch):
        hit = [child for child in self.children if child.collide_point(*touch.pos)]
        return any(self.has_just_moved or child.dispatch("on_touch_down", touch) for child in hit)


class Snackbars:
    """The pile of messages; the newest is shown. A covered one keeps its remaining time until it is shown again, unless
    it has been read. Call it on the UI thread."""

    def __init__(self) -> None:
        self._pile: list[Message] = []
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
        ended = [said for said in self._pile if message.ends(said)]
        if top is not None and top.repeats(message):
            self._close_all(said for said in ended if said is not top)
            top.stop()
            top.left, top.about = message.seconds, message.about
            top.begin(self._take_off)
            return
        self._pile.append(message)
        if top is not None:
            self._hide(top)
            if top.is_read and top not in ended:
                ended.append(top)
        self._close_all(ended)
        self._show_top(instead=top is not None)

    def end(self, about: Hashable) -> None:
        """End messages about that."""
        self._close_all([said for said in self._pile if about in said.about])

    def clear(self) -> None:
        """Close all messages as if their time were over."""
        self._close_all(list(self._pile))

    def rebuild(self) -> None:
        """Show them in the sizes of now."""
        for said in self._pile[-1:]:
            self._hide(said)
            Window.remove_widget(self.stack)
        self.stack = None
        if self._pile:
            self._show_top(instead=True)

    def _show_top(self, instead: bool) -> None:
        """``instead``: in the place of another one."""
        said = self._pile[-1]
        stack = self.stack = self.stack or SnackbarStack()
        Window.remove_widget(stack)  # on top of what was opened since
        Window.add_widget(stack)
        said.bar = Snackbar(text=said.text, icon=said.icon, action_text=said.action)
        said.bar.bind(on_action=self._pressed)
        said.bar.opacity = 1  # KivyMD's begins at 0
        stack.below = len(self._pile) - 1
        stack.add_widget(said.bar)
        stack.settles_at = Clock.get_time() + SETTLES if instead or stack.wide or stack.low else 0.0
        said.begin(self._take_off)

    def _hide(self, said: Message) -> None:
        said.stop()
        if said.bar.parent is not None:
            self.stack.remove_widget(said.bar)

    def _pressed(self, bar: Snackbar) -> None:
        """Perhaps of one that was covered when the finger was down already."""
        said = next((said for said in self._pile if said.bar is bar), None)
        if said is not None:
            self._take_off(said)
            if said.on_action is not None:
                said.on_action()

    def _close_all(self, pile: Iterable[Message]) -> None:
        for said in pile:
            self._take_off(said)

    def _take_off(self, said: Message) -> None:
        was_top = said is self._pile[-1]
        if was_top:
            rest.after_leaving(said.bar)
        self._hide(said)
        self._pile.remove(said)
        if not self._pile:
            Window.remove_widget(self.stack)
        elif was_top:
            self._show_top(instead=True)
        self.stack.below = max(0, len(self._pile) - 1)

    @property
    def texts(self) -> list[str]:
        """The texts that are not over, oldest first; the last one is on screen."""
        return [said.text for said in self._pile]
