"""Settings, Missions: from a robot's list, by hand, favourites, what is missing, and Undo."""

from __future__ import annotations

import threading
from dataclasses import replace
from datetime import datetime

from app.domain.models import Mission, Schedule
from app.mir.errors import TimedOut
from app.screens.settings.missions import MissionRow, MissionSheet
from app.services.catalogue import mission_edit
from app.widgets.buttons import CommandButton, IconButton, MenuChip, Toggle
from app.widgets.choices import ChoiceSheet, OptionRow
from app.widgets.display import Notice
from app.widgets.fields import Field, PickBox, SearchField
from app.widgets.rest import DOUBLE_TAP
from app.widgets.sheet import AskSheet
from app.window.key_focus import ESCAPE
from tests.ui.integrator import choose, enter, go, item_of, missions, page, press, says, section_row, undo
from tests.ui.whole_app import GUIDS


def fetch_buttons(ui) -> list[CommandButton]:
    """Also the one that is shown while there are no missions."""
    return [button for button in ui.find_all(CommandButton, disabled=False) if button.text.startswith("Fetch")]


def ask(ui, robot: str) -> None:
    ui.wait(lambda: fetch_buttons(ui))
    ui.tap(fetch_buttons(ui)[-1])
    ui.wait(lambda: ui.find_all(OptionRow, title=robot))
    ui.tap(ui.find(OptionRow, title=robot))


def fetch(ui, robot: str) -> ChoiceSheet:
    ask(ui, robot)
    ui.wait(lambda: ui.find_all(ChoiceSheet, multiple=True))
    return ui.find(ChoiceSheet)


def test_missions_are_taken_over_from_a_checklist(site, app, ui):
    site.add_robots()
    site.add_missions("Deliver")
    go(ui, "missions")
    ui.wait(lambda: ui.find_all(MissionRow))
    dialog = fetch(ui, "Aino")
    assert "Deliver" not in [option.text for option in dialog.options]  # here already
    ui.tap(ui.find(OptionRow, root=dialog, title="Collect empties"))
    press(ui, "Add chosen", dialog)
    ui.wait(lambda: len(missions(site)) == 2)
    assert {mission.name: mission.guid for mission in missions(site)} == {
        name: GUIDS[name] for name in ("Deliver", "Collect empties")
    }
    ui.wait(lambda: says(ui, "1 mission added"))
    ui.wait(lambda: len(ui.find_all(MissionRow)) == 2)


def test_ticks_that_esc_closed_come_back(site, app, ui):
    site.add_robots()
    go(ui, "missions")
    dialog = fetch(ui, "Aino")
    ui.tap(ui.find(OptionRow, root=dialog, title="Collect empties"))
    ui.key(ESCAPE)
    ui.wait(lambda: not ui.find_all(ChoiceSheet))
    undo(ui)
    ui.wait(lambda: ui.find_all(ChoiceSheet))
    ui.advance(1)
    press(ui, "Add chosen", dialog)
    ui.wait(lambda: [mission.name for mission in missions(site)] == ["Collect empties"])


def test_when_everything_is_here_that_is_said(site, app, ui):
    _aino, veikko = site.add_robots()
    found = site.container.operator.fetch_missions(veikko.id)
    site.container.catalogue.edit(
        lambda edit: [mission_edit.save(edit, Mission(mission.name, mission.guid)) for mission in found]
    )
    go(ui, "missions")
    ui.wait(lambda: ui.find_all(MissionRow))
    press(ui, "Fetch")
    ui.tap(ui.find(OptionRow, title="Veikko"))
    ui.wait(lambda: says(ui, f"All {len(found)} missions of Veikko are already added"))


def test_on_another_page_it_is_said_that_no_mission_was_added(site, app, ui):
    site.add_robots()
    site.fleet.robots[0].control({"fault": {"kind": "late", "path": "/missions", "count": None, "seconds": 2.0}})
    go(ui, "missions")
    ask(ui, "Aino")
    go(ui, "about")
    ui.wait(lambda: app.shell.snackbars.texts == ["Not asked, as the page was left: Missions of Aino"])
    assert app.shell.dialogs.top is None
    go(ui, "missions")
    site.fleet.robots[0].control({"fault": None})
    ask(ui, "Aino")
    ui.wait(lambda: ui.find_all(ChoiceSheet, multiple=True))


