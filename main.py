"""Entry point: the window, headless, or a one-shot command (docs/interfaces.md)."""

from __future__ import annotations

import argparse
import contextlib
import os
import sys
import tempfile
from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING, NoReturn

from app import NAME, __version__
from app.command import is_installed, program
from app.failures import BadInput, Failure
from app.process import terminal

if TYPE_CHECKING:  # imported late, so that --help needs nothing
    from app.process.data_directory import DataDirectory
    from app.process.host import DemoFleet


class _Parser(argparse.ArgumentParser):
    def error(self, message: str) -> NoReturn:
        """One line, exit 2."""
        self.exit(2, f"{self.prog}: {message}; see --help\n")


def _directory(name: str) -> Path:
    if not name:  # of a variable that is not set, in a script; a Path of it would be the current directory
        raise argparse.ArgumentTypeError("needs the name of a directory")
    return Path(name)


def parser() -> argparse.ArgumentParser:
    p = _Parser(
        prog=program(),
        description="Starts missions of MiR robots by time, by recurrence and by idleness.",
        allow_abbrev=False,
    )
    p.add_argument("--version", action="version", version=f"{NAME} {__version__}")
    p.add_argument(
        "--data-dir",
        type=_directory,
        metavar="DIR",
        help="where database, backups and logs live (default: the user's data directory)",
    )
    p.add_argument(
        "--demo",
        action="store_true",
        help="with five simulated robots, schedules and history, in a throw-away data directory",
    )
    p.add_argument("--headless", action="store_true", help="schedule without a window until SIGINT or SIGTERM")
    p.add_argument("--kiosk", action="store_true", help="the window fills the screen and has no pointer")
    one = p.add_mutually_exclusive_group()
    one.add_argument(
        "--import-config", metavar="FILE", help="read a configuration in one transaction and say what changed"
    )
    one.add_argument("--export-config", metavar="FILE", help="write the configuration, without secrets (- = stdout)")
    one.add_argument("--export-log", metavar="FILE", help="write the execution history as CSV (- = stdout)")
    one.add_argument(
        "--run-now", nargs=2, metavar=("ROBOT", "MISSION"), help="start one mission and print its queue id"
    )
    one.add_argument(
        "--check-up", metavar="NAME", help="find out what a robot or a fleet really does, and print the report"
    )
    one.add_argument("--restore-backup", type=Path, metavar="FILE", help="put a backup in the place of the database")
    one.add_argument("--remove-pin", action="store_true", help="open Settings again when its PIN is forgotten")
    one.add_argument(
        "--move-here", action="store_true", help="go on here with a data directory that was copied from another tablet"
    )
    one.add_argument(
        "--clock-is-right",
        action="store_true",
        help="start missions by this machine's clock though robots show other times",
    )
    p.add_argument(
        "--with-mission",
        nargs="?",
        const="",
        metavar="NAME",
        help="with --check-up: queue this harmless mission too; without NAME one that waits a second, made and removed",
    )
    p.add_argument(
        "--on-robot",
        metavar="ROBOT",
        help="with --check-up FLEET --with-mission NAME: the fleet's robot that gets an order, which is deleted before it runs",
    )
    p.add_argument(
        "--report",
        metavar="FILE",
        help="with --check-up: write the report as JSON, which "
        f"{'mir-sim' if is_installed() else 'python -m mir_sim'} --profile takes",
    )
    p.add_argument(
        "--yes",
        action="store_true",
        help="confirms that --import-config may delete runs, by a lower history limit; --with-mission does not ask",
    )
    p.add_argument(
        "--parameter", action="append", default=[], metavar="NAME=VALUE", help="a parameter of the mission of --run-now"
    )
    return p


