"""Stories: what people and the world do to a site, step by step, and what has to be true then.

A step is a value that acts on a ``Stage``; a number is seconds that pass, a list is its steps, ``each`` is one of several. A story has as
many quick cases as its longest ``each`` has values, so that each value comes once; all other combinations are ``long``. In the end no row
is open and no start is on robots twice, unless the story says otherwise.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from datetime import UTC, datetime, timedelta
from functools import wraps
from itertools import product
from pathlib import Path
from shutil import copytree

import pytest

from app.database.backups import back_up, restore
from app.domain.models import Execution, InvalidInput, Mission, ReasonCode, Robot, Schedule, State, Wait
from mir_sim.mission_queue import QueueItem
from tests.support.groups import Hall
from tests.support.network import Fate
from tests.support.seen import sent_at
from tests.support.site import GUIDS

DAY = 86400.0
BEGIN = datetime(2026, 11, 23, 6, 0, tzinfo=UTC)
DONE, CHANGED = (State.COMPLETED, None), (State.CANCELLED, ReasonCode.SCHEDULE_CHANGED)
REMOVED, CANCELLED = (State.CANCELLED, ReasonCode.ROBOT_REMOVED), (State.CANCELLED, ReasonCode.USER_CANCELLED)
CLEARED, PAUSED = (State.CANCELLED, ReasonCode.QUEUE_CLEARED), (State.SKIPPED, ReasonCode.HOLD)
MISSED, UNKNOWN = (State.MISSED, ReasonCode.APP_DOWN), (State.FAILED, ReasonCode.UNKNOWN_OUTCOME)
WORDS = {
    "rule": "recurrence",
    "window": "start_window_minutes",
    "battery": "minimum_battery_percent",
    "finish_by": "finish_by_minutes",
    "workdays": "respect_working_days",
}


def instant(text: str) -> datetime:
    """ "06:05" of the first day, or "24T06:05"."""
    return datetime.fromisoformat(f"2026-11-{text if 'T' in text else f'23T{text}'}")


def fields(values: dict) -> dict:
    """Of a schedule, by the short words of stories. ``every`` is minutes."""
    own = {WORDS.get(name, name): value for name, value in values.items() if name not in ("at", "every")}
    own |= {"start": instant(values["at"])} if "at" in values else {}
    return own | ({"recurrence": f"FREQ=MINUTELY;INTERVAL={values['every']}"} if "every" in values else {})


class Stage(Hall):
    """The site of a story: robots of one group, the mission Deliver, and schedules of R1 or of the group."""

    def __init__(self, directory: Path, on: str, robots: int, **values) -> None:
        super().__init__(directory, robots=robots, **values)
        self.where = {"robot_id": 1, "group_id": None} if on == "robot" else {"robot_id": None, "group_id": 1}
        self.removed: list = []
        self.noted: list = []  # what steps pass on to later ones: rows, instants
        self.others: list[Stage] = []  # tablets with a copy of the data

    def schedule(self, name: str = "A") -> Schedule:
        found = self.container.catalogue.schedules()
        return next((each for each in found if each.name == name), found[0])

    def mission(self, name: str = "Deliver") -> Mission:
        return next(each for each in self.container.catalogue.missions() if each.name == name)

    def row(self, name: str = "") -> Execution:
        """The newest start, of a schedule or of any."""
        return next(row for row in reversed(self.executions()) if not name or row.schedule == name)

    def its_robot(self) -> Robot:
        """Of the start that was made first, or R1."""
        number = next((row.robot_id for row in self.executions() if row.robot_id), 1)
        return next(robot for robot in self.container.catalogue.robots() if robot.id == number)

    def all_items(self) -> list[QueueItem]:
        for machine in self.machines.values():
            machine.catch_up()
        return self.items()

    def doubled(self) -> list[str]:
        """Tokens with several items of which none was taken back."""
        ours = {row.token for row in self.executions()} | {post.token for post in self.network.posts()}
        found = Counter(item.description for item in self.all_items() if str(item.state) != "Aborted")
        return [token for token, number in found.items() if number > 1 and token in ours]

    def said(self) -> str:
        rows = [(row.schedule, str(row.state), row.wait, row.reason and row.reason.code) for row in self.executions()]
        return f"{self.clock.now():%d %H:%M:%S}, rows {rows}, sent {sent_at(self)}, alarms {self.alarms()}"


@dataclass(frozen=True)
class Step:
    name: str
    act: Callable[[Stage], object]

    def __str__(self) -> str:
        return self.name


@dataclass(frozen=True)
class Each:
    values: tuple


def each(*values) -> Each:
    """One of these."""
    return Each(values)


def step(act: Callable) -> Callable[..., Step]:
    """What is called with a stage and values becomes what makes steps of values."""

    @wraps(act)
    def make(*values, **named) -> Step:
        said = ", ".join([*map(str, values), *(f"{name}={value}" for name, value in named.items())])
        return Step(f"{act.__name__}({said})" if len(said) < 50 else act.__name__, lambda s: act(s, *values, **named))

    return make


def check(act: Callable) -> Callable[..., Step]:
    """A step of what is found, which has to be the values of the step."""

    @wraps(act)
    def make(*wanted, **named) -> Step:
        def compare(s: Stage) -> None:
            found = list(act(s, **named))
            assert found == list(wanted), f"{act.__name__}: {found} and not {list(wanted)}"

        return Step(act.__name__, compare)

    return make


def play(s: Stage, *steps) -> None:
    for one in steps:
        if isinstance(one, Step):
            try:
                one.act(s)
            except Exception as error:
                error.add_note(f"{one} at {s.said()}")
                raise
        elif isinstance(one, list | tuple):
            play(s, *one)
        else:
            s.run(one)


class Story:
    """``on``: R1, or its group, or each. ``robots``, ``with_window`` and others are of the ``Stage``."""

    def __init__(self, name: str, *steps, on="robot", robots=1, stays_open=False, doubles=False, **site) -> None:
        self.name, self.steps, self.site = name, steps, {"robots": robots, **site}
        self.on = each(*([on] if isinstance(on, str) else on))
        self.stays_open, self.doubles = stays_open, doubles

    def cases(self) -> Iterator:
        axes = [self.on.values, *(one.values for one in self.steps if isinstance(one, Each))]
        most = max(map(len, axes))
        quick = [tuple(number % len(axis) for axis in axes) for number in range(most)]
        for chosen in sorted(product(*map(range, map(len, axes))), key=lambda chosen: chosen not in quick):
            values = [axis[index] for axis, index in zip(axes, chosen, strict=True) if len(axis) > 1]
            labels = [self.name, *(said(value) for value in values)]
            marks = () if chosen in quick else pytest.mark.long
            yield pytest.param(self, chosen, id=", ".join(labels), marks=marks)

    def play(self, directory: Path, chosen: tuple[int, ...]) -> None:
        on, *rest = chosen
        picks = iter(rest)
        steps = [one.values[next(picks)] if isinstance(one, Each) else one for one in self.steps]
        s = Stage(directory, self.on.values[on], **self.site)
        try:
            play(s, *steps)
            still = [] if self.stays_open else [row.state for row in s.executions() if row.state.is_open]
            assert still == [], f"still open: {s.said()}"
            assert self.doubles or s.doubled() == [], f"twice: {s.said()}"
        finally:
            for tablet in (*s.others, s):
                tablet.switch_off()


def said(value) -> str:
    """Of a case's name."""
    return " ".join(map(said, value)) if isinstance(value, list | tuple) else str(value)


