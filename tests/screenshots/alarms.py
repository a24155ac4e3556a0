"""The list of alarms over Home: its three parts, its menu, and the note."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from datetime import timedelta
from types import SimpleNamespace
from typing import Any

from app.domain.models import Alarm, Reason, ReasonCode
from app.domain.reasons import to_store
from app.mir.errors import Unreachable
from app.screens.common.alarms_view import alarm_text, menu_of
from app.screens.frame.alarm_list import AlarmList, AlarmRow, NoteDialog
from app.screens.frame.facts import OpenIssues
from tests.screenshots.home import ALARMS, home, stopped
from tests.screenshots.registry import BOTH, GLOVES, LANDSCAPE, LARGE_TEXT, SMALL, picture
from tests.support import home_facts as sample
from tests.support.alarms import alarm

SIZES = (*BOTH, SMALL, LARGE_TEXT, GLOVES)
STANDING = (
    ALARMS[0],
    replace(
        ALARMS[1],
        raised_at=sample.ago(hours=2),
        last_at=sample.ago(minutes=9),
        acknowledged_at=sample.ago(minutes=5),
        note="Access point in hall B is being replaced",
    ),
    *ALARMS[2:],
    replace(
        ALARMS[1],
        id=5,
        key="robot:3",
        details={"robot": "Sisu"},
        shelved_until=sample.NOW + timedelta(hours=1, minutes=52),
    ),
)
PAST = tuple(
    replace(
        ALARMS[n % 4],
        id=100 + n,
        cleared_at=sample.ago(hours=n + 1),
        acknowledged_at=sample.ago(hours=n),
        count=1 + n % 3,
        raised_at=sample.ago(hours=n + 3),
        last_at=sample.ago(hours=n + 2),
        note="Cable on the floor" if n % 3 == 0 else "",
    )
    for n in range(50)
)
ROBOTS = {robot.id: robot for robot in sample.FACTS.robots}


class Desk:
    """Services that know these alarms; work in the background is done at once."""

    def __init__(self, studio: Any, past: Sequence[Alarm] = PAST, standing: Sequence[Alarm] = STANDING) -> None:
        issues = OpenIssues(standing, [sample.HOLD])
        home(studio, sample.on_hold(stopped()), issues=issues)
        services: Any = SimpleNamespace(
            clock=SimpleNamespace(now=lambda: sample.NOW),
            alarms=SimpleNamespace(past=lambda _limit: (past, 312 if past else 0)),
        )
        shell: Any = SimpleNamespace(background=self, dialogs=studio.dialogs, say_problem=print)
        self.list = AlarmList(services, shell, lambda _act, _about: None)
        self.list.show(issues, ROBOTS, sample.SETTINGS)
        self.list.open()
        self.dialog = studio.dialogs.top

    @staticmethod
    def run(work: Any, done: Any, _failed: Any, key: Any = None) -> None:
        done(work())


@picture("alarms", sizes=SIZES)
def standing(studio: Any) -> Any:
    return Desk(studio).dialog


@picture("alarms-one-cause", sizes=SIZES)
def one_cause(studio: Any) -> Any:
    problem = Unreachable(code="no_answer", address="10.40.12.22").message
    silent = [
        replace(
            ALARMS[1],
            id=20 + n,
            key=f"robot:{20 + n}",
            details={"robot": f"Robot {n}", "problem": problem},
            raised_at=sample.ago(minutes=36),
            last_at=sample.ago(minutes=36, seconds=-n),
        )
        for n in range(1, 15)
    ]
    dialog = Desk(studio, standing=(STANDING[0], *silent)).dialog
    dialog.dispatch("on_row", ("group", 21), "fold")
    return dialog


@picture("alarms-many", sizes=SIZES)
def many(studio: Any) -> Any:
    """More than the window holds."""
    reason = to_store(
        Reason(
            ReasonCode.WINDOW_CLOSED,
            {
                "until": "2026-11-20T12:15:00+00:00",
                "problem": Unreachable(code="no_answer", address="10.40.12.23").message,
            },
        )
    )
    failed = [
        alarm(
            "execution_failed",
            f"schedule:{n}",
            id=40 + n,
            last_at=sample.ago(minutes=n),
            details={"robot": "Sisu", "robot_id": 3, "mission": name, "reason": reason},
        )
        for n, name in enumerate(
            ("Collect empties", "Waste to compactor", "Deliver kits to line 2", "Bring pallet to dock")
        )
    ]
    stops = [replace(ALARMS[0], id=50 + n, key=f"robot:{50 + n}", details={"robot": f"Robot {n}"}) for n in range(1, 9)]
    return Desk(studio, standing=(*stops, *failed)).dialog


@picture("alarms-shelved", sizes=BOTH)
def shelved(studio: Any) -> Any:
    dialog = Desk(studio).dialog
    dialog.tab = "shelved"
    return dialog


@picture("alarms-past", sizes=(*BOTH, LARGE_TEXT))
def past(studio: Any) -> Any:
    dialog = Desk(studio).dialog
    dialog.tab = "past"
    return dialog


@picture("alarms-none", sizes=(LANDSCAPE,))
def nothing(studio: Any) -> Any:
    desk = Desk(studio, past=())
    desk.list.show(OpenIssues(), ROBOTS, sample.SETTINGS)
    return desk.dialog


@picture("alarms-menu", sizes=SIZES)
def menu(studio: Any) -> Any:
    dialog = Desk(studio).dialog
    studio.driver.advance(0.2)
    row = next(widget for widget in dialog.walk() if isinstance(widget, AlarmRow))
    return studio.dialogs.menu(row.children[0], row.text, menu_of(STANDING[0], ROBOTS), lambda _key: None)


@picture("alarms-note", sizes=SIZES)
def note(studio: Any) -> Any:
    Desk(studio)
    return studio.dialogs.open(NoteDialog(alarm_text(STANDING[0], sample.SETTINGS, sample.NOW), lambda _note: None))
