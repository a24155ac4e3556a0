"""The way from a list of missions to one that is not in it yet."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from app.i18n import _
from app.screens.common.shell import Shell
from app.widgets.items import Option

FETCH = "fetch"  # key of the option


def fetch_option() -> Option:
    return Option(FETCH, _("Not in the list? Fetch it from a robot"), "download", _("in Settings"))


def or_fetch(shell: Shell, choose: Callable[[Any], object]) -> Callable[[Any], object]:
    """The action for the chosen key."""
    return lambda key: shell.go("settings", section="missions", fetch=True) if key == FETCH else choose(key)
