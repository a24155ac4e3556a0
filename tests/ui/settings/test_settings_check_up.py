"""The check-up of a robot in Settings, as an integrator uses it: over HTTP against simulated robots, with a virtual clock."""

from __future__ import annotations

import gc
import json
import threading
import time
import weakref
from collections.abc import Iterator
from dataclasses import replace
from datetime import UTC, datetime, timedelta

import pytest

from app.domain.models import Schedule
from app.screens.settings.check_up import CheckUpSheet, standing_of
from app.screens.settings.robot_sheet import RobotSheet
from app.screens.settings.view import NoticeView
from app.services.files.places import Place, PlaceKind
from app.widgets.buttons import CommandButton, IconButton
from app.widgets.choices import ChoiceSheet, OptionRow
from app.widgets.fields import Field
from app.widgets.list_row import ListRow
from app.widgets.surfaces import Tap
from app.window.key_focus import ENTER, ESCAPE, TAB
from mir_sim import deviant
from mir_sim.profile import FAITHFUL, profile_of
from tests.support.clock import VirtualClock
from tests.ui.integrator import choose, go, open_row, page, press, robots, says, titles
from tests.ui.whole_app import GUIDS


class Hurried(VirtualClock):
    """The time of this machine when it is first asked, then ``hurry`` times as fast in pauses; reading robots takes next to none."""

    hurry = 100.0

    def __init__(self) -> None:
        super().__init__()
        self._is_set = False

    def now(self) -> datetime:
        if not self._is_set:
            self._now, self._is_set = datetime.now(UTC), True
        return super().now()

    def sleep(self, seconds: float) -> None:
        self.advance(seconds)
        time.sleep(seconds / self.hurry)


@pytest.fixture(scope="module")
def first_settings():
    return {"timezone": "Europe/Copenhagen"}  # that of the robots


@pytest.fixture
def clock(site, monkeypatch) -> Hurried:
    """The clock of the check-ups."""
    clock = Hurried()
    monkeypatch.setattr(site.container.check_ups, "_clock", clock)
    return clock


@pytest.fixture
def aino(site, app, ui, clock):
    """The first of the fleet, on its panel."""
    site.add_robots()
    go(ui, "robots")
    ui.wait(lambda: len(titles(ui)) == 2 and all(robot.software for robot in robots(site)))
    yield site.fleet.robots[0]
    site.fleet.robots[0].model.profile = FAITHFUL


def stands(app) -> NoticeView:
    """How the check-up of Aino stands."""
    return standing_of(page(app).context, page(app).context.facts.robots[0])


def opened(ui) -> CheckUpSheet:
    sheet = ui.find(RobotSheet) if ui.find_all(RobotSheet) else open_row(ui, "Aino")
    choose(ui, "Check up", sheet)
    ui.wait(lambda: ui.find_all(CheckUpSheet))
    ui.advance(0.5)
    return ui.find(CheckUpSheet)


def close(ui, dialog: CheckUpSheet) -> None:
    ui.tap(ui.find(IconButton, dialog, icon="close"))
    ui.wait(lambda: not ui.find_all(CheckUpSheet))


def begin(ui, dialog: CheckUpSheet) -> None:
    ui.wait(lambda: dialog.vm.can_begin)
    press(ui, dialog.vm.foot, dialog)


def until_reported(ui, dialog: CheckUpSheet) -> dict[str, str]:
    """The findings that are not in order: their sentences by topic."""
    ui.wait(lambda: dialog.vm.part == "CheckUpReport")
    ui.advance(0.2)
    assert says(ui, dialog.vm.verdict.text), "the sheet was open until the end"
    return {row.support: row.title for row in dialog.vm.found if row.tone != "neutral"}


def try_with_a_mission(ui, dialog: CheckUpSheet) -> None:
    press(ui, "Run trial", dialog)
    ui.wait(lambda: dialog.vm.will_do)


def state_of(robot) -> tuple[list[str], int, bool]:
    """The missions of the simulated robot, how many items its queue ever had, and whether it is paused."""
    model = robot.model
    with model.lock:
        return sorted(row["guid"] for row in model.site.table("/missions")), len(model.queue), model.paused


