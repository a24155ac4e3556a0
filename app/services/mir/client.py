"""One MiR robot over its REST API v2.0.0.

A client is used by one thread at a time: its robot's lane, or one action of the operator. Every call raises RobotError and nothing else; what a failed
one may have done says ``error.delivery``. Calls that change something are never repeated here.
"""
from __future__ import annotations

import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from typing import Any
from urllib.parse import quote

from app.services.mir import parameters as mission_parameters
from app.services.mir import parse
from app.services.mir.address import Address
from app.services.mir.credentials import Token
from app.services.mir.errors import Busy, NotAMir, Rejected, RobotError, RobotFault, Unauthorized, Unreadable
from app.services.mir.texts import clean, resolve
from app.services.mir.transport import API, HttpTransport, Response, Timeouts, Transport
from app.services.mir.types import (
    Identity, MapPosition, MissionDetail, MissionInfo, MissionParameter, QueueItem, QueueState, Register, RobotMap, RobotState, RobotStatus,
)

PAGE = 200                  # queue items asked for at once
MOST_ITEMS = 5000           # looked through in one call; ids of 59,000 have been seen, so a whole history is never read
MOST_SINGLE_READS = 100     # items read one by one where the robot's lists are short
LONGEST_DESCRIPTION = 200   # of message and description (reference, section 3)
NOT_OFFERED = (400, 404, 405, 410, 501)      # how a robot may answer a feature it doesn't have


