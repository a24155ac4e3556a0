"""Cancelling a start: with Undo if it was never sent, otherwise after a question; and the messages about it."""

from __future__ import annotations

from collections.abc import Callable

from app.domain.execution import Execution, State
from app.i18n import _
from app.screens.common.holding import about_start, waiting_words
from app.screens.common.shell import PROBLEM_SECONDS, Shell
from app.services.catalogue.catalogue import Catalogue
from app.services.catalogue.undo import may_wait_again


def is_undoable(row: Execution) -> bool:
    """Whether cancelling it can be undone, or needs no undo: an idle mission starts again automatically."""
    return row.state is State.WAITING and not row.attempts and not row.is_called_off


def ask_to_cancel(shell: Shell, mission: str, robot: str, row: Execution | None, agreed: Callable[[], object]) -> None:
    """What does not run yet. ``row``: the app's execution; None: an item of the robot's queue that others made."""
    if row is None or row.queue_id is not None:
        where = _("It leaves the queue of {robot}.")
    elif row.state is State.SUBMITTING:
        where = _("It is not sent again. If {robot} has it, it is cancelled there.")
    else:
        where = ""
    _ask(shell, mission, f"{where} ".lstrip().format(robot=robot) + _("This can't be undone."), agreed)


def ask_to_stop(shell: Shell, mission: str, robot: str, agreed: Callable[[], object], following: str = "") -> None:
    """What that robot is on, "" if it is not known which one; ``following`` is the next in its queue, as far as
    known."""
    text = _("{robot} stops where it is.").format(robot=robot) if robot else _("Its robot stops where it is.")
    if following:
        text += " " + _("Then it runs {mission}.").format(mission=following)
    _ask(shell, mission, text, agreed)


def _ask(shell: Shell, mission: str, text: str, agreed: Callable[[], object]) -> None:
    asked = _("Cancel {mission}?").format(mission=mission)
    shell.sheets.ask(asked, text, _("Cancel mission"), agreed, _("Keep"))


def say_cancelled(
    shell: Shell, catalogue: Catalogue, mission: str, left: Execution | None, changed: Callable[[], object]
) -> None:
    """``left``: the app's execution as it is now; open until the robot confirms. With Undo if it was never sent;
    ``changed()`` is called after Undo."""
    if left is not None:
        shell.snackbars.end(about_start(left.id))
    said = _("Asked to cancel {mission}") if left is not None and left.state.is_open else _("{mission} is cancelled")
    if left is not None and left.state is State.SUBMITTING:  # its robot is silent, or slow
        words = waiting_words(left, left.timezone)
        shell.snackbars.show(f"{mission}: {words}", icon="close", seconds=PROBLEM_SECONDS)
        return
    if left is None or not may_wait_again(left):
        shell.snackbars.show(said.format(mission=mission), icon="close")
        return
    again, row_id = _("{mission} waits again").format(mission=mission), left.id

    def waits(_none: None) -> None:
        shell.snackbars.show(again, icon="undo", about=about_start(row_id))
        changed()

    # only a refusal's sentence: trying again never helps
    shell.snackbars.undo(
        said.format(mission=mission),
        _("Undo"),
        lambda: shell.background.run(lambda: catalogue.wait_again(row_id), waits, shell.say_problem),
    )
