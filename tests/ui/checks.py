"""What the eye might miss in a picture, found by walking its widgets.

Clipped text, broken words, text under 14 sp, text and widgets that leave their place or overlap in their box, touch targets under 48 dp
(56 with gloves), gaps between targets under 8 dp, hidden widgets that swallow touches, and the contrast of every pair of colours that the
widgets use; fields that are not level. What else a canvas draws it does not see.
"""

from __future__ import annotations

from collections.abc import Iterator
from itertools import combinations

import pytest
from kivy.core.window import Window
from kivy.metrics import dp, sp
from kivy.tests.common import UnitTestTouch
from kivy.uix.behaviors import ButtonBehavior
from kivy.uix.boxlayout import BoxLayout
from kivy.uix.label import Label
from kivy.uix.scrollview import ScrollView
from kivy.uix.textinput import TextInput
from kivy.uix.widget import Widget

from app.widgets.fields import Field
from app.widgets.long_list import LongList
from app.widgets.sheet import Sheet
from app.widgets.surfaces import Passive
from app.widgets.text import SEAM, line_width
from app.widgets.tokens import COLOURS, THEMES, TONES, tk

SLACK = 1.5  # px: tolerance for rounding
GAP = 8  # dp
DIVIDED = ("ListRow", "NavItem", "BoardKey", "FleetHead", "CauseRow", "TrendRow", "MissionRow", "Segment", "TabButton")
LONGEST_WORD = 30  # characters, also in Finnish


def name_of(widget: Widget) -> str:
    words = next(
        (getattr(widget, name) for name in ("text", "title", "label", "mission", "name") if getattr(widget, name, "")),
        "",
    )
    return f"{type(widget).__name__} {str(words)[:40]!r}"


def shown(root: Widget) -> Iterator[tuple[Widget, tuple[Widget, ...]]]:
    """Every widget that can be seen, with its ancestors from the outermost in."""

    def walk(widget: Widget, above: tuple[Widget, ...]):
        if not widget.opacity or widget.width < 2 or widget.height < 2:
            return
        yield widget, above
        for child in widget.children:
            yield from walk(child, (*above, widget))

    yield from walk(root, ())


def parents(widget: Widget) -> tuple[Widget, ...]:
    """From the outermost in."""
    found: list[Widget] = []
    while (widget := widget.parent) is not None and widget is not Window:
        found.insert(0, widget)
    return tuple(found)


def area(widget: Widget) -> tuple[float, float, float, float]:
    """left, bottom, right, top in the window."""
    x, y = widget.to_window(*widget.pos)
    return x, y, x + widget.width, y + widget.height


def visible_area(widget: Widget, above: tuple[Widget, ...]) -> tuple[float, float, float, float] | None:
    """The part of ``widget`` that the scroll views around it let through; None when nothing of it."""
    x, y, right, top = area(widget)
    for view in above:
        if isinstance(view, ScrollView):
            vx, vy, vright, vtop = area(view)
            x, y, right, top = max(x, vx), max(y, vy), min(right, vright), min(top, vtop)
    return (x, y, right, top) if right - x > SLACK and top - y > SLACK else None


def is_seen(widget: Widget) -> bool:
    """All of it, without scrolling."""
    return visible_area(widget, parents(widget)) == pytest.approx(area(widget), abs=1)


def whole_rows(rows: LongList) -> list[Widget]:
    """The rows that are seen whole, from the top."""
    return [row for row in rows.views if is_seen(row)]


def problems(root: Widget) -> list[str]:
    """Sentences about what is wrong in ``root`` as it is laid out now."""
    found: list[str] = []
    targets: list[tuple[Widget, tuple[Widget, ...]]] = []
    for widget, above in shown(root):
        if visible_area(widget, above) is None:
            continue
        if isinstance(widget, Label) and widget.text and widget.font_name != "Icons":
            found += _text_problems(widget, above)
        if takes_presses(widget) or isinstance(widget, TextInput):
            targets.append((widget, above))
        if takes_presses(widget) and min(widget.size) < tk.h_touch - SLACK:
            found.append(f"small target {name_of(widget)}: {widget.width:.0f}×{widget.height:.0f}")
        if isinstance(widget, BoxLayout):
            found += _box_problems(widget)
        found += _level_problems(widget)
    return [*found, *_gap_problems(targets), *swallowed_touches(root)]


