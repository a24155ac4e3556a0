"""Settings as an integrator uses it: taps and typing, on real services, files and simulated robots."""
from __future__ import annotations

import gc
import json
import socket
import weakref
from datetime import datetime
from pathlib import Path

import pytest

from app.models import Mission, Robot, Schedule
from app.screens.settings_constraints import ConstraintsPage
from app.screens.settings_data import FileRow
from app.screens.settings_idle import IdlePanel
from app.screens.settings_missions import MissionDialog, MissionRow
from app.screens.settings_page import SwitchRow
from app.screens.settings_robot_dialog import RobotDialog
from app.screens.settings_robots import RobotPanel
from app.services.mir.credentials import Token
from app.widgets.buttons import CommandButton, IconButton, Segment, Toggle
from app.widgets.dialogs import ChoiceDialog
from app.widgets.display import Notice
from app.widgets.fields import FormField, PickBox, PickField, RepeatButton, SearchField, StepField
from app.widgets.frame import NavItem
from app.widgets.panel_grid import PanelGrid
from app.widgets.rows import OptionRow, RobotChip, SectionRow
from app.widgets.snackbar import Snackbar
from app.widgets.surfaces import Tap
from app.widgets.tokens import tk
from tests.ui.whole_app import GUIDS, PASSWORD, USER, plant, shown


@pytest.fixture
def site(tmp_path, monkeypatch):
    monkeypatch.setattr("platformdirs.user_documents_path", lambda: tmp_path / "Documents")
    (tmp_path / "Documents").mkdir()
    with plant(tmp_path / "data", robots=2) as site:
        site.documents = tmp_path / "Documents"
        yield site


@pytest.fixture
def app(site, ui):
    """The app on an empty database."""
    with shown(site.container, ui) as app:
        yield app


# ---------------------------------------------------------------------- hands
def go(ui, section: str) -> None:
    ui.tap(ui.find(NavItem, name="settings"))
    ui.wait(lambda: ui.find_all(SectionRow, key=section))
    ui.tap(ui.find(SectionRow, key=section))


def press(ui, word: str, root=None) -> None:
    ui.tap(ui.find(CommandButton, root=root, text=word))


def enter(ui, field, text: str) -> None:
    """Type ``text`` in the place of what stands there."""
    field.text = ""
    ui.type(field, text)


def fill_in(ui, **values: str) -> RobotDialog:
    """Type into the robot dialog that is open, field by field."""
    dialog = ui.find(RobotDialog)
    for name, text in values.items():
        enter(ui, dialog.ids[f"{name}_field"], text)
    return dialog


def robots(site) -> list[Robot]:
    return site.container.repositories.robots.all(site.container.db.read())


def missions(site) -> list[Mission]:
    return site.container.repositories.missions.all(site.container.db.read())


def schedules(site) -> list[Schedule]:
    return site.container.repositories.schedules.all(site.container.db.read())


def says(ui, text: str) -> bool:
    return any(text in found for found in ui.texts())


def undo(ui) -> None:
    bar = ui.find(Snackbar)
    ui.tap(ui.find(Tap, root=bar))


# ---------------------------------------------------------------------- robots
def test_the_first_robot_from_the_empty_home_to_its_panel(site, app, ui):
    ui.wait(lambda: "Add your first robot" in ui.texts())
    press(ui, "Add robot")
    ui.wait(lambda: ui.find_all(RobotDialog))
    dialog = fill_in(ui, name="Aino", address=site.fleet.robots[0].url, username=USER, password=PASSWORD)
    press(ui, "Test connection", dialog)
    ui.wait(lambda: dialog.vm.outcome.tone == "done")
    assert dialog.vm.outcome.text.startswith("Aino answers in ")
    assert "MiR" in dialog.vm.outcome.note
    assert "serial" in dialog.vm.outcome.note
    assert robots(site) == []                                 # a test saves nothing
    press(ui, "Save robot", dialog)
    ui.wait(lambda: robots(site) and not ui.find_all(RobotDialog))
    ui.wait(lambda: ui.find_all(RobotPanel))
    panel, = ui.find_all(RobotPanel)
    assert (panel.name, panel.address) == ("Aino", site.fleet.robots[0].url.removeprefix("http://"))
    ui.wait(lambda: panel.badge.startswith("Connected"))
    assert panel.serial not in ("", "–")
    ui.tap(ui.find(NavItem, name="home"))
    ui.wait(lambda: [chip.name for chip in ui.find_all(RobotChip)] == ["Aino"])


