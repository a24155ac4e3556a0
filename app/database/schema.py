"""The tables, as a list of migrations. ``PRAGMA user_version`` counts how many have been applied; a shipped one is never edited.

Instants are UTC text ``YYYY-MM-DDTHH:MM:SS.ffffffZ`` (fixed width, so text order is time order); JSON columns hold objects.
AUTOINCREMENT, because the id of a deleted schedule must never come back: the tokens of its executions are made of it.
"""

from __future__ import annotations

import sqlite3

from app.database.schema_figures import _FIGURES
from app.database.schema_groups import (
    _BEGUN,
    _CHECK_UPS_OF_FLEETS,
    _DRAIN,
    _FAILURES,
    _FLEETS,
    _GROUPS,
    _LAST_MISSION,
    _MISSION_PARAMETERS,
    _RUN_DURATIONS,
    _SKIPPED_AHEAD,
    _STARTS,
    _SUGGESTIONS_AND_GROUP_FIGURES,
    _WAYS,
)

APPLICATION_ID = 0x414D5253  # "AMRS": how a file is known to be ours

_FIRST = """
CREATE TABLE settings (
    name  TEXT PRIMARY KEY,
    value TEXT NOT NULL                       -- JSON
) STRICT, WITHOUT ROWID;

CREATE TABLE robots (
    id                 INTEGER PRIMARY KEY AUTOINCREMENT,
    name               TEXT NOT NULL UNIQUE,
    address            TEXT NOT NULL,
    username           TEXT NOT NULL DEFAULT '',
    token              TEXT,                  -- Authorization header value: the one place where it is kept
    certificate_sha256 TEXT,
    enabled            INTEGER NOT NULL DEFAULT 1,
    needs_password     INTEGER NOT NULL DEFAULT 0,
    serial_number      TEXT,
    model              TEXT,
    software           TEXT
) STRICT;

CREATE TABLE missions (
    id        INTEGER PRIMARY KEY AUTOINCREMENT,
    name      TEXT NOT NULL,
    guid      TEXT NOT NULL,
    robot_id  INTEGER REFERENCES robots(id) ON DELETE CASCADE,
    favourite INTEGER NOT NULL DEFAULT 0
) STRICT;
CREATE UNIQUE INDEX missions_identity ON missions (name, coalesce(robot_id, 0));

CREATE TABLE idle_rules (
    robot_id      INTEGER PRIMARY KEY REFERENCES robots(id) ON DELETE CASCADE,
    mission_id    INTEGER NOT NULL REFERENCES missions(id) ON DELETE CASCADE,
    after_minutes INTEGER NOT NULL,
    enabled       INTEGER NOT NULL DEFAULT 1
) STRICT;

CREATE TABLE schedules (
    id                      INTEGER PRIMARY KEY AUTOINCREMENT,
    name                    TEXT NOT NULL UNIQUE,
    robot_id                INTEGER NOT NULL REFERENCES robots(id) ON DELETE CASCADE,
    mission_id              INTEGER NOT NULL REFERENCES missions(id) ON DELETE CASCADE,
    start                   TEXT NOT NULL,    -- naive local YYYY-MM-DDTHH:MM
    timezone                TEXT NOT NULL,
    recurrence              TEXT,
    between_start           TEXT,             -- HH:MM
    between_end             TEXT,
    enabled                 INTEGER NOT NULL DEFAULT 1,
    minimum_battery_percent REAL,
    respect_working_days    INTEGER NOT NULL DEFAULT 1,
    start_window_minutes    INTEGER,
    overlap                 TEXT NOT NULL DEFAULT 'skip',
    priority                INTEGER NOT NULL DEFAULT 0,
    parameters              TEXT NOT NULL DEFAULT '{}',
    changed_at              TEXT NOT NULL,
    next_at                 TEXT,
    paused_until            TEXT
) STRICT;
CREATE INDEX schedules_due ON schedules (next_at) WHERE enabled = 1 AND next_at IS NOT NULL;
CREATE INDEX schedules_by_robot ON schedules (robot_id);

CREATE TABLE executions (
    id                      INTEGER PRIMARY KEY AUTOINCREMENT,
    trigger                 TEXT NOT NULL,
    schedule_id             INTEGER,          -- no foreign key: history outlives its schedule and its robot
    schedule                TEXT NOT NULL DEFAULT '',
    robot_id                INTEGER,
    robot                   TEXT NOT NULL,
    mission                 TEXT NOT NULL,
    mission_guid            TEXT NOT NULL,
    parameters              TEXT NOT NULL DEFAULT '{}',
    priority                INTEGER NOT NULL DEFAULT 0,
    minimum_battery_percent REAL,
    timezone                TEXT NOT NULL,
    token                   TEXT NOT NULL UNIQUE,
    state                   TEXT NOT NULL,
    reason_code             TEXT,
    reason_details          TEXT NOT NULL DEFAULT '{}',
    wait                    TEXT NOT NULL DEFAULT 'due',
    wait_details            TEXT NOT NULL DEFAULT '{}',
    hold_until              TEXT,
    planned_at              TEXT NOT NULL,
    closes_at               TEXT NOT NULL,
    created_at              TEXT NOT NULL,
    attempts                INTEGER NOT NULL DEFAULT 0,
    queue_floor             INTEGER,
    queue_id                INTEGER,
    cancel_code             TEXT,
    submitted_at            TEXT,
    started_at              TEXT,
    ended_at                TEXT,
    duration_s              REAL,
    robot_delay_s           REAL,
    UNIQUE (schedule_id, planned_at)
) STRICT;
CREATE INDEX executions_open ON executions (robot_id, state) WHERE state IN ('waiting', 'submitting', 'queued', 'executing');
CREATE INDEX executions_open_of_schedule ON executions (schedule_id) WHERE state IN ('waiting', 'submitting', 'queued', 'executing');
CREATE INDEX executions_idle ON executions (robot_id, id) WHERE trigger = 'idle';
CREATE INDEX executions_planned ON executions (planned_at, id);
CREATE INDEX executions_by_mission ON executions (robot_id, mission_guid, ended_at) WHERE state = 'completed';
-- the ground of the KPIs: each answers its question from the index alone
CREATE INDEX executions_by_day ON executions (ended_at, id, robot_id, state, duration_s) WHERE ended_at IS NOT NULL;
CREATE INDEX executions_by_robot ON executions (robot_id, state, ended_at, duration_s) WHERE ended_at IS NOT NULL;
CREATE INDEX executions_by_outcome ON executions (state, reason_code, ended_at, robot_id)
    WHERE ended_at IS NOT NULL AND trigger = 'scheduled';

CREATE TABLE observed (                       -- for how long each robot was watched, per day: the ground of utilisation
    robot_id INTEGER NOT NULL,
    day      TEXT NOT NULL,                   -- YYYY-MM-DD in settings.timezone
    activity TEXT NOT NULL,                   -- executing, idle, charging, paused, error, offline
    seconds  REAL NOT NULL DEFAULT 0,
    PRIMARY KEY (robot_id, day, activity)
) STRICT, WITHOUT ROWID;

CREATE TABLE alarms (
    id              INTEGER PRIMARY KEY AUTOINCREMENT,
    code            TEXT NOT NULL,
    key             TEXT NOT NULL,
    priority        TEXT NOT NULL,
    details         TEXT NOT NULL DEFAULT '{}',
    raised_at       TEXT NOT NULL,
    last_at         TEXT NOT NULL,
    count           INTEGER NOT NULL DEFAULT 1,
    cleared_at      TEXT,
    acknowledged_at TEXT,
    note            TEXT NOT NULL DEFAULT '',
    shelved_until   TEXT
) STRICT;
CREATE UNIQUE INDEX alarms_standing ON alarms (code, key) WHERE cleared_at IS NULL OR acknowledged_at IS NULL;

CREATE TABLE holds (                          -- nothing (or one robot) is sent until the hold ends
    id         INTEGER PRIMARY KEY AUTOINCREMENT,
    robot_id   INTEGER REFERENCES robots(id) ON DELETE CASCADE,   -- NULL = all robots
    reason     TEXT NOT NULL DEFAULT '',
    started_at TEXT NOT NULL,
    until      TEXT
) STRICT;
"""

