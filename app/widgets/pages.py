"""Pages that scroll only if their content doesn't fit, with lists in them that scroll too.

kivy's scroll views (2.3.1) can't be nested: the outer one consumes the end of a tap, so that nothing inside the inner
one is ever pressed. Here each touch belongs to one of them: to the list or page under the finger, else (and at a list's
end) to the page around it (``CalmScroll``).
"""

from kivy.uix.scrollview import ScrollView

from app.widgets.scrolling import CalmScroll, ScrollPage

SCROLL_EVENTS = ("on_scroll_start", "on_scroll_move", "on_scroll_stop")


class LowPage(CalmScroll):
    """A page with lists in it. While ``do_scroll_y`` is False because everything fits, it forwards all touches."""

    def on_do_scroll_y(self, *_):
        """Content that fits is shown from its top, ignoring the earlier scroll position."""
        if not self.do_scroll_y:
            self.scroll_y = 1

    def on_touch_down(self, touch):
        if not self.collide_point(*touch.pos):
            return super().on_touch_down(touch)
        if not (self.do_scroll_x or self.do_scroll_y):
            return self._pass(touch)
        if self._is_for_inner(touch):
            is_wheel = "button" in touch.profile and touch.button.startswith("scroll")
            return self._pass(touch) or (is_wheel and super().on_touch_down(touch))  # the list has reached its end
        return super().on_touch_down(touch)

    def _pass(self, touch) -> bool:
        """Forward the touch to the children, as any widget does."""
        touch.push()
        touch.apply_transform_2d(self.to_local)
        taken = super(ScrollView, self).on_touch_down(touch)
        touch.pop()
        return taken

    def _is_for_inner(self, touch) -> bool:
        """Whether a list, or a page that scrolls, is under the finger."""
        place = self.to_window(*touch.pos)
        return any(
            inner is not self
            and isinstance(inner, ScrollView)
            and not (isinstance(inner, LowPage) and inner.is_still)
            and inner.collide_point(*inner.parent.to_widget(*place))
            for inner in self.walk(restrict=True)
        )

    def dispatch_children(self, event_type, *args, **kwargs):
        """Don't forward scroll events: kivy would do so for every touch, with wrong coordinates below a RelativeLayout. Who gets a touch is
        decided in ``on_touch_down``."""
        if event_type in SCROLL_EVENTS:
            return False
        return super().dispatch_children(event_type, *args, **kwargs)

    @property
    def is_still(self) -> bool:
        """Everything fits."""
        return not (self.do_scroll_x or self.do_scroll_y)


class LowColumn(LowPage, ScrollPage):
    """A ScrollPage that can be inside a LowPage."""


def turn_to(widget) -> None:
    """Scroll the pages around ``widget`` until all of it is visible, the inner ones first."""
    page = widget.parent
    while page is not None and page is not page.parent:  # the window is its own parent
        if isinstance(page, LowPage) and not page.is_still:
            page.scroll_to(widget, padding=0, animate=False)
        page = page.parent


def top_of_page(widget) -> None:
    """Scroll the page around ``widget`` until it is at the upper edge, or the end of the page is in sight."""
    page = widget.parent
    while not isinstance(page, LowPage):
        page = page.parent
    if not page.is_still:
        below = page.top - page.parent.to_widget(*widget.to_window(widget.x, widget.top))[1]
        page.scroll_y = min(max(page.scroll_y - page.convert_distance_to_scroll(0, below)[1], 0), 1)
