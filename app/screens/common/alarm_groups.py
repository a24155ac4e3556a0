"""One cause, one line: many robots that fall silent within a short time have not all failed, and one robot fails all its missions at once.
Pure."""
from __future__ import annotations

from collections import defaultdict
from collections.abc import Iterable, Mapping, Sequence
from datetime import datetime, timedelta

from app.domain.message import is_message
from app.domain.models import Alarm, Settings
from app.domain.reasons import stored_sentence
from app.i18n import _, ngettext
from app.mir import errors
from app.screens.common import formats
from app.screens.common.alarms_view import AlarmEntry, alarm_icon, alarm_tone, is_over, is_shelved, state_words

ENOUGH = 3                               # alarms, from which on they share a line
NAMED = 3                                # robots or missions whose names are in the note
APART = timedelta(minutes=1)             # at most, between one that falls silent and the next
Together = tuple[Alarm, ...]             # alarms in one line; one alone: itself

# What the problems of silent robots have in common, by the code of their sentence
_CAUSES = {"no_answer": "network", "no_route": "network", "timed_out": "network", "too_slow": "network",
           "refused": "refused", "unknown_name": "names", "slow_name": "names"}
_CAUSE_OF = {errors.SENTENCES[code]: cause for code, cause in _CAUSES.items()}
_OF_RUNS = ("execution_failed", "execution_skipped")


def _began(alarm: Alarm) -> datetime:
    return alarm.last_at or alarm.raised_at


def _message_id(text: object) -> str:
    return str(text["msgid"]) if is_message(text) else ""


def _silence(alarm: Alarm) -> str:
    """Why a robot can't be reached: "network", "refused" or "names"; empty where that is not known."""
    return _CAUSE_OF.get(_message_id(alarm.details.get("problem")), "")


def _reason(alarm: Alarm) -> str:
    """What has ended a run: the problem with the robot where it was one, whichever limit it then met."""
    reason = alarm.details.get("reason")
    if not isinstance(reason, Mapping):
        return ""
    details = reason.get("details")
    return _message_id(details.get("problem") if isinstance(details, Mapping) else None) or str(reason.get("code"))


def together(alarms: Iterable[Alarm], now: datetime) -> list[Together]:
    """Every alarm is in exactly one line. Only what has one cause and is in the same state shares one."""
    lines: list[Together] = []
    silent: dict[tuple[object, ...], list[Alarm]] = defaultdict(list)
    ended: dict[tuple[object, ...], list[Alarm]] = defaultdict(list)
    for alarm in alarms:
        state, robot_id = (is_over(alarm), alarm.acknowledged_at is None, is_shelved(alarm, now)), alarm.details.get("robot_id")
        if alarm.code == "unreachable":
            silent[_silence(alarm), *state].append(alarm)
        elif alarm.code in _OF_RUNS and isinstance(robot_id, int):
            ended[alarm.code, robot_id, _reason(alarm), *state].append(alarm)
        else:
            lines.append((alarm,))
    for run in [*(run for same in silent.values() for run in _runs(sorted(same, key=_began))), *ended.values()]:
        lines += [tuple(run)] if len(run) >= ENOUGH else [(alarm,) for alarm in run]
    return lines


def _runs(alarms: Sequence[Alarm]) -> list[list[Alarm]]:
    """Those that began one shortly after the other."""
    runs: list[list[Alarm]] = []
    for alarm in alarms:
        if runs and _began(alarm) - _began(runs[-1][-1]) <= APART:
            runs[-1].append(alarm)
        else:
            runs.append([alarm])
    return runs


def group_text(group: Together, settings: Settings, now: datetime) -> str:
    """The cause that they share, and since when."""
    n, robot = len(group), str(group[0].details.get("robot", "–"))
    if group[0].code in _OF_RUNS:
        n = sum(alarm.count for alarm in group)
        words = (ngettext("{n} mission on {robot} failed", "{n} missions on {robot} failed", n) if group[0].code == "execution_failed" else
                 ngettext("{n} mission on {robot} was skipped", "{n} missions on {robot} were skipped", n))
        return words.format(n=n, robot=robot)
    return _silent_words(_silence(group[0]), is_over(group[0]), n).format(
        n=n, time=formats.day_and_time(_began(group[0]), settings.timezone, now))


def _silent_words(cause: str, over: bool, n: int) -> str:
    match cause, over:
        case "network", False:
            return ngettext("Wi-Fi: {n} robot unreachable since {time}", "Wi-Fi: {n} robots unreachable since {time}", n)
        case "network", True:
            return ngettext("Wi-Fi: {n} robot was unreachable from {time}", "Wi-Fi: {n} robots were unreachable from {time}", n)
        case "refused", False:
            return ngettext("{n} robot refuses connections since {time}", "{n} robots refuse connections since {time}", n)
        case "refused", True:
            return ngettext("{n} robot refused connections from {time}", "{n} robots refused connections from {time}", n)
        case "names", False:
            return ngettext("The name of {n} robot is not found since {time}", "The names of {n} robots are not found since {time}", n)
        case "names", True:
            return ngettext("The name of {n} robot was not found from {time}", "The names of {n} robots were not found from {time}", n)
        case _, False:
            return ngettext("{n} robot unreachable since {time}", "{n} robots unreachable since {time}", n)
    return ngettext("{n} robot was unreachable from {time}", "{n} robots were unreachable from {time}", n)


def _advice(cause: str) -> str:
    return {"network": _("is the access point on, and this tablet on its network?"),
            "refused": _("the network works; are the robots starting, and are their ports right?"),
            "names": _("does this network know names? Enter the robots' IP addresses instead")}.get(cause, "")


def group_note(group: Together, settings: Settings, now: datetime) -> str:
    """Which robots or missions, and why, what to do, or since when it is over."""
    of_runs, zone = group[0].code in _OF_RUNS, settings.timezone
    found = list(dict.fromkeys(str(alarm.details.get("mission" if of_runs else "robot", "–")) for alarm in group))
    names = ", ".join(found[:NAMED]) + (" …" if len(found) > NAMED else "")
    if of_runs:
        newest = max(group, key=_began)
        reason = stored_sentence(newest.details["reason"], zone, _) if _reason(newest) else ""
        return " · ".join(filter(None, (reason, _("last {time}").format(time=formats.day_and_time(_began(newest), zone, now)), names)))
    if is_over(group[0]):
        ended = max(alarm.cleared_at for alarm in group if alarm.cleared_at is not None)
        return " · ".join((_("Over since {time}").format(time=formats.day_and_time(ended, zone, now)), names))
    return " · ".join(filter(None, (_advice(_silence(group[0])), names)))


def group_entry(group: Together, settings: Settings, now: datetime, unfolded: bool) -> AlarmEntry:
    """Its line in the list; ``unfolded``: those of its robots are below it."""
    action = _("Unshelve") if is_shelved(group[0], now) else _("Acknowledge") if group[0].acknowledged_at is None else ""
    tone = "neutral" if is_shelved(group[0], now) else alarm_tone(group[0])
    return AlarmEntry(("group", group[0].id), alarm_icon(group[0]), tone, group_text(group, settings, now),
                      group_note(group, settings, now), *state_words(group[0], settings, now), action=action,
                      has_menu=not is_shelved(group[0], now), fold="chevron-up" if unfolded else "chevron-down")
