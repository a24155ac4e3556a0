"""What the page All robots asks the database: how long runs usually take, and since when robots need a person."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from datetime import datetime, timedelta

from app.domain.activity import NO_DATA
from app.domain.execution import DurationEstimate, Execution
from app.screens.common.alarms_view import id_in
from app.screens.common.shell import Shell
from app.screens.common.view_model import Refresher
from app.screens.home.facts import HomeServices

LOOKED_BACK = timedelta(hours=24)  # for when a robot stopped or was paused
HELD_UP = ("paused", "error")  # activities
ALARMS = ("robot_error", "emergency_stop", "question")  # of a robot that needs a person since then


class Known:
    """Asks once for each, in the background, as the database takes its time. ``learnt()`` when there is something new."""

    def __init__(self, services: HomeServices, shell: Shell, learnt: Callable[[], object]) -> None:
        self._services, self._learnt = services, learnt
        self._usual: dict[int, DurationEstimate | None] = {}  # by execution; None: unknown
        self._since: dict[int, datetime | None] = {}  # by robot; None: unknown
        self._runs: dict[int, Execution] = {}  # to be learnt, as
        self._robots: set[int] = set()
        self._reader = Refresher(shell, self._reading, self._take, lambda _problem: None)

    def open(self) -> Callable[[], None]:
        """The robots were not looked at for a while. Returns what ends it."""
        self._since = {}
        return self._reader.start()

    def keep_runs(self, open_ones: set[int]) -> None:
        self._usual = {number: usual for number, usual in self._usual.items() if number in open_ones}

    def usual(self, run: Execution) -> DurationEstimate | None:
        """How long it usually takes, as far as it is known."""
        if run.id not in self._usual:
            self._runs[run.id] = run
            self._reader.request()
        return self._usual.get(run.id)

    def since(self, robot_id: int) -> datetime | None:
        """Since when it needs a person, as far as it is known."""
        if robot_id not in self._since:
            self._robots.add(robot_id)
            self._reader.request()
        return self._since.get(robot_id)

    def began(self, robot_id: int, at: datetime) -> None:
        """It was seen to need a person from then on."""
        self._since[robot_id] = at

    def ended(self, robot_id: int) -> None:
        self._since.pop(robot_id, None)

    def ask_again(self) -> None:
        """What is not known: an alarm is stored after its robot was seen."""
        self._robots |= {robot_id for robot_id, since in self._since.items() if since is None}
        if self._robots:
            self._reader.request()

    def _reading(self) -> Callable[[], tuple[dict[int, DurationEstimate | None], dict[int, datetime | None]]]:
        services, runs, robots = self._services, self._runs, self._robots
        self._runs, self._robots = {}, set()
        return lambda: (_usual(services, runs), _since_when(services, robots) if robots else {})

    def _take(self, found: tuple[dict[int, DurationEstimate | None], dict[int, datetime | None]]) -> None:
        self._usual |= found[0]
        self._since |= {robot_id: since for robot_id, since in found[1].items() if not self._since.get(robot_id)}
        self._learnt()


def _usual(services: HomeServices, runs: Mapping[int, Execution]) -> dict[int, DurationEstimate | None]:
    """Off the UI thread."""
    return {number: services.history.expected(run.robot_id or 0, run.mission_guid) for number, run in runs.items()}


def _since_when(services: HomeServices, robots: set[int]) -> dict[int, datetime | None]:
    """Off the UI thread: when these robots began to need a person, as far as that was stored."""
    found: dict[int, datetime | None] = dict.fromkeys(robots)
    now = services.clock.now()
    for line in services.robot_states.timelines(now - LOOKED_BACK, now, list(robots)):
        last = next((span for span in reversed(line.spans) if span.activity != NO_DATA), None)
        if last is not None and last.activity in HELD_UP and last.start > now - LOOKED_BACK:
            found[line.robot_id] = last.start
    for alarm in services.alarms.open():
        robot = id_in(alarm.key, "robot")
        if robot in robots and alarm.code in ALARMS and alarm.cleared_at is None:
            found[robot] = alarm.last_at or alarm.raised_at
    return found
