"""The interface /sim, which real robots don't have: shows the model's state and makes things happen.

It needs no credentials on this machine, a key from any other one, and refuses requests of web pages.
"""

from __future__ import annotations

import hmac
import json
from collections.abc import Callable
from functools import singledispatch
from ipaddress import ip_address
from typing import Any

from mir_sim import checks
from mir_sim.checks import WrongValue
from mir_sim.faults import Fault, FaultKind
from mir_sim.floor_plan import live_view
from mir_sim.machine import Machine
from mir_sim.messages import Request, Response
from mir_sim.robot import SimulatedRobot
from mir_sim.state import RobotError

PATH, MAP_PATH = "/sim", "/sim/map.png"
KEY_HEADER = "X-Sim-Key"
Action = Callable[[Any], object]  # gets the machine
Commands = dict[str, Callable[[Any], Action]]  # by name: turns the value into what is to happen, or raises WrongValue


def refusal(request: Request, peer: str, key: str) -> Response | None:
    """The answer to a request for /sim that may not be handled; None if it may. ``peer`` is the address it comes from."""
    if request.path.rstrip("/") not in (PATH, MAP_PATH):
        return None
    if "origin" in request.headers:  # only browsers send it: any open page could move the robots
        return _refusal(403, "Requests of web pages are refused.")
    sent = request.headers.get(KEY_HEADER.lower(), "")
    if not _is_here(peer) and not hmac.compare_digest(sent.encode(), key.encode()):
        return _refusal(
            401, f"From another machine the header {KEY_HEADER} needs the key that was printed at the start."
        )
    return None


def _is_here(peer: str) -> bool:
    try:
        address = ip_address(peer.partition("%")[0])
    except ValueError:
        return False
    mapped = getattr(address, "ipv4_mapped", None)
    return (mapped or address).is_loopback


def control(machine: Machine, request: Request) -> Response:
    """Answer GET and POST /sim, and of robots GET /sim/map.png."""
    if request.path == MAP_PATH:
        if not isinstance(machine, SimulatedRobot):
            return _refusal(404, "Only robots have a map.")
        return Response(200, {"Content-Type": "image/png"}, live_view(machine.pose))
    if request.method == "GET":
        return Response.json_of(200, machine.snapshot())
    if request.method != "POST":
        return _refusal(405, "Only GET and POST are possible here.")
    try:
        commands = json.loads(request.body)
    except (ValueError, RecursionError):
        return _refusal(400, "The body is not JSON.")
    try:
        apply(machine, commands)
    except WrongValue as error:
        return _refusal(400, str(error))
    return Response.json_of(200, machine.snapshot())


def _refusal(status: int, sentence: str) -> Response:
    code = {400: "bad_request", 401: "unauthorized", 403: "forbidden", 404: "not_found", 405: "method_not_allowed"}[
        status
    ]
    return Response.json_of(status, {"error_code": code, "error_human": sentence})


def apply(machine: Machine, commands: Any) -> None:
    """Execute the commands of a POST: all of them, or none when any is wrong.

    Args:
        commands: parsed JSON, to be an object of command names and their values.

    Raises:
        WrongValue: says what is wrong.
    """
    if not isinstance(commands, dict) or not commands:
        raise WrongValue("The body must be an object with at least one command.")
    known = commands_of(machine)
    for name in commands:
        if name not in known:
            raise WrongValue(f"There is no command {name!r}; known are {', '.join(known)}.")
    actions = [known[name](value) for name, value in commands.items()]
    with machine.lock:
        machine.catch_up()
        for action in actions:
            action(machine)


def _battery(value: Any) -> Action:
    percent = checks.number(value, "battery", 0, 100)
    return lambda robot: robot.set_battery(percent)


def _emergency_stop(value: Any) -> Action:
    pressed = checks.boolean(value, "emergency_stop")
    return lambda robot: robot.press_emergency_stop(pressed)


def _error(value: Any) -> Action:
    if value is None:
        return lambda robot: robot.remove_error_causes()
    if not isinstance(value, dict) or isinstance(value.get("code"), bool) or not isinstance(value.get("code"), int):
        raise WrongValue('error must be null or an object with an integer "code" and a "description".')
    description = checks.text(value.get("description"), "error.description")
    error = RobotError(
        value["code"], description, str(value.get("module", "MissionController")), value.get("non_resettable") is True
    )
    return lambda robot: robot.raise_error(error, lasting=True)


def _fail_next(value: Any) -> Action:
    text = None if value is None else checks.text(value, "fail_next_mission")
    return lambda robot: setattr(robot, "fail_next", text)


def _reboot(value: Any) -> Action:
    seconds = checks.number(value, "reboot_seconds", 0, 3600)
    return lambda machine: machine.reboot(seconds)


def _user_prompt(value: Any) -> Action:
    if value is None:
        return lambda robot: robot.withdraw_prompt(robot.prompt.guid) if robot.prompt else None
    if not isinstance(value, dict):
        raise WrongValue("user_prompt must be null or an object with question, options and timeout.")
    question = checks.text(value.get("question"), "user_prompt.question")
    options = value.get("options", ["Yes", "No"])
    if not isinstance(options, list) or not all(isinstance(option, str) for option in options):
        raise WrongValue("user_prompt.options must be a list of texts.")
    timeout = checks.number(value.get("timeout", 60), "user_prompt.timeout", 0)
    return lambda robot: robot.ask(question, options, timeout, expires=robot.in_real(timeout), blocks=True)


def _fault(value: Any) -> Action:
    if value is None:
        return lambda machine: machine.faults.clear()
    if not isinstance(value, dict) or value.get("kind") not in set(FaultKind):
        raise WrongValue(f"fault must be null or an object whose kind is one of {', '.join(FaultKind)}.")
    unknown = set(value) - {"kind", "method", "path", "count", "seconds"}
    if unknown:
        raise WrongValue(f"A fault has no {', '.join(sorted(unknown))}.")
    count = value.get("count", 1)
    if count is not None and (isinstance(count, bool) or not isinstance(count, int) or count < 1):
        raise WrongValue("fault.count must be null or a whole number above 0.")
    path = checks.text(value.get("path", "*"), "fault.path")
    if path != "*" and not path.startswith("/"):
        raise WrongValue('fault.path must be "*" or begin with a slash.')
    seconds = checks.number(value.get("seconds", 5), "fault.seconds", 0)
    kind, method = FaultKind(value["kind"]), checks.text(value.get("method", "*"), "fault.method").upper()
    return lambda machine: machine.faults.add(Fault(kind, path.rstrip("/") or "/", method, count, seconds))


SHARED: Commands = {"reboot_seconds": _reboot, "fault": _fault}
COMMANDS: Commands = {
    "battery": _battery,
    "emergency_stop": _emergency_stop,
    "error": _error,
    "fail_next_mission": _fail_next,
    "user_prompt": _user_prompt,
    **SHARED,
}


@singledispatch
def commands_of(machine: Machine) -> Commands:
    """The commands of a kind of machine; each kind registers its own."""
    return SHARED


@commands_of.register
def _(robot: SimulatedRobot) -> Commands:
    return COMMANDS
