"""What rows of lists, choices, menus, tabs and lanes show: without kivy, so that a screen's words are made and tested without a window."""

from collections.abc import Hashable
from dataclasses import dataclass
from datetime import date
from typing import NamedTuple


@dataclass(frozen=True)
class Action:
    """A button of a row. Without ``text`` it is an icon. ``off`` says why it can't be pressed, which the row shows."""

    name: str
    text: str = ""
    icon: str = ""
    style: str = ""  # of CommandButton; usually outlined, an icon without an outline
    tone: str = "neutral"
    off: str = ""


@dataclass(frozen=True)
class Item:
    """What one row shows. The ``tone`` colours the icon, and the whole row where its look is ``tint``."""

    key: Hashable
    title: str = ""
    support: str = ""  # below the title
    meta: str = ""  # at the right, or a column
    lead: str = ""  # a time at the left
    icon: str = ""
    tone: str = "neutral"
    actions: tuple[Action, ...] = ()
    look: str = "plain"  # tint: of its tone; chosen: the present one; faint: off; head: of the rows below it
    number: str = ""  # in a ring, in the place of the icon
    disc: bool = False  # the icon is on a disc
    loud: bool = False  # the disc is solid
    edge: bool = False  # a line of its tone at the left edge
    aside: str = ""  # beside the title
    note: str = ""  # below the support
    who: str = ""  # in front of the title, or a column before it: whose it is
    place: str = ""  # a column: the robot, the group
    support_tone: str = ""
    meta_tone: str = ""
    meta_icon: str = ""
    strong: bool = True  # the title has medium weight
    large: bool = False  # the title is 24 sp, the support 18
    below: bool = False  # buttons with words have a line of their own
    opens: bool = True  # a tap on the row is the action "open"
    on: bool | None = None  # a switch: action "switch" with the wanted state
    ticked: bool | None = None  # a box in the place of the icon

    @property
    def whole(self) -> str:
        """The title with whose it is."""
        return f"{self.who} · {self.title}" if self.who else self.title

    @property
    def beside(self) -> tuple[Action, ...]:
        """The buttons in the line of the title."""
        return tuple(action for action in self.actions if not (self.below and action.text))

    @property
    def under(self) -> tuple[Action, ...]:
        """The buttons in a line of their own."""
        return tuple(action for action in self.actions if self.below and action.text)

    @property
    def at_right(self) -> str:
        """The meta, or why a button is off."""
        return self.meta or next((action.off for action in self.actions if action.off), "")


@dataclass(frozen=True)
class Option:
    """One choice of a list, of a row of chips or of a menu. ``key`` is handed back when it is chosen; ``tone`` is of its icon, in a menu of
    all of it. ``off``: why it can't be chosen now, in the place of its text."""

    key: Hashable
    text: str
    icon: str = ""
    note: str = ""
    selected: bool = False
    tone: str = "neutral"
    off: str = ""


@dataclass(frozen=True)
class Card:
    """What a thing on screen represents, and its actions."""

    title: str
    text: str
    items: tuple[Option, ...]


@dataclass(frozen=True)
class Tab:
    """``count`` 0 is not shown. A ``tone`` colours icon and count: something there is not normal."""

    key: Hashable
    text: str
    icon: str = ""
    tone: str = ""
    count: int = 0


class Day(NamedTuple):
    """A day of a month; the defaults: a blank one of another month. One that is ``off`` can't be chosen."""

    day: date | None = None
    text: str = ""
    status: str = "work"
    icon: str = ""
    today: bool = False
    chosen: bool = False
    off: bool = False


# Hours are floats from one common instant. Named tuples, because kivy compares thousands of them whenever they are set.
class Bar(NamedTuple):
    """A run, or several that are too short to be distinguished; or what a robot did. ``key`` is handed back when it is tapped."""

    key: Hashable
    start: float
    end: float
    label: str = ""
    state: str = "planned"  # of lanes_frame.TOKENS
    movable: bool = False  # to another time, by a finger
    shorter: tuple[str, ...] = ()  # shorter labels, the best first; an empty one: none rather than a cut one


class Lane(NamedTuple):
    """A robot, its bars, and from when to when two of them want it."""

    name: str
    note: str = ""
    bars: tuple[Bar, ...] = ()
    overlaps: tuple[tuple[float, float], ...] = ()
    key: Hashable = None
    line: str = ""  # instead of a robot: what it represents
    is_open: bool = False  # and whether they follow it
    icon: str = ""  # of the robot's state
    tone: str = "neutral"