def told(*stories: Story):
    """Makes a test of each case of them."""

    @pytest.mark.parametrize(("story", "chosen"), [case for story in stories for case in story.cases()])
    def test(story: Story, chosen: tuple[int, ...], tmp_path: Path) -> None:
        story.play(tmp_path, chosen)

    return test


# ---------------------------------------------------------------------- the plan
@step
def plan(s, name="A", at="06:05", on=None, **values):
    """``on``: a robot's number, where it is not the story's own place."""
    where = s.where if on is None else {"robot_id": on, "group_id": None}
    s.plan(name, f"{instant(at):%Y-%m-%dT%H:%M}", **where | fields(values))
    s.kick()


@step
def edit(s, name="A", /, **values):
    s.container.catalogue.save_schedule(replace(s.schedule(name), **fields(values)))


@step
def off(s, name="A"):
    s.container.catalogue.set_schedule_enabled(s.schedule(name).id, False)


@step
def on(s, name="A"):
    s.container.catalogue.set_schedule_enabled(s.schedule(name).id, True)


@step
def delete(s, what="schedule"):
    catalogue = s.container.catalogue
    match what:
        case "schedule":
            removed = catalogue.remove_schedule(s.schedule().id)
        case "robot":
            removed = catalogue.remove_robot(s.its_robot().id)
        case "own mission":
            removed = catalogue.remove_mission(next(m.id for m in catalogue.missions() if m.robot_id))
        case "group":
            removed = catalogue.edit(lambda edit: edit.remove_group(s.group.id))
        case _:
            removed = catalogue.remove_mission(s.mission("Deliver" if what == "mission" else what).id)
    s.removed.append(removed)


