"""A tab of the Logs that reads what it shows when it is shown."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING, Generic, TypeVar

from kivy.event import EventDispatcher

from app.screens.common.shell import Shell
from app.screens.common.view_model import Refresher
from app.screens.logs.facts import LogsServices

if TYPE_CHECKING:
    from app.screens.logs.screen import LogsViewModel

T = TypeVar("T")


class LogsPart(EventDispatcher, Generic[T]):
    """``_facts`` are those of the last reading; None: not read yet."""

    _facts: T | None = None

    def __init__(self, services: LogsServices, shell: Shell, logs: LogsViewModel) -> None:
        super().__init__()
        self._services, self._shell, self._logs = services, shell, logs
        self.refresher = Refresher(shell, self._start_reading, self._take, wanted=self._wanted)

    def _wanted(self) -> object:
        """A reading for anything else is dropped."""
        return self._logs.wanted

    def _start_reading(self) -> Callable[[], T]:
        raise NotImplementedError

    def _take(self, facts: T) -> None:
        self._facts = facts
        self.show()

    def show(self) -> None:
        raise NotImplementedError
