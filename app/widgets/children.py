"""A child for each of some data."""

from collections.abc import Callable, Hashable, Iterable
from itertools import takewhile
from typing import Any

from kivy.uix.widget import Widget

from app.widgets.places import places
from app.widgets.rest import rest


def refill(box: Any, keys: Iterable[Hashable], make: Callable[[Any], Widget]) -> list[Any]:
    """The children of ``box``, one for each of ``keys``, made by ``make(key)``. Those with the same keys in the same places stay, as a
    finger may be on one of them; from the first other key on they are new, and where others stood they take no tap for a moment."""
    keys, before = list(keys), getattr(box, "filled_for", [])
    same = sum(1 for _ in takewhile(lambda pair: pair[0] == pair[1], zip(keys, before, strict=False)))
    for child in box.children[: len(before) - same]:
        rest.after_pressing(child)
        box.remove_widget(child)
    for key in keys[same:]:
        box.add_widget(child := make(key))
        places.come(child, among_others=bool(before))
    box.filled_for = keys
    return list(box.children[::-1])
