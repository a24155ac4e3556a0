"""The robot on its own map: its picture, planned path, robot with its heading."""

from itertools import pairwise
from math import cos, hypot, pi, radians, sin

from kivy.graphics import (
    Color,
    Mesh,
    Rectangle,
    RoundedRectangle,
    SmoothLine,
    StencilPop,
    StencilPush,
    StencilUnUse,
    StencilUse,
)
from kivy.graphics.texture import Texture
from kivy.metrics import dp, sp
from kivy.properties import ListProperty, NumericProperty, ObjectProperty, StringProperty

from app.widgets.chart import Chart
from app.widgets.tokens import tk


def ground(picture):
    """Texture of a map that has a ``size`` and a ``shade`` of one byte per pixel: white, as opaque as there are walls."""
    texture = Texture.create(size=picture.size, colorfmt="rgba")

    def fill(texture):
        pixels = bytearray(b"\xff" * (4 * len(picture.shade)))  # 1.4 MB of a usual map, not kept
        pixels[3::4] = picture.shade
        texture.blit_buffer(bytes(pixels), colorfmt="rgba", bufferfmt="ubyte")

    fill(texture)
    texture.add_reload_observer(fill)  # a tablet may lose its graphics while it sleeps
    return texture


class RobotMap(Chart):
    """Coordinates are fractions of the map, origin bottom left; ``heading`` in degrees, 0 = right, anticlockwise.

    The background is a ``texture`` whose alpha shows the walls (the theme colours it). ``places`` (x, y, name) are shown unless they
    overlap each other or the robot; ``path`` = points still to drive, the last one is the goal; ``label`` is at the goal, or without one at
    the robot; ``at`` empty = position unknown; The map keeps its proportions (``aspect`` = height /
    width); without enough room it is cropped around the robot.
    """

    tone = StringProperty("accent")
    at = ListProperty()
    heading = NumericProperty(0)
    path = ListProperty()
    texture = ObjectProperty(None, allownone=True)
    aspect = NumericProperty(0.385)
    places = ListProperty()
    label = StringProperty()
    watch = ("tone", "at", "heading", "path", "texture", "aspect", "places", "label")

    def draw(self):
        self._place_map()
        clip = {"pos": self.pos, "size": self.size, "radius": [dp(12)]}
        StencilPush()
        RoundedRectangle(**clip)
        StencilUse()
        self._ground()
        self._names()
        if self.path:
            self._goal([self._point(x, y) for x, y in self.path])
        if self.at:
            self._robot(*self._point(*self.at), self.heading, self.tone)
        if self.label:
            self._plate(self._label_area(), self.label, tk.ink, ring=True)
        StencilUnUse()
        RoundedRectangle(**clip)
        StencilPop()
        self.box(*self.pos, *self.size, tk.map_wall, dp(12), ring=2)

    def _place_map(self):
        """Fill the widget, with the robot visible, and the goal as well if both fit."""
        self._wide = max(self.width, self.height / self.aspect)
        self._high = self._wide * self.aspect
        x, y = self.at or (0.5, 0.5)
        goal_x, goal_y = self.path[-1] if self.path else (x, y)
        self._x0 = self.x + self._shift(self.width, self._wide, x, goal_x)
        self._y0 = self.y + self._shift(self.height, self._high, y, goal_y)

    @staticmethod
    def _shift(room, length, at, goal):
        """Offset of a map of ``length`` in ``room``: centred between both points, with the robot's circle inside the edge."""
        least = max(0, room / 2 - dp(26))
        middle = length * at + min(least, max(-least, length * (goal - at) / 2))
        return min(0, max(room - length, room / 2 - middle))

    def _point(self, x, y):
        return self._x0 + self._wide * x, self._y0 + self._high * y

    def _ground(self):
        self.box(*self.pos, *self.size, tk.map_floor)
        if self.texture is not None:
            Color(*tk.map_wall)
            Rectangle(pos=(self._x0, self._y0), size=(self._wide, self._high), texture=self.texture)

    def _names(self):
        """Labels of places, without those that would overlap another, the robot or the goal."""
        taken = [
            *([self._label_area()] if self.label else []),
            *(self._around(*self._point(*point), dp(17)) for point in self._marked()),
        ]
        for place in self.places:
            px, py = self._point(place.x, place.y)
            half, high = self.width_of(place.name) / 2, sp(9)
            if not (
                self.x < px < self.right and self.y + high + dp(3) < py < self.top - high - dp(3)
            ) or 2 * half > self.width - dp(12):
                continue
            px = min(max(px, self.x + half + dp(6)), self.right - half - dp(6))
            plate = px - half - dp(3), py - high, px + half + dp(3), py + high
            if not any(touch_each_other(plate, other) for other in taken):
                taken.append(plate)
                self._plate(plate, place.name, tk.ink2)

    def _label_area(self):
        """Beside the goal's pin or the robot, where there is room."""
        x, y = self._point(*self.path[-1]) if self.path else self._point(*(self.at or (0.5, 0.5)))
        wide, high = self.width_of(self.label) + dp(16), sp(26)
        left = x - dp(18) - wide if x - dp(18) - wide > self.x + dp(4) else x + dp(18)
        low = min(max(y + dp(11) - high / 2, self.y + dp(4)), self.top - high - dp(4))
        return left, low, left + wide, low + high

    def _marked(self):
        """Points that no label may cover."""
        return [point for point in (self.at, *self.path[-1:]) if point]

    def _plate(self, area, name, colour, ring=False):
        left, bottom, right, top = area
        self.box(left, bottom, right - left, top - bottom, tk.map_floor, dp(4), alpha=1.0 if ring else 0.82)
        if ring:
            self.box(left, bottom, right - left, top - bottom, tk.map_wall, dp(4), ring=1)
        self.text(name, (left + right) / 2, (bottom + top) / 2, colour, 14, 0.5)

    @staticmethod
    def _around(x, y, reach):
        return x - reach, y - reach, x + reach, y + reach

    def _robot(self, x, y, heading, tone):
        colour = getattr(tk, tone)
        self.box(x - dp(20), y - dp(20), dp(40), dp(40), colour, dp(20), alpha=0.18)
        self.box(x - dp(14), y - dp(14), dp(28), dp(28), tk.map_floor, dp(14))
        self.box(x - dp(12), y - dp(12), dp(24), dp(24), colour, dp(12))
        turn = radians(heading)
        arrow = [
            (x + cos(turn + angle) * dp(reach), y + sin(turn + angle) * dp(reach))
            for reach, angle in ((8, 0), (7.5, 2.4), (3, pi), (7.5, -2.4))
        ]
        Color(*tk.map_floor)
        Mesh(vertices=[c for point in arrow for c in (*point, 0, 0)], indices=[0, 1, 2, 0, 2, 3], mode="triangles")
        for a, b in zip(arrow, [*arrow[1:], arrow[0]], strict=True):
            SmoothLine(points=[*a, *b], width=dp(0.5))

    def _goal(self, points):
        """Dots at equal distances along the whole path, and a pin at its end."""
        step, next_dot, drawn = dp(9), dp(22), 0.0
        for (x1, y1), (x2, y2) in pairwise(points):
            length = hypot(x2 - x1, y2 - y1)
            while length and next_dot <= drawn + length:
                part = (next_dot - drawn) / length
                self.box(x1 + (x2 - x1) * part - dp(2), y1 + (y2 - y1) * part - dp(2), dp(4), dp(4), tk.accent, dp(2))
                next_dot += step
            drawn += length
        x, y = points[-1]
        if not (self.x < x < self.right and self.y < y < self.top - dp(26)):
            return  # the pin would be cut off
        self.box(x - dp(3), y - dp(3), dp(6), dp(6), tk.accent, dp(3))
        self.icon("map-marker", x, y + dp(11), tk.accent, 26)


