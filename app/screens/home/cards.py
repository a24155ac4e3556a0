"""The parts of Home, as kv/home/screen.kv and kv/home/cards.kv lay them out. Each finds the view model in ``vm``."""

from __future__ import annotations

from typing import Any

from kivy.clock import Clock
from kivy.event import EventDispatcher
from kivy.input import MotionEvent
from kivy.metrics import dp, sp
from kivy.properties import BooleanProperty, ListProperty, NumericProperty, ObjectProperty, StringProperty
from kivy.uix.behaviors import ButtonBehavior
from kivy.uix.boxlayout import BoxLayout
from kivy.uix.gridlayout import GridLayout
from kivy.uix.widget import Widget

from app.screens.common.presses import DOUBLE_TAP
from app.screens.home.fleet_model import FleetState
from app.screens.home.view import HomeView
from app.screens.home.waiting_model import NO_WAITING
from app.services.robots.map_picture import MapPicture
from app.widgets import flow
from app.widgets.buttons import CommandButton
from app.widgets.display import SectionCard, Tile
from app.widgets.frame import SETTLES
from app.widgets.pages import LowPage, turn_to
from app.widgets.robot_map import RobotMap, ground
from app.widgets.rows import DoneRow, PlanRow
from app.widgets.surfaces import Surface, Tap, TonedSurface, TonedTap
from app.widgets.text import line_width
from app.widgets.tokens import tk

NOTHING = HomeView()


class HomeState(EventDispatcher):
    """Read by kv: the fields of HomeView, and the person's next action. ``busy`` has the names of the commands under
    way for the robot shown."""

    loaded = BooleanProperty(False)
    fleet = ObjectProperty(FleetState(), rebind=True)  # the page All robots
    has_robots = BooleanProperty(False)
    robots = ListProperty()
    card = ObjectProperty(NOTHING.card, rebind=True)
    controls = ObjectProperty(NOTHING.controls, rebind=True)
    prompt = ObjectProperty(NOTHING.prompt, rebind=True)
    map = ObjectProperty(NOTHING.map, rebind=True)
    queue = ListProperty()
    queue_note = StringProperty()
    queue_blocked = ObjectProperty(NOTHING.queue_blocked, rebind=True)
    queue_empty = StringProperty()
    planned = ListProperty()
    planned_empty = StringProperty()
    finished = ListProperty()
    run = ObjectProperty(NOTHING.run, rebind=True)
    busy = ListProperty()
    pause_rests = BooleanProperty(False)  # a tap on Pause or Resume belongs to the press before
    waiting = ObjectProperty(NO_WAITING, rebind=True)  # for a robot
    goes_first = BooleanProperty(False)  # Run now on a group: before everything else
    asks = BooleanProperty(False)  # the chosen mission has parameters: a dialog comes before it runs


NO_STATE = HomeState()  # until a part is given its view model: kv applies a class's rule before that


class OfHome:
    """Mixin of what shows a part of the state."""

    vm = ObjectProperty(NO_STATE, rebind=True)


class Part(OfHome, BoxLayout):
    """A piece of the page."""


class Card(OfHome, SectionCard):
    """A card of the page."""


class HomeWide(Part):
    """Landscape."""


class Bands(OfHome, LowPage):
    """Robots' strip, robot and the rest, one below the other. In a low window the next step of a robot that needs a
    person is visible at once: its card comes before the strip, with the part of that ``step`` first. This moves content
    under a finger; a tap in the next moment was meant for what was there before."""

    low = BooleanProperty(False)
    step = StringProperty()
    scroll_y: float
    hides_queue = BooleanProperty(False)  # its head with the blocked items is below the fold

    def __init__(self, **kwargs: Any) -> None:
        self._rests_until = 0.0
        super().__init__(**kwargs)

    def on_kv_post(self, _base_widget: Any) -> None:
        self.fbind("step", self._needed)
        self._arrange()

    def _needed(self, *_: Any) -> None:
        self._rests_until = Clock.get_time() + SETTLES
        bands, card = self.ids.bands, self.ids.card
        if (
            self.step and (1 - self.scroll_y) * (bands.height - self.height) < bands.top - card.y
        ):  # some of the card is in sight
            self.scroll_y = 1
        self._arrange()

    def _arrange(self) -> None:
        bands, robots = self.ids.bands, self.ids.strip
        bands.remove_widget(robots)
        bands.add_widget(robots, index=len(bands.children) - bool(self.step))

    def on_touch_down(self, touch: MotionEvent) -> Any:
        is_meant_for_before = self.collide_point(*touch.pos) and Clock.get_time() < self._rests_until
        return is_meant_for_before or super().on_touch_down(touch)


