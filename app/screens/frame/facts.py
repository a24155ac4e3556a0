"""What the frame needs to know at one moment, read on a background thread; view.py turns it into words."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace

from app.database.robots import Hold
from app.domain import rules
from app.domain.clock import Clock
from app.domain.execution import Execution, State, Wait
from app.domain.models import Alarm, Robot, Settings
from app.screens.common.mission_names import NOTHING_KNOWN, MissionNames
from app.screens.common.name_order import by_name
from app.services.catalogue.catalogue import Catalogue
from app.services.dispatch.engine import Engine
from app.services.history.runs import History
from app.services.live.alarms import ZONE_GUESSED, Alarms
from app.services.live.holds import Holds
from app.services.live.snapshots import Snapshots
from app.services.live.tablet import Tablet
from app.services.robots.commands import Operator
from app.services.robots.missions import RobotMissions


@dataclass(frozen=True)
class FrameServices:
    """What the frame uses of the app."""

    alarms: Alarms
    catalogue: Catalogue
    clock: Clock
    history: History
    holds: Holds
    engine: Engine
    operator: Operator
    robot_missions: RobotMissions
    settings: Callable[[], Settings]
    snapshots: Snapshots
    tablet: Tablet


@dataclass(frozen=True)
class OpenIssues:
    """Everything that a banner may show."""

    alarms: Sequence[Alarm] = ()  # open ones, shelved ones among them
    holds: Sequence[Hold] = ()  # the operator's, of all robots or of one
    late_starts: Sequence[Execution] = ()
    waiting_for_hold: Sequence[Execution] = ()  # for the end of one; not those that a person put on hold one by one
    copy: Hold | None = None  # why nothing is sent from here: the data was copied from another tablet
    guessed_zone: str = ""  # of the tablet, until a person has chosen one
    mission_names: MissionNames = NOTHING_KNOWN  # what is known of the values that the late starts' missions get


@dataclass(frozen=True)
class FrameFacts:
    settings: Settings = field(default_factory=Settings)
    robots: Mapping[int, Robot] = field(default_factory=dict)
    issues: OpenIssues = field(default_factory=OpenIssues)

    @property
    def robot(self) -> Robot | None:
        """The selected robot; the first if the selected one was deleted."""
        return self.robots.get(self.settings.selected_robot_id or 0) or next(iter(self.robots.values()), None)


def read(services: FrameServices) -> FrameFacts:
    """Called off the UI thread."""
    robots = {robot.id: robot for robot in by_name(services.catalogue.robots())}
    holds = sorted(services.holds.current(), key=lambda hold: hold.robot_id is not None)  # that of all robots first
    alarms, settings = services.alarms.open(), services.settings()
    open_ones = services.history.open()
    is_guess = any((alarm.code, alarm.key) == ZONE_GUESSED and alarm.cleared_at is None for alarm in alarms)
    return FrameFacts(
        settings,
        robots,
        OpenIssues(
            alarms,
            holds,
            late_starts(open_ones, robots),
            [e for e in open_ones if e.state is State.WAITING and e.wait is Wait.HOLD and not e.held],
            _copy(services.holds),
            settings.timezone if is_guess else "",
        ),
    )


def _copy(holds: Holds) -> Hold | None:
    hold = holds.active()
    return hold if hold is not None and hold.is_copy else None


def may_have_run(execution: Execution) -> bool:
    """Its robots are asked first; it counts down when they deny it."""
    return execution.wait is Wait.ELSEWHERE and rules.is_listed_later(execution)


def late_starts(executions: Sequence[Execution], robots: Mapping[int, Robot]) -> list[Execution]:
    """Fell due while the app was off: sent when the time to object is over, unless a person puts them on hold, or when their robots deny
    that they have run. With the names that the robots have now."""
    late = [
        e for e in executions if e.state is State.WAITING and (e.wait is Wait.LATE_START or e.held or may_have_run(e))
    ]
    return [replace(e, robot=robot.name) if (robot := robots.get(e.robot_id or 0)) else e for e in late]
