"""The page of alarms: its three tabs, its menu, and the note."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from datetime import timedelta
from types import SimpleNamespace
from typing import Any

from app.domain.execution import Reason, ReasonCode
from app.domain.models import Alarm, RobotSnapshot
from app.domain.reasons import to_store
from app.mir.errors import Unreachable
from app.screens.common.alarm_groups import menu_of_group
from app.screens.common.alarms_view import alarm_text
from app.screens.common.sheets import Sheets
from app.screens.frame.alarms import AlarmsModel, AlarmsScreen, NoteSheet
from app.screens.frame.facts import OpenIssues
from app.widgets.list_row import ListRow
from tests.screenshots.frame import framed
from tests.screenshots.home import ALARMS, show_issues
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
    """The page of these alarms in its frame; work in the background is done at once."""

    def __init__(self, studio: Any, past: Sequence[Alarm] = PAST, standing: Sequence[Alarm] = STANDING) -> None:
        services: Any = SimpleNamespace(
            clock=SimpleNamespace(now=lambda: sample.NOW),
            alarms=SimpleNamespace(past=lambda _limit: (past, 312 if past else 0)),
            snapshots=SimpleNamespace(get=RobotSnapshot),
        )
        shell: Any = SimpleNamespace(background=self, dialogs=studio.dialogs, say_problem=print)
        self.model = AlarmsModel(services, shell, lambda _act, _about: None, lambda: None)
        self.screen = AlarmsScreen(self.model, name="alarms")
        frame = self.frame = framed("alarms")
        show_issues(frame, OpenIssues(standing), ROBOTS, sample.SETTINGS, "alarms")
        frame.add_widget(self.screen)
        self.screen.shown()
        studio.afterwards(self.screen.hidden)
        self.model.show(standing, ROBOTS, sample.SETTINGS)
        studio.show(frame)
        studio.driver.advance(0.2)

    @staticmethod
    def run(work: Any, done: Any, _failed: Any, key: Any = None) -> None:
        done(work())


@picture("alarms", sizes=SIZES)
def standing(studio: Any) -> None:
    Desk(studio)


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
    Desk(studio, standing=(STANDING[0], *silent)).model.used(("group", 21), "fold")


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
    Desk(studio, standing=(*stops, *failed))


@picture("alarms-shelved", sizes=BOTH)
def shelved(studio: Any) -> Any:
    Desk(studio).model.choose("shelved")


@picture("alarms-past", sizes=(*BOTH, LARGE_TEXT))
def past(studio: Any) -> Any:
    Desk(studio).model.choose("past")


@picture("alarms-none", sizes=(LANDSCAPE,))
def nothing(studio: Any) -> Any:
    Desk(studio, past=(), standing=())


@picture("alarms-menu", sizes=SIZES)
def menu(studio: Any) -> Any:
    row = next(widget for widget in Desk(studio).screen.walk() if isinstance(widget, ListRow))
    return studio.dialogs.menu(row.children[0], row.item.title, menu_of_group(STANDING[:1]), lambda _key: None)


@picture("alarms-note", sizes=SIZES)
def note(studio: Any) -> Any:
    frame = Desk(studio).frame
    return Sheets(frame.ids.sheets.__self__).show(NoteSheet(text=alarm_text(STANDING[0], sample.SETTINGS, sample.NOW)))


@picture("alarms-tablet", sizes=BOTH)
def tablet(studio: Any) -> Any:
    """The tablet's own troubles."""
    codes = {"network_lost": 0, "tablet_battery_low": 14, "disk_nearly_full": 310, "clock_not_synchronised": 0}
    troubles = [
        alarm(code, "tablet", id=60 + n, details={"percent": value, "free": value})
        for n, (code, value) in enumerate(codes.items())
    ]
    Desk(studio, standing=troubles)
