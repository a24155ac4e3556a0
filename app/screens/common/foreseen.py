"""What is foreseen of planned starts: that they are refused; of a group's the robot that will probably take them, always
marked as a forecast. Pure."""

from __future__ import annotations

from collections.abc import Collection

from app.domain.models import Connection
from app.i18n import _
from app.screens.common.robot_appearance import silence_word
from app.services.planning.planned import PlannedRun

ABOUT = "≈\N{NO-BREAK SPACE}"


def whose(run: PlannedRun) -> str:
    """The robot of a start; of a group's the group and the robot that will probably take it."""
    if run.group is None:
        return run.robot.name
    group = _("any of {group}").format(group=run.group.name)
    return f"{group} ({ABOUT}{run.robot.name})" if run.begins_at is not None else group


def label(run: PlannedRun, words: str) -> str:
    """On a bar."""
    return f"{ABOUT}{words}" if run.is_approximate else words


def lack(run: PlannedRun, refused: Collection[int]) -> str:
    """In a few words, why no robot can do it, as far as is known. ``refused``: schedules whose values no robot takes."""
    if run.lacks_mission:
        return _("no robot of the group has the mission")
    return wrong_values() if run.schedule.id in refused else ""


def wrong_values() -> str:
    return _("a value is missing or wrong")


def silence(run: PlannedRun, connection: Connection | None) -> str:
    """In a few words, the problem of the robot that it waits for; a group's start goes to another one."""
    return silence_word(connection) if run.group is None else ""


def sentence(run: PlannedRun) -> str:
    """The forecast of the robot; empty if the robot is fixed."""
    if run.group is None:
        return ""
    if run.lacks_mission:
        return _("No robot of {group} has the mission {mission}").format(group=run.group.name, mission=run.mission.name)
    if run.begins_at is None:
        return _(
            "A forecast: no robot of {group} will be free in its start window. The robot is chosen at its time."
        ).format(group=run.group.name)
    return _("A forecast: {robot} will probably take it. The robot of {group} is chosen at its time.").format(
        robot=run.robot.name, group=run.group.name
    )
