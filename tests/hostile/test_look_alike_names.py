"""A file with a robot whose name looks like another's: who enters its password thinks it goes to the known machine."""

from __future__ import annotations

import pytest

from app.container import Container
from app.domain.models import InvalidInput
from app.mir.texts import clean
from tests.hostile.credentials import add, import_robot, stored

UNSEEN = [
    "\ufe00",
    "\ufe0e",
    "\ufe0f",
    "\U000e0100",
    "\U000e01ef",
    "\u180b",
    "\u200b",
    "\u00ad",
    "\u2061",
    "\U000e0041",
]


@pytest.mark.parametrize("character", UNSEEN, ids=ascii)
def test_a_robot_with_such_a_name_is_not_imported(container: Container, character: str) -> None:
    add(container, "http://127.0.0.1:9")
    for name in (f"Aino{character}", f"Ai{character}no", f"{character}Aino"):
        with pytest.raises(InvalidInput, match="invisible or unknown character"):
            import_robot(container, name=name, address="http://127.0.0.1:10")
    assert stored(container).address == "http://127.0.0.1:9"


@pytest.mark.parametrize("character", UNSEEN, ids=ascii)
def test_nor_has_a_robot_s_text_one(character: str) -> None:
    assert clean(f"Dock{character} {character}1") == "Dock 1"


def test_a_symbol_keeps_its_picture() -> None:
    assert clean("\u2764\ufe0f and \U0001f469\u200d\U0001f527") == "\u2764\ufe0f and \U0001f469\u200d\U0001f527"
