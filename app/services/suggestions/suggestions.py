"""Finds schedules that are often late and what would help in the present plan, and stores people's answers. Never
changes anything itself."""

from __future__ import annotations

import sqlite3
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from datetime import datetime, timedelta
from enum import StrEnum
from itertools import islice
from types import MappingProxyType

from app.database.connection import Database
from app.database.groups import GroupRepository
from app.database.robots import RobotRepository
from app.database.schedules import ScheduleRepository
from app.database.suggestions import ACCEPTED, DISMISSED, Answer, SuggestionRepository
from app.domain import writing
from app.domain.clock import Clock
from app.domain.models import Mission, Robot, Schedule
from app.domain.writing import Translate
from app.services.planning.durations import LiveRobots, MissionDurations
from app.services.planning.recurrence import Recurrence
from app.services.suggestions.late_schedules import Cause, Finding, counts, findings, is_late

UNDONE = "undone"  # an answer: the accepted suggestion was undone
LOOKS_BACK = timedelta(days=28)
SILENT_FOR = timedelta(days=60)
RESULTS_AFTER = timedelta(days=14)
DOUBLES = 2  # times as large a share of late starts ends the silence
MOST = 3  # suggestions at once
MOST_EXAMINED = (
    10  # late schedules for which the plan is searched: a preview for each robot may take a tenth of a second
)

HasMission = Callable[[int, str], bool]
FreeAt = Callable[[Schedule], datetime | None]


class Kind(StrEnum):
    TIME = "time"
    ROBOT = "robot"
    GROUP = "group"


@dataclass(frozen=True)
class Change:
    """A change that would help. ``draft``: the changed schedule, for the form; by the present plan ``robot``, or one of
    ``group``, is free then. ``is_often``: it starts several times a day; ``shift_s``: the shift of all its times."""

    kind: Kind
    draft: Schedule
    robot: str = ""
    group: str = ""
    shift_s: float = 0.0
    is_often: bool = False


@dataclass(frozen=True)
class Suggestion:
    """``whose``: its robot, or its group."""

    finding: Finding
    schedule: Schedule
    whose: str
    changes: tuple[Change, ...] = ()


@dataclass(frozen=True)
class Result:
    """The result of a suggestion that was accepted at least two weeks ago: ``late`` of ``starts`` since then."""

    schedule: Schedule
    late: int
    starts: int
    before: Answer


@dataclass(frozen=True)
class Advice:
    """At most three suggestions, the worst first; and the results of accepted ones, the newest first."""

    suggestions: tuple[Suggestion, ...] = ()
    results: tuple[Result, ...] = ()