# ---------------------------------------------------------------------- reading
def test_from_the_panel_to_the_report_and_nothing_is_written_to_the_robot(site, app, ui, aino):
    assert stands(app).text == "Never checked up"
    before = state_of(aino)
    dialog = opened(ui)
    assert dialog.vm.begins == "Reads only: takes about 1 min 35 s, nothing moves"
    assert dialog.vm.will_do == ""
    begin(ui, dialog)
    found = until_reported(ui, dialog)
    few = "Not found out: too few missions are in its queue"
    assert found == {
        "Encryption": "It is asked over http: anyone on the network can read the password",
        "Password": "User Distributor has the default password that MiR's manuals print",
        "Lists": few,
        "Order of lists": few,
        "Searching": few,
    }
    assert dialog.vm.verdict.text == "5 notes"
    assert "Only read: no mission was queued" in dialog.vm.verdict.note
    clock = next(row for row in dialog.vm.found if row.support == "Clock")
    assert (clock.tone, clock.icon) == ("neutral", "check")
    row = ui.find_all(ListRow, dialog)[0]
    ui.tap(row)
    assert dialog.vm.found[0].note
    close(ui, dialog)
    ui.wait(lambda: stands(app).text == "Checked up today: 5 notes")
    assert stands(app).tone == "action"
    assert state_of(aino) == before


def test_the_last_report_is_shown_again_and_a_new_one_can_be_made(site, app, ui, aino):
    dialog = opened(ui)
    begin(ui, dialog)
    until_reported(ui, dialog)
    close(ui, dialog)
    dialog = opened(ui)
    assert until_reported(ui, dialog)
    press(ui, "Check again", dialog)
    assert (dialog.vm.part, dialog.vm.wants_trial) == ("CheckUpRunning", False)
    assert until_reported(ui, dialog)
    press(ui, "Run trial", dialog)
    assert (dialog.vm.part, dialog.vm.wants_trial) == ("CheckUpBefore", True)


def test_a_robot_that_does_not_answer_is_reported_and_stays_unchecked(site, app, ui, aino):
    aino.control({"fault": {"kind": "drop_request", "path": "*", "count": None}})
    dialog = opened(ui)
    begin(ui, dialog)
    found = until_reported(ui, dialog)
    assert list(found) == ["Who it is"]
    assert found["Who it is"].startswith("It could not be asked")
    assert "no answer to the end" in dialog.vm.verdict.note
    assert (dialog.foot, dialog.second) == ("Check again", "")
    close(ui, dialog)
    ui.wait(lambda: app.shell.background.idle)
    assert stands(app).text == "Never checked up"


def test_after_a_change_of_the_software_the_panel_asks_for_another(site, app, ui, aino):
    dialog = opened(ui)
    begin(ui, dialog)
    until_reported(ui, dialog)
    close(ui, dialog)
    repository = site.container.repositories.robots
    robot = robots(site)[0]
    site.container.db.write(lambda c: repository.update(c, replace(robot, software="9.9")))
    page(app).context.refresh()
    ui.wait(lambda: stands(app).text == "Software is 9.9 now: check it up again")


# ---------------------------------------------------------------------- while it runs
class Waiting(Hurried):
    """Stops at the next pause until released; its time is that of the robots."""

    def __init__(self) -> None:
        super().__init__()
        self.go_on = threading.Event()

    def sleep(self, seconds: float) -> None:
        began = time.monotonic()
        self.go_on.wait(30)
        self.advance(time.monotonic() - began)
        super().sleep(seconds)


@pytest.fixture
def waiting(site, aino, monkeypatch) -> Iterator[Waiting]:
    clock = Waiting()
    monkeypatch.setattr(site.container.check_ups, "_clock", clock)
    yield clock
    clock.go_on.set()


def test_stop_ends_it_and_says_that_it_is_not_complete(site, app, ui, waiting):
    dialog = opened(ui)
    begin(ui, dialog)
    ui.wait(lambda: dialog.vm.part == "CheckUpRunning" and dialog.vm.doing == "Asking who it is")
    press(ui, "Stop", dialog)
    assert dialog.vm.stopping
    waiting.go_on.set()
    until_reported(ui, dialog)
    assert "It was stopped" in dialog.vm.verdict.note
    close(ui, dialog)
    assert stands(app).text == "Never checked up"


