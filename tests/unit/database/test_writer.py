"""One thread writes; a write is done when ``write`` returns, and undone when it raises."""

from __future__ import annotations

import sqlite3
import threading

import pytest

from app.database import writer
from app.database.connection import Database, DatabaseUnavailable
from app.database.settings import SettingsRepository
from app.database.writer import WAL_KEPT, WRITE_BACK_EVERY

SETTINGS = SettingsRepository()


@pytest.fixture(params=[True, False], ids=["thread", "inline"])
def db(request, start):
    return start(threaded=request.param, durable=False)


def put(name: str, value: object):
    return lambda c: SETTINGS.put(c, name, value)


def stored(db: Database, name: str) -> object:
    return SETTINGS.get(db.read(), name)


def test_a_failing_write_is_rolled_back_and_the_exception_reaches_the_caller(db):
    def work(c):
        put("a", 1)(c)
        raise KeyError("broken")

    with pytest.raises(KeyError, match="broken"):
        db.write(work)
    assert stored(db, "a") is None
    db.write(put("a", 2))
    assert stored(db, "a") == 2


def test_a_broken_constraint_reaches_the_caller_as_itself(db):
    with pytest.raises(sqlite3.IntegrityError):
        db.write(lambda c: c.execute("INSERT INTO idle_rules (robot_id, mission_id, after_minutes) VALUES (7, 7, 7)"))


def test_a_write_inside_a_write_is_a_mistake_in_the_program(db):
    with pytest.raises(RuntimeError):
        db.write(lambda c: db.write(put("a", 1)))
    assert stored(db, "a") is None


def test_readers_cannot_write(db):
    with pytest.raises(sqlite3.OperationalError, match="readonly"):
        db.read().execute("DELETE FROM settings")


def test_a_reader_does_not_see_a_write_that_is_not_committed(db):
    seen = []

    def work(c):
        put("a", 1)(c)
        seen.append(stored(db, "a"))

    db.write(work)
    assert seen == [None]
    assert stored(db, "a") == 1


def test_the_disk_being_full_is_reported_and_nothing_is_half_written(db):
    pages = db.read().execute("PRAGMA page_count").fetchone()[0]
    db.write(lambda c: c.execute(f"PRAGMA max_page_count = {pages}").fetchone())

    def work(c):
        for number in range(1000):
            put(f"name {number}", "x" * 1000)(c)

    with pytest.raises(DatabaseUnavailable, match="disk is full") as refused:
        db.write(work)
    assert str(refused.value.__cause__) == "database or disk is full"
    assert stored(db, "name 0") is None
    db.write(lambda c: c.execute("PRAGMA max_page_count = 1000000").fetchone())
    db.write(put("a", 1))
    assert stored(db, "a") == 1


def test_a_read_only_disk_is_reported(db):
    db.write(lambda c: c.execute("PRAGMA query_only = ON"))
    with pytest.raises(DatabaseUnavailable, match="read-only") as refused:
        db.write(put("a", 1))
    assert str(refused.value.__cause__) == "attempt to write a readonly database"


def test_a_closed_database_says_so(db):
    db.close()
    with pytest.raises(DatabaseUnavailable, match="closed"):
        db.write(put("a", 1))
    with pytest.raises(DatabaseUnavailable, match="closed"):
        db.read()


def test_the_write_ahead_log_is_written_back_and_reused(db):
    wal = db.path.with_name(db.path.name + "-wal")
    sizes = []
    for number in range(2 * WRITE_BACK_EVERY):
        db.write(put("name", number))
        sizes.append(wal.stat().st_size)
    db.write(put("name", "last"))
    assert sizes[WRITE_BACK_EVERY - 1] == sizes[-1] == wal.stat().st_size > sizes[0]
    assert stored(db, "name") == "last"


def test_a_write_ahead_log_that_one_work_made_long_is_cut_when_it_starts_again(db):
    wal = db.path.with_name(db.path.name + "-wal")
    db.write(put("name", "x" * (WAL_KEPT + 500_000)))
    assert wal.stat().st_size > WAL_KEPT
    for number in range(WRITE_BACK_EVERY):
        db.write(put("last", number))
    assert wal.stat().st_size == WAL_KEPT
    assert len(stored(db, "name")) == WAL_KEPT + 500_000


