"""Text and icons, and the classes of each size of text: Body, Note, Title …"""

import re

from kivy.core.text import Label as CoreLabel
from kivy.metrics import dp
from kivy.properties import BooleanProperty, NumericProperty, ObjectProperty, OptionProperty, StringProperty
from kivymd.icon_definitions import md_icons
from kivymd.uix.boxlayout import MDBoxLayout
from kivymd.uix.label import MDIcon, MDLabel

SEAM = re.compile(r"(?<=[/@._-])(?=.)|(?=:\d)")  # where an address, a path or a file name may break
JOINT = re.compile(
    r"(?<=\d) (?=(?:s|min|h|d|pv|%|m|km|m/s)(?![\w/]))| (?=…)"
)  # between a number and its unit, before dots: no line ends

LEAST = 14  # dp, of letters that got smaller
SEEN = 2.5  # characters in the width of an em: on average there are two


class Txt(MDLabel):
    """A label that shows all of its text, unless ``most_lines`` > 0 says how many lines there may be: the last one then
    ends with "…".

    ``fit`` False: it gets its width from the layout and wraps. True: it is as wide as its text, at least
    ``least_width``, and wraps only beyond ``max_width`` (0: never). Either way it is as high as its ``lines``, at any
    font scale. A word wider than a line breaks before its port, after a slash and the like; without such a place all
    letters get smaller, and only where even the smallest are too wide it breaks anywhere. A number is never separated
    from its unit, or "…" from the word before it.
    """

    fit = BooleanProperty(False)
    max_width = NumericProperty(0)
    least_width = NumericProperty(0)
    most_lines = NumericProperty(0)
    lines = NumericProperty(0)  # that are shown
    font_name = StringProperty("Roboto")
    font_size = NumericProperty("16sp")  # a string, so that kivy follows the font scale live
    pos_hint = ObjectProperty({"center_y": 0.5})  # where it stands in a row
    halign = OptionProperty("left", options=["left", "center", "right", "justify", "auto"])
    valign = OptionProperty("middle", options=["bottom", "middle", "center", "top"])

    def __init__(self, **kwargs):
        super().__init__(**kwargs)
        mode = self._mode  # one method for all: each access makes another
        for name in ("fit", "max_width", "least_width", "text", "font_size", "font_name", "markup"):
            self.fbind(name, mode)
        self.fbind("most_lines", self._trigger_texture)
        self.fbind("width", self._wrap)
        self.fbind("texture_size", self._resize)
        self._mode()

    def _mode(self, *_):
        if not self.fit:
            self.size_hint_y = None
            self._wrap()
            return
        self.size_hint = None, None
        self.text_size = None, None
        if self.max_width > 0 or self.least_width > 0:
            self.texture_update()
            width = self.texture_size[0]
            if width > self.max_width > 0 or width < self.least_width:
                self.text_size = (self.least_width if width < self.least_width else self.max_width), None
        self._resize()

    def _wrap(self, *_):
        """One line until the layout has set a usable width: else list rows would briefly have wrong heights."""
        if not self.fit:
            self.text_size = (self.width if self.width > dp(24) else None), None
            self._resize()

    def _resize(self, *_):
        if self.fit:
            self.size = self.texture_size
        else:
            self.height = self.texture_size[1]

    def texture_update(self, *args):
        """Kivy breaks words that are too wide at any character, and leaves lines out without a sign."""
        width = self.text_size[0]
        if not self.markup:
            self._label.options["font_size"] = self.font_size
            self._label.text = self._broken(width) if width else self.text
        super().texture_update(*args)
        self.lines = len(self._label._cached_lines)

    def _broken(self, width) -> str:
        """The text with line breaks where kivy's would be wrong, cut after enough lines."""
        if not self.most_lines:
            return self._seamed(self.text, width)
        room = int(SEEN * (self.most_lines + 2) * width / self.font_size)
        text = self._seamed(self.text[:room], width)
        lines = self._lines_of(text)
        if len(self.text) > room and len(lines) < self.most_lines + 2:  # very narrow characters: more of them are seen
            text = self._seamed(self.text, width)
            lines = self._lines_of(text)
        if len(lines) > self.most_lines:
            lines = lines[: int(self.most_lines)]
            text = "\n".join([*lines[:-1], self._shortened(lines[-1], width)])
        return text

    def _lines_of(self, text) -> list[str]:
        self._label.text = text
        self._label.render()
        return ["".join(word.text for word in line.words) for line in self._label._cached_lines]

    def _seamed(self, text, width) -> str:
        text = JOINT.sub("\N{NO-BREAK SPACE}", text)
        if (
            max(map(len, text.split()), default=0) * self.font_size > width
        ):  # else no word is too wide: don't measure them
            self._label.resolve_font_name()
            self._shrink([piece for word in text.split() for piece in SEAM.split(word)], width)
            text = re.sub(r"\S+", lambda word: self._break_word(word[0], width), text)
        return text

    def _shrink(self, pieces, width) -> None:
        """Take the largest letters with which no piece is wider than a line, if there are any."""
        size = self._label.options["font_size"]
        while pieces and self._label.options["font_size"] >= dp(LEAST):
            pieces = [piece for piece in pieces if self._label.get_extents(piece)[0] > width]
            self._label.options["font_size"] -= 1 if pieces else 0
        if pieces:
            self._label.options["font_size"] = size

    def _break_word(self, word, width) -> str:
        if self._label.get_extents(word)[0] <= width:
            return word
        lines = [""]
        for piece in SEAM.split(word):
            if lines[-1] and self._label.get_extents(lines[-1] + piece)[0] > width:
                lines.append("")
            lines[-1] += piece
        return "\n".join(lines)

    def _shortened(self, line, width) -> str:
        while line and self._label.get_extents(line + "…")[0] > width:
            line = line[:-1]
        return line.rstrip() + "…"


def line_width(text: str, font_name: str, font_size: float) -> float:
    """Width in px of ``text`` on one line; ``font_size`` in px."""
    label = CoreLabel(font_name=font_name, font_size=font_size)
    label.resolve_font_name()
    return label.get_extents(text)[0]


def _size(name: str, size: int, strong: bool = True) -> type[Txt]:
    """The class ``name`` of texts of ``size`` sp."""
    font = StringProperty("RobotoMedium" if strong else "Roboto")
    return type(Txt)(name, (Txt,), {"font_name": font, "font_size": NumericProperty(f"{size}sp")})


Note, NoteStrong = _size("Note", 14, strong=False), _size("NoteStrong", 14)
Body, BodyStrong = _size("Body", 16, strong=False), _size("BodyStrong", 16)
Large, Title = _size("Large", 18, strong=False), _size("Title", 18)
BigValue, ScreenTitle = _size("BigValue", 24), _size("ScreenTitle", 24)
Kpi = _size("Kpi", 40)


class Ico(MDIcon):
    """One Material Design icon by name; an unknown name raises ``KeyError`` instead of showing nothing."""

    icon = StringProperty("")
    font_name = StringProperty("Icons")
    font_size = NumericProperty("24dp")
    pos_hint = ObjectProperty({"center_y": 0.5})
    halign = OptionProperty("center", options=["left", "center", "right", "justify", "auto"])
    valign = OptionProperty("middle", options=["bottom", "middle", "center", "top"])

    def on_icon(self, *_):
        self.text = md_icons[self.icon] if self.icon else ""


class Lines(MDBoxLayout):
    """Texts below each other, as high as their sum, vertically centred in a row."""
