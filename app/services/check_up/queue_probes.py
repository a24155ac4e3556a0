"""How the robot's queue can be read: search, order, pages, fields; its length, and its other users."""

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
from app.mir.raw_client import Answer
from app.mir.texts import clean
from app.services.check_up.session import CheckUpSession, Found, amber, green, red

PAGE = 200  # entries asked for at once, as the app does
FEW = 5
LATELY = timedelta(hours=2)  # by the robot's own clock: orders of others since then count
TOO_FEW = amber(
    "Not found out: too few missions are in its queue",
    "The app uses the careful way until then. Check up again when the robot has had some missions.",
)
SHARED = message(
    "A fleet or another program may queue missions too. Starts of this plan wait behind those of others in the "
    "robot's queue: let only one of them use this robot, or leave time between starts."
)


def queue(session: CheckUpSession) -> Found:
    """All that a client can know of the queue by reading it, search, pages and order among it."""
    answer = session.robot.get(session.robot.queue, sort_by="id,desc", limit=str(FEW))
    if answer.is_list and (answer.ids or not answer.found):
        return _QueueLists(session, answer.ids).look()
    for topic in (Topic.SEARCH, Topic.PAGING, Topic.SORTING):
        session.add(topic, amber("Not looked at, as the mission queue can't be read", "Check up again once it can."))
    return red(
        "The mission queue can't be read: {problem}",
        "Without it the app can't know whether a start arrived. Correct this before anything is scheduled.",
        problem=answer.problem if answer.error else message("its answer is no list of missions"),
    )


class _QueueLists:
    """``downwards``: ids as they come when the newest are asked for."""

    def __init__(self, session: CheckUpSession, downwards: list[int]) -> None:
        self._session, self._downwards = session, downwards
        self._upwards = self._ids(sort_by="id,asc", limit="1")
        seen = [*downwards, *self._upwards]
        self._oldest, self._newest = min(seen, default=0), max(seen, default=0)  # as far as a reader finds them
        self._is_sorted = downwards == sorted(downwards, reverse=True)
        self._ignores: set[str] = set()

    def _ids(self, **query: str) -> list[int]:
        return self._session.robot.get(self._session.robot.queue, **query).ids

    def look(self) -> Found:
        robot, page_of_newest = self._session.robot, 0 if self._is_sorted else self._find_newest()
        self._session.newest_id = self._newest
        self._session.add(Topic.SORTING, self._sorting())
        page = robot.get(robot.queue, whitelist="all", sort_by="id,desc", limit=str(PAGE))
        self._session.add(Topic.PAGING, self._paging(page))
        self._session.add(Topic.SEARCH, self._search())
        length = self._length()
        if self._ignores or len(page.ids) > 2:
            self._session.facts["ignores"] = frozenset(self._ignores)
        if self._newest not in page.ids and page_of_newest:
            page = robot.get(robot.queue, whitelist="all", limit=str(PAGE), offset=str(page_of_newest))
        if max(page.ids, default=0) >= self._newest:
            self._session.entries = page.rows
        return length

    def _find_newest(self) -> int:
        """At the other end of the list. Returns the offset of the page that has it."""
        found_at = 0
        for offset in range(0, 50 * PAGE, PAGE):
            highest = max(self._ids(limit=str(PAGE), offset=str(offset)), default=0)
            if highest <= self._newest:
                break
            self._newest, found_at = highest, offset
        return found_at

    def _sorting(self) -> Found:
        if self._is_sorted and (len(set(self._downwards)) < 2 or not self._upwards):
            return TOO_FEW
        if self._is_sorted and self._upwards[0] <= min(self._downwards):
            return green("Its lists are sorted as asked for, the newest first")
        self._ignores.add("sort_by")
        return amber(
            "It ignores the order that is asked for: the newest entries come first"
            if self._is_sorted
            else "It ignores the order that is asked for: the oldest entries come first",
            "The app finds new items by its search or by number, which takes some more requests. Nothing to do.",
        )

    def _paging(self, page: Answer) -> Found:
        ids = set(page.ids)
        if len(ids) > 2 and len(self._ids(limit="2")) > 2:
            self._ignores.add("limit")
        limit = len(ids) if 0 < len(ids) < PAGE and "limit" not in self._ignores and self._has_more_than(ids) else 0
        if len(ids) > 1 and self._same_with_offset():
            self._ignores.add("offset")
        if not all(parse.has_all_fields(entry) or "mission_id" in entry for entry in page.rows):
            self._ignores.add("whitelist")
        if limit > 1 or len(ids) >= PAGE:  # pages of one have no order
            self._session.facts["page_limit"] = limit
        if limit:
            return amber(
                "A list always has {n} entries at most",
                "The app reads page after page. Nothing to do.",
                n=limit,
            )
        if found := sorted(self._ignores & {"limit", "offset", "whitelist"}):
            return amber(
                "Its lists ignore {names}",
                "The app reads what it needs one by one, which takes longer after a lost answer. Nothing to do.",
                names=", ".join(found),
            )
        return TOO_FEW if len(ids) <= 2 else green("Its lists come in pages as asked for, with all fields")

    def _has_more_than(self, ids: set[int]) -> bool:
        """Whether its queue has more entries than it returned, although more were requested."""
        further = self._ids(sort_by="id,desc", limit="1", offset=str(len(ids)))
        return not ids.issuperset([*further, self._oldest, self._newest])

    def _same_with_offset(self) -> bool:
        first, second = (self._ids(sort_by="id,desc", limit="1", offset=offset) for offset in ("0", "1"))
        return first == second != []

    def _search(self) -> Found:
        after = {"fieldname": "id", "operator": ">", "value": max(0, self._newest - 1)}
        answer = self._session.robot.search(after, whitelist="all", sort_by="id,desc", limit="50")
        if answer.is_list and not self._newest:
            return TOO_FEW
        has_search = self._session.facts["has_search"] = self._newest in answer.ids
        if not has_search:
            return amber(
                "Its search does not find items that are in its queue"
                if answer.is_list
                else "Its queue can't be searched: {problem}",
                "The app reads the list instead, which takes longer where the queue is long. Nothing to do.",
                problem=answer.problem,
            )
        if min(answer.ids) < self._newest:
            self._ignores.add("filters")
            return amber(
                "Its search also returns items that were not asked for",
                "The app removes them itself, which takes longer where the queue is long. Nothing to do.",
            )
        return green("Its queue can be searched")

    def _length(self) -> Found:
        if not self._newest:
            return green("Its queue is empty, and can be read")
        ordered = parse.instant(
            self._session.robot.get(f"{self._session.robot.queue}/{self._oldest}").one.get("ordered")
        )
        return green(
            "Its queue goes from {oldest}, ordered on {day}, to {newest}"
            if ordered
            else "Its queue goes from {oldest} to {newest}",
            oldest=self._oldest,
            newest=self._newest,
            day=ordered and ordered.date().isoformat(),
        )


