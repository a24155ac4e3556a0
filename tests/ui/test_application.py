"""The window as a whole: polls, starts late only when allowed, restores a damaged database, ends cleanly."""

from __future__ import annotations

import gc
import os
import subprocess
import sys
import threading
import weakref
from datetime import timedelta
from pathlib import Path

import pytest
from kivy.core.window import Window

from app.container import Container
from app.database.backups import back_up
from app.database.connection import Database, DatabaseDamaged
from app.domain.execution import State
from app.domain.message import render
from app.domain.models import Robot, Schedule
from app.failures import BadInput, Failure
from app.i18n import translation, translator
from app.process.data_directory import DataDirectory, restore_backup
from app.screens.frame.late_starts import LateSheet
from app.screens.home.sending import AllMissionsSheet
from app.screens.rescue import TRIED_EVERY, Damage, NotStarted
from app.services.live.changes import Topic
from app.widgets.buttons import CommandButton, IconButton
from app.widgets.frame import Banner
from app.widgets.lanes import Lanes
from app.widgets.list_row import ListRow, RowButton
from app.widgets.sheet import AskSheet
from app.widgets.tokens import tk
from app.window import window
from app.window.application import SchedulerApp, UiExceptionHandler
from app.window.key_focus import ENTER, TAB
from tests.support.examples import at_night
from tests.ui.drawing import put_down
from tests.ui.whole_app import plant, shown, tab_shown

ROOT = Path(__file__).parents[2]


@pytest.fixture
def site(tmp_path):
    with plant(tmp_path) as site:
        yield site


# ---------------------------------------------------------------------- the first screen
@pytest.mark.long
def test_without_a_robot_it_opens_once_on_the_steps_of_the_set_up(site, ui):
    with shown(site.container, ui, None) as app:
        ui.wait(lambda: app.shell.navigator.current == "settings" and "Robots answer" in ui.texts())
        app.shell.go("home")
        ui.advance(2)
        assert app.shell.navigator.current == "home"
    site.add_robots()
    with shown(site.container, ui, None) as app:
        assert app.shell.navigator.current == "home"


@pytest.mark.long
def test_the_steps_of_the_set_up_are_behind_the_pin_too(site, ui):
    site.container.access.set_pin("2580")
    with shown(site.container, ui, None) as app:
        ui.wait(lambda: "Enter the PIN" in ui.texts())
        assert app.shell.navigator.current == "home"


# ---------------------------------------------------------------------- polling
def test_the_window_asks_for_a_cycle_every_poll_interval(tmp_path, ui, monkeypatch):
    asked = []
    with plant(tmp_path, start=False) as site:
        monkeypatch.setattr(site.container.engine, "request_cycle", lambda by_window=False: asked.append(by_window))
        ask_for_cycles(site, ui, asked)


def ask_for_cycles(site, ui, asked: list[bool]) -> None:
    site.container.catalogue.change_settings(poll_interval_seconds=10)
    with shown(site.container, ui):
        assert asked  # at once
        ui.advance(0.5)
        asked.clear()
        ui.advance(31)
        assert asked == [True] * 3
        site.container.catalogue.change_settings(poll_interval_seconds=5)
        ui.advance(0.2)
        ui.advance(10.1)
        assert len(asked) == 3 + 1 + 2  # a new interval begins with a cycle
    ui.advance(30)
    assert len(asked) == 6  # closed: nothing is asked any more


# ---------------------------------------------------------------------- survival
def test_a_flood_of_failures_is_reported_once_a_second_even_if_reporting_fails(caplog):
    reported = []
    survivor = UiExceptionHandler(reported.append)
    for said in "xxxxxy":
        survivor.handle_exception(RuntimeError(said))
    assert len(reported) == 1
    assert [record.exc_info[1].args for record in caplog.records] == [("x",), ("y",)]  # each is logged

    def fails(_problem):
        raise ValueError

    assert UiExceptionHandler(fails).handle_exception(RuntimeError("x")) == survivor.handle_exception(RuntimeError("x"))


def test_ctrl_c_still_ends_the_app():
    from kivy.base import ExceptionManager

    assert UiExceptionHandler(print).handle_exception(KeyboardInterrupt()) == ExceptionManager.RAISE


# ---------------------------------------------------------------------- late starts
def late_schedule(site, name: str = "Home", position: str = "") -> None:
    """A schedule that fell due while the app was off, still inside its start window; of a mission that is given a ``position``."""
    container = site.container
    (robot,) = site.add_robots()
    (mission,) = site.add_missions(name)
    facts = {
        asked.name: next(key for key, label in asked.choices if label == position)
        for asked in (container.robot_missions.parameters(robot.id, mission.guid) if position else ())
    }
    now = container.clock.now()
    due = now - timedelta(minutes=2)
    container.catalogue.save_schedule(
        Schedule(
            "Late one",
            robot.id,
            mission.id,
            due.replace(tzinfo=None, second=0, microsecond=0),
            "UTC",
            respect_working_days=False,
            parameters=facts,
        )
    )
    heartbeat = now - timedelta(hours=1)
    container.db.write(lambda c: container.repositories.settings.set_heartbeat(c, heartbeat))
    container.runner.start()


