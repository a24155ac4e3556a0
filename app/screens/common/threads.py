"""Events and results of other threads are delivered on the UI thread, a bounded number per frame."""

from __future__ import annotations

import logging
import threading
from collections import OrderedDict
from collections.abc import Callable, Hashable
from concurrent.futures import Future, ThreadPoolExecutor, wait
from dataclasses import dataclass
from functools import partial
from typing import Any

from kivy.clock import Clock

from app.services.live.changes import Changes, Topic

log = logging.getLogger(__name__)

APART = 2  # threads for each kind of work that runs apart
STAYING = 4  # threads that wait for more work, as many as a screen keeps busy
LAST_WORDS = 0.5  # s: how long a closing window waits for work on the tablet; a robot may take longer


class UiBus:
    """``publish`` from any thread; handlers run on the UI thread, in order, at most ``per_frame`` events a frame.

    Events with a ``key`` are coalesced: of undelivered ones only the newest remains, in the first one's place. So fifty
    robots that answer at once cost at most fifty updates.
    """

    def __init__(self, per_frame: int = 100) -> None:
        self._per_frame = per_frame
        self._lock = threading.Lock()
        self._calls: OrderedDict[Hashable, Callable[[], object]] = OrderedDict()  # by key: a new value keeps its place
        self._handlers: dict[type, list[Callable[[Any], object]]] = {}
        self._is_scheduled = False  # a call of _drain; one event of kivy's that two threads trigger can get lost

    def publish(self, event: object, key: Hashable | None = None) -> None:
        """Deliver ``event`` to those who subscribed to its class or to a class above it."""
        self.post(partial(self._deliver, event), key)

    def post(self, call: Callable[[], object], key: Hashable | None = None) -> None:
        """Run ``call`` on the UI thread."""
        with self._lock:
            self._calls[object() if key is None else key] = call
            self._schedule()

    def _schedule(self) -> None:
        """With the lock held."""
        if not self._is_scheduled:
            self._is_scheduled = True
            Clock.schedule_once(self._drain)

    def subscribe(self, kind: type, handler: Callable[[Any], object]) -> Callable[[], None]:
        """Call ``handler(event)`` for events of class ``kind``; returns the function that ends it. On the UI thread."""
        self._handlers.setdefault(kind, []).append(handler)

        def unsubscribe() -> None:
            if handler in self._handlers[kind]:
                self._handlers[kind].remove(handler)

        return unsubscribe

    def _drain(self, _dt: float) -> None:
        self._is_scheduled = False
        for _n in range(self._per_frame):
            with self._lock:
                if not self._calls:
                    return
                _key, call = self._calls.popitem(last=False)
            self._guarded(call)
        with self._lock:
            if self._calls:
                self._schedule()

    def _deliver(self, event: object) -> None:
        for kind in type(event).__mro__:
            for handler in list(self._handlers.get(kind, ())):
                self._guarded(handler, event)

    @staticmethod
    def _guarded(call: Callable[..., object], *args: object) -> None:
        """A handler that fails must stop neither the others nor the window; its traceback goes to the log."""
        try:
            call(*args)
        except Exception:
            log.exception("a handler on the UI thread failed")


@dataclass(frozen=True)
class Changed:
    """A service has published a change; delivered on the UI thread. ``about`` is the robot's id of a snapshot."""

    topic: Topic
    about: int | None = None


def forward(changes: Changes, bus: UiBus) -> Callable[[], None]:
    """Deliver what the services publish on the UI thread, as ``Changed``; returns the function that ends it."""

    def publish(topic: Topic, about: int | None) -> None:
        event = Changed(topic, about)
        bus.publish(event, key=event)

    return changes.subscribe(publish)


Done = Callable[[Any], object]
Failed = Callable[[BaseException], object]


@dataclass(eq=False)
class Job:
    """Work under way. ``cancel`` drops its result; the work itself runs to its end."""

    done: Done | None
    failed: Failed | None
    key: Hashable | None
    apart: str
    cancelled: bool = False
    finished: bool = False

    def cancel(self) -> None:
        self.cancelled = True


