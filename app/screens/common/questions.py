"""A robot's question that is answered here: it may be over already, or replaced by another one."""

from __future__ import annotations

from typing import Protocol

from kivy.clock import Clock

from app.domain.models import Robot
from app.domain.robot import UserPrompt, clipped
from app.i18n import _
from app.mir.errors import Rejected
from app.screens.common.formats import LONGEST_QUESTION
from app.screens.common.options import Option
from app.screens.common.shell import PROBLEM_SECONDS, Shell
from app.screens.common.threads import Changed
from app.services.dispatch.engine import Engine
from app.services.live.snapshots import Snapshots
from app.services.robots.commands import Operator

READ_WITHIN = 8.0  # s, in which a robot that refuses an answer can be read
SURELY_AFTER = 2  # readings; the first may have begun before


class Services(Protocol):
    """What is used of those of a screen."""

    @property
    def engine(self) -> Engine: ...

    @property
    def operator(self) -> Operator: ...

    @property
    def snapshots(self) -> Snapshots: ...


def asked(snapshots: Snapshots, robot_id: int) -> UserPrompt | None:
    """What the robot was last seen to ask."""
    status = snapshots.get(robot_id).status
    return status.user_prompt if status is not None else None


def over(robot: Robot, guid: str, snapshots: Snapshots) -> str:
    """A sentence if the question with this ``guid`` is over, as the robot was last seen; empty otherwise."""
    now = asked(snapshots, robot.id)
    if now is None:
        return f"{robot.name}: {_('The question has been answered or withdrawn')}"
    return _("{robot} asks something else now").format(robot=robot.name) if now.guid != guid else ""


def say_not_answered(shell: Shell, services: Services, robot: Robot, guid: str, problem: BaseException) -> None:
    """Why the question with this ``guid`` was not answered. If the robot refused the answer, its present question is
    known after its next reading."""

    def say() -> None:
        if text := over(robot, guid, services.snapshots):
            shell.snackbars.show(text, icon="information-outline", seconds=PROBLEM_SECONDS)
        else:
            shell.say_not_done(problem, robot, _("Answer"))

    if not isinstance(problem, Rejected):
        say()
        return
    read_at = {services.snapshots.get(robot.id).read_at}

    def end(_dt: float = 0.0) -> None:
        unsubscribe()
        late.cancel()
        say()

    def look(_changed: Changed) -> None:
        read_at.add(services.snapshots.get(robot.id).read_at)
        if len(read_at) > SURELY_AFTER or (len(read_at) > 1 and over(robot, guid, services.snapshots)):
            end()

    unsubscribe, late = shell.bus.subscribe(Changed, look), Clock.schedule_once(end, READ_WITHIN)
    services.engine.poll(robot.id)


def ask(shell: Shell, services: Services, robot: Robot) -> None:
    """What the robot asks now, as a dialog that ends with the question."""
    snapshots = services.snapshots

    def say(text: str, icon: str) -> None:
        shell.snackbars.show(text, icon=icon, seconds=PROBLEM_SECONDS)

    prompt = asked(snapshots, robot.id)
    guid = prompt.guid if prompt is not None else ""
    if prompt is None:
        say(over(robot, guid, snapshots), "information-outline")
        return

    def answer(option: str) -> None:
        said = _("Answer sent to {robot}: {answer}").format(robot=robot.name, answer=option)
        shell.background.run(
            lambda: services.operator.answer_prompt(robot.id, guid, option),
            lambda _none: say(said, "comment-check-outline"),
            lambda problem: say_not_answered(shell, services, robot, guid, problem),
        )

    def follow(_changed: Changed) -> None:
        if text := over(robot, guid, snapshots):
            dialog.dismiss()
            say(text, "information-outline")

    title = _("{robot} asks: {question}").format(robot=robot.name, question=clipped(prompt.question, LONGEST_QUESTION))
    dialog = shell.dialogs.choose(
        title, [Option(option, option, "comment-outline") for option in dict.fromkeys(prompt.options)], answer
    )
    follows = shell.bus.subscribe(Changed, follow)
    dialog.bind(on_dismiss=lambda *_args: follows())
