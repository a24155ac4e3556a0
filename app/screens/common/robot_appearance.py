"""How one robot looks, wherever it is shown: chip, card, top bar, picker. Pure words, icons and tones; normal is grey (ISA-101)."""
from __future__ import annotations

from dataclasses import dataclass
from datetime import datetime

from app.domain.activity import activity_of
from app.domain.models import Connection, Robot, RobotSnapshot, Settings
from app.domain.robot import RobotState, RobotStatus
from app.i18n import _
from app.screens.common import formats
from app.services.live.snapshots import is_stale

ANSWERS = (Connection.CONNECTED, Connection.SLOW)
STOPPED = (RobotState.EMERGENCY_STOP, RobotState.ERROR)
DRIVES = (RobotState.EXECUTING, RobotState.DOCKING)


@dataclass(frozen=True)
class Look:
    """A state as people see it: always word, icon and tone together; ``loud`` asks for a person now."""
    word: str
    icon: str
    tone: str = "neutral"
    loud: bool = False
    disc_icon: str = ""                  # where a disc stands around it already; empty: the same


def state_look(robot: Robot, snapshot: RobotSnapshot, stale: bool) -> Look:
    """What the robot does; of one that has not answered lately only that."""
    if not robot.enabled or snapshot.connection is Connection.DISABLED:
        return Look(_("Switched off"), "power-plug-off-outline", "offline")
    if snapshot.status is None:
        if snapshot.connection is Connection.UNKNOWN:
            return Look(_("Connecting"), "timer-sand", "offline")
        return Look(_("No connection"), "wifi-off", "attention")
    if stale or snapshot.connection not in (*ANSWERS, Connection.UNKNOWN):
        return Look(_("No connection"), "wifi-off", "attention")
    return _look_of(snapshot.status)


def _look_of(status: RobotStatus) -> Look:
    if status.user_prompt is not None and status.state not in STOPPED:
        return Look(_("Waits for an answer"), "comment-question", "action")
    if status.state not in STOPPED and activity_of(status) == "charging":
        return Look(_("Charging"), "lightning-bolt")
    return {
        RobotState.STARTING: Look(_("Starting up"), "timer-sand"),
        RobotState.SHUTTING_DOWN: Look(_("Shutting down"), "power"),
        RobotState.READY: Look(_("Ready"), "check-circle-outline", disc_icon="check"),
        RobotState.PAUSE: Look(_("Paused"), "pause-circle-outline", "action", disc_icon="pause"),
        RobotState.EXECUTING: Look(_("Executing"), "play-circle-outline", "accent", disc_icon="play"),
        RobotState.ABORTED: Look(_("Mission ended early"), "close-circle-outline", disc_icon="close"),
        RobotState.COMPLETED: Look(_("Mission done"), "check-circle-outline", disc_icon="check"),
        RobotState.DOCKING: Look(_("Docking"), "map-marker-radius-outline", "accent"),
        RobotState.EMERGENCY_STOP: Look(_("Emergency stop"), "alert-octagon", "fault", loud=True),
        RobotState.MANUAL_CONTROL: Look(_("Driven by hand"), "gamepad-variant-outline", "attention"),
        RobotState.ERROR: Look(_("Error"), "alert-circle", "fault", loud=True, disc_icon="exclamation-thick"),
    }.get(status.state) or Look(status.state_text or _("Unknown state"), "help-circle-outline", "attention")


def link_look(robot: Robot, snapshot: RobotSnapshot, now: datetime, settings: Settings) -> Look:
    """How the robot answers, with the age of what is known: "Connected · 2 s ago"; one that doesn't says since when."""
    connection = snapshot.connection
    if not robot.enabled or connection is Connection.DISABLED:
        return Look(_("Switched off"), "power-plug-off-outline", "offline")
    if connection in ANSWERS and snapshot.read_at is not None:
        age = formats.ago(max(0.0, (now - snapshot.read_at).total_seconds()))
        if is_stale(snapshot.read_at, now, settings):
            return Look(_("No news · {age}").format(age=age), "wifi-alert", "attention")
        if connection is Connection.SLOW:
            return Look(_("Slow · {age}").format(age=age), "wifi-strength-2-alert", "attention")
        return Look(_("Connected · {age}").format(age=age), "wifi")
    words, icon = {
        Connection.UNREACHABLE: (_("No answer"), "wifi-off"),
        Connection.UNAUTHORIZED: (_("Wrong password"), "account-lock-outline"),
        Connection.WRONG_ROBOT: (_("Another robot"), "robot-confused-outline"),
        Connection.NOT_A_ROBOT: (_("Not a MiR robot"), "robot-off-outline"),
    }.get(connection, (_("Connecting"), "timer-sand"))
    if connection is Connection.UNKNOWN or snapshot.since is None:
        return Look(words, icon, "neutral" if connection is Connection.UNKNOWN else "attention")
    since = formats.day_and_time(snapshot.since, settings.timezone, now)
    return Look(_("{problem} since {time}").format(problem=words, time=since), icon, "attention")


@dataclass(frozen=True)
class BatteryLook:
    """Unknown is "–" and level −1, never 0."""
    text: str = "–"
    icon: str = "battery-unknown"
    tone: str = "neutral"
    level: float = -1.0                  # 0..1
    level_tone: str = "accent"
    note: str = ""


NO_BATTERY = BatteryLook()


def battery_look(status: RobotStatus | None, settings: Settings) -> BatteryLook:
    percent = status.battery_percentage if status else None
    if status is None or percent is None:
        return BatteryLook(note=_("not known"))
    charging = status.state not in STOPPED and activity_of(status) == "charging"
    tenth = min(10, max(0, round(percent / 10))) * 10
    low = settings.minimum_battery_percent is not None and percent < settings.minimum_battery_percent
    if charging:
        icon, note = f"battery-charging-{max(10, tenth)}" if tenth < 100 else "battery-charging-100", _("charging")
    else:
        icon = "battery" if tenth == 100 else "battery-alert-variant-outline" if tenth == 0 else f"battery-{tenth}"
        left = status.battery_time_remaining_s
        note = _("about {time} left").format(time=formats.rough_duration(left)) if left else ""
    if low:
        note = _("under {minimum} %").format(minimum=formats.plain(settings.minimum_battery_percent))
    return BatteryLook(_("{n} %").format(n=int(percent)), icon, "attention" if low else "neutral", percent / 100,
                       "attention" if low else "accent", note)


def is_old(snapshot: RobotSnapshot, now: datetime, settings: Settings) -> bool:
    """Whether what is known of the robot must not look fresh."""
    return snapshot.connection not in ANSWERS or is_stale(snapshot.read_at, now, settings)
