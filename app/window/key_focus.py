"""The window by keys alone: Tab and the arrows go from target to target, Enter or the space bar presses the one in the ring."""

import math
from datetime import timedelta

from kivy.clock import Clock
from kivy.core.window import Window
from kivy.graphics import Color, SmoothLine
from kivy.metrics import dp
from kivy.uix.behaviors import ButtonBehavior
from kivy.uix.screenmanager import Screen
from kivy.uix.scrollview import ScrollView

from app.widgets.around import around
from app.widgets.chart import Chart, KeySeat
from app.widgets.choices import ChoiceSheet
from app.widgets.display import SectionCard
from app.widgets.dock import dock
from app.widgets.fields import FieldInput
from app.widgets.keyboard import DockedKeyboard
from app.widgets.long_list import LongList, Seat
from app.widgets.menu import Menu
from app.widgets.month import MonthDay, MonthGrid
from app.widgets.places import places
from app.widgets.rest import SETTLES, rest
from app.widgets.sheet import Finds, Sheet
from app.widgets.surfaces import Passive
from app.widgets.tokens import tk

TAB, ENTER, KEYPAD_ENTER, ESCAPE, SPACE = 9, 13, 271, 27, 32
PRESSES = (ENTER, KEYPAD_ENTER, SPACE)
ARROWS = {273: (0, 1), 274: (0, -1), 275: (1, 0), 276: (-1, 0)}  # key: direction
DOWN = 274


def parents(widget) -> list:
    """``widget`` and its ancestors, up to the child of the window; empty if it is not in the window."""
    found = list(around(widget))
    return found if found and found[-1].parent is Window else []


def _list_of(widget):
    """The long list that it is in, or None."""
    return next(around(widget, LongList), None)


def _row_of(widget):
    """The long list's row that it is or is inside, or None."""
    return next((each for each in around(widget) if isinstance(each.parent, Seat)), None)


def _middle(target) -> tuple[float, float]:
    """Of the window, px."""
    return target.to_window(*target.center)


def _away(target, place) -> float:
    """How far it is from that place of the window, px."""
    (x, y), (left, bottom) = place, target.to_window(*target.pos)
    return math.hypot(max(left - x, x - left - target.width, 0), max(bottom - y, y - bottom - target.height, 0))


def _around(target) -> tuple[float, float, float, float]:
    """x, y, width, height of the ring: around the target, but in the window, and not on its card's border."""
    x, y = target.to_window(*target.pos)
    left, bottom = max(x - dp(3), dp(2)), max(y - dp(3), dp(2))
    right, top = (
        min(x + target.width + dp(3), Window.width - dp(2)),
        min(y + target.height + dp(3), Window.height - dp(2)),
    )
    for card in around(target.parent, SectionCard):
        (low, base), edge = card.to_window(*card.pos), dp(6)
        left, bottom = max(left, low + edge), max(bottom, base + edge)
        right, top = min(right, low + card.width - edge), min(top, base + card.height - edge)
    return left, bottom, right - left, top - bottom


def _covers(sheet, target) -> bool:
    """Whether it lies over a part of it; what scrolls is covered with all that is in it, or the ring could scroll under it."""
    view = [target, *around(target, ScrollView)][-1]
    (left, bottom), (x, y) = sheet.to_window(*sheet.pos), view.to_window(*view.pos)
    is_beside = x + view.width <= left + 1 or x >= left + sheet.width - 1
    return not (is_beside or y + view.height <= bottom + 1 or y >= bottom + sheet.height - 1)


def _reveal(target) -> None:
    """Scroll what it is in."""
    for view in parents(target)[1:]:
        if isinstance(view, LongList):
            view.reveal(_row_of(target).key)
        elif isinstance(view, ScrollView) and any(
            inside.height > view.height or inside.width > view.width for inside in view.children
        ):
            view.scroll_to(target, padding=dp(24), animate=False)
            view.update_from_scroll()  # now: in the next frame it would be another move, which scrolls again


def _far(target, other, right, up) -> float:
    """The distance of the other one in that direction, from edge to edge; a sideways offset counts twice. With equal
    distances, the one best in line; infinite: not in that direction."""
    (x, y), (left, bottom) = target.to_window(*target.pos), other.to_window(*other.pos)
    spans = [
        ((x, x + target.width), (left, left + other.width)),
        ((y, y + target.height), (bottom, bottom + other.height)),
    ]
    (own, its), (own_side, its_side) = spans if right else spans[::-1]
    middles = (sum(its) - sum(own)) / 2 * (right + up)
    if middles <= 1:
        return math.inf
    ahead = max(its[0] - own[1], own[0] - its[1])
    aside = max(0, its_side[0] - own_side[1], own_side[0] - its_side[1])
    return (ahead if ahead >= 0 else middles) + 2 * aside + abs(sum(its_side) - sum(own_side)) / 20


