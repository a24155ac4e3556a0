"""What check-ups of robots and of fleets have in common: one at a time of each, what they report, and that what an
interrupted trial has left is undone later."""

from __future__ import annotations

import logging
import math
import sqlite3
import threading
from abc import ABC, abstractmethod
from collections.abc import Callable, Collection, Iterator, Mapping, Sequence
from contextlib import AbstractContextManager, contextmanager
from typing import Any, ClassVar, Generic, TypeVar

from app.database.check_ups import CheckUpRepository
from app.database.connection import Database
from app.database.errors import DatabaseError
from app.domain.check_up import LeftBehind, Progress, Report, Trial
from app.domain.clock import Clock
from app.domain.message import Message
from app.domain.models import Fleet, InvalidInput, Robot, Settings
from app.mir.classic_vehicle import ClassicVehicle
from app.mir.client import RobotClient
from app.mir.enterprise_vehicle import EnterpriseVehicle
from app.mir.errors import RobotError
from app.mir.raw_client import RawClient
from app.mir.target import Target
from app.services.check_up.fleet_trial import FleetJournal
from app.services.check_up.journal import Journal
from app.services.check_up.session import CheckUpSession
from app.services.dispatch.ledger import Ledger
from app.services.live.alarms import Alarms
from app.services.live.changes import Changes, Topic
from app.services.live.holds import Holds

log = logging.getLogger(__name__)

RETRY_EVERY = 30.0  # s, for what a trial left behind

T = TypeVar("T", Robot, Fleet)
C = TypeVar("C", RobotClient, ClassicVehicle | EnterpriseVehicle)
J = TypeVar("J", Journal, FleetJournal)

OnProgress = Callable[[Progress], None]
IsWanted = Callable[[], bool]
Keep = Callable[[sqlite3.Connection], object]  # stores a complete check-up


