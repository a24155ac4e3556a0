"""The steps of stories: what people and the world do to a site. ``checks`` has what has to be true, ``stage`` plays a story."""

from __future__ import annotations

from dataclasses import replace
from datetime import timedelta
from shutil import copytree

import pytest

from app.database.backups import back_up, restore
from app.domain.execution import State
from app.domain.models import InvalidInput, Mission
from app.services.catalogue import group_edit
from app.services.executions.transitions import Event
from tests.services.checks import *
from tests.services.stage import *
from tests.support.moments import once
from tests.support.network import Fate
from tests.support.site import GUIDS
from tests.support.targets import *

WORDS = {
    "rule": "recurrence",
    "window": "start_window_minutes",
    "battery": "minimum_battery_percent",
    "finish_by": "finish_by_minutes",
    "workdays": "respect_working_days",
}
LOST, REFUSED, LATE, ANSWER_LOST = Fate.LOST, Fate.REFUSED, Fate.LATE, Fate.ANSWER_LOST
SLOW, ERROR_BEFORE, ERROR_AFTER, NOT_FOUND = Fate.SLOW, Fate.ERROR_BEFORE, Fate.ERROR_AFTER, Fate.NOT_FOUND


def fields(values: dict) -> dict:
    """Of a schedule, by the short words of stories. ``every`` is minutes."""
    own = {WORDS.get(name, name): value for name, value in values.items() if name not in ("at", "every")}
    own |= {"start": instant(values["at"])} if "at" in values else {}
    return own | ({"recurrence": f"FREQ=MINUTELY;INTERVAL={values['every']}"} if "every" in values else {})


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
    s.container.catalogue.switch_schedule(s.schedule(name).id, False)


@step
def on(s, name="A"):
    s.container.catalogue.switch_schedule(s.schedule(name).id, True)


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
            removed = catalogue.edit(lambda edit: group_edit.remove(edit, s.group.id))
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
    found = s.schedule()
    start = instant(at).replace(tzinfo=UTC) if at else found.next_at
    s.container.pausing.skip(found.id, start)
    s.noted.append(start)


@step
def unskip(s):
    """What was skipped last, or the start that was cancelled last, runs after all."""
    last = s.noted[-1]
    s.container.pausing.unskip(s.schedule().id, getattr(last, "planned_at", last), must_run=True)


@step
def move(s, start, to, on=None):
    """A single start; ``on``: a robot's number."""
    planned = s.container.plan.next(9)
    run = next(run for run in planned if run.at == instant(start).replace(tzinfo=UTC))
    s.noted.append(s.container.moving.move(run.schedule.id, run.at, instant(to), robot_id=on))


@step
def move_back(s):
    """The undo of the last move."""
    s.container.moving.undo(s.noted[-1])


@step
def set_up(s, **settings):
    s.container.catalogue.change_settings(**settings)


POLLED_OFTEN = set_up(poll_interval_seconds=30)  # the default


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
    s.container.catalogue.change_idle_rule(1, mission_id=s.mission(name).id, after_minutes=5, enabled=enabled)


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
    """Waiting starts are held, each by itself."""
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
def when_assigned(s, *steps, before=()):
    """As soon as a start of a group is given to a robot: its row is noted, and these happen; ``before`` that is written others do."""

    def note(rows):
        s.noted += rows[:1]
        play(s, *steps)

    once(s.container.ledger, Event.ASSIGN, before=lambda: play(s, *before), after=note)


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
def others_continue(s):
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
def copied(s, *, tablet="another one"):
    """Another tablet, or a second app on the same one, has a copy of the data, on the same network, at the same time."""
    directory = s.directory.with_name(f"{s.directory.name} copied")
    copytree(s.directory, directory)
    s.others.append(s.another_tablet(directory, tablet))


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
    """The person gets the reason."""
    with pytest.raises(error, match=match):
        which.act(s)


@step
def until(s, condition, within=900):
    s.run_until(lambda: condition(s), within)


@step
def do(s, act):
    """What no other step does."""
    act(s)
