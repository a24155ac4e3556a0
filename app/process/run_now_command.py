"""``--run-now``: starts one mission exactly once, in this process or by the running app, and says what it waits for."""

from __future__ import annotations

import contextlib
import json
import sqlite3
import threading
import time
import uuid
from collections.abc import Iterator, Mapping, Sequence
from contextlib import closing, contextmanager
from typing import Any

from app.command import command
from app.container import Container
from app.database.executions import ExecutionRepository
from app.domain.execution import Execution
from app.domain.reasons import waiting_sentence
from app.failures import BadInput, Failure
from app.mir.errors import RobotError
from app.process.data_directory import DataDirectory, open_for_reading
from app.process.inbox import NoAnswer, here_or_by_the_running_app, raise_for
from app.process.requests import MORE_THAN_A_WINDOW, known_start, outcome, run_now
from app.process.terminal import print_error, say
from app.services.dispatch.worker import RobotWorker
from app.services.executions.transitions import NOT_WITH_THE_ROBOT

ANSWER_WITHIN = 1.0  # s for the robots of a group to answer before one of them is chosen
REPORT_EVERY = 10.0  # s between two sentences about what it waits for


def run(directory: DataDirectory, robot: str, mission: str, assignments: Sequence[str]) -> int:
    """``assignments``: parameters as NAME=VALUE. Returns the exit code. Raises BadInput or Failure."""
    parameters = dict(_parameter(text) for text in assignments)
    token = str(uuid.uuid4())  # of this command: in any process, and however often it is tried, the mission runs once
    with _progress_on_stderr(directory, token):
        try:
            answer = here_or_by_the_running_app(
                directory,
                lambda container: _submit(container, robot, mission, parameters, token),
                "run_now",
                MORE_THAN_A_WINDOW,
                robot=robot,
                mission=mission,
                parameters=parameters,
                token=token,
            )
        except NoAnswer as error:
            answer = _accepted_or_not(directory, token, error)
    raise_for(answer)
    say(" ".join([*([answer["robot"]] if "robot" in answer else []), str(answer["queue_id"])]))
    return 0


def _accepted_or_not(directory: DataDirectory, token: str, error: NoAnswer) -> dict[str, Any]:
    """The running app did not answer in time: whether it has accepted the request, so that the mission may still start."""
    where = f"see Logs in the app, or {command('--data-dir', directory.path, '--export-log', '-')}"
    try:
        execution = _stored(directory, token)
    except (Failure, sqlite3.Error):
        raise Failure(f"{error}; the mission may still start: {where}") from None
    if execution is None:
        raise Failure(f"{error} and had not accepted the mission, so it will not start: give the command again")
    if execution.state in NOT_WITH_THE_ROBOT:
        which = f"{execution.mission} on {execution.robot or execution.robot_group}"
        raise Failure(f"{error}; {which} may still start, now or when the app runs again: {where}")
    return outcome(execution)


def _stored(directory: DataDirectory, token: str) -> Execution | None:
    """Raises Failure or sqlite3.Error."""
    with closing(open_for_reading(directory)) as db:
        return ExecutionRepository().by_token(db.read(), token)


def _parameter(text: str) -> tuple[str, Any]:
    name, sign, value = text.partition("=")
    if not sign or not name:
        raise BadInput(f"--parameter {text!r} is not NAME=VALUE")
    try:
        number = json.loads(value)
    except ValueError:
        return name, value
    return name, number if isinstance(number, int | float) else value


def _submit(
    container: Container, robot_name: str, mission_name: str, parameters: dict[str, Any], token: str
) -> dict[str, Any]:
    """The same exactly-once path as in the running app, only for this one execution, which an earlier app may have
    begun."""
    execution = known_start(container, token) or run_now(container, robot_name, mission_name, parameters, token)
    group = next((group for group in container.catalogue.groups() if group.id == execution.group_id), None)
    robot_ids = group.members if group is not None else (execution.robot_id,)
    robots = [robot for robot in container.catalogue.robots() if robot.id in robot_ids]
    readers = {robot.id: _Reader(container.make_worker(robot)) for robot in robots}
    try:
        while (readers or execution.robot_id is None) and execution.state in NOT_WITH_THE_ROBOT:
            _ask_fleets(container, readers)
            wait = _go_on(container, readers, execution)
            execution = container.ledger.get(execution.id) or execution
            if execution.state in NOT_WITH_THE_ROBOT:
                container.clock.sleep(min(wait, 1.0))
    finally:
        for reader in readers.values():
            reader.join()
            reader.worker.close()
    return outcome(execution)


def _ask_fleets(container: Container, readers: dict[int, _Reader]) -> None:
    """Who they are, where that is not known yet: nothing is sent to one that could be another."""
    unknown = {key: reader for key, reader in readers.items() if not reader.worker.robot.is_identified}
    if not unknown:
        return
    container.fleets.ask_new({reader.worker.robot.fleet_id for reader in unknown.values()})
    for robot in container.catalogue.robots():
        if robot.id in unknown and robot.is_identified:
            unknown[robot.id].join()
            unknown[robot.id].worker.close()
            readers[robot.id] = _Reader(container.make_worker(robot))


def _go_on(container: Container, readers: Mapping[int, _Reader], execution: Execution) -> float:
    """One round for it; returns the seconds until the next."""
    if execution.robot_id is None:
        for reader in readers.values():
            reader.read()
        end = time.monotonic() + ANSWER_WITHIN
        for reader in readers.values():
            reader.join(max(0.0, end - time.monotonic()))
        container.allocator.advance({key: reader.worker for key, reader in readers.items()}, only=execution.id)
        execution = container.ledger.get(execution.id) or execution
    its_reader = readers.get(execution.robot_id or 0)
    if its_reader is None:
        return 1.0
    its_reader.join()  # two threads never use one connection
    return its_reader.worker.start_only(execution.id)


class _Reader:
    """Reads one robot of a group on its own thread: one that hangs does not delay the others."""

    def __init__(self, worker: RobotWorker) -> None:
        self.worker = worker
        self._thread: threading.Thread | None = None

    def read(self) -> None:
        if self._thread is None or not self._thread.is_alive():
            self._thread = threading.Thread(target=self._run, name=f"read-{self.worker.robot.name}", daemon=True)
            self._thread.start()

    def join(self, seconds: float | None = None) -> None:
        if self._thread is not None:
            self._thread.join(seconds)

    def _run(self) -> None:
        with contextlib.suppress(RobotError):
            self.worker.seen.read_status()


@contextmanager
def _progress_on_stderr(directory: DataDirectory, token: str) -> Iterator[None]:
    """What the start with this token waits for; on its own thread, as stderr may block."""
    is_over = threading.Event()
    threading.Thread(target=_report, args=(directory, token, is_over), name="waiting", daemon=True).start()
    try:
        yield
    finally:
        is_over.set()


def _report(directory: DataDirectory, token: str, is_over: threading.Event) -> None:
    while not is_over.wait(REPORT_EVERY):
        if text := _waits_for(directory, token):
            print_error(text)


def _waits_for(directory: DataDirectory, token: str) -> str:
    try:
        start = _stored(directory, token)
    except (Failure, sqlite3.Error):
        return ""
    if start is None:
        return "waiting for the process that uses the data directory"
    sentence = waiting_sentence(start)
    return sentence and f"{start.mission} on {start.robot or start.robot_group}: {sentence}"
