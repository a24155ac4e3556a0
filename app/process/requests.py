"""Requests of one-shot commands to the running app, and the answers (transported by app.process.inbox)."""

from __future__ import annotations

import sqlite3
import threading
from collections.abc import Callable, Mapping, Sequence
from concurrent.futures import Future
from functools import partial
from pathlib import Path
from typing import Any, TypeVar
from zoneinfo import ZoneInfo

from app.container import Container
from app.database.fleets import FleetRepository
from app.database.robots import RobotRepository
from app.database.settings import CLOCK_CONFIRMED_AT
from app.database.values import to_text
from app.domain import names
from app.domain.check_up import Level, Topic, Trial
from app.domain.execution import Execution
from app.domain.message import render
from app.domain.models import Fleet, Group, InvalidInput, Mission, Robot
from app.domain.reasons import sentence
from app.failures import BadInput
from app.process.inbox import Handler, withdrawn
from app.services.catalogue import configuration
from app.services.check_up import report as reports
from app.services.check_up.fleet_check_ups import FleetCheckUps
from app.services.check_up.service import CheckUps
from app.services.dispatch.clock_guard import UNPROVEN
from app.services.executions.transitions import NOT_WITH_THE_ROBOT

T = TypeVar("T", bound=Robot | Group | Fleet)

MORE_THAN_A_WINDOW = 1441 * 60.0 + 600.0  # s: the longest start window plus the time for an unknown outcome


def run_now(container: Container, target: str, mission: str, parameters: Mapping[str, Any], token: str) -> Execution:
    """``target``: a robot's name, or a group's. Raises BadInput or InvalidInput."""
    found = find_target(container, target)
    mission_id = find_mission(container, mission, found).id
    start = container.operator.run_now if isinstance(found, Robot) else container.operator.run_on_any
    return start(found.id, mission_id, parameters, token)


def known_start(container: Container, token: str) -> Execution | None:
    """The one that was begun with this token. Raises BadInput where the data was copied from another machine."""
    if (hold := container.holds.active()) is not None and hold.is_copy:
        raise BadInput(f"{hold.reason}: with --move-here this machine starts its missions")
    return container.ledger.by_token(token)


def import_configuration(container: Container, path: str, content: bytes, *, may_delete: bool) -> dict[str, Any]:
    """The answer to ``--import-config``: what was added or changed, one line each. Raises BadInput."""
    before = {robot.id: robot.token for robot in container.catalogue.robots()}
    try:
        lines = configuration.import_configuration(container.catalogue, content, may_delete=may_delete)
    except InvalidInput as error:
        raise BadInput(f"{path}: {error}; nothing was changed") from None
    changes = [render(line) for line in lines]
    if any(before.get(robot.id) not in (None, robot.token) for robot in container.catalogue.robots()):
        changes.append(
            "backups made before still hold the former access tokens: the daily ones for a week, others until they are deleted"
        )
    return {"changes": changes}


def find_target(container: Container, name: str) -> Robot | Group:
    """A robot or a group. Raises BadInput."""
    robots: list[Robot | Group] = [*container.repositories.robots.all(container.db.read())]
    return _named(name, [*robots, *container.catalogue.groups()])


def find_checked(c: sqlite3.Connection, name: str) -> Robot | Fleet:
    """What ``--check-up`` is about: a robot or a fleet, which goes before its robot of the same name. Raises BadInput."""
    targets: list[Robot | Fleet] = [*RobotRepository().all(c), *FleetRepository().all(c)]
    return _named(name, sorted(targets, key=lambda each: isinstance(each, Robot) and each.fleet is not None))


def check_ups_of(container: Container, target: Robot | Fleet) -> CheckUps | FleetCheckUps:
    return container.fleet_check_ups if isinstance(target, Fleet) else container.check_ups


def _named(name: str, robots: Sequence[T]) -> T:
    for each in robots:
        if each.name in (name, names.normal(name)):
            return each
    known = ", ".join(each.name for each in robots) or "none yet"
    raise BadInput(f"there is no robot {name!r}; known: {known}")


def find_mission(container: Container, name: str, robot: Robot | Group) -> Mission:
    """The mission of that name for this robot, else the one for all. Raises BadInput."""
    missions = container.repositories.missions.all(container.db.read())
    own = robot.id if isinstance(robot, Robot) else None
    missions = [m for m in missions if m.robot_id in (None, own)]
    named = [m for m in missions if m.name in (name, names.normal(name))]
    if not named:
        known = ", ".join(sorted({m.name for m in missions})) or "none yet"
        raise BadInput(f"there is no mission {name!r} for {robot.name}; known: {known}")
    return max(named, key=lambda m: m.robot_id is not None)


def outcome(execution: Execution) -> dict[str, Any]:
    """The answer to ``--run-now`` for an execution that is on the robot or has ended."""
    if execution.queue_id is not None:
        chosen = {"robot": execution.robot} if execution.group_id is not None else {}
        return {"queue_id": execution.queue_id, **chosen}
    reason = sentence(execution.reason, execution.timezone) if execution.reason else "it ended without a reason"
    return {
        "exit": 1,
        "error": f"{execution.mission} on {execution.robot or execution.robot_group} was not started: {reason}",
    }


