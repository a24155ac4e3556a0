"""An on-screen keyboard, for tablets without a keyboard: letters with å ä ö, signs, and a number pad for number fields.

Not kivy's VKeyboard: that one uses images of its own, ignores the theme, has neither large keys nor a number pad, and moves the whole
window.
"""

from kivy.clock import Clock
from kivy.core.window import Window
from kivy.metrics import dp
from kivy.properties import NumericProperty, StringProperty
from kivy.uix.behaviors import FocusBehavior
from kivy.uix.boxlayout import BoxLayout
from kivy.uix.scrollview import ScrollView
from kivy.uix.widget import Widget

from app.widgets import finger, load_kv
from app.widgets.around import around
from app.widgets.dock import dock
from app.widgets.fields import Field
from app.widgets.rest import rest
from app.widgets.surfaces import Surface, Tap

SHIFT, BACKSPACE, DONE, SIGNS, MORE, LETTERS, SPACE = "shift", "backspace", "done", "signs", "more", "letters", "space"
DECIMAL, GAP = "decimal", ""
ICONS = {SHIFT: "apple-keyboard-shift", BACKSPACE: "backspace-outline", DONE: "check", SPACE: "keyboard-space"}
WORDS = {SIGNS: "123", MORE: "#$~", LETTERS: "abc"}
WIDE = {SPACE: 5.0, DONE: 2.0, LETTERS: 1.5}  # in widths of a letter's key
PAGES = {
    "letters": ([*"qwertyuiopå"], [*"asdfghjklöä"], [SHIFT, *"zxcvbnm.-", BACKSPACE], [SIGNS, "@", SPACE, "/", DONE]),
    "signs": ([*"1234567890+"], [*"-/:;()€&@\"'"], [MORE, *".,?!_=#%*", BACKSPACE], [LETTERS, "[", SPACE, "]", DONE]),
    "more": ([*"$^~|\\<>{}[]"], [*"`*+-/=_#%&@"], [SIGNS, *".,?!§£°µ·", BACKSPACE], [LETTERS, "(", SPACE, ")", DONE]),
    "decimals": ([*"123", BACKSPACE], [*"456", "-"], [*"789", DECIMAL], ["0", DONE]),
    "integers": ([*"123", BACKSPACE], [*"456", "-"], [*"789", GAP], ["0", DONE]),
    "digits": ([*"123", BACKSPACE], [*"456", GAP], [*"789", GAP], ["0", DONE]),
}
NUMBERS = {"-.": "decimals", "-": "integers", "": "digits"}  # signs of a field -> its number pad
PAD_WIDTH = 480  # dp, of the number pad
REPEATS = (0.5, 0.1)  # s before a held backspace repeats, and between repetitions
CLEARANCE = 16  # dp between the field and the keyboard


class BoardKey(Tap):
    """One key; ``share`` is its part of the row's width."""

    key = StringProperty()
    text = StringProperty()
    icon = StringProperty()
    share = NumericProperty(1)


class WordKey(BoardKey):
    """With a character or a word on it."""


class IconKey(BoardKey):
    """With an icon on it."""


class BoardRow(BoxLayout):
    """The keys of one row; 64 dp high with gloves and in high windows."""


