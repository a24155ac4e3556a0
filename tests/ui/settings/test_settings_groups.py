"""Settings, Robots, Groups and Missions, Places, as an integrator uses them: taps and typing."""

from __future__ import annotations

from dataclasses import replace
from datetime import datetime
from threading import Event

from app.database.errors import DatabaseUnavailable
from app.database.missions import StopRepository
from app.domain.models import Group, HandOver, Place, Robot, Schedule
from app.domain.robot import Stop
from app.screens.settings.groups import GroupSheet
from app.screens.settings.missions import MissionRow
from app.screens.settings.places import PlaceSheet
from app.services.robots import missions
from app.widgets.buttons import CommandButton, IconButton, Segment
from app.widgets.choices import ChoiceSheet, OptionRow
from app.widgets.fields import Field
from app.widgets.list_row import ListRow
from app.widgets.sheet import AskSheet
from app.widgets.snackbar import Snackbar
from app.widgets.surfaces import Tap
from app.widgets.tabs import TabButton
from tests.ui.integrator import (
    choose,
    enter,
    go,
    item_of,
    open_row,
    page,
    press,
    reveal,
    robots,
    row_of,
    schedules,
    titles,
    undo,
)
from tests.ui.whole_app import api


def groups(site):
    return site.container.catalogue.groups()


def turn_to(ui, word):
    ui.wait(lambda: tab(ui, word))
    ui.tap(tab(ui, word))
    ui.advance(0.3)


def tab(ui, word):
    return next((button for button in ui.find_all(TabButton) if button.tab.text == word), None)


def save_group(site, **values):
    return site.container.catalogue.save_group(Group("Hall 1", tuple(robot.id for robot in robots(site)), **values))


def tick(ui, *words):
    """In the list that is open, then confirm."""
    ui.wait(lambda: ui.find_all(ChoiceSheet))
    for word in words:
        ui.tap(ui.find(OptionRow, title=word))
    press(ui, "Set", ui.find(ChoiceSheet))
    ui.advance(0.3)


def test_one_robot_alone_has_neither_groups_nor_places(site, app, ui):
    site.add_missions("Deliver")
    site.container.catalogue.remove_robot(site.add_robots()[1].id)
    go(ui, "robots")
    ui.wait(lambda: titles(ui))
    assert len(ui.find_all(TabButton)) == 1
    go(ui, "missions")
    ui.advance(0.3)
    assert len(ui.find_all(TabButton)) == 1


def test_a_group_is_made_of_ticked_robots(site, app, ui):
    site.add_robots()
    go(ui, "robots")
    turn_to(ui, "Groups")
    press(ui, "Add group")
    dialog = ui.find(GroupSheet)
    press(ui, "Save", dialog)
    assert (dialog.ids.name_field.problem, dialog.problems.get("members"), groups(site)) == (
        "Enter a name",
        "Choose the robots of the group",
        [],
    )
    for name in ("Aino", "Veikko"):
        ui.tap(next(row for row in ui.find_all(ListRow, dialog) if row.item.title == name))
    assert (list(dialog.it.members), dialog.problems) == (
        [robot.id for robot in robots(site)],
        {"name": "Enter a name"},
    )
    enter(ui, dialog.ids.name_field, "aino")
    press(ui, "Save", dialog)
    ui.wait(lambda: dialog.ids.name_field.problem == "There is a robot Aino already")
    enter(ui, dialog.ids.name_field, "Hall 1")
    at_once = ui.find(Segment, dialog, text="At once")
    reveal(ui, at_once)
    ui.tap(at_once)
    assert "While the tablet is off, the robots continue" in dialog.hand_over_note
    press(ui, "Save", dialog)
    ui.wait(lambda: titles(ui))
    assert item_of(ui, "Hall 1").support == "Aino, Veikko"
    assert groups(site) == [
        Group("Hall 1", tuple(robot.id for robot in robots(site)), HandOver.AT_ONCE, 0, groups(site)[0].id)
    ]


