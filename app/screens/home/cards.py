"""The parts of Home, as kv/home/screen.kv and kv/home/cards.kv lay them out. Each finds the view model in ``vm``."""
from __future__ import annotations

from collections.abc import Hashable, Sequence
from dataclasses import dataclass
from typing import Any

from kivy.event import EventDispatcher
from kivy.graphics.texture import Texture
from kivy.properties import BooleanProperty, ListProperty, ObjectProperty, StringProperty
from kivy.uix.boxlayout import BoxLayout
from kivy.uix.widget import Widget

from app.screens.home.view import HomeView, PromptView
from app.services.robots.map_picture import MapPicture
from app.widgets import flow  # noqa: F401  (registers kivy classess classes)
from app.widgets.buttons import CommandButton
from app.widgets.display import SectionCard
from app.widgets.lists import CalmScroll, Row
from app.widgets.rows import DoneRow, PlanRow
from app.widgets.surfaces import Surface, Tap, TonedSurface

NOTHING = HomeView()


class HomeState(EventDispatcher):
    """What kv reads: the fields of HomeView, and what a person is about to do. ``busy`` has the names of the commands under way."""
    loaded = BooleanProperty(False)
    has_robots = BooleanProperty(False)
    robots = ListProperty()
    card = ObjectProperty(NOTHING.card, rebind=True)
    controls = ObjectProperty(NOTHING.controls, rebind=True)
    prompt = ObjectProperty(NOTHING.prompt, rebind=True)
    map = ObjectProperty(NOTHING.map, rebind=True)
    queue = ListProperty()
    queue_note = StringProperty()
    queue_empty = StringProperty()
    planned = ListProperty()
    finished = ListProperty()
    run = ObjectProperty(NOTHING.run, rebind=True)
    busy = ListProperty()
    parameters = ListProperty()          # fields of the chosen mission
    problems = ObjectProperty({})        # by name of the parameter


NO_STATE = HomeState()                   # until a part is given its view model: kv applies a class's rule before that


class OfHome:
    """Mixin of what shows a part of the state."""
    vm = ObjectProperty(NO_STATE, rebind=True)


class Part(OfHome, BoxLayout):
    """A piece of the page."""


class Card(OfHome, SectionCard):
    """A card of the page."""


class HomeWide(Part):
    """Landscape."""


class HomeTall(OfHome, CalmScroll):
    """Portrait: one column of bands, at least as high as the window has room for."""


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


class MissionTile(OfHome, TonedSurface):
    """What runs, or what is wrong and what to do."""


class RobotMessage(OfHome, Surface):
    """The robot's own words, with its speed and distance where there is room."""
    labelled = BooleanProperty(False)
    roomy = BooleanProperty(False)


@dataclass(frozen=True)
class Answer:
    """One possible answer to the robot's question; ``busy`` while one is sent."""
    key: str
    text: str
    busy: bool


class PromptPanel(OfHome, Surface):
    """The robot asks a person."""

    def answers(self, prompt: PromptView, busy: Sequence[Hashable]) -> list[Answer]:
        return [Answer(option, option, "answer" in busy) for option in prompt.options]


class PromptOption(Row, CommandButton):
    """One possible answer."""

    def on_release(self) -> None:
        self.act("choose")


class RobotPlace(Part):
    """The robot on its own map, and under it the robot's words."""
    texture = ObjectProperty(None, allownone=True)

    def __init__(self, **kwargs: Any) -> None:
        self._picture: MapPicture | None = None
        super().__init__(**kwargs)

    def show(self, picture: MapPicture) -> None:
        """The texture of the map, made only when it is another picture."""
        if picture is not self._picture:
            self._picture, self.texture = picture, ground(picture)


def ground(picture: MapPicture) -> Texture:
    """White, as opaque as there are walls."""
    pixels = bytearray(b"\xff" * (4 * len(picture.shade)))
    pixels[3::4] = picture.shade
    texture = Texture.create(size=picture.size, colorfmt="rgba")

    def fill(texture: Texture) -> None:
        texture.blit_buffer(bytes(pixels), colorfmt="rgba", bufferfmt="ubyte")

    fill(texture)
    texture.add_reload_observer(fill)        # a tablet may lose its graphics while it sleeps
    return texture


class Slot(Part):
    """A place in the robot's card for one of several things, the first of ``order`` that there is."""
    prompt = ObjectProperty(NOTHING.prompt)
    map = ObjectProperty(NOTHING.map)
    order: tuple[type[Widget], ...] = ()

    def __init__(self, **kwargs: Any) -> None:
        super().__init__(**kwargs)
        for name in ("vm", "prompt", "map"):
            self.fbind(name, self._choose)
        self._choose()

    def _choose(self, *_: Any) -> None:
        wanted = {PromptPanel: bool(self.prompt.guid), RobotPlace: self.map.picture is not None, RobotMessage: True}
        kind = next((kind for kind in self.order if wanted[kind]), None)
        if [type(child) for child in self.children] != [kind]:
            self.clear_widgets()
            if kind is not None:
                self.add_widget(kind())
        for child in self.children:
            child.vm = self.vm
            if isinstance(child, RobotPlace):
                child.show(self.map.picture)


class PromptSlot(Slot):
    """In the narrow card: the question or nothing."""
    order = (PromptPanel,)


class PlaceSlot(Slot):
    """In the narrow card below the tiles: the map or the robot's words."""
    order = (RobotPlace, RobotMessage)


class BelowTiles(Slot):
    """In the wide card: the question, the map, or the robot's words."""
    order = (PromptPanel, RobotPlace, RobotMessage)


class RobotCard(Card):
    """The selected robot in landscape, a narrow card."""


class RobotCardWide(Card):
    """The same in portrait, a wide card."""


class QueueCard(Card):
    """What the robot has to do."""


class NextCard(Card):
    """What is planned."""


class OpensOnTap(Tap):
    """Mixin of rows that open what they show."""

    def on_release(self) -> None:
        self.act("open")


class FinishedRow(DoneRow, OpensOnTap):
    """An ended run; opens its story."""


class PlannedRow(PlanRow, OpensOnTap):
    """A planned start; opens its schedule."""


class FinishedCard(Card):
    """What has ended."""


class RunNowCard(Card):
    """Start one mission now."""
