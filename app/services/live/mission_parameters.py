"""Missions' parameters as robots have reported them, and the check of entered values. They are stored in the database,
as a robot may be silent when they are needed. A mission may be edited on the robot later: so a robot is asked again, if
possible, before anything is refused, and no start is refused by stored values alone.
"""

from __future__ import annotations

import logging
import math
import threading
import time
from collections.abc import Callable, Iterable, Mapping, Sequence
from contextlib import closing, suppress
from dataclasses import replace
from typing import Any, NamedTuple

from app.database.connection import Database
from app.database.errors import DatabaseError
from app.database.missions import MissionParameterRepository
from app.domain.clock import Clock
from app.domain.execution import Execution, Reason, ReasonCode
from app.domain.models import Connection, InvalidInput, Robot
from app.domain.parameters import has_position_by_name, values_for
from app.domain.robot import ENTRIES, MapPosition, MissionParameter
from app.mir.errors import AnotherRobot, Busy, NotAMir, Refusal, RobotError, SerialNumberHidden, Unreadable
from app.mir.target import Target
from app.services.live.changes import Changes, Topic
from app.services.live.snapshots import Snapshots

log = logging.getLogger(__name__)

VALID_FOR = 300.0  # s for which a screen does not ask again; an integrator may edit the mission
VALID_FOR_STARTS = (
    10.0  # s for which the name of a position still means the same one; asked within these before an instant
)
ANSWER_TIMEOUT = 10.0  # s for all robots that are asked before something is saved
ROBOTS_AT_ONCE = 16

Answers = dict[tuple[int, str], Sequence[MissionParameter]]  # by robot and guid


class _Answer(NamedTuple):
    """A robot's answer (``parameters`` None: it does not say) at a time of the monotonic clock, when it was on that
    map. An answer from the database counts as older than all times."""

    parameters: Sequence[MissionParameter] | None
    at: float = -math.inf
    map_id: str | None = None


