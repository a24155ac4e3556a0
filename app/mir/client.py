"""One MiR robot over its REST API v2.0.0.

A client is used by one thread at a time: its robot's worker, or one action of the operator. Every call raises RobotError and
nothing else; ``error.delivery`` says what a failed one may have done. Calls that change something are never repeated here.

The status is asked for without credentials and its serial number compared with the known one. No request with credentials is sent
unless that was done in the last seconds: where it was not, the call does it first.
"""

from __future__ import annotations

import math
import time
from collections.abc import Callable, Mapping
from typing import Any, TypeVar
from urllib.parse import quote

from app.domain.check_up import NOTHING_KNOWN, RobotProfile
from app.domain.message import message
from app.domain.robot import (
    IdentifiedBy,
    Identity,
    MapPosition,
    MissionActions,
    MissionDetail,
    MissionInfo,
    MissionParameter,
    QueueItem,
    RobotMap,
    RobotState,
    RobotStatus,
)
from app.mir import parameters as mission_parameters
from app.mir import parse, robot_vocabulary
from app.mir.address import Address
from app.mir.credentials import Token
from app.mir.errors import (
    AnotherRobot,
    Busy,
    ConnectionLost,
    NotAMir,
    Refusal,
    Rejected,
    RobotError,
    RobotFault,
    SerialNumberHidden,
    Unauthorized,
    Unreadable,
)
from app.mir.http import HttpTransport
from app.mir.mission_queue import UNSUPPORTED, QueueReader
from app.mir.robot_vocabulary import in_mir_words
from app.mir.texts import clean, resolve
from app.mir.transport import API, OF_ALL, OF_READS, OF_STATUS, Pace, Response, Timeouts, Transport

LARGEST_OBJECT = 256 * 1024  # bytes of an answer about one thing: a status, a queue item, an error
MOST_MISSIONS = 2000  # sites have tens to hundreds
LARGEST_MISSIONS = 1024 * 1024  # bytes of their list, three times what so many need
VERIFIED_FOR = (
    10.0  # s for which a compared serial number lets credentials go out, while the connection it came over is open
)
VERIFIED_WITHOUT = 2.0  # the same where that connection was closed as soon as the answer was there

T = TypeVar("T")


