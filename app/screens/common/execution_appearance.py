"""How the states of an execution are shown: icon, word and tone, always all three."""

from __future__ import annotations

from app.domain.execution import State, Trigger
from app.i18n import _, pgettext

# state: (icon, tone)
LOOKS = {
    State.WAITING: ("timer-sand", "attention"),
    State.SUBMITTING: ("upload-outline", "neutral"),
    State.QUEUED: ("tray-full", "neutral"),
    State.EXECUTING: ("play-circle-outline", "accent"),
    State.COMPLETED: ("check-circle-outline", "done"),
    State.FAILED: ("alert-circle", "fault"),
    State.CANCELLED: ("cancel", "neutral"),
    State.SKIPPED: ("skip-next-circle", "attention"),
    State.MISSED: ("clock-alert-outline", "attention"),
}


def word(state: State) -> str:
    """The state as one word. What is sent but has not begun waits, wherever it waits."""
    return {
        State.EXECUTING: _("Working"),
        State.COMPLETED: _("Completed"),
        State.FAILED: pgettext("run", "Failed"),
        State.CANCELLED: _("Cancelled"),
        State.SKIPPED: _("Not run"),
        State.MISSED: _("Not run"),  # why is said by the reason
    }.get(state, _("Waiting"))


def trigger_word(trigger: Trigger) -> str:
    return {Trigger.SCHEDULED: _("Schedule"), Trigger.MANUAL: _("Run now"), Trigger.IDLE: pgettext("trigger", "Idle")}[
        trigger
    ]