def test_robots_are_kept_free_from_four_on_and_the_cost_is_said(site, app, ui):
    site.add_robots()
    save_group(site)
    go(ui, "robots")
    turn_to(ui, "Groups")
    dialog = open_row(ui, "Hall 1")
    assert dialog.keep_free_note == "From 4 robots on"
    assert dialog.ids.keep_free.disabled
    for n in (3, 4):
        site.container.catalogue.save_robot(Robot(f"R{n}", f"127.0.0.2:{n}", "user", enabled=False))
    ui.wait(lambda: len(dialog.rows) == 4)
    for name in ("R3", "R4"):
        tick_robot(ui, dialog, name)
    field = dialog.ids.keep_free
    ui.wait(lambda: not field.disabled)
    reveal(ui, field)
    ui.tap(ui.find(CommandButton, field, icon="plus"))
    assert "every fifth is not run" in dialog.keep_free_note
    ui.wait(lambda: (len(groups(site)[0].members), groups(site)[0].keep_free) == (4, 1))


def tick_robot(ui, dialog, name):
    row = next(row for row in ui.find_all(ListRow, dialog) if row.item.title == name)
    reveal(ui, row)
    ui.tap(row)
    ui.advance(0.3)


def test_a_group_is_changed_at_once_and_changed_back(site, app, ui):
    site.add_robots()
    group, mission = save_group(site), site.add_missions("Deliver")[0]
    site.container.catalogue.save_schedule(
        Schedule("", None, mission.id, datetime(2030, 1, 7, 6), "UTC", group_id=group.id)
    )
    go(ui, "robots")
    turn_to(ui, "Groups")
    dialog = open_row(ui, "Hall 1")
    enter(ui, dialog.ids.name_field, "Hall 2")
    dialog.ids.name_field.focus = False
    ui.wait(lambda: item_of(ui, "Hall 2"))
    assert dialog.title == "Hall 2"
    ui.wait(lambda: [(each.name, each.group_id) for each in schedules(site)] == [("Deliver on Hall 2", group.id)])
    tick_robot(ui, dialog, "Veikko")
    ui.wait(lambda: len(groups(site)[0].members) == 1 and app.shell.background.idle)
    ui.advance(0.3)
    undo(ui)
    ui.wait(lambda: len(groups(site)[0].members) == 2 == len(dialog.it.members))
    for name in ("Aino", "Veikko"):
        tick_robot(ui, dialog, name)
    ui.wait(lambda: dialog.problems.get("members") == "Choose the robots of the group")
    assert len(groups(site)[0].members) == 1


def test_what_a_group_could_not_save_is_not_shown_as_saved(site, app, ui, monkeypatch):
    """And what was typed in that time stays."""
    is_typed = Event()

    def refuse(*_args):
        assert is_typed.wait(30)
        raise DatabaseUnavailable("The disk is full")

    site.add_robots()
    save_group(site)
    go(ui, "robots")
    turn_to(ui, "Groups")
    dialog = open_row(ui, "Hall 1")
    monkeypatch.setattr(site.container.catalogue, "change", refuse)
    dialog.choose(hand_over=HandOver.AT_ONCE)
    dialog.enter(name="Hall 9")
    is_typed.set()
    ui.wait(lambda: dialog.outcome.text.startswith("The disk is full"))
    assert dialog.it == replace(groups(site)[0], name="Hall 9")


def test_deleting_a_group_names_its_schedules_and_is_undone(site, app, ui):
    site.add_robots()
    group, mission = save_group(site), site.add_missions("Deliver")[0]
    for name in ("Morning", "Evening"):
        site.container.catalogue.save_schedule(
            Schedule(name, None, mission.id, datetime(2030, 1, 7, 6), "UTC", group_id=group.id)
        )
    site.container.holds.hold("cleaning", None)
    site.container.operator.run_on_any(group.id, mission.id)
    go(ui, "robots")
    turn_to(ui, "Groups")
    open_row(ui, "Hall 1")
    choose(ui, "Delete", ui.find(GroupSheet))
    ui.wait(lambda: ui.find_all(AskSheet))
    question = ui.find(AskSheet)
    assert question.title == "Delete Hall 1?"
    assert question.text == (
        "These 2 schedules go with it:\nEvening\nMorning\n\nA start that waits for one of its robots is cancelled.\n"
        "Its robots stay, and running missions continue."
    )
    press(ui, "Delete", question)
    ui.wait(lambda: not groups(site) and not titles(ui))
    assert (schedules(site), len(robots(site))) == ([], 2)
    ui.wait(lambda: ui.find_all(Snackbar))
    undo(ui)
    ui.wait(lambda: item_of(ui, "Hall 1"))
    assert [schedule.name for schedule in schedules(site)] == ["Evening", "Morning"]


