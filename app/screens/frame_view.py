"""What is always there, in words: the selected robot in the top bar, and the banner with the most serious alarm or hold. Pure."""
from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from datetime import datetime
from enum import StrEnum
from typing import Any

from app.i18n import _, ngettext
from app.models import Alarm, Execution, Priority, Robot, RobotSnapshot, Settings, State, Wait
from app.screens import formats
from app.screens.home_robot import battery_look, is_old, link_look, state_look
from app.services.alarms import EVENTS, alarm_sentence
from app.services.holds import Hold


@dataclass(frozen=True)
class BarView:
    """The top bar, but for the screen's name."""
    date: str = ""
    clock: str = ""
    robot: str = ""
    link: str = ""
    icon: str = "robot-off-outline"
    tone: str = "offline"


def top_bar(robot: Robot | None, snapshot: RobotSnapshot | None, settings: Settings, now: datetime) -> BarView:
    date, clock = formats.day(now, settings.timezone, year=True), formats.clock_time(now, settings.timezone)
    if robot is None:
        return BarView(date, clock, _("No robot"))
    look = link_look(robot, snapshot or RobotSnapshot(robot.id), now, settings)
    return BarView(date, clock, robot.name, look.word, look.icon, look.tone)


def robot_option(robot: Robot, snapshot: RobotSnapshot, settings: Settings, now: datetime) -> dict[str, Any]:
    """One robot in the list to choose from."""
    look = state_look(robot, snapshot, is_old(snapshot, now, settings))
    battery = battery_look(snapshot.status, settings)
    return {"key": robot.id, "text": robot.name, "icon": look.icon, "note": f"{look.word} · {battery.text}"}


class Act(StrEnum):
    """What the banner's button does."""
    NOTHING = "nothing"
    SHOW_ROBOT = "show_robot"            # select it and go Home
    ROBOT_SETTINGS = "robot_settings"    # where address and password are mended
    ACKNOWLEDGE = "acknowledge"
    HOLD = "hold"                        # the late starts
    RELEASE = "release"                  # a hold


@dataclass(frozen=True)
class BannerView:
    """Empty ``text``: no banner."""
    text: str = ""
    note: str = ""
    tone: str = "fault"
    icon: str = "alert-octagon"
    others: str = ""
    action: str = ""
    act: Act = Act.NOTHING
    about: int | None = None             # id of the robot or alarm that ``act`` is about


@dataclass(frozen=True)
class Worries:
    """Everything a banner may have to tell."""
    alarms: Sequence[Alarm] = ()         # standing
    holds: Sequence[Hold] = ()           # the operator's, of all robots or of one
    late_starts: Sequence[Execution] = ()


def late_starts(executions: Sequence[Execution]) -> list[Execution]:
    """Fell due while the app was off; sent when the operator's seconds are over."""
    return [e for e in executions if e.state is State.WAITING and e.wait is Wait.LATE_START]


def banner(worries: Worries, robots: Mapping[int, Robot], settings: Settings, now: datetime, on_screen: int | None = None) -> BannerView:
    """The most serious one. ``on_screen`` is the robot that Home shows just now, so that its alarm doesn't lead to where one is already."""
    alarms = [alarm for alarm in worries.alarms if not is_shelved(alarm, now)]
    holds = [hold for hold in worries.holds if not hold.clock]        # a doubted clock has its own alarm
    count = len(alarms) + len(holds) + bool(worries.late_starts)
    if count == 0:
        return BannerView()
    others = ngettext("+{n} more", "+{n} more", count - 1).format(n=count - 1) if count > 1 else ""
    if worries.late_starts:
        return _late(worries.late_starts, settings, now, others)
    alarm = min(alarms, key=_urgency, default=None)
    if holds and (alarm is None or _urgency(alarm) > _HOLD):
        return _hold(holds[0], robots, settings, now, others)
    assert alarm is not None
    return _alarm(alarm, robots, settings, now, others or _("Details"), on_screen)


def is_shelved(alarm: Alarm, now: datetime) -> bool:
    return alarm.shelved_until is not None and alarm.shelved_until > now


def is_over(alarm: Alarm) -> bool:
    """Whether its cause is gone; an event has none that lasts."""
    return alarm.cleared_at is not None and alarm.code not in EVENTS


_HOLD = (False, False, 0.5, 0.0)         # a hold comes after what is high and new, before all others


def _urgency(alarm: Alarm) -> tuple[bool, bool, float, float]:
    newest = (alarm.last_at or alarm.raised_at).timestamp()
    return alarm.acknowledged_at is not None, is_over(alarm), list(Priority).index(alarm.priority), -newest


# ---------------------------------------------------------------------- one alarm
def robot_of(alarm: Alarm) -> int | None:
    """The robot it is about, from its key "robot:3"."""
    kind, _colon, number = alarm.key.partition(":")
    return int(number) if kind == "robot" and number.isdecimal() else None


_MENDED_IN_SETTINGS = ("unauthorized", "not_a_robot", "wrong_robot")

