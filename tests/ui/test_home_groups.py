"""Home with a group of two simulated robots: Run now on any of them, what waits for a robot, giving it to one by hand."""

from __future__ import annotations

import pytest

from app.domain.execution import State
from app.domain.models import Group
from app.domain.robot import RobotState
from app.screens.home.cards import SendTile, TodayRow
from app.widgets.buttons import ChoiceChip
from app.widgets.choices import ChoiceSheet, OptionRow
from app.widgets.items import Item
from app.widgets.list_row import RowButton, RowIcon
from app.widgets.menu import MenuRow
from app.widgets.sheet import AskSheet
from app.widgets.snackbar import Snackbar
from tests.support.history import last_ended
from tests.support.stored import Stored
from tests.ui.home.operator import choose, items, open_robot, press
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
            ui.wait(lambda: site.is_at_rest(began) and "Ready" in ui.texts())
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
    app.shell.sheets.give_up()
    ui.wait(
        lambda: app.root_vm.view.card.state == "Ready" and not app.root_vm.facts.groups and not app.root_vm.foot_rests
    )
    return app


@pytest.fixture
def hall(home, ui):
    """Both robots in one group."""
    group = home.site.container.catalogue.save_group(
        Group("Hall 1", tuple(robot.id for robot in home.site.container.catalogue.robots()))
    )
    ui.wait(lambda: home.root_vm.facts.groups)
    return group


def run_on_any(ui, mission: str) -> None:
    choose(ui, mission)
    ui.tap(ui.find(ChoiceChip, text="Any of Hall 1"))
    ui.advance(0.7)
    press(ui, "Run on any of Hall 1")


def stop_both(home, ui) -> None:
    """In Pause, so that neither is free."""
    for robot in home.site.fleet.robots:
        robot.control({"emergency_stop": True})
        robot.control({"emergency_stop": False})
    container = home.site.container
    ui.wait(
        lambda: all(
            container.snapshots.get(robot.id).status.state is RobotState.PAUSE for robot in container.catalogue.robots()
        )
    )


def waiting(ui) -> list[Item]:
    return items(ui, "waiting")


def act(ui, action: str) -> None:
    """Press that button of the start that waits for a robot."""
    row = next(row for row in ui.find_all(TodayRow) if row.item.key[0] == "waiting")
    ui.tap(
        next(button for button in (*ui.find_all(RowButton, row), *ui.find_all(RowIcon, row)) if button.name == action)
    )


def test_any_free_robot_of_a_group_comes(home, hall, ui):
    run_on_any(ui, "Home")
    ui.wait(
        lambda: last_ended(home.site.container, 1) or [row for row in home.site.container.history.open() if row.robot]
    )
    row = (home.site.container.history.open() or last_ended(home.site.container, 1))[0]
    assert (row.robot_group, row.priority, row.robot in ("Aino", "Veikko")) == ("Hall 1", 1, True)
    texts = f"Home is sent to {row.robot}. {row.robot}: free now", "Home is not sent yet. "  # on a slow machine
    ui.wait(lambda: [bar for bar in ui.find_all(Snackbar) if bar.text.startswith(texts)])


def test_a_start_that_no_robot_can_take_waits_on_each_of_them_and_one_is_pressed(home, hall, ui):
    stop_both(home, ui)
    run_on_any(ui, "Home")
    ui.wait(lambda: waiting(ui) and "Aino stopped · Veikko stopped" in waiting(ui)[0].support)
    assert waiting(ui)[0].title == "Home · any of Hall 1"
    assert home.site.container.history.open()[0].priority == 1
    open_robot(ui, "Veikko")
    ui.wait(lambda: home.root_vm.view.card.name == "Veikko" and waiting(ui))
    open_robot(ui, "Aino")
    ui.wait(lambda: home.root_vm.view.card.name == "Aino" and waiting(ui))
    ui.advance(1)
    act(ui, "here")
    ui.wait(lambda: not waiting(ui) and "Home" in [item.title for item in items(ui, "execution")])
    (row,) = home.site.container.history.open()
    assert (row.robot, row.robot_group) == ("Aino", "Hall 1")


def test_a_robot_that_refuses_the_values_is_named_in_the_message(home, hall, ui):
    home.site.add_missions("Collect empties")
    ui.wait(lambda: ui.find_all(SendTile, text="Collect empties"))
    stop_both(home, ui)
    run_on_any(ui, "Collect empties")
    ui.wait(lambda: waiting(ui) and home.shell.snackbars.texts and home.shell.background.idle)
    home.shell.snackbars.clear()
    api(home.site.fleet.robots[0], "DELETE", f"/missions/{GUIDS['Collect empties']}")  # since its list was read
    ui.advance(1)
    act(ui, "here")
    ui.wait(lambda: home.shell.snackbars.texts)
    (message,) = home.shell.snackbars.texts
    assert message.startswith("Collect empties is not sent yet. Aino refused it: There is no such mission: ")


