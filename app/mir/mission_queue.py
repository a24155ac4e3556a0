"""Reading a queue whose history may have tens of thousands of items, on robots that know more or less of filters, order
and paging.

MiR's manual describes search, order and paging, and clients on robots use them; but one robot (2.13.1.4) was reported
to page its bare list too, and recorded lists give short items. So nothing is assumed: the newest items may be missing
in a bare list, order is checked, missing items are read one by one, and a queue that can't be read completely within
bounds raises an error.
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterator, Mapping, Sequence
from typing import Any

from app.domain.check_up import NOTHING_KNOWN, RobotProfile
from app.domain.message import message
from app.domain.robot import QueueItem, QueueState
from app.mir import parse
from app.mir.errors import Refusal, Rejected, RobotFault, Unreadable
from app.mir.target import Known

OPEN_STATES = [state.value for state in QueueState if state.is_open]
RUN_STATES = [*OPEN_STATES, QueueState.DONE.value]  # a robot with a word of its own for one of them has others too
PAGE = 200  # items asked for at once
MOST_ITEMS = 5000  # read in one call
MOST_SINGLE_READS = 100  # asked for one by one in one call, where the robot's lists are short
LONGEST_STEP = 2**20  # between two numbers that are tried
MISSING_IN_A_ROW = 5  # numbers: items may have been deleted
UNSUPPORTED = (400, 404, 405, 410, 501)  # how a robot may answer a feature that it doesn't have

Ask = Callable[[str, str, Mapping[str, str], Any], list[parse.Object]]
Wanted = Callable[[parse.Object], bool]


class QueueReader:
    """``ask(method, path, query, json)`` gives the entries of a list, ``read_item`` one whole item; both raise RobotError.
    ``path``: of the list."""

    def __init__(
        self,
        ask: Ask,
        read_item: Callable[[int], QueueItem],
        path: str = "/mission_queue",
        known: RobotProfile = NOTHING_KNOWN,
    ) -> None:
        self._ask, self._read_item, self._path = ask, read_item, path
        self.use_profile(known)
        self._does_sort = True  # the newest of its list came first, when it was read last
        self._is_complete = True  # and then everything was read
        self._climbed = 0  # highest id seen, where it doesn't sort

    def use_profile(self, known: RobotProfile) -> None:
        self._has_search, words = known.has_search, known.item_states  # None: not known yet
        own = [word for word, state in words.items() if state in OPEN_STATES]
        are_all = {words[word] for word in own} == set(OPEN_STATES)
        self._open_states = own if are_all else OPEN_STATES  # the robot's words for them
        # whether it has others than MiR's
        self._has_unknown_words = not are_all and any(
            word != state and state in RUN_STATES for word, state in words.items()
        )
        # most entries of a page; whether it may have fewer than exist
        self._page, self._limits_pages = min(PAGE, known.page_limit or PAGE), known.page_limit != 0

    def saw(self, item: QueueItem) -> None:
        self._has_unknown_words |= item.state is QueueState.UNKNOWN

    def open_items(self) -> list[QueueItem]:
        if self._has_unknown_words:
            return self._without_end()
        items, _ = self._search(
            {"fieldname": "state", "operator": "IN", "value": self._open_states},
            lambda entry: parse.queue_state(entry).is_open,
        )
        return [item for item in items if item.state.is_open]

    def _without_end(self) -> list[QueueItem]:
        """Among the newest, on a robot with words of its own for states, which can't be searched for."""
        entries = self._ask(
            "GET", self._path, {"whitelist": "all", "sort_by": "id,desc", "limit": str(self._page)}, None
        )
        items = [parse.listed_item(entry) for entry in entries if parse.has_all_fields(entry)]
        return sorted((item for item in items if item.may_be_open), key=lambda item: item.id)

    def items_after(self, floor: int, known: Known | None = None, highest: int = 0) -> list[QueueItem]:
        known = {} if known is None else known
        found, is_proof = self._search(
            {"fieldname": "id", "operator": ">", "value": floor},
            lambda entry: parse.queue_id(entry) > floor,
            known,
            floor,
        )
        return found if is_proof else self._one_by_one(floor, found, known, highest)

    def described(self, tokens: Collection[str]) -> list[QueueItem]:
        """Items with one of these descriptions, whatever their number; without search, those among the newest."""
        items, _ = self._search(
            {"fieldname": "description", "operator": "IN", "value": [*tokens]},
            lambda entry: entry.get("description") in tokens,
        )
        return items

    def _one_by_one(self, floor: int, listed: Sequence[QueueItem], known: Known, highest: int) -> list[QueueItem]:
        """If a list proves nothing (it may have the oldest items), numbers do: those above the floor, until several in
        a row are missing."""
        known |= {item.id: item for item in listed}
        items: list[QueueItem] = []
        last, missing, reads = max(highest, max(known, default=0)), 0, 0
        for number in range(floor + 1, floor + 1 + MOST_ITEMS):
            if number in known:
                item = known[number]
            elif (reads := reads + 1) > MOST_SINGLE_READS:
                break
            else:
                item = self._item_with(number)
                if item is not None or number < last:
                    known[number] = item
            if item is not None:
                items.append(item)
                missing = 0
            elif (missing := missing + 1) >= MISSING_IN_A_ROW and number >= last:
                return items
        raise Unreadable(problem=message("more than {n} queue items in short form", n=MOST_SINGLE_READS))

    def _item_with(self, number: int) -> QueueItem | None:
        """None: there is none."""
        try:
            item = self._read_item(number)
        except Refusal as error:
            if error.status not in (404, 410):
                raise
            return None
        if item.id != number:
            raise Unreadable(problem=message("item {found} instead of {number}", found=item.id, number=number))
        return item

    def highest_id(self) -> int | None:
        newest = self.ids({"sort_by": "id,desc", "limit": "2"})
        if newest == sorted(newest, reverse=True):
            return max(newest, default=None)
        self._climbed = self._climb(max(newest + self.ids({})))  # it doesn't sort; perhaps it doesn't page either
        return self._climbed

    def _climb(self, listed: int) -> int:
        """The list may end far below the newest items, so numbers above it are tried in growing, then shrinking steps,
        past gaps as long as in ``_one_by_one``. Only existing numbers count: a number that is too low is safe to search
        from, and the next call continues from it. Raises Unreadable if it finds no end.
        """
        known = self._climbed if self._climbed > listed and self._is_there(self._climbed) else listed
        step, missing, tries = 1, 0, 0
        while missing < MISSING_IN_A_ROW and (tries := tries + 1) <= MOST_SINGLE_READS:
            if self._is_there(known + missing + step):
                known, step, missing = known + missing + step, 2 * step, 0
                if step > LONGEST_STEP:
                    raise Unreadable(problem=message("the queue has no end"))
            elif step > 1:
                step //= 2
            else:
                missing += 1
        return known

    def _is_there(self, number: int) -> bool:
        try:
            return self._read_item(number).id == number
        except (Rejected, RobotFault, Unreadable):
            return False

    def ids(self, query: Mapping[str, str]) -> list[int]:
        return [parse.queue_id(entry) for entry in self._ask("GET", self._path, query, None)]

    def _search(
        self, filter_: Mapping[str, Any], wanted: Wanted, known: Known | None = None, floor: int | None = None
    ) -> tuple[list[QueueItem], bool]:
        """By the robot's search, or from its list if it has none: newest first, until a page has nothing wanted. Also
        returns whether this proves that there are no others. ``floor``: wanted items have higher ids."""
        entries = self._by_search(filter_, wanted, floor) if self._has_search is not False else None
        if entries is not None:
            return self._in_full(entries, known), self._is_complete
        entries = list(self._pages("GET", self._path, None, wanted, floor))
        return self._in_full(entries, known), self._does_sort and self._is_complete

    def _by_search(self, filter_: Mapping[str, Any], wanted: Wanted, floor: int | None) -> list[parse.Object] | None:
        """None: the robot does not offer it; only for now, if it did before (it may be booting)."""
        try:
            entries = list(self._pages("POST", f"{self._path}/search", {"filters": [filter_]}, wanted, floor))
        except Refusal as error:
            if error.status not in UNSUPPORTED:
                raise
            self._has_search = self._has_search or False
            return None
        self._has_search = True
        return entries

    def _pages(self, method: str, path: str, body: Any, wanted: Wanted, floor: int | None) -> Iterator[parse.Object]:
        """Each wanted entry once, whether or not the robot supports filter, order, limit and offset. A page shorter
        than requested is the last one only if it reaches down to the ``floor``: some robots give no more than 50 at
        once. One entry shows no order, so a single unwanted one does not mean that later ones are unwanted."""
        seen: dict[int, None] = {}  # in the order in which they came
        self._does_sort = self._is_complete = True
        while len(seen) < MOST_ITEMS:
            query = {"whitelist": "all", "sort_by": "id,desc", "limit": str(self._page), "offset": str(len(seen))}
            page = {parse.queue_id(entry): entry for entry in self._ask(method, path, query, body)}
            fresh = [entry for number, entry in page.items() if number not in seen]
            found = list(filter(wanted, fresh))
            if len(seen) + len(found) > MOST_ITEMS:  # a robot that does not page
                break
            yield from found
            seen |= dict.fromkeys(page)
            shown = list(seen if len(page) == 1 else page)
            is_sorted = shown == sorted(shown, reverse=True)
            self._does_sort &= is_sorted
            has_order = self._does_sort and (len(seen) > 1 or bool(found))
            is_all = floor is None or not self._limits_pages or (has_order and min(seen) <= floor + 1)
            if page and not fresh:  # it gives one page only
                self._is_complete = is_all
                return
            is_listed_otherwise = method == "GET" and not is_sorted  # which proves nothing, however much is read
            if (
                (len(page) != self._page and (is_all or is_listed_otherwise))
                or not page
                or (is_sorted and not found and len(seen) > 1)
            ):
                return
        raise Unreadable(problem=message("more than {n} queue items", n=MOST_ITEMS))

    def _in_full(self, entries: Sequence[parse.Object], known: Known | None = None) -> list[QueueItem]:
        """Items with all their fields, by ascending id; those in short form in the list are read one by one, unless
        they are ``known``."""
        items: list[QueueItem] = []
        known, reads = {} if known is None else known, 0
        for entry in entries:
            if parse.has_all_fields(entry):
                items.append(parse.listed_item(entry))
                continue
            number = parse.queue_id(entry)
            item = known.get(number)
            if item is None:
                if (reads := reads + 1) > MOST_SINGLE_READS:
                    raise Unreadable(problem=message("more than {n} queue items in short form", n=MOST_SINGLE_READS))
                item = known[number] = self._read_item(number)
            items.append(item)
        return sorted(items, key=lambda item: item.id)
