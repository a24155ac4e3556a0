"""Results of check-ups: the last report and profile of each robot, and the changes of a trial under way."""

from __future__ import annotations

import json
import math
import re
import sqlite3
from collections.abc import Mapping
from dataclasses import asdict, replace
from datetime import UTC, datetime
from functools import lru_cache
from typing import Any

from app.database.value_checks import YEARS
from app.domain.check_up import Finding, LeftBehind, Level, Report, Rest, RobotProfile, Topic
from app.domain.message import Message, is_message
from app.domain.robot import QueueState

LONGEST = 10_000  # characters of a text in a profile
_STATES = {state.value.casefold(): state.value for state in QueueState if state is not QueueState.UNKNOWN}
_CANCELLED = "Cancelled"  # of ``item_states`` as well


class CheckUpRepository:
    def report(self, c: sqlite3.Connection, robot_id: int) -> Report | None:
        """Of the last one."""
        row = c.execute(
            "SELECT report, profile FROM current_check_ups WHERE robot_id = ? AND report IS NOT NULL", (robot_id,)
        ).fetchone()
        return row and _report(json.loads(row[0]), row[1])

    def put(self, c: sqlite3.Connection, robot_id: int, report: Report) -> None:
        """In the place of the one before. A robot that is another machine now gets none."""
        self._put(
            c,
            robot_id,
            "report = excluded.report, profile = excluded.profile",
            report.profile.serial_number,
            profile=profile_text(report.profile),
            report=json.dumps(_without_profile(report)),
        )

    def left_behind(self, c: sqlite3.Connection) -> dict[int, LeftBehind]:
        """By robot: changes of a trial that are not undone yet."""
        rows = c.execute("SELECT robot_id, left_behind FROM current_check_ups WHERE left_behind IS NOT NULL")
        return {row[0]: _left_behind(json.loads(row[1])) for row in rows}

    def note_left_behind(self, c: sqlite3.Connection, robot_id: int, left: LeftBehind | None) -> None:
        """None: everything has been put back."""
        if left is None:
            c.execute("UPDATE check_ups SET left_behind = NULL WHERE robot_id = ?", (robot_id,))
        else:
            self._put(
                c,
                robot_id,
                "left_behind = excluded.left_behind",
                left.serial_number,
                left_behind=_left_text(left),
            )

    def keep_paused(self, c: sqlite3.Connection, robot_id: int) -> None:
        """From now on its pause is a person's."""
        c.execute(
            "UPDATE check_ups SET left_behind = json_set(left_behind, '$.is_paused', json('false')) WHERE robot_id = ? "
            "AND left_behind IS NOT NULL",
            (robot_id,),
        )

    @staticmethod
    def _put(c: sqlite3.Connection, robot_id: int, change: str, serial_number: str | None, **values: str) -> None:
        names = tuple(values)
        c.execute(
            f"""INSERT INTO check_ups (robot_id, {", ".join(names)}) SELECT id, {", ".join("?" for _name in names)} FROM robots
                      WHERE id = ? AND (serial_number IS ? OR serial_number IS NULL) ON CONFLICT DO UPDATE SET {change}""",
            (*values.values(), robot_id, serial_number),
        )

    # ------------------------------------------------------------------ of fleets
    def report_of_fleet(self, c: sqlite3.Connection, fleet_id: int) -> Report | None:
        row = c.execute("SELECT report FROM current_fleets WHERE id = ? AND report IS NOT NULL", (fleet_id,)).fetchone()
        if row is None:
            return None
        found = json.loads(row[0])
        return _report(found, found["profile"])

    def put_of_fleet(self, c: sqlite3.Connection, fleet_id: int, report: Report, known: RobotProfile | None) -> None:
        """``known``: what the app may rely on from now on."""
        text = json.dumps({**_without_profile(report), "profile": profile_text(report.profile)})
        c.execute(
            "UPDATE fleets SET report = ?, profile = ? WHERE id = ?", (text, known and profile_text(known), fleet_id)
        )

    def left_on_fleets(self, c: sqlite3.Connection) -> dict[int, LeftBehind]:
        rows = c.execute("SELECT id, left_behind FROM current_fleets WHERE left_behind IS NOT NULL")
        return {row[0]: _left_behind(json.loads(row[1])) for row in rows}

    def note_left_on_fleet(self, c: sqlite3.Connection, fleet_id: int, left: LeftBehind | None) -> None:
        c.execute("UPDATE fleets SET left_behind = ? WHERE id = ?", (left and _left_text(left), fleet_id))

    def check(self, c: sqlite3.Connection) -> None:
        """Read all of them. Raises ValueError, TypeError or LookupError for one that can't be used."""
        for row in c.execute("SELECT robot_id, profile FROM current_check_ups").fetchall():
            self.report(c, row[0])
            if row[1] is not None:
                profile_of(row[1])
        self.left_behind(c)
        self.left_on_fleets(c)
        for row in c.execute("SELECT id FROM current_fleets").fetchall():
            self.report_of_fleet(c, row[0])


