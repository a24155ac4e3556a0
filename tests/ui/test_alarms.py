"""The list of alarms by taps: acknowledge with a note, shelve and take back, what is over, the past ones, and where each leads."""
from __future__ import annotations

from dataclasses import replace

import pytest

from app.domain.models import Robot
from app.mir.errors import Unreachable
from app.screens.frame import alarm_list as frame_alarms
from app.screens.frame import controller
from app.screens.frame.alarm_list import AlarmRow, AlarmsDialog, NoteDialog
from app.screens.settings.page import SwitchRow
from app.widgets import finger
from app.widgets.buttons import CommandButton, IconButton, Segment, Toggle
from app.widgets.dialogs import Menu, MenuRow
from app.widgets.fields import FormField
from app.widgets.frame import AlarmBanner, NavItem, TopBar
from app.widgets.surfaces import Tap
from app.widgets.tokens import tk
from tests.support import month
from tests.support.stored import Stored
from tests.ui import checks
from tests.ui.integrator import go
from tests.ui.whole_app import begin_anew, shown


class Recorder:
    """A loudspeaker that counts."""
    exists = True

    def __init__(self) -> None:
        self.played = 0

    def play(self) -> None:
        self.played += 1


@pytest.fixture(scope="module")
def ui(shared_ui):
    return shared_ui


@pytest.fixture(scope="module")
def container(tmp_path_factory):
    """Of a new tablet; nothing runs there."""
    container = month.plant(tmp_path_factory.mktemp("data"), furnished=False)
    yield container
    container.close()


@pytest.fixture(scope="module")
def shared_app(container, ui):
    with shown(container, ui, loudspeaker=Recorder()) as app:
        app.stored = Stored(container)
        yield app


@pytest.fixture
def app(shared_app, container, ui):
    """Without any alarm, now or in the past."""
    def put_back() -> None:
        container.alarms.database_works()
        container.clock.step((month.NOW - container.clock.now()).total_seconds())
        shared_app.stored.put_back()

    begin_anew(shared_app, ui, put_back)
    assert not ui.find_all(AlarmBanner)
    assert ui.find(TopBar).bell_count == ""
    return shared_app


@pytest.fixture
def alarms(app, container):
    return container.alarms


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
    ui.wait(lambda: len(ui.find_all(AlarmRow)) == count)


# ---------------------------------------------------------------------- acknowledging
def test_an_alarm_is_acknowledged_with_a_note_that_is_shown_afterwards(app, alarms, ui):
    alarms.raise_("unreachable", "robot:77", robot="Aino", problem="no answer")
    ui.wait(lambda: ui.find(TopBar).bell_count == "1")
    open_list(ui)
    assert row(ui, "Aino").state_words == "Active, not acknowledged"
    menu(ui, row(ui, "Aino"), "Acknowledge with a note")
    ui.type(ui.find(FormField, root=ui.find(NoteDialog)), "Access point is off")
    ui.tap(ui.find(CommandButton, ui.find(NoteDialog), text="Acknowledge"))
    ui.wait(lambda: row(ui, "Aino").state_words == "Active, acknowledged")
    assert row(ui, "Aino").answer.endswith(": Access point is off")
    assert row(ui, "Aino").action == ""
    alarms.clear("unreachable", "robot:77")
    wait_for_rows(ui, 0)
    ui.tap(tab(ui, "past"))
    wait_for_rows(ui, 1)
    assert row(ui, "Aino").state_words == "Over, acknowledged"
    assert "Over since" in row(ui, "Aino").note
    assert row(ui, "Aino").answer.endswith(": Access point is off")


def test_a_note_is_optional_and_can_be_left(app, alarms, ui):
    alarms.raise_("clock_stepped", "clock", seconds=40)
    ui.wait(lambda: ui.find(TopBar).bell_count == "1")
    open_list(ui)
    menu(ui, row(ui, "clock"), "Acknowledge with a note")
    ui.tap(ui.find(CommandButton, ui.find(NoteDialog), text="Cancel"))
    assert alarms.open()
    menu(ui, row(ui, "clock"), "Acknowledge with a note")
    ui.tap(ui.find(CommandButton, ui.find(NoteDialog), text="Acknowledge"))
    wait_for_rows(ui, 0)
    assert not alarms.open()


