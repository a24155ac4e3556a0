"""How the robot's queue can be read: search, order, pages, fields; how long it is, and who else uses it."""

from __future__ import annotations

import itertools
from collections import Counter
from collections.abc import Mapping, Sequence
from datetime import datetime, timedelta
from statistics import median
from typing import Any
from zoneinfo import ZoneInfo

from app.domain.check_up import Topic
from app.domain.message import message
from app.mir import parse
from app.mir.raw_client import Answer, ids_of
from app.mir.texts import clean
from app.services.check_up.session import CheckUpSession, Found, amber, green, probe, red, why

PAGE = 200  # entries asked for at once, as the app does
FEW = 5
LATELY = timedelta(hours=2)  # by the robot's own clock: orders of others since then count
TOO_FEW = amber(
    message("Not found out: too few missions are in its queue"),
    message("The app uses the careful way until then. Check up again when the robot has had some missions."),
)
SHARED = message(
    "A fleet or another program may queue by itself. Starts of this plan wait in the robot's queue behind what others put "
    "there: give this robot to one of them, or plan with room between starts."
)


def look_at_queue(session: CheckUpSession) -> None:
    """All that a client can know of the queue by reading it."""
    answer = session.robot.queue(sort_by="id,desc", limit=str(FEW))
    if answer.is_list and (ids_of(answer) or not answer.found):
        _QueueLists(session, ids_of(answer)).look()
        return
    session.add(
        Topic.QUEUE,
        red(
            message(
                "The mission queue can't be read: {problem}",
                problem=why(answer) if answer.error else message("its answer is no list of missions"),
            ),
            message(
                "Without it the app can't tell whether a start arrived. Put this right before anything is scheduled."
            ),
        ),
    )
    for topic in (Topic.SEARCH, Topic.PAGING, Topic.SORTING):
        session.add(
            topic,
            amber(message("Not looked at, as the mission queue can't be read"), message("Check up again once it can.")),
        )


class _QueueLists:
    """``downwards``: ids as they come when the newest are asked for."""

    def __init__(self, session: CheckUpSession, downwards: list[int]) -> None:
        self._session, self._robot, self._downwards = session, session.robot, downwards
        self._upwards = ids_of(self._robot.queue(sort_by="id,asc", limit="1"))
        # Ids, as far as a reader finds them; 0: there is none.
        self._oldest, self._newest = (
            min([*downwards, *self._upwards], default=0),
            max([*downwards, *self._upwards], default=0),
        )
        self._is_sorted = downwards == sorted(downwards, reverse=True)
        self._ignores: set[str] = set()

    def look(self) -> None:
        page_of_newest = 0 if self._is_sorted else self._find_newest()
        self._session.newest_id = self._newest
        self._session.add(Topic.SORTING, self._sorting())
        page = self._robot.queue(whitelist="all", sort_by="id,desc", limit=str(PAGE))
        self._session.add(Topic.PAGING, self._paging(page))
        self._session.add(Topic.SEARCH, self._search())
        self._session.add(Topic.QUEUE, self._length())
        if self._ignores or len(ids_of(page)) > 2:
            self._session.facts["ignores"] = frozenset(self._ignores)
        if self._newest not in ids_of(page) and page_of_newest:
            page = self._robot.queue(whitelist="all", limit=str(PAGE), offset=str(page_of_newest))
        if max(ids_of(page), default=0) >= self._newest:
            self._session.entries = page.rows

    def _find_newest(self) -> int:
        """At the other end of the list. Returns the offset of the page that has it."""
        found_at = 0
        for offset in range(0, 50 * PAGE, PAGE):
            page = ids_of(self._robot.queue(limit=str(PAGE), offset=str(offset)))
            if not page or max(page) <= self._newest:
                break
            self._newest, found_at = max(self._newest, *page), offset
        return found_at

    def _sorting(self) -> Found:
        if not self._is_sorted:
            says = message("It ignores the order that is asked for: the oldest entries come first")
        elif len(set(self._downwards)) < 2 or not self._upwards:
            return TOO_FEW
        elif self._upwards[0] > min(self._downwards):
            says = message("It ignores the order that is asked for: the newest entries come first")
        else:
            return green(message("Its lists are sorted as asked for, the newest first"))
        self._ignores.add("sort_by")
        return amber(
            says,
            message(
                "The app finds what is new by its search or by number, which takes some more requests. Nothing to do."
            ),
        )

    def _paging(self, page: Answer) -> Found:
        ids = set(ids_of(page))
        if len(ids) > 2 and len(ids_of(self._robot.queue(limit="2"))) > 2:
            self._ignores.add("limit")
        limit = len(ids) if 0 < len(ids) < PAGE and "limit" not in self._ignores and self._has_more_than(ids) else 0
        if len(ids) > 1 and self._same_with_offset():
            self._ignores.add("offset")
        if not all(parse.is_whole_item(entry) or "mission_id" in entry for entry in page.rows):
            self._ignores.add("whitelist")
        if limit > 1 or len(ids) >= PAGE:  # pages of one have no order
            self._session.facts["page_limit"] = limit
        if limit:
            return amber(
                message("A list has {n} entries at most, whatever is asked for", n=limit),
                message("The app reads page after page. Nothing to do."),
            )
        if found := sorted(self._ignores & {"limit", "offset", "whitelist"}):
            return amber(
                message("Its lists ignore {names}", names=", ".join(found)),
                message(
                    "The app reads what it needs one by one, which takes longer after a lost answer. Nothing to do."
                ),
            )
        return TOO_FEW if len(ids) <= 2 else green(message("Its lists come in pages as asked for, with all fields"))

    def _has_more_than(self, ids: set[int]) -> bool:
        """Whether its queue has entries besides those that came though more were asked for."""
        further = ids_of(self._robot.queue(sort_by="id,desc", limit="1", offset=str(len(ids))))
        return not ids.issuperset([*further, self._oldest, self._newest])

    def _same_with_offset(self) -> bool:
        first, second = (
            ids_of(self._robot.queue(sort_by="id,desc", limit="1", offset=offset)) for offset in ("0", "1")
        )
        return bool(first) and first == second

    def _search(self) -> Found:
        answer = self._robot.search(
            [{"fieldname": "id", "operator": ">", "value": max(0, self._newest - 1)}],
            whitelist="all",
            sort_by="id,desc",
            limit="50",
        )
        if answer.is_list and not self._newest:
            return TOO_FEW
        self._session.facts["has_search"] = self._newest in ids_of(answer) and answer.is_list
        if not self._session.facts["has_search"]:
            return amber(
                message("Its search does not find what is in its queue")
                if answer.is_list
                else message("Its queue can't be searched: {problem}", problem=why(answer)),
                message("The app reads the list instead, which takes longer where the queue is long. Nothing to do."),
            )
        if min(ids_of(answer)) < self._newest:
            self._ignores.add("filters")
            return amber(
                message("Its search gives what it was not asked for"),
                message("The app sorts that out by itself, which takes longer where the queue is long. Nothing to do."),
            )
        return green(message("Its queue can be searched"))

    def _length(self) -> Found:
        if not self._newest:
            return green(message("Its queue is empty, and can be read"))
        first = parse.instant(self._robot.get(f"/mission_queue/{self._oldest}").one.get("ordered"))
        ends = {"oldest": self._oldest, "newest": self._newest}
        return green(
            message("Its queue goes from {oldest} to {newest}", **ends)
            if first is None
            else message(
                "Its queue goes from {oldest}, ordered on {day}, to {newest}", day=first.date().isoformat(), **ends
            )
        )


