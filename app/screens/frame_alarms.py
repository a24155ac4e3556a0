"""Two lists over any screen: the alarms that stand, and the late starts that the operator may still hold."""
from __future__ import annotations

from collections.abc import Callable, Sequence
from datetime import datetime
from typing import Any

from kivy.properties import ListProperty, StringProperty
from kivy.uix.boxlayout import BoxLayout

from app.i18n import _, ngettext
from app.models import Alarm, Execution, Settings
from app.screens.frame_view import alarm_icon, alarm_note, alarm_text, alarm_tone, is_shelved, late_line, seconds_left
from app.widgets import load_kv
from app.widgets.dialogs import FormDialog
from app.widgets.lists import Row
from app.widgets.surfaces import TonedSurface


class AlarmRow(Row, TonedSurface):
    """One alarm: what, since when, how often, what to do; ``action`` takes note of it."""
    icon = StringProperty()
    text = StringProperty()
    note = StringProperty()
    action = StringProperty()


class LateRow(Row, BoxLayout):
    """One late start: what, where, when it should have been."""
    text = StringProperty()
    note = StringProperty()


class AlarmsDialog(FormDialog):
    """All that stand, most serious first. ``act(alarm_id)`` acknowledges one."""
    rows = ListProperty()

    def __init__(self, act: Callable[[int], object], **kwargs: Any) -> None:
        load_kv("frame_alarms")
        self._act = act
        super().__init__(title=_("Alarms"), **kwargs)

    def show(self, alarms: Sequence[Alarm], settings: Settings, now: datetime) -> None:
        self.rows = [
            {"key": alarm.id, "icon": alarm_icon(alarm), "tone": alarm_tone(alarm), "text": alarm_text(alarm, settings, now),
             "note": alarm_note(alarm, settings, now), "action": "" if alarm.acknowledged_at else _("Acknowledge")}
            for alarm in alarms if not is_shelved(alarm, now)]

    def acknowledge(self, alarm_id: int) -> None:
        self._act(alarm_id)


class LateStartsDialog(FormDialog):
    """What fell due while the app was off, counted down; ``hold()`` keeps it all from being sent."""
    text = StringProperty()
    rows = ListProperty()

    def __init__(self, hold: Callable[[], object], **kwargs: Any) -> None:
        load_kv("frame_alarms")
        self._hold = hold
        super().__init__(title=_("The app was off. Start this now?"), **kwargs)

    def show(self, executions: Sequence[Execution], settings: Settings, now: datetime) -> None:
        left = seconds_left(executions, now)
        self.text = ngettext("It starts in {n} s unless you hold it.", "It starts in {n} s unless you hold it.", left).format(n=left)
        self.rows = [{"key": e.id, "text": late_line(e, settings), "note": e.schedule} for e in executions]

    def hold(self) -> None:
        self._hold()
        self.dismiss()
