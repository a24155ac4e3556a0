"""Starts that wait for a robot of their group, or that a silent robot may have. Pure."""

from __future__ import annotations

from datetime import datetime

from app.domain import choice
from app.domain.execution import Execution, Wait
from app.domain.models import Robot
from app.i18n import _, ngettext
from app.screens.common.group_starts import has_no_robot
from app.screens.common.holding import waiting_words
from app.screens.home.facts import HomeFacts
from app.widgets.items import Action, Item, Option


def group_starts(facts: HomeFacts, robot: Robot | None = None) -> list[Execution]:
    """In the order in which they get a robot, as far as it is fixed; with ``robot`` those that it may get."""
    groups = {group.id for group in facts.groups if robot is None or robot.id in group.members}
    found = [run for run in facts.open if run.group_id in groups and (has_no_robot(run) or stuck_since(facts, run))]
    return sorted(found, key=lambda run: (-run.priority, run.planned_at, run.id))


def stuck_since(facts: HomeFacts, run: Execution) -> datetime | None:
    """Since when the robot that may have it is silent."""
    snapshot = facts.snapshots.get(run.robot_id or 0)
    return choice.stuck_since(run, snapshot) if snapshot is not None else None


def waits_for(facts: HomeFacts, run: Execution) -> str:
    """What it waits for: what each robot of the group is doing, if that is the reason."""
    zone = facts.settings.timezone
    if (since := stuck_since(facts, run)) is not None:
        return choice.stuck(run.robot, since, zone, _)
    words = choice.awaited(run.wait_details, zone, _).replace("; ", " · ") if run.wait is Wait.ROBOT else ""
    return words or waiting_words(run, zone)


def waiting_rows(facts: HomeFacts) -> tuple[Item, ...]:
    """For the list of all robots."""
    rows = []
    for run in group_starts(facts):
        give = Action("give", _("Give to a robot") if has_no_robot(run) else _("Start elsewhere"))
        cancel = Action("cancel", icon="close", off=_("Being cancelled") if run.cancel_code is not None else "")
        row = Item(
            ("start", run.id),
            title=facts.mission_names.run(run),
            support=waits_for(facts, run),
            icon="timer-sand",
            tone="attention",
            below=True,
            opens=False,
            actions=(cancel,) if run.held else (give, cancel),
        )
        rows.append(row)
    return tuple(rows)


def waiting_title(count: int) -> str:
    return ngettext("Waiting to start ({n})", "Waiting to start ({n})", count).format(n=count) if count else ""


def others_for(facts: HomeFacts, run: Execution) -> list[Option]:
    """Who could do it as well: any other of the group, or one of them."""
    members = next((group.members for group in facts.groups if group.id == run.group_id), ())
    others = [robot for robot in facts.robots if robot.id in members and robot.id != run.robot_id and robot.enabled]
    any_other = (
        [Option(0, _("Any other of {group}").format(group=run.robot_group), "select-group")] if len(others) > 1 else []
    )
    return [*any_other, *(Option(robot.id, robot.name, "robot-outline") for robot in others)]
