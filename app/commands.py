"""The one-shot commands: import, export, run now, restore.

Exports read beside a running app; the others are handed to it when there is one.
"""
from __future__ import annotations

import argparse
import hashlib
import json
import os
import sys
import tempfile
import uuid
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from app import logs
from app.container import Container
from app.data_directory import DataDirectory
from app.database.backups import restore
from app.database.errors import DatabaseError
from app.failures import BadInput, Failure
from app.models import Execution, InvalidInput, State
from app.opening import open_container, open_for_reading
from app.requests import MORE_THAN_A_WINDOW, find_mission, find_robot, outcome
from app.services import configuration
from app.services.clock import SystemClock
from app.services.history_export import write_history
from app.services.inbox import NoAnswer, ask
from app.services.lock import AlreadyRunning, InstanceLock

IMPORT_WITHIN = 30.0        # s for the running app to take a configuration up
LARGEST_CONFIGURATION = 5 * 1024 * 1024


def run(options: argparse.Namespace, directory: DataDirectory) -> int:
    """Returns the exit code. Raises BadInput or Failure with the one line to say."""
    logs.start(directory.logs, stderr=False)
    if options.restore_backup:
        return _restore(directory, options.restore_backup)
    if options.import_config:
        return _import(directory, Path(options.import_config))
    if options.run_now:
        robot, mission = options.run_now
        return _run_now(directory, robot, mission, options.parameter)
    _begin_if_new(directory)
    db = open_for_reading(directory)
    try:
        if options.export_config:
            text = configuration.export_configuration(db.read())
            _write(options.export_config, text.encode("utf-8"))
        else:
            with _Target(options.export_log) as file:
                write_history(db.read(), file)
    finally:
        db.close()
    return 0


def _begin_if_new(directory: DataDirectory) -> None:
    """An export of a directory without data writes the defaults, or a log without rows."""
    if directory.database.exists():
        return
    lock = InstanceLock(directory.path)
    if lock.try_acquire():
        try:
            open_container(directory).db.close()
        finally:
            lock.release()


# ------------------------------------------------------------------ import
def _import(directory: DataDirectory, path: Path) -> int:
    content = read_configuration(path)
    lock = InstanceLock(directory.path)
    if lock.try_acquire():
        try:
            container = open_container(directory)
            try:
                changes = configuration.import_configuration(container.catalogue, content)
            finally:
                container.db.close()
        except InvalidInput as error:
            raise BadInput(f"{path}: {error}; nothing was changed") from None
        finally:
            lock.release()
    else:
        digest = hashlib.sha256(content).hexdigest()
        answer = _ask(directory, "import", IMPORT_WITHIN, path=str(path.resolve()), sha256=digest)
        _raise_for(answer)
        changes = answer["changes"]
    for line in changes:
        print(line)
    if not changes:
        print("nothing changed")
    return 0


def read_configuration(path: Path) -> bytes:
    """The file's bytes. Raises BadInput."""
    try:
        with open(path, "rb") as file:
            content = file.read(LARGEST_CONFIGURATION + 1)
    except OSError as error:
        raise BadInput(f"{path} can't be read: {error.strerror}; nothing was changed") from None
    if len(content) > LARGEST_CONFIGURATION:
        raise BadInput(f"{path} is larger than 5 MiB; nothing was changed")
    return content


# ------------------------------------------------------------------ run now
def _run_now(directory: DataDirectory, robot: str, mission: str, given: Sequence[str]) -> int:
    parameters = dict(_parameter(text) for text in given)
    token = str(uuid.uuid4())
    lock = InstanceLock(directory.path)
    if lock.try_acquire():
        try:
            container = open_container(directory)
            try:
                ended = _submit(container, robot, mission, parameters, token)
            finally:
                container.db.close()
        except InvalidInput as error:
            raise BadInput(str(error)) from None
        finally:
            lock.release()
        answer = outcome(ended)
    else:
        answer = _ask(directory, "run_now", MORE_THAN_A_WINDOW, robot=robot, mission=mission, parameters=parameters, token=token)
    _raise_for(answer)
    print(answer["queue_id"])
    return 0


def _parameter(text: str) -> tuple[str, Any]:
    name, sign, value = text.partition("=")
    if not sign or not name:
        raise BadInput(f"--parameter {text!r} is not NAME=VALUE")
    try:
        number = json.loads(value)
    except ValueError:
        return name, value
    return name, number if isinstance(number, int | float) else value


def _submit(container: Container, robot_name: str, mission_name: str, parameters: dict[str, Any], token: str) -> Execution:
    """The same exactly-once path as in the running app, for this one execution only."""
    robot = find_robot(container, robot_name)
    mission = find_mission(container, mission_name, robot)
    execution = container.operator.run_now(robot.id, mission.id, parameters, token)
    lane = container.make_lane(robot)
    try:
        while execution.state in (State.WAITING, State.SUBMITTING):
            wait = lane.dispatch_only(execution.id)
            execution = container.ledger.get(execution.id) or execution
            if execution.state in (State.WAITING, State.SUBMITTING):
                container.clock.sleep(min(wait, 1.0))
    finally:
        lane.close()
    return execution


# ------------------------------------------------------------------ restore
def _restore(directory: DataDirectory, backup: Path) -> int:
    lock = InstanceLock(directory.path)
    try:
        lock.acquire()
    except AlreadyRunning as error:
        raise BadInput(str(error)) from None
    try:
        kept = restore(backup, directory.database, SystemClock().now())
    except DatabaseError as error:
        raise BadInput(error.text) from None
    finally:
        lock.release()
    print(f"{backup} restored" + (f"; the former database is kept as {kept}" if kept else ""))
    return 0


# ------------------------------------------------------------------ talking to the running app, and to files
def _ask(directory: DataDirectory, kind: str, timeout: float, **request: Any) -> dict[str, Any]:
    def holder_is_gone() -> bool:
        probe = InstanceLock(directory.path)
        gone = probe.try_acquire()
        probe.release()
        return gone
    try:
        return ask(directory.path, kind, timeout=timeout, holder_is_gone=holder_is_gone, **request)
    except NoAnswer as error:
        raise Failure(str(error)) from None


def _raise_for(answer: dict[str, Any]) -> None:
    if error := answer.get("error"):
        raise BadInput(error) if answer.get("exit") == 2 else Failure(error)


class _Target:
    """The file that an export is written to: beside and renamed, so that a failed export leaves the old one; ``-`` is stdout."""

    def __init__(self, name: str) -> None:
        self._name = name

    def __enter__(self) -> Any:
        if self._name == "-":
            self._file = open(sys.stdout.fileno(), "w", encoding="utf-8", newline="", closefd=False)
            return self._file
        self._path = Path(self._name)
        try:
            descriptor, self._draft = tempfile.mkstemp(dir=self._path.parent, prefix=f".{self._path.name}.")
        except OSError as error:
            raise BadInput(f"{self._path} can't be written: {error.strerror}") from None
        self._file = os.fdopen(descriptor, "w", encoding="utf-8", newline="")
        return self._file

    def __exit__(self, kind: object, error: object, trace: object) -> None:
        if self._name == "-":
            self._file.flush()
            return
        self._file.close()
        if kind is not None:
            os.unlink(self._draft)
            return
        try:
            os.replace(self._draft, self._path)
        except OSError as problem:
            os.unlink(self._draft)
            raise BadInput(f"{self._path} can't be written: {problem.strerror}") from None


def _write(name: str, content: bytes) -> None:
    with _Target(name) as file:
        file.write(content.decode("utf-8"))
