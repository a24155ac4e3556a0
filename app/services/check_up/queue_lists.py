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

PAGE = 200  # entries asked for at once, as the app does
FEW = 5
LATELY = timedelta(hours=2)  # by the robot's own clock: orders of others since then count
FEW_MEANS = message("The app uses the careful way until then. Check up again when the robot has had some missions.")
SHARED = message(
    "A fleet or another program may queue by itself. Starts of this plan wait in the robot's queue behind what others put "
    "there: give this robot to one of them, or plan with room between starts."
)


class QueueLists:
    """``is_empty``: it was read, and nothing is in it."""

    def __init__(self, look: Look) -> None:
        self._look, self._probe = look, look.probe
        self._ignores: set[str] = set()
        self._oldest = self._newest = 0  # ids, as far as a reader finds them; 0: there is none
        self.is_empty = False
        self._first_of_last_page = 0  # where the newest entries are, if order is ignored

    def look(self) -> list[parse.Object]:
        """All that a client can know of it by reading; returns its newest items, whole where lists give them so."""
        plain = self._probe.queue(sort_by="id,desc", limit=str(FEW))
        if not plain.is_good or not isinstance(plain.found, list) or (plain.found and not ids_of(plain)):
            self._unreadable(plain)
            return []
        upwards = ids_of(self._probe.queue(sort_by="id,asc", limit="1"))
        self._find_ends(ids_of(plain), upwards)
        self.is_empty = not self._newest
        self._look_at_sorting(ids_of(plain), upwards)
        page = self._probe.queue(whitelist="all", sort_by="id,desc", limit=str(PAGE))
        is_found_out = self._look_at_pages(page)
        self._look_at_search()
        self._look_at_length()
        if self._ignores or is_found_out:
            self._look.seen["ignores"] = frozenset(self._ignores)
        return self._newest_of(page)

    def _unreadable(self, answer: Answer) -> None:
        problem = why(answer) or message("its answer is no list of missions")
        self._look.red(
            Topic.QUEUE,
            message("The mission queue can't be read: {problem}", problem=problem),
            message(
                "Without it the app can't tell whether a start arrived. Put this right before anything is scheduled."
            ),
        )
        for topic in (Topic.SEARCH, Topic.PAGING, Topic.SORTING):
            self._look.amber(
                topic,
                message("Not looked at, as the mission queue can't be read"),
                message("Check up again once it can."),
            )

    def _find_ends(self, downwards: list[int], upwards: list[int]) -> None:
        seen = [*downwards, *upwards]
        self._newest, self._oldest = max(seen, default=0), min(seen, default=0)
        if downwards != sorted(downwards, reverse=True):  # the newest are at the other end
            for offset in range(0, 50 * PAGE, PAGE):
                page = ids_of(self._probe.queue(limit=str(PAGE), offset=str(offset)))
                if not page or max(page) <= self._newest:
                    break
                self._newest, self._first_of_last_page = max(self._newest, *page), offset

    def _newest_of(self, page: Answer) -> list[parse.Object]:
        """[] where they can't be read."""
        if self._newest not in ids_of(page) and self._first_of_last_page:
            page = self._probe.queue(whitelist="all", limit=str(PAGE), offset=str(self._first_of_last_page))
        return page.rows if max(ids_of(page), default=0) >= self._newest else []

    def _look_at_sorting(self, downwards: list[int], upwards: list[int]) -> None:
        means = message(
            "The app finds what is new by its search or by number, which takes some more requests. Nothing to do."
        )
        if downwards != sorted(downwards, reverse=True):
            self._ignores.add("sort_by")
            self._look.amber(
                Topic.SORTING, message("It ignores the order that is asked for: the oldest entries come first"), means
            )
        elif len(set(downwards)) < 2 or not upwards:
            self._look.amber(Topic.SORTING, message("Not found out: too few missions are in its queue"), FEW_MEANS)
        elif upwards[0] > min(downwards):
            self._ignores.add("sort_by")
            self._look.amber(
                Topic.SORTING, message("It ignores the order that is asked for: the newest entries come first"), means
            )
        else:
            self._look.green(Topic.SORTING, message("Its lists are sorted as asked for, the newest first"))

    def _look_at_pages(self, page: Answer) -> bool:
        """Whether all was found out."""
        ids = set(ids_of(page))
        if len(ids) > 2 and len(ids_of(self._probe.queue(limit="2"))) > 2:
            self._ignores.add("limit")
        limit = len(ids) if 0 < len(ids) < PAGE and "limit" not in self._ignores and self._has_more_than(ids) else 0
        if len(ids) > 1 and self._same_with_offset():
            self._ignores.add("offset")
        if not all(parse.is_whole_item(entry) or "mission_id" in entry for entry in page.rows):
            self._ignores.add("whitelist")
        if limit > 1 or len(ids) >= PAGE:  # pages of one have no order
            self._look.seen["page_limit"] = limit
        if limit:
            self._look.amber(
                Topic.PAGING,
                message("A list has {n} entries at most, whatever is asked for", n=limit),
                message("The app reads page after page. Nothing to do."),
            )
        elif found := sorted(self._ignores & {"limit", "offset", "whitelist"}):
            self._look.amber(
                Topic.PAGING,
                message("Its lists ignore {names}", names=", ".join(found)),
                message(
                    "The app reads what it needs one by one, which takes longer after a lost answer. Nothing to do."
                ),
            )
        elif len(ids) <= 2:
            self._look.amber(Topic.PAGING, message("Not found out: too few missions are in its queue"), FEW_MEANS)
        else:
            self._look.green(Topic.PAGING, message("Its lists come in pages as asked for, with all fields"))
        return len(ids) > 2

    def _has_more_than(self, ids: set[int]) -> bool:
        """Whether its queue has entries besides those that came though more were asked for."""
        further = ids_of(self._probe.queue(sort_by="id,desc", limit="1", offset=str(len(ids))))
        return not ids.issuperset([*further, self._oldest, self._newest])

    def _same_with_offset(self) -> bool:
        first, second = (
            ids_of(self._probe.queue(sort_by="id,desc", limit="1", offset=offset)) for offset in ("0", "1")
        )
        return bool(first) and first == second

    def _look_at_search(self) -> None:
        floor = self._newest - 1
        answer = self._probe.search(
            [{"fieldname": "id", "operator": ">", "value": max(0, floor)}],
            whitelist="all",
            sort_by="id,desc",
            limit="50",
        )
        has_search = answer.is_good and isinstance(answer.found, list)
        if not has_search:
            problem = why(answer) or message("its answer is no list")
            self._look.amber(
                Topic.SEARCH,
                message("Its queue can't be searched: {problem}", problem=problem),
                message("The app reads the list instead, which takes longer where the queue is long. Nothing to do."),
            )
        elif self.is_empty:
            self._look.amber(Topic.SEARCH, message("Not found out: too few missions are in its queue"), FEW_MEANS)
            return
        elif self._newest not in ids_of(answer):
            has_search = False
            self._look.amber(
                Topic.SEARCH,
                message("Its search does not find what is in its queue"),
                message("The app reads the list instead, which takes longer where the queue is long. Nothing to do."),
            )
        elif any(number <= floor for number in ids_of(answer)):
            self._ignores.add("filters")
            self._look.amber(
                Topic.SEARCH,
                message("Its search gives what it was not asked for"),
                message("The app sorts that out by itself, which takes longer where the queue is long. Nothing to do."),
            )
        else:
            self._look.green(Topic.SEARCH, message("Its queue can be searched"))
        self._look.seen["has_search"] = has_search

    def _look_at_length(self) -> None:
        if self.is_empty:
            self._look.green(Topic.QUEUE, message("Its queue is empty, and can be read"))
            return
        first = parse.instant(self._probe.get(f"/mission_queue/{self._oldest}").one.get("ordered"))
        if first is None:
            self._look.green(
                Topic.QUEUE,
                message("Its queue goes from {oldest} to {newest}", oldest=self._oldest, newest=self._newest),
            )
        else:
            self._look.green(
                Topic.QUEUE,
                message(
                    "Its queue goes from {oldest}, ordered on {day}, to {newest}",
                    oldest=self._oldest,
                    newest=self._newest,
                    day=first.date().isoformat(),
                ),
            )


