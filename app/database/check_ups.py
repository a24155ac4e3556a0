"""Results of check-ups: the last report and profile of each robot, and the changes of a trial under way."""

from __future__ import annotations

import json
import re
import sqlite3
from dataclasses import asdict
from functools import lru_cache
from typing import Any

from app.database.value_checks import decoded
from app.database.values import to_json
from app.domain.check_up import LeftBehind, Report, Rest, RobotProfile
from app.domain.robot import QueueState

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
            report=to_json(asdict(report) | {"profile": None}),
        )

    def left_behind(self, c: sqlite3.Connection) -> dict[int, LeftBehind]:
        """By robot: changes of a trial that are not undone yet."""
        rows = c.execute("SELECT robot_id, left_behind FROM current_check_ups WHERE left_behind IS NOT NULL")
        return {row[0]: _left_behind(row[1]) for row in rows}

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
                left_behind=to_json(asdict(left)),
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
        text = to_json(asdict(report) | {"profile": profile_text(report.profile)})
        c.execute(
            "UPDATE fleets SET report = ?, profile = ? WHERE id = ?", (text, known and profile_text(known), fleet_id)
        )

    def left_on_fleets(self, c: sqlite3.Connection) -> dict[int, LeftBehind]:
        rows = c.execute("SELECT id, left_behind FROM current_fleets WHERE left_behind IS NOT NULL")
        return {row[0]: _left_behind(row[1]) for row in rows}

    def names_left(self, c: sqlite3.Connection) -> list[str]:
        """Of robots and fleets with changes of a trial that are not undone yet."""
        rows = c.execute(
            """SELECT name FROM current_robots WHERE id IN (SELECT robot_id FROM current_check_ups WHERE left_behind IS NOT NULL)
                      UNION ALL SELECT name FROM current_fleets WHERE left_behind IS NOT NULL"""
        )
        return sorted(row[0] for row in rows)

    def note_left_on_fleet(self, c: sqlite3.Connection, fleet_id: int, left: LeftBehind | None) -> None:
        c.execute("UPDATE fleets SET left_behind = ? WHERE id = ?", (left and to_json(asdict(left)), fleet_id))

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
    found: RobotProfile = decoded(RobotProfile, json.loads(text))
    rest = found.rest or Rest(1, 1.0)
    times = (found.lost, found.quiet_s, found.timeout_s, found.ended_shown_s, *(found.latency or ()))
    _require(all(time is None or time >= 0 for time in times) and rest.requests >= 1 and rest.seconds > 0, "a time")
    for number in (found.page_limit, found.order_status):
        _require(number is None or (number >= 0 and number != 1), f"{number}")  # pages of one have no order
    for word, state in found.item_states.items():  # MiR's own words mean what they do
        _require(
            state in (*_STATES.values(), _CANCELLED) and _STATES.get(word.casefold(), state) == state,
            f"item_states {word!r:.40}",
        )
    return found


def profile_text(profile: RobotProfile) -> str:
    """JSON, for ``profile_of``."""
    return to_json(asdict(profile))


def _report(found: Any, profile: str | None) -> Report:
    report: Report = decoded(Report, found, profile=profile_of(profile or ""))
    _require(report.took_s >= 0, f"took_s {report.took_s}")
    return report


def _left_behind(text: str) -> LeftBehind:
    left: LeftBehind = decoded(LeftBehind, json.loads(text))
    _require(
        left.mission is None or re.fullmatch(r"[\w-]+", left.mission, re.ASCII), "mission"
    )  # it goes into addresses
    return left


def _require(condition: object, problem: str) -> None:
    if not condition:
        raise ValueError(problem)
