"""Text and icons. The sizes (Body, Note, Title …) are kv classes in tokens.kv."""
from kivy.metrics import dp
from kivy.properties import BooleanProperty, NumericProperty, StringProperty
from kivy.uix.boxlayout import BoxLayout
from kivy.uix.label import Label
from kivymd.icon_definitions import md_icons


class Txt(Label):
    """One text, never cut to "…".

    ``fit`` False: takes the width it is given and wraps. True: is as wide as its text, and wraps only beyond ``max_width`` (0 = never).
    Either way it is as high as its lines, whatever the font scale.
    """
    fit = BooleanProperty(False)
    max_width = NumericProperty(0)

    def __init__(self, **kwargs):
        super().__init__(**kwargs)
        for name in ("fit", "max_width", "text", "font_size", "font_name", "markup"):
            self.fbind(name, self._mode)
        self.fbind("width", self._wrap)
        self.fbind("texture_size", self._resize)
        self._mode()

    def _mode(self, *_):
        if not self.fit:
            self.size_hint_y = None
            self._wrap()
            return
        self.size_hint = None, None
        self.pos_hint = self.pos_hint or {"center_y": .5}
        self.text_size = None, None
        if self.max_width > 0:
            self.texture_update()
            if self.texture_size[0] > self.max_width:
                self.text_size = self.max_width, None
        self._resize()

    def _wrap(self, *_):
        """Until the layout has given room for a word or so, the text counts as one line: a list must not jump through heights."""
        if not self.fit:
            self.text_size = (self.width if self.width > dp(24) else None), None
            self._resize()

    def _resize(self, *_):
        if self.fit:
            self.size = self.texture_size
        else:
            self.height = self.texture_size[1]


class Ico(Label):
    """One Material Design icon by name; an unknown name raises ``KeyError``: it must not become a blank."""
    icon = StringProperty("")

    def on_icon(self, *_):
        self.text = md_icons[self.icon] if self.icon else ""


class Lines(BoxLayout):
    """Texts under each other, as high as they are, centred in their row."""
