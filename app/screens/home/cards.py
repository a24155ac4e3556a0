"""The widgets of the page of one robot, as kv/home/page.kv lays them out, and the state that they show."""

from __future__ import annotations

from typing import Any

from kivy.clock import Clock
from kivy.event import EventDispatcher
from kivy.metrics import dp, sp
from kivy.properties import BooleanProperty, ListProperty, NumericProperty, ObjectProperty, StringProperty
from kivy.uix.behaviors import ButtonBehavior
from kivy.uix.boxlayout import BoxLayout
from kivy.uix.gridlayout import GridLayout

from app.screens.home.fleet_model import FleetState
from app.screens.home.map import NO_MAP
from app.screens.home.view import HomeView
from app.services.robots.map_picture import MapPicture
from app.widgets.buttons import CommandButton, IconButton
from app.widgets.children import refill
from app.widgets.display import RowsCard, SectionCard
from app.widgets.events import Late
from app.widgets.items import Option, Tab
from app.widgets.list_row import ListRow
from app.widgets.robot_map import RobotMap, ground
from app.widgets.surfaces import OnlySeen, Tap, TonedSurface
from app.widgets.text import line_width
from app.widgets.tokens import tk


class HomeState(EventDispatcher):
    """Read by kv. ``busy`` has the names of the commands under way for the robot shown."""

    loaded = BooleanProperty(False)
    fleet = ObjectProperty(FleetState(), rebind=True)  # the page All robots
    view = ObjectProperty(HomeView(), rebind=True)  # the robot's page in words
    busy = ListProperty()
    foot_rests = BooleanProperty(False)  # a tap on the card's button belongs to the press before
    room = NumericProperty(7)  # rows of Today in sight
    robots_on_map = ListProperty()


NO_STATE = HomeState()  # until a part is given its view model: kv applies a class's rule before that


class OfHome:
    """Mixin of what shows a part of the state."""

    vm = ObjectProperty(NO_STATE, rebind=True)


class Part(OfHome, BoxLayout):
    """A piece of the page."""


class HomeCard(OfHome, SectionCard):
    """A card of the page."""


class HomeWide(Part):
    """The robot, and at its right what it can be sent and its day."""


class HomeLow(Part):
    """A window without height to spare: the day and the missions take turns."""

    shown = StringProperty("today")

    @staticmethod
    def tabs(today: str, send: str) -> list[Tab]:
        return [Tab("today", today), Tab("send", send)]


class HomeTall(Part):
    """The robot, the missions and the day below each other."""


class HomeSmall(Part):
    """A window smaller than any tablet: one column that scrolls; only the robot's button stays."""


class HomeEmpty(Part):
    """No robot yet."""


class FirstStep(BoxLayout):
    """A way to a first robot: ``on_release``."""

    icon = StringProperty()
    title = StringProperty()
    action = StringProperty()
    style = StringProperty("outlined")

    __events__ = ("on_release",)

    def on_release(self) -> None:
        """Its button was pressed."""


class RobotCard(HomeCard):
    """The robot: texts, map, one button. The map gets the room that the texts leave."""


class RobotCardTall(HomeCard):
    """The same with the map at the right."""


class RobotWords(Part):
    """State, problem or mission. A low card is too ``tight`` for both name and problem; the name is on its tab, too."""

    tight = BooleanProperty(False)

    @staticmethod
    def ink_of(tone: str, *_theme: str) -> Any:
        """The colour of the state's word: normal is that of all texts."""
        return tk.ink if tone in ("neutral", "accent", "offline") else getattr(tk, tone)


class RobotFoot(Part):
    """The one button of the card, and why it is off."""


class ProblemNote(OfHome, TonedSurface):
    """What a person has to know, do or answer."""


class PromptOption(CommandButton):
    """One possible answer; a long one wraps."""