def test_saving_tests_first_and_says_what_is_wrong_at_the_field(site, app, ui):
    go(ui, "robots")
    press(ui, "Add robot")
    dialog = fill_in(ui, name="Aino", address=site.fleet.robots[0].url, username=USER, password="wrong")
    press(ui, "Save robot", dialog)
    ui.wait(lambda: dialog.vm.outcome.tone == "fault")
    assert says(ui, "doesn't accept the user name and password")
    assert dialog.ids.password_field.problem == "Check user name and password"
    assert robots(site) == []
    enter(ui, dialog.ids.password_field, PASSWORD)            # mended: the field is not red any more, Save saves
    assert dialog.ids.password_field.problem == ""
    press(ui, "Save robot", dialog)
    ui.wait(lambda: [robot.name for robot in robots(site)] == ["Aino"])
    assert robots(site)[0].token == Token.derive(USER, PASSWORD).header


def test_a_robot_that_does_not_answer_can_be_saved_by_a_second_press(site, app, ui):
    with socket.socket() as closed:                           # bound, not listening: refused
        closed.bind(("127.0.0.1", 0))
        go(ui, "robots")
        press(ui, "Add robot")
        dialog = fill_in(ui, name="Late", address=f"127.0.0.1:{closed.getsockname()[1]}", username=USER, password=PASSWORD)
        press(ui, "Save robot", dialog)
        ui.wait(lambda: dialog.vm.save_word == "Save anyway")
        assert says(ui, "refused the connection")
        assert robots(site) == []
        press(ui, "Save anyway", dialog)
        ui.wait(lambda: [robot.name for robot in robots(site)] == ["Late"])


@pytest.mark.parametrize(("field", "text", "problem"), [
    ("name", "", "Give the robot a name"),
    ("address", "not an address", "An address has no spaces"),
    ("username", "a:b", "A user name can't contain a colon"),
    ("username", "", "Enter the robot's user name"),
    ("password", "", f"Enter the password of {USER}"),
])
def test_bad_input_is_one_sentence_at_its_field_and_nothing_is_saved(site, app, ui, field, text, problem):
    go(ui, "robots")
    press(ui, "Add robot")
    values = {"name": "Aino", "address": site.fleet.robots[0].url, "username": USER, "password": PASSWORD, field: text}
    dialog = fill_in(ui, **values)
    press(ui, "Save robot", dialog)
    ui.wait(lambda: dialog.ids[f"{field}_field"].problem.startswith(problem))
    ui.wait(lambda: app.shell.background.idle)
    assert robots(site) == []
    assert ui.find(RobotDialog).ids.address_field.text == values["address"]      # nothing that was entered is lost


def test_a_name_that_is_taken_is_said_at_the_name(site, app, ui):
    site.add_robots()
    go(ui, "robots")
    press(ui, "Add robot")
    dialog = fill_in(ui, name="Aino", address=site.fleet.robots[1].url, username=USER, password=PASSWORD)
    press(ui, "Save robot", dialog)
    ui.wait(lambda: dialog.ids.name_field.problem == "There is a robot Aino already")
    assert len(robots(site)) == 2


def test_something_else_at_the_address_is_no_robot(site, app, ui):
    site.fleet.robots[0].control({"fault": {"kind": "html", "path": "*", "count": None}})
    go(ui, "robots")
    press(ui, "Add robot")
    dialog = fill_in(ui, name="Page", address=site.fleet.robots[0].url, username=USER, password=PASSWORD)
    press(ui, "Test connection", dialog)
    ui.wait(lambda: dialog.vm.outcome.tone == "fault")
    assert "web page" in dialog.vm.outcome.text


def test_the_panel_tests_the_stored_connection(site, app, ui):
    site.add_robots()
    go(ui, "robots")
    ui.wait(lambda: len(ui.find_all(RobotPanel)) == 2)
    panel = ui.find(RobotPanel, name="Veikko")
    press(ui, "Test connection", panel)
    ui.wait(lambda: panel.result_tone == "done")
    assert panel.result.startswith("Veikko answers in")
    aino = ui.find(RobotPanel, name="Aino")
    site.container.catalogue.save_robot(next(robot for robot in robots(site) if robot.name == "Aino"), password="changed there")
    press(ui, "Test connection", aino)
    ui.wait(lambda: aino.result_tone == "fault")
    assert "doesn't accept" in aino.result