def test_it_says_within_seconds_that_it_waits_for_the_robot(site, app, ui, waiting):
    dialog = opened(ui)
    begin(ui, dialog)
    ui.wait(lambda: dialog.vm.doing == "Asking who it is")
    ui.advance(7)
    assert says(ui, "s for Aino. Without an answer it continues after a minute.")
    waiting.go_on.set()
    until_reported(ui, dialog)


def test_it_continues_while_its_dialog_is_closed_and_reports_its_end(site, app, ui, waiting):
    dialog = opened(ui)
    begin(ui, dialog)
    ui.wait(lambda: dialog.vm.doing == "Asking who it is")
    ui.key(ESCAPE)
    ui.wait(lambda: not ui.find_all(CheckUpSheet))
    ui.wait(lambda: stands(app).text.startswith("Is being checked up: 0 s of about"))
    closed = weakref.ref(dialog)
    del dialog

    def is_collected() -> bool:
        gc.unfreeze()
        gc.collect()
        return closed() is None

    ui.wait(is_collected)
    dialog = opened(ui)
    assert dialog.vm.part == "CheckUpRunning"
    ui.key(ESCAPE)
    waiting.go_on.set()
    ui.wait(lambda: says(ui, "Aino is checked up: 5 notes"))
    ui.wait(lambda: stands(app).text == "Checked up today: 5 notes")


def test_what_one_has_found_that_ended_early_unseen_is_shown_when_it_is_opened_again(site, app, ui, waiting):
    dialog = opened(ui)
    begin(ui, dialog)
    ui.wait(lambda: dialog.vm.doing == "Asking who it is")
    app.shell.go("home")
    dialog.vm.stop()
    waiting.go_on.set()
    ui.wait(lambda: any(text.startswith("The check-up of Aino ended early") for text in ui.texts()))
    go(ui, "robots")
    ui.wait(lambda: titles(ui))
    for _time in range(2):
        dialog = opened(ui)
        assert "It was stopped" in dialog.vm.verdict.note
        close(ui, dialog)


def test_it_can_be_stopped_when_the_screens_were_built_again(site, app, ui, waiting):
    close(ui, begun := opened(ui))
    begun.vm.begin()
    before = page(app)
    site.container.catalogue.change_settings(gloves=True)
    ui.wait(lambda: page(app) is not before and page(app).context.facts.settings.gloves)
    go(ui, "robots")
    ui.wait(lambda: titles(ui))
    assert stands(app).text.startswith("Is being checked up")
    dialog = opened(ui)
    press(ui, "Stop", dialog)
    waiting.go_on.set()
    until_reported(ui, dialog)
    assert "It was stopped" in dialog.vm.verdict.note


def test_the_end_of_the_app_ends_it(site, app, ui, waiting):
    dialog = opened(ui)
    begin(ui, dialog)
    ui.wait(lambda: dialog.vm.doing == "Asking who it is")
    dialog.vm._job.cancel()  # as the window does with all that is under way when it closes
    waiting.go_on.set()
    robot = robots(site)[0]
    ui.wait(lambda: app.shell.background.idle and not site.container.check_ups._under_way)
    assert site.container.check_ups.report(robot.id) is None


# ---------------------------------------------------------------------- trying it
def test_a_trial_names_what_moves_and_restores_the_robot(site, app, ui, aino, clock):
    clock.hurry = 12
    aino.model.profile = deviant("no-id")
    missions, queued, _paused = state_of(aino)
    dialog = opened(ui)
    try_with_a_mission(ui, dialog)
    assert "Aino gets a mission that waits a second, four times" in dialog.vm.will_do
    assert ui.find_all(CommandButton, dialog, text="Queue 4 missions on Aino")
    begin(ui, dialog)
    ui.wait(lambda: dialog.vm.part == "CheckUpRunning")
    assert says(ui, "Aino gets a mission that waits a second")  # what was agreed to stays in sight
    found = until_reported(ui, dialog)
    assert found["Taking a mission"] == "It takes a mission, but does not return its number"
    assert "Tried with the mission AMR Scheduler check-up" in dialog.vm.verdict.note
    assert state_of(aino) == (missions, queued + 4, False)
    assert site.container.holds.current() == []


