"""The tablet's own troubles, each an alarm while it lasts: its disk nearly full, its clock set by no time server, its battery nearly empty,
its network gone."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from datetime import datetime, timedelta
from typing import Any

from app.domain.clock import Clock
from app.domain.models import Connection
from app.services.live.alarms import Alarms
from app.services.live.snapshots import Snapshots
from app.services.live.tablet import Tablet

MB = 1024 * 1024
LEAST_ROOM = 300 * MB  # for log files and exports
COPIES = 3  # of the database: a backup, one more during a restore, and a month of history
ROOM_AGAIN = 1.25  # times the room needed, from which on there is enough again
BATTERY_LOW, BATTERY_GOOD = 15.0, 20.0  # %; up to the first it is low, above the second no longer
AN_ANSWER_MAY_BE_UNDER_WAY = timedelta(seconds=5)  # when the network goes
OTHERS_EVERY = 10.0  # s; the network is looked at every time
KEY = "tablet"  # of these alarms

Details = Mapping[str, Any]


@dataclass(frozen=True)
class Battery:
    percent: float
    is_charging: bool


@dataclass(frozen=True)
class Room:
    """In bytes: free on the disk of the data directory, and the size of the database."""

    free: int
    database: int


@dataclass(frozen=True)
class Readings:
    """What the system says of the tablet; None where it can't know."""

    room: Callable[[], Room | None]
    is_clock_synchronised: Callable[[], bool | None]
    battery: Callable[[], Battery | None]
    has_network: Callable[[], bool | None]


class Trouble:
    """An alarm that comes when its cause has lasted ``comes_after`` s, and ends when the cause has been over for ``goes_after`` s. ``find``
    returns the details while there is a cause; it gets whether the alarm is on."""

    def __init__(
        self,
        alarms: Alarms,
        code: str,
        find: Callable[[bool], Details | None],
        comes_after: float,
        goes_after: float,
        key: str = KEY,
    ) -> None:
        self.is_on: bool | None = None  # None: there may be an alarm of an earlier run
        self._alarms, self._code, self._find, self._key = alarms, code, find, key
        self._comes_after, self._goes_after = comes_after, goes_after
        self._was_found: bool | None = None
        self._since = 0.0  # when the cause came or went last
        self._details: Details | None = None  # of the alarm

    def look(self, monotonic: float) -> None:
        """``monotonic``: now, in s."""
        details = self._find(bool(self.is_on))
        is_found = details is not None
        if is_found is not self._was_found:
            self._was_found, self._since = is_found, monotonic
        lasted = monotonic - self._since
        if details is not None and details != self._details and (self.is_on or lasted >= self._comes_after):
            self._alarms.raise_(self._code, self._key, **details)
            self._details, self.is_on = details, True
        elif details is None and self.is_on is not False and lasted >= self._goes_after:
            self._alarms.clear(self._code, self._key)
            self._details, self.is_on = None, False


class TabletTroubles:
    """A chore. While the network is gone, ``tablet.has_no_network`` says so, and robots that don't answer get no alarm of their own.
    ``robots``: ids of those that are asked."""

    def __init__(
        self,
        readings: Readings,
        *,
        clock: Clock,
        alarms: Alarms,
        snapshots: Snapshots,
        tablet: Tablet,
        robots: Callable[[], Sequence[int]],
    ) -> None:
        self._readings, self._clock, self._snapshots, self._tablet = readings, clock, snapshots, tablet
        self._robots = robots
        self._network_lost_at: datetime | None = None
        self._network = Trouble(alarms, "network_lost", self._no_network, 10, 10)
        self._others = (
            Trouble(alarms, "disk_nearly_full", self._little_room, 10, 60),
            Trouble(alarms, "clock_not_synchronised", self._clock_on_its_own, 900, 0),  # after a boot it takes a while
            Trouble(alarms, "tablet_battery_low", self._low_battery, 30, 30),
        )
        self._others_at = -math.inf

    def tick(self) -> None:
        monotonic = self._clock.monotonic()
        self._network.look(monotonic)
        self._tablet.has_no_network = bool(self._network.is_on) or self._is_cut_off
        if monotonic - self._others_at >= OTHERS_EVERY:
            self._others_at = monotonic
            for trouble in self._others:
                trouble.look(monotonic)

    # ------------------------------------------------------------------ the network
    def _no_network(self, _is_on: bool) -> Details | None:
        """No route, and a robot that was asked does not answer."""
        if self._readings.has_network() is not False:
            self._network_lost_at = None
        elif self._network_lost_at is None:
            self._network_lost_at = self._clock.now()
        silent = any(self._snapshots.get(robot).connection is Connection.UNREACHABLE for robot in self._robots())
        return {} if silent and self._is_cut_off else None

    @property
    def _is_cut_off(self) -> bool:
        """No route, and no robot has answered since: one of the demo does."""
        lost_at = self._network_lost_at
        return lost_at is not None and all(
            read_at is None or read_at <= lost_at + AN_ANSWER_MAY_BE_UNDER_WAY
            for read_at in (self._snapshots.get(robot).read_at for robot in self._robots())
        )

    # ------------------------------------------------------------------ the others
    def _little_room(self, is_on: bool) -> Details | None:
        room = self._readings.room()
        if room is None:
            return None
        needed = LEAST_ROOM + COPIES * room.database
        return {"free": room.free // MB // 10 * 10} if room.free < needed * (ROOM_AGAIN if is_on else 1) else None

    def _clock_on_its_own(self, _is_on: bool) -> Details | None:
        return {} if self._readings.is_clock_synchronised() is False else None

    def _low_battery(self, is_on: bool) -> Details | None:
        battery = self._readings.battery()
        if battery is None or battery.is_charging or battery.percent > (BATTERY_GOOD if is_on else BATTERY_LOW):
            return None
        return {"percent": round(battery.percent)}
