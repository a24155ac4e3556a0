"""One cause, one line: many robots that fall silent within a short time have not all failed, one robot fails all its missions at once, and
an error of a robot ends what it was running. Pure."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Iterable, Mapping, Sequence
from datetime import datetime, timedelta

from app.domain.execution import ReasonCode
from app.domain.message import render
from app.domain.models import Alarm, Robot, Settings
from app.i18n import _, ngettext
from app.screens.common import formats
from app.screens.common.alarms_view import (
    advice_of,
    alarm_icon,
    alarm_note,
    alarm_text,
    alarm_tone,
    can_be_handled,
    id_in,
    is_over,
    is_past,
    is_shelved,
    is_unseen,
    message_id,
    reason_of,
    short_words,
    silence,
    urgency,
    way_to,
)
from app.services.live.alarms import SHELF_HOURS
from app.widgets.items import Action, Item, Option

ENOUGH = 3  # alarms, from which on they share a line
NAMED = 3  # robots or missions whose names are in the note
APART = timedelta(minutes=1)  # at most, between one that falls silent and the next, an error and the end of a run
Together = tuple[Alarm, ...]  # alarms in one line; one alone: itself

_OF_RUNS = ("execution_failed", "execution_skipped")
_OF_ROBOTS = ("unreachable", "unauthorized", "robot_error")


def _began(alarm: Alarm) -> datetime:
    return alarm.last_at or alarm.raised_at


def _reason(alarm: Alarm) -> str:
    """Why a run ended: the problem with the robot if there was one, regardless of the limit reached."""
    reason = alarm.details.get("reason")
    if not isinstance(reason, Mapping):
        return ""
    details = reason.get("details")
    return message_id(details.get("problem") if isinstance(details, Mapping) else None) or str(reason.get("code"))


def _is_cause(error: Alarm, ended: Alarm) -> bool:
    """Whether this robot error ended the run: it gives the same reason about that time, or none."""
    reason, problem = ended.details.get("reason"), render(error.details.get("problem", ""))
    if (
        not isinstance(reason, Mapping)
        or reason.get("code") != ReasonCode.ROBOT_ABORTED
        or abs(_began(error) - _began(ended)) > APART
    ):
        return False
    details = reason.get("details")
    said = render(details.get("message", "") if isinstance(details, Mapping) else "")
    return said in problem or problem in said


def _with_their_runs(alarms: Sequence[Alarm], now: datetime) -> list[Together]:
    """Errors of robots, each with the runs it ended: the more urgent first, which is the error while it lasts."""
    failed: dict[tuple[object, ...], list[Alarm]] = defaultdict(list)
    for alarm in alarms:
        if alarm.code == "execution_failed" and isinstance(robot_id := alarm.details.get("robot_id"), int):
            failed[_seen(alarm, now), robot_id].append(alarm)
    errors = [
        (alarm, failed[_seen(alarm, now), id_in(alarm.key, "robot")]) for alarm in alarms if alarm.code == "robot_error"
    ]
    found = [(error, *(run for run in runs if _is_cause(error, run))) for error, runs in errors]
    return [tuple(sorted(group, key=urgency)) for group in found if len(group) > 1]


def _seen(alarm: Alarm, now: datetime) -> tuple[bool, bool]:
    return alarm.acknowledged_at is None, is_shelved(alarm, now)


def has_leader(group: Together) -> bool:
    """Whether the first alarm explains the others: an error, and the runs it ended."""
    return len(group) == 1 or len({alarm.code for alarm in group}) > 1


def together(alarms: Iterable[Alarm], now: datetime) -> list[Together]:
    """Every alarm is in exactly one line. Only what has one cause and is in the same state shares one."""
    alarms = tuple(alarms)
    lines = _with_their_runs(alarms, now)
    grouped = {id(alarm) for group in lines for alarm in group}
    troubled: dict[tuple[object, ...], list[Alarm]] = defaultdict(list)
    ended: dict[tuple[object, ...], list[Alarm]] = defaultdict(list)
    of_fleets: dict[tuple[object, ...], list[Alarm]] = defaultdict(list)
    for alarm in alarms:
        state, robot_id = (is_over(alarm), *_seen(alarm, now)), alarm.details.get("robot_id")
        if id(alarm) in grouped:
            continue
        if fleet := alarm.details.get("fleet"):
            of_fleets[str(fleet), alarm.code, *state].append(alarm)
        elif alarm.code in _OF_ROBOTS and short_words(alarm):
            troubled[alarm.code, silence(alarm), short_words(alarm), *state].append(alarm)
        elif alarm.code in _OF_RUNS and isinstance(robot_id, int):
            ended[alarm.code, robot_id, _reason(alarm), *state].append(alarm)
        else:
            lines.append((alarm,))
    for run in [*(run for same in troubled.values() for run in _runs(sorted(same, key=_began))), *ended.values()]:
        lines += [tuple(run)] if len(run) >= ENOUGH else [(alarm,) for alarm in run]
    return lines + [tuple(same) for same in of_fleets.values()]


def _runs(alarms: Sequence[Alarm]) -> list[list[Alarm]]:
    """Those that began one within a minute of the other."""
    runs: list[list[Alarm]] = []
    for alarm in alarms:
        if runs and _began(alarm) - _began(runs[-1][-1]) <= APART:
            runs[-1].append(alarm)
        else:
            runs.append([alarm])
    return runs


def who_and_what(group: Together) -> tuple[str, str]:
    """The robot, or how many, and what is the matter; empty where only the whole sentence says it."""
    alarm, n = group[0], len(group)
    robot, runs = str(alarm.details.get("robot", "–")), [alarm for alarm in group if alarm.code in _OF_RUNS]
    if alarm in runs and len(runs) > 1:
        n = sum(run.count for run in runs)
        if alarm.code == "execution_failed":
            return robot, ngettext("{n} mission failed", "{n} missions failed", n).format(n=n)
        return robot, ngettext("{n} mission was not run", "{n} missions were not run", n).format(n=n)
    what = short_words(alarm)
    if fleet := alarm.details.get("fleet"):
        robot = str(fleet)
    elif what and not has_leader(group):
        robot = ngettext("{n} robot", "{n} robots", n).format(n=n)
    return (robot, what) if what else ("", "")


def group_text(group: Together, settings: Settings, now: datetime) -> str:
    """The cause that they share."""
    who, what = who_and_what(group)
    if what and group[0].code != "question":  # its sentence is as short
        return _("{robot}: {problem}").format(robot=who, problem=what)
    return alarm_text(group[0], settings, now)


def _advice(group: Together) -> str:
    """Of robots with one cause."""
    if group[0].details.get("fleet"):
        return advice_of(group[0])
    return {
        "network": _("All at the same minute. Is the access point on?"),
        "refused": _("Are they starting? Are their ports right?"),
        "names": _("Enter the robots' addresses in numbers instead."),
    }.get(silence(group[0])) or advice_of(group[0])


def _names(alarms: Iterable[Alarm], of: str) -> tuple[int, str]:
    """How many they are, and the first of them."""
    found = list(dict.fromkeys(str(alarm.details.get(of, "–")) for alarm in alarms))
    return len(found), ", ".join(found[:NAMED]) + (" …" if len(found) > NAMED else "")


def _note_of_error(group: Together, settings: Settings, now: datetime) -> str:
    """Which missions an error has ended; of an error that is over, only these remain."""
    note = alarm_note(group[0], settings, now)
    if group[0].code == "robot_error":
        n, names = _names((alarm for alarm in group if alarm.code in _OF_RUNS), "mission")
        ended = ngettext("Mission failed: {missions}", "Missions failed: {missions}", n).format(missions=names)
        return " · ".join(filter(None, (ended, note)))
    error = next(alarm for alarm in group if alarm.code == "robot_error")
    over = _("Over since {time}").format(time=formats.day_and_time(error.cleared_at, settings.timezone, now))
    return " · ".join(filter(None, (note, over)))


def group_note(group: Together, settings: Settings, now: datetime) -> str:
    """Which robots or missions, and why, what to do, or since when it is over."""
    if len(group) == 1:
        return alarm_note(group[0], settings, now)
    if has_leader(group):
        return _note_of_error(group, settings, now)
    of_runs, zone = group[0].code in _OF_RUNS, settings.timezone
    _count, names = _names(group, "mission" if of_runs else "robot")
    if of_runs:
        newest = max(group, key=_began)
        reason = reason_of(newest, settings) if _reason(newest) else ""
        return " · ".join(
            filter(None, (reason, _("last {time}").format(time=formats.day_and_time(_began(newest), zone, now)), names))
        )
    if is_over(group[0]):
        ended = max(alarm.cleared_at for alarm in group if alarm.cleared_at is not None)
        return " · ".join((_("Over since {time}").format(time=formats.day_and_time(ended, zone, now)), names))
    return " · ".join(filter(None, (names, _advice(group))))


def alarm_item(
    group: Together,
    robots: Mapping[int, Robot],
    settings: Settings,
    now: datetime,
    below: bool = False,
    why_no_reset: str = "",
) -> Item:
    """The row of an alarm, or of several with one cause. ``below``: its buttons have a line of their own;
    ``why_no_reset``: its robot's errors can't be reset from here."""
    alarm, n = group[0], len(group)
    who, what = who_and_what(group)
    note = group_note(group, settings, now)
    return Item(
        ("group" if n > 1 else "alarm", alarm.id),
        what[:1].upper() + what[1:] or alarm_text(alarm, settings, now),
        note[:1].upper() + note[1:],
        lead=formats.day_or_time(_began(alarm), settings.timezone, now),
        icon=alarm_icon(alarm),
        tone="neutral" if is_shelved(alarm, now) else alarm_tone(alarm),
        actions=_actions(group, robots, now, why_no_reset),
        disc=True,
        loud=alarm_tone(alarm) == "fault",
        edge=True,
        who=who,
        strong=is_unseen(alarm),
        below=below,
        opens=False,
    )


def _actions(group: Together, robots: Mapping[int, Robot], now: datetime, why_no_reset: str) -> tuple[Action, ...]:
    alarm, n = group[0], len(group)
    fold = [Action("fold", icon="unfold-more-horizontal")] if n > 1 else []
    if is_shelved(alarm, now):
        return (Action("unshelve", _("Unshelve")), *fold)
    if is_past(alarm):
        return ()
    way = way_to(alarm, robots) if has_leader(group) else None
    word = _("Acknowledge") if n == 1 else _("Acknowledge {n}").format(n=n)
    seen = [Action("acknowledge", word, style="text", tone="accent")] if is_unseen(alarm) else []
    solving = [Action("way", way.word)] if way is not None else []
    if way is not None and alarm.code == "robot_error":
        solving = [Action("reset", _("Reset errors"), off=why_no_reset)]
    menu = [Action("menu", icon="dots-vertical")] if can_be_handled(alarm) else []
    return (*seen, *solving, *fold, *menu)


def menu_of_group(group: Together) -> list[Option]:
    """What else can be done about them; the keys are "note" and a number of hours."""
    note = [Option("note", _("Acknowledge with a note"), "note-edit-outline")] if is_unseen(group[0]) else []
    return note + [
        Option(
            hours, ngettext("Shelve for {n} hour", "Shelve for {n} hours", hours).format(n=hours), "bell-sleep-outline"
        )
        for hours in SHELF_HOURS
    ]
