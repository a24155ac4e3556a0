"""The one-shot commands: import, export, run now, check-up, remove the PIN, restore.

Exports read beside a running app; changes are handed to it when there is one, but for restoring a backup, which needs it closed.
"""

from __future__ import annotations

import argparse
import contextlib
import errno
import json
import os
import shlex
import sqlite3
import sys
import threading
import time
import uuid
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import AbstractContextManager
from pathlib import Path
from typing import Any, TextIO

from app.container import Container
from app.database.executions import ExecutionRepository
from app.domain.check_up import Trial
from app.domain.message import render
from app.domain.models import Execution, InvalidInput, State
from app.failures import BadInput, Failure
from app.mir.errors import RobotError
from app.process import log_file, terminal
from app.process.data_directory import DataDirectory, refuse_own_file
from app.process.inbox import HolderGone, Interrupted, NoAnswer, ask
from app.process.lock import InstanceLock
from app.process.opening import open_container, open_for_reading
from app.process.requests import (
    MORE_THAN_A_WINDOW,
    check_up,
    find_robot,
    import_configuration,
    keep_clock_confirmation,
    outcome,
    run_now,
)
from app.process.restoring import restore_backup
from app.process.terminal import say
from app.process.waiting import said_while_waiting
from app.services.catalogue import configuration
from app.services.check_up.service import moves
from app.services.dispatch.worker import RobotWorker
from app.services.files.history_export import write_history
from app.services.files.reading import read_file
from app.services.files.shared_places import draft_of, open_in_place, without_links

CHANGED_WITHIN = 120.0  # s for the running app to carry out a change: several times what the largest import takes
CHECKED_UP_WITHIN = 3600.0  # s for the running app to check a robot up: with a long mission that is tried three times
PUT_BACK_WITHIN = 60.0  # s for it to put a robot back when the command is interrupted
HEARD_WITHIN = 1.0  # s for the robots of a group to answer before one of them is chosen
WAIT_FOR_COMMAND = 0.1  # s between looks whether another command has ended


def run(options: argparse.Namespace, directory: DataDirectory) -> int:
    """Returns the exit code. Raises BadInput or Failure with the one line to say."""
    log_file.start(directory.logs, stderr=False, only_to_read=directory.only_to_read)
    if options.restore_backup:
        return _restore(directory, options.restore_backup)
    if options.remove_pin:
        return _remove_pin(directory)
    if options.move_here:
        return _move_here(directory)
    if options.clock_is_right:
        return _clock_is_right(directory)
    if options.import_config:
        return _import(directory, Path(options.import_config), may_delete=options.yes)
    if options.run_now:
        robot, mission = options.run_now
        return _run_now(directory, robot, mission, options.parameter)
    if options.check_up:
        return _check_up(directory, options)
    db = open_for_reading(directory)
    try:
        if options.export_config:
            text = configuration.export_configuration(db.read())
            _write(options.export_config, text.encode("utf-8"))
        else:
            with export_target(options.export_log) as file:
                write_history(db.read(), file)
    except (ValueError, TypeError, LookupError, AttributeError, ArithmeticError, sqlite3.Error) as error:
        raise BadInput(
            f"{directory.database} has a value that can't be used ({error}), so it is not exported; restore a backup"
        ) from error
    finally:
        db.close()
    return 0


# ------------------------------------------------------------------ import
def _import(directory: DataDirectory, path: Path, *, may_delete: bool) -> int:
    try:
        content = read_file(path, may_be_pipe=True)
    except InvalidInput as error:
        raise BadInput(f"{error}; nothing was changed") from None

    def import_here(container: Container) -> dict[str, Any]:
        try:
            return import_configuration(container, content, may_delete=may_delete)
        except InvalidInput as error:
            raise BadInput(f"{path}: {error}; nothing was changed") from None

    changes = _change(directory, import_here, "import", path=str(path), content=content, may_delete=may_delete)[
        "changes"
    ]
    say("\n".join(changes) or "nothing changed")
    return 0


