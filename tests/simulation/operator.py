"""What people do at the tablet, drawn by the seed and written into the diary when it has taken effect."""

from __future__ import annotations

import json
import random
import uuid
from collections.abc import Callable, Collection, Mapping
from contextlib import suppress
from dataclasses import replace
from datetime import datetime, timedelta
from pathlib import Path
from typing import TYPE_CHECKING, Any
from zoneinfo import ZoneInfo

from app.database.backups import back_up
from app.database.errors import DatabaseError
from app.domain.models import WEEKDAYS, DayException, InvalidInput, Overlap, Schedule
from app.mir.errors import RobotError
from app.services.catalogue.configuration import import_configuration
from app.services.catalogue.moving import Moved
from app.services.catalogue.undo import Changed
from tests.simulation.diary import MINUTE, OVERLAPS, Move, Target, Undone, Wishes, instants
from tests.support.edits import skip_next, switch_robot

if TYPE_CHECKING:
    from tests.simulation.world import World

MOST_PLANS = 14
LONGEST_WINDOW = timedelta(minutes=241)
WINDOWS = (None, 1, 2, 5, 8, 15, 60, 240)
IDLE_MISSION = "Home"


class Person:
    """``world`` is asked for the site and the diary, and protects what a person does with one write from a crash in the middle of it."""

    def __init__(self, world: World, rng: random.Random) -> None:
        self.world, self.rng, self.diary = world, rng, world.diary
        self.backups: list[tuple[Path, float, Wishes]] = []  # and at which true time each was made

    def do(self, name: str) -> None:
        """One act, unless the app says that it can't be."""
        try:
            getattr(self, name)()
        except (InvalidInput, RobotError, DatabaseError, LookupError):
            return  # shown to the operator, who may press again
        self.world.findings.acts[name] += 1

    # ------------------------------------------------------------------ helpers
    @property
    def _app(self) -> Any:
        return self.world.site.container

    @property
    def _wall(self) -> datetime:
        return self.world.site.clock.now()

    def _decide(self, act: Callable[[], Any], note: Callable[[Wishes], Any]) -> Any:
        """Do it with one write of the app, and note it."""
        with self.world.without_crash():
            result = act()
        wishes = self.diary.decide(self.world.site.seconds())
        note(wishes)
        wishes.follow()
        return result

    def _decide_later(
        self,
        after: float,
        act: Callable[[], Any],
        note: Callable[[Wishes], Any],
        is_due: Callable[[], bool],
        *refusals: type[Exception],
    ) -> None:
        """Where the app runs then and it is still due; again and again while it can't be written, or for one of these
        ``refusals``."""

        def decide() -> None:
            if self.world.is_on and is_due():
                try:
                    self._decide(act, note)
                except (DatabaseError, *refusals):
                    self.world.site.at(60.0, decide)

        self.world.site.at(after, decide)

    def _robot(self) -> str:
        return self.rng.choice(list(self.diary.names.values()))

    def _id(self, robot: str) -> int:
        return next(key for key, name in self.diary.names.items() if name == robot)

    def _plan(self) -> Schedule:
        plans = self.diary.now.whole
        if not plans:
            raise LookupError
        return plans[self.rng.choice(sorted(plans))]

    def _mission(self) -> int:
        return self.rng.choice([key for key, guid in self.diary.guids.items() if guid != self.world.idle_guid])

    def _edit(self, plan: Schedule, **changes: Any) -> None:
        stored = self._app.repositories.schedules.get(self._app.db.read(), plan.id)

        before = self.diary.now
        changed = self._decide(
            lambda: self._app.catalogue.change_schedule(stored, replace(stored, **changes)),
            lambda wishes: self._note_edit(wishes, plan, changes),
        )
        if self.world.profile.edits_undone and self.rng.random() < self.world.profile.edits_undone:
            self._undo_edit_later(changed, plan, replace(plan, **changes), before)

    def _can_run(self, plan: Schedule) -> bool:
        """Whether its mission and its robot or group are there."""
        there = self._app.catalogue
        return all(
            id_ is None or id_ in {each.id for each in found}
            for id_, found in (
                (plan.mission_id, there.missions()),
                (plan.robot_id, there.robots()),
                (plan.group_id, there.groups()),
            )
        )

    def _note_edit(self, wishes: Wishes, plan: Schedule, changes: Mapping[str, Any]) -> None:
        wishes.plans[plan.id] = replace(plan, **changes)
        if changes.keys() & {"start", "robot_id"}:  # skips are of instants that it had
            wishes.stopped -= {key for key in wishes.stopped if key[0] == plan.id and key[1] > self._wall}

    def _undo_edit_later(self, changed: Changed, plan: Schedule, edited: Schedule, before: Wishes) -> None:
        was = {name: value for name, value in vars(plan).items() if value != getattr(edited, name)}

        def undo() -> None:
            if not self.world.is_on or self.diary.started_at > made_at or self.world.was_restored_since(made_at):
                return
            try:
                self._decide(
                    lambda: self._app.catalogue.undo_change(changed),
                    lambda wishes: self._note_edit(wishes, wishes.plans[plan.id], was),
                )
            except DatabaseError:
                return
            except InvalidInput as problem:
                if self.diary.now.plans.get(plan.id) == edited and self._can_run(plan):
                    self.world.judge.object(f"truth: an edit of {plan.name} can't be undone: {problem}")
                return
            is_of_instants = was.keys() <= {"start", "robot_id", "enabled"}
            if is_of_instants and only_edited(made_at) and not self._may_have_started(edited, made_at):
                self.diary.undone.append(Undone(plan.id, made_at, self.world.site.seconds()))

        def only_edited(since: float) -> bool:
            """Whether people have decided nothing else since then."""
            wishes = self.diary.between(since, self.world.site.seconds())
            return all(vars(each) | {"plans": each.plans | {plan.id: plan}} == vars(before) for each in wishes)

        made_at = self.world.site.seconds()
        self.world.site.at(self.rng.choice((3.0, 8.0, 40.0, 200.0)), undo)

    def _may_have_started(self, plan: Schedule, since: float) -> bool:
        """Whether a start of it may have been sent or ended since then."""
        now = self.world.site.seconds()
        begin = self._wall - timedelta(seconds=now - since) - LONGEST_WINDOW
        due = {self.diary.token((plan.id, instant)) for instant in instants(plan, begin, self._wall + MINUTE)}
        was_sent = any(post.at >= since and post.token in due for post in self.world.site.network.submissions)
        return was_sent or not all(self.diary.is_clear(name, since - 1.0, now) for name in self.diary.robots_of(plan))

    def _stop_due(self, wishes: Wishes, plans: list[Schedule]) -> None:
        """Due starts of these whose rows have been written are stopped for good, unless they had ended before."""
        if plans[0].robot_id is None:  # one that waits may be ended a moment later
            self._doubt_due(plans)
        elif self.diary.is_clear(
            self.diary.names[plans[0].robot_id],
            self.world.site.seconds() - 20.0,
            self.world.site.seconds(),
            but=("slow", "network", "battery", "robot", "hold"),
        ):
            rows = self.world.site.executions()
            ended = {row.token for row in rows if row.ended_at is not None and row.ended_at < self._wall}
            written = {row.token for row in rows} - ended
            for plan in plans:
                for instant in instants(plan, self._wall - LONGEST_WINDOW, self._wall - timedelta(seconds=2)):
                    token = self.diary.token((plan.id, instant))
                    if token in written:
                        wishes.stopped.add((plan.id, instant))
                    elif token not in ended:  # past when the plan got it, it comes again if the clock is set back
                        self.diary.uncertain.add(token)

    def _doubt_due(self, plans: list[Schedule]) -> None:
        """Due starts of these may have been stopped, or not yet."""
        for plan in plans:
            due = instants(plan, self._wall - LONGEST_WINDOW, self._wall + timedelta(seconds=2))
            self.diary.uncertain |= {self.diary.token((plan.id, instant)) for instant in due}

    # ------------------------------------------------------------------ schedules
    def rename(self) -> None:
        plan = self._plan()
        self._edit(plan, name=f"{plan.name.partition(' /')[0]} / {self.rng.randrange(10**6)}")

    def change_window(self) -> None:
        self._edit(self._plan(), start_window_minutes=self.rng.choice(WINDOWS))

    def change_battery(self) -> None:
        self._edit(self._plan(), minimum_battery_percent=self.rng.choice((None, 0, 5, 30, 40)))

    def change_mission(self) -> None:
        self._edit(self._plan(), mission_id=self._mission(), priority=self.rng.randrange(5))

    def change_overlap(self) -> None:
        plan = self._plan()
        self._edit(plan, overlap=Overlap.QUEUE if plan.overlap is not Overlap.QUEUE else Overlap.SKIP)

    def move(self) -> None:
        plan = self._plan()
        self._edit(plan, start=plan.start + timedelta(minutes=self.rng.choice((-7, -1, 1, 4, 11, 60))))

    def other_robot(self) -> None:
        plan = self._plan()
        overlap = Overlap.SKIP if plan.overlap is Overlap.PARALLEL else plan.overlap
        self._edit(
            plan,
            robot_id=self._id(self._robot()),
            **({} if plan.group_id is None else {"group_id": None, "overlap": overlap}),
        )

    def switch_schedule(self) -> None:
        plan = self._plan()
        self._edit(plan, enabled=not plan.enabled)

    def plan_once(self) -> None:
        local = self._wall.astimezone(ZoneInfo(self.world.nature.zone)).replace(second=0, microsecond=0, tzinfo=None)
        ended = [plan for plan in self.diary.now.whole.values() if plan.recurrence is None]
        if len(ended) > MOST_PLANS // 2:
            self._remove(ended[0])
        self._add(start=local + timedelta(minutes=self.rng.choice((0, 1, 2, 5, 9))), respect_working_days=False)

    def plan_often(self) -> None:
        if len(self.diary.now.whole) > MOST_PLANS:
            self._remove(self._plan())
        local = self._wall.astimezone(ZoneInfo(self.world.nature.zone)).replace(second=0, microsecond=0, tzinfo=None)
        self._add(
            start=local + timedelta(minutes=self.rng.randrange(1, 8)),
            recurrence=f"FREQ=MINUTELY;INTERVAL={self.rng.choice((4, 7, 15, 30))}",
        )

    def _add(self, **values: Any) -> None:
        made = Schedule(
            f"Plan {self.rng.randrange(10**9)}",
            self._id(self._robot()),
            self._mission(),
            timezone=self.world.nature.zone,
            start_window_minutes=self.rng.choice(WINDOWS),
            overlap=self.rng.choice(OVERLAPS),
            priority=self.rng.randrange(5),
            minimum_battery_percent=self.rng.choice((None, 0, 30)),
            **values,
        )
        self.world.plan(made)

    def import_plan(self) -> None:
        """A file with one schedule, a new one or a changed one."""
        plan = self._plan()
        changed = replace(
            plan, start_window_minutes=self.rng.choice(WINDOWS[1:]), priority=self.rng.randrange(5), enabled=True
        )
        document = {
            "format": "amr-scheduler/1",
            "schedules": [
                {
                    "name": changed.name,
                    **self._target(plan),
                    "mission": self.world.missions[plan.mission_id],
                    "start": f"{plan.start:%Y-%m-%dT%H:%M}",
                    "timezone": plan.timezone,
                    "recurrence": plan.recurrence,
                    "enabled": True,
                    "start_window_minutes": changed.start_window_minutes,
                    "priority": changed.priority,
                }
            ],
        }
        self._decide(
            lambda: import_configuration(self._app.catalogue, json.dumps(document).encode()),
            lambda wishes: wishes.plans.update({plan.id: changed}),
        )

    def _target(self, plan: Schedule) -> dict[str, str]:
        """As a file names it."""
        return {"robot": self.diary.names[plan.robot_id or 0]}

    # ------------------------------------------------------------------ deletions, most of them undone
    def delete(self) -> None:
        self._remove(self._plan(), undo_after=self.rng.choice((None, 0.0, 3.0, 40.0, 200.0)))

    def _remove(self, plan: Schedule, undo_after: float | None = None) -> None:
        removed = self._decide(
            lambda: self._app.catalogue.remove_schedule(plan.id), lambda wishes: wishes.plans.pop(plan.id)
        )
        self._undo_later(removed, [plan], undo_after)

    def delete_mission(self) -> None:
        mission_id = self._mission()
        plans = [plan for plan in self.diary.now.whole.values() if plan.mission_id == mission_id]
        removed = self._decide(
            lambda: self._app.catalogue.remove_mission(mission_id),
            lambda wishes: [wishes.plans.pop(plan.id) for plan in plans],
        )
        self._undo_later(removed, plans, self.rng.choice((1.0, 20.0, 100.0)), must=True)

    def delete_robot(self) -> None:
        robot = self._robot()
        robot_id, was_off = self._id(robot), robot in self.diary.now.off
        plans = [plan for plan in self.diary.now.whole.values() if plan.robot_id == robot_id]
        now = self.diary.now
        dropped = {token for token, manual in now.manual.items() if manual.robot == robot} - now.cancelled
        for row in self._app.history.open():
            if row.robot_id == robot_id:
                self.diary.excused[row.token] = "its robot was removed"

        def note(wishes: Wishes) -> None:
            for plan in plans:
                wishes.plans.pop(plan.id)
            wishes.off.add(robot)
            wishes.cancelled |= dropped

        removed = self._decide(lambda: self._app.catalogue.remove_robot(robot_id), note)
        self._undo_later(
            removed,
            plans,
            self.rng.choice((1.0, 20.0, 100.0)),
            must=True,
            on_again=None if was_off else robot,
            wanted=dropped,
        )

    def _undo_later(
        self,
        removed: Any,
        plans: list[Schedule],
        after: float | None,
        must: bool = False,
        on_again: str | None = None,
        wanted: Collection[str] = (),
    ) -> None:
        """``must``: tried again until it succeeds, so that there is something to simulate. ``wanted``: tokens that it brings back."""
        if after is None:
            return

        def note(wishes: Wishes) -> None:
            wishes.plans.update({plan.id: plan for plan in plans})
            wishes.cancelled.difference_update(wanted)
            if on_again:
                wishes.off.discard(on_again)

        def undo() -> None:
            if self.world.is_on and not self.world.was_restored_since(made_at):
                try:
                    self._decide(lambda: self._app.catalogue.restore(removed), note)
                except (InvalidInput, DatabaseError):
                    if must:
                        self.world.site.at(30.0, undo)
            elif must and not self.world.is_on:
                self.world.site.at(30.0, undo)

        made_at = self.world.site.seconds()
        self.world.site.at(after, undo)

    # ------------------------------------------------------------------ stopping and going on
    def switch_robot(self) -> None:
        robot = self._robot()
        is_on = robot not in self.diary.now.off
        plans = [plan for plan in self.diary.now.plans.values() if plan.robot_id == self._id(robot)]

        def note(wishes: Wishes) -> None:
            (wishes.off.add if is_on else wishes.off.discard)(robot)
            if is_on:
                wishes.cancelled |= {token for token, manual in wishes.manual.items() if manual.robot == robot}
                if plans:
                    self._stop_due(wishes, plans)

        self._decide(lambda: switch_robot(self._app.catalogue, self._id(robot), not is_on), note)
        if is_on:
            self._decide_later(
                self.rng.choice((0.5, 30.0, 400.0)),
                lambda: switch_robot(self._app.catalogue, self._id(robot), True),
                lambda wishes: wishes.off.discard(robot),
                lambda: robot in self.diary.now.off and self._app.catalogue.robot(self._id(robot)) is not None,
                InvalidInput,
            )

    def pause(self) -> None:
        plan, until = self._plan(), self._wall + timedelta(seconds=self.rng.choice((30, 400, 3000)))

        def note(wishes: Wishes) -> None:
            wishes.paused[plan.id] = until
            for each in (plan, *(wishes.plans[id_] for id_, move in wishes.moves.items() if move.of[0] == plan.id)):
                self._stop_due(wishes, [each])

        self._decide(lambda: self._app.pausing.pause(plan.id, until), note)

    def resume(self) -> None:
        paused = sorted(self.diary.now.paused.keys() & self.diary.now.whole.keys())
        if paused:
            schedule_id = self.rng.choice(paused)
            self._decide(lambda: self._app.pausing.resume(schedule_id), lambda wishes: wishes.paused.pop(schedule_id))

    def skip(self) -> None:
        plan = self._plan()
        with self.world.without_crash():
            instant = skip_next(self._app, plan.id)
        self.diary.decide(self.world.site.seconds()).skipped.add((plan.id, instant))

    def move_start(self) -> None:
        """The next start of a schedule, or one that was moved, to another time and perhaps another robot."""
        plan = self.diary.now.plans[self.rng.choice(sorted(self.diary.now.plans))]
        at = next((run.at for run in self._app.plan.next(40) if run.schedule.id == plan.id), None)
        if at is None:
            raise LookupError
        shift = timedelta(minutes=self.rng.choice((-9, -2, 0, 1, 2, 5, 11, 60)))
        start = at.astimezone(ZoneInfo(plan.timezone)).replace(tzinfo=None) + shift
        robot_id = self.rng.choice((None, None, self._id(self._robot())))
        target = (plan.robot_id, plan.group_id) if robot_id is None else (robot_id, None)
        if plan.recurrence is not None and shift == timedelta() and target == (plan.robot_id, plan.group_id):
            raise LookupError  # nothing is moved
        was = self.diary.now.copy()
        moved = self._decide(
            lambda: self._app.moving.move(plan.id, at, start, robot_id=robot_id, any_day=True),
            lambda wishes: None,
        )
        self._note_move(plan, at, start, target, moved.after.id)
        if self.rng.random() < 0.4:
            self._undo_move_later(moved, was, plan.id)

    def _note_move(self, plan: Schedule, at: datetime, start: datetime, target: Target, id_: int) -> None:
        wishes = self.diary.now
        if (move := wishes.moves.get(plan.id)) is not None and id_ == plan.id:
            wishes.moves[id_] = replace(move, start=start, target=target)
        elif move is not None:  # back
            del wishes.moves[plan.id], wishes.plans[plan.id]
            wishes.skipped.discard(move.of)
        elif plan.recurrence is None:
            wishes.plans[id_] = replace(plan, start=start, robot_id=target[0], group_id=target[1])
            wishes.stopped -= {key for key in wishes.stopped if key[0] == id_ and key[1] > self._wall}
        else:
            wishes.skipped.add((plan.id, at))
            wishes.moves[id_] = Move((plan.id, at), start, target, (plan.robot_id, plan.group_id))
            self.diary.ids.add(id_)
        wishes.follow()

    def _undo_move_later(self, moved: Moved, was: Wishes, id_: int) -> None:
        def undo() -> None:
            if self.world.is_on and not self.world.was_restored_since(made_at):
                with suppress(InvalidInput, DatabaseError):
                    back = self._decide(lambda: self._app.moving.undo(moved), lambda wishes: None)
                    whole = self.diary.now.plans[id_ if id_ not in was.moves else was.moves[id_].of[0]]
                    start = moved.was_at.astimezone(ZoneInfo(whole.timezone)).replace(tzinfo=None)
                    before = whole if plan.recurrence is not None else plan
                    target = before.robot_id, before.group_id
                    self._note_move(self.diary.now.plans[moved.after.id], moved.at, start, target, back.after.id)

        plan, made_at = was.plans[id_], self.world.site.seconds()
        self.world.site.at(self.rng.choice((0.5, 8.0, 90.0)), undo)

    def hold(self) -> None:
        robot = self.rng.choice((None, *self.diary.names.values()))
        until = self.rng.choice((None, self._wall + timedelta(seconds=self.rng.choice((5, 60, 600)))))
        self._decide(
            lambda: self._app.holds.hold("a meeting", until, robot and self._id(robot)),
            lambda wishes: wishes.holds.update({robot: until}),
        )
        self.world.note_holds()
        self.world.site.at(self.rng.choice((20.0, 200.0, 1200.0)), lambda: self.release(robot))

    def release(self, robot: str | None = None) -> None:
        if self.world.is_on and robot in self.diary.now.holds:
            try:
                self._decide(
                    lambda: self._app.holds.release(robot and self._id(robot)), lambda wishes: wishes.holds.pop(robot)
                )
            except DatabaseError:
                self.world.site.at(60.0, lambda: self.release(robot))
            self.world.note_holds()

    # ------------------------------------------------------------------ single starts
    def run_now(self) -> None:
        robot, mission_id = self._robot(), self._mission()
        token = str(uuid.UUID(int=self.rng.getrandbits(128), version=4))
        parameters = (
            {"Time": "00:00:30.000000"}
            if self.world.missions[mission_id] == "Wait at home" and self.rng.random() < 0.5
            else {}
        )
        self._decide(
            lambda: self._app.operator.run_now(self._id(robot), mission_id, parameters, token),
            lambda wishes: wishes.manual.update({token: self.world.manual(robot, mission_id)}),
        )
        self.world.site.kick()

    def cancel(self) -> None:
        open_ones = self._app.history.open()
        if not open_ones:
            raise LookupError
        row = self.rng.choice(open_ones)
        self.diary.uncertain.add(row.token)
        self.diary.by_person.add(row.token)
        self._app.operator.cancel_execution(row.id)
        self.diary.decide(self.world.site.seconds()).cancelled.add(row.token)

    def hold_start(self) -> None:
        """Hold a waiting start and release it after a while."""
        row = self.rng.choice(self._app.history.open())
        self.diary.by_person.add(row.token)
        with self.world.without_crash():
            if not self._app.operator.hold_starts([row.id]):
                raise LookupError
        self.diary.decide(self.world.site.seconds()).held_starts.add(row.token)
        self._decide_later(
            self.rng.choice((0.5, 20.0, 200.0, 1200.0)),
            lambda: self._app.operator.hold_starts([row.id], False),
            lambda wishes: wishes.held_starts.discard(row.token),
            lambda: row.token in self.diary.now.held_starts,
        )

    def clear(self) -> None:
        robot_id = self._id(self._robot())
        tokens = {row.token for row in self._app.history.open() if row.robot_id == robot_id}
        self.diary.uncertain |= tokens
        self.diary.by_person |= tokens
        self._app.operator.clear_queue(robot_id)
        self.diary.decide(self.world.site.seconds()).cancelled |= tokens

    # ------------------------------------------------------------------ the integrator
    def idle_rule(self) -> None:
        robot, is_on = self._robot(), self.rng.random() < 0.8

        def note(wishes: Wishes) -> None:
            wishes.idle.pop(robot, None)
            if is_on:
                wishes.idle[robot] = self.world.idle_guid

        home = next(key for key, guid in self.diary.guids.items() if guid == self.world.idle_guid)
        self._decide(
            lambda: self._app.catalogue.change_idle_rule(
                self._id(robot), mission_id=home, after_minutes=self.rng.choice((5, 8)), enabled=is_on
            ),
            note,
        )

    def working_days(self) -> None:
        days = self.rng.choice((WEEKDAYS[:5], WEEKDAYS, ("SA", "SU", "MO")))
        self._decide(*self._works_on(days))
        if days != WEEKDAYS:
            self._decide_later(600.0, *self._works_on(WEEKDAYS), lambda: self.diary.now.working_days != WEEKDAYS)

    def _works_on(self, days: tuple[str, ...]) -> tuple[Callable[[], Any], Callable[[Wishes], Any]]:
        """The act and its note."""
        return (
            lambda: self._app.catalogue.change_settings(working_days=days),
            lambda wishes: setattr(wishes, "working_days", days),
        )

    def day_off(self) -> None:
        today = self._wall.astimezone(ZoneInfo(self.world.nature.zone)).date()
        entries = self._app.catalogue.day_exceptions()
        if entries:
            self._decide(
                lambda: self._app.catalogue.remove_days(*(entry.id for entry in entries)),
                lambda wishes: setattr(wishes, "closed", frozenset()),
            )
        else:
            self._decide(
                lambda: self._app.catalogue.save_days(DayException("Inventory", today, today)),
                lambda wishes: setattr(wishes, "closed", frozenset({today})),
            )
            self.world.site.at(900.0, lambda: self.world.is_on and self.diary.now.closed and self.do("day_off"))

    def history_limit(self) -> None:
        with self.world.without_crash():
            self._app.catalogue.change_settings(history_limit=self.rng.choice((1, 5, 50, None)))
        self.world.keeps_history = False

    def watch(self) -> None:
        self._app.engine.watch(self.rng.choice((None, *self.diary.names)))

    def confirm_clock(self) -> None:
        """Somebody looks at the clock, which is right, and says so."""
        hold = self._app.holds.active()
        if hold is not None and hold.clock and abs(self.diary.ahead(self.world.site.seconds())) < 60:
            self._app.holds.confirm_clock()

    def back_up(self) -> None:
        file = self.world.site.directory / f"backup-{len(self.backups)}.db"
        with self.world.without_crash():
            back_up(self._app.db.path, file)
        self.backups = [*self.backups, (file, self.world.site.seconds(), self.diary.now.copy())][-3:]


__all__ = ["IDLE_MISSION", "MINUTE", "Person"]
