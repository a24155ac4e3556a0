"""The lists of Home as rows: the robot's queue, what is planned next, what ended last. Pure."""
from __future__ import annotations

from datetime import datetime
from typing import Any

from app.domain.models import Execution, ReasonCode, Robot, State, Trigger, Wait
from app.domain.reasons import sentence, waiting_sentence
from app.domain.robot import QueueItem, QueueState, RobotState
from app.i18n import _, ngettext
from app.screens.common import execution_appearance, formats
from app.screens.common.robot_appearance import STOPPED, is_old
from app.screens.home.facts import HomeFacts

Row = dict[str, Any]

HOLDING = (RobotState.PAUSE, RobotState.MANUAL_CONTROL, *STOPPED)


# ---------------------------------------------------------------------- the queue
def queue_rows(facts: HomeFacts, now: datetime) -> list[Row]:
    """Running on top, then pending in order, then what waits here to be sent. Keys: ("execution", id) for ours, else ("item", id)."""
    rows: list[Row] = []
    held, old = _is_held(facts), is_old(facts.snapshot, now, facts.settings)
    number = 0
    for item in facts.snapshot.queue:
        ours = facts.execution_of(item)
        number += item.state is not QueueState.EXECUTING
        rows.append({"key": ("execution", ours.id) if ours else ("item", item.id), "mission": facts.name_of(item),
                     **(_running(facts, item, ours, held, old) if item.state is QueueState.EXECUTING
                        else _pending(facts, item, ours, number)),
                     **_cancelling(ours, item.id in facts.cancelling)})
    for e in facts.not_in_queue:
        if e.state in (State.WAITING, State.SUBMITTING):
            words = _waiting(facts, e, now)
        else:                                # the robot has it, but its queue was read before that; the row stays where it is
            number += 1
            words = {"number": str(number), "origin": _since(facts, e)}
        rows.append({"key": ("execution", e.id), "mission": e.mission, **words, **_cancelling(e, False)})
    return rows


def _is_held(facts: HomeFacts) -> bool:
    status = facts.snapshot.status
    return status is not None and status.state in HOLDING


def _running(facts: HomeFacts, item: QueueItem, ours: Execution | None, held: bool, old: bool) -> Row:
    status = facts.snapshot.status
    since = ours.started_at if ours and ours.started_at else facts.seen_running.get(item.id)
    started = formats.clock_time(since, facts.settings.timezone) if since else "–"
    words = _("{source} · held, started {time}") if held else _("{source} · started {time}")
    stopped = status is not None and status.state in STOPPED
    return {"icon": "pause" if held else "play", "tone": "offline" if old else "fault" if stopped else "accent",
            "loud": not held and not old,
            "origin": words.format(source=source_of(item, ours), time=started)}


def _pending(facts: HomeFacts, item: QueueItem, ours: Execution | None, number: int) -> Row:
    if ours:
        return {"number": str(number), "origin": _since(facts, ours)}
    source = source_of(item, ours)
    if item.ordered is None:
        return {"number": str(number), "origin": source}
    by_robot = formats.wall_time(item.ordered)       # the robot's clock, which may be another one than ours
    return {"number": str(number), "origin": _("{source} · {time} by its clock").format(source=source, time=by_robot)}


def _since(facts: HomeFacts, execution: Execution) -> str:
    since = formats.clock_time(execution.submitted_at or max(execution.created_at, execution.planned_at), facts.settings.timezone)
    return _("{source} · since {time}").format(source=trigger_words(execution), time=since)


def source_of(item: QueueItem, ours: Execution | None) -> str:
    """Who put it there: our schedule, idle automation or Run now; else the user whom the robot names."""
    return trigger_words(ours) if ours else item.created_by_name or _("The robot itself")


def trigger_words(execution: Execution) -> str:
    match execution.trigger:
        case Trigger.MANUAL:
            return _("Run now")
        case Trigger.IDLE:
            return _("Idle automation")
    return execution.schedule or _("Schedule")


def _cancelling(ours: Execution | None, asked: bool) -> Row:
    return {"origin": _("Being cancelled"), "cancellable": False} if asked or (ours and ours.cancel_code) else {}


