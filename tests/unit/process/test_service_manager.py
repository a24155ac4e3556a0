"""What systemd hears, read from a socket as systemd has one: ready, and its watchdog fed only while engine and writer make progress."""

from __future__ import annotations

import os
import queue
import socket
import sys
import threading
import time
from contextlib import suppress
from types import SimpleNamespace

import pytest

from app.container import Container
from app.domain.clock import SystemClock
from app.failures import BadInput
from app.process.data_directory import DataDirectory
from app.process.host import _say_ready, host
from app.process.service_manager import TAKEN_WITHIN, Progress, Watchdog, notify
from tests.support.process import running, wait_for

WITHIN = 60.0
SILENCE = 0.3  # s in which a watchdog with FAST_TIMEOUT is otherwise fed 30 times
FAST_TIMEOUT = "40000"  # microseconds

pytestmark = pytest.mark.skipif(sys.platform != "linux", reason="systemd runs on Linux only")


@pytest.fixture
def systemd(tmp_path, monkeypatch):
    """The end of the socket at which systemd listens."""
    path = str(tmp_path / "notify")
    with socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM) as listening:
        listening.bind(path)
        listening.settimeout(WITHIN)
        monkeypatch.setenv("NOTIFY_SOCKET", path)
        yield listening


def hears(listening: socket.socket) -> str:
    return listening.recv(100).decode()


def test_a_socket_without_a_file_has_a_name_with_an_at_sign(monkeypatch):
    with socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM) as listening:
        listening.bind(f"\0amr-scheduler-{os.getpid()}")
        listening.settimeout(WITHIN)
        monkeypatch.setenv("NOTIFY_SOCKET", f"@amr-scheduler-{os.getpid()}")
        notify("READY=1")
        assert hears(listening) == "READY=1"


@pytest.mark.parametrize("address", [None, "", "/nowhere/at/all"])
def test_without_systemd_nothing_happens(monkeypatch, address):
    monkeypatch.delenv("NOTIFY_SOCKET", raising=False)
    if address is not None:
        monkeypatch.setenv("NOTIFY_SOCKET", address)
    notify("READY=1")


def test_the_app_says_that_it_is_ready_and_then_that_it_works(systemd, tmp_path, monkeypatch):
    monkeypatch.setenv("WATCHDOG_USEC", "8000000")
    with running(tmp_path / "data"):
        assert hears(systemd) == "READY=1"
        assert hears(systemd) == "WATCHDOG=1"


def test_an_app_that_is_already_stopped_is_never_ready(systemd, monkeypatch):
    said: list[str] = []
    monkeypatch.setattr("app.process.host.notify", said.append)
    monkeypatch.setattr("app.process.host.print_without_waiting", said.append)
    container = SimpleNamespace(clock=SystemClock(), engine=SimpleNamespace(is_ready=False))
    stop: queue.SimpleQueue[int] = queue.SimpleQueue()
    stop.put(15)
    _say_ready(container, stop)
    assert said == []


def test_without_a_time_out_nothing_is_fed(systemd, monkeypatch):
    monkeypatch.delenv("WATCHDOG_USEC", raising=False)
    before = threading.active_count()
    Watchdog().feed_while(lambda: True)
    assert threading.active_count() == before


def test_the_watchdog_is_fed_while_progress_is_made_and_when_nothing_is_watched(systemd, monkeypatch):
    monkeypatch.setenv("WATCHDOG_USEC", FAST_TIMEOUT)
    works, asked = threading.Event(), threading.Semaphore(0)
    works.set()

    def is_fed() -> bool:
        asked.release()
        return works.is_set()

    watchdog = Watchdog()
    watchdog.feed_while(is_fed)
    assert hears(systemd) == "WATCHDOG=1"
    works.clear()
    drain(systemd)
    for _ in range(3):
        assert asked.acquire(timeout=WITHIN)
    drain(systemd)  # of the time before it was asked
    assert is_silent(systemd)
    watchdog.rest()
    assert hears(systemd) == "WATCHDOG=1"
    watchdog.feed_while(lambda: False)