def test_recovery_is_shown_until_it_is_acknowledged(app, alarms, ui):
    for _n in range(2):
        alarms.raise_("unreachable", "robot:77", robot="Aino", problem="no answer")
        alarms.clear("unreachable", "robot:77")
    ui.wait(lambda: ui.find_all(AlarmBanner) and ui.find(AlarmBanner).note.startswith("Over since"))
    open_list(ui)
    assert row(ui, "Aino").state_words == "Over, not acknowledged"
    assert "2 times, last" in row(ui, "Aino").note
    ui.tap(ui.find(CommandButton, row(ui, "Aino"), text="Acknowledge"))
    wait_for_rows(ui, 0)
    assert "No alarms. Everything is as it should be." in ui.texts(ui.find(AlarmsDialog))
    ui.wait(lambda: not ui.find_all(AlarmBanner))


def test_a_robot_that_is_renamed_carries_its_new_name_in_banner_and_list_at_once(container, app, alarms, ui):
    robot = container.catalogue.save_robot(Robot("Aino", "http://127.0.0.1:9", "u"), password="p")
    alarms.raise_("emergency_stop", f"robot:{robot.id}", robot="Aino")
    ui.wait(lambda: ui.find_all(AlarmBanner))
    open_list(ui)
    container.catalogue.save_robot(replace(container.catalogue.robot(robot.id), name="Alma"))
    ui.wait(lambda: ui.find(AlarmBanner).text.startswith("Alma") and row(ui, "emergency stop").text.startswith("Alma"))


# ---------------------------------------------------------------------- shelving
def test_a_shelved_alarm_leaves_the_banner_and_can_be_unshelved(app, alarms, ui):
    alarms.raise_("unreachable", "robot:77", robot="Aino", problem="no answer")
    alarms.raise_("clock_stepped", "clock", seconds=40)
    ui.wait(lambda: ui.find_all(AlarmBanner) and ui.find(AlarmBanner).text == "Aino doesn't answer")
    assert ui.find(AlarmBanner).others == "+1 more"
    open_list(ui)
    wait_for_rows(ui, 2)
    menu(ui, row(ui, "Aino"), "Shelve for 4 hours")
    wait_for_rows(ui, 1)
    ui.wait(lambda: "clock" in ui.find(AlarmBanner).text)
    assert ui.find(AlarmBanner).others == "Details"
    assert ui.find(TopBar).bell_count == "1"
    ui.tap(tab(ui, "shelved"))
    assert row(ui, "Aino").state_words.startswith("Shelved until ")
    assert tab(ui, "shelved").text == "Shelved (1)"
    ui.tap(ui.find(CommandButton, row(ui, "Aino"), text="Unshelve"))
    wait_for_rows(ui, 0)
    ui.wait(lambda: ui.find(AlarmBanner).text == "Aino doesn't answer")


def test_a_shelved_alarm_comes_back_by_itself(container, app, alarms, ui):
    alarms.raise_("unreachable", "robot:77", robot="Aino", problem="no answer")
    alarms.shelve(alarms.open()[0].id, 1)
    ui.wait(lambda: ui.find(TopBar).bell_icon == "bell-sleep-outline")
    assert not ui.find_all(AlarmBanner)
    container.clock.advance(3601)
    ui.advance(1.1)                                       # the frame looks once a second
    assert ui.find(AlarmBanner).text == "Aino doesn't answer"
    assert ui.find(TopBar).bell_icon == "bell-ring-outline"


def test_nothing_is_said_to_be_as_it_should_be_while_an_alarm_is_shelved(app, alarms, ui):
    alarms.raise_("unreachable", "robot:77", robot="Aino", problem="no answer")
    alarms.shelve(alarms.open()[0].id, 1)
    ui.wait(lambda: ui.find(TopBar).bell_icon == "bell-sleep-outline")
    dialog = open_list(ui)
    assert dialog.empty == "Nothing else is open. What is shelved comes back by itself."


