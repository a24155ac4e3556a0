"""What one-shot commands may ask of the running app, and the answers (app.process.inbox carries them)."""
from __future__ import annotations

import hashlib
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from app.container import Container
from app.domain import names
from app.domain.message import render
from app.domain.models import Execution, InvalidInput, Mission, Robot, State
from app.domain.reasons import sentence
from app.process.inbox import Handler
from app.services.catalogue import configuration

MORE_THAN_A_WINDOW = 1441 * 60.0 + 600.0      # s: the longest start window and what an unknown outcome may take beyond


def find_robot(container: Container, name: str) -> Robot:
    """Raises InvalidInput."""
    by_name, db = container.repositories.robots.by_name, container.db.read()
    robot = by_name(db, name) or by_name(db, names.normal(name))
    if robot is None:
        known = ", ".join(r.name for r in container.repositories.robots.all(container.db.read())) or "none yet"
        raise InvalidInput("robot", "there is no robot {name}; known: {known}", name=repr(name), known=known)
    return robot


def find_mission(container: Container, name: str, robot: Robot) -> Mission:
    """The mission of that name for this robot, else the one for all. Raises InvalidInput."""
    missions = container.repositories.missions.all(container.db.read())
    named = [m for m in missions if m.name in (name, names.normal(name)) and m.robot_id in (None, robot.id)]
    if not named:
        known = ", ".join(sorted({m.name for m in missions})) or "none yet"
        raise InvalidInput("mission", "there is no mission {name} for {robot}; known: {known}",
                           name=repr(name), robot=robot.name, known=known)
    return max(named, key=lambda m: m.robot_id is not None)


def outcome(execution: Execution) -> dict[str, Any]:
    """The answer to ``--run-now`` for an execution that is on the robot or has ended."""
    if execution.queue_id is not None:
        return {"queue_id": execution.queue_id}
    reason = sentence(execution.reason, execution.timezone) if execution.reason else "it ended without a reason"
    return {"exit": 1, "error": f"{execution.mission} on {execution.robot} was not started: {reason}"}


def handlers(container: Container) -> Mapping[str, Handler]:
    def take_import(request: Mapping[str, Any]) -> Mapping[str, Any]:
        path = Path(request["path"])
        if not path.is_file():                   # a pipe or a terminal, which the command has read to its end: more would be waited for
            return {"exit": 2, "error": f"{path} is no plain file, which the running app could read; nothing was changed"}
        try:
            content = path.read_bytes()
        except OSError as error:
            return {"exit": 2, "error": f"the running app can't read {path}: {error.strerror}; nothing was changed"}
        if hashlib.sha256(content).hexdigest() != request["sha256"]:
            return {"exit": 2, "error": f"{path} changed while it was handed over; nothing was changed"}
        try:
            return {"changes": [render(line) for line in configuration.import_configuration(container.catalogue, content)]}
        except InvalidInput as error:
            return {"exit": 2, "error": f"{path}: {error}; nothing was changed"}

    def take_run_now(request: Mapping[str, Any]) -> Mapping[str, Any] | None:
        """Answered once the robot has accepted it or it has ended: until then the request stays in the inbox."""
        if (hold := container.holds.active()) is not None and hold.is_copy:
            return {"exit": 2, "error": f"{hold.reason}: with --move-here this machine starts its missions"}
        execution = container.ledger.by_token(request["token"])
        if execution is None:
            try:
                robot = find_robot(container, request["robot"])
                mission = find_mission(container, request["mission"], robot)
                execution = container.operator.run_now(robot.id, mission.id, request["parameters"], request["token"])
            except InvalidInput as error:
                return {"exit": 2, "error": str(error)}
        return None if execution.state in (State.WAITING, State.SUBMITTING) else outcome(execution)

    def take_remove_pin(_request: Mapping[str, Any]) -> Mapping[str, Any]:
        return {"was_set": container.access.remove()}

    def take_move_here(_request: Mapping[str, Any]) -> Mapping[str, Any]:
        return {"was_copy": container.tablet.move_here()}

    return {"import": take_import, "run_now": take_run_now, "remove_pin": take_remove_pin, "move_here": take_move_here}
