"""One MiR robot over its REST API v2.0.0.

A client is used by one thread at a time: its robot's worker, or one action of the operator. Every call raises only
RobotError; ``error.delivery`` says what a failed one may have done. Calls that change something are never repeated
here.
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Mapping
from typing import Any

from app.domain.capabilities import OF_A_ROBOT, Capabilities
from app.domain.message import message
from app.domain.robot import (
    IdentifiedBy,
    Identity,
    QueueItem,
    RobotState,
    RobotStatus,
)
from app.mir import parse, robot_vocabulary
from app.mir.errors import (
    AnotherRobotDidIt,
    NotAMir,
    Refusal,
    Rejected,
    Unreadable,
)
from app.mir.texts import clean
from app.mir.transport import OF_ALL, OF_STATUS, Response
from app.mir.verified_requests import VerifiedRequests


class RobotClient(VerifiedRequests):
    """The app's requests and commands to a robot. It is a ``Target``."""

    capabilities: Capabilities = OF_A_ROBOT

    # ------------------------------------------------------------------ who it is
    def identify(self) -> Identity:
        """Status, and the app's user at the robot, to detect a wrong password (Unauthorized); the software version if
        known."""
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
        """Put a mission at the end of the robot's queue; returns the id of its item. ``is_wanted`` is called when the
        connection is open, as the tablet may have slept before: if not, raises NotWanted, and nothing was sent.
        """
        try:
            body = robot_vocabulary.order(mission_guid, description, text, priority, parameters or {})
        except (TypeError, ValueError, RecursionError):
            raise Rejected(
                status=400, reason=message("a parameter can't be written as JSON"), address=self.address.netloc
            ) from None
        self.pace.wait(OF_ALL)
        self._verify(OF_STATUS)
        answer = self._send("POST", "/mission_queue", json=body, is_wanted=is_wanted)
        return self._number_of_new(answer)

    def queue_item(self, queue_id: int, token: str = "") -> QueueItem:
        """Raises Rejected with status 404 when the robot has no such item (any more)."""
        item = self._get(f"/mission_queue/{queue_id}", lambda found: parse.queue_item(self._in_mir_words(found)))
        self._queue.saw(item)
        return item

    def open_items(self) -> list[QueueItem]:
        """Everything pending or executing, of the app and of others, by ascending id."""
        return self._queue.open_items()

    def items_after(
        self,
        id_floor: int,
        known: dict[int, QueueItem | None] | None = None,
        highest: int = 0,
        tokens: Collection[str] = (),
    ) -> list[QueueItem]:
        """Every item with a higher id, by ascending id. Returns all of them or raises, as a missing item is a reason to
        send again. ``known``: items (None: missing) that need not be read one by one; newly read ones are added to it,
        so that the next call continues. ``highest``: an existing id, below which the reading must not stop.
        """
        return self._queue.items_after(id_floor, known, highest)

    def highest_queue_id(self) -> int | None:
        """Highest id in the queue's history; if the robot can't sort, perhaps a lower one, which is safe to search
        from. None: empty."""
        return self._queue.highest_id()

    def newest_id(self, token: str = "") -> int | None:
        return self.highest_queue_id()

    def cancel(self, queue_id: int, token: str = "") -> None:
        """Abort one item. It stays in the robot's list as Aborted."""
        self._order("DELETE", f"/mission_queue/{queue_id}")

    def clear_queue(self, own: Mapping[int, str] | None = None) -> None:
        """Abort everything pending and executing, of the app and of others."""
        self._order("DELETE", "/mission_queue")

    # ------------------------------------------------------------------ the robot
    def set_state(self, state: RobotState) -> RobotStatus | None:
        """READY: continue; PAUSE: pause the running mission and hold the queue. Returns the new status, if the robot
        gives it."""
        return self._put_status({"state_id": int(state)})

    def clear_error(self) -> RobotStatus | None:
        """Clear resettable errors. The robot is then in Pause and does not move; ``set_state(READY)`` continues."""
        return self._put_status({"clear_error": True})

    def answer_prompt(self, guid: str, answer: str) -> RobotStatus | None:
        """Answer the question with this guid (``RobotStatus.user_prompt``)."""
        return self._put_status({"guid": guid, "answer": answer})

    # ------------------------------------------------------------------ requests
    def ask(self, method: str, path: str, *, query: Mapping[str, str] | None = None, json: Any = None) -> Response:
        """Any request, for a check-up: an answer of success as it came. Raises RobotError."""
        return self._request(method, path, query=query, json=json)

    def _put_status(self, body: Mapping[str, Any]) -> RobotStatus | None:
        began = self._clock()
        answer = self._order("PUT", "/status", body)
        try:
            status = self._status(answer, self._clock() - began)
        except (NotAMir, Unreadable):
            return None
        self._check_serial_number(status, AnotherRobotDidIt)
        return status
