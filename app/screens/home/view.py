"""Home in words: what the facts of one moment look like. Pure; called once a second, so that ages and elapsed times run on."""
from __future__ import annotations

from dataclasses import dataclass, field
from datetime import datetime
from typing import Any

from app.domain.models import Connection, Robot, RobotSnapshot
from app.domain.robot import QueueItem, RobotState, RobotStatus, UserPrompt
from app.i18n import _
from app.screens.common import formats
from app.screens.common.problems import words_of
from app.screens.common.robot_appearance import NO_BATTERY, STOPPED, BatteryLook, battery_look, chips, is_old, link_look, state_look
from app.screens.home.facts import HomeFacts
from app.screens.home.lists import finished_rows, planned_rows, queue_empty, queue_note, queue_rows
from app.screens.home.map import NO_MAP, MapView, map_view

CHIPS = 4                                # missions offered by one tap where none is marked as a favourite
LONGER_THAN_USUAL = 1.5                  # times the usual duration, from which on it is told

Row = dict[str, Any]


@dataclass(frozen=True)
class CardView:
    """The robot: what it does, how it is, where it answers."""
    state: str = "–"
    icon: str = "robot-off-outline"
    tone: str = "offline"
    loud: bool = False
    note: str = ""
    mission_tone: str = "neutral"
    mission_label: str = ""
    mission: str = "–"
    progress: float = -1.0               # 0..1, −1: not known
    elapsed: str = ""
    usual: str = ""
    battery: BatteryLook = NO_BATTERY
    battery_mark: float = -1.0           # the minimum, 0..1
    old: bool = True                     # values must look stale
    address: str = "–"
    link: str = ""
    link_icon: str = "wifi-off"
    link_tone: str = "neutral"
    says_label: str = ""
    says: str = ""                       # in the robot's own words, or what is wrong with the connection
    facts: tuple[Row, ...] = ()


@dataclass(frozen=True)
class ControlsView:
    """The buttons say what they will do."""
    pauses: bool = True                  # else it resumes
    pause: str = ""
    pause_icon: str = "pause"
    pause_style: str = "tonal"
    pause_off: bool = True
    reset_off: bool = True
    clear_count: int = 0


@dataclass(frozen=True)
class PromptView:
    """A question of the running mission; empty ``guid``: none."""
    guid: str = ""
    question: str = ""
    options: tuple[str, ...] = ()


@dataclass(frozen=True)
class RunView:
    """Run now. ``off`` when it can't be pressed; the button then says why."""
    note: str = ""
    mission_id: int | None = None
    mission: str = ""
    chips: tuple[Row, ...] = ()
    text: str = ""
    off: bool = True
    low_battery: str = ""                # the question that comes before it runs all the same


@dataclass(frozen=True)
class HomeView:
    has_robots: bool = False
    robots: tuple[Row, ...] = ()
    card: CardView = field(default_factory=CardView)
    controls: ControlsView = field(default_factory=ControlsView)
    prompt: PromptView = field(default_factory=PromptView)
    map: MapView = NO_MAP
    queue: tuple[Row, ...] = ()
    queue_note: str = ""
    queue_empty: str = ""
    planned: tuple[Row, ...] = ()
    finished: tuple[Row, ...] = ()
    run: RunView = field(default_factory=RunView)


def present(facts: HomeFacts, now: datetime, chosen_mission: int | None = None) -> HomeView:
    """``chosen_mission`` is the one picked for Run now."""
    robot = facts.robot
    if robot is None:
        return HomeView()
    shown, old = card(facts, robot, now), is_old(facts.snapshot, now, facts.settings)
    return HomeView(
        has_robots=True, robots=tuple(chips(facts.robots, facts.snapshots, robot.id, now, facts.settings)),
        card=shown, controls=controls(facts, robot), prompt=prompt(facts.snapshot, old), map=map_view(facts, now, shown.tone, old),
        queue=tuple(queue_rows(facts, now)), queue_note=queue_note(facts, now), queue_empty=queue_empty(facts, robot),
        planned=tuple(planned_rows(facts, now)), finished=tuple(finished_rows(facts, now)), run=run_now(facts, robot, chosen_mission))