# ---------------------------------------------------------------------- one cause
def silence(alarms, ui, count: int = 6) -> None:
    for number in range(count):
        alarms.raise_("unreachable", f"robot:{70 + number}", robot=f"Robot {number}",
                      problem=Unreachable(code="no_answer", address=f"10.1.1.{number}").message)
    ui.wait(lambda: ui.find_all(AlarmBanner) and ui.find(AlarmBanner).text.startswith(f"Wi-Fi: {count} robots"))


def test_robots_that_fall_silent_together_are_one_row_and_all_of_them_one_tap_away(app, alarms, ui):
    silence(alarms, ui)
    assert ui.find(TopBar).bell_count == "1"
    open_list(ui)
    wait_for_rows(ui, 1)
    ui.tap(ui.find(IconButton, row(ui, "Wi-Fi"), icon="chevron-down"))
    wait_for_rows(ui, 7)
    assert checks.problems(ui.find(AlarmsDialog)) == []
    ui.tap(ui.find(IconButton, row(ui, "Wi-Fi"), icon="chevron-up"))
    wait_for_rows(ui, 1)


def test_the_banner_of_a_group_leads_to_its_robots(app, alarms, ui):
    silence(alarms, ui)
    ui.advance(.3)
    ui.tap(ui.find(CommandButton, ui.find(AlarmBanner), text="Show all"))
    wait_for_rows(ui, 7)


def test_a_group_is_acknowledged_shelved_and_taken_back_in_one_go(app, alarms, ui):
    silence(alarms, ui)
    open_list(ui)
    menu(ui, row(ui, "Wi-Fi"), "Shelve for 4 hours")
    wait_for_rows(ui, 0)
    ui.tap(tab(ui, "shelved"))
    wait_for_rows(ui, 1)
    ui.tap(ui.find(CommandButton, row(ui, "Wi-Fi"), text="Unshelve"))
    wait_for_rows(ui, 0)
    ui.tap(tab(ui, "open"))
    wait_for_rows(ui, 1)
    ui.tap(ui.find(CommandButton, row(ui, "Wi-Fi"), text="Acknowledge"))
    ui.wait(lambda: row(ui, "Wi-Fi").state_words == "Active, acknowledged")
    assert all(alarm.acknowledged_at for alarm in alarms.open())


# ---------------------------------------------------------------------- all that is on screen
def acknowledge_all(ui, word: str = "Acknowledge all") -> None:
    ui.tap(ui.find(CommandButton, ui.find(AlarmsDialog), text=word))


def unseen(alarms) -> int:
    return sum(alarm.acknowledged_at is None for alarm in alarms.open())


def test_one_press_acknowledges_all_that_is_on_screen(app, alarms, ui):
    silence(alarms, ui, 3)
    alarms.raise_("emergency_stop", "robot:90", robot="Aino")
    alarms.raise_("app_was_off", "app")
    ui.wait(lambda: ui.find(TopBar).bell_count == "3")
    dialog = open_list(ui)
    wait_for_rows(ui, 3)
    assert checks.problems(dialog) == []
    acknowledge_all(ui)
    ui.wait(lambda: not unseen(alarms) and dialog.all_word == "")


def test_what_is_out_of_sight_is_not_acknowledged(app, alarms, ui):
    for number in range(9):
        alarms.raise_("emergency_stop", f"robot:{70 + number}", robot=f"Robot {number}")
    ui.wait(lambda: ui.find(TopBar).bell_count == "9")
    dialog = open_list(ui)
    wait_for_rows(ui, 9)
    page = dialog.ids.alarm_page
    page.scroll_y = .5                                        # rows are cut off above and below
    ui.advance(.2)
    shown = [each.text for each in ui.find_all(AlarmRow) if page.to_window(*page.pos)[1] <= each.to_window(*each.pos)[1]
             and each.to_window(0, each.top)[1] <= page.to_window(0, page.top)[1]]
    assert 2 <= len(shown) <= 7
    acknowledge_all(ui, "Acknowledge those shown")
    ui.wait(lambda: unseen(alarms) == 9 - len(shown))
    assert not {f"{alarm.details['robot']} is stopped: emergency stop pressed" for alarm in alarms.open()
                if alarm.acknowledged_at is None} & set(shown)


