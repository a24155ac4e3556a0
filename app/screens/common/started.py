"""What became of a mission that a person has just started: said once, and only when it is known."""
from __future__ import annotations

from collections.abc import Callable

from kivy.clock import Clock, ClockEvent

from app.domain import choice
from app.domain.models import Execution, State, Wait
from app.domain.reasons import sentence, waiting_sentence
from app.i18n import _
from app.screens.common import formats
from app.screens.common.holding import HAND
from app.screens.common.shell import PROBLEM_SECONDS, Shell
from app.screens.common.view_model import Changed
from app.services.live.changes import Topic
from app.widgets.snackbar import SECONDS

ANSWERS_WITHIN = 5.0                     # s, after which it is said that a robot's answer is waited for
CHOSEN_WITHIN = 1.0                      # s, after which it is said that a start of a group has no robot yet

Words = tuple[str, str, float]           # text, icon, and for how many seconds it is shown


def outcome(execution: Execution) -> Words | None:
    """None while it is under way, or when it was cancelled, which is said where that is done."""
    names = {"mission": execution.mission, "robot": execution.robot or execution.robot_group}
    passed = choice.moved_on(execution.tried, execution.robot, _)
    if execution.state is State.WAITING and execution.wait is not Wait.DUE:
        words = waiting_sentence(execution, None, _)
        if execution.robot_id is None:
            words = ". ".join(filter(None, (passed, words)))
            return _("{mission} is not sent yet. {why}").format(mission=execution.mission, why=words), "timer-sand", PROBLEM_SECONDS
        return _("{mission} is not sent to {robot} yet. {why}").format(**names, why=words), \
            HAND if execution.wait is Wait.HOLD else "timer-sand", PROBLEM_SECONDS
    if execution.queue_id is not None or execution.state in (State.QUEUED, State.EXECUTING, State.COMPLETED):
        if why := passed or choice.chosen(execution.choice, execution.timezone, _):
            return _("{mission} is sent to {robot}. {why}").format(**names, why=why), "check", PROBLEM_SECONDS
        return _("{mission} is sent to {robot}").format(**names), "check", SECONDS
    if execution.reason is not None and execution.state is not State.CANCELLED:
        why = sentence(execution.reason, execution.timezone, _)
        return _("{mission} was not started on {robot}. {why}").format(**names, why=why), "alert-circle-outline", PROBLEM_SECONDS
    return None


def unanswered(execution: Execution) -> Words:
    """Nothing is known yet."""
    text = _("{mission} waits for an answer of {robot}, until {time} at most") if execution.robot else _(
        "{mission} waits for a robot of {group}, until {time} at most")
    return text.format(mission=execution.mission, robot=execution.robot, group=execution.robot_group,
                       time=formats.clock_time(execution.closes_at, execution.timezone)), "timer-sand", PROBLEM_SECONDS


class StartReports:
    """Follows what was started, while the screen is shown, until there is something to say. ``read`` gives an execution as it is now."""

    def __init__(self, shell: Shell, read: Callable[[int], Execution | None]) -> None:
        self._shell, self._read = shell, read
        self._followed: dict[int, tuple[ClockEvent, ...]] = {}
        self._said: dict[int, str] = {}                       # of those that wait, until it has been read
        self._is_early: set[int] = set()                      # ids of those that may get a robot at any moment

    def open(self) -> Callable[[], None]:
        """Returns what ends it."""
        release = self._shell.bus.subscribe(Changed, self._changed)

        def close() -> None:
            release()
            for key in list(self._followed):
                self._forget(key)

        return close

    def follow(self, execution: Execution, is_silent: bool = False) -> None:
        """``is_silent``: the robot is known not to answer."""
        key = execution.id
        self._forget(key)
        if execution.group_id is not None:
            self._is_early.add(key)
        self._followed[key] = (
            Clock.schedule_once(lambda _dt: self._say(key, unanswered(execution)), 0 if is_silent else ANSWERS_WITHIN),
            Clock.schedule_once(lambda _dt: self._early_no_more(key), CHOSEN_WITHIN))
        self._look(key)

    def _early_no_more(self, key: int) -> None:
        if key in self._is_early:
            self._is_early.remove(key)
            self._look(key)

    def _changed(self, event: Changed) -> None:
        if event.topic is Topic.EXECUTIONS:
            for key in self._followed:
                self._look(key)

    def _look(self, key: int) -> None:
        self._shell.background.run(lambda: self._read(key), lambda found: self._take(key, found), lambda _problem: None,
                                   key=("started", key))

    def _take(self, key: int, found: Execution | None) -> None:
        if found is not None and found.robot_id is None and found.wait is Wait.ROBOT and found.state.is_open and key in self._is_early:
            return
        if found is not None and (words := outcome(found)):
            self._say(key, words, found.state is State.WAITING)
        elif found is None or not found.state.is_open:
            self._forget(key)
            self._shell.snackbars.end(("started", key))

    def _say(self, key: int, words: Words, waits: bool = False) -> None:
        """That it ``waits`` is no more true when a person releases it while that is read."""
        text, icon, seconds = words
        if key not in self._followed or self._said.get(key) == text:
            return
        self._forget(key)
        self._shell.snackbars.show(text, icon=icon, seconds=seconds, about=("started", key))
        if waits:
            self._said[key] = text
            self._followed[key] = (Clock.schedule_once(lambda _dt: self._forget(key), seconds),)

    def _forget(self, key: int) -> None:
        self._is_early.discard(key)
        self._said.pop(key, None)
        for event in self._followed.pop(key, ()):
            event.cancel()