def test_on_another_page_a_message_says_that_the_robot_did_not_list_its_missions(site, app, ui, monkeypatch):
    left = threading.Event()

    def fetch_missions(_robot_id: int) -> None:
        assert left.wait(20)
        raise TimedOut

    site.add_robots()
    monkeypatch.setattr(site.container.operator, "fetch_missions", fetch_missions)
    go(ui, "missions")
    ask(ui, "Aino")
    app.shell.go("logs")
    left.set()
    ui.wait(lambda: app.shell.snackbars.texts)
    (said,) = app.shell.snackbars.texts
    assert "Fetch missions" in said
    assert "Aino" in said


def test_a_robot_that_is_deleted_while_its_missions_are_asked_for(site, app, ui):
    site.add_robots()
    go(ui, "missions")
    site.fleet.robots[0].control({"fault": {"kind": "drop_request", "path": "*", "count": None}})
    ask(ui, "Aino")
    ui.wait(lambda: ui.find_all(Notice, tone="fault"))
    assert not page(app).vm.fetching
    assert "Aino" in page(app).vm.outcome.text


def test_all_missions_of_a_list_are_ticked_at_once(site, app, ui):
    site.add_robots()
    go(ui, "missions")
    dialog = fetch(ui, "Aino")
    search = ui.find(SearchField, dialog)
    search.text = "collect"
    ui.advance(0.2)
    press(ui, "Select all", dialog)
    ui.advance(0.2)
    press(ui, "Select none", dialog)  # of those that the search shows
    ui.advance(0.2)
    assert dialog.selected == []
    search.text = ""
    ui.advance(0.2)
    press(ui, "Select all", dialog)
    press(ui, "Add chosen", dialog)
    offered = [option.text for option in dialog.options]
    ui.wait(lambda: len(missions(site)) == len(offered) > 3)
    assert {mission.name for mission in missions(site)} == set(offered)


def test_the_guid_of_a_mission_is_behind_details(site, app, ui):
    site.add_missions("Deliver")
    go(ui, "missions")
    ui.wait(lambda: ui.find_all(MissionRow))
    assert GUIDS["Deliver"] not in ui.texts()
    ui.tap(ui.find(MissionRow))
    ui.wait(lambda: ui.find_all(MissionSheet))
    ui.advance(0.5)
    dialog = ui.find(MissionSheet)
    assert "GUID" not in ui.texts(dialog)
    ui.tap(ui.find(MenuChip, dialog, text="Details"))
    ui.advance(0.3)
    assert "GUID" in ui.texts(dialog)
    assert ui.find(Field, dialog, label="GUID").text == GUIDS["Deliver"]


def test_a_mission_by_hand_with_its_bad_input_at_the_field(site, app, ui):
    site.add_missions("Deliver")
    go(ui, "missions")
    ui.wait(lambda: ui.find_all(MissionRow))
    ui.tap(ui.find(IconButton, icon="plus"))
    dialog = ui.find(MissionSheet)
    enter(ui, dialog.ids.name_field, "Deliver")
    guid = ui.find(Field, dialog, label="GUID")
    enter(ui, guid, "no guid!")
    press(ui, "Save", dialog)
    ui.wait(lambda: guid.problem.startswith("A mission's guid has"))
    enter(ui, guid, GUIDS["Home"])
    press(ui, "Save", dialog)
    ui.wait(lambda: dialog.ids.name_field.problem == "There is a mission Deliver already")
    enter(ui, dialog.ids.name_field, "Home")
    press(ui, "Save", dialog)
    ui.wait(lambda: not ui.find_all(MissionSheet))
    assert {mission.name for mission in missions(site)} == {"Deliver", "Home"}


def test_a_usual_duration_is_typed_refused_at_its_field_and_removed(site, app, ui):
    site.add_missions("Deliver")
    go(ui, "missions")
    ui.wait(lambda: ui.find_all(MissionRow))

    def opened() -> MissionSheet:
        ui.tap(ui.find(MissionRow))
        return ui.find(MissionSheet)

    dialog = opened()
    field = dialog.ids.usual_minutes_field
    assert field.text == ""
    for text in ("0", "1441"):
        enter(ui, field, text)
        press(ui, "Save", dialog)
        ui.wait(lambda: field.problem == "Enter a whole number from 1 to 1440")
    enter(ui, field, "25")
    assert field.problem == ""
    press(ui, "Save", dialog)
    ui.wait(lambda: not ui.find_all(MissionSheet))
    assert missions(site)[0].usual_minutes == 25
    ui.wait(lambda: ui.find(MissionRow).item.usual == "25 min")
    dialog = opened()
    assert dialog.ids.usual_minutes_field.text == "25"
    enter(ui, dialog.ids.usual_minutes_field, "")
    press(ui, "Save", dialog)
    ui.wait(lambda: not ui.find_all(MissionSheet))
    assert missions(site)[0].usual_minutes is None
    ui.wait(lambda: ui.find(MissionRow).item.usual == "–")


