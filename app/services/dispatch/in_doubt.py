"""Starts whose request may have reached the robot, or still may: looked for until that is known.

Every 2 s the robot's queue is searched for the token. Found: it is accepted, nothing is sent again. Not found after the
quiet time: the attempt has failed, and is repeated within the window and the retry limit, unless the robot has said why
it can't take it. If the robot can't be asked until the quiet time has passed and the window has closed, it ends as
unknown, with an alarm.

What the target can do decides how a start is found there (``Capabilities.find_by``): by its id, which is the token; by
its token, whatever its number; or only by mission, user and number. A fleet that may have forgotten orders, or begun
their numbers again, since a start was sent leaves it unknown.
"""

from __future__ import annotations

from datetime import datetime, timedelta

from app.domain.capabilities import FindBy
from app.domain.choice import may_change_robot
from app.domain.clock import EARLIEST
from app.domain.execution import Execution, Reason, ReasonCode, State
from app.domain.message import Message, message
from app.mir.errors import Ambiguous, RobotError, VehicleUnavailable
from app.mir.target import Target
from app.services.dispatch.attempt import Attempt, Moment, Phase, intent_of
from app.services.dispatch.context import Context
from app.services.dispatch.duplicates import Duplicates
from app.services.dispatch.observation import Observation
from app.services.dispatch.outcomes import Outcomes
from app.services.dispatch.timing import RECONCILE_EVERY
from app.services.executions.transitions import WITH_THE_ROBOT, is_other_machine

SENT_TOGETHER = timedelta(minutes=5)  # of two starts: clocks can't be trusted to tell which was first


