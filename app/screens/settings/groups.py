"""Settings, Robots, Groups: the sheet of a group. A change of a group is saved when it is made."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Any

from kivy.properties import ListProperty, NumericProperty, StringProperty

from app.domain.models import Group, HandOver, InvalidInput
from app.i18n import _
from app.screens.settings import groups_view as view
from app.screens.settings import removals
from app.screens.settings.edit_sheet import EditForm, EditSheet, ask_and_delete
from app.screens.settings.page import PageContext
from app.services.catalogue import checks, validation

ENTERED = ("name", "members", "hand_over", "keep_free")


class GroupForm(EditForm):
    name = StringProperty()
    members = ListProperty()
    rows = ListProperty()  # of robots to tick
    hand_over = StringProperty(HandOver.WHEN_FREE)
    hand_overs = ListProperty()
    hand_over_note = StringProperty()
    keep_free = NumericProperty(0)
    most_kept_free = NumericProperty(0)
    keep_free_note = StringProperty()
    name_problem = StringProperty()
    members_problem = StringProperty()
    keep_free_problem = StringProperty()


class GroupSheet(EditSheet):
    kind = "groups"
    at_once = True

    def __init__(self, context: PageContext, group: Group | None = None, **kwargs: Any) -> None:
        form = GroupForm(hand_overs=[(str(key), word) for key, word in view.hand_over_names().items()])
        self._fill(form, group or Group(""))
        super().__init__(context, group, form, **kwargs)
        self.show_facts()
        for name in ENTERED:
            form.fbind(name, self._changed, name)

    @staticmethod
    def _fill(form: GroupForm, group: Group) -> None:
        form.name, form.members = group.name, list(group.members)
        form.hand_over, form.keep_free = group.hand_over, group.keep_free

    def show_facts(self) -> None:
        """The robots that there are now, and the group as it is stored."""
        facts, form = self.context.facts, self.vm
        if (stored := facts.group(self.stored_id)) is not None and stored != self.stored and not form.saving:
            self.stored = stored
            self._fill(form, stored)
        form.title = self.stored.name if self.stored is not None else _("Add group")
        form.rows = view.member_items(facts, form.members, self.stored)
        form.hand_over_note = view.hand_over_meaning(HandOver(form.hand_over))
        form.most_kept_free = view.most_kept_free(len(form.members))
        form.keep_free_note = view.keep_free_meaning(int(form.keep_free), len(form.members))

    def _changed(self, name: str, *_args: Any) -> None:
        form = self.vm
        if name == "name":
            form.name_problem = ""
        else:
            form.members_problem = form.keep_free_problem = ""
            form.keep_free = min(form.keep_free, view.most_kept_free(len(form.members)))
            self.show_facts()
        self.draft = self.stored is None

    def tick(self, robot_id: int, action: str) -> None:
        """A robot joins the group, or leaves it; or the missions are wanted that it lacks."""
        if action == "missions":
            self.context.shell.go("settings", section="missions", group_id=self.stored_id or 0)
            return
        chosen = set(self.vm.members) ^ {robot_id}
        self.vm.members = [robot.id for robot in self.context.facts.robots if robot.id in chosen]
        self.keep()

    # ------------------------------------------------------------------ save, delete
    def entered(self) -> Group:
        form = self.vm
        return replace(
            self.stored or Group(""),
            name=form.name.strip(),
            members=tuple(form.members),
            hand_over=HandOver(form.hand_over),
            keep_free=int(form.keep_free),
        )

    def store(self, write: Callable[[], Any], kept: Any = None) -> None:
        """All errors are shown at once, each at its field."""
        group, is_complete = self.entered(), not self.ids.keep_free.outside
        for check in (lambda: checks.name(group.name), lambda: validation.group(replace(group, name="–"))):
            try:
                check()
            except InvalidInput as problem:
                is_complete = False
                self.refuse(problem)
        if is_complete:
            super().store(write, kept)

    def remove(self) -> None:
        context, group = self.context, self.stored
        context.run(
            lambda: context.services.catalogue.waiting_for(group.id),
            lambda waiting: ask_and_delete(
                context,
                group,
                lambda: context.services.catalogue.remove_group(group.id),
                removals.group_question(context.facts, group, waiting),
            ),
        )
