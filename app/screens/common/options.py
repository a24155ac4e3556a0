"""What can be chosen: options of a dialog or of a row of chips, commands of a menu, and a card with some."""

from __future__ import annotations

from collections.abc import Hashable
from dataclasses import dataclass


@dataclass(frozen=True)
class Option:
    """One of several choices. ``key`` is handed back when it is chosen; ``tone`` is of its icon."""

    key: Hashable
    text: str
    icon: str = ""
    note: str = ""
    selected: bool = False
    tone: str = "neutral"


@dataclass(frozen=True)
class MenuItem:
    """One command of a menu."""

    key: Hashable
    text: str
    icon: str = ""
    tone: str = "neutral"
    disabled: bool = False


@dataclass(frozen=True)
class Card:
    """What a thing on screen represents, and its actions."""

    title: str
    text: str
    items: tuple[MenuItem, ...]