_EXCEPTION_CALENDAR = """
CREATE TABLE calendar_days (                  -- where the weekly rule of working days does not hold
    id         INTEGER PRIMARY KEY AUTOINCREMENT,
    name       TEXT NOT NULL,
    first_day  TEXT NOT NULL,                 -- local YYYY-MM-DD, both ends included
    last_day   TEXT NOT NULL,
    is_working INTEGER NOT NULL,              -- 0 closed, 1 extra working days
    yearly     INTEGER NOT NULL DEFAULT 0,
    source     TEXT NOT NULL DEFAULT ''       -- the file they came with
) STRICT;
"""

_KPI_INDEXES = """
-- durations of a mission, and what a run waited for, from the index alone
DROP INDEX executions_by_mission;
CREATE INDEX executions_by_mission ON executions (robot_id, mission_guid, ended_at, duration_s) WHERE state = 'completed';
CREATE INDEX executions_timings ON executions (ended_at, robot_id, planned_at, submitted_at, robot_delay_s, duration_s)
    WHERE trigger = 'scheduled' AND submitted_at IS NOT NULL AND robot_delay_s IS NOT NULL;
"""

_ACTIVITY_SPANS = """
CREATE TABLE activity_spans (                 -- what each robot was seen doing: the ground of its timeline
    robot_id   INTEGER NOT NULL,
    started_at TEXT NOT NULL,
    ended_at   TEXT NOT NULL,
    activity   TEXT NOT NULL,                 -- executing, idle, charging, paused, error, offline
    PRIMARY KEY (robot_id, started_at)
) STRICT, WITHOUT ROWID;
"""