def test_editing_keeps_the_password_and_never_shows_it(site, app, ui):
    site.add_robots()
    token = robots(site)[0].token
    go(ui, "robots")
    ui.wait(lambda: ui.find_all(RobotPanel))
    press(ui, "Edit", ui.find(RobotPanel, name="Aino"))
    dialog = ui.find(RobotDialog)
    assert (dialog.ids.password_field.text, dialog.ids.password_field.hint) == ("", "unchanged")
    enter(ui, dialog.ids.name_field, "Aino 2")
    press(ui, "Save robot", dialog)
    ui.wait(lambda: not ui.find_all(RobotDialog))
    assert {robot.name: robot.token for robot in robots(site)}["Aino 2"] == token
    assert says(ui, "Aino 2 saved")


def test_another_user_needs_the_users_own_password(site, app, ui):
    site.add_robots()
    go(ui, "robots")
    ui.wait(lambda: ui.find_all(RobotPanel))
    press(ui, "Edit", ui.find(RobotPanel, name="Aino"))
    dialog = fill_in(ui, username="admin")
    press(ui, "Save robot", dialog)
    assert dialog.ids.password_field.problem == "Enter the password of admin"
    enter(ui, dialog.ids.password_field, "admin")
    press(ui, "Save robot", dialog)
    ui.wait(lambda: not ui.find_all(RobotDialog))
    assert robots(site)[0].username == "admin"


def test_another_machine_is_told_before_it_is_accepted(site, app, ui):
    site.add_robots()
    ui.wait(lambda: all(robot.serial_number for robot in robots(site)))
    before = robots(site)[0].serial_number
    go(ui, "robots")
    ui.wait(lambda: ui.find_all(RobotPanel))
    press(ui, "Edit", ui.find(RobotPanel, name="Aino"))
    dialog = fill_in(ui, address=site.fleet.robots[1].url)
    press(ui, "Save robot", dialog)
    ui.wait(lambda: dialog.vm.save_word == "Save as this robot")
    assert before in dialog.vm.outcome.text
    assert robots(site)[0].serial_number == before
    press(ui, "Save as this robot", dialog)
    ui.wait(lambda: not ui.find_all(RobotDialog))
    assert robots(site)[0].serial_number == robots(site)[1].serial_number


def test_a_robot_can_be_switched_off_without_answering(site, app, ui):
    site.add_robots()
    go(ui, "robots")
    ui.wait(lambda: ui.find_all(RobotPanel))
    press(ui, "Edit", ui.find(RobotPanel, name="Aino"))
    dialog = ui.find(RobotDialog)
    ui.tap(ui.find(Toggle, root=dialog))
    press(ui, "Save robot", dialog)
    ui.wait(lambda: not ui.find_all(RobotDialog))
    assert not robots(site)[0].enabled
    ui.wait(lambda: ui.find(RobotPanel, name="Aino").badge == "Switched off")


def test_a_certificate_is_asked_for_only_with_https(site, app, ui):
    go(ui, "robots")
    press(ui, "Add robot")
    dialog = fill_in(ui, name="Safe", address="https://10.0.0.1", username=USER, password=PASSWORD)
    assert not dialog.ids.fingerprint_field.disabled
    enter(ui, dialog.ids.fingerprint_field, "no fingerprint")
    press(ui, "Save robot", dialog)
    ui.wait(lambda: dialog.ids.fingerprint_field.problem.startswith("A SHA-256 fingerprint"))
    enter(ui, dialog.ids.address_field, "10.0.0.1")
    assert "Certificate fingerprint (SHA-256)" not in ui.texts(dialog)


def test_a_deleted_robot_comes_back_with_its_schedules(site, app, ui):
    aino, _veikko = site.add_robots()
    mission, = site.add_missions("Deliver")
    site.container.catalogue.save_schedule(Schedule("Morning", aino.id, mission.id, datetime(2030, 1, 7, 6, 30), "UTC", "FREQ=DAILY"))
    go(ui, "robots")
    ui.wait(lambda: ui.find_all(RobotPanel, name="Aino"))
    press(ui, "Edit", ui.find(RobotPanel, name="Aino"))
    press(ui, "Delete robot", ui.find(RobotDialog))
    ui.wait(lambda: len(robots(site)) == 1)
    assert schedules(site) == []
    ui.wait(lambda: says(ui, "Aino and its schedule deleted"))
    undo(ui)
    ui.wait(lambda: len(robots(site)) == 2)
    assert [schedule.name for schedule in schedules(site)] == ["Morning"]
    ui.wait(lambda: len(ui.find_all(RobotPanel)) == 2)


