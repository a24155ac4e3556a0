"""Bugs to be planted, each a small patch to one function, with the world in which an oracle notices it. ``test_mutants`` runs them."""

from __future__ import annotations
import __future__ as future

import importlib
import inspect
import sys
import textwrap
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, replace

from tests.simulation.profile import Profile

CLOCKS = Profile(events_per_hour=6).only(
    acts="move switch_schedule delete plan_once",
    events="big_step medium_step power_cut",
    fault_rate=0.0,
    crash_rate=0.0,
    rough_s=2400.0,
    calm_s=1200.0,
)
# A clock is trusted unproven when the app starts with a wrong one and no robot answers.
UNPROVEN = Profile(events_per_hour=120, longest_outage=300.0).only(
    acts="",
    events="big_step power_cut outage",
    fault_rate=0.0,
    crash_rate=0.0,
    site={"every_minutes": 3, "fleet": "normal", "robots": 1, "poll_interval": 120, "retry_limit": 20},
)
ABSENCES = Profile(acts_per_hour=12, events_per_hour=6).only(
    acts="pause skip",
    events="power_cut",
    fault_rate=0.0,
    crash_rate=0.0,
    rough_s=2400.0,
    calm_s=1200.0,
    site={"every_minutes": 3, "fleet": "normal", "history_limit": None},
)
PEOPLE = Profile(acts_per_hour=60, events_per_hour=20).only(
    acts="change_mission switch_schedule switch_robot delete pause skip hold cancel clear run_now plan_once working_days",
    events="lost_request outage slow_answers low_battery",
    crash_rate=0.0,
    site={"quiet_s": 90, "fleet": "normal"},
)
BUSY = Profile(acts_per_hour=60, events_per_hour=20).only(
    acts="change_mission switch_schedule delete pause skip hold run_now plan_once",
    events="lost_request outage",
    fault_rate=0.0,
    crash_rate=0.0,
    longest_outage=300.0,
    site={"quiet_s": 90, "fleet": "normal", "robots": 2, "poll_interval": 30, "every_minutes": 3},
)
HELD_STARTS = Profile(acts_per_hour=60, events_per_hour=20).only(
    acts="hold_start",
    events="outage",
    fault_rate=0.0,
    crash_rate=0.0,
    site={"quiet_s": 90, "fleet": "normal", "every_minutes": 3},
)
LOST = Profile(events_per_hour=40).only(
    acts="run_now",
    events="lost_request very_late_request",
    fault_rate=0.0,
    crash_rate=0.0,
    site={"every_minutes": 3, "fleet": "normal"},
)
MOVED_STARTS = Profile(acts_per_hour=60, events_per_hour=0).only(
    acts="move_start switch_schedule move other_robot change_mission",
    events="",
    fault_rate=0.0,
    crash_rate=0.0,
    site={"fleet": "normal", "every_minutes": 10},
)
MOVED_BESIDE = replace(MOVED_STARTS, events_per_hour=30).only(
    acts="move_start", events="robot_pauses", site={"fleet": "normal", "every_minutes": 5}
)
FLAT_ROBOTS = Profile(acts_per_hour=20, events_per_hour=12).only(
    acts="change_battery",
    events="low_battery",
    fault_rate=0.0,
    crash_rate=0.0,
    site={"every_minutes": 5, "fleet": "normal", "robots": 2, "poll_interval": 30},
)
OUTAGES = Profile(events_per_hour=30).only(
    acts="",
    events="outage",
    fault_rate=0.0,
    crash_rate=0.0,
    longest_outage=90.0,
    site={"every_minutes": 3, "fleet": "normal", "retry_limit": 10, "poll_interval": 30},
)
CRASHES = Profile(crash_rate=0.01).only(
    acts="run_now", events="lost_request", fault_rate=0.0, site={"every_minutes": 3, "fleet": "normal"}
)
ROBOTS = Profile(events_per_hour=30).only(
    acts="run_now idle_rule",
    events="another_robot robot_pauses mission_fails person_queues person_cancels poison low_battery very_late_request",
    crash_rate=0.0,
    site={"fleet": "normal", "every_minutes": 5},
)
LATE_AND_PAUSED = Profile(events_per_hour=30).only(
    acts="run_now",
    events="very_late_request robot_pauses",
    fault_rate=0.0,
    crash_rate=0.0,
    site={"every_minutes": 3, "fleet": "normal", "poll_interval": 10, "quiet_s": 90, "history_limit": None},
)
# Polls are so rare that what arrives late has run before it is seen.
LATE_AND_IDLE = Profile(acts_per_hour=20, events_per_hour=30).only(
    acts="idle_rule",
    events="very_late_request person_queues",
    fault_rate=0.0,
    crash_rate=0.0,
    site={"every_minutes": 60, "fleet": "normal", "robots": 4, "poll_interval": 120, "quiet_s": 30},
)
BACK = Profile(acts_per_hour=30, events_per_hour=12).only(
    acts="back_up run_now",
    events="restore outage",
    fault_rate=0.0,
    crash_rate=0.0,
    site={"every_minutes": 3, "fleet": "normal", "history_limit": None},
)
BACK_AND_ELSEWHERE = Profile(acts_per_hour=60, events_per_hour=12).only(
    acts="back_up other_robot",
    events="restore outage",
    fault_rate=0.0,
    crash_rate=0.0,
    site={"every_minutes": 3, "fleet": "normal", "history_limit": None, "robots": 3},
)
SHORT = Profile(acts_per_hour=80, events_per_hour=0).only(
    acts="plan_once switch_schedule rename skip working_days idle_rule run_now",
    events="",
    fault_rate=0.0,
    crash_rate=0.0,
    site={"history_limit": 1, "fleet": "normal"},
)
WINDOW = Profile(events_per_hour=12).only(
    acts="hold",
    events="power_cut nap outage",
    fault_rate=0.0,
    crash_rate=0.0,
    longest_off=600.0,
    site={"with_window": True, "every_minutes": 3, "fleet": "normal"},
)
FORGETFUL = Profile(events_per_hour=40).only(
    acts="", events="lost_request", fault_rate=0.0, crash_rate=0.0, site={"every_minutes": 3, "fleet": "forgetful"}
)
CALM = Profile(acts_per_hour=0, events_per_hour=0, rough_s=900, calm_s=900).only(
    fault_rate=0.0, crash_rate=0.0, site={"every_minutes": 3}
)