_TYPED_DURATIONS = """
ALTER TABLE missions ADD COLUMN usual_minutes INTEGER;        -- as a person typed it; NULL: known from runs only
"""

_ENDED_DAYS = """
CREATE TABLE ended_days (                     -- what ended, counted per UTC day by the triggers below: the ground of long periods' KPIs
    day          TEXT NOT NULL,               -- YYYY-MM-DD of ended_at
    robot_id     INTEGER NOT NULL,            -- 0: none
    is_scheduled INTEGER NOT NULL,
    state        TEXT NOT NULL,
    reason_code  TEXT NOT NULL,               -- '': none
    is_submitted INTEGER NOT NULL,
    number       INTEGER NOT NULL,
    timed        INTEGER NOT NULL,            -- of these, with a known duration
    microseconds INTEGER NOT NULL,            -- of these durations; whole ones, so that what is added can be taken away again exactly
    PRIMARY KEY (day, robot_id, is_scheduled, state, reason_code, is_submitted)
) STRICT, WITHOUT ROWID;

INSERT INTO ended_days
SELECT substr(ended_at, 1, 10), coalesce(robot_id, 0), trigger = 'scheduled', state, coalesce(reason_code, ''), submitted_at IS NOT NULL,
       count(*), count(duration_s), coalesce(sum(CAST(round(duration_s * 1000000) AS INTEGER)), 0)
FROM executions WHERE ended_at IS NOT NULL GROUP BY 1, 2, 3, 4, 5, 6;

CREATE TRIGGER ended_days_add AFTER INSERT ON executions WHEN NEW.ended_at IS NOT NULL BEGIN
    INSERT INTO ended_days VALUES (
        substr(NEW.ended_at, 1, 10), coalesce(NEW.robot_id, 0), NEW.trigger = 'scheduled', NEW.state, coalesce(NEW.reason_code, ''),
        NEW.submitted_at IS NOT NULL, 1, NEW.duration_s IS NOT NULL, coalesce(CAST(round(NEW.duration_s * 1000000) AS INTEGER), 0))
    ON CONFLICT DO UPDATE SET number = number + 1, timed = timed + excluded.timed, microseconds = microseconds + excluded.microseconds;
END;

CREATE TRIGGER ended_days_remove AFTER DELETE ON executions WHEN OLD.ended_at IS NOT NULL BEGIN
    UPDATE ended_days SET number = number - 1, timed = timed - (OLD.duration_s IS NOT NULL),
        microseconds = microseconds - coalesce(CAST(round(OLD.duration_s * 1000000) AS INTEGER), 0)
    WHERE day = substr(OLD.ended_at, 1, 10) AND robot_id = coalesce(OLD.robot_id, 0) AND is_scheduled = (OLD.trigger = 'scheduled')
        AND state = OLD.state AND reason_code = coalesce(OLD.reason_code, '') AND is_submitted = (OLD.submitted_at IS NOT NULL);
    DELETE FROM ended_days WHERE day = substr(OLD.ended_at, 1, 10) AND number = 0;
END;

CREATE TRIGGER ended_days_change AFTER UPDATE OF ended_at, robot_id, trigger, state, reason_code, submitted_at, duration_s ON executions
WHEN OLD.ended_at IS NOT NULL OR NEW.ended_at IS NOT NULL BEGIN
    UPDATE ended_days SET number = number - 1, timed = timed - (OLD.duration_s IS NOT NULL),
        microseconds = microseconds - coalesce(CAST(round(OLD.duration_s * 1000000) AS INTEGER), 0)
    WHERE day = substr(OLD.ended_at, 1, 10) AND robot_id = coalesce(OLD.robot_id, 0) AND is_scheduled = (OLD.trigger = 'scheduled')
        AND state = OLD.state AND reason_code = coalesce(OLD.reason_code, '') AND is_submitted = (OLD.submitted_at IS NOT NULL);
    INSERT INTO ended_days SELECT
        substr(NEW.ended_at, 1, 10), coalesce(NEW.robot_id, 0), NEW.trigger = 'scheduled', NEW.state, coalesce(NEW.reason_code, ''),
        NEW.submitted_at IS NOT NULL, 1, NEW.duration_s IS NOT NULL, coalesce(CAST(round(NEW.duration_s * 1000000) AS INTEGER), 0)
    WHERE NEW.ended_at IS NOT NULL
    ON CONFLICT DO UPDATE SET number = number + 1, timed = timed + excluded.timed, microseconds = microseconds + excluded.microseconds;
    DELETE FROM ended_days WHERE day = substr(OLD.ended_at, 1, 10) AND number = 0;
END;
"""

