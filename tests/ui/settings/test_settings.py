"""Settings as an integrator uses it: sections, constraints, idle automation, scheduler, display, and the screen itself."""

from __future__ import annotations

import gc
import time
import weakref
from importlib.metadata import version
from threading import Event

import pytest
from kivy.core.window import Window

from app.database.errors import DatabaseUnavailable
from app.domain.models import Connection, IdleRule, Robot
from app.screens.settings import screen as settings_module
from app.screens.settings.constraints import ConstraintsPage
from app.screens.settings.facts import read
from app.screens.settings.page import SwitchRow
from app.screens.settings.robot_sheet import RobotSheet
from app.screens.settings.screen import PAGES, SectionList
from app.services.catalogue import robot_edit
from app.widgets.buttons import CommandButton, IconButton, Segment, Toggle
from app.widgets.choices import ChoiceSheet, OptionRow
from app.widgets.fields import Field, PickBox, SearchField
from app.widgets.frame import NavItem
from app.widgets.long_list import LongList
from app.widgets.snackbar import Snackbar
from app.widgets.tokens import tk
from tests.ui import checks
from tests.ui.integrator import (
    add,
    enter,
    go,
    is_saved,
    item_of,
    open_row,
    page,
    press,
    robots,
    row_of,
    says,
    section_row,
    section_rows,
    settings,
    titles,
    undo,
)
from tests.ui.wear import CACHED
from tests.ui.whole_app import PASSWORD, POLL, USER


# ---------------------------------------------------------------------- constraints
def test_the_minimum_battery_is_0_until_wanted(site, app, ui):
    go(ui, "constraints")
    field = ui.find(Field, label="Minimum battery")
    assert (field.value, section_row(ui, "constraints").item.support) == (0, "Mon–Fri")
    ui.tap(ui.find(CommandButton, root=field, icon="plus"))
    ui.wait(lambda: settings(site).minimum_battery_percent == 5)
    enter(ui, field, "250")
    ui.key(13)
    field.focus = False
    ui.advance(0.2)
    assert field.outside
    ui.wait(lambda: app.shell.background.idle)
    assert settings(site).minimum_battery_percent == 5  # an invalid value is shown red and not saved
    enter(ui, field, "0")
    field.focus = False
    ui.wait(lambda: settings(site).minimum_battery_percent is None)
    ui.wait(lambda: section_row(ui, "constraints").item.support == "Mon–Fri")


def test_none_but_the_open_section_is_kept(site, app, ui):
    def is_kept_alone(section: str) -> bool:
        """Wait until no work is left between threads."""
        ui.skip(CACHED)
        ui.wait(lambda: app.shell.background.idle)
        gc.collect()
        return [kept for kept in PAGES if pages[kept]() is not None] == [section]

    pages = {}
    for section in PAGES:
        go(ui, section)
        pages[section] = weakref.ref(page(app))
    ui.wait(lambda: is_kept_alone("about"))
    app.shell.go("home")
    ui.wait(lambda: is_kept_alone("about"))
    go(ui, "about")
    assert page(app) is pages["about"]()
    go(ui, "robots")
    ui.wait(lambda: ui.find_all(CommandButton, text="Add"))


def test_a_section_with_something_under_way_is_kept_until_that_has_ended(site, app, ui):
    go(ui, "data")
    data = page(app)
    data.back_up()
    data._sheet.running = True
    for section in ("robots", "display"):
        go(ui, section)
    app.shell.go("home")
    go(ui, "data")
    assert page(app) is data
    data._sheet.running = False
    for section in ("robots", "display", "data"):
        go(ui, section)
    assert page(app) is not data


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
    ui.wait(lambda: row_of(ui, "Aino"))
    assert row_of(ui, "Aino").item.support == "No mission"
    ui.tap(ui.find(Toggle, root=row_of(ui, "Aino")))  # without a mission it requests one
    ui.tap(ui.find(OptionRow, title="Home"))
    ui.wait(lambda: robots(site)[0].idle is not None)
    idle = robots(site)[0].idle
    assert (idle.enabled, idle.after_minutes) == (True, 10)
    ui.wait(lambda: row_of(ui, "Aino").item.on)
    minutes = ui.find(Field, root=open_row(ui, "Aino"), kind="step")
    enter(ui, minutes, "31")
    minutes.focus = False
    ui.advance(0.2)
    assert minutes.outside
    assert robots(site)[0].idle.after_minutes == 10
    enter(ui, minutes, "30")
    minutes.focus = False
    ui.wait(lambda: robots(site)[0].idle.after_minutes == 30)
    ui.wait(lambda: row_of(ui, "Aino").item.support == "Home · after 30 min")
    ui.tap(ui.find(Toggle, root=row_of(ui, "Aino")))
    ui.wait(lambda: not robots(site)[0].idle.enabled)
    ui.wait(lambda: section_row(ui, "idle").item.support == "off")


