"""Messages about the outcome of a mission that a person has just started: shown when known, and only while true."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

from kivy.clock import Clock

from app.domain import choice
from app.domain.execution import Execution, State, Wait
from app.i18n import _
from app.screens.common import formats
from app.screens.common.execution_appearance import cause
from app.screens.common.holding import about_start, waiting_words
from app.screens.common.mission_names import MissionNames
from app.screens.common.shell import PROBLEM_SECONDS, Shell
from app.screens.common.view_model import Changed, ViewModel
from app.services.executions.transitions import NOT_WITH_THE_ROBOT
from app.services.history.runs import History
from app.services.live.changes import Topic
from app.widgets.snackbar import SECONDS

ANSWERS_WITHIN = 5.0  # s until the message that a robot has not answered, or that a group has no free one

Words = tuple[str, str, float]  # text, icon, and for how many seconds it is shown


def outcome(execution: Execution, mission_names: MissionNames, is_late: bool = False) -> Words | None:
    """None if it is cancelled, which has its own message, or while it is under way and not yet ``is_late``."""
    if execution.state is State.CANCELLED or execution.cancel_code is not None:
        return None
    zone, icon, seconds = execution.timezone, "timer-sand", PROBLEM_SECONDS
    why, passed = waiting_words(execution, zone), choice.earlier_robots(execution.tried, execution.robot, _)
    is_waiting = execution.state is State.WAITING and execution.wait is not Wait.DUE
    if execution.queue_id is not None or execution.state in (State.QUEUED, State.EXECUTING, State.COMPLETED):
        text, icon, why = (
            _("{mission} is sent to {robot}. {why}"),
            "check",
            passed or choice.chosen(execution.choice, zone, _),
        )
        if not why:
            text, seconds = _("{mission} is sent to {robot}"), SECONDS
    elif execution.reason is not None:
        text, icon = _("{mission} was not started on {robot}. {why}"), "alert-circle-outline"
        why = cause(execution, zone)[0]
    elif is_waiting and execution.robot_id is not None:
        text = _("{mission} is not sent to {robot} yet. {why}")
    elif is_waiting and (is_late or passed or execution.wait is not Wait.ROBOT):
        text, why = _("{mission} is not sent yet. {why}"), ". ".join(filter(None, (passed, why)))
    elif execution.state is State.SUBMITTING and "answer" in execution.wait_details:
        text = _("It is not certain that {robot} has {mission}. {why}")
    elif is_late and execution.robot:
        text = _("{mission}: no answer from {robot}, tried until {time}")
    else:
        return None
    robot, time = execution.robot or execution.robot_group, formats.clock_time(execution.closes_at, zone)
    return text.format(mission=mission_names.run(execution), robot=robot, why=why, time=time), icon, seconds


@dataclass
class Followed:
    """A start whose message is shown (``said``), or not known yet. ``is_retried``: that says that it is tried again."""

    unsubscribe: Callable[[], object]
    is_late: bool = False
    said: str = ""
    is_retried: bool = False


class StartReports:
    """Follows the starts made on ``page`` until their message, while it is open; then, on every screen, as long as the
    message is shown, as it may become outdated."""

    def __init__(self, page: ViewModel, shell: Shell, history: History) -> None:
        self._page, self._shell, self._history = page, shell, history
        self._followed: dict[int, Followed] = {}  # by the execution's id

    def follow(self, execution: Execution) -> None:
        """Ends its earlier message."""
        key = execution.id
        self._end(key)

        def changed(event: Changed) -> None:
            if event.topic is Topic.EXECUTIONS:
                self._look(key)

        def late(_dt: float) -> None:
            each.is_late = True
            self._look(key)

        each = self._followed[key] = Followed(self._shell.bus.subscribe(Changed, changed))
        Clock.schedule_once(late, ANSWERS_WITHIN)
        self._look(key)

    def _look(self, key: int) -> None:
        if self._current(key) is not None:
            self._shell.background.run(
                lambda: self._history.get(key),
                lambda found: self._take(key, found),
                lambda _problem: None,
                key=(self, key),
            )

    def _current(self, key: int) -> Followed | None:
        """None as soon as the message is closed, or the page before there is one."""
        each = self._followed.get(key)
        if each is not None and (each.said in self._shell.snackbars.texts if each.said else self._page.is_open):
            return each
        self._forget(key)
        return None

    def _take(self, key: int, found: Execution | None) -> None:
        each = self._current(key)
        if each is None:
            return
        if found is None or found.cancel_code is not None or found.state is State.CANCELLED:
            self._end(key)
            return
        is_unsent = found.state in NOT_WITH_THE_ROBOT and "answer" not in found.wait_details
        is_retried = is_unsent and found.wait is Wait.RETRY
        if is_retried and each.is_retried:
            return  # each try says no more than the first
        words = outcome(found, self._shell.mission_names.known, each.is_late)
        if words is None and each.said:  # what kept it back is over
            self.follow(found)
        elif words is not None and words[0] != each.said:
            each.is_retried, (each.said, icon, seconds) = is_retried, words
            self._shell.snackbars.show(each.said, icon=icon, seconds=seconds, about=about_start(key))

    def _end(self, key: int) -> None:
        """Its message is outdated."""
        self._forget(key)
        self._shell.snackbars.end(about_start(key))

    def _forget(self, key: int) -> None:
        if (each := self._followed.pop(key, None)) is not None:
            each.unsubscribe()
