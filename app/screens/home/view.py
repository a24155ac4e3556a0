"""The facts of one moment in words. Pure; called once a second, so that ages and elapsed times run on."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from datetime import datetime, timedelta

from app.database.robots import Hold
from app.domain import rules
from app.domain.activity import is_charging
from app.domain.message import render
from app.domain.models import Connection, Robot, RobotSnapshot, Settings
from app.domain.robot import QueueItem, RobotState, RobotStatus, UserPrompt, problems_in_words
from app.i18n import _, ngettext
from app.screens.common import formats
from app.screens.common.formats import LONGEST_QUESTION
from app.screens.common.holding import state_and_hold, until_words
from app.screens.common.problems import words_of
from app.screens.common.robot_appearance import (
    NO_BATTERY,
    STOPPED,
    BatteryAppearance,
    battery_appearance,
    is_old,
    link_appearance,
    state_appearance,
)
from app.screens.common.robot_groups import FEW, Group, group_of
from app.screens.home.facts import HomeFacts
from app.screens.home.fleet import LONGER_THAN_USUAL
from app.screens.home.lists import (
    NOT_BLOCKED,
    Blocked,
    FinishedRun,
    PlannedStart,
    QueueEntry,
    RobotSummary,
    blocked,
    finished_runs,
    held_words,
    planned_empty,
    planned_starts,
    queue_empty,
    queue_entries,
    queue_note,
    robot_summaries,
)
from app.screens.home.map import NO_MAP, MapView, map_view, own_words
from app.screens.home.run_now import RunView, run_now
from app.screens.home.waiting import kept_for
from app.services.dispatch import idle


@dataclass(frozen=True)
class MissionView:
    """The running mission, or the problem and what a person can do about it."""

    label: str = ""
    name: str = "–"
    note: str = ""
    tone: str = "neutral"
    progress: float = -1.0  # 0..1, −1: not known
    elapsed: str = ""


@dataclass(frozen=True)
class LabelledValue:
    label: str
    value: str


@dataclass(frozen=True)
class TileView:
    icon: str = "lan-connect"
    label: str = ""
    value: str = "–"
    note: str = ""
    note_icon: str = ""
    tone: str = "neutral"  # of the note


@dataclass(frozen=True)
class CardView:
    """The robot: state, mission, battery, and its end time or connection."""

    state: str = "–"
    icon: str = "robot-off-outline"
    tone: str = "offline"
    loud: bool = False
    note: str = ""
    mission: MissionView = field(default_factory=MissionView)
    battery: BatteryAppearance = NO_BATTERY
    battery_mark: float = -1.0  # the minimum, 0..1
    battery_minimum: str = ""  # in words
    old: bool = True  # values are shown as stale
    end_tile: TileView = field(default_factory=TileView)
    message_label: str = ""
    message: str = ""  # in the robot's own words, or what is wrong with the connection
    facts: tuple[LabelledValue, ...] = ()


@dataclass(frozen=True)
class ControlsView:
    """The buttons say what they will do. ``next_step`` is the action that the robot waits for, the most prominent on
    the page: to "answer", "reset" or "resume" it, or for "hands" on it."""

    next_step: str = ""
    pauses: bool = True  # else it resumes
    pause: str = ""
    pause_icon: str = "pause"
    pause_style: str = "tonal"
    reset_style: str = "outlined"
    pause_off: bool = True
    reset_off: bool = True
    clear_count: int = 0

    @property
    def step_in(self) -> str:
        """The part of the robot's card in which the next step is."""
        return {"answer": "prompt", "reset": "controls", "resume": "controls", "hands": "mission"}.get(
            self.next_step, ""
        )


@dataclass(frozen=True)
class PromptView:
    """A question of the running mission; empty ``guid``: none."""

    guid: str = ""
    question: str = ""
    options: tuple[str, ...] = ()


@dataclass(frozen=True)
class HomeView:
    has_robots: bool = False
    robots: tuple[RobotSummary, ...] = ()  # none if there are many: then they have a page
    card: CardView = field(default_factory=CardView)
    controls: ControlsView = field(default_factory=ControlsView)
    prompt: PromptView = field(default_factory=PromptView)
    map: MapView = NO_MAP
    queue: tuple[QueueEntry, ...] = ()
    queue_note: str = ""
    queue_blocked: Blocked = NOT_BLOCKED
    queue_empty: str = ""
    planned: tuple[PlannedStart, ...] = ()
    planned_empty: str = ""
    finished: tuple[FinishedRun, ...] = ()
    run: RunView = field(default_factory=RunView)


