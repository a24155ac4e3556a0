"""A robot's question that is answered here: it may be over already, or replaced by another one."""

from __future__ import annotations

from typing import Protocol

from kivy.clock import Clock

from app.domain.models import Robot
from app.i18n import _
from app.mir.errors import Rejected
from app.screens.common.shell import PROBLEM_SECONDS, Shell
from app.screens.common.threads import Changed
from app.services.dispatch.engine import Engine
from app.services.live.snapshots import Snapshots

READ_WITHIN = 8.0  # s, in which a robot that refuses an answer can be read
SURELY_AFTER = 2  # readings; the first may have begun before


class Services(Protocol):
    """What is used of those of a screen."""

    @property
    def engine(self) -> Engine: ...

    @property
    def snapshots(self) -> Snapshots: ...


def over(robot: Robot, guid: str, snapshots: Snapshots) -> str:
    """A sentence if the question with this ``guid`` is over, as the robot was last seen; empty otherwise."""
    status = snapshots.get(robot.id).status
    now = status.user_prompt if status is not None else None
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
