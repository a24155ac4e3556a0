"""How rough a simulated world is, and what kind of site a seed draws."""

from __future__ import annotations

import random
from collections import Counter
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from types import MappingProxyType

from tests.support.targets import ROBOT

ACTS: Mapping[str, float] = MappingProxyType(
    {  # what people do, and how often in proportion
        "rename": 1,
        "change_window": 1,
        "change_battery": 1,
        "change_mission": 1,
        "change_overlap": 1,
        "move": 2,
        "other_robot": 1,
        "switch_schedule": 2,
        "switch_robot": 1,
        "delete": 2,
        "delete_mission": 0.3,
        "delete_robot": 0.3,
        "plan_once": 4,
        "plan_often": 1,
        "pause": 2,
        "resume": 2,
        "skip": 2,
        "move_start": 3,
        "hold": 2,
        "release": 2,
        "cancel": 3,
        "hold_start": 3,
        "clear": 1,
        "run_now": 3,
        "idle_rule": 1,
        "working_days": 1,
        "day_off": 0.5,
        "history_limit": 0.5,
        "import_plan": 1,
        "back_up": 0.7,
        "watch": 1,
        "confirm_clock": 1,
    }
)
GROUP_ACTS: Mapping[str, float] = MappingProxyType(
    {  # the same where robots form a group
        "join_or_leave": 2,
        "change_group": 1,
        "delete_group": 0.3,
        "assign_robot": 3,
        "start_on_another": 2,
        "run_on_any": 3,
        "plan_for_any": 4,
        "to_any": 1,
        "one_line": 0.5,
    }
)
EVENTS: Mapping[str, float] = MappingProxyType(
    {  # what happens, the same
        "outage": 3,
        "reboot": 0.5,
        "robot_pauses": 1,
        "mission_fails": 1,
        "low_battery": 1,
        "person_queues": 2,
        "person_cancels": 1,
        "very_late_request": 1,
        "slow_answers": 3,
        "lost_request": 2,
        "nap": 0.6,
        "small_step": 1,
        "medium_step": 0.5,
        "big_step": 0.5,
        "disk": 0.5,
        "poison": 0.5,
        "queue_is_reset": 0.15,
        "another_robot": 0.2,
        "wrong_clock": 0.3,
        "power_cut": 1,
        "restart": 0.5,
        "restore": 0.25,
    }
)

OF_ROBOTS = (
    "queue_is_reset",
    "another_robot",
    "wrong_clock",
)  # nothing like it happens to a fleet, or it has no clock to compare
OF_FLEETS: Mapping[str, float] = MappingProxyType({"fleet_restarts": 0.3, "no_contact": 1})  # what happens to fleets


# Without those that answer too late to be judged by the second, and that others use all the time.
DEVIANTS = (
    "forgets-descriptions",
    "renames-descriptions",
    "moves-descriptions",
    "no-id",
    "no-search",
    "pages-of-50",
    "ignores-sort",
    "german-texts",
    "german-states",
    "cancelled",
    "other-zone",
)
FORGETFUL = DEVIANTS[:3]


@dataclass(frozen=True)
class Profile:
    """``every_minutes``, ``poll_interval``: None: drawn by the seed. ``crash_rate`` is per step at which the app can die. ``rough_s`` and
    ``calm_s``: how long it is so by turns; in calm weather nothing happens but what people do."""

    every_minutes: int | None = None
    poll_interval: int | None = None
    fault_rate: float = 0.02
    crash_rate: float = 0.0006
    acts_per_hour: float = 15.0
    edits_undone: float = 0.3  # the part of edits of a schedule that are undone a moment later
    events_per_hour: float = 15.0
    rough_s: float = 3000.0
    calm_s: float = 1500.0
    longest_outage: float = 1500.0
    longest_off: float = 1500.0  # s that the tablet stays off after a crash, in one of five
    acts: Mapping[str, float] = field(default_factory=lambda: dict(ACTS))
    events: Mapping[str, float] = field(default_factory=lambda: dict(EVENTS))
    site: Mapping[str, object] = field(default_factory=dict)  # what the seed would draw otherwise
    groups: bool = False  # the robots are also a group
    target: str = ROBOT  # what takes the missions
    deviants: bool = (
        False  # some robots differ from the faithful one, with what a check-up has found of them or without
    )

    def only(self, acts: str = "", events: str = "", **values: object) -> Profile:
        """The same world with these acts and events alone, by their names, and no edit undone."""
        chosen = {"acts": dict.fromkeys(acts.split(), 1.0), "events": dict.fromkeys(events.split(), 1.0)}
        return Profile(**{**vars(self), "edits_undone": 0.0, **chosen, **values})  # type: ignore[arg-type]

    def with_groups(self) -> Profile:
        """The same world with starts for any of three to five robots in addition to those for one."""
        return replace(self, groups=True, acts={**self.acts, **(GROUP_ACTS if self.acts else {})})

    def through(self, target: str) -> Profile:
        """The same world with a fleet above its robots."""
        if target == ROBOT:
            return self
        events = {name: weight for name, weight in self.events.items() if name not in OF_ROBOTS}
        natures = {"fleet": "normal"} if target == "enterprise" else {}
        return replace(self, target=target, events={**events, **OF_FLEETS}, site={**natures, **self.site})