def test_a_second_tap_acknowledges_nothing_more(app, alarms, ui, monkeypatch):
    monkeypatch.setattr(frame_alarms, "SECOND_TAP", 1e3)
    for number in range(9):
        alarms.raise_("emergency_stop", f"robot:{70 + number}", robot=f"Robot {number}")
    ui.wait(lambda: ui.find(TopBar).bell_count == "9")
    dialog = open_list(ui)
    wait_for_rows(ui, 9)
    acknowledge_all(ui, "Acknowledge those shown")
    ui.wait(lambda: unseen(alarms) < 9 and len(dialog.unseen) == unseen(alarms))
    left = unseen(alarms)
    assert left > 1                                           # above those that are acknowledged, where the first ones were
    acknowledge_all(ui)
    ui.wait(lambda: app.shell.background.idle)
    assert unseen(alarms) == left
    ui.skip(1e3)
    acknowledge_all(ui)
    ui.wait(lambda: unseen(alarms) < left)


def test_what_has_only_just_come_is_not_acknowledged_unread(app, alarms, ui, monkeypatch):
    monkeypatch.setattr(frame_alarms, "SECOND_TAP", 1e3)
    alarms.raise_("app_was_off", "app")
    alarms.raise_("clock_stepped", "clock", seconds=40)
    ui.wait(lambda: ui.find(TopBar).bell_count == "2")
    open_list(ui)
    wait_for_rows(ui, 2)
    alarms.raise_("emergency_stop", "robot:90", robot="Aino")
    wait_for_rows(ui, 3)
    acknowledge_all(ui)
    wait_for_rows(ui, 1)
    assert [alarm.code for alarm in alarms.open()] == ["emergency_stop"]
    assert unseen(alarms) == 1


# ---------------------------------------------------------------------- the past
def test_the_past_is_shown_page_by_page_with_its_count(app, alarms, ui, monkeypatch):
    monkeypatch.setattr(frame_alarms, "PAGE", 3)
    for number in range(7):
        alarms.raise_("app_was_off", str(number))
    for alarm in alarms.open():
        alarms.acknowledge(alarm.id)
    ui.wait(lambda: ui.find(TopBar).bell_count == "")
    dialog = open_list(ui)
    ui.tap(tab(ui, "past"))
    wait_for_rows(ui, 3)
    assert dialog.count == "The newest 3 of 7"
    ui.tap(ui.find(CommandButton, dialog, text="Show more"))
    wait_for_rows(ui, 6)
    dialog.ids.alarm_page.scroll_y = 0
    ui.advance(.1)
    ui.tap(ui.find(CommandButton, dialog, text="Show more"))
    wait_for_rows(ui, 7)
    assert (dialog.count, dialog.more) == ("7 past alarms", "")


# ---------------------------------------------------------------------- holds, and the way to where it is solved
def test_a_hold_is_in_the_list_and_is_released_there(container, app, ui):
    container.holds.hold("Fire drill")
    ui.wait(lambda: ui.find(TopBar).bell_count == "1")
    open_list(ui)
    ui.tap(ui.find(CommandButton, row(ui, "Nothing is sent"), text="Release"))
    wait_for_rows(ui, 0)
    assert not container.holds.active()


@pytest.mark.parametrize(("code", "key", "screen"), [
    ("unauthorized", "robot:{robot}", "settings"), ("unreachable", "robot:{robot}", "home"), ("executions_missed", "plan", "logs"),
    ("execution_failed", "schedule:1", "logs"), ("unknown_outcome", "execution:1", "logs"), ("backup_failed", "backup", "settings")])
def test_the_banner_leads_to_where_it_is_solved(container, app, alarms, ui, code, key, screen):
    robot = container.catalogue.save_robot(Robot("Aino", "http://127.0.0.1:9", "u", enabled=False), password="p")
    ui.tap(ui.find(NavItem, name="scheduler"))
    alarms.raise_(code, key.format(robot=robot.id), robot="Aino", mission="Home", reason="x", problem="x", count=2)
    ui.wait(lambda: ui.find_all(AlarmBanner))
    ui.advance(.3)                                            # it stands where it is tapped
    ui.tap(ui.find(CommandButton, ui.find(AlarmBanner), text=ui.find(AlarmBanner).action))
    ui.wait(lambda: app.shell.navigator.current == screen)
    assert alarms.open()                                      # going there acknowledges nothing