def test_a_robot_that_lacks_a_mission_of_its_group_leads_to_the_missions(site, app, ui, monkeypatch):
    monkeypatch.setattr(missions, "ASK_AGAIN_AFTER", 0.0)
    site.add_robots()
    empties, _deliver = site.add_missions(
        "Collect empties", "Deliver"
    )  # the first of no other test here: it stays away
    group = save_group(site)
    site.container.catalogue.save_schedule(
        Schedule("", None, empties.id, datetime(2030, 1, 7, 6), "UTC", group_id=group.id)
    )
    go(ui, "robots")
    turn_to(ui, "Groups")
    dialog = open_row(ui, "Hall 1")
    ui.wait(lambda: len(page(app).context.facts.names) == 2)
    assert [row.support for row in dialog.rows] == ["", ""]
    api(site.fleet.robots[1], "DELETE", f"/missions/{empties.guid}")
    page(app).context.refresh()
    ui.wait(lambda: [row.support for row in dialog.rows] == ["", "Lacks Collect empties"])
    assert item_of(ui, "Hall 1").meta == "1 mission missing"
    ui.tap(next(button for button in ui.find_all(IconButton, dialog) if button.icon == "chevron-right"))
    ui.wait(lambda: [row.item.name for row in ui.find_all(MissionRow)] == ["Collect empties"])
    assert [head.text for head in page(app).vm.heads] == ["Aino", "Veikko"]
    assert [cell.icon for cell in ui.find(MissionRow).item.cells] == ["check", "close"]


def places(site):
    return site.container.catalogue.places()


def open_places(ui):
    go(ui, "missions")
    turn_to(ui, "Places")


def add_place(ui):
    ui.tap(ui.find(IconButton, icon="plus"))
    return ui.find(PlaceSheet)


def test_a_place_and_the_missions_that_use_it(site, app, ui):
    site.add_robots()
    site.add_missions("Deliver", "Home")
    open_places(ui)
    sheet = add_place(ui)
    press(ui, "Save", sheet)
    ui.wait(lambda: sheet.ids.name_field.problem == "Enter a name")
    enter(ui, sheet.ids.name_field, "Dock 2")
    ui.tap(ui.find(Tap, ui.find(Field, root=sheet, kind="pick")))
    tick(ui, "Deliver", "Home")
    press(ui, "Save", sheet)
    ui.wait(lambda: row_of(ui, "Dock 2"))
    assert (row_of(ui, "Dock 2").item.support, places(site)[0].most) == ("Deliver, Home", 1)
    choose(ui, "Delete", open_row(ui, "Dock 2"))
    ui.wait(lambda: ui.find_all(Snackbar, text="Dock 2 deleted"))
    ui.wait(lambda: not row_of(ui, "Dock 2"))
    ui.tap(ui.find(root=ui.find(Snackbar, text="Dock 2 deleted"), text="Undo"))
    ui.wait(lambda: row_of(ui, "Dock 2"))
    turn_to(ui, "Missions")
    assert page(app).vm.part == "missions"
    assert not row_of(ui, "Dock 2")


def test_every_quick_tap_counts_and_undo_takes_them_all_back(site, app, ui, monkeypatch):
    """However slowly the tablet writes; the button stays where it is."""
    site.add_robots()
    (deliver,) = site.add_missions("Deliver")
    site.container.catalogue.save_place(Place("Dock 2", 1, (deliver.id,)))
    open_places(ui)
    sheet = open_row(ui, "Dock 2")
    write, go_on = site.container.catalogue.change, Event()
    monkeypatch.setattr(site.container.catalogue, "change", lambda *both: go_on.wait(30) and write(*both))
    plus = ui.find(CommandButton, sheet, icon="plus")
    place = plus.to_window(*plus.center)
    ui.advance(1)  # until the sheet takes touches
    for _n in range(4):
        ui.tap_at(*place)
    assert (sheet.it.most, row_of(ui, "Dock 2").item.meta) == (5, "5")
    go_on.set()
    ui.wait(lambda: places(site)[0].most == 5 and app.shell.background.idle)
    undo(ui)
    ui.wait(lambda: places(site)[0].most == sheet.it.most == 1)


