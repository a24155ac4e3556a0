"""Text and icons. The sizes (Body, Note, Title …) are kv classes in tokens.kv."""
from kivy.metrics import dp
from kivy.properties import BooleanProperty, NumericProperty, StringProperty
from kivy.uix.boxlayout import BoxLayout
from kivy.uix.label import Label
from kivymd.icon_definitions import md_icons


class Txt(Label):
    """A label whose text is never shortened to "…".

    ``fit`` False: it gets its width from the layout and wraps. True: it is as wide as its text, and wraps only beyond ``max_width``
    (0: never). Either way it is as high as its lines, whatever the font scale.
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
        """One line until the layout has set a usable width: else rows of lists would pass through wrong heights."""
        if not self.fit:
            self.text_size = (self.width if self.width > dp(24) else None), None
            self._resize()

    def _resize(self, *_):
        if self.fit:
            self.size = self.texture_size
        else:
            self.height = self.texture_size[1]


class Ico(Label):
    """One Material Design icon by name; an unknown name raises ``KeyError`` instead of showing nothing."""
    icon = StringProperty("")

    def on_icon(self, *_):
        self.text = md_icons[self.icon] if self.icon else ""


class Lines(BoxLayout):
    """Texts below each other, as high as their sum, vertically centred in a row."""