# code: what a person does about it
_ADVICE: Mapping[str, Callable[[], str]] = {
    "emergency_stop": lambda: _("release the red button, then press Reset on the robot"),
    "robot_error": lambda: _("see the robot on Home"),
    "unreachable": lambda: _("is it switched on, and on this network?"),
    "unauthorized": lambda: _("enter user name and password anew"),
    "not_a_robot": lambda: _("correct its address"),
    "wrong_robot": lambda: _("correct its address, or remove and add the robot"),
    "clock_implausible": lambda: _("set the tablet's clock"),
    "database": lambda: _("see to the tablet's disk"),
}
_LOUD: Mapping[str, Callable[[], str]] = {
    "emergency_stop": lambda: _("{robot} stands still: emergency stop pressed"),
    "unreachable": lambda: _("{robot} doesn't answer"),
}


def alarm_text(alarm: Alarm, settings: Settings, now: datetime) -> str:
    """One sentence in the operator's language, instants in the zone of the settings."""
    if alarm.code in _LOUD and alarm.details.get("robot"):
        return _LOUD[alarm.code]().format(robot=alarm.details["robot"])
    details = {name: _readable(value, settings, now) for name, value in alarm.details.items()}
    return alarm_sentence(replace(alarm, details=details), _)


def _readable(value: Any, settings: Settings, now: datetime) -> Any:
    """Instants are kept as ISO text in details; people want the time of their zone."""
    if not isinstance(value, str) or "T" not in value:
        return value
    try:
        return formats.day_and_time(datetime.fromisoformat(value), settings.timezone, now)
    except ValueError:
        return value


def alarm_note(alarm: Alarm, settings: Settings, now: datetime) -> str:
    """Since when or when, how often, whether it is over, and what to do."""
    zone = settings.timezone
    if alarm.code in EVENTS:
        parts = [formats.day_and_time(alarm.last_at or alarm.raised_at, zone, now)]
    elif is_over(alarm) and alarm.cleared_at is not None:
        parts = [_("Over since {time}").format(time=formats.day_and_time(alarm.cleared_at, zone, now))]
    else:
        parts = [_("Since {time}").format(time=formats.day_and_time(alarm.raised_at, zone, now))]
    if alarm.count > 1:
        parts.append(ngettext("{n} time", "{n} times", alarm.count).format(n=alarm.count))
    if not is_over(alarm) and alarm.code in _ADVICE:
        parts.append(_ADVICE[alarm.code]())
    return " · ".join(parts)


def alarm_tone(alarm: Alarm) -> str:
    """Red only for what is high and lasts or has just happened."""
    if is_over(alarm):
        return "neutral"
    return "fault" if alarm.priority is Priority.HIGH else "attention"


def alarm_icon(alarm: Alarm) -> str:
    if is_over(alarm):
        return "check-circle-outline"
    return "alert-octagon" if alarm.priority is Priority.HIGH else "alert"


def _alarm(alarm: Alarm, robots: Mapping[int, Robot], settings: Settings, now: datetime, others: str,
           on_screen: int | None) -> BannerView:
    return BannerView(alarm_text(alarm, settings, now), alarm_note(alarm, settings, now), alarm_tone(alarm), alarm_icon(alarm), others,
                      *alarm_action(alarm, robots, on_screen))


def alarm_action(alarm: Alarm, robots: Mapping[int, Robot], on_screen: int | None) -> tuple[str, Act, int | None]:
    """Where it is solved; where one is already, or where there is nothing to solve, that it was seen."""
    robot = robots.get(robot_of(alarm) or 0)
    if robot is not None and not is_over(alarm):
        if alarm.code in _MENDED_IN_SETTINGS:
            return _("Open settings"), Act.ROBOT_SETTINGS, robot.id
        if robot.id != on_screen:
            return _("Show {robot}").format(robot=robot.name), Act.SHOW_ROBOT, robot.id
    if alarm.acknowledged_at is None:
        return _("Acknowledge"), Act.ACKNOWLEDGE, alarm.id
    return "", Act.NOTHING, None


# ---------------------------------------------------------------------- holds and late starts
def _late(executions: Sequence[Execution], settings: Settings, now: datetime, others: str) -> BannerView:
    left = seconds_left(executions, now)
    count = len(executions)
    first = ngettext("{n} late mission starts in {s} s", "{n} late missions start in {s} s", count).format(n=count, s=left)
    names = ", ".join(late_line(e, settings) for e in executions[:3])
    note = _("Due while the app was off: {missions}").format(missions=names)
    return BannerView(first, note, "attention", "timer-alert-outline", others, _("Hold"), Act.HOLD)


def late_line(execution: Execution, settings: Settings) -> str:
    return _("{mission} on {robot} ({time})").format(mission=execution.mission, robot=execution.robot,
                                                     time=formats.clock_time(execution.planned_at, settings.timezone))


def seconds_left(executions: Sequence[Execution], now: datetime) -> int:
    """Whole seconds until the first of them is sent."""
    ends = [e.hold_until for e in executions if e.hold_until is not None]
    return max(0, round((min(ends) - now).total_seconds())) if ends else 0


def _hold(hold: Hold, robots: Mapping[int, Robot], settings: Settings, now: datetime, others: str) -> BannerView:
    robot = robots.get(hold.robot_id or 0)
    text = _("Nothing is sent to {robot}").format(robot=robot.name) if robot else _("Nothing is sent to any robot")
    until = _("Held until released")
    if hold.until is not None:
        until = _("Held until {time}").format(time=formats.day_and_time(hold.until, settings.timezone, now))
    return BannerView(text, " · ".join(filter(None, (until, hold.reason))), "attention", "hand-back-right-outline", others, _("Release"),
                      Act.RELEASE, hold.robot_id)