def test_a_mission_that_holds_for_one_robot_only(site, app, ui):
    _aino, veikko = site.add_robots()
    site.add_missions("Deliver")
    go(ui, "missions")
    ui.wait(lambda: ui.find_all(MissionRow))
    ui.tap(ui.find(MissionRow))
    dialog = ui.find(MissionSheet)
    ui.tap(ui.find(PickBox, root=dialog))
    ui.tap(ui.find(OptionRow, title="Only Veikko"))
    press(ui, "Save", dialog)
    ui.wait(lambda: missions(site)[0].robot_id == veikko.id)
    ui.wait(lambda: ui.find(MissionRow).item.note == "Only Veikko")


def test_a_late_save_closes_its_own_sheet_alone(site, app, ui, monkeypatch):
    site.add_robots()
    site.add_missions("Deliver")
    goes, catalogue = threading.Event(), site.container.catalogue
    save = catalogue.save_mission
    monkeypatch.setattr(catalogue, "save_mission", lambda mission: goes.wait(30) and save(mission))
    go(ui, "missions")
    ui.wait(lambda: ui.find_all(MissionRow))
    ui.tap(ui.find(MissionRow))
    sheet = ui.find(MissionSheet)
    enter(ui, sheet.ids.usual_minutes_field, "7")
    press(ui, "Save", sheet)
    page(app).add()
    another = ui.find(MissionSheet)
    goes.set()
    ui.wait(lambda: missions(site)[0].usual_minutes == 7 and says(ui, "Deliver saved"))
    assert another is not sheet
    assert app.shell.sheets.top is another


def delete(ui, app, mission: str) -> None:
    """In the menu of its sheet."""
    key = next(row.key for row in page(app).vm.rows if row.name == mission)
    page(app).act(key, "open")
    choose(ui, "Delete", ui.find(MissionSheet))


def test_a_star_stays_in_its_place_and_a_deleted_mission_comes_back(site, app, ui):
    site.add_missions("Deliver", "Home", favourite=False)
    go(ui, "missions")
    ui.wait(lambda: len(ui.find_all(MissionRow)) == 2)
    ui.tap(ui.find(IconButton, ui.find(MissionRow, name="Home"), icon="star-outline"))
    ui.wait(lambda: [(row.name, row.favourite) for row in page(app).vm.rows] == [("Deliver", False), ("Home", True)])
    delete(ui, app, "Home")
    ui.wait(lambda: [mission.name for mission in missions(site)] == ["Deliver"] and not ui.find_all(MissionSheet))
    ui.wait(lambda: says(ui, "Home deleted"))
    undo(ui)
    ui.wait(
        lambda: (
            {(mission.name, mission.favourite) for mission in missions(site)} == {("Home", True), ("Deliver", False)}
        )
    )


def test_a_star_stays_when_the_open_sheet_of_its_mission_is_saved(site, app, ui):
    site.add_missions("Home", favourite=False)
    go(ui, "missions")
    ui.wait(lambda: ui.find_all(MissionRow))
    ui.tap(ui.find(MissionRow))
    sheet = ui.find(MissionSheet)
    ui.find(MissionRow).act("favourite", True)
    ui.wait(lambda: page(app).context.facts.missions[0].favourite)
    ui.advance(0.5)  # until the sheet takes touches
    enter(ui, sheet.ids.usual_minutes_field, "7")
    press(ui, "Save", sheet)
    ui.wait(lambda: missions(site)[0].usual_minutes == 7)
    assert missions(site)[0].favourite