# ---------------------------------------------------------------------- touches
def swallowed_touches(root: Widget) -> Iterator[str]:
    """Invisible widgets that keep a touch: transparent, without a size, or outside what holds them.

    A layout hands touches to what it holds wherever that lies, and a disabled widget keeps those on it (Widget.on_touch_down); only scroll
    views and screens look whether a touch is theirs. So every hidden part is touched wherever it has something that could take a touch.
    """

    def walk(widget: Widget, above: tuple[Widget, ...]) -> Iterator[str]:
        if why := _why_hidden(widget, above):
            yield from _kept_by(widget, above, why)
            return
        if not (widget.disabled and takes_touches(widget)):  # what is seen keeps the touches of what it holds itself
            for child in widget.children:
                yield from walk(child, (*above, widget))

    yield from walk(root, ())


def takes_presses(widget: Widget) -> bool:
    """Every card of KivyMD's is a button; those that only show something are not."""
    presses = isinstance(widget, ButtonBehavior) and not isinstance(widget, Passive)
    return presses and getattr(widget, "can_press", True)


def takes_touches(widget: Widget) -> bool:
    return takes_presses(widget) or isinstance(widget, TextInput | ScrollView) or widget.disabled


def _why_hidden(widget: Widget, above: tuple[Widget, ...]) -> str:
    if not widget.opacity:
        return "transparent"
    if widget.width < 1 or widget.height < 1:
        return "without a size"
    if above and not isinstance(above[-1], ScrollView):
        x, y, right, top = area(widget)
        bx, by, bright, btop = area(above[-1])
        if min(right, bright) - max(x, bx) < SLACK or min(top, btop) - max(y, by) < SLACK:
            return f"beside {name_of(above[-1])}"
    return ""


def _kept_by(hidden: Widget, above: tuple[Widget, ...], why: str) -> Iterator[str]:
    def walk(widget: Widget, above: tuple[Widget, ...]) -> Iterator[tuple[Widget, tuple[float, float, float, float]]]:
        if takes_touches(widget) and (place := _reachable_area(widget, above)) is not None:
            yield widget, place
        for child in widget.children:
            yield from walk(child, (*above, widget))

    for widget, (x, y, right, top) in walk(hidden, above):
        if why.startswith("beside") or _keeps(hidden, widget, (x + right) / 2, (y + top) / 2):
            where = "" if widget is hidden else f" in {name_of(hidden)}"
            yield f"{name_of(widget)}{where} is {why} and keeps touches at {x:.0f}–{right:.0f}, {y:.0f}–{top:.0f}"
            return


def _keeps(hidden: Widget, widget: Widget, x: float, y: float) -> bool:
    """Whether a touch at (x, y) of the window that reaches ``hidden`` ends there, in ``widget``, without an effect."""
    touch = UnitTestTouch(x, y)
    touch.scale_for_screen(Window.width, Window.height)
    touch.push()
    touch.apply_transform_2d(lambda x, y: hidden.parent.to_widget(x, y) if hidden.parent is not Window else (x, y))
    if widget is not hidden:
        widget.on_touch_down = lambda _touch: True
    try:
        return bool(hidden.dispatch("on_touch_down", touch))
    finally:
        touch.pop()
        if widget is not hidden:
            del widget.on_touch_down


