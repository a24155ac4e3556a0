"""What one robot has done, does and will do, as rows of one list: the last two done, now, what waits for a robot of its group, its
queue, what is planned. Pure."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from datetime import datetime, timedelta

from app.domain import names, rules
from app.domain.execution import Execution, ReasonCode, State, Wait
from app.domain.models import Robot
from app.domain.robot import QueueItem, QueueState, RobotState
from app.i18n import _, ngettext
from app.screens.common import execution_appearance, foreseen, formats
from app.screens.common.group_starts import has_no_robot
from app.screens.common.holding import HAND, held_note
from app.screens.common.robot_appearance import STOPPED, is_old, why_not
from app.screens.home.facts import HomeFacts
from app.screens.home.waiting import group_starts, stuck_since, waits_for
from app.services.allocation.choose import AHEAD
from app.services.dispatch import idle
from app.services.planning.planned import PlannedRun
from app.widgets.items import Action, Item

OURS, THEIRS = "execution", "item"  # kinds of keys in the queue: the app's by the execution, others' by the queue item
DONE = 2  # that are shown, if there is room
WAITS_FOR_GROUP = 1.5  # rows that one of them takes

_WAIT_ICONS = {
    Wait.DUE: "",
    Wait.RETRY: "refresh",
    Wait.BATTERY: "battery-alert-variant-outline",
    Wait.HOLD: HAND,
    Wait.LATE_START: "timer-alert-outline",
    Wait.CLOCK: "clock-alert-outline",
    Wait.CHECK_UP: "clipboard-check-outline",
    Wait.ELSEWHERE: "magnify",
    Wait.ROBOT: "robot-outline",
    Wait.PLACE: "map-marker-outline",
}


def today(facts: HomeFacts, robot: Robot, now: datetime, room: float = 7.0) -> tuple[Item, ...]:
    """``room``: how many rows are in sight; rows that are done give way to those that are not."""
    waiting, queue, planned = _waiting(facts, robot), _queue(facts, robot, now), _planned(facts, robot, now)
    done = min(DONE, max(0, int(room - len(queue) - WAITS_FOR_GROUP * len(waiting))))
    now_row, others = queue[:1], queue[1:]
    if queue and queue[0].number:
        now_row, others = [], queue
    if len(queue) + WAITS_FOR_GROUP * len(waiting) > room:  # what is blocked is never below the fold
        others = sorted(others, key=lambda row: not row.meta_tone)
    rows = [*_done(facts, now, done), *now_row, *waiting, *others, *planned]
    if not rows and not facts.is_new:
        rows = [Item(("nothing",), _empty(robot), strong=False, opens=False)]
    return tuple(rows)


def _empty(robot: Robot) -> str:
    if robot.needs_password:
        return _("Nothing starts before its password is entered")
    return _("Nothing done, nothing planned")


# ---------------------------------------------------------------------- done
def _done(facts: HomeFacts, now: datetime, most: int) -> Iterator[Item]:
    """Of this day only: the rows show no date."""
    zone = facts.settings.timezone
    of_today = [
        run for run in facts.finished if formats.day(run.ended_at or run.planned_at, zone) == formats.day(now, zone)
    ]
    for run in reversed(of_today[:most]):
        icon, tone = execution_appearance.LOOKS[run.state]
        is_well = run.state is State.COMPLETED
        yield Item(
            ("run", run.id),
            facts.mission_names.run(run),
            " · ".join(filter(None, (_of_any(run, facts), "" if is_well else outcome_line(run)))),
            lead=formats.clock_time(run.ended_at or run.planned_at, facts.settings.timezone),
            icon="check" if is_well else icon,
            tone=tone,
            strong=False,
        )


def outcome_line(execution: Execution) -> str:
    """How it ended, in one line."""
    if execution.state is State.COMPLETED:
        return _("Completed")
    reason = execution_appearance.cause(execution, execution.timezone)[0] or formats.NOTHING
    if execution.reason and execution.reason.code in (ReasonCode.USER_CANCELLED, ReasonCode.QUEUE_CLEARED):
        return reason  # it begins with the outcome
    return _("{outcome}: {reason}").format(outcome=execution_appearance.word(execution.state), reason=reason)


# ---------------------------------------------------------------------- now, and the queue
def _queue(facts: HomeFacts, robot: Robot, now: datetime) -> list[Item]:
    """The running one, those in the robot's queue, those of the app that are not there yet. Only these have a number."""
    old, number, rows = is_old(facts.snapshot, now, facts.settings), 0, []
    deaf = _("{robot} can't hear it").format(robot=robot.name) if old else ""
    can = facts.snapshot.capabilities
    clears = robot.id in facts.clearing
    seen: set[int] = set()  # ours; a copy of one is an item of its own
    for item in facts.queue:
        ours = facts.execution_of(item)
        if ours is not None and ours.id in seen:
            ours = None
        elif ours is not None:
            seen.add(ours.id)
        key = (OURS, ours.id) if ours else (THEIRS, item.id)
        goes = clears or facts.on_robot(item) in facts.cancelling or bool(ours and ours.cancel_code)
        if item.state is QueueState.EXECUTING:
            rows.append(_now(facts, item, key, old, goes, now))
            continue
        number += 1
        who = "" if ours else item.created_by_name or ""
        rows.append(
            _waits(
                key,
                facts.name_of(item),
                number,
                who,
                goes,
                off="" if ours and old else deaf or why_not(can.cancel_waiting),
            )
        )
    if more := len(facts.snapshot.queue) - len(facts.queue):
        number += more
        words = ngettext("and {n} more", "and {n} more", more).format(n=more)
        rows.append(Item(("more", 0), words, icon="dots-horizontal", strong=False, opens=False))
    for run in facts.not_in_queue:
        if facts.is_missing(run):
            rows.append(_unknown((OURS, run.id), facts.mission_names.run(run), ""))
            continue
        number += 1
        goes = clears or run.cancel_code is not None
        row = _waits((OURS, run.id), facts.mission_names.run(run), number, "", goes)
        rows.append(_with_reason(row, facts, run, now) if row.actions else row)
    return rows


