"""Scrolling: a scroll view that handles touches as fingers expect, and a page of one column."""

from kivy.effects.scroll import ScrollEffect
from kivy.metrics import dp
from kivy.properties import AliasProperty, NumericProperty, VariableListProperty
from kivy.uix.scrollview import ScrollView

from app.widgets.lists import PRESSED_ACTION, PRESSED_ROW, Row, RowPress

WHEEL_WAYS = {"scrollup": 1, "scrolldown": -1}  # by kivy's names, which are the page's directions
FAR = 1e6  # px, where nothing is


class CalmScroll(ScrollView):
    """A scroll view that doesn't overshoot, with a line at its lower edge while there is ``more_below``.

    A resting finger presses what is under it. If it drags later, it scrolls and has pressed nothing, unless the widget
    under it ``keeps_drag``. A widget that ``takes_at_once`` gets touches without a rest.

    ``wheel_way``: where a mouse's wheel is turning it, 1 down, -1 up; 0: a finger, or nothing, has moved it. A list
    that stops at whole rows continues in that direction: a notch is less than half a row, so the nearest row would undo
    it.
    """

    wheel_way = 0

    def _has_more_below(self) -> bool:
        return bool(self.do_scroll_y) and (self.viewport_size[1] - self.height) * self.scroll_y > dp(2)

    more_below = AliasProperty(_has_more_below, bind=("do_scroll_y", "viewport_size", "height", "scroll_y"), cache=True)

    def __init__(self, **kwargs):
        kwargs.setdefault("effect_cls", ScrollEffect)
        kwargs.setdefault(
            "always_overscroll", False
        )  # content that fits is at the upper edge, ignoring the scroll position
        super().__init__(**kwargs)

    def on_touch_down(self, touch):
        if self.collide_point(*touch.pos):
            self.wheel_way = WHEEL_WAYS.get(touch.button, 0) if "button" in touch.profile else 0
        if (
            PRESSED_ROW not in touch.ud
            and (row := self._under(touch, lambda widget: isinstance(widget, Row))) is not None
        ):
            button = self._under(touch, lambda widget: isinstance(widget, RowPress))
            touch.ud[PRESSED_ROW] = row.key
            touch.ud[PRESSED_ACTION] = button.name if button is not None and not button.has_just_moved else ""
        is_for_fingers = self._under(touch, lambda widget: getattr(widget, "takes_at_once", False)) is not None
        if is_for_fingers and self._touch and self._touch.ud.get(self._get_uid(), {}).get("mode") == "scroll":
            return True  # the other finger scrolls
        taken = super().on_touch_down(touch)
        if is_for_fingers and self._touch is touch and self._get_uid() in touch.ud:
            self._touch = None
            touch.ud[self._get_uid("lent")] = True
            self.simulate_touch_down(touch)
        return taken

    def _under(self, touch, is_wanted):
        """The first widget of that kind under a finger on this page, or None."""
        if not self.collide_point(*touch.pos):
            return None
        place = self.to_window(*touch.pos)
        return next(
            (
                widget
                for widget in self.walk(restrict=True)
                if is_wanted(widget) and widget.collide_point(*widget.parent.to_widget(*place))
            ),
            None,
        )

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
        """Whether it has become a drag that this, or the page around it, follows."""
        dx, dy = touch.x - touch.ox, touch.y - touch.oy
        if max(abs(dx), abs(dy)) <= self.scroll_distance or self._touch is not None:
            return False
        follows = (
            self.can_follow(dy) or self._around(dy) is not None
            if abs(dy) > abs(dx)
            else self.do_scroll_x and self.viewport_size[0] > self.width + 1
        )
        return follows and not any(getattr(reference(), "keeps_drag", False) for reference in touch.grab_list)

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

    def on_scroll_move(self, touch):
        """When this has reached its end, the drag continues with the page around it."""
        drag = touch.ud.get(self._get_uid())
        if drag is not None and touch.dy and not self.can_follow(touch.dy) and self._is_drag_upright(drag, touch):
            outer = self._around(touch.dy)
            if outer is not None and self._hand_over(touch, drag, outer):
                return True
        return super().on_scroll_move(touch)

    def can_follow(self, dy: float) -> bool:
        """Whether its content can follow a finger that moves upwards (px > 0) or downwards."""
        is_higher = bool(self.do_scroll_y) and self.viewport_size[1] > self.height + 1
        return is_higher and (self.scroll_y > 1e-3 if dy > 0 else self.scroll_y < 1 - 1e-3)

    def _is_drag_upright(self, drag, touch) -> bool:
        """Whether it has moved further than a tap, and vertically."""
        return not (touch.ud["in_bar_x"] or touch.ud["in_bar_y"]) and drag["dy"] > max(drag["dx"], self.scroll_distance)

    def _around(self, dy: float):
        view = self.parent
        while view is not None and not (isinstance(view, CalmScroll) and view.can_follow(dy)):
            view = view.parent if view.parent is not view else None
        return view

    def _hand_over(self, touch, drag, outer) -> bool:
        """The touch is the outer page's from now on, if that is under it."""
        touch.push()
        touch.apply_transform_2d(lambda x, y: outer.parent.to_widget(*self.parent.to_window(x, y)))
        if is_taken := outer.collide_point(*touch.pos) and outer._touch is None:
            outer.on_scroll_start(touch, check_children=False)
            touch.ud[outer._get_uid()].update(mode="scroll", user_stopped=True)
        touch.pop()
        if is_taken:
            drag["mode"] = "scroll"  # no tap
            self.dispatch("on_scroll_stop", touch)
            del touch.ud[self._get_uid()]
            outer._touch = touch
            touch.ungrab(self)
            touch.grab(outer)
        return is_taken


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
