"""Many robots that fall silent within a short time have not all failed: their alarms are one line, with the cause that they share. Pure."""
from __future__ import annotations

from collections import defaultdict
from collections.abc import Iterable, Sequence
from datetime import datetime, timedelta

from app.domain.models import Alarm, Settings
from app.i18n import _, ngettext
from app.screens.common import formats
from app.screens.common.alarms_view import AlarmEntry, alarm_icon, alarm_tone, is_over, is_shelved, state_words

ENOUGH = 3                               # robots, from which on it is not they that have failed
NAMED = 3                                # robots whose names are in the note
APART = timedelta(minutes=1)             # at most, between one that falls silent and the next
Together = tuple[Alarm, ...]             # alarms in one line; one alone: itself


def _began(alarm: Alarm) -> datetime:
    return alarm.last_at or alarm.raised_at


def together(alarms: Iterable[Alarm], now: datetime) -> list[Together]:
    """Every alarm is in exactly one line. Only what is in the same state shares one."""
    lines: list[Together] = []
    silent: dict[tuple[object, ...], list[Alarm]] = defaultdict(list)
    for alarm in alarms:
        if alarm.code == "unreachable":
            silent[is_over(alarm), alarm.acknowledged_at is None, is_shelved(alarm, now)].append(alarm)
        else:
            lines.append((alarm,))
    for same in silent.values():
        for run in _runs(sorted(same, key=_began)):
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
    time = formats.day_and_time(_began(group[0]), settings.timezone, now)
    if is_over(group[0]):
        words = ngettext("Wi-Fi: {n} robot was unreachable from {time}", "Wi-Fi: {n} robots were unreachable from {time}", len(group))
    else:
        words = ngettext("Wi-Fi: {n} robot unreachable since {time}", "Wi-Fi: {n} robots unreachable since {time}", len(group))
    return words.format(n=len(group), time=time)


def group_note(group: Together, settings: Settings, now: datetime) -> str:
    """Which robots, and what to do, or since when it is over."""
    names = ", ".join(str(alarm.details.get("robot", "–")) for alarm in group[:NAMED])
    if len(group) > NAMED:
        names += " …"
    if is_over(group[0]):
        last = max(alarm.cleared_at for alarm in group if alarm.cleared_at is not None)
        return " · ".join((_("Over since {time}").format(time=formats.day_and_time(last, settings.timezone, now)), names))
    return " · ".join((_("is the access point on, and this tablet on its network?"), names))


def group_entry(group: Together, settings: Settings, now: datetime, unfolded: bool) -> AlarmEntry:
    """Its line in the list; ``unfolded``: those of its robots are below it."""
    action = _("Unshelve") if is_shelved(group[0], now) else _("Acknowledge") if group[0].acknowledged_at is None else ""
    tone = "neutral" if is_shelved(group[0], now) else alarm_tone(group[0])
    return AlarmEntry(("group", group[0].id), alarm_icon(group[0]), tone, group_text(group, settings, now),
                      group_note(group, settings, now), *state_words(group[0], settings, now), action=action,
                      has_menu=not is_shelved(group[0], now), fold="chevron-up" if unfolded else "chevron-down")