def _waits(key: tuple[str, int], mission: str, number: int, meta: str, goes: bool, off: str = "") -> Item:
    """``off``: why it can't be cancelled; what is the app's always can, its robot is asked until it answers."""
    if goes:
        return Item(key, mission, meta=_("Being cancelled"), number=str(number), strong=False, opens=False)
    cancel = Action("cancel", icon="close", off=off)
    return Item(key, mission, meta=meta, number=str(number), strong=False, actions=(cancel,), opens=key[0] == OURS)


def _with_reason(row: Item, facts: HomeFacts, run: Execution, now: datetime) -> Item:
    """What it waits for, besides its turn. Its row names a hold until its worker looks again, 2 s after the release."""
    is_released = run.wait is Wait.HOLD and not run.held and facts.hold(run.robot_id or 0, now) is None
    if run.state is not State.WAITING or run.wait is Wait.DUE or is_released:
        return row
    return replace(row, meta=reason_words(facts, run, now), meta_tone="attention", meta_icon=_WAIT_ICONS[run.wait])


def reason_words(facts: HomeFacts, run: Execution, now: datetime) -> str:
    """In a few words; its story has all of them."""
    details = run.wait_details
    match run.wait:
        case Wait.BATTERY if isinstance(minimum := details.get("minimum"), int | float):
            return _("Needs {percent} %").format(percent=formats.plain(minimum))
        case Wait.LATE_START if run.listed_until is not None:
            seconds = max(0, round((run.listed_until - now).total_seconds()))
            return _("Late, starts in {n} s").format(n=seconds)
        case Wait.PLACE if "place" in details:
            return _("{place} is full").format(place=details["place"])
        case Wait.CHECK_UP if "user" in details:
            return _("the app needs its own user at the fleet")
        case Wait.HOLD:
            hold = facts.hold(run.robot_id or 0, now)
            if hold is not None and hold.until is not None and hold.until < run.closes_at:
                return _("on hold")
            return _("on hold, not run from {time}").format(
                time=formats.clock_time(run.closes_at, facts.settings.timezone)
            )
    return {
        Wait.RETRY: _("No answer"),
        Wait.BATTERY: _("battery unknown"),
        Wait.LATE_START: _("Late"),
        Wait.CLOCK: _("the tablet's clock"),
        Wait.CHECK_UP: _("the fleet has to be checked up"),
        Wait.ELSEWHERE: _("may have run already"),
        Wait.ROBOT: _("waits for a robot"),
        Wait.PLACE: _("a place is full"),
    }[run.wait]


