"""Finds schedules that often come late and what would have helped, and keeps what people answer. Nothing is ever changed by itself.

``compute`` takes seconds on a site of many hundred schedules: it is called in the background, at night and when the card is opened.
"""

from __future__ import annotations

import sqlite3
import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from datetime import datetime, timedelta
from types import MappingProxyType

from app.database.connection import Database
from app.database.groups import GroupRepository
from app.database.missions import MissionRepository
from app.database.robots import RobotRepository
from app.database.schedules import ScheduleRepository
from app.database.suggestions import ACCEPTED, DISMISSED, Answer, SuggestionRepository
from app.domain.clock import Clock
from app.domain.models import Group, InvalidInput, Mission, Robot, Schedule
from app.services.planning.recurrence import Frequency, Recurrence
from app.services.suggestions.find import MOST, Finding, Kind, Option, Rule, findings, shifts
from app.services.suggestions.history import counts, is_late, past_of
from app.services.suggestions.words import Change, Result, Suggestion

UNDONE = "undone"  # an answer: the schedule is again as it was before its suggestion was accepted
LOOKS_BACK = timedelta(days=28)
SILENT_FOR = timedelta(days=60)
TELLS_AFTER = timedelta(days=14)
DOUBLES = 2  # times as large a share of late starts ends the silence

HasMission = Callable[[int, str], bool]


@dataclass(frozen=True)
class Advice:
    """At most three suggestions, the worst first; and what came of those that were accepted, the newest first."""

    suggestions: tuple[Suggestion, ...] = ()
    results: tuple[Result, ...] = ()


class Suggestions:
    """``has_mission``: whether a robot has a mission, by its id and the guid, as far as its list is known."""

    def __init__(self, db: Database, clock: Clock, has_mission: HasMission = lambda _robot_id, _guid: True) -> None:
        self._db, self._clock, self._has_mission = db, clock, has_mission
        self._repository = SuggestionRepository()
        self.latest: Advice | None = None  # as it was computed last; None: not yet, or not since an answer

    def compute(self) -> Advice:
        """From the last four weeks. Reads the database, and works for up to some seconds: never on the window's thread."""
        c, now = self._db.read(), self._clock.now()
        answers = self._repository.answers(c)
        site = _Site(c, self._has_mission)
        accepted = {answer.schedule_id: answer.at for answer in answers if answer.answer == ACCEPTED}
        undone = {(answer.schedule_id, answer.at): _before(answer) for answer in answers if answer.answer == UNDONE}

        def changed(schedule: Schedule) -> datetime | None:
            return schedule.changed_at and undone.get((schedule.id, schedule.changed_at), schedule.changed_at)

        since = {
            schedule.id: max(filter(None, (changed(schedule), accepted.get(schedule.id), now - LOOKS_BACK))).timestamp()
            for schedule in site.schedules.values()
            if schedule.enabled and schedule.next_at is not None
        }
        past = past_of(
            self._repository.runs(c, now - LOOKS_BACK), self._repository.activities(c, now - LOOKS_BACK), since
        )
        found = findings(past, [site.rule(site.schedules[key]) for key in since], _let_others_go_on)
        told = [one for one in found if not _is_silent(one, answers, now)][:MOST]
        advice = Advice(tuple(site.suggestion(one) for one in told), tuple(self._results(c, site, answers, now)))
        self.latest = advice
        return advice

    def dismiss(self, suggestion: Suggestion) -> Answer:
        """ "Not now": nothing about that schedule for 60 days, unless its share of late starts doubles."""
        return self._answer(suggestion, DISMISSED, None)

    def accept(self, suggestion: Suggestion, option: Option) -> Answer:
        """Its draft has been saved by a person: from now on only the starts after that count."""
        return self._answer(suggestion, ACCEPTED, option)

    def take_back(self, answer: Answer) -> None:
        """Undo an answer: it is as if it had not been given."""
        self._db.write(lambda c: self._repository.take_back(c, answer.id))
        self.latest = None

    def take_back_change(self, answer: Answer, before: Schedule, now: Schedule) -> None:
        """Undo that one was accepted. The schedule is ``now`` again as it was ``before``: what it did then goes on to count, though it has
        just been changed."""
        self.take_back(answer)
        if before.changed_at is not None and now.changed_at is not None:
            undone = replace(answer, answer=UNDONE, at=now.changed_at, option={"since": before.changed_at.isoformat()})
            self._db.write(lambda c: self._repository.answer(c, undone))

    def _answer(self, suggestion: Suggestion, word: str, option: Option | None) -> Answer:
        finding = suggestion.finding
        details = {} if option is None else {"kind": str(option.kind), "value": option.value, "late": option.late}
        given = Answer(finding.schedule, word, self._clock.now(), finding.late, finding.starts, details)
        kept = self._db.write(lambda c: self._repository.answer(c, given))
        self.latest = None
        return kept

    def _results(
        self, c: sqlite3.Connection, site: _Site, answers: Sequence[Answer], now: datetime
    ) -> Iterator[Result]:
        newest = {answer.schedule_id: answer for answer in answers if answer.answer == ACCEPTED}
        for answer in sorted(newest.values(), key=lambda one: one.at, reverse=True):
            schedule = site.schedules.get(answer.schedule_id)
            if schedule is None or not TELLS_AFTER <= now - answer.at < SILENT_FOR:
                continue
            runs = [run for run in self._repository.runs_of(c, answer.schedule_id, answer.at) if counts(run)]
            if runs:
                replayed = answer.option.get("late", 0)
                yield Result(
                    schedule,
                    sum(is_late(run) for run in runs),
                    len(runs),
                    answer.late,
                    answer.starts,
                    replayed,
                    answer.id,
                )


