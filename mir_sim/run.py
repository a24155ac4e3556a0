"""A queue item in execution: its current action and how long that one has been active."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

from mir_sim.mission_queue import QueueItem
from mir_sim.site import Row
from mir_sim.steps import Step

STARTING_SECONDS = 0.5


@dataclass
class Run:
    """The mission that a robot is executing.

    Attributes:
        step: the action under way.
        next_action: index of the action that follows it.
        done: active seconds that the step had had at ``since``.
        since: simulated second at which the step was begun or resumed; None while missions are held.
        failure: message with which the mission is to fail, or None.
        fails_after: active seconds of the step after which it fails; None until its first step has begun.
    """

    item: QueueItem
    actions: list[Row]
    step: Step = field(default_factory=lambda: Step(STARTING_SECONDS, "Starting..."))
    next_action: int = 0
    done: float = 0.0
    since: float | None = None
    failure: str | None = None
    fails_after: float | None = None

    def elapsed(self, now: float) -> float:
        """Active seconds of the current step."""
        return self.done + (now - self.since if self.since is not None else 0.0)

    def suspend(self, now: float) -> None:
        self.done, self.since = self.elapsed(now), None

    def resume(self, now: float) -> None:
        if self.since is None:
            self.since = now

    def begin(self, step: Step, now: float) -> None:
        """Begin a step. A mission that is to fail does so halfway through its first one, or after a second if that has no set duration."""
        self.step, self.done, self.since = step, 0.0, now
        if self.failure is not None and self.fails_after is None:
            self.fails_after = step.duration / 2 if step.duration else 1.0

    def values(self, action: Row) -> dict[str, Any]:
        """The parameter values of an action, with those given when the mission was queued."""
        parameters = {
            parameter.get("input_name") or parameter.get("id"): parameter.get("value")
            for parameter in self.item.parameters
        }
        return {
            one["id"]: parameters.get(one["input_name"], one["value"]) if one.get("input_name") else one["value"]
            for one in action["parameters"]
        }