def test_one_of_the_robots_own_missions_may_be_chosen(site, app, ui, aino):
    dialog = opened(ui)
    try_with_a_mission(ui, dialog)
    ui.tap(ui.find(Tap, ui.find(Field, root=dialog)))
    ui.wait(lambda: ui.find_all(ChoiceSheet))
    assert ui.find(ChoiceSheet).options[0].text == "One that waits a second, made and removed again"
    ui.find(ChoiceSheet).query = "Wait"
    ui.advance(0.2)
    name = ui.find(ChoiceSheet).shown[-1].text
    ui.tap(ui.find(OptionRow, title=name))
    ui.wait(lambda: dialog.vm.will_do.startswith(f"{name} is queued four times on Aino"))
    assert dialog.vm.mission_word == name


def test_no_mission_is_chosen_after_the_check_up_dialog_is_closed(site, app, ui, aino):
    dialog = opened(ui)
    try_with_a_mission(ui, dialog)
    aino.control({"fault": {"kind": "late", "count": None, "seconds": 1.0}})
    ui.tap(ui.find(Tap, ui.find(Field, root=dialog)))
    assert dialog.vm.asking_missions
    ui.key(ESCAPE)
    ui.wait(lambda: not dialog.vm.asking_missions)
    aino.control({"fault": None})
    assert ui.find_all(ChoiceSheet) == []


def test_a_soon_planned_start_goes_first_and_is_named(site, app, ui, aino):
    (mission,) = site.add_missions(next(iter(GUIDS)))
    at = (site.container.clock.now() + timedelta(minutes=3)).replace(second=0, microsecond=0)
    site.container.catalogue.save_schedule(
        Schedule(
            "Night count", robots(site)[0].id, mission.id, at.replace(tzinfo=None), "UTC", respect_working_days=False
        )
    )
    before = state_of(aino)
    dialog = opened(ui)
    try_with_a_mission(ui, dialog)
    begin(ui, dialog)
    ui.wait(lambda: dialog.vm.outcome.text.startswith("Night count is planned at"))
    assert (dialog.vm.part, dialog.vm.outcome.tone, dialog.vm.wants_trial) == ("CheckUpBefore", "attention", True)
    assert state_of(aino) == before


# ---------------------------------------------------------------------- what is left behind
def test_the_report_and_the_file_lie_where_people_look_and_have_no_password(site, app, ui, aino):
    dialog = opened(ui)
    begin(ui, dialog)
    until_reported(ui, dialog)
    for word, ending in (("Save report to print", ".html"), ("Save file for support", ".json")):
        choose(ui, word, dialog)
        ui.wait(lambda ending=ending: dialog.vm.outcome.note.endswith(ending))
        assert dialog.vm.outcome.text == "Written, without passwords"
    (html,) = site.documents.glob("amr-scheduler-check-up-aino-*.html")
    (file,) = site.documents.glob("amr-scheduler-check-up-aino-*.json")
    assert "Check-up of Aino" in html.read_text("utf-8")
    assert profile_of(json.loads(file.read_text("utf-8"))).software == robots(site)[0].software
    for text in (html.read_text("utf-8"), file.read_text("utf-8")):
        assert robots(site)[0].token.split()[-1] not in text


def test_the_report_goes_to_the_stick_that_is_chosen(site, app, ui, aino, tmp_path, monkeypatch):
    monkeypatch.setattr("app.services.files.exports.mounted", lambda: iter([Place(PlaceKind.USB, tmp_path, "STICK")]))
    dialog = opened(ui)
    begin(ui, dialog)
    until_reported(ui, dialog)
    choose(ui, "Save report to print", dialog)
    ui.wait(lambda: ui.find_all(ChoiceSheet))
    ui.tap(ui.find(OptionRow, ui.find(ChoiceSheet), title="USB: STICK"))
    ui.wait(lambda: dialog.vm.outcome.note)
    assert [path.suffix for path in tmp_path.glob("amr-scheduler-check-up-aino-*")] == [".html"]


def test_keys_alone_check_a_robot_up(site, app, ui, aino):
    dialog = opened(ui)
    for _press in range(30):  # also through the list of sections, which stays beside the sheet
        ui.key(TAB)
        if getattr(app._keys.target, "text", "") == dialog.vm.foot:
            break
    ui.key(ENTER)
    assert until_reported(ui, dialog)
    ui.key(ESCAPE)
    ui.wait(lambda: not ui.find_all(CheckUpSheet))