def test_a_reader_in_the_middle_keeps_what_it_reads_while_the_log_is_written_back(db):
    for number in range(50):
        db.write(put(f"name {number:02}", 1))
    reading = db.read().execute("SELECT name FROM settings WHERE name LIKE 'name%' ORDER BY name")
    first = reading.fetchone()
    for number in range(12):
        db.write(put(f"name {number:02}", "x" * 500_000))
    db.write(lambda c: c.execute("DELETE FROM settings WHERE name LIKE 'name%'"))
    assert [row["name"] for row in [first, *reading]] == [f"name {number:02}" for number in range(50)]


# ---------------------------------------------------------------------- many at once
@pytest.fixture
def busy(start):
    """A database whose writer can be held up, so that works pile up behind it."""
    return start(durable=False)


def pile_up(db: Database, works) -> list[object]:
    """Hand in all works while the writer is held up; what each returned or raised, in their order."""
    holding, release = threading.Event(), threading.Event()
    outcomes: list[object] = [None] * len(works)

    def hold(c):
        holding.set()
        release.wait(30)

    def hand_in(number, work):
        try:
            outcomes[number] = db.write(work)
        except Exception as error:
            outcomes[number] = error

    threads = [threading.Thread(target=db.write, args=(hold,))]
    threads[0].start()
    assert holding.wait(30)
    waiting = db._writer._tasks.qsize
    for number, work in enumerate(works):
        threads.append(threading.Thread(target=hand_in, args=(number, work)))
        threads[-1].start()
        while waiting() <= number:
            threading.Event().wait(0.001)
    release.set()
    for thread in threads:
        thread.join(30)
    return outcomes


def test_works_that_wait_together_share_one_transaction(busy):
    count = "SELECT count(*) FROM settings WHERE name LIKE 'name%'"

    def work(number):
        def run(c):
            put(f"name {number}", number)(c)
            return c.execute(count).fetchone()[0], busy.read().execute(count).fetchone()[0]

        return run

    outcomes = pile_up(busy, [work(number) for number in range(50)])
    assert outcomes == [(number + 1, 0) for number in range(50)]  # each sees those before it, other readers none yet
    assert busy.read().execute(count).fetchone()[0] == 50


def test_a_failing_write_undoes_only_itself(busy):
    def broken(c):
        put("broken", 1)(c)
        raise KeyError("broken")

    outcomes = pile_up(busy, [put("a", 1), broken, put("b", 2)])
    assert [type(outcome) for outcome in outcomes] == [type(None), KeyError, type(None)]
    assert (stored(busy, "a"), stored(busy, "broken"), stored(busy, "b")) == (1, None, 2)


def test_when_the_shared_transaction_is_lost_every_one_of_it_fails(busy):
    outcomes = pile_up(busy, [put("a", 1), lambda c: c.execute("ROLLBACK"), put("b", 2)])
    assert all(isinstance(outcome, sqlite3.Error) for outcome in outcomes)
    assert (stored(busy, "a"), stored(busy, "b")) == (None, None)
    busy.write(put("a", 3))
    assert stored(busy, "a") == 3


def test_closing_finishes_what_waits(busy, start):
    outcomes = pile_up(busy, [put("a", 1)])
    closer = threading.Thread(target=busy.close)
    closer.start()
    closer.join(10)
    assert not closer.is_alive()
    assert (outcomes, stored(start(threaded=False), "a")) == ([None], 1)


def test_a_patient_work_goes_with_the_next_one_in_its_transaction(busy, monkeypatch):
    monkeypatch.setattr(writer, "PATIENCE", 30.0)
    seen: list[tuple[object, object]] = []
    patient = threading.Thread(target=busy.write, args=(put("patient", 1), True))
    patient.start()
    while busy._writer._tasks.qsize():
        threading.Event().wait(0.001)
    assert stored(busy, "patient") is None
    busy.write(lambda c: seen.append((SETTINGS.get(c, "patient"), stored(busy, "patient"))))
    patient.join(10)
    assert seen == [(1, None)]  # done before it, and other readers do not see it yet
    assert stored(busy, "patient") == 1


def test_a_patient_work_that_stays_alone_is_still_done(busy):
    busy.write(put("patient", 1), patient=True)
    assert stored(busy, "patient") == 1
