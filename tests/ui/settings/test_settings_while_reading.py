"""Settings while they are still being read: what is chosen, typed or saved during that is neither reverted nor lost."""

from __future__ import annotations

from dataclasses import replace
from threading import Event

import pytest

from app.database.errors import DatabaseUnavailable
from app.domain.models import Connection, Group
from app.mir.errors import TimedOut
from app.screens.settings import screen as settings_module
from app.screens.settings.facts import read
from app.screens.settings.missions import MissionRow, MissionSheet
from app.services.planning import public_holidays
from app.widgets.buttons import CommandButton, Segment, Toggle
from app.widgets.choices import ChoiceSheet, OptionRow
from app.widgets.fields import Field
from tests.ui.integrator import enter, go, is_saved, page, press, robots, row_of, says, settings

pytestmark = pytest.mark.long


@pytest.fixture
def hold_readings(monkeypatch):
    """Called, later readings arrive only after the returned function was called, with the values from when they began."""
    go_on = Event()

    def reading(*args):
        facts = read(*args)
        assert go_on.wait(30)
        return facts

    def hold():
        monkeypatch.setattr(settings_module, "read", reading)
        return go_on.set

    yield hold
    go_on.set()


def test_a_second_day_takes_the_first_one_not_back(site, app, ui, hold_readings):
    """However slowly the tablet reads: both were tapped."""
    go(ui, "constraints")
    hold_readings()
    ui.tap(ui.find(Segment, text="Mon"))
    ui.wait(lambda: "MO" not in settings(site).working_days)
    ui.tap(ui.find(Segment, text="Tue"))
    ui.wait(lambda: settings(site).working_days == ("WE", "TH", "FR"))


def test_switching_the_rule_off_keeps_a_mission_saved_but_not_yet_read(site, app, ui, hold_readings):
    robot, _other = site.add_robots()
    home, deliver = site.add_missions("Home", "Deliver")
    site.container.catalogue.change_idle_rule(robot.id, mission_id=home.id, after_minutes=10)
    go(ui, "idle")
    ui.wait(lambda: row_of(ui, "Aino"))
    hold_readings()
    page(app).act(robot.id, "mission")
    ui.wait(lambda: ui.find_all(OptionRow, title="Deliver"))
    ui.tap(ui.find(OptionRow, title="Deliver"))
    ui.wait(lambda: robots(site)[0].idle.mission_id == deliver.id and not ui.find_all(ChoiceSheet))
    ui.tap(ui.find(Toggle, root=row_of(ui, "Aino")))
    ui.wait(lambda: not robots(site)[0].idle.enabled)
    assert robots(site)[0].idle.mission_id == deliver.id


def test_editing_again_begins_with_the_values_just_saved(site, app, ui, hold_readings):
    """Before it is read: else the next Save would take the new name back."""
    site.add_missions("Home")
    go(ui, "missions")
    ui.wait(lambda: ui.find_all(MissionRow, name="Home"))
    hold_readings()
    ui.find(MissionRow, name="Home").act("open")
    ui.wait(lambda: ui.find_all(MissionSheet))
    dialog = ui.find(MissionSheet)
    enter(ui, dialog.ids.name_field, "Back home")
    press(ui, "Save", dialog)
    ui.wait(lambda: not ui.find_all(MissionSheet))
    ui.find(MissionRow).act("open")
    ui.wait(lambda: ui.find_all(MissionSheet))
    assert ui.find(MissionSheet).it.name == "Back home"
    assert ui.find(MissionRow).item.name == "Back home"


@pytest.fixture
def hold_asking(site, monkeypatch):
    """Called, parameters of missions are reported only after the returned function was called; with ``problem`` they are not."""
    go_on, tell = Event(), site.container.robot_missions.parameters

    def hold(problem=None):
        def parameters(*args):
            assert go_on.wait(30)
            if problem is not None:
                raise problem
            return tell(*args)

        monkeypatch.setattr(site.container.robot_missions, "parameters", parameters)
        return go_on.set

    yield hold
    go_on.set()


def choose(ui, mission: str) -> None:
    """As Aino's idle mission."""
    row_of(ui, "Aino").act("mission")
    ui.wait(lambda: ui.find_all(OptionRow, title=mission))
    ui.tap(ui.find(OptionRow, title=mission))