def test_a_mission_that_more_goes_with_is_deleted_once_that_was_asked(site, app, ui):
    aino, _veikko = site.add_robots()
    deliver, _home = site.add_missions("Deliver", "Home")
    catalogue = site.container.catalogue
    catalogue.save_schedule(Schedule("Morning", aino.id, deliver.id, datetime(2030, 1, 7, 6, 30), "UTC", "FREQ=DAILY"))
    catalogue.change_idle_rule(aino.id, mission_id=deliver.id)
    go(ui, "missions")
    ui.wait(lambda: [row.name for row in page(app).vm.rows] == ["Deliver", "Home"])
    delete(ui, app, "Deliver")
    question = ui.find(AskSheet)
    assert question.title == "Delete Deliver?"
    assert question.text.splitlines() == [
        "This schedule goes with it:",
        "Morning",
        "",
        "This goes with it: idle automation on Aino.",
    ]
    press(ui, "Keep", question)
    ui.wait(lambda: app.shell.background.idle)
    assert len(missions(site)) == 2
    ui.advance(DOUBLE_TAP)
    choose(ui, "Delete", ui.find(MissionSheet))
    press(ui, "Delete", ui.find(AskSheet))
    ui.wait(lambda: [mission.name for mission in missions(site)] == ["Home"])
    ui.wait(lambda: len(ui.find_all(MissionRow)) == 1)
    assert says(ui, "Deliver deleted")
    undo(ui)
    ui.wait(lambda: len(missions(site)) == 2)
    assert [schedule.name for schedule in catalogue.schedules()] == ["Morning"]
    assert catalogue.robot(aino.id).idle.mission_id == deliver.id


def test_a_mission_that_the_robot_lost_is_flagged(site, app, ui):
    aino, _veikko = site.add_robots()
    missing = site.container.catalogue.save_mission(Mission("Gone", "00000000-0000-0000-0000-000000000000"))
    site.container.catalogue.save_schedule(
        Schedule("Morning", aino.id, missing.id, datetime(2030, 1, 7, 6, 30), "UTC", "FREQ=DAILY")
    )
    go(ui, "missions")
    ui.wait(lambda: [[cell.icon for cell in row.item.cells] for row in ui.find_all(MissionRow)] == [["close", ""]])
    assert section_row(ui, "missions").item.support == "1, 1 missing"
    ui.tap(section_row(ui, "robots"))
    ui.wait(lambda: item_of(ui, "Aino").meta == "1 mission missing")


def test_missions_are_found_while_typing(site, app, ui):
    site.add_missions(*GUIDS)
    go(ui, "missions")
    ui.wait(lambda: len(page(app).vm.rows) == len(GUIDS))
    ui.tap(ui.find(IconButton, icon="magnify"))
    ui.wait(lambda: ui.find_all(SearchField))
    ui.type(ui.find(SearchField), "empties")
    assert [row.name for row in page(app).vm.rows] == ["Collect empties"]


def test_a_mission_may_start_on_a_low_battery(site, app, ui):
    site.add_missions("Deliver")
    go(ui, "missions")
    ui.wait(lambda: ui.find_all(MissionRow))
    ui.tap(ui.find(MissionRow))
    dialog = ui.find(MissionSheet)
    assert not ui.find(Toggle, dialog).active
    ui.tap(ui.find(Toggle, dialog))
    assert ui.find(Toggle, dialog).active
    press(ui, "Save", dialog)
    ui.wait(lambda: not ui.find_all(MissionSheet))
    assert missions(site)[0].on_low_battery


def test_an_undo_that_is_refused_says_why_and_can_be_pressed_again(site, app, ui):
    (deliver,) = site.add_missions("Deliver")
    go(ui, "missions")
    ui.wait(lambda: ui.find_all(MissionRow))
    delete(ui, app, "Deliver")
    ui.wait(lambda: says(ui, "Deliver deleted"))
    other = site.container.catalogue.save_mission(Mission("Deliver", "other"))
    undo(ui)
    ui.wait(lambda: says(ui, "There is another mission Deliver now: rename that one, then undo again"))
    site.container.catalogue.save_mission(replace(other, name="Deliver kits"))
    undo(ui)
    ui.wait(
        lambda: (
            {mission.name: mission.id for mission in missions(site)}
            == {"Deliver": deliver.id, "Deliver kits": other.id}
        )
    )


def test_add_chosen_is_off_while_none_is_chosen(site, app, ui):
    site.add_robots()
    site.add_missions("Deliver")
    go(ui, "missions")
    ui.wait(lambda: ui.find_all(MissionRow))
    dialog = fetch(ui, "Aino")
    button = ui.find(CommandButton, dialog, text="Add chosen")
    assert button.disabled
    row = ui.find(OptionRow, root=dialog, title="Collect empties")
    ui.tap(row)
    ui.wait(lambda: not button.disabled)
    ui.tap(row)
    ui.wait(lambda: button.disabled)
