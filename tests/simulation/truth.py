"""Truth: after ten minutes without faults, each row agrees with its item on the robot, and figures equal a recount."""

from __future__ import annotations

from collections import Counter
from collections.abc import Collection
from datetime import datetime, timedelta
from typing import TYPE_CHECKING

from app.domain.execution import Execution, State, Wait
from mir_sim.mission_queue import ItemState
from tests.simulation.diary import Wishes, instants

if TYPE_CHECKING:
    from tests.simulation.oracles import Found, Judge
    from tests.simulation.world import World

JUST_NOW = 20.0  # s that the app may be behind the robot
ENDS_WITHIN = 600.0  # s in which every row of a robot that is well ends
LOOKED_FOR = 600.0  # s for which the app looks for what it has given up


class Truth:
    def __init__(self, world: World, judge: Judge) -> None:
        self.world, self.judge_, self.diary = world, judge, world.diary
        self._counted: set[str] = set()  # tokens of rows that stand for several starts

    def judge(self, since: float) -> None:
        """Everything has been well for that long (s)."""
        items = self.judge_._items_of
        rows = self.world.site.executions()
        for row in rows:
            found = [each for each in items.get(row.token, []) if self._is_on_its_robot(each)]
            if row.state.is_open:
                self._judge_open(row, found, since)
            elif row.token not in self.diary.excused and not self._is_of_restored_time(row):
                self._judge_ended(row, found)
        if self.world.keeps_history and not self.diary.restores:
            for token in items.keys() - {row.token for row in rows} - self.diary.excused.keys():
                if self.diary.key_of(token, self.world.site.clock.now()) or any(
                    token in each.manual for _at, each in self.diary.wishes
                ):
                    self.judge_.object(f"truth: an item without a row: {token[:8]}")
        self._judge_absences(rows)
        self._count_again(rows)

    def _is_on_its_robot(self, found: Found) -> bool:
        """A late request reaches the machine that has the address then. Its result on another machine says nothing
        about the robot, and can't be known: the app doesn't read the queue of a machine with a different serial
        number."""
        return found.machine is self.world.site.machines.get(found.robot)

    def _judge_absences(self, rows: list[Execution]) -> None:
        """A row that stands for several starts has the right number of them. Only a start about which a person decided has a row of its
        own in that time, and is not among them: what one cancelled is skipped when the clock is set back and its instant comes again."""
        for row in rows:
            if row.starts == 1 or row.reason is None:
                continue
            first = datetime.fromisoformat(row.reason.details["first"])
            others = [
                each
                for each in rows
                if each.schedule_id == row.schedule_id and first <= each.planned_at <= row.planned_at
            ]
            others.remove(row)
            for other in others:
                is_skipped = (row.schedule_id, other.planned_at) in self.diary.now.skipped
                if not is_skipped and other.token not in self.diary.by_person:
                    self.judge_.object(
                        f"truth: {self._shown(other)}, and {row.starts} from {first:%d %H:%M} on: {self._shown(row)}"
                    )
            if row.token not in self._counted:
                self._counted.add(row.token)
                self.judge_.findings.absences += 1
                apart = {each.planned_at for each in others}
                numbers = {
                    self._number(each, row.schedule_id or 0, first, row.planned_at, apart)
                    for _at, each in self.diary.wishes
                }
                if row.starts not in numbers:
                    self.judge_.object(
                        f"truth: {self._shown(row)} for {row.starts} starts from {first:%d %H:%M} on, by hand {numbers}"
                    )

    def _number(
        self, wishes: Wishes, schedule_id: int, first: datetime, last: datetime, apart: Collection[datetime]
    ) -> int:
        """Of the schedule's starts in that time, as people wanted it then, without those that have rows of their own, or had one that the
        history may have forgotten."""
        plan = wishes.plans.get(schedule_id)
        if plan is None:
            return 0
        keys = [
            (schedule_id, instant)
            for instant in instants(plan, first, last + timedelta(seconds=1))
            if instant not in apart
        ]
        is_left_out = [key in wishes.skipped or self.diary.token(key) in wishes.cancelled for key in keys]
        return sum(
            not out and self.diary.is_on_its_days(wishes, plan, key[1])
            for key, out in zip(keys, is_left_out, strict=True)
        )

    def _is_of_restored_time(self, row: Execution) -> bool:
        return any(each.start - timedelta(hours=4) <= row.planned_at <= each.end for each in self.diary.restores)

    def _judge_open(self, row: Execution, found: list[Found], since: float) -> None:
        """Whether nothing prevents it from ending."""
        world = self.world
        age = (world.site.clock.now() - row.planned_at).total_seconds()
        is_busy = any(
            self.judge_.is_open(each)
            or self.judge_._ended_before(each, world.site.seconds()) < JUST_NOW + world.nature.poll_interval
            for each in found
        )
        now = world.site.seconds()
        is_clear = self.diary.is_clear(row.robot, now - ENDS_WITHIN, now) and row.robot not in self.diary.now.off
        is_held = any(row.token in each.held_starts for each in self.diary.between(now - ENDS_WITHIN, now))
        is_bound = row.robot_id is not None  # else it waits for a robot of its group, however long that is away
        if row.wait is Wait.ELSEWHERE and world.site.clock.now() < row.closes_at:
            is_bound &= not self.judge_.may_stay_uncertain(row.planned_at)
        if is_bound and age > ENDS_WITHIN and since >= ENDS_WITHIN and not is_busy and is_clear and not is_held:
            self.judge_.object(f"liveness: open for {age:.0f} s: {self._shown(row)}")
        if (
            row.state in (State.QUEUED, State.EXECUTING)
            and not found
            and row.token not in self.diary.excused
            and is_clear
        ):
            self.judge_.object(f"truth: no such item: {self._shown(row)}")

    def _judge_ended(self, row: Execution, found: list[Found]) -> None:
        states = {each.item.state for each in found}
        if self.world.nature.fleet != "normal":
            return  # which item is whose can't be known there
        if any(
            self.judge_._ended_before(each, self.world.site.seconds()) < JUST_NOW + self.world.nature.poll_interval
            for each in found
        ):
            return
        match row.state:
            case State.COMPLETED:
                agrees = ItemState.DONE in states
            case State.FAILED | State.CANCELLED:  # of two copies the earlier one counts
                agrees = states != {ItemState.DONE} or (row.queue_id is None and self._came_unseen(row))
            case _:  # it may have been tried, and come when it was too late, or when it was no longer looked for
                agrees = not states or (row.attempts > 0 and states == {ItemState.ABORTED}) or self._came_unseen(row)
        if not agrees:
            self.judge_.object(f"truth: {self._shown(row)}, the robot says {sorted(states) or 'nothing'}")

    def _came_unseen(self, row: Execution) -> bool:
        patience = LOOKED_FOR + self.world.nature.quiet_s
        posts = [post for post in self.world.site.network.submissions if post.token == row.token]
        return any(post.lands_at is not None and post.lands_at - post.at > patience for post in posts)

    def _shown(self, row: Execution) -> str:
        code = f" ({row.reason.code})" if row.reason else f" [{row.wait}]" if row.state is State.WAITING else ""
        return f"{row.robot} {row.schedule or row.trigger} {row.planned_at:%d %H:%M:%S} {row.token[:8]} is {row.state}{code}"

    def _count_again(self, rows: list[Execution]) -> None:
        """What ended by a clock that was ahead counts once that time has come."""
        now = self.world.site.clock.now()
        kpis = self.world.site.container.kpis.facts()
        count = Counter(row.state for row in rows if row.ended_at is None or row.ended_at <= now)
        if (kpis.completed, kpis.failed, kpis.cancelled) != (
            count[State.COMPLETED],
            count[State.FAILED],
            count[State.CANCELLED],
        ):
            self.judge_.object(
                f"truth: KPIs count {kpis.completed}/{kpis.failed}/{kpis.cancelled}, the rows say {dict(count)}"
            )

    def count(self) -> None:
        self.world.findings.states = Counter(row.state.value for row in self.world.site.executions())