def test_late_starts_lie_over_home_and_can_be_put_on_hold_and_released(tmp_path, ui):
    with plant(tmp_path, start=False) as site:
        late_schedule(site)
        with shown(site.container, ui) as app:
            ui.wait(lambda: {"Not started yet", "Home", "Aino · 2 min late"} <= set(ui.texts()))
            assert not ui.find(LateSheet).closable
            app.shell.go("logs")
            ui.wait(lambda: ui.find_all(Banner, action="Hold all"))
            app.shell.go("home")
            ui.wait(lambda: ui.find_all(LateSheet) and not ui.find_all(Banner))
            ui.tap(ui.find(CommandButton, text="Hold all"))
            ui.wait(lambda: {"1 on hold", "1 start is on hold"} <= set(ui.texts()))
            app.shell.navigator.screen("home").vm.sending.open_all()
            ui.advance(2)
            assert ui.find_all(AllMissionsSheet)
            ui.wait(lambda: ui.find_all(CommandButton, text="Show"))
            ui.tap(ui.find(CommandButton, text="Show"))
            assert [(e.state, e.held) for e in site.container.history.open()] == [(State.WAITING, True)]
            ui.advance(1)
            ui.tap(ui.find(IconButton, ui.find(LateSheet), icon="close", visible=True))
            ui.wait(lambda: "1 late start on hold" in ui.texts())
            ui.tap(ui.find(CommandButton, text="Show"))
            ui.tap(ui.find(CommandButton, ui.find(LateSheet), text="Release"))
            ui.advance(0.5)
            assert ui.find(AskSheet).title == "1 start is due now"
            ui.tap(ui.find(CommandButton, ui.find(AskSheet), text="Release"))
            ui.wait(lambda: all(e.state is not State.WAITING for e in site.container.history.open()))
            assert not site.container.holds.active()


@pytest.mark.long
def test_a_late_start_that_is_not_wanted_is_cancelled_and_can_be_had_back(tmp_path, ui):
    with plant(tmp_path, start=False) as site:
        late_schedule(site)
        with shown(site.container, ui) as app:
            ui.wait(lambda: ui.find_all(RowButton, text="Don't start"))
            ui.tap(ui.find(RowButton, ui.find(LateSheet), text="Don't start"))
            ui.wait(lambda: not ui.find_all(LateSheet))
            assert site.container.history.open() == []
            assert app.shell.snackbars.texts == ["Home is cancelled"]
            ui.tap_text("Undo")
            ui.wait(lambda: site.container.history.open())


@pytest.mark.long
def test_a_late_start_is_called_by_where_it_goes(tmp_path, ui):
    with plant(tmp_path, start=False) as site:
        late_schedule(site, "Go to position", "Press")
        with shown(site.container, ui):
            ui.wait(lambda: ui.find_all(LateSheet))
            ui.wait(lambda: "Go to position · Press" in ui.texts(ui.find(LateSheet)))


# ---------------------------------------------------------------------- a damaged database
def damaged_directory(path: Path, language: str = "en") -> DatabaseDamaged:
    """A data directory whose database is broken, with one good backup that knows a robot."""
    db = Database.open(path / "amr-scheduler.db")
    db.close()
    with plant(path, start=False) as site:
        site.container.catalogue.save_robot(
            Robot("Aino", site.fleet.robots[0].url, "distributor"), password="distributor"
        )
        site.container.catalogue.change_settings(language=language)
        back_up(site.container.db.path, path / "backups" / "daily-2026-11-20.db")
    for side in path.glob("amr-scheduler.db-*"):
        side.unlink()
    (path / "amr-scheduler.db").write_bytes(b"this is no database" * 1000)
    with pytest.raises(DatabaseDamaged) as caught:
        Database.open(path / "amr-scheduler.db")
    return caught.value


def restore_button(ui) -> CommandButton:
    return next(button for button in ui.find_all(CommandButton) if button.style == "filled")


