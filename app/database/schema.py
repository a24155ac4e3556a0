"""The tables, as a list of migrations. ``PRAGMA user_version`` counts how many have been applied; a shipped one is never edited.

Instants are UTC text ``YYYY-MM-DDTHH:MM:SS.ffffffZ`` (fixed width, so text order is time order); JSON columns hold objects.
AUTOINCREMENT, because the id of a deleted schedule must never come back: the tokens of its executions are made of it.
"""
from __future__ import annotations

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

MIGRATIONS: tuple[str, ...] = (_FIRST,)
