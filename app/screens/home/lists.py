"""The lists of Home: the robot's queue, what is planned next, what ended last. Pure."""

from __future__ import annotations

from dataclasses import dataclass, replace
from datetime import datetime

from app.domain import choice
from app.domain.models import Execution, Reason, ReasonCode, Robot, RobotSnapshot, State, Trigger, Wait
from app.domain.reasons import sentence
from app.domain.robot import QueueItem, QueueState
from app.i18n import _, ngettext
from app.screens.common import execution_appearance, foreseen, formats
from app.screens.common.holding import HAND, held_note, waiting_words
from app.screens.common.robot_appearance import HOLDING, STOPPED, battery_appearance, is_old, state_appearance
from app.screens.common.robot_groups import group_of, look_of, or_held
from app.screens.home.facts import HomeFacts
from app.services.planning.planned import PlannedRun


@dataclass(frozen=True)
class RobotSummary:
    """``key``: id of the robot."""

    key: int
    name: str
    word: str
    icon: str
    tone: str
    battery: str
    battery_icon: str
    battery_tone: str
    selected: bool


@dataclass(frozen=True)
class QueueEntry:
    """``key``: ("execution", id) for the app's, ("item", id of the queue item) for others', ("more", 0) for those only
    counted. A number or an icon shows its place."""

    key: tuple[str, int]
    mission: str
    origin: str = ""
    number: str = ""
    icon: str = ""
    tone: str = "neutral"
    loud: bool = False
    cancellable: bool = True
    runs: bool = False  # the robot is running it: cancelling stops the robot


@dataclass(frozen=True)
class PlannedStart:
    """``key``: id of the schedule and instant."""

    key: tuple[int, datetime]
    time: str
    mission: str
    note: str
    icon: str = ""  # blocked
    day: str = ""  # another one than today


@dataclass(frozen=True)
class FinishedRun:
    """``key``: id of the execution."""

    key: int
    icon: str
    tone: str
    abnormal: bool
    mission: str
    when: str
    reason: str


def robot_summaries(facts: HomeFacts, now: datetime) -> list[RobotSummary]:
    """Every robot with its state and battery."""
    return [
        _summary(robot, facts.snapshots.get(robot.id) or RobotSnapshot(robot.id), facts, now) for robot in facts.robots
    ]


def _summary(robot: Robot, snapshot: RobotSnapshot, facts: HomeFacts, now: datetime) -> RobotSummary:
    old = is_old(snapshot, now, facts.settings)
    battery = battery_appearance(None if old else snapshot.status, facts.settings)
    state = state_appearance(robot, snapshot, old)
    look = look_of(or_held(group_of(robot, snapshot, old, facts.settings), facts.holds, robot, now))
    return RobotSummary(
        robot.id,
        robot.name,
        look.word,
        state.icon if look.icon != HAND else HAND,
        state.tone,
        battery.text,
        battery.icon,
        "offline" if old else battery.tone,
        robot is facts.robot,
    )


# ---------------------------------------------------------------------- the queue
def queue_entries(facts: HomeFacts, now: datetime) -> list[QueueEntry]:
    """Running on top, then pending in order, then starts that wait here."""
    entries = []
    held, old = _is_held(facts), is_old(facts.snapshot, now, facts.settings)
    number, goes = 0, facts.robot is not None and facts.robot.id in facts.clearing
    seen: set[int] = set()  # ours; a copy of one is an item of its own
    for item in facts.queue:
        ours = facts.execution_of(item)
        if ours and ours.id in seen:
            ours = None
        elif ours:
            seen.add(ours.id)
        if item.state is QueueState.EXECUTING:
            entry = _running(facts, item, ours, held, old)
        else:
            number += 1
            entry = QueueEntry(_key(item, ours), facts.name_of(item), _pending_origin(facts, item, ours), str(number))
        entries.append(
            _cancelling(entry)
            if goes or facts.on_robot(item) in facts.cancelling or (ours and ours.cancel_code)
            else entry
        )
    if more := len(facts.snapshot.queue) - len(facts.queue):
        number += more
        entries.append(
            QueueEntry(
                ("more", 0),
                ngettext("and {n} more", "and {n} more", more).format(n=more),
                icon="dots-horizontal",
                cancellable=False,
            )
        )
    for e in facts.not_in_queue:
        if e.state in (State.WAITING, State.SUBMITTING):
            entry = _waiting(facts, e, now)
        elif e.cancel_code:  # waits for nothing: the robot has dropped it, and its end here follows the next reading
            entry = QueueEntry(("execution", e.id), facts.mission_names.run(e), icon="cancel")
        else:  # the robot has it, but its queue was read before; the entry keeps its place
            number += 1
            entry = QueueEntry(("execution", e.id), facts.mission_names.run(e), _since(facts, e), str(number))
        entries.append(_cancelling(entry) if goes or e.cancel_code else entry)
    return entries


def _key(item: QueueItem, ours: Execution | None) -> tuple[str, int]:
    return ("execution", ours.id) if ours else ("item", item.id)