class HomeTall(Bands):
    """Portrait, and windows too small for three columns: at least as high as the window has room for."""


class HomeColumn(Bands):
    """A narrow window: one card below the other."""


class HomeEmpty(Part):
    """No robot yet."""


class RobotStrip(Part):
    """A chip per robot, or the way to the page of all robots if there are many; and the ``blocked`` queue items, if
    they have to be named here: a tap fires ``on_show_blocked``."""

    blocked = StringProperty()

    __events__ = ("on_show_blocked",)

    def on_show_blocked(self) -> None:
        """What is blocked was tapped."""


class RobotHead(Part):
    """State and name; ``side`` of the state's disc in px."""

    side = NumericProperty(0)


class RobotTiles(Part):
    """Battery and address, or the battery ``alone``, which is ``high``; ``spare`` px higher than ``needed``."""

    alone = BooleanProperty(False)
    high = NumericProperty(0)
    needed = NumericProperty(0)
    spare = NumericProperty(0)


class RobotControls(Part):
    """Pause or Resume, Reset errors, Clear queue."""


class MissionTile(OfHome, TonedSurface):
    """The running mission, or the one that has ``failed`` and what to do; ``spare`` px higher than ``needed``."""

    failed = BooleanProperty(False)
    needed = NumericProperty(0)
    spare = NumericProperty(0)


class RobotMessage(OfHome, Tile):
    """The robot's own words, with its speed and distance if they fit."""

    labelled = BooleanProperty(False)
    roomy = BooleanProperty(False)


class PromptPanel(OfHome, Surface):
    """The robot asks a person."""

    LARGE_UP_TO = 100  # characters of the question


class PromptOption(CommandButton):
    """One possible answer; a long one wraps."""


