"""The story of one run: when it was planned, sent, started and ended, why it ended so, and how often that happened. Pure."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from datetime import datetime, timedelta
from zoneinfo import ZoneInfo

from app.database.execution_history import Replacement
from app.domain.execution import DurationEstimate, Execution, State
from app.domain.reasons import address_in
from app.i18n import _, ngettext
from app.screens.common import execution_appearance, formats
from app.screens.common.holding import waiting_words
from app.screens.common.mission_names import NOTHING_KNOWN, MissionNames
from app.screens.logs import of_groups
from app.screens.logs.view import NOT_RUN, ON_TIME_S, day_word, like_of
from app.widgets.items import Item

RUN_AGAIN = (State.FAILED, *NOT_RUN)  # possibly still wanted
SEEN_LATE = timedelta(minutes=1)  # after the robot's own durations, which show that the run was seen late


@dataclass(frozen=True)
class StoryFacts:
    """A run and what its story needs: the ``expected`` duration of its mission, the start that replaced it or that it replaced, and
    how many ended for the same cause in 30 days."""

    run: Execution
    expected: DurationEstimate | None = None
    replacement: Replacement | None = None
    like: int = 0


@dataclass(frozen=True)
class Story:
    key: int = 0
    title: str = ""
    line: str = ""  # robot and day
    cause: str = ""
    quote: str = ""  # what the robot said
    tone: str = "neutral"
    note: str = ""  # what the mission was given
    steps: tuple[Item, ...] = ()
    like: str = ""
    again: bool = False


def story(facts: StoryFacts, now: datetime, zone: ZoneInfo, mission_names: MissionNames = NOTHING_KNOWN) -> Story:
    run = facts.run
    at, words, quote = run.planned_at.astimezone(zone), *execution_appearance.cause(run, zone)
    when = f"{day_word(at.date(), now.astimezone(zone).date())} {formats.wall_time(at)}"
    return Story(
        run.id,
        mission_names.run(run),
        " · ".join((of_groups.whose(run), when)),
        waiting_words(run, str(zone)) if run.state.is_open and run.state is not State.EXECUTING else words,
        "" if quote == words else quote,
        execution_appearance.LOOKS[run.state][1],
        mission_names.line(run.mission_guid, run.parameters),
        tuple(steps(facts, zone)),
        ngettext("{n} like this in 30 days", "{n} like this in 30 days", facts.like).format(n=facts.like)
        if facts.like > 1 and like_of(run, zone)
        else "",
        run.state in RUN_AGAIN,
    )


def steps(facts: StoryFacts, zone: ZoneInfo) -> Iterator[Item]:
    """planned → sent → started → ended, as far as it went."""
    found = list(_steps(facts, zone))
    tones = ["neutral"] * (len(found) - 1) + [execution_appearance.LOOKS[facts.run.state][1]]
    for key, ((label, time, note), tone) in enumerate(zip(found, tones, strict=True)):
        yield Item(key, label, note, lead=time, icon="circle-medium", tone=tone, opens=False)


def _steps(facts: StoryFacts, zone: ZoneInfo) -> Iterator[of_groups.Step]:
    """(label, time, note) of each; with dates if there are several days."""
    run, replacement = facts.run, facts.replacement
    started_at, ran_until = _really_ran(run)
    ended_at = skipped_at(run) or ran_until
    left = replacement if replacement is not None and replacement.id == run.id else None
    instants = (run.planned_at, run.submitted_at, started_at, ended_at, left.at if left else None)
    with_day = len({at.astimezone(zone).date() for at in instants if at is not None}) > 1

    def time(at: datetime | None) -> str:
        there = None if at is None else at.astimezone(zone)
        day = [formats.wall_day(there.date())] if there and with_day else []
        return "\n".join([*day, formats.wall_time(there, seconds=True)])

    yield _("Planned"), time(run.planned_at), _planned_note(run, replacement)
    yield from of_groups.steps(run, zone)
    at = address_in(run.reason.details if run.reason is not None else run.wait_details)
    if run.submitted_at is not None:
        yield _("Sent"), time(run.submitted_at), " · ".join(filter(None, (_tries(run.attempts), at)))
    elif run.attempts:
        tried = _("{tries}, none accepted").format(tries=_tries(run.attempts))
        yield _("Tried"), formats.NOTHING, " · ".join(filter(None, (tried, at)))
    if left is not None:
        yield _("Elsewhere"), time(left.at), _("a person started it on {robot} instead").format(robot=left.other_robot)
    if started_at is not None:
        yield _("Started"), time(started_at), _queue_note(run)
    state = execution_appearance.word(run.state)
    if run.state.is_open:
        yield state, formats.NOTHING, _open_note(facts.expected)
    else:
        seen = _("seen at {time}").format(time=time(run.ended_at)) if ran_until != run.ended_at else ""
        yield state, time(ended_at), " · ".join(filter(None, (_end_note(run, facts.expected), seen)))


def _really_ran(execution: Execution) -> tuple[datetime | None, datetime | None]:
    """When it started and ended, as this tablet saw it. If it saw that much later (it was off, or the answer was lost),
    by the robot's own durations from the submission."""
    started_at, ended_at = execution.started_at, execution.ended_at
    if started_at is None or execution.submitted_at is None or execution.robot_delay_s is None:
        return started_at, ended_at
    began = execution.submitted_at + timedelta(seconds=execution.robot_delay_s)
    started_at = began if started_at - began > SEEN_LATE else started_at
    if ended_at is None or execution.duration_s is None:
        return started_at, ended_at
    done = started_at + timedelta(seconds=execution.duration_s)
    return started_at, done if ended_at - done > SEEN_LATE else ended_at


def skipped_at(execution: Execution) -> datetime | None:
    """When a person skipped it, where one did."""
    at = execution.reason.details.get("skipped_at") if execution.reason else None
    return datetime.fromisoformat(at) if isinstance(at, str) else None


def _planned_note(execution: Execution, replacement: Replacement | None) -> str:
    """Whether it is the last of several, what started it, its group, and which start it replaces."""
    last = _("the last of {n}").format(n=formats.count(execution.starts)) if execution.starts > 1 else ""
    started_by = execution.own_name or execution_appearance.trigger_word(execution.trigger)
    instead = (
        _("instead of the start on {robot}").format(robot=replacement.robot)
        if replacement and replacement.other == execution.id
        else ""
    )
    return " · ".join(filter(None, (last, started_by, of_groups.any_of(execution), instead)))


def _tries(number: int) -> str:
    return _("1st try") if number == 1 else ngettext("{n} try", "{n} tries", number).format(n=number)


def _queue_note(execution: Execution) -> str:
    """How long it waited in the robot's queue, if that was a delay."""
    if execution.robot_delay_s is None or execution.robot_delay_s <= ON_TIME_S:
        return ""
    return _("waited {duration}").format(duration=formats.duration(execution.robot_delay_s))


def _open_note(expected: DurationEstimate | None) -> str:
    """Its expected duration and the source of that."""
    if expected is None:
        return ""
    text = _("{duration} as typed in Settings") if expected.typed else _("usually {duration}")
    return text.format(duration=formats.rough_duration(expected.median_s))


def _end_note(execution: Execution, expected: DurationEstimate | None) -> str:
    """A mission that ran only once would be compared with itself."""
    if execution.duration_s is None:
        return ""
    took = formats.rough_duration(execution.duration_s)
    if expected is None or expected.runs < 2 or not expected.median_s:
        return _("after {duration}").format(duration=took)
    return _("after {duration}, usually {usual}").format(duration=took, usual=formats.rough_duration(expected.median_s))
