"""The one-shot commands: import, export, run now, check-up, remove the PIN, restore.

Exports read while an app runs; changes are handed to the running app, except restoring a backup, which needs it closed.
"""

from __future__ import annotations

import argparse
import contextlib
import errno
import os
import sqlite3
import sys
from collections.abc import Callable, Iterator, Mapping
from contextlib import AbstractContextManager, closing
from pathlib import Path
from typing import Any, TextIO

from app.container import Container
from app.domain.check_up import Trial
from app.domain.message import render
from app.domain.models import Fleet, InvalidInput
from app.failures import BadInput, Failure
from app.process import log_file, run_now_command, terminal
from app.process.data_directory import (
    DataDirectory,
    open_for_reading,
    refuse_own_file,
    restore_backup,
)
from app.process.inbox import Interrupted, NoAnswer, here_or_by_the_running_app, raise_for
from app.process.requests import (
    check_up,
    check_ups_of,
    find_checked,
    import_configuration,
    keep_clock_confirmation,
)
from app.process.terminal import say
from app.services.catalogue import configuration
from app.services.check_up.fleet_check_ups import FleetCheckUps
from app.services.check_up.service import CheckUps
from app.services.files.file_access import draft_of, open_in_place, read_file, without_links
from app.services.files.history_export import write_history

CHANGED_WITHIN = 120.0  # s for the running app to carry out a change: several times what the largest import takes
CHECKED_UP_WITHIN = 3600.0  # s for the running app to check a robot up: with a long mission that is tried three times
PUT_BACK_WITHIN = 60.0  # s for it to put a robot back when the command is interrupted


def run(options: argparse.Namespace, directory: DataDirectory) -> int:
    """Returns the exit code. Raises BadInput or Failure with the one line to say."""
    log_file.start(directory.logs, stderr=False, read_only=directory.read_only)
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
        return run_now_command.run(directory, robot, mission, options.parameter)
    if options.check_up:
        return _check_up(directory, options)
    db = open_for_reading(directory)
    try:
        with export_target(options.export_config or options.export_log) as file:
            if options.export_config:
                file.write(configuration.export_configuration(db.read()))
            else:
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
    answer = _change(
        directory,
        lambda container: import_configuration(container, str(path), content, may_delete=may_delete),
        "import",
        path=str(path),
        content=content,
        may_delete=may_delete,
    )
    say("\n".join(answer["changes"]) or "nothing changed")
    return 0


# ------------------------------------------------------------------ check-up
def _check_up(directory: DataDirectory, options: argparse.Namespace) -> int:
    """Prints the report, even an incomplete one; with ``--report`` it is also written to a file, or to stdout
    instead."""
    terminal.end_as_interrupted()
    trial = None if options.with_mission is None else Trial(options.with_mission or None, options.on_robot or "")
    if trial is not None and not options.yes and sys.stdin is not None and sys.stdin.isatty():
        terminal.confirm(_moves(directory, options.check_up, trial))

    # A target that can't be written is found before the robot is asked. Raising leaves an old file unchanged.
    is_file = bool(options.report) and options.report != "-"
    with export_target(options.report) if is_file else contextlib.nullcontext() as file:
        try:
            answer = here_or_by_the_running_app(
                directory,
                lambda container: _check_up_here(container, options.check_up, trial),
                "check_up",
                CHECKED_UP_WITHIN,
                is_taken_over=False,
                put_back_within=PUT_BACK_WITHIN,
                robot=options.check_up,
                is_tried=trial is not None,
                mission=trial.mission if trial else None,
                on_robot=trial.robot if trial else "",
            )
        except NoAnswer as error:
            raise Failure(f"{error}; give the command again") from None
        except Interrupted as end:
            raise Failure(f"interrupted; {_what_is_left(end.answer)}") from None
        if "text" not in answer:
            raise_for(answer)
        if file is not None:
            file.write(answer["document"])
    say(answer["document" if options.report == "-" else "text"].rstrip("\n"))
    raise_for(answer)
    return 0


def _check_up_here(container: Container, robot: str, trial: Trial | None) -> dict[str, Any]:
    try:
        return check_up(container, robot, trial)
    except KeyboardInterrupt:
        target = find_checked(container.db.read(), robot)
        left = target.id in check_ups_of(container, target).left_behind()
        raise Interrupted(
            {"left": "the robot is not as it was before: the app's next start puts it back"} if left else {}
        ) from None


def _what_is_left(answer: Mapping[str, Any] | None) -> str:
    """Changes left by an interrupted check-up; None: the running app did not say."""
    if answer is None:
        return f"the app did not confirm within {PUT_BACK_WITHIN:.0f} s that the robot was put back: check it"
    return str(answer.get("left", "nothing is left on the robot"))


def _moves(directory: DataDirectory, robot: str, trial: Trial) -> str:
    with closing(open_for_reading(directory)) as db:
        target = find_checked(db.read(), robot)
    return render((FleetCheckUps if isinstance(target, Fleet) else CheckUps).moves(target.name, trial))


# ------------------------------------------------------------------ a forgotten PIN
def _remove_pin(directory: DataDirectory) -> int:
    """Anyone who may run commands on the data directory may open Settings."""
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


# ------------------------------------------------------------------ the running app, and files
def _change(
    directory: DataDirectory, here: Callable[[Container], dict[str, Any]], kind: str, **request: Any
) -> dict[str, Any]:
    """For changes of the configuration. Raises Failure or BadInput."""
    try:
        answer = here_or_by_the_running_app(directory, here, kind, CHANGED_WITHIN, **request)
    except NoAnswer as error:
        raise Failure(
            f"{error}; it may have been done or not: give the command again, twice changes nothing more"
        ) from None
    raise_for(answer)
    return answer


@contextlib.contextmanager
def export_target(name: str) -> Iterator[TextIO]:
    """Where an export goes. A file is written as a draft and renamed, so that a failed export leaves the old one; ``-``
    is stdout; an existing target that isn't a plain file (a pipe, a device) is written to and never replaced. Raises
    BadInput."""
    try:
        with _opened(name) as file:
            yield file
    except OSError as error:
        where = "stdout" if name == "-" else name
        raise BadInput(f"{where} can't be written: {error.strerror}; give another file to write to") from None


def _opened(name: str) -> AbstractContextManager[TextIO]:
    if name == "-":
        if sys.stdout is None:  # closed; its number may be another file's now
            raise OSError(errno.EBADF, os.strerror(errno.EBADF))
        return open(sys.stdout.fileno(), "w", encoding="utf-8", newline="", closefd=False)
    try:
        path = without_links(Path(name))
    except InvalidInput as error:
        raise BadInput(str(error)) from None
    refuse_own_file(path)
    is_in_place = path.exists() and not (path.is_file() or path.is_dir())
    return open_in_place(path) if is_in_place else draft_of(path)