# ---------------------------------------------------------------------- missions
def fetch(ui, robot: str) -> ChoiceDialog:
    press(ui, "Fetch from robot")
    ui.tap(ui.find(OptionRow, text=robot))
    ui.wait(lambda: ui.find_all(ChoiceDialog, multiple=True))
    return ui.find(ChoiceDialog)


def test_missions_are_taken_over_from_a_checklist(site, app, ui):
    site.add_robots()
    site.add_missions("Deliver")
    go(ui, "missions")
    ui.wait(lambda: ui.find_all(MissionRow))
    dialog = fetch(ui, "Aino")
    assert "Deliver" not in [option["text"] for option in dialog.options]         # here already
    ui.tap(ui.find(OptionRow, root=dialog, text="Collect empties"))
    press(ui, "Add chosen", dialog)
    ui.wait(lambda: len(missions(site)) == 2)
    assert {mission.name: mission.guid for mission in missions(site)} == {name: GUIDS[name] for name in ("Deliver", "Collect empties")}
    ui.wait(lambda: says(ui, "1 mission added"))
    ui.wait(lambda: len(ui.find_all(MissionRow)) == 2)


def test_when_everything_is_here_that_is_said(site, app, ui):
    _aino, veikko = site.add_robots()
    found = site.container.operator.fetch_missions(veikko.id)
    site.container.catalogue.edit(lambda edit: [edit.save_mission(Mission(mission.name, mission.guid)) for mission in found])
    go(ui, "missions")
    ui.wait(lambda: ui.find_all(MissionRow))
    press(ui, "Fetch from robot")
    ui.tap(ui.find(OptionRow, text="Veikko"))
    ui.wait(lambda: says(ui, f"All {len(found)} missions of Veikko are here already"))


def test_a_robot_that_is_gone_while_its_missions_are_asked_for(site, app, ui):
    site.add_robots()
    go(ui, "missions")
    ui.wait(lambda: ui.find_all(CommandButton, text="Fetch from robot", disabled=False))
    site.fleet.robots[0].control({"fault": {"kind": "drop_request", "path": "*", "count": None}})
    ui.tap(ui.find_all(CommandButton, text="Fetch from robot", disabled=False)[-1])
    ui.tap(ui.find(OptionRow, text="Aino"))
    ui.wait(lambda: ui.find_all(Notice, tone="fault"))
    assert not ui.find(CommandButton, text="Fetch from robot").busy


def test_a_mission_by_hand_with_its_bad_input_at_the_field(site, app, ui):
    site.add_missions("Deliver")
    go(ui, "missions")
    ui.wait(lambda: ui.find_all(MissionRow))
    press(ui, "Add by hand")
    dialog = ui.find(MissionDialog)
    enter(ui, dialog.ids.name_field, "Deliver")
    enter(ui, dialog.ids.guid_field, "no guid!")
    press(ui, "Save mission", dialog)
    ui.wait(lambda: dialog.ids.guid_field.problem.startswith("A mission's guid has"))
    enter(ui, dialog.ids.guid_field, GUIDS["Home"])
    press(ui, "Save mission", dialog)
    ui.wait(lambda: dialog.ids.name_field.problem == "There is a mission Deliver already")
    enter(ui, dialog.ids.name_field, "Home")
    press(ui, "Save mission", dialog)
    ui.wait(lambda: not ui.find_all(MissionDialog))
    assert {mission.name for mission in missions(site)} == {"Deliver", "Home"}


def test_a_mission_that_holds_for_one_robot_only(site, app, ui):
    _aino, veikko = site.add_robots()
    site.add_missions("Deliver")
    go(ui, "missions")
    ui.wait(lambda: ui.find_all(MissionRow))
    row = ui.find(MissionRow)
    ui.tap(next(tap for tap in ui.find_all(Tap, root=row) if not isinstance(tap, IconButton)))
    dialog = ui.find(MissionDialog)
    ui.tap(ui.find(PickBox, root=dialog))
    ui.tap(ui.find(OptionRow, text="Only Veikko"))
    press(ui, "Save mission", dialog)
    ui.wait(lambda: missions(site)[0].robot_id == veikko.id)
    ui.wait(lambda: says(ui, "Only on Veikko"))


