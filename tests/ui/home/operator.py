"""What an operator sees and presses on Home."""

from __future__ import annotations

from app.screens.home.cards import QueueCard
from app.widgets.buttons import ChoiceChip, CommandButton
from app.widgets.long_list import LongList
from app.widgets.rows import QueueRow


def is_shown_running(ui) -> bool:
    """The first of the queue."""
    return any(" · started " in origin for _mission, origin in rows(ui)[:1])


def press(ui, word: str) -> None:
    """The button with that word."""
    ui.tap(ui.find(CommandButton, text=word))


def choose(ui, mission: str) -> None:
    ui.tap(ui.find(ChoiceChip, text=mission))


def rows(ui) -> list[tuple[str, str]]:
    return [(row.mission, row.origin) for row in ui.find_all(QueueRow)]


def is_shown_pending(ui) -> bool:
    """One of them in the robot's own queue, by its number."""
    return any(row.number for row in ui.find_all(QueueRow))


def loud(ui) -> list[str]:
    """What the filled buttons say that can be pressed."""
    return [button.text for button in ui.find_all(CommandButton, style="filled", disabled=False)]


def visible_rows(ui) -> list[tuple[str, str]]:
    """Those whose middle lies in the list."""
    in_sight = ui.find(LongList, ui.find(QueueCard))
    return [
        (row.mission, row.origin)
        for row in in_sight.views
        if in_sight.collide_point(*in_sight.parent.to_widget(*row.to_window(*row.center)))
    ]


def run(ui, mission: str) -> None:
    choose(ui, mission)
    press(ui, "Run on Aino")


def pend(home) -> None:
    """Hold the robot, so that what is sent stays in its queue."""
    home.aino.control({"emergency_stop": True})
    home.aino.control({"emergency_stop": False})  # it is then in Pause
