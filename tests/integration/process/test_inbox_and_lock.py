from __future__ import annotations

import errno
import json
import os
import subprocess
import sys
import threading
from pathlib import Path

import pytest

from app.domain.models import InvalidInput
from app.failures import BadInput
from app.process import inbox as inboxes
from app.process.data_directory import AlreadyRunning, InstanceLock
from app.process.inbox import HolderEnded, Inbox, Interrupted, ask
from tests.support.errors import raises


def test_only_one_process_holds_a_directory_and_a_killed_one_loses_it(tmp_path):
    code = (
        "import sys, pathlib; from app.process.data_directory import InstanceLock; lock = InstanceLock(pathlib.Path(sys.argv[1]));"
        "lock.acquire(); print('held', flush=True); sys.stdin.read()"
    )
    with subprocess.Popen(
        [sys.executable, "-c", code, str(tmp_path)],
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        text=True,
        cwd=Path(__file__).parents[3],
    ) as other:
        assert other.stdout.readline() == "held\n"
        with pytest.raises(AlreadyRunning, match=f"process {other.pid}"):
            InstanceLock(tmp_path).acquire()
        other.kill()
    mine = InstanceLock(tmp_path)
    mine.acquire()
    assert not InstanceLock(tmp_path).try_acquire()
    mine.release()
    assert InstanceLock(tmp_path).try_acquire()


def left_in(tmp_path) -> list[str]:
    return sorted(path.name for path in (tmp_path / "inbox").iterdir())


def leave(tmp_path, name, text="a password"):
    """What a killed command left long ago."""
    left = tmp_path / "inbox" / name
    left.write_text(text)
    os.utime(left, (1000.0, 1000.0))
    return left


def served(tmp_path, handlers, **request):
    """Ask while another thread ticks the inbox."""
    inbox, done = Inbox(tmp_path, handlers), threading.Event()

    def serve():
        while not done.wait(0.005):
            inbox.tick()

    thread = threading.Thread(target=serve)
    thread.start()
    try:
        return ask(tmp_path, "greet", timeout=10, has_holder_ended=lambda: False, **request)
    finally:
        done.set()
        thread.join()


def test_a_request_is_answered_and_leaves_nothing_behind(tmp_path):
    assert served(tmp_path, {"greet": lambda request: {"text": f"hello {request['name']}"}}, name="Äijä") == {
        "text": "hello Äijä"
    }
    assert left_in(tmp_path) == []


def test_a_request_may_take_several_ticks(tmp_path):
    looks = iter([None, None, {"done": True}])
    assert served(tmp_path, {"greet": lambda request: next(looks)}) == {"done": True}


def test_a_handler_that_fails_is_an_answer_too(tmp_path):
    answer = served(tmp_path, {"greet": lambda request: 1 / 0})
    assert answer["exit"] == 1
    assert "ZeroDivisionError" in answer["error"]


@pytest.mark.parametrize("problem", [BadInput("no such robot"), InvalidInput("robot", "no such robot")])
def test_what_can_not_be_done_is_said_with_exit_code_2(tmp_path, problem):
    def refuse(request):
        raise problem

    assert served(tmp_path, {"greet": refuse}) == {"exit": 2, "error": "no such robot"}


def test_there_is_no_answer_after_the_app_ended(tmp_path):
    with pytest.raises(HolderEnded, match="ended"):
        ask(tmp_path, "greet", timeout=10, has_holder_ended=lambda: True)
    assert left_in(tmp_path) == []


def test_a_full_disk_is_said_and_leaves_no_draft(tmp_path, monkeypatch):
    def full(*_):
        raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))

    monkeypatch.setattr(os, "replace", full)
    with pytest.raises(BadInput, match=r"can't be written: No space left on device; nothing was changed"):
        ask(tmp_path, "greet", timeout=10, has_holder_ended=lambda: False)
    assert left_in(tmp_path) == []


def test_an_app_that_was_restarted_at_once_is_asked_again(tmp_path):
    """Between the two the lock was free for a moment that the command did not see."""
    begun, takes_over = threading.Event(), threading.Event()

    def has_ended():
        begun.set()
        takes_over.wait(30)
        return False

    def begin():
        begun.wait(30)
        for request in (tmp_path / "inbox").glob("*.request"):
            os.utime(request, (1000.0, 1000.0))
        Inbox(tmp_path, {}, since=2000.0)
        takes_over.set()

    app = threading.Thread(target=begin)
    app.start()
    with pytest.raises(HolderEnded):
        ask(tmp_path, "greet", timeout=1.0, has_holder_ended=has_ended)
    app.join()


