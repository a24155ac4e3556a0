"""The list of alarms as a person handles it."""

from __future__ import annotations

from app.mir.errors import Unreachable
from app.screens.frame.alarm_list import AlarmRow, AlarmsDialog
from app.widgets.buttons import IconButton, Segment
from app.widgets.dialogs import MenuRow
from app.widgets.frame import AlarmBanner, TopBar


def open_list(ui) -> AlarmsDialog:
    ui.tap(ui.find(TopBar).ids.bell)
    return ui.find(AlarmsDialog)


def tab(ui, key: str) -> Segment:
    return ui.find(Segment, root=ui.find(AlarmsDialog), key=key)


def row(ui, code_text: str) -> AlarmRow:
    found = [row for row in ui.find_all(AlarmRow) if code_text in row.text]
    assert found, [row.text for row in ui.find_all(AlarmRow)]
    return found[0]


def menu(ui, of: AlarmRow, word: str) -> None:
    ui.tap(ui.find(IconButton, of, icon="dots-vertical"))
    ui.tap(ui.find(MenuRow, text=word))


def wait_for_rows(ui, count: int) -> None:
    """In sight or not."""
    ui.wait(lambda: len(ui.find(AlarmsDialog).rows) == count)
    ui.advance()


def silence(alarms, ui, count: int = 6) -> None:
    for number in range(count):
        alarms.raise_(
            "unreachable",
            f"robot:{70 + number}",
            robot=f"Robot {number}",
            problem=Unreachable(code="no_answer", address=f"10.1.1.{number}").message,
        )
    ui.wait(lambda: ui.find_all(AlarmBanner) and ui.find(AlarmBanner).text.startswith(f"Wi-Fi: {count} robots"))
