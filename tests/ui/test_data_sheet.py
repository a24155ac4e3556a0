"""Facts of a robot's data sheet: no address is broken in the middle, at any width."""

from __future__ import annotations

import pytest

from app.widgets.display import Fact
from app.widgets.text import Value


@pytest.mark.parametrize(
    ("value", "lines"),
    [
        ("10.40.12.21", 1),
        ("192.168.100.200", 1),
        ("127.0.0.1:46123", 1),
        ("its serial number", 2),
        ("robot-in-hall-7.plant.example:8080", 2),
    ],
)
def test_a_word_of_a_value_is_broken_only_where_it_has_no_room_in_smaller_letters(ui, value, lines):
    fact = ui.show(Fact(label="Address", value=value), (145, 60))
    ui.advance(0.1)
    assert ui.find(Value, root=fact).lines == lines