@pytest.mark.parametrize("by", ["finger", *at_night("keyboard")])
def test_a_damaged_database_is_a_screen_with_a_restore_button(tmp_path, ui, by):
    damage = damaged_directory(tmp_path)
    directory = DataDirectory(tmp_path)
    opened = []

    def restore(backup):
        restore_backup(directory, backup)
        opened.append(Container.open(tmp_path, with_window=True))
        return opened[0]

    app = SchedulerApp(None, damage=Damage(damage, restore))
    app._run_prepare()
    try:
        ui.advance(0.2)
        assert {"Data is damaged", "Nothing is sent. Robots continue with what they have."} <= set(ui.texts())
        if by == "finger":
            ui.tap(ui.find(CommandButton, text="What is damaged"))
            (reported,) = (text for text in ui.texts() if text.startswith(f"The database {damage.path} is damaged ("))
            assert reported.endswith(f"), kept as {damage.kept_as}")
            assert not [text for text in ui.texts() if "main.py" in text]  # the operator has a button and no shell
            ui.tap(restore_button(ui))
        else:
            ui.key(TAB)  # "Choose another"
            ui.key(TAB)
            ui.key(ENTER)
        ui.wait(lambda: app.container is not None)
        ui.wait(lambda: tab_shown(ui) == "Aino")
    finally:
        app.dispatch("on_stop")
        ui.advance()
        for container in opened:
            container.close()


@pytest.mark.long
def test_the_screen_of_a_damaged_database_speaks_the_language_that_was_set(tmp_path, ui):
    damage = damaged_directory(tmp_path, language="fi")
    problem = BadInput(damage.text)
    problem.__cause__ = damage
    app = window._app_without_services(DataDirectory(tmp_path), problem, lambda: None, lambda _backup: None)
    app._run_prepare()
    try:
        ui.advance(0.2)
        ui.tap(ui.find(CommandButton, text="Mikä on vioittunut"))
        assert render(Damage(damage, print).sentence, translation("fi").gettext) in ui.texts()
        assert restore_button(ui).text.startswith("Palauta ")
    finally:
        app.dispatch("on_stop")
        translator.use("en")


def test_without_a_good_backup_another_is_chosen_and_a_failed_restore_says_why(tmp_path, ui):
    asked = []

    def fails(backup):
        asked.append(backup)
        raise BadInput("the disk is full")

    app = SchedulerApp(None, damage=Damage(DatabaseDamaged(tmp_path / "a.db", "torn"), fails))
    ui.show(app.build())
    assert "No good backup on this tablet" in ui.texts()
    ui.tap(ui.find(CommandButton, text="Choose a backup"))
    ui.wait(lambda: "No backup here, on a stick or a share" in ui.texts())
    ui.tap(ui.find(CommandButton, text="What is damaged"))
    assert [text for text in ui.texts() if "--restore-backup FILE" in text]
    chosen = tmp_path / "backups" / "daily-2026-11-20.db"
    chosen.parent.mkdir()
    chosen.write_bytes(b"of another time")
    ui.advance(1)
    ui.tap(ui.find(CommandButton, text="Choose a backup"))
    ui.wait(lambda: [row for row in ui.find_all(ListRow) if row.key == str(chosen)])
    ui.advance(1.1)  # a row that has just slid takes no touch
    ui.tap(next(row for row in ui.find_all(ListRow) if row.key == str(chosen)))
    ui.advance(1)
    ui.tap(restore_button(ui))
    ui.wait(lambda: "the disk is full" in ui.texts())
    assert asked == [chosen]
    assert not restore_button(ui).busy


# ---------------------------------------------------------------------- another reason not to start
@pytest.mark.long
def test_what_keeps_the_app_from_starting_is_said_until_it_starts(tmp_path, ui):
    problems = [Failure("the disk is full"), BadInput("in use by another process")]
    with plant(tmp_path, start=False) as site:

        def start() -> Container:
            if problems:
                raise problems.pop()
            return site.container

        app = SchedulerApp(None, damage=NotStarted(problems.pop(0), start))
        app._run_prepare()
        try:
            ui.advance(0.2)
            assert "The app can't start" in ui.texts()
            assert Window.clearcolor == tk.bg  # nothing else is behind the words
            ui.wait(lambda: [text for text in ui.texts() if text.startswith("the disk is full\n")])
            ui.advance(TRIED_EVERY)
            ui.wait(lambda: [text for text in ui.texts() if text.startswith("in use by another process\n")])
            assert app.container is None
            ui.advance(TRIED_EVERY)
            ui.wait(lambda: app.container is site.container and app.shell.navigator.current == "settings")
        finally:
            app.dispatch("on_stop")
            ui.advance()


def going_back(tmp_path):
    """Services that know Aino, a backup of them, and Veikko who came later; how the window goes back,
    as soon as it may."""
    may = threading.Event()
    container = Container.open(tmp_path, with_window=True)
    container.catalogue.save_robot(Robot("Aino", "http://127.0.0.1:9", "u"), password="p")
    backup = tmp_path / "backups" / "daily-2026-11-20.db"
    back_up(container.db.path, backup)
    container.catalogue.save_robot(Robot("Veikko", "http://127.0.0.1:10", "u"), password="p")
    opened = [container]

    def restore(path):
        may.wait(30)
        opened[-1].close()
        problem = None
        try:
            restore_backup(DataDirectory(tmp_path), path)
        except BadInput as error:
            problem = error
        opened.append(Container.open(tmp_path, with_window=True))
        return opened[-1], problem

    return opened, backup, restore, may


