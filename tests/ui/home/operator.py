"""What an operator sees and presses on Home."""

from __future__ import annotations

from app.screens.home.cards import QueueMenu, SendTile, TodayRow
from app.screens.home.screen import HomeScreen
from app.widgets.buttons import CommandButton
from app.widgets.frame import TopBar
from app.widgets.items import Item
from app.widgets.list_row import RowButton, RowIcon
from app.widgets.menu import MenuRow
from app.widgets.tabs import TabButton

QUEUE = ("execution", "item", "more")  # kinds of rows


def press(ui, word: str, root=None) -> None:
    """The button with that word."""
    ui.tap(ui.find(CommandButton, root, text=word))


def step(ui, word: str) -> None:
    """The button of the card, which takes no press for a second after it has become another one."""
    ui.wait(lambda: ui.find_all(CommandButton, text=word, busy=False))
    press(ui, word)


def choose(ui, mission: str) -> None:
    """Open the sheet of that mission, until it is known what it asks for."""
    ui.tap(ui.find(SendTile, text=mission))
    ui.wait(lambda: ui.find_all(CommandButton, text="Run on Aino", busy=False))


def run(ui, mission: str) -> None:
    choose(ui, mission)
    ui.advance(0.7)  # what has just appeared takes no touch
    press(ui, "Run on Aino")


def open_robot(ui, name: str) -> None:
    """Its tab."""
    ui.tap(tab(ui, name))


def tab(ui, name: str) -> TabButton:
    return next(button for button in ui.find_all(TabButton, ui.find(TopBar)) if button.tab.text == name)


def items(ui, *kinds: str) -> list[Item]:
    """Those rows of Today that have one of these kinds of keys."""
    rows = sorted(ui.find_all(TodayRow), key=lambda row: -row.to_window(0, row.y)[1])
    return [row.item for row in rows if row.item.key[0] in kinds]


def rows(ui) -> list[tuple[str, str]]:
    """Of the queue: mission, and what is said of it."""
    return [(item.title, item.meta) for item in items(ui, *QUEUE)]


def is_shown_running(ui) -> bool:
    return any(item.lead == "Now" for item in items(ui, *QUEUE))


def is_shown_pending(ui) -> bool:
    """One of them in the robot's own queue, no longer in the app's alone."""
    sent = any(row.queue_id is not None for row in ui.find(HomeScreen).vm.facts.open)
    return sent and any(item.number for item in items(ui, *QUEUE))


def tap_cancel(ui, mission: str = "") -> None:
    """Of the first row in the queue that has one, or the first of that mission."""
    row = next(
        row
        for row in sorted(ui.find_all(TodayRow), key=lambda row: -row.to_window(0, row.y)[1])
        if row.item.key[0] in QUEUE and row.item.actions and mission in row.item.title
    )
    ui.tap((ui.find_all(RowIcon, row) or ui.find_all(RowButton, row))[0])


def clear_queue(ui) -> None:
    """As far as the question."""
    ui.tap(ui.find(QueueMenu))
    ui.wait(lambda: ui.find_all(MenuRow, text="Clear queue"))
    ui.advance(0.7)
    ui.tap(ui.find(MenuRow, text="Clear queue"))
    ui.advance(0.7)


def loud(ui) -> list[str]:
    """What the filled buttons say that can be pressed."""
    return [button.text for button in ui.find_all(CommandButton, style="filled", disabled=False)]


def pend(home) -> None:
    """Hold the robot, so that what is sent stays in its queue."""
    home.aino.control({"emergency_stop": True})
    home.aino.control({"emergency_stop": False})  # it is then in Pause
