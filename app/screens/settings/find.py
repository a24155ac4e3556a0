"""Settings, Robots, Find robots: the sheet that asks the addresses beside the tablet's own, and lists the robots that answer."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any

from kivy.clock import Clock
from kivy.properties import BooleanProperty, ListProperty, StringProperty

from app.domain.robot import RobotStatus
from app.i18n import _, ngettext
from app.mir.address import machine
from app.screens.common.problems import sentence_of
from app.screens.common.threads import Job
from app.screens.settings.edit_sheet import SettingsSheet
from app.screens.settings.facts import SettingsFacts
from app.screens.settings.page import PageContext
from app.services.robots import finder
from app.widgets.items import Action, Item

SHOWN_EVERY = 0.25  # s; the answers come from other threads


def found_items(facts: SettingsFacts, found: Mapping[str, RobotStatus]) -> list[Item]:
    """A row per robot that answers, by address; those that are there already can't be added."""
    known = {machine(robot.address) for robot in facts.robots}
    ordered = sorted(found, key=lambda address: [part.zfill(3) for part in address.split(".")])
    return [_item(address, found[address], machine(address) in known) for address in ordered]


def _item(address: str, status: RobotStatus, is_known: bool) -> Item:
    return Item(
        address,
        " · ".join((status.robot_model or _("MiR robot"), address)),
        status.robot_name,
        _("Added") if is_known else "",
        icon="robot-outline",
        opens=False,
        actions=() if is_known else (Action("add", _("Add")),),
    )


def found_phrase(asked: int, of: int, found: int) -> str:
    """How far it is, or its result."""
    if not of:
        return _("This tablet has no private network.")
    if asked < of:
        return (
            ngettext("{asked} of {of} asked, {n} robot", "{asked} of {of} asked, {n} robots", found)
            if found
            else _("{asked} of {of} asked, no robot")
        ).format(asked=asked, of=of, n=found)
    return (
        ngettext("{n} robot answers.", "{n} robots answer.", found).format(n=found)
        if found
        else _("No robot answers. One that is reached over https only has to be added by its address.")
    )


class FindSheet(SettingsSheet):
    """Searches while it is open; ``add(address, name)`` is called for the chosen robot."""

    items = ListProperty()
    said = StringProperty()
    is_searching = BooleanProperty(False)

    def __init__(self, context: PageContext, add: Callable[[str, str], object], **kwargs: Any) -> None:
        self._context, self._add = context, add
        self._is_wanted = False  # read by other threads
        self._answers: dict[str, RobotStatus | None] = {}  # written by them
        self._of: int | None = None  # None: not known yet
        self._job: Job | None = None  # under way
        self._tick = Clock.create_trigger(self._show, SHOWN_EVERY, interval=True)
        super().__init__(title=_("Find robots"), foot_style="outlined", **kwargs)
        self._search()

    def on_parent(self, sheet: SettingsSheet, place: Any) -> None:
        super().on_parent(sheet, place)
        if place is None:
            self._is_wanted = False

    def on_done(self) -> None:
        """Stop, or search again."""
        if self.is_searching:
            self._is_wanted = False
        else:
            self._search()

    def _search(self) -> None:
        answers: dict[str, RobotStatus | None] = {}
        self._answers = answers
        self._of, self._job = None, None
        self._is_wanted = self.is_searching = True

        def work() -> None:
            asked = finder.addresses()
            self._of = len(asked)
            finder.find(asked, answers.__setitem__, self._goes_on)

        def failed(problem: BaseException) -> None:
            self._end()
            self.said = sentence_of(problem)

        self._job = self._context.run(work, lambda _none: self._end(), failed, apart="find robots")
        self._tick()
        self._show()

    def _goes_on(self) -> bool:
        """Called by its threads: neither stopped nor is the app ending."""
        return self._is_wanted and not (self._job is not None and self._job.cancelled)

    def _end(self) -> None:
        self.is_searching = False
        self._tick.cancel()
        self._show()

    def _show(self, *_args: object) -> None:
        answers = dict(self._answers)
        found = {address: status for address, status in answers.items() if status is not None}
        self.items = found_items(self._context.facts, found)
        self.said = found_phrase(len(answers), self._of, len(found)) if self._of is not None else ""
        self.foot = _("Stop") if self.is_searching else _("Search again")

    def choose(self, address: str) -> None:
        status = self._answers.get(address)
        self._add(address, status.robot_name if status else "")