def _reachable_area(widget: Widget, above: tuple[Widget, ...]) -> tuple[float, float, float, float] | None:
    """The part of it that lies in the window and in the scroll views around it."""
    if (place := visible_area(widget, above)) is None:
        return None
    x, y, right, top = place
    x, y, right, top = max(x, 0.0), max(y, 0.0), min(right, float(Window.width)), min(top, float(Window.height))
    return (x, y, right, top) if right - x > SLACK and top - y > SLACK else None


def _text_problems(label: Label, above: tuple[Widget, ...]) -> Iterator[str]:
    if label.font_size < sp(14) - 0.1:
        yield f"small text {label.font_size:.0f} px: {name_of(label)}"
    wide, high = label.texture_size
    if wide > label.width + SLACK or high > label.height + SLACK:
        yield f"clipped {name_of(label)}: {wide}×{high} in {label.width:.0f}×{label.height:.0f}"
    if words := broken_words(label):
        yield f"broken {words} of {name_of(label)} in {label.text_size[0]:.0f} px"
    x, y, right, top = area(label)
    for box in reversed(above):
        if isinstance(box, ScrollView):
            return
        bx, by, bright, btop = area(box)
        if x < bx - SLACK or right > bright + SLACK or y < by - SLACK or top > btop + SLACK:
            yield (
                f"{name_of(label)} leaves {name_of(box)}: {x:.0f}–{right:.0f}, {y:.0f}–{top:.0f} "
                f"/ {bx:.0f}–{bright:.0f}, {by:.0f}–{btop:.0f}"
            )
            return


def broken_words(label: Label) -> list[str]:
    """Words of it that are wider than its line; of an address or a path only the parts between which it may break.
    What is longer than any word breaks somewhere."""
    room, size = label.text_size[0], label._label.options["font_size"]
    if label.markup or not room:
        return []
    return [
        word
        for word in label.text.split()
        if len(word) <= LONGEST_WORD
        and len(word) * size > room
        and max(line_width(part, label.font_name, size) for part in SEAM.split(word)) > room + 1
    ]


def _box_problems(box: BoxLayout) -> Iterator[str]:
    children = [child for child in box.children if child.opacity and child.width >= 2 and child.height >= 2]
    for child in children:
        if (
            child.x < box.x - SLACK
            or child.right > box.right + SLACK
            or child.y < box.y - SLACK
            or child.top > box.top + SLACK
        ):
            yield f"{name_of(child)} leaves {name_of(box)}: {child.pos} {child.size} / {box.pos} {box.size}"
    for n, a in enumerate(children):
        for b in children[n + 1 :]:
            if min(a.right, b.right) - max(a.x, b.x) > SLACK and min(a.top, b.top) - max(a.y, b.y) > SLACK:
                yield f"{name_of(a)} overlaps {name_of(b)}"


def _level_problems(box: Widget) -> Iterator[str]:
    """Fields in one row whose labels are not: one has more lines below it."""
    fields = [child for child in box.children if isinstance(child, Field)]
    for a, b in combinations(fields, 2):
        if min(a.top, b.top) - max(a.y, b.y) > SLACK and abs(a.top - b.top) > SLACK:
            yield f"{name_of(a)} is not level with {name_of(b)}: {a.top:.0f}, {b.top:.0f}"


def _gap_problems(targets: list[tuple[Widget, tuple[Widget, ...]]]) -> Iterator[str]:
    seen = [(widget, above, visible_area(widget, above)) for widget, above in targets]
    seen = [(widget, above, place) for widget, above, place in seen if place is not None]
    for n, (a, a_above, (ax, ay, aright, atop)) in enumerate(seen):
        for b, b_above, (bx, by, bright, btop) in seen[n + 1 :]:
            if a in b_above or b in a_above or _one_field(a_above, b_above):
                continue
            if _is_beneath(b, b_above, a_above) or _is_beneath(a, a_above, b_above):
                continue
            gap = max(bx - aright, ax - bright, by - atop, ay - btop)
            if gap > -SLACK and _are_divided(a, a_above, b, b_above):
                continue
            if gap < dp(GAP) - SLACK:
                yield f"gap {gap:.0f} px between {name_of(a)} and {name_of(b)}"