def test_another_idle_mission_can_be_undone(site, app, ui):
    robot, _other = site.add_robots()
    home, deliver = site.add_missions("Home", "Deliver")
    site.container.catalogue.change_idle_rule(robot.id, mission_id=home.id, after_minutes=25)
    go(ui, "idle")
    sheet = open_row(ui, "Aino")
    ui.tap(ui.find(PickBox, root=sheet))
    ui.tap(ui.find(OptionRow, title="Deliver"))
    ui.wait(lambda: robots(site)[0].idle.mission_id == deliver.id and sheet.mission == "Deliver")
    undo(ui)
    ui.wait(lambda: sheet.mission == "Home")
    assert robots(site)[0].idle == IdleRule(home.id, 25)


def test_a_mission_that_asks_for_something_is_no_idle_mission(site, app, ui):
    """No person can enter it: the robot would refuse it at every idle time."""
    aino, _sisu = site.add_robots()
    home, go_to = site.add_missions("Home", "Go to position")
    ui.wait(lambda: site.container.snapshots.get(aino.id).connection is Connection.CONNECTED)
    go(ui, "idle")
    ui.wait(lambda: row_of(ui, "Aino"))
    ui.tap(ui.find(Toggle, root=row_of(ui, "Aino")))
    ui.tap(ui.find(OptionRow, title="Go to position"))
    refused = "Go to position asks for Position, which only a schedule or Run now can give"
    ui.wait(lambda: row_of(ui, "Aino").item.support == refused)
    assert robots(site)[0].idle is None
    site.container.catalogue.change_idle_rule(
        aino.id, mission_id=go_to.id, after_minutes=10, enabled=False
    )  # as a file may bring it
    sheet = open_row(ui, "Aino")
    ui.wait(lambda: sheet.mission == "Go to position")
    ui.tap(ui.find(Toggle, root=row_of(ui, "Aino")))
    ui.wait(lambda: sheet.problem == refused)
    assert not robots(site)[0].idle.enabled
    ui.tap(ui.find(PickBox, root=sheet))
    ui.tap(ui.find(OptionRow, title="Home"))
    ui.wait(lambda: robots(site)[0].idle.mission_id == home.id)
    ui.wait(lambda: not sheet.problem)


def test_minutes_that_are_saved_while_a_mission_is_chosen_are_kept(site, app, ui):
    robot, _other = site.add_robots()
    home, deliver = site.add_missions("Home", "Deliver")
    site.container.catalogue.change_idle_rule(robot.id, mission_id=home.id, after_minutes=10)
    go(ui, "idle")
    sheet = open_row(ui, "Aino")
    ui.tap(ui.find(CommandButton, root=sheet, icon="plus"))
    page(app).act(robot.id, "mission")
    ui.wait(lambda: robots(site)[0].idle.after_minutes == 15)
    ui.wait(lambda: app.shell.background.idle)
    ui.tap(ui.find(OptionRow, title="Deliver"))
    ui.wait(lambda: robots(site)[0].idle.mission_id == deliver.id)
    assert robots(site)[0].idle.after_minutes == 15
    site.container.catalogue.change_idle_rule(robot.id, mission_id=deliver.id, after_minutes=30)
    ui.wait(lambda: sheet.minutes == 30)


