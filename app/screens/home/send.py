"""Sending the robot: the tiles, all its missions, and what the sheet of one mission says before it runs. Pure."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from datetime import datetime, timedelta

from app.domain import rules
from app.domain.activity import is_charging
from app.domain.execution import DurationEstimate
from app.domain.models import Group, HandOver, Mission, Robot
from app.i18n import _, ngettext
from app.screens.common import formats
from app.screens.common.group_starts import lacking
from app.screens.common.holding import hold_at, run_words
from app.screens.common.missing_mission import fetch_option
from app.screens.common.robot_appearance import is_old
from app.screens.common.start_now import why_not
from app.screens.home.card import Card
from app.screens.home.facts import HomeFacts
from app.widgets.items import Item, Option

TILES = 5  # missions that are one tap away
Usual = Mapping[str, DurationEstimate | None]  # how long missions take on the robot, by guid


@dataclass(frozen=True)
class SendView:
    """A mission's sheet: when it ``starts``, ``why`` then, and the button. ``off``: why it can't be pressed."""

    starts: str = ""
    why: str = ""
    tone: str = "neutral"
    text: str = ""
    off: str = ""
    targets: tuple[Option, ...] = ()  # the robot, then its groups; empty without groups


def tiles(facts: HomeFacts) -> tuple[Option, ...]:
    """Favourites come first. Until they are read their places are empty, so that nothing moves then."""
    if facts.is_new:
        return (Option(0, ""),) * TILES
    return tuple(Option(mission.id, mission.name, "play-circle-outline") for mission in facts.missions[:TILES])


def all_missions(facts: HomeFacts, robot: Robot, usual: Usual, text: str) -> list[Item]:
    """Those with ``text`` in their names, favourites first; grey with the reason if the robot does not have it. The last row leads to the
    missions that are on robots and not entered here."""
    there, wanted = {mission.id for mission in facts.missions}, text.strip().casefold()
    rows = [
        _mission_row(mission, robot, usual, mission.id in there)
        for mission in facts.entered or facts.missions
        if wanted in mission.name.casefold()
    ]
    fetch = fetch_option()
    return [*rows, Item(fetch.key, fetch.text, fetch.note, icon=fetch.icon, strong=False)]


def _mission_row(mission: Mission, robot: Robot, usual: Usual, is_there: bool) -> Item:
    icon, tone = ("star", "accent") if mission.favourite else ("play-circle-outline", "neutral")
    if not is_there:
        words = _("Not on {robot}").format(robot=robot.name)
        return Item(mission.id, mission.name, meta=words, icon=icon, look="faint", strong=False, opens=False)
    known = usual.get(mission.guid)
    meta = formats.rough_duration(known.median_s if known is not None else None)
    return Item(mission.id, mission.name, meta=meta, icon=icon, tone=tone, strong=False)


# ---------------------------------------------------------------------- the sheet of one mission
def send_view(
    facts: HomeFacts, robot: Robot, shown: Card, mission: Mission, group_id: int | None, usual: Usual, now: datetime
) -> SendView:
    """``shown`` is the robot's card; ``usual`` has the durations of what is in its queue. ``group_id`` None: the robot of the page."""
    groups = [group for group in facts.groups if robot.id in group.members]
    group = next((group for group in groups if group.id == group_id), None)
    view = _on_robot(facts, robot, shown, usual, now) if group is None else _on_group(facts, group, mission, now)
    if not groups:
        return view
    chips = [Option(None, robot.name, "robot-outline", selected=group is None)]
    chips += [
        Option(each.id, _("Any of {group}").format(group=each.name), "select-group", selected=each is group)
        for each in groups
    ]
    return replace(view, targets=tuple(chips))