def test_favourites_come_first_and_a_deleted_mission_comes_back(site, app, ui):
    site.add_missions("Deliver", "Home", favourite=False)
    go(ui, "missions")
    ui.wait(lambda: len(ui.find_all(MissionRow)) == 2)
    star, bin_ = ui.find_all(IconButton, root=ui.find(MissionRow, name="Home"))
    ui.tap(star)
    ui.wait(lambda: [row["name"] for row in page(app).vm.rows] == ["Home", "Deliver"])
    star, bin_ = ui.find_all(IconButton, root=ui.find(MissionRow, name="Home"))
    ui.tap(bin_)
    ui.wait(lambda: [mission.name for mission in missions(site)] == ["Deliver"])
    ui.wait(lambda: says(ui, "Home deleted"))
    undo(ui)
    ui.wait(lambda: {(mission.name, mission.favourite) for mission in missions(site)} == {("Home", True), ("Deliver", False)})


def test_a_mission_that_the_robot_lost_is_flagged(site, app, ui):
    aino, _veikko = site.add_robots()
    gone = site.container.catalogue.save_mission(Mission("Gone", "00000000-0000-0000-0000-000000000000"))
    site.container.catalogue.save_schedule(Schedule("Morning", aino.id, gone.id, datetime(2030, 1, 7, 6, 30), "UTC", "FREQ=DAILY"))
    go(ui, "missions")
    ui.wait(lambda: [row.warning for row in ui.find_all(MissionRow)] == ["Not on Aino any more"])
    assert ui.find(SectionRow, key="missions").note == "1 mission, 1 missing"
    ui.tap(ui.find(SectionRow, key="robots"))
    ui.wait(lambda: ui.find(RobotPanel, name="Aino").missions == "1 missing")


def test_missions_are_found_while_typing(site, app, ui):
    site.add_missions(*GUIDS)
    go(ui, "missions")
    ui.wait(lambda: len(page(app).vm.rows) == len(GUIDS))
    ui.type(ui.find(SearchField), "empties")
    assert [row["name"] for row in page(app).vm.rows] == ["Collect empties"]


def page(app):
    return app.shell.navigator.screen("settings")._page


# ---------------------------------------------------------------------- constraints
def settings(site):
    return site.container.settings()


def test_the_minimum_battery_is_off_until_wanted(site, app, ui):
    go(ui, "constraints")
    field = ui.find(StepField)
    assert field.disabled
    ui.tap(ui.find(Toggle))
    ui.wait(lambda: settings(site).minimum_battery_percent == 30)
    ui.wait(lambda: not field.disabled)
    ui.tap(ui.find_all(RepeatButton, icon="plus")[0])
    ui.wait(lambda: settings(site).minimum_battery_percent == 35)
    enter(ui, field, "250")
    ui.key(13)
    field.focus = False
    ui.advance(.2)
    assert field.outside
    ui.wait(lambda: app.shell.background.idle)
    assert settings(site).minimum_battery_percent == 35       # what can't stand is shown red and not saved
    enter(ui, field, "0")
    field.focus = False
    ui.wait(lambda: settings(site).minimum_battery_percent is None)
    ui.wait(lambda: ui.find(SectionRow, key="constraints").note.startswith("No minimum battery"))


def test_working_days_but_never_none(site, app, ui):
    go(ui, "constraints")
    for day in ("Mon", "Tue", "Wed", "Thu"):
        before = settings(site).working_days
        ui.tap(ui.find(Segment, text=day))
        ui.wait(lambda before=before: len(settings(site).working_days) == len(before) - 1)
        ui.wait(lambda day=day: not ui.find(Segment, text=day).selected)
    ui.tap(ui.find(Segment, text="Fri"))
    ui.wait(lambda: says(ui, "At least one day must stay a working day"))
    assert settings(site).working_days == ("FR",)
    ui.tap(ui.find(Segment, text="Sun"))
    ui.wait(lambda: settings(site).working_days == ("FR", "SU"))
    ui.wait(lambda: says(ui, "Fri, Sun"))
    assert isinstance(page(app), ConstraintsPage)


