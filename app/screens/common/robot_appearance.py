"""How one robot is shown, in chip, card, top bar and picker: words, icons and tones; normal is grey (ISA-101). Pure."""

from __future__ import annotations

from dataclasses import dataclass, replace
from datetime import datetime

from app.domain.activity import is_charging
from app.domain.models import Connection, Fleet, Robot, RobotSnapshot, Settings
from app.domain.robot import RobotState, RobotStatus
from app.i18n import _
from app.screens.common import formats
from app.services.live.snapshots import is_stale
from app.widgets.items import Option

ANSWERS = (Connection.CONNECTED, Connection.SLOW)
STOPPED = (RobotState.EMERGENCY_STOP, RobotState.ERROR)
HOLDING = (
    RobotState.PAUSE,
    RobotState.MANUAL_CONTROL,
    *STOPPED,
)  # does not continue by itself, even if its text is unchanged
ANY = "robot"  # icon of any robot of a fleet
LOW = 10.0  # % of battery below which a person has to look, if no minimum is set


@dataclass(frozen=True)
class Appearance:
    """A state as it is shown: always word, icon and tone together; ``loud``: a person is needed now."""

    word: str
    icon: str
    tone: str = "neutral"
    loud: bool = False
    disc_icon: str = ""  # on a disc; empty: the same


def state_appearance(robot: Robot, snapshot: RobotSnapshot, stale: bool, free: str = "") -> Appearance:
    """What the robot does, in one of the words that the whole app has for it; if it has not answered lately, only that.
    A state that is not known is "–". ``free``: how many are, if it stands for any robot of a fleet that takes orders."""
    if not robot.enabled or snapshot.connection is Connection.DISABLED:
        return off_appearance(robot)
    if snapshot.status is None and snapshot.connection is Connection.UNKNOWN:
        return Appearance(formats.NOTHING, "timer-sand", "offline")
    if snapshot.status is None or stale or is_silent(snapshot.connection):
        return _silence(snapshot.connection, of_fleet=silent_fleet(robot, snapshot) is not None)
    if robot.is_any and snapshot.status.state is RobotState.READY:
        return Appearance(free or _("Ready"), ANY)
    return _appearance_of(snapshot.status)


def off_appearance(robot: Robot) -> Appearance:
    """Of one that is switched off, by a person or because its password is missing."""
    if robot.needs_password:
        return Appearance(_("Off"), "account-lock-outline", "attention")
    return Appearance(_("Off"), "power-plug-off-outline", "offline")


def robot_option(robot: Robot, state: str = "") -> Option:
    """To choose it in a list; ``state``: what else is said of it."""
    what = _("Any robot of the fleet") if robot.is_any else robot.model
    return Option(
        robot.id, robot.name, ANY if robot.is_any else "robot-outline", " · ".join(filter(None, (what, state)))
    )


def off_word(robot: Robot) -> str:
    """Why nothing is sent to a robot that is switched off, in small print."""
    return _("needs its password") if robot.needs_password else _("off")


def _appearance_of(status: RobotStatus) -> Appearance:
    if status.user_prompt is not None and status.state not in STOPPED:
        return Appearance(_("Asks"), "comment-question", "action")
    if status.state not in HOLDING and is_charging(status):
        return Appearance(_("Charging"), "lightning-bolt")
    ready = Appearance(_("Ready"), "check-circle-outline", disc_icon="check")
    working = Appearance(_("Working"), "play-circle-outline", "accent", disc_icon="play")
    return {
        RobotState.STARTING: Appearance(_("Starting up"), "timer-sand", "offline"),
        RobotState.SHUTTING_DOWN: Appearance(_("Off"), "power", "offline"),
        **dict.fromkeys((RobotState.READY, RobotState.ABORTED, RobotState.COMPLETED), ready),
        RobotState.PAUSE: Appearance(_("Paused"), "pause-circle-outline", "action", disc_icon="pause"),
        **dict.fromkeys((RobotState.EXECUTING, RobotState.DOCKING), working),
        RobotState.EMERGENCY_STOP: Appearance(_("Stopped"), "alert-octagon", "fault", loud=True),
        RobotState.MANUAL_CONTROL: Appearance(_("Manual control"), "gamepad-variant-outline", "attention"),
        RobotState.ERROR: Appearance(_("Stopped"), "alert-circle", "fault", loud=True, disc_icon="exclamation-thick"),
    }.get(status.state) or Appearance(formats.NOTHING, "help-circle-outline", "attention")


