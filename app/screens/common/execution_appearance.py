"""How the states of an execution are shown: icon, word and tone, always all three, and why it ended so."""

from __future__ import annotations

from zoneinfo import ZoneInfo

from app.domain.execution import Execution, ReasonCode, State, Trigger
from app.domain.reasons import naming_robot, sentence
from app.i18n import _, pgettext
from app.screens.common.robot_texts import problem_of

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


def cause(execution: Execution, zone: ZoneInfo | str) -> tuple[str, str]:
    """Why it ended so, in our words, and what the robot said, if it did. Empty if everything was normal."""
    reason = naming_robot(execution).reason
    if reason is None:
        return "", ""
    if message := said_by_robot(execution):
        return problem_of(message).words or message, message
    return sentence(reason, zone, _), ""


def cause_line(execution: Execution, zone: ZoneInfo | str) -> str:
    """``cause`` in one line, with the robot's own text in quotes where ours is another."""
    words, quote = cause(execution, zone)
    return words if quote in ("", words) else f"{words} “{quote}”"


def said_by_robot(execution: Execution) -> str:
    """When it ended the run."""
    reason = execution.reason
    return str(reason.details.get("message") or "") if reason and reason.code is ReasonCode.ROBOT_ABORTED else ""
