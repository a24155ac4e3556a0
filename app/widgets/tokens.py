"""Design tokens: all colours of the app, and the sizes that depend on the glove mode.

Colours are properties of ``tk`` so that kv binds to them (``tk.ink``) and a switch repaints live. ``apply_theme`` gives the same
colours to KivyMD's own widgets. Sizes that never change are constants of tokens.kv. ``tk`` is global, because kv needs a name for it;
nothing but the appearance depends on it.
"""

from collections.abc import Callable
from weakref import WeakMethod

from kivy.event import EventDispatcher
from kivy.lang.parser import global_idmap
from kivy.metrics import Metrics, dp
from kivy.properties import BooleanProperty, ColorProperty, NumericProperty, OptionProperty

from app.domain.models import THEMES

TONES = ("fault", "attention", "action", "done", "neutral", "offline", "accent")

# name: (light, dark, high contrast)
COLOURS = {
    # surfaces, from the back to the front
    "bg": ("#EDF0F3", "#0D1317", "#FFFFFF"),
    "surface": ("#FFFFFF", "#171F25", "#FFFFFF"),
    "surface2": ("#F3F5F8", "#1F2930", "#FFFFFF"),
    "scrim": ("#0B141A8C", "#000000A6", "#000000B3"),
    # lines: hairline is decoration, outline is the border of a control (3:1)
    "line": ("#DBE1E7", "#2A353E", "#000000"),
    "outline": ("#76838F", "#7C8A96", "#000000"),
    # text: all three reach 4.5:1 on every surface (7:1 in high contrast)
    "ink": ("#101C25", "#E9EEF2", "#000000"),
    "ink2": ("#44525F", "#B6C2CC", "#000000"),
    "ink3": ("#586673", "#9AA8B4", "#262626"),
    "disabled": ("#818D98", "#66737E", "#595959"),
    # the one accent: petrol
    "accent": ("#0B5A6B", "#7FD0DE", "#003F4D"),
    "accent_ink": ("#FFFFFF", "#00343E", "#FFFFFF"),
    "accent_bg": ("#D8EBEF", "#123F4A", "#003F4D"),
    "accent_on": ("#063C49", "#C9F0F6", "#FFFFFF"),
    "accent_solid": ("#0B5A6B", "#1A7F91", "#003F4D"),  # a filled button: never the brightest area of a dark screen
    "accent_mid": ("#3E8494", "#4A98A6", "#1F6B7A"),  # large areas of data
    "accent_soft": ("#A9CDD5", "#2D6470", "#6D9DA3"),
    # states: <s> on a surface, <s>_bg tint, <s>_on text on the tint, <s>_solid for the loudest use
    "fault": ("#B3261E", "#FF9E94", "#8A0000"),
    "fault_bg": ("#FCE6E3", "#4B1814", "#8A0000"),
    "fault_on": ("#7F1610", "#FFDAD5", "#FFFFFF"),
    "fault_solid": ("#B3261E", "#CF3A2F", "#8A0000"),
    "attention": ("#8F5600", "#FFC04D", "#5A3500"),
    "attention_bg": ("#FFEFD2", "#3E2E08", "#FFC400"),
    "attention_on": ("#5E3800", "#FFE2AD", "#000000"),
    "attention_solid": ("#F0A30A", "#FFB52E", "#FFC400"),
    "action": ("#1D4ED8", "#AABDFF", "#00309C"),
    "action_bg": ("#E3EAFF", "#182757", "#00309C"),
    "action_on": ("#173A9E", "#DDE5FF", "#FFFFFF"),
    "action_solid": ("#1D4ED8", "#3F64D9", "#00309C"),
    "done": ("#1A7440", "#7FD59A", "#00491D"),
    "done_bg": ("#E0F2E6", "#12371F", "#00491D"),
    "done_on": ("#0F5229", "#C6F0D2", "#FFFFFF"),
    "done_solid": ("#1A7440", "#1F7D45", "#00491D"),
    "neutral": ("#44525F", "#B6C2CC", "#000000"),
    "neutral_bg": ("#E8ECF0", "#28333B", "#FFFFFF"),
    "neutral_on": ("#2E3B47", "#D8E0E7", "#000000"),
    "neutral_solid": ("#5B6976", "#626F7B", "#262626"),
    "offline": ("#586673", "#9AA8B4", "#262626"),
    "offline_bg": ("#E8ECF0", "#222C33", "#FFFFFF"),
    "offline_on": ("#3B4854", "#C2CDD6", "#262626"),
    "offline_solid": ("#66727D", "#66737E", "#595959"),
    # text on the solid tones
    "solid_ink": ("#FFFFFF", "#FFFFFF", "#FFFFFF"),
    "amber_ink": ("#241700", "#241700", "#000000"),
    # the bar that reports what was done
    "snack": ("#22303A", "#DCE4EA", "#000000"),
    "snack_ink": ("#FFFFFF", "#14202A", "#FFFFFF"),
    "snack_accent": ("#9ADBE6", "#0B5A6B", "#9FE8F4"),
    # charts and map: data is the accent, the rest stays grey
    "track": ("#E1E6EB", "#28333B", "#D0D0D0"),
    "grid": ("#E4E9ED", "#25303A", "#B0B0B0"),
    "overlap": ("#F0A30A", "#FFB52E", "#5A3500"),  # hatch over attention_bg
    "closed": ("#EEF1F4", "#141B20", "#FFFFFF"),
    "hatch": ("#D3DAE1", "#2B3740", "#8C8C8C"),
    "map_floor": ("#FFFFFF", "#26313A", "#FFFFFF"),
    "map_wall": ("#5B6976", "#8A98A4", "#000000"),
}

