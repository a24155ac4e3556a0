"""Settings, Set-up: the steps of a new tablet. Each leads to where it is taken."""

from __future__ import annotations

from typing import Any

from kivy.event import EventDispatcher
from kivy.properties import ListProperty, NumericProperty, StringProperty

from app.i18n import _
from app.screens.settings.page import SettingsPage
from app.screens.settings.setup_view import step_items, steps


class SetupModel(EventDispatcher):
    items = ListProperty()
    calm_items = ListProperty()  # beside a sheet, which has the filled button
    said = StringProperty()
    share = NumericProperty(0)


class SetupPage(SettingsPage):
    Model = SetupModel

    def show(self) -> None:
        taken = steps(self.context.facts)
        done = sum(step.is_done for step in taken)
        self.vm.items, self.vm.calm_items = step_items(taken), step_items(taken, is_beside_sheet=True)
        self.vm.share = done / len(taken)
        self.vm.said = _("{done} of {all} done").format(done=done, all=len(taken))

    def act(self, key: str, action: str, *_values: Any) -> None:
        if action == "later":
            self._leave_out(key)
        else:
            self._open(key)

    def _leave_out(self, key: str) -> None:
        context, leave_out = self.context, self.context.services.catalogue.leave_out
        title = next(step.title for step in steps(context.facts) if step.key == key)
        context.change(
            lambda: leave_out(key),
            undo=(_("{step} left out").format(step=title), lambda: leave_out(key, wanted=True)),
        )

    def _open(self, key: str) -> None:
        step = next(step for step in steps(self.context.facts) if step.key == key)
        intent = {} if step.is_done else dict(step.intent)
        self.context.shell.go("settings", section=step.section, **intent)

    def find(self) -> None:
        self.context.shell.go("settings", section="robots", find=True)
