"""Positions chosen on the map that a robot is on."""

from collections import Counter
from functools import partial
from math import hypot
from typing import NamedTuple

from kivy.metrics import dp, sp
from kivy.properties import AliasProperty, BooleanProperty, ListProperty, ObjectProperty, StringProperty

from app.widgets import load_kv
from app.widgets.around import around
from app.widgets.buttons import CommandButton
from app.widgets.choices import Picker
from app.widgets.places import places
from app.widgets.robot_map import WholeMap, ground, touch_each_other
from app.widgets.sheet import Sheet
from app.widgets.tokens import tk


class Spot(NamedTuple):
    """A position on the map, in fractions of it."""

    key: object
    x: float
    y: float
    name: str


class PositionsMap(WholeMap):
    """Of the ``places``, each a Spot, the one nearest to the finger is ``chosen``, also while it moves. Keys press one
    of them: ``on_spot(key)``."""

    chosen = ObjectProperty(None, allownone=True)
    watch = (*WholeMap.watch, "chosen")
    keeps_drag = True

    __events__ = ("on_spot",)

    stands = True

    def __init__(self, **kwargs):
        super().__init__(**kwargs)
        places.watch(self)

    def seats(self):
        """The positions, with a ring that covers no name; the chosen one, or else the first, is a tab stop."""
        stop = self.chosen if self.chosen is not None or not self.places else self.places[0].key
        points = {place.key: self._around(*self._point(place.x, place.y), dp(9)) for place in self.places}
        return self.seats_at(
            {key: (("on_spot", key), edges[:2], (dp(18), dp(18)), key == stop) for key, edges in points.items()}
        )

    def on_touch_down(self, touch):
        if places.misses(self, touch):
            return True
        if not self.collide_point(*touch.pos) or touch.is_mouse_scrolling:
            return super().on_touch_down(touch)
        touch.grab(self)
        self._choose_at(*touch.pos)
        return True

    def on_touch_move(self, touch):
        if touch.grab_current is self:
            self._choose_at(*touch.pos)
        return super().on_touch_move(touch)

    def on_touch_up(self, touch):
        if touch.grab_current is self:
            touch.ungrab(self)
        return super().on_touch_up(touch)

    def let_go(self, touch):
        """The finger is for something in front now; what it has marked stays marked."""
        touch.ungrab(self)

    def _choose_at(self, x, y):
        def away(place):
            px, py = self._point(place.x, place.y)
            return hypot(px - x, py - y)

        nearest = min(self.places, key=away, default=None)
        if nearest is not None and away(nearest) <= tk.h_touch:
            self.chosen = nearest.key

    def _names(self):
        if self.metres > 0:
            self._scale()
        plates = self.plates()
        for place in sorted(self.places, key=lambda place: place.key == self.chosen):  # the chosen one above all others
            is_chosen = place.key == self.chosen
            if is_chosen:
                self._spot(place, dp(22), tk.accent, alpha=0.25)
            self._spot(place, dp(11) if is_chosen else dp(6), tk.accent)
            if is_chosen:
                self._spot(place, dp(4), tk.map_floor)
            if place.key in plates:
                self._plate(plates[place.key], place.name, tk.ink, ring=is_chosen)

    def _spot(self, place, reach, colour, alpha=1.0):
        x, y = self._point(place.x, place.y)
        self.box(x - reach, y - reach, 2 * reach, 2 * reach, colour, reach, alpha=alpha)

    def plates(self):
        """Where names are written, (left, bottom, right, top) by key: next to their positions, without overlaps.
        Names without room are omitted, as are those in the way of the chosen one; none moves when another position
        is chosen."""
        found = {}
        taken = [self._around(*self._point(place.x, place.y), dp(6)) for place in self.places]
        taken += [self._scale_area()] if self.metres > 0 else []
        for place in self.places:
            free = next(
                (
                    plate
                    for plate in self._plates_around(place)
                    if not any(touch_each_other(plate, other) for other in (*taken, *found.values()))
                ),
                None,
            )
            if free is not None:
                found[place.key] = free
        for place in self.places:
            if (
                place.key == self.chosen
                and place.key not in found
                and (plate := next(iter(self._plates_around(place)), None))
            ):
                found = {key: other for key, other in found.items() if not touch_each_other(other, plate)} | {
                    place.key: plate
                }
        return found

    def _plates_around(self, place):
        """On the map under it, above it, to the right or to the left; at the map's edge moved inwards."""
        x, y = self._point(place.x, place.y)
        wide, high, gap = self.width_of(place.name) + dp(8), sp(20), dp(13)
        left = max(self.x, min(x - wide / 2, self.right - wide))
        for corner in (
            (left, y - gap - high),
            (left, y + gap),
            (x + gap, y - high / 2),
            (x - gap - wide, y - high / 2),
        ):
            plate = *corner, corner[0] + wide, corner[1] + high
            if self.x <= plate[0] and plate[2] <= self.right and self.y <= plate[1] and plate[3] <= self.top:
                yield plate


class PositionSheet(Picker):
    """Of the ``places`` of the map's ``picture`` one is ``chosen``; it picks its key when that is confirmed."""

    scrolls = BooleanProperty(False)
    picture = ObjectProperty(None)
    texture = ObjectProperty(None)
    places = ListProperty()
    chosen = ObjectProperty(None, allownone=True)
    name = StringProperty()  # of the chosen one

    def __init__(self, picture, **kwargs):
        load_kv("widgets/positions")
        super().__init__(picture=picture, texture=ground(picture), **kwargs)

    def name_of(self, places, chosen):
        return next((place.name for place in places if place.key == chosen), "")

    def press(self, key):
        """By keys: mark it, or confirm it if it is marked already."""
        if key == self.chosen:
            self.on_done()
        else:
            self.chosen = key

    def on_done(self):
        self.dispatch("on_pick", self.chosen)


class OnMap(CommandButton):
    """Opens the ``map`` to choose one of the ``options`` [(key, name), …] there; visible if the map has one of them.
    Ambiguous names are ignored."""

    label = StringProperty()
    map = ObjectProperty(None, allownone=True)  # picture with name, aspect, extent and places
    options = ListProperty()
    chosen = ObjectProperty(None, allownone=True)

    def _get_places(self):
        shown = self.map.places if self.map is not None else ()
        there, offered = Counter(place.name for place in shown), Counter(name for _key, name in self.options)
        keys = {name: key for key, name in self.options if there[name] == offered[name] == 1}
        return [Spot(keys[place.name], place.x, place.y, place.name) for place in shown if place.name in keys]

    places = AliasProperty(_get_places, bind=("map", "options"))

    def on_release(self):
        sheet = PositionSheet(self.map, title=self.label, places=self.places, chosen=self.chosen)
        next(around(self, Sheet)).stack.pick(sheet, partial(setattr, self, "chosen"))