def check_up(
    container: Container, name: str, trial: Trial | None, is_wanted: Callable[[], bool] = lambda: True
) -> dict[str, Any]:
    """The answer to ``--check-up``: the report as text and as a file, and why it is incomplete, if so. Raises
    InvalidInput."""
    target = find_checked(container.db.read(), name)
    report = check_ups_of(container, target).run(target.id, trial, is_wanted=is_wanted)
    zone = container.settings().timezone
    answer = {"text": reports.text(report, zone), "document": reports.document(report, zone)}
    if report.is_complete:
        return answer
    problems = [finding for finding in report.findings if finding.level is not Level.GREEN]
    left = [{"left": render(finding.says)} for finding in problems if finding.topic is Topic.LEFT]
    why = f": {render(problems[-1].says)}" if problems and is_wanted() else ""
    return {
        **answer,
        **(left[0] if left else {}),
        "exit": 1,
        "error": f"the check-up of {report.robot} is not complete{why}",
    }


def clock_now(container: Container) -> dict[str, Any]:
    """What this machine's clock shows, in the plan's zone."""
    zone = container.settings().timezone
    return {"time": f"{container.clock.now().astimezone(ZoneInfo(zone)):%Y-%m-%d %H:%M} ({zone})"}


def keep_clock_confirmation(container: Container) -> dict[str, Any]:
    """No app is running: its next start takes the clock as right, even if robots differ."""
    now, settings = container.clock.now(), container.repositories.settings
    container.db.write(lambda c: settings.put(c, CLOCK_CONFIRMED_AT, to_text(now)))
    return clock_now(container)


class _InBackground:
    """Requests on threads of their own: the scheduler's thread starts nothing while one of them reads, checks or asks a robot."""

    def __init__(self, name: str, work: Callable[[Mapping[str, Any]], Mapping[str, Any]]) -> None:
        self._name, self._work = name, work
        self._begun: dict[str, Future[Mapping[str, Any]]] = {}  # by request

    def take(self, request: Mapping[str, Any]) -> Mapping[str, Any] | None:
        """None until it is done. The same request, repeated, continues it."""
        answer = self._begun.get(request["id"])
        if answer is None:
            self._begun = {
                request["id"]: (answer := Future()),
                **{key: one for key, one in self._begun.items() if not one.done()},
            }
            threading.Thread(target=self._run, args=(request, answer), name=self._name, daemon=True).start()
        return self._begun.pop(request["id"]).result() if answer.done() else None

    def _run(self, request: Mapping[str, Any], answer: Future[Mapping[str, Any]]) -> None:
        try:
            answer.set_result(self._work(request))
        except BaseException as error:
            answer.set_exception(error)


def handlers(container: Container) -> Mapping[str, Handler]:
    run = _InBackground("run now", partial(_begin_run, container))  # a robot may have to be asked for the parameters
    return {
        "import": _InBackground("import", partial(_import, container)).take,
        "check_up": _InBackground("check-up", partial(_check_up, container)).take,
        "run_now": partial(_take_run_now, container, run),
        "remove_pin": lambda _request: {"was_set": container.access.remove()},
        "move_here": lambda _request: {"was_copy": container.tablet.move_here()},
        "clock_is_right": lambda _request: _take_clock_is_right(container),
    }


def _begin_run(container: Container, request: Mapping[str, Any]) -> Mapping[str, Any]:
    run_now(container, request["robot"], request["mission"], request["parameters"], request["token"])
    return {}


def _take_run_now(container: Container, run: _InBackground, request: Mapping[str, Any]) -> Mapping[str, Any] | None:
    """Answered once the robot has accepted it or it has ended: until then the request stays in the inbox."""
    execution = known_start(container, request["token"])
    if execution is None:
        return run.take(request) or None
    return None if execution.state in NOT_WITH_THE_ROBOT else outcome(execution)


def _take_clock_is_right(container: Container) -> Mapping[str, Any] | None:
    """Answered once it is known whether robots agree."""
    problem = container.holds.clock_problem
    if problem == UNPROVEN:
        return None
    if problem is not None:
        container.holds.confirm_clock()
    return {"was_in_doubt": problem is not None, **clock_now(container)}


def _import(container: Container, request: Mapping[str, Any]) -> Mapping[str, Any]:
    file = Path(request["content"])
    content = file.read_bytes()
    file.unlink()
    return import_configuration(container, request["path"], content, may_delete=request["may_delete"])


def _check_up(container: Container, request: Mapping[str, Any]) -> Mapping[str, Any]:
    asked = Path(request["content"]).with_suffix(".request")  # goes with a command that was killed
    trial = Trial(request["mission"], request.get("on_robot", "")) if request["is_tried"] else None
    return check_up(container, request["robot"], trial, lambda: asked.exists() and not withdrawn(asked).exists())
