"""A plain row with a cross, for the tests of lists."""

from __future__ import annotations

from kivy.metrics import dp

from app.widgets.items import Action, Item
from app.widgets.list_row import ListRow


class QueueRow(ListRow):
    """72 dp high."""

    def __init__(self, **kwargs: object) -> None:
        super().__init__(least=dp(72), **kwargs)


def entry(key: object, title: str, number: str = "", off: str = "") -> Item:
    """``off``: why its cross can't be pressed."""
    return Item(key, title, number=number, opens=False, actions=(Action("cancel", icon="close", off=off),))


def queue(*keys: int) -> list[Item]:
    return [entry(key, f"Mission {key}", str(key)) for key in keys]
