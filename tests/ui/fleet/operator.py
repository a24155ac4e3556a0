"""What an operator sees and presses on the page of all robots."""

from __future__ import annotations

from app.container import Container
from app.domain.models import Connection, Robot
from app.domain.robot import QueueItem, RobotStatus
from app.screens.home.fleet_page import CountChip, FleetTile
from app.widgets.buttons import CommandButton
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

    def place(tile) -> tuple[float, float]:
        x, y = tile.to_window(*tile.pos)
        return -round(y), x

    return [tile.name for tile in sorted(ui.find_all(FleetTile), key=place)]


def counted(ui) -> list[str]:
    return [chip.text for chip in ui.find_all(CountChip)]


def open_tile(ui, name: str) -> None:
    ui.tap(ui.find(FleetTile, name=name))


def go_back(ui) -> None:
    """Wait before and after, so that no tap counts as the second of a double tap."""
    ui.advance(0.5)
    ui.tap(next(button for button in ui.find_all(CommandButton) if button.text.startswith("All robots")))
    ui.advance(0.5)


def settle(app, ui) -> None:
    ui.wait(lambda: app.shell.background.idle)
    ui.advance(0.5)


def tab_to(ui, kind: type, **values) -> None:
    targets = KeyFocus().targets()
    for _n in range(
        1
        + next(
            n
            for n, target in enumerate(targets)
            if isinstance(target, kind) and all(getattr(target, name) == value for name, value in values.items())
        )
    ):
        ui.key(TAB)
