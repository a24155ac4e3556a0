"""Time zones of the settings and of schedules: the one to use if none was chosen yet, or if one is not known here."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

from app.domain.models import Schedule
from app.services.catalogue import checks, schedule_edit
from app.services.catalogue.edit import Edit
from app.services.live.alarms import ZONE_GUESSED, alarm_of
from app.services.live.changes import Topic
from app.services.live.tablet_zone import TabletZone


def take_known_zones(edit: Edit, find_zone: Callable[[], TabletZone]) -> list[str]:
    """At a start: settings without a time zone, or with one that is not known here (of another system or version),
    get the tablet's; a person is asked if that isn't certain. Schedules with an unknown zone get that of the
    settings, and are switched off if it is only a guess, as they could start at wrong times. Returns one line for
    each, for the log."""
    lines, stored = [], edit.settings.timezone
    is_stored = edit.stored_settings.is_stored(edit.c, "timezone")
    if not is_stored or not checks.is_zone(stored):
        found = find_zone()
        if is_stored:
            lines.append(f"the time zone {stored} is not known here; the settings take {found.name}")
        edit.settings = edit.stored_settings.save(edit.c, timezone=found.name)
        edit.topics.add(Topic.SETTINGS)
        if not found.is_certain:
            ask_for_zone(edit)
            lines.append(
                f"it was not certain which time zone the tablet has; the settings take {found.name} until one is chosen"
            )
    for schedule in edit.schedules.all(edit.c):
        if not checks.is_zone(schedule.timezone):
            lines.append(_take_known_zone(edit, schedule))
    return lines


def _take_known_zone(edit: Edit, schedule: Schedule) -> str:
    unknown, zone = schedule.timezone, edit.settings.timezone
    is_guess = edit.alarms.active(edit.c, *ZONE_GUESSED) is not None
    known = replace(schedule, timezone=zone, enabled=schedule.enabled and not is_guess, changed_at=edit.now)
    edit.schedules.update(edit.c, replace(known, next_at=schedule_edit.next_due(edit, known)))
    edit.topics.add(Topic.SCHEDULES)
    if not is_guess or not schedule.enabled:
        return f"the time zone {unknown} is not known here; the schedule {schedule.name} takes {zone}"
    details = {"schedule": schedule.name, "zone": unknown}
    edit.alarms.raise_once(edit.c, alarm_of("zone_unknown", f"zone:{schedule.id}", edit.now, details))
    edit.topics.add(Topic.ALARMS)
    return f"the time zone {unknown} is not known here; the schedule {schedule.name} is switched off"


def ask_for_zone(edit: Edit) -> None:
    """With an alarm, until a person has chosen one: that of the settings is a guess."""
    edit.alarms.raise_once(edit.c, alarm_of(*ZONE_GUESSED, edit.now, {"zone": edit.settings.timezone}))
    edit.topics.add(Topic.ALARMS)


def was_chosen(edit: Edit) -> None:
    """Chosen by a person or by a configuration: the alarm that asks for it ends."""
    if guessed := edit.alarms.active(edit.c, *ZONE_GUESSED):
        edit.alarms.clear(edit.c, *ZONE_GUESSED, edit.now)
        edit.alarms.acknowledge(edit.c, guessed.id, edit.now)
        edit.topics.add(Topic.ALARMS)
