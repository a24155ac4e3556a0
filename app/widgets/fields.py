"""Fields of forms, and the field that searches a list.

The line that is typed into is KivyMD's text field. Its own hint and helper text are not used: 12 sp, outside its bounds and over other
widgets, and on one line.
"""

import re

from kivy.base import EventLoop
from kivy.clock import Clock
from kivy.factory import Factory
from kivy.properties import (
    BooleanProperty,
    NumericProperty,
    ObjectProperty,
    OptionProperty,
    StringProperty,
)
from kivy.uix.boxlayout import BoxLayout
from kivy.uix.floatlayout import FloatLayout
from kivy.uix.textinput import TextInput
from kivymd.uix.textfield import MDTextField

from app.domain import writing
from app.widgets.around import around
from app.widgets.dock import dock
from app.widgets.events import Fires
from app.widgets.places import places
from app.widgets.scrolling import CalmScroll, turn_to
from app.widgets.slots import PartSlot
from app.widgets.surfaces import OnlySeen, Tap

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

    stands = True

    def __init__(self, **kwargs):
        self._follow_cursor = Clock.create_trigger(self._show_cursor, -1)
        self._entering = None  # uid of the touch by which a number is entered
        super().__init__(**kwargs)
        places.watch(self)
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
        if places.misses(self, touch):
            return True
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


class FieldHelp(PartSlot):
    """Help, or what is ``faulty``: then the first such on its page comes in sight, with what it is about."""

    text = StringProperty()
    faulty = BooleanProperty(False)

    def on_text(self, *_):
        if self.text and self.faulty:
            Clock.schedule_once(self._bring_in_sight, 0.05)  # once it has its height

    on_faulty = on_text

    def _bring_in_sight(self, _dt):
        page = next(around(self, CalmScroll), None)
        if page is None:
            return
        helps = (each for each in page.walk(restrict=True) if isinstance(each, FieldHelp))
        if first := next((each for each in helps if each.text and each.faulty), None):
            turn_to(first.parent)
            turn_to(first)  # as that may be higher than the page


class Field(Fires, BoxLayout):
    """A field of a form, with its label on the outline; ``problem`` is one sentence that replaces the ``help`` and turns the outline red.

    ``kind``: text, url, count (a whole number from 0), int and decimal are typed; any text can be, as it is checked when it is saved. A
    ``pick`` shows its ``value``, and a tap is ``on_release``. A ``step`` is a whole number from ``minimum`` to ``maximum`` between two
    buttons, which lead to multiples of ``step``; while the number is outside of the range it is red and its ``help``, or else the range, is
    below it. With ``optional`` an empty one means None.

    ``on_commit`` fires on Enter or when the field is left, with the text, or the number of a step, if that has changed and is in the range;
    ``on_enter`` after it. ``password`` hides the text; the eye shows what was typed.
    """

    kind = OptionProperty("text", options=[*KINDS, "pick", "step"])
    label = StringProperty()
    help = StringProperty()
    problem = StringProperty()
    text = StringProperty()
    hint = StringProperty()
    value = ObjectProperty(None, allownone=True)
    icon = StringProperty("menu-down")  # of a pick
    password = BooleanProperty(False)
    shown = BooleanProperty(False)
    max_length = NumericProperty(0)
    focus = BooleanProperty(False)
    minimum = NumericProperty(0)
    maximum = NumericProperty(100)
    step = NumericProperty(1)
    unit = StringProperty()
    optional = BooleanProperty(False)
    outside = BooleanProperty(False)  # the text is not a number of the range
    is_number = BooleanProperty(True)  # the text is empty or a whole number
    is_cut = BooleanProperty(False)

    __events__ = ("on_commit", "on_enter", "on_release")

    def __init__(self, **kwargs):
        super().__init__(**kwargs)
        self._committed = self.text
        self.bind(
            focus=self._focus_changed,
            value=self._value_changed,
            disabled=self._value_changed,  # a field that can't be changed has no problem
            text=self._validate,
            minimum=self._validate,
            maximum=self._validate,
            optional=self._validate,
        )

    def on_kv_post(self, _base):
        """Before, its kind is not known; afterwards it stays."""
        line = {"pick": "FieldPick", "step": "FieldStep"}.get(self.kind, "FieldLine")
        self.ids.line.add_widget(Factory.get(line)(card=self))
        self._value_changed()

    @property
    def signs(self) -> str:
        """What the number pad offers besides digits."""
        return ("-" if self.minimum < 0 else "") if self.kind == "step" else KINDS.get(self.kind, ("", ""))[1]

    @property
    def input_type(self) -> str:
        return "number" if self.kind == "step" else KINDS[self.kind][0]

    def show(self, text: str) -> None:
        """Set the text without ``on_commit``."""
        self.text = self._committed = text

    def commit(self):
        """Take over what is in the field; a number outside the range stays red."""
        if self.kind == "step":
            if not self.outside and (number := self._number()) != self.value:
                self.value = number
                self.dispatch("on_commit", number)
            if not self.outside:
                self._show_value()  # "007" is taken as 7
        elif self.text != self._committed:
            self._committed = self.text
            self.dispatch("on_commit", self.text)

    def entered(self):
        self.commit()
        self.dispatch("on_enter")

    def _focus_changed(self, *_):
        if not self.focus:
            self.commit()
        elif self.kind != "step":
            self._committed = self.text

    # ------------------------------------------------------------------ steps
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
        if self.kind != "step":
            return
        self.is_number = not self.text.strip() or WHOLE.fullmatch(self.text.strip()) is not None
        try:
            self._number()
            self.outside = False
        except ValueError:
            self.outside = True

    def _value_changed(self, *_):
        """None, for a text that is not a number, is what the text says already."""
        if self.kind == "step" and (self.value is not None or self.is_number or self.disabled):
            self._show_value()

    def _show_value(self):
        self.text = "" if self.value is None else str(int(self.value))
        self._validate()

    def grouped(self, text: str, gettext) -> str:
        """The number that ``text`` says, to be read; another text as it is."""
        return writing.count(whole_number(text), gettext) if WHOLE.fullmatch(text.strip()) else text

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


class FieldPart(FloatLayout):
    """The line of one kind of field, ``card``."""

    card = ObjectProperty(None, rebind=True)
    label = ObjectProperty(None, rebind=True)
    lift = NumericProperty(0)  # px by which the label rises above the outline
    is_narrow = BooleanProperty(False)


class SearchField(OnlySeen, BoxLayout):
    """A text field that filters a list while typing; bind ``text``. The cross clears it."""

    text = StringProperty()
    hint = StringProperty()
    focus = BooleanProperty(False)


class SlotSearch(SearchField):
    """One in a slot. Its opening gives it the focus; a restored search does not. ``card`` is the slot's."""

    card = ObjectProperty(None, allownone=True, rebind=True)

    def on_kv_post(self, _base):
        self.focus = not self.text


class PickBox(Tap):
    """The tappable frame of a pick field."""

    faulty = BooleanProperty(False)
