"""Home in every state, and what is shown over it: banner, alarms, late starts, the damaged database."""

from __future__ import annotations

import sqlite3
from collections.abc import Mapping
from dataclasses import replace
from datetime import timedelta
from pathlib import Path
from types import SimpleNamespace
from typing import Any

from app.database.errors import SENTENCES, DatabaseDamaged, DatabaseUnavailable
from app.database.robots import Hold
from app.domain import rules
from app.domain.clock import zone_names
from app.domain.execution import DurationEstimate, State, Wait
from app.domain.message import message, render
from app.domain.models import Alarm, Priority, Robot, RobotSnapshot, Settings
from app.domain.reasons import to_store
from app.domain.robot import MissionParameter, RobotState
from app.i18n import _, ngettext
from app.screens.common.alarms_view import bell, doubts_clock, is_shelved
from app.screens.common.mission_names import SharedMissionNames
from app.screens.common.pin_sheet import PinSheet
from app.screens.common.threads import UiBus
from app.screens.common.view_model import Navigator
from app.screens.frame.facts import OpenIssues
from app.screens.frame.late_starts import LateSheet
from app.screens.frame.view import banner, new_lines, open_lines, zone_asked
from app.screens.home.facts import HomeFacts
from app.screens.home.screen import HomeScreen, HomeViewModel
from app.screens.rescue import Damage, NotStarted
from app.services.live.tablet import IS_COPY
from app.widgets import load_kv
from app.widgets.snackbar import Snackbars
from tests.screenshots.frame import framed, sheets_of
from tests.screenshots.registry import BOTH, GLOVES, LANDSCAPE, LARGE_TEXT, SHARP, SMALL, SMALL_LARGE_TEXT, picture
from tests.support import home_facts as sample
from tests.support import sample_alarms

EVERY_SIZE = (*BOTH, SMALL, SHARP, LARGE_TEXT, SMALL_LARGE_TEXT, GLOVES)
PARAMETERS = (
    MissionParameter("place", "Pick-up place", choices=(("K1", "Kitting 1"), ("K2", "Kitting 2")), default="K1"),
    MissionParameter("count", "Pallets", "Integer", 2, 1, 8),
)
POSITION = (
    MissionParameter(
        "place",
        "Position",
        sets="position",
        choices=tuple((place.name, place.name) for place in sample.FACTS.map.places),
    ),
)
SILENCE = sample.without_veikko().snapshots[2].problem
FAILED_RUN = next(run for run in sample.FINISHED if run.state is State.FAILED)
ALARMS = (
    Alarm("emergency_stop", "robot:1", Priority.HIGH, sample.ago(minutes=2), {"robot": "Aino"}, id=1),
    Alarm(
        "unreachable",
        "robot:2",
        Priority.MEDIUM,
        sample.ago(minutes=9),
        {"robot": "Veikko", "problem": SILENCE},
        id=2,
        count=3,
    ),
    Alarm(
        "execution_failed",
        "execution:14",
        Priority.MEDIUM,
        FAILED_RUN.ended_at,
        {"robot": "Veikko", "robot_id": 2, "mission": FAILED_RUN.mission, "reason": to_store(FAILED_RUN.reason)},
        id=3,
        cleared_at=FAILED_RUN.ended_at,
    ),
    Alarm(
        "robot_error",
        "robot:2",
        Priority.HIGH,
        FAILED_RUN.ended_at,
        {"robot": "Veikko", "problem": FAILED_RUN.reason.details["message"]},
        id=4,
        cleared_at=sample.ago(minutes=38),
    ),
)
ERROR = Alarm(
    "robot_error",
    "robot:1",
    Priority.HIGH,
    sample.ago(minutes=1),
    {"robot": "Aino", "robot_id": 1, "problem": "Failed to reach goal position 'Line 2'"},
    id=6,
)
QUESTION = Alarm(
    "question",
    "robot:1",
    Priority.HIGH,
    sample.ago(minutes=1),
    {
        "robot": "Aino",
        "robot_id": 1,
        "question": "Is the pallet loaded at Dock 3?",
        "answers": ["Yes", "No", "Skip this stop"],
    },
    id=7,
)
SILENT = Alarm(
    "unreachable",
    "robot:1",
    Priority.MEDIUM,
    sample.ago(minutes=4),
    {"robot": "Aino", "robot_id": 1, "problem": sample.without_aino().snapshots[1].problem},
    id=8,
)
LATE = tuple(
    replace(
        sample.HELD,
        id=number,
        mission=mission,
        schedule=schedule,
        wait=Wait.LATE_START,
        wait_details={},
        listed_until=sample.NOW + timedelta(seconds=24),
    )
    for number, mission, schedule in ((21, "Waste to compactor", sample.HELD.schedule), (22, "Collect empties", ""))
)


