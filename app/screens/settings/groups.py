"""Settings, Robots, Groups: the sheet of a group. A change of a group is saved when it is made."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

from kivy.properties import ListProperty, NumericProperty, StringProperty

from app.domain.models import Group, InvalidInput
from app.screens.settings import groups_view as view
from app.screens.settings import removals
from app.screens.settings.edit_sheet import EditSheet
from app.screens.settings.page import PageContext
from app.services.catalogue import checks, validation
from app.services.catalogue.edit import Removed


class GroupSheet(EditSheet):
    kind = "groups"
    at_once = ("name", "members", "hand_over", "keep_free")
    fields = ("name", "members", "keep_free")

    rows = ListProperty()  # of robots to tick
    hand_overs = ListProperty()
    hand_over_note = StringProperty()
    most_kept_free = NumericProperty(0)
    keep_free_note = StringProperty()

    def __init__(self, context: PageContext, group: Group | None = None) -> None:
        words = [(key, word) for key, word in view.hand_over_names().items()]
        super().__init__(context, group or Group(""), hand_overs=words)

    def show_facts(self) -> None:
        """The robots that there are now, and the group as it is stored."""
        super().show_facts()
        group, members = self.it, len(self.it.members)
        self.rows = view.member_items(self.context.facts, group.members, self.stored)
        self.hand_over_note = view.hand_over_meaning(group.hand_over)
        self.most_kept_free = view.most_kept_free(members)
        self.keep_free_note = view.keep_free_meaning(group.keep_free, members)

    def enter(self, **values: Any) -> None:
        group = replace(self.it, **values)
        most = view.most_kept_free(len(group.members))
        super().enter(**{**values, "keep_free": min(group.keep_free, most)})
        self.show_facts()

    def tick(self, robot_id: int, action: str) -> None:
        """A robot joins the group, or leaves it; or the missions are wanted that it lacks."""
        if action == "missions":
            self.context.shell.go("settings", section="missions", group_id=self.stored_id or 0)
            return
        chosen = {*self.it.members} ^ {robot_id}
        self.choose(members=tuple(robot.id for robot in self.context.facts.robots if robot.id in chosen))

    # ------------------------------------------------------------------ save, delete
    def store(self, entered: Any, **how: Any) -> None:
        """All errors are shown at once, each at its field."""
        group, is_complete = self.it, not self.ids.keep_free.outside
        for check in (lambda: checks.name(group.name), lambda: validation.group(replace(group, name="–"))):
            try:
                check()
            except InvalidInput as problem:
                is_complete = False
                self.refuse(problem)
        if is_complete:
            super().store(entered, **how)

    _waiting = 0  # starts for one of its robots

    def remove(self) -> None:
        """Once it is known what waits for it."""
        group, catalogue, ask = self.stored, self.context.services.catalogue, super().remove

        def counted(waiting: int) -> None:
            self._waiting = waiting
            ask()

        self.context.run(lambda: catalogue.waiting_for(group.id), counted)

    def question(self) -> str:
        return removals.group_question(self.context.facts, self.stored, self._waiting)

    def delete(self, it: Group) -> Removed:
        return self.context.services.catalogue.remove_group(it.id)
