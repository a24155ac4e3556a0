"""What happens to robots, network, tablet and disk, drawn by the seed; each time in which something was wrong goes into the diary."""

from __future__ import annotations

import random
from collections.abc import Callable
from typing import TYPE_CHECKING

from app.database.errors import DatabaseError
from mir_sim import SimulatedRobot
from mir_sim.mission_queue import MissionQueue
from tests.simulation.diary import Trouble
from tests.support.network import QUEUE, Fate
from tests.support.targets import OrderItem, number_in_paths

if TYPE_CHECKING:
    from tests.simulation.world import World

SPEED = 16.0  # of the robots against the tablet
FULL, LOW, FLAT = 90.0, 40.0, 10.0  # %; below the second some schedules don't start
WRONG_CLOCK_S = 600.0  # from here on the tablet's clock counts as wrong
YEAR = 365 * 86400.0


class PowerOff(BaseException):
    """The app ends here: ``how`` is "cut", "clean" or "restore"."""

    def __init__(self, how: str) -> None:
        self.how = how


class Weather:
    def __init__(self, world: World, rng: random.Random) -> None:
        self.world, self.rng, self.diary = world, rng, world.diary
        self._cures: list[Callable[[], None]] = []  # of what lasts
        self._charged_at = 0.0

    def strike(self, name: str) -> None:
        self.world.findings.faults[name] += 1
        getattr(self, name)()

    def clear_up(self) -> None:
        """Everything that lasts ends now."""
        cures, self._cures = self._cures, []
        for cure in cures:
            cure()
        self.world.site.network.planned.clear()
        self.attend(but_flat=False)

    # ------------------------------------------------------------------ helpers
    def _name(self) -> str:
        return self.rng.choice(list(self.world.site.machines))

    def _machine(self, name: str) -> SimulatedRobot:
        machine = self.world.site.machines[name]
        machine.catch_up()
        return machine

    def _trouble(self, kind: str, robot: str | None, seconds: float = float("inf")) -> Trouble:
        return self.diary.begin(kind, robot, self.world.site.seconds(), seconds)

    def _lasts(self, seconds: float, trouble: Trouble, cure: Callable[[], object], recovery: float = 0.0) -> None:
        """It ends then, or when everything clears up."""

        def end() -> None:
            if end in self._cures:
                self._cures.remove(end)
            if trouble.end == float("inf"):
                cure()
                trouble.end = self.world.site.seconds() + recovery

        self._cures.append(end)
        self.world.site.at(seconds, end)

    # ------------------------------------------------------------------ the network
    def outage(self) -> None:
        name, site = self._name(), self.world.site
        down, names = site.network.down, {*site.machines} if site.fleet else {name}
        if name in down:
            return
        down |= names
        self._lasts(
            self.rng.uniform(5, self.world.profile.longest_outage),
            self._trouble("network", None if site.fleet else name),
            lambda: down.difference_update(names),
        )

    def very_late_request(self) -> None:
        self.world.site.network.next("POST", QUEUE, Fate.LATE, self.rng.uniform(60, 700), robot=self._name())

    def lost_request(self) -> None:
        fate = self.rng.choice((Fate.LOST, Fate.ANSWER_LOST, Fate.ERROR_AFTER, Fate.LATE, Fate.CUT))
        self.world.site.network.next("POST", QUEUE, fate, self.rng.uniform(5, 80), robot=self._name())

    def slow_answers(self) -> None:
        self.world.site.network.next(
            self.rng.choice(("*", "GET", "POST")),
            "*",
            Fate.SLOW,
            self.rng.uniform(1, 9),
            robot=self._name(),
            count=self.rng.randrange(1, 5),
        )

    # ------------------------------------------------------------------ robots
    def reboot(self) -> None:
        name, lasts = self._name(), self.rng.uniform(10, 90)
        self._machine(name).reboot(lasts * SPEED)
        self._trouble("robot", name, lasts + 10)

    def fleet_restarts(self) -> None:
        """Its robots continue; it remembers what waits."""
        fleet, lasts = self.world.site.fleet, self.rng.uniform(10, 300)
        fleet.catch_up()
        fleet.restart(lasts * SPEED)
        for name in self.world.site.machines:
            self._trouble("robot", name, lasts + 15)

    def no_contact(self) -> None:
        """The fleet hears nothing of a robot, which continues."""
        fleet, name = self.world.site.fleet, self._name()
        cut_off = {each.robot.name for each in fleet.vehicles if not each.has_contact}
        if name in cut_off:
            return
        fleet.catch_up()
        fleet.cut_off({*cut_off, name})

        def cure() -> None:
            fleet.cut_off({each.robot.name for each in fleet.vehicles if not each.has_contact} - {name})

        self._lasts(self.rng.uniform(20, 1500), self._trouble("robot", name), cure, 15.0)

    def robot_pauses(self) -> None:
        self._machine(self._name()).pause()

    def mission_fails(self) -> None:
        self._machine(self._name()).fail_next = "Failed to reach goal position 'Line 1'"

    def low_battery(self) -> None:
        name = self._name()
        if self.diary.was_wrong("battery", name, self.world.site.seconds(), float("inf")):
            return
        self._machine(name).set_battery(FLAT)
        self._lasts(
            self.rng.uniform(60, 2400),
            self._trouble("battery", name),
            lambda: self._machine(name).set_battery(FULL),
            5.0,
        )

    def attend(self, but_flat: bool = True) -> None:
        """A person on the floor: clears errors, resumes robots, plugs them in. He comes by the tablet's clock, which
        stops while it sleeps, so that batteries may have been low for hours."""
        now, charged_at = self.world.site.seconds(), self._charged_at
        self._charged_at = now
        flat = {each.robot for each in self.diary.troubles if each.kind == "battery" and each.end == float("inf")}
        for name in self.world.site.machines:
            machine = self._machine(name)
            machine.clear_errors()
            machine.resume()
            if name not in flat or not but_flat:
                if machine.battery.at(machine.now) < LOW:
                    self.diary.begin("battery", name, charged_at, now + 5.0 - charged_at)
                machine.set_battery(FULL)

    def person_queues(self) -> None:
        """At a fleet, or at its robot itself, which the fleet does not show."""
        site = self.world.site
        for _ in range(self.rng.randrange(1, 4)):
            mission, robot = self.rng.choice(list(self.world.missions.values())), self._name()
            site.stranger_queues(mission, robot, at_robot=site.fleet is not None and self.rng.random() < 0.5)

    def person_cancels(self) -> None:
        machine = self._machine(self._name())
        items = [item for item in machine.queue if item.finished is None]
        if items:
            machine.cancel(self.rng.choice(items))

    def poison(self) -> None:
        """One of the newest items can't be read for a while."""
        site = self.world.site
        name, network = self._name(), site.network
        items = [item for item in site.queue(name) if site.fleet is None or isinstance(item, OrderItem)][-3:]
        if not items:
            return
        item = self.rng.choice(items)
        place = (name, number_in_paths(item))
        self.diary.excused[item.description] = "it could not be read"
        if self.rng.random() < 0.5:
            network.unreadable.add(place)
        else:
            network.shown[place] = {"state": None}

        def cure() -> None:
            network.unreadable.discard(place)
            network.shown.pop(place, None)

        if self.rng.random() < 0.5:
            self._lasts(self.rng.uniform(20, 1500), self._trouble("slow", name), cure)
        else:  # however calm it is
            site.at(self.rng.uniform(2000, 6000), cure)

    def queue_is_reset(self) -> None:
        """The robot's database is reset: its queue and its history are lost, and with them what could not be read."""
        name, network = self._name(), self.world.site.network
        machine = self._machine(name)
        machine.cancel_all()
        machine.controller.finish_abort()
        self.diary.lost_items[name] += list(machine.queue)
        for item in machine.queue:
            self.diary.excused[item.description] = "the queue was reset"
        for post in network.posts(name)[-10:]:
            self.diary.excused[post.token] = "the queue was reset"
        machine.queue = MissionQueue()
        for place in [place for place in (*network.unreadable, *network.shown) if place[0] == name]:
            network.unreadable.discard(place)
            network.shown.pop(place, None)
        self.diary.begin("queue", name, self.world.site.seconds() - 15000.0, 15300.0)

    def another_robot(self) -> None:
        """For a while another machine answers at the address."""
        name, site = self._name(), self.world.site
        if name in site.network.impostors:
            return
        other = SimulatedRobot(
            f"X{self.rng.randrange(1000)}",
            seed=self.rng.randrange(10**6),
            clock=lambda: site.seconds() * SPEED,
            start=site.machines[name].clock.start,
            battery=FULL,
        )
        site.network.impostors[name] = other
        self.world.impostors.append((name, other))

        def cure() -> None:
            del site.network.impostors[name]

        trouble = self._trouble("impostor", name)
        trouble.start -= 15000.0  # what was due before ends as "wrong robot" too
        self._lasts(self.rng.uniform(20, 600), trouble, cure, 5.0)

    def wrong_clock(self) -> None:
        """One of at least three robots has another time."""
        if len(self.world.site.machines) < 3 or self.diary.was_wrong(
            "robot's clock", None, self.world.site.seconds(), float("inf")
        ):
            return
        name = self._name()
        clock = self._machine(name).clock
        by = self.rng.choice((-YEAR, YEAR, 7200.0, -3600.0))
        clock.offset += by

        def cure() -> None:
            clock.offset -= by

        self._lasts(self.rng.uniform(300, 3000), self._trouble("robot's clock", name), cure)

    # ------------------------------------------------------------------ the tablet
    def nap(self) -> None:
        if self.world.is_on:
            seconds = self.rng.choice((3.0, 45.0, 300.0, 3000.0)) * self.rng.uniform(0.5, 1.5)
            self._trouble("app", None, seconds + 5.0)
            self.world.site.suspend(seconds)
            self.world.woke_up(seconds)

    def small_step(self) -> None:
        """Corrections by a time server; the shift stays small."""
        self._step(self.rng.uniform(-45, 45) - self.diary.ahead(self.world.site.seconds()), 5.0)

    def medium_step(self) -> None:
        self._step(self.rng.uniform(-540, 540) - self.diary.ahead(self.world.site.seconds()), 60.0)

    def big_step(self) -> None:
        """From 20 minutes to years, and back after a while."""
        sign = self.rng.choice((1, 1, -1))
        by = sign * self.rng.choice((1200.0, 7200.0, 86400.0, 3 * 86400.0, YEAR, 10 * YEAR)) * self.rng.uniform(1, 1.2)
        back = self.diary.ahead(self.world.site.seconds())
        if abs(back) > WRONG_CLOCK_S:
            return
        trouble = self._trouble("clock", None)
        self._step(by, 5.0)
        self._lasts(
            self.rng.choice((0.5, 20.0, 60.0, 600.0, 1800.0)),
            trouble,
            lambda: self._step(back - self.diary.ahead(self.world.site.seconds()), 60.0),
            60.0,
        )

    def _step(self, by: float, trouble: float) -> None:
        now = self.world.site.seconds()
        self._trouble("clock", None, trouble)
        self.world.site.clock.step(by)
        self.diary.clock.append((now, self.diary.ahead(now) + by))
        self.diary.come_again(now, self.world.site.clock.now())
        self.world.note_holds()

    def disk(self) -> None:
        """Full or read-only for a while, or until the app starts again."""
        site = self.world.site
        if not self.world.is_on or self.world.container_with_bad_disk is site.container:
            return
        try:
            with self.world.without_crash():
                mend = self.rng.choice((site.make_read_only, site.fill_disk))()
        except DatabaseError:
            return
        container = self.world.container_with_bad_disk = site.container

        def cure() -> None:
            if site.container is container and self.world.is_on:
                mend()
            self.world.container_with_bad_disk = None

        self._lasts(self.rng.uniform(3, 400), self._trouble("disk", None), cure, 15.0)

    def power_cut(self) -> None:
        if self.world.is_on:
            raise PowerOff("cut")

    def restart(self) -> None:
        if self.world.is_on:
            raise PowerOff("clean")

    def restore(self) -> None:
        if self.world.is_on and self.world.person.backups:
            raise PowerOff("restore")
