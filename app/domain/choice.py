"""Why a start of a group got that robot, or none yet: stored as codes and numbers, shown as one sentence in any
language.

Nothing here ever fails, as in ``reasons``.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from datetime import datetime, tzinfo
from types import MappingProxyType
from typing import Any

from app.domain import writing
from app.domain.execution import Execution, State, Wait
from app.domain.message import render
from app.domain.models import Connection, RobotSnapshot
from app.domain.reasons import at_robot, instant_of, known_zone, stored_sentence
from app.domain.writing import Translate

MOST_SHOWN = 4  # robots of a sentence; of more, how many
# what waits so may wait for hours
LEAVES_ROBOT_FREE = (Wait.HOLD, Wait.CHECK_UP, Wait.BATTERY, Wait.LATE_START, Wait.PLACE, Wait.ELSEWHERE)

_OUT: Mapping[str, str] = MappingProxyType(
    {
        "off": "{robot} off",
        "unchecked": "{robot}: look at its fleet in Settings",
        "silent": "{robot}: no answer",
        "wrong_robot": "{robot}: another robot",
        "held": "{robot} on hold",
        "stopped": "{robot} stopped",
        "lacks_mission": "{robot} has no such mission",
        "tried": "{robot} refused it or did not answer",
        "low_battery": "{robot} {battery} % battery",
        "too_little_battery": "{robot} {battery} % battery, too little for the whole run",
    }
)
_WHY: Mapping[str, str] = MappingProxyType(
    {  # of the chosen one: what it had over others that were free
        "soonest": "will be done soonest, about {done}",
        "less_run": "has run less today",
        "ahead": "keeps the others free for planned missions",
        "equal": "will be done as early as the others",
    }
)


def is_by_operator(choice: Mapping[str, Any]) -> bool:
    """A person has given the start to its robot, which therefore gets it as it would a start of its own: stopped, low, or busy."""
    return choice.get("by") == "person"


def may_change_robot(row: Execution) -> bool:
    """Whether another robot may get it instead: a start of a group whose robot was not chosen by a person."""
    return row.group_id is not None and not is_by_operator(row.choice)


def chosen(
    choice: Mapping[str, Any], zone: tzinfo | str, translate: Translate = lambda text: text, whole: bool = True
) -> str:
    """For an assigned start: its robot and, in the ``whole`` story, the best of the others."""
    robots = _robots(choice)
    if not robots:
        return ""
    if is_by_operator(choice):
        return translate("{robot}: chosen by a person").format(robot=robots[0]["robot"])
    first = _queued(robots[0], zone, translate) if choice.get("last_call") else _why(robots[0], zone, translate)
    if not whole:
        return first
    others = [_described(robot, zone, translate) for robot in robots[1:MOST_SHOWN]]
    return " · ".join([first, *others, *_more(choice, robots, translate)])


def earlier_robots(tried: Mapping[str, Any], robot: str, translate: Translate = lambda text: text) -> str:
    """For a start of a group: robots that had it before and did not take it, and its present one; empty without earlier
    ones."""
    parts = []
    for each in tried.values():
        if not (isinstance(each, Mapping) and each.get("tries") and each.get("robot") and each["robot"] != robot):
            continue
        named = at_robot(each, str(each["robot"]))
        text = render(named.get("problem") or "", translate)
        template = translate("{robot}: {problem}") if text else translate("{robot} refused it or did not answer")
        if "code" in each:  # for good
            template, text = translate("{robot} refused it: {problem}"), text or stored_sentence(each, "UTC", translate)
        elif named is not each:  # the problem says whose it is
            parts.append(text)
            continue
        parts.append(template.format(robot=each["robot"], problem=text))
    if parts and robot:
        parts.append(translate("assigned to {robot}").format(robot=robot))
    return " · ".join(parts)


def stuck_since(execution: Execution, snapshot: RobotSnapshot) -> datetime | None:
    """Since when the robot that may have this start is silent, so that no other robot gets it; None: no such robot, or
    it is not sent again in any case."""
    is_silent = snapshot.connection not in (Connection.CONNECTED, Connection.SLOW, Connection.UNKNOWN)
    may_go_on = execution.state is State.SUBMITTING and not execution.is_called_off
    return snapshot.since if may_go_on and is_silent else None


def stuck(robot: str, since: datetime, zone: tzinfo | str, translate: Translate = lambda text: text) -> str:
    words = translate("{robot} may have it, no answer since {since}: it goes to no other robot")
    return words.format(robot=robot, since=_time(since, zone, translate))


def awaited(choice: Mapping[str, Any], zone: tzinfo | str, translate: Translate = lambda text: text) -> str:
    """For one that waits for a robot: what each is doing; empty if unknown."""
    robots = _robots(choice)
    parts = [_described(robot, zone, translate) for robot in robots[:MOST_SHOWN]]
    if kept_for := choice.get("kept_for"):
        parts.insert(0, translate("kept for {mission}").format(mission=kept_for))
    return " · ".join([*parts, *_more(choice, robots, translate)])


def _robots(choice: Mapping[str, Any]) -> Sequence[Mapping[str, Any]]:
    robots = choice.get("robots", ())
    return (
        [robot for robot in robots if isinstance(robot, Mapping) and "robot" in robot]
        if isinstance(robots, Sequence)
        else []
    )


def _why(robot: Mapping[str, Any], zone: tzinfo | str, translate: Translate) -> str:
    text, done = _described(robot, zone, translate), _time(robot.get("done"), zone, translate)
    why = str(robot.get("why"))
    return (
        text
        if why not in _WHY or (why == "soonest" and not done)
        else f"{text}, {translate(_WHY[why]).format(done=done)}"
    )


def _described(robot: Mapping[str, Any], zone: tzinfo | str, translate: Translate) -> str:
    text, failures = _state(robot, zone, translate), robot.get("failures")
    if robot.get("late") is True:
        text = translate("{text}, would be done too late").format(text=text)
    if not isinstance(failures, int) or failures < 1:
        return text
    words = (
        translate("{text}, its last start failed")
        if failures == 1
        else translate("{text}, {count} starts failed in a row")
    )
    return words.format(text=text, count=failures)


def _state(robot: Mapping[str, Any], zone: tzinfo | str, translate: Translate) -> str:
    if out := robot.get("out"):
        battery = robot.get("battery")
        text = translate(_OUT.get(str(out), "{robot}"))
        return text.format(robot=robot["robot"], battery=round(battery) if isinstance(battery, int | float) else "–")
    if until := _time(robot.get("until"), zone, translate):
        return translate("{robot} busy until about {until}").format(robot=robot["robot"], until=until)
    if gets := robot.get("gets"):
        return translate("{mission} is being sent to {robot}").format(robot=robot["robot"], mission=gets)
    if robot.get("unread") is True:
        return translate("{robot}: no reading yet").format(robot=robot["robot"])
    metres = robot.get("metres")
    if isinstance(metres, int | float) and math.isfinite(metres):
        return translate("{robot}: free now, {metres} m away").format(robot=robot["robot"], metres=round(metres))
    return translate("{robot}: free now").format(robot=robot["robot"])


def _queued(robot: Mapping[str, Any], zone: tzinfo | str, translate: Translate) -> str:
    if until := _time(robot.get("until"), zone, translate):
        return translate("{robot}: into its queue before the start window closes, free about {until}").format(
            robot=robot["robot"], until=until
        )
    return _why(robot, zone, translate)


def _more(choice: Mapping[str, Any], robots: Sequence[Mapping[str, Any]], translate: Translate) -> list[str]:
    more = max(0, len(robots) - MOST_SHOWN) + (count if isinstance(count := choice.get("more"), int) else 0)
    return [translate("and {count} more").format(count=more)] if more else []


def _time(value: object, zone: tzinfo | str, translate: Translate) -> str:
    instant = instant_of(value, known_zone(zone))
    return "" if instant is None else writing.time_of_day(instant, translate)