@dataclass(frozen=True)
class Mutant:
    """``target`` is "module:name" of a function below app. ``old`` is replaced by ``new`` in its source. ``oracle`` is in what is found."""

    name: str
    target: str
    old: str
    new: str
    oracle: str
    profile: Profile
    seed: int = 1
    hours: float = 3.0


@contextmanager
def planted(mutant: Mutant) -> Iterator[None]:
    """The bug is there."""
    module_name, _, path = mutant.target.partition(":")
    module = importlib.import_module(f"app.{module_name}")
    *classes, name = path.split(".")
    owner = module
    for each in classes:
        owner = getattr(owner, each)
    original = vars(owner)[name]
    function = original.fget if isinstance(original, property) else getattr(original, "__func__", original)
    source = textwrap.dedent(inspect.getsource(function))
    if source.count(mutant.old) != 1:
        raise LookupError(f"{mutant.name}: {mutant.old!r} is {source.count(mutant.old)} times in {mutant.target}")
    made: dict[str, object] = {}
    code = compile(
        source.replace(mutant.old, mutant.new), mutant.target, "exec", flags=future.annotations.compiler_flag
    )
    exec(code, vars(module), made)
    owners = [
        owner,
        *(each for key, each in [*sys.modules.items()] if key.startswith("app.") and vars(each).get(name) is original),
    ]
    for each in owners:
        setattr(each, name, made[name])
    try:
        yield
    finally:
        for each in owners:
            setattr(each, name, original)