def _unknown(key: tuple[str, int], mission: str, at: str) -> Item:
    """One that ran ``at`` that time, and now perhaps not."""
    words, icon = _("not known now"), "help-circle-outline"
    return Item(key, mission, meta=words, lead=at, icon=icon, strong=False, opens=key[0] == OURS)


def _of_any(run: Execution, facts: HomeFacts) -> str:
    """Of a start for any robot of a fleet: which one it is on; there, that any was asked for."""
    here = facts.robot is not None and run.robot_id == facts.robot.id
    return run.taken_by if here else run.robot


def _now(facts: HomeFacts, item: QueueItem, key: tuple[str, int], old: bool, goes: bool, now: datetime) -> Item:
    mission, status = facts.name_of(item), facts.status_of(item)
    if old:
        at = formats.day_and_time(facts.snapshot.queue_read_at, facts.settings.timezone, now)
        return _unknown(key, mission, at)
    icon, tone = "play", "accent"
    if status is not None and status.state in STOPPED:
        icon, tone = "alert-circle", "fault"
    elif status is not None and status.user_prompt is not None:
        icon, tone = "comment-question", "action"
    elif status is not None and status.state is RobotState.PAUSE:
        icon, tone = "pause", "action"
    elif status is not None and status.state is RobotState.MANUAL_CONTROL:
        icon, tone = "pause", "attention"
    ours = facts.execution_of(item)
    row = Item(
        key,
        mission,
        _of_any(ours, facts) if ours else "",
        lead=_("Now"),
        icon=icon,
        tone=tone,
        look="tint",
        opens=key[0] == OURS,
    )
    if goes:
        return replace(row, meta=_("Being cancelled"))
    why = why_not(facts.snapshot.capabilities.cancel_running)
    return replace(row, actions=(Action("cancel", _("Cancel"), style="text", off=why),))


# ---------------------------------------------------------------------- what waits for a robot of a group
def _waiting(facts: HomeFacts, robot: Robot) -> list[Item]:
    zone, rows = facts.settings.timezone, []
    for run in group_starts(facts, robot):
        since = stuck_since(facts, run)
        actions: tuple[Action, ...] = (Action("here", _("Run here"), style="outlined", tone="attention"),)
        if since is not None and run.robot_id == robot.id:
            actions = ()
        if not run.held or since is not None:
            actions = (*actions, Action("cancel", icon="close"))
        rows.append(
            Item(
                ("waiting", run.id),
                _("{mission} · any of {group}").format(mission=facts.mission_names.run(run), group=run.robot_group),
                waits_for(facts, run),
                lead=formats.clock_time(max(run.created_at, run.planned_at), zone),
                icon="timer-sand",
                tone="attention",
                look="tint",
                meta=_("Being cancelled") if run.cancel_code else "",
                actions=() if run.cancel_code else actions,
            )
        )
    return rows


# ---------------------------------------------------------------------- planned
def _planned(facts: HomeFacts, robot: Robot, now: datetime) -> Iterator[Item]:
    zone, day, said = facts.settings.timezone, formats.day(now, facts.settings.timezone), ""
    for run in facts.planned:
        if formats.day(run.at, zone) != day:
            day = formats.day(run.at, zone)
            yield Item(("day", day), day, look="head", opens=False)
        held, why = facts.hold_of(run), _why_not_planned(facts, run, robot, now)
        meta, said = (why if why != said else ""), why
        yield Item(
            ("planned", run.schedule.id, run.at),
            planned_name(facts, run),
            meta=meta,
            meta_tone="attention" if foreseen.lack(run, facts.refused) else "",
            lead=formats.clock_time(run.at, zone),
            icon=HAND if held else "clock-outline",
            strong=False,
        )