@probe(Topic.OTHERS)
def others(session: CheckUpSession) -> Found:
    """Who else has put missions there recently, by the robot's own times."""
    if session.newest_id == 0:
        return green(message("Its queue is empty: nobody uses it just now"))
    entries, user = session.entries, session.identity.user_name
    by_whom = [(parse.instant(entry.get("ordered")), _is_of_others(entry, user), entry) for entry in entries]
    since = (
        _local_now(session, max(times)) - LATELY
        if (times := [at for at, _theirs, _entry in by_whom if at is not None])
        else None
    )
    lately = [
        (at, entry) for at, theirs, entry in by_whom if theirs and at is not None and since is not None and at >= since
    ]
    undated = sum(theirs is True for at, theirs, _entry in by_whom if at is None)
    is_unclear = any(
        theirs is None if at is None or since is None else theirs is None and at >= since
        for at, theirs, _entry in by_whom
    )
    if len(lately) > 1:
        return _often(lately)
    if lately:
        return amber(message("One mission of the last two hours is of {name}", name=_name(lately[0][1])), SHARED)
    if undated:
        return amber(
            message(
                "{n} of the newest {of} missions in its queue were queued by others; it does not tell when they "
                "were queued",
                n=undated,
                of=len(entries),
            ),
            SHARED,
        )
    if is_unclear or not entries:
        return amber(message("Not found out: who queued the newest missions can't be told"), SHARED)
    return green(message("Nobody else has used its queue recently"))


def _often(lately: Sequence[tuple[datetime, Mapping[str, Any]]]) -> Found:
    [(name, _n)] = Counter(_name(entry) for _at, entry in lately).most_common(1)
    times = sorted(at for at, _entry in lately)
    every = median((after - before).total_seconds() for before, after in itertools.pairwise(times)) / 60
    return amber(
        message(
            "{n} missions of the last two hours are of others, most of them of {name}, one every {minutes} min",
            n=len(lately),
            name=name,
            minutes=round(every, 1),
        ),
        SHARED,
    )


def _name(entry: Mapping[str, Any]) -> str:
    return clean(entry.get("created_by_name"), 80) or "?"


def _is_of_others(entry: Mapping[str, Any], user: str) -> bool | None:
    """None: it can't be told."""
    name = clean(entry.get("created_by_name"), 80)
    if entry.get("fleet_schedule_guid"):
        return True
    return name != user if name and user else None


def _local_now(session: CheckUpSession, newest: datetime) -> datetime:
    """The robot's own time as its items tell it: by its zone and clock, where they are known, else that of its newest item."""
    zone, offset = session.facts.get("timezone"), session.facts.get("clock_offset")
    if zone is None or offset is None:
        return newest
    return (session.now() + timedelta(seconds=offset)).astimezone(ZoneInfo(zone)).replace(tzinfo=None)