# Half as much as with one act and one event an hour, everything of it; crashes are as frequent.
CALM = Profile(every_minutes=60, poll_interval=600, acts_per_hour=0.5, events_per_hour=0.5, crash_rate=0.001)


@dataclass(frozen=True)
class Nature:
    """What a seed draws of a site."""

    robots: int
    every_minutes: int
    poll_interval: int
    with_window: bool
    history_limit: int | None
    retry_limit: int
    quiet_s: int
    zone: str
    fleet: str  # normal; forgetful: tokens are not given back; short lists: no search, oldest items only; deviant: some robots differ
    groups: bool = False
    deviants: Mapping[str, tuple[str, bool]] = field(
        default_factory=dict
    )  # by robot: how it differs, and whether it is checked up

    @classmethod
    def drawn(cls, rng: random.Random, profile: Profile) -> Nature:
        every, poll = rng.choice((3, 5, 10, 20)), rng.choice((10, 30, 60, 120))
        drawn = {
            "robots": rng.choice((1, 2, 3, 3, 4)),
            "every_minutes": profile.every_minutes or every,
            "poll_interval": profile.poll_interval or poll,
            "with_window": rng.random() < 0.35,
            "history_limit": rng.choice((1, 3, 20, 100, None, None, None, None)),
            "retry_limit": rng.choice((20, 20, 10, 3)),
            "quiet_s": rng.choice((90, 90, 90, 30)),
            "zone": rng.choice(("Europe/Helsinki", "UTC", "America/New_York")),
            "fleet": rng.choice(("normal",) * 8 + ("forgetful", "short lists")),
        }
        if profile.groups:
            drawn |= {"groups": True, "robots": rng.choice((3, 4, 5))}
        if profile.deviants:
            names = [f"R{number}" for number in range(1, int(str(drawn["robots"])) + 1)]
            deviants = {name: (rng.choice(DEVIANTS), rng.random() < 0.5) for name in names if rng.random() < 0.7}
            forgets = any(deviant in FORGETFUL for deviant, _is_known in deviants.values())
            drawn |= {"deviants": deviants, "fleet": "forgetful" if forgets else "deviant"}
        return cls(**{**drawn, **profile.site})  # type: ignore[arg-type]


@dataclass
class Findings:
    """What the run did, and every violation."""

    hours: float = 0.0
    occurrences: int = 0
    submissions: int = 0
    judged: int = 0  # starts that had to run, and did
    punctual: int = 0  # starts with nothing wrong
    absences: int = 0  # rows that stand for several missed starts
    crashes: int = 0
    steps: int = 0
    acts: Counter[str] = field(default_factory=Counter)
    faults: Counter[str] = field(default_factory=Counter)
    states: Counter[str] = field(default_factory=Counter)
    violations: list[str] = field(default_factory=list)

    def line(self, seed: int) -> str:
        verdict = "ok" if not self.violations else f"{len(self.violations)} VIOLATIONS"
        states = ", ".join(f"{name} {count}" for name, count in sorted(self.states.items()))
        return (
            f"seed {seed}: {self.hours:.0f} simulated hours, {self.occurrences} occurrences, {self.submissions} submissions, "
            f"{sum(self.faults.values())} faults, {sum(self.acts.values())} acts, {self.crashes} app crashes, {self.steps} steps; "
            f"{self.judged} had to run, {self.punctual} on time, {self.absences} absences counted again; {states}; verdict: {verdict}"
        )
