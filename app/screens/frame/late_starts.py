"""The late starts that the operator may still hold, over any screen."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from datetime import datetime
from typing import Any

from kivy.properties import BooleanProperty, ListProperty, StringProperty
from kivy.uix.boxlayout import BoxLayout

from app.domain.models import Settings
from app.i18n import _, ngettext
from app.screens.frame.facts import OpenIssues
from app.screens.frame.view import late_line, seconds_left
from app.widgets import load_kv
from app.widgets.dialogs import FormDialog
from app.widgets.lists import Row


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


class LateStartsDialog(FormDialog):
    """Starts that fell due while the app was off, counted down: each can be held and released, or all at once, by
    ``hold(ids, held)``."""

    text = StringProperty()
    rows = ListProperty()
    all_held = BooleanProperty(False)

    def __init__(self, hold: Callable[[Sequence[int], bool], object], **kwargs: Any) -> None:
        load_kv("frame/late_starts")
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