def test_an_interrupted_command_reports_its_outcome_in_bounded_time(tmp_path):
    interrupts = iter([KeyboardInterrupt])

    def interrupt() -> bool:
        for error in interrupts:
            raise error
        return False

    with raises(Interrupted, answer=None):
        ask(tmp_path, "greet", timeout=10.0, has_holder_ended=interrupt, put_back_within=0.2)
    assert left_in(tmp_path) == []


def test_a_withdrawn_request_leaves_no_answer(tmp_path):
    inbox = Inbox(tmp_path, {"greet": lambda _request: left.unlink() or {}})
    left = tmp_path / "inbox" / "left.request"
    left.write_text('{"kind": "greet"}')
    inbox.tick()
    assert left_in(tmp_path) == []


def test_bytes_are_handed_over_privately_and_do_not_stay(tmp_path):
    seen = []

    def look(request):
        file = request["content"]
        seen.append((file.read_bytes(), file.stat().st_mode & 0o777))
        return {}

    served(tmp_path, {"greet": look}, content=b"secret")
    assert seen == [(b"secret", 0o600)]
    assert left_in(tmp_path) == []


def test_requests_to_an_earlier_process_are_not_executed(tmp_path):
    """The command and the app were killed; its mission would start late."""
    asked = []
    Inbox(tmp_path, {})
    left = leave(tmp_path, "left.request", '{"kind": "run_now", "id": "left"}')
    inbox = Inbox(tmp_path, {"run_now": lambda request: asked.append(request) or {}}, since=2000.0)
    inbox.tick()
    assert asked == []
    assert not left.exists()
    left.write_text('{"kind": "run_now", "id": "new"}')
    os.utime(left, (1500.0, 1500.0))  # the clock was set back since
    inbox.tick()
    assert [request["id"] for request in asked] == ["new"]


def test_an_unreadable_request_stops_nothing(tmp_path):
    inbox = Inbox(tmp_path, {})
    (tmp_path / "inbox" / "x.request").write_text("{nonsense")
    inbox.tick()
    assert json.loads((tmp_path / "inbox" / "x.answer").read_text())["exit"] == 1


# ---------------------------------------------------------------------- remains and obstacles
LEFT = ("x.draft", "x.content", "x.answer")


@pytest.mark.parametrize("name", LEFT)
def test_files_of_a_killed_command_are_deleted_at_the_next_start(tmp_path, name):
    Inbox(tmp_path, {})
    left = leave(tmp_path, name)
    Inbox(tmp_path, {}, since=2000.0)
    assert not left.exists()


@pytest.mark.parametrize("name", LEFT)
def test_a_running_app_deletes_old_files_of_killed_commands(tmp_path, monkeypatch, name):
    inbox = Inbox(tmp_path, {})
    left = leave(tmp_path, name)  # however old it seems: clocks are set
    inbox.tick()
    assert left.exists()
    monkeypatch.setattr(inboxes, "LEFT_FOR", -1.0)
    inbox.tick()
    assert not left.exists()


def test_files_of_a_waiting_request_stay(tmp_path, monkeypatch):
    monkeypatch.setattr(inboxes, "LEFT_FOR", -1.0)
    inbox = Inbox(tmp_path, {"wait": lambda _request: None})
    for suffix, text in ((".content", "a password"), (".request", '{"kind": "wait"}')):
        (tmp_path / "inbox" / "x").with_suffix(suffix).write_text(text)
    inbox.tick()
    inbox.tick()
    assert left_in(tmp_path) == ["x.content", "x.request"]


def test_a_file_in_the_place_of_the_inbox_is_one_sentence(tmp_path):
    (tmp_path / "inbox").write_text("in the way")
    for meets_it in (
        lambda: Inbox(tmp_path, {}),
        lambda: ask(tmp_path, "greet", timeout=10, has_holder_ended=lambda: False),
    ):
        with pytest.raises(BadInput, match="inbox is not a directory: remove it"):
            meets_it()


def test_a_replaced_inbox_is_reported_until_it_is_restored(tmp_path):
    inbox = Inbox(tmp_path, {})
    (tmp_path / "inbox").rmdir()
    (tmp_path / "inbox").write_text("in the way")
    with pytest.raises(BadInput, match="is not a directory: remove it"):
        inbox.tick()
    (tmp_path / "inbox").unlink()
    (tmp_path / "inbox").mkdir()
    inbox.tick()
