"""Fields of forms. All have a label, a help line and a ``problem``: one sentence that replaces the help and turns the frame red.

The line that is typed into is KivyMD's text field. Its own hint and helper text are not used: 12 sp, outside its bounds and over other
widgets, and on one line.
"""

import re

from kivy.base import EventLoop
from kivy.clock import Clock
from kivy.properties import (
    AliasProperty,
    BooleanProperty,
    NumericProperty,
    ObjectProperty,
    OptionProperty,
    StringProperty,
)
from kivy.uix.boxlayout import BoxLayout
from kivy.uix.textinput import TextInput
from kivymd.uix.textfield import MDTextField

from app.widgets.buttons import CommandButton
from app.widgets.dock import dock
from app.widgets.surfaces import SeenBox, Tap

# kind -> (input_type, signs on the number pad besides digits). Typed signs are never dropped: "1.5" would become 15.
KINDS = {
    "text": ("text", ""),
    "count": ("number", ""),
    "int": ("number", "-"),
    "decimal": ("number", "-."),
    "url": ("url", ""),
}


WHOLE = re.compile(r"[+-]?\d+")  # int() also takes 1_5, as 15


def whole_number(text: str) -> int:
    """Raises ValueError if ``text`` is not a whole number."""
    if WHOLE.fullmatch(text.strip()) is None:
        raise ValueError(text)
    return int(text)


def has_ended(touch) -> bool:
    """A page that scrolls forwards a short tap only after the finger has left."""
    return touch not in EventLoop.touches


class FieldInput(MDTextField):
    """The line of a field; ``max_length`` > 0 limits the characters, ``is_cut``: more were entered. ``error`` stays as it is set."""

    max_length = NumericProperty(0)
    signs = StringProperty()  # of a number: what the number pad offers besides digits, of "-."
    is_cut = BooleanProperty(False)
    leading = NumericProperty(0)  # px for an icon before the text
    trailing = NumericProperty(0)  # px for a button after it

    def __init__(self, **kwargs):
        self._follow_cursor = Clock.create_trigger(self._show_cursor, -1)
        self._entering = None  # uid of the touch by which a number is entered
        super().__init__(**kwargs)
        self.theme_cls.unbind(primary_palette=self.update_colors, theme_style=self.update_colors)  # never released

    def _not_used(self, *_):
        """KivyMD's moves a hint and colours a helper text that this field has not, and takes ``error`` back."""

    set_text = update_colors = on_error = on_disabled = _not_used
    _refresh_hint_text = TextInput._refresh_hint_text  # that KivyMD's has put out of use

    def _adjust_viewport(self, _column, _row):
        """All TextInputs share one trigger, which keeps the last one alive with the page or dialog around it."""
        self._follow_cursor()

    def _show_cursor(self, _dt):
        TextInput._adjust_viewport.__wrapped__(self, *self.cursor)

    def on_text(self, *_):
        if len(self.text) < self.max_length:
            self.is_cut = False

    def on_touch_down(self, touch):
        """A finger that rests may be about to scroll: it enters the field when it leaves."""
        if (
            self.focus
            or self.disabled
            or touch.is_mouse_scrolling
            or not self.collide_point(*touch.pos)
            or has_ended(touch)
        ):
            return self._enter(touch)
        touch.ud[self.uid] = "rests here"
        return True

    def on_touch_up(self, touch):
        if touch.grab_current is None and touch.ud.pop(self.uid, None) and self.collide_point(*touch.pos):
            return self._enter(touch)  # it gets the touch's end, too: it has grabbed it
        taken = super().on_touch_up(touch)
        if touch.grab_current is self and self._entering == touch.uid:
            self._entering = None
            self.select_all()  # after kivy has placed the cursor under the finger
        return taken

    def _enter(self, touch):
        """A tapped number is selected, so that typing replaces it. Another tap places the cursor in it."""
        was_focused = self.focus
        taken = super().on_touch_down(touch)
        self._entering = touch.uid if self.focus and not was_focused and self.input_type == "number" else None
        return taken

    def on_focus(self, _field, focused):
        (dock.entered if focused else dock.left)(self)

    def insert_text(self, substring, from_undo=False):
        if self.selection_text and not from_undo:
            self.delete_selection()
        if self.max_length and not from_undo:
            room = max(0, int(self.max_length) - len(self.text) + len(self.selection_text))
            self.is_cut = len(substring) > room
            substring = substring[:room]
        return super().insert_text(substring, from_undo)


class FieldBase(BoxLayout):
    """Label above, help or problem below."""

    label = StringProperty()
    help = StringProperty()
    problem = StringProperty()


class FormField(FieldBase):
    """A text field. ``on_commit(text)`` fires on Enter or when the field is left, if the text has changed.

    ``kind``: text, count (a whole number from 0), int, decimal, url. For numbers, too, any text can be typed: it is
    checked when it is saved. ``password`` hides the text; the eye button shows it.
    """

    text = StringProperty()
    hint = StringProperty()
    kind = OptionProperty("text", options=list(KINDS))
    password = BooleanProperty(False)
    shown = BooleanProperty(False)
    max_length = NumericProperty(0)
    input_type = StringProperty("text")
    signs = StringProperty()
    focus = BooleanProperty(False)

    __events__ = ("on_commit", "on_enter")

    def __init__(self, **kwargs):
        super().__init__(**kwargs)
        self._committed = self.text
        self.fbind("focus", self._focus_changed)

    def on_kind(self, *_):
        self.input_type, self.signs = KINDS[self.kind]

    def on_commit(self, text):
        """The text was changed and the field was left."""

    def on_enter(self):
        """Enter was pressed; ``on_commit`` fired before it if there was a change."""

    def show(self, text: str) -> None:
        """Set the text without ``on_commit``."""
        self.text = self._committed = text

    def commit(self):
        if self.text != self._committed:
            self._committed = self.text
            self.dispatch("on_commit", self.text)

    def entered(self):
        self.commit()
        self.dispatch("on_enter")

    def _focus_changed(self, *_):
        if self.focus:
            self._committed = self.text
        else:
            self.commit()


