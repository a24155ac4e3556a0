"""A page that scrolls only where the window is too low for it, and otherwise is not in the way of the lists in it."""
from kivy.uix.scrollview import ScrollView

from app.widgets.lists import CalmScroll


class LowPage(CalmScroll):
    """While its content fits, touches go straight to the content: a scroll view that cannot scroll keeps the end of a tap from the scroll
    views inside it (kivy 2.3.1)."""

    def on_touch_down(self, touch):
        if self.do_scroll_x or self.do_scroll_y:
            return super().on_touch_down(touch)
        if not self.collide_point(*touch.pos):
            return False
        touch.push()
        touch.apply_transform_2d(self.to_local)
        taken = super(ScrollView, self).on_touch_down(touch)
        touch.pop()
        return taken