def present(facts: HomeFacts, now: datetime, chosen_mission: int | None = None) -> HomeView:
    """``chosen_mission`` is the one picked for Run now."""
    robot = facts.robot
    if robot is None:
        return HomeView()
    shown, old = card(facts, robot, now), is_old(facts.snapshot, now, facts.settings)
    return HomeView(
        has_robots=True,
        robots=tuple(robot_summaries(facts, now)) if len(facts.robots) <= FEW else (),
        card=shown,
        controls=controls(facts, robot, old),
        prompt=prompt(facts.snapshot, old),
        map=map_view(facts, now, shown.tone, old),
        queue=tuple(queue_entries(facts, now)),
        queue_note=queue_note(facts, now),
        queue_blocked=blocked(facts),
        queue_empty=queue_empty(facts, robot, now),
        planned=tuple(planned_starts(facts, now)),
        planned_empty=planned_empty(facts),
        finished=tuple(finished_runs(facts, now)),
        run=run_now(facts, robot, chosen_mission, now),
    )


# ---------------------------------------------------------------------- the robot
def card(facts: HomeFacts, robot: Robot, now: datetime) -> CardView:
    snapshot, settings = facts.snapshot, facts.settings
    old = is_old(snapshot, now, settings)
    state, hold = state_appearance(robot, snapshot, old), _hold(facts, robot, now)
    minimum = settings.minimum_battery_percent
    return CardView(
        state=state_and_hold(state.word, hold),
        icon=state.disc_icon or state.icon,
        tone=state.tone,
        loud=state.loud,
        note=" · ".join(filter(None, (robot.name, robot.model, until_words(hold, settings, now) if hold else ""))),
        mission=_mission(facts, robot, now, old),
        battery=_battery(snapshot, settings, old, now),
        battery_mark=minimum / 100 if minimum else -1.0,
        old=old,
        battery_minimum=_("min {minimum} %").format(minimum=formats.plain(minimum)) if minimum else "",
        end_tile=_done_about(facts, now, old or not robot.enabled) or _reached(robot, snapshot, settings, now),
        message_label=_("What is wrong") if old else _("At the moment"),
        message=words_of(snapshot.problem) if old else own_words(snapshot.status),
        facts=() if old or snapshot.status is None else _figures(snapshot.status),
    )


def _hold(facts: HomeFacts, robot: Robot, now: datetime) -> Hold | None:
    """A person's, on a robot that would get something otherwise."""
    hold = facts.hold(robot.id, now)
    return hold if hold is not None and robot.enabled and not (hold.clock or hold.is_copy) else None


def _reached(robot: Robot, snapshot: RobotSnapshot, settings: Settings, now: datetime) -> TileView:
    link = link_appearance(robot, snapshot, now, settings)
    return TileView("lan-connect", _("Address"), formats.address(robot.address), link.word, link.icon, link.tone)


def _done_about(facts: HomeFacts, now: datetime, old: bool) -> TileView | None:
    """When the present run will probably end; None if unknown."""
    item, status = facts.running, facts.snapshot.status
    if item is None or status is None or old or status.state in (*STOPPED, RobotState.PAUSE) or is_charging(status):
        return None
    usual, since = facts.expected.get(facts.guid_of(item)), facts.working_since(item, now)
    if usual is None or not usual.median_s or since is None:
        return None
    end = since + timedelta(seconds=usual.median_s)
    left = (end - now).total_seconds()
    if left <= 0:
        return TileView("timer-outline", _("Longer than usual"), f"+{formats.rough_duration(-left)}")
    return TileView(
        "timer-outline",
        _("Done about"),
        formats.day_and_time(end, facts.settings.timezone, now),
        _("{time} left").format(time=formats.rough_duration(left)),
    )


