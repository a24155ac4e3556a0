"""The axis of lanes: days and times, the present time, until when everything is held."""

from __future__ import annotations

from kivy.metrics import dp
from kivymd.icon_definitions import md_icons

from app.widgets.chart import box, text, width_of
from app.widgets.lanes_frame import AXIS, Frame, Span, kept_in
from app.widgets.tokens import tk

LABEL_REACH = 8  # dp: the farthest end of a label from its line


def paint_now(frame: Frame, now: float, now_label: str) -> None:
    """The line through all lanes."""
    if now_label:
        box(frame.at(now) - 1, frame.y, 2, frame.bottom_of_axis - frame.y, tk.ink)


def paint_axis(frame: Frame, seen: Span, now: float, now_label: str) -> None:
    """The labels of the ticks, of the present time and of a hold; ``seen``: left and right end of the visible part."""
    pill = None
    if now_label:
        width = width_of(now_label, 16, "RobotoMedium") + dp(16)
        left = kept_in(frame.at(now), width, seen)
        pill = left, left + width
    taken = [pill] if pill else []
    _paint_tick_labels(frame, seen, taken + _paint_hold(frame, seen, pill))
    if pill:
        middle = frame.top - dp(AXIS) / 2
        box(left, middle - dp(14), width, dp(28), tk.ink, dp(14))
        text(now_label, left + width / 2, middle, tk.surface, 16, ax=0.5, font="RobotoMedium")


def _paint_hold(frame: Frame, seen: Span, now: Span | None) -> list[Span]:
    """Until when everything is held and why, above its band and next to the time, which is within it. Returns the room
    it takes."""
    for start, end, words, kind in frame.bands:
        x, x2 = max(frame.at(start), seen[0]), min(frame.at(end), seen[1])
        if kind == "held" and x < x2:
            width = width_of(words, font="RobotoMedium") + dp(40)
            if now and now[0] < x + width and x < now[1] + dp(6):
                x = now[1] + dp(6)
            if x + width > seen[1]:
                x = max(seen[0], (now[0] - dp(6) if now and now[1] + dp(6) == x else seen[1]) - width)
            y = frame.top - dp(AXIS) / 2 + dp(1)
            box(x, y - dp(12), width, dp(24), tk.attention_solid, dp(12))
            text(md_icons["hand-back-right-outline"], x + dp(18), y, tk.amber_ink, 16, 0.5, 0.5, "Icons")
            text(words, x + dp(30), y, tk.amber_ink, font="RobotoMedium")
            return [(x, x + width)]
    return []


def _paint_tick_labels(frame: Frame, seen: Span, taken: list[Span]) -> None:
    """As many as fit side by side without what is ``taken``: the strong ones (a new day) first, which move aside if
    they still belong clearly to their hour. Visible ones stay whole at the ends."""
    y = frame.top - dp(AXIS) / 2
    for hour, label, strong in sorted(frame.ticks, key=lambda tick: not tick[2]):
        if not label:
            continue
        font = "RobotoMedium" if strong else "Roboto"
        width = width_of(label, 16, font)
        places = [kept_in(frame.at(hour), width, seen)]
        if strong and seen[0] <= frame.at(hour) <= seen[1]:
            moved = [place for begins, ends in taken for place in (ends + dp(6), begins - dp(6) - width)]
            places += sorted(
                (place for place in moved if frame.at(hour) - dp(LABEL_REACH) - width < place < frame.at(hour) + width),
                key=lambda x: abs(x - places[0]),
            )
        for left in places:
            is_cut = any(left < edge < left + width for edge in seen)
            if not is_cut and all(left + width + dp(6) <= begins or ends + dp(6) <= left for begins, ends in taken):
                taken.append((left, left + width))
                text(label, left, y, tk.ink if strong else tk.ink2, 16, font=font)
                break