def _let_others_go_on() -> None:
    """Give the interpreter away for a moment, so that a window is drawn in time meanwhile."""
    time.sleep(0)


def _before(answer: Answer) -> datetime:
    """Since when the schedule had been as it is again; since the undo where that can't be read."""
    try:
        since = datetime.fromisoformat(str(answer.option.get("since")))
    except ValueError:
        return answer.at
    return since if since.tzinfo is not None else answer.at


def _is_silent(finding: Finding, answers: Sequence[Answer], now: datetime) -> bool:
    return any(
        answer.answer == DISMISSED
        and answer.schedule_id == finding.schedule
        and now - answer.at < SILENT_FOR
        and finding.share < DOUBLES * answer.late / answer.starts
        for answer in answers
    )


class _Site:
    """What is configured: what could be done about a schedule, and how it is called."""

    def __init__(self, c: sqlite3.Connection, has_mission: HasMission) -> None:
        self._has_mission = has_mission
        self.schedules = {schedule.id: schedule for schedule in ScheduleRepository().all(c)}
        self._robots = {robot.id: robot for robot in RobotRepository().all(c)}
        self._groups = {group.id: group for group in GroupRepository().all(c)}
        self._missions = {mission.id: mission for mission in MissionRepository().all(c)}
        self._meant = {(mission.name, mission.robot_id): mission for mission in self._missions.values()}

    def rule(self, schedule: Schedule) -> Rule:
        mission = self._missions[schedule.mission_id]
        able = [
            robot.id
            for robot in sorted(self._robots.values(), key=lambda one: one.name)
            if robot.enabled and not robot.needs_password and self._mission(mission.name, robot) is not None
        ]
        times = [shift for shift in shifts() if _keeps_days(schedule, shift)]
        if schedule.robot_id is None:
            group = self._groups.get(schedule.group_id or 0)
            return Rule(schedule.id, tuple(robot_id for robot_id in able if group and robot_id in group.members), times)
        others = tuple(robot_id for robot_id in able if robot_id != schedule.robot_id)
        groups = tuple(
            (group.id, members)
            for group in self._groups.values()
            if schedule.robot_id in group.members
            and (members := tuple(robot_id for robot_id in able if robot_id in group.members))
            and len(members) > 1
        )
        return Rule(
            schedule.id, (schedule.robot_id,), times, others, groups if (mission.name, None) in self._meant else ()
        )

    def _mission(self, name: str, robot: Robot) -> Mission | None:
        """What has that name on a robot."""
        meant = self._meant.get((name, robot.id)) or self._meant.get((name, None))
        return meant if meant is not None and self._has_mission(robot.id, meant.guid) else None

    def suggestion(self, finding: Finding) -> Suggestion:
        schedule = self.schedules[finding.schedule]
        target = self._robots.get(schedule.robot_id or 0) or self._groups.get(schedule.group_id or 0)
        changes = tuple(self._change(schedule, option) for option in finding.options)
        return Suggestion(finding, schedule, target.name if target else "", changes)

    def _change(self, schedule: Schedule, option: Option) -> Change:
        if option.kind is Kind.TIME:
            start = schedule.start + timedelta(seconds=option.value)
            is_often = Recurrence.parse(schedule.recurrence).frequency.is_sub_daily
            return Change(option, replace(schedule, start=start), at=None if is_often else start.time())
        mission = self._missions[schedule.mission_id].name
        if option.kind is Kind.ROBOT:
            robot = self._robots[int(option.value)]
            meant = self._mission(mission, robot) or self._missions[schedule.mission_id]
            return Change(option, replace(schedule, robot_id=robot.id, mission_id=meant.id), robot=robot.name)
        group: Group = self._groups[int(option.value)]
        draft = replace(schedule, robot_id=None, group_id=group.id, mission_id=self._meant[mission, None].id)
        return Change(option, draft, group=group.name)


_PERIODS_S: Mapping[Frequency, float] = MappingProxyType({Frequency.MINUTELY: 60.0, Frequency.HOURLY: 3600.0})


def _keeps_days(schedule: Schedule, shift: float) -> bool:
    """Whether all starts can be moved by changing when it begins, and stay on their days."""
    try:
        rule = Recurrence.parse(schedule.recurrence)
    except InvalidInput:
        return False
    moved = schedule.start + timedelta(seconds=shift)
    if schedule.between is not None or rule.hours or rule.minutes or moved.date() != schedule.start.date():
        return False
    return not rule.frequency.is_sub_daily or abs(shift) < rule.interval * _PERIODS_S[rule.frequency]