class MissionParameters:
    def __init__(
        self,
        db: Database,
        clock: Clock,
        make_client: Callable[[Robot], Target],
        snapshots: Snapshots,
        changes: Changes,
    ) -> None:
        self._db, self._clock, self._make_client, self._snapshots = db, clock, make_client, snapshots
        self._stored = MissionParameterRepository()
        self._answers: dict[tuple[int, str], _Answer] = {}  # only by steps that no other thread can interrupt
        changes.subscribe(self._forget)

    # ------------------------------------------------------------------ what is known
    def _of(self, robot_id: int, guid: str) -> _Answer:
        if (kept := self._answers.get((robot_id, guid))) is not None:
            return kept
        stored = _Answer(self._stored.get(self._db.read(), robot_id, guid))
        return self._answers.setdefault((robot_id, guid), stored)

    def known(self, robot_id: int, guid: str) -> Sequence[MissionParameter] | None:
        """The robot's answer of any age; None: none."""
        return self._of(robot_id, guid).parameters

    def said_before(self, robot_id: int, guid: str) -> Sequence[MissionParameter] | None:
        """The same or else another robot's."""
        own = self.known(robot_id, guid)
        return own if own is not None else self._stored.of_any(self._db.read(), guid)

    def known_from_any(self, robot_id: int, guid: str) -> Sequence[MissionParameter] | None:
        """The same without another robot's positions, which may differ."""
        if (own := self.known(robot_id, guid)) is not None:
            return own
        found = self.said_before(robot_id, guid)
        return found and tuple(
            replace(each, choices=(), on_other_maps=()) if each.is_position else each for each in found
        )

    def recent(self, robot_id: int, guid: str) -> Sequence[MissionParameter] | None:
        """As the robot has said within the last minutes."""
        kept = self._of(robot_id, guid)
        return kept.parameters if self._clock.monotonic() - kept.at < VALID_FOR else None

    def to_send(self, robot_id: int, guid: str, mission: str, entered: Mapping[str, Any]) -> Mapping[str, Any] | None:
        """The values as the robot wants them: positions by their guid, choices by their value; as they were ``entered``
        if the robot does not say what the mission asks for. None: the robot has to be asked first, as it would refuse
        them by stored values, or these may be outdated."""
        kept = self._of(robot_id, guid)
        if not entered and not kept.parameters:  # most missions ask for nothing
            return {}
        is_recent = self._clock.monotonic() - kept.at <= VALID_FOR_STARTS
        if kept.parameters is None:
            return dict(entered) if is_recent else None
        if has_position_by_name(kept.parameters, entered) and not (is_recent and kept.map_id == self._map_of(robot_id)):
            return None
        with suppress(InvalidInput):
            return values_for(mission, kept.parameters, entered)
        return None

    def _map_of(self, robot_id: int) -> str | None:
        status = self._snapshots.get(robot_id).status
        return None if status is None else status.map_id

    def _forget(self, topic: Topic, _about: int | None) -> None:
        """A robot may be another machine now: only the answers in the database count."""
        if topic is Topic.ROBOTS:
            self._answers.clear()

    # ------------------------------------------------------------------ asking
    def learn(self, robot_id: int, guid: str, client: Target) -> Sequence[MissionParameter] | None:
        """Ask the robot. None: it does not say. Raises RobotError, Rejected with status 404 if it has no such
        mission."""
        map_id = self._map_of(robot_id)  # as known before: if it has changed since, names are read again
        found = _ask_client(client, guid)
        self.keep({(robot_id, guid): found}, map_id)
        return found

    def ask_for_start(self, robot_id: int, guid: str, client: Target) -> Sequence[MissionParameter] | None:
        """Ask the robot. None: it does not say, or not to this user: then it checks the values itself. Raises
        RobotError if it can't be asked."""
        try:
            return self.learn(robot_id, guid, client)
        except RobotError as error:
            if not _is_unsupported(error):
                raise
            self.keep({(robot_id, guid): None})
            return None

    def refusal(self, start: Execution, robot_id: int, client: Target) -> Reason | None:
        """Ask the robot what the mission needs; returns why it would refuse these values. Raises RobotError if it can't
        be asked."""
        found = self.ask_for_start(robot_id, start.mission_guid, client)
        try:
            if found is not None:
                values_for(start.mission, found, start.parameters)
        except InvalidInput as problem:
            return Reason(ReasonCode.REFUSED, {"problem": problem.message})
        return None

    def keep(
        self, answers: Mapping[tuple[int, str], Sequence[MissionParameter] | None], map_id: str | None = None
    ) -> None:
        """Robots' new answers, on that map; None: one was asked and does not say."""
        now = self._clock.monotonic()
        new = {key: found for key, found in answers.items() if found is not None and found != self._of(*key).parameters}
        self._answers.update({key: _Answer(found, now, map_id) for key, found in answers.items()})
        if new:
            try:
                self._db.write(lambda c: self._stored.put(c, new), patient=True)
            except DatabaseError as problem:  # it is asked again when it is needed
                log.info("What a mission asks for could not be stored: %s", problem)

    def ask(self, wanted: Sequence[tuple[Robot, Sequence[str]]], within: float = ANSWER_TIMEOUT) -> Answers:
        """What these robots say about missions (guids), many at a time, without those that don't answer ``within`` so
        many seconds. Silent ones are not asked further. Stores nothing: they need not be configured yet."""
        answers, end = Answers(), time.monotonic() + within
        left = [(robot, guids) for robot, guids in wanted if self._may_answer(robot)]

        def work() -> None:
            while left:
                with suppress(IndexError):  # another one was quicker
                    self._ask_robot(*left.pop(0), answers, end)

        threads = [
            threading.Thread(target=work, name="mission parameters", daemon=True)
            for _ in range(min(ROBOTS_AT_ONCE, len(left)))
        ]
        for thread in threads:
            thread.start()
        for thread in threads:
            thread.join(max(0.0, end - time.monotonic()))
        return dict(answers)

    def _may_answer(self, robot: Robot) -> bool:
        may = (Connection.UNKNOWN, Connection.CONNECTED, Connection.SLOW)
        return robot.enabled and not robot.needs_password and self._snapshots.get(robot.id).connection in may

    def _ask_robot(self, robot: Robot, guids: Sequence[str], answers: Answers, end: float) -> None:
        try:
            with closing(self._make_client(robot)) as client:
                for guid in guids:
                    if time.monotonic() > end:
                        return
                    try:
                        if (found := _ask_client(client, guid)) is not None:
                            answers[robot.id, guid] = found
                    except RobotError as error:
                        if not _is_unsupported(error):
                            raise
        except (RobotError, InvalidInput) as error:
            log.info("What missions ask for was not said by %r: %s", robot.name, error)


def _is_unsupported(error: RobotError) -> bool:
    """Whether the robot has answered, but without the mission's parameters: it lacks the mission or the interface, or
    this user may not read it. A busy robot may answer soon."""
    return isinstance(error, Refusal | NotAMir | Unreadable) and not isinstance(
        error, Busy | AnotherRobot | SerialNumberHidden
    )


def _ask_client(client: Target, guid: str) -> Sequence[MissionParameter] | None:
    found = client.parameters(guid)
    if found is None or not any(parameter.is_position for parameter in found):
        return found and tuple(found)
    map_id = client.status().map_id
    here = _named(client.positions(map_id)) if map_id else ()
    try:
        everywhere = _named(client.positions())
    except Refusal:
        everywhere = here
    return tuple(_with_positions(parameter, here or everywhere, everywhere) for parameter in found)


def _named(positions: Iterable[MapPosition]) -> tuple[tuple[str, str], ...]:
    """Guid and name of where the robot can be sent, by name."""
    named = {
        position.guid: position.name for position in positions if position.name and position.type_id not in ENTRIES
    }
    return tuple(sorted(named.items(), key=lambda entry: entry[1].casefold()))


def _with_positions(
    parameter: MissionParameter, here: tuple[tuple[str, str], ...], everywhere: tuple[tuple[str, str], ...]
) -> MissionParameter:
    if not parameter.is_position:
        return parameter
    choices = parameter.choices or here
    return replace(
        parameter, choices=choices, on_other_maps=tuple(entry for entry in everywhere if entry not in choices)
    )
