"""What can be done with a robot through the connection that the app has to it: screens and dispatch ask this, never
what kind of connection it is."""

from __future__ import annotations

from dataclasses import dataclass
from enum import StrEnum


class FindBy(StrEnum):
    """How a start whose answer was lost is found again."""

    ID = "id"  # the app chooses the id of an order: ids don't grow
    TOKEN = "token"  # noqa: S105  # the order gives back the text that was sent with it
    MATCH = "match"  # neither: by mission, user and number


@dataclass(frozen=True)
class Capabilities:
    """A robot's own; a fleet's differ.

    Attributes: own_queue: its queue and the ids there are the robot's alone, and clearing it takes all; a fleet's list
    has the orders of all its robots. cancel_waiting, cancel_running: one order can be cancelled before, and while, it
    runs. pause, clear_error, prompts: a person can pause and resume the robot, clear its errors, answer its questions.
    failure_text: an order that failed says why.
    """

    find_by: FindBy = FindBy.TOKEN
    own_queue: bool = True
    cancel_waiting: bool = True
    cancel_running: bool = True
    pause: bool = True
    clear_error: bool = True
    prompts: bool = True
    failure_text: bool = True

    @property
    def shares_numbers(self) -> bool:
        """Whether its orders have numbers that a fleet gives to all of its clients, and may give again."""
        return not self.own_queue and self.find_by is not FindBy.ID


OF_A_ROBOT = Capabilities()