def test_nothing_waits_for_a_systemd_that_takes_no_message(systemd):
    with socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM) as full:
        full.connect(systemd.getsockname())
        full.setblocking(False)
        with suppress(BlockingIOError):
            while True:
                full.send(b"x")
        began = time.monotonic()
        notify("READY=1")
        assert time.monotonic() - began < TAKEN_WITHIN
        while (said := hears(systemd)) == "x":  # makes room
            pass
        assert said == "READY=1"


def test_a_window_that_hangs_ends_the_feeding(systemd, monkeypatch):
    monkeypatch.setenv("WATCHDOG_USEC", FAST_TIMEOUT)
    watchdog = Watchdog()
    watchdog.rest()
    assert hears(systemd) == "WATCHDOG=1"  # there is no window yet
    watchdog.window_works()
    wait_for(lambda: is_silent(systemd), what="its hanging")
    watchdog.window_works()

    def works() -> bool:
        watchdog.window_works()
        return not is_silent(systemd, 0.001)

    wait_for(works, what="its going on")
    watchdog.feed_while(lambda: False)


def is_silent(listening: socket.socket, seconds: float = SILENCE) -> bool:
    drain(listening)
    listening.settimeout(seconds)
    try:
        hears(listening)
    except TimeoutError:
        return True
    finally:
        listening.settimeout(WITHIN)
    return False


def test_the_watchdog_is_fed_while_a_person_is_asked_for_a_backup(systemd, tmp_path, monkeypatch):
    (tmp_path / "amr-scheduler.db").write_bytes(b"damaged" * 1000)
    monkeypatch.setenv("WATCHDOG_USEC", FAST_TIMEOUT)
    watchdog = Watchdog()
    monkeypatch.setattr("app.process.host.watchdog", watchdog)
    with pytest.raises(BadInput), host(DataDirectory.prepare(tmp_path)):
        pass
    drain(systemd)
    assert hears(systemd) == "WATCHDOG=1"
    watchdog.feed_while(lambda: False)


def drain(listening: socket.socket) -> None:
    listening.setblocking(False)
    try:
        while True:
            listening.recv(100)
    except BlockingIOError:
        listening.settimeout(WITHIN)


@pytest.fixture
def container(tmp_path):
    container = Container.open(tmp_path / "data")
    yield container
    container.close()


@pytest.fixture
def progress(container):
    """Of an engine that works."""
    progress = Progress(container)
    container.runner.start()
    wait_for(progress.is_made)
    return progress


def test_a_stuck_engine_ends_the_progress(container, progress):
    stuck, goes_on = threading.Event(), threading.Event()

    def hang() -> None:
        if stuck.is_set():
            goes_on.wait()

    container.engine.add_chore("Hanging", hang)
    stuck.set()
    wait_for(lambda: not progress.is_made(), what="its hanging")
    goes_on.set()
    wait_for(progress.is_made, what="its going on")


def test_a_stuck_writer_gives_no_answer(container, progress):
    stuck, goes_on = threading.Event(), threading.Event()

    def hang(_connection: object) -> None:
        stuck.set()
        goes_on.wait()

    hanging = threading.Thread(target=container.db.write, args=(hang,))
    hanging.start()
    assert stuck.wait(WITHIN)
    answers: list[bool] = []
    asking = threading.Thread(target=lambda: answers.append(progress.is_made()))
    asking.start()
    asking.join(SILENCE)
    assert (asking.is_alive(), answers) == (True, [])
    goes_on.set()
    asking.join(WITHIN)
    hanging.join(WITHIN)
    wait_for(progress.is_made, what="its going on")


def test_a_closed_writer_makes_no_progress(container, progress):
    container.db.close()
    wait_for(lambda: not progress.is_made())
