"""A robot that has a number more in its queue whenever it is asked: its thread asked for ever, sent nothing and ended nothing."""

from __future__ import annotations

import itertools
from typing import Any

from app.domain.robot import QueueItem, QueueState
from app.mir.errors import Rejected
from app.mir.mission_queue import MOST_SINGLE_READS, QueueReader


class Queue:
    """Lists its oldest items only. ``is_there`` says whether a number that is asked for is one of it."""

    def __init__(self, is_there: Any) -> None:
        self.asked, self._is_there = 0, is_there
        self.reader = QueueReader(lambda *_: [{"id": 1}, {"id": 2}], self.item)

    def item(self, number: int) -> QueueItem:
        self.asked += 1
        if self.asked > 10 * MOST_SINGLE_READS:
            raise AssertionError("asked for ever")
        if not self._is_there(number):
            raise Rejected(status=404)
        return QueueItem(number, QueueState.DONE)


def test_numbers_that_are_there_every_other_time_are_asked_for_so_often_only():
    answers = itertools.cycle([True, False])
    queue = Queue(lambda _number: next(answers))
    first = queue.reader.highest_id()
    assert queue.asked <= MOST_SINGLE_READS
    assert first < queue.reader.highest_id()


def test_a_queue_with_gaps_is_climbed_to_its_end_in_some_polls():
    queue = Queue(lambda number: number <= 60_000 and number % 7 > 2)
    found = [queue.reader.highest_id() for _ in range(5)]
    assert found == sorted(found)
    assert found[-1] == 60_000
