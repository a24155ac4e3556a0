"""The card that opens at a bar of the timeline: what the bar represents, and its actions. Pure."""

from __future__ import annotations

from datetime import datetime, timedelta

from app.domain import choice, conflicts
from app.domain.execution import Execution
from app.i18n import _
from app.screens.common import execution_appearance, foreseen, formats
from app.screens.common.group_starts import has_no_robot
from app.screens.common.holding import HAND, waiting_words
from app.screens.common.priorities import word
from app.screens.common.problems import sentence_of
from app.screens.scheduler import of_groups
from app.screens.scheduler.contested import Contested
from app.screens.scheduler.facts import SchedulerFacts
from app.screens.scheduler.timeline import span_of
from app.screens.scheduler.view import run_item
from app.services.planning.planned import ASSUMED_S, PlannedRun
from app.widgets.items import Card, Option


def run_card(facts: SchedulerFacts, execution: Execution, now: datetime) -> Card:
    """Of a run that has begun, waits or has ended, or of a skipped start: its outcome and why."""
    begins, ends = span_of(facts, execution, now)
    hold = facts.hold(execution.robot_id, execution.group_id, now)
    why = (
        waiting_words(execution, facts.settings.timezone, hold)
        if execution.state.is_open
        else execution_appearance.cause_line(execution, facts.zone) or execution_appearance.word(execution.state)
    )
    log, edit = (
        Option("log", _("Open in Logs"), "text-box-outline"),
        Option("edit", _("Edit"), "pencil-outline"),
    )
    if facts.may_start_after_all(execution, now):  # in the place of its opposite on the card of a planned start
        items = [Option("again", _("Start it after all"), "undo"), edit, log]
    else:
        items = [log, edit] if facts.schedule(execution.schedule_id) is not None else [log]
    if has_no_robot(execution) and execution.group_id is not None:
        items = [*_waiting_items(execution), *items]
    name = facts.name(facts.schedule(execution.schedule_id))
    whose = execution.ran_on or _("any of {group}").format(group=execution.robot_group)
    chosen = choice.chosen(execution.choice, facts.zone, _)
    return Card(
        facts.mission_names.run(execution),
        _lines(
            name,
            f"{whose} · {_from_to(facts, begins, ends)}",
            _moved(facts, execution.moved_from, execution.planned_at, now),
            why,
            chosen,
        ),
        tuple(items),
    )


def _waiting_items(execution: Execution) -> list[Option]:
    """The actions of Home, and Hold."""
    if execution.cancel_code is not None:
        return [Option("cancel", _("Cancel"), "close", off=_("Being cancelled"))]
    priority = _("Priority: {priority}").format(priority=word(execution.priority))
    return [
        *([] if execution.held else [Option("give", _("Give to a robot"), "robot-outline")]),
        Option("priority", priority, "chevron-double-up"),
        Option("release", _("Release"), "play") if execution.held else Option("hold", _("Hold"), HAND),
        Option("cancel", _("Cancel"), "close"),
    ]


def start_card(facts: SchedulerFacts, run: PlannedRun, now: datetime) -> Card:
    """Of a planned start: its duration if known, and its hold."""
    hold, ends = facts.hold_of(run), run.begins + timedelta(seconds=run.usual_s or ASSUMED_S)
    usual = formats.duration(run.usual_s)
    if run.usual is None:
        length = _("Its duration is not known yet: 5 min are assumed")
    elif run.usual.typed:
        length = _("Usually {usual}").format(usual=usual)
    else:
        length = _("Usually {usual}, nine of ten within {slow}").format(
            usual=usual, slow=formats.duration(run.usual.slow_s)
        )
    held = ""
    if hold is not None:
        until = hold.until and formats.day_or_time(hold.until, facts.settings.timezone, now)
        held = _("On hold until {time}").format(time=until) if until else _("On hold")
        held = f"{held}: {_(hold.reason)}" if hold.reason else held
    others = of_groups.other_robots(facts, run)
    items = (
        Option("move", _("Move"), "arrow-left-right"),
        Option("robot", _("Other robot"), "robot-outline", off="" if others else _("No other robot is switched on")),
        Option("skip", _("Skip"), "skip-next"),
        Option("edit", _("Edit"), "pencil-outline"),
        run_item(facts, run.schedule, now),
    )
    when = f"{foreseen.whose(run)} · {_from_to(facts, run.begins, ends)}"
    contested = [
        conflicts.sentence(each.code, each.at, each.details, facts.zone, _)
        for each in Contested(facts.conflicts).of(run)
    ]
    whole = facts.schedule(run.schedule.moved_of) or run.schedule
    is_elsewhere = (whole.robot_id, whole.group_id) != (run.schedule.robot_id, run.schedule.group_id)
    whose = of_groups.target_text(facts.target(whole)) if is_elsewhere else ""
    moved = _moved(facts, run.schedule.moved_from, run.at, now, whose)
    refused = facts.refused.get(run.schedule.id)
    wrong = sentence_of(refused) if refused is not None else ""
    note = _lines(facts.name(run.schedule), when, moved, foreseen.sentence(run), wrong, length, held, *contested)
    return Card(facts.mission_names.start(run), note, items)


def _moved(facts: SchedulerFacts, was: datetime | None, at: datetime, now: datetime, whose: str = "") -> str:
    """From which time, and from ``whose`` robot if that was another one."""
    time = "" if was in (None, at) else formats.day_and_time(was, facts.settings.timezone, now)
    said = " · ".join(filter(None, (whose, time)))
    return _("Moved from {where}").format(where=said) if said else ""


def _from_to(facts: SchedulerFacts, begins: datetime, ends: datetime) -> str:
    start, end = begins.astimezone(facts.zone), ends.astimezone(facts.zone)
    return f"{formats.wall_day(start.date())} {formats.wall_time(start)}–{formats.wall_time(end)}"


def _lines(*lines: str) -> str:
    return "\n".join(line for line in lines if line)
