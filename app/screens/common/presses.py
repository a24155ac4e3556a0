"""Commands under way: a second tap on a button counts as the first press, and commands of one robot never delay those
of another."""

from __future__ import annotations

from collections.abc import Callable, Hashable
from typing import NamedTuple, TypeVar

from kivy.clock import Clock

from app.screens.common.shell import Shell

T = TypeVar("T")
DOUBLE_TAP = 1.0  # s within which a gloved finger's second tap on a button is the same press
FRAME = 0.02  # s


class OfRobot(NamedTuple):
    """A command to a robot, which may take seconds to answer."""

    command: Hashable
    robot_id: int


class Presses:
    """Of a press the key is a name, or ``OfRobot``. ``changed()`` when one begins or ends, and when the button takes presses again."""

    def __init__(self, changed: Callable[[], object] = lambda: None) -> None:
        self._changed = changed
        self._under_way: list[Hashable] = []
        self._rests: dict[Hashable, float] = {}  # until when a tap on a button belongs to the press before

    def begin(self, key: Hashable) -> bool:
        """False: that is under way already."""
        if key in self._under_way:
            return False
        self._under_way.append(key)
        self._changed()
        return True

    def end(self, key: Hashable) -> None:
        self._under_way.remove(key)
        self._changed()

    def rest(self, key: Hashable) -> None:
        """A tap on that button within the next moment belongs to the press before."""
        now = Clock.get_time()
        self._rests = {**{other: until for other, until in self._rests.items() if until > now}, key: now + DOUBLE_TAP}
        Clock.schedule_once(lambda _dt: self._changed(), DOUBLE_TAP + FRAME)

    def is_same(self, key: Hashable) -> bool:
        """Whether it is under way or was done a moment ago. A failed one can be tried again at once."""
        return key in self._under_way or Clock.get_time() < self._rests.get(key, 0.0)

    def names(self, robot_id: int | None) -> list[Hashable]:
        """The commands under way that its page shows."""
        return [
            key.command if isinstance(key, OfRobot) else key
            for key in self._under_way
            if not isinstance(key, OfRobot) or key.robot_id == robot_id
        ]


class Commands:
    """Commands in the background, one at a time for each key; ``ended()`` after each, even with an error: its effect can be read."""

    def __init__(self, shell: Shell, ended: Callable[[], object], presses: Presses | None = None) -> None:
        self._shell, self._ended, self._presses = shell, ended, presses or Presses()

    def run(
        self,
        key: Hashable,
        work: Callable[[], T],
        done: Callable[[T], object] = lambda _outcome: None,
        failed: Callable[[BaseException], object] | None = None,
    ) -> bool:
        """Unless it is under way: False. Its button is busy until the outcome is on screen."""
        if not self._presses.begin(key):
            return False

        def ended(call: Callable[[], object]) -> None:
            self._presses.end(key)
            call()
            self._ended()

        def succeeded(outcome: T) -> None:
            self._presses.rest(key)
            ended(lambda: done(outcome))

        self._shell.background.run(
            work, succeeded, lambda problem: ended(lambda: (failed or self._shell.say_problem)(problem))
        )
        return True