def names(container):
    return [robot.name for robot in container.repositories.robots.all(container.db.read())]


@pytest.mark.long
@pytest.mark.parametrize("is_good", [True, False])
def test_the_running_app_goes_back_to_a_backup_and_on_with_it(tmp_path, ui, is_good):
    opened, backup, restore, may = going_back(tmp_path)
    if not is_good:
        backup = tmp_path / "backups" / "daily-bad.db"
        backup.write_bytes(b"no database")
    app = SchedulerApp(opened[0], restore=restore)
    app._run_prepare()
    try:
        ui.advance(0.2)
        app.shell.go("settings", section="data")
        ui.wait(lambda: app.shell.background.idle)
        app.shell.restore(backup)
        ui.advance()
        assert any(text.startswith("Restoring") for text in ui.texts())
        may.set()
        ui.wait(lambda: app.container is not None)
        ui.advance(0.3)
        assert app.container is opened[1]
        assert names(app.container) == (["Aino"] if is_good else ["Aino", "Veikko"])
        assert any(backup.name in text for text in ui.texts())
        ui.wait(lambda: tab_shown(ui) == "Aino")
    finally:
        may.set()
        app.dispatch("on_stop")
        ui.advance()
        opened[-1].close()


@pytest.mark.long
def test_damage_that_is_found_while_it_runs_can_be_repaired_by_keys_alone(tmp_path, ui):
    opened, backup, restore, may = going_back(tmp_path)
    may.set()
    app = SchedulerApp(opened[0], restore=restore)
    app._run_prepare()
    try:
        ui.advance(0.2)
        app.container.runner.on_damage(DatabaseDamaged(tmp_path / "a.db", "torn", backup=backup))
        ui.advance(0.2)
        assert "Data is damaged" in ui.texts()
        ui.key(TAB)  # "Choose another"
        ui.key(TAB)
        ui.key(ENTER)
        ui.wait(lambda: app.container is not None, seconds=10)
        assert names(app.container) == ["Aino"]
    finally:
        app.dispatch("on_stop")
        ui.advance()
        opened[-1].close()


@pytest.mark.long
def test_a_finger_may_be_on_the_timeline_while_the_app_goes_back(tmp_path, ui):
    opened, backup, restore, may = going_back(tmp_path)
    app = SchedulerApp(opened[0], restore=restore)
    app._run_prepare()
    try:
        app.shell.go("scheduler")
        ui.wait(lambda: app.shell.background.idle)
        chart = ui.find(Lanes)
        finger = put_down(*chart.to_window(*chart.center))
        finger.touch_move(finger.x + 100, finger.y)
        app.shell.restore(backup)
        ui.advance()
        finger.touch_up()
        assert not chart.touched
    finally:
        may.set()
        ui.wait(lambda: app.container is not None)
        app.dispatch("on_stop")
        ui.advance()
        opened[-1].close()


# ---------------------------------------------------------------------- the end
def test_a_closed_window_lets_go_of_the_services(site, ui):
    site.add_robots()
    listeners = len(site.container.changes._listeners)
    with shown(site.container, ui) as app:
        ui.wait(lambda: "Ready" in ui.texts())
        assert len(site.container.changes._listeners) > listeners
        reference = weakref.ref(app.shell.navigator)
    assert len(site.container.changes._listeners) == listeners
    site.container.changes.publish(Topic.SETTINGS)
    ui.advance(2)
    del app
    gc.collect()
    assert reference() is None or not reference().built


def run_main(tmp_path: Path, *arguments: str, **environment: str) -> subprocess.CompletedProcess:
    env = {
        name: value
        for name, value in os.environ.items()
        if name not in ("DISPLAY", "WAYLAND_DISPLAY", "SDL_VIDEODRIVER") and not name.startswith("KIVY_")
    }
    return subprocess.run(
        [sys.executable, str(ROOT / "main.py"), "--data-dir", str(tmp_path / "data"), *arguments],
        check=False,
        capture_output=True,
        text=True,
        timeout=60,
        env={**env, "XDG_CACHE_HOME": str(tmp_path), **environment},
    )


@pytest.mark.parametrize("environment", [{"DISPLAY": ":987"}, *at_night({})])
def test_without_a_display_one_line_says_so(tmp_path, environment):
    done = run_main(tmp_path, **environment)
    assert done.returncode == 1
    assert done.stdout == ""
    assert len(done.stderr.splitlines()) == 1
    assert "--headless" in done.stderr
