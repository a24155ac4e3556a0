"""Settings, Set-up: the steps of a new tablet. Each leads to where it is taken."""

from __future__ import annotations

from typing import Any

from kivy.properties import ListProperty, NumericProperty, StringProperty

from app.i18n import _
from app.screens.settings.page import SettingsPage
from app.screens.settings.setup_view import steps


class SetupPage(SettingsPage):
    steps = ListProperty()
    said = StringProperty()
    share = NumericProperty(0)

    def show(self) -> None:
        self.steps = taken = steps(self.context.facts)
        done = sum(step.is_done for step in taken)
        self.share = done / len(taken)
        self.said = _("{done} of {all} done").format(done=done, all=len(taken))

    def act(self, key: str, action: str, *_values: Any) -> None:
        context, leave_out = self.context, self.context.services.catalogue.leave_out
        step = next(step for step in steps(context.facts) if step.key == key)
        if action == "later":
            said = _("{step} left out").format(step=step.title)
            context.change(lambda: leave_out(key), undo=(said, lambda: leave_out(key, wanted=True)))
        else:
            where = {"section": step.section} if step.section else {}
            context.shell.go(step.screen, **where, **({} if step.is_done else dict(step.intent)))