class Answers(GridLayout):
    """Equal buttons for the ``options``: in one row if they fit, large if possible, else in columns as wide as the
    longest, or one below the other. A tap fires ``on_answer(option)``, unless it is ``busy`` sending an answer. A touch
    right after ``about`` has changed was meant for the previous question."""

    about = StringProperty()  # the question
    options = ListProperty()
    busy = BooleanProperty(False)

    __events__ = ("on_answer",)

    def __init__(self, **kwargs: Any) -> None:
        self._arrange = Clock.create_trigger(self._choose_columns, -1)
        self._last, self._rests_until = "", 0.0
        super().__init__(cols=1, **kwargs)
        self.fbind("about", self._question_changed)
        self.fbind("options", self._build)
        self.fbind("busy", self._mark)
        self.fbind("width", self._arrange)
        self._build()

    def on_answer(self, option: str) -> None:
        """It was tapped."""

    def _build(self, *_: Any) -> None:
        self.clear_widgets()
        for option in self.options:
            button = PromptOption(text=option)
            button.bind(on_release=lambda _button, option=option, about=self.about: self._press(option, about))
            self.add_widget(button)
        self._mark()
        self._arrange()

    def _question_changed(self, *_: Any) -> None:
        if self._last:
            self._rests_until = Clock.get_time() + DOUBLE_TAP
        self._last = self.about
        self._build()

    def _press(self, option: str, about: str) -> None:
        if about == self.about and Clock.get_time() >= self._rests_until:
            self.dispatch("on_answer", option)

    def _mark(self, *_: Any) -> None:
        for button in self.children:
            button.busy = self.busy

    def _choose_columns(self, _dt: float) -> None:
        gap = self.spacing[0]
        for size in (20, 16):
            widths = [line_width(option, "RobotoMedium", sp(size)) + dp(34) for option in self.options]
            is_row = sum(widths) + gap * (len(widths) - 1) <= self.width
            if is_row:
                break
        self.cols = max(1, len(widths) if is_row else int((self.width + gap) // (max(widths) + gap)))
        for button, width in zip(reversed(self.children), widths, strict=True):
            button.size_hint_min_x = width if is_row else None
            button.large = size == 20


class PlaceMap(ButtonBehavior, RobotMap):
    """The map in the robot's card; a tap opens all of it."""

    def draw(self) -> None:
        super().draw()
        self.box(self.right - dp(31), self.y + dp(5), dp(26), dp(26), tk.map_floor, dp(8), alpha=0.82)
        self.icon("arrow-expand", self.right - dp(18), self.y + dp(18), tk.ink2, 22)

    def kept_free(self) -> list[tuple[float, float, float, float]]:
        """The corner with the icon."""
        return [(self.right - dp(34), self.y, self.right, self.y + dp(34))]


class RobotPlace(Part):
    """The robot on its own map, and under it the robot's words."""

    texture = ObjectProperty(None, allownone=True)

    def __init__(self, **kwargs: Any) -> None:
        self._picture: MapPicture | None = None
        super().__init__(**kwargs)

    def show(self, picture: MapPicture) -> None:
        """The texture of the map, made again only for another picture."""
        if picture is not self._picture:
            self._picture, self.texture = picture, ground(picture)


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
    """The selected robot, a narrow card; it scrolls where it is lower than ``needed``.

    A card that ``fills`` the available room may have none left for the map, which is below the part ``above``. With
    ``shows_map`` the map then replaces the address next to the battery: if no run with a known end is on the robot, if it
    has failed, or if it does not answer.

    If a card is too ``tight`` for both its state and what a person has to do ``first`` (an answer, or the steps of a
    fault), the state comes second; on a low page the next ``step`` is at its top.
    """

    needed = NumericProperty(0)  # height at which nothing in it scrolls
    above = NumericProperty(0)  # height of what is above the map
    seen = NumericProperty(0)  # height of what is above the controls, which don't scroll
    spare = NumericProperty(0)  # of that, what nothing needs
    fills = BooleanProperty(False)
    shows_map = BooleanProperty(False)  # instead of its address, if its present or last position is known
    first = NumericProperty(0)  # height of what a person has to do
    step = StringProperty()
    controls_first = BooleanProperty(False)
    tight = BooleanProperty(False)
    has_map_at_side = BooleanProperty(False)

    def on_tight(self, *_: Any) -> None:
        words, head = self.ids.words, self.ids.head
        words.remove_widget(head)
        words.add_widget(head, index=words.children.index(self.ids.mission) if self.tight else len(words.children))

    def on_controls_first(self, *_: Any) -> None:
        controls = self.ids.controls
        self.remove_widget(controls)
        self.add_widget(controls, index=len(self.children) if self.controls_first else 0)

    def on_has_map_at_side(self, *_: Any) -> None:
        place, words, side = self.ids.place, self.ids.words, self.ids.side
        place.parent.remove_widget(place)
        (side if self.has_map_at_side else words).add_widget(place)


class RobotCardWide(Card):
    """The same as a wide card, never lower than ``needed``. In a ``low`` window the page ends within it. Then the
    controls come before the mission, and the part with the next ``step`` before everything else, also before the state.
    """

    needed = NumericProperty(0)
    low = BooleanProperty(False)
    step = StringProperty()

    def on_kv_post(self, _base_widget: Any) -> None:
        for name in ("low", "step"):
            self.fbind(name, self._arrange)
        self._arrange()

    def _arrange(self, *_: Any) -> None:
        ids = self.ids
        if not self.low:
            order = ids.head, ids.mission, ids.controls
        elif self.step == "controls":
            order = ids.controls, ids.mission, ids.head
        else:
            order = (
                (ids.mission, ids.controls, ids.head)
                if self.step == "mission"
                else (ids.head, ids.controls, ids.mission)
            )
        side = (ids.below, ids.tiles) if self.step == "prompt" else (ids.tiles, ids.below)
        for column, widgets in ((ids.words, order), (ids.side, side)):
            if tuple(reversed(column.children)) != widgets:
                column.clear_widgets()
                for widget in widgets:
                    column.add_widget(widget)


class QueueCard(Card):
    """What the robot has to do."""

    def show_blocked(self) -> None:
        self.ids.queue.show(self.vm.queue_blocked.key)
        turn_to(self)


class BlockedLine(TonedTap):
    """That something in the queue is blocked, and why, in at most ``room`` px; a tap shows its row."""

    text = StringProperty()
    room = NumericProperty(0)


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

    @staticmethod
    def first_chips(can_be: bool, chosen: bool, words: str) -> list[flow.Chip]:
        """A start on a group can be put before everything else."""
        return [flow.Chip("first", words, "chevron-double-up", chosen)] if can_be else []
