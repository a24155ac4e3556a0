"""The persistent list of alarms, after ISA-18.2: active or cleared, acknowledged or not."""

from __future__ import annotations

import logging
import sqlite3
from collections.abc import Callable, Mapping, Sequence
from contextlib import suppress
from dataclasses import replace
from datetime import datetime, timedelta
from typing import Any

from app.database.alarms import AlarmRepository
from app.database.connection import Database
from app.database.errors import DatabaseError
from app.domain import writing
from app.domain.clock import Clock
from app.domain.message import Decimal, Message, is_message, render
from app.domain.models import Alarm, Priority, Robot
from app.domain.reasons import instants_in_words, stored_sentence
from app.domain.robot import UserPrompt, clipped
from app.domain.writing import Translate
from app.services.live.changes import Changes, Topic
from app.services.live.snapshots import Snapshots

log = logging.getLogger(__name__)

# By their priority, of each code the English sentence. Those of EVENTS are cleared from the start: they stay open until acknowledged.
SENTENCES: Mapping[str, tuple[Priority, str]] = {
    code: (priority, sentence)
    for priority, sentences in {
        Priority.HIGH: {
            "robot_error": "{robot}: {problem}",
            "emergency_stop": "{robot}: the emergency stop is pressed",
            "question": "{robot} asks: {question}",
            "wrong_robot": "Another robot answers at the address of {robot}: serial number {found} instead of {expected}, "
            "nothing is sent",
            "same_machine": "{robots} have the same serial number, {number}: they are one machine, and starts for both end "
            "up in its one queue",
            "serial_hidden": "{robot} no longer shows its serial number {expected}, nothing is sent",
            "certificate_changed": "{robot} shows another certificate than the one that is trusted, nothing is sent",
            "certificate_untrusted": "{robot} shows a certificate that is not trusted, nothing is sent",
            "needs_password": "{robot} is switched off until its password is entered, nothing is sent",
            "clock_implausible": "Nothing is sent, the tablet's clock can't be right: {problem}",
            "duplicate_running": "A second copy of {mission} has started on {robot} (queue item {queue_id})",
            "started_twice": "{mission} reached {robot} after all and had been started on {other} too",
            "unmarked_copy": "Queue item {queue_id} of {robot} may be a second copy of {mission}: this robot does not return "
            "the app's mark",
            "unknown_outcome": "It is not known whether {mission} reached {robot}: {problem}",
            "check_up_left": "{robot} is not in the state from before its check-up: {problem}",
            "database": "Nothing is sent, the database can't be written: {problem}",
            "two_tablets": "Another tablet starts missions of this plan on {robot} too, nothing is sent from here",
            "lock_lost": "{path} was deleted or replaced: another app could start missions of the same data",
            "too_few_files": "{robots} robots need about {needed} open files and connections, and the system allows "
            "{allowed}: starts may not be sent",
            "network_lost": "This tablet has no network: no robot can be reached",
            "tablet_battery_low": "The tablet's battery is down to {percent} %",
            "pin_guessed": "Somebody is guessing the PIN of Settings: {tries} wrong ones in a row, or more",
        },
        Priority.MEDIUM: {
            "unreachable": "{robot} does not answer: {problem}",
            "unauthorized": "{robot} refuses user name or password",
            "not_a_robot": "What answers at the address of {robot} is not a MiR robot: {problem}",
            "execution_failed": "{mission} on {robot} failed: {reason}",
            "start_refused": "{robot} did not take {mission}, others of {group} may take it: {reason}",
            "robot_fails": "{robot} has failed {count} starts in a row, the last one of {mission}",
            "executions_missed": "{count} planned missions were missed while the app was off or asleep, its clock was wrong, or "
            "nothing could be written",
            "duplicate_healed": "A second copy of {mission} on {robot} (queue item {queue_id}) was cancelled before it ran",
            "late_cancelled": "{mission} reached {robot} too late (queue item {queue_id}) and was cancelled",
            "adopted_unproven": "Queue item {queue_id} of {robot} was taken for {mission}, whose answer was lost: it is not "
            "known yet whether this robot returns the app's mark",
            "item_unreadable": "{robot} gives no readable answer about {mission} (queue item {queue_id}): {problem}",
            "disk_nearly_full": "The tablet's disk is nearly full: {free} MB are left",
            "chore_failed": "A part of the app does not work and is tried again: {problem}",
            "zone_guessed": "It is not certain which time zone this tablet has: times are those of {zone} until one is "
            "chosen",
            "zone_unknown": "{schedule} was switched off: its time zone {zone} is not known here",
        },
        Priority.LOW: {
            "execution_skipped": "{mission} on {robot} was not run: {reason}",
            "app_was_off": "The app was off or asleep from {start} to {end}",
            "backup_restored": "A backup was restored: what the app did from {start} to {end} is not in it",
            "clock_stepped": "The tablet's clock was moved by {seconds} s",
            "clock_not_synchronised": "The tablet's clock is not set by a time server",
            "check_up_outdated": "{robot} has to be checked up again: {change}",
            "backup_failed": "Today's backup could not be made: {problem}",
        },
    }.items()
    for code, sentence in sentences.items()
}
# Where the fleet fails through which a robot is reached, and not the robot alone: others are said with the fleet's name
_OF_FLEETS = {
    "wrong_robot": "Another fleet answers at the address of {fleet}: {found} instead of {expected}, nothing is sent",
    "not_a_robot": "What answers at the address of {fleet} is not a MiR fleet: {problem}",
}
KEPT = 1000  # past alarms
# shelving always ends automatically (ISA-18.2): an alarm shelved for ever would never be seen again
SHELF_HOURS = (1, 4, 8, 24)
LONGEST_NOTE = 200  # characters
LONGEST_DETAIL = 300  # characters, with nothing around it
LONGEST_SHOWN = 1000  # characters of a detail in a sentence: it may be one itself, and come from a backup
EVENTS = frozenset(
    {
        "execution_failed",
        "start_refused",
        "execution_skipped",
        "executions_missed",
        "app_was_off",
        "backup_restored",
        "clock_stepped",
        "duplicate_healed",
        "duplicate_running",
        "started_twice",
        "unmarked_copy",
        "unknown_outcome",
        "late_cancelled",
        "adopted_unproven",
        "item_unreadable",
        "zone_unknown",
    }
)
# code and key; while it is active, no person has chosen the time zone
ZONE_GUESSED = ("zone_guessed", "tablet")