_ACTIVITY_DAYS = """
-- What was observed per day was counted apart from the spans. It stays for the days before them and for the one with the first of them,
-- which may have begun in the middle of it (its day in UTC and the next, whatever the zone), but not for today.
ALTER TABLE observed RENAME TO activity_days;
DELETE FROM activity_days WHERE day > (
    SELECT min(date(min(started_at), '+1 day'), date(max(ended_at), '-2 days')) FROM activity_spans
    WHERE activity_spans.robot_id = activity_days.robot_id);
"""

_NO_DECISION_READS_HISTORY = """
-- What decisions need is kept beside what they are about, so that the history may be pruned to nothing.
ALTER TABLE schedules ADD COLUMN planned_through TEXT;       -- instants up to here have their rows, or had them
ALTER TABLE schedules ADD COLUMN started_through TEXT;       -- the newest instant whose row was to be sent
UPDATE schedules SET
    planned_through = (SELECT max(planned_at) FROM executions WHERE schedule_id = schedules.id
                       AND NOT (state = 'skipped' AND reason_code = 'hold' AND attempts = 0 AND planned_at > ended_at)),
    started_through = (SELECT max(planned_at) FROM executions WHERE schedule_id = schedules.id AND state NOT IN ('skipped', 'missed'));
CREATE TABLE skips (                          -- starts that a person left out in advance
    schedule_id INTEGER NOT NULL REFERENCES schedules(id) ON DELETE CASCADE,
    planned_at  TEXT NOT NULL,
    PRIMARY KEY (schedule_id, planned_at)
) STRICT, WITHOUT ROWID;
INSERT INTO skips SELECT schedule_id, planned_at FROM executions JOIN schedules ON schedules.id = schedule_id
    WHERE state = 'skipped' AND reason_code = 'hold' AND attempts = 0 AND planned_at > executions.ended_at;
ALTER TABLE robots ADD COLUMN last_queue_id INTEGER;         -- the newest item that it took from us, and what was sent as its description
ALTER TABLE robots ADD COLUMN last_token TEXT;
UPDATE robots SET (last_queue_id, last_token) = (SELECT queue_id, token FROM executions WHERE robot_id = robots.id AND queue_id IS NOT NULL
                                                 ORDER BY id DESC LIMIT 1);
ALTER TABLE robots ADD COLUMN idle_queue_id INTEGER;         -- of the last idle mission; ids above it have ended its idle period
UPDATE robots SET idle_queue_id = (SELECT max(coalesce(queue_id, 0), coalesce(queue_floor, 0)) FROM executions
                                   WHERE robot_id = robots.id AND trigger = 'idle' ORDER BY id DESC LIMIT 1);
ALTER TABLE executions ADD COLUMN robot_address TEXT;        -- where it was accepted, and by which machine
ALTER TABLE executions ADD COLUMN robot_serial TEXT;
ALTER TABLE executions ADD COLUMN revoked TEXT;              -- JSON: why it must not be sent (again), though what is on the robot goes on
DROP INDEX executions_idle;
"""