class _Nowhere:
    """Services that a picture doesn't need."""

    def run(self, *_args: Any, **_kwargs: Any) -> None:
        """Work in the background never comes back."""


_NOWHERE = _Nowhere()


def home(
    studio: Any,
    facts: HomeFacts,
    *,
    issues: OpenIssues | None = None,
    more: dict[str, Any] | None = None,
    background: Any = _NOWHERE,
) -> HomeScreen:
    """Home in its frame, with these facts, and with ``issues``, by default those that the app would have; ``more`` services by name."""
    issues = sample_alarms.issues_of(facts) if issues is None else issues
    services: Any = SimpleNamespace(
        **{
            "maps": SimpleNamespace(is_due=lambda _robot_id, _map_id: False),
            "operator": None,
            "catalogue": None,
            "history": None,
            "holds": None,
            "robot_missions": SimpleNamespace(learn_names=bool),
            "clock": SimpleNamespace(now=lambda: sample.NOW),
            "snapshots": SimpleNamespace(get=lambda robot_id: facts.snapshots.get(robot_id) or RobotSnapshot(robot_id)),
        }
        | (more or {})
    )
    frame = framed("home")
    shell: Any = SimpleNamespace(
        sheets=sheets_of(studio, frame),
        background=background,
        dialogs=studio.dialogs,
        say_problem=None,
        restore=None,
        navigator=Navigator(None, {}),
        bus=UiBus(),
        mission_names=SharedMissionNames(),
    )
    screen = HomeScreen(HomeViewModel(services, shell))
    frame.add_widget(screen)
    screen.vm.take(facts)
    show_issues(frame, issues, {robot.id: robot for robot in facts.robots}, facts.settings, "home")
    studio.show(frame)
    return screen


def sent(studio: Any, facts: HomeFacts, parameters: tuple[MissionParameter, ...]) -> None:
    """Home with the sheet of a mission that has these parameters."""
    screen = home(studio, facts)
    screen.vm.sending.usual = sample.FACTS.expected
    screen.vm.sending.open(sample.KITS.id)
    screen.vm.sending.learned(screen.vm.sheets.top, parameters)
    studio.driver.advance(0.2)


def show_issues(frame: Any, issues: OpenIssues, robots: Mapping[int, Robot], settings: Settings, name: str) -> None:
    """Banner and bell over the screen of that name, as the app sets them with Aino selected."""
    bar, frame.banner = frame.ids.bar, banner(issues, robots, settings, sample.NOW, name)
    bar.clock_in_doubt = any(map(doubts_clock, issues.alarms))
    lines = open_lines(issues.alarms, sample.NOW)
    shelved = [alarm for alarm in issues.alarms if is_shelved(alarm, sample.NOW)]
    bar.bell_icon, bar.bell_count = bell(len(new_lines(lines)), len(lines), len(shelved))


stopped = sample.without_veikko  # as ``ALARMS`` say


@picture("home", sizes=EVERY_SIZE)
def running(studio: Any) -> None:
    home(studio, sample.FACTS)