class RobotClient:
    """``clock`` is a monotonic clock in seconds, for the elapsed time of answers."""

    def __init__(self, address: Address, token: Token, *, certificate_sha256: str | None = None, transport: Transport | None = None,
                 clock: Callable[[], float] = time.monotonic, timeouts: Timeouts | None = None) -> None:
        self.address = address
        self._token, self._clock, self._timeouts = token, clock, timeouts or Timeouts()
        self._transport = transport or HttpTransport(address, token, certificate_sha256=certificate_sha256)
        self._has_search = True                       # until it says otherwise

    def close(self) -> None:
        self._transport.close()

    def __repr__(self) -> str:
        return f"RobotClient({self.address})"

    # ------------------------------------------------------------------ who and how
    def status(self) -> RobotStatus:
        """``/status``, which answers without credentials too. Raises NotAMir when something else answers."""
        began = self._clock()
        try:
            answer = self._request("GET", "/status")
        except Rejected as error:
            if error.status in (404, 405, 410):
                raise NotAMir(code="no_interface", address=self.address.netloc, status=error.status) from None
            raise
        return self._status(answer, self._clock() - began)

    def identify(self) -> Identity:
        """Status, and who we are to the robot, so that a wrong password shows; software version where the robot tells it."""
        status = self.status()
        user = ""
        try:
            me = self._json(self._request("GET", "/users/me"))
            me = me[0] if isinstance(me, list) and me else me       # the spec types single objects as lists
            user = clean(parse.object_(me, "the user").get("name"), 80)
        except Rejected:
            self._json(self._request("GET", "/mission_queue", query={"limit": "1"}))    # needs credentials as well
        return Identity(status, user, status.software or self._software())

    def _software(self) -> str | None:
        """From software 3.x on; older robots tell it in a header, if at all."""
        try:
            found = self._json(self._request("GET", "/software/system_status"))
        except (Rejected, Unreadable, RobotFault):
            return None
        found = found[0] if isinstance(found, list) and found else found
        return parse.text_or_none(found.get("application_version")) if isinstance(found, dict) else None

    # ------------------------------------------------------------------ missions
    def missions(self) -> list[MissionInfo]:
        """All missions of the site that the robot has."""
        return parse.listed(self._json(self._request("GET", "/missions")), "the mission list", parse.mission_info)

    def mission(self, guid: str) -> MissionDetail:
        """Raises Rejected with status 404 when the robot has no such mission."""
        return parse.mission_detail(self._json(self._request("GET", f"/missions/{_part(guid)}")))

    def parameters(self, guid: str) -> list[MissionParameter]:
        """What has to be given when this mission is queued; [] for most missions."""
        mission = self.mission(guid)
        if mission.has_user_parameters is False:
            return []
        own = f"/missions/{_part(guid)}"
        for url, read in ((mission.definition_url or f"{API}{own}/definition", mission_parameters.from_definition),
                          (mission.actions_url or f"{API}{own}/actions", mission_parameters.from_actions)):
            try:
                found = read(self._json(self._request("GET", url.removeprefix(API))))
            except Rejected as error:
                if error.status not in NOT_OFFERED:
                    raise
                continue
            if found:
                return found
        return []

    # ------------------------------------------------------------------ the queue
    def enqueue(self, mission_guid: str, *, description: str = "", message: str = "", priority: int = 0,
                parameters: Mapping[str, Any] | None = None) -> int:
        """Put a mission at the end of the robot's queue; the id of its item. Only 201 with an integer id counts as accepted."""
        body: dict[str, Any] = {"mission_id": mission_guid, "priority": priority}
        if description:
            body["description"] = description[:LONGEST_DESCRIPTION]
        if message:
            body["message"] = message[:LONGEST_DESCRIPTION]
        if parameters:
            body["parameters"] = [{"input_name": name, "value": value} for name, value in parameters.items()]
        answer = self._request("POST", "/mission_queue", json=body)
        if answer.status != 201:
            raise self._unreadable(f"status {answer.status} instead of 201")
        try:
            return parse.queue_id(self._json(answer))
        except NotAMir as error:
            raise self._unreadable("a web page instead of a queue number") from error

    def queue_item(self, queue_id: int) -> QueueItem:
        """Raises Rejected with status 404 when the robot has no such item (any more)."""
        return parse.queue_item(self._json(self._request("GET", f"/mission_queue/{queue_id}")))

    def open_items(self) -> list[QueueItem]:
        """Everything pending or executing, whoever put it there, by ascending id."""
        open_states = [QueueState.PENDING.value, QueueState.EXECUTING.value]
        items = self._search([{"fieldname": "state", "operator": "IN", "value": open_states}], 0, still_of_interest=_is_open)
        return [item for item in items if item.is_open]

    def items_after(self, id_floor: int) -> list[QueueItem]:
        """Every item with a higher id, by ascending id. Complete, or it raises: "not there" is a ground to send again."""
        return self._search([{"fieldname": "id", "operator": ">", "value": id_floor}], id_floor)

    def highest_queue_id(self) -> int | None:
        """Highest id in the queue's history, or where the robot can't sort, a lower one (which is safe to search from); None when empty."""
        newest = self._ids({"sort_by": "id,desc", "limit": "2"})
        if len(newest) == 2 and newest[0] < newest[1]:          # it doesn't sort; perhaps it doesn't page either
            newest += self._ids({})
        return max(newest, default=None)

    def cancel(self, queue_id: int) -> None:
        """Abort one item. It stays in the robot's list as Aborted."""
        self._request("DELETE", f"/mission_queue/{queue_id}")

    def clear_queue(self) -> None:
        """Abort everything pending and executing, whoever put it there."""
        self._request("DELETE", "/mission_queue")

    # ------------------------------------------------------------------ the robot
    def set_state(self, state: RobotState) -> RobotStatus | None:
        """READY: go on; PAUSE: pause what runs and hold the queue. The status afterwards, where the robot gives it."""
        if state not in (RobotState.READY, RobotState.PAUSE):
            raise ValueError(state)
        return self._put_status({"state_id": int(state)})

    def clear_error(self) -> RobotStatus | None:
        """Clear resettable errors. The robot then stands in Pause and does not move; going on is ``set_state(READY)``."""
        return self._put_status({"clear_error": True})

    def answer_prompt(self, guid: str, answer: str) -> RobotStatus | None:
        """Answer the question with this guid (``RobotStatus.user_prompt``)."""
        return self._put_status({"guid": guid, "answer": answer[:255]})

    def map(self, map_id: str) -> RobotMap:
        """Picture and scale of a map; ``RobotStatus.map_id`` is the current one."""
        return parse.robot_map(self._json(self._request("GET", f"/maps/{_part(map_id)}")))

    def positions(self, map_id: str | None = None) -> list[MapPosition]:
        """Named places, of one map or of all. Coordinates come along where the robot knows the whitelist."""
        path = f"/maps/{_part(map_id)}/positions" if map_id else "/positions"
        found = self._json(self._request("GET", path, query={"whitelist": "guid,name,type_id,map_id,pos_x,pos_y,orientation"}))
        return parse.listed(found, "the list of positions", lambda entry: parse.map_position(entry, map_id))

    def registers(self) -> list[Register]:
        return parse.listed(self._json(self._request("GET", "/registers")), "the list of registers", parse.register)

    # ------------------------------------------------------------------ reading the queue
    def _search(self, filters: Sequence[Mapping[str, Any]], floor: int,
                still_of_interest: Callable[[parse.Object], bool] = lambda entry: True) -> list[QueueItem]:
        """Items by the robot's search, or where it has none, from its list, newest first until a page has nothing of interest."""
        if self._has_search:
            try:
                return self._whole(self._pages(lambda query: self._request("POST", "/mission_queue/search", query=query,
                                                                           json={"filters": list(filters)}), floor), floor, still_of_interest)
            except Rejected as error:
                if error.status not in NOT_OFFERED:
                    raise
                self._has_search = False
        return self._whole(self._pages(lambda query: self._request("GET", "/mission_queue", query=query), floor, still_of_interest),
                           floor, still_of_interest)

    def _pages(self, ask: Callable[[dict[str, str]], Response], floor: int,
               still_of_interest: Callable[[parse.Object], bool] = lambda entry: True) -> Iterator[parse.Object]:
        """Each entry above the floor once. Knows robots that ignore whitelist, order, limit or offset (reference: "paging", R conflict)."""
        seen: set[int] = set()
        offset = 0
        while True:
            entries = parse.objects(self._json(ask({"whitelist": "all", "sort_by": "id,desc", "limit": str(PAGE), "offset": str(offset)})),
                                    "the mission queue")
            new = {parse.queue_id(entry): entry for entry in entries}
            fresh = [entry for number, entry in new.items() if number not in seen]
            seen |= new.keys()
            yield from (entry for entry in fresh if entry["id"] > floor)
            is_sorted = list(new) == sorted(new, reverse=True)
            reached_floor = is_sorted and bool(new) and min(new) <= floor
            if len(entries) != PAGE or not fresh or reached_floor or (is_sorted and not any(map(still_of_interest, fresh))):
                return
            offset += PAGE
            if offset >= MOST_ITEMS:
                raise self._unreadable(f"more than {MOST_ITEMS} queue items")

    def _whole(self, entries: Iterator[parse.Object], floor: int, wanted: Callable[[parse.Object], bool]) -> list[QueueItem]:
        """Items with all their fields; those that the list gave in short form are asked for by id."""
        found = [entry for entry in entries if wanted(entry)]
        short = [entry for entry in found if not parse.is_whole_item(entry)]
        if len(short) > MOST_SINGLE_READS:
            raise self._unreadable(f"{len(short)} queue items in short form")
        items = [self.queue_item(entry["id"]) if entry in short else parse.queue_item(entry) for entry in found]
        return sorted((item for item in items if item.id > floor), key=lambda item: item.id)

    def _ids(self, query: Mapping[str, str]) -> list[int]:
        return [parse.queue_id(entry) for entry in parse.objects(self._json(self._request("GET", "/mission_queue", query=query)),
                                                                 "the mission queue")]

    # ------------------------------------------------------------------ requests
    def _put_status(self, body: Mapping[str, Any]) -> RobotStatus | None:
        began = self._clock()
        answer = self._request("PUT", "/status", json=body)
        try:
            return self._status(answer, self._clock() - began)
        except (NotAMir, Unreadable):
            return None

    def _status(self, answer: Response, elapsed_s: float) -> RobotStatus:
        try:
            return parse.status(self._json(answer), software=clean(answer.header("Robot-Version"), 40) or None,
                                date=parse.http_date(answer.header("Date")), elapsed_s=elapsed_s)
        except NotAMir as error:
            raise self._named(error) from None

    def _request(self, method: str, path: str, *, query: Mapping[str, str] | None = None, json: Any = None) -> Response:
        """The answer, if its status is one of success. Raises RobotError."""
        answer = self._transport.send(method, path, query=query, json=json, timeout=self._timeouts)
        status, address = answer.status, self.address.netloc
        if 200 <= status < 300:
            return answer
        if status < 400:
            target = clean(answer.header("Location"), 100) or "elsewhere"
            raise NotAMir(code="redirected", address=address, target=self._token.hide_in(target))
        robot_code, reason = self._own_words(answer)
        if status in (401, 403):
            raise Unauthorized(status=status, address=address)
        if status == 503:
            raise Busy(address=address, robot_code=robot_code, reason=reason)
        kind = Rejected if status < 500 else RobotFault
        raise kind(status=status, robot_code=robot_code, reason=reason, address=address)

    def _own_words(self, answer: Response) -> tuple[str, str]:
        """``error_code`` and ``error_human`` of the error body, empty where there is none."""
        try:
            found = parse.loads(answer.body)
        except Unreadable:
            return "", ""
        if not isinstance(found, dict):
            return "", ""
        return clean(found.get("error_code"), 80), self._token.hide_in(resolve(found.get("error_human"), 300))

    def _json(self, answer: Response) -> Any:
        if parse.looks_like_web_page(answer.body):
            raise NotAMir(code="web_page", address=self.address.netloc)
        return parse.loads(answer.body)

    def _unreadable(self, problem: str) -> Unreadable:
        return Unreadable(address=self.address.netloc, problem=problem)

    def _named(self, error: RobotError) -> RobotError:
        return type(error)(code=error.code, **{**error.params, "address": self.address.netloc})


def _part(identifier: str) -> str:
    """One path segment."""
    return quote(identifier, safe="")


def _is_open(entry: parse.Object) -> bool:
    return parse.queue_item(entry).is_open