def _on_robot(facts: HomeFacts, robot: Robot, shown: Card, usual: Usual, now: datetime) -> SendView:
    closes_at = rules.closes_at(now, None, facts.settings)
    low, enough = _battery(facts, now)
    starts, after = (shown.send_note, "") if shown.send_note else _starts(facts, usual, now)
    if shown.send_note and facts.hold(robot.id, now) is None and shown.old:
        after = _("Waits until {time} at most.").format(
            time=formats.day_and_time(closes_at, facts.settings.timezone, now)
        )
    text = _("Run anyway on {robot}") if low else _("Run on {robot}")
    return SendView(
        starts,
        " ".join(filter(None, (after, low or enough))),
        "attention" if low else "neutral",
        text.format(robot=robot.name),
        shown.send_off,
    )


def _starts(facts: HomeFacts, usual: Usual, now: datetime) -> tuple[str, str]:
    """When its turn is. What charges ends at once."""
    others = [
        item for item in facts.snapshot.queue if item is not facts.running or not is_charging(facts.snapshot.status)
    ]
    guids = [facts.guid_of(item) for item in others if item is not facts.running]
    guids += [run.mission_guid for run in facts.not_in_queue]
    count = len(others) + len(facts.not_in_queue)
    if not count:
        return _("Starts now"), ""
    after = ngettext("After {n} other.", "After {n} others.", count).format(n=count)
    left, known = timedelta(), [usual.get(guid) for guid in guids]
    if facts.running in others:
        estimate = usual.get(facts.guid_of(facts.running)) if facts.running else None
        since = facts.working_since(facts.running, now) if facts.running else None
        if since is not None and estimate is not None and estimate.median_s:
            left = max(timedelta(), since + timedelta(seconds=estimate.median_s) - now)
        else:
            known.append(None)
    seconds = [estimate.median_s if estimate is not None else None for estimate in known]
    if not all(seconds):
        return _("Starts in its turn"), after
    at = now + left + timedelta(seconds=sum(second or 0.0 for second in seconds))
    words = _("Starts about {time}").format(time=formats.day_and_time(at, facts.settings.timezone, now))
    return words, after


def _battery(facts: HomeFacts, now: datetime) -> tuple[str, str]:
    """That it is under the minimum, or not known; that it is enough. Both are empty without a minimum."""
    minimum = facts.settings.minimum_battery_percent
    status = None if is_old(facts.snapshot, now, facts.settings) else facts.snapshot.status
    if not minimum:
        return "", ""
    if status is None or status.battery_percentage is None:
        return _("Battery not known, minimum {minimum} %.").format(minimum=formats.plain(minimum)), ""
    percent = f"{status.battery_percentage:.0f}"
    if status.battery_percentage >= minimum:
        return "", _("{battery} % battery is enough.").format(battery=percent)
    words = _("Battery {battery} %, minimum {minimum} %.")
    return words.format(battery=percent, minimum=formats.plain(minimum)), ""


def _on_group(facts: HomeFacts, group: Group, mission: Mission, now: datetime) -> SendView:
    members = [robot for robot in facts.robots if robot.id in group.members and robot.enabled]
    lack = lacking(mission, members, facts.all_missions, facts.known)
    hold = hold_at(facts.holds, None, now)
    zone, closes_at = facts.settings.timezone, rules.closes_at(now, None, facts.settings)
    off = why_not(group, facts.robots, hold)
    if (
        not off
        and mission.robot_id is not None
        and not any(other.name == mission.name and other.robot_id is None for other in facts.entered)
    ):
        off = _("This mission is for one robot only")
    elif not off and len(lack) == len(members):
        off = _("No robot of {group} has this mission").format(group=group.name)
    held = run_words(hold, None, closes_at, zone, now)
    starts = held[0] if held else _("Starts on the first free robot")
    if group.hand_over is HandOver.AT_ONCE and hold is None:
        starts = _("Starts at once, also on a busy robot")
    waits = _("Waits until {time} at most.").format(time=formats.day_and_time(closes_at, zone, now))
    without = _("Not on {robots}.").format(robots=", ".join(lack)) if lack else ""
    why = f"{waits} {without}".strip()
    return SendView(starts, why, text=_("Run on any of {group}").format(group=group.name), off=off)
