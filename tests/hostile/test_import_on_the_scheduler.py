"""Configurations that are large, endless or made to take long: the scheduler and other writers continue."""

from __future__ import annotations

import itertools
import json
import os
import random
import re
import sqlite3
import threading
import time
from concurrent.futures import ThreadPoolExecutor
from contextlib import closing
from datetime import timedelta
from pathlib import Path
from typing import Any

import pytest

from app.database.errors import DatabaseDamaged
from app.domain.execution import State
from app.domain.models import InvalidInput
from app.failures import BadInput
from app.process.inbox import Inbox, ask
from app.process.requests import handlers
from app.services.catalogue.configuration import import_configuration, importing, preview
from app.services.catalogue.configuration.document import LARGEST_FILE
from tests.support.edits import import_file
from tests.support.effort import calls_of_this_thread
from tests.support.examples import first_of_each
from tests.support.process import PATIENCE, run, running

OFTEN = 8  # turns of the scheduler during the import; once or twice where that delays it


def document(schedules: list[dict[str, Any]], sections: dict[str, Any] | None = None) -> bytes:
    schedule = {"robot": "R", "mission": "M", "start": "2026-11-25T06:30"}
    return json.dumps(
        {
            "format": "amr-scheduler/1",
            "settings": {"timezone": "UTC"},
            "robots": [{"name": "R", "address": "h"}],
            "missions": [{"name": "M", "guid": "g"}],
            "schedules": [{**schedule, **fields} for fields in schedules],
            **(sections or {}),
        }
    ).encode()


@pytest.mark.long
def test_many_unnamed_schedules_do_not_take_long(container):
    """138 kB of them held the writer for a minute; it is less than a second."""
    content = document([{} for _ in range(1900)])
    with calls_of_this_thread() as calls:
        assert len(import_configuration(container.catalogue, content)) >= 1902
        assert import_configuration(container.catalogue, content) == []
    assert calls.number < 2_000_000


@pytest.mark.long
def test_unnamed_schedules_keep_their_names_in_any_order(container):
    fields = [{"priority": number} for number in range(300)]
    import_configuration(container.catalogue, document(fields))
    random.Random(1).shuffle(fields)
    assert import_configuration(container.catalogue, document(fields)) == []
    changed = import_configuration(
        container.catalogue, document([{"priority": number, "overlap": "queue"} for number in range(300)])
    )
    assert len(changed) == 300
    assert len(container.catalogue.schedules()) == 600


def test_the_scheduler_continues_while_it_serves_an_import(container):
    inbox, turns, ends = Inbox(container.db.path.parent, handlers(container)), itertools.count(), threading.Event()

    def serve() -> None:
        while not ends.wait(0.001):
            inbox.tick()
            next(turns)

    app = threading.Thread(target=serve)
    app.start()
    answer = ask(
        container.db.path.parent,
        "import",
        timeout=60,
        has_holder_ended=lambda: False,
        path="gone.json",
        content=document([{} for _ in range(1000)]),
        may_delete=False,
    )
    ends.set()
    app.join()
    assert len(answer["changes"]) >= 1002
    assert next(turns) >= OFTEN


def test_a_preview_says_what_the_import_will_and_changes_nothing(container):
    content, before = document([{}, {}]), list(container.db.read().iterdump())
    lines, _deletes = preview(container.catalogue, content)
    assert list(container.db.read().iterdump()) == before
    assert import_configuration(container.catalogue, content) == lines


def test_others_do_not_wait_for_a_preview_nor_for_a_file_that_changes_nothing(container, monkeypatch):
    import_configuration(container.catalogue, document([{}]))
    monkeypatch.setattr(container.db, "write", lambda *_: pytest.fail("a transaction was begun"))
    assert import_configuration(container.catalogue, document([{}])) == []
    with pytest.raises(InvalidInput, match="there is no mission unknown"):
        import_configuration(container.catalogue, document([{}, {"mission": "unknown"}]))
    assert len(preview(container.catalogue, document([{}, {}]))[0]) == 1


def test_a_damaged_database_is_named_by_a_preview(container):
    (root,) = (
        container.db.read().execute("SELECT rootpage FROM sqlite_schema WHERE name = 'suggestion_answers'").fetchone()
    )
    with closing(sqlite3.connect(container.db.path)) as connection:
        connection.execute("PRAGMA wal_checkpoint(TRUNCATE)")
    with container.db.path.open("r+b") as file:
        file.seek((root - 1) * 4096)
        file.write(b"\xff" * 4096)
    with ThreadPoolExecutor() as pool, pytest.raises(DatabaseDamaged) as caught:  # another thread reads the file again
        pool.submit(preview, container.catalogue, document([{}])).result()
    assert isinstance(caught.value.__cause__, sqlite3.DatabaseError)  # for the log