class SearchField(SeenBox):
    """A text field that filters a list while typing; bind ``text``. The cross clears it."""

    text = StringProperty()
    hint = StringProperty()
    focus = BooleanProperty(False)


class PickField(BoxLayout):
    """Label and value in a frame; a tap (``on_release``) opens a picker."""

    label = StringProperty()
    value = StringProperty("–")
    icon = StringProperty("chevron-down")
    problem = StringProperty()

    __events__ = ("on_release",)

    def on_release(self):
        """The field was tapped."""


class PickBox(Tap):
    """The tappable frame of a pick field."""

    faulty = BooleanProperty(False)


class RepeatButton(CommandButton):
    """Fires ``on_step`` when tapped and, while held, ten times a second."""

    __events__ = ("on_step",)

    def __init__(self, **kwargs):
        self._first = Clock.create_trigger(self._start_repeating, 0.5)
        self._again = Clock.create_trigger(self._step, 0.1, interval=True)
        super().__init__(**kwargs)

    def on_step(self):
        """Tapped, or held."""

    @property
    def keeps_drag(self) -> bool:
        """Only when it repeats: before that the finger may be about to scroll."""
        return bool(self._again.is_triggered)

    def on_press(self):
        self._first()

    def on_release(self):
        if not self.keeps_drag:
            self.dispatch("on_step")

    def on_touch_up(self, touch):
        is_mine = touch.grab_current is self
        taken = super().on_touch_up(touch)
        if is_mine:
            self._first.cancel()
            self._again.cancel()
        return taken

    def _start_repeating(self, _dt):
        if self.state == "down":
            self._again()
            self._step(0)

    def _step(self, _dt):
        if self.state != "down" or self.disabled:
            self._again.cancel()
            return
        self.dispatch("on_step")


class StepField(FieldBase):
    """A whole number between ``minimum`` and ``maximum``: minus button, text field, plus button. ``on_commit(value)``
    when it has changed.

    ``help`` should say the range: it turns red while the number is outside of it, and nothing is committed then; for
    other text it says that a whole number is needed. With ``optional`` an empty field means None. The buttons go to
    multiples of ``step``.
    """

    value = ObjectProperty(None, allownone=True)
    minimum = NumericProperty(0)
    maximum = NumericProperty(100)
    step = NumericProperty(1)
    unit = StringProperty()
    hint = StringProperty("–")
    optional = BooleanProperty(False)
    outside = BooleanProperty(False)  # the text is not a number of the range
    is_number = BooleanProperty(True)  # the text is empty or a whole number
    text = StringProperty()
    focus = BooleanProperty(False)

    __events__ = ("on_commit",)

    def __init__(self, **kwargs):
        super().__init__(**kwargs)
        self.fbind("value", self._value_changed)
        self.fbind("disabled", self.show)  # a field that can't be changed has no problem
        self.fbind("focus", self._focus_changed)
        for name in ("text", "minimum", "maximum", "optional"):
            self.fbind(name, self._validate)
        self.show()

    def on_commit(self, value):
        """The value was changed to another valid one."""

    def _number(self) -> int | None:
        """The number in the field, None if it is empty and ``optional``. Raises ValueError if it is not a number of the
        range."""
        if not self.text.strip() and self.optional:
            return None
        number = whole_number(self.text)
        if not self.minimum <= number <= self.maximum:
            raise ValueError(number)
        return number

    def _validate(self, *_):
        self.is_number = not self.text.strip() or WHOLE.fullmatch(self.text.strip()) is not None
        try:
            self._number()
            self.outside = False
        except ValueError:
            self.outside = True

    def _value_changed(self, *_):
        """None, for a text that is not a number, is what the text says already."""
        if self.value is not None or self.is_number:
            self.show()

    def show(self, *_):
        """The value, in place of what was typed."""
        self.text = "" if self.value is None else str(int(self.value))
        self._validate()

    def _focus_changed(self, *_):
        if not self.focus:
            self.commit()

    def commit(self):
        """Take over the number in the field; one outside the range stays red."""
        if self.outside:
            return
        number = self._number()
        if number != self.value:
            self.value = number
            self.dispatch("on_commit", number)
        self.show()  # "007" is taken as 7

    def nudge(self, direction: int):
        """One step up (1) or down (-1), within the range; from an empty field to the minimum or maximum."""
        step = int(self.step) or 1
        try:
            number = self._number()
        except ValueError:
            number = self.value
        if number is None:
            new = int(self.minimum if direction > 0 else self.maximum)
        else:
            new = (number // step + 1) * step if direction > 0 else (-(-number // step) - 1) * step
            new = min(int(self.maximum), max(int(self.minimum), new))
        self.text = str(new)
        self.commit()

    def _unit_text(self):
        return f"{self.label} ({self.unit})" if self.unit and self.label else self.label or self.unit

    heading = AliasProperty(_unit_text, None, bind=("label", "unit"))