@step
def undo(s, which=-1):
    s.container.catalogue.restore(s.removed.pop(which))


@step
def pause(s, minutes=2880):
    s.container.pausing.pause(s.schedule().id, s.clock.now() + timedelta(minutes=minutes))


@step
def resume(s):
    s.container.pausing.resume(s.schedule().id)


@step
def skip(s, at=None):
    pausing, found = s.container.pausing, s.schedule()
    s.noted.append(
        pausing.skip_next(found.id) if at is None else pausing.skip(found.id, instant(at).replace(tzinfo=UTC))
    )


@step
def unskip(s):
    """What was skipped last, or the start that was cancelled last, runs after all."""
    last = s.noted[-1]
    s.container.pausing.unskip(s.schedule().id, getattr(last, "planned_at", last), must_run=True)


@step
def set_up(s, **settings):
    s.container.catalogue.change_settings(**settings)


@step
def mission(s, name="Deliver", /, **changes):
    """``does`` is the name of what the robots do then."""
    changes |= {"guid": GUIDS[changes.pop("does")]} if "does" in changes else {}
    s.container.catalogue.save_mission(replace(s.mission(name), **changes))


@step
def own_mission(s, does="Home", name="Deliver"):
    """R1 does something else under that name."""
    s.container.catalogue.save_mission(Mission(name, GUIDS[does], robot_id=1))


@step
def rest(s, name="Home", enabled=True):
    """R1 does that after five minutes of rest."""
    if name not in [each.name for each in s.container.catalogue.missions()]:
        s.add_mission(name)
    s.container.catalogue.save_idle_rule(1, s.mission(name).id, after_minutes=5, enabled=enabled)


# ---------------------------------------------------------------------- starts and robots
@step
def run_now(s):
    operator, found = s.container.operator, s.mission().id
    operator.run_now(1, found) if s.where["robot_id"] else operator.run_on_any(s.group.id, found)


@step
def cancel(s, which=-1):
    """One of the starts that are open."""
    s.noted.append([row for row in s.executions() if row.state.is_open][which])
    s.container.operator.cancel_execution(s.noted[-1].id)


@step
def want_again(s):
    """The undo of a cancel."""
    s.container.catalogue.wait_again(s.noted[-1].id)


@step
def keep(s, held=True):
    """What waits is kept back, each by itself."""
    s.noted += s.executions(State.WAITING)
    s.container.operator.hold_starts([row.id for row in s.executions(State.WAITING)], held=held)


@step
def let_go(s):
    s.container.operator.hold_starts([row.id for row in s.executions(State.WAITING)], held=False)


@step
def hold(s, name=None):
    s.hold(name)


@step
def release(s):
    for robot_id in (None, *s.group.members):
        s.container.holds.release(robot_id)


@step
def give(s, name="R1"):
    """A person gives the group's start to a robot."""
    s.container.operator.assign_robot(s.row().id, s.robot(name).id)


@step
def when_given(s, *steps, before=()):
    """As soon as a start of a group is given to a robot: its row is noted, and these happen; ``before`` that is written others do."""
    ledger = s.container.ledger

    def bind(*values):
        del ledger.bind
        play(s, *before)
        rows = ledger.bind(*values)
        s.noted += rows[:1]
        play(s, *steps)
        return rows

    ledger.bind = bind


@step
def clear_queue(s):
    s.container.operator.clear_queue(1)


@step
def robot_off(s, *names):
    for name in names or [s.its_robot().name]:
        s.switch(name, on=False)


@step
def robot_on(s, *names):
    for name in names or [robot.name for robot in s.container.catalogue.robots()]:
        s.switch(name, on=True)


@step
def battery(s, percent, *names):
    for name in names or s.machines:
        s.machines[name].set_battery(percent)


@step
def robot_pauses(s, name="R1"):
    s.machines[name].pause()


