"""Utilisation of robots side by side, with the time behind each share."""
from kivy.metrics import dp, sp
from kivy.properties import ListProperty, NumericProperty

from app.widgets.chart import Chart
from app.widgets.tokens import tk


class RobotBars(Chart):
    """``rows`` = [(robot, share, time, busy, charging), …]: words of the share and of the time, then fractions 0..1 of the time seen."""
    rows = ListProperty()
    row_height = NumericProperty("40sp")
    wanted_height = NumericProperty(0)       # of all rows; for lists that scroll
    watch = ("rows",)

    def on_rows(self, *_):
        self.wanted_height = len(self.rows) * self.row_height

    def draw(self):
        if not self.rows:
            return
        slot = self.height / len(self.rows)
        names = min(max(self.width_of(row[0], 16) for row in self.rows) + dp(16), self.width * .4)
        words = max(max(self.width_of(row[1], 20, "RobotoMedium"), self.width_of(row[2])) for row in self.rows) + dp(16)
        x, w, h = self.x + names, max(dp(8), self.width - names - words), dp(16)
        for n, (name, share, time, busy, charging) in enumerate(self.rows):
            y = self.top - slot * (n + .5)
            self.text(name, self.x, y, tk.ink, 16)
            self._track(x, y - h / 2, w, h, busy, charging)
            self.text(share, self.right, y + sp(7), tk.ink, 20, 1, font="RobotoMedium")
            self.text(time, self.right, y - sp(11), tk.ink3, 14, 1)

    def _track(self, x, y, w, h, busy, charging):
        self.box(x, y, w, h, tk.track, dp(4))
        on_mission = w * min(1., busy)
        on_charger = min(w * charging, w - on_mission - 1)
        if on_mission > 1:
            self.box(x, y, on_mission, h, tk.accent, (dp(4), 0, 0, dp(4)))
        if on_charger > 1:
            self.box(x + on_mission + 1, y, on_charger, h, tk.accent_soft)
            self.box(x + on_mission + 1, y, on_charger, h, tk.accent, ring=1)