@lru_cache(maxsize=1024)
def profile_of(text: str) -> RobotProfile:
    """Of its JSON. Raises ValueError, TypeError or LookupError."""
    found = _object(json.loads(text))
    latency, rest, ignores = found.pop("latency"), found.pop("rest"), found.pop("ignores")
    for name in ("serial_number", "software", "token_field", "cancelled_message", "timezone", "own_key"):
        _check(found.get(name), str)
    for name in ("has_search", "gives_id", "priority_counts"):
        _check(found[name], bool)
    for name in ("page_limit", "order_status"):
        _check(found[name], int)
        _require(
            found[name] is None or (found[name] >= 0 and found[name] != 1), f"{name} {found[name]}"
        )  # pages of one have no order
    for name in ("clock_offset", "lost", "quiet_s", "timeout_s", "ended_shown_s"):
        value = found.get(name)  # those of earlier versions lack the last one
        found[name] = None if value is None else _finite(value, 0.0 if name != "clock_offset" else -math.inf)
    states = {_text(word): _text(state) for word, state in _object(found.pop("item_states")).items()}
    for word, state in states.items():  # MiR's own words mean what they do
        _require(
            state in (*_STATES.values(), _CANCELLED) and _STATES.get(word.casefold(), state) == state,
            f"item_states {word!r:.40}",
        )
    return RobotProfile(
        **found,
        item_states=states,
        ignores=None if ignores is None else frozenset(map(_text, ignores)),
        latency=None if latency is None else _four(latency),
        rest=None if rest is None else Rest(int(_finite(rest["requests"], 1.0)), _finite(rest["seconds"], 0.001)),
    )


def _report(found: Mapping[str, Any], profile: str | None) -> Report:
    findings = tuple(
        Finding(Topic(each["topic"]), Level(each["level"]), _message(each["says"]), _message(each["means"]))
        for each in found["findings"]
    )
    return Report(
        _text(found["robot"]),
        _text(found["address"]),
        _text(found["model"]),
        _instant(found["began_at"]),
        _finite(found["took_s"]),
        findings,
        profile_of(profile or ""),
        _text(found["mission"]),
        found["is_complete"] is True,
        found.get("of_fleet") is True,  # reports of earlier versions lack it
    )


def _without_profile(report: Report) -> dict[str, Any]:
    return {
        **asdict(replace(report, findings=())),
        "findings": [asdict(each) for each in report.findings],
        "profile": None,
        "began_at": report.began_at.isoformat(),
    }


def profile_text(profile: RobotProfile) -> str:
    """JSON, for ``profile_of``."""
    return json.dumps({**asdict(profile), "ignores": None if profile.ignores is None else sorted(profile.ignores)})


_TIMES_LEFT = ("sent_at", "begins_by")


def _left_text(left: LeftBehind) -> str:
    times = {name: at and at.isoformat() for name in _TIMES_LEFT for at in [getattr(left, name)]}
    return json.dumps({**asdict(left), **times})


def _left_behind(found: Any) -> LeftBehind:
    started, uptime_s = found.get("started"), found.get("uptime_s")  # notes of earlier versions lack them
    vehicle, number = found.get("vehicle", ""), found.get("number")
    sent_at, begins_by = (at and _instant(at) for at in map(found.get, _TIMES_LEFT))
    _check(number, int)
    for value in (found["serial_number"], found["mission"], found["queued"], started):
        _check(value, str)
    _check(found["hold"], int)
    _require(
        found["mission"] is None or re.fullmatch(r"[\w-]+", found["mission"], re.ASCII), "mission"
    )  # it goes into addresses
    return LeftBehind(
        found["serial_number"],
        found["mission"],
        tuple(map(_text, found["tokens"])),
        int(_finite(found["queue_floor"])),
        found["is_paused"] is True,
        found["queued"],
        found["hold"],
        started,
        None if uptime_s is None else _finite(uptime_s),
        _text(vehicle),
        sent_at,
        number,
        tuple(map(int, found.get("holds", ()))),
        begins_by,
    )


def _instant(value: Any) -> datetime:
    found = datetime.fromisoformat(value)
    _require(found.tzinfo is not None and found.year in YEARS, f"instant {found}")
    return found.astimezone(UTC)


def _require(condition: object, problem: str) -> None:
    if not condition:
        raise ValueError(problem)


def _finite(value: Any, least: float = 0.0) -> float:
    number = float(value)
    _require(math.isfinite(number) and number >= least, f"{value!r:.40} is out of range")
    return number


def _object(value: Any) -> dict[str, Any]:
    if not isinstance(value, dict):
        raise TypeError("no JSON object")
    return dict(value)


def _check(value: Any, kind: type) -> None:
    if value is not None and not (isinstance(value, kind) and type(value) is kind):
        raise TypeError(f"{value!r:.40} is no {kind.__name__}")
    if isinstance(value, str) and len(value) > LONGEST:
        raise ValueError("too long a text")


def _text(value: Any) -> str:
    if value is None:
        raise TypeError("no text")
    _check(value, str)
    return str(value)


def _message(value: Any) -> Message:
    if is_message(value):
        return value
    return _text(value)


def _four(value: Any) -> tuple[float, float, float, float]:
    one, two, three, four = map(_finite, value)
    return one, two, three, four