def test_switching_the_rule_off_keeps_minutes_saved_but_not_yet_read(site, app, ui):
    robot, _other = site.add_robots()
    site.container.catalogue.change_idle_rule(robot.id, mission_id=site.add_missions("Home")[0].id, after_minutes=10)
    go(ui, "idle")
    ui.wait(lambda: row_of(ui, "Aino"))
    page(app).act(robot.id, "minutes", 15)
    ends = time.monotonic() + 20
    while (
        robots(site)[0].idle.after_minutes != 15 and time.monotonic() < ends
    ):  # no frame passes, so the screen reads nothing
        time.sleep(0.01)
    page(app).act(robot.id, "switch", False)
    ui.wait(lambda: not robots(site)[0].idle.enabled)
    ui.wait(lambda: app.shell.background.idle)
    assert robots(site)[0].idle.after_minutes == 15


def test_a_step_is_saved_at_once(site, app, ui):
    robot, _other = site.add_robots()
    site.container.catalogue.change_idle_rule(robot.id, mission_id=site.add_missions("Home")[0].id, after_minutes=30)
    go(ui, "idle")
    ui.tap(ui.find(CommandButton, root=open_row(ui, "Aino"), icon="minus"))
    ui.wait(lambda: robots(site)[0].idle.after_minutes == 25)
    ui.wait(lambda: row_of(ui, "Aino").item.support == "Home · after 25 min")


def test_idle_automation_without_missions_says_where_they_come_from(site, app, ui):
    site.add_robots()
    go(ui, "idle")
    ui.wait(lambda: row_of(ui, "Veikko"))
    ui.tap(ui.find(Toggle, root=row_of(ui, "Veikko")))
    ui.wait(lambda: row_of(ui, "Veikko").item.support == "There are no missions yet: add them under Missions")
    assert not row_of(ui, "Veikko").item.on


# ---------------------------------------------------------------------- scheduler
NUMBERS = {  # label: (setting, what is accepted at its ends, what is not)
    "Ask the robots every": ("poll_interval_seconds", ("1", "3600"), ("0", "3601")),
    "Retries when a robot can't be reached": ("retry_limit", ("0", "20"), ("21",)),
    "A mission may start late by": ("start_window_minutes", ("1", "1440"), ("0", "1441")),
    "Wait after an unknown outcome": ("unknown_outcome_quiet_seconds", ("5", "600"), ("4", "601")),
    "Otherwise keep the last": ("history_limit", ("1", "5000"), ("0",)),
}


def test_numbers_of_the_scheduler_are_saved_when_the_field_is_left(site, app, ui):
    go(ui, "scheduler")
    for label, (name, accepted, _refused) in NUMBERS.items():
        field = ui.find(Field, label=label)
        for typed in accepted:
            enter(ui, field, typed)
            field.focus = False
            ui.wait(lambda name=name, typed=typed: getattr(settings(site), name) == int(typed))
            ui.wait(lambda: is_saved(site, app))


def test_a_number_outside_its_range_stays_red_and_is_not_saved(site, app, ui):
    before = settings(site)
    go(ui, "scheduler")
    for label, (_name, _accepted, refused) in NUMBERS.items():
        field = ui.find(Field, label=label)
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
    ui.wait(lambda: ui.find(Field, label="Otherwise keep the last").disabled)
    ui.tap(ui.find(Toggle, root=ui.find(SwitchRow, text="Keep the whole history")))
    ui.wait(lambda: settings(site).history_limit == 100_000)


def test_the_time_zone_is_found_by_name_and_its_change_undone(site, app, ui):
    before = settings(site).timezone
    go(ui, "scheduler")
    ui.tap(ui.find(PickBox))
    ui.wait(lambda: ui.find_all(ChoiceSheet))
    ui.type(ui.find(SearchField), "New York")
    ui.wait(lambda: [row.item.title for row in ui.find_all(OptionRow)] == ["America/New York"])
    ui.tap(ui.find(OptionRow))
    ui.wait(lambda: settings(site).timezone == "America/New_York")
    ui.wait(lambda: "America/New_York" in ui.texts())
    ui.wait(lambda: says(ui, "The time zone is America/New York"))
    ui.tap_text("Undo")
    ui.wait(lambda: settings(site).timezone == before)


# ---------------------------------------------------------------------- display
def test_the_theme_changes_at_once_and_is_kept(site, app, ui):
    go(ui, "display")
    ui.tap(ui.find(Segment, text="High contrast"))
    ui.wait(lambda: tk.theme == "contrast")
    assert settings(site).theme == "contrast"