_IDENTIFIED_BY = """
ALTER TABLE robots ADD COLUMN identified_by TEXT;            -- what shows that the machine at its address is the robot
"""

_LOW_BATTERY_AND_HELD_STARTS = """
ALTER TABLE missions ADD COLUMN on_low_battery INTEGER NOT NULL DEFAULT 0;   -- a person allows it under the minimum battery
ALTER TABLE missions ADD COLUMN charges INTEGER NOT NULL DEFAULT 0;          -- as its actions on the robot say
ALTER TABLE executions ADD COLUMN held INTEGER NOT NULL DEFAULT 0;           -- a person keeps it back
"""

_CHECK_UPS = """
CREATE TABLE check_ups (                      -- of robots: what the last one found, and what one under way has changed
    robot_id    INTEGER PRIMARY KEY REFERENCES robots(id) ON DELETE CASCADE,
    profile     TEXT,                         -- JSON, as all of these: what the app may rely on
    report      TEXT,
    left_behind TEXT
) STRICT;
"""

_KEPT_BACK_AHEAD = """
ALTER TABLE skips ADD COLUMN held INTEGER NOT NULL DEFAULT 0;               -- not left out: kept back when its time has come
"""

_DELETED = """
-- What a person deletes stays, invisible, as long as that can be undone: everything is read through these views.
ALTER TABLE robots ADD COLUMN deleted_at TEXT;
ALTER TABLE robot_groups ADD COLUMN deleted_at TEXT;
ALTER TABLE places ADD COLUMN deleted_at TEXT;
ALTER TABLE missions ADD COLUMN deleted_at TEXT;
ALTER TABLE schedules ADD COLUMN deleted_at TEXT;
ALTER TABLE calendar_days ADD COLUMN deleted_at TEXT;
CREATE VIEW current_robots AS SELECT * FROM robots WHERE deleted_at IS NULL;
CREATE VIEW current_robot_groups AS SELECT * FROM robot_groups WHERE deleted_at IS NULL;
CREATE VIEW current_places AS SELECT * FROM places WHERE deleted_at IS NULL;
CREATE VIEW current_missions AS SELECT * FROM missions WHERE deleted_at IS NULL;
CREATE VIEW current_schedules AS SELECT * FROM schedules WHERE deleted_at IS NULL;
CREATE VIEW current_calendar_days AS SELECT * FROM calendar_days WHERE deleted_at IS NULL;
CREATE VIEW current_group_members AS SELECT * FROM group_members
    WHERE (SELECT deleted_at FROM robots WHERE id = robot_id) IS NULL
        AND (SELECT deleted_at FROM robot_groups WHERE id = group_id) IS NULL;
CREATE VIEW current_mission_places AS SELECT * FROM mission_places
    WHERE (SELECT deleted_at FROM missions WHERE id = mission_id) IS NULL
        AND (SELECT deleted_at FROM places WHERE id = place_id) IS NULL;
CREATE VIEW current_idle_rules AS SELECT * FROM idle_rules
    WHERE (SELECT deleted_at FROM robots WHERE id = robot_id) IS NULL
        AND (SELECT deleted_at FROM missions WHERE id = mission_id) IS NULL;
CREATE VIEW current_holds AS SELECT * FROM holds WHERE (SELECT deleted_at FROM robots WHERE id = robot_id) IS NULL;
CREATE VIEW current_check_ups AS SELECT * FROM check_ups WHERE (SELECT deleted_at FROM robots WHERE id = robot_id) IS NULL;
"""