# ---------------------------------------------------------------------- idle automation
def test_idle_automation_of_a_robot(site, app, ui):
    site.add_robots()
    site.add_missions("Home", "Deliver")
    go(ui, "idle")
    ui.wait(lambda: len(ui.find_all(IdlePanel)) == 2)
    panel = ui.find(IdlePanel, name="Aino")
    ui.tap(ui.find(Toggle, root=panel))                       # without a mission it asks for one
    ui.tap(ui.find(OptionRow, text="Home"))
    ui.wait(lambda: robots(site)[0].idle is not None)
    idle = robots(site)[0].idle
    assert (idle.enabled, idle.after_minutes) == (True, 10)
    ui.wait(lambda: panel.active)
    assert panel.mission == "Home"
    enter(ui, ui.find(StepField, root=panel), "31")
    ui.find(StepField, root=panel).focus = False
    ui.advance(.2)
    assert ui.find(StepField, root=panel).outside
    assert robots(site)[0].idle.after_minutes == 10
    enter(ui, ui.find(StepField, root=panel), "30")
    ui.find(StepField, root=panel).focus = False
    ui.wait(lambda: robots(site)[0].idle.after_minutes == 30)
    ui.wait(lambda: panel.note == "After 30 minutes without work, once")
    ui.tap(ui.find(Toggle, root=panel))
    ui.wait(lambda: not robots(site)[0].idle.enabled)
    ui.wait(lambda: ui.find(SectionRow, key="idle").note == "off")


def test_idle_automation_without_missions_says_where_they_come_from(site, app, ui):
    site.add_robots()
    go(ui, "idle")
    ui.wait(lambda: ui.find_all(IdlePanel))
    panel = ui.find(IdlePanel, name="Veikko")
    ui.tap(ui.find(Toggle, root=panel))
    ui.wait(lambda: ui.find(PickField, root=panel).problem == "There are no missions yet: add them under Missions")
    assert not panel.active


# ---------------------------------------------------------------------- scheduler
NUMBERS = {                              # label: (setting, what is accepted at its ends, what is not)
    "Ask the robots every (s)": ("poll_interval_seconds", ("1", "3600"), ("0", "3601")),
    "Further tries when a robot can't be reached": ("retry_limit", ("0", "20"), ("21",)),
    "A mission may start late by (min)": ("start_window_minutes", ("0", "1440"), ("1441",)),
    "Wait after an unknown outcome (s)": ("unknown_outcome_quiet_seconds", ("5", "600"), ("4", "601")),
    "Otherwise keep the last (runs)": ("history_limit", ("1", "5000"), ("0",)),
}


def test_numbers_of_the_scheduler_are_saved_when_the_field_is_left(site, app, ui):
    go(ui, "scheduler")
    for label, (name, accepted, _refused) in NUMBERS.items():
        field = ui.find(StepField, heading=label)
        for typed in accepted:
            enter(ui, field, typed)
            field.focus = False
            ui.wait(lambda name=name, typed=typed: getattr(settings(site), name) == int(typed))


def test_a_number_outside_its_range_stays_red_and_is_not_saved(site, app, ui):
    before = settings(site)
    go(ui, "scheduler")
    for label, (_name, _accepted, refused) in NUMBERS.items():
        field = ui.find(StepField, heading=label)
        for typed in refused:
            enter(ui, field, typed)
            field.focus = False
            ui.advance(2)
            assert (field.outside, field.text) == (True, typed)
    ui.wait(lambda: app.shell.background.idle)
    assert settings(site) == before


def test_the_whole_history_can_be_kept(site, app, ui):
    go(ui, "scheduler")
    ui.tap(ui.find(Toggle, root=ui.find(SwitchRow, text="Keep the whole history")))
    ui.wait(lambda: settings(site).history_limit is None)
    ui.wait(lambda: ui.find(StepField, heading="Otherwise keep the last (runs)").disabled)
    ui.tap(ui.find(Toggle, root=ui.find(SwitchRow, text="Keep the whole history")))
    ui.wait(lambda: settings(site).history_limit == 100)


def test_the_time_zone_is_found_by_name(site, app, ui):
    go(ui, "scheduler")
    ui.tap(ui.find(PickBox))
    ui.wait(lambda: ui.find_all(ChoiceDialog))
    ui.type(ui.find(SearchField), "New York")
    ui.wait(lambda: [row.text for row in ui.find_all(OptionRow)] == ["America/New York"])
    ui.tap(ui.find(OptionRow))
    ui.wait(lambda: settings(site).timezone == "America/New_York")
    ui.wait(lambda: "America/New_York" in ui.texts())


