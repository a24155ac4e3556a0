"""Starts that wait for a robot of their group, and robots reserved for more important ones. Pure."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from datetime import datetime, timedelta
from typing import Any

from app.domain import choice
from app.domain.execution import Execution, State, Wait
from app.domain.models import Group, Robot, Settings
from app.i18n import _, ngettext
from app.screens.common import formats
from app.screens.common.group_starts import has_no_robot
from app.screens.common.holding import waiting_words
from app.screens.home.facts import HomeFacts
from app.services.allocation.choose import LAST_CALL
from app.services.allocation.situation import Ineligible
from app.widgets.items import Action, Item, Option

ON_THE_WAY = timedelta(seconds=2)  # until the message that a start is being sent


def waiting_of(rows: Iterable[Execution]) -> list[Execution]:
    """Those without a robot, in the order in which they will get one, as far as it is fixed."""
    found = [row for row in rows if has_no_robot(row)]
    return sorted(found, key=lambda row: (-row.priority, row.planned_at, row.id))


def waiting_row(facts: HomeFacts, row: Execution) -> Item:
    give = Action("give", _("Give to a robot"))
    can_give = row.group_id is not None and not row.held
    return _row(facts, row, waits_for(row, facts.settings), *([give] if can_give else []))


def _row(facts: HomeFacts, row: Execution, note: str, *actions: Action) -> Item:
    cancel = Action("cancel", icon="close", off=_("Being cancelled") if row.cancel_code is not None else "")
    return Item(
        ("start", row.id),
        title=facts.mission_names.run(row),
        support=note,
        icon="timer-sand",
        tone="attention",
        below=True,
        opens=False,
        actions=(*actions, cancel),
    )


def starts_with_a_robot(facts: HomeFacts, now: datetime) -> list[tuple[Execution, Item]]:
    """Starts of groups with a note: those that a silent robot may have, so that another one can be asked to do it as well, and those that
    their robot has not confirmed yet. Usually the confirmation comes before the note could be read."""
    stuck, sent = [], []
    for row in facts.open:
        if row.group_id is None or row.robot_id is None:
            continue
        snapshot = facts.snapshots.get(row.robot_id)
        if snapshot is not None and (since := choice.stuck_since(row, snapshot)) is not None:
            words = choice.stuck(row.robot, since, facts.settings.timezone, _)
            stuck.append((row, _row(facts, row, words, Action("give", _("Start elsewhere")))))
        elif _is_being_sent(row) and now - max(row.created_at, row.planned_at) >= ON_THE_WAY:
            sent.append((row, _row(facts, row, _("Being sent to {robot}").format(robot=row.robot))))
    return stuck + sent


def _is_being_sent(row: Execution) -> bool:
    """Starts that wait for something else, such as the end of a hold, are in their robot's queue."""
    if row.state is State.SUBMITTING:
        return row.queue_id is None and not row.is_called_off
    return row.state is State.WAITING and row.wait in (Wait.DUE, Wait.RETRY)


def others_for(row: Execution, robots: Iterable[Robot], groups: Iterable[Group]) -> list[Option]:
    """Who could do it as well: any other of the group, or one of them."""
    members = next((group.members for group in groups if group.id == row.group_id), ())
    others = [robot for robot in robots if robot.id in members and robot.id != row.robot_id and robot.enabled]
    any_other = (
        [Option(0, _("Any other of {group}").format(group=row.robot_group), "select-group")] if len(others) > 1 else []
    )
    return [*any_other, *(Option(robot.id, robot.name, "robot-outline") for robot in others)]


def waits_for(row: Execution, settings: Settings) -> str:
    """What it waits for, what each robot is doing, and when it goes into a queue at the latest."""
    zone = settings.timezone
    parts = [waiting_words(row, zone)]
    passed = choice.earlier_robots(row.tried, row.robot, _)
    if row.wait is Wait.ROBOT and (
        words := choice.awaited(_without_those_tried(row) if passed else row.wait_details, zone, _)
    ):
        last_call = formats.clock_time(row.closes_at - timedelta(seconds=LAST_CALL), zone)
        end = (
            _("Goes into a queue at {time} at the latest")
            if choice.may_any(row.wait_details)
            else _("Not run if none can by {time}")
        )
        if row.finish_by is not None:
            end, last_call = _("Not run if it can't be done by {time}"), formats.clock_time(row.finish_by, zone)
        parts = [words, end.format(time=last_call)]
    return ". ".join(filter(None, (passed, *parts)))


def _without_those_tried(row: Execution) -> dict[str, Any]:
    """What it waits for; robots that had it before are named elsewhere."""
    robots = [
        each
        for each in row.wait_details.get("robots", ())
        if not (isinstance(each, dict) and each.get("out") == Ineligible.TRIED)
    ]
    return {**row.wait_details, "robots": robots}


def waiting_title(rows: Sequence[Execution]) -> str:
    """Without any it is empty."""
    count, waits = len(rows), {row.wait if has_no_robot(row) else Wait.DUE for row in rows}
    if not count:
        return ""
    if waits <= {Wait.ROBOT, Wait.DUE}:
        return ngettext("Waiting for a robot ({n})", "Waiting for a robot ({n})", count).format(n=count)
    if waits == {Wait.PLACE}:
        return ngettext("Waiting for a place ({n})", "Waiting for a place ({n})", count).format(n=count)
    return ngettext("Waiting to start ({n})", "Waiting to start ({n})", count).format(n=count)