_MOVED_STARTS = """
-- A start that a person moved is a one-time schedule; the schedule that it is of skips it. It is current as long as that one is, and
-- what it was moved to.
ALTER TABLE schedules ADD COLUMN moved_of INTEGER REFERENCES schedules(id) ON DELETE CASCADE;
ALTER TABLE schedules ADD COLUMN moved_from TEXT;            -- when that schedule has it
ALTER TABLE executions ADD COLUMN moved_from TEXT;
CREATE INDEX schedules_moved ON schedules (moved_of) WHERE moved_of IS NOT NULL;
DROP VIEW current_schedules;
CREATE VIEW current_schedules AS SELECT * FROM schedules WHERE deleted_at IS NULL AND (moved_of IS NULL OR coalesce(
    (SELECT deleted_at FROM schedules AS whole WHERE whole.id = schedules.moved_of),
    (SELECT deleted_at FROM robots WHERE robots.id = schedules.robot_id),
    (SELECT deleted_at FROM robot_groups WHERE robot_groups.id = schedules.group_id),
    (SELECT deleted_at FROM missions WHERE missions.id = schedules.mission_id)) IS NULL);
"""

MIGRATIONS: tuple[str, ...] = (
    _FIRST,
    _EXCEPTION_CALENDAR,
    _KPI_INDEXES,
    _ACTIVITY_SPANS,
    _TYPED_DURATIONS,
    _ENDED_DAYS,
    _ACTIVITY_DAYS,
    _NO_DECISION_READS_HISTORY,
    _IDENTIFIED_BY,
    _LOW_BATTERY_AND_HELD_STARTS,
    _SKIPPED_AHEAD,
    _GROUPS,
    _SUGGESTIONS_AND_GROUP_FIGURES,
    _DRAIN,
    _RUN_DURATIONS,
    _CHECK_UPS,
    _WAYS,
    _KEPT_BACK_AHEAD,
    _STARTS,
    _FAILURES,
    _MISSION_PARAMETERS,
    _FIGURES,
    _DELETED,
    _MOVED_STARTS,
    _FLEETS,
    _CHECK_UPS_OF_FLEETS,
    _BEGUN,
    _LAST_MISSION,
)


def configured(connection: sqlite3.Connection) -> sqlite3.Connection:
    """The same connection, as every part of the app expects it and no file can turn it against the app."""
    connection.row_factory = sqlite3.Row
    connection.create_function(
        "casefold", 1, str.casefold, deterministic=True
    )  # SQLite itself knows the case of ASCII only
    connection.execute("PRAGMA trusted_schema = OFF")
    connection.execute("PRAGMA secure_delete = ON")  # tokens that were replaced are not to be found in the file
    connection.execute("PRAGMA cell_size_check = ON")
    connection.execute("PRAGMA mmap_size = 0")
    return connection