class Threads:
    """A few threads, and the work that they were given and that has not been delivered."""

    def __init__(self, name: str, most: int) -> None:
        self.pool = ThreadPoolExecutor(most, thread_name_prefix=f"ui-{name}")
        self.jobs: dict[Job, Future[Any]] = {}
        self.peak = 0  # most jobs at a time, and so threads: one is added when all are busy


class Background:
    """Runs work that may take longer than a frame (database, robots) on a few threads and returns the results to the UI
    thread.

    ``unexpected(exception)`` gets failures for which no ``failed`` was given, on the UI thread, after they are in the
    log.
    """

    def __init__(
        self, bus: UiBus, workers: int = 12, unexpected: Callable[[BaseException], object] | None = None
    ) -> None:
        self._bus = bus
        self._workers = workers
        self._threads: dict[str, Threads] = {}  # of all kinds of work: "" is what does not run apart
        self._unexpected = unexpected
        self._latest: dict[Hashable, Job] = {}
        self._is_closed = False

    def run(
        self,
        work: Callable[[], Any],
        done: Done | None = None,
        failed: Failed | None = None,
        *,
        key: Hashable | None = None,
        apart: str = "",
    ) -> Job:
        """Run ``work()`` on another thread, then ``done(result)`` or ``failed(exception)`` on the UI thread. Call it on
        the UI thread.

        Of several runs with one ``key`` only the newest delivers (a search while typing). Work that asks robots without
        a press runs ``apart``, on few threads for all of that name, so that slow robots never delay a press. Raises
        RuntimeError when closed.
        """
        if self._is_closed:
            raise RuntimeError("no more work is taken")
        job = Job(done, failed, key, apart)
        if key is not None:
            if key in self._latest:
                self._latest[key].cancel()
            self._latest[key] = job
        if apart not in self._threads:
            self._threads[apart] = Threads(apart or "work", APART if apart else self._workers)
        threads = self._threads[apart]
        threads.jobs[job] = result = threads.pool.submit(work)
        threads.peak = max(threads.peak, len(threads.jobs))
        result.add_done_callback(partial(self._finish, job))
        return job

    @property
    def idle(self) -> bool:
        """Nothing is running and every result has been delivered."""
        return not any(threads.jobs for threads in self._threads.values())

    def close(self) -> None:
        """Take no more work and deliver nothing more. Pressed commands are still run, so that no entry is lost; work
        that runs apart only ends, and its failures are not in the log."""
        self._is_closed = True
        pressed: list[Future[Any]] = []
        for name, threads in self._threads.items():
            for job in threads.jobs:
                job.cancel()
            threads.pool.shutdown(wait=False, cancel_futures=bool(name))
            pressed += [] if name else threads.jobs.values()
        for late in wait(pressed, LAST_WORDS).not_done:
            late.cancel()  # unless it runs

    def _finish(self, job: Job, result: Future[Any]) -> None:
        if result.cancelled():
            return
        if self._is_closed and not job.apart and (problem := result.exception()):  # results are no longer delivered
            log.error("work in the background failed", exc_info=problem)
        self._bus.post(partial(self._deliver, job, result))

    def _deliver(self, job: Job, result: Future[Any]) -> None:
        threads = self._threads[job.apart]
        del threads.jobs[job]
        if not threads.jobs and (job.apart or threads.peak > STAYING):
            # Names of work come and go with robots and files, and hanging robots keep many threads busy. Unneeded threads
            # would wait for ever, each with its reader of the database.
            threads.pool.shutdown(wait=False)
            del self._threads[job.apart]
        job.finished = True
        if job.key is not None and self._latest.get(job.key) is job:
            del self._latest[job.key]
        if job.cancelled:
            return
        if (problem := result.exception()) is None:
            if job.done is not None:
                job.done(result.result())
        elif job.failed is not None:
            job.failed(problem)
        else:
            log.error("work in the background failed", exc_info=problem)
            if self._unexpected is not None:
                self._unexpected(problem)