class Answers(Late, GridLayout):
    """Equal buttons for the ``options``: in one row if they fit, large if possible, else in columns as wide as the
    longest, or one below the other. A tap fires ``on_answer(option)``, unless it is ``busy`` sending an answer."""

    about = StringProperty()  # the question
    options = ListProperty()
    busy = BooleanProperty(False)

    __events__ = ("on_answer",)

    def __init__(self, **kwargs: Any) -> None:
        self._arrange = Clock.create_trigger(self._choose_columns, -1)
        super().__init__(cols=1, **kwargs)
        self.fbind("width", self._arrange)

    def on_answer(self, option: str) -> None:
        """It was tapped."""

    def on_options(self, *_: Any) -> None:
        refill(self, [(self.about, option) for option in self.options], self._button)
        self.on_busy()
        self._arrange()

    def _button(self, answer: tuple[str, str]) -> PromptOption:
        return PromptOption(text=answer[1], on_release=lambda _button: self._press(*answer))

    on_about = on_options

    def _press(self, about: str, option: str) -> None:
        if about == self.about:
            self.dispatch("on_answer", option)

    def on_busy(self, *_: Any) -> None:
        for button in self.children:
            button.busy = self.busy

    def _choose_columns(self, _dt: float) -> None:
        gap = self.spacing[0]
        for size in (24, 18):
            widths = [line_width(option, "RobotoMedium", sp(size)) + dp(34) for option in self.options]
            is_row = sum(widths) + gap * (len(widths) - 1) <= self.width
            if is_row:
                break
        self.cols = max(1, len(widths) if is_row else int((self.width + gap) // (max(widths) + gap)))
        for button, width in zip(reversed(self.children), widths, strict=True):
            button.size_hint_min_x = width if is_row else None
            button.large = size == 24


class PlaceMap(OnlySeen, ButtonBehavior, RobotMap):
    """The map in the robot's card; a tap opens all of it."""


class RobotPlace(Part):
    """The robot on its own map, if both are known."""

    map = ObjectProperty(NO_MAP, rebind=True)
    texture = ObjectProperty(None, allownone=True)

    def __init__(self, **kwargs: Any) -> None:
        self._picture: MapPicture | None = None
        super().__init__(**kwargs)

    def on_map(self, *_: Any) -> None:
        """The texture of the map, made again only for another picture."""
        picture = self.map.picture
        if picture is not None and picture is not self._picture:
            self._picture, self.texture = picture, ground(picture)


class MapPage(RobotPlace):
    """The whole map of the robot, with all robots on it."""


class SendTile(Tap):
    """A mission, or with the key None the way to all of them."""

    key = NumericProperty(None, allownone=True)
    icon = StringProperty()
    text = StringProperty()


class SendTiles(OfHome, GridLayout):
    """The ``tiles`` of missions that are one tap away, and the way to all of them. ``off``: no mission can be sent."""

    tiles = ListProperty()
    off = StringProperty()
    last = StringProperty()  # the words of the way to all

    def on_tiles(self, *_: Any) -> None:
        options = [*self.tiles, Option(None, self.last, "apps")]
        tiles = refill(self, [each.key for each in options], lambda key: SendTile(key=key, on_release=self._press))
        for tile, option in zip(tiles, options, strict=True):
            tile.icon, tile.text = option.icon, option.text
            tile.disabled = not option.text or (bool(self.off) and option.key is not None)

    on_off = on_last = on_tiles

    def _press(self, tile: SendTile) -> None:
        if tile.key is None:
            self.vm.sending.open_all()
        else:
            self.vm.sending.open(tile.key)


class SendCard(HomeCard):
    """What the robot can be sent."""


class TodayCard(OfHome, RowsCard):
    """What the robot has done, does and will do."""


class TodayHead(Part):
    """Its title and menu."""


class QueueMenu(OfHome, IconButton):
    """What is seldom done to the queue."""


class TodayList(Part):
    """Its rows; as many of what is done as leave room for the rest."""


class TodayRow(ListRow):
    """One of them."""