@picture("home-cancel", sizes=(*BOTH, SMALL))
def cancel_asked(studio: Any) -> None:
    vm = home(studio, sample.FACTS).vm
    vm.cancel(("execution", sample.RUNNING.id))


@picture("home-message", sizes=EVERY_SIZE)
def said(studio: Any) -> None:
    """The message about what was pressed a moment ago."""
    home(studio, sample.FACTS)
    bars = Snackbars()
    studio.afterwards(bars.clear)
    bars.undo("Schedule deleted: Waste to compactor", "Undo", lambda: None)


@picture("home-waiting", sizes=EVERY_SIZE)
def waiting_for_a_robot(studio: Any) -> None:
    """A start of a group that waits for a robot."""
    home(studio, replace(sample.WITH_WAITING, open=sample.WITH_WAITING.open[:4]))


@picture("home-estop", sizes=(*BOTH, SMALL, SMALL_LARGE_TEXT))
def emergency_stop(studio: Any) -> None:
    home(studio, stopped(), issues=OpenIssues(ALARMS))


@picture("home-overdue", sizes=(*BOTH, SMALL, LARGE_TEXT))
def overdue(studio: Any) -> None:
    home(studio, stopped(), issues=OpenIssues([replace(ALARMS[0], raised_at=sample.ago(minutes=7)), *ALARMS[1:]]))


@picture("home-acknowledged", sizes=(LANDSCAPE, SMALL))
def acknowledged(studio: Any) -> None:
    """The page as the next operator finds it."""
    seen = replace(ALARMS[0], acknowledged_at=sample.ago(minutes=1), note="Waiting for maintenance")
    home(studio, stopped(), issues=OpenIssues([seen, ALARMS[1]]))


@picture("home-error", sizes=(LANDSCAPE,))
def error(studio: Any) -> None:
    home(studio, sample.with_aino(sample.FAILED), issues=OpenIssues([ERROR]))


@picture("home-question", sizes=EVERY_SIZE)
def question(studio: Any) -> None:
    home(studio, sample.with_aino(sample.ASKING), issues=OpenIssues([QUESTION]))


@picture("home-unreachable", sizes=(LANDSCAPE,))
def unreachable(studio: Any) -> None:
    home(studio, sample.without_aino(), issues=OpenIssues([SILENT]))


@picture("home-idle", sizes=BOTH)
def idle(studio: Any) -> None:
    home(studio, replace(sample.with_aino(sample.READY, ()), open=(), planned=(), finished=()))


@picture("home-paused", sizes=(LANDSCAPE,))
def paused(studio: Any) -> None:
    home(studio, sample.with_aino(replace(sample.EXECUTING, state=RobotState.PAUSE)))


@picture("home-manual", sizes=(LANDSCAPE,))
def manual(studio: Any) -> None:
    home(studio, sample.with_aino(replace(sample.EXECUTING, state=RobotState.MANUAL_CONTROL)))


@picture("home-late", sizes=(LANDSCAPE,))
def late(studio: Any) -> None:
    home(studio, replace(sample.FACTS, expected={sample.KITS.guid: DurationEstimate(100.0, 110.0)}))


@picture("home-loading", sizes=(LANDSCAPE,))
def loading(studio: Any) -> None:
    home(studio, replace(sample.FACTS, snapshots={}, open=(), planned=(), finished=(), map=None, is_new=True))


@picture("home-parameters", sizes=(*BOTH, SHARP, LARGE_TEXT))
def parameters(studio: Any) -> None:
    sent(studio, sample.FACTS, PARAMETERS)


@picture("home-pin", sizes=EVERY_SIZE)
def pin(studio: Any) -> None:
    """It is asked for on the way to Settings."""
    problem = ngettext("Wrong PIN, {n} try left", "Wrong PIN, {n} tries left", 4).format(n=4)
    home(studio, sample.FACTS).vm.sheets.over(PinSheet(title=_("Enter the PIN"), pin="471", problem=problem))


