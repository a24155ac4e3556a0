"""Alarms in words: the sentence, the state (active or over, acknowledged or not, shelved), what to do and where. Pure."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from datetime import datetime
from enum import StrEnum
from typing import Any

from app.domain.message import is_message, render
from app.domain.models import Alarm, Priority, Robot, Settings
from app.domain.reasons import at_robot, stored_sentence
from app.i18n import _, ngettext
from app.mir import errors
from app.screens.common import formats
from app.screens.common.robot_texts import Problem, problem_of
from app.services.live.alarms import EVENTS, alarm_sentence


class Act(StrEnum):
    """The actions of buttons at an alarm, a hold or a late start."""

    NOTHING = "nothing"
    GO = "go"  # to another screen
    SCHEDULE_RUN = "schedule_run"  # the story of a schedule's last execution
    HOLD = "hold"  # the late starts
    LATE_STARTS = "late_starts"  # show their list
    RELEASE = "release"  # a hold
    CLOCK_IS_RIGHT = "clock_is_right"  # regardless of the robots' clocks
    TIME_ZONE = "time_zone"  # of the tablet, if it is uncertain
    WHOSE_PLAN = "whose_plan"  # does data that was copied from another tablet move here?


@dataclass(frozen=True)
class Way:
    """A button: its word, its action, and the id of the action's object; of GO what ``Shell.go`` is given."""

    word: str
    act: Act
    about: Any = None


def to_robot(word: str, robot_id: int) -> Way:
    """Select it and go Home."""
    return Way(word, Act.GO, {"screen": "home", "robot_id": robot_id})


def to_settings(**intent: Any) -> Way:
    return Way(_("Open settings"), Act.GO, {"screen": "settings", **intent})


# ---------------------------------------------------------------------- what is the case
def is_shelved(alarm: Alarm, now: datetime) -> bool:
    return alarm.shelved_until is not None and alarm.shelved_until > now


def is_over(alarm: Alarm) -> bool:
    """Whether its cause is over; an event's cause always is."""
    return alarm.cleared_at is not None and alarm.code not in EVENTS


def doubts_clock(alarm: Alarm) -> bool:
    """Whether it says that the tablet's clock can't be right."""
    return alarm.code == "clock_implausible" and not is_over(alarm)


def is_past(alarm: Alarm) -> bool:
    """Over *and* acknowledged."""
    return alarm.cleared_at is not None and alarm.acknowledged_at is not None


def can_be_handled(alarm: Alarm) -> bool:
    """Acknowledged or shelved; the one alarm that can't be written can't be."""
    return alarm.id > 0


def is_unseen(alarm: Alarm) -> bool:
    """Whether a person has yet to acknowledge it."""
    return alarm.acknowledged_at is None and can_be_handled(alarm)


def urgency(alarm: Alarm) -> tuple[bool, bool, float, float]:
    """Unseen alarms before seen ones, lasting before ended ones, an emergency stop before all others, then by priority,
    the newest first."""
    newest = (alarm.last_at or alarm.raised_at).timestamp()
    severity = -1 if alarm.code == "emergency_stop" else list(Priority).index(alarm.priority)
    return alarm.acknowledged_at is not None, is_over(alarm), severity, -newest


