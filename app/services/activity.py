"""What a robot is doing, in the few words that utilisation counts."""
from __future__ import annotations

from app.services.mir.types import RobotState, RobotStatus

ACTIVITIES = ("executing", "charging", "idle", "paused", "error", "offline")


def activity_of(status: RobotStatus) -> str:
    """One of ``ACTIVITIES``. Charging is told by the mission text or the state Docked, as hardware clients do (reference, section 2: R)."""
    if status.state is RobotState.DOCKED or status.mission_text.startswith("Charging"):
        return "charging"
    match status.state:
        case RobotState.EXECUTING | RobotState.DOCKING:
            return "executing"
        case RobotState.PAUSE | RobotState.MANUAL_CONTROL:
            return "paused"
        case RobotState.ERROR | RobotState.EMERGENCY_STOP:
            return "error"
    return "idle"