_WAIT_ICONS = {Wait.DUE: "timer-sand", Wait.RETRY: "refresh", Wait.BATTERY: "battery-alert-variant-outline",
               Wait.HOLD: "hand-back-right-outline", Wait.LATE_START: "timer-alert-outline", Wait.CLOCK: "clock-alert-outline"}


def _waiting(facts: HomeFacts, execution: Execution, now: datetime) -> Row:
    """Not on the robot yet: what holds it, and until when."""
    words = waiting_sentence(execution, facts.settings.timezone, _)
    if execution.wait is Wait.LATE_START and execution.hold_until is not None:
        words = _("late, because the app was off; starts in {n} s").format(n=max(0, round((execution.hold_until - now).total_seconds())))
    is_due = execution.wait is Wait.DUE or execution.state is State.SUBMITTING
    return {"icon": "upload-outline" if execution.state is State.SUBMITTING else _WAIT_ICONS[execution.wait],
            "tone": "neutral" if is_due else "attention",
            "origin": _("{source} · {sentence}").format(source=trigger_words(execution), sentence=words)}


def queue_note(facts: HomeFacts, now: datetime) -> str:
    """How many run and wait; of a robot out of sight, when that was read."""
    rows = queue_rows(facts, now)
    running = sum(1 for item in facts.snapshot.queue if item.state is QueueState.EXECUTING)
    waiting = len(rows) - running
    if is_old(facts.snapshot, now, facts.settings) and facts.snapshot.queue_read_at is not None:
        return _("as of {time}").format(time=formats.clock_time(facts.snapshot.queue_read_at, facts.settings.timezone))
    parts = []
    if running:
        parts.append((_("{n} held") if _is_held(facts) else _("{n} running")).format(n=running))
    if waiting:
        parts.append(ngettext("{n} waiting", "{n} waiting", waiting).format(n=waiting))
    return ", ".join(parts)


def queue_empty(facts: HomeFacts, robot: Robot) -> str:
    if facts.snapshot.queue_read_at is None:
        return _("Not read yet")
    return _("{robot} has nothing to do. Missions from a schedule, from Run now or from the robot's own screen stand here.").format(
        robot=robot.name)


# ---------------------------------------------------------------------- before and after
def planned_rows(facts: HomeFacts, now: datetime) -> list[Row]:
    """The next starts of all robots, in the zone of the settings."""
    zone = facts.settings.timezone
    return [{"key": (run.schedule.id, run.at), "time": formats.clock_time(run.at, zone), "mission": run.mission.name,
             "note": f"{run.robot.name} · {_how_soon(run.at, now, zone)}"} for run in facts.planned]


def _how_soon(at: datetime, now: datetime, zone: str) -> str:
    """Within a day how long until then; beyond it the day, as the time stands beside it."""
    seconds = (at - now).total_seconds()
    return formats.ahead(seconds) if seconds < formats.DAY else formats.day(at, zone)


def finished_rows(facts: HomeFacts, now: datetime) -> list[Row]:
    """The last ended executions of all robots with their reason line."""
    return [_finished(facts, e, now) for e in facts.finished]


def _finished(facts: HomeFacts, execution: Execution, now: datetime) -> Row:
    icon, tone = execution_appearance.LOOKS[execution.state]
    zone = facts.settings.timezone
    at = execution.ended_at or execution.planned_at
    return {"key": execution.id, "icon": icon, "tone": tone, "abnormal": tone in ("fault", "attention"), "mission": execution.mission,
            "when": f"{execution.robot} {formats.day_and_time(at, zone, now)}", "reason": outcome_line(execution)}


def outcome_line(execution: Execution) -> str:
    """How it ended, in one line."""
    if execution.state is State.COMPLETED:
        if execution.duration_s is None:
            return _("Completed")
        return _("Completed in {duration}").format(duration=formats.duration(execution.duration_s))
    return _("{outcome}: {reason}").format(outcome=execution_appearance.word(execution.state), reason=_reason(execution))


def _reason(execution: Execution) -> str:
    reason = execution.reason
    if reason is None:
        return "–"
    if reason.code is ReasonCode.ROBOT_ABORTED and (message := reason.details.get("message")):
        return str(message)              # the line says already that it failed; the robot's words are what is new
    return sentence(reason, execution.timezone, _)