class CheckUpsOf(ABC, Generic[T, C, J]):
    """Of what can be checked up, by their ids. ``run`` blocks for a minute or two and belongs on a background thread,
    or in a command."""

    WHAT: ClassVar[str]

    def __init__(
        self,
        db: Database,
        *,
        clock: Clock,
        ledger: Ledger,
        holds: Holds,
        alarms: Alarms,
        changes: Changes,
        settings: Callable[[], Settings],
        make_client: Callable[[Robot], Target],
    ) -> None:
        self._db, self._clock, self._ledger, self._holds, self._alarms = db, clock, ledger, holds, alarms
        self._changes, self._settings, self._make_client = changes, settings, make_client
        self._check_ups = CheckUpRepository()
        self._lock, self._under_way = threading.Lock(), set[int]()
        self._retry_at = -math.inf  # monotonic
        self._thread: threading.Thread | None = None

    # ------------------------------------------------------------------ what differs
    @abstractmethod
    def _get(self, id_: int) -> T:
        """Raises InvalidInput if it has been removed."""

    @abstractmethod
    def _client(self, it: T) -> AbstractContextManager[C]:
        """A separate client with long time-outs. Raises InvalidInput for one without its password."""

    @abstractmethod
    def _run(self, it: T, trial: Trial | None, on_progress: OnProgress, is_wanted: IsWanted) -> tuple[Report, Keep]: ...

    @abstractmethod
    def _left(self) -> Mapping[int, LeftBehind]:
        """What trials have changed that is not undone yet."""

    @abstractmethod
    def _journal(self, it: T, left: LeftBehind) -> J: ...

    @abstractmethod
    def _put_back(self, it: T, journal: J) -> Message | None:
        """Raises RobotError or InvalidInput."""

    # ------------------------------------------------------------------ the check-up
    def harmless_missions(self, id_: int) -> Sequence[str]:
        """Names of its missions, to choose a harmless one for a trial. Asks it. Raises RobotError or InvalidInput."""
        with self._client(self._get(id_)) as client:
            return sorted(missions_of(client), key=str.casefold)

    def run(
        self,
        id_: int,
        trial: Trial | None = None,
        on_progress: OnProgress = lambda progress: None,
        is_wanted: IsWanted = lambda: True,
    ) -> Report:
        """Read it and, with a ``trial``, queue missions on it. ``on_progress`` is called with the progress.
        ``is_wanted`` is called between questions, and changes are undone in any case. That it is silent is a finding,
        not an error. An incomplete check-up is not stored.

        Raises InvalidInput where it is being checked up, and for a trial that can't be now, with the reason.
        """
        it = self._get(id_)
        with self._alone_with(it):
            problem: Message | None
            try:  # first: remains of the last one may block this one
                problem = self._undo(it)
            except (RobotError, InvalidInput) as error:
                problem = error.message
            if problem is not None and trial is not None:
                raise InvalidInput("robot", "the last check-up has not been undone yet: {problem}", problem=problem)
            report, keep = self._run(it, trial, on_progress, is_wanted)
        if report.is_complete:
            self._db.write(keep)
            self._changes.publish(Topic.ROBOTS)
        log.info(
            "%s %r was checked up%s: %s%s",
            self.WHAT,
            it.name,
            f" with {report.mission!r}" if report.mission else "",
            report.level,
            "" if report.is_complete else ", not complete",
        )
        return report

    def _session(self, client: C, **values: Any) -> CheckUpSession:
        return CheckUpSession(RawClient(client, self._clock), self._clock, self._settings().timezone, **values)

    @contextmanager
    def _alone_with(self, it: T) -> Iterator[None]:
        with self._lock:
            if it.id in self._under_way:
                raise InvalidInput("robot", "{robot} is being checked up already", robot=it.name)
            self._under_way.add(it.id)
        try:
            yield
        finally:
            self._under_way.discard(it.id)

    # ------------------------------------------------------------------ what a trial left
    def put_back(self, id_: int) -> Message | None:
        """Undo an interrupted trial there. Returns what could not be undone; None: everything is restored. Raises
        InvalidInput or RobotError."""
        it = self._get(id_)
        with self._alone_with(it):
            return self._undo(it)

    def _undo(self, it: T) -> Message | None:
        if (left := self._left().get(it.id)) is None:
            return None
        self._holds.check_is_no_copy()
        journal = self._journal(it, left)
        try:
            problem = self._put_back(it, journal)
        except RobotError as error:
            journal.warn(error.message)
            raise
        if problem is not None:
            journal.warn(problem)
        return problem

    def left_behind(self) -> Collection[int]:
        """Where changes of an interrupted trial have not been undone."""
        return [id_ for id_ in self._left() if id_ not in self._under_way]

    def tick(self) -> None:
        """A chore: undo remains of a trial on a separate thread. Returns at once."""
        now = self._clock.monotonic()
        if now < self._retry_at or (self._thread and self._thread.is_alive()):
            return
        self._retry_at = now + RETRY_EVERY
        if left := list(self.left_behind()):
            self._thread = threading.Thread(
                target=self.put_back_all, args=(left,), name="after a check-up", daemon=True
            )
            self._thread.start()

    def put_back_all(self, ids: Sequence[int]) -> None:
        """One that does not answer is asked again later."""
        for id_ in ids:
            try:
                self.put_back(id_)
            except (RobotError, InvalidInput, DatabaseError) as problem:
                log.info("What a check-up left there (%d) could not be put back yet: %s", id_, problem)


def missions_of(client: Target) -> Mapping[str, str]:
    """Names of the missions that people made on it, with their guids. Raises RobotError."""
    return {mission.name: mission.guid for mission in client.missions() if not mission.is_built_in}


def mission_called(name: str, client: Target, missing: InvalidInput) -> str:
    """Its guid, for a trial. Raises ``missing`` if there is none, InvalidInput, or RobotError."""
    guid = missions_of(client).get(name)
    if guid is None:
        raise missing
    if any(parameter.default in (None, "") for parameter in client.parameters(guid) or ()):
        raise InvalidInput(
            "mission", "{mission} asks for values when it is started: choose another mission", mission=name
        )
    return guid
