"""A robot's question that somebody answers here: it may be over by then, or another one may have come in its place."""
from __future__ import annotations

from app.domain.models import Robot
from app.domain.problems import clipped
from app.domain.robot import UserPrompt
from app.i18n import _
from app.mir.errors import Rejected
from app.screens.common.formats import LONGEST_QUESTION
from app.screens.common.options import Option
from app.screens.common.shell import PROBLEM_SECONDS, Shell
from app.screens.common.threads import Changed
from app.services.live.snapshots import Snapshots
from app.services.robots.commands import Operator


def asked(snapshots: Snapshots, robot_id: int) -> UserPrompt | None:
    """What the robot was last seen to ask."""
    status = snapshots.get(robot_id).status
    return status.user_prompt if status is not None else None


def over(robot: Robot, guid: str, snapshots: Snapshots, problem: BaseException | None = None) -> str:
    """That the question with this ``guid`` is over, as the robot was last seen, or refuses an answer to it (``problem``); empty: it is
    not."""
    now = asked(snapshots, robot.id)
    if now is not None and now.guid != guid:
        return _("{robot} asks something else now").format(robot=robot.name)
    if now is None or isinstance(problem, Rejected):
        return f"{robot.name}: {_('The question has been answered, or is gone')}"
    return ""


def ask(shell: Shell, snapshots: Snapshots, operator: Operator, robot: Robot) -> None:
    """What the robot asks now, as a dialog that ends with the question."""
    def say(text: str, icon: str) -> None:
        shell.snackbars.show(text, icon=icon, seconds=PROBLEM_SECONDS)

    prompt = asked(snapshots, robot.id)
    guid = prompt.guid if prompt is not None else ""
    if prompt is None:
        say(over(robot, guid, snapshots), "information-outline")
        return

    def answer(option: str) -> None:
        said = _("Answer sent to {robot}: {answer}").format(robot=robot.name, answer=option)
        shell.background.run(lambda: operator.answer_prompt(robot.id, guid, option), lambda _none: say(said, "comment-check-outline"),
                             failed)

    def failed(problem: BaseException) -> None:
        if text := over(robot, guid, snapshots, problem):
            say(text, "information-outline")
        else:
            shell.say_not_done(problem, robot, _("Answer"))

    def follow(_changed: Changed) -> None:
        if text := over(robot, guid, snapshots):
            dialog.dismiss()
            say(text, "information-outline")

    title = _("{robot} asks: {question}").format(robot=robot.name, question=clipped(prompt.question, LONGEST_QUESTION))
    dialog = shell.dialogs.choose(title, [Option(option, option, "comment-outline") for option in dict.fromkeys(prompt.options)], answer)
    follows = shell.bus.subscribe(Changed, follow)
    dialog.bind(on_dismiss=lambda *_args: follows())
