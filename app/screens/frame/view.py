"""The banner in words. Pure."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from datetime import datetime, timedelta
from typing import Any

from app.database.robots import Hold
from app.domain.execution import Execution
from app.domain.models import Alarm, Priority, Robot, Settings
from app.i18n import _, ngettext
from app.screens.common import formats
from app.screens.common.alarm_groups import Together, group_text, has_leader, together
from app.screens.common.alarms_view import (
    Act,
    Way,
    alarm_icon,
    alarm_tone,
    id_in,
    is_over,
    is_shelved,
    to_settings,
    urgency,
    way_to,
)
from app.screens.common.holding import HAND, hold_at
from app.screens.common.mission_names import MissionNames
from app.screens.common.zones import zone_options
from app.screens.frame.facts import OpenIssues, may_have_run
from app.services.check_up.journal import HOLD as CHECK_UP
from app.widgets.items import Action, Item, Option


@dataclass(frozen=True)
class BannerView:
    """One line and one button. Empty ``text``: no banner."""

    text: str = ""
    tone: str = "attention"
    icon: str = HAND
    action: str = ""
    act: Act = Act.NOTHING
    about: Any = None  # of ``act``, as in Way


def banner(
    issues: OpenIssues, robots: Mapping[int, Robot], settings: Settings, now: datetime, screen: str
) -> BannerView:
    """What a person has to know on this screen: why nothing is sent, what is about to start, or which robot is worst off. About robots
    only where none is in sight."""
    if issues.copy is not None:
        return BannerView(
            _("Nothing is sent from this tablet"), icon="tablet-dashboard", action=_("Decide"), act=Act.WHOSE_PLAN
        )
    if counting := counting_down(issues.late_starts):
        return BannerView(counting_words(counting, now), "attention", "timer-alert-outline", _("Hold all"), Act.HOLD)
    new = [group for group in new_lines(open_lines(issues.alarms, now)) if not is_over(group[0])]
    in_need = [group for group in new if _is_of_robot(group[0])] if screen not in ("home", "alarms") else []
    of_tablet = (group for group in new if _is_of_tablet(group[0]))
    red = [group for group in (*of_tablet, *in_need) if group[0].priority is Priority.HIGH]
    holds = [hold for hold in issues.holds if not hold.clock and not hold.is_over(now)]
    hold = min(holds, key=lambda hold: hold.reason == CHECK_UP, default=None)  # which ends by itself
    if red:
        worst = _alarm(red[0], robots, settings, now)
        if hold is None or hold.robot_id is not None:
            return worst
        return replace(worst, text=f"{worst.text} · {_hold(hold, robots, settings, now).text}")
    if hold is not None:
        return _hold(hold, robots, settings, now)
    if in_need:
        return _alarm(in_need[0], robots, settings, now)
    if held := sum(e.held for e in issues.late_starts):
        text = ngettext("{n} late start on hold", "{n} late starts on hold", held).format(n=held)
        return BannerView(text, action=_("Show"), act=Act.LATE_STARTS)
    return BannerView()


def open_lines(alarms: Iterable[Alarm], now: datetime) -> list[Together]:
    """All that are open and not shelved, those of one cause together, the most serious first."""
    standing = (alarm for alarm in alarms if not is_shelved(alarm, now))
    return sorted(together(standing, now), key=lambda group: min(map(urgency, group)))


def new_lines(lines: Iterable[Together]) -> list[Together]:
    """Those of them that are not acknowledged, as the bell and the page count them."""
    return [group for group in lines if group[0].acknowledged_at is None]


def _is_of_robot(alarm: Alarm) -> bool:
    """Whether it says how a robot is, not what became of a run."""
    return id_in(alarm.key, "robot") is not None


def _is_of_tablet(alarm: Alarm) -> bool:
    """Whether it concerns all robots."""
    return "robot" not in alarm.details or alarm.code in ("clock_implausible", "database", "two_tablets", "lock_lost")


def _alarm(group: Together, robots: Mapping[int, Robot], settings: Settings, now: datetime) -> BannerView:
    alarm = group[0]
    way = way_to(alarm, robots) if has_leader(group) else None
    if alarm.code == "clock_implausible":
        text, icon = _("This clock can't be right. Nothing is sent."), "clock-alert-outline"
        return BannerView(text, "attention", icon, _("Decide"), Act.CLOCK_IS_RIGHT)
    if way is None:
        way = Way(_("Show"), Act.GO, {"screen": "alarms", "unfold": alarm.id})
    return BannerView(
        group_text(group, settings, now), alarm_tone(alarm), alarm_icon(alarm), way.word, way.act, way.about
    )


# ---------------------------------------------------------------------- holds and late starts
def counting_down(late: Sequence[Execution]) -> list[Execution]:
    """Those that start by themselves in a moment."""
    return [e for e in late if not e.held and not may_have_run(e)]


def counting_words(counting: Sequence[Execution], now: datetime) -> str:
    count = len(counting)
    return ngettext("{n} starts in {s} s", "{n} start in {s} s", count).format(n=count, s=seconds_left(counting, now))


def late_rows(late: Sequence[Execution], names: MissionNames, settings: Settings, now: datetime) -> list[Item]:
    """Those that may have run already come last: their robots are being asked, and a start could run them twice."""
    unclear = [e for e in late if may_have_run(e)]
    head = [Item(("head",), _("May have run already"), look="head")] if unclear else []
    found = [e for e in late if not may_have_run(e)]
    return [
        *(_late_row(e, names, settings, now) for e in found),
        *head,
        *(_late_row(e, names, settings, now) for e in unclear),
    ]


def _late_row(execution: Execution, names: MissionNames, settings: Settings, now: datetime) -> Item:
    robot, closes = execution.robot or execution.robot_group, formats.clock_time(execution.closes_at, settings.timezone)
    late = formats.rough_duration(max(timedelta(minutes=1), now - execution.planned_at).total_seconds())
    drop, start = Action("drop", _("Don't start"), style="text"), Action("start", _("Start"))
    actions: tuple[Action, ...] = (drop, start)
    words = _("{robot} · {time} late").format(robot=robot, time=late)
    if may_have_run(execution):
        words, actions = _("Asking {robot}, until {time}").format(robot=robot, time=closes), (drop,)
    elif execution.held:
        words = _("{robot} · on hold, not run from {time}").format(robot=robot, time=closes)
    return Item(
        execution.id,
        names.run(execution),
        words,
        lead=formats.clock_time(execution.planned_at, settings.timezone),
        actions=actions,
        opens=False,
    )


def held_back(issues: OpenIssues, robot_id: int | None, now: datetime) -> int:
    """How many starts are due at once when the hold of that robot, or of all (None), is released."""
    others = [hold for hold in issues.holds if hold.robot_id != robot_id]
    return sum(
        robot_id in (None, e.robot_id) and hold_at(others, e.robot_id, now) is None for e in issues.waiting_for_hold
    )


def seconds_left(executions: Sequence[Execution], now: datetime) -> int:
    """Whole seconds until the first of them is sent."""
    ends = [e.listed_until for e in executions if e.listed_until is not None]
    return max(0, round((min(ends) - now).total_seconds())) if ends else 0


def zone_asked(names: Iterable[str], guess: str, now: datetime) -> tuple[str, list[Option]]:
    """The question and its answers, the guess first: its time shows whether it is right."""
    return _("Which time zone is this tablet in?"), zone_options(names, now, guess)


def whose_plan() -> list[Option]:
    """The purpose of copied data; the keys say whether it moves here."""
    return [
        Option(
            True,
            _("It moves here"),
            "tablet-dashboard",
            _("The other one is off. This one starts all missions from now on."),
        ),
        Option(
            False,
            _("It is only looked at"),
            "eye-outline",
            _("The other one continues. Nothing is ever sent from here."),
        ),
    ]


def _hold(hold: Hold, robots: Mapping[int, Robot], settings: Settings, now: datetime) -> BannerView:
    robot = robots.get(hold.robot_id or 0)
    if robot is not None and hold.reason == CHECK_UP:  # it ends by itself
        text = _("{robot} on hold: its check-up is not over").format(robot=robot.name)  # or it was interrupted
        return BannerView(
            text, "neutral", "stethoscope", _("Show"), Act.GO, to_settings(section="robots", robot_id=robot.id).about
        )
    who = robot.name if robot else _("All robots")
    text = _("{robot} on hold").format(robot=who)
    if hold.until is not None:
        time = formats.day_or_time(hold.until, settings.timezone, now)
        text = _("{robot} on hold until {time}").format(robot=who, time=time)
    return BannerView(
        " · ".join(filter(None, (text, hold.reason and _(hold.reason)))),
        action=_("Release"),
        act=Act.RELEASE,
        about=hold.robot_id,
    )