# ---------------------------------------------------------------------- display
def test_the_theme_changes_at_once_and_is_kept(site, app, ui):
    go(ui, "display")
    ui.tap(ui.find(Segment, text="High contrast"))
    ui.wait(lambda: tk.theme == "contrast")
    assert settings(site).theme == "contrast"


# ---------------------------------------------------------------------- data
def file_row(ui, label: str, number: int = 0) -> FileRow:
    return ui.find_all(FileRow, label=label)[number]


def outcome(app, name: str):
    return getattr(page(app).vm, f"{name}_outcome")


def test_the_configuration_goes_out_without_secrets_and_says_where(site, app, ui):
    site.add_robots()
    go(ui, "data")
    row = file_row(ui, "Export to")
    ui.wait(lambda: row.model.path.startswith(str(site.documents)))
    press(ui, "Export", row)
    ui.wait(lambda: outcome(app, "configuration").text == "Configuration written, without passwords")
    written = json.loads(Path(outcome(app, "configuration").note).read_text(encoding="utf-8"))
    assert [robot["name"] for robot in written["robots"]] == ["Aino", "Veikko"]
    assert "password" not in written["robots"][0]
    first = outcome(app, "configuration").note
    ui.wait(lambda: row.model.path != first)                  # the next suggestion is free again
    enter(ui, ui.find(FormField, root=row), first)
    press(ui, "Export", row)
    ui.wait(lambda: row.model.problem.endswith("exists already; choose another name"))


def test_a_configuration_comes_in_with_a_list_of_what_changed(site, app, ui):
    file = site.documents / "plant.json"
    file.write_text(json.dumps({"format": "amr-scheduler/1", "settings": {"retry_limit": 3},
                                "missions": [{"name": "Deliver", "guid": GUIDS["Deliver"]}]}), encoding="utf-8")
    go(ui, "data")
    row = file_row(ui, "Import from")
    ui.wait(lambda: row.model.path == str(file))              # the newest configuration there is suggested
    press(ui, "Import", row)
    ui.wait(lambda: outcome(app, "configuration").text == "2 changes taken over")
    assert settings(site).retry_limit == 3
    assert [mission.name for mission in missions(site)] == ["Deliver"]
    press(ui, "Import", row)
    ui.wait(lambda: outcome(app, "configuration").text == "Everything in the file is here already")


@pytest.mark.parametrize("content", [
    "{", "[]", '{"format": "amr-scheduler/2"}', '{"format": "amr-scheduler/1", "robotz": []}',
    '{"format": "amr-scheduler/1", "settings": {"retry_limit": 99}}'])
def test_an_unusable_configuration_is_one_sentence_and_changes_nothing(site, app, ui, content):
    file = site.documents / "broken.json"
    file.write_text(content, encoding="utf-8")
    before = settings(site)
    go(ui, "data")
    row = file_row(ui, "Import from")
    ui.wait(lambda: row.model.path == str(file))
    press(ui, "Import", row)
    ui.wait(lambda: row.model.problem)
    assert settings(site) == before
    assert "Traceback" not in row.model.problem
    assert outcome(app, "configuration").text == ""


def test_a_file_that_is_not_there(site, app, ui):
    go(ui, "data")
    row = file_row(ui, "Import from")
    enter(ui, ui.find(FormField, root=row), "/nowhere/plant.json")
    press(ui, "Import", row)
    ui.wait(lambda: row.model.problem == "There is no file /nowhere/plant.json")
    enter(ui, ui.find(FormField, root=file_row(ui, "Export to")), "/nowhere/plant.json")
    press(ui, "Export", file_row(ui, "Export to"))
    ui.wait(lambda: file_row(ui, "Export to").model.problem == "There is no directory /nowhere")


def test_log_and_backup_say_where_they_are(site, app, ui):
    go(ui, "data")
    row = file_row(ui, "Export to", 1)
    ui.wait(lambda: row.model.path)
    press(ui, "Export", row)
    ui.wait(lambda: outcome(app, "log").text == "Log written")
    assert Path(outcome(app, "log").note).read_text(encoding="utf-8").startswith("id,trigger,schedule")
    page(app).back_up()
    ui.wait(lambda: outcome(app, "backup").text == "Backup made")
    assert outcome(app, "backup").note.startswith(str(site.container.db.path.parent))
    ui.wait(lambda: page(app).vm.backups.startswith("1 backup"))


