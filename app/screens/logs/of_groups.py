"""Groups of robots in the Logs: the group of a run, robots passed over, why one was chosen. Pure."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from zoneinfo import ZoneInfo

from app.domain import choice
from app.domain.execution import Execution, State
from app.domain.models import Group, Robot
from app.i18n import _
from app.screens.common import formats
from app.screens.common.robot_appearance import robot_option
from app.widgets.items import Option

Step = tuple[str, str, str]  # label, time, note


@dataclass(frozen=True)
class OfGroup:
    """A group by its name in the history. ``members``: ids of its present robots, whose figures are shown."""

    name: str
    members: tuple[int, ...] = ()


def target_options(groups: Sequence[Group], robots: Sequence[Robot]) -> list[Option]:
    """Groups first, then robots; 0: all."""
    names = {robot.id: robot.name for robot in robots}
    return [
        Option(0, _("All robots")),
        *(
            Option(
                OfGroup(group.name, group.members),
                _("Any of {group}").format(group=group.name),
                "select-group",
                ", ".join(names[member] for member in group.members if member in names),
            )
            for group in groups
        ),
        *map(robot_option, robots),
    ]


def whose(execution: Execution) -> str:
    """The robot, or the group of a run without one."""
    return execution.ran_on or any_of(execution)


def any_of(execution: Execution) -> str:
    """Empty where it was for one robot only."""
    return _("any of {group}").format(group=execution.robot_group) if execution.robot_group else ""


def steps(execution: Execution, zone: ZoneInfo) -> list[Step]:
    """Between planned and submitted: robots passed over, the chosen one and why; or what it still waits for."""
    if not execution.robot_group:
        return []
    found = [
        (_("Passed by"), formats.NOTHING, note)
        for key, each in execution.tried.items()
        if (note := choice.earlier_robots({key: each}, execution.robot, _).partition(" · ")[0])
    ]
    if chosen := choice.chosen(execution.choice, zone, _):
        at = (
            formats.wall_time(execution.bound_at.astimezone(zone), seconds=True)
            if execution.bound_at
            else formats.NOTHING
        )
        found.append((_("Chosen"), at, chosen))
    elif execution.state is State.WAITING and (awaited := choice.awaited(execution.wait_details, zone, _)):
        found.append((_("Waits for a robot"), formats.NOTHING, awaited))
    return found
