"""All times of dispatch, in seconds, and the relations between them."""

from __future__ import annotations

from app.domain.rules import INTENT_LEAD as _INTENT_LEAD

# The engine
LONGEST_WAIT = 1.0  # between two rounds: bounds what a clock step or a sleep can delay
INTENT_LEAD = (
    _INTENT_LEAD.total_seconds()
)  # before its instant a start is on disk: many of groups are given to robots in it
INTENT_EVERY = 0.025  # between searches for starts due in a moment: several share a transaction
PREFETCH_LEAD = 1.2  # a robot is read so long before something is due
PREFETCH_TOGETHER = 0.5  # robots with instants this close together get their message at once
PREFETCH_SPREAD = 0.4  # over which their reads are spread
FIRST_POLL_WITHIN = 5.0  # until "ready", with robots in any state
CYCLE_TAKES = 2.0  # within which every robot has its turn
TURN_EVERY = 0.08  # between turns
CHORES_EVERY = 0.1  # at least between chores
TIDY_EVERY = 0.5  # between looks whether history and alarms are beyond their limits
TIDIES_WITHIN = 60.0  # that housekeeping gives way to what falls due
MIN_IDLE = 0.02  # until the next start; with less, housekeeping waits
DECIDES_EVERY = 5.0  # at which a start of a group goes to a robot in any case
DECIDES_AGAIN = 0.15  # at least between two such decisions
LOOKS_FOR = 0.5  # that the first one waits for robots that are being read
PRUNE_EVERY = 600.0  # after which a lowered limit shows at the latest
AFTER_A_FAILURE = 5.0  # before a worker continues after an error, or is made again
STOP_WITHIN = 3.0  # a stop has to end within 5 s, the database included; a request under way is left to its time-out

# A robot's worker
STATUS_IS_FRESH = 2.0  # for which one status serves everything that falls due
LEAVES_WITHIN = 90.0  # validity of a status for a start found ready: the robot's request limit and its connection may take that long
CLOCKS_PART = 1.0  # difference of wall and monotonic clock without a sleep of the tablet
ROUND_TAKES = 0.04  # what is due sooner goes first
PUT_OFF_AT_MOST = 0.5  # that everything else waits for due starts
RECHECK = 2.0  # between checks of what a start waits for (battery, hold)
EARLY_RECHECK = (
    20.0  # the same if its instant will come again, after the clock was set back: it may be set forward again
)
AWAITED_FOR = 3 * RECHECK  # for which robots are asked for a start that is looked for on all
RECONCILE_EVERY = 2.0  # between reads of a queue in which a request may still appear
GONE_FOR = 10.0  # that a queue item has to be missing: a robot that boots answers 404 too
UNSEARCHED_AT_MOST = 3600.0  # that such searches may fail on a robot that answers otherwise, before they end
LIVE_EVERY = 2.0  # between reads of a robot on screen, or with something of ours
SLOW_ANSWER = 2.0  # from here on an answer is shown as slow
IN_PART_AT_MOST = 60.0  # until a robot with a readable status but not queue raises an alarm
SAVE_SPANS_EVERY = 60.0  # between writes of a robot's activity

# The clock
FIRST_DOUBT = 30.0  # that the first start, or one after a jump, waits for a robot's time when no robot answers
DOUBT_POLLS_EVERY = 5.0  # between polls while robots' clocks are waited for
CLOCKS_AGREE = 600.0  # by which a robot's clock may differ and still count as equal
REPORTED_STEP = 5.0  # from here on a step of the clock raises an alarm

assert PREFETCH_LEAD > LONGEST_WAIT, "or some instants are never announced"
assert PREFETCH_LEAD - PREFETCH_SPREAD > INTENT_LEAD, "the robot is read before the start is written"
assert PREFETCH_LEAD < STATUS_IS_FRESH, "what was read ahead still holds at the instant"
assert INTENT_EVERY < INTENT_LEAD, "or a start is written at its instant only"
assert ROUND_TAKES < INTENT_LEAD, "a start that is held keeps its robot's worker free for it"