def pick(ui, word: str) -> None:
    ui.wait(lambda: ui.find_all(ChoiceSheet))
    ui.advance(0.3)
    ui.tap(ui.find(OptionRow, title=word))


def test_undoing_the_cancellation_of_a_waiting_start_makes_it_wait_again(home, hall, ui):
    stop_both(home, ui)
    run_on_any(ui, "Deliver")
    ui.wait(lambda: waiting(ui) and home.shell.background.idle)
    (row,) = home.site.container.history.open()
    ui.advance(1)
    act(ui, "cancel")
    ui.wait(lambda: "Deliver is cancelled" in ui.texts() and not waiting(ui))
    ui.tap_text("Undo")
    ui.wait(lambda: waiting(ui) and "Deliver waits again" in home.shell.snackbars.texts)
    (again,) = home.site.container.history.open()
    assert (again.id, again.token) == (row.id, row.token)


def test_a_waiting_start_offers_the_same_on_the_timeline_as_on_home(home, hall, ui):
    stop_both(home, ui)
    run_on_any(ui, "Deliver")
    ui.wait(lambda: waiting(ui))
    (row,) = home.site.container.history.open()
    home.shell.go("scheduler")
    vm = home.shell.navigator.screen("scheduler").vm

    def use(word: str) -> None:
        ui.wait(lambda: home.shell.background.idle and any(one.id == row.id for one in vm._facts.past))
        vm.open_bar(("execution", row.id), home.root)
        ui.wait(lambda: ui.find_all(MenuRow, text=word))
        ui.advance(0.3)
        ui.tap(ui.find(MenuRow, text=word))

    use("Priority: High")
    pick(ui, "Low")
    ui.wait(lambda: home.site.container.history.get(row.id).priority == -1)
    for word, held, said in (
        ("Hold", True, "Deliver is on hold"),
        ("Release", False, "Deliver is no longer on hold"),
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
    ui.wait(lambda: waiting(ui))
    (row,) = home.site.container.history.open()
    home.shell.go("scheduler")
    vm = home.shell.navigator.screen("scheduler").vm
    ui.wait(lambda: home.shell.background.idle and any(one.id == row.id for one in vm._facts.past))
    vm.open_bar(("execution", row.id), home.root)
    ui.wait(lambda: ui.find_all(MenuRow, text="Cancel"))
    for robot in home.site.fleet.robots:
        api(robot, "PUT", "/status", state_id=3)
    ui.wait(lambda: any((one.id, one.state) == (row.id, State.EXECUTING) for one in vm._facts.past))
    ui.tap(ui.find(MenuRow, text="Cancel"))
    ui.wait(lambda: "Cancel Deliver?" in ui.texts())
    press(ui, "Keep")
    assert home.site.container.history.get(row.id).cancel_code is None


def test_a_waiting_start_is_cancelled(home, hall, ui):
    stop_both(home, ui)
    run_on_any(ui, "Deliver")
    ui.wait(lambda: waiting(ui))
    ui.advance(1)
    act(ui, "cancel")
    ui.wait(lambda: not waiting(ui))
    assert last_ended(home.site.container, 1)[0].state is State.CANCELLED


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
            ).status.state
            is RobotState.PAUSE
        )
    )
    run_on_any(ui, "Home")
    ui.wait(lambda: [row for row in container.history.open() if row.state is State.SUBMITTING and row.robot == "Aino"])
    ui.wait(lambda: not aino.model.faults.full())  # being sent
    aino.control({"fault": {"kind": "drop_request", "path": "*", "count": None}})
    open_robot(ui, "Veikko")
    ui.wait(lambda: waiting(ui) and waiting(ui)[0].support.startswith("Aino may have it, "))
    veikko.model.resume()
    ui.advance(1)
    act(ui, "here")
    ui.wait(lambda: ui.find_all(AskSheet))
    assert ui.find(AskSheet).title == "Start Home on Veikko?"
    assert ui.find(AskSheet).text == "If Aino already has it, it runs twice."
    assert len(container.history.open()) == 1
    press(ui, "Start it", ui.find(AskSheet))
    ui.wait(lambda: [row for row in (*container.history.open(), *last_ended(container, 5)) if row.robot == "Veikko"])