class DockedKeyboard(Surface):
    """At the bottom of the window while a field has the focus and ``wanted()`` is true. The field stays visible:
    dialogs use the room above, pages scroll, and the screen moves up (but not under a finger, which would touch one
    field and press another). It hides when a real keyboard types, until a finger touches a field."""

    page = StringProperty()

    def __init__(self, wanted, decimal=lambda: ".", **kwargs):
        """``decimal()`` is the decimal sign of the language."""
        load_kv("widgets/keyboard")
        self._wanted, self._decimal = wanted, decimal
        self._pages = {}
        self._is_upper = False
        self._is_real = False  # a real keyboard types
        self._entered = None  # the field that it was last shown for
        self._lifted = None  # (widget, its y before it was moved up)
        self._follow = Clock.create_trigger(self._place, 0.05)  # another field may get the focus
        self._reveal = Clock.create_trigger(self._scroll_to_field, 0.05)  # when a dialog has its new height
        self._raise = Clock.create_trigger(self._lift, 0.02)
        self._watch = Clock.create_trigger(self._check_field, 0.25, interval=True)
        self._repeat = Clock.create_trigger(self._repeat_backspace, REPEATS[0])
        super().__init__(**kwargs)

    # ------------------------------------------------------------------ life
    def start(self) -> None:
        dock.bind(field=self._follow)
        Window.bind(size=self._follow, on_key_down=self._real_key, on_touch_down=self._finger)

    def stop(self) -> None:
        dock.unbind(field=self._follow)
        Window.unbind(size=self._follow, on_key_down=self._real_key, on_touch_down=self._finger)
        self._follow.cancel()
        self._hide()

    def _real_key(self, *_):
        self._is_real = True
        self._hide()

    def _finger(self, _window, touch):
        self._is_real = False
        if (
            dock.field is not None
            and self.parent is None
            and dock.field.collide_point(*dock.field.to_widget(*touch.pos))
        ):
            self._follow()

    def _place(self, *_):
        if finger.is_down():
            self._follow()
            return
        field = dock.field
        if field is None or self._is_real or not self._wanted():
            if self.parent is not None:
                rest.after_moving()  # what it has lifted comes down
            self._hide()
            if field is not None:
                self._reveal()
            return
        if field is not self._entered and field.input_type == "number":
            field.cursor = field.get_cursor_from_index(len(field.text))  # numbers are edited from the end
        self._entered = field
        is_letters = self.page in ("", *NUMBERS.values())
        self._show_page(
            NUMBERS[field.signs] if field.input_type == "number" else "letters" if is_letters else self.page
        )
        if self.parent is not None:
            Window.remove_widget(self)  # on top of what was opened since
        else:
            rest.after_moving()
        self.size_hint = None, None
        row = self._pages[self.page][0].height
        self.pos, self.size = (
            (0, 0),
            (Window.width, len(self._pages[self.page]) * (row + self.spacing) - self.spacing + 2 * dp(8)),
        )
        Window.add_widget(self)
        dock.height = self.height
        self._reveal()
        self._watch()

    def _check_field(self, _dt):
        """Hide when the field is removed, with rows that are no longer shown."""
        if any(widget.parent is Window for widget in around(dock.field)):
            return
        if dock.field is not None:
            dock.field.focus = False
        self._hide()

    def _hide(self) -> None:
        self._watch.cancel()
        self._repeat.cancel()
        self._reveal.cancel()
        self._raise.cancel()
        self._put_down()
        dock.height = 0
        self._entered = None
        self.page = ""
        if self.parent is not None:
            Window.remove_widget(self)
        self.clear_widgets()
        self._pages = {
            name: rows for name, rows in self._pages.items() if name == "letters"
        }  # the others are seldom needed

    def _scroll_to_field(self, _dt) -> None:
        """With its label and help where these fit."""
        if finger.is_down():
            self._reveal()
            return
        field = dock.field
        if field is None:
            return
        shown = next(around(field, Field), field)
        for view in around(field, ScrollView):
            view.scroll_to(shown if shown.height <= view.height else field, padding=0, animate=False)
        self._raise()

    def _lift(self, _dt) -> None:
        """Move up the screen of the field, so far that the field is above the keyboard."""
        self._put_down()
        field = dock.field
        if field is None or self.parent is None:
            return
        *_inner, top = around(field)
        up = self.height + dp(CLEARANCE) - field.to_window(field.x, field.y)[1]
        if up > 0:
            self._lifted = top, top.y
            top.y += up

    def _put_down(self) -> None:
        if self._lifted is not None:
            widget, y = self._lifted
            widget.y = y
            self._lifted = None

    # ------------------------------------------------------------------ pages
    def _show_page(self, name) -> None:
        if name == self.page:
            return
        self.page = name
        if name not in self._pages:
            self._pages[name] = [self._row(keys) for keys in PAGES[name]]
        self.clear_widgets()
        for row in self._pages[name]:
            self.add_widget(row)
        self._set_case(False)

    def _row(self, keys) -> BoardRow:
        row = BoardRow()
        for key in keys:
            if key == GAP:
                row.add_widget(Widget())
                continue
            face = (
                {"icon": ICONS[key]}
                if key in ICONS
                else {"text": self._decimal() if key == DECIMAL else WORDS.get(key, key)}
            )
            button = (IconKey if key in ICONS else WordKey)(key=key, share=WIDE.get(key, 1.0), **face)
            button.bind(on_press=self._pressed, on_release=self._released)
            row.add_widget(button)
        return row

    def _set_case(self, is_upper) -> None:
        self._is_upper = is_upper
        for key in self._keys():
            if len(key.key) == 1:
                key.text = key.key.upper() if is_upper else key.key

    def _keys(self) -> list[BoardKey]:
        """Of the page that is shown."""
        return [key for row in self.children for key in row.children if isinstance(key, BoardKey)]

    # ------------------------------------------------------------------ keys
    def on_touch_down(self, touch):
        """Keep the focus in the field: kivy removes it when something else is touched, unless the touch is in ``ignored_touch``."""
        if not self.collide_point(*touch.pos):
            return False
        FocusBehavior.ignored_touch.append(touch)
        super().on_touch_down(touch)
        return True

    def _pressed(self, key):
        if key.key == BACKSPACE:
            self._backspace()
            self._repeat.timeout = REPEATS[0]
            self._repeat()

    def _released(self, key):
        field, name = dock.field, key.key
        self._repeat.cancel()
        if field is None or name == BACKSPACE:
            return
        if name == SHIFT:
            self._set_case(not self._is_upper)
        elif name in (SIGNS, MORE, LETTERS):
            self._show_page(name)
        elif name == DONE:
            rest.after_leaving(self)
            field.dispatch("on_text_validate")
            field.focus = False
        else:
            field.insert_text(" " if name == SPACE else key.text)
            if self._is_upper:
                self._set_case(False)

    def _backspace(self):
        field = dock.field
        if field is None:
            return
        if field.selection_text:
            field.delete_selection()
        else:
            field.do_backspace()

    def _repeat_backspace(self, _dt):
        if any(key.key == BACKSPACE and key.state == "down" for key in self._keys()):
            self._backspace()
            self._repeat.timeout = REPEATS[1]
            self._repeat()


def side_margin(width: float, page: str) -> float:
    """Margin left and right of the keys in px: a number pad has a fixed width."""
    return max(dp(8), (width - dp(PAD_WIDTH)) / 2) if page in NUMBERS.values() else dp(8)


def has_keyboard(devices: str) -> bool:
    """Whether Linux's list of input devices (/proc/bus/input/devices) has one with keys that repeat and lights for the locks: power buttons
    and remote controls have neither."""
    return any("kbd" in device and "EV=120013" in device for device in devices.split("\n\n"))


def lacks_keyboard(metric) -> bool:
    """Whether a tablet with Windows has none, by its ``GetSystemMetrics``: a built-in touch screen, held as a slate, in no dock."""
    has_touch, is_laptop, is_docked = metric(94) & 1, metric(0x2003), metric(0x2004)
    return bool(has_touch) and not is_laptop and not is_docked