class Suggestions:
    """``has_mission``: whether a robot has a mission, by its id and the guid, if its list is known. ``free_at``: the
    nearest first start of a schedule without an overlap, possibly its own; None if there is none, or it can't run."""

    def __init__(self, db: Database, clock: Clock, has_mission: HasMission, free_at: FreeAt) -> None:
        self._db, self._clock, self._has_mission, self._free_at = db, clock, has_mission, free_at
        self._repository = SuggestionRepository()
        self.latest: Advice | None = None  # as last computed; None: not yet, or not since an answer

    def compute(self) -> Advice:
        """From the last four weeks. Reads the database, and works for up to some seconds: never on the window's thread."""
        c, now = self._db.read(), self._clock.now()
        answers = self._repository.answers(c)
        site = _Site(c, self._has_mission, self._free_at)
        runs = self._repository.runs(c, now - LOOKS_BACK)
        found = findings(runs, self._since(site, answers, now), lambda *at: self._repository.activity_at(c, *at))
        worst = islice((one for one in found if not _is_silent(one, answers, now)), MOST_EXAMINED)
        helpful = tuple(islice((one for one in map(site.suggestion, worst) if one.changes), MOST))
        self.latest = Advice(helpful, tuple(self._results(c, site, answers, now)))
        return self.latest

    @staticmethod
    def _since(site: _Site, answers: Sequence[Answer], now: datetime) -> dict[int, float]:
        """Since when each schedule with future starts is unchanged."""
        accepted = {answer.schedule_id: answer.at for answer in answers if answer.answer == ACCEPTED}
        undone = {(answer.schedule_id, answer.at): _before(answer) for answer in answers if answer.answer == UNDONE}
        return {
            one.id: max(
                accepted.get(one.id, now - LOOKS_BACK),
                undone.get((one.id, one.changed_at), one.changed_at) if one.changed_at else now - LOOKS_BACK,
                now - LOOKS_BACK,
            ).timestamp()
            for one in site.schedules.values()
            if one.enabled and one.next_at is not None
        }

    def dismiss(self, suggestion: Suggestion) -> Answer:
        """ "Not now": nothing about that schedule for 60 days, unless its share of late starts doubles."""
        return self._answer(suggestion, DISMISSED, {})

    def accept(self, suggestion: Suggestion, change: Change) -> Answer:
        """Its draft has been saved by a person: from now on only the starts after that count."""
        return self._answer(suggestion, ACCEPTED, {"kind": change.kind.value})

    def undo(self, answer: Answer) -> None:
        """As if it had never been there."""
        self._db.write(lambda c: self._repository.remove(c, answer.id))
        self.latest = None

    def undo_change(self, answer: Answer, before: Schedule, now: Schedule) -> None:
        """Undo an accepted suggestion. The schedule is ``now`` the same as ``before``: its earlier starts still count,
        though it has just been changed."""
        self.undo(answer)
        if before.changed_at is not None and now.changed_at is not None:
            undone = replace(answer, answer=UNDONE, at=now.changed_at, option={"since": before.changed_at.isoformat()})
            self._db.write(lambda c: self._repository.answer(c, undone))

    def _answer(self, suggestion: Suggestion, word: str, option: Mapping[str, str]) -> Answer:
        one = suggestion.finding
        answer = Answer(one.schedule, word, self._clock.now(), one.late, one.starts, option)
        stored = self._db.write(lambda c: self._repository.answer(c, answer))
        self.latest = None
        return stored

    def _results(
        self, c: sqlite3.Connection, site: _Site, answers: Sequence[Answer], now: datetime
    ) -> Iterator[Result]:
        newest = {answer.schedule_id: answer for answer in answers if answer.answer == ACCEPTED}
        for answer in sorted(newest.values(), key=lambda one: one.at, reverse=True):
            schedule = site.schedules.get(answer.schedule_id)
            if schedule is None or not RESULTS_AFTER <= now - answer.at < SILENT_FOR:
                continue
            runs = [run for run in self._repository.runs_of(c, answer.schedule_id, answer.at) if counts(run)]
            if runs:
                yield Result(schedule, sum(map(is_late, runs)), len(runs), answer)


