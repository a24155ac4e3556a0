"""Home with a group of two simulated robots: Run now on any of them, what waits for a robot, giving it to one by hand."""

from __future__ import annotations

import pytest

from app.domain.models import Group, Mission, State
from app.screens.home.cards import RobotHead, RunNowCard
from app.screens.home.waiting_model import WaitingCard, WaitingDialog, WaitingRow
from app.widgets.buttons import ChoiceChip, CommandButton
from app.widgets.dialogs import ChoiceDialog, ConfirmDialog, MenuRow
from app.widgets.fields import PickField
from app.widgets.rows import OptionRow, QueueRow
from app.widgets.snackbar import Snackbar
from tests.support.stored import Stored
from tests.ui.whole_app import GUIDS, api, plant, restart, shown


@pytest.fixture(scope="module")
def ui(shared_ui):
    return shared_ui


@pytest.fixture(scope="module")
def app(tmp_path_factory, ui):
    """Two robots and two missions, no group yet."""
    with plant(tmp_path_factory.mktemp("plant"), robots=2) as site:
        site.add_robots()
        site.add_missions("Deliver", "Home")
        with shown(site.container, ui) as app:
            app.site, began = site, site.container.clock.now()
            ui.wait(
                lambda: site.is_at_rest(began) and any("Ready" in ui.texts(head) for head in ui.find_all(RobotHead))
            )
            app.stored, app.root_vm = Stored(site.container), app.shell.navigator.screen("home").vm
            yield app


@pytest.fixture
def home(app, ui):
    """At robots at rest, without a group."""

    def put_back() -> None:
        app.site.calm_down(ui)
        app.stored.put_back()
        for group in app.site.container.catalogue.groups():
            app.site.container.catalogue.remove_group(group.id)

    restart(app, ui, put_back)
    app.root_vm.choose_mission(None)
    app.root_vm.choose_target(("robot", 0))
    app.root_vm.go_first(False)
    ui.wait(lambda: "Ready" in ui.texts(ui.find(RobotHead)) and not ui.find_all(ChoiceChip, text="Any of Hall 1"))
    return app


@pytest.fixture
def hall(home, ui):
    """Both robots in one group."""
    group = home.site.container.catalogue.save_group(
        Group("Hall 1", tuple(robot.id for robot in home.site.container.catalogue.robots()))
    )
    ui.wait(lambda: ui.find_all(ChoiceChip, text="Any of Hall 1"))
    return group


def press(ui, word: str, root=None) -> None:
    ui.tap(ui.find(CommandButton, root, text=word))


def choose(ui, word: str) -> None:
    ui.tap(ui.find(ChoiceChip, text=word))


def run_on_any(ui, mission: str) -> None:
    choose(ui, "Any of Hall 1")
    choose(ui, mission)
    press(ui, "Run on any of Hall 1")


def stop_both(home, ui) -> None:
    """In Pause, so that neither is free."""
    for robot in home.site.fleet.robots:
        robot.control({"emergency_stop": True})
        robot.control({"emergency_stop": False})
    container = home.site.container
    ui.wait(
        lambda: all(container.snapshots.get(robot.id).status.state_id == 4 for robot in container.catalogue.robots())
    )


def waiting(ui) -> list[tuple[str, str]]:
    return [(row.mission, row.priority) for row in ui.find_all(WaitingRow, ui.find(WaitingCard))]


def test_without_a_group_there_is_nothing_of_groups(home, ui):
    card = ui.find(RunNowCard)
    assert [chip.text for chip in ui.find_all(ChoiceChip, card)] == ["Deliver", "Home"]
    assert not ui.find_all(WaitingCard)
    assert "Run on Aino" not in ui.texts(card)  # no mission is chosen
    choose(ui, "Home")
    assert ui.find(CommandButton, card, text="Run on Aino")