# ---------------------------------------------------------------------- the screen itself
def test_every_section_can_be_opened_and_shows_its_name(site, app, ui):
    site.add_robots()
    for key, title in {"robots": "Robots", "missions": "Missions", "constraints": "Constraints", "idle": "Idle automation",
                       "scheduler": "Scheduler", "display": "Display & language", "data": "Data", "about": "About"}.items():
        go(ui, key)
        ui.wait(lambda title=title: app.shell.navigator.screen("settings").vm.title == title)
        assert [row.key for row in ui.find_all(SectionRow, selected=True)] == [key]


def test_about_tells_versions_licences_and_where_the_data_are(site, app, ui):
    go(ui, "about")
    ui.wait(lambda: says(ui, "AMR Scheduler"))
    texts = ui.texts()
    assert str(site.container.db.path.parent) in texts
    assert {"SQLite", "KivyMD", "Roboto"} <= set(texts)


def test_a_change_from_elsewhere_shows_at_once(site, app, ui):
    go(ui, "scheduler")
    site.container.catalogue.change_settings(retry_limit=7)
    ui.wait(lambda: ui.find(StepField, heading="Further tries when a robot can't be reached").text == "7")


def test_what_is_being_typed_is_not_overwritten(site, app, ui):
    go(ui, "scheduler")
    field = ui.find(StepField, heading="Further tries when a robot can't be reached")
    enter(ui, field, "1")
    site.container.catalogue.change_settings(start_window_minutes=20)
    ui.wait(lambda: ui.find(StepField, heading="A mission may start late by (min)").text == "20")
    ui.advance(3)
    assert field.text == "1"
    field.focus = False
    ui.wait(lambda: settings(site).retry_limit == 1)


def test_in_portrait_list_and_section_take_turns(site, ui):
    from app.screens.base import Background, Dialogs, Navigator, Snackbars, UiBus
    from app.screens.settings import SettingsScreen
    from app.screens.shell import Shell
    bus = UiBus()
    background = Background(bus)
    screen = SettingsScreen(site.container, Shell(Navigator(None, {}), Dialogs(animate=False), Snackbars(), bus, background))
    ui.show(screen, size=(752, 790))
    screen.shown()
    ui.wait(lambda: ui.find_all(SectionRow))
    assert not ui.find_all(StepField)
    ui.tap(ui.find(SectionRow, key="scheduler"))
    ui.wait(lambda: ui.find_all(StepField))
    assert not ui.find_all(SectionRow)
    ui.tap(ui.find(IconButton, icon="arrow-left"))
    assert ui.find_all(SectionRow)
    assert not ui.find_all(SectionRow, selected=True)
    screen.hidden()
    background.close()


def test_fifty_robots_are_all_there_but_only_the_visible_ones_exist(site, app, ui):
    def add_all(edit):
        for number in range(50):
            edit.save_robot(Robot(f"R{number:02d}", f"http://127.0.0.1:9{number:03d}", USER, enabled=False), PASSWORD)
    site.container.catalogue.edit(add_all)
    go(ui, "robots")
    grid = ui.find(PanelGrid)
    ui.wait(lambda: len(grid.panels) == 51 and ui.find_all(RobotPanel))
    assert len(ui.find_all(RobotPanel)) < 10                  # only the visible ones exist
    grid.scroll_y = 0
    ui.wait(lambda: any(panel.name == "R49" for panel in ui.find_all(RobotPanel)))
    press(ui, "Edit", ui.find(RobotPanel, name="R49"))
    assert ui.find(RobotDialog).vm.name == "R49"


def test_closed_dialogs_are_freed(site, app, ui):
    go(ui, "robots")
    dialogs = []
    for _n in range(4):
        press(ui, "Add robot")
        dialogs.append(weakref.ref(ui.find(RobotDialog)))
        press(ui, "Cancel", dialogs[-1]())
        ui.advance(.5)
    gc.collect()
    ui.advance(.1)
    gc.collect()
    # kivy's TextInput holds the one that was laid out last (kivy.clock.triggered keeps its arguments)
    assert [dialog() for dialog in dialogs[:-1]] == [None] * 3
