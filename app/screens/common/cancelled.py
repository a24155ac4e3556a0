"""What is said of a start that was cancelled, and that it can wait again."""
from __future__ import annotations

from collections.abc import Callable

from app.domain.models import Execution
from app.i18n import _
from app.screens.common.holding import about_start
from app.screens.common.shell import Shell
from app.services.catalogue.catalogue import Catalogue
from app.services.catalogue.undo import may_wait_again


def say_cancelled(shell: Shell, catalogue: Catalogue, mission: str, left: Execution | None, changed: Callable[[], object]) -> None:
    """``left``: ours, as it is now; open until the robot has said that it is gone. With Undo where nothing of it was ever sent;
    ``changed()`` when that was pressed."""
    if left is not None:
        shell.snackbars.end(about_start(left.id))
    said = _("{mission} is being cancelled") if left is not None and left.state.is_open else _("{mission} is cancelled")
    if left is None or not may_wait_again(left):
        shell.snackbars.show(said.format(mission=mission), icon="close")
        return
    again, row_id = _("{mission} waits again").format(mission=mission), left.id

    def waits(_none: None) -> None:
        shell.snackbars.show(again, icon="undo", about=about_start(row_id))
        changed()

    # of a refusal only the sentence: none of them is mended by trying again
    shell.snackbars.undo(said.format(mission=mission), _("Undo"),
                         lambda: shell.background.run(lambda: catalogue.wait_again(row_id), waits, shell.say_problem))
