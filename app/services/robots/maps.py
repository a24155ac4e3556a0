"""The maps of the robots: read from the robot, kept in memory and next to the database, so that an absent robot still
has its map.

``known`` answers at once; ``learn`` reads files and talks to the robot, with a client of its own, and belongs on a
background thread: no robot worker waits for a picture. Callers that show maps call ``learn`` whenever one ``is_due``:
at most once a minute for a robot, with any number of maps.
"""

from __future__ import annotations

import hashlib
import logging
import threading
from collections import OrderedDict
from collections.abc import Callable
from contextlib import closing, suppress
from pathlib import Path

from app.database.files import DIRECTORY_MODE, write_whole
from app.domain.clock import Clock
from app.domain.models import InvalidInput, Robot
from app.domain.robot import MapPosition
from app.mir.errors import RobotError, Unreadable
from app.mir.target import Target
from app.services.robots.map_picture import MapPicture, from_bytes, picture_of, to_bytes

log = logging.getLogger(__name__)

REFRESH_AFTER = 3600.0  # s after which a map is read again: it may have been edited under the same guid
ASK_EVERY = 60.0  # s between two questions to one robot, for any answer and map
MOST_IN_MEMORY = 8
MOST_FILES = MOST_POSTPONED = 64
LARGEST_FILE = 4 * 1024 * 1024  # bytes

Key = tuple[int, str]  # robot, guid of its map


class RobotMaps:
    """``directory`` is made when the first map is stored; ``robot`` finds a configured robot by id, ``make_client``
    connects to it."""

    def __init__(
        self,
        directory: Path,
        robot: Callable[[int], Robot | None],
        make_client: Callable[[Robot], Target],
        clock: Clock,
    ) -> None:
        self._directory, self._robot, self._make_client, self._clock = directory, robot, make_client, clock
        self._lock = threading.Lock()
        self._pictures: OrderedDict[Key, MapPicture] = OrderedDict()
        self._due_at: dict[Key, float] = {}  # of maps, and of robots, the earliest time
        self._ask_at: dict[int, float] = {}
        self._warned: set[int] = set()  # robots

    def known(self, robot_id: int, map_id: str) -> MapPicture | None:
        with self._lock:
            picture = self._pictures.get((robot_id, map_id))
            if picture is not None:
                self._pictures.move_to_end((robot_id, map_id))
            return picture

    def is_due(self, robot_id: int, map_id: str) -> bool:
        """Whether ``learn`` may bring something new."""
        with self._lock:
            now = self._clock.monotonic()
            return now >= self._ask_at.get(robot_id, now) and now >= self._due_at.get((robot_id, map_id), now)

    def learn(self, robot_id: int, map_id: str) -> MapPicture | None:
        """The stored map, if it is not in memory yet; else the robot's answer. None without either."""
        key, robot = (robot_id, map_id), self._robot(robot_id)
        with self._lock:
            self._ask_at[robot_id] = self._clock.monotonic() + ASK_EVERY  # first, so that no other thread asks too
        if robot is None or not map_id:
            return None
        if self.known(robot_id, map_id) is None and (kept := self._kept(robot, map_id)) is not None:
            self._remember(key, kept)
            return kept
        try:
            picture = self._ask(robot, map_id)
        except (RobotError, InvalidInput) as problem:
            if isinstance(problem, Unreadable):
                self._warn_once(robot, problem)
                self._postpone(key)
            return self.known(robot_id, map_id)
        with self._lock:
            self._warned.discard(robot_id)
        self._remember(key, picture)
        self._postpone(key)
        self._keep(self._path(robot.serial_number or robot.address, map_id), picture)
        return picture

    # ------------------------------------------------------------------ inside
    def _ask(self, robot: Robot, map_id: str) -> MapPicture:
        positions: list[MapPosition] = []
        with closing(self._make_client(robot)) as client:
            floor = client.map(map_id)
            with suppress(RobotError):  # a map without names is a map
                positions = client.positions(map_id)
        return picture_of(floor, positions)

    def _remember(self, key: Key, picture: MapPicture) -> None:
        with self._lock:
            self._pictures[key] = picture
            self._pictures.move_to_end(key)
            while len(self._pictures) > MOST_IN_MEMORY:
                oldest, _picture = self._pictures.popitem(last=False)
                self._due_at.pop(oldest, None)

    def _postpone(self, key: Key) -> None:
        with self._lock:
            self._due_at.pop(key, None)
            self._due_at[key] = self._clock.monotonic() + REFRESH_AFTER
            while len(self._due_at) > MOST_POSTPONED:
                del self._due_at[next(iter(self._due_at))]

    def _warn_once(self, robot: Robot, problem: Unreadable) -> None:
        """Once, until a map of this robot can be shown again."""
        with self._lock:
            is_new = robot.id not in self._warned
            self._warned.add(robot.id)
        if is_new:
            log.warning("The map of %s can't be shown: %s", robot.name, problem)

    # ------------------------------------------------------------------ files
    def _path(self, owner: str, map_id: str) -> Path:
        name = hashlib.sha256(f"{owner}\n{map_id}".encode("utf-8", "surrogatepass")).hexdigest()
        return self._directory / f"{name[:40]}.json"

    def _kept(self, robot: Robot, map_id: str) -> MapPicture | None:
        """Under the robot's serial number, or under its address: the first picture may have come before the number was known."""
        owners = filter(None, (robot.serial_number, robot.address))
        return next(filter(None, (self._read(self._path(owner, map_id)) for owner in owners)), None)

    def _read(self, path: Path) -> MapPicture | None:
        try:
            if path.stat().st_size <= LARGEST_FILE:
                return from_bytes(path.read_bytes())
        except FileNotFoundError:
            return None
        except (OSError, ValueError):
            log.info("A kept map can't be read; the robot is asked again")
        return None

    def _keep(self, path: Path, picture: MapPicture) -> None:
        """Written completely or not at all, readable only by its owner; if there are too many, the oldest are deleted.
        Without room on the disk nothing is stored."""
        try:
            self._directory.mkdir(mode=DIRECTORY_MODE, parents=True, exist_ok=True)
            write_whole(path, to_bytes(picture))
            by_age = sorted(self._directory.iterdir(), key=lambda entry: entry.stat().st_mtime)
            for oldest in by_age[:-MOST_FILES]:
                oldest.unlink(missing_ok=True)
        except OSError as error:
            log.info("The map can't be kept: %s", error.strerror or error)
