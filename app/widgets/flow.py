"""Chips that flow from left to right and wrap, and the fields that a mission's parameters need."""

from collections.abc import Mapping
from functools import partial
from typing import Any

from kivy.properties import ListProperty, NumericProperty, ObjectProperty, StringProperty
from kivy.uix.boxlayout import BoxLayout
from kivy.uix.stacklayout import StackLayout

from app.widgets.around import around
from app.widgets.buttons import ChoiceChip
from app.widgets.children import refill
from app.widgets.choices import ChoiceSheet
from app.widgets.events import Fires, Late
from app.widgets.fields import Field
from app.widgets.items import Option
from app.widgets.sheet import Sheet

FINE = 50  # with up to this many numbers a step is 1, with more 5


class ChipFlow(Fires, Late, StackLayout):
    """``data`` have ``key``, ``text``, ``icon`` with its ``tone``, and ``selected``; a tap fires ``on_choose(key)``. As high as its
    rows; ``whole_width`` px would be one row."""

    data = ListProperty()
    whole_width = NumericProperty(0)

    __events__ = ("on_choose",)

    def on_width(self, *_):
        for chip in self.children:
            chip.limit = self.width

    def on_data(self, *_):
        for chip, option in zip(refill(self, [option.key for option in self.data], self._chip), self.data, strict=True):
            chip.text, chip.icon, chip.tone, chip.active = option.text, option.icon, option.tone, option.selected
        self._measure()

    def _chip(self, key):
        chip = ChoiceChip(limit=self.width, on_release=lambda _chip: self.dispatch("on_choose", key))
        chip.fbind("width", self._measure)
        return chip

    def _measure(self, *_):
        self.whole_width = sum(chip.width + self.spacing[0] for chip in self.children)


class ChoiceRow(BoxLayout):
    """A label above chips with one chosen: ``chosen`` is its key."""

    label = StringProperty()
    problem = StringProperty()
    options = ListProperty()  # [(key, word), …]
    chosen = ObjectProperty(None, allownone=True)

    def chips(self, options, chosen):
        return [Option(key, word, selected=key == chosen) for key, word in options]


class ChoiceField(Field):
    """A choice of many, in a list that can be searched: ``chosen`` is its key."""

    options = ListProperty()  # [(key, word), …]
    chosen = ObjectProperty(None, allownone=True)

    def word_of(self, options, chosen):
        return next((word for key, word in options if key == chosen), "–")

    def on_release(self):
        options = [Option(*option) for option in self.options]
        picker = ChoiceSheet(title=self.label, options=options, selected=[] if self.chosen is None else [self.chosen])
        next(around(self, Sheet)).stack.pick(picker, partial(setattr, self, "chosen"))


CHOICES = {"choice": ChoiceRow, "list": ChoiceField}


class ParameterFields(Fires, Late, BoxLayout):
    """One field per parameter: ``fields`` have ``name``, ``label``, ``kind`` (text, int, count, steps, decimal, choice,
    list), ``default``, ``help``, ``choices`` [(value, word), …] and ``limits`` of steps (from, to);
    ``problems`` is one sentence by name where something can't be used. ``values()`` are the
    entered values, and ``on_entered(values)`` reports them after each change; ``missing`` says in kv's words what has
    to be entered first, and is empty when nothing is missing."""

    fields = ListProperty()
    problems = ObjectProperty({}, force_dispatch=True)
    missing = StringProperty()
    choose_first = StringProperty("{field}")
    enter_first = StringProperty("{field}")

    __events__ = ("on_entered",)

    _views: Mapping[str, Field | ChoiceRow] = {}

    def on_fields(self, *_):
        """If one of them has the focus, its successor gets it."""
        typing = next((name for name, view in self._views.items() if getattr(view, "focus", False)), None)
        self.clear_widgets()
        self._views = {}
        for field in self.fields:
            if field.kind in CHOICES:
                view = CHOICES[field.kind](label=field.label, options=field.choices, chosen=field.default)
            elif field.kind == "steps":
                low, high = field.limits
                view = Field(
                    kind="step",
                    label=field.label,
                    help=field.help,
                    minimum=low,
                    maximum=high,
                    step=1 if high - low <= FINE else 5,
                    optional=True,
                )
                view.text = (
                    "" if field.default is None else str(field.default)
                )  # also one that can't be: it stays as typed
                view.commit()
            else:
                view = Field(
                    label=field.label,
                    kind=field.kind,
                    help=field.help,
                    text="" if field.default is None else str(field.default),
                )
            view.fbind("chosen" if field.kind in CHOICES else "text", self._entered)
            self._views[field.name] = view
            self.add_widget(view)
        self._look_for_empty()
        if hasattr(self._views.get(typing), "focus"):
            self._views[typing].focus = True

    def _entered(self, view, _value):
        view.problem = ""  # of what was there before
        self._look_for_empty()
        self.dispatch("on_entered", self.values())

    def _look_for_empty(self, *_):
        values = self.values()
        empty = next(
            (
                field
                for field in self.fields
                if not str("" if values[field.name] is None else values[field.name]).strip()
            ),
            None,
        )
        self.missing = (
            ""
            if empty is None
            else (self.choose_first if empty.kind in CHOICES else self.enter_first).format(field=empty.label)
        )

    on_choose_first = on_enter_first = _look_for_empty

    def values(self) -> Mapping[str, Any]:
        """Name -> entered value: typed text, or the value of the choice."""
        return {name: view.chosen if hasattr(view, "chosen") else view.text for name, view in self._views.items()}

    def on_problems(self, *_):
        for name, view in self._views.items():
            view.problem = self.problems.get(name, "")
