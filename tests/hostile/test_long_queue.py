"""A robot with thousands of items in its queue, or with copies of ours: Home shows what anyone reads, and counts the rest."""

from __future__ import annotations

from dataclasses import replace
from datetime import datetime
from types import SimpleNamespace

from app.domain.robot import QueueItem, QueueState
from app.mir.mission_queue import MOST_ITEMS
from app.screens.home import facts as home_facts
from app.screens.home.facts import LONGEST_QUEUE, HomeFacts
from app.screens.home.view import present
from app.widgets.items import Item
from tests.support.home_facts import AINO, EXECUTING, FACTS, HELD, NOW, QUEUED, RUNNING, with_aino

LONG = (
    QueueItem(RUNNING.queue_id or 0, QueueState.EXECUTING, mission_id=RUNNING.mission_guid),
    *(
        QueueItem(
            200 + n,
            QueueState.PENDING,
            mission_id=f"g{n}",
            created_by_name="Nobody",
            ordered=datetime(2026, 11, 20, 14, 37),
        )
        for n in range(MOST_ITEMS - 1)
    ),
)
JUST_SENT = replace(QUEUED, queue_id=999_999)


def long_queue() -> HomeFacts:
    return replace(with_aino(EXECUTING, LONG), open=(RUNNING, JUST_SENT, HELD))


def queue_of(facts: HomeFacts) -> list[Item]:
    return [row for row in present(facts, NOW, room=999.0).today if row.key[0] in ("execution", "item", "more")]


def test_home_shows_what_runs_the_first_of_a_long_queue_and_what_waits_here() -> None:
    rows = queue_of(long_queue())
    shown, rest = rows[:LONGEST_QUEUE], rows[LONGEST_QUEUE:]
    assert (shown[0].title, shown[0].icon) == (RUNNING.mission, "play")
    assert [row.number for row in shown[1:]] == [str(n) for n in range(1, LONGEST_QUEUE)]
    assert [row.title for row in rest] == [f"and {MOST_ITEMS - LONGEST_QUEUE} more", JUST_SENT.mission, HELD.mission]
    assert (rest[0].actions, rest[1].number) == ((), str(MOST_ITEMS))
    assert present(long_queue(), NOW).clear_count == MOST_ITEMS + 2


def test_a_queue_of_the_longest_length_ends_without_such_a_line() -> None:
    rows = queue_of(replace(with_aino(EXECUTING, LONG[:LONGEST_QUEUE]), open=(RUNNING,)))
    assert [row.key[0] for row in rows] == ["execution", *["item"] * (LONGEST_QUEUE - 1)]


def test_ours_beyond_what_is_shown_is_not_taken_for_one_that_waits_here() -> None:
    far = replace(QUEUED, queue_id=LONG[-1].id)
    facts = replace(long_queue(), open=(RUNNING, far))
    assert facts.not_in_queue == ()
    assert ("execution", far.id) not in [row.key for row in queue_of(facts)]


def test_copies_of_ours_are_rows_of_their_own() -> None:
    ours = replace(QUEUED, queue_id=None)
    copies = tuple(
        QueueItem(number, QueueState.PENDING, mission_id=ours.mission_guid, description=ours.token)
        for number in (7, 8, 9)
    )
    rows = queue_of(replace(with_aino(EXECUTING, copies), open=(ours,)))
    assert [row.key for row in rows] == [("execution", ours.id), ("item", 8), ("item", 9)]


def test_only_what_runs_is_looked_up_in_the_history() -> None:
    asked: list[str] = []
    services = SimpleNamespace(
        snapshots=SimpleNamespace(get=long_queue().snapshots.__getitem__),
        maps=SimpleNamespace(known=lambda *_: None),
        robot_missions=SimpleNamespace(names=lambda _robot_id: {}, offered=lambda _robot_id, entered: list(entered)),
        holds=SimpleNamespace(all_active=list),
        clock=SimpleNamespace(now=lambda: NOW),
        robot_states=SimpleNamespace(timelines=lambda *_: []),
        history=SimpleNamespace(expected=lambda _robot_id, guid: asked.append(guid)),
    )
    facts = home_facts.read(services, FACTS)  # type: ignore[arg-type]
    assert facts.robot == AINO
    assert facts.snapshot.queue == LONG
    assert asked == [RUNNING.mission_guid]