GLOVES = 1.25  # with gloves everything is so much larger, as far as a window of LEAST dp is left
LEAST = 1024, 600
TARGETS = {"h_foot": (72, 96), "h_touch": (48, 56)}  # name: (bare hands, gloves) in dp

# what all kv knows by these names, in dp
SPACES = {
    "MARGIN": 24,
    "GAP": 16,
    "PAD": 16,
    **{f"S{n}": n for n in (4, 8, 12, 16, 24)},
    "R_CARD": 12,
    "R_CTRL": 12,
    "R_CHIP": 8,
    "R_FIELD": 4,
    "R_PILL": 999,
    "H_TOP": 64,
    "H_LOW": 640,  # a lower window has no height to spare
}


def late_color(default) -> ColorProperty:
    """A colour property that dispatches whenever it is set, even to the value it has.

    A label on a dark background has two kv rules for its ``color``: that of its class (``tk.ink``) and its own. The
    last one dispatched wins, so after a switch of the theme an unchanged colour must be dispatched again, after
    ``tk.ink``.
    """
    return ColorProperty(default, force_dispatch=True)


Colours = type("Colours", (EventDispatcher,), {name: late_color(light) for name, (light, _, _) in COLOURS.items()})


class Tokens(Colours):
    """The present appearance. ``use`` switches it; kv rules that read a token are updated."""

    theme = OptionProperty("light", options=THEMES)
    gloves = BooleanProperty(False)
    strong = BooleanProperty(False)  # high contrast: tiles get borders, tints become solid
    line_w = NumericProperty(1)  # border of cards, px
    control_w = NumericProperty(1)  # border of fields and buttons, px
    select_w = NumericProperty(2)  # border of what is selected or focused, px
    h_touch = NumericProperty("48dp")  # least side of anything that can be touched
    h_field = NumericProperty("56dp")  # height of a field or a button
    h_foot = NumericProperty("72dp")  # height of the button at the foot of a page or sheet

    def __init__(self, **kwargs) -> None:
        self._followers: dict[WeakMethod, None] = {}  # an ordered set
        super().__init__(**kwargs)
        self._grown = 1.0  # how much larger everything is
        self._measure()
        for source, name in ((self, "theme"), (Metrics, "fontscale")):
            source.fbind(name, self._notify)

    def follow(self, appearance_changed: Callable[..., object]) -> None:
        """Call the method ``appearance_changed()`` after each change of the theme or of the text size, as long as its widget lives.

        Kivy's ``bind`` removes the entries of deleted widgets only at the next change, which on a wall tablet may never come.
        """
        self._followers[WeakMethod(appearance_changed, self._forget)] = None

    def _forget(self, dead: WeakMethod) -> None:
        self._followers.pop(dead, None)

    def _notify(self, *_args) -> None:
        for reference in list(self._followers):
            appearance_changed = reference()
            if appearance_changed is not None:
                appearance_changed()

    def use(self, theme: str, gloves: bool | None = None) -> None:
        """Switch to ``theme`` and, unless None, to sizes for gloved or bare hands: widgets that exist have to be built again."""
        column = THEMES.index(theme)
        if theme != self.theme:  # dispatched after the colours for widgets that choose colours by the theme
            for name, values in COLOURS.items():
                setattr(self, name, values[column])
        if gloves is not None:
            self.gloves = gloves
            self._measure()
        self.strong = theme == "contrast"
        self.line_w = self.control_w = max(1, round(dp(2 if self.strong else 1)))
        self.select_w = max(2, round(dp(3 if self.strong else 2)))
        self.theme = theme  # last: widgets that choose colours themselves are bound to it

    def _measure(self) -> None:
        """The sizes of now. kivy's ``dp()`` in kv keeps what it was when a widget was built."""
        grown = 1.0
        if self.gloves:
            from kivy.core.window import Window  # not before the window is configured

            own = Metrics.density / self._grown
            room = min(side / own / least for side, least in zip(sorted(Window.size), sorted(LEAST), strict=True))
            grown = min(GLOVES, max(1.0, room))
        if grown != self._grown:
            Metrics.density, self._grown = Metrics.density / self._grown * grown, grown
        for name, sizes in TARGETS.items():
            setattr(self, name, dp(sizes[self.gloves]))
        global_idmap.update({name: dp(size) for name, size in SPACES.items()})


