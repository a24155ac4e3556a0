"""Robots of the list that are one machine: their starts end up in one queue, and a group counts it twice."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence

from app.services.live.alarms import Alarms

CODE = "same_machine"


class SameMachine:
    """A chore: an alarm for each serial number that several robots have, as long as they have it. ``read``: names of these robots by serial
    number."""

    def __init__(self, read: Callable[[], Mapping[str, Sequence[str]]], alarms: Alarms) -> None:
        self._read, self._alarms = read, alarms
        self._known: Mapping[str, Sequence[str]] | None = None  # None: the list of alarms has earlier ones

    def tick(self) -> None:
        found = self._read()
        if found == self._known:
            return
        known = self._before() if self._known is None else self._known.keys()
        for number in known - found.keys():
            self._alarms.clear(CODE, _key(number))
        for number, names in found.items():  # an existing one only follows the names
            self._alarms.raise_(CODE, _key(number), robot=names[0], robots=", ".join(names), number=number)
        self._known = found

    def _before(self) -> set[str]:
        return {
            alarm.key.removeprefix(_key(""))
            for alarm in self._alarms.open()
            if alarm.code == CODE and alarm.cleared_at is None
        }


def _key(serial_number: str) -> str:
    return f"serial:{serial_number}"
