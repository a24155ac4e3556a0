"""Hours of operation in seconds: the real services, simulated robots, and everything that people do and that can go wrong, by one seed.

The app is killed between any two steps (before a commit, after it, before a request leaves, after the robot has it), requests meet every
fate of ``tests.support.network``, and ``operator`` and ``weather`` say what else there is. Rough and calm times take turns. ``oracles``
judges by the robots' own histories and by the ``diary``, never by the app's code.
"""

from __future__ import annotations

import random
import uuid
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from dataclasses import replace
from datetime import UTC, datetime, timedelta
from pathlib import Path
from typing import Any
from zoneinfo import ZoneInfo

from app.database.backups import restore
from app.database.errors import DatabaseError
from app.database.missions import StopRepository
from app.domain.models import Group, Overlap, Place, Schedule
from app.domain.robot import Spot, Stop
from app.services.catalogue import group_edit
from mir_sim import MISSIONS as MISSIONS_OF_ROBOTS
from mir_sim import SimulatedRobot, deviant
from mir_sim.missions import Mission
from mir_sim.world import MAP_GUID, STATIONS
from tests.simulation.diary import OVERLAPS, Diary, Manual, Restore
from tests.simulation.group_acts import GroupPerson
from tests.simulation.group_oracles import PLACE_FOR, SAMPLED_EVERY
from tests.simulation.operator import IDLE_MISSION, Person
from tests.simulation.oracles import Judge
from tests.simulation.profile import Findings, Nature, Profile
from tests.simulation.weather import SPEED, PowerOff, Weather
from tests.support.expected_findings import checked_up
from tests.support.network import HARMFUL, Fate, Network, Planned
from tests.support.site import GUIDS, Site

START = datetime(2026, 10, 24, 22, 0, tzinfo=UTC)  # a Saturday; the night of the autumn change in Europe comes first
MISSIONS = ("Deliver", "Wait at home", IDLE_MISSION)
CHUNK = 300.0  # s between verdicts
ATTENDED_EVERY = 900.0  # s
CHECKED_UP_EVERY = 120.0  # s
SETTLING = 660.0  # s of calm, after which everything has to be in order
FAULT_LASTS = 12.0  # s from a request that met one until the robot counts as well again


def stops_of(mission: Mission) -> list[Stop]:
    """As a robot would list them."""
    guids = [action.parameters.get("position") or action.parameters.get("marker") for action in mission.actions]
    there = [station for guid in guids for station in STATIONS if station.guid == guid]
    return [Stop(station.guid, station.name, Spot(MAP_GUID, station.pose.x, station.pose.y)) for station in there]


def shaky(write: Callable[..., Any], interrupt: Callable[[str], None]) -> Callable[..., Any]:
    """The database's ``write``, in front of and behind which the app may die."""

    def shaky_write(work: Callable[[Any], Any], patient: bool = False) -> Any:
        interrupt("before commit")
        result = write(work, patient)
        interrupt("after commit")
        return result

    return shaky_write


