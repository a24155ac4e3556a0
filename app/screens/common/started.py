"""Messages about the outcome of a mission that a person has just started: shown when known, and only while true."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

from kivy.clock import Clock, ClockEvent

from app.domain import choice
from app.domain.execution import Execution, State, Wait
from app.domain.reasons import sentence
from app.i18n import _
from app.screens.common import formats
from app.screens.common.holding import HAND, about_start, waiting_words
from app.screens.common.mission_names import MissionNames
from app.screens.common.shell import PROBLEM_SECONDS, Shell
from app.screens.common.view_model import Changed
from app.services.history.runs import History
from app.services.live.changes import Topic
from app.services.live.holds import Holds
from app.widgets.snackbar import SECONDS

ANSWERS_WITHIN = 5.0  # s until the message that a robot's answer is missing
CHOSEN_WITHIN = 1.0  # s until the message that a start of a group has no robot yet

Words = tuple[str, str, float]  # text, icon, and for how many seconds it is shown


def outcome(execution: Execution, mission_names: MissionNames) -> Words | None:
    """None while it is under way, or if it is cancelled, which has its own message."""
    if execution.state is State.CANCELLED or execution.cancel_code is not None:
        return None
    names = {"mission": mission_names.run(execution), "robot": execution.robot or execution.robot_group}
    passed = choice.earlier_robots(execution.tried, execution.robot, _)
    if execution.state is State.WAITING and execution.wait is not Wait.DUE:
        words = waiting_words(execution, execution.timezone)
        if execution.robot_id is None:
            words = ". ".join(filter(None, (passed, words)))
            return _("{mission} is not sent yet. {why}").format(**names, why=words), "timer-sand", PROBLEM_SECONDS
        return (
            _("{mission} is not sent to {robot} yet. {why}").format(**names, why=words),
            HAND if execution.wait is Wait.HOLD else "timer-sand",
            PROBLEM_SECONDS,
        )
    if execution.state is State.SUBMITTING and execution.queue_id is None and "answer" in execution.wait_details:
        return (
            _("It is not certain that {robot} has {mission}. {why}").format(
                **names, why=waiting_words(execution, execution.timezone)
            ),
            "timer-sand",
            PROBLEM_SECONDS,
        )
    if execution.queue_id is not None or execution.state in (State.QUEUED, State.EXECUTING, State.COMPLETED):
        if why := passed or choice.chosen(execution.choice, execution.timezone, _):
            return _("{mission} is sent to {robot}. {why}").format(**names, why=why), "check", PROBLEM_SECONDS
        return _("{mission} is sent to {robot}").format(**names), "check", SECONDS
    if execution.reason is not None:
        why = sentence(execution.reason, execution.timezone, _)
        return (
            _("{mission} was not started on {robot}. {why}").format(**names, why=why),
            "alert-circle-outline",
            PROBLEM_SECONDS,
        )
    return None


def say_not_started(shell: Shell, mission: str, where: str, why: str) -> None:
    """The message that nothing was started: ``where`` is the robot, or any of a group."""
    text = _("{mission} was not started on {robot}. {why}").format(mission=mission, robot=where, why=why)
    shell.snackbars.show(text, icon="alert-circle-outline", seconds=PROBLEM_SECONDS)


def unanswered(execution: Execution, mission_names: MissionNames) -> Words:
    """Nothing is known yet."""
    text = (
        _("{mission}: no answer from {robot}, tried until {time}")
        if execution.robot
        else _("{mission} waits for a robot of {group}, until {time} at most")
    )
    return (
        text.format(
            mission=mission_names.run(execution),
            robot=execution.robot,
            group=execution.robot_group,
            time=formats.clock_time(execution.closes_at, execution.timezone),
        ),
        "timer-sand",
        PROBLEM_SECONDS,
    )


def as_it_is(history: History, holds: Holds) -> Callable[[int], Execution | None]:
    """Reads an execution. After a release its row says "held" for some more seconds, until it is tried."""

    def read(execution_id: int) -> Execution | None:
        row = history.get(execution_id)
        if (
            row is None
            or row.robot_id is None
            or row.held
            or row.wait not in (Wait.HOLD, Wait.CLOCK)
            or holds.active(row.robot_id)
        ):
            return row
        return replace(row, wait=Wait.DUE, wait_details={})

    return read


@dataclass
class Followed:
    """A start with a message to show, or already shown."""

    is_early: bool  # a start of a group, which may get a robot at any moment
    is_late: bool  # its robot does not answer
    clocks: tuple[ClockEvent, ...] = ()
    said: str = ""


class StartReports:
    """Follows the starts made here until their message; then, on every screen, as long as the message is shown, as it
    may become outdated. ``read`` returns an execution as it is now."""

    def __init__(self, shell: Shell, read: Callable[[int], Execution | None]) -> None:
        self._shell, self._read = shell, read
        self._followed: dict[int, Followed] = {}  # by the execution's id
        self._is_open = False
        self._unsubscribe: Callable[[], object] = lambda: None

    def open(self) -> Callable[[], None]:
        """Returns what ends it."""
        self._is_open = True

        def close() -> None:
            self._is_open = False
            for key in [key for key, each in self._followed.items() if not each.said]:
                self._forget(key)

        return close

    def follow(self, execution: Execution, is_silent: bool = False) -> None:
        """Ends its earlier message. ``is_silent``: its robot is known not to answer."""
        key = execution.id
        self._end(key)
        if not self._is_open:
            return
        if not self._followed:
            self._unsubscribe = self._shell.bus.subscribe(Changed, self._changed)
        each = self._followed[key] = Followed(execution.group_id is not None, is_silent)

        def early_no_more(_dt: float) -> None:
            each.is_early = False
            self._look(key)

        def late(_dt: float) -> None:
            each.is_late = True
            self._look(key)

        each.clocks = Clock.schedule_once(early_no_more, CHOSEN_WITHIN), Clock.schedule_once(late, ANSWERS_WITHIN)
        self._look(key)

    def _changed(self, event: Changed) -> None:
        if event.topic in (Topic.EXECUTIONS, Topic.HOLDS):
            for key in list(self._followed):
                self._look(key)

    def _look(self, key: int) -> None:
        if self._current(key) is not None:
            self._shell.background.run(
                lambda: self._read(key), lambda found: self._take(key, found), lambda _problem: None, key=(self, key)
            )

    def _current(self, key: int) -> Followed | None:
        """None as soon as the message is closed."""
        each = self._followed.get(key)
        if each is not None and each.said and each.said not in self._shell.snackbars.texts:
            self._forget(key)
            return None
        return each

    def _take(self, key: int, found: Execution | None) -> None:
        each, mission_names = self._current(key), self._shell.mission_names.known
        words = outcome(found, mission_names) if found is not None else None
        if each is None:
            return
        if found is None or (words is None and (found.cancel_code is not None or not found.state.is_open)):
            self._end(key)
            return
        is_unsent = found.state in (State.WAITING, State.SUBMITTING)
        is_retried = is_unsent and found.wait is Wait.RETRY
        if is_unsent and each.is_early and found.robot_id is None and found.wait is Wait.ROBOT:
            return
        if each.is_late and (words is None or is_retried):
            if not each.said:
                self._say(key, each, unanswered(found, mission_names))
            return  # each try says no more
        if words is not None:
            each.is_late = is_retried
            self._say(key, each, words)
        elif each.said:  # what kept it back is over
            self.follow(found)

    def _say(self, key: int, each: Followed, words: Words) -> None:
        text, icon, seconds = words
        if text != each.said:
            each.said, each.is_early = text, False
            self._stop(each)
            self._shell.snackbars.show(text, icon=icon, seconds=seconds, about=about_start(key))

    def _end(self, key: int) -> None:
        """Its message is outdated."""
        self._forget(key)
        self._shell.snackbars.end(about_start(key))

    def _forget(self, key: int) -> None:
        if (each := self._followed.pop(key, None)) is not None:
            self._stop(each)
            if not self._followed:
                self._unsubscribe()

    @staticmethod
    def _stop(each: Followed) -> None:
        for clock in each.clocks:
            clock.cancel()