def test_undo_leaves_what_was_changed_elsewhere_since(site, app, ui):
    site.add_robots()
    (deliver,) = site.add_missions("Deliver")
    dock = site.container.catalogue.save_place(Place("Dock", 2, (deliver.id,)))
    open_places(ui)
    sheet = open_row(ui, "Dock")
    sheet.choose(most=3)
    ui.wait(lambda: places(site)[0].most == 3 and app.shell.background.idle)
    site.container.catalogue.save_place(replace(dock, most=9))
    ui.wait(lambda: sheet.it.most == 9)
    sheet.choose(name="Dock 3")
    ui.wait(lambda: places(site)[0].name == "Dock 3" and app.shell.background.idle)
    undo(ui)
    ui.wait(lambda: places(site)[0].name == "Dock")
    assert places(site)[0].most == 9


def test_a_change_of_a_place_is_saved_at_once_and_undone(site, app, ui):
    site.add_robots()
    deliver, home = site.add_missions("Deliver", "Home")
    before = site.container.catalogue.save_place(Place("Dock 2", 1, (deliver.id,)))
    open_places(ui)
    sheet = open_row(ui, "Dock 2")
    ui.tap(ui.find(Tap, ui.find(Field, root=sheet, kind="pick")))
    tick(ui, "Home")
    ui.wait(lambda: places(site)[0].missions == (deliver.id, home.id))
    undo(ui)
    ui.wait(lambda: places(site) == [before] and sheet.missions == "Deliver")
    enter(ui, sheet.ids.name_field, "Dock 3")
    ui.tap(ui.find(IconButton, sheet, icon="close"))
    ui.wait(lambda: places(site)[0].name == "Dock 3")


def test_a_position_of_several_missions_is_proposed_as_a_place(site, app, ui):
    site.add_robots()
    missions = site.add_missions("Deliver", "Home", "Waste to compactor")
    line, home = Stop("p1", "Line 1"), Stop("p2", "Home")
    stops = dict(zip((mission.guid for mission in missions), ([line], [home], [home, line]), strict=True))
    site.container.db.write(lambda c: StopRepository().keep(c, stops))
    open_places(ui)
    ui.wait(lambda: row_of(ui, "Line 1"))
    ui.tap(ui.find(IconButton, row_of(ui, "Home"), icon="close"))
    ui.wait(lambda: not row_of(ui, "Home"))
    ui.advance(1)  # a row that has just slid takes no touch
    press(ui, "Make it a place", row_of(ui, "Line 1"))
    sheet = ui.find(PlaceSheet)
    assert (sheet.title, sheet.it.name, sheet.it.most) == ("Add place", "Line 1", 1)
    assert sheet.missions == "Deliver, Waste to compactor"
    press(ui, "Save", sheet)
    ui.wait(lambda: [place.name for place in places(site)] == ["Line 1"])
    ui.wait(lambda: not row_of(ui, "Used by several missions"))


def test_a_place_that_will_be_wanted_too_much_says_so_before_it_is_saved(site, app, ui):
    robots_ = site.add_robots()
    mission = site.container.catalogue.save_mission(replace(site.add_missions("Deliver")[0], usual_minutes=50))
    for robot in robots_:
        site.container.catalogue.save_schedule(
            Schedule("", robot.id, mission.id, datetime(2026, 1, 1), "UTC", "FREQ=HOURLY", respect_working_days=False)
        )
    open_places(ui)
    sheet = add_place(ui)
    enter(ui, sheet.ids.name_field, "Dock 2")
    sheet.choose(missions=(mission.id,), name="Dock 2")
    ui.wait(lambda: "Dock 2 is in use" in sheet.warning)
    sheet.choose(most=9)
    ui.wait(lambda: not sheet.warning)
    assert not places(site)


def test_a_robot_s_own_line_is_kept_in_the_app_where_that_is_wanted(site, app, ui):
    site.add_robots()
    go(ui, "robots")
    ui.wait(lambda: titles(ui))
    dialog = open_row(ui, "Aino")
    row = next(row for row in ui.find_all(ListRow, dialog) if row.key == "advanced")
    assert row.item.meta == "Starts at once"
    reveal(ui, row)
    ui.tap(row)
    ui.wait(lambda: ui.find_all(Segment, dialog, text="When it is free"))
    when_free = ui.find(Segment, dialog, text="When it is free")
    reveal(ui, when_free)
    ui.tap(when_free)
    ui.wait(lambda: robots(site)[0].hand_over is HandOver.WHEN_FREE)
    assert robots(site)[1].hand_over is HandOver.AT_ONCE
