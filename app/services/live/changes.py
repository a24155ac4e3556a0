"""Notifications of changes: services publish a topic; screens, robot workers and cached values subscribe."""

from __future__ import annotations

import logging
import threading
from collections.abc import Callable
from enum import StrEnum
from typing import Generic, TypeVar

log = logging.getLogger(__name__)


class Topic(StrEnum):
    SNAPSHOT = "snapshot"  # of the robot with that id
    EXECUTIONS = "executions"
    SCHEDULES = "schedules"
    ROBOTS = "robots"
    MISSIONS = "missions"
    SETTINGS = "settings"
    CALENDAR = "calendar"  # exceptions to the working days
    ALARMS = "alarms"
    HOLDS = "holds"


T = TypeVar("T")

NO_ROBOT = 0  # about executions for which no robot has been chosen yet

Listener = Callable[[Topic, int | None], None]


class Changes:
    """Calls every listener on the publisher's thread: a listener only notes the change and returns at once."""

    def __init__(self) -> None:
        self._lock = threading.Lock()
        self._listeners: tuple[Listener, ...] = ()

    def subscribe(self, listener: Listener) -> Callable[[], None]:
        """Returns the function that ends the subscription."""
        with self._lock:
            self._listeners = (*self._listeners, listener)
        return lambda: self._drop(listener)

    def _drop(self, listener: Listener) -> None:
        with self._lock:
            self._listeners = tuple(each for each in self._listeners if each is not listener)

    def publish(self, topic: Topic, about: int | None = None) -> None:
        for listener in self._listeners:
            try:
                listener(topic, about)
            except Exception:
                log.exception("A listener to %s failed", topic)  # a listener that fails must not stop the publisher


class CachedUntilChanged(Generic[T]):
    """A value that is read often and changes rarely: kept until one of the topics is published."""

    def __init__(self, read: Callable[[], T], changes: Changes, *topics: Topic) -> None:
        self._read, self._topics = read, topics
        self._value: T | None = None
        self._version = 0
        changes.subscribe(self._forget)

    def _forget(self, topic: Topic, _about: int | None) -> None:
        if topic in self._topics:
            self._version += 1
            self._value = None

    def __call__(self) -> T:
        value = self._value
        if value is None:
            version = self._version
            value = self._read()
            if version == self._version:  # else it may be from before the change
                self._value = value
        return value
