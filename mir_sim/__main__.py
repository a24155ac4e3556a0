"""``python -m mir_sim``: serve simulated robots until interrupted."""

from __future__ import annotations

import argparse
import contextlib
import queue
import secrets
import signal
import ssl
import sys
from collections.abc import Callable, Sequence
from pathlib import Path
from types import FrameType
from typing import NoReturn, TypeVar

from mir_sim import checks
from mir_sim.checks import WrongValue
from mir_sim.definition import SOFTWARE
from mir_sim.fleet import Fleet, make_robots
from mir_sim.fleets import KINDS, make_fleet
from mir_sim.fleets.base import SimulatedFleet
from mir_sim.fleets.knobs import changed
from mir_sim.history import MAX_ITEMS
from mir_sim.profile import DEVIANTS, FAITHFUL, deviant, read
from mir_sim.robot import SimulatedRobot

USAGE_ERROR = 2
SEEDS = 10**9
STOPPING = {"SIGINT", "SIGTERM", "SIGBREAK"}  # the last one is Ctrl-Break of Windows
T = TypeVar("T")


class Parser(argparse.ArgumentParser):
    """Reports a wrong option in one line, without the usage text."""

    def error(self, message: str) -> NoReturn:
        self.exit(USAGE_ERROR, f"{self.prog}: {message}\n")


def _number_from(low: float, high: float, kind: Callable[[str], float]) -> Callable[[str], float]:
    def parse(text: str) -> float:
        try:
            value = kind(text)
        except ValueError:
            value = float("nan")
        if not low <= value <= high:
            raise argparse.ArgumentTypeError(
                f"{text!r} must be a {'whole ' if kind is int else ''}number from {low:g} to {high:g}"
            )
        return value

    return parse


def _checked(check: Callable[[str], T]) -> Callable[[str], T]:
    def parse(text: str) -> T:
        try:
            return check(text)
        except WrongValue as error:
            raise argparse.ArgumentTypeError(str(error)) from None

    return parse


def tls_of(name: str) -> ssl.SSLContext:
    """A server with the certificate of a file. Raises WrongValue."""
    context = ssl.SSLContext(ssl.PROTOCOL_TLS_SERVER)
    try:
        context.load_cert_chain(name)
    except OSError as error:
        raise WrongValue(f"{name} has no certificate with its key: {error.strerror or error}.") from None
    return context


def program() -> str:
    """The name it was started by: installed, or from a checkout."""
    return "mir-sim" if Path(sys.argv[0]).stem == "mir-sim" else "python -m mir_sim"


def parser() -> argparse.ArgumentParser:
    options = Parser(
        prog=program(),
        description="Simulated MiR robots on consecutive ports, with a fleet on request.",
        allow_abbrev=False,
    )
    options.add_argument("--host", default="127.0.0.1", help="address to listen on (default %(default)s)")
    options.add_argument(
        "--port",
        type=_number_from(0, 65535, int),
        default=8080,
        help="port of the fleet or the first robot, 0 = free ones (default %(default)s)",
    )
    options.add_argument(
        "--key",
        default="",
        help="what /sim asks for from other machines, in the header X-Sim-Key (default: a random one)",
    )
    options.add_argument(
        "--certificate",
        type=_checked(tls_of),
        metavar="FILE",
        help="PEM file with a certificate and its key, self-signed or not: serve HTTPS (default: HTTP)",
    )
    options.add_argument("--robots", type=_number_from(1, 500, int), default=3, help="how many (default %(default)s)")
    options.add_argument(
        "--fleet", choices=KINDS, help="a fleet that has these robots, on the first port (default: none)"
    )
    options.add_argument(
        "--knobs",
        type=_checked(lambda name: checks.read_json(Path(name), lambda document: document)),
        default={},
        metavar="FILE",
        help="how the fleet differs from a faithful one",
    )
    options.add_argument(
        "--time-scale", type=_number_from(1, 1000, float), default=1.0, help="simulated seconds per second, 1 to 1000"
    )
    options.add_argument(
        "--seed", type=int, help="decides everything random, serial numbers too (default: a new one each time)"
    )
    options.add_argument("--software", choices=SOFTWARE, help=f"software of the robots (default {FAITHFUL.software})")
    differing = options.add_mutually_exclusive_group()
    differing.add_argument(
        "--profile",
        type=_checked(lambda name: read(Path(name))),
        default=FAITHFUL,
        metavar="FILE",
        help="how the robots differ from faithful ones; the options of software and clock win over it",
    )
    differing.add_argument(
        "--deviant",
        dest="profile",
        type=_checked(deviant),
        metavar="NAME",
        help=f"a profile that is built in: {', '.join(DEVIANTS)}",
    )
    options.add_argument(
        "--chaos",
        type=_number_from(0, 1, float),
        default=0.0,
        metavar="RATE",
        help="share of requests that meet a random fault",
    )
    options.add_argument(
        "--failure-rate",
        type=_number_from(0, 1, float),
        default=0.0,
        metavar="RATE",
        help="share of missions that fail",
    )
    options.add_argument(
        "--history",
        type=_number_from(0, MAX_ITEMS, int),
        default=0,
        metavar="ITEMS",
        help="ended items that each queue begins with, and ended orders of a classic fleet",
    )
    options.add_argument(
        "--timezone",
        type=_checked(lambda name: checks.zone(name, "it")),
        help=f"zone of the robots' clocks (default {FAITHFUL.timezone})",
    )
    options.add_argument(
        "--clock-offset", type=_number_from(-1e6, 1e6, float), metavar="SECONDS", help="error of the robots' clocks"
    )
    options.add_argument(
        "--clock-drift", type=_number_from(-3600, 3600, float), metavar="SECONDS", help="seconds gained per day"
    )
    return options


