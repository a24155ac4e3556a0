"""What the tests of Settings share: a tablet with two robots and a home directory, and an integrator's hands."""
from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest

from app.domain.models import Mission, Robot, Schedule, Settings
from app.screens.settings.page import SettingsPage
from app.screens.settings.robot_dialog import RobotDialog
from app.widgets.buttons import CommandButton
from app.widgets.frame import NavItem
from app.widgets.rows import SectionRow
from app.widgets.snackbar import Snackbar
from app.widgets.surfaces import Tap
from app.window.application import SchedulerApp
from tests.ui.driver import Driver
from tests.ui.whole_app import Plant, plant


@contextmanager
def tablet(directory: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Plant]:
    """Two robots that answer and services that run; ``documents`` is where people keep their files."""
    documents = directory / "Documents"
    documents.mkdir()
    monkeypatch.setattr("platformdirs.user_documents_path", lambda: documents)
    with plant(directory / "data", robots=2) as site:
        site.documents = documents
        yield site


def go(ui: Driver, section: str) -> None:
    ui.tap(ui.find(NavItem, name="settings"))
    ui.wait(lambda: ui.find_all(SectionRow, key=section))
    ui.tap(ui.find(SectionRow, key=section))


def page(app: SchedulerApp) -> SettingsPage:
    """The section that is open."""
    return app.shell.navigator.screen("settings").page


def press(ui: Driver, word: str, root=None) -> None:
    ui.tap(ui.find(CommandButton, root=root, text=word))


def enter(ui: Driver, field, text: str) -> None:
    """Type ``text`` in place of what is in the field."""
    field.text = ""
    ui.type(field, text)


def fill_in(ui: Driver, **values: str) -> RobotDialog:
    """Type into the robot dialog that is open, field by field."""
    dialog = ui.find(RobotDialog)
    for name, text in values.items():
        enter(ui, dialog.ids[f"{name}_field"], text)
    return dialog


def says(ui: Driver, text: str) -> bool:
    return any(text in found for found in ui.texts())


def undo(ui: Driver) -> None:
    ui.tap(ui.find(Tap, root=ui.find(Snackbar)))


# ---------------------------------------------------------------------- what is saved
def robots(site: Plant) -> list[Robot]:
    return site.container.catalogue.robots()


def missions(site: Plant) -> list[Mission]:
    return site.container.catalogue.missions()


def schedules(site: Plant) -> list[Schedule]:
    return site.container.catalogue.schedules()


def settings(site: Plant) -> Settings:
    return site.container.settings()
