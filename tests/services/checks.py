"""What has to be true in a story, and words for what ends and waits."""

from __future__ import annotations

from collections.abc import Callable
from functools import wraps

from app.domain.execution import ReasonCode, State, Wait
from tests.services.stage import Stage, Step, step
from tests.support.seen import sent_at
from tests.support.site import GUIDS

DONE, CHANGED = (State.COMPLETED, None), (State.CANCELLED, ReasonCode.SCHEDULE_CHANGED)
REMOVED, CANCELLED = (State.CANCELLED, ReasonCode.ROBOT_REMOVED), (State.CANCELLED, ReasonCode.USER_CANCELLED)
CLEARED, PAUSED = (State.CANCELLED, ReasonCode.QUEUE_CLEARED), (State.SKIPPED, ReasonCode.HOLD)
MISSED, UNKNOWN = (State.MISSED, ReasonCode.APP_DOWN), (State.FAILED, ReasonCode.UNKNOWN_OUTCOME)
WAITING, SUBMITTING, QUEUED, EXECUTING = State.WAITING, State.SUBMITTING, State.QUEUED, State.EXECUTING
COMPLETED, FAILED, BATTERY, HOLD = State.COMPLETED, State.FAILED, Wait.BATTERY, Wait.HOLD


def check(act: Callable) -> Callable[..., Step]:
    """A step of what is found, which has to be the values of the step."""

    @wraps(act)
    def make(*wanted, **named) -> Step:
        def compare(s: Stage) -> None:
            found = list(act(s, **named))
            assert found == list(wanted), f"{act.__name__}: {found} and not {list(wanted)}"

        return Step(act.__name__, compare)

    return make


@check
def ends(s):
    """How each row has ended."""
    return [(row.state, row.reason and row.reason.code) for row in s.executions()]


@check
def tries(s):
    return [row.attempts for row in s.executions()]


@check
def counts(s):
    """How many starts each row stands for."""
    return [row.starts for row in s.executions()]


@check
def states(s):
    """Of the rows, or of those of one schedule."""
    return s.states()


@check
def robots(s):
    """Of the rows."""
    return [row.robot for row in s.executions()]


@check
def waits(s):
    """What open rows wait for."""
    return [row.wait for row in s.executions(State.WAITING)]


@check
def sent(s):
    """When requests to start a mission left, in seconds from the beginning."""
    return sent_at(s)


@check
def items(s):
    """What robots say of what they were given."""
    return [str(item.state) for item in s.all_items()]


@check
def did(s):
    """The missions that robots were given."""
    names = {guid: name for name, guid in GUIDS.items()}
    return [names[item.mission_id] for item in s.all_items()]


@check
def minutes(s):
    """Of the instants for which robots have a start."""
    return sorted(row.planned_at.minute for row in s.executions() if row.queue_id)


@step
def left_out(s, is_left_out=True):
    """Robots have nothing of the start that was noted last."""
    at = getattr(s.noted[-1], "planned_at", s.noted[-1])
    assert is_left_out is (at not in [row.planned_at for row in s.executions() if row.queue_id]), at


@step
def runs(s, number):
    """How many items robots have."""
    assert len(s.all_items()) == number, f"{len(s.all_items())} items and not {number}"


@step
def raised(s, *codes):
    assert set(codes) <= set(s.alarms()), f"{s.alarms()} and not {codes}"


@step
def not_raised(s, *codes):
    assert not set(codes or s.alarms()) & set(s.alarms()), s.alarms()


@step
def true(s, condition):
    assert condition(s), f"line {condition.__code__.co_firstlineno}"