# ---------------------------------------------------------------------- texts
# What the problems of silent robots have in common, by the code of their sentence
_CAUSES = {
    "no_answer": "network",
    "no_route": "network",
    "timed_out": "network",
    "too_slow": "network",
    "refused": "refused",
    "unknown_name": "names",
    "slow_name": "names",
}
_CAUSE_OF = {errors.SENTENCES[code]: cause for code, cause in _CAUSES.items()}
# code: what a person does about it
_ADVICE: Mapping[str, Callable[[], str]] = {
    "emergency_stop": lambda: _("Release the red button. Then press Reset on the robot."),
    "robot_error": lambda: _("see the robot on Home"),
    "question": lambda: _("answer it at the robot"),
    "unreachable": lambda: _("Is it switched on?"),
    "unauthorized": lambda: _("enter user name and password again"),
    "not_a_robot": lambda: _("correct its address"),
    "wrong_robot": lambda: _("correct its address, or accept the new robot"),
    "same_machine": lambda: _("correct the wrong address, or remove one of them"),
    "serial_hidden": lambda: _("check at the robot that it is the same one"),
    "certificate_changed": lambda: _("compare it with the robot's own, then trust it in Settings"),
    "certificate_untrusted": lambda: _("compare it with the robot's own, then trust it in Settings"),
    "needs_password": lambda: _("enter it in Settings"),
    "clock_implausible": lambda: _("set the tablet's clock, or say that it is right"),
    "database": lambda: _("check the tablet's disk"),
    "duplicate_running": lambda: _("cancel one of the two"),
    "started_twice": lambda: _("cancel those that have not run and are not needed"),
    "unmarked_copy": lambda: _("if it is not needed, cancel it"),
    "robot_fails": lambda: _("see what stops it"),
    "check_up_outdated": lambda: _("check it up in its settings"),
    "check_up_left": lambda: _("look at the robot"),
    "two_tablets": lambda: _("switch the other tablet off, then release the hold"),
    "lock_lost": lambda: _("see that only one app runs on this data, and start it again"),
    "too_few_files": lambda: _("raise the limit (ulimit -n, or LimitNOFILE of the service) and start the app again"),
    "zone_guessed": lambda: _("choose the zone that the robots and the tablet are in"),
    "zone_unknown": lambda: _("look at its times, then switch it on again"),
    "network_lost": lambda: _("Is its Wi-Fi on? Is the access point on?"),
    "tablet_battery_low": lambda: _("connect its charger: without power nothing starts"),
    "disk_nearly_full": lambda: _("delete files, or keep fewer runs: on a full disk nothing starts"),
    "clock_not_synchronised": lambda: _("connect it to one: a drifting clock starts missions early or late"),
    "pin_guessed": lambda: _("enter the right PIN to end this"),
    "unknown_outcome": lambda: _("look for it in the queue before starting it again"),
}


def message_id(text: object) -> str:
    return str(text["msgid"]) if is_message(text) else ""


def silence(alarm: Alarm) -> str:
    """Why a robot can't be reached: "network", "refused" or "names"; empty if unknown."""
    return _CAUSE_OF.get(message_id(alarm.details.get("problem")), "")


def short_words(alarm: Alarm) -> str:
    """What is the matter with a robot, where its name stands in front of it; empty where only the whole sentence says it."""
    if not alarm.details.get("robot"):
        return ""
    match alarm.code:
        case "emergency_stop":
            return _("emergency stop")
        case "unreachable":
            return _("no answer")
        case "unauthorized":
            return _("wrong password")
        case "wrong_robot" if alarm.details.get("fleet"):
            return _("another fleet answers")
        case "wrong_robot" if not is_message(alarm.details.get("found")):
            return _("another robot answers")
        case "robot_error":
            problem = _problem(alarm)
            return problem.words or problem.quote
        case "question":
            return _("asks: {question}").format(question=render(alarm.details.get("question"), _))
        case "execution_failed" if alarm.details.get("mission"):
            return _("{mission} failed").format(mission=alarm.details["mission"])
        case "execution_skipped" if alarm.details.get("mission"):
            return _("{mission} was not run").format(mission=alarm.details["mission"])
    return ""


def _problem(alarm: Alarm) -> Problem:
    """What a robot says is wrong, in the words that Home has for it."""
    return problem_of(render(alarm.details.get("problem"), _))


def alarm_text(alarm: Alarm, settings: Settings, now: datetime) -> str:
    """One sentence in the operator's language, instants in the zone of the settings."""
    details = {name: _readable(value, settings, now) for name, value in alarm.details.items()}
    return alarm_sentence(replace(alarm, details=details), _)


