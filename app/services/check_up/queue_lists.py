"""How the robot's queue can be read: search, order, pages, fields; how long it is, and who else uses it."""
from __future__ import annotations

import itertools
from collections import Counter
from collections.abc import Sequence
from datetime import datetime, timedelta
from statistics import median
from zoneinfo import ZoneInfo

from app.domain.check_up import Topic
from app.domain.message import message
from app.mir import parse
from app.mir.probe import Answer, ids_of
from app.mir.texts import clean
from app.services.check_up.look import Look, why

PAGE = 200                   # entries asked for at once, as the app does
FEW = 5
LATELY = timedelta(hours=2)              # by the robot's own clock: orders of others since then count
OTHERS_TO_TELL = 2           # orders


class QueueLists:
    """``user``: who we are to the robot."""

    def __init__(self, look: Look, user: str) -> None:
        self._look, self._probe, self._user = look, look.probe, user
        self._ignores: set[str] = set()

    def look(self) -> list[parse.Object]:
        """All that a client can know of it by reading; returns its newest items, whole where lists give them so."""
        plain = self._probe.queue(sort_by="id,desc", limit=str(FEW))
        if not plain.is_good or not isinstance(plain.found, list) or (plain.found and not ids_of(plain)):
            self._unreadable(plain)
            return []
        newest, oldest = self._ends(plain)
        self._look_at_sorting(plain)
        entries = self._look_at_pages(newest, oldest)
        self._look_at_search(newest, oldest)
        self._look_at_length(newest, oldest)
        self._look.seen["ignores"] = frozenset(self._ignores)
        return entries

    def _unreadable(self, answer: Answer) -> None:
        problem = why(answer) or message("its answer is no list of missions")
        self._look.red(Topic.QUEUE, message("The mission queue can't be read: {problem}", problem=problem),
                       message("Without it the app can't tell whether a start arrived. Put this right before anything is scheduled."))
        for topic in (Topic.SEARCH, Topic.PAGING, Topic.SORTING):
            self._look.amber(topic, message("Not looked at, as the mission queue can't be read"), message("Check up again once it can."))

    def _ends(self, plain: Answer) -> tuple[int, int]:
        """The highest and the lowest id that a reader can find; 0: its queue is empty."""
        first = ids_of(self._probe.queue(sort_by="id,asc", limit="1"))
        seen = ids_of(plain) + first
        newest = max(seen, default=0)
        if ids_of(plain) != sorted(ids_of(plain), reverse=True):               # the newest are at the other end
            for offset in range(0, 50 * PAGE, PAGE):
                page = ids_of(self._probe.queue(limit=str(PAGE), offset=str(offset)))
                if not page or max(page) <= newest:
                    break
                newest = max(newest, *page)
        return newest, min(seen, default=0)

    def _look_at_sorting(self, plain: Answer) -> None:
        ids = ids_of(plain)
        if ids == sorted(ids, reverse=True):
            self._look.green(Topic.SORTING, message("Its lists are sorted as asked for, the newest first"))
            return
        self._ignores.add("sort_by")
        self._look.amber(Topic.SORTING, message("It ignores the order that is asked for: the oldest entries come first"),
                         message("The app finds what is new by its search or by number, which takes some more requests. Nothing to do."))

    def _look_at_pages(self, newest: int, oldest: int) -> list[parse.Object]:
        page = self._probe.queue(whitelist="all", sort_by="id,desc", limit=str(PAGE))
        ids, there = ids_of(page), newest - oldest + 1
        limit = 0
        if there > FEW and len(ids_of(self._probe.queue(limit="2"))) > 2:
            self._ignores.add("limit")
        elif len(ids) < min(PAGE, there) and self._has_more(len(ids)):
            limit = len(ids)
        if there > FEW and self._same_with_offset():
            self._ignores.add("offset")
        is_whole = not page.rows or all(parse.is_whole_item(entry) or "mission_id" in entry for entry in page.rows)
        if not is_whole:
            self._ignores.add("whitelist")
        self._look.seen["page_limit"] = limit if limit > 1 or (not limit and there >= PAGE) else None        # pages of one have no order
        if limit:
            self._look.amber(Topic.PAGING, message("A list has {n} entries at most, whatever is asked for", n=limit),
                             message("The app reads page after page. Nothing to do."))
        elif found := sorted(self._ignores & {"limit", "offset", "whitelist"}):
            self._look.amber(Topic.PAGING, message("Its lists ignore {names}", names=", ".join(found)),
                             message("The app reads what it needs one by one, which takes longer after a lost answer. Nothing to do."))
        else:
            self._look.green(Topic.PAGING, message("Its lists come in pages as asked for, with all fields"))
        return page.rows

    def _has_more(self, n: int) -> bool:
        """Whether entries follow after the first so many."""
        return bool(ids_of(self._probe.queue(sort_by="id,desc", limit="1", offset=str(n))))

    def _same_with_offset(self) -> bool:
        first, second = (ids_of(self._probe.queue(sort_by="id,desc", limit="1", offset=offset)) for offset in ("0", "1"))
        return bool(first) and first == second

    def _look_at_search(self, newest: int, oldest: int) -> None:
        floor = max(newest - 2, oldest)
        answer = self._probe.search([{"fieldname": "id", "operator": ">", "value": floor}], whitelist="all", sort_by="id,desc", limit="50")
        self._look.seen["has_search"] = answer.is_good and isinstance(answer.found, list)
        if not self._look.seen["has_search"]:
            problem = why(answer) or message("its answer is no list")
            self._look.amber(Topic.SEARCH, message("Its queue can't be searched: {problem}", problem=problem),
                             message("The app reads the list instead, which takes longer where the queue is long. Nothing to do."))
        elif newest and any(number <= floor for number in ids_of(answer)):
            self._ignores.add("filters")
            self._look.amber(Topic.SEARCH, message("Its search gives what it was not asked for"),
                             message("The app sorts that out by itself, which takes longer where the queue is long. Nothing to do."))
        else:
            self._look.green(Topic.SEARCH, message("Its queue can be searched"))

    def _look_at_length(self, newest: int, oldest: int) -> None:
        if not newest:
            self._look.green(Topic.QUEUE, message("Its queue has never had a mission"))
            return
        first = parse.instant(self._probe.get(f"/mission_queue/{oldest}").one.get("ordered"))
        if first is None:
            self._look.green(Topic.QUEUE, message("Its queue goes from {oldest} to {newest}", oldest=oldest, newest=newest))
        else:
            self._look.green(Topic.QUEUE, message("Its queue goes from {oldest}, ordered on {day}, to {newest}", oldest=oldest,
                                                  newest=newest, day=first.date().isoformat()))