def alarm_sentence(alarm: Alarm, translate: Translate = lambda text: text) -> str:
    """One sentence for people, with a dash for each detail that is not known."""
    if alarm.code not in SENTENCES:  # of another version, or a hostile backup
        return clipped(alarm.code, LONGEST_DETAIL)
    fleet = alarm.details.get("fleet")
    text = (fleet and _OF_FLEETS.get(alarm.code)) or SENTENCES[alarm.code][1]
    zone = str(alarm.details.get("timezone", "UTC"))
    details = {**alarm.details, **instants_in_words(alarm.details, zone, translate)}
    if fleet:
        details["robot"] = fleet
    if isinstance(count := details.get("count"), int):
        details["count"] = writing.count(count, translate)
    return translate(text).format_map(
        writing.Dashes({name: _rendered(value, zone, translate) for name, value in details.items()})
    )


def _rendered(value: Any, zone: str, translate: Translate) -> Any:
    """Reasons and problems are kept in their parts; rows of older versions have them as English text."""
    if isinstance(value, int | float):
        return Decimal(value, translate) if isinstance(value, float) else value
    is_reason = isinstance(value, Mapping) and "code" in value and not is_message(value)
    return clipped(stored_sentence(value, zone, translate) if is_reason else render(value, translate), LONGEST_SHOWN)


def _clipped(value: Any) -> Any:
    """A detail without the endless texts that a robot may send."""
    if isinstance(value, Mapping):
        return {name: _clipped(part) for name, part in value.items()}
    if isinstance(value, (list, tuple)):
        return [_clipped(part) for part in value]
    return clipped(value, LONGEST_DETAIL) if isinstance(value, str) else value