def machines_of(args: argparse.Namespace, seed: int) -> tuple[list[SimulatedRobot], SimulatedFleet | None]:
    """The robots of the options, and the fleet above them if one is wanted. Ends the program when its knobs are wrong."""
    kind = KINDS.get(args.fleet)
    software = args.software or (kind.robots if kind is not None and args.profile is FAITHFUL else None)
    robots = make_robots(
        args.robots,
        time_scale=args.time_scale,
        seed=seed,
        profile=args.profile,
        software=software,
        chaos=args.chaos,
        failure_rate=args.failure_rate,
        history=args.history,
        timezone=args.timezone,
        clock_offset=args.clock_offset,
        clock_drift=args.clock_drift,
    )
    if kind is None:
        if args.knobs:
            parser().error("--knobs needs --fleet")
        return robots, None
    try:
        knobs = changed(kind.knobs(), args.knobs)
    except WrongValue as error:
        parser().error(f"--knobs: {error}")
    return robots, make_fleet(args.fleet, robots, seed=seed, chaos=args.chaos, history=args.history, knobs=knobs)


def main(arguments: Sequence[str] | None = None) -> int:
    """Serve until SIGINT or SIGTERM. Returns the exit code: 0 done, 2 when a port can't be opened."""
    args = parser().parse_args(arguments)
    last = args.port + args.robots - 1 + (args.fleet is not None)
    if args.port and last > 65535:
        parser().error(f"--port {args.port}: {args.robots} robots need ports up to {last}, the last one is 65535")
    stop: queue.SimpleQueue[int] = (
        queue.SimpleQueue()
    )  # setting an Event can deadlock with the wait that the signal interrupts

    def end(number: int, frame: FrameType | None) -> None:
        stop.put(number)

    for name in STOPPING & set(dir(signal)):
        signal.signal(getattr(signal, name), end)
    seed = secrets.randbelow(SEEDS) if args.seed is None else args.seed
    robots, above = machines_of(args, seed)
    fleet = Fleet(robots, args.host, args.port, args.key, above, args.certificate)
    try:
        fleet.start()
    except OSError as error:
        print(
            f"{program()}: cannot listen on {args.host} port {args.port}: {error.strerror or error}",
            file=sys.stderr,
        )
        return USAGE_ERROR
    if args.seed is None:
        print(f"{program()}: --seed {seed} makes the same robots again", file=sys.stderr, flush=True)
    if not args.key and args.host not in ("127.0.0.1", "::1", "localhost"):
        print(
            f"{program()}: from other machines, /sim asks for the header X-Sim-Key: {fleet.key}",
            file=sys.stderr,
            flush=True,
        )
    for one in ([] if fleet.above is None else [fleet.above]) + fleet.robots:
        print(f"ready {one.name} {one.url}", flush=True)
    while True:  # a signal that arrives just before get() begins does not wake it: hence the timeout
        with contextlib.suppress(queue.Empty):
            stop.get(timeout=1.0)
            break
    fleet.stop()
    return 0


if __name__ == "__main__":
    sys.exit(main())