class WholeMap(RobotMap):
    """All of the map, never cropped, with every robot on it, and a scale; ``metres`` is the map's width. ``robots`` = (x, y, heading,
    tone, name): the first is uppermost. A name is shown where it has room above or below its robot and covers neither a name nor a robot
    before it."""

    robots = ListProperty()
    metres = NumericProperty(0)
    watch = (*RobotMap.watch, "robots", "metres")

    def _place_map(self):
        self._wide = min(self.width, self.height / self.aspect)
        self._high = self._wide * self.aspect
        self._x0, self._y0 = self.center_x - self._wide / 2, self.center_y - self._high / 2

    def _marked(self):
        return [(robot.x, robot.y) for robot in self.robots]

    def _names(self):
        super()._names()
        for robot in reversed(self.robots):
            self._robot(*self._point(robot.x, robot.y), robot.heading, robot.tone)
        taken = []
        for robot in self.robots:  # above all robots
            x, y = self._point(robot.x, robot.y)
            half = self.width_of(robot.name) / 2 + dp(4)
            x = min(max(x, self.x + half + dp(4)), self.right - half - dp(4))
            areas = [(x - half, low, x + half, low + sp(20)) for low in (y - dp(22) - sp(20), y + dp(22))]
            area = next(
                (
                    area
                    for area in areas
                    if self.y < area[1]
                    and area[3] < self.top
                    and not any(touch_each_other(area, other) for other in taken)
                ),
                None,
            )
            if area is not None:
                self._plate(area, robot.name, tk.ink, ring=True)
                taken.append(area)
            taken.append(self._around(*self._point(robot.x, robot.y), dp(12)))
        if self.metres > 0:
            self._scale()

    def _scale(self):
        """A round number of metres, about a tenth of the map."""
        length = self._scale_length()
        wide, (left, low, right, top) = self._wide * length / self.metres, self._scale_area()
        self.box(left, low, right - left, top - low, tk.map_floor, dp(4))
        self.box(right - dp(8) - wide, low + dp(8), wide, dp(4), tk.ink)
        self.text(f"{length:g} m", (left + right) / 2, low + dp(16) + sp(9), tk.ink, 14, 0.5)

    def _scale_length(self):
        return next(step for step in (0.5, 1, 2, 5, 10, 20, 50, 100, 200, 500, self.metres) if 12 * step >= self.metres)

    def _scale_area(self):
        length, right, low = self._scale_length(), self.right - dp(8), self.y + dp(8)
        reach = max(self._wide * length / self.metres, self.width_of(f"{length:g} m"))
        return right - reach - dp(16), low, right, low + sp(20) + dp(20)


def touch_each_other(a, b):
    """Whether two areas (left, bottom, right, top) overlap."""
    return a[0] < b[2] and b[0] < a[2] and a[1] < b[3] and b[1] < a[3]