def main(arguments: list[str] | None = None) -> int:
    """Returns the exit code: 0 done, 2 bad usage or bad input, 1 anything else; the two latter with one line on stderr."""
    os.umask(0o077)  # what is created is for its owner only
    terminal.use_utf8()
    options = parser().parse_args(arguments)
    try:
        _check(options)
        return _start(options)
    except BadInput as problem:
        return _say(problem, 2)
    except Failure as problem:
        return _say(problem, 1)
    except KeyboardInterrupt:
        return _say("interrupted; what was begun may still be done", 1) if _one_shot(options) else 0
    except Exception as problem:  # the traceback goes to the log file
        from app.process.log_file import log_crash

        return _say(f"unexpected error: {type(problem).__name__}{log_crash(problem)}", 1)


def _say(problem: object, code: int) -> int:
    terminal.print_error(str(problem))
    return code


def _one_shot(options: argparse.Namespace) -> bool:
    return any(
        (
            options.import_config,
            options.export_config,
            options.export_log,
            options.run_now,
            options.check_up,
            options.restore_backup,
            options.remove_pin,
            options.move_here,
            options.clock_is_right,
        )
    )


def _check(options: argparse.Namespace) -> None:
    for name in ("import_config", "export_config", "export_log", "report"):
        if getattr(options, name) == "":  # of a variable that is not set, in a script
            raise BadInput(f"--{name.replace('_', '-')} needs the name of a file")
    if options.parameter and not options.run_now:
        raise BadInput("--parameter belongs to --run-now ROBOT MISSION")
    if options.check_up == "":
        raise BadInput("--check-up needs the name of a robot or a fleet")
    if not options.check_up and (options.with_mission is not None or options.report):
        raise BadInput("--with-mission and --report belong to --check-up ROBOT")
    if options.on_robot and not (options.check_up and options.with_mission):
        raise BadInput("--on-robot belongs to --check-up FLEET --with-mission NAME")
    if options.yes and not (options.import_config or options.with_mission is not None):
        raise BadInput("--yes belongs to --import-config FILE, or to --check-up ROBOT --with-mission")
    if _one_shot(options) and (options.headless or options.demo or options.kiosk):
        raise BadInput("a command that exits can't be combined with --headless, --demo or --kiosk; give it alone")
    if options.headless and options.kiosk:
        raise BadInput("--kiosk needs a window; leave out --headless or --kiosk")


def _start(options: argparse.Namespace) -> int:
    from app.process.data_directory import DataDirectory
    from app.process.host import open_more_files

    open_more_files()
    if options.demo:
        with _demo_directory(options.data_dir) as path, _fleet() as robots:
            return _schedule(options, DataDirectory.prepare(path), robots)
    is_export = bool(options.export_config or options.export_log)
    begins_data = options.import_config or options.restore_backup or not _one_shot(options)
    directory = DataDirectory.prepare(options.data_dir, read_only=is_export, has_data=not begins_data)
    if _one_shot(options):
        from app.process import commands

        return commands.run(options, directory)
    return _schedule(options, directory, None)


def _schedule(options: argparse.Namespace, directory: DataDirectory, robots: DemoFleet | None) -> int:
    if options.headless:
        from app.process.host import run_headless

        return run_headless(directory, demo_robots=robots)
    from app.window.window import run as run_window

    return int(run_window(directory, demo_robots=robots, kiosk=options.kiosk))


@contextlib.contextmanager
def _demo_directory(chosen: Path | None) -> Iterator[Path]:
    if chosen is not None:
        yield chosen
        return
    with tempfile.TemporaryDirectory(prefix="amr-scheduler-demo-", ignore_cleanup_errors=True) as path:
        yield Path(path)


@contextlib.contextmanager
def _fleet() -> Iterator[DemoFleet]:
    """The only place where the app meets the simulator."""
    import mir_sim

    with mir_sim.serve(robots=5, time_scale=1, seed=1) as fleet:
        yield (
            [(robot.name, robot.url) for robot in fleet.robots],
            {mission.name: mission.guid for mission in mir_sim.MISSIONS},
        )


if __name__ == "__main__":
    sys.exit(main())