# ---------------------------------------------------------------------- the robot
def card(facts: HomeFacts, robot: Robot, now: datetime) -> CardView:
    snapshot, settings = facts.snapshot, facts.settings
    old = is_old(snapshot, now, settings)
    look, link = state_look(robot, snapshot, old), link_look(robot, snapshot, now, settings)
    minimum = settings.minimum_battery_percent
    return CardView(
        state=look.word, icon=look.disc_icon or look.icon, tone=look.tone, loud=look.loud,
        note=" · ".join(filter(None, (robot.name, robot.model))),
        battery=battery_look(snapshot.status, settings), battery_mark=minimum / 100 if minimum else -1.0, old=old,
        address=formats.address(robot.address), link=link.word, link_icon=link.icon, link_tone=link.tone,
        says_label=_("What is wrong") if old else _("At the moment"),
        says=words_of(snapshot.problem) if old else snapshot.status.mission_text if snapshot.status else "",
        facts=() if old else tuple(_facts(snapshot.status)), **_mission(facts, robot, now, old))


def _mission(facts: HomeFacts, robot: Robot, now: datetime, old: bool) -> dict[str, Any]:
    """The block that says what runs, or what is wrong, and what a person can do about it."""
    snapshot = facts.snapshot
    status = snapshot.status
    if not robot.enabled:
        return {"mission_label": _("Mission"), "mission": _("Not watched"), "usual": _("The robot is switched off in Settings")}
    if old or status is None:
        return _out_of_sight(facts, snapshot, now)
    if status.state is RobotState.EMERGENCY_STOP:
        return {"mission_tone": "fault", "mission_label": _("What the robot says"),
                "mission": _errors(status) or _("Emergency stop is pressed"),
                "usual": _("Release the red button, then press Reset on the robot")}
    if status.state is RobotState.ERROR or status.errors:
        way_out = _("Reset errors clears it; the robot then waits for Resume") if can_reset(status) else \
            _("It can't be reset from here: see to the robot itself")
        return {"mission_tone": "fault" if status.state is RobotState.ERROR else "attention", "mission_label": _("What the robot says"),
                "mission": _errors(status) or status.mission_text or _("An error"), "usual": way_out}
    running = facts.running
    if running is None:
        hint = _("Resume lets the robot take missions again") if status.state is RobotState.PAUSE else _next(facts, robot, now)
        return {"mission_label": _("Mission"), "mission": _("None"), "usual": hint}
    return _running(facts, running, now)


def _next(facts: HomeFacts, robot: Robot, now: datetime) -> str:
    """What the idle robot will do next, as far as it is among the next planned."""
    run = next((run for run in facts.planned if run.robot.id == robot.id), None)
    if run is None:
        return ""
    return _("next: {mission}, {when}").format(mission=run.mission.name, when=formats.until(run.at, now, facts.settings.timezone))


def _out_of_sight(facts: HomeFacts, snapshot: RobotSnapshot, now: datetime) -> dict[str, Any]:
    running = facts.running
    if snapshot.read_at is None:
        return {"mission_label": _("Mission"), "mission": "–"}
    since = formats.day_and_time(snapshot.read_at, facts.settings.timezone, now)
    return {"mission_label": _("Last known mission"), "mission": facts.name_of(running) if running else "–",
            "usual": _("unknown since {time}").format(time=since)}


def _running(facts: HomeFacts, item: QueueItem, now: datetime) -> dict[str, Any]:
    ours = facts.execution_of(item)
    since = ours.started_at if ours and ours.started_at else facts.seen_running.get(item.id)
    elapsed = max(0.0, (now - since).total_seconds()) if since else None
    guid = ours.mission_guid if ours else item.mission_id or ""
    usual = facts.usual_s.get(guid)
    view: dict[str, Any] = {"mission_label": _("Mission"), "mission": facts.name_of(item),
                            "elapsed": formats.duration(elapsed)}
    if usual and elapsed is not None:
        view["progress"] = min(1.0, elapsed / usual)
        text = _("of {duration} as typed in Settings") if guid in facts.typed else _("of usually {duration}")
        view["usual"] = text.format(duration=formats.duration(usual))
        if guid not in facts.typed and elapsed > LONGER_THAN_USUAL * usual:
            view |= {"mission_tone": "attention", "usual": _("usually {duration}").format(duration=formats.duration(usual))}
    elif ours:
        view["usual"] = _("no earlier run to compare with")
    else:
        view["usual"] = _("since this tablet has seen it run")
    if facts.snapshot.status and facts.snapshot.status.state is RobotState.PAUSE:
        view["mission_label"] = _("Mission, held by the pause")
    return view


