"""The page of alarms as a person handles it."""

from __future__ import annotations

from app.mir.errors import Unreachable
from app.screens.frame.alarms import AlarmsScreen
from app.widgets.buttons import CommandButton, IconButton
from app.widgets.frame import TopBar
from app.widgets.list_row import ListRow
from app.widgets.menu import MenuRow
from app.widgets.tabs import TabButton


def open_list(ui) -> AlarmsScreen:
    ui.tap(ui.find(TopBar).ids.bell)
    ui.wait(lambda: ui.find_all(AlarmsScreen))
    return ui.find(AlarmsScreen)


def tab(ui, key: str) -> TabButton:
    return next(button for button in ui.find_all(TabButton) if button.tab.key == key)


def row(ui, text: str) -> ListRow:
    found = [row for row in ui.find_all(ListRow) if text in row.item.whole]
    assert found, [row.item.whole for row in ui.find_all(ListRow)]
    return found[0]


def press(ui, of: ListRow, word: str) -> None:
    ui.tap(ui.find(CommandButton, of, text=word))


def fold(ui, of: ListRow) -> None:
    """Or unfold."""
    ui.tap(ui.find(IconButton, of, icon="unfold-more-horizontal"))


def menu(ui, of: ListRow, word: str) -> None:
    ui.tap(ui.find(IconButton, of, icon="dots-vertical"))
    ui.tap(ui.find(MenuRow, text=word))


def wait_for_rows(ui, count: int) -> None:
    """In sight or not."""
    ui.wait(lambda: len(ui.find(AlarmsScreen).vm.rows) == count)
    ui.advance()


def silence(alarms, ui, count: int = 6) -> None:
    for number in range(count):
        alarms.raise_(
            "unreachable",
            f"robot:{70 + number}",
            robot=f"Robot {number}",
            problem=Unreachable(code="no_answer", address=f"10.1.1.{number}").message,
        )
    ui.wait(lambda: len(alarms.open()) == count and ui.find(TopBar).bell_count == "1")  # one cause