def _battery(snapshot: RobotSnapshot, settings: Settings, old: bool, now: datetime) -> BatteryAppearance:
    """An old reading shows its time, but no remaining time and no charging."""
    battery = battery_appearance(snapshot.status, settings)
    if not old or battery.level < 0:
        return battery
    return replace(
        battery, note=_("as of {time}").format(time=formats.day_and_time(snapshot.read_at, settings.timezone, now))
    )


def _mission(facts: HomeFacts, robot: Robot, now: datetime, old: bool) -> MissionView:
    snapshot = facts.snapshot
    status = snapshot.status
    if not robot.enabled:
        return MissionView(
            _("Mission"),
            _("Not asked"),
            _("Its password has to be entered in Settings")
            if robot.needs_password
            else _("The robot is switched off in Settings"),
        )
    if old or status is None:
        return _last_known(facts, snapshot, now)
    if status.state is RobotState.EMERGENCY_STOP:
        return MissionView(
            _("What to do now"), _("Release the red button, then press Reset on the robot"), _errors(status), "fault"
        )
    if has_errors(status):
        tone, said = "fault" if status.state is RobotState.ERROR else "attention", error_words(status)
        if can_reset(status):
            hint = (
                _("Reset errors did not clear it: remove its cause first")
                if facts.has_reset_no_effect
                else _("Reset errors clears it; the robot then waits for Resume")
            )
            return MissionView(_("What the robot says"), said, hint, tone)
        return MissionView(_("What to do now"), _("It can't be reset from here: check the robot itself"), said, tone)
    if facts.running is not None:
        return _running(facts, facts.running, now)
    if status.state is RobotState.EXECUTING:  # its queue is still to be read, as when it answers again
        return MissionView(_("Mission"), "–", _("the robot is being asked"))
    hint = (
        _("Resume lets the robot take missions again") if status.state is RobotState.PAUSE else _next(facts, robot, now)
    )
    return MissionView(_("Mission"), _("None"), hint)


def _next(facts: HomeFacts, robot: Robot, now: datetime) -> str:
    """The idle robot's next mission, if it is among the next planned starts."""
    run = next((run for run in facts.planned if run.robot.id == robot.id), None)
    if run is None:
        return (
            kept_for(facts, robot, now)
            or _idle_obstacle(facts, robot, None, now)
            or ("" if facts.planned else _("nothing is planned"))
        )
    when = held_words(facts, run, now) or formats.until(run.at, now, facts.settings.timezone)
    words = _("probably next: {mission}, {when}") if run.is_approximate else _("next: {mission}, {when}")
    planned = kept_for(facts, robot, now) or words.format(mission=facts.mission_names.start(run), when=when)
    return " · ".join(filter(None, (planned, _idle_obstacle(facts, robot, run.at, now))))


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
            return _("{mission} when idle: not today, a day off").format(mission=mission.name)
        case idle.Obstacle.BATTERY if battery is None:
            return _("{mission} when idle waits: battery unknown").format(mission=mission.name)
        case idle.Obstacle.BATTERY:
            return _("{mission} when idle waits: battery {battery}, needs {minimum}").format(
                mission=mission.name, battery=formats.percent(battery), minimum=formats.percent(minimum)
            )
    return ""  # starts planned within minutes are shown already


def _last_known(facts: HomeFacts, snapshot: RobotSnapshot, now: datetime) -> MissionView:
    running = facts.running
    if snapshot.read_at is None:
        return MissionView(_("Mission"))
    since = formats.day_and_time(snapshot.read_at, facts.settings.timezone, now)
    return MissionView(
        _("Last known mission"),
        facts.name_of(running) if running else "–",
        _("unknown since {time}").format(time=since),
    )


def _running(facts: HomeFacts, item: QueueItem, now: datetime) -> MissionView:
    status = facts.snapshot.status
    ours, since = facts.execution_of(item), facts.working_since(item, now)
    elapsed = max(0.0, (now - since).total_seconds()) if since else None
    usual = facts.expected.get(facts.guid_of(item))
    is_paused = status is not None and status.state is RobotState.PAUSE
    view = MissionView(
        _("Mission, held by the pause") if is_paused else _("Mission"),
        facts.name_of(item),
        elapsed=formats.duration(elapsed),
    )
    if is_charging(status):  # ends when the robot is charged or gets another mission, not after a usual time
        return replace(view, note="" if is_paused else _("charging: not compared with earlier runs"))
    if not usual or not usual.median_s or elapsed is None:
        return replace(
            view, note=_("no earlier run to compare with") if ours else _("since this tablet has seen it run")
        )
    duration = formats.duration(usual.median_s)
    view = replace(view, progress=min(1.0, elapsed / usual.median_s))
    if usual.typed:
        return replace(view, note=_("of {duration} as typed in Settings").format(duration=duration))
    if elapsed > LONGER_THAN_USUAL * usual.median_s:
        return replace(view, note=_("usually {duration}").format(duration=duration), tone="attention")
    return replace(view, note=_("of usually {duration}").format(duration=duration))


