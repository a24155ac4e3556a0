"""Charts of runs: outcomes per day, use of robots side by side. A tap on a day or a robot is an event with its key."""

from kivy.metrics import dp
from kivy.properties import ListProperty, NumericProperty

from app.widgets.chart import Chart, nice_step
from app.widgets.places import places
from app.widgets.tokens import tk

OUTCOMES = {"completed": "accent_mid", "not_run": "attention_solid", "failed": "fault_solid"}
MOVED = dp(12)  # a finger that moved so far did not tap
NOT_OVER = 0.45  # opacity of the present day


class PressedChart(Chart):
    """A chart whose parts can be pressed: ``boxes`` are (x, y, width, height, key) in window px, as they were drawn. A tap on one fires
    ``on_part(key)``."""

    stands = True

    __events__ = ("on_part",)

    def __init__(self, **kwargs):
        self.boxes = []
        super().__init__(**kwargs)
        places.watch(self)

    def part_at(self, x, y):
        """The box there, or None."""
        return next(
            (box for box in self.boxes if box[0] <= x <= box[0] + box[2] and box[1] <= y <= box[1] + box[3]), None
        )

    def on_touch_down(self, touch):
        if places.misses(self, touch):
            return True
        if self.collide_point(*touch.pos) and not touch.is_mouse_scrolling:
            touch.ud[self.uid] = self.part_at(*touch.pos), touch.pos
        return super().on_touch_down(touch)

    def on_touch_up(self, touch):
        part, began = touch.ud.get(self.uid, (None, touch.pos))
        if touch.grab_current is None and part and max(abs(touch.x - began[0]), abs(touch.y - began[1])) < MOVED:
            self.dispatch("on_part", part[4])
            return True
        return super().on_touch_up(touch)

    def seats(self):
        return self.seats_at({box[4]: (("on_part", box[4]), box[:2], box[2:4], False) for box in self.boxes})


class StackedBars(PressedChart):
    """One column per day: ``days`` have a ``key``, a ``label``, a ``date`` and a number for each of ``OUTCOMES``; the last day
    is today, which is pale. The first is named by its date, the others, as many as fit, by their label."""

    days = ListProperty()
    watch = ("days",)

    def draw(self):
        self.boxes = []
        if not self.days:
            return
        columns = [[getattr(day, name) for name in OUTCOMES] for day in self.days]
        top = max(1, *map(sum, columns))
        step = nice_step(top)
        left = self.width_of(str(int(top) // step * step)) + dp(12)
        bottom = dp(24)
        width, height = self.width - left, self.height - bottom - dp(8)
        x0, y0 = self.x + left, self.y + bottom
        for value in range(0, int(top) + 1, step):
            y = y0 + height * value / top
            self.box(x0, y, width, 1, tk.grid)
            self.text(str(value), x0 - dp(8), y, tk.ink3, ax=1)
        slot = width / len(self.days)
        for n, (day, values) in enumerate(zip(self.days, columns, strict=True)):
            self._column(x0 + slot * n, y0, slot, height / top, values, NOT_OVER if n == len(columns) - 1 else 1.0)
            self.boxes.append((x0 + slot * n, self.y, slot, self.height, day.key))
        self._name_days(x0, width)

    def _name_days(self, x0, width):
        """The last one first: it is today."""
        slot, room = width / len(self.days), x0 + width
        for n in reversed(range(len(self.days))):
            words = self.days[n].label if n or slot > dp(40) else self.days[n].date
            long = self.width_of(words)
            left = min(max(x0 + slot * (n + 0.5) - long / 2, x0), x0 + width - long)
            if left + long <= room and (n == 0 or len(self.days) <= 14 or n == len(self.days) - 1):
                self.text(words, left, self.y + dp(8), tk.ink2)
                room = left - dp(8)

    def _column(self, x, y, slot, unit, values, alpha):
        width = min(dp(64), slot * 0.68)
        x += (slot - width) / 2
        for value, token in zip(values, OUTCOMES.values(), strict=True):
            if value:
                height = max(dp(3), unit * value)
                self.box(x, y, width, height - 1, getattr(tk, token), alpha=alpha)
                if tk.strong:  # amber on white has no edge of its own
                    self.box(x, y, width, height - 1, tk.ink, ring=dp(1))
                y += height


class RobotBars(PressedChart):
    """``rows`` have ``key``, ``robot``, ``share`` as text, and ``busy`` and ``charging`` as fractions 0..1 of the observed time."""

    rows = ListProperty()
    row_height = NumericProperty("48sp")
    wanted_height = NumericProperty(0)  # of all rows
    watch = ("rows",)

    def on_rows(self, *_):
        self.wanted_height = len(self.rows) * self.row_height

    def draw(self):
        self.boxes = []
        if not self.rows:
            return
        slot = self.height / len(self.rows)
        names = min(max(self.width_of(row.robot, 18) for row in self.rows) + dp(20), self.width * 0.4)
        words = max(self.width_of(row.share, 18, "RobotoMedium") for row in self.rows) + dp(20)
        x, w, h = self.x + names, max(dp(8), self.width - names - words), dp(20)
        for n, row in enumerate(self.rows):
            y = self.top - slot * (n + 0.5)
            self.text(row.robot, self.x, y, tk.ink, 18)
            self._track(x, y - h / 2, w, h, row.busy, row.charging)
            self.text(row.share, self.right, y, tk.ink, 18, 1, font="RobotoMedium")
            self.boxes.append((self.x, y - slot / 2, self.width, slot, row.key))

    def _track(self, x, y, w, h, busy, charging):
        self.box(x, y, w, h, tk.track, dp(4))
        on_mission = w * min(1.0, busy)
        on_charger = min(w * charging, w - on_mission - 1)
        if on_mission > 1:
            self.box(x, y, on_mission, h, tk.accent_mid, (dp(4), 0, 0, dp(4)))
        if on_charger > 1:
            self.box(x + on_mission + 1, y, on_charger, h, tk.accent_soft)
            if tk.strong:
                self.box(x + on_mission + 1, y, on_charger, h, tk.accent, ring=1)
