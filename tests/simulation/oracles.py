"""What has to hold of every run: safety, liveness, truth. Judged by the robots' own histories and by the diary, never by the app's code."""

from __future__ import annotations

import itertools
import math
from collections import Counter, defaultdict
from collections.abc import Iterable, Iterator, Set
from dataclasses import dataclass
from datetime import datetime, timedelta
from typing import TYPE_CHECKING

from app.domain.models import Overlap
from mir_sim import SimulatedRobot
from mir_sim.mission_queue import ItemState, QueueItem
from tests.simulation.diary import KEPT_S, MINUTE, Key, Wishes, instants
from tests.simulation.group_oracles import GroupJudge
from tests.simulation.truth import Truth
from tests.simulation.weather import FLAT, SPEED
from tests.support.network import Fate, Submission

if TYPE_CHECKING:
    from tests.simulation.world import World

GRACE = 1.0  # s within which what people decide takes effect
LATE = 1.0  # s that a start may be late when nothing is wrong
ASKS = 5.0  # s more, in which robots are asked whether a start from before a restore has run
TOGETHER = 180.0  # s for which robot and app have to be well within the window
GENERAL_WINDOW = 15  # min
LISTED_FOR = 28.0  # s for which late starts after an absence are shown first, where there is a window
ABSENCE = 80.0  # s from which on that is so, a heartbeat included
IMPOSTOR_SEEN = 3.0  # s within which another machine at the address is noticed
CLOCK_ASKED = 20.0  # s within which a robot that is well has been asked for its time
READ = 6.0  # s within which a battery that is low is known to be


@dataclass(frozen=True)
class Found:
    machine: SimulatedRobot
    robot: str
    item: QueueItem


