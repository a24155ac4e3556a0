"""The alarms as a page: open, shelved, past. Its model lives as long as the app: it follows what is open while another screen is shown."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from functools import partial
from typing import Any

from kivy.properties import BooleanProperty, ListProperty, StringProperty

from app.domain.models import Alarm, Robot, Settings
from app.i18n import _, ngettext
from app.screens.common.alarm_groups import Together, alarm_item, group_text, menu_of_group, together
from app.screens.common.alarms_view import Act, id_in, is_shelved, is_unseen, past_count, way_to
from app.screens.common.presses import Presses
from app.screens.common.robot_appearance import why_not
from app.screens.common.shell import Shell
from app.screens.common.view_model import ScreenBase, ViewModel
from app.screens.frame.facts import FrameServices
from app.screens.frame.view import new_lines, open_lines
from app.services.live.alarms import LONGEST_NOTE
from app.widgets import load_kv
from app.widgets.items import Item, Tab
from app.widgets.sheet import Sheet

PAGE = 50  # past alarms that are read at first, and whenever the last one comes into sight
EMPTY: Mapping[str, Callable[[], str]] = {
    "open": lambda: _("No alarms"),
    "shelved": lambda: _("Nothing shelved"),
    "past": lambda: _("No past alarms"),
}
Do = Callable[[Act, Any], object]


class NoteSheet(Sheet):
    """Acknowledge an alarm with a note."""

    text = StringProperty()
    note = StringProperty()
    longest = LONGEST_NOTE


class AlarmsModel(ViewModel):
    """Which rows there are, and what their buttons do; ``do`` runs those that lead elsewhere, ``back`` leads to the screen before."""

    tabs = ListProperty()
    tab = StringProperty("open")
    rows = ListProperty()
    head = StringProperty()  # how many are new, or how many past ones there are
    empty = StringProperty()  # without rows
    unseen = ListProperty()  # ids of what is to be acknowledged in several rows of Open
    below = BooleanProperty(False)  # the buttons of a row are in a line of their own

    def __init__(self, services: FrameServices, shell: Shell, do: Do, back: Callable[[], object]) -> None:
        super().__init__()
        self._services, self._shell, self._do, self.back = services, shell, do, back
        self._presses = Presses()
        self._alarms: Sequence[Alarm] = ()
        self._robots: Mapping[int, Robot] = {}
        self._settings = Settings()
        self._past: Sequence[Alarm] | None = None  # None: not read yet
        self._past_total = 0
        self._wanted = PAGE
        self._unfolded: set[int] = set()  # alarms whose group shows all that are in it
        self.fbind("below", self._show)

    # ------------------------------------------------------------------ showing
    def opened(self, unfold: int | None = None) -> None:
        """``unfold`` shows all alarms of this one's group."""
        self._unfolded = set() if unfold is None else {unfold}
        self.rows = []  # those of the last time: what is there now is there from the start
        self.choose("open")

    def show(self, alarms: Sequence[Alarm], robots: Mapping[int, Robot], settings: Settings) -> None:
        """What is open now; called every second."""
        self._alarms, self._robots, self._settings = alarms, robots, settings
        self._show()

    def changed(self) -> None:
        """Something was raised, cleared, acknowledged or shelved."""
        if self.is_open and self.tab == "past":
            self._read_past()

    def choose(self, tab: str) -> None:
        self.tab, self._wanted = tab, PAGE
        self.changed()
        self._show()

    def _show(self, *_args: Any) -> None:
        if not self.is_open:
            return
        now = self._services.clock.now()
        lines = open_lines(self._alarms, now)
        off = together((alarm for alarm in self._alarms if is_shelved(alarm, now)), now)
        self.tabs = [
            Tab("open", _("Open"), count=len(lines)),
            Tab("shelved", _("Shelved"), tone="attention" if off else "", count=len(off)),
            Tab("past", _("Past")),
        ]
        past: list[Together] = [(alarm,) for alarm in self._past or ()]
        groups = {"open": lines, "shelved": off, "past": past}[self.tab]
        self.rows = [item for group in groups for item in self._items(group)]
        new = new_lines(lines) if self.tab == "open" else []
        unseen = [alarm_id for group in new for alarm_id in _unseen(group)]
        self.unseen = unseen if len(new) > 1 else []
        self.head = ngettext("{n} new", "{n} new", len(new)).format(n=len(new)) if new else ""
        if self.tab == "past" and self.rows:
            self.head = past_count(len(self.rows), self._past_total)
        is_reading = self.tab == "past" and self._past is None
        self.empty = "" if self.rows or is_reading else EMPTY[self.tab]()

    def _items(self, group: Together) -> list[Item]:
        """One row, and for an unfolded group those of its alarms."""
        unfolded = len(group) > 1 and any(alarm.id in self._unfolded for alarm in group)
        shown = [group, *((alarm,) for alarm in group if unfolded)]
        now = self._services.clock.now()
        return [
            alarm_item(each, self._robots, self._settings, now, self.below, self._why_no_reset(each[0]))
            for each in shown
        ]

    def _why_no_reset(self, alarm: Alarm) -> str:
        """Its robot's errors, from here."""
        return why_not(self._services.snapshots.get(id_in(alarm.key, "robot") or 0).capabilities.clear_error)

    def _meant_by(self, key: tuple[str, int]) -> Together:
        """The alarms of a row; empty if they are over."""
        kind, alarm_id = key
        found: list[Together] = [(alarm,) for alarm in self._alarms]
        if kind == "group":
            found = together(self._alarms, self._services.clock.now())
        return next((group for group in found if any(alarm.id == alarm_id for alarm in group)), ())

    # ------------------------------------------------------------------ the past ones
    def read_on(self) -> None:
        """The last row is in sight."""
        if self.tab == "past" and self._past is not None and self._wanted <= len(self._past) < self._past_total:
            self._wanted += PAGE
            self._read_past()

    def _read_past(self) -> None:
        wanted = self._wanted
        self._shell.background.run(
            lambda: self._services.alarms.past(wanted), self._take_past, self._shell.say_problem, key=("alarms", "past")
        )

    def _take_past(self, found: tuple[Sequence[Alarm], int]) -> None:
        self._past, self._past_total = found
        self._show()

    # ------------------------------------------------------------------ buttons
    def used(self, key: tuple[str, int], action: str, *values: Any) -> None:
        """A button of a row."""
        group, alarms = self._meant_by(key), self._services.alarms
        if not group:
            return  # over since
        ids = {alarm.id for alarm in group}
        match action:
            case "fold":
                self._unfolded = self._unfolded - ids if self._unfolded & ids else self._unfolded | ids
                self._show()
            case "menu":
                items = menu_of_group(group)
                self._shell.dialogs.menu(values[0], self._text_of(group), items, lambda key: self._chosen(group, key))
            case "unshelve":
                self._for_each([alarm.id for alarm in group], alarms.unshelve)
            case "acknowledge":
                self.acknowledge(_unseen(group))
            case "reset":
                self._reset(group[0])
            case "way" if way := way_to(group[0], self._robots):
                self._do(way.act, way.about)

    def _reset(self, alarm: Alarm) -> None:
        """The errors of its robot. What remains stays in the list."""
        robot = self._robots.get(id_in(alarm.key, "robot") or 0)
        if robot is None or self._presses.is_same(robot.id):
            return
        self._presses.rest(robot.id)
        said = _("Reset errors was sent to {robot}").format(robot=robot.name)
        self._shell.background.run(
            lambda: self._services.operator.reset_errors(robot.id),
            lambda _none: self._shell.snackbars.show(said, icon="restore-alert", about=("reset", robot.id)),
            lambda problem: self._shell.say_not_done(problem, robot, _("Reset errors")),
        )

    def acknowledge(self, ids: Sequence[int], note: str = "") -> None:
        alarms, n = self._services.alarms, len(ids)
        said = ngettext("{n} alarm acknowledged", "{n} alarms acknowledged", n).format(n=n)
        self._for_each(ids, lambda alarm_id: alarms.acknowledge(alarm_id, note), said, alarms.unacknowledge)

    def _chosen(self, group: Together, chosen: str | int) -> None:
        """In the menu of a row."""
        alarms = self._services.alarms
        if chosen == "note":
            sheet = NoteSheet(text=self._text_of(group))

            def done(*_args: object) -> None:
                self._shell.sheets.close(sheet)
                self.acknowledge(_unseen(group), sheet.note)

            sheet.bind(on_done=done)
            self._shell.sheets.show(sheet)
        else:
            hours, n = int(chosen), len(group)
            said = ngettext("{n} alarm shelved", "{n} alarms shelved", n).format(n=n)
            ids = [alarm.id for alarm in group]
            self._for_each(ids, lambda alarm_id: alarms.shelve(alarm_id, hours), said, alarms.unshelve)

    def _text_of(self, group: Together) -> str:
        return group_text(group, self._settings, self._services.clock.now())

    def _for_each(
        self,
        ids: Sequence[int],
        work: Callable[[int], object],
        said: str = "",
        undo: Callable[[int], object] | None = None,
    ) -> None:
        """Its effect is published on the bus. What hides alarms is said, with ``undo``."""

        def done(_none: object) -> None:
            if undo is not None and ids:
                offered = partial(_each, ids, undo)
                self._shell.offer_undo(said, offered, self.changed, about="alarms that were hidden")

        self._shell.background.run(partial(_each, ids, work), done, self._shell.say_problem)


def _unseen(group: Together) -> list[int]:
    return [alarm.id for alarm in group if is_unseen(alarm)]


def _each(ids: Iterable[int], work: Callable[[int], object]) -> None:
    for alarm_id in ids:
        work(alarm_id)


class AlarmsScreen(ScreenBase):
    def __init__(self, vm: AlarmsModel, **kwargs: Any) -> None:
        load_kv("frame/alarms")
        super().__init__(vm=vm, can_go_back=True, **kwargs)

    def shown(self, **intent: Any) -> None:
        self.on_tall()
        super().shown(**intent)

    def on_tall(self, *_args: Any) -> None:
        self.vm.below = self.tall

    def choose_tab(self, key: str) -> None:
        self.vm.choose(key)

    def go_back(self) -> None:
        self.vm.back()
