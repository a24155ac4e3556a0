"""What an operator sees and presses on the page of all robots."""

from __future__ import annotations

from app.container import Container
from app.domain.models import Connection, Robot
from app.domain.robot import QueueItem, RobotStatus
from app.screens.home.fleet_page import FleetPage, RobotCell
from app.widgets.list_row import ListRow, RowButton
from app.widgets.long_list import LongList
from app.widgets.tabs import TabButton
from app.window.key_focus import TAB, KeyFocus


def add_robots(container: Container, count: int) -> list[Robot]:
    """After the three of the plant."""
    return [
        container.catalogue.save_robot(Robot(f"Robot {n}", f"10.40.13.{n}", "scheduler"), "secret")
        for n in range(1, count + 1)
    ]


def see(container: Container, robot: Robot, status: RobotStatus, queue: tuple[QueueItem, ...] = ()) -> None:
    """A poll has found this."""
    now = container.clock.now()
    container.snapshots.update(
        robot.id, connection=Connection.CONNECTED, status=status, queue=queue, read_at=now, queue_read_at=now
    )


def tiles(ui) -> list[str]:
    """Names, in reading order on the screen."""

    def place(cell) -> tuple[float, float]:
        x, y = cell.to_window(*cell.pos)
        return -round(y), x

    return [cell.item.title for cell in sorted(ui.find_all(RobotCell), key=place)]


def counted(ui) -> list[str]:
    return [count.text for page in ui.find_all(FleetPage) for count in page.vm.counts]


def to_do(ui) -> list[str]:
    """The titles of the rows at the left, from the top."""
    return [row.item.title for row in ui.find(LongList).views]


def head(ui) -> str | None:
    """The title of what needs a person; None without the page."""
    return next((page.vm.pane.title for page in ui.find_all(FleetPage)), None)


def row_of(ui, title: str) -> ListRow:
    return next(row for row in ui.find(LongList).views if row.item.title == title)


def press(ui, title: str, text: str) -> None:
    """A button of that row."""
    ui.tap(ui.find(RowButton, row_of(ui, title), text=text))


def open_tile(ui, name: str) -> None:
    ui.tap(ui.find(RobotCell, title=name))


def go_back(ui) -> None:
    """Wait before and after, so that no tap counts as the second of a double tap."""
    ui.advance(0.5)
    ui.tap(next(tab for tab in ui.find_all(TabButton) if tab.tab.text == "All robots"))
    ui.advance(0.5)


def settle(app, ui) -> None:
    ui.wait(lambda: app.shell.background.idle)
    ui.advance(0.5)


def tab_to(ui, kind: type, **values) -> None:
    target = ui.find(kind, **values)
    for _n in range(KeyFocus().targets().index(target) + 1):
        ui.key(TAB)