class InDoubt:
    """Those of one robot."""

    def __init__(
        self, client: Target, context: Context, observation: Observation, duplicates: Duplicates, outcomes: Outcomes
    ) -> None:
        self._client, self._s, self._ledger, self._clock = client, context, context.ledger, context.clock
        self._seen, self._duplicates, self._outcomes = observation, duplicates, outcomes
        self._attempts, self._robot_id = outcomes.attempts, observation.robot.id
        self.recovered: set[tuple[object, ...]] = set()  # intents that were looked for as lost ones

    def recover(self) -> None:
        """Rows in state submitting that no worker has: their process has ended, or the database failed in between. Each
        is looked for on the robot as if its request had just been sent."""
        for row in self._ledger.open_for(self._robot_id, (State.SUBMITTING,)):
            attempt = self._attempts.get(row.id)
            if attempt is None or attempt.phase is Phase.BACKOFF:  # it does not know that its intent was written
                self.recovered.add(intent_of(row))
                # It may have left this moment.
                self.mark(row, self._client.timeouts.total, is_taken=row.submitted_at is not None)
        for row in self._ledger.open_for(self._robot_id, (State.SUBMITTING, *WITH_THE_ROBOT)):
            self._note_sent(row)
        self._duplicates.watch_again()

    def _note_sent(self, row: Execution) -> None:
        """So that it can be found by what it is, and no other's order is taken for it. Nothing is noted if that may be one
        that another robot of the fleet has run."""
        robot, now, sent_at = self._seen.robot, self._clock.now(), _sent_at(row)
        if self._client.capabilities.find_by is not FindBy.ID:
            return
        robots = [each for each in self._s.robots.all(self._s.db.read()) if each.fleet_id == robot.fleet_id]
        ids = [each.id for each in robots if each.id == robot.id or each.is_any or robot.is_any]
        ended = self._ledger.ended_since(ids, row.mission_guid, sent_at - SENT_TOGETHER)
        is_open = (
            other.mission_guid == row.mission_guid
            for id_ in ids
            if id_ != robot.id
            for other in self._ledger.open_for(id_, (State.SUBMITTING, *WITH_THE_ROBOT))
        )
        if ended is None or any(other.robot_id != robot.id for other in ended) or any(is_open):
            return
        dates = [self._date_of(each, _sent_at(each)) for each in (*ended, row)]
        if EARLIEST in dates:
            return
        for each, date in zip((*ended, row), dates, strict=True):
            ago = max(0.0, (now - _sent_at(each)).total_seconds())
            self._client.note_sent(each.token, each.mission_guid, ago, date)

    def _date_of(self, row: Execution, at: datetime) -> datetime:
        """By the fleet where its time was known, else ``at`` by the tablet. EARLIEST: its clock was set back since."""
        return self._seen.time_of(row.queue_floor) or (at if at <= self._clock.now() else EARLIEST)

    def mark(self, row: Execution, ahead: float = 0.0, *, is_taken: bool = False) -> None:
        """``ahead``: s from now until its request times out. One that ``is_taken`` is looked for at once, one that is
        found by its id, without a search, soon."""
        mono, by_id = self._clock.monotonic() + ahead, self._client.capabilities.find_by is FindBy.ID
        wake_at = mono if is_taken else mono + (RECONCILE_EVERY / 2 if by_id else RECONCILE_EVERY)
        before = self._attempts.get(row.id)
        sent_since = before and before.sent_since  # the tablet may have slept during the request
        begun_at = row.begun_at or row.planned_at
        first = Moment(self._date_of(row, begun_at), begun_at, mono)
        since = first if ahead else sent_since or self._now
        self._attempts[row.id] = Attempt(
            Phase.IN_DOUBT, wake_at, in_doubt_since=mono, sent_since=since, is_taken=is_taken
        )

    def look_for(self, row: Execution) -> None:
        """On the robot. It is sent again only if it is certainly not there and no request can still arrive."""
        attempt = self._attempts[row.id]
        quiet_left = self._seen.quiet_seconds - (self._clock.monotonic() - attempt.in_doubt_since)
        is_closed = self._clock.now() >= row.closes_at
        try:
            if self._is_other_machine(row):
                self._give_up(row, message("the robot has been replaced by another machine"))
                return
            if found := self._duplicates.own.of(row):
                in_doubt = max(0.0, self._clock.monotonic() - attempt.in_doubt_since)
                self._outcomes.found(row, found, self._clock.now() - timedelta(seconds=in_doubt))
                return
            self._note_not_there(attempt)
            age = self._seconds_since(attempt.sent_since)
            if quiet_left <= 0 and (
                problem := self._duplicates.own.why_uncertain(
                    row, attempt.is_taken, may_change_robot(row), age, attempt.unasked
                )
            ):
                self._give_up(row, problem)
                return
        except RobotError as error:
            if quiet_left <= 0 and (is_closed or isinstance(error, Ambiguous)):
                self._give_up(row, error.message)
            else:
                attempt.wake_at = self._clock.monotonic() + 2 * RECONCILE_EVERY
            return
        if quiet_left > 0:
            attempt.wake_at = self._clock.monotonic() + min(RECONCILE_EVERY, quiet_left)
        else:
            self._is_not_there(row)
            self._duplicates.watch_for(row)

    @property
    def _now(self) -> Moment:
        return Moment(self._seen.time, self._clock.now(), self._clock.monotonic())

    def _seconds_since(self, then: Moment | None) -> float:
        """By each clock since its own reading then, and of these the most: so neither a sleep of the tablet nor a clock that was
        set back shortens them."""
        now = self._now
        by_fleet, by_tablet, mono = then or now
        passed = now.by_fleet - by_fleet, now.by_tablet - by_tablet
        return max(now.mono - mono, *(each.total_seconds() for each in passed))

    def _note_not_there(self, attempt: Attempt) -> None:
        """The robot was asked for it just now."""
        attempt.unasked = max(attempt.unasked, self._seconds_since(attempt.asked_at or attempt.sent_since))
        attempt.asked_at = self._now

    def _is_other_machine(self, row: Execution) -> bool:
        """Whether another machine answers, whose queue must not be read as the robot's. A fleet that has lost contact with
        the robot is the known fleet, and is asked if it is known how orders are recognised there. Raises RobotError."""
        try:
            status = self._seen.read_status()
        except VehicleUnavailable:
            if self._client.capabilities.find_by is not FindBy.ID and self._seen.known is None:
                raise
            return False
        if is_other_machine(row, status.serial_number):
            return True
        self._seen.identify()  # with other software it may answer in another way
        return False

    def _is_not_there(self, row: Execution) -> None:
        """Not on the robot: failed, or refused if the robot said why."""
        answer = row.wait_details.get("answer")
        if row.wait_details.get("is_reason") and self._ledger.wanted(row).why is None:
            self._outcomes.refused_as_sent(row, Reason(ReasonCode.REFUSED, {"problem": answer}), may_come=True)
        else:
            self._outcomes.failed([row], answer or message("the robot did not receive it"), waited=True)

    def _give_up(self, row: Execution, problem: Message) -> None:
        self._ledger.apply([self._duplicates.give_up(row, problem)])
        self._attempts.pop(row.id, None)


def _sent_at(row: Execution) -> datetime:
    """When its first attempt was, at the earliest."""
    return (row.begun_at if row.attempts == 1 else None) or row.planned_at