def _readable(value: Any, settings: Settings, now: datetime) -> Any:
    """Instants are kept as ISO text in details; people want the time of their zone."""
    if not isinstance(value, str) or "T" not in value:
        return value
    try:
        return formats.day_and_time(datetime.fromisoformat(value), settings.timezone, now)
    except ValueError:
        return value


def alarm_note(alarm: Alarm, settings: Settings, now: datetime) -> str:
    """Until when it is shelved, since when it is over, how often, what to do, and when it was acknowledged."""
    parts = [reason_of(alarm, settings)]
    if is_shelved(alarm, now):
        parts.append(_("Shelved until {time}").format(time=_time(alarm.shelved_until, settings, now)))
    if is_over(alarm):
        parts.append(_("Over since {time}").format(time=_time(alarm.cleared_at, settings, now)))
    if alarm.count > 1:
        times = (
            ngettext("{n} time, last {time}", "{n} times, last {time}", alarm.count)
            if alarm.last_at
            else ngettext("{n} time", "{n} times", alarm.count)
        )
        parts.append(times.format(n=alarm.count, time=_time(alarm.last_at, settings, now)))
    if alarm.code == "question" and is_over(alarm):
        parts.append(_answered(alarm))
    elif not is_past(alarm) and not is_over(alarm) and alarm.code in _ADVICE:
        parts.append(advice_of(alarm))
    return " · ".join(filter(None, (*parts, seen_words(alarm, settings, now))))


def reason_of(alarm: Alarm, settings: Settings) -> str:
    """Why a run ended, in the words for the robot's own ones; empty for other alarms."""
    reason = alarm.details.get("reason")
    if not isinstance(reason, Mapping):
        return ""
    if isinstance(details := reason.get("details"), Mapping):
        reason = {**reason, "details": at_robot(details, str(alarm.details.get("robot") or ""))}
    sentence = stored_sentence(reason, settings.timezone, _)
    return problem_of(sentence).words or sentence


def seen_words(alarm: Alarm, settings: Settings, now: datetime) -> str:
    """When it was acknowledged, and the note."""
    if alarm.acknowledged_at is None:
        return ""
    time = _time(alarm.acknowledged_at, settings, now)
    return (_("Seen {time}: “{note}”") if alarm.note else _("Seen {time}")).format(time=time, note=alarm.note)


def _time(instant: datetime | None, settings: Settings, now: datetime) -> str:
    return formats.day_and_time(instant, settings.timezone, now)


def advice_of(alarm: Alarm) -> str:
    """What to do. A robot that answers for another can't be accepted instead."""
    problem, found = alarm.details.get("problem"), alarm.details.get("found")
    if alarm.code == "question" and (answers := answers_of(alarm)):
        return _("answers: {answers}").format(answers=" / ".join(answers))
    if alarm.code == "unreachable" and alarm.details.get("fleet"):
        return _("Is the fleet's server on?")
    if alarm.code == "wrong_robot" and alarm.details.get("fleet"):
        return _("correct its address")
    if alarm.code == "unreachable" and silence(alarm) in ("refused", "names"):
        return render(problem, _)
    if alarm.code == "robot_error" and (known := _problem(alarm)).words:
        return " ".join(filter(None, (known.step, f"“{known.quote}”")))
    if alarm.code == "wrong_robot" and is_message(found):
        return _("correct the addresses")
    return _ADVICE[alarm.code]()


def _answered(alarm: Alarm) -> str:
    """How a question ended."""
    answer = alarm.details.get("answer")
    return (
        _("answered: {answer}").format(answer=answer) if isinstance(answer, str) and answer else _("not answered here")
    )


def answers_of(alarm: Alarm) -> list[str]:
    """Of a robot's question, those that can be given here."""
    answers = alarm.details.get("answers")
    return [str(answer) for answer in answers] if isinstance(answers, list) else []


def alarm_tone(alarm: Alarm) -> str:
    """Red only for high priority while it lasts, or until it is acknowledged; blue for a question."""
    if is_over(alarm) or is_past(alarm):
        return "neutral"
    if alarm.code == "question":
        return "action"
    return "fault" if alarm.priority is Priority.HIGH else "attention"