class World:
    def __init__(self, directory: Path, seed: int, profile: Profile | None = None) -> None:
        self.profile = profile or Profile()
        self.nature = Nature.drawn(random.Random(f"nature/{seed}"), self.profile)
        self.rng, self._crashes = random.Random(f"world/{seed}"), random.Random(f"crashes/{seed}")
        self.findings = Findings()
        self.is_on = self._armed = False
        self.is_calm = True
        self.keeps_history = self.nature.history_limit is None
        self.impostors: list[tuple[str, SimulatedRobot]] = []
        self.container_with_bad_disk: object = None
        network = Network(
            seed=seed,
            fates=(*HARMFUL, Fate.SLOW, Fate.SLOW, Fate.NOT_FOUND),
            interrupt=self._maybe_crash,
            met=self._met,
            others_wait=False,
            forgets_descriptions=self.nature.fleet == "forgetful" and not self.nature.deviants,
            short_lists=10 if self.nature.fleet == "short lists" else None,
        )
        self.site = Site(
            directory,
            robots=self.nature.robots,
            now=START,
            network=network,
            robot_speed=SPEED,
            with_window=self.nature.with_window,
            profiles={robot: deviant(name) for robot, (name, _is_known) in self.nature.deviants.items()},
            target=self.profile.target,
            token_field="" if network.forgets_descriptions else "description",
        )
        self.is_on = True
        install_id = str(
            uuid.UUID(int=random.Random(f"install/{seed}").getrandbits(128), version=4)
        )  # or tokens would be others in each run
        settings = self.site.container.repositories.settings
        self.site.container.db.write(lambda c: settings.put(c, "install_id", install_id))
        self.diary = Diary(install_id)
        self.person = (GroupPerson if self.nature.groups else Person)(self, random.Random(f"person/{seed}"))
        self.weather = Weather(self, random.Random(f"weather/{seed}"))
        self.judge = Judge(self)
        network.submitted = self.judge.posted
        self.missions: dict[int, str] = {}
        self._furnish()
        self.site.switched_on = self._make_shaky
        self._make_shaky()
        self._again(3600.0 / max(self.profile.acts_per_hour, 1e-9), self._act)
        self._again(3600.0 / max(self.profile.events_per_hour, 1e-9), self._strike)
        self.site.at(ATTENDED_EVERY, self._attend)
        if self.nature.deviants:
            self.site.at(CHECKED_UP_EVERY, self._check_up)

    def _check_up(self) -> None:
        """Robots that are checked up, and have answered; again those whose check-up was lost, as after a restore."""
        self.site.at(CHECKED_UP_EVERY, self._check_up)
        if not self.is_on:
            return
        with self.without_crash(), suppress(DatabaseError):  # a disk may fail
            for robot in self.site.container.repositories.robots.all(self.site.container.db.read()):
                name, is_known = self.nature.deviants.get(robot.name, ("", False))
                if (
                    is_known
                    and robot.known is None
                    and robot.serial_number
                    and robot.name not in self.site.network.impostors
                ):
                    self.site.check_up(robot, checked_up(name, robot.serial_number, robot.software))

    # ------------------------------------------------------------------ the plan
    def _furnish(self) -> None:
        site, nature = self.site, self.nature
        catalogue = site.container.catalogue
        catalogue.change_settings(
            poll_interval_seconds=nature.poll_interval,
            history_limit=nature.history_limit,
            timezone=nature.zone,
            retry_limit=nature.retry_limit,
            unknown_outcome_quiet_seconds=nature.quiet_s,
            working_days=self.diary.now.working_days,
        )
        for name in MISSIONS:
            mission = site.add_mission(name)
            self.missions[mission.id], self.diary.guids[mission.id] = name, mission.guid
        local = START.astimezone(ZoneInfo(nature.zone)).replace(tzinfo=None)
        deliver = next(iter(self.missions))
        for number, robot in enumerate(site.add_robots()):
            self.diary.names[robot.id] = robot.name
            first = local + timedelta(minutes=1 + number)
            overlap = self.rng.choice(OVERLAPS)
            self.plan(
                Schedule(
                    f"Often {robot.name}",
                    robot.id,
                    deliver,
                    first,
                    nature.zone,
                    f"FREQ=MINUTELY;INTERVAL={nature.every_minutes}",
                    overlap=overlap,
                    start_window_minutes=self.rng.choice((2, 8, 8, None, 60)),
                )
            )
            self.plan(
                Schedule(
                    f"Nightly {robot.name}",
                    robot.id,
                    deliver,
                    first.replace(hour=3, minute=30),
                    nature.zone,
                    "FREQ=DAILY",
                    priority=5,
                )
            )
            self.plan(
                Schedule(
                    f"Weekly {robot.name}",
                    robot.id,
                    deliver,
                    first.replace(minute=45),
                    nature.zone,
                    "FREQ=WEEKLY;BYDAY=SA,SU,MO",
                    minimum_battery_percent=30,
                    start_window_minutes=120,
                )
            )

        if nature.groups:
            self._form_group()

    def plan(self, schedule: Schedule) -> None:
        """A new schedule, as people want it from now on."""
        with self.without_crash():
            saved = self.site.container.catalogue.save_schedule(schedule)
        self.diary.decide(self.site.seconds()).plans[saved.id] = replace(schedule, id=saved.id)
        self.diary.ids.add(saved.id)

    def manual(self, robot: str, mission_id: int, group_id: int | None = None) -> Manual:
        return Manual(robot, self.diary.guids[mission_id], self.site.clock.now(), group_id)

    def _form_group(self) -> None:
        """All robots or all but one, starts for any of them, and a place for two of one mission."""
        site, nature, catalogue = self.site, self.nature, self.site.container.catalogue
        ids = sorted(self.diary.names)
        members = ids[: self.rng.choice((len(ids), max(3, len(ids) - 1)))]
        group = catalogue.save_group(Group("Hall", tuple(members)))
        wishes = self.diary.decide(site.seconds())
        wishes.groups[group.id] = frozenset(self.diary.names[key] for key in members)
        deliver, other, _home = self.missions
        catalogue.edit(lambda edit: group_edit.save_place(edit, Place("Dock", PLACE_FOR, (other,))))
        site.container.db.write(
            lambda c: StopRepository().keep(c, {mission.guid: stops_of(mission) for mission in MISSIONS_OF_ROBOTS})
        )
        local = START.astimezone(ZoneInfo(nature.zone)).replace(tzinfo=None)
        minutes, are_equal = (
            self.rng.choice((2, 3, 5)) * (10 if nature.every_minutes >= 60 else 1),
            self.rng.random() < 0.5,
        )
        kinds = (*("burst",) * (len(ids) + 3), "dock", "dock", "dock", "one by one", "one by one")
        for number, kind in enumerate(kinds):
            self.plan(
                Schedule(
                    f"Any {kind} {number}",
                    None,
                    other if kind == "dock" else deliver,
                    local + timedelta(minutes=3 if kind == "burst" else 2),
                    nature.zone,
                    f"FREQ=MINUTELY;INTERVAL={minutes}",
                    group_id=group.id,
                    overlap=Overlap.PARALLEL if kind == "burst" else self.rng.choice(OVERLAPS),
                    priority=2 if are_equal or kind == "dock" else self.rng.choice((-1, 0, 0, 1, 2)),
                    start_window_minutes=self.rng.choice((2, 8, 15, 60)),
                )
            )
        self.site.at(SAMPLED_EVERY, self._sample)

    def _sample(self) -> None:
        if self.judge.groups is not None:
            self.judge.groups.sample()
            self.site.at(SAMPLED_EVERY, self._sample)

    @property
    def idle_guid(self) -> str:
        return GUIDS[IDLE_MISSION]

    # ------------------------------------------------------------------ what comes again and again
    def _again(self, mean: float, what: Callable[[], None]) -> None:
        def happen() -> None:
            self.site.at(self.rng.expovariate(1 / mean), happen)
            what()

        self.site.at(self.rng.expovariate(1 / mean), happen)

    def _act(self) -> None:
        if self.profile.acts and self.is_on:
            self.person.do(self.rng.choices(*zip(*self.profile.acts.items(), strict=True))[0])  # type: ignore[arg-type]
            if not self.is_calm:
                self._maybe_crash("after an act")

    def _strike(self) -> None:
        if self.profile.events and not self.is_calm:
            self.weather.strike(self.rng.choices(*zip(*self.profile.events.items(), strict=True))[0])  # type: ignore[arg-type]

    def _attend(self) -> None:
        self.weather.attend()
        self.site.at(ATTENDED_EVERY, self._attend)

    def _met(self, robot: str, planned: Planned) -> None:
        if planned.fate is Fate.SLOW:
            self.diary.begin("slow", None, self.site.seconds(), (planned.seconds or 0.0) + 1.0)
        elif planned.fate is not Fate.REFUSED or robot not in self.site.network.down:
            who = None if self.site.fleet else robot  # an answer about all of a fleet's robots serves all of them
            self.diary.begin("network", who, self.site.seconds(), FAULT_LASTS)
            self.diary.begin("slow", None, self.site.seconds(), 6.0)

    def note_holds(self) -> None:
        """What a person holds, for how long it will be so as the tablet's clock goes now."""
        now, wall = self.site.seconds(), self.site.clock.now()
        for trouble in self.diary.troubles:
            if trouble.kind == "hold":
                trouble.end = min(trouble.end, now + 2.0)
        for robot, until in self.diary.now.holds.items():
            left = float("inf") if until is None else (until - wall).total_seconds()
            if left > 0:
                self.diary.begin("hold", robot, now, left + 3.0)

    # ------------------------------------------------------------------ crashes
    @contextmanager
    def without_crash(self) -> Iterator[None]:
        before, self._armed = self._armed, False
        try:
            yield
        finally:
            self._armed = before

    def _make_shaky(self) -> None:
        db = self.site.container.db
        db.write = shaky(db.write, self._maybe_crash)

    def _maybe_crash(self, where: str) -> None:
        self.findings.steps += 1
        if self._armed and self._crashes.random() < self.profile.crash_rate:
            raise PowerOff("cut")

    def _off(self, how: str) -> None:
        """Power is back after a while; the start itself may be cut short too."""
        trouble = self.diary.begin("app", None, self.site.seconds())
        while True:
            self.findings.crashes += how == "cut"
            self.is_on = False
            self._switch_off(how)
            self.site.stay_off(self.rng.uniform(1, self.profile.longest_off if self.rng.random() < 0.2 else 60))
            try:
                if how == "restore":
                    self._restore(trouble.start)
                self.site.switch_on()
            except PowerOff as off:
                how = off.how
                continue
            break
        self.is_on = True
        self.judge.came_back(trouble.start)
        trouble.end = self.site.seconds() + 5.0

    def _switch_off(self, how: str) -> None:
        try:
            with self.without_crash():
                self.site.switch_off(cleanly=how != "cut")
        except DatabaseError:
            self.site.container.db.close()

    def _restore(self, left_at: float) -> None:
        file, made_at, wishes = self.person.backups[-1]
        at, wall = self.site.seconds(), self.site.clock.now()
        restore(file, self.site.container.db.path, wall)
        made = wall - timedelta(seconds=at - made_at + max(0.0, self.diary.ahead(at) - self.diary.ahead(made_at)))
        # the clock may have been set back since the backup: the plan had gone on up to the latest time that it has shown
        moments = [left_at, *(since - 0.001 for since, _ahead in self.diary.clock if made_at < since <= left_at)]
        shown = max(
            wall - timedelta(seconds=at - each + self.diary.ahead(at) - self.diary.ahead(each)) for each in moments
        )
        self.diary.restores.append(Restore(at, made, max(wall, shown)))
        self.diary.wishes.append((self.site.seconds(), wishes.copy()))
        self.note_holds()

    def was_restored_since(self, true_time: float) -> bool:
        return any(each.at >= true_time for each in self.diary.restores)

    def woke_up(self, seconds: float) -> None:
        self.judge.came_back(self.site.seconds() - seconds)

    # ------------------------------------------------------------------ running
    def run(self, hours: float, stop_at: str | None = None) -> Findings:
        """``stop_at``: end as soon as there is a violation with that word in it."""
        end = self.site.seconds() + hours * 3600
        while self.site.seconds() < end - 0.01 and not self._is_found(stop_at):
            self._rough(min(self.profile.rough_s, end - self.site.seconds()), stop_at)
            if self.profile.calm_s and not self._is_found(stop_at):
                self._calm(self.profile.calm_s, stop_at)
        if not self._is_found(stop_at):
            self._calm(2 * SETTLING, stop_at)
        self.findings.hours = self.site.seconds() / 3600
        self.findings.faults.update(self.site.network.counts)
        self.judge.last_verdict()
        self.site.container.db.close()
        return self.findings

    def _is_found(self, stop_at: str | None) -> bool:
        return stop_at is not None and any(stop_at in problem for problem in self.findings.violations)

    def _rough(self, seconds: float, stop_at: str | None) -> None:
        self.is_calm, self._armed, self.site.network.rate = False, True, self.profile.fault_rate
        self._pass(seconds, stop_at)

    def _calm(self, seconds: float, stop_at: str | None) -> None:
        self.is_calm, self._armed, self.site.network.rate = True, False, 0.0
        self.weather.clear_up()
        self._pass(seconds, stop_at)
        if not self._is_found(stop_at):
            self.judge.all_is_well(SETTLING)

    def _pass(self, seconds: float, stop_at: str | None) -> None:
        end = self.site.seconds() + seconds
        while (left := end - self.site.seconds()) > 0.01 and not self._is_found(stop_at):
            try:
                self.site.run(min(CHUNK, left))
            except PowerOff as off:
                self._off(off.how)
            self.judge.now_and_then()
            self.diary.forget(self.site.seconds())