def _is_beneath(widget: Widget, above: tuple[Widget, ...], other_above: tuple[Widget, ...]) -> bool:
    """Under the sheet that holds the other one, which keeps the touches there."""
    sheet = next((part for part in other_above if isinstance(part, Sheet)), None)
    if sheet is None or sheet in above:
        return False
    (x, y, right, top), (sx, sy, sright, stop) = area(widget), area(sheet)
    return min(right, sright) - max(x, sx) > SLACK and min(top, stop) - max(y, sy) > SLACK


def _are_divided(a: Widget, a_above: tuple[Widget, ...], b: Widget, b_above: tuple[Widget, ...]) -> bool:
    """A line is between them: rows or tabs side by side, or a row and a button in the next row."""
    rows = [_is_divided(widget) for widget in (a, b)]
    inside = [any(_is_divided(around) for around in above) for above in (a_above, b_above)]
    return all(rows) or any(is_row and is_inside for is_row, is_inside in zip(rows, reversed(inside), strict=True))


def _is_divided(widget: Widget) -> bool:
    return any(kind.__name__ in DIVIDED for kind in type(widget).__mro__)


def _one_field(a_above: tuple[Widget, ...], b_above: tuple[Widget, ...]) -> bool:
    """A field and the icon inside its frame belong together."""
    return type(a_above[-1]).__name__ in ("FieldFrame", "FieldLine") and a_above[-1] is b_above[-1]


# ---------------------------------------------------------------------- contrast of the tokens
def luminance(colour: str) -> float:
    """Relative luminance of "#RRGGBB" (WCAG 2.2)."""
    channels = [int(colour[i : i + 2], 16) / 255 for i in (1, 3, 5)]
    linear = [c / 12.92 if c <= 0.04045 else ((c + 0.055) / 1.055) ** 2.4 for c in channels]
    return 0.2126 * linear[0] + 0.7152 * linear[1] + 0.0722 * linear[2]


def contrast_ratio(a: str, b: str) -> float:
    high, low = sorted((luminance(a), luminance(b)), reverse=True)
    return (high + 0.05) / (low + 0.05)


TEXT_PAIRS = [
    *((ink, ground) for ink in ("ink", "ink2", "ink3", *TONES) for ground in ("bg", "surface", "surface2")),
    *((f"{tone}_on", f"{tone}_bg") for tone in TONES),
    *(("solid_ink", f"{tone}_solid") for tone in ("fault", "action", "done", "neutral", "offline", "accent")),
    ("ink2", "map_floor"),
    ("ink2", "closed"),
    ("accent_ink", "accent"),
    ("ink", "accent_soft"),
    ("amber_ink", "attention_solid"),
    ("snack_ink", "snack"),
    ("snack_accent", "snack"),
]
PART_PAIRS = [
    *(("outline", ground) for ground in ("bg", "surface", "surface2")),
    *(("accent", ground) for ground in ("bg", "surface", "track", "map_floor")),
    *(("accent_solid", ground) for ground in ("bg", "surface", "surface2")),
    ("accent_mid", "surface"),
    ("map_wall", "map_floor"),
    ("disabled", "surface"),
    ("fault_solid", "surface"),
    ("fault", "map_floor"),
    ("neutral_solid", "surface"),
]


def contrast_problems() -> list[str]:
    """Pairs of tokens below WCAG's ratios: text 4.5 (high contrast 7), parts of controls and data 3."""
    found = []
    for column, theme in enumerate(THEMES):
        for pairs, need in ((TEXT_PAIRS, 7.0 if theme == "contrast" else 4.5), (PART_PAIRS, 3.0)):
            for a, b in pairs:
                ratio = contrast_ratio(COLOURS[a][column], COLOURS[b][column])
                if ratio < need:
                    found.append(f"{theme}: {a} on {b} {ratio:.2f} < {need}")
    return found
