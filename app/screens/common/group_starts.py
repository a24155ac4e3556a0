"""A person's commands for a start that waits for a robot of its group: assign a robot, put it before others, hold or
cancel it."""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterable, Mapping, Sequence
from datetime import datetime

from app.database.robots import Hold
from app.domain import choice
from app.domain.execution import Execution, State, Wait
from app.domain.models import Group, Mission, Robot, Settings
from app.i18n import _
from app.screens.common.cancelled import ask_to_cancel, ask_to_stop, is_undoable, say_cancelled
from app.screens.common.holding import HAND, about_start, hold_at, until_words
from app.screens.common.priorities import LEVELS, level, word
from app.screens.common.shell import Shell
from app.services.catalogue.catalogue import Catalogue
from app.services.robots.commands import Operator
from app.widgets.items import Option


def has_no_robot(row: Execution) -> bool:
    return row.state is State.WAITING and row.robot_id is None


def robots_for(
    row: Execution,
    robots: Iterable[Robot],
    groups: Iterable[Group],
    holds: Sequence[Hold],
    settings: Settings,
    now: datetime,
) -> list[Option]:
    """Robots to which a person can assign it: with what each is doing, or why it can't take it now."""
    members = next((group.members for group in groups if group.id == row.group_id), ())
    status = {
        each["robot"]: each for each in row.wait_details.get("robots", ()) if isinstance(each, dict) and "robot" in each
    }
    full = ""
    if row.wait is Wait.PLACE and "place" in row.wait_details:
        full = _("{place} is full: {robot} uses it").format(
            place=row.wait_details["place"], robot=row.wait_details.get("robot", "–")
        )

    def note(robot: Robot) -> str:
        if hold := hold_at(holds, robot.id, now):
            return until_words(hold, settings, now)
        return full or (
            choice.awaited({"robots": [status[robot.name]]}, settings.timezone, _) if robot.name in status else ""
        )

    return [
        Option(robot.id, robot.name, "robot-outline", note(robot))
        for robot in robots
        if robot.id in members and robot.enabled
    ]


def lacking(
    mission: Mission, members: Iterable[Robot], missions: Sequence[Mission], names: Mapping[int, Collection[str]]
) -> list[str]:
    """Names of the robots of a group that don't have the mission, as far as is known. A robot's own mission of that name takes the place of
    the one for all. ``names``: guids that each robot has, by its id."""

    def lacks(robot: Robot) -> bool:
        own = next((each for each in missions if each.name == mission.name and each.robot_id == robot.id), mission)
        there = names.get(robot.id) or ()
        return bool(there) and own.guid not in there

    return [robot.name for robot in members if lacks(robot)]


def lacking_words(names: Sequence[str]) -> str:
    return _("not on {robots}").format(robots=", ".join(names)) if names else ""


class GroupStarts:
    """Commands on starts, in the background, one at a time for each start; ``changed()`` when one ends, even with an
    error. ``follow(execution)`` reports on one that was assigned to a robot. ``present(id)`` is the start as last read:
    it may have begun while a menu or question was open."""

    def __init__(
        self,
        operator: Operator,
        catalogue: Catalogue,
        shell: Shell,
        changed: Callable[[], object],
        follow: Callable[[Execution], object],
        present: Callable[[int], Execution | None],
    ) -> None:
        from app.screens.common.presses import Commands  # needs kivy, which the words of this module don't

        self._operator, self._catalogue, self._shell, self._changed, self._follow = (
            operator,
            catalogue,
            shell,
            changed,
            follow,
        )
        self._present = present
        self._do = Commands(shell, changed).run

    def give(self, row: Execution, robots: Sequence[Option]) -> None:
        title = _("Give {mission} to").format(mission=self._name(row))
        self._shell.dialogs.choose(title, robots, lambda robot_id: self.assign(row, robot_id))

    def assign(self, row: Execution, robot_id: int) -> None:
        self._do(row.id, lambda: self._operator.assign_robot(row.id, robot_id), self._follow)

    def prioritise(self, row: Execution) -> None:
        def chosen(priority: int) -> None:
            said = _("{mission}: priority {priority}").format(mission=self._name(row), priority=word(priority))
            self._do(
                row.id,
                lambda: self._operator.prioritise(row.id, priority),
                self._saying(row, said, "chevron-double-up"),
            )

        self._shell.dialogs.choose(
            _("Priority of {mission}").format(mission=self._name(row)),
            [Option(each, word(each)) for each in LEVELS],
            chosen,
            selected=level(row.priority),
        )

    def cancel(self, row: Execution) -> None:
        row = self._present(row.id) or row

        def cancel() -> None:
            self._do(
                row.id,
                lambda: self._operator.cancel_execution(row.id),
                lambda left: say_cancelled(self._shell, self._catalogue, self._name(row), left, self._changed),
            )

        def agreed() -> None:
            now = self._present(row.id)
            if now is not None and now.state is State.EXECUTING:
                self.cancel(now)
            else:
                cancel()

        if row.state is State.EXECUTING:
            ask_to_stop(self._shell, self._name(row), row.taken_by or row.robot, cancel)
        elif is_undoable(row):
            cancel()
        else:
            ask_to_cancel(self._shell, self._name(row), row.robot, row, agreed)

    def hold(self, row: Execution, held: bool) -> None:
        """Hold or release it."""
        words = _("{mission} is on hold") if held else _("{mission} is no longer on hold")
        said = self._saying(row, words.format(mission=self._name(row)), HAND if held else "play")
        too_late = self._saying(
            row, _("{mission} had already been sent").format(mission=self._name(row)), "information-outline"
        )
        self._do(
            row.id,
            lambda: self._operator.hold_starts([row.id], held),
            lambda number: (said if number else too_late)(number),
        )

    def start_on_another(self, row: Execution, robots: Sequence[Option]) -> None:
        """Start it on another robot too."""

        def chosen(robot_id: int) -> None:
            self.start_also(row, robot_id, next((robot.text for robot in robots if robot.key == robot_id), ""))

        self._shell.dialogs.choose(_("Start on another robot"), robots, chosen)

    def start_also(self, row: Execution, robot_id: int, name: str) -> None:
        """Start it on that robot too (0: on any other): asks first, because the silent robot may have it."""
        asked = _("Start {mission} on {robot}?") if robot_id else _("Start {mission} on another robot?")
        self._shell.sheets.ask(
            asked.format(mission=self._name(row), robot=name),
            _("If {robot} already has it, it runs twice.").format(robot=row.robot),
            _("Start it"),
            lambda: self._do(row.id, lambda: self._operator.start_on_another(row.id, robot_id or None), self._follow),
            _("Don't start"),
        )

    def _name(self, row: Execution) -> str:
        return self._shell.mission_names.known.run(row)

    def _saying(self, row: Execution, text: str, icon: str) -> Callable[[object], None]:
        return lambda _done: self._shell.snackbars.show(text, icon=icon, about=about_start(row.id))
