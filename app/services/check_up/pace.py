"""How soon the robot answers, how often it doesn't, and whether it bears as many questions as the app may have."""

from __future__ import annotations

from dataclasses import dataclass
from statistics import median

from app.domain.check_up import Rest, Topic
from app.domain.message import message
from app.domain.robot import RobotState, RobotStatus
from app.mir.errors import RobotError
from app.mir.transport import Timeouts
from app.services.check_up.look import Look

MINUTE = 60  # questions, one a second
FEWEST = 5  # of a robot that takes long: enough to judge it
LOAD_S, LOAD_A_SECOND = 10.0, 4  # how long, and how many: more than the app asks at its busiest
BACK_WITHIN = 300.0  # s that a robot which went away is waited for: longer than it boots
SLOW_S, LOST = 1.0, 0.02  # from here on it is reported
LEAST_S = 0.01  # the least that is shown
TOO_SLOW_S = Timeouts().read  # an answer that takes longer is none, unless the robot's profile allows for it
QUIET_FACTOR, TIMEOUT_FACTOR = 6, 2  # times the slowest answer
LONGEST_QUIET, LONGEST_TIMEOUT = 600.0, 30.0
ASKED_LESS = message(
    "The app asks this robot less often from now on. Look for other programs that ask it too: fleet, dashboards, scripts."
)


def measure(look: Look, questions: int, after_s: float, of_s: float) -> None:
    """``questions``: one a second; fewer of a robot that takes longer, so that it does not last much longer."""
    took: list[float] = []
    asked, start = 0, look.probe.clock()
    while asked < questions and (asked < FEWEST or look.probe.clock() - start < questions):
        look.at(message("Measuring how soon it answers"), after_s + min(look.probe.clock() - start, questions), of_s)
        asked += 1
        began = look.probe.clock()
        try:
            look.probe.status()
        except RobotError:
            pass
        else:
            took.append(look.probe.clock() - began)
        look.pause(max(0.0, 1.0 - (look.probe.clock() - began)))
    lost = asked - len(took)
    look.seen["lost"] = lost / asked
    if not took:
        look.red(
            Topic.LATENCY,
            message("It answered none of {n} questions", n=asked),
            message("Nothing can be scheduled before it answers: check the radio network where the robot drives."),
        )
        return
    took.sort()
    slowest = took[-1]
    look.seen["latency"] = took[0], median(took), took[int(0.95 * (len(took) - 1))], slowest
    _judge(look, asked, lost, median(took), slowest)


def _judge(look: Look, questions: int, lost: int, usual: float, slowest: float) -> None:
    says = message(
        "{answered} of {n} questions were answered, half of these within {usual} s, the slowest in {slowest} s",
        n=questions,
        answered=questions - lost,
        usual=max(LEAST_S, round(usual, 2)),
        slowest=max(LEAST_S, round(slowest, 2)),
    )
    if slowest > TOO_SLOW_S:
        look.seen["quiet_s"] = min(LONGEST_QUIET, max(90.0, QUIET_FACTOR * slowest))
        look.seen["timeout_s"] = min(LONGEST_TIMEOUT, TIMEOUT_FACTOR * slowest)
        look.red(
            Topic.LATENCY,
            says,
            message(
                "The app waits up to {timeout} s for it from now on, and {quiet} s before it sends a start "
                "again whose answer was lost. Starts may be late: have the robot's disk and network looked at.",
                timeout=round(look.seen["timeout_s"]),
                quiet=round(look.seen["quiet_s"]),
            ),
        )
    elif lost > LOST * questions or slowest > SLOW_S:
        look.amber(
            Topic.LATENCY,
            says,
            message(
                "Starts may be late by as much, and one whose answer was lost is sent again only after it is certain that it "
                "did not arrive. Better radio where the robot drives helps."
            ),
        )
    else:
        look.green(Topic.LATENCY, says)


def load(look: Look, after_s: float, of_s: float) -> None:
    """Ten seconds of as many questions as the app asks at its busiest, one after the other, unless the robot is at work. Where one is not
    answered it is asked as often once more, unless it has booted: one gap may be of the radio."""
    try:
        before = look.probe.status()
    except RobotError:
        before = None
    if before is None or before.state not in (RobotState.READY, RobotState.PAUSE):
        look.amber(
            Topic.LOAD,
            message("Not tried, as it is not standing ready"),
            message("Check up again while it stands: it is asked 40 times within 10 s then."),
        )
        return
    run = _ask_often(look, after_s, of_s)
    if run.all_answered:
        look.green(
            Topic.LOAD, message("It answered {n} questions within {seconds} s", n=run.asked, seconds=round(run.seconds))
        )
        return
    back = _come_back(look, after_s, of_s)
    if back is None:
        look.red(
            Topic.LOAD,
            message(
                "It stopped answering when it was asked {n} times within 10 s, and was not back within {minutes} min",
                n=run.asked,
                minutes=round(BACK_WITHIN / 60),
            ),
            message("Check up again when it answers."),
        )
    elif back.has_booted_since(before.uptime_s):
        look.seen["rest"] = Rest(max(1, run.asked - 1), LOAD_S)
        look.red(Topic.LOAD, message("It booted when it was asked {n} times within 10 s", n=run.asked), ASKED_LESS)
    elif look.seen.get("lost"):
        look.amber(
            Topic.LOAD,
            message("Not found out whether it bears many questions: it leaves some unanswered at any time"),
            message("Check up again where the radio is better."),
        )
    else:
        _confirm(look, run, after_s, of_s)


def _confirm(look: Look, first: _Run, after_s: float, of_s: float) -> None:
    look.pause(LOAD_S)
    again = _ask_often(look, after_s, of_s)
    if again.all_answered:
        look.amber(
            Topic.LOAD,
            message(
                "It left one of {n} questions within 10 s unanswered, and answered all when it was asked as often "
                "once more",
                n=first.asked,
            ),
            message("That was the network rather than the robot. Nothing to do."),
        )
        return
    asked = max(first.asked, again.asked)
    look.seen["rest"] = Rest(max(1, asked - 1), LOAD_S)
    look.red(
        Topic.LOAD, message("It stopped answering when it was asked {n} times within 10 s, twice", n=asked), ASKED_LESS
    )


@dataclass(frozen=True)
class _Run:
    asked: int
    seconds: float
    all_answered: bool


def _ask_often(look: Look, after_s: float, of_s: float) -> _Run:
    """Until one is not answered."""
    began, asked = look.probe.clock(), 0
    while asked < LOAD_S * LOAD_A_SECOND and look.probe.clock() - began < LOAD_S:
        look.at(message("Asking as often as the app does at its busiest"), after_s + look.probe.clock() - began, of_s)
        asked += 1
        try:
            look.probe.status()
        except RobotError:
            return _Run(asked, look.probe.clock() - began, False)
        look.pause(max(0.0, began + asked / LOAD_A_SECOND - look.probe.clock()))
    return _Run(asked, look.probe.clock() - began, True)


def _come_back(look: Look, after_s: float, of_s: float) -> RobotStatus | None:
    """Its first status; None: it stays away."""
    began = look.probe.clock()
    while look.probe.clock() - began < BACK_WITHIN:
        look.at(message("Waiting until it answers again"), after_s, of_s)
        look.pause(1.0)
        try:
            return look.probe.status()
        except RobotError:
            continue
    return None