tk = Tokens()

# role of KivyMD's theme: token; other roles keep their first value
_ROLES = {
    "background": "bg",
    "onBackground": "ink",
    "surface": "surface",
    "surfaceDim": "bg",
    "surfaceBright": "surface",
    "surfaceContainerLowest": "surface",
    "surfaceContainerLow": "surface",
    "surfaceContainer": "surface",
    "surfaceContainerHigh": "surface2",
    "surfaceContainerHighest": "track",
    "surfaceVariant": "surface2",
    "onSurface": "ink",
    "onSurfaceVariant": "ink2",
    "inverseSurface": "snack",
    "inverseOnSurface": "snack_ink",
    "inversePrimary": "snack_accent",
    "outline": "outline",
    "outlineVariant": "line",
    "shadow": "scrim",
    "scrim": "scrim",
    "surfaceTint": "accent",
    "primary": "accent",
    "primaryDim": "accent",
    "onPrimary": "accent_ink",
    "primaryContainer": "accent_bg",
    "onPrimaryContainer": "accent_on",
    "secondary": "accent",
    "onSecondary": "accent_ink",
    "secondaryContainer": "accent_bg",
    "onSecondaryContainer": "accent_on",
    "tertiary": "action",
    "onTertiary": "solid_ink",
    "tertiaryContainer": "action_bg",
    "onTertiaryContainer": "action_on",
    "error": "fault",
    "onError": "solid_ink",
    "errorContainer": "fault_bg",
    "onErrorContainer": "fault_on",
    "disabledText": "disabled",
}


def set_roles(theme_cls) -> None:
    """Give KivyMD's roles the colours of the tokens. Attention and done have no role there: see ``Toned``."""
    for role, token in _ROLES.items():
        setattr(theme_cls, role + "Color", getattr(tk, token))


def apply_theme(theme_cls, theme: str, gloves: bool | None = None) -> None:
    """Switch our tokens and KivyMD's roles together."""
    tk.use(theme, gloves)
    theme_cls.theme_style_switch_animation = False
    theme_cls.theme_style = "Dark" if theme == "dark" else "Light"
    set_roles(theme_cls)
