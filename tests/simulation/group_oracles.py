"""What has to hold of starts for any robot of a group: each at one robot at a time, in order, without delay. Judged as all else is, by the
robots' own histories and the diary."""

from __future__ import annotations

import math
from collections import Counter, defaultdict
from collections.abc import Iterator
from datetime import timedelta
from typing import TYPE_CHECKING

from app.domain.models import Overlap, Schedule
from mir_sim.mission_queue import QueueItem
from mir_sim.missions import MISSIONS
from mir_sim.state import StateId
from mir_sim.world import STATIONS as ALL_STATIONS
from tests.simulation.diary import Key, instants
from tests.support.network import Fate, Submission

if TYPE_CHECKING:
    from tests.simulation.oracles import Judge
    from tests.simulation.world import World

PLACE_FOR = 2  # missions at the place
SAMPLED_EVERY = 5.0  # s
COEXIST = 3  # samples after the first in which a robot is free and a start waits: longer than the 10 s promised
ASKED_AGAIN = 64.0  # s after which a robot that was away for long is asked again at the latest, or a poll later
LAST_CALL = 5.0 + 1.5  # s before its window closes a start goes into a queue
PROTECTED = 150.0  # s before a planned start that its robot may be kept for it: longer than any mission takes by the robots' clocks
UNKNOWN = 340.0  # the same while the duration is not known, and taken for five minutes
GIVEN_WITH = 0.5  # s after another one a start may be sent that was given to its own robot in the same moment
BINDING = 4.0  # s that a start may have waited unseen when another one was bound
SLOWEST = 20.0  # s before a submission an answer may have been made that its choice rests on
OFF_BY = 3.0  # m that a robot may be nearer or farther than stated
STATIONS = {station.guid: station for station in ALL_STATIONS}
KNOWN = (Fate.FINE, Fate.SLOW, Fate.REFUSED, Fate.NOT_FOUND)
WORKS = (StateId.READY, StateId.EXECUTING, StateId.ABORTED, StateId.COMPLETED, StateId.DOCKED, StateId.DOCKING)