def test_the_last_choice_is_the_idle_mission_although_the_robot_went_silent(site, app, ui, hold_asking):
    robot, _other = site.add_robots()
    _home, deliver = site.add_missions("Home", "Deliver")
    ui.wait(lambda: site.container.snapshots.get(robot.id).connection is Connection.CONNECTED)
    go(ui, "idle")
    ui.wait(lambda: row_of(ui, "Aino"))
    go_on = hold_asking(TimedOut())
    choose(ui, "Home")
    site.fleet.robots[0].control({"fault": {"kind": "drop_request", "path": "*", "count": None}})
    ui.wait(lambda: page(app).context.facts.snapshot(robot.id).connection is not Connection.CONNECTED)
    choose(ui, "Deliver")
    ui.wait(lambda: robots(site)[0].idle is not None)
    go_on()
    ui.wait(lambda: app.shell.background.idle)
    assert robots(site)[0].idle.mission_id == deliver.id


def test_a_silent_robot_gets_no_mission_with_known_parameters(site, app, ui):
    robot, _other = site.add_robots()
    (go_to,) = site.add_missions("Go to position")
    ui.wait(lambda: site.container.snapshots.get(robot.id).connection is Connection.CONNECTED)
    app.shell.mission_names.take(go_to.guid, site.container.robot_missions.parameters(robot.id, go_to.guid))
    site.fleet.robots[0].control({"fault": {"kind": "drop_request", "path": "*", "count": None}})
    go(ui, "idle")
    ui.wait(lambda: row_of(ui, "Aino"))
    ui.wait(lambda: page(app).context.facts.snapshot(robot.id).connection is not Connection.CONNECTED)
    choose(ui, "Go to position")
    ui.wait(lambda: row_of(ui, "Aino").item.support.startswith("Go to position asks for Position"))
    assert robots(site)[0].idle is None


def test_on_another_page_a_message_says_that_a_mission_is_no_idle_mission(site, app, ui, hold_asking):
    robot, _other = site.add_robots()
    site.add_missions("Go to position")
    ui.wait(lambda: site.container.snapshots.get(robot.id).connection is Connection.CONNECTED)
    go(ui, "idle")
    ui.wait(lambda: row_of(ui, "Aino"))
    go_on = hold_asking()
    choose(ui, "Go to position")
    go(ui, "about")
    go_on()
    ui.wait(
        lambda: (
            app.shell.snackbars.texts
            == ["Aino: Go to position asks for Position, which only a schedule or Run now can give"]
        )
    )


def test_a_star_takes_no_new_name_of_a_mission_back(site, app, ui, hold_readings):
    (mission,) = site.add_missions("Home", favourite=False)
    go(ui, "missions")
    ui.wait(lambda: ui.find_all(MissionRow, name="Home"))
    hold_readings()
    site.container.catalogue.save_mission(replace(mission, name="Back home"))
    ui.find(MissionRow, name="Home").act("favourite", True)
    ui.wait(lambda: site.container.catalogue.missions()[0].favourite)
    assert site.container.catalogue.missions()[0].name == "Back home"


def test_no_step_is_lost_while_earlier_ones_are_still_being_read(site, app, ui, hold_readings):
    site.container.catalogue.change_settings(minimum_battery_percent=30)
    go(ui, "constraints")
    field = ui.find(Field, label="Minimum battery")
    ui.wait(lambda: is_saved(site, app) and field.value == 30)
    go_on = hold_readings()
    for _n in range(3):
        ui.tap(ui.find(CommandButton, root=field, icon="minus"))
    assert field.text == "15"
    ui.wait(lambda: settings(site).minimum_battery_percent == 15)
    go_on()
    ui.wait(lambda: is_saved(site, app))
    assert field.text == "15"