def look_at_others(look: Look, entries: Sequence[parse.Object], user: str, *, is_empty: bool = False) -> None:
    """Who else has put missions there recently, by the robot's own times. ``entries``: the newest, [] where they can't be read;
    ``user``: who we are to it; ``is_empty``: nothing is in its queue."""
    if is_empty:
        look.green(Topic.OTHERS, message("Its queue is empty: nobody uses it just now"))
        return
    by_whom = [(parse.instant(entry.get("ordered")), _is_of_others(entry, user), entry) for entry in entries]
    since = (
        _local_now(look, max(times)) - LATELY
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
        _tell_others(look, lately)
    elif lately:
        look.amber(
            Topic.OTHERS, message("One mission of the last two hours is of {name}", name=_name(lately[0][1])), SHARED
        )
    elif undated:
        look.amber(
            Topic.OTHERS,
            message(
                "{n} of the newest {of} missions in its queue were queued by others; it does not tell when they "
                "were queued",
                n=undated,
                of=len(entries),
            ),
            SHARED,
        )
    elif is_unclear or not entries:
        look.amber(Topic.OTHERS, message("Not found out: who queued the newest missions can't be told"), SHARED)
    else:
        look.green(Topic.OTHERS, message("Nobody else has used its queue recently"))


def _tell_others(look: Look, lately: Sequence[tuple[datetime, parse.Object]]) -> None:
    [(name, _n)] = Counter(_name(entry) for _at, entry in lately).most_common(1)
    times = sorted(at for at, _entry in lately)
    every = median((after - before).total_seconds() for before, after in itertools.pairwise(times)) / 60
    look.amber(
        Topic.OTHERS,
        message(
            "{n} missions of the last two hours are of others, most of them of {name}, one every {minutes} min",
            n=len(lately),
            name=name,
            minutes=round(every, 1),
        ),
        SHARED,
    )


def _name(entry: parse.Object) -> str:
    return clean(entry.get("created_by_name"), 80) or "?"


def _is_of_others(entry: parse.Object, user: str) -> bool | None:
    """None: it can't be told."""
    name = clean(entry.get("created_by_name"), 80)
    if entry.get("fleet_schedule_guid"):
        return True
    return name != user if name and user else None


def _local_now(look: Look, newest: datetime) -> datetime:
    """The robot's own time as its items tell it: by its zone and clock, where they are known, else that of its newest item."""
    zone, offset = look.seen.get("timezone"), look.seen.get("clock_offset")
    if zone is None or offset is None:
        return newest
    return (look.now() + timedelta(seconds=offset)).astimezone(ZoneInfo(zone)).replace(tzinfo=None)
