"""How soon the robot answers, how often it doesn't, and whether it bears as many questions as the app may have."""

from __future__ import annotations

from statistics import median

from app.domain.check_up import Rest
from app.domain.message import message
from app.domain.robot import RobotState, RobotStatus
from app.mir.transport import Timeouts
from app.services.check_up.session import CheckUpSession, Found, amber, green, red

READS_S = 25.0  # that the questions before the measurement take, about
QUESTIONS = 60  # by which the latency is measured, one a second
FEWEST = 5  # of a robot that takes long: enough to judge it
LOAD_S, LOAD_A_SECOND = 10.0, 4  # how long, and how many: more than the app asks at its busiest
BACK_WITHIN = 300.0  # s that a robot which went away is waited for: longer than it boots
SLOW_S, LOST = 1.0, 0.02  # from here on it is reported
LEAST_S = 0.01  # the least that is shown
TOO_SLOW_S = Timeouts().read  # a slower answer counts as none, unless the robot's profile allows for it
QUIET_FACTOR, TIMEOUT_FACTOR = 6, 2  # times the slowest answer
LONGEST_QUIET, LONGEST_TIMEOUT = 600.0, 30.0
LENGTH_S = READS_S + QUESTIONS + LOAD_S  # that reading a robot takes, about
ASKED_LESS = message(
    "The app asks this robot less often from now on. Look for other programs that ask it too: fleet, dashboards, scripts."
)


def latency(session: CheckUpSession) -> Found:
    """With this many questions, one a second; fewer if the robot is slow, so that it does not last much longer."""
    took: list[float] = []
    asked, start = 0, session.clock.monotonic()
    while asked < QUESTIONS and (asked < FEWEST or session.clock.monotonic() - start < QUESTIONS):
        began = session.clock.monotonic()
        session.at(message("Measuring how fast it answers"), READS_S + min(began - start, QUESTIONS))
        asked += 1
        if session.status() is not None:
            took.append(session.clock.monotonic() - began)
        session.clock.sleep(max(0.0, 1.0 - (session.clock.monotonic() - began)))
    lost = asked - len(took)
    session.facts["lost"] = lost / asked
    if not took:
        return red(
            "It answered none of {n} questions",
            "Nothing can be scheduled until it answers: check the radio network where the robot drives.",
            n=asked,
        )
    took.sort()
    session.facts["latency"] = took[0], median(took), took[int(0.95 * (len(took) - 1))], took[-1]
    return _rate(session, asked, lost, median(took), took[-1])


def _rate(session: CheckUpSession, asked: int, lost: int, usual: float, slowest: float) -> Found:
    says = message(
        "{answered} of {n} questions were answered, half of these within {usual} s, the slowest in {slowest} s",
        n=asked,
        answered=asked - lost,
        usual=max(LEAST_S, round(usual, 2)),
        slowest=max(LEAST_S, round(slowest, 2)),
    )
    if slowest > TOO_SLOW_S:
        session.facts["quiet_s"] = min(LONGEST_QUIET, max(90.0, QUIET_FACTOR * slowest))
        session.facts["timeout_s"] = min(LONGEST_TIMEOUT, TIMEOUT_FACTOR * slowest)
        return red(
            says,
            "From now on the app waits up to {timeout} s for it, and {quiet} s before it repeats a start whose "
            "answer was lost. Starts may be late: have the robot's disk and network looked at.",
            timeout=round(session.facts["timeout_s"]),
            quiet=round(session.facts["quiet_s"]),
        )
    if lost > LOST * asked or slowest > SLOW_S:
        return amber(
            says,
            "Starts may be that much late. A start whose answer was lost is sent again only when it certainly did "
            "not arrive. Better radio where the robot drives helps.",
        )
    return green(says)


def load(session: CheckUpSession) -> Found:
    """Ask for ten seconds as often as the app does at its busiest, unless the robot is working. If an answer is
    missing, try again, unless the robot has booted: one gap may be the radio's."""
    before, began = session.status(), session.clock.monotonic()
    if before is None or before.state not in (RobotState.READY, RobotState.PAUSE):
        return amber(
            "Not tried, as it is not ready",
            "Check up again while it stands still: it is then asked 40 times within 10 s.",
        )
    asked, all_answered = _ask_often(session)
    if all_answered:
        return green(
            "It answered {n} questions within {seconds} s", n=asked, seconds=round(session.clock.monotonic() - began)
        )
    back = _come_back(session)
    if back is None:
        return red(
            "It stopped answering when it was asked {n} times within 10 s, and was not back within {minutes} min",
            "Check up again when it answers.",
            n=asked,
            minutes=round(BACK_WITHIN / 60),
        )
    if back.has_booted_since(before.uptime_s):
        session.facts["rest"] = Rest(max(1, asked - 1), LOAD_S)
        return red("It booted when it was asked {n} times within 10 s", ASKED_LESS, n=asked)
    if session.facts.get("lost"):
        return amber(
            "Not found out whether it can answer many questions: it always leaves some unanswered",
            "Check up again where the radio is better.",
        )
    return _again(session, asked)


def _again(session: CheckUpSession, asked: int) -> Found:
    session.clock.sleep(LOAD_S)
    asked_again, all_answered = _ask_often(session)
    if all_answered:
        return amber(
            "It left one of {n} questions within 10 s unanswered, and answered all when it was asked as often again",
            "The network caused that, not the robot. Nothing to do.",
            n=asked,
        )
    asked = max(asked, asked_again)
    session.facts["rest"] = Rest(max(1, asked - 1), LOAD_S)
    return red("It stopped answering when it was asked {n} times within 10 s, twice", ASKED_LESS, n=asked)


def _ask_often(session: CheckUpSession) -> tuple[int, bool]:
    """The number of questions until the first unanswered one, and whether it answered all."""
    began, asked = session.clock.monotonic(), 0
    while asked < LOAD_S * LOAD_A_SECOND and (elapsed := session.clock.monotonic() - began) < LOAD_S:
        session.at(message("Asking as often as the app does at its busiest"), READS_S + QUESTIONS + elapsed)
        asked += 1
        if session.status() is None:
            return asked, False
        session.clock.sleep(max(0.0, began + asked / LOAD_A_SECOND - session.clock.monotonic()))
    return asked, True


def _come_back(session: CheckUpSession) -> RobotStatus | None:
    """Its first status; None: it stays away."""
    began = session.clock.monotonic()
    while session.clock.monotonic() - began < BACK_WITHIN:
        session.at(message("Waiting until it answers again"), READS_S + QUESTIONS)
        session.clock.sleep(1.0)
        if (status := session.status()) is not None:
            return status
    return None
