"""Two lists over any screen: the alarms (open, shelved, past), and the late starts that the operator may still hold."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from datetime import datetime
from typing import Any

from kivy.clock import Clock
from kivy.properties import BooleanProperty, ListProperty, StringProperty
from kivy.uix.boxlayout import BoxLayout

from app.domain.models import Alarm, Robot, Settings
from app.i18n import _, ngettext
from app.screens.common.alarm_groups import Together, group_entry, group_text, menu_of_group, together
from app.screens.common.alarms_view import (
    Act,
    AlarmEntry,
    button_of,
    can_be_handled,
    is_shelved,
    is_unseen,
    open_entry,
    past_count,
    past_entry,
    shelved_entry,
    tab_words,
    way_to,
)
from app.screens.common.presses import DOUBLE_TAP
from app.screens.common.shell import Shell
from app.screens.frame.facts import FrameServices, OpenIssues
from app.screens.frame.view import OpenIssue, issue_entry, late_line, open_issues, seconds_left
from app.services.live.alarms import LONGEST_NOTE
from app.widgets import load_kv
from app.widgets.dialogs import Dialog, FormDialog
from app.widgets.lists import RecycledRow, Row
from app.widgets.surfaces import TonedSurface

PAGE = 50  # past alarms that are read at first, and whenever the last one comes into sight
EMPTY: Mapping[str, Callable[[], str]] = {
    "open": lambda: _("No alarms. Everything is as it should be."),
    "put_off": lambda: _("Nothing else is open. What is shelved comes back by itself."),
    "shelved": lambda: _(
        "Nothing is shelved. Shelving keeps an alarm out of the way for some hours, then it comes back by itself."
    ),
    "past": lambda: _("No past alarms"),
}
Do = Callable[[Act, int | None], object]


class AlarmRow(RecycledRow, TonedSurface):
    """One alarm, or several with one cause: sentence, state, since when, how often, what to do, notes.
    ``action`` is the word of its button."""

    icon = StringProperty()
    text = StringProperty()
    state_icon = StringProperty()
    state_words = StringProperty()
    note = StringProperty()
    answer = StringProperty()
    action = StringProperty()
    has_menu = BooleanProperty(False)
    fold = StringProperty()  # icon of the button that shows or hides those of a group


class LateRow(Row, BoxLayout):
    """One late start: mission, robot, planned time. ``act("hold")`` toggles ``held``."""

    text = StringProperty()
    note = StringProperty()
    held = BooleanProperty(False)


@dataclass(frozen=True)
class LateStart:
    """What a LateRow shows; ``key`` is the id of the execution."""

    key: int
    text: str
    note: str
    held: bool = False


class AlarmsDialog(Dialog):
    """Alarms in three parts, most serious first. The rows fire ``on_row(key, action, …)``.

    One button acknowledges all rows on screen (``on_acknowledge(keys)``), but no row that is hidden, cut off or has
    only just appeared, as it was not seen.
    """

    tabs = ListProperty()
    tab = StringProperty("open")
    rows = ListProperty()
    empty = StringProperty()  # shown without rows
    count = StringProperty()  # under the past ones
    unseen = ListProperty()  # keys of unacknowledged rows
    all_word = StringProperty()  # of the button that acknowledges those on screen

    __events__ = ("on_row", "on_end", "on_acknowledge")

    def __init__(self, **kwargs: Any) -> None:
        load_kv("frame/alarm_list")
        self._came: dict[object, float] = {}  # when a row was first there
        self._rests_until = 0.0
        super().__init__(title=_("Alarms"), **kwargs)
        self._look = Clock.create_trigger(self._name_button)
        for name in ("rows", "unseen"):
            self.fbind(name, self._look)
        for name in ("scroll_y", "size", "pos", "content_height"):
            self.ids.alarm_rows.fbind(name, self._look)

    def on_rows(self, *_args: Any) -> None:
        now = Clock.get_time() if self._came else 0.0
        self._came = {row.key: self._came.get(row.key, now) for row in self.rows}

    def _in_sight(self) -> list[object]:
        """Unacknowledged rows that are wholly on screen, or fill the page."""
        page, unseen = self.ids.alarm_rows, set(self.unseen)
        bottom = page.to_window(*page.pos)[1]
        found = []
        for row in page.whole_rows:
            low = row.to_window(*row.pos)[1]
            shown = min(low + row.height, bottom + page.height) - max(low, bottom)
            if row.key in unseen and shown >= min(row.height, page.height) - 1:
                found.append(row.key)
        return found

    def _name_button(self, *_args: Any) -> None:
        found = len(self._in_sight()) if len(self.unseen) > 1 else 0
        self.all_word = (
            "" if not found else _("Acknowledge all") if found == len(self.unseen) else _("Acknowledge those shown")
        )

    def acknowledge(self) -> None:
        """The rows on screen. A moment later others are in their places, unseen when a second tap comes."""
        now = Clock.get_time()
        if now < self._rests_until:
            return
        self._rests_until = now + DOUBLE_TAP
        self.dispatch("on_acknowledge", [key for key in self._in_sight() if now - self._came[key] >= DOUBLE_TAP])

    def on_acknowledge(self, keys: Sequence[tuple[str, int]]) -> None:
        """These rows were acknowledged."""

    def on_row(self, key: tuple[str, int], action: str, *values: Any) -> None:
        """The button or the menu of a row was pressed."""

    def on_end(self) -> None:
        """The last of the rows is in sight."""


class NoteDialog(FormDialog):
    """Acknowledge an alarm with a note: ``done(note)``."""

    text = StringProperty()
    longest = LONGEST_NOTE

    def __init__(self, alarm: str, done: Callable[[str], object], **kwargs: Any) -> None:
        load_kv("frame/alarm_list")
        self._done = done
        super().__init__(title=_("Acknowledge"), text=alarm, **kwargs)

    def acknowledge(self, note: str) -> None:
        self._done(note)
        self.dismiss()


class AlarmList:
    """Opens the list over any screen, updates it and runs its buttons; ``do`` runs those that the banner has too."""

    def __init__(self, services: FrameServices, shell: Shell, do: Do) -> None:
        self._services, self._shell, self._do = services, shell, do
        self._dialog: AlarmsDialog | None = None
        self._issues, self._settings = OpenIssues(), Settings()
        self._robots: Mapping[int, Robot] = {}
        self._past: Sequence[Alarm] | None = None  # None: not read yet
        self._past_total = 0
        self._wanted = PAGE
        self._unfolded: set[int] = set()  # alarms whose group shows all that are in it

    # ------------------------------------------------------------------ showing
    def open(self, unfold: int | None = None) -> None:
        """``unfold`` shows all alarms of this one's group."""
        if self._dialog is not None:
            return
        self._wanted, self._unfolded = PAGE, {unfold} if unfold is not None else set()
        self._dialog = dialog = AlarmsDialog()
        dialog.bind(
            on_dismiss=self._closed,
            on_row=self._row_used,
            on_acknowledge=self._acknowledge,
            on_end=self._read_on,
            tab=lambda *_args: self._tab_chosen(),
        )
        self._show()
        self._shell.dialogs.open(dialog)

    def _closed(self, _dialog: AlarmsDialog) -> None:
        self._dialog, self._past, self._past_total = None, None, 0

    def show(self, issues: OpenIssues, robots: Mapping[int, Robot], settings: Settings) -> None:
        """What is open now; called every second."""
        self._issues, self._robots, self._settings = issues, robots, settings
        self._show()

    def changed(self) -> None:
        """Something was raised, cleared, acknowledged or shelved."""
        if self._dialog is not None and self._dialog.tab == "past":
            self._read_past()

    def _show(self) -> None:
        dialog = self._dialog
        if dialog is None:
            return
        now = self._services.clock.now()
        issues = open_issues(self._issues, self._robots, self._settings, now)
        off = together((alarm for alarm in self._issues.alarms if is_shelved(alarm, now)), now)
        dialog.tabs = tab_words(len(issues), len(off))
        entries = [entry for issue in issues for entry in self._entries(issue, now)]
        is_past = dialog.tab == "past"
        if is_past:
            entries = [past_entry(alarm, self._settings, now) for alarm in self._past or ()]
        dialog.rows = (
            [entry for group in off for entry in self._shelved(group, now)] if dialog.tab == "shelved" else entries
        )
        dialog.unseen = (
            [entry.key for entry in entries if any(map(is_unseen, self._meant_by(entry.key)))]
            if dialog.tab == "open"
            else []
        )
        empty = "put_off" if dialog.tab == "open" and off else dialog.tab
        dialog.empty = "" if dialog.rows or (is_past and self._past is None) else EMPTY[empty]()
        dialog.count = past_count(len(entries), self._past_total) if is_past and entries else ""

    def _is_unfolded(self, group: Together) -> bool:
        return len(group) > 1 and any(alarm.id in self._unfolded for alarm in group)

    def _entries(self, issue: OpenIssue, now: datetime) -> list[AlarmEntry]:
        """Rows of an open item: one, and for an unfolded group those of its alarms."""
        unfolded = self._is_unfolded(issue.alarms)
        return [
            issue_entry(issue, self._robots, self._settings, now, unfolded),
            *(open_entry(alarm, self._robots, self._settings, now) for alarm in issue.alarms if unfolded),
        ]

    def _shelved(self, group: Together, now: datetime) -> list[AlarmEntry]:
        unfolded = self._is_unfolded(group)
        head = [group_entry(group, self._settings, now, unfolded)] if len(group) > 1 else []
        return head + [shelved_entry(alarm, self._settings, now) for alarm in group if unfolded or not head]

    def _meant_by(self, key: tuple[str, int]) -> Together:
        """The alarms of a row; empty if they are over, or if it is about something else."""
        kind, alarm_id = key
        if kind == "group":
            return next(
                (
                    group
                    for group in together(self._issues.alarms, self._services.clock.now())
                    if any(alarm.id == alarm_id for alarm in group)
                ),
                (),
            )
        return tuple(alarm for alarm in self._issues.alarms if kind == "alarm" and alarm.id == alarm_id)

    # ------------------------------------------------------------------ the past ones
    def _tab_chosen(self) -> None:
        self._wanted = PAGE
        self.changed()
        self._show()

    def _read_on(self, dialog: AlarmsDialog) -> None:
        if dialog.tab == "past" and self._past is not None and self._wanted <= len(self._past) < self._past_total:
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

    # ------------------------------------------------------------------ actions of the rows
    def _row_used(self, _dialog: AlarmsDialog, key: tuple[str, int], action: str, *values: Any) -> None:
        kind, about = key
        now, all_alarms = self._services.clock.now(), self._issues.alarms
        alarm = next((alarm for alarm in all_alarms if alarm.id == about), None) if kind in ("alarm", "group") else None
        if kind == "hold":
            self._do(Act.RELEASE, about or None)
        elif kind == "copy":
            self._do(Act.WHOSE_PLAN, None)
        elif kind == "late":
            self._do(Act.LATE_STARTS if all(e.held for e in self._issues.late_starts) else Act.HOLD, None)
        elif alarm is None:
            return  # over since
        elif kind == "group":
            self._group_used(next(group for group in together(all_alarms, now) if alarm in group), action, *values)
        elif action == "menu":
            self._shell.dialogs.menu(
                values[0],
                self._text_of((alarm,)),
                menu_of_group((alarm,), self._robots),
                lambda chosen: self._menu_used((alarm,), chosen),
            )
        elif is_shelved(alarm, now):
            self._work(lambda: self._services.alarms.unshelve(alarm.id))
        elif not can_be_handled(alarm):
            self._go(alarm)
        else:
            way = button_of(alarm, self._robots)
            if way.act is Act.ACKNOWLEDGE:
                self._acknowledge_all((alarm,))  # alone, though it may be below its group
            else:
                self._do(way.act, way.about)

    def acknowledge(self, about: int) -> None:
        """Of an alarm the whole line."""
        self._acknowledge_all(self._meant_by(("group", about)))

    def _acknowledge_all(self, group: Together) -> None:
        self._for_each(group, lambda alarm: self._services.alarms.acknowledge(alarm.id))

    def _acknowledge(self, _dialog: AlarmsDialog, keys: Sequence[tuple[str, int]]) -> None:
        """Each alarm once, though it may be in a group above it."""
        found = {alarm.id: alarm for key in keys for alarm in self._meant_by(key) if is_unseen(alarm)}
        self._acknowledge_all(tuple(found.values()))

    def _group_used(self, group: Together, action: str, *values: Any) -> None:
        alarms, ids = self._services.alarms, {alarm.id for alarm in group}
        if action == "fold":
            self._unfolded = self._unfolded - ids if self._unfolded & ids else self._unfolded | ids
            self._show()
        elif action == "menu":
            self._shell.dialogs.menu(
                values[0],
                self._text_of(group),
                menu_of_group(group, self._robots),
                lambda chosen: self._menu_used(group, chosen),
            )
        elif is_shelved(group[0], self._services.clock.now()):
            self._for_each(group, lambda alarm: alarms.unshelve(alarm.id))
        else:
            self._acknowledge_all(group)

    def _menu_used(self, group: Together, chosen: str | int) -> None:
        """Of one alarm, or of a group."""
        alarms = self._services.alarms
        if chosen == "way":
            self._go(group[0])
        elif chosen == "note":
            self._shell.dialogs.open(
                NoteDialog(
                    self._text_of(group),
                    lambda note: self._for_each(group, lambda alarm: alarms.acknowledge(alarm.id, note)),
                )
            )
        else:
            hours = int(chosen)
            self._for_each(group, lambda alarm: alarms.shelve(alarm.id, hours))

    def _text_of(self, group: Together) -> str:
        return group_text(group, self._settings, self._services.clock.now())

    def _go(self, alarm: Alarm) -> None:
        way = way_to(alarm, self._robots)
        if way is not None and self._dialog is not None:
            self._dialog.dismiss()
            self._do(way.act, way.about)

    def _work(self, work: Callable[[], object]) -> None:
        """Its effect is published on the bus."""
        self._shell.background.run(work, None, self._shell.say_problem)

    def _for_each(self, group: Together, work: Callable[[Alarm], object]) -> None:
        def all_of_them() -> None:
            for alarm in group:
                work(alarm)

        self._work(all_of_them)