def alarm_of(code: str, key: str, now: datetime, details: Mapping[str, Any]) -> Alarm:
    """A new one, of a code in SENTENCES."""
    short = {name: _clipped(value) for name, value in details.items()}
    return Alarm(code, key, SENTENCES[code][0], now, short, last_at=now, cleared_at=now if code in EVENTS else None)


class Alarms:
    def __init__(self, db: Database, clock: Clock, changes: Changes) -> None:
        self._db, self._repository, self._clock, self._changes = db, AlarmRepository(), clock, changes
        self._database: Alarm | None = None  # the one alarm that can't be stored

    def raise_(self, code: str, key: str, **details: Any) -> None:
        """Open an alarm, or count up the open one of the same code and key."""
        self._raise(alarm_of(code, key, self._clock.now(), details))

    def raise_about_robot(self, code: str, robot: Robot, **details: Any) -> None:
        """Open a condition of a robot, unless it was removed or switched off while its answer was under way."""
        alarm = alarm_of(code, f"robot:{robot.id}", self._clock.now(), {"robot": robot.name, **details})
        self._raise(alarm, lambda c: self._repository.is_asked(c, robot.id))

    def _raise(self, alarm: Alarm, is_wanted: Callable[[sqlite3.Connection], bool] = lambda c: True) -> None:
        if self._db.write(lambda c: is_wanted(c) and self._repository.raise_once(c, alarm)):
            log.warning("alarm: %s", alarm_sentence(alarm))
        self._changes.publish(Topic.ALARMS)

    def clear(self, code: str, key: str) -> None:
        """Record that the cause has ended; the alarm stays open until it is acknowledged too. Writes only changes."""
        if self._repository.active(self._db.read(), code, key):
            self._db.write(lambda c: self._repository.clear(c, code, key, self._clock.now()))
            self._changes.publish(Topic.ALARMS)

    def note_answer(self, key: str, guid: str, answer: str) -> None:
        """What somebody has answered to the question with this guid: it need not be acknowledged, and is shown with past alarms."""
        said, now = clipped(answer, LONGEST_DETAIL), self._clock.now()
        if self._db.write(lambda c: self._repository.note_answer(c, key, guid, said, now)):
            self._changes.publish(Topic.ALARMS)

    def withdraw(self, code: str, key: str, at: datetime) -> None:
        """This event at about that time has turned out to be wrong: it need not be read, but stays in the list of past
        ones."""
        if self._db.write(lambda c: self._repository.withdraw(c, code, key, at, self._clock.now())):
            self._changes.publish(Topic.ALARMS)

    def database_fails(self, problem: Message) -> None:
        """Nothing can be written, so nothing is sent, and this alarm is kept in memory until ``database_works``."""
        if self._database is None:
            self._database = alarm_of("database", "database", self._clock.now(), {"problem": problem})
            log.error("alarm: %s", alarm_sentence(self._database))
            self._changes.publish(Topic.ALARMS)

    def database_works(self) -> Alarm | None:
        """It can be written again: the alarm is stored, cleared. Returns it, or None."""
        alarm = self._database
        if alarm is not None:
            over = replace(alarm, cleared_at=self._clock.now())
            self._db.write(lambda c: self._repository.raise_once(c, over))
            self._database = None
            log.warning("The database can be written again")
            self._changes.publish(Topic.ALARMS)
        return alarm

    @property
    def is_database_failing(self) -> bool:
        return self._database is not None

    # ------------------------------------------------------------------ the operator
    def acknowledge(self, alarm_id: int, note: str = "") -> None:
        """Record that a person has seen it, with an optional note. A second call changes nothing."""
        note = " ".join(note.split())[:LONGEST_NOTE]
        self._db.write(lambda c: self._repository.acknowledge(c, alarm_id, self._clock.now(), note))
        log.info("alarm %d acknowledged%s", alarm_id, f": {note}" if note else "")
        self._changes.publish(Topic.ALARMS)

    def unacknowledge(self, alarm_id: int) -> None:
        """Undo that. If it has come again since, that one is to be acknowledged."""
        self._db.write(lambda c: self._repository.unacknowledge(c, alarm_id))
        log.info("alarm %d is unacknowledged again", alarm_id)
        self._changes.publish(Topic.ALARMS)

    def shelve(self, alarm_id: int, hours: int) -> None:
        """Hide it for ``hours``, one of SHELF_HOURS."""
        self._shelve(alarm_id, self._clock.now() + timedelta(hours=hours))

    def unshelve(self, alarm_id: int) -> None:
        """Show it again before that time."""
        self._shelve(alarm_id, None)

    def _shelve(self, alarm_id: int, until: datetime | None) -> None:
        self._db.write(lambda c: self._repository.shelve(c, alarm_id, until))
        done = f"shelved until {until.isoformat(timespec='minutes')}" if until else "unshelved"
        log.info("alarm %d %s", alarm_id, done)
        self._changes.publish(Topic.ALARMS)

    def prune(self) -> None:
        """Delete all but the newest past alarms."""
        self._db.write(lambda c: self._repository.prune(c, KEPT))

    def past(self, limit: int) -> tuple[Sequence[Alarm], int]:
        """The newest of those that are cleared and acknowledged, and how many there are."""
        db = self._db.read()
        return self._repository.past(db, limit), self._repository.count_past(db)

    def open(self) -> list[Alarm]:
        """Not yet both cleared and acknowledged, most serious and newest first; shelved ones last. If the database
        can't be read, only that alarm."""
        now = self._clock.now()
        order = list(Priority)
        try:
            stored = self._repository.open(self._db.read())
        except sqlite3.DatabaseError:
            if self._database is None:
                raise
            stored = []
        unwritable = [self._database] if self._database else []
        return sorted(
            [*unwritable, *stored],
            key=lambda a: (
                bool(a.shelved_until and a.shelved_until > now),
                order.index(a.priority),
                a.cleared_at is not None,
                -(a.last_at or a.raised_at).timestamp(),
            ),
        )


