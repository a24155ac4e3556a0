"""Charts of runs: outcomes per day, utilisation of robots side by side."""

from kivy.metrics import dp, sp
from kivy.properties import ListProperty, NumericProperty

from app.widgets.chart import Chart, nice_step
from app.widgets.tokens import tk

OUTCOMES = {
    "completed": "accent_mid",
    "not_run": "attention_solid",
    "failed": "fault_solid",
    "cancelled": "neutral_solid",
}


class StackedBars(Chart):
    """One column per day: ``days`` have a ``label``, a ``date`` and a number for each of ``OUTCOMES``; the last day is today. The first and
    the last one are written with their date, the others, as many as fit, with their label."""

    days = ListProperty()
    watch = ("days",)

    def draw(self):
        if not self.days:
            return
        columns = [[getattr(day, name) for name in OUTCOMES] for day in self.days]
        top = max(1, *map(sum, columns))
        step = nice_step(top)
        left = self.width_of(str(int(top) // step * step)) + dp(12)
        bottom = dp(22)
        width, height = self.width - left, self.height - bottom - dp(8)
        x0, y0 = self.x + left, self.y + bottom
        for value in range(0, int(top) + 1, step):
            y = y0 + height * value / top
            self.box(x0, y, width, 1, tk.grid)
            self.text(str(value), x0 - dp(8), y, tk.ink3, ax=1)
        slot = width / len(self.days)
        for n, values in enumerate(columns):
            self._column(x0 + slot * n, y0, slot, height / top, values)
        self._name_days(x0, width)

    def _name_days(self, x0, width):
        first, *others, last = self.days if len(self.days) > 1 else (None, *self.days)
        y, slot, gap, right = self.y + dp(8), width / len(self.days), dp(8), x0 + width
        room_right = right - self.text(last.date or last.label, right, y, tk.ink, ax=1, font="RobotoMedium") - gap
        room_left = x0
        if first is not None and x0 + self.width_of(first.date or first.label) <= room_right:
            room_left += self.text(first.date or first.label, x0, y, tk.ink3) + gap
        widest = max((self.width_of(day.label) for day in others), default=0) + gap
        every = max(1, -int(-widest // slot))
        for n, day in enumerate(others, 1):
            left, middle = x0 + slot * (n + 0.5) - self.width_of(day.label) / 2, x0 + slot * (n + 0.5)
            if (len(self.days) - 1 - n) % every == 0 and left >= room_left and 2 * middle - left <= room_right:
                self.text(day.label, middle, y, tk.ink3, ax=0.5)

    def _column(self, x, y, slot, unit, values):
        width = min(dp(28), slot * 0.62)
        x += (slot - width) / 2
        parts = [(value, token) for value, token in zip(values, OUTCOMES.values(), strict=True) if value]
        for k, (value, token) in enumerate(parts):
            height = max(dp(3), unit * value)
            gap = 1 if k else 0
            corners = (dp(4), dp(4), 0, 0) if k == len(parts) - 1 else 0
            self.box(x, y + gap, width, height - gap, getattr(tk, token), corners)
            if tk.strong:  # amber on white has no edge of its own
                self.box(x, y + gap, width, height - gap, tk.ink, corners, ring=dp(1))
            y += height


class RobotBars(Chart):
    """``rows`` have ``robot``, ``share`` and ``time`` as text, and ``busy`` and ``charging`` as fractions 0..1 of the observed time."""

    rows = ListProperty()
    row_height = NumericProperty("40sp")
    wanted_height = NumericProperty(0)  # of all rows; for lists that scroll
    watch = ("rows",)

    def on_rows(self, *_):
        self.wanted_height = len(self.rows) * self.row_height

    def draw(self):
        if not self.rows:
            return
        slot = self.height / len(self.rows)
        names = min(max(self.width_of(row.robot, 16) for row in self.rows) + dp(16), self.width * 0.4)
        words = max(
            max(self.width_of(row.share, 20, "RobotoMedium"), self.width_of(row.time)) for row in self.rows
        ) + dp(16)
        x, w, h = self.x + names, max(dp(8), self.width - names - words), dp(16)
        for n, row in enumerate(self.rows):
            y = self.top - slot * (n + 0.5)
            self.text(row.robot, self.x, y, tk.ink, 16)
            self._track(x, y - h / 2, w, h, row.busy, row.charging)
            self.text(row.share, self.right, y + sp(7), tk.ink, 20, 1, font="RobotoMedium")
            self.text(row.time, self.right, y - sp(11), tk.ink3, 14, 1)

    def _track(self, x, y, w, h, busy, charging):
        self.box(x, y, w, h, tk.track, dp(4))
        on_mission = w * min(1.0, busy)
        on_charger = min(w * charging, w - on_mission - 1)
        if on_mission > 1:
            self.box(x, y, on_mission, h, tk.accent, (dp(4), 0, 0, dp(4)))
        if on_charger > 1:
            self.box(x + on_mission + 1, y, on_charger, h, tk.accent_soft)
            self.box(x + on_mission + 1, y, on_charger, h, tk.accent, ring=1)