def look_at_others(look: Look, entries: Sequence[parse.Object], user: str) -> None:
    """Who else has put missions there of late, by the robot's own times; ``user`` is who we are to it."""
    dated = [(at, entry) for entry in entries if (at := parse.instant(entry.get("ordered"))) is not None]
    if not dated:
        look.green(Topic.OTHERS, message("Nobody else has used its queue of late"))
        return
    since = _local_now(look, max(at for at, _entry in dated)) - LATELY
    lately = [(at, entry) for at, entry in dated if at >= since and _is_of_others(entry, user)]
    if len(lately) < OTHERS_TO_TELL:
        look.green(Topic.OTHERS, message("Nobody else has used its queue of late"))
        return
    [(name, _n)] = Counter(clean(entry.get("created_by_name"), 80) or "?" for _at, entry in lately).most_common(1)
    times = sorted(at for at, _entry in lately)
    every = median((after - before).total_seconds() for before, after in itertools.pairwise(times)) / 60
    look.amber(Topic.OTHERS, message("{n} missions of the last two hours are of others, most of them of {name}, one every {minutes} min",
                                     n=len(lately), name=name, minutes=round(every, 1)),
               message("A fleet or another program may queue by itself. Starts of this plan wait in the robot's queue behind what others "
                       "put there: give this robot to one of them, or plan with room between starts."))


def _is_of_others(entry: parse.Object, user: str) -> bool:
    name = clean(entry.get("created_by_name"), 80)
    return bool(entry.get("fleet_schedule_guid")) or bool(user and name and name != user)


def _local_now(look: Look, newest: datetime) -> datetime:
    """The robot's own time as its items tell it: by its zone and clock, where they are known, else that of its newest item."""
    zone, offset = look.seen.get("timezone"), look.seen.get("clock_offset")
    if zone is None or offset is None:
        return newest
    return (look.now() + timedelta(seconds=offset)).astimezone(ZoneInfo(zone)).replace(tzinfo=None)