class RobotClient:
    """``clock`` is a monotonic clock in seconds; ``transport`` replaces HTTP in simulations.

    ``serial_number`` is the known one, None before the first contact. ``identified_by`` is what it was identified by the last time: a
    robot that has shown its serial number to anybody gets no credentials when it does so no longer. ``pace`` is shared by all clients of
    the robot.
    """

    def __init__(
        self,
        address: Address,
        token: Token,
        *,
        certificate_sha256: str | None = None,
        serial_number: str | None = None,
        identified_by: IdentifiedBy | None = None,
        transport: Transport | None = None,
        clock: Callable[[], float] = time.monotonic,
        timeouts: Timeouts | None = None,
        profile: RobotProfile | None = None,
        pace: Pace | None = None,
    ) -> None:
        self.address, self._serial_number, self.identified_by = address, serial_number, identified_by
        self.has_default_password = token.is_published_default
        self._verified_at, self._verified_over = -math.inf, object()
        self._has_answered = False  # as HTTP
        self._clock = clock
        self.timeouts = self._usual_timeouts = timeouts or Timeouts()
        self._transport = transport or HttpTransport(address, token, certificate_sha256)
        self.on_pause: Callable[[], None] = lambda: (
            None
        )  # called between the many requests that reading a queue may take
        self._queue, self.pace = QueueReader(self._entries, self._next_item), pace or Pace(clock)
        self._profile = NOTHING_KNOWN
        self.use_profile(profile)

    def close(self) -> None:
        """Let go of the connection; a later call opens a new one."""
        self._transport.close()

    def __repr__(self) -> str:
        return f"RobotClient({self.address})"

    # ------------------------------------------------------------------ who and how
    @property
    def serial_number(self) -> str | None:
        return self._serial_number

    @serial_number.setter
    def serial_number(self, known: str | None) -> None:
        if known != self._serial_number:
            self._serial_number, self._verified_at = known, -math.inf

    def use_profile(self, known: RobotProfile | None) -> None:
        """What a check-up has found of the robot as it is now; None: nothing."""
        known = known or NOTHING_KNOWN
        if known != self._profile:
            self._profile, self.pace.rest = known, known.rest
            self.timeouts = self._usual_timeouts.at_least(known.timeout_s)
            self._queue.use_profile(known)

    def status(self) -> RobotStatus:
        """How the robot is, asked without credentials; with them only where it gives no status else (401).

        Raises AnotherRobot when its serial number is not the known one, SerialNumberHidden when it was always shown and is no longer,
        NotAMir when something else answers.
        """
        self.pace.wait(OF_STATUS)
        return self._ask_status()

    def _ask_status(self) -> RobotStatus:
        began, self._verified_at = self._clock(), -math.inf
        answer, is_open = self._answer_of_status()
        status = self._status(answer, self._clock() - began)
        self._check_serial_number(status)
        if not status.serial_number:
            self._check_may_be_hidden()
        shown = IdentifiedBy.SERIAL_NUMBER if is_open and status.serial_number else IdentifiedBy.ADDRESS
        self.identified_by = IdentifiedBy.CERTIFICATE if self.address.is_secure else shown
        self._verified_at, self._verified_over = self._clock(), self._transport.kept()
        return status

    def _answer_of_status(self) -> tuple[Response, bool]:
        """And whether it is given without credentials."""
        try:
            try:
                return _again_if_stale(lambda: self._send("GET", "/status", with_credentials=False)), True
            except Unauthorized:
                self._check_may_be_hidden()
                return self._send("GET", "/status"), False
        except Rejected as error:
            if error.status in (404, 405, 410):
                raise NotAMir(code="no_interface", address=self.address.netloc, status=error.status) from None
            raise

    def _check_serial_number(self, status: RobotStatus, code: str = "") -> None:
        expected, found = self.serial_number, status.serial_number
        if expected and found and found != expected:
            self._verified_at = -math.inf
            raise AnotherRobot(code=code, address=self.address.netloc, expected=expected, found=found)

    def _is_verified(self) -> bool:
        """Whether credentials may go out: the known serial number was shown a moment ago, or on a connection that has been open since."""
        kept = self._transport.kept()
        lasts = VERIFIED_FOR if kept and kept is self._verified_over else VERIFIED_WITHOUT
        return kept is not False and self._clock() - self._verified_at <= lasts

    def _check_may_be_hidden(self) -> None:
        """Whoever takes a robot's place could hide its serial number to get the credentials. A certificate can't be hidden."""
        if self.serial_number and not self.address.is_secure and self.identified_by not in (None, IdentifiedBy.ADDRESS):
            raise SerialNumberHidden(address=self.address.netloc, expected=self.serial_number)

    def identify(self) -> Identity:
        """Status, and who we are to the robot, so that a wrong password shows (Unauthorized); the software version where known."""
        status = self.status()
        try:
            user = self._get("/users/me", lambda found: clean(parse.single(found, message("the user")).get("name"), 80))
        except Rejected:
            user = ""
            self._queue.ids({"limit": "1"})  # needs credentials as well
        return Identity(status, user, status.software or self._software(), self.identified_by or IdentifiedBy.ADDRESS)

    def _software(self) -> str | None:
        """From software 3.x on; older robots give it in a header, if at all."""
        try:
            return self._get(
                "/software/system_status",
                lambda found: parse.text_or_none(
                    parse.single(found, message("the system status")).get("application_version")
                ),
            )
        except (Refusal, Unreadable, NotAMir):
            return None

    # ------------------------------------------------------------------ missions
    def missions(self) -> list[MissionInfo]:
        """All missions of the site that the robot has. Raises Unreadable for more than MOST_MISSIONS."""
        return self._get(
            "/missions",
            lambda found: parse.listed(found, message("the mission list"), parse.mission_info, MOST_MISSIONS),
            largest=LARGEST_MISSIONS,
        )

    def mission(self, guid: str) -> MissionDetail:
        """Raises Rejected with status 404 when the robot has no such mission."""
        return self._get(f"/missions/{_segment(guid)}", parse.mission_detail)

    def parameters(self, guid: str) -> list[MissionParameter] | None:
        """What has to be given when this mission is queued; [] for most missions. None: the robot does not say. Raises Rejected with
        status 404 when it has no such mission."""
        mission = self.mission(guid)
        if mission.has_user_parameters is False:
            return []
        own = f"{API}/missions/{_segment(guid)}"
        defined, of_actions = (
            self._parameters(url, read)
            for url, read in (
                (mission.definition_url or f"{own}/definition", mission_parameters.from_definition),
                (mission.actions_url or f"{own}/actions", mission_parameters.from_actions),
            )
        )
        found = mission_parameters.with_meaning(defined or (), of_actions or ())
        return found or (None if mission.has_user_parameters or of_actions is None else [])

    def actions(self, guid: str) -> MissionActions:
        """What the mission's actions tell."""
        url = self.mission(guid).actions_url or f"{API}/missions/{_segment(guid)}/actions"
        return self._get(url.removeprefix(API), mission_parameters.actions, largest=None)

    def _parameters(self, url: str, read: Callable[[Any], list[MissionParameter]]) -> list[MissionParameter] | None:
        try:
            return self._get(url.removeprefix(API), read, largest=None)
        except Refusal as error:
            if error.status not in UNSUPPORTED:
                raise
            return None

    # ------------------------------------------------------------------ the queue
    def enqueue(
        self,
        mission_guid: str,
        *,
        description: str = "",
        text: str = "",
        priority: int = 0,
        parameters: Mapping[str, Any] | None = None,
        is_wanted: Callable[[], bool] = lambda: True,
    ) -> int:
        """Put a mission at the end of the robot's queue; returns the id of its item. Only 201, or what the robot is known to answer, counts
        as accepted; without an integer id that raises Unnumbered.

        ``is_wanted`` is asked when the connection stands: the tablet may have slept before that. If not, raises NotWanted, and nothing was
        sent.
        """
        try:
            body = robot_vocabulary.order(mission_guid, description, text, priority, parameters or {})
        except (TypeError, ValueError, RecursionError):
            raise Rejected(
                status=400, reason=message("a parameter can't be written as JSON"), address=self.address.netloc
            ) from None
        answer = self._request("POST", "/mission_queue", json=body, is_wanted=is_wanted)
        if problem := robot_vocabulary.order_problem(answer, self._profile):
            raise problem.at(self.address.netloc)
        return self._read(answer, parse.queue_id)

    def queue_item(self, queue_id: int) -> QueueItem:
        """Raises Rejected with status 404 when the robot has no such item (any more)."""
        item = self._get(
            f"/mission_queue/{queue_id}", lambda found: parse.queue_item(in_mir_words(found, self._profile))
        )
        self._queue.saw(item)
        return item

    def open_items(self) -> list[QueueItem]:
        """Everything pending or executing, of the app and of others, by ascending id."""
        return self._queue.open_items()

    def items_after(
        self, id_floor: int, known: dict[int, QueueItem | None] | None = None, highest: int = 0
    ) -> list[QueueItem]:
        """Every item with a higher id, by ascending id. All of them, or it raises: "not there" is a reason to send again.

        ``known``: items (None: not there) that need not be read one by one; those that were are added to it, so that of many the next call
        reads more. ``highest``: an id that is there, below which nothing ends.
        """
        return self._queue.items_after(id_floor, known, highest)

    def highest_queue_id(self) -> int | None:
        """Highest id in the queue's history; where the robot can't sort, perhaps a lower one, which is safe to search from. None: empty."""
        return self._queue.highest_id()

    def cancel(self, queue_id: int) -> None:
        """Abort one item. It stays in the robot's list as Aborted."""
        self._request("DELETE", f"/mission_queue/{queue_id}", at_once=True)

    def clear_queue(self) -> None:
        """Abort everything pending and executing, of the app and of others."""
        self._request("DELETE", "/mission_queue", at_once=True)

    # ------------------------------------------------------------------ the robot
    def set_state(self, state: RobotState) -> RobotStatus | None:
        """READY: go on; PAUSE: pause what runs and hold the queue. Returns the status afterwards, where the robot gives it."""
        if state not in (RobotState.READY, RobotState.PAUSE):
            raise ValueError(state)
        return self._put_status({"state_id": int(state)})

    def clear_error(self) -> RobotStatus | None:
        """Clear resettable errors. The robot is in Pause then and does not move; ``set_state(READY)`` makes it go on."""
        return self._put_status({"clear_error": True})

    def answer_prompt(self, guid: str, answer: str) -> RobotStatus | None:
        """Answer the question with this guid (``RobotStatus.user_prompt``)."""
        return self._put_status({"guid": guid, "answer": answer})

    def map(self, map_id: str) -> RobotMap:
        """Picture and scale of a map; ``RobotStatus.map_id`` is the current one."""
        return self._get(f"/maps/{_segment(map_id)}", parse.robot_map, largest=None)

    def positions(self, map_id: str | None = None) -> list[MapPosition]:
        """Named places, of one map or of all. Coordinates come along where the robot knows the whitelist."""
        path = f"/maps/{_segment(map_id)}/positions" if map_id else "/positions"
        return self._get(
            path,
            lambda found: parse.listed(
                found, message("the list of positions"), lambda entry: parse.map_position(entry, map_id)
            ),
            {"whitelist": "all"},
            largest=None,
        )

    def position(self, guid: str) -> MapPosition:
        """With its coordinates. Raises Rejected with status 404 when the robot has no such position."""
        return self._get(f"/positions/{_segment(guid)}", parse.position)

    # ------------------------------------------------------------------ requests
    def ask(self, method: str, path: str, *, query: Mapping[str, str] | None = None, json: Any = None) -> Response:
        """Any request, for a check-up: an answer of success as it came. Raises RobotError."""
        return self._request(method, path, query=query, json=json)

    def _get(
        self,
        path: str,
        read: Callable[[Any], T],
        query: Mapping[str, str] | None = None,
        *,
        largest: int | None = LARGEST_OBJECT,
    ) -> T:
        return self._read(self._request("GET", path, query=query), read, largest)

    def _entries(self, method: str, path: str, query: Mapping[str, str], json: Any) -> list[parse.Object]:
        self.on_pause()
        answer = self._request(method, path, query=query, json=json)
        entries = self._read(answer, lambda found: parse.objects(found, message("the mission queue")), None)
        return [in_mir_words(entry, self._profile) for entry in entries]

    def _next_item(self, queue_id: int) -> QueueItem:
        self.on_pause()
        return self.queue_item(queue_id)

    def _put_status(self, body: Mapping[str, Any]) -> RobotStatus | None:
        began = self._clock()
        answer = self._request("PUT", "/status", json=body, at_once=True)
        try:
            status = self._status(answer, self._clock() - began)
        except (NotAMir, Unreadable):
            return None
        self._check_serial_number(status, "another_robot_did_it")
        return status

    def _status(self, answer: Response, elapsed_s: float) -> RobotStatus:
        software, date = (
            clean(answer.headers.get("Robot-Version", ""), 40) or None,
            parse.http_date(answer.headers.get("Date", "")),
        )
        return self._read(answer, lambda found: parse.status(found, software=software, date=date, elapsed_s=elapsed_s))

    def _read(self, answer: Response, read: Callable[[Any], T], largest: int | None = LARGEST_OBJECT) -> T:
        """What a body of at most ``largest`` bytes says: parsing one of megabytes holds up every thread. Raises Unreadable or NotAMir,
        with the robot's address in it."""
        if largest is not None and len(answer.body) > largest:
            raise Unreadable(code="too_large", address=self.address.netloc, limit=largest >> 10)
        try:
            return read(parse.loads(answer.body))
        except Unreadable as error:
            if parse.looks_like_web_page(answer.body):
                raise NotAMir(code="web_page", address=self.address.netloc) from None
            raise error.at(self.address.netloc) from None
        except RobotError as error:
            raise error.at(self.address.netloc) from None

    def _request(
        self,
        method: str,
        path: str,
        *,
        query: Mapping[str, str] | None = None,
        json: Any = None,
        is_wanted: Callable[[], bool] | None = None,
        at_once: bool = False,
    ) -> Response:
        """With credentials, to the robot that is known. ``at_once``: what a person orders does not wait for its turn. Raises RobotError."""

        def send() -> Response:
            is_read = method == "GET" or path.endswith("/search")
            if at_once:
                self.pace.count()
            else:
                self.pace.wait(OF_READS if is_read else OF_ALL, self.on_pause if is_read else lambda: None)
            self._verify(at_once)
            return self._send(method, path, query=query, json=json, is_wanted=is_wanted)

        return _again_if_stale(send)

    def _verify(self, at_once: bool) -> None:
        if self.serial_number and not self._is_verified():
            try:
                if at_once:
                    self.pace.count()
                    self._ask_status()
                else:
                    self.status()
            except RobotError as error:
                raise error.unsent() from None

    def _send(
        self,
        method: str,
        path: str,
        *,
        query: Mapping[str, str] | None = None,
        json: Any = None,
        is_wanted: Callable[[], bool] | None = None,
        with_credentials: bool = True,
    ) -> Response:
        """The answer, if its status is one of success. Raises RobotError."""
        try:
            answer = self._transport.send(
                method,
                path,
                query=query,
                json=json,
                timeout=self.timeouts,
                is_wanted=is_wanted,
                with_credentials=with_credentials,
            )
        except RobotError as error:
            self._verified_at = -math.inf  # what answers next may be another machine
            if type(error) is ConnectionLost and not (self._has_answered or self.address.is_secure):
                error = ConnectionLost(code="lost_over_http")
            raise error.at(self.address.netloc) from None
        self._has_answered = True
        status, address = answer.status, self.address.netloc
        if 200 <= status < 300:
            return answer
        if status < 200:
            raise Unreadable(address=address, problem=message("status {status}", status=status))
        if status < 400:
            target = clean(answer.headers.get("Location", ""), 100) or "elsewhere"
            raise NotAMir(code="redirected", address=address, target=target)
        if status in (401, 403):
            raise Unauthorized(status=status, address=address)
        robot_code, reason = self._error_of(answer)
        if status == 503:
            raise Busy(address=address, robot_code=robot_code, reason=reason)
        raise (Rejected if status < 500 else RobotFault)(
            status=status, robot_code=robot_code, reason=reason, address=address
        )

    def _error_of(self, answer: Response) -> tuple[str, str]:
        """``error_code`` and ``error_human`` of the error body, empty where there is none."""
        try:
            found = parse.loads(answer.body) if len(answer.body) <= LARGEST_OBJECT else None
        except Unreadable:
            return "", ""
        if not isinstance(found, dict):
            return "", ""
        return resolve(found.get("error_code"), 80), resolve(found.get("error_human"), 300)


def _again_if_stale(ask: Callable[[], T]) -> T:
    """A read once more, on a new connection, where the robot was just closing the open one."""
    try:
        return ask()
    except ConnectionLost as error:
        if not error.is_stale:
            raise
    return ask()


def _segment(identifier: str) -> str:
    """One segment of a path."""
    return quote(identifier, safe="", errors="replace")