def planned_name(facts: HomeFacts, run: PlannedRun) -> str:
    mission = facts.mission_names.start(run)
    if run.group is None:
        return mission
    return _("{mission} · any of {group}").format(mission=mission, group=run.group.name)


def _why_not_planned(facts: HomeFacts, run: PlannedRun, robot: Robot, now: datetime) -> str:
    """Why it may not start at its time; said once for starts that follow each other."""
    settings, status = facts.settings, facts.snapshot.status
    hold = facts.hold_of(run)
    if hold is not None:
        late = rules.closes_at(run.at, run.schedule.start_window_minutes, settings)
        return _("on hold, not run") if hold.until is not None and late <= hold.until else _("on hold")
    if lack := foreseen.lack(run, facts.refused):
        return lack
    is_stopped = status is not None and status.state in STOPPED and not is_old(facts.snapshot, now, settings)
    return _("if {robot} is back").format(robot=robot.name) if is_stopped else ""


# ---------------------------------------------------------------------- the robot without a mission
def next_words(facts: HomeFacts, robot: Robot, now: datetime) -> tuple[str, str]:
    """What comes next, and why its idle mission does not start or for what it is kept free."""
    run = next(iter(facts.planned), None)
    said = _kept_for(facts, now) or _idle_obstacle(facts, robot, run.at if run else None, now)
    if run is None:
        return ("" if facts.is_new else _("Nothing planned")), said
    words = _("Next about {time} {mission}") if run.is_approximate else _("Next {time} {mission}")
    held = held_note(facts.hold_of(run), run.at, run.schedule.start_window_minutes, facts.settings, now)
    at = formats.day_and_time(run.at, facts.settings.timezone, now)
    return words.format(time=at, mission=facts.mission_names.start(run)), held or said


def _kept_for(facts: HomeFacts, now: datetime) -> str:
    """The planned start for which the robot is kept free, though others wait."""
    missions = {row.wait_details.get("kept_for") for row in facts.open if has_no_robot(row)}
    soon = now + timedelta(seconds=AHEAD)
    run = next((run for run in facts.planned if run.mission.name in missions and run.at <= soon), None)
    if run is None:
        return ""
    name = names.own_schedule_name(run.schedule.name, run.mission.name, run.whose) or facts.mission_names.start(run)
    return _("Kept for {name} at {time}").format(name=name, time=formats.clock_time(run.at, facts.settings.timezone))


def _idle_obstacle(facts: HomeFacts, robot: Robot, next_planned_at: datetime | None, now: datetime) -> str:
    """Why the idle mission does not start now."""
    rule, status = robot.idle, facts.snapshot.status
    mission = next((mission for mission in facts.entered if rule is not None and mission.id == rule.mission_id), None)
    if (
        rule is None
        or not rule.enabled
        or mission is None
        or status is None
        or not idle.is_idle(status, bool(facts.snapshot.queue))
    ):
        return ""
    battery, minimum = status.battery_percentage, rules.minimum_battery(None, mission, facts.settings)
    match idle.obstacle(battery, minimum, next_planned_at, facts.settings, facts.calendar, now):
        case idle.Obstacle.DAY_OFF:
            return _("{mission}: not today, a day off").format(mission=mission.name)
        case idle.Obstacle.BATTERY if battery is None:
            return _("{mission} waits: battery unknown").format(mission=mission.name)
        case idle.Obstacle.BATTERY:
            return _("{mission} waits: battery under {minimum}").format(
                mission=mission.name, minimum=formats.percent(minimum)
            )
    return ""  # starts planned within minutes are shown already
