"""Settings, Robots, Groups: their robots, and which of these have which missions."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

from kivy.event import EventDispatcher
from kivy.properties import (
    BooleanProperty,
    ListProperty,
    NumericProperty,
    ObjectProperty,
    StringProperty,
)
from kivy.uix.boxlayout import BoxLayout
from kivy.uix.widget import Widget

from app.domain.models import Group, HandOver, InvalidInput
from app.i18n import _
from app.screens.common.options import MenuItem
from app.screens.common.problems import sentence_of
from app.screens.settings import groups_view as view
from app.screens.settings import removals
from app.screens.settings.facts import SettingsFacts
from app.screens.settings.page import PageContext
from app.screens.settings.view import NoticeView, went_wrong
from app.services.catalogue import checks, validation
from app.widgets.dialogs import Dialog
from app.widgets.lists import RecycledRow
from app.widgets.sheet import Sheet
from app.widgets.surfaces import Toned
from app.widgets.text import Ico, Note

FIELDS = ("name", "members", "keep_free")


class GroupsPart:
    """What is pressed among the groups."""

    def __init__(self, context: PageContext) -> None:
        self._context = context
        self._table: GroupMissions | None = None

    def show(self) -> None:
        if self._table is not None:
            self._table.show(self._context.facts)
        if isinstance(sheet := self._context.shell.sheets.top, GroupSheet):
            sheet.show_facts()

    def open(self, group_id: int | None) -> None:
        """The sheet of a group, or with None of a new one."""
        sheet = GroupSheet(self._context, self._context.facts.group(group_id))
        sheet.bind(
            on_remove=lambda _sheet, group: self._remove(group),
            on_missions=lambda _sheet, group: self._show_missions(group),
        )
        self._context.shell.sheets.show(sheet)

    def _show_missions(self, group: Group) -> None:
        self._table = table = GroupMissions(group)
        table.bind(on_dismiss=lambda *_args: setattr(self, "_table", None))
        self.show()
        self._context.shell.dialogs.open(table)
        self._context.refresh()  # what the robots have now

    def _remove(self, group: Group) -> None:
        """Ask first: its schedules go with it. Undo brings it all back."""
        context = self._context
        context.run(
            lambda: context.services.catalogue.waiting_for(group.id),
            lambda waiting: context.shell.dialogs.confirm(
                _("Delete {group}?").format(group=group.name),
                removals.group_question(context.facts, group, waiting),
                _("Delete group"),
                lambda: context.remove(
                    lambda: context.services.catalogue.remove_group(group.id),
                    removals.group_sentence(context.facts, group),
                ),
                danger=True,
            ),
        )


class GroupForm(EventDispatcher):
    """What is entered, with one problem per field."""

    title = StringProperty()
    name = StringProperty()
    members = ListProperty()
    rows = ListProperty()  # of robots to tick
    missions = ListProperty()  # a row
    hand_over = StringProperty(HandOver.WHEN_FREE)
    hand_overs = ListProperty()
    hand_over_note = StringProperty()
    keep_free = NumericProperty(0)
    most_kept_free = NumericProperty(0)
    keep_free_note = StringProperty()
    name_problem = StringProperty()
    members_problem = StringProperty()
    keep_free_problem = StringProperty()
    outcome = ObjectProperty(NoticeView())
    saving = BooleanProperty(False)
    is_known = BooleanProperty(False)


class GroupSheet(Sheet):
    """Adds or edits a group. ``on_remove(group)`` fires when Delete was chosen, the sheet is closed then; ``on_missions(group)`` when its
    missions are to be shown."""

    vm = ObjectProperty(None, rebind=True, allownone=True)

    __events__ = ("on_remove", "on_missions")

    def __init__(self, context: PageContext, group: Group | None = None, **kwargs: Any) -> None:
        self._context, self._group = context, group
        stored = group or Group("")
        form = GroupForm(
            title=group.name if group else _("Add group"),
            name=stored.name,
            members=list(stored.members),
            hand_over=stored.hand_over,
            keep_free=stored.keep_free,
            is_known=group is not None,
            hand_overs=[(str(key), word) for key, word in view.hand_over_names().items()],
        )
        super().__init__(vm=form, **kwargs)
        form.fbind("name", lambda *_args: setattr(form, "name_problem", ""))
        for name in ("members", "hand_over", "keep_free"):
            form.fbind(name, self._chosen)
        self._chosen()
        self._entered_first = self._values()
        for name in ("name", "members", "hand_over", "keep_free"):
            form.fbind(name, lambda *_args: setattr(self, "draft", self._values() != self._entered_first))

    @property
    def group_id(self) -> int | None:
        return self._group.id if self._group is not None else None

    def on_remove(self, group: Group) -> None:
        """Delete was chosen."""

    def on_missions(self, group: Group) -> None:
        """Its missions are to be shown."""

    def _values(self) -> tuple[object, ...]:
        return self.vm.name, tuple(self.vm.members), self.vm.hand_over, self.vm.keep_free

    def show_facts(self) -> None:
        """The robots that there are now, and their missions."""
        facts, form = self._context.facts, self.vm
        form.rows = view.member_items(facts, form.members, self._group)
        form.missions = [view.missions_item(facts, self._group)] if self._group else []

    def _chosen(self, *_args: Any) -> None:
        form = self.vm
        form.members_problem = form.keep_free_problem = ""
        self.show_facts()
        form.hand_over_note = view.hand_over_meaning(HandOver(form.hand_over))
        form.most_kept_free = view.most_kept_free(len(form.members))
        form.keep_free = min(form.keep_free, form.most_kept_free)
        form.keep_free_note = view.keep_free_meaning(int(form.keep_free), len(form.members))

    def tick(self, robot_id: int) -> None:
        """A robot joins the group, or leaves it."""
        chosen = set(self.vm.members) ^ {robot_id}
        self.vm.members = [robot.id for robot in self._context.facts.robots if robot.id in chosen]

    def show_missions(self) -> None:
        if self._group is not None:
            self.dispatch("on_missions", self._group)

    def on_dots(self, button: Widget) -> None:
        self._context.shell.dialogs.menu(
            button,
            "",
            [MenuItem("delete", _("Delete group"), "delete-outline", tone="fault")],
            lambda _key: self.remove(),
        )

    def remove(self) -> None:
        if self._group is not None:
            self._context.shell.sheets.close()
            self.dispatch("on_remove", self._group)

    # ------------------------------------------------------------------ save
    def save(self) -> None:
        form = self.vm
        if form.saving or self.ids.keep_free.outside:  # it shows why
            return
        group = replace(
            self._group or Group(""),
            name=form.name.strip(),
            members=tuple(form.members),
            hand_over=HandOver(form.hand_over),
            keep_free=int(form.keep_free),
        )
        if not self._is_complete(group):
            return
        form.saving = True
        self._context.run(lambda: self._context.services.catalogue.save_group(group), self._saved, self._refused)

    def _is_complete(self, group: Group) -> bool:
        """All visible errors are shown at once, each at its field."""
        problems = []
        for check in (lambda: checks.name(group.name), lambda: validation.group(replace(group, name="–"))):
            try:
                check()
            except InvalidInput as problem:
                problems.append(problem)
                self._refused(problem)
        return not problems

    def _saved(self, group: Group) -> None:
        self._context.shell.sheets.close()
        self._context.was_saved("groups", group)
        self._context.say((_("{group} saved") if self._group else _("{group} added")).format(group=group.name))

    def _refused(self, problem: BaseException) -> None:
        form = self.vm
        form.saving = False
        field = problem.field if isinstance(problem, InvalidInput) else ""
        if field in FIELDS:
            setattr(form, f"{field}_problem", sentence_of(problem))
        else:
            form.outcome = went_wrong(problem)


# ---------------------------------------------------------------------- the table
class MissionCells(BoxLayout):
    """One icon, or name, per robot, in columns of one width."""

    cells = ListProperty()
    names = ListProperty()

    def __init__(self, **kwargs: Any) -> None:
        super().__init__(**kwargs)
        for name in ("cells", "names"):
            self.fbind(name, self._build)

    def _build(self, *_args: Any) -> None:
        self.clear_widgets()
        for name in self.names:
            self.add_widget(Note(text=name, halign="center"))
        for icon in self.cells:
            self.add_widget(CellIcon(icon=icon))


class CellIcon(Ico):
    """Has it, lacks it, not known."""


class MissionTableRow(RecycledRow, Toned, BoxLayout):
    """A mission, the robots that lack it in words, and a cell per robot if they fit."""

    name = StringProperty()
    note = StringProperty()
    cells = ListProperty()


class GroupMissions(Dialog):
    """Which robot of the group has which mission, gaps first."""

    names = ListProperty()
    lines = ListProperty()

    def __init__(self, group: Group, **kwargs: Any) -> None:
        self._group = group
        super().__init__(title=_("Missions of {group}").format(group=group.name), **kwargs)

    def show(self, facts: SettingsFacts) -> None:
        members, lines = facts.members(self._group), view.mission_lines(facts, self._group)
        has_columns = len(members) <= view.MOST_COLUMNS
        self.names = [robot.name for robot in members] if has_columns else []
        self.lines = lines if has_columns else [replace(line, cells=()) for line in lines]
