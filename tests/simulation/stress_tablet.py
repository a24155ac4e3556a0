"""A tablet under stress, as a process: the real services with all their threads and sockets, and operators that act at random.

``python -m tests.simulation.stress_tablet DATA_DIR DIARY SEED OPERATORS``: with no operators it only works off what is planned. Each act is
written to the diary before it begins and when it is over, so that the process that kills this one knows what was certainly done.
"""

from __future__ import annotations

import json
import logging
import os
import random
import sys
import threading
import time
import traceback
import uuid
from collections.abc import Callable
from dataclasses import replace
from datetime import UTC, datetime
from pathlib import Path

from app.container import Container
from app.domain.models import InvalidInput, Overlap, Schedule
from app.mir.errors import RobotError
from app.services.catalogue import schedule_edit
from tests.support.edits import switch_robot

MISSION = "Home"
LONGEST_HOLD = 4.0  # s


class Diary:
    """One line per event, each written at once."""

    def __init__(self, path: Path) -> None:
        self._file = os.open(path, os.O_WRONLY | os.O_APPEND | os.O_CREAT, 0o600)

    def note(self, act: str, about: str, event: str, robot: str = "") -> None:
        line = json.dumps({"at": time.time(), "act": act, "about": about, "event": event, "robot": robot})
        os.write(self._file, f"{line}\n".encode())


class Operator(threading.Thread):
    """A person who does something every moment. The first robot alone is switched off and cleared, so that what is planned on the others
    has to run."""

    def __init__(self, container: Container, diary: Diary, name: str) -> None:
        super().__init__(name=name, daemon=True)
        self._container, self._diary, self._rng, self._count = container, diary, random.Random(name), 0

    def run(self) -> None:
        acts: list[tuple[Callable[[], None], int]] = [
            (self._add, 12),
            (self._run_now, 4),
            (self._switch_off, 3),
            (self._remove, 3),
            (self._cancel, 3),
            (self._change, 2),
            (self._look, 4),
            (self._hold, 1),
            (self._robot_off, 1),
            (self._clear, 1),
        ]
        choices, weights = zip(*acts, strict=True)
        while True:
            time.sleep(self._rng.uniform(0.0, 0.25))
            try:
                self._rng.choices(choices, weights)[0]()
            except (RobotError, InvalidInput, LookupError):
                continue  # shown to a person, who may try again
            except Exception:
                traceback.print_exc()  # the parent looks for it

    def _act(self, act: str, about: str, do: Callable[[], object], robot: str = "") -> None:
        self._diary.note(act, about, "begun", robot)
        do()
        self._diary.note(act, about, "done", robot)

    # ------------------------------------------------------------------ what a person does
    def _add(self) -> None:
        """A start that is due this very minute."""
        self._count += 1
        catalogue, robot = self._container.catalogue, self._rng.choice(self._container.catalogue.robots())
        name = f"{self.name}-{self._count}"
        start = datetime.now(UTC).replace(second=0, microsecond=0, tzinfo=None)
        schedule = Schedule(
            name, robot.id, self._mission_id(), start, "UTC", overlap=Overlap.QUEUE, respect_working_days=False
        )
        self._act("add", name, lambda: catalogue.save_schedule(schedule), robot.name)

    def _mission_id(self) -> int:
        return next(mission.id for mission in self._container.catalogue.missions() if mission.name == MISSION)

    def _any(self) -> Schedule:
        """One of the newest: old events can't be undone."""
        return self._rng.choice(sorted(self._container.catalogue.schedules(), key=lambda schedule: schedule.id)[-6:])

    def _switch_off(self) -> None:
        schedule = self._any()
        self._act("off", schedule.name, lambda: self._container.catalogue.switch_schedule(schedule.id, False))

    def _remove(self) -> None:
        schedule, catalogue = self._any(), self._container.catalogue
        removed = []
        self._act("remove", schedule.name, lambda: removed.append(catalogue.remove_schedule(schedule.id)))
        if self._rng.random() < 0.5:
            self._act("undo", schedule.name, lambda: catalogue.restore(removed[0]))

    def _change(self) -> None:
        """Another priority: the start stays."""
        schedule, catalogue = self._any(), self._container.catalogue
        catalogue.edit(
            lambda edit: schedule_edit.save(
                edit, replace(edit.the(Schedule, schedule.id), priority=self._rng.randrange(9))
            )
        )

    def _cancel(self) -> None:
        if rows := self._container.history.open():
            row = self._rng.choice(rows)
            self._act("cancel", row.token, lambda: self._container.operator.cancel_execution(row.id))

    def _run_now(self) -> None:
        robot, mission_id = self._rng.choice(self._container.catalogue.robots()), self._mission_id()
        token = str(uuid.UUID(int=self._rng.getrandbits(128), version=4))
        self._act("run", token, lambda: self._container.operator.run_now(robot.id, mission_id, token=token), robot.name)

    def _hold(self) -> None:
        self._act("hold", "", lambda: self._container.holds.hold("stress"))
        time.sleep(self._rng.uniform(0.0, LONGEST_HOLD))
        self._act("release", "", self._container.holds.release)

    def _robot_off(self) -> None:
        robot = self._container.catalogue.robots()[0]
        self._act("robot off", robot.name, lambda: switch_robot(self._container.catalogue, robot.id, False), robot.name)
        time.sleep(self._rng.uniform(0.0, LONGEST_HOLD))
        self._act("robot on", robot.name, lambda: switch_robot(self._container.catalogue, robot.id, True), robot.name)

    def _clear(self) -> None:
        robot = self._container.catalogue.robots()[0]
        self._act("clear", robot.name, lambda: self._container.operator.clear_queue(robot.id), robot.name)

    def _look(self) -> None:
        """What screens read while all of this happens."""
        self._container.kpis.facts()
        self._container.history.open()
        self._container.alarms.open()
        self._container.engine.watch(self._rng.choice(self._container.catalogue.robots()).id)


def main() -> None:
    data_dir, diary_path, seed, operators = sys.argv[1:]
    logging.basicConfig(level=logging.WARNING)
    diary = Diary(Path(diary_path))
    container = Container.open(Path(data_dir))
    container.runner.start()
    diary.note("release", "", "begun")
    container.holds.release()
    for robot in container.catalogue.robots():
        diary.note("robot on", robot.name, "begun", robot.name)
        switch_robot(container.catalogue, robot.id, True)
    people = [Operator(container, diary, f"{seed}.{number}") for number in range(int(operators))]
    for person in people:
        person.start()
    print("ready", flush=True)
    sys.stdin.read()  # until the parent goes or says so
    container.close()


if __name__ == "__main__":
    main()