def _cancelling(entry: QueueEntry) -> QueueEntry:
    return replace(entry, origin=_("Being cancelled"), cancellable=False)


def _is_held(facts: HomeFacts) -> bool:
    status = facts.snapshot.status
    return status is not None and status.state in HOLDING


def _running(facts: HomeFacts, item: QueueItem, ours: Execution | None, held: bool, old: bool) -> QueueEntry:
    status = facts.snapshot.status
    since = facts.running_since(item)
    started = formats.clock_time(since, facts.settings.timezone) if since else "–"
    words = _("{source} · held, started {time}") if held else _("{source} · started {time}")
    origin = _with_choice(words.format(source=source_of(item, ours), time=started), facts, ours)
    stopped = status is not None and status.state in STOPPED
    return QueueEntry(
        _key(item, ours),
        facts.name_of(item),
        origin,
        icon="pause" if held else "play",
        tone="offline" if old else "fault" if stopped else "accent",
        loud=not held and not old,
        runs=True,
    )


def _pending_origin(facts: HomeFacts, item: QueueItem, ours: Execution | None) -> str:
    if ours:
        return _since(facts, ours)
    source = source_of(item, ours)
    if item.ordered is None:
        return source
    by_robot = formats.wall_time(item.ordered)  # the robot's clock, which may differ from ours
    return _("{source} · {time} robot time").format(source=source, time=by_robot)


def _since(facts: HomeFacts, execution: Execution) -> str:
    since = formats.clock_time(
        execution.submitted_at or max(execution.created_at, execution.planned_at), facts.settings.timezone
    )
    return _with_choice(
        _("{source} · since {time}").format(source=trigger_words(execution), time=since), facts, execution
    )


def _with_choice(words: str, facts: HomeFacts, ours: Execution | None) -> str:
    """Why a start of a group came to this robot."""
    why = choice.chosen(ours.choice, facts.settings.timezone, _, whole=False) if ours is not None else ""
    return f"{words} · {why}" if why else words


def source_of(item: QueueItem, ours: Execution | None) -> str:
    """Its source: a schedule, idle automation or Run now; else the user named by the robot."""
    return trigger_words(ours) if ours else item.created_by_name or _("The robot itself")


def trigger_words(execution: Execution) -> str:
    match execution.trigger:
        case Trigger.MANUAL:
            return _("Run now")
        case Trigger.IDLE:
            return _("Idle automation")
    return execution.own_name or _("Schedule")


_WAIT_ICONS = {
    Wait.DUE: "timer-sand",
    Wait.RETRY: "refresh",
    Wait.BATTERY: "battery-alert-variant-outline",
    Wait.HOLD: HAND,
    Wait.LATE_START: "timer-alert-outline",
    Wait.CLOCK: "clock-alert-outline",
    Wait.ELSEWHERE: "magnify",
    Wait.ROBOT: "robot-outline",
    Wait.PLACE: "map-marker-outline",
}


def _waiting(facts: HomeFacts, execution: Execution, now: datetime) -> QueueEntry:
    """Not on the robot yet: what blocks it, and until when."""
    words = waiting_words(execution, facts.settings.timezone, facts.hold(execution.robot_id or 0, now))
    if execution.wait is Wait.LATE_START and execution.listed_until is not None:
        words = _("late, because the app was off; starts in {n} s").format(
            n=max(0, round((execution.listed_until - now).total_seconds()))
        )
    is_due = execution.wait is Wait.DUE or execution.state is State.SUBMITTING
    return QueueEntry(
        ("execution", execution.id),
        facts.mission_names.run(execution),
        _("{source} · {sentence}").format(source=trigger_words(execution), sentence=words),
        icon="upload-outline" if execution.state is State.SUBMITTING else _WAIT_ICONS[execution.wait],
        tone="neutral" if is_due else "attention",
    )


@dataclass(frozen=True)
class Blocked:
    """What waits here for something other than its turn; ``key`` of its first row in the queue."""

    text: str = ""
    key: tuple[str, int] | None = None


NOT_BLOCKED = Blocked()


def blocked(facts: HomeFacts) -> Blocked:
    """Shown above the queue, as the rows may be below the fold."""
    rows = [e for e in facts.not_in_queue if e.state is State.WAITING and e.wait is not Wait.DUE and not e.cancel_code]
    if not rows:
        return NOT_BLOCKED
    words = {
        Wait.RETRY: _("no answer"),
        Wait.BATTERY: _("battery"),
        Wait.HOLD: _("held"),
        Wait.LATE_START: _("late start"),
        Wait.CLOCK: _("the tablet's clock"),
        Wait.ELSEWHERE: _("may have run already"),
        Wait.ROBOT: _("the robot is busy"),
        Wait.PLACE: _("a place is full"),
    }
    why = ", ".join(dict.fromkeys(words[e.wait] for e in rows))
    return Blocked(
        ngettext("{n} blocked: {why}", "{n} blocked: {why}", len(rows)).format(n=len(rows), why=why),
        ("execution", rows[0].id),
    )