def _errors(status: RobotStatus) -> str:
    return render(problems_in_words(status.errors), _)


def error_words(status: RobotStatus) -> str:
    """What stops it from working, if anything."""
    return _errors(status) or status.mission_text or _("An error")


def _figures(status: RobotStatus) -> tuple[LabelledValue, ...]:
    """What else the robot reports."""
    return (
        LabelledValue(_("Speed"), formats.number(status.linear_velocity, 1, "m/s")),
        LabelledValue(_("To the goal"), formats.number(status.distance_to_next_target, 1, "m")),
        LabelledValue(_("Driven"), formats.number(status.moved / 1000 if status.moved is not None else None, 0, "km")),
    )


def prompt(snapshot: RobotSnapshot, old: bool) -> PromptView:
    asked: UserPrompt | None = snapshot.status.user_prompt if snapshot.status and not old else None
    if asked is None:
        return PromptView()
    question, more = asked.question, asked.more_options
    if len(question) > LONGEST_QUESTION:
        question = _("{question} … read all of it at the robot").format(
            question=question[:LONGEST_QUESTION].rsplit(" ", 1)[0]
        )
    if more:
        question += " " + ngettext(
            "({n} more answer can be given at the robot)", "({n} more answers can be given at the robot)", more
        ).format(n=more)
    return PromptView(asked.guid, question, asked.options)


# ---------------------------------------------------------------------- the controls
def has_errors(status: RobotStatus) -> bool:
    return status.state is RobotState.ERROR or bool(status.errors)


def can_reset(status: RobotStatus | None) -> bool:
    """Whether Reset errors would change something: the emergency stop and other errors are solved at the robot itself."""
    if status is None or status.state is RobotState.EMERGENCY_STOP:
        return False
    if status.errors:
        return any(error.resettable for error in status.errors)
    return status.state is RobotState.ERROR


def _next_step(facts: HomeFacts, robot: Robot, old: bool) -> str:
    """The way out of a stop is Reset errors, then Resume."""
    status = facts.snapshot.status
    if status is None or not robot.enabled:
        return ""
    match group_of(robot, facts.snapshot, old, facts.settings):
        case Group.STOPPED:
            return "reset" if can_reset(status) else "hands"
        case Group.LOOK if has_errors(status):
            return "reset" if can_reset(status) else "hands"
        case Group.ASKS:
            return "answer"
        case Group.PAUSED:
            return "resume"
    return ""


def controls(facts: HomeFacts, robot: Robot, old: bool) -> ControlsView:
    """Pause can be tried even on a robot that doesn't answer just now: stopping must never wait for the next poll."""
    status = facts.snapshot.status
    state = status.state if status else RobotState.UNKNOWN
    answers = facts.snapshot.connection in (Connection.CONNECTED, Connection.SLOW)
    off = not robot.enabled or (answers and state in (RobotState.STARTING, RobotState.SHUTTING_DOWN))
    resumes = state in (RobotState.PAUSE, *STOPPED)
    next_step = _next_step(facts, robot, old)
    count = len(facts.snapshot.queue) + len(facts.not_in_queue)
    return ControlsView(
        next_step=next_step,
        reset_style="filled" if next_step == "reset" else "outlined",
        pauses=not resumes,
        pause=_("Resume") if resumes else _("Pause"),
        pause_icon="play" if resumes else "pause",
        pause_style="filled" if next_step == "resume" else "outlined" if state in STOPPED else "tonal",
        pause_off=off or state in STOPPED,
        reset_off=not robot.enabled or not can_reset(status),
        clear_count=count if robot.enabled else 0,
    )