class Judge:
    def __init__(self, world: World) -> None:
        self.world, self.diary, self.findings = world, world.diary, world.findings
        self._epoch = world.site.clock.now()  # of true time
        self._said: set[str] = set()
        self._first_post: dict[str, float] = {}
        self._ran: set[Key] = set()
        self._items_of: dict[str, list[Found]] = defaultdict(list)  # by token
        self._copied: dict[str, None] = {}  # tokens of more than one item
        self._taken: dict[
            int, tuple[Iterable[QueueItem], int]
        ] = {}  # lists of items by identity, and how many of each are in these
        self._known: set[int] = set()  # items, by identity: most items of a queue that was reset were taken before
        self._late: set[str] = set()  # tokens of requests that may arrive yet
        self._idle: set[str] = set()  # tokens
        self._back_at, self._away_since = -1e9, -1e9  # after the last absence
        self.truth = Truth(world, self)
        self.groups = GroupJudge(world, self) if world.nature.groups else None

    def object(self, what: str) -> None:
        if what not in self._said:
            self._said.add(what)
            self.findings.violations.append(
                f"{what} (at {self.world.site.seconds():.1f} s, {self.world.site.clock.now():%d %H:%M:%S})"
            )

    def came_back(self, away_since: float) -> None:
        self._away_since, self._back_at = away_since, self.world.site.seconds()

    # ------------------------------------------------------------------ safety: each submission as it leaves
    def posted(self, post: Submission) -> None:
        self.findings.submissions += 1
        wall, wishes = self.world.site.clock.now(), self.diary.between(post.at - GRACE, post.at)
        name = f"{post.robot} {post.token[:8]}"
        if all(each.is_held(post.robot, wall - timedelta(seconds=GRACE)) for each in wishes) and all(
            each.is_held(post.robot, wall) for each in wishes
        ):
            self.object(f"safety: sent under a hold: {name}")
        if all(post.robot in each.off for each in wishes):
            self.object(f"safety: sent to a robot that is switched off: {name}")
        if any(
            each.kind == "impostor"
            and each.robot == post.robot
            and each.start + 15000.0 < post.at - IMPOSTOR_SEEN
            and each.end > post.at + 6
            for each in self.diary.troubles
        ):
            self.object(f"safety: sent to another machine: {name}")
        if all(post.token in each.cancelled for each in wishes):
            self.object(f"safety: sent though it was cancelled: {name}")
        if all(post.token in each.held_starts for each in wishes):
            self.object(f"safety: sent although it was held: {name}")
        self._judge_clock(post, name)
        manual = next((each.manual[post.token] for each in wishes if post.token in each.manual), None)
        if manual is not None:
            self._in_window(name, wall, min(wall, manual.at), GENERAL_WINDOW)
            in_groups = {name for each in wishes for name in each.groups.get(manual.group_id or 0, ())}
            robots = in_groups if manual.group_id else {manual.robot}
            if post.robot not in robots or manual.guid != post.mission_id:
                self.object(f"safety: sent to the wrong robot or as another mission: {name}")
        elif key := self.diary.key_of(post.token, wall):
            self._judge_start(post, key, wishes, wall)
        elif post.mission_id == self.world.idle_guid:
            self._judge_idle(post, wishes, name)
        elif not self._knew_manual(post.token):
            self.object(f"safety: never planned: {name}")
        if self.groups is not None:
            self.groups.posted(post)
        self._first_post.setdefault(post.token, post.at)
        if post.fate is Fate.LATE:
            self._late.add(post.token)

    def _judge_idle(self, post: Submission, wishes: list[Wishes], name: str) -> None:
        """Its robot has a rule, and somebody has used it since its last idle mission. A late copy that was cancelled,
        before or while it ran, does not count as an idle mission."""
        if not any(each.idle.get(post.robot) for each in wishes):
            self.object(f"safety: an idle mission without a rule: {name}")
        last = next(
            (
                item.description
                for item in reversed(list(self.world.site.queue(post.robot)))
                if item.description != post.token and not (item.description in self._late and self._is_called_off(item))
            ),
            None,
        )
        if self.world.nature.fleet == "forgetful" and last in self._late:
            return  # a late copy; without its token it looks like a use by somebody else
        if last in self._idle and not self.diary.restores and last not in self.diary.excused:
            self.object(f"safety: two idle missions and nothing between: {name}")
        self._idle.add(post.token)

    @staticmethod
    def _is_called_off(item: QueueItem) -> bool:
        return not item.started or item.state in (ItemState.ABORT, ItemState.ABORTED)

    def _knew_manual(self, token: str) -> bool:
        return any(token in wishes.manual for _at, wishes in self.diary.wishes)

    def _judge_clock(self, post: Submission, name: str) -> None:
        """While the tablet's clock is far ahead and robots could say so, nothing leaves."""
        ahead = self.diary.ahead(post.at)
        since = next((at for at, offset in reversed(self.diary.clock) if abs(offset - ahead) > 60), 0.0)
        since = max(
            since, *(each.end for each in self.diary.troubles if each.kind == "app" and each.end < post.at), 0.0
        )
        could_ask = any(
            until - start > CLOCK_ASKED
            for name in self.diary.names.values()
            if not self.diary.was_wrong("robot's clock", name, since, post.at)
            for start, until in self.diary.clear_spans(
                name, since, post.at, but=("slow", "clock", "battery", "hold", "queue", "disk")
            )
        )
        if ahead > 60.0 * GENERAL_WINDOW + 60 and could_ask:
            self.object(f"safety: sent while the clock was {ahead:.0f} s ahead: {name}")

    def _judge_start(self, post: Submission, key: Key, wishes: list[Wishes], wall: datetime) -> None:
        name = f"{post.robot} {self._shown(key)}"
        wanted = [each for each in wishes if self.diary.wants(each, key, days=False)]
        due = self._true(key[1], post.at)
        shown = list(self._times_shown(key[1])) or [due]
        first_due = min(due, *shown)  # before the clock was set back
        if not wanted or not any(
            self.diary.wants(each, key) for each in self.diary.between(min(first_due, post.at) - 5.0, post.at)
        ):
            self.object(f"safety: sent though it had been withdrawn: {name}")
            return
        plans = [each.plans[key[0]] for each in wanted]
        if not any(
            post.robot in self.diary.robots_of(plan, each) and self.diary.guids[plan.mission_id] == post.mission_id
            for each in wanted
            for plan in (each.plans[key[0]],)
        ):
            self.object(f"safety: sent to the wrong robot or as another mission: {name}")
        windows = [GENERAL_WINDOW if plan.start_window_minutes is None else plan.start_window_minutes for plan in plans]
        self._in_window(name, wall, key[1], max(windows))
        if (
            self.world.nature.with_window
            and self._away_since < min(shown) <= max(shown) <= self._back_at - 1
            and post.token not in self._first_post
            and not self.diary.was_wrong("hold", post.robot, self._back_at, post.at)
            and self._back_at - self._away_since > ABSENCE
            and post.at < self._back_at + LISTED_FOR
            and not any(
                post.token in each.assigned | each.held_starts for each in self.diary.between(self._back_at, post.at)
            )
        ):
            self.object(f"safety: started late after an absence without the list: {name}")
        if all((plan.minimum_battery_percent or 0) > FLAT for plan in plans) and any(
            each.kind == "battery" and each.robot == post.robot and each.start < post.at - READ and each.end == math.inf
            for each in self.diary.troubles
        ):
            self.object(f"safety: sent on a low battery: {name}")
        if all(plan.overlap is Overlap.SKIP for plan in plans) and self._is_settled(key, due - 5.0, post.at):
            self._judge_overlap(key, due, post, name)
        self._judge_punctuality(post, key, name)

    def _judge_overlap(self, key: Key, due: float, post: Submission, name: str) -> None:
        """A start before it, moved or not, of a schedule that does not overlap, was with a robot when it fell due and is there still."""
        tokens = {self.diary.token(each) for each in self.diary.others(key, key[1] - timedelta(hours=2), key[1])}
        tokens -= self.diary.excused.keys() | self.diary.uncertain
        site = self.world.site
        first = {item.description: (name, item) for name in site.machines for item in reversed(list(site.queue(name)))}
        for robot, item in first.values():
            if (
                item.description in tokens
                and item.finished is None
                and self._first_post.get(item.description, due) < due - 10.0
                and all(
                    self.diary.is_clear(each, due - 30.0, due, but=("battery", "hold", "slow"))
                    for each in {robot, post.robot}
                )
            ):
                self.object(f"safety: sent though the one before it is still there: {name}")

    def _in_window(self, name: str, wall: datetime, planned: datetime, minutes: int) -> None:
        early = (planned - wall).total_seconds()
        if early > 0.001 and not self.diary.was_wrong(
            "clock", None, self.world.site.seconds() - 2.0, self.world.site.seconds()
        ):
            self.object(f"safety: sent {early:.1f} s before its instant: {name}")
        if early < -60.0 * max(1, minutes) - 0.05:
            self.object(f"safety: sent after its window: {name}")

    def _judge_punctuality(self, post: Submission, key: Key, name: str) -> None:
        due, plan = self._true(key[1], post.at), self.diary.now.plans[key[0]]
        if self.groups is not None and not self.groups.goes_at_once(plan, due - 90.0, post.at):
            return
        if post.token in self._first_post or not self.diary.is_clear(post.robot, due - 90.0, post.at, but=()):
            return
        if self._is_settled(key, due - 90.0, post.at):
            self.findings.punctual += 1
            if post.at - due > LATE + (ASKS if self.diary.is_of_restored_time(key[1]) else 0.0):
                self.object(f"liveness: {post.at - due:.1f} s late, and nothing was wrong: {name}")

    # ------------------------------------------------------------------ liveness
    def _true(self, instant: datetime, at: float) -> float:
        """When the tablet's clock, as it goes at a true time, shows that instant."""
        return (
            (instant - self.world.site.clock.now()).total_seconds()
            + self.world.site.seconds()
            - (self.diary.ahead(at) - self.diary.ahead(self.world.site.seconds()))
        )

    def _times_shown(self, instant: datetime) -> Iterator[float]:
        """True times at which the tablet's clock has shown that instant, or was set past it."""
        clock, shown = self.diary.clock, (instant - self._epoch).total_seconds()
        before = [0.0, *(ahead for _at, ahead in clock)]
        for (since, ahead), was, until in zip(clock, before, [*(at for at, _ in clock[1:]), math.inf], strict=False):
            if since <= shown - ahead < until:
                yield shown - ahead
            elif since + was < shown < since + ahead:
                yield since

    def _is_settled(self, key: Key, start: float, end: float, *, except_undone: bool = False) -> bool:
        """Whether it was wanted and not held all this time, on the same robot and within the same window."""
        wishes = self.diary.between(start, end, key[0] if except_undone else None)
        token = self.diary.token(key)
        if not all(self.diary.wants(each, key) and token not in each.held_starts for each in wishes):
            return False
        plans = [each.plans[key[0]] for each in wishes]
        same = (
            "robot_id",
            "group_id",
            "start_window_minutes",
            "start",
            "recurrence",
            "minimum_battery_percent",
            "overlap",
        )
        return len({tuple(getattr(plan, name) for name in same) for plan in plans}) == 1

    def _judge_liveness(self, sent: Set[str]) -> None:
        wall, now = self.world.site.clock.now(), self.world.site.seconds()
        if abs(self.diary.ahead(now)) > 600:
            return
        for plan in self.diary.now.plans.values():
            minutes = GENERAL_WINDOW if plan.start_window_minutes is None else plan.start_window_minutes
            for instant in instants(
                plan, wall - timedelta(minutes=min(minutes, 120) + 15), wall - timedelta(seconds=self._together)
            ):
                key = (plan.id, instant)
                if key in self._ran:
                    continue
                if (token := self.diary.token(key)) in sent:
                    self._ran.add(key)
                    self.findings.occurrences += 1
                    self.findings.judged += self._chance(key, max(1, minutes)) is not None
                elif (
                    token not in self.diary.excused
                    and token not in self.diary.uncertain
                    and (span := self._chance(key, max(1, minutes)))
                ):
                    self._ran.add(key)
                    self.object(
                        f"liveness: never ran: {plan.name} {self._shown(key)}, well from {span[0]:.0f} to {span[1]:.0f} s"
                    )

    @property
    def _together(self) -> float:
        nature = self.world.nature
        return max(TOGETHER, nature.poll_interval + nature.quiet_s + 60.0)

    def _chance(self, key: Key, minutes: int) -> tuple[float, float] | None:
        """A time within its window in which robot and app were well together for long enough."""
        now, plan = self.world.site.seconds(), self.diary.now.plans[key[0]]
        due = self._true(key[1], now)
        end = min(now, due + 60.0 * minutes)
        if (
            due < 60
            or not self.diary.is_steady(due - 60.0)
            or not self._is_settled(key, due - 2.0, end, except_undone=True)
            or key in self.diary.now.stopped
        ):
            return None
        edited_at = next(
            (
                at
                for at, wishes in reversed(self.diary.wishes)
                if wishes.plans.get(key[0]) != plan and not self.diary.was_undone(key[0], at)
            ),
            -math.inf,
        )
        if (plan.overlap is Overlap.SKIP and self._may_overlap(key, due)) or edited_at > due - self.diary.most_back():
            return None  # it was past when it was planned so, before the clock was set back
        if self.groups is not None and not self.groups.goes_at_once(plan, due - 90.0, end):
            return self.groups.chance(plan, key, due, due + 60.0 * minutes) if now > due + 60.0 * minutes else None
        robot = self.diary.names[
            self.diary.between(due, end)[-1].plans[key[0]].robot_id or 0
        ]  # another start may have it now
        shown = [
            at
            for at in self._times_shown(key[1])
            if not self.diary.is_clear(robot, at - 2.0, at + 600.0, but=("slow", "clock"))
        ]
        first = min([due, *shown])  # it may have been given up then, before the clock was set back
        back = self.diary.undone_until(key[0], due, end)
        for start, until in ((max(each, back), until) for each, until in self.diary.clear_spans(robot, due, end)):
            if until - start < self._together or self._gave_up(robot, first, start):
                continue
            others = self.diary.names.values() if self.diary.is_of_restored_time(key[1]) else ()
            if self.may_stay_uncertain(key[1]) or not all(self.diary.is_clear(other, start, until) for other in others):
                continue  # each has to say that it does not have it
            between = next(self.diary.others(key, key[1], key[1] + timedelta(seconds=start - due + 35.0)), None)
            if between is None or start == due:
                return start, until
        return None

    def may_stay_uncertain(self, planned_at: datetime) -> bool:
        """A robot that has lost its queue, or has an item that can't be read, never says that it does not have a start
        from before a restore. That start waits until its window is over (docs/reliability.md, 6)."""
        network = self.world.site.network
        cannot_say = network.unreadable or network.shown or any(self.diary.lost_items.values())
        return bool(cannot_say) and self.diary.is_of_restored_time(planned_at)

    def _gave_up(self, robot: str, due: float, start: float) -> bool:
        """Whether earlier faults may have used up its attempts or hidden their outcome."""
        nature = self.world.nature
        at_starts = sum(
            each.kind == "app" and due <= each.end <= start for each in self.diary.troubles
        )  # at each it is tried at once
        tries = sum(min(2.0**attempt, nature.poll_interval) for attempt in range(1, nature.retry_limit + 1 - at_starts))
        if nature.fleet != "normal" and start > due:
            return True
        is_over = any(self.diary.was_wrong(kind, robot, due, start) for kind in ("queue", "impostor"))
        return start - due > 0.6 * tries or (start > due and is_over)

    def _may_overlap(self, key: Key, due: float) -> bool:
        """Whether an earlier start of the schedule, moved or not, may have been open then."""
        plan = self.diary.now.plans[key[0]]
        minutes = GENERAL_WINDOW if plan.start_window_minutes is None else plan.start_window_minutes
        earlier = list(self.diary.others(key, key[1] - timedelta(hours=4), key[1] + MINUTE))
        for each in earlier:
            items = self._items_of.get(self.diary.token(each), [])
            if not items and self._true(each[1], due) + 60.0 * max(1, minutes) + 180 > due:
                return True
            if any(self._ended_before(found, due) < 120.0 + 2 * self.world.nature.poll_interval for found in items):
                return True
        plans = [plan, *(self.diary.now.plans[id_] for id_, _instant in earlier)]
        robots = frozenset[str]().union(*map(self.diary.robots_of, plans))
        return not all(self.diary.is_clear(name, due - 600.0, due) for name in robots)

    def _ended_before(self, found: Found, at: float) -> float:
        """For how long an item had ended then, in s; negative: it had not."""
        return -1.0 if found.item.finished is None else at - self._when(found, found.item.finished)

    def _when(self, found: Found, stamp: str) -> float:
        """The true time of what its robot wrote down, if the robot's clock has not been set since."""
        now = self.world.site.seconds()
        local = found.machine.clock.local(now * SPEED)
        return now - (local - datetime.fromisoformat(stamp)).total_seconds() / SPEED

    # ------------------------------------------------------------------ verdicts
    def _take_new_items(self) -> None:
        """Items are added to lists and never removed: only what is new is looked at."""
        for name, machine in [*self.world.site.machines.items(), *self.world.impostors]:
            machine.catch_up()
            is_of_site = self.world.site.machines.get(name) is machine
            lost = self.diary.lost_items[name] if is_of_site else []
            for items in (lost, self.world.site.queue(name) if is_of_site else machine.queue):
                _items, taken = self._taken.get(id(items), (items, 0))
                for item in itertools.islice(items, taken, None):
                    if item.description and id(item) not in self._known:
                        self._known.add(id(item))
                        self._items_of[item.description].append(Found(machine, name, item))
                        if len(self._items_of[item.description]) > 1:
                            self._copied[item.description] = None
                self._taken[id(items)] = items, len(items)

    def now_and_then(self) -> None:
        self._take_new_items()
        if self.world.nature.fleet != "forgetful":
            for token in self._copied:
                self._judge_copies(token, self._items_of[token])
        if self.world.nature.fleet == "forgetful":
            self._judge_numbers()
        self._judge_liveness(self._items_of.keys() | self._late)

    def _judge_numbers(self) -> None:
        """Where robots forget whose an item is: not more of a mission than there were starts of it. What a restored backup has forgotten
        is sent to them again (docs/reliability.md, Not shown)."""
        posts = self.world.site.network.submissions
        starts = {(post.robot, post.mission_id, post.token, self._restores_before(post.at)) for post in posts}
        starts_of = Counter((robot, mission) for robot, mission, _token, _restores in starts)
        late = Counter((post.robot, post.mission_id) for post in posts if post.fate is Fate.LATE)
        items_of = Counter((found.robot, found.item.mission_id) for items in self._items_of.values() for found in items)
        for key, number in items_of.items():
            if number > starts_of[key] + late[key] and not self.diary.excused:
                self.object(f"safety: more items with one token than starts: {key[0]} {number} for {starts_of[key]}")

    def _restores_before(self, at: float) -> int:
        return sum(each.at <= at for each in self.diary.restores)

    def _judge_copies(self, token: str, items: list[Found]) -> None:
        posts = [post for post in self.world.site.network.submissions if post.token == token]
        late = [
            post for post in posts if post.lands_at is not None and post.lands_at - post.at > self.world.nature.quiet_s
        ]
        shown = [f"{found.robot}#{found.item.id} {found.item.state}" for found in items]
        if token in self.diary.excused:
            return
        if len(items) > 1 + len(late):
            self.object(f"safety: {len(items)} items with one token: {token[:8]} {shown}")
            return
        ran = sorted((found for found in items if found.item.started is not None), key=lambda found: found.item.id)
        if self.world.keeps_history and any(self._could_be_cancelled(found, posts[0].at) for found in ran[1:]):
            self.object(f"safety: a second copy ran after it had waited: {token[:8]} {shown}")

    def _could_be_cancelled(self, copy: Found, first_sent: float) -> bool:
        """Whether it waited on its robot until after the next poll, with nothing wrong before it began. ``first_sent``: when its start was
        sent first. False where the app or the judge can't know: the app's row is not in a backup that was restored since, the robot's
        clock has been wrong since, or the diary has forgotten what was wrong."""
        now, patience = self.world.site.seconds(), self.world.nature.poll_interval + 20.0
        is_forgotten = self.world.was_restored_since(first_sent) or first_sent < now - KEPT_S
        if is_forgotten or self.diary.was_wrong("robot's clock", copy.robot, first_sent, now):
            return False
        came, began = self._when(copy, copy.item.ordered), self._when(copy, copy.item.started or "")
        return began - came > patience and self.diary.is_clear(copy.robot, began - patience, began, but=())

    def all_is_well(self, since: float) -> None:
        """Everything has been well for that long (s)."""
        self.now_and_then()
        self.truth.judge(since)

    def last_verdict(self) -> None:
        if self.groups is not None:
            self.groups.last_verdict()
        self.truth.count()

    def is_open(self, found: Found) -> bool:
        return found.item.state in (ItemState.PENDING, ItemState.EXECUTING, ItemState.ABORT)

    def _shown(self, key: Key) -> str:
        return f"#{key[0]} {key[1]:%d %H:%M}"