def _errors(status: RobotStatus) -> str:
    return "; ".join(dict.fromkeys(error.description for error in status.errors if error.description))


def _facts(status: RobotStatus | None) -> list[Row]:
    """What else the robot tells, as pairs of label and value."""
    if status is None:
        return []
    pairs = [
        (_("Speed"), formats.number(status.linear_velocity, 1, "m/s")),
        (_("To the goal"), formats.number(status.distance_to_next_target, 1, "m")),
        (_("Driven"), formats.number(status.moved / 1000 if status.moved is not None else None, 0, "km")),
    ]
    return [{"label": label, "value": value} for label, value in pairs]


def prompt(snapshot: RobotSnapshot, old: bool) -> PromptView:
    asked: UserPrompt | None = snapshot.status.user_prompt if snapshot.status and not old else None
    return PromptView(asked.guid, asked.question, asked.options) if asked else PromptView()


# ---------------------------------------------------------------------- the controls
def can_reset(status: RobotStatus | None) -> bool:
    """Whether Reset errors would change something: the emergency stop and errors that can't be reset need hands on the robot."""
    if status is None or status.state is RobotState.EMERGENCY_STOP:
        return False
    if status.errors:
        return any(error.resettable for error in status.errors)
    return status.state is RobotState.ERROR


def controls(facts: HomeFacts, robot: Robot) -> ControlsView:
    """Pause can be tried even on a robot that doesn't answer just now: stopping must never wait for the next poll."""
    status = facts.snapshot.status
    state = status.state if status else RobotState.UNKNOWN
    answers = facts.snapshot.connection in (Connection.CONNECTED, Connection.SLOW)
    off = not robot.enabled or (answers and state in (RobotState.STARTING, RobotState.SHUTTING_DOWN))
    resumes = state in (RobotState.PAUSE, *STOPPED)
    count = len(facts.snapshot.queue) + len(facts.not_in_queue)
    return ControlsView(
        pauses=not resumes, pause=_("Resume") if resumes else _("Pause"), pause_icon="play" if resumes else "pause",
        pause_style="outlined" if state in STOPPED else "tonal", pause_off=off or state in STOPPED,
        reset_off=not robot.enabled or not can_reset(status), clear_count=count if robot.enabled else 0)


# ---------------------------------------------------------------------- run now
def run_now(facts: HomeFacts, robot: Robot, chosen: int | None) -> RunView:
    missions = facts.missions
    mission = next((m for m in missions if m.id == chosen), missions[0] if len(missions) == 1 else None)
    shown = [m for m in missions if m.favourite] or missions[:CHIPS]
    rows = tuple({"key": m.id, "icon": "star" if m.favourite else "", "text": m.name, "selected": m is mission} for m in shown)
    status = facts.snapshot.status
    text, off = _("Run on {robot}").format(robot=robot.name), False
    if not missions:
        text, off = _("No missions yet"), True
    elif not robot.enabled:
        text, off = _("{robot} is switched off").format(robot=robot.name), True
    elif status is not None and status.state in STOPPED:
        text, off = _("{robot} is stopped").format(robot=robot.name), True
    elif mission is None:
        text, off = _("Choose a mission"), True
    return RunView(note=_("on {robot}").format(robot=robot.name), mission_id=mission.id if mission else None,
                   mission=mission.name if mission else _("Choose a mission"), chips=rows, text=text, off=off,
                   low_battery=_low_battery(facts, robot))


def _low_battery(facts: HomeFacts, robot: Robot) -> str:
    minimum = facts.settings.minimum_battery_percent
    status = facts.snapshot.status
    if not minimum:
        return ""
    if status is None or status.battery_percentage is None:
        return _("The battery of {robot} is not known; the minimum is {minimum} %.").format(
            robot=robot.name, minimum=formats.plain(minimum))
    if status.battery_percentage >= minimum:
        return ""
    return _("The battery of {robot} is at {battery} %, under the minimum of {minimum} %.").format(
        robot=robot.name, battery=f"{status.battery_percentage:.0f}", minimum=formats.plain(minimum))