class GroupJudge:
    def __init__(self, world: World, judge: Judge) -> None:
        self.world, self.judge, self.diary = world, judge, world.diary
        self._last_called: set[str] = set()  # tokens
        self._posts: dict[str, list[Submission]] = defaultdict(list)  # by token
        self._stopped_since: dict[str, float] = {}  # robots by when they were first seen unable to work
        self._stopped_at: dict[str, list[float]] = defaultdict(list)
        self._together: Counter[tuple[Key, str]] = Counter()
        self._passed_by: list[
            tuple[float, str, str]
        ] = []  # at what time, the token of the one that waited, what to say

    # ------------------------------------------------------------------ what is what
    def goes_at_once(self, plan: Schedule, start: float, end: float) -> bool:
        """Whether it is for one robot, which gets it at its instant."""
        wishes = self.diary.between(start, end)
        is_simple = plan.group_id is None and plan.mission_id != self._at_the_place
        return is_simple and not any(self.diary.robots_of(plan, each) & each.one_line for each in wishes)

    @property
    def _at_the_place(self) -> int:
        return list(self.world.missions)[1]

    def _group_of(self, token: str) -> int | None:
        wishes, wall = self.diary.now, self.world.site.clock.now()
        if token in wishes.manual:
            return wishes.manual[token].group_id
        key = self.diary.key_of(token, wall)
        plan = wishes.plans.get(key[0]) if key else None
        return plan.group_id if plan else None

    def _is_judged(self, token: str) -> bool:
        """Its outcome is certain, and no request of it arrives later than promised."""
        late = any(
            post.lands_at is not None and post.lands_at - post.at > self.world.nature.quiet_s
            for post in self._posts.get(token, ())
        )
        return (
            not late
            and token not in self.diary.excused
            and token not in self.diary.uncertain
            and token not in self.diary.now.cancelled
        )

    def _open_items(self, robot: str) -> list[QueueItem]:
        return [item for item in self.world.site.queue(robot) if item.finished is None]

    # ------------------------------------------------------------------ each submission as it leaves
    def posted(self, post: Submission) -> None:
        name = f"{post.robot} {post.token[:8]}"
        earlier, group_id = list(self._posts[post.token]), self._group_of(post.token)
        self._judge_place(post, name)
        if group_id is not None:
            self._judge_unread(post, earlier, name)
            self._judge_metres(post, name)
            wishes = self.diary.between(post.at - 10.0, post.at)
            is_assigned = any(post.token in each.assigned for each in wishes)  # by a person, to any robot
            if not is_assigned:
                self._judge_state(post, name)
            is_at_once = any(group_id in each.at_once for each in wishes)
            if not is_assigned and not is_at_once and self._is_judged(post.token):
                self._judge_order(post, group_id, name)
        self._posts[post.token].append(post)

    def _judge_unread(self, post: Submission, earlier: list[Submission], name: str) -> None:
        """What became of it elsewhere was unknown, so that robot was asked after the quiet time."""
        for before in earlier:
            if before.robot == post.robot or before.fate in KNOWN or self.world.was_restored_since(before.at):
                continue
            if self.world.site.network.answered.get(before.robot, -1.0) < before.at + self.world.nature.quiet_s - 0.1:
                self.judge.object(f"safety: given to another robot before the first was read: {name}, {before.robot}")

    def _judge_state(self, post: Submission, name: str) -> None:
        since = self._stopped_since.get(post.robot)
        machine = self.world.site.machines[post.robot]
        machine.catch_up()
        if since is not None and post.at - since > 3.0 and not self._works(post.robot):
            self.judge.object(f"safety: given to a robot that has been stopped for {post.at - since:.0f} s: {name}")

    def _judge_metres(self, post: Submission, name: str) -> None:
        """The stated distance of a robot chosen a moment ago is true: a free robot does not move."""
        row = self.world.site.container.ledger.by_token(post.token)
        if (
            row is None
            or row.bound_at is None
            or (self.world.site.clock.now() - row.bound_at).total_seconds() > BINDING
        ):
            return
        if self._open_items(post.robot):  # sent a moment before, not arrived yet
            return
        if self.diary.was_wrong("slow", None, post.at - SLOWEST, post.at):  # a late answer shows where it was
            return
        [mission] = [mission for mission in MISSIONS if mission.guid == post.mission_id]
        goal, pose = STATIONS[mission.actions[0].parameters["position"]].pose, self.world.site.machines[post.robot].pose
        for chosen in row.choice.get("robots", ())[:1]:
            way = math.dist((pose.x, pose.y), (goal.x, goal.y))
            if abs(chosen.get("metres", way) - way) > OFF_BY:
                self.judge.object(f"truth: {chosen['metres']} m were stated: {name} at {pose.x:.0f}, {pose.y:.0f}")

    def _judge_place(self, post: Submission, name: str) -> None:
        guid = self.diary.guids[self._at_the_place]
        if post.mission_id != guid or self.diary.restores or self.world.nature.fleet != "normal":
            return
        there = {
            item.description
            for robot in self.world.site.machines
            for item in self._open_items(robot)
            if item.mission_id == guid and item.description != post.token
            if self._posts.get(item.description) and self._is_judged(item.description)
        }
        if len(there) >= PLACE_FOR:
            self.judge.object(f"safety: {len(there) + 1} at a place for {PLACE_FOR}: {name}")

    def _judge_order(self, post: Submission, group_id: int, name: str) -> None:
        key = self.diary.key_of(post.token, self.world.site.clock.now())
        if key is None:
            return
        plan = self.diary.now.plans[key[0]]
        left = self._closes(plan, key, post.at) - post.at
        if left <= LAST_CALL:
            self._last_called.add(post.token)  # into a queue, also before one that will be sent a moment later
        elif not self._was_edited(plan, post.at):
            others = {item.description for item in self._open_items(post.robot)} - {post.token} - self._last_called
            if any(
                self._posts.get(token) and self._group_of(token) is not None and self._is_judged(token)
                for token in others
            ):
                self.judge.object(f"safety: a second start of a group on one robot: {name}")
            self._judge_priority(post, plan, group_id, name)

    def _judge_priority(self, post: Submission, plan: Schedule, group_id: int, name: str) -> None:
        robots = self.diary.robots_of(plan)
        if not all(self.diary.is_clear(robot, post.at - 60.0, post.at, but=()) for robot in robots):
            return
        for other, key in self._waiting(group_id, post.at - BINDING):
            is_longer = self._is_kept(post.robot, other, post.at)  # and does not fit before what is planned
            if other.priority > plan.priority and other.minimum_battery_percent is None and not is_longer:
                self._passed_by.append(
                    (post.at, self.diary.token(key), f"safety: {key[0]} of higher priority waited when {name} was sent")
                )

    def _was_edited(self, plan: Schedule, at: float) -> bool:
        return any(
            each.plans.get(plan.id) != plan or each.groups != self.diary.now.groups
            for each in self.diary.between(at - 20.0, at)
        )

    def _closes(self, plan: Schedule, key: Key, at: float) -> float:
        minutes = 15 if plan.start_window_minutes is None else max(1, plan.start_window_minutes)
        return self.judge._true(key[1], at) + 60.0 * minutes

    # ------------------------------------------------------------------ what waits
    def _waiting(self, group_id: int, since: float) -> Iterator[tuple[Schedule, Key]]:
        """Unsent starts of a group that wait only for a robot, and did so then already."""
        now, wall = self.world.site.seconds(), self.world.site.clock.now()
        for plan in self.diary.now.plans.values():
            waits_for_more = (
                plan.mission_id == self._at_the_place or plan.finish_by_minutes or plan.overlap is not Overlap.PARALLEL
            )
            if plan.group_id != group_id or waits_for_more:
                continue
            minutes = 15 if plan.start_window_minutes is None else max(1, plan.start_window_minutes)
            for instant in instants(plan, wall - timedelta(minutes=min(minutes, 60)), wall):
                key, due = (plan.id, instant), self.judge._true(instant, now)
                if not (due <= since and due > 120.0 and due + 60.0 * minutes > now + 10.0):
                    continue
                if (
                    self._has_been_away(due)
                    or self.diary.is_of_restored_time(instant)
                    or self._was_edited(plan, now)
                    or not self.diary.is_steady(due - 60.0)
                    or not self.diary.is_clear("", due - 60.0, now, but=("slow",))
                ):
                    continue
                token = self.diary.token(key)
                if (
                    token not in self._posts
                    and token not in self.judge._items_of
                    and self._is_judged(token)
                    and self.judge._is_settled(key, due - 5.0, now)
                    and not self._was_due_before(key, due)
                ):
                    yield plan, key

    def _has_been_away(self, due: float) -> bool:
        """Not yet written, or listed first, after the app was off."""
        return self.judge._back_at > due - 120.0

    def _was_due_before(self, key: Key, due: float) -> bool:
        """It may have been given up then, and the clock was set back since."""
        return any(at < due - 60.0 for at in self.judge._times_shown(key[1]))

    # ------------------------------------------------------------------ every few seconds
    def sample(self) -> None:
        now = self.world.site.seconds()
        for robot in self.world.site.machines:
            if self._works(robot):
                self._stopped_since.pop(robot, None)
            else:
                self._stopped_since.setdefault(robot, now)
                self._stopped_at[robot].append(now)
        for at, token, what in [each for each in self._passed_by if now - each[0] >= GIVEN_WITH]:
            self._passed_by.remove((at, token, what))
            if not any(post.at <= at + GIVEN_WITH for post in self._posts.get(token, ())):
                self.judge.object(what)
        together = {(key, robot) for key, robot in self._free_and_waiting(now)} if self.world.is_on else set()
        self._together = Counter({pair: self._together[pair] + 1 for pair in together})
        for (key, robot), times in self._together.items():
            if times > COEXIST:
                self.judge.object(f"liveness: {robot} is free and {self.judge._shown(key)} waits")

    def _works(self, robot: str) -> bool:
        machine = self.world.site.machines[robot]
        machine.catch_up()
        return machine.state in WORKS and not machine.errors

    def _free_and_waiting(self, now: float) -> Iterator[tuple[Key, str]]:
        busy = {row.robot for row in self.world.site.container.history.open()}
        for group_id, members in self.diary.now.groups.items():
            if group_id in self.diary.now.at_once:
                continue
            free = [robot for robot in sorted(members) if robot not in busy and self._is_free(robot, now)]
            for plan, key in self._waiting(group_id, now - SAMPLED_EVERY) if free else ():
                for robot in free:
                    if not self._is_kept(robot, plan, now):
                        yield key, robot

    def _is_free(self, robot: str, now: float) -> bool:
        if (
            robot in self.diary.now.off
            or not self._works(robot)
            or self.world.site.machines[robot].state is not StateId.READY
        ):
            return False
        known_for = min(ASKED_AGAIN, max(30.0, self.world.nature.poll_interval))
        return not self._open_items(robot) and self.diary.is_clear(robot, now - known_for, now, but=())

    def _is_kept(self, robot: str, plan: Schedule, now: float) -> bool:
        """For a start that is planned soon: a fixed one, or one that matters more."""
        wall, limit = self.world.site.clock.now(), self.world.nature.history_limit
        is_known = now > 900.0 and limit is None and self.world.keeps_history and not self.diary.restores
        ahead = timedelta(seconds=PROTECTED if is_known else UNKNOWN)
        for other in self.diary.now.plans.values():
            matters = other.group_id is None or other.priority > plan.priority
            if matters and robot in self.diary.robots_of(other) and next(instants(other, wall, wall + ahead), None):
                return True
        return False

    # ------------------------------------------------------------------ never lost
    def chance(self, plan: Schedule, key: Key, due: float, closes: float) -> tuple[float, float] | None:
        """A time in which one of its robots was well to the end of its window, in which it goes into its queue at the latest."""
        start, wishes = due - 60.0, self.diary.between(due - 60.0, closes)
        token = self.diary.token(key)
        if (
            plan.mission_id == self._at_the_place
            or plan.finish_by_minutes
            or plan.overlap is Overlap.QUEUE
            or start < 60.0
        ):
            return None
        if token in self._posts or any(token in each.assigned for each in wishes):
            return None  # if that request got lost, its robot keeps the start
        if self._was_due_before(key, due):
            return None
        members = [self.diary.robots_of(each.plans[key[0]], each) for each in wishes if key[0] in each.plans]
        for robot in sorted(frozenset.intersection(*members)):
            was_stopped = any(start <= at <= closes for at in self._stopped_at[robot])
            was_off = any(robot in each.off for each in wishes)
            if self.diary.is_clear(robot, start, closes, but=()) and not was_off and not was_stopped:
                return start, closes
        return None

    # ------------------------------------------------------------------ at the end
    def last_verdict(self) -> None:
        """Every robot that was asked to take a start and does not have it is recorded with it; and each choice names
        its robot first."""
        if self.diary.restores:
            return
        ids = {name: str(robot_id) for robot_id, name in self.diary.names.items()}
        for row in self.world.site.executions():
            if row.group_id is None or not self._is_judged(row.token):
                continue
            for robot in {post.robot for post in self._posts.get(row.token, ())} - {row.robot}:
                if ids[robot] not in row.tried:
                    self.judge.object(f"truth: nothing is noted of {robot}: {row.token[:8]}")
            chosen = row.choice.get("robots", [])
            if row.robot_id is not None and chosen and chosen[0]["robot"] != row.robot:
                self.judge.object(f"truth: {row.robot} has it, {chosen[0]['robot']} was chosen: {row.token[:8]}")
