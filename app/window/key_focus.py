"""The window by keys alone: Tab and the arrows go from target to target, Enter or the space bar presses the one in the ring."""
from kivy.clock import Clock
from kivy.core.window import Window
from kivy.graphics import Color, SmoothLine
from kivy.metrics import dp
from kivy.uix.behaviors import ButtonBehavior
from kivy.uix.scrollview import ScrollView

from app.widgets.dialogs import Overlay
from app.widgets.dock import dock
from app.widgets.fields import FieldInput
from app.widgets.keyboard import DockedKeyboard
from app.widgets.surfaces import Passive
from app.widgets.tokens import tk

TAB, ENTER, KEYPAD_ENTER, ESCAPE, SPACE = 9, 13, 271, 27, 32
ARROWS = {273: (0, 1), 274: (0, -1), 275: (1, 0), 276: (-1, 0)}          # key: direction


def parents(widget):
    """``widget`` and what it is in, up to the child of the window; empty when it is not in the window."""
    found = [widget]
    while found[-1].parent not in (None, Window) and found[-1].parent is not found[-1]:
        found.append(found[-1].parent)
    return found if found[-1].parent is Window else []


class KeyFocus:
    """From ``start`` to ``stop``. Only what is topmost is reached: in a dialog its targets, else those of the screen. A touch ends it."""

    def __init__(self) -> None:
        self.target = None                   # what has the ring
        self._shown = None
        self._follow = Clock.create_trigger(self._draw, 0, interval=True)

    def start(self) -> None:
        Window.bind(on_key_down=self._key_in_field, on_keyboard=self._key, on_touch_down=self._touched)

    def stop(self) -> None:
        Window.unbind(on_key_down=self._key_in_field, on_keyboard=self._key, on_touch_down=self._touched)
        self.forget()

    def forget(self) -> None:
        self.target = None
        self._follow.cancel()
        self._clear()

    def targets(self) -> list:
        """What can be pressed or typed into now, in reading order of the tree."""
        tops = [top for top in Window.children if not isinstance(top, DockedKeyboard) and getattr(top, "is_open", True)]
        dialog = next((n for n, top in enumerate(tops) if isinstance(top, Overlay)), len(tops) - 1)
        found = []
        waiting = tops[dialog::-1]           # messages above it come last
        while waiting:
            widget = waiting.pop(0)
            if not widget.opacity or widget.disabled or widget.width < 1 or widget.height < 1:
                continue
            presses = isinstance(widget, ButtonBehavior) and not isinstance(widget, Passive | Overlay)
            if presses or isinstance(widget, FieldInput):
                found.append(widget)
            waiting[:0] = widget.children[::-1]
        return found

    # ------------------------------------------------------------------ keys
    def _key_in_field(self, _window, key, _scancode=None, _text=None, modifiers=()):
        """Kivy's Tab goes to fields only, past the buttons."""
        if key != TAB or dock.field is None:
            return False
        self.target = dock.field
        self._step(-1 if "shift" in modifiers else 1)
        return True

    def _key(self, _window, key, _scancode=None, _text=None, modifiers=()):
        if dock.field is not None:
            return False
        if key == TAB:
            self._step(-1 if "shift" in modifiers else 1)
        elif key in ARROWS:
            self._turn(*ARROWS[key])
        elif key in (ENTER, KEYPAD_ENTER, SPACE) and self.target in self.targets():
            if not getattr(self.target, "busy", False):
                self.target.trigger_action(.1)
        elif key == ESCAPE and self.target is not None:
            self.forget()
        else:
            return False
        return True

    def _touched(self, *_args):
        if self.target is not None:
            self.forget()

    def _step(self, by) -> None:
        targets = self.targets()
        if targets:
            at = targets.index(self.target) + by if self.target in targets else 0 if by > 0 else -1
            self._go(targets[at % len(targets)])

    def _turn(self, right, up) -> None:
        """To the nearest target in that direction."""
        targets = self.targets()
        if self.target not in targets:
            self._step(1)
            return
        x, y = self.target.to_window(*self.target.center)
        near = []
        for target in targets:
            left, top = target.to_window(*target.center)
            ahead, aside = (left - x, top - y) if right else (top - y, left - x)
            if ahead * (right + up) > 1:
                near.append((abs(ahead) + 3 * abs(aside), len(near), target))
        if near:
            self._go(min(near)[2])

    def _go(self, target) -> None:
        if dock.field is not None:
            dock.field.focus = False
        self.target = target
        for view in parents(target)[1:]:
            if isinstance(view, ScrollView) and any(inside.height > view.height or inside.width > view.width for inside in view.children):
                view.scroll_to(target, padding=dp(24), animate=False)
        if isinstance(target, FieldInput):
            target.focus = True              # which shows it in its own way
        self._follow()

    # ------------------------------------------------------------------ the ring
    def _draw(self, _dt) -> None:
        target = self.target
        if target is None or not parents(target):
            self.forget()
            return
        seen = target in self.targets() and not isinstance(target, FieldInput)
        place = (*target.to_window(*target.pos), *target.size, *tk.ink) if seen else None
        if place != self._shown:
            self._clear()
            self._shown = place
            if place is not None:
                x, y, width, height = place[:4]
                left, bottom = max(x - dp(3), dp(2)), max(y - dp(3), dp(2))          # around it, but in the window
                right, top = min(x + width + dp(3), Window.width - dp(2)), min(y + height + dp(3), Window.height - dp(2))
                with Window.canvas.after:
                    self._ring = (Color(rgba=tk.ink), SmoothLine(
                        width=dp(1.5), rounded_rectangle=(left, bottom, right - left, top - bottom, dp(12))))

    def _clear(self) -> None:
        if self._shown is not None:
            for part in self._ring:
                Window.canvas.after.remove(part)
        self._shown = None
