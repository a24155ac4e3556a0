"""Schedules and when each is due next."""

from __future__ import annotations

import sqlite3
from collections.abc import Mapping, Sequence
from datetime import datetime, time
from typing import Any, NamedTuple

from app.database.table import Table, to_column
from app.database.values import (
    from_json,
    placeholders,
    to_instant,
    to_optional_instant,
    to_optional_text,
    to_text,
)
from app.domain.models import Between, Overlap, Schedule

# Schedules with what is open of them, moved starts included.
OPEN_OF_WHOLE = """current_schedules AS whole JOIN schedules AS part ON part.id = whole.id OR part.moved_of = whole.id
    LEFT JOIN executions INDEXED BY executions_open_of_schedule
        ON schedule_id = part.id AND state IN ('waiting', 'submitting', 'queued', 'executing')"""
_MOVED = "\x1e"  # begins the stored names of moved starts: it can't be typed
Skip = tuple[int, datetime]  # a start skipped in advance: its schedule's id and its instant


class Progress(NamedTuple):
    """How far a schedule has been planned: the next instant, the last one with a row, and the last one sent (None:
    none)."""

    schedule_id: int
    next_at: datetime | None
    planned_through: datetime | None
    started_through: datetime | None


class ScheduleRepository(Table[Schedule]):
    """A moved start has the name of its schedule; stored is one that people can not type, as names are unique."""

    name = "schedules"
    query = """SELECT *, iif(moved_of IS NULL, name, (SELECT name FROM schedules AS whole WHERE whole.id = schedules.moved_of))
               AS shown_name FROM current_schedules AS schedules"""
    columns = (
        "name",
        "robot_id",
        "group_id",
        "mission_id",
        "start",
        "timezone",
        "recurrence",
        "between_start",
        "between_end",
        "enabled",
        "minimum_battery_percent",
        "respect_working_days",
        "start_window_minutes",
        "finish_by_minutes",
        "overlap",
        "priority",
        "parameters",
        "changed_at",
        "next_at",
        "paused_until",
        "planned_through",
        "started_through",
        "moved_of",
        "moved_from",
    )

    @staticmethod
    def read(row: sqlite3.Row) -> Schedule:
        between = None
        if row["between_start"] is not None:
            between = Between(time.fromisoformat(row["between_start"]), time.fromisoformat(row["between_end"]))
        return Schedule(
            name=row["shown_name"],
            robot_id=row["robot_id"],
            group_id=row["group_id"],
            mission_id=row["mission_id"],
            start=datetime.fromisoformat(row["start"]),
            timezone=row["timezone"],
            recurrence=row["recurrence"],
            id=row["id"],
            enabled=bool(row["enabled"]),
            between=between,
            minimum_battery_percent=row["minimum_battery_percent"],
            respect_working_days=bool(row["respect_working_days"]),
            start_window_minutes=row["start_window_minutes"],
            finish_by_minutes=row["finish_by_minutes"],
            overlap=Overlap(row["overlap"]),
            priority=row["priority"],
            parameters=from_json(row["parameters"]),
            changed_at=to_instant(row["changed_at"]),
            next_at=to_optional_instant(row["next_at"]),
            paused_until=to_optional_instant(row["paused_until"]),
            planned_through=to_optional_instant(row["planned_through"]),
            started_through=to_optional_instant(row["started_through"]),
            moved_of=row["moved_of"],
            moved_from=to_optional_instant(row["moved_from"]),
        )

    def values(self, each: Schedule) -> list[object]:
        between = each.between
        found = vars(each) | {
            "name": each.name if each.moved_of is None else f"{_MOVED}{each.moved_of} {each.moved_from}",
            "start": each.start.isoformat(timespec="minutes"),
            "between_start": between and f"{between.start:%H:%M}",
            "between_end": between and f"{between.end:%H:%M}",
        }
        return [to_column(found[column]) for column in self.columns]

    def for_robot(self, c: sqlite3.Connection, robot_id: int) -> list[Schedule]:
        return self.select(c, "WHERE robot_id = ? ORDER BY name", robot_id)

    def for_mission(self, c: sqlite3.Connection, mission_id: int) -> list[Schedule]:
        return self.select(c, "WHERE mission_id = ? ORDER BY name", mission_id)

    def with_unsent(self, c: sqlite3.Connection, mission_id: int | None = None) -> list[Schedule]:
        """Those of this mission, or all, with a start that no robot has yet."""
        return self.select(
            c,
            """WHERE id IN (SELECT schedule_id FROM executions INDEXED BY executions_open_of_schedule
                            WHERE state IN ('waiting', 'submitting', 'queued', 'executing') AND state IN ('waiting', 'submitting'))
               AND mission_id = coalesce(?, mission_id)""",
            mission_id,
        )

    def replace_mission(self, c: sqlite3.Connection, old_id: int, new_id: int, robot_id: int) -> None:
        """Another mission in all schedules of a robot that have this one."""
        c.execute(
            "UPDATE schedules SET mission_id = ? WHERE mission_id = ? AND robot_id = ?", (new_id, old_id, robot_id)
        )

    def due(
        self, c: sqlite3.Connection, now: datetime, lately: datetime | None = None, limit: int = -1, offset: int = 0
    ) -> list[Schedule]:
        """Enabled schedules that are due, all or so many, from an ``offset`` on: those that fell due ``lately`` first,
        in order of time; then the newest, which may still start."""
        since = to_optional_text(lately) or ""
        return self.select(
            c,
            """WHERE enabled = 1 AND next_at IS NOT NULL AND next_at <= ?
                                ORDER BY next_at < ?, iif(next_at < ?, NULL, next_at), next_at DESC, id LIMIT ? OFFSET ?""",
            to_text(now),
            since,
            since,
            limit,
            offset,
        )

    def planned_beyond(self, c: sqlite3.Connection, now: datetime) -> list[Schedule]:
        """Schedules with rows for future instants, and those planned or changed at such a time."""
        return self.select(c, "WHERE planned_through > ? OR changed_at > ?", to_text(now), to_text(now))

    def replan(
        self,
        c: sqlite3.Connection,
        schedule_id: int,
        next_at: datetime | None,
        planned_through: datetime,
        now: datetime,
    ) -> None:
        """It has no more rows of future times."""
        c.execute(
            "UPDATE schedules SET next_at = ?, planned_through = ?, changed_at = min(changed_at, ?) WHERE id = ?",
            (to_optional_text(next_at), to_text(planned_through), to_text(now), schedule_id),
        )

    def changed_between(self, c: sqlite3.Connection, first: datetime, last: datetime) -> list[Schedule]:
        """Both included."""
        return self.select(c, "WHERE changed_at BETWEEN ? AND ?", to_text(first), to_text(last))

    def count_from(self, c: sqlite3.Connection, schedule_id: int, next_at: datetime | None, now: datetime) -> None:
        """As if it had been changed now."""
        c.execute(
            "UPDATE schedules SET next_at = ?, changed_at = ? WHERE id = ?",
            (to_optional_text(next_at), to_text(now), schedule_id),
        )

    def days_changed(self, c: sqlite3.Connection, now: datetime) -> None:
        """Other days are working days since then."""
        c.execute(
            "UPDATE schedules SET changed_at = ? WHERE respect_working_days = 1 AND recurrence IS NOT NULL",
            (to_text(now),),
        )

    # ------------------------------------------------------------------ starts that a person moved
    def moved_starts(self, c: sqlite3.Connection, schedule_id: int) -> list[Schedule]:
        """Of this schedule, each a one-time schedule."""
        return self.select(c, "WHERE moved_of = ?", schedule_id)

    def moved_away(self, c: sqlite3.Connection) -> set[Skip]:
        """All that schedules skip because a person moved them."""
        rows = c.execute("SELECT moved_of, moved_from FROM current_schedules WHERE moved_of IS NOT NULL")
        return {(schedule_id, to_instant(moved_from)) for schedule_id, moved_from in rows}

    def move_original(self, c: sqlite3.Connection, schedule_id: int, old: datetime, new: datetime) -> None:
        """By newer rules its schedule has it at another instant."""
        c.execute(
            "UPDATE schedules SET moved_from = ? WHERE moved_of = ? AND moved_from = ?",
            (to_text(new), schedule_id, to_text(old)),
        )

    def drop_moved(self, c: sqlite3.Connection, id_: int) -> None:
        """A moved start is where its schedule has it again."""
        c.execute("DELETE FROM schedules WHERE id = ? AND moved_of IS NOT NULL", (id_,))

    def purge(self, c: sqlite3.Connection) -> None:
        """Also moved starts that are over."""
        super().purge(c)
        c.execute(
            """DELETE FROM schedules WHERE moved_of IS NOT NULL AND planned_through IS NOT NULL AND next_at IS NULL
                      AND NOT EXISTS (SELECT 1 FROM executions WHERE schedule_id = schedules.id
                                      AND state IN ('waiting', 'submitting', 'queued', 'executing'))"""
        )

    # ------------------------------------------------------------------ starts skipped in advance
    def skip(self, c: sqlite3.Connection, schedule_id: int, instant: datetime) -> None:
        """Unless the schedule is purged."""
        c.execute(
            "INSERT OR REPLACE INTO skips (schedule_id, planned_at) SELECT id, ? FROM schedules WHERE id = ?",
            (to_text(instant), schedule_id),
        )

    def hold(self, c: sqlite3.Connection, schedule_id: int, instant: datetime) -> None:
        """Unless it is skipped, or the schedule is purged."""
        c.execute(
            "INSERT OR IGNORE INTO skips (schedule_id, planned_at, held) SELECT id, ?, 1 FROM schedules WHERE id = ?",
            (to_text(instant), schedule_id),
        )

    def unskip(self, c: sqlite3.Connection, schedule_id: int, instant: datetime) -> None:
        """Remove the skip or the hold of a start."""
        c.execute("DELETE FROM skips WHERE schedule_id = ? AND planned_at = ?", (schedule_id, to_text(instant)))

    def skipped(self, c: sqlite3.Connection, schedule_id: int) -> set[datetime]:
        return {instant for _id, instant in self.skips(c, [schedule_id])}

    def skips(self, c: sqlite3.Connection, schedule_ids: Sequence[int], *, held: bool = False) -> set[Skip]:
        """All starts of these that are skipped, or that are ``held`` when they fall due."""
        rows = c.execute(
            f"""SELECT schedule_id, planned_at FROM skips WHERE schedule_id IN ({placeholders(schedule_ids)}) AND held = ?""",
            (*schedule_ids, held),
        )
        return {(schedule_id, to_instant(planned_at)) for schedule_id, planned_at in rows}

    def skips_from(self, c: sqlite3.Connection, instant: datetime, *, held: bool = False) -> set[Skip]:
        """All starts at that instant or later that are skipped, or ``held``."""
        rows = c.execute(
            "SELECT schedule_id, planned_at FROM skips WHERE planned_at >= ? AND held = ?", (to_text(instant), held)
        )
        return {(schedule_id, to_instant(planned_at)) for schedule_id, planned_at in rows}

    def newest_row(self, c: sqlite3.Connection, schedule_id: int, until: datetime) -> int | None:
        """Id of the execution with its latest planned instant up to then."""
        row = c.execute(
            "SELECT id FROM executions WHERE schedule_id = ? AND planned_at <= ? ORDER BY planned_at DESC LIMIT 1",
            (schedule_id, to_text(until)),
        ).fetchone()
        return int(row[0]) if row else None

    def next_due(self, c: sqlite3.Connection) -> datetime | None:
        """The earliest next occurrence of all robots."""
        return to_optional_instant(
            c.execute(
                "SELECT min(next_at) FROM current_schedules WHERE enabled = 1 AND next_at IS NOT NULL"
            ).fetchone()[0]
        )

    def next_to_run(self, c: sqlite3.Connection, robot_id: int) -> datetime | None:
        """The earliest next instant of a robot that is not skipped by a pause."""
        row = c.execute(
            """SELECT min(next_at) FROM current_schedules WHERE enabled = 1 AND next_at IS NOT NULL AND robot_id = ?
                           AND (paused_until IS NULL OR paused_until <= next_at)""",
            (robot_id,),
        ).fetchone()
        return to_optional_instant(row[0])

    def next_starts(
        self, c: sqlite3.Connection, after: datetime, until: datetime
    ) -> list[tuple[datetime, str, int | None, int | None, int]]:
        """The next start of each schedule, if it is after one instant and not after the other, and no pause skips it: when,
        the mission's name, the ids of its robot and its group, and the priority. In order of time."""
        rows = c.execute(
            """SELECT next_at, missions.name, schedules.robot_id, group_id, priority FROM current_schedules AS schedules
                            JOIN current_missions AS missions ON missions.id = mission_id
                            WHERE enabled = 1 AND next_at > ? AND next_at <= ?
                                AND (paused_until IS NULL OR paused_until <= next_at)
                            ORDER BY next_at, schedules.id""",
            (to_text(after), to_text(until)),
        )
        return [(to_instant(at), *rest) for at, *rest in rows]

    def with_parameters(
        self, c: sqlite3.Connection, robot_id: int, until: datetime
    ) -> list[tuple[str, str, Mapping[str, Any]]]:
        """What a robot starts until then with parameters: the mission's guid and name, and the values as they were
        entered."""
        rows = c.execute(
            """SELECT DISTINCT guid, missions.name, parameters FROM current_schedules AS schedules
                            JOIN current_missions AS missions ON missions.id = mission_id
                            WHERE schedules.robot_id = ? AND enabled = 1 AND next_at <= ? AND parameters <> '{}'""",
            (robot_id, to_text(until)),
        )
        return [(guid, name, from_json(text)) for guid, name, text in rows]

    def next_of_groups(self, c: sqlite3.Connection, robot_id: int, until: datetime) -> dict[tuple[int, ...], int]:
        """Of each group of a robot how many starts are planned by then: by its members that are switched on."""
        rows = c.execute(
            """
            SELECT (SELECT group_concat(id) FROM (
                        SELECT robots.id FROM current_group_members AS other JOIN current_robots AS robots ON robots.id = other.robot_id
                        WHERE other.group_id = schedules.group_id AND robots.enabled ORDER BY robots.id)), count(*)
            FROM current_schedules AS schedules JOIN current_group_members AS group_members ON group_members.group_id = schedules.group_id
            WHERE schedules.enabled = 1 AND next_at <= ? AND group_members.robot_id = ?
                AND (paused_until IS NULL OR paused_until <= next_at) GROUP BY schedules.group_id""",
            (to_text(until), robot_id),
        )
        return {tuple(map(int, members.split(","))): count for members, count in rows if members}

    def robots_due(self, c: sqlite3.Connection, after: datetime, until: datetime) -> set[int]:
        """Ids of robots, also as members of groups, of schedules with an instant after the first and not after the second time."""
        rows = c.execute(
            """SELECT DISTINCT coalesce(schedules.robot_id, group_members.robot_id) FROM current_schedules AS schedules
                            LEFT JOIN current_group_members AS group_members USING (group_id)
                            WHERE enabled = 1 AND next_at > ? AND next_at <= ?""",
            (to_text(after), to_text(until)),
        )
        return {row[0] for row in rows}

    def for_group(self, c: sqlite3.Connection, group_id: int) -> list[Schedule]:
        return self.select(c, "WHERE group_id = ? ORDER BY name", group_id)

    def advance(self, c: sqlite3.Connection, schedule_id: int, next_at: datetime | None) -> None:
        """Store the next instant; None: the schedule has no more."""
        c.execute("UPDATE schedules SET next_at = ? WHERE id = ?", (to_optional_text(next_at), schedule_id))

    def advance_all(self, c: sqlite3.Connection, progress: Sequence[Progress]) -> None:
        """Note how far these have been planned."""
        if progress:
            places = ", ".join("(?, ?, ?, ?)" for _ in progress)
            c.execute(
                f"""WITH progress (id, next_at, planned, started) AS (VALUES {places})
                          UPDATE schedules SET next_at = progress.next_at, planned_through = coalesce(progress.planned, planned_through),
                                               started_through = coalesce(progress.started, started_through)
                          FROM progress WHERE schedules.id = progress.id""",
                [value for each in progress for value in (each.schedule_id, *map(to_optional_text, each[1:]))],
            )

    def note_begun(self, c: sqlite3.Connection, schedule_id: int, instant: datetime) -> None:
        """Something of it may have been sent."""
        c.execute(
            "UPDATE schedules SET started_through = ?2 WHERE id = ?1 AND coalesce(started_through, '') < ?2",
            (schedule_id, to_text(instant)),
        )

    def forget_skips(self, c: sqlite3.Connection, schedule_id: int, through: datetime) -> None:
        """A robot has the start of that instant: skips up to it are no longer needed."""
        c.execute("DELETE FROM skips WHERE schedule_id = ? AND planned_at <= ?", (schedule_id, to_text(through)))

    def pause(self, c: sqlite3.Connection, schedule_id: int, until: datetime | None) -> None:
        """Until when instants are skipped; None: no pause."""
        c.execute("UPDATE schedules SET paused_until = ? WHERE id = ?", (to_optional_text(until), schedule_id))
