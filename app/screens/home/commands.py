"""The operator's commands to the robot on Home. Each runs in the background and reports its result with the robot's
name."""

from __future__ import annotations

from collections.abc import Callable, Hashable
from dataclasses import replace
from datetime import datetime
from functools import partial
from typing import Any

from kivy.clock import Clock

from app.domain.models import Robot, RobotSnapshot
from app.i18n import _, ngettext
from app.mir.errors import Rejected, RobotError
from app.screens.common.cancelled import ask_to_cancel, ask_to_stop, is_undoable, say_cancelled
from app.screens.common.presses import OfRobot, Presses
from app.screens.common.shell import PROBLEM_SECONDS, Shell
from app.screens.common.view_model import Refresher
from app.screens.home.card import error_words, has_errors
from app.screens.home.cards import HomeState
from app.screens.home.facts import HomeFacts, HomeServices, Standing, standing
from app.screens.home.fleet import ANSWER
from app.widgets.items import Item

READ_WITHIN = 5.0  # s until the message that errors remain after the reset
ASKED_UNTIL = 8.0  # s after an answer, in which a robot may still show its question
GONE = (404, 410)  # a robot's answers about an item that it no longer has


def foot_of(robot_id: int) -> OfRobot:
    """The key of presses on the button of that robot's card, whatever it does: a double tap never means two things."""
    return OfRobot("foot", robot_id)


class ResetReport:
    """``say(text)`` shows it, once for each ``begin``, unless another screen is shown."""

    def __init__(self, say: Callable[[str], object]) -> None:
        self._say = say
        self._asked: tuple[Robot, datetime, float] | None = None  # since when, and until when to wait for its answer
        self.without_effect: frozenset[Standing] = frozenset()  # errors that were reset and stand

    def begin(self, robot: Robot, pressed_at: datetime) -> None:
        """The robot has taken Reset errors."""
        self._asked = robot, pressed_at, Clock.get_time() + READ_WITHIN

    def forget(self) -> None:
        """It may be long ago when this screen is shown again."""
        self._asked, self.without_effect = None, frozenset()

    def look(self, facts: HomeFacts) -> None:
        """Whether its errors are over."""
        self.without_effect &= {standing(snapshot) for snapshot in facts.snapshots.values()}
        if self._asked is None:
            return
        robot, since, until = self._asked
        seen = facts.snapshots.get(robot.id) or RobotSnapshot(robot.id)
        status = seen.status if seen.read_at is not None and seen.read_at >= since else None
        is_over = status is not None and not has_errors(status)
        if not is_over and Clock.get_time() < until:
            return
        self._asked = None
        if status is not None and not is_over:
            self.without_effect |= {standing(seen)}
            text = _("Still there: {problem}. Remove its cause at {robot}, then reset again")
            self._say(text.format(problem=error_words(status), robot=robot.name))