def others(session: CheckUpSession) -> Found:
    """Who else has put missions there recently, by the robot's own times."""
    if session.newest_id == 0:
        return green("Its queue is empty: not in use now")
    entries, user = session.entries, session.identity.user_name
    by_whom = [(parse.instant(entry.get("ordered")), _is_of_others(entry, user), entry) for entry in entries]
    times = [at for at, _theirs, _entry in by_whom if at is not None]
    since = _local_now(session, max(times)) - LATELY if times else datetime.min  # noqa: DTZ901  # of its own clock
    recent = [row for row in by_whom if row[0] is None or row[0] >= since]
    lately = [(at, entry) for at, theirs, entry in recent if theirs and at is not None]
    undated = sum(theirs is True for at, theirs, _entry in recent if at is None)
    if len(lately) > 1:
        return _often(lately)
    if lately:
        return amber("One mission of the last two hours is of {name}", SHARED, name=_name(lately[0][1]))
    if undated:
        return amber(
            "{n} of the newest {of} missions in its queue were queued by others. It does not report when",
            SHARED,
            n=undated,
            of=len(entries),
        )
    if not entries or any(theirs is None for _at, theirs, _entry in recent):
        return amber("Not found out: it does not say who queued the newest missions", SHARED)
    return green("Its queue has not been used by others recently")


def _often(lately: Sequence[tuple[datetime, Mapping[str, Any]]]) -> Found:
    [(name, _n)] = Counter(_name(entry) for _at, entry in lately).most_common(1)
    times = sorted(at for at, _entry in lately)
    every = median((after - before).total_seconds() for before, after in itertools.pairwise(times)) / 60
    return amber(
        "{n} missions of the last two hours are of others, most of them of {name}, one every {minutes} min",
        SHARED,
        n=len(lately),
        name=name,
        minutes=round(every, 1),
    )


def _name(entry: Mapping[str, Any]) -> str:
    return clean(entry.get("created_by_name"), 80) or "?"


def _is_of_others(entry: Mapping[str, Any], user: str) -> bool | None:
    """None: unknown."""
    name = clean(entry.get("created_by_name"), 80)
    if entry.get("fleet_schedule_guid"):
        return True
    return name != user if name and user else None


def _local_now(session: CheckUpSession, newest: datetime) -> datetime:
    """The robot's own time: from its zone and clock if known, else the time of its newest item."""
    zone, offset = session.facts.get("timezone"), session.facts.get("clock_offset")
    if zone is None or offset is None:
        return newest
    return (session.clock.now() + timedelta(seconds=offset)).astimezone(ZoneInfo(zone)).replace(tzinfo=None)