def test_the_language_changes_at_once_everywhere_and_back(site, app, ui):
    go(ui, "display")
    ui.tap(ui.find(Segment, text="Suomi"))
    ui.wait(lambda: "Asetukset" in ui.texts())
    assert settings(site).language == "fi"
    assert section_row(ui, "robots").item.title == "Robotit"
    assert section_row(ui, "display").item.title == "Näyttö"
    ui.tap(ui.find(Segment, text="English"))  # each language is named in its own words
    ui.wait(lambda: section_row(ui, "display").item.title == "Display")


def test_the_hours_in_which_the_screen_is_dimmed_are_chosen(site, app, ui):
    go(ui, "display")
    for label, choice, kept in (
        ("Dim the screen from", "21:00", (21, 6)),
        ("Bright again from", "05:00", (21, 5)),
        ("Dim the screen from", "Never", (None, 5)),
    ):
        ui.tap(ui.find(PickBox, root=ui.find(Field, label=label)))
        ui.type(ui.find(SearchField), choice)
        ui.tap(next(row for row in ui.find_all(OptionRow) if row.item.title == choice))
        ui.wait(lambda kept=kept: (settings(site).dim_from, settings(site).dim_until) == kept)
        ui.wait(lambda label=label, choice=choice: ui.find(Field, label=label).value == choice)


# ---------------------------------------------------------------------- the screen itself
def test_a_first_start_offers_the_other_language(site, app, ui):
    app.shell.go("home")
    ui.wait(lambda: says(ui, "No robots yet"))
    press(ui, "Suomi")
    ui.wait(lambda: says(ui, "Ei vielä robotteja"))
    press(ui, "English")
    ui.wait(lambda: says(ui, "No robots yet") and settings(site).language == "en")


def test_every_section_can_be_opened_and_shows_its_name(site, app, ui):
    site.add_robots()
    for key, title in {
        "robots": "Robots",
        "missions": "Missions",
        "constraints": "Conditions",
        "idle": "When idle",
        "scheduler": "Planning",
        "display": "Display",
        "data": "Data",
        "about": "About",
    }.items():
        go(ui, key)
        ui.wait(lambda title=title: app.shell.navigator.screen("settings").tabs[0].text == title)
        assert [row.key for row in section_rows(ui) if row.item.look == "chosen"] == [key]


def test_about_shows_versions_licences_and_where_the_data_are(site, app, ui):
    go(ui, "about")
    ui.wait(lambda: says(ui, "AMR Scheduler"))
    texts = ui.texts()
    assert str(site.container.db.path.parent) in texts
    assert {"Python", "SQLite", "KivyMD"} <= set(texts)  # the first of the list
    assert f"{version('kivymd')} · MIT" in texts


def test_a_change_from_outside_shows_at_once(site, app, ui):
    go(ui, "scheduler")
    site.container.catalogue.change_settings(retry_limit=7)
    ui.wait(lambda: ui.find(Field, label="Retries when a robot can't be reached").text == "7")


def test_a_field_is_not_overwritten_while_typing(site, app, ui):
    go(ui, "scheduler")
    field = ui.find(Field, label="Retries when a robot can't be reached")
    enter(ui, field, "1")
    site.container.catalogue.change_settings(start_window_minutes=20)
    ui.wait(lambda: ui.find(Field, label="A mission may start late by").text == "20")
    ui.advance(3)
    assert field.text == "1"
    field.focus = False
    ui.wait(lambda: settings(site).retry_limit == 1)


def test_fifty_robots_are_all_there_but_only_the_visible_ones_exist(site, app, ui):
    def add_all(edit):
        for number in range(50):
            robot_edit.save(
                edit, Robot(f"R{number:02d}", f"http://127.0.0.1:9{number:03d}", USER, enabled=False), PASSWORD
            )

    site.container.catalogue.edit(add_all)
    go(ui, "robots")
    rows = ui.find(LongList, page(app))
    ui.wait(lambda: len(rows.data) == 50 and titles(ui))
    assert len(titles(ui)) < 15  # only the visible ones exist
    rows.scroll_y = 0
    ui.wait(lambda: item_of(ui, "R49"))
    open_row(ui, "R49")
    assert ui.find(RobotSheet).it.name == "R49"