SENDING, OUTCOMES, IN_DOUBT, LEDGER, PLANNER = (
    "services.dispatch.sending:Sending",
    "services.dispatch.outcomes:Outcomes",
    "services.dispatch.in_doubt:InDoubt",
    "services.dispatch.ledger:Ledger",
    "services.dispatch.planner:Planner",
)
ROW_MAKER, GUARD, DUPLICATES, OWN_ITEMS = (
    "services.dispatch.planned_rows:RowMaker",
    "services.dispatch.clock_guard:ClockGuard",
    "services.dispatch.duplicates:Duplicates",
    "services.dispatch.own_items:OwnItems",
)
TRACKING, ENGINE, HOLDS = (
    "services.dispatch.tracking:Tracking",
    "services.dispatch.engine:Engine",
    "services.live.holds:Holds",
)
SCHEDULES, EXECUTIONS = "database.schedules:ScheduleRepository", "database.executions:ExecutionRepository"
RULES = "domain.rules"
MOVING = "services.catalogue.moving"
TRANSITIONS = "services.executions.transitions"

MUTANTS = (
    # ------------------------------------------------------------------ never twice
    Mutant(
        "every failed start is sent again",
        f"{SENDING}._not_accepted",
        "error.delivery is Delivery.NOT_SENT",
        "error.delivery is not Delivery.REFUSED",
        "items with one token",
        LOST,
    ),
    Mutant(
        "an unknown outcome is never looked for",
        f"{OWN_ITEMS}.of",
        "found = [item for item in newer if item.description == row.token]",
        "found = []",
        "items with one token",
        LOST,
    ),
    Mutant(
        "no quiet time",
        f"{IN_DOUBT}.look_for",
        "quiet_left = self._seen.quiet_seconds - (",
        "quiet_left = 0 * (",
        "items with one token",
        LOST,
    ),
    Mutant(
        "an intent that is not on disk",
        f"{OUTCOMES}.begin",
        "return self._ledger.apply([transitions.begin(row, robot, floor, now) for row in rows], quietly=True)",
        "return [transitions.begin(row, robot, floor, now).after for row in rows]",
        "items with one token",
        CRASHES,
    ),
    Mutant(
        "a restored row is sent unasked",
        "services.dispatch.waiting:Waiting._found",
        "if through is None or row.planned_at > through:",
        "if True:",
        "items with one token",
        BACK,
    ),
    Mutant(
        "a second copy that waits is left alone",
        f"{DUPLICATES}.cancel_copy",
        "if item.is_pending:",
        "if False:",
        "a second copy ran",
        LATE_AND_PAUSED,
        seed=3,
    ),
    Mutant(
        "after a restore only the robot of the backup is asked",
        "services.dispatch.waiting:Waiting._found",
        "None if row.trigger is Trigger.SCHEDULED else",
        "",
        "items with one token",
        BACK_AND_ELSEWHERE,
        seed=2,
    ),
    Mutant(
        "after a restore intents are written ahead",
        f"{ROW_MAKER}.submitting",
        "may_be_there = ready.uncertain_through is not None and",
        "may_be_there = False and",
        "items with one token",
        BACK,
    ),
    Mutant(
        "how far a schedule is planned is not kept",
        f"{SCHEDULES}.advance_all",
        "planned_through = coalesce(given.planned, planned_through)",
        "planned_through = planned_through",
        "items with one token",
        SHORT,
        seed=2,
    ),
    Mutant(
        "robots that forget descriptions have nothing of ours",
        f"{OWN_ITEMS}.of",
        "candidates = [item for item in newer if self.may_be_of(row, item)][:1]",
        "candidates = []",
        "more items with one token",
        FORGETFUL,
    ),
    Mutant(
        "an answer that makes no sense is a failure",
        "mir.client:RobotClient.enqueue",
        "return self._read(answer, parse.queue_id)",
        "found = self._read(answer, parse.queue_id)\n"
        "        if found % 7 == 0:\n            raise Rejected(status=503, reason='', address='x')\n        return found",
        "truth",
        CALM,
        seed=2,
    ),
    # ------------------------------------------------------------------ never lost
    Mutant(
        "all rows missed",
        f"{PLANNER}._row",
        "if context.now >= rules.closes_at(",
        "if True or context.now >= rules.closes_at(",
        "never ran",
        CALM,
    ),
    Mutant(
        "everything that is due was missed",
        f"{PLANNER}._take",
        "rows, latest, following = self._passed_and_latest(schedule, make)",
        "rows, latest, following = self._passed_and_latest(schedule, make)\n"
        "    rows, latest = [*rows, *([make.missed(latest, None)] if latest else [])], None",
        "never ran",
        CALM,
    ),
    Mutant(
        "an absence is said to have cost one start more",
        "services.dispatch.planned_rows:_parts",
        "yield Passed(starts, first",
        "yield Passed(starts + 1, first",
        "by hand",
        ABSENCES,
    ),
    Mutant(
        "the start that still goes after an absence is missed as well",
        f"{PLANNER}._passed_and_latest",
        "until = context.now if latest is None else latest - MOMENT",
        "until = context.now",
        "truth",
        ABSENCES,
    ),
    Mutant(
        "everything fails without a request",
        f"{SENDING}.send_due",
        "self._post(intent, attempt.plan_version)",
        "self._ledger.end(Event.REFUSE, intent, Reason(ReasonCode.REFUSED))",
        "never ran",
        CALM,
    ),
    Mutant(
        "no back-off",
        f"{RULES}:back_off",
        "return float(min(2 ** min(attempts, 12), settings.poll_interval_seconds))",
        "return 0.0",
        "never ran",
        OUTAGES,
    ),
    Mutant(
        "one failed try ends it",
        f"{RULES}:after_failed_attempt",
        "execution.attempts > settings.retry_limit",
        "execution.attempts > 0",
        "never ran",
        OUTAGES,
    ),
    Mutant(
        "what did not arrive is given up",
        f"{IN_DOUBT}._is_not_there",
        "waited=True",
        "waited=self._give_up(row, 'x')",
        "never ran",
        LOST,
    ),
    Mutant(
        "low battery, for ever",
        "services.dispatch.waiting:Waiting.why_robot",
        '{"battery": battery, "minimum": minimum})',
        '{"battery": battery, "minimum": minimum}, 1e9)',
        "never ran",
        FLAT_ROBOTS,
    ),
    Mutant(
        "a hold without end",
        "services.live.holds:Hold.is_over",
        "return self.until is not None and self.until <= now",
        "return False",
        "liveness",
        PEOPLE,
        seed=4,
    ),
    Mutant(
        "every start overlaps",
        f"{PLANNER}._row",
        "if previous := context.open_of_schedule.get(schedule.whole_id):",
        "if previous := schedule.whole_id in context.open_of_schedule and schedule.next_at:",
        "never ran",
        CALM,
    ),
    Mutant(
        "in doubt for ever",
        f"{IN_DOUBT}.look_for",
        "min(RECONCILE_EVERY, quiet_left)",
        "1e9",
        "open for",
        LOST,
        seed=3,
    ),
    Mutant(
        "what the robot took is not written",
        f"{OUTCOMES}.note",
        "if attempt.accepted]",
        "if False]",
        "open for",
        CALM,
        seed=2,
    ),
    Mutant(
        "an aborted mission never ends",
        f"{TRACKING}._states",
        "if item.state is QueueState.ABORTED or (",
        "if False and (",
        "open for",
        ROBOTS,
        seed=2,
    ),
    Mutant(
        "no robot is followed",
        f"{TRACKING}.follow",
        "for row, queue_id in accepted:",
        "for row, queue_id in accepted[:0]:",
        "open for",
        CALM,
        seed=2,
    ),
    Mutant(
        "only what ran is planned again",
        f"{SCHEDULES}.planned_beyond",
        'WHERE planned_through > ? OR changed_at > ?", to_text(now), ',
        'WHERE planned_through > ?", ',
        "never ran",
        CLOCKS,
        seed=12,
    ),
    Mutant(
        "the engine oversleeps",
        f"{ENGINE}._seconds_to_next",
        "return min(max(left, 0.0), max(left - INTENT_LEAD, INTENT_EVERY), longest)",
        "return 4.0",
        "late, and nothing was wrong",
        CALM,
    ),
    # ------------------------------------------------------------------ nothing that is not wanted
    Mutant(
        "sent as soon as it is on disk",
        f"{SENDING}.take_over",
        "ahead = min(",
        "ahead = 0.0 * min(",
        "before its instant",
        CALM,
    ),
    Mutant(
        "the window does not close",
        f"{RULES}:closes_at",
        "return planned_at + ",
        "return planned_at + timedelta(minutes=15) + ",
        "after its window",
        PEOPLE,
    ),
    Mutant(
        "holds are ignored",
        f"{HOLDS}.active",
        "hold.robot_id in (None, robot_id)",
        "hold.clock",
        "under a hold",
        PEOPLE,
    ),
    Mutant(
        "the hold of all robots holds none",
        f"{HOLDS}.active",
        "hold.robot_id in (None, robot_id)",
        "hold.robot_id == robot_id",
        "under a hold",
        PEOPLE,
        seed=2,
    ),
    Mutant(
        "what was cancelled in doubt is sent again",
        f"{TRANSITIONS}:why_withdrawn",
        "Reason(row.cancel_code) if row.cancel_code else row.withdrawn",
        "row.withdrawn",
        "though it was cancelled",
        PEOPLE,
        seed=2,
    ),
    Mutant(
        "a cleared queue keeps what waits",
        "services.robots.commands:Operator.clear_queue",
        "cleared.rows = frozenset(row.id for row in rows)",
        "cleared.rows = frozenset()",
        "though it was cancelled",
        PEOPLE,
        seed=5,
    ),
    Mutant(
        "pauses are ignored",
        f"{ROW_MAKER}.is_skipped",
        "return self.schedule.is_paused(planned_at) or",
        "return False or",
        "withdrawn",
        PEOPLE,
        seed=2,
    ),
    Mutant(
        "a pause leaves what waits",
        "services.catalogue.pausing:Pausing.pause",
        "if row.planned_at < until)",
        "if False)",
        "withdrawn",
        PEOPLE,
        seed=76,
    ),
    Mutant(
        "skips are forgotten (D5)",
        f"{SCHEDULES}.skips",
        "return {(schedule_id, to_instant(planned_at)) for",
        "return {(0, 0) for",
        "withdrawn",
        SHORT,
        seed=2,
    ),
    Mutant(
        "what waits keeps its old mission (D6)",
        "services.executions.wanted:as_defined",
        "if value != getattr(row, name)}",
        "if value != getattr(row, name) and 'mission' not in name}",
        "as another mission",
        BUSY,
        seed=2,
    ),
    Mutant(
        "what is edited while it is in doubt is sent unchanged",
        "services.executions.apply:apply_in",
        "for check in rule.checks:",
        "for check in [each for each in rule.checks if each is not is_wanted]:",
        "as another mission",
        Profile(acts_per_hour=120, events_per_hour=40).only(
            acts="change_mission",
            events="lost_request",
            fault_rate=0.0,
            crash_rate=0.0,
            site={"quiet_s": 90, "fleet": "normal", "every_minutes": 3},
        ),
    ),
    Mutant(
        "whether a start was withdrawn is not asked before it is sent",
        "services.executions.wanted:wanted",
        "if not reopen and (why := why_withdrawn(row) or _robot_is_off(c, row)):",
        "if why := None:",
        "though it was cancelled",
        PEOPLE,
        seed=2,
    ),
    Mutant(
        "a held start is sent",
        f"{TRANSITIONS}:hold",
        '"held": held,',
        '"held": False,',
        "held",
        HELD_STARTS,
    ),
    Mutant(
        "a low battery is enough",
        f"{RULES}:battery_allows",
        "return minimum is None or",
        "return True or",
        "low battery",
        ROBOTS,
    ),
    Mutant(
        "starts overlap",
        f"{PLANNER}._row",
        "if previous := context.open_of_schedule.get(schedule.whole_id):",
        "if previous := None:",
        "still there",
        ROBOTS,
        seed=2,
    ),
    Mutant(
        "a moved start overlaps",
        f"{PLANNER}._row",
        "if previous := context.open_of_schedule.get(schedule.whole_id):",
        "if previous := context.open_of_schedule.get(schedule.id):",
        "still there",
        MOVED_BESIDE,
        seed=4,
    ),
    Mutant(
        "another machine will do",
        "mir.verified_requests:VerifiedRequests._check_serial_number",
        "and found != expected",
        "and False",
        "another machine",
        ROBOTS,
    ),
    Mutant(
        "a jump of the clock is believed (D4)",
        f"{GUARD}._notice_step",
        "elif step > self._shortest_doubtful():",
        "elif False:",
        "while the clock was",
        CLOCKS,
    ),
    Mutant(
        "a robot that contradicts a clock which nothing has proven is sent to",
        f"{GUARD}.is_contradicted",
        "not self.is_proven and self._votes",
        "False and self._votes",
        "sent while the clock was",
        UNPROVEN,
    ),
    Mutant(
        "an idle mission that arrives after it was overtaken belongs to no row",
        "services.executions.apply:apply_in",
        "for effect in rule.effects:",
        "for effect in [each for each in rule.effects if each is not note_ran_idle]:",
        "two idle missions",
        LATE_AND_IDLE,
        seed=2,
    ),
    Mutant(
        "tokens that are not predictable",
        f"{RULES}:token_of",
        "{schedule_id}|",
        "{schedule_id}/",
        "never planned",
        CALM,
    ),
    Mutant(
        "working days are ignored",
        "services.planning.working_days:WorkingCalendar.is_working_day",
        "return day.weekday() in self._weekdays if found is None else found.is_working",
        "return True",
        "withdrawn",
        SHORT,
    ),
    Mutant(
        "a late start is not listed first",
        "services.dispatch.waiting:Waiting._why_listed",
        "if row.listed_until is None or row.wait is not Wait.LATE_START:",
        "if True:",
        "without the list",
        WINDOW,
        seed=2,
    ),
    Mutant(
        "a moved start runs where it was too",
        f"{MOVING}:_save",
        "leave_out(edit, whole, instant)",
        "pass",
        "withdrawn",
        replace(MOVED_STARTS, acts_per_hour=8),  # moved twice it breaks a rule of the database
        seed=2,
    ),
    Mutant(
        "a start that was moved back runs twice",
        f"{MOVING}:_save",
        "edit.schedules.drop_moved(edit.c, shown.id)",
        "pass",
        "withdrawn",
        MOVED_STARTS,
    ),
    Mutant(
        "a moved start is lost when it is moved back",
        f"{MOVING}:_save",
        "put_back(edit, whole, changed.moved_from or instant)",
        "pass",
        "never ran",
        MOVED_STARTS,
    ),
    Mutant(
        "a moved start does not follow its schedule",
        "services.catalogue.schedule_edit:_change_moved",
        "edit.schedules.moved_starts(edit.c, schedule.id)",
        "[]",
        "withdrawn",
        MOVED_STARTS,
    ),
    # ------------------------------------------------------------------ truth
    Mutant(
        "an aborted mission was completed",
        f"{TRACKING}._states",
        "if item.state is QueueState.DONE:",
        "if item.state in (QueueState.DONE, QueueState.ABORTED):",
        "truth",
        ROBOTS,
    ),
    Mutant(
        "one answer 404 and it has vanished",
        f"{TRACKING}._has_been_missing",
        "return mono - ",
        "return True or mono - ",
        "truth",
        Profile(
            acts_per_hour=0,
            events_per_hour=0,
            fault_rate=0.1,
            crash_rate=0.0,
            site={"every_minutes": 3, "fleet": "normal"},
        ),
    ),
    Mutant(
        "a lost answer is a refusal",
        f"{SENDING}._not_accepted",
        "elif error.delivery is Delivery.REFUSED:",
        "elif True:",
        "truth",
        LOST,
    ),
)

# Those that show in the same worlds through a classic fleet too. Others need what these don't bring there in time: copies, absences.
AT_CLASSIC_FLEETS = (
    "every failed start is sent again",
    "an unknown outcome is never looked for",
    "no quiet time",
    "an intent that is not on disk",
    "a restored row is sent unasked",
    "after a restore intents are written ahead",
    "how far a schedule is planned is not kept",
    "robots that forget descriptions have nothing of ours",
    "all rows missed",
    "everything that is due was missed",
    "everything fails without a request",
    "no back-off",
    "one failed try ends it",
)