def link_appearance(robot: Robot, snapshot: RobotSnapshot, now: datetime, settings: Settings) -> Appearance:
    """The robot's connection, with the age of its state: "Connected · 20 s ago"; for a silent one, since when."""
    connection = snapshot.connection
    if not robot.enabled or connection is Connection.DISABLED:
        return off_appearance(robot)
    if connection in ANSWERS and snapshot.read_at is not None:
        age = formats.ago(max(0.0, (now - snapshot.read_at).total_seconds()))
        if is_stale(snapshot.read_at, now, settings):
            return Appearance(_("No update · {age}").format(age=age), "wifi-alert", "attention")
        if connection is Connection.SLOW:
            return Appearance(_("Slow · {age}").format(age=age), "wifi-strength-2-alert", "attention")
        return Appearance(_("Connected · {age}").format(age=age), "wifi")
    if not is_silent(connection):
        return Appearance(formats.NOTHING, "timer-sand", "offline")
    shown = _silence(connection, of_fleet=silent_fleet(robot, snapshot) is not None)
    if snapshot.since is None:
        return shown
    since = formats.day_and_time(snapshot.since, settings.timezone, now)
    return replace(shown, word=_("{problem} since {time}").format(problem=shown.word, time=since))


def is_silent(connection: Connection) -> bool:
    """Whether it gives no answer, or none that can be trusted: planned starts wait for it."""
    return connection not in (*ANSWERS, Connection.UNKNOWN, Connection.DISABLED)


def silent_fleet(robot: Robot, snapshot: RobotSnapshot) -> Fleet | None:
    """Its fleet, if that is silent and not the robot alone."""
    return robot.fleet if snapshot.fleet_failed and robot.enabled and is_silent(snapshot.connection) else None


def why_not(able: bool) -> str:
    """Why something can't be done through the connection to a robot, if it is not ``able`` to; else empty."""
    return "" if able else _("The fleet can't do that. Do it at the robot.")


def trouble_of(robot: Robot, silent: Fleet | None) -> tuple[str, int]:
    """What to count, if it needs a person: a silent fleet is one trouble, however many robots it has."""
    return ("robot", robot.id) if silent is None else ("fleet", silent.id)


def silence_word(connection: Connection | None) -> str:
    """The problem of a silent robot; empty for others."""
    return _silence(connection).word if connection is not None and is_silent(connection) else ""


def _silence(connection: Connection, *, of_fleet: bool = False) -> Appearance:
    words, icon = {
        Connection.UNAUTHORIZED: (_("Wrong password"), "account-lock-outline"),
        Connection.WRONG_ROBOT: (_("Another robot"), "robot-confused-outline"),
        Connection.OTHER_CERTIFICATE: (_("Another certificate"), "certificate-outline"),
        Connection.UNTRUSTED: (_("Another certificate"), "certificate-outline"),
        Connection.NOT_A_ROBOT: (_("Another robot"), "robot-off-outline"),
    }.get(connection, (_("No answer"), "wifi-off"))
    if of_fleet and connection in (Connection.WRONG_ROBOT, Connection.NOT_A_ROBOT):
        words = _("Another fleet")
    return Appearance(words, icon, "attention")


@dataclass(frozen=True)
class BatteryAppearance:
    """Unknown is "–", never 0."""

    text: str = "–"
    icon: str = "battery-unknown"
    tone: str = "neutral"
    note: str = ""


def battery_appearance(status: RobotStatus | None, settings: Settings) -> BatteryAppearance:
    percent = status.battery_percentage if status else None
    if status is None or percent is None:
        return BatteryAppearance(note=_("not known"))
    charging = status.state not in HOLDING and is_charging(status)
    tenth = min(10, max(0, round(percent / 10))) * 10
    minimum = settings.minimum_battery_percent or (0.0 if charging else LOW)
    low = percent < minimum
    if charging:
        icon, note = f"battery-charging-{max(10, tenth)}" if tenth < 100 else "battery-charging-100", _("charging")
    else:
        icon = "battery" if tenth == 100 else "battery-alert-variant-outline" if tenth == 0 else f"battery-{tenth}"
        left = status.battery_time_remaining_s
        note = _("about {time} left").format(time=formats.rough_duration(left)) if left else ""
    if low:
        note = _("under {minimum} %").format(minimum=formats.plain(minimum))
    return BatteryAppearance(
        _("{n} %").format(n=int(percent)),
        icon,
        "attention" if low else "neutral",
        note,
    )


def is_old(snapshot: RobotSnapshot, now: datetime, settings: Settings) -> bool:
    """Whether what is known of the robot is out of date."""
    return snapshot.connection not in ANSWERS or is_stale(snapshot.read_at, now, settings)