def test_two_quick_taps_are_written_in_their_order(site, app, ui, monkeypatch):
    site.container.catalogue.change_settings(minimum_battery_percent=30)
    go(ui, "constraints")
    field = ui.find(Field, label="Minimum battery")
    ui.wait(lambda: is_saved(site, app) and field.value == 30)
    write, second = site.container.catalogue.change_settings, Event()

    def slow(minimum_battery_percent):
        if minimum_battery_percent == 25:
            second.wait(0.5)
        write(minimum_battery_percent=minimum_battery_percent)
        second.set()

    monkeypatch.setattr(site.container.catalogue, "change_settings", slow)
    for _n in range(2):
        ui.tap(ui.find(CommandButton, root=field, icon="minus"))
    ui.wait(lambda: is_saved(site, app))
    assert settings(site).minimum_battery_percent == 20


def test_a_typed_number_stays_while_the_earlier_choice_is_still_being_read(site, app, ui, hold_readings):
    site.container.catalogue.change_settings(minimum_battery_percent=30)
    go(ui, "constraints")
    field = next(field for field in ui.find_all(Field) if field.kind == "step")
    ui.wait(lambda: is_saved(site, app) and not field.disabled)
    go_on = hold_readings()
    ui.tap(ui.find(CommandButton, root=field, icon="minus"))
    ui.wait(lambda: settings(site).minimum_battery_percent == 25)
    enter(ui, field, "45")
    go_on()
    ui.wait(lambda: is_saved(site, app))
    assert field.text == "45"
    field.focus = False
    ui.wait(lambda: settings(site).minimum_battery_percent == 45)


def test_a_value_that_could_not_be_saved_shows_the_stored_one(site, app, ui, monkeypatch):
    def refuse(**_changes):
        raise DatabaseUnavailable("The disk is full")

    go(ui, "constraints")
    monkeypatch.setattr(site.container.catalogue, "change_settings", refuse)
    ui.tap(ui.find(Segment, text="Mon"))
    ui.wait(lambda: says(ui, "The disk is full"))
    assert ui.find(Segment, text="Mon").selected


def test_an_unwritten_choice_stays_whatever_is_read(site, app, ui, monkeypatch):
    """And goes back to what is stored where that fails after all."""
    go_on = Event()

    def refuse(**_changes):
        assert go_on.wait(30)
        raise DatabaseUnavailable("The disk is full")

    go(ui, "constraints")
    monkeypatch.setattr(site.container.catalogue, "change_settings", refuse)
    ui.tap(ui.find(Segment, text="Mon"))
    site.add_missions("Home")  # so that everything is read
    ui.wait(lambda: page(app).context.facts.missions)
    assert not ui.find(Segment, text="Mon").selected
    go_on.set()
    ui.wait(lambda: says(ui, "The disk is full"))
    assert ui.find(Segment, text="Mon").selected


@pytest.mark.parametrize(
    ("screen", "section"), [("home", {}), ("settings", {"section": "about"})], ids=["home", "section"]
)
@pytest.mark.parametrize("asks", ["Public holidays", "1 change", "Delete Hall 1?"])
def test_what_would_be_asked_too_late_is_not_and_that_is_said(
    site, app, ui, monkeypatch, tmp_path, asks, screen, section
):
    """On another screen it would be asked without the PIN."""
    robots_, go_on, container = site.add_robots(), Event(), site.container
    group = container.catalogue.save_group(Group("Hall 1", tuple(robot.id for robot in robots_)))
    file = container.files.export_configuration(str(tmp_path / "site.json"))
    container.catalogue.change_settings(poll_interval_seconds=7)

    def late(of, name):
        work = getattr(of, name)
        monkeypatch.setattr(of, name, lambda *args: go_on.wait(30) and work(*args))

    if asks == "Public holidays":
        go(ui, "constraints")
        late(public_holidays, "countries")
        page(app).calendar.choose_country()
    elif asks == "1 change":
        go(ui, "data")
        late(container.files, "preview_import")
        page(app).import_configuration()
        sheet = app.shell.sheets.top
        sheet.file, sheet.typed = str(file), True
        sheet.dispatch("on_done")
    else:
        go(ui, "robots")
        late(container.catalogue, "waiting_for")
        ui.wait(lambda: page(app).parts)
        page(app).turn_to("groups")
        page(app).open(group.id)
        app.shell.sheets.top.remove()
    app.shell.go(screen, **section)
    go_on.set()
    ui.wait(lambda: app.shell.snackbars.texts == [f"Not asked, as the page was left: {asks}"])
    assert (app.shell.sheets.top, app.shell.sheets.picker) == (None, None)