def _before(answer: Answer) -> datetime:
    """Since when the schedule had been in this state before; since the undo if that can't be read."""
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
    """The configuration: possible changes of a schedule, and its name."""

    def __init__(self, c: sqlite3.Connection, has_mission: HasMission, free_at: FreeAt) -> None:
        self._free_at, self._missions = free_at, MissionDurations(c, live=LiveRobots(has_mission=has_mission))
        self.schedules = {schedule.id: schedule for schedule in ScheduleRepository().all(c)}
        self._robots = {robot.id: robot for robot in RobotRepository().all(c)}
        self._groups = {group.id: group for group in GroupRepository().all(c)}

    def suggestion(self, finding: Finding) -> Suggestion:
        schedule = self.schedules[finding.schedule]
        target = self._robots.get(schedule.robot_id or 0) or self._groups.get(schedule.group_id or 0)
        is_often = Recurrence.parse(schedule.recurrence).frequency.is_sub_daily
        changes = tuple(replace(change, is_often=is_often) for change in self._changes(schedule))
        return Suggestion(finding, schedule, target.name if target else "", changes)

    def _changes(self, schedule: Schedule) -> Iterator[Change]:
        """Another time; another robot that is free at its times; any of a group that its robot is of. One of each at most."""
        robot, group = self._robots.get(schedule.robot_id or 0), self._groups.get(schedule.group_id or 0)
        start, name = self._free_at(schedule), self._missions.missions[schedule.mission_id].name
        if start is not None and start != schedule.start:
            shift_s = (start - schedule.start).total_seconds()
            draft = replace(schedule, start=start)
            yield Change(Kind.TIME, draft, robot.name if robot else "", group.name if group else "", shift_s)
        if robot is None:
            return
        able = {one.id: meant for one in self._robots.values() if (meant := self._mission(name, one)) is not None}
        general = self._missions.mission(name)
        robots = (
            Change(Kind.ROBOT, replace(schedule, robot_id=one.id, mission_id=able[one.id].id), robot=one.name)
            for one in sorted(self._robots.values(), key=lambda one: one.name)
            if one.id in able.keys() - {robot.id}
        )
        groups = (
            Change(Kind.GROUP, replace(schedule, robot_id=None, group_id=one.id, mission_id=general.id), group=one.name)
            for one in self._groups.values()
            if general is not None and robot.id in one.members and len(able.keys() & set(one.members)) > 1
        )
        for drafts in (robots, groups):
            yield from islice((one for one in drafts if self._free_at(one.draft) == schedule.start), 1)

    def _mission(self, name: str, robot: Robot) -> Mission | None:
        """The mission with that name on a usable robot."""
        may_use = robot.enabled and not robot.needs_password and self._missions.has(robot.id, name)
        return self._missions.mission(name, robot.id) if may_use else None


# ---------------------------------------------------------------------- in words
_CAUSES: Mapping[Cause, str] = MappingProxyType(
    {
        Cause.BUSY: "{robot} was busy with {mission}",
        Cause.OTHER: "{robot} was busy with something that was not planned here",
        Cause.STOPPED: "{robot} stood still",
        Cause.SILENT: "{robot} did not answer",
        Cause.BATTERY: "the battery of {robot} was too low",
    }
)
_FOUND = "{schedule} was late in {late} of its last {starts} starts"
_TYPICALLY = "{found}, typically {minutes} min"
_BECAUSE = "{found}: {cause}"
_DONE: Mapping[str, str] = MappingProxyType(
    {
        "at": "Move to {time}",
        "later": "Move {minutes} min later",
        "earlier": "Move {minutes} min earlier",
        "robot": "Use {robot}",
        "group": "Any of {group}",
    }
)


def sentence(suggestion: Suggestion, translate: Translate = lambda text: text, called: str = "") -> str:
    """The finding: "Kits to line 2 was late in 16 of its last 20 starts, typically 9 min: Aino was busy with Waste".
    ``called``: the schedule's name for people; empty: its own name."""
    one = suggestion.finding
    text = translate(_FOUND).format(schedule=called or suggestion.schedule.name, late=one.late, starts=one.starts)
    if one.typical_s is not None:
        text = translate(_TYPICALLY).format(found=text, minutes=max(1, round(one.typical_s / 60)))
    if cause := because(suggestion, translate):
        text = translate(_BECAUSE).format(found=text, cause=cause)
    return text


def because(suggestion: Suggestion, translate: Translate = lambda text: text) -> str:
    """Why it was late: "Aino was busy with Waste"; empty: not known."""
    one = suggestion.finding
    if one.cause not in _CAUSES:
        return ""
    return translate(_CAUSES[one.cause]).format(robot=suggestion.whose, mission=one.mission)


def action(change: Change, translate: Translate = lambda text: text) -> str:
    """What its button says: "Move to 07:50"."""
    key = change.kind.value
    if change.kind is Kind.TIME:
        key = _moved(change) if change.is_often else "at"
    return translate(_DONE[key]).format(robot=change.robot, group=change.group, **_times(change, translate))


def _moved(change: Change) -> str:
    return "later" if change.shift_s > 0 else "earlier"


def _times(change: Change, translate: Translate) -> dict[str, object]:
    return {
        "time": writing.time_of_day(change.draft.start.time(), translate),
        "minutes": round(abs(change.shift_s) / 60),
    }