def test_closed_dialogs_are_freed(site, app, ui):
    go(ui, "robots")
    dialogs = []
    for _n in range(4):
        add(ui, "Add robot")
        dialogs.append(weakref.ref(ui.find(RobotSheet)))
        ui.tap(ui.find(IconButton, dialogs[-1](), icon="close"))
        ui.advance(0.5)
    gc.collect()
    ui.advance(0.1)
    gc.collect()
    # kivy's TextInput holds the one that was laid out last (kivy.clock.triggered keeps its arguments)
    assert [dialog() for dialog in dialogs[:-1]] == [None] * 3


@pytest.mark.parametrize("first_screen", ["home"])
def test_nothing_passes_for_a_setting_before_settings_are_read(site, app, ui, monkeypatch):
    """The first reading fails; a second later they are read again."""
    may_be_read = Event()

    def reading(*args):
        if not may_be_read.is_set():
            raise DatabaseUnavailable("The database can't be read")
        return read(*args)

    monkeypatch.setattr(settings_module, "read", reading)
    vm = app.shell.navigator.screen("settings").vm
    vm.has_facts, vm.sections = False, []  # as at the first visit
    ui.tap(ui.find(NavItem, name="settings"))
    ui.wait(lambda: ui.find_all(Snackbar))
    assert section_rows(ui) == [field for field in ui.find_all(Field) if field.kind == "step"] == []
    may_be_read.set()
    ui.wait(lambda: section_row(ui, "scheduler"))
    ui.tap(section_row(ui, "scheduler"))
    assert ui.find(Field, label="Ask the robots every").value == POLL


@pytest.mark.parametrize(
    "leave", [lambda app, ui: app.shell.go("home"), lambda app, ui: go(ui, "display")], ids=["screen", "section"]
)
def test_a_number_that_could_not_be_saved_when_leaving_its_page_is_reported(site, app, ui, monkeypatch, leave):
    has_left = Event()

    def refuse(**_changes):
        assert has_left.wait(30)
        raise DatabaseUnavailable("The disk is full")

    go(ui, "scheduler")
    monkeypatch.setattr(site.container.catalogue, "change_settings", refuse)
    ui.tap(ui.find(CommandButton, root=ui.find(Field, label="Ask the robots every"), icon="plus"))
    leave(app, ui)
    has_left.set()
    ui.wait(lambda: app.shell.snackbars.texts == ["The disk is full"])


def test_unsaved_minutes_are_not_shown_as_saved_after_leaving_settings(site, app, ui, monkeypatch):
    def refuse(_work):
        raise DatabaseUnavailable("The disk is full")

    robot, _other = site.add_robots()
    site.container.catalogue.change_idle_rule(robot.id, mission_id=site.add_missions("Home")[0].id, after_minutes=10)
    go(ui, "idle")
    ui.wait(lambda: row_of(ui, "Aino"))
    monkeypatch.setattr(site.container.catalogue, "edit", refuse)
    page(app).act(robot.id, "minutes", 15)
    app.shell.go("home")
    ui.wait(lambda: app.shell.snackbars.texts == ["The disk is full"])
    app.shell.go("settings")
    ui.wait(lambda: app.shell.background.idle and row_of(ui, "Aino"))
    ui.wait(lambda: row_of(ui, "Aino").item.support == "Home · after 10 min")


# ---------------------------------------------------------------------- a low window
@pytest.fixture
def low_window():
    before = Window.size
    Window.size = 1024, 600
    yield
    Window.size = before


def test_all_sections_are_in_sight_in_a_low_window_with_their_values(low_window, site, app, ui):
    ui.advance(0.5)
    rows = section_rows(ui)
    assert len(rows) == 9
    for row in rows:
        assert checks.is_seen(row)
        assert row.height >= 48
    assert checks.problems(ui.find(SectionList)) == []


def test_a_step_of_the_set_up_is_left_out_until_it_is_wanted_again(site, app, ui):
    go(ui, "setup")
    ui.wait(lambda: row_of(ui, "PIN"))
    press(ui, "Not now", row_of(ui, "PIN"))
    ui.wait(lambda: not row_of(ui, "PIN"))
    undo(ui)
    ui.wait(lambda: row_of(ui, "PIN"))
