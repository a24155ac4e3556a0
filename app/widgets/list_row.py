"""The one row of all lists: a time at the left, an icon, a title and what supports it, columns, buttons."""

from kivy.metrics import dp
from kivy.properties import BooleanProperty, NumericProperty, ObjectProperty, StringProperty
from kivymd.icon_definitions import md_icons
from kivymd.uix.boxlayout import MDBoxLayout

from app.widgets.buttons import CommandButton, IconButton
from app.widgets.children import refill
from app.widgets.items import Item
from app.widgets.lists import Row, RowPress
from app.widgets.shapes import Colour
from app.widgets.surfaces import CLEAR, Tap
from app.widgets.text import Ico
from app.widgets.tokens import tk


class RowMark(Ico):
    """An icon, on a disc if it is a ``disc``; a ``number`` in a ring; a box to tick."""

    number = StringProperty()

    def on_icon(self, *_):
        self.text = self.number or (md_icons[self.icon] if self.icon else "")

    on_number = on_icon


class RowButton(RowPress, CommandButton):
    """A button with a word."""


class RowIcon(RowPress, IconButton):
    """A button with an icon only."""


class RowActions(MDBoxLayout):
    """The buttons of a row; they stay while only their words change."""

    actions = ObjectProperty(())
    row = ObjectProperty(None, allownone=True)
    over = BooleanProperty(False)  # on a tinted row
    shared = BooleanProperty(False)  # equal buttons that share the width

    def on_actions(self, *_):
        kinds = [RowButton if action.text else RowIcon for action in self.actions]
        for button, action in zip(refill(self, kinds, lambda kind: kind()), self.actions, strict=True):
            self._show(button, action)

    on_over = on_actions

    def _show(self, button, action):
        button.name, button.disabled, button.over_solid = action.name, bool(action.off), self.over
        button.tone = action.tone if action.tone != "neutral" or not self.over else self.row.item.tone
        button.icon = action.icon
        if action.text:
            button.text, button.style, button.fit = action.text, action.style or "outlined", not self.shared
        else:
            button.style = action.style or "standard"


class ListRow(Row, Tap):
    """Shows ``item``. A tap is the action "open", the switch "switch" (with the wanted state), a button its name (with the button, so that
    a menu can hang on it).

    A list sets its columns in kv (``<RunRow@ListRow>:``): ``least`` is the height of a row, ``lead_width`` the width for times, and
    ``who_width``, ``place_width`` and ``meta_width`` those of the columns, all in px; 0: as wide as the text, and no column for who and
    place. A ``folded`` row has place and meta in the line of its support.
    """

    item = ObjectProperty(Item(None), rebind=True)
    least = NumericProperty("56dp")
    lead_width = NumericProperty(0)
    who_width = NumericProperty(0)
    place_width = NumericProperty(0)
    meta_width = NumericProperty(0)
    folded = BooleanProperty(False)

    def take(self, data):
        super().take(data)
        self.can_press = data.opens and data.look != "head"

    def supporting(self, item, folded: bool, place_width: float) -> str:
        """The text below the title."""
        parts = (item.place if folded or not place_width else "", item.support, item.at_right if folded else "")
        return " · ".join(part for part in parts if part)

    # ------------------------------------------------------------------ colours, when the item or the theme has changed
    def ink(self, tone: str, usual: str, item: Item, *_theme) -> Colour:
        """The colour of a text: that of its ``tone``, or the ``usual`` one, on the row's background."""
        if item.look == "chosen":
            return tk.accent_on
        if item.look == "tint":
            return getattr(tk, item.tone + "_on")
        return tk.disabled if item.look == "faint" else getattr(tk, tone if tone not in ("", "neutral") else usual)

    def back(self, item: Item, *_theme) -> Colour:
        fills = {"chosen": tk.accent_bg, "tint": getattr(tk, item.tone + "_bg"), "head": tk.surface2}
        return fills.get(item.look, CLEAR)

    def edge_of(self, item: Item, *_theme) -> Colour:
        """The line at the left edge."""
        return getattr(tk, item.tone + "_solid") if item.edge else CLEAR

    def icon_of(self, item: Item) -> str:
        return ("check" if item.ticked else "") if item.ticked is not None else item.icon

    def mark_size(self, item: Item) -> tuple[float, float]:
        side = dp(40) if item.disc else dp(28) if item.icon or item.number or item.ticked is not None else 0
        return side, side

    def mark_ink(self, item: Item, *_theme) -> Colour:
        if item.ticked or (item.disc and item.loud):
            return tk.amber_ink if item.disc and item.tone == "attention" else tk.solid_ink
        return getattr(tk, item.tone + "_on") if item.disc else self.ink(item.tone, "ink2", item)

    def mark_fill(self, item: Item, *_theme) -> Colour:
        if item.disc:
            return getattr(tk, item.tone + ("_solid" if item.loud else "_bg"))
        return tk.accent_solid if item.ticked else CLEAR

    def mark_edge(self, item: Item, *_theme) -> Colour:
        if item.ticked is None and not item.number:
            return getattr(tk, item.tone) if item.disc and tk.strong else CLEAR
        return tk.accent_solid if item.ticked else self.ink("", "outline", item)