def queue_note(facts: HomeFacts, now: datetime) -> str:
    """How many run and wait; of a robot that doesn't answer, when that was read."""
    running = sum(1 for item in facts.snapshot.queue if item.state is QueueState.EXECUTING)
    waiting = len(facts.snapshot.queue) - running + sum(1 for e in facts.not_in_queue if not e.cancel_code)
    if is_old(facts.snapshot, now, facts.settings) and facts.snapshot.queue_read_at is not None:
        return _("as of {time}").format(time=formats.clock_time(facts.snapshot.queue_read_at, facts.settings.timezone))
    parts = []
    if running:
        parts.append((_("{n} held") if _is_held(facts) else _("{n} running")).format(n=running))
    if waiting:
        parts.append(ngettext("{n} waiting", "{n} waiting", waiting).format(n=waiting))
    return ", ".join(parts)


def queue_empty(facts: HomeFacts, robot: Robot, now: datetime) -> str:
    if not robot.enabled:
        return _("The queue of a robot that is switched off is not read.")
    if facts.snapshot.queue_read_at is None:
        return _("Not read yet")
    if is_old(facts.snapshot, now, facts.settings):
        return _("The queue was empty when {robot} last answered.").format(robot=robot.name)
    return _(
        "{robot} has nothing to do. Missions from a schedule, from Run now or from the robot's own screen appear here."
    ).format(robot=robot.name)


# ---------------------------------------------------------------------- before and after
def planned_starts(facts: HomeFacts, now: datetime) -> list[PlannedStart]:
    """The next starts of all robots, in the zone of the settings."""
    zone = facts.settings.timezone
    starts = []
    for run in facts.planned:
        held, soon = held_words(facts, run, now), (run.at - now).total_seconds()
        day = "" if formats.day(run.at, zone) == formats.day(now, zone) else formats.day(run.at, zone)
        kept = held or foreseen.lack(run)
        snapshot = facts.snapshots.get(run.robot.id) or RobotSnapshot(run.robot.id)
        silence = "" if kept else foreseen.silence(run, snapshot.connection)
        note = (foreseen.whose(run), silence, kept or (formats.ahead(soon) if soon < formats.DAY else ""))
        starts.append(
            PlannedStart(
                (run.schedule.id, run.at),
                formats.clock_time(run.at, zone),
                facts.mission_names.start(run),
                " · ".join(filter(None, note)),
                HAND if held else "",
                day,
            )
        )
    return starts


def held_words(facts: HomeFacts, run: PlannedRun, now: datetime) -> str:
    """Whether a planned start is held, and until when; empty when it is not."""
    return held_note(facts.hold_of(run), run.at, run.schedule.start_window_minutes, facts.settings, now)


def planned_empty(facts: HomeFacts) -> str:
    """Why nothing is planned."""
    if names := [robot.name for robot in facts.robots if robot.needs_password]:
        return ngettext(
            "Nothing starts on {robots} before its password is entered in Settings.",
            "Nothing starts on {robots} before their passwords are entered in Settings.",
            len(names),
        ).format(robots=", ".join(names))
    return _("Nothing is planned. A schedule says when a mission runs; the Scheduler makes one.")


def finished_runs(facts: HomeFacts, now: datetime) -> list[FinishedRun]:
    """The last ended executions of all robots with their reason line."""
    return [_finished(facts, e, now) for e in facts.finished]


def _finished(facts: HomeFacts, execution: Execution, now: datetime) -> FinishedRun:
    icon, tone = execution_appearance.LOOKS[execution.state]
    at = formats.day_and_time(execution.ended_at or execution.planned_at, facts.settings.timezone, now)
    return FinishedRun(
        execution.id,
        icon,
        tone,
        tone in ("fault", "attention"),
        facts.mission_names.run(execution),
        f"{execution.robot or execution.robot_group} {at}",
        outcome_line(execution),
    )


def outcome_line(execution: Execution) -> str:
    """How it ended, in one line."""
    if execution.state is State.COMPLETED:
        if execution.duration_s is None:
            return _("Completed")
        return _("Completed in {duration}").format(duration=formats.duration(execution.duration_s))
    if execution.reason is not None and _says_outcome(execution.reason):
        return _reason(execution)
    return _("{outcome}: {reason}").format(
        outcome=execution_appearance.word(execution.state), reason=_reason(execution)
    )


def _says_outcome(reason: Reason) -> bool:
    """Whether its sentence begins with the outcome."""
    return reason.code in (ReasonCode.USER_CANCELLED, ReasonCode.QUEUE_CLEARED)


def _reason(execution: Execution) -> str:
    reason = execution.reason
    if reason is None:
        return "–"
    if reason.code is ReasonCode.ROBOT_ABORTED and (message := reason.details.get("message")):
        return str(message)  # the line says already that it failed
    return sentence(reason, execution.timezone, _)