def test_run_now_offers_groups_first_and_any_free_robot_comes(home, hall, ui):
    card = ui.find(RunNowCard)
    chips = sorted(ui.find_all(ChoiceChip, card), key=lambda chip: (-round(chip.y), chip.x))
    assert [chip.text for chip in chips][:2] == ["Any of Hall 1", "Aino"]
    assert ui.find(ChoiceChip, card, text="Aino").active  # as today, until a group is chosen
    run_on_any(ui, "Home")
    ui.wait(
        lambda: (
            home.site.container.history.last_finished(1)
            or [row for row in home.site.container.history.open() if row.robot]
        )
    )
    row = (home.site.container.history.open() or home.site.container.history.last_finished(1))[0]
    assert (row.robot_group, row.priority, row.robot in ("Aino", "Veikko")) == ("Hall 1", 1, True)
    texts = f"Home is sent to {row.robot}. {row.robot}: free now", "Home is not sent yet. "  # on a slow machine
    ui.wait(lambda: [bar for bar in ui.find_all(Snackbar) if bar.text.startswith(texts)])


def test_many_groups_show_the_chosen_one_and_a_list_of_all(home, hall, ui):
    members = hall.members
    for name in ("Hall 2", "Night crew"):
        home.site.container.catalogue.save_group(Group(name, members))
    ui.wait(lambda: ui.find_all(ChoiceChip, text="Groups (3)"))
    card = ui.find(RunNowCard)
    chips = [chip.text for chip in sorted(ui.find_all(ChoiceChip, card), key=lambda chip: (-chip.y, chip.x))]
    assert chips[:2] == ["Groups (3)", "Aino"]
    ui.tap(ui.find(ChoiceChip, card, text="Groups (3)"))
    ui.wait(lambda: ui.find_all(ChoiceDialog))
    ui.advance(0.3)
    assert ui.find(OptionRow, text="Any of Night crew").note == "Aino, Veikko"
    ui.tap(ui.find(OptionRow, text="Any of Night crew"))
    ui.wait(lambda: ui.find_all(ChoiceChip, card, text="Any of Night crew", active=True))
    assert not ui.find_all(ChoiceChip, card, text="Any of Hall 1")
    choose(ui, "Home")
    ui.wait(lambda: ui.find_all(CommandButton, card, text="Run on any of Night crew"))


def test_a_start_that_no_robot_can_take_waits_above_the_queue_and_is_assigned_by_hand(home, hall, ui):
    stop_both(home, ui)
    choose(ui, "Any of Hall 1")
    choose(ui, "Before everything else")
    choose(ui, "Home")
    press(ui, "Run on any of Hall 1")
    ui.wait(lambda: ui.find_all(WaitingCard))
    card = ui.find(WaitingCard)
    assert "Waiting for a robot (1)" in ui.texts(card)
    assert waiting(ui) == [("Home", "Critical")]
    ui.wait(lambda: "Aino stopped; Veikko stopped" in ui.find(WaitingRow).note)
    assert "Not run if none can by " in ui.find(WaitingRow).note
    press(ui, "Give to a robot", ui.find(WaitingRow))
    ui.wait(lambda: ui.find_all(ChoiceDialog))
    ui.advance(0.3)
    assert [row.text for row in sorted(ui.find_all(OptionRow), key=lambda row: -row.y)] == ["Aino", "Veikko"]
    ui.tap(ui.find(OptionRow, text="Aino"))
    ui.wait(lambda: not ui.find_all(WaitingCard))
    ui.wait(
        lambda: [item for item in ui.find_all(QueueRow, mission="Home") if "Aino: chosen by a person" in item.origin]
    )
    (row,) = home.site.container.history.open()
    assert (row.robot, row.robot_group) == ("Aino", "Hall 1")


def test_a_robot_that_refuses_the_values_is_named_in_the_message_and_on_the_card(home, hall, ui):
    home.site.add_missions("Collect empties")
    ui.wait(lambda: ui.find_all(ChoiceChip, text="Collect empties"))
    stop_both(home, ui)
    run_on_any(ui, "Collect empties")
    ui.wait(lambda: ui.find_all(WaitingRow) and home.shell.snackbars.texts and home.shell.background.idle)
    home.shell.snackbars.clear()
    api(home.site.fleet.robots[1], "DELETE", f"/missions/{GUIDS['Collect empties']}")  # since its list was read
    press(ui, "Give to a robot", ui.find(WaitingRow))
    ui.wait(lambda: ui.find_all(ChoiceDialog))
    ui.advance(0.3)
    ui.tap(ui.find(OptionRow, text="Veikko"))
    ui.wait(lambda: home.shell.snackbars.texts)
    (message,) = home.shell.snackbars.texts
    assert message.startswith("Collect empties is not sent yet. Veikko refused it: The robot has no such mission: ")
    ui.wait(
        lambda: (
            ui.find_all(WaitingRow)
            and ui.find(WaitingRow).note.startswith("Veikko refused it: The robot has no such mission")
        )
    )