class HomeCommands(HomeState):
    """The part of Home's view model that sends commands to the selected robot."""

    facts: HomeFacts
    _services: HomeServices
    _shell: Shell
    _reader: Refresher[Any]
    _presses: Presses
    _reset: ResetReport
    act_once: Callable[..., bool]  # as Commands.run

    def _show(self) -> None:
        """The facts have changed."""
        raise NotImplementedError

    def press_foot(self) -> None:
        """The next step of the robot that is shown, or Pause."""
        robot, action = self.facts.robot, self.view.card.foot.action
        if robot is None or self._presses.is_same(foot_of(robot.id)):
            return
        match action:
            case "reset":
                self.reset_errors(robot)
            case "resume":
                self.resume(robot)
            case _:
                said = self._saying(_("{robot} pauses").format(robot=robot.name), "pause", foot_of(robot.id))
                refused = self._refused(robot, _("Pause"))
                self.act_once(foot_of(robot.id), lambda: self._services.operator.pause(robot.id), said, refused)

    def resume(self, robot: Robot) -> None:
        key = foot_of(robot.id)
        if not self._presses.is_same(key):
            self.act_once(
                key,
                lambda: self._services.operator.resume(robot.id),
                self._saying(_("{robot} continues").format(robot=robot.name), "play", key),
                self._refused(robot, _("Resume")),
            )

    def reset_errors(self, robot: Robot | None = None) -> None:
        """Of the selected robot, or of that one. The result is shown after its next reading."""
        robot = robot or self.facts.robot
        if robot is not None and not self._presses.is_same(foot_of(robot.id)):
            pressed_at = self._services.clock.now()
            self.act_once(
                foot_of(robot.id),
                lambda: self._services.operator.reset_errors(robot.id),
                lambda _none: self._reset.begin(robot, pressed_at),
                self._refused(robot, _("Reset errors")),
            )

    def command(self, robot: Robot, name: str, helps: bool) -> None:
        """What solves the problem of a robot, as its row among all says; unless it no longer ``helps``."""
        if name.startswith(ANSWER):
            guid, _line, option = name.removeprefix(ANSWER).partition("\n")
            over = self._question_is_over(robot, guid)
            send, key = partial(self.answer_of, robot, guid, option), OfRobot("answer", robot.id)
        else:
            over = "" if helps else _("{robot}: nothing sent, its state has changed").format(robot=robot.name)
            send, key = partial(self.reset_errors if name == "reset" else self.resume, robot), foot_of(robot.id)
        if not over:
            send()
        elif not self._presses.is_same(key):
            self._shell.snackbars.show(over, icon="information-outline", seconds=PROBLEM_SECONDS)

    def clear_queue(self) -> None:
        """Asked first: what is aborted can't be brought back."""
        robot, count = self.facts.robot, self.view.clear_count
        if robot is None or not count or self._presses.is_same(OfRobot("clear", robot.id)):
            return
        title = ngettext(
            "Clear {n} mission from the queue of {robot}?", "Clear {n} missions from the queue of {robot}?", count
        )
        text = _("Missions of others go too. A running one is cancelled.")
        if not self.facts.snapshot.capabilities.own_queue:
            text = _("Missions of others stay. A running one is cancelled.")
        if self.view.card.old:
            text += " " + _("{robot} doesn't answer now, so perhaps nothing is removed.").format(robot=robot.name)
        asked = title.format(n=count, robot=robot.name)
        self._shell.sheets.ask(asked, text, _("Clear queue"), lambda: self._clear(robot), _("Keep"))

    def _clear(self, robot: Robot) -> None:
        self.facts = replace(self.facts, clearing=self.facts.clearing | {robot.id})
        self.act_once(
            OfRobot("clear", robot.id),
            lambda: self._services.operator.clear_queue(robot.id),
            self._saying(_("The queue of {robot} is cleared").format(robot=robot.name), "playlist-remove"),
            lambda problem: self._not_cleared(problem, robot),
        )
        self._show()

    def _not_cleared(self, problem: BaseException, robot: Robot) -> None:
        """The app's items are cancelled one by one if it is unknown whether the robot has cleared them."""
        if isinstance(problem, RobotError) and not problem.certainly_without_effect:
            said = _("{robot} has not answered yet: missions sent from here are cancelled as soon as it does")
            self._shell.snackbars.show(said.format(robot=robot.name), icon="timer-sand", seconds=PROBLEM_SECONDS)
        else:
            self._refused(robot, _("Clear queue"))(problem)

    def cancel(self, key: tuple[str, int]) -> None:
        """Cancel one row of the queue: the app's by the execution, others' by the item. Asks first if it runs or can't be undone."""
        robot, row = self.facts.robot, self._row(key)
        if robot is None or row is None or self._presses.is_same(OfRobot(key, robot.id)):
            return  # without a row: it went in the frame of the press
        name, ours = row.title, next((each for each in self.facts.open if key == ("execution", each.id)), None)
        if not row.number:
            following = next((each.title for each in self.view.today if each.number and each.actions), "")
            is_moving = row.tone == "accent"
            stops = (ours.taken_by if ours is not None else "") or ("" if robot.is_any else robot.name)
            ask_to_stop(
                self._shell, name, stops, lambda: self._cancel(robot, key, name), following if is_moving else ""
            )
        elif ours is not None and is_undoable(ours):
            self._cancel(robot, key, name)
        else:
            ask_to_cancel(self._shell, name, robot.name, ours, lambda: self._agreed(robot, key, name))

    def _row(self, key: tuple[str, int]) -> Item | None:
        return next((row for row in self.view.today if row.key == key), None)

    def _agreed(self, robot: Robot, key: tuple[str, int], name: str) -> None:
        """Cancel it if it still only waits; a run that has begun since needs another question."""
        shown, row = self.facts.robot, self._row(key)
        if shown is not None and shown.id == robot.id and row is not None and not row.number:
            self.cancel(key)
        elif not self._presses.is_same(OfRobot(key, robot.id)):
            self._cancel(robot, key, name)

    def _cancel(self, robot: Robot, key: tuple[str, int], name: str) -> None:
        operator, (kind, number) = self._services.operator, key
        if kind == "item":
            self.facts = replace(self.facts, cancelling=self.facts.cancelling | {(robot.id, number)})
        self.act_once(
            OfRobot(key, robot.id),
            lambda: (
                operator.cancel_execution(number) if kind == "execution" else operator.cancel_item(robot.id, number)
            ),
            lambda left: say_cancelled(self._shell, self._services.catalogue, name, left, self._reader.request),
            lambda problem: self._not_cancelled(problem, robot, key, name),
        )
        self._show()

    def _not_cancelled(self, problem: BaseException, robot: Robot, key: tuple[str, int], name: str) -> None:
        kind, number = key
        if kind == "item":  # executions are numbered by themselves
            self.facts = replace(self.facts, cancelling=self.facts.cancelling - {(robot.id, number)})
        if isinstance(problem, Rejected) and problem.status in GONE:
            said = _("{mission} had already ended").format(mission=name)
            self._shell.snackbars.show(said, icon="information-outline")
        else:
            self._refused(robot, name)(problem)

    def answer(self, option: str) -> None:
        if self.facts.robot is not None and self.view.card.note.guid:
            self.answer_of(self.facts.robot, self.view.card.note.guid, option)

    def answer_of(self, robot: Robot, guid: str, option: str) -> None:
        """Answer that robot's question."""

        def forget(_dt: float) -> None:
            self.facts = replace(self.facts, answered=self.facts.answered - {guid})

        def answered(_none: None) -> None:
            self.facts = replace(self.facts, answered=self.facts.answered | {guid})
            Clock.schedule_once(forget, ASKED_UNTIL)
            said = _("Answer sent to {robot}: {answer}").format(robot=robot.name, answer=option)
            self._shell.snackbars.show(said, icon="comment-check-outline")

        def not_answered(problem: BaseException) -> None:
            if said := self._question_is_over(robot, guid):
                self._shell.snackbars.show(said, icon="information-outline", seconds=PROBLEM_SECONDS)
            else:
                self._refused(robot, _("Answer"))(problem)

        if guid not in self.facts.answered and not self._presses.is_same(OfRobot("answer", robot.id)):
            self.act_once(
                OfRobot("answer", robot.id),
                lambda: self._services.operator.answer_prompt(robot.id, guid, option),
                answered,
                not_answered,
            )

    # ------------------------------------------------------------------ inside
    def _question_is_over(self, robot: Robot, guid: str) -> str:
        """A sentence, if the robot asked something else or nothing when it was last read."""
        status = self._services.snapshots.get(robot.id).status
        now = status.user_prompt if status is not None else None
        if now is None:
            return f"{robot.name}: {_('The question has been answered or withdrawn')}"
        return _("{robot} asks something else now").format(robot=robot.name) if now.guid != guid else ""

    def _saying(self, text: str, icon: str, about: Hashable | None = None) -> Callable[[object], None]:
        """To be called with an outcome that has no words of its own."""
        return lambda _outcome: self._shell.snackbars.show(text, icon=icon, about=about)

    def _refused(self, robot: Robot, asked: str) -> Callable[[BaseException], object]:
        """To be called with what went wrong."""
        return lambda problem: self._shell.say_not_done(problem, robot, asked)