class LateStartsDialog(FormDialog):
    """Starts that fell due while the app was off, counted down: each can be held and released, or all at once, by
    ``hold(ids, held)``."""

    text = StringProperty()
    rows = ListProperty()
    all_held = BooleanProperty(False)

    def __init__(self, hold: Callable[[Sequence[int], bool], object], **kwargs: Any) -> None:
        load_kv("frame/alarm_list")
        self._hold = hold
        super().__init__(**kwargs)

    def show(self, issues: OpenIssues, settings: Settings, now: datetime) -> None:
        executions = issues.late_starts
        going = [e for e in executions if not e.held]
        many = len(going)
        self.title = (
            ngettext("The app was off. Start this now?", "The app was off. Start these {n} now?", many).format(n=many)
            if going
            else _("Held late starts")
        )
        text = (
            _("Each is started when it is released, and skipped when its time is over.")
            if not going
            else _("It starts in {n} s unless you hold it.")
            if many == 1
            else _("They start in {n} s unless you hold them.")
        )
        self.text = text.format(n=seconds_left(going, now))
        self.all_held = not going
        self.rows = [
            LateStart(e.id, late_line(e, issues.mission_names, settings), e.own_name, e.held) for e in executions
        ]

    def start(self) -> None:
        """At once, what is not held."""
        if going := [row.key for row in self.rows if not row.held]:
            self._hold(going, False)
        self.dismiss()

    def hold_one(self, execution_id: int) -> None:
        self._hold([execution_id], not next(row.held for row in self.rows if row.key == execution_id))

    def hold_all(self) -> None:
        """Or release all, when all are held."""
        self._hold([row.key for row in self.rows if row.held == self.all_held], not self.all_held)
        self.dismiss()