def pick(ui, word: str) -> None:
    ui.wait(lambda: ui.find_all(ChoiceDialog))
    ui.advance(0.3)
    ui.tap(ui.find(OptionRow, text=word))


def test_the_priority_of_what_waits_is_changed_by_a_tap_on_it(home, hall, ui):
    stop_both(home, ui)
    run_on_any(ui, "Deliver")
    ui.wait(lambda: ui.find_all(WaitingRow) and home.shell.snackbars.texts)  # what is said of its start is said
    ui.tap(ui.find(ChoiceChip, ui.find(WaitingRow), text="High"))
    pick(ui, "Critical")
    ui.wait(
        lambda: (
            ui.find(WaitingRow).priority == "Critical" and "Deliver: priority Critical" in home.shell.snackbars.texts
        )
    )
    assert home.site.container.history.open()[0].priority == 2


def test_undoing_the_cancellation_of_a_waiting_start_makes_it_wait_again(home, hall, ui):
    stop_both(home, ui)
    run_on_any(ui, "Deliver")
    ui.wait(lambda: ui.find_all(WaitingRow) and home.shell.background.idle)
    (row,) = home.site.container.history.open()
    press(ui, "Cancel", ui.find(WaitingRow))
    ui.wait(lambda: "Deliver is cancelled" in ui.texts() and not ui.find_all(WaitingRow))
    ui.tap_text("Undo")
    ui.wait(lambda: ui.find_all(WaitingRow) and "Deliver waits again" in home.shell.snackbars.texts)
    (again,) = home.site.container.history.open()
    assert (again.id, again.token) == (row.id, row.token)


def test_a_waiting_start_offers_the_same_on_the_timeline_as_on_home(home, hall, ui):
    stop_both(home, ui)
    run_on_any(ui, "Deliver")
    ui.wait(lambda: ui.find_all(WaitingRow))
    (row,) = home.site.container.history.open()
    home.shell.go("scheduler")
    vm = home.shell.navigator.screen("scheduler").vm

    def use(word: str) -> None:
        ui.wait(lambda: home.shell.background.idle and any(one.id == row.id for one in vm._facts.past))
        vm.open_bars([("execution", row.id)], home.root)
        ui.wait(lambda: ui.find_all(MenuRow, text=word))
        ui.advance(0.3)
        ui.tap(ui.find(MenuRow, text=word))

    use("Priority: High")
    pick(ui, "Low")
    ui.wait(lambda: home.site.container.history.get(row.id).priority == -1)
    for word, held, said in (
        ("Hold", True, "Deliver is held; it is skipped unless it is released in time"),
        ("Release", False, "Deliver is released"),
    ):
        use(word)
        ui.wait(lambda held=held: home.site.container.history.get(row.id).held is held)
        ui.wait(lambda said=said: said in home.shell.snackbars.texts)
    use("Cancel")
    ui.wait(
        lambda: (
            home.site.container.history.get(row.id).state is State.CANCELLED and "Deliver is cancelled" in ui.texts()
        )
    )
    ui.tap_text("Undo")
    ui.wait(lambda: home.site.container.history.get(row.id).state is State.WAITING)
    ui.wait(lambda: "Deliver waits again" in home.shell.snackbars.texts)
    use("Give to a robot")
    pick(ui, "Veikko")
    ui.wait(lambda: home.site.container.history.get(row.id).robot == "Veikko")


def test_cancel_on_the_card_of_a_start_that_runs_asks_first(home, hall, ui):
    stop_both(home, ui)
    run_on_any(ui, "Deliver")
    ui.wait(lambda: ui.find_all(WaitingRow))
    (row,) = home.site.container.history.open()
    home.shell.go("scheduler")
    vm = home.shell.navigator.screen("scheduler").vm
    ui.wait(lambda: home.shell.background.idle and any(one.id == row.id for one in vm._facts.past))
    vm.open_bars([("execution", row.id)], home.root)
    ui.wait(lambda: ui.find_all(MenuRow, text="Cancel"))
    for robot in home.site.fleet.robots:
        api(robot, "PUT", "/status", state_id=3)
    ui.wait(lambda: any((one.id, one.state) == (row.id, State.EXECUTING) for one in vm._facts.past))
    ui.tap(ui.find(MenuRow, text="Cancel"))
    ui.wait(lambda: "Stop Deliver?" in ui.texts())
    press(ui, "Let it run")
    assert home.site.container.history.get(row.id).cancel_code is None