@step
def robot_goes_on(s, name="R1"):
    s.machines[name].resume()


@step
def stranger(s, name="Deliver", robot="R1", count=1):
    """Somebody else puts a mission on a robot."""
    for _n in range(count):
        s.stranger_queues(name, robot)


def all_busy(count=9):
    """With what somebody else has put on them."""
    return do(lambda s: [s.stranger_queues(robot=name) for name in s.machines for _n in range(count)])


# ---------------------------------------------------------------------- the world
@step
def meets(s, method, path, fate, seconds=None, count=1, robot="*"):
    s.network.next(method, path, fate, seconds, robot=robot, count=count)


def post(fate, seconds=None, count=1, robot="*"):
    """What the next request to start a mission meets."""
    return replace(meets("POST", "/mission_queue", fate, seconds, count, robot), name=f"post {fate}")


@step
def down(s, *names):
    s.network.down.update(names or s.machines)


@step
def up(s):
    s.network.down.clear()


@step
def clock(s, *steps):
    """It is set, some seconds between."""
    for number, seconds in enumerate(steps):
        s.run(5 if number else 0)
        s.clock.step(seconds)
        s.kick()


@step
def app_off(s, cleanly=True):
    s.switch_off(cleanly=cleanly)


@step
def app_on(s):
    s.switch_on()


@step
def off_for(s, seconds=5.0):
    """A power cut."""
    s.power_cut(seconds)


@step
def asleep(s, seconds):
    s.suspend(seconds)


@step
def later(s, seconds, *steps):
    s.at(seconds, lambda: play(s, *steps))


@step
def others_go_on(s):
    """While a robot's answer takes time."""
    s.network.others_wait = False


@step
def during(s, method, *steps):
    """While the next request of that kind, which meets something, is made."""

    def met(_robot, planned):
        if planned.method == method:
            s.network.met = lambda robot, planned: None
            play(s, *steps)

    s.network.met = met


def while_posting(*steps):
    """While the connection for the next request to start a mission is made."""
    return [post(Fate.SLOW, 0.1), during("POST", *steps)]


@step
def backup(s):
    back_up(s.container.db.path, s.directory / "before.db")


@step
def restored(s, *steps, behind=0.0):
    """The backup is put back by a clock that is so much behind, and these happen while the app is off."""
    s.switch_off()
    restore(s.directory / "before.db", s.container.db.path, s.clock.now() - timedelta(seconds=behind))
    play(s, *steps)
    s.switch_on()


@step
def copied(s):
    """Another tablet has a copy of the data, on the same network, at the same time."""
    directory = s.directory.with_name(f"{s.directory.name} copied")
    copytree(s.directory, directory)
    s.others.append(s.another_tablet(directory))


@step
def on_copy(s, *steps):
    play(s.others[0], *steps)


@step
def on_both(s, seconds):
    for _half_second in range(int(seconds * 2)):
        s.run(0.5)
        s.others[0].run(0.0)


@step
def refused(s, which, match=None, error=InvalidInput):
    """A person is told why not."""
    with pytest.raises(error, match=match):
        which.act(s)


@step
def until(s, condition, within=900):
    s.run_until(lambda: condition(s), within)


@step
def do(s, act):
    """What no other step does."""
    act(s)


# ---------------------------------------------------------------------- what is true
@check
def ends(s):
    """How each row has ended."""
    return [(row.state, row.reason and row.reason.code) for row in s.executions()]


@check
def tries(s):
    return [row.attempts for row in s.executions()]


@check
def states(s):
    """Of the rows, or of those of one schedule."""
    return [row.state for row in s.executions()]


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
    """Of the instants of which robots have a start."""
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


LOST, REFUSED, LATE, ANSWER_LOST = Fate.LOST, Fate.REFUSED, Fate.LATE, Fate.ANSWER_LOST
SLOW, ERROR_BEFORE, ERROR_AFTER, NOT_FOUND = Fate.SLOW, Fate.ERROR_BEFORE, Fate.ERROR_AFTER, Fate.NOT_FOUND
WAITING, SUBMITTING, QUEUED, EXECUTING = State.WAITING, State.SUBMITTING, State.QUEUED, State.EXECUTING
COMPLETED, FAILED, BATTERY, HOLD = State.COMPLETED, State.FAILED, Wait.BATTERY, Wait.HOLD