def test_the_menu_says_which_alarm_it_is_about(app, alarms, ui):
    alarms.raise_("executions_missed", "plan", count=4)
    ui.wait(lambda: ui.find(TopBar).bell_count == "1")
    open_list(ui)
    about = row(ui, "missed")
    ui.tap(ui.find(IconButton, about, icon="dots-vertical"))
    ui.advance(.3)
    assert ui.texts(ui.find(Menu))[0] == about.text


def test_the_menu_leads_there_too_and_closes_the_list(app, alarms, ui):
    alarms.raise_("executions_missed", "plan", count=4)
    ui.wait(lambda: ui.find(TopBar).bell_count == "1")
    open_list(ui)
    menu(ui, row(ui, "missed"), "Show in Logs")
    ui.wait(lambda: app.shell.navigator.current == "logs")
    assert not ui.find_all(AlarmsDialog)
    ui.wait(lambda: ui.find(AlarmBanner).action == "Acknowledge")      # where one is already


def test_when_nothing_can_be_written_the_alarm_says_where_to_look(app, alarms, ui):
    alarms.database_fails("disk full")
    ui.wait(lambda: ui.find(TopBar).bell_count == "1")
    open_list(ui)
    assert not ui.find_all(IconButton, icon="dots-vertical")
    ui.tap(ui.find(CommandButton, row(ui, "database"), text="Open settings"))
    ui.wait(lambda: app.shell.navigator.current == "settings")


# ---------------------------------------------------------------------- looks
@pytest.mark.parametrize("gloves", [False, True])
def test_nothing_is_clipped_or_too_small(container, app, alarms, ui, gloves):
    container.catalogue.change_settings(gloves=gloves)
    ui.wait(lambda: tk.gloves is gloves)
    alarms.raise_("emergency_stop", "robot:77", robot="A robot with a very long name in the hall of the presses")
    alarms.raise_("executions_missed", "plan", count=4)
    ui.wait(lambda: ui.find(TopBar).bell_count == "2")
    dialog = open_list(ui)
    ui.advance(.3)
    assert checks.problems(dialog) == []
    ui.tap(ui.find(IconButton, row(ui, "missed"), icon="dots-vertical"))
    top = app.shell.dialogs.top
    assert checks.problems(top) == []
    ui.tap(next(widget for widget in ui.find_all(Tap, top) if getattr(widget, "text", "") == "Acknowledge with a note"))
    assert checks.problems(ui.find(NoteDialog)) == []


# ---------------------------------------------------------------------- heard
def test_a_new_alarm_is_heard_and_again_when_nobody_acknowledges_it(container, app, alarms, ui):
    loudspeaker = app.shell.loudspeaker
    before = loudspeaker.played
    alarms.raise_("emergency_stop", "robot:77", robot="Aino")
    ui.wait(lambda: loudspeaker.played == before + 1)
    height = ui.find(AlarmBanner).height
    container.clock.advance(301)
    ui.advance(1.1)
    assert loudspeaker.played == before + 2
    assert ui.find(AlarmBanner).height > height
    assert ui.find(AlarmBanner).note.startswith("Nobody has acknowledged it for 5 min")
    assert checks.problems(ui.find(AlarmBanner)) == []
    alarms.acknowledge(alarms.open()[0].id)
    ui.wait(lambda: ui.find(AlarmBanner).calm)
    played = loudspeaker.played
    container.clock.advance(301)
    ui.wait(lambda: ui.find(AlarmBanner).height == height)
    assert loudspeaker.played == played == before + 2


def test_the_sound_is_switched_in_settings_where_it_is_heard(container, app, alarms, ui):
    loudspeaker = app.shell.loudspeaker
    go(ui, "display")
    switch = ui.find(Toggle, root=ui.find(SwitchRow, text="Sound at alarms"))
    ui.tap(switch)
    ui.wait(lambda: not container.settings().alarm_sound)
    before = loudspeaker.played
    alarms.raise_("emergency_stop", "robot:77", robot="Aino")
    ui.wait(lambda: ui.find_all(AlarmBanner))
    assert loudspeaker.played == before
    ui.wait(lambda: not ui.find(SwitchRow, text="Sound at alarms").active)
    ui.tap(ui.find(Toggle, root=ui.find(SwitchRow, text="Sound at alarms")))
    ui.wait(lambda: container.settings().alarm_sound)
    assert loudspeaker.played == before + 1