def test_a_wrong_file_is_reported_and_changes_nothing(container):
    before = container.db.read().execute("SELECT * FROM settings").fetchall()
    answers = handlers(container)
    file = container.db.path.parent / "bad.content"
    file.write_bytes(document([{}, {"mission": "unknown"}]))
    request = {"id": "1", "path": "bad.json", "content": file, "may_delete": False}
    with pytest.raises(BadInput) as refused:
        next(filter(None, (answers["import"](request) or time.sleep(0.01) for _ in itertools.count())))
    assert str(refused.value) == (
        "bad.json: schedules[1].mission: there is no mission unknown for R, add it "
        "or write the name that it has now; nothing was changed"
    )
    assert not file.exists()
    assert container.catalogue.robots() == []
    assert container.db.read().execute("SELECT * FROM settings").fetchall() == before


def test_a_key_that_appears_twice_among_many_is_found_at_once(container):
    pairs = [f'"k{number}":0' for number in range(20_000)]
    with pytest.raises(InvalidInput, match="'k19999' appears twice"):
        import_configuration(container.catalogue, ("{" + ",".join([*pairs, '"k19999":1']) + "}").encode())


@pytest.mark.parametrize(("section", "most"), [("robots", 3), ("missions", 4), ("schedules", 5)])
def test_there_is_room_for_so_many(container, monkeypatch, section, most):
    monkeypatch.setitem(importing.MOST, section, (importing.MOST[section][0], most))
    one = {
        "robots": {},
        "missions": {"guid": "g"},
        "schedules": {"robot": "R", "mission": "M", "start": "2026-11-25T06:30"},
    }

    def named(name):
        return {"name": name, **one[section], **({"address": name} if section == "robots" else {})}

    full = [named(letter) for letter in "RMabc"[:most]]
    import_configuration(container.catalogue, document([]))
    with pytest.raises(InvalidInput, match=f"{section}: this file would make more than the {most} allowed"):
        import_configuration(container.catalogue, document([], {section: [*full, named("x")]}))
    assert container.catalogue.schedules() == []
    with pytest.raises(
        InvalidInput, match="this file would make more than"
    ):  # said before they are compared with each other
        import_configuration(container.catalogue, document([], {section: [full[0]] * (most + 1)}))
    import_configuration(container.catalogue, document([], {section: full}))
    with pytest.raises(InvalidInput, match=f"this file would make more than the {most} allowed"):
        import_configuration(container.catalogue, document([], {section: [named("x")]}))


@pytest.mark.long
def test_a_pipe_is_read_by_the_command(tmp_path):
    data, pipe = tmp_path / "data", tmp_path / "pipe"
    os.mkfifo(pipe)
    with running(data):
        writer = threading.Thread(target=pipe.write_bytes, args=(document([{"name": "piped"}]),))
        writer.start()
        done = run(data, "--import-config", pipe, timeout=PATIENCE)
        writer.join()
        assert (done.returncode, done.stderr) == (0, ""), done
        assert "schedule piped added" in done.stdout
        assert not list((data / "inbox").iterdir())


def test_a_pipe_is_not_read_on_screen(container, tmp_path):
    pipe = Path(tmp_path / "endless.json")
    os.mkfifo(pipe)
    with pytest.raises(InvalidInput, match="not a plain file"):
        container.files.import_configuration(str(pipe))


def test_an_import_changes_and_withdraws_waiting_starts_like_an_edit(site):
    site.add_mission("Deliver")
    catalogue = site.container.catalogue
    fields = {
        "name": "S",
        "robot": "R1",
        "mission": "Deliver",
        "start": f"{site.clock.now() + timedelta(minutes=5):%Y-%m-%dT%H:%M}",
    }

    def take(**values: Any) -> None:
        import_file(catalogue, schedules=[{**fields, "respect_working_days": False, **values}])

    take()
    site.network.down.add("R1")
    site.run(310)
    assert [(row.state, row.priority) for row in site.executions()] == [(State.WAITING, 0)]
    take(priority=7)
    assert [(row.state, row.priority) for row in site.executions()] == [(State.WAITING, 7)]
    take(enabled=False)
    assert site.states() == [State.CANCELLED]


@pytest.mark.parametrize(
    ("name", "problem"),
    first_of_each(
        {
            "large": ("big.json", "big.json is larger than 5 MiB; nothing was changed"),
            "missing": ("gone.json", "there is no file .*gone.json; nothing was changed"),
            "directory": (".", "can't be read: Is a directory; nothing was changed"),
        }
    ),
)
def test_the_command_reads_no_more_than_the_screen_does(tmp_path, name, problem):
    (tmp_path / "big.json").write_bytes(b" " * (LARGEST_FILE + 1))
    done = run(tmp_path / "data", "--import-config", tmp_path / name)
    assert done.returncode == 2
    assert re.search(problem, done.stderr), done
