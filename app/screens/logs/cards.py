"""The parts of the Logs as kv/logs/screen.kv lays them out."""
from __future__ import annotations

from typing import Any

from kivy.clock import Clock
from kivy.properties import BooleanProperty, ListProperty, NumericProperty, ObjectProperty, StringProperty
from kivy.uix.boxlayout import BoxLayout

from app.widgets import activity_bands, figure_charts, figures, pages, slots  # noqa: F401  (kv's Factory learns them)
from app.widgets.display import SectionCard
from app.widgets.fields import SearchField

SETTLED = 0.35               # s in which rows have found their height and the list its rest


class FilterBar(BoxLayout):
    """Period, robot, export."""
    vm = ObjectProperty(None, allownone=True)
    period = StringProperty()
    periods = ListProperty()
    part = StringProperty()
    parts = ListProperty()
    robot = StringProperty()
    all_robots = BooleanProperty(True)
    exporting = BooleanProperty(False)
    reporting = BooleanProperty(False)
    empty = BooleanProperty(True)


class LogsBody(BoxLayout):
    """What is below the figures: one part of ``PARTS``; the others do not exist."""
    vm = ObjectProperty(None, rebind=True, allownone=True)
    portrait = BooleanProperty(False)
    part = StringProperty()

    def __init__(self, **kwargs: Any) -> None:
        self._shown: tuple[str, object] = ("", None)
        super().__init__(**kwargs)
        for name in ("part", "vm"):
            self.fbind(name, self._build)
        self.fbind("portrait", self._turn)

    def _build(self, *_: Any) -> None:
        wanted = (self.part, self.vm)
        if wanted == self._shown or self.vm is None or self.part not in PARTS:
            return
        self._shown = wanted
        self.clear_widgets()
        self.add_widget(PARTS[self.part](vm=self.vm, portrait=self.portrait))

    def _turn(self, *_: Any) -> None:
        for part in self.children:
            part.portrait = self.portrait


class LogsPart(BoxLayout):
    """Base of what can stand there."""
    vm = ObjectProperty(None, rebind=True, allownone=True)
    portrait = BooleanProperty(False)


class RunsPart(LogsPart):
    """Charts beside the runs (above them in portrait)."""


class FiguresPart(LogsPart):
    """Further figures in cards, two columns (one in portrait)."""


class RobotsPart(LogsPart):
    """What the robots did, as bands."""


PARTS = {"runs": RunsPart, "figures": FiguresPart, "robots": RobotsPart}


class MoreCard(SectionCard):
    """A figure with its words; the button in its head says what it means: ``vm.explain(key)``."""
    title = StringProperty()
    note = StringProperty()
    about = StringProperty()


class Ranking(BoxLayout):
    """Words, and reasons as ranked bars (RankRow)."""
    words = StringProperty()
    rows = ListProperty()


class Facts(BoxLayout):
    """Labels and values (FactRow)."""
    rows = ListProperty()


class BandsCard(SectionCard):
    """Bands of all robots, and what they mean."""
    lanes = ListProperty()
    ticks = ListProperty()
    marked = ListProperty()
    legend = ListProperty()


class Waiting(BoxLayout):
    """Waiting against running: a bar, its legend, words."""
    share = NumericProperty(0)
    words = StringProperty()


class LineLegend(BoxLayout):
    """What a drawn line or band means."""
    kind = StringProperty("line")
    text = StringProperty()
    shown = BooleanProperty(True)


class UtilisationCard(SectionCard):
    """Bars of all robots."""
    rows = ListProperty()
    note = StringProperty()
    wanted = NumericProperty(0)


class OutcomesCard(SectionCard):
    """How runs ended, day by day."""
    days = ListProperty()


class RunsSearch(SearchField):
    """What is searched for; ``card`` is the RunsCard."""
    card = ObjectProperty(None, rebind=True)


class RunsCard(SectionCard):
    """The executions with their filters. ``told`` is the one whose story is told: it stays in sight, also when it has grown."""
    rows = ListProperty()
    told = ObjectProperty(None, allownone=True)
    found = StringProperty()
    outcome = StringProperty()
    mission = StringProperty()
    trigger = StringProperty()
    narrows = BooleanProperty(False)
    searching = BooleanProperty(False)
    query = StringProperty()
    empty_title = StringProperty()
    empty_text = StringProperty()

    def __init__(self, **kwargs: Any) -> None:
        self._bring_soon = Clock.create_trigger(self._bring_into_sight, SETTLED)
        self._sought = False                 # told, but not in the list yet: it is still being read
        super().__init__(**kwargs)
        self.fbind("told", self._seek)
        self.fbind("rows", self._rows_came)

    def _seek(self, *_args: object) -> None:
        self._sought = self.told is not None
        self._bring_soon()

    def _rows_came(self, *_args: object) -> None:
        if self._sought:
            self._bring_soon()

    def _bring_into_sight(self, _dt: float) -> None:
        """A list that rests on whole rows has no place for a row that has become too high where it stood."""
        if not self._sought or all(row["key"] != self.told for row in self.rows):
            return
        self._sought = False
        runs = self.ids.runs
        row = next((row for row in runs.views if row.key == self.told), None)
        if row is None or row.to_window(0, row.y)[1] < runs.to_window(0, runs.y)[1] - 1:
            runs.show(self.told)