class KeyFocus:
    """Active from ``start`` to ``stop``. Only the topmost layer is reached: a dialog's targets, else the screen's that no
    sheet covers. A touch ends it. The ring goes into a sheet or menu that Enter has opened, but into no question. When
    what keys have opened closes, the ring continues at the widget that opened it, or its successor; what goes away leaves
    it to what is nearest there, as long as the page stays. Enter presses the
    widget with the ring before the dialog's own action; all other keys go to the dialog first. A held key presses once.
    """

    def __init__(self) -> None:
        self.target = None  # what has the ring
        self._path: list = []  # what that is in
        self._place = 0.0, 0.0  # its middle
        self._left: list = []  # what had it on the page before, or below the sheet
        self._pressed: tuple = ()  # what Enter pressed last on the page or a sheet, and what was open then
        self._openers: list = []  # (dialog, the widget with the ring when it opened, and its place; or None, None)
        self._shown = None
        self._follow = Clock.create_trigger(self._draw, 0, interval=True)

    def start(self) -> None:
        Window.bind(
            on_key_down=self._key_down, on_keyboard=self._key, on_touch_down=self._touched, children=self._tops_changed
        )
        dock.bind(question=self._tops_changed)
        rest.ask_first()

    def stop(self) -> None:
        Window.unbind(
            on_key_down=self._key_down, on_keyboard=self._key, on_touch_down=self._touched, children=self._tops_changed
        )
        dock.unbind(question=self._tops_changed)
        self.forget()
        self._openers.clear()

    def forget(self) -> None:
        self.target = None
        self._path, self._pressed = [], ()
        self._left.clear()
        self._follow.cancel()
        self._clear()

    def targets(self) -> list:
        """What can be pressed or typed into now, in the order of the tree, rows of lists from above."""
        return [widget for widget in self._reached() if not widget.disabled]

    def _reached(self) -> list:
        """The same with what is disabled."""
        tops = [top for top in Window.children if not isinstance(top, DockedKeyboard) and getattr(top, "is_open", True)]
        question = dock.question if parents(dock.question) else None
        front = next((top for top in tops if isinstance(top, Menu)), question or tops[-1])
        above = tops[: tops.index(front)] if front in tops else tops[:-1]
        found = []
        waiting = [front, *above[::-1]]  # messages above it come last
        while waiting:
            widget = waiting.pop(0)
            if not widget.opacity or widget.width < 1 or widget.height < 1:
                continue
            presses = isinstance(widget, ButtonBehavior) and not isinstance(widget, Passive | Menu)
            presses = presses and getattr(widget, "can_press", True)
            if presses or isinstance(widget, FieldInput):
                found.append(widget)
            waiting[:0] = (
                widget.views
                if isinstance(widget, LongList)
                else widget.seats()
                if isinstance(widget, Chart)
                else widget.children[::-1]
            )
        for at, widget in enumerate(found):
            for sheet in around(widget, Sheet):
                return [*(below for below in found[:at] if not _covers(sheet, below)), *found[at:]]
        return found

    def _opened(self):
        """The sheet or menu that is open, or None."""
        tops = (each for target in self.targets() for each in around(target) if isinstance(each, Menu | Sheet))
        return next(tops, None)

    # ------------------------------------------------------------------ keys
    def _key_down(self, _window, key, _scancode=None, _text=None, modifiers=()):
        """Before fields and dialogs see the key."""
        if dock.field is not None:  # kivy's Tab goes to fields only, past the buttons; Enter in one is not a press
            if key == TAB:
                self.target = dock.field
                self._step(-1 if "shift" in modifiers else 1)
            return key == TAB or self._key_in_search(key)
        if key not in PRESSES or isinstance(self.target, FieldInput) or self.target not in self.targets():
            return False
        if (
            not places.has_just_moved(self.target)
            and self.target.state == "normal"
            and not getattr(self.target, "busy", False)
        ):
            if not self._openers:  # what is chosen there may open something instead of them
                self._pressed = self.target, self._opened()
            self.target.trigger_action(0.1)
        return True

    def _key_in_search(self, key) -> bool:
        """In a sheet with options: Down leads to the first hit, and so does Enter, which chooses the only one."""
        choice = next(around(dock.field, Finds), None)
        if choice is None or key not in (DOWN, ENTER, KEYPAD_ENTER):
            return False
        found = choice.found()
        if len(found) == 1 and key != DOWN:
            choice.chosen(found[0].key)
        elif found:
            self._reveal_row(choice.ids.option_list.__self__, found[0].key, _middle(dock.field)[0])
        return True

    def _key(self, _window, key, _scancode=None, _text=None, modifiers=()):
        if dock.field is not None:
            return False
        if key == TAB:
            self._step(-1 if "shift" in modifiers else 1)
        elif key in ARROWS:
            self._turn(*ARROWS[key])
        elif key == ESCAPE and self.target is not None:
            self.forget()
        else:
            return False
        return True

    def _touched(self, *_args):
        if self.target is not None:
            self.forget()

    def _tops_changed(self, *_args):
        known = [dialog for dialog, _target, _place in self._openers]
        tops = [*(top for top in Window.children if isinstance(top, Menu)), *filter(None, [dock.question])]
        new = next((top for top in tops if top not in known), None)
        if new is not None:
            self._openers.append((new, self.target, _middle(self.target) if parents(self.target) else None))
            self._clear()  # behind it
        else:
            self._come_back()

    def _step(self, by) -> None:
        self._come_back()
        reached = self._reached()
        at = reached.index(self.target) if self.target in reached else -1 if by > 0 else len(reached)
        following = reached[at + by] if 0 <= at + by < len(reached) else None
        if self.target in reached and self._turn_list(by, following, 0 if by > 0 else Window.width):
            return  # of a row below a dialog nothing follows
        for n in range(1, len(reached) + 1):
            target = reached[(at + n * by) % len(reached)]
            is_beside = isinstance(target, MonthDay) and self.target in target.parent.children
            if not target.disabled and getattr(target, "is_tab_stop", True) and not is_beside:
                self._go(target)
                return

    def _turn(self, right, up) -> None:
        """To the nearest target in that direction; from a place on a chart to another one there, if there is one."""
        self._come_back()
        targets = self.targets()
        if self.target not in targets:
            if not self._go_to_chosen(targets):
                self._step(1)
            return
        if isinstance(self.target, MonthDay):
            self._turn_day(right - 7 * up)
            return
        far = {target: away for target in targets if (away := _far(self.target, target, right, up)) < math.inf}
        siblings = [target for target in far if isinstance(target, KeySeat) and target.parent is self.target.parent]
        found = min(siblings or far, key=far.__getitem__, default=None)
        if (
            not (up and self._turn_list(-up, found, self.target.to_window(*self.target.center)[0]))
            and found is not None
        ):
            self._go(found)

    def _go_to_chosen(self, targets) -> bool:
        """In a dialog with a choice: to the present one, or to the first of a list."""
        asked = next((each for target in targets[:1] for each in around(target) if each is dock.question), None)
        if isinstance(asked, ChoiceSheet) and (options := asked.found()):
            chosen = next((option for option in options if option.key in asked.selected), options[0])
            self._reveal_row(asked.ids.option_list.__self__, chosen.key, asked.center_x)
            return True
        day = next((target for target in targets if isinstance(target, MonthDay) and target.item.chosen), None)
        if day is not None:
            self._go(day)
        return day is not None

    def _turn_day(self, days: int) -> None:
        """To the day so many days later, in another month too, unless it can't be chosen."""
        grid, before = next(around(self.target, MonthGrid)), self.target.item.day
        day = before + timedelta(days)
        months = 12 * (day.year - before.year) + day.month - before.month
        grid.dispatch("on_turn", months)
        Clock.schedule_once(lambda _dt: self._go_to_day(grid, day, months), 0)

    def _go_to_day(self, grid, day, months: int) -> None:
        found = next((each for each in self.targets() if isinstance(each, MonthDay) and each.item.day == day), None)
        if found is None:
            grid.dispatch("on_turn", -months)
        else:
            self._go(found)

    def _turn_list(self, by: int, following, x: float) -> bool:
        """Whether the ring goes to a long list's row that does not exist yet, as ``following`` is outside the list; to
        the widget nearest to ``x`` of the window there."""
        rows, row = _list_of(self.target), _row_of(self.target)
        key = rows.next_key(row.key, by) if rows is not None and row is not None else None
        if key is None or (following is not None and (_list_of(following) is rows)):
            return False
        self._reveal_row(rows, key, x)
        return True

    def _reveal_row(self, rows, key, x) -> None:
        rows.reveal(key)
        Clock.schedule_once(lambda _dt: self._go_to_row(rows, key, x), 0)

    def _go_to_row(self, rows, key, x) -> None:
        found = [target for target in self.targets() if _list_of(target) is rows and _row_of(target).key == key]
        if found:
            self._go(min(found, key=lambda target: abs(target.to_window(*target.center)[0] - x)))

    def _come_back(self) -> None:
        """To the widget that opened the closed dialog, or that had the ring on the page that has returned."""
        opener = place = None
        while self._openers and not (parents(self._openers[-1][0]) and getattr(self._openers[-1][0], "is_open", True)):
            _dialog, opener, place = self._openers.pop()
        if place is not None and self.target is not None and self.target not in (reached := self._reached()):
            self.target = (
                opener if opener in reached or self._has_opened(opener) else self._nearest(place) or self.target
            )
        while self._left and not self._openers and not (parents(self.target) and self.target in self._reached()):
            self.target = self._left.pop()

    def _nearest(self, place):
        """The widget at that place, or next to it; None if there is none."""
        near = min(self.targets(), key=lambda target: _away(target, place), default=None)
        return near if near is not None and _away(near, place) <= tk.h_touch else None

    def _nearest_remaining(self):
        """Where the one with the ring has gone, but not its page: what is nearest, in what it was in; or None."""
        left = next((each for each in self._path if parents(each)), None)
        if next(around(left, Screen), None) is None:
            return None
        near = (target for target in self.targets() if left in around(target))
        return min(near, key=lambda target: _away(target, self._place), default=None)

    def _has_opened(self, target) -> bool:
        """Enter on it has opened something."""
        return target in self._pressed[:1] and self._opened() not in (None, self._pressed[1])

    def _go_in(self) -> None:
        """Move the ring into the sheet or menu that is open, past its head, but into no question; else to the widget
        that receives it (``receives_ring``) on the page that has replaced the one with the ring. It returns from there."""
        reached, opened = self._reached(), self._opened()
        if opened is None:
            inside = [target for target in reached if getattr(target, "receives_ring", False)]
        elif isinstance(opened, Menu) or opened.is_picker or not opened.is_question:
            inside = [target for target in reached if opened in around(target)]
        else:
            return
        head = opened.ids.head.__self__ if isinstance(opened, Sheet) else None
        if inside:
            rest.ignore_keys(SETTLES)  # a second Enter is not meant for what is in it
            if not self._openers:  # they know where it returns to
                self._left.append(self.target)
            past = [target for target in inside if head not in around(target)]
            self.target = min(past or inside, key=lambda target: target.disabled)  # the first one, off if all are
            if opened is dock.question is not None:
                self._go_to_chosen(self.targets())

    def _go(self, target) -> None:
        if dock.field is not None:
            dock.field.focus = False
        top = parents(target)[-1:]
        if self.target is not None and top != parents(self.target)[-1:] and not isinstance(top[0], Menu):
            self._left.append(self.target)
        self.target = target
        _reveal(target)
        if isinstance(target, FieldInput):
            target.focus = True  # which shows it in its own way
            target.select_all()
        self._follow()

    # ------------------------------------------------------------------ the ring
    def _draw(self, _dt) -> None:
        if not parents(self.target):
            self._come_back()
        if not parents(self.target) or self._has_opened(self.target):
            self._go_in()
        if not (parents(self.target) or self._openers):
            rest.ignore_keys(SETTLES)  # a second Enter was meant for what has gone
            self.target = self._nearest_remaining()
        target = self.target
        if target is None:
            self.forget()
            return
        if path := parents(target):
            self._path, self._place = path, _middle(target)
        seen = target in self.targets() and dock.field is None  # else keys go to the field
        place = (*_around(target), *tk.ink) if seen else None
        if place != self._shown:
            if seen and self._shown is not None:
                _reveal(target)  # it has moved: its action may have pushed it out of sight
                place = (*_around(target), *tk.ink)
            self._clear()
            self._shown = place
            if place is not None:
                width, outline = dp(3 if tk.strong else 1.5), {"rounded_rectangle": (*place[:4], dp(12))}
                with Window.canvas.after:  # light and dark: one of them is seen, on a card as on a red banner
                    self._ring = (
                        Color(rgba=tk.surface),
                        SmoothLine(width=width + dp(1.5), **outline),
                        Color(rgba=tk.ink),
                        SmoothLine(width=width, **outline),
                    )

    def _clear(self) -> None:
        if self._shown is not None:
            for part in self._ring:
                Window.canvas.after.remove(part)
        self._shown = None
