"""The frame in words: the selected robot in the top bar, and the banner with the most serious alarm or hold. Pure."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from datetime import datetime

from app.database.robots import Hold
from app.domain.models import Alarm, Execution, Robot, RobotSnapshot, Settings
from app.i18n import _, ngettext
from app.screens.common import formats
from app.screens.common.alarm_groups import Together, group_entry, group_note, group_text, has_leader, together
from app.screens.common.alarms_view import (
    NOWHERE,
    Act,
    AlarmEntry,
    Here,
    acknowledged_words,
    acknowledging,
    alarm_icon,
    alarm_tone,
    is_over,
    is_shelved,
    open_entry,
    urgency,
    way_to,
)
from app.screens.common.holding import HAND, hold_at, state_and_hold
from app.screens.common.mission_names import MissionNames
from app.screens.common.options import Option
from app.screens.common.robot_appearance import battery_appearance, is_old, link_appearance, state_appearance
from app.screens.common.robot_groups import FEW, NEEDS_HELP, Group, group_of, help_words, look_of
from app.screens.common.zones import zone_options
from app.screens.frame.facts import OpenIssues
from app.screens.frame.sounding import is_overdue


@dataclass(frozen=True)
class BarView:
    """The top bar, except tabs and name of the screen."""

    clock: str = ""
    robot: str = ""
    link: str = ""
    link_icon: str = "robot-off-outline"
    link_tone: str = "offline"
    help_count: str = ""  # of robots that need a person, where Home doesn't show all of them side by side


def top_bar(
    robot: Robot | None, snapshot: RobotSnapshot | None, settings: Settings, now: datetime, groups: Sequence[Group] = ()
) -> BarView:
    """``groups`` are those of all robots."""
    clock = formats.clock_time(now, settings.timezone)
    if robot is None:
        return BarView(clock, _("No robot"))
    link = link_appearance(robot, snapshot or RobotSnapshot(robot.id), now, settings)
    needy = sum(group in NEEDS_HELP for group in groups)
    return BarView(
        clock, robot.name, link.word, link.icon, link.tone, str(needy) if needy and len(groups) > FEW else ""
    )


def picker_title(groups: Sequence[Group]) -> str:
    """Of the list to choose from."""
    help_needed = help_words(groups)
    return _("Robot · {help}").format(help=help_needed) if help_needed else _("Robot")


def robot_option(
    robot: Robot, snapshot: RobotSnapshot, settings: Settings, now: datetime, holds: Sequence[Hold] = ()
) -> Option:
    """One robot in the list to choose from; the icon of one that needs help stands out."""
    hold, old = hold_at(holds, robot.id, now) if robot.enabled else None, is_old(snapshot, now, settings)
    state, group = state_appearance(robot, snapshot, old), group_of(robot, snapshot, old, settings)
    battery = battery_appearance(None if old else snapshot.status, settings)
    return Option(
        robot.id,
        robot.name,
        state.icon,
        f"{state_and_hold(state.word, hold)} · {battery.text}",
        tone=look_of(group).tone if group in NEEDS_HELP else "neutral",
    )


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
    about: int | None = None  # id of the robot, alarm or start that ``act`` is about
    urgent: bool = False  # larger: unacknowledged for long
    calm: bool = False  # somebody has acknowledged it


def banner(
    issues: OpenIssues, robots: Mapping[int, Robot], settings: Settings, now: datetime, here: Here = NOWHERE
) -> BannerView:
    """The most serious one, and how many others the list has. ``here`` is the present screen, so that no button leads
    there."""
    found = open_issues(issues, robots, settings, now, here)
    if not found:
        return BannerView()
    count = len(found) - 1
    is_one = bool(found[0].alarms) and has_leader(found[0].alarms)
    others = ngettext("+{n} more", "+{n} more", count).format(n=count) if count else _("Details") if is_one else ""
    return replace(found[0].view, others=others)


@dataclass(frozen=True)
class OpenIssue:
    """One line that the banner counts and the list shows: an alarm, a hold, or the late starts."""

    key: tuple[str, int]
    view: BannerView
    alarms: Together = ()  # several with one cause


def open_issues(
    issues: OpenIssues, robots: Mapping[int, Robot], settings: Settings, now: datetime, here: Here = NOWHERE
) -> list[OpenIssue]:
    """Everything that is open and not shelved, most serious first."""
    standing = [alarm for alarm in issues.alarms if not is_shelved(alarm, now)]
    lines = [
        (
            min(map(urgency, group)),
            OpenIssue(
                ("group" if len(group) > 1 else "alarm", group[0].id),
                _alarms(group, robots, settings, now, here),
                group,
            ),
        )
        for group in together(standing, now)
    ]
    lines += [
        (_HOLD, OpenIssue(("hold", hold.robot_id or 0), _hold(hold, robots, settings, now)))
        for hold in issues.holds
        if not hold.clock and not hold.is_over(now)
    ]  # an implausible clock has its own alarm
    starting = [OpenIssue(("late", 0), _late(issues, settings, now))] if issues.late_starts else []
    if starting and all(start.held for start in issues.late_starts):  # nothing of them runs away, as of other holds
        lines += [(_HOLD, starting.pop())]
    lines.sort(key=lambda line: line[0])
    copy = [OpenIssue(("copy", 0), _copy(issues.copy))] if issues.copy else []
    return [*copy, *starting, *(issue for _urgency, issue in lines)]


def issue_entry(
    issue: OpenIssue, robots: Mapping[int, Robot], settings: Settings, now: datetime, unfolded: bool = False
) -> AlarmEntry:
    """Its line in the list; ``unfolded``: those of a group are below it."""
    if len(issue.alarms) > 1:
        return group_entry(issue.alarms, settings, now, unfolded)
    if issue.alarms:
        return open_entry(issue.alarms[0], robots, settings, now)
    view = issue.view
    return AlarmEntry(issue.key, view.icon, view.tone, view.text, view.note, action=view.action)


_HOLD = (False, False, 0.5, 0.0)  # a hold comes after new alarms of high priority, before all others


def _alarms(group: Together, robots: Mapping[int, Robot], settings: Settings, now: datetime, here: Here) -> BannerView:
    alarm = group[0]
    newest = max(group, key=lambda one: (one.acknowledged_at is not None, one.acknowledged_at or one.raised_at))
    seen, calm = acknowledged_words(newest, settings, now), alarm.acknowledged_at is not None
    if not has_leader(group):
        note = " · ".join(filter(None, (seen, group_note(group, settings, now))))
        return BannerView(
            _now_or_over(alarm, group_text(group, settings, now)),
            note,
            alarm_tone(alarm),
            _icon(alarm),
            "",
            _("Show all"),
            Act.SHOW_ALARMS,
            alarm.id,
            calm=calm,
        )
    way = way_to(alarm, robots)
    is_on_card = (
        way is not None and here.is_at(way) and alarm.code in ("robot_error", "emergency_stop")
    )  # by the robot's card below
    if way is None or here.is_at(way):
        way = acknowledging(alarm)
    note, urgent = (
        " · ".join(filter(None, (seen, group_note(group, settings, now, advises=not is_on_card)))),
        is_overdue(alarm, now),
    )
    if urgent:
        since = formats.rough_duration((now - (alarm.last_at or alarm.raised_at)).total_seconds())
        note = _("Unacknowledged for {time} · {note}").format(time=since, note=note)
    text = (
        _("{robot} reports an error").format(robot=alarm.details["robot"])
        if is_on_card and alarm.code == "robot_error"
        else group_text(group, settings, now)
    )
    return BannerView(
        _now_or_over(alarm, text), note, alarm_tone(alarm), _icon(alarm), "", way.word, way.act, way.about, urgent, calm
    )


def _now_or_over(alarm: Alarm, text: str) -> str:
    """The sentence; if the alarm is over, that comes first."""
    return _("Over: {alarm}").format(alarm=text) if is_over(alarm) else text


def _icon(alarm: Alarm) -> str:
    """An acknowledged one looks calmer."""
    return alarm_icon(alarm) if alarm.acknowledged_at is None else "bell-check-outline"


# ---------------------------------------------------------------------- holds and late starts
def _late(issues: OpenIssues, settings: Settings, now: datetime) -> BannerView:
    executions = issues.late_starts
    going = [e for e in executions if not e.held]
    count = len(going) or len(executions)
    names = ", ".join(late_line(e, issues.mission_names, settings) for e in (going or executions)[:3])
    note = _("Due while the app was off: {missions}").format(missions=names)
    if not going:
        text = ngettext("{n} late mission is held", "{n} late missions are held", count).format(n=count)
        return BannerView(text, note, "attention", HAND, "", _("Show"), Act.LATE_STARTS)
    left = seconds_left(going, now)
    first = ngettext("{n} late mission starts in {s} s", "{n} late missions start in {s} s", count).format(
        n=count, s=left
    )
    action, about = (_("Hold"), going[0].id) if count == 1 else (_("Hold all"), None)
    return BannerView(first, note, "attention", "timer-alert-outline", "", action, Act.HOLD, about)


def late_line(execution: Execution, mission_names: MissionNames, settings: Settings) -> str:
    return _("{mission} on {robot} ({time})").format(
        mission=mission_names.run(execution),
        robot=execution.robot or execution.robot_group,
        time=formats.clock_time(execution.planned_at, settings.timezone),
    )


def seconds_left(executions: Sequence[Execution], now: datetime) -> int:
    """Whole seconds until the first of them is sent."""
    ends = [e.listed_until for e in executions if e.listed_until is not None]
    return max(0, round((min(ends) - now).total_seconds())) if ends else 0


def _copy(hold: Hold) -> BannerView:
    reason = _(hold.reason)
    return BannerView(
        _("Nothing is sent from this tablet"),
        reason[:1].upper() + reason[1:],
        "attention",
        "tablet-dashboard",
        "",
        _("Decide"),
        Act.WHOSE_PLAN,
    )


def zone_asked(names: Iterable[str], guess: str, now: datetime) -> tuple[str, list[Option]]:
    """The question and its answers, the guess first: its time shows whether it is right."""
    return _("Which time zone is this tablet in?"), zone_options(names, now, guess)


def whose_plan() -> list[Option]:
    """The purpose of data copied from another tablet; the keys say whether it moves here."""
    return [
        Option(
            True,
            _("It moves here"),
            "tablet-dashboard",
            _("The other tablet is off. This one starts all missions from now on."),
        ),
        Option(
            False,
            _("It is only looked at"),
            "eye-outline",
            _("The other tablet continues. Nothing is ever sent from here."),
        ),
    ]


def _hold(hold: Hold, robots: Mapping[int, Robot], settings: Settings, now: datetime) -> BannerView:
    robot = robots.get(hold.robot_id or 0)
    text = _("Nothing is sent to {robot}").format(robot=robot.name) if robot else _("Nothing is sent to any robot")
    until = _("Held until released")
    if hold.until is not None:
        until = _("Held until {time}").format(time=formats.day_and_time(hold.until, settings.timezone, now))
    since = (
        _("since {time}").format(time=formats.day_and_time(hold.since, settings.timezone, now)) if hold.since else ""
    )
    note = " · ".join(filter(None, (until, since, hold.reason and _(hold.reason))))
    return BannerView(text, note, "attention", "hand-back-right-outline", "", _("Release"), Act.RELEASE, hold.robot_id)
