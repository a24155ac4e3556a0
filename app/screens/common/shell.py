"""The interface between the window and its screens.

A screen is an MDScreen, built lazily on its first visit as ``HomeScreen(HomeScreen.Model(services, shell))``; they are listed in
``SCREENS``. ``services`` is an instance of the class's ``Services``: the services that this screen uses, and no others.
The window calls ``shown(**intent)`` each time it appears (``shell.go("logs", execution_id=7)`` passes the intent) and
``hidden()`` when another one replaces it: between the two it subscribes to ``Changed`` on the bus and ticks, otherwise
it does nothing. The frame (top bar, banner, navigation) belongs to the window; a screen fills the space between them,
and the margins around it are the frame's.
"""

from __future__ import annotations

import logging
from collections.abc import Callable, Hashable
from dataclasses import dataclass, field, fields
from pathlib import Path
from typing import TYPE_CHECKING, Any, Protocol, TypeVar

from app.domain.models import InvalidInput, Robot
from app.screens.common.mission_names import SharedMissionNames
from app.screens.common.problems import is_of_robot, sentence_of
from app.screens.common.sheets import Sheets, offer_undo

if TYPE_CHECKING:
    from app.screens.common.view_model import Background, Dialogs, Navigator, Snackbars, UiBus

S = TypeVar("S")
log = logging.getLogger(__name__)

PROBLEM_SECONDS = 8.0

# name: (module, class)
SCREENS = {
    "home": ("app.screens.home.screen", "HomeScreen"),
    "scheduler": ("app.screens.scheduler.screen", "SchedulerScreen"),
    "logs": ("app.screens.logs.screen", "LogsScreen"),
    "settings": ("app.screens.settings.screen", "SettingsScreen"),
    "alarms": ("app.screens.frame.alarms", "AlarmsScreen"),
}


def pick(kind: type[S], container: object) -> S:
    """The services of a screen: ``kind`` is a dataclass whose fields are named as services of the container."""
    return kind(**{field.name: getattr(container, field.name) for field in fields(kind)})  # type: ignore[arg-type]


class Loudspeaker(Protocol):
    """Of the tablet, if one ``exists``; ``play()`` makes the sound of an alarm."""

    @property
    def exists(self) -> bool: ...

    def play(self) -> None: ...


@dataclass(frozen=True)
class Shell:
    """The services of the window (app/screens/common/view_model.py shows how they are used); tests pass fakes.

    ``navigator`` shows another screen; ``dialogs`` asks; ``sheets`` shows a sheet beside the page; ``snackbars`` reports what was done,
    with Undo; ``bus`` delivers events of other threads on the UI thread; ``background`` runs work off the UI thread and its result back on
    it. ``restore`` closes the services, replaces the database by a backup and continues with it; None: this window can't. Without a
    ``loudspeaker`` it is silent. ``mission_names`` are the known names and values of missions.
    """

    navigator: Navigator
    dialogs: Dialogs
    snackbars: Snackbars
    bus: UiBus
    background: Background
    restore: Callable[[Path], object] | None = None
    loudspeaker: Loudspeaker | None = None
    mission_names: SharedMissionNames = field(default_factory=SharedMissionNames)
    sheets: Sheets = field(default_factory=Sheets)

    def go(self, screen: str, **intent: Any) -> None:
        """Show ``screen`` (a key of SCREENS): ``go("settings", section="robots", add=True)``, ``go("scheduler", schedule_id=3)``."""
        self.navigator.go(screen, **intent)

    def say_problem(self, problem: BaseException, asked: str = "") -> None:
        """Show one sentence about an error, long enough to be read. ``asked``: what was asked for, in case the user has
        moved on."""
        said = sentence_of(problem)
        self.snackbars.show(f"{asked}: {said}" if asked else said, icon="alert-circle-outline", seconds=PROBLEM_SECONDS)

    def say_not_done(self, problem: BaseException, robot: Robot, asked: str) -> None:
        """The message that a robot was ``asked`` something and has not done it, with its name: the user may look at
        another one now."""
        if is_of_robot(problem):
            self.say_problem(problem.at(robot.name), asked)
        else:  # of the disk, for example, or of a host name: it names no robot
            self.say_problem(problem, " · ".join(filter(None, (robot.name, asked))))

    def offer_undo(
        self,
        text: str,
        undo: Callable[[], object],
        undone: Callable[[], object],
        *,
        behind: str = "",
        about: Hashable | None = None,
    ) -> None:
        """Show ``text`` with an offer to undo. If ``undo()``, in the background, raises InvalidInput, its sentence is shown with the
        offer. ``behind`` a screen's guard it is offered until the guard lets the user pass. Ends earlier messages and
        offers ``about`` the same."""

        def refused(problem: BaseException) -> None:
            if isinstance(problem, InvalidInput):
                self.offer_undo(sentence_of(problem), undo, undone, behind=behind, about=about)
            else:
                log.error("could not be undone", exc_info=problem)
                self.say_problem(problem)

        def work() -> None:
            self.background.run(undo, lambda _none: undone(), refused)

        topic = work if about is None else about
        offer_undo(self.navigator, self.snackbars, text, work, behind=behind, about=topic)
