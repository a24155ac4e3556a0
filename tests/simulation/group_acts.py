"""What people do in addition where robots form a group: who is in it, starts for any of them, and what they do about one by hand."""

from __future__ import annotations

import uuid
from collections.abc import Callable
from dataclasses import replace
from datetime import timedelta
from typing import Any
from zoneinfo import ZoneInfo

from app.domain.execution import ReasonCode, State
from app.domain.models import Group, HandOver, Overlap, Schedule
from tests.simulation.diary import Wishes
from tests.simulation.operator import WINDOWS, Person


class GroupPerson(Person):
    def do(self, name: str) -> None:
        super().do(name)
        self._doubt_groups_without_robots()

    def _decide(self, act: Callable[[], Any], note: Callable[[Wishes], Any]) -> Any:
        """Also what the groups are now, as Settings shows them."""

        def note_all(wishes: Wishes) -> None:
            note(wishes)
            groups = self._app.catalogue.groups()
            wishes.groups = {group.id: frozenset(self.diary.names[key] for key in group.members) for group in groups}
            wishes.at_once = {group.id for group in groups if group.hand_over is HandOver.AT_ONCE or group.keep_free}

        return super()._decide(act, note_all)

    def _doubt_groups_without_robots(self) -> None:
        """End their waiting starts in a moment."""
        wishes = self.diary.now
        for group_id, members in wishes.groups.items():
            if members <= wishes.off:
                self._doubt_due([plan for plan in wishes.plans.values() if plan.group_id == group_id])
                self.diary.uncertain |= {
                    token for token, manual in wishes.manual.items() if manual.group_id == group_id
                }

    def _group(self) -> Group:
        groups = self._app.catalogue.groups()
        if not groups:
            raise LookupError
        found: Group = self.rng.choice(groups)
        return found

    def _token(self) -> str:
        return str(uuid.UUID(int=self.rng.getrandbits(128), version=4))

    def _target(self, plan: Schedule) -> dict[str, str]:
        if plan.group_id is None:
            return super()._target(plan)
        return {"group": next(group.name for group in self._app.catalogue.groups() if group.id == plan.group_id)}

    # ------------------------------------------------------------------ the integrator
    def join_or_leave(self) -> None:
        group, robot_id = self._group(), self._id(self._robot())
        members = tuple({*group.members} ^ {robot_id})
        self._decide(lambda: self._app.catalogue.save_group(replace(group, members=members)), lambda wishes: None)

    def change_group(self) -> None:
        group, when_free = self._group(), {"hand_over": HandOver.WHEN_FREE, "keep_free": 0}
        changed = self.rng.choice(({"hand_over": HandOver.AT_ONCE}, {"keep_free": 1}, when_free, when_free))
        self._decide(lambda: self._app.catalogue.save_group(replace(group, **changed)), lambda wishes: None)

    def delete_group(self) -> None:
        group = self._group()
        plans = [plan for plan in self.diary.now.whole.values() if plan.group_id == group.id]
        self.diary.uncertain |= {
            token for token, manual in self.diary.now.manual.items() if manual.group_id == group.id
        }
        removed = self._decide(
            lambda: self._app.catalogue.remove_group(group.id),
            lambda wishes: [wishes.plans.pop(plan.id) for plan in plans],
        )
        self._undo_later(removed, plans, self.rng.choice((1.0, 20.0, 100.0)), must=True)

    def one_line(self) -> None:
        """A robot gets its starts when it is free, or at once."""
        robot = self._app.catalogue.robot(self._id(self._robot()))
        is_line = robot.hand_over is HandOver.AT_ONCE
        changed = replace(robot, hand_over=HandOver.WHEN_FREE if is_line else HandOver.AT_ONCE)
        self._decide(
            lambda: self._app.catalogue.save_robot(changed),
            lambda wishes: (wishes.one_line.add if is_line else wishes.one_line.discard)(robot.name),
        )

    # ------------------------------------------------------------------ starts for any robot
    def plan_for_any(self) -> None:
        local = self._wall.astimezone(ZoneInfo(self.world.nature.zone)).replace(second=0, microsecond=0, tzinfo=None)
        is_once = self.rng.random() < 0.8
        self.world.plan(
            Schedule(
                f"Any {self.rng.randrange(10**9)}",
                None,
                self._mission(),
                local + timedelta(minutes=self.rng.choice((0, 1, 1, 2, 5))),
                self.world.nature.zone,
                None if is_once else f"FREQ=MINUTELY;INTERVAL={self.rng.choice((4, 7, 15))}",
                group_id=self._group().id,
                respect_working_days=not is_once,
                start_window_minutes=self.rng.choice(WINDOWS),
                overlap=self.rng.choice((Overlap.SKIP, Overlap.QUEUE, Overlap.PARALLEL)),
                priority=self.rng.choice((-1, 0, 0, 1, 2)),
                finish_by_minutes=self.rng.choice((None, None, None, 3, 30)),
            )
        )

    def to_any(self) -> None:
        """Make a schedule for one robot one for any of them."""
        self._edit(self._plan(), robot_id=None, group_id=self._group().id)

    def run_on_any(self) -> None:
        group, mission_id, token = self._group(), self._mission(), self._token()
        self._decide(
            lambda: self._app.operator.run_on_any(group.id, mission_id, {}, token),
            lambda wishes: wishes.manual.update({token: self.world.manual("", mission_id, group.id)}),
        )

    def assign_robot(self) -> None:
        waiting = [
            row
            for row in self._app.history.open()
            if row.state is State.WAITING and row.group_id and row.robot_id is None
        ]
        row = self.rng.choice(waiting) if waiting else None
        if row is None:
            raise LookupError
        self._decide(
            lambda: self._app.operator.assign_robot(row.id, self._id(self._robot())),
            lambda wishes: wishes.assigned.add(row.token),
        )

    def start_on_another(self) -> None:
        """Start on another robot what is stuck, or ended so."""
        rows = [row for row in self.world.site.executions() if row.state is State.SUBMITTING]
        rows += [
            row for row in self.world.site.executions() if row.reason and row.reason.code is ReasonCode.UNKNOWN_OUTCOME
        ]
        row = self.rng.choice(rows) if rows else None
        if row is None:
            raise LookupError
        robot, token = (None if row.group_id and self.rng.random() < 0.5 else self._robot()), self._token()
        mission_id = next(key for key, guid in self.diary.guids.items() if guid == row.mission_guid)
        manual = self.world.manual(robot or "", mission_id, None if robot else row.group_id)
        self._decide(
            lambda: self._app.operator.start_on_another(row.id, robot and self._id(robot), token),
            lambda wishes: wishes.manual.update({token: manual}),
        )
