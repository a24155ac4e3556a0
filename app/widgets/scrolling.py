"""Scrolling: a scroll view that handles touches as fingers expect, and a page of one column. No scroll view is inside another one."""

from kivy.core.window import Window
from kivy.effects.scroll import ScrollEffect
from kivy.metrics import dp
from kivy.properties import AliasProperty, NumericProperty, VariableListProperty
from kivy.uix.scrollview import ScrollView

from app.widgets.around import around
from app.widgets.places import places

FAR = 1e6  # px, where nothing is
WHEEL = 64  # dp that a notch of the wheel moves, about a row
# how far to the right a notch leads; kivy names them after the way the content goes
SIDEWAYS = {"scrollleft": 1, "scrollright": -1}
WITH_SHIFT = {**SIDEWAYS, "scrollup": 1, "scrolldown": -1}


def sideways(touch) -> int:
    """1 for a wheel turned to the right, -1 to the left, or with shift down and up; otherwise 0."""
    notches = WITH_SHIFT if "shift" in Window.modifiers else SIDEWAYS
    return notches.get(touch.button, 0) if touch.is_mouse_scrolling else 0


class CalmScroll(ScrollView):
    """A scroll view that doesn't overshoot, with a line at its lower edge while there is ``more_below``. Content that fits doesn't scroll.

    A resting finger presses what is under it. If it drags later, it scrolls and has pressed nothing, unless the widget
    under it ``keeps_drag``.
    """

    def _has_more_below(self) -> bool:
        return bool(self.do_scroll_y) and (self.viewport_size[1] - self.height) * self.scroll_y > dp(2)

    more_below = AliasProperty(_has_more_below, bind=("do_scroll_y", "viewport_size", "height", "scroll_y"), cache=True)

    def __init__(self, **kwargs):
        kwargs.setdefault("effect_cls", ScrollEffect)
        kwargs.setdefault("scroll_wheel_distance", dp(WHEEL))
        kwargs.setdefault(
            "always_overscroll", False
        )  # content that fits is at the upper edge, ignoring the scroll position
        super().__init__(**kwargs)
        places.watch(self, "viewport_size")

    def update_from_scroll(self, *args):
        """On whole pixels: in between, every line on the page would be blurred."""
        super().update_from_scroll(*args)
        self.g_translate.xy = tuple(map(round, self.g_translate.xy))

    def _bind_inactive_bar_color(self, *_):
        """kivy's bar would fade, unseen and for 30 frames, after each scrolling: this page has none."""

    def on_do_scroll_y(self, *_):
        """Content that fits is shown from its top, ignoring the earlier scroll position."""
        if not self.do_scroll_y:
            self.scroll_y = 1

    def on_touch_down(self, touch):
        if not self.do_scroll_y and self.collide_point(*touch.pos):
            return self.simulate_touch_down(touch)  # at once: it can't become a drag
        if sideways(touch) and self.collide_point(*touch.pos) and self.simulate_touch_down(touch):
            return True  # of what is in it
        if (
            self._touch
            and self._touch.ud.get(self._get_uid(), {}).get("mode") == "scroll"
            and self.collide_point(*touch.pos)
        ):
            return True  # the other finger scrolls
        return super().on_touch_down(touch)

    def _change_touch_mode(self, *_):
        """kivy gives a resting touch finally to the widget under it; here only until it is dragged."""
        touch = self._touch
        super()._change_touch_mode()
        if touch and self._touch is None:
            touch.ud[self._get_uid("lent")] = True
            touch.grab(self)

    def on_touch_move(self, touch):
        if touch.grab_current is self and self._get_uid("lent") in touch.ud:
            if self._is_wanted_back(touch):
                self._take_back(touch)
            return True
        if touch is self._touch and abs(touch.x - touch.ox) > max(self.scroll_distance, abs(touch.y - touch.oy)):
            self._change_touch_mode()  # it can't follow sideways
        return super().on_touch_move(touch)

    def on_touch_up(self, touch):
        if touch.grab_current is self and touch.ud.pop(self._get_uid("lent"), False):
            touch.ungrab(self)
            del touch.ud[self._get_uid()]  # not a tap: the widget under it has been pressed
            if self._touch is None:
                self.dispatch("on_scroll_stop", touch)
            return True
        return super().on_touch_up(touch)

    def _is_wanted_back(self, touch) -> bool:
        """Whether it has become a drag that this can follow."""
        dx, dy = touch.x - touch.ox, touch.y - touch.oy
        if max(abs(dx), abs(dy)) <= self.scroll_distance or self._touch is not None:
            return False
        return (
            abs(dy) > abs(dx)
            and self._can_follow(dy)
            and not any(getattr(reference(), "keeps_drag", False) for reference in touch.grab_list)
        )

    def _take_back(self, touch):
        """It leaves what is under it without having pressed it, and scrolls from here on."""
        dx, dy = touch.x - touch.ox, touch.y - touch.oy
        del touch.ud[self._get_uid("lent")]
        touch.push()
        touch.apply_transform_2d(lambda x, y: (x + FAR, y + FAR))
        self._do_touch_up(touch)
        touch.pop()
        touch.grab(self)
        self.on_scroll_start(touch, check_children=False)
        touch.ud[self._get_uid()].update(mode="scroll", user_stopped=True, dx=abs(dx), dy=abs(dy))

    def _can_follow(self, dy: float) -> bool:
        """Whether its content can follow a finger that moves upwards (px > 0) or downwards."""
        return self.do_scroll_y and (self.scroll_y > 1e-3 if dy > 0 else self.scroll_y < 1 - 1e-3)


class ScrollPage(CalmScroll):
    """A page that scrolls: children go into one column as wide as the page, as high as they need."""

    padding = VariableListProperty([0, 0, 0, 0])
    spacing = NumericProperty("16dp")
    content_height = NumericProperty(0)  # of the column, with its padding

    def add_widget(self, widget, *args, **kwargs):
        column = self.ids.get("column")
        if column is None:
            return super().add_widget(widget, *args, **kwargs)
        return column.add_widget(widget, *args, **kwargs)

    def clear_widgets(self, *args, **kwargs):
        self.ids.column.clear_widgets(*args, **kwargs)


def turn_to(widget) -> None:
    """Scroll the page around ``widget`` until all of it is visible."""
    page = next(around(widget.parent, CalmScroll), None)
    if page is not None and page.do_scroll_y:
        page.scroll_to(widget, padding=0, animate=False)


def top_of_page(widget) -> None:
    """Scroll the page around ``widget`` until it is at the upper edge, or the end of the page is in sight."""
    page = next(around(widget.parent, CalmScroll))
    if page.do_scroll_y:
        below = page.top - page.parent.to_widget(*widget.to_window(widget.x, widget.top))[1]
        page.scroll_y = min(max(page.scroll_y - page.convert_distance_to_scroll(0, below)[1], 0), 1)