_ICONS = {
    "question": "comment-question",
    "robot_error": "alert-circle",
    "unreachable": "wifi-off",
    "unauthorized": "account-lock-outline",
    "network_lost": "wifi-off",
    "tablet_battery_low": "battery-alert",
    "disk_nearly_full": "harddisk",
    "clock_not_synchronised": "clock-alert-outline",
}


def alarm_icon(alarm: Alarm) -> str:
    if is_over(alarm) or is_past(alarm):
        return "check-circle-outline"
    return _ICONS.get(alarm.code) or ("alert-octagon" if alarm.priority is Priority.HIGH else "alert")


# ---------------------------------------------------------------------- what can be done
_OF_THE_CONFIGURATION = (
    "unauthorized",
    "not_a_robot",
    "wrong_robot",
    "same_machine",
    "serial_hidden",
    "certificate_changed",
    "certificate_untrusted",
    "needs_password",
    "check_up_outdated",
)
_OF_THE_TABLET = (
    "app_was_off",
    "backup_restored",
    "clock_stepped",
    "two_tablets",
    "chore_failed",
    "pin_guessed",
    "lock_lost",
    "too_few_files",
    "zone_unknown",
    "network_lost",
    "tablet_battery_low",
    "clock_not_synchronised",
)
_OF_THE_DISK = ("database", "backup_failed", "disk_nearly_full")
_OF_THE_PLAN = (
    "execution_failed",
    "start_refused",
    "execution_skipped",
    "executions_missed",
    "unknown_outcome",
    "duplicate_healed",
    "late_cancelled",
    "adopted_unproven",
    "item_unreadable",
)


def id_in(key: str, wanted: str) -> int | None:
    kind, _colon, number = key.partition(":")
    return int(number) if kind == wanted and number.isdecimal() else None


def way_to(alarm: Alarm, robots: Mapping[int, Robot]) -> Way | None:
    """The way to its solution or full description. None if there is nothing more to see: "the tablet was off" can't be
    changed in the app, and an ended alarm needs no solution."""
    if is_over(alarm):
        return None
    if alarm.code == "clock_implausible":
        return Way(_("Decide"), Act.CLOCK_IS_RIGHT)
    if alarm.code == "zone_guessed":
        return Way(_("Choose the time zone"), Act.TIME_ZONE)
    if alarm.code in _OF_THE_TABLET:
        return None
    if alarm.code in _OF_THE_DISK:
        return to_settings(section="data")
    if alarm.code in _OF_THE_PLAN:
        if (execution_id := id_in(alarm.key, "execution")) is not None:
            return Way(_("Show"), Act.GO, {"screen": "logs", "execution_id": execution_id})
        if (schedule_id := id_in(alarm.key, "schedule")) is not None:
            return Way(_("Show"), Act.SCHEDULE_RUN, schedule_id)
        return Way(_("Show"), Act.GO, {"screen": "logs", "unfiltered": True})
    robot = next((robot for robot in robots.values() if robot.name == alarm.details.get("robot")), None)
    if robot is None:
        return None
    if alarm.code in _OF_THE_CONFIGURATION:
        return to_settings(section="robots", robot_id=robot.id)
    return to_robot(_("Answer") if answers_of(alarm) else _("Show"), robot.id)


def past_count(shown: int, total: int) -> str:
    """How many of the past ones are in sight."""
    if shown < total:
        return _("The newest {n} of {total}").format(n=formats.count(shown), total=formats.count(total))
    return ngettext("{n} past alarm", "{n} past alarms", total).format(n=formats.count(total))


def bell(new: int, still_open: int, shelved: int) -> tuple[str, str]:
    """Icon and number of the bell in the top bar: how many alarms are new."""
    if new:
        return "bell-ring-outline", str(new)
    return ("bell-outline" if still_open or not shelved else "bell-sleep-outline"), ""
