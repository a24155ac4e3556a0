"""The robot on its own map: map picture or drawn plan, planned path, robot with its heading."""
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
from kivy.metrics import dp
from kivy.properties import ListProperty, NumericProperty, ObjectProperty, StringProperty

from app.widgets.chart import Chart
from app.widgets.tokens import tk


class RobotMap(Chart):
    """Coordinates are fractions of the map, origin bottom left; ``heading`` in degrees, 0 = right, anticlockwise.

    The ground is a ``texture`` (the robot's own map picture), or drawn from ``walls`` and ``racks`` = [(x, y, width, height)].
    ``places`` = [(x, y, name)]; ``path`` = points still to drive; ``at`` empty = position unknown. The map keeps its proportions
    (``aspect`` = height / width); where room is short it is cut around the robot.
    """
    tone = StringProperty("accent")
    at = ListProperty()
    heading = NumericProperty(0)
    path = ListProperty()
    texture = ObjectProperty(None, allownone=True)
    aspect = NumericProperty(.385)
    walls = ListProperty()
    racks = ListProperty()
    places = ListProperty()
    watch = ("tone", "at", "heading", "path", "texture", "aspect", "walls", "racks", "places")

    def draw(self):
        self._place_map()
        clip = {"pos": self.pos, "size": self.size, "radius": [dp(12)]}
        StencilPush()
        RoundedRectangle(**clip)
        StencilUse()
        self._ground()
        if self.path:
            self._goal([self._point(x, y) for x, y in self.path])
        if self.at:
            self._robot(*self._point(*self.at))
        StencilUnUse()
        RoundedRectangle(**clip)
        StencilPop()
        self.box(*self.pos, *self.size, tk.map_wall, dp(12), ring=2)

    def _place_map(self):
        """Fill the width or the height, whichever leaves nothing empty, and keep the robot in sight."""
        self._wide = max(self.width, self.height / self.aspect)
        self._high = self._wide * self.aspect
        x, y = self.at or (.5, .5)
        self._x0 = self.x + min(0, max(self.width - self._wide, self.width / 2 - self._wide * x))
        self._y0 = self.y + min(0, max(self.height - self._high, self.height / 2 - self._high * y))

    def _point(self, x, y):
        return self._x0 + self._wide * x, self._y0 + self._high * y

    def _ground(self):
        self.box(*self.pos, *self.size, tk.map_floor)
        if self.texture is not None:
            shade = .82 if tk.theme == "dark" else 1
            Color(shade, shade, shade, 1)
            Rectangle(pos=(self._x0, self._y0), size=(self._wide, self._high), texture=self.texture)
        for parts, colour, least, corner in ((self.racks, tk.map_rack, 0, dp(2)), (self.walls, tk.map_wall, dp(2), 0)):
            for x, y, w, h in parts:
                self.box(*self._point(x, y), max(least, self._wide * w), max(least, self._high * h), colour, corner)
        for x, y, name in self.places:
            px, py = self._point(x, y)
            if self.y + dp(12) < py < self.top - dp(12):              # no name cut in two
                self.text(name, px, py, tk.ink2, 14, .5)

    def _robot(self, x, y):
        colour = getattr(tk, self.tone)
        self.box(x - dp(20), y - dp(20), dp(40), dp(40), colour, dp(20), alpha=.18)
        self.box(x - dp(14), y - dp(14), dp(28), dp(28), tk.map_floor, dp(14))
        self.box(x - dp(12), y - dp(12), dp(24), dp(24), colour, dp(12))
        turn = radians(self.heading)
        arrow = [(x + cos(turn + angle) * dp(reach), y + sin(turn + angle) * dp(reach))
                 for reach, angle in ((8, 0), (7.5, 2.4), (3, pi), (7.5, -2.4))]
        Color(*tk.map_floor)
        Mesh(vertices=[c for point in arrow for c in (*point, 0, 0)], indices=[0, 1, 2, 0, 2, 3], mode="triangles")
        for a, b in zip(arrow, [*arrow[1:], arrow[0]], strict=True):
            SmoothLine(points=[*a, *b], width=dp(.5))

    def _goal(self, points):
        """Dots at equal steps along the whole path, so that corners do not break the rhythm, and a pin at its end."""
        step, next_dot, gone = dp(9), dp(22), 0.
        for (x1, y1), (x2, y2) in pairwise(points):
            length = hypot(x2 - x1, y2 - y1)
            while length and next_dot <= gone + length:
                part = (next_dot - gone) / length
                self.box(x1 + (x2 - x1) * part - dp(2), y1 + (y2 - y1) * part - dp(2), dp(4), dp(4), tk.accent, dp(2))
                next_dot += step
            gone += length
        x, y = points[-1]
        self.box(x - dp(3), y - dp(3), dp(6), dp(6), tk.accent, dp(3))
        self.icon("map-marker", x, y + dp(11), tk.accent, 26)
