"""The sheet that asks whether to trust a machine that is not known. Nothing is sent before the answer."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from kivy.properties import ObjectProperty, StringProperty
from kivy.uix.boxlayout import BoxLayout
from kivy.utils import escape_markup, get_hex_from_color

from app.i18n import _
from app.screens.settings.edit_sheet import SettingsSheet
from app.screens.settings.trust_view import Question, fours
from app.widgets.tokens import tk


def marked(number: str, other: str) -> str:
    """As markup: differing groups are underlined, in amber."""
    colour = get_hex_from_color(tk.attention)
    words = [
        f"[u][color={colour}]{escape_markup(group)}[/color][/u]" if differs else escape_markup(group)
        for group, differs in fours(number, other)
    ]
    return "\n".join("  ".join(words[n : n + 4]) for n in range(0, len(words), 4))


class TrustNumber(BoxLayout):
    """A serial number or fingerprint, with whose it is."""

    label = StringProperty()
    number = StringProperty()


class TrustSheet(SettingsSheet):
    """Lies over the sheet that asks; ``agreed()`` follows the risky answer, and nothing the safe one."""

    question = ObjectProperty(None, rebind=True)

    def __init__(self, question: Question, agreed: Callable[[], object], **kwargs: Any) -> None:
        self._agreed = agreed
        super().__init__(question=question, **kwargs)
        for label, number, other in (
            (_("{robot} so far").format(robot=question.robot), question.before, ""),
            (_("Answers now"), question.now, question.before),
        ):
            if number:
                self.ids.numbers.add_widget(TrustNumber(label=label, number=marked(number, other)))

    def on_done(self) -> None:
        self.stack.close(self)

    def on_other(self) -> None:
        self.stack.close(self)
        self._agreed()