def test_the_missions_to_run_on_a_group_say_which_robot_lacks_them(home, hall, ui):
    veikko = hall.members[1]
    home.site.container.catalogue.save_mission(
        Mission("Deliver", "00000000-0000-0000-0000-000000000000", robot_id=veikko)
    )
    choose(ui, "Any of Hall 1")
    ui.wait(lambda: home.shell.background.idle)
    ui.tap(ui.find(PickField, ui.find(RunNowCard)))
    ui.wait(lambda: ui.find_all(ChoiceDialog))
    ui.advance(0.3)
    *rows, fetch = sorted(ui.find_all(OptionRow), key=lambda row: -row.to_window(0, row.y)[1])
    assert {row.text: row.note for row in rows} == {"Deliver": "not on Veikko", "Home": ""}
    assert fetch.text == "Not in the list? Fetch it from a robot"


def test_a_waiting_start_is_cancelled(home, hall, ui):
    stop_both(home, ui)
    run_on_any(ui, "Deliver")
    ui.wait(lambda: ui.find_all(WaitingRow))
    press(ui, "Cancel", ui.find(WaitingRow))
    ui.wait(lambda: not ui.find_all(WaitingCard))
    assert home.site.container.history.last_finished(1)[0].state is State.CANCELLED


def test_many_waiting_starts_show_the_first_on_home_and_all_in_a_dialog(home, hall, ui):
    stop_both(home, ui)
    mission = home.site.container.catalogue.missions()[0]
    for _n in range(5):
        home.site.container.operator.run_on_any(hall.id, mission.id)
    ui.wait(lambda: ui.find_all(WaitingCard) and "Waiting for a robot (5)" in ui.texts(ui.find(WaitingCard)))
    assert len(waiting(ui)) == 2
    ui.find(WaitingCard).state.show_all()
    ui.wait(lambda: ui.find_all(WaitingDialog))
    assert len(ui.find(WaitingDialog).state.all_rows) == 5


def test_a_start_that_a_silent_robot_may_have_is_run_on_another_by_a_person_only(home, hall, ui):
    """Aino does not answer in time, then falls silent; no other robot gets it until a person has agreed that it may run twice."""
    aino, veikko = home.site.fleet.robots
    veikko.control({"emergency_stop": True})
    veikko.control({"emergency_stop": False})
    aino.control({"fault": {"kind": "delay", "method": "POST", "path": "/mission_queue", "seconds": 30}})
    container = home.site.container
    ui.wait(
        lambda: (
            next(
                container.snapshots.get(robot.id) for robot in container.catalogue.robots() if robot.name == "Veikko"
            ).status.state_id
            == 4
        )
    )
    run_on_any(ui, "Home")
    ui.wait(lambda: [row for row in container.history.open() if row.state is State.SUBMITTING and row.robot == "Aino"])
    ui.wait(lambda: not aino.model.faults.full())  # being sent
    aino.control({"fault": {"kind": "drop_request", "path": "*", "count": None}})
    ui.wait(
        lambda: [row for row in ui.find_all(WaitingRow) if row.note.startswith("Aino may have it, no answer since ")]
    )
    veikko.model.resume()
    ui.advance(1)
    press(ui, "Start elsewhere", ui.find(WaitingRow))
    ui.wait(lambda: ui.find_all(ChoiceDialog))
    ui.advance(0.3)
    ui.tap(ui.find(OptionRow, text="Veikko"))
    ui.wait(lambda: ui.find_all(ConfirmDialog))
    assert ui.find(ConfirmDialog).title == "Start Home on Veikko?"
    assert ui.find(ConfirmDialog).text == "If Aino already has it, it runs twice."
    assert len(container.history.open()) == 1
    press(ui, "Start it", ui.find(ConfirmDialog))
    ui.wait(
        lambda: [
            row for row in (*container.history.open(), *container.history.last_finished(5)) if row.robot == "Veikko"
        ]
    )