# ------------------------------------------------------------------ run now
def _run_now(directory: DataDirectory, robot: str, mission: str, given: Sequence[str]) -> int:
    parameters = dict(_parameter(text) for text in given)
    token = str(
        uuid.uuid4()
    )  # of this command: whoever carries it out, and however often it is asked, the mission runs once
    with said_while_waiting(directory, token):
        try:
            answer = _here_or_by_the_running_app(
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
            answer = _found_out(directory, token, error)
    _raise_for(answer)
    say(" ".join([*([answer["robot"]] if "robot" in answer else []), str(answer["queue_id"])]))
    return 0


def _found_out(directory: DataDirectory, token: str, error: NoAnswer) -> dict[str, Any]:
    """The running app did not answer in time: whether it has accepted the request, so that the mission may still start."""
    where = f"see Logs in the app, or python main.py --data-dir {shlex.quote(str(directory.path))} --export-log -"
    try:
        db = open_for_reading(directory)
        try:
            execution = ExecutionRepository().by_token(db.read(), token)
        finally:
            db.close()
    except (Failure, sqlite3.Error):
        return {"exit": 1, "error": f"{error}; the mission may still start: {where}"}
    if execution is None:
        return {
            "exit": 1,
            "error": f"{error} and had not accepted the mission, so it will not start: give the command again",
        }
    if execution.state in (State.WAITING, State.SUBMITTING):
        which = f"{execution.mission} on {execution.robot or execution.robot_group}"
        return {"exit": 1, "error": f"{error}; {which} may still start, now or when the app runs again: {where}"}
    return outcome(execution)


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
    """The same exactly-once path as in the running app, for this one execution only, which an app that is gone may have begun."""
    if (hold := container.holds.active()) is not None and hold.is_copy:
        raise BadInput(f"{hold.reason}: with --move-here this machine starts its missions")
    execution = container.ledger.by_token(token)
    if execution is None:
        try:
            execution = run_now(container, robot_name, mission_name, parameters, token)
        except InvalidInput as error:
            raise BadInput(str(error)) from None
    group = next((group for group in container.catalogue.groups() if group.id == execution.group_id), None)
    wanted = group.members if group is not None else (execution.robot_id,)
    workers = {robot.id: container.make_worker(robot) for robot in container.catalogue.robots() if robot.id in wanted}
    readers = {key: _Reader(worker) for key, worker in workers.items()}
    try:
        while (workers or execution.robot_id is None) and execution.state in (State.WAITING, State.SUBMITTING):
            wait = _go_on(container, readers, execution)
            execution = container.ledger.get(execution.id) or execution
            if execution.state in (State.WAITING, State.SUBMITTING):
                container.clock.sleep(min(wait, 1.0))
    finally:
        for reader in readers.values():
            reader.join()
            reader.worker.close()
    return outcome(execution)


def _go_on(container: Container, readers: Mapping[int, _Reader], execution: Execution) -> float:
    """One round for it; returns the seconds until the next."""
    if execution.robot_id is None:
        for reader in readers.values():
            reader.read()
        end = time.monotonic() + HEARD_WITHIN
        for reader in readers.values():
            reader.join(max(0.0, end - time.monotonic()))
        container.allocator.advance({key: reader.worker for key, reader in readers.items()}, only=execution.id)
        bound = container.ledger.get(execution.id)
        if bound is None or bound.robot_id is None:
            return 1.0
        execution = bound
    reader_of_it = readers.get(execution.robot_id or 0)
    if reader_of_it is None:
        return 1.0
    reader_of_it.join()  # two threads never use one connection
    return reader_of_it.worker.start_only(execution.id)


class _Reader:
    """Reads one robot of a group on a thread of its own: one that hangs holds up none of the others."""

    def __init__(self, worker: RobotWorker) -> None:
        self.worker = worker
        self._thread: threading.Thread | None = None

    @property
    def is_reading(self) -> bool:
        return self._thread is not None and self._thread.is_alive()

    def read(self) -> None:
        if not self.is_reading:
            self._thread = threading.Thread(target=self._run, name=f"read-{self.worker.robot.name}", daemon=True)
            self._thread.start()

    def join(self, seconds: float | None = None) -> None:
        if self._thread is not None:
            self._thread.join(seconds)

    def _run(self) -> None:
        with contextlib.suppress(RobotError):
            self.worker.seen.read_status()


# ------------------------------------------------------------------ check-up
def _check_up(directory: DataDirectory, options: argparse.Namespace) -> int:
    """Prints the report, of one that is not complete as well; with ``--report`` it is written as a file too, or to stdout in its stead."""
    terminal.end_as_interrupted()
    trial = None if options.with_mission is None else Trial(options.with_mission or None)
    if trial is not None and not options.yes and sys.stdin is not None and sys.stdin.isatty():
        terminal.ask(_moves(directory, options.check_up, trial))

    def check_up_here(container: Container) -> dict[str, Any]:
        try:
            return check_up(container, options.check_up, trial)
        except InvalidInput as error:
            raise BadInput(str(error)) from None
        except KeyboardInterrupt:
            left = find_robot(container.db.read(), options.check_up).id in container.check_ups.left_behind()
            raise Interrupted(
                {"left": "the robot is not as it was before: the app's next start puts it back"} if left else {}
            ) from None

    # A target that can't be written is found before the robot is asked. Raising leaves an old file as it was.
    is_file = bool(options.report) and options.report != "-"
    with export_target(options.report) if is_file else contextlib.nullcontext() as file:
        try:
            answer = _here_or_by_the_running_app(
                directory,
                check_up_here,
                "check_up",
                CHECKED_UP_WITHIN,
                is_taken_over=False,
                put_back_within=PUT_BACK_WITHIN,
                robot=options.check_up,
                is_tried=trial is not None,
                mission=trial.mission if trial else None,
            )
        except NoAnswer as error:
            raise Failure(f"{error}; give the command again") from None
        except Interrupted as end:
            raise Failure(f"interrupted; {_what_is_left(end.answer)}") from None
        if "text" not in answer:
            _raise_for(answer)
        if file is not None:
            file.write(answer["document"])
    say(answer["document" if options.report == "-" else "text"].rstrip("\n"))
    _raise_for(answer)
    return 0


def _what_is_left(answer: Mapping[str, Any] | None) -> str:
    """By a check-up that was interrupted; None: the running app did not say."""
    if answer is None:
        return f"the app did not confirm within {PUT_BACK_WITHIN:.0f} s that the robot was put back: check it"
    return str(answer.get("left", "nothing is left on the robot"))


def _moves(directory: DataDirectory, robot: str, trial: Trial) -> str:
    db = open_for_reading(directory)
    try:
        return render(moves(find_robot(db.read(), robot).name, trial))
    except InvalidInput as error:
        raise BadInput(str(error)) from None
    finally:
        db.close()


# ------------------------------------------------------------------ a forgotten PIN
def _remove_pin(directory: DataDirectory) -> int:
    """Whoever may run commands on the data directory may open Settings."""
    answer = _change(directory, lambda container: {"was_set": container.access.remove()}, "remove_pin")
    say("the PIN for Settings was removed" if answer["was_set"] else "there was no PIN for Settings")
    return 0


# ------------------------------------------------------------------ a copied data directory
def _move_here(directory: DataDirectory) -> int:
    answer = _change(directory, lambda container: {"was_copy": container.tablet.move_here()}, "move_here")
    say(
        "this machine starts the missions from now on"
        if answer["was_copy"]
        else "this machine starts the missions already"
    )
    return 0


# ------------------------------------------------------------------ a clock that robots contradict
def _clock_is_right(directory: DataDirectory) -> int:
    answer = _change(directory, keep_clock_confirmation, "clock_is_right")
    if "was_in_doubt" not in answer:
        say(f"no app runs; the next one started within a day trusts this clock: {answer['time']}")
    elif answer["was_in_doubt"]:
        say(f"missions start by this clock from now on: {answer['time']}")
    else:
        say(f"nothing contradicts this clock: {answer['time']}")
    return 0


# ------------------------------------------------------------------ restore
def _restore(directory: DataDirectory, backup: Path) -> int:
    kept = restore_backup(directory, backup)
    say(f"{backup} restored" + (f"; the former database is kept as {kept}" if kept else ""))
    return 0


# ------------------------------------------------------------------ talking to the running app, and to files
def _here_or_by_the_running_app(
    directory: DataDirectory,
    here: Callable[[Container], dict[str, Any]],
    kind: str,
    timeout: float,
    *,
    is_taken_over: bool = True,
    **request: Any,
) -> dict[str, Any]:
    """Do it in this process when no other one holds the data directory, else ask the one that does.

    A command that holds it answers nobody and is waited for. When an app ends without an answer, this process tries again: what is asked
    for must come to the same when it is done twice. What lasts long is not ``is_taken_over``: the app could not be started again
    meanwhile. Raises NoAnswer when an app that runs on does not answer within ``timeout`` s, or ends and is not followed.
    """
    while True:
        lock = InstanceLock(directory.path)
        if lock.try_acquire():
            try:
                container = open_container(directory)
                try:
                    return here(container)
                finally:
                    container.db.close()
            finally:
                lock.release()
        if lock.is_held_by_command:
            time.sleep(WAIT_FOR_COMMAND)
            continue
        try:
            return ask(directory.path, kind, timeout=timeout, holder_is_gone=lambda: _is_free(directory), **request)
        except HolderGone:
            if not is_taken_over:
                raise


def _is_free(directory: DataDirectory) -> bool:
    """Whether no process holds the data directory at this moment."""
    probe = InstanceLock(directory.path)
    free = probe.try_acquire()
    probe.release()
    return free


def _change(
    directory: DataDirectory, here: Callable[[Container], dict[str, Any]], kind: str, **request: Any
) -> dict[str, Any]:
    """For changes of the configuration. Raises Failure or BadInput."""
    try:
        answer = _here_or_by_the_running_app(directory, here, kind, CHANGED_WITHIN, **request)
    except NoAnswer as error:
        raise Failure(
            f"{error}; it may have been done or not: give the command again, twice changes nothing more"
        ) from None
    _raise_for(answer)
    return answer


def _raise_for(answer: dict[str, Any]) -> None:
    if error := answer.get("error"):
        raise BadInput(error) if answer.get("exit") == 2 else Failure(error)


@contextlib.contextmanager
def export_target(name: str) -> Iterator[TextIO]:
    """Where an export goes. A file is written beside and renamed, so that a failed export leaves the old one; ``-`` is stdout; an
    existing target that isn't a plain file (a pipe, a device) is written into and never replaced. Raises BadInput."""
    try:
        with _opened(name) as file:
            yield file
    except OSError as error:
        where = "stdout" if name == "-" else name
        raise BadInput(f"{where} can't be written: {error.strerror}; give another file to write to") from None


def _opened(name: str) -> AbstractContextManager[TextIO]:
    if name == "-":
        if sys.stdout is None:  # closed; its number may be another file's by now
            raise OSError(errno.EBADF, os.strerror(errno.EBADF))
        return open(sys.stdout.fileno(), "w", encoding="utf-8", newline="", closefd=False)
    try:
        path = without_links(Path(name))
    except InvalidInput as error:
        raise BadInput(str(error)) from None
    refuse_own_file(path)
    is_in_place = path.exists() and not (path.is_file() or path.is_dir())
    return open_in_place(path) if is_in_place else draft_of(path)


def _write(name: str, content: bytes) -> None:
    with export_target(name) as file:
        file.write(content.decode("utf-8"))