def test_an_alarm_is_heard_again_though_the_clock_was_set_back(container, app, alarms, ui):
    loudspeaker = app.shell.loudspeaker
    before = loudspeaker.played
    alarms.raise_("emergency_stop", "robot:77", robot="Aino")
    ui.wait(lambda: loudspeaker.played == before + 1)
    container.clock.step(-3600)
    container.clock.advance(301)
    ui.advance(1.1)
    assert loudspeaker.played == before + 2


# ---------------------------------------------------------------------- its place
def test_the_tabs_stay_where_the_finger_is(app, alarms, ui):
    for number in range(4):
        alarms.raise_("robot_error", f"robot:{number}", robot=f"Robot {number}", problem="no answer")
    ui.wait(lambda: ui.find(TopBar).bell_count == "4")
    open_list(ui)
    wait_for_rows(ui, 4)
    place = tab(ui, "past").to_window(*tab(ui, "past").pos)
    ui.tap(tab(ui, "past"))
    wait_for_rows(ui, 0)
    assert tab(ui, "past").to_window(*tab(ui, "past").pos) == place


# ---------------------------------------------------------------------- fingers
def test_an_alarm_does_not_move_what_a_finger_is_on(app, alarms, ui, monkeypatch):
    monkeypatch.setattr(finger, "LONGEST", 1e6)
    lift = ui.press(ui.find(NavItem, name="settings"))
    alarms.raise_("clock_stepped", "clock", seconds=40)
    ui.wait(lambda: ui.find(TopBar).bell_count == "1")
    assert ui.find_all(AlarmBanner) == []
    lift()
    assert ui.find(NavItem, name="settings").active
    ui.wait(lambda: ui.find_all(AlarmBanner))


def test_a_tap_on_what_the_banner_has_just_moved_presses_nothing(app, alarms, ui):
    def at(button: CommandButton) -> tuple[float, float]:
        return button.to_window(*button.center)

    def tap_at_once(button: CommandButton) -> None:
        """Without looking first."""
        ui.tap_at(*at(button))
        ui.wait(lambda: app.shell.background.idle)

    button = ui.find(CommandButton, text="Add robot")
    place = at(button)
    alarms.raise_("app_was_off", "app")
    ui.wait(lambda: ui.find_all(AlarmBanner))
    acknowledge = ui.find(CommandButton, ui.find(AlarmBanner), text="Acknowledge")
    assert at(button) != place
    tap_at_once(acknowledge)
    assert alarms.open()
    ui.tap(acknowledge)
    ui.wait(lambda: not ui.find_all(AlarmBanner))
    assert at(button) == place                                # it has moved back
    tap_at_once(button)
    assert app.shell.navigator.current == "home"
    ui.tap(button)
    assert app.shell.navigator.current == "settings"


def test_the_second_tap_on_the_banner_is_the_same_press(app, alarms, ui, monkeypatch):
    """It says something else by then, at which nobody has looked."""
    monkeypatch.setattr(controller, "SECOND_TAP", 1e3)
    for seconds in (40, 50):
        alarms.raise_("app_was_off", str(seconds))
    ui.wait(lambda: ui.find_all(AlarmBanner) and ui.find(TopBar).bell_count == "2")
    ui.advance(.5)
    button = ui.find(CommandButton, ui.find(AlarmBanner), text="Acknowledge")
    place = button.to_window(*button.center)
    ui.tap_at(*place)
    ui.wait(lambda: len(alarms.open()) == 1 and ui.find(AlarmBanner).others == "Details")
    ui.tap_at(*place)
    ui.wait(lambda: app.shell.background.idle)
    assert len(alarms.open()) == 1
    ui.skip(1e3)
    ui.tap_at(*place)
    ui.wait(lambda: not alarms.open())


def test_a_hand_that_rests_on_the_screen_keeps_no_alarm_away(app, alarms, ui):
    lift = ui.press(ui.find(NavItem, name="settings"))
    alarms.raise_("clock_stepped", "clock", seconds=40)
    ui.wait(lambda: ui.find_all(AlarmBanner))
    lift()