@picture("home-position", sizes=EVERY_SIZE)
def position(studio: Any) -> None:
    """The hint to choose a mission, and where."""
    sent(studio, sample.FACTS, POSITION)


@picture("home-no-map", sizes=(*BOTH, SMALL))
def no_map(studio: Any) -> None:
    home(studio, replace(sample.FACTS, map=None))


@picture("home-map", sizes=(*BOTH, SMALL))
def whole_map(studio: Any) -> None:
    home(studio, sample.with_aino(sample.STOPPED)).vm.open_map()


@picture("home-held", sizes=(LANDSCAPE,))
def held(studio: Any) -> None:
    home(studio, sample.on_hold(sample.FACTS))


@picture("home-clock", sizes=BOTH)
def wrong_clock(studio: Any) -> None:
    problem = message("most robots' clocks are {time} behind it", time=message("{days} days", days=3))
    home(
        studio,
        sample.FACTS,
        issues=OpenIssues(
            [Alarm("clock_implausible", "clock", Priority.HIGH, sample.ago(minutes=1), {"problem": problem}, id=5)]
        ),
    )


@picture("home-copy", sizes=BOTH)
def copied_data(studio: Any) -> None:
    home(studio, sample.FACTS, issues=OpenIssues(copy=Hold(render(IS_COPY, _), is_copy=True)))


@picture("home-empty")
def empty(studio: Any) -> None:
    home(studio, HomeFacts(settings=sample.SETTINGS))


@picture("late-starts", sizes=EVERY_SIZE)
def late_starts(studio: Any) -> None:
    late = [
        LATE[0],
        replace(LATE[1], held=True),
        replace(LATE[0], id=23, wait=Wait.ELSEWHERE, wait_details=rules.LISTED_LATER),
    ]
    facts = replace(sample.with_aino(sample.EXECUTING, sample.QUEUE[:1]), open=(sample.RUNNING, *late))
    screen = home(studio, facts, issues=OpenIssues())
    load_kv("frame/late_starts")
    sheet = LateSheet()
    sheet.show(OpenIssues(late_starts=late), sample.SETTINGS, sample.NOW)
    screen.vm.sheets.show(sheet)
    studio.driver.advance(0.3)


@picture("time-zone-asked", sizes=BOTH)
def time_zone_asked(studio: Any) -> Any:
    """At the first start, where it isn't certain which one the tablet has."""
    home(studio, sample.FACTS)
    title, options = zone_asked(zone_names(), "Europe/Helsinki", sample.NOW)
    return studio.dialogs.choose(title, options, lambda _key: None)


@picture("mission-picker", sizes=(LANDSCAPE,))
def mission_picker(studio: Any) -> None:
    home(studio, replace(sample.FACTS, entered=(*sample.FACTS.missions, sample.COILS))).vm.sending.open_all()


@picture("clear-queue", sizes=(LANDSCAPE,))
def clear_queue(studio: Any) -> Any:
    home(studio, sample.FACTS).vm.clear_queue()
    return studio.dialogs.top


@picture("damaged-database")
def damaged(studio: Any) -> None:
    directory = Path("/home/tablet/.local/share/amr-scheduler")
    found = DatabaseDamaged(
        directory / "amr-scheduler.db",
        message("malformed disk image"),
        directory / "amr-scheduler.db.damaged-20261120",
        directory / "backups" / "daily-2026-11-20.db",
    )
    damage = Damage(found, lambda: None)
    studio.show(damage.page(UiBus(), lambda _services: None))


@picture("not-started", sizes=(LANDSCAPE,))
def not_started(studio: Any) -> None:
    path = Path("/var/lib/amr-scheduler/amr-scheduler.db")
    found = NotStarted(DatabaseUnavailable(SENTENCES[sqlite3.SQLITE_FULL], path=path), lambda: None)
    studio.show(found.page(UiBus(), lambda _services: None))
