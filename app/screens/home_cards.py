"""The parts of Home, as kv/home.kv and kv/home_cards.kv lay them out. Each finds the view model in ``vm``."""
from __future__ import annotations

from typing import Any

from kivy.event import EventDispatcher
from kivy.properties import BooleanProperty, ListProperty, ObjectProperty, StringProperty
from kivy.uix.boxlayout import BoxLayout
from kivy.uix.widget import Widget

from app.screens.home_view import HomeView
from app.widgets import flow  # noqa: F401  (kivy's Factory learns its classes)
from app.widgets.buttons import CommandButton
from app.widgets.display import SectionCard
from app.widgets.lists import CalmScroll, Row
from app.widgets.rows import DoneRow
from app.widgets.surfaces import Surface, TonedSurface

NOTHING = HomeView()


class HomeState(EventDispatcher):
    """What kv reads: the fields of HomeView, and what a person is about to do. ``busy`` names the buttons that wait for their outcome."""
    loaded = BooleanProperty(False)
    has_robots = BooleanProperty(False)
    robots = ListProperty()
    card = ObjectProperty(NOTHING.card, rebind=True)
    controls = ObjectProperty(NOTHING.controls, rebind=True)
    prompt = ObjectProperty(NOTHING.prompt, rebind=True)
    queue = ListProperty()
    queue_note = StringProperty()
    queue_empty = StringProperty()
    planned = ListProperty()
    finished = ListProperty()
    run = ObjectProperty(NOTHING.run, rebind=True)
    busy = ListProperty()
    parameters = ListProperty()          # fields of the chosen mission
    problems = ObjectProperty({})        # by name of the parameter


NOT_YET = HomeState()                    # what a part shows until it is given its view model: kv applies a class's rule before that


class Part(BoxLayout):
    """A piece of the page."""
    vm = ObjectProperty(NOT_YET, rebind=True)


class Card(SectionCard):
    """A card of the page."""
    vm = ObjectProperty(NOT_YET, rebind=True)


class HomeWide(Part):
    """Landscape."""


class HomeTall(CalmScroll):
    """Portrait: one column of bands, at least as high as the window has room for."""
    vm = ObjectProperty(NOT_YET, rebind=True)


class HomeEmpty(Part):
    """No robot yet."""


class RobotStrip(Part):
    """A chip per robot."""


class RobotHead(Part):
    """State and name."""


class RobotTiles(Part):
    """Battery and address."""


class RobotControls(Part):
    """Pause or Resume, Reset errors, Clear queue."""


class MissionTile(TonedSurface):
    """What runs, or what is wrong and what to do."""
    vm = ObjectProperty(NOT_YET, rebind=True)


class RobotSays(Surface):
    """The robot's own words, with its speed and way where there is room."""
    vm = ObjectProperty(NOT_YET, rebind=True)
    labelled = BooleanProperty(False)
    roomy = BooleanProperty(False)


class PromptPanel(Surface):
    """The robot asks a person."""
    vm = ObjectProperty(NOT_YET, rebind=True)

    def options(self, prompt: Any, busy: list[Any]) -> list[dict[str, Any]]:
        return [{"key": option, "text": option, "busy": "answer" in busy} for option in prompt.options]


class PromptOption(Row, CommandButton):
    """One possible answer."""

    def on_release(self) -> None:
        self.act("choose")


class Slot(Part):
    """Where the robot's question stands as long as it has one, and else what ``otherwise`` says."""
    prompt = ObjectProperty(NOTHING.prompt)
    otherwise: type[Widget] | None = None

    def __init__(self, **kwargs: Any) -> None:
        super().__init__(**kwargs)
        for name in ("vm", "prompt"):
            self.fbind(name, self._choose)
        self._choose()

    def _choose(self, *_: Any) -> None:
        kind = PromptPanel if self.prompt.guid else self.otherwise
        if [type(child) for child in self.children] != [kind]:
            self.clear_widgets()
            if kind is not None:
                self.add_widget(kind())
        for child in self.children:
            child.vm = self.vm


class PromptSlot(Slot):
    """In the upright card: the question or nothing."""


class BelowTiles(Slot):
    """In the lying card: the question or the robot's words."""
    otherwise = RobotSays


class RobotCard(Card):
    """The selected robot, upright."""


class RobotCardWide(Card):
    """The same, lying."""


class QueueCard(Card):
    """What the robot has to do."""


class NextCard(Card):
    """What is planned."""


class FinishedRow(DoneRow):
    """An ended run beside the bar of its list."""


class FinishedCard(Card):
    """What has ended."""


class RunNowCard(Card):
    """Start one mission now."""