class Prompts:
    """Of robots that wait for a person: an alarm each, until it is answered or the robot drops
    it. Works on the thread of the robot's worker, which publishes its snapshots and raises its other alarms."""

    def __init__(
        self, snapshots: Snapshots, alarms: Alarms, changes: Changes, robot: Callable[[int], Robot | None]
    ) -> None:
        self._snapshots, self._alarms, self._robot = snapshots, alarms, robot
        self._prompts: dict[int, UserPrompt | None] = {}  # of robots that were read since the start; None: no question
        changes.subscribe(self._on_change)

    def answered(self, robot_id: int, guid: str, answer: str) -> None:
        """The robot has taken an answer from here."""
        with suppress(DatabaseError):
            self._alarms.note_answer(f"robot:{robot_id}", guid, answer)

    def _on_change(self, topic: Topic, about: int | None) -> None:
        if topic is Topic.SNAPSHOT and about is not None:
            with suppress(DatabaseError):  # has its own alarm; the next snapshot is looked at again
                self._check(about)

    def _check(self, robot_id: int) -> None:
        status = self._snapshots.get(robot_id).status
        if status is None:  # removed or switched off, with its alarms; or not read yet
            self._prompts.pop(robot_id, None)
            return
        prompt = status.user_prompt
        if robot_id in self._prompts and self._prompts[robot_id] == prompt:
            return
        before = self._prompts.get(robot_id)
        if prompt is None or (before is not None and before.guid != prompt.guid):
            self._alarms.clear("question", f"robot:{robot_id}")
        if prompt is not None and (robot := self._robot(robot_id)) is not None:
            self._alarms.raise_about_robot(
                "question", robot, question=prompt.question, answers=list(prompt.options), guid=prompt.guid
            )
        self._prompts[robot_id] = prompt
