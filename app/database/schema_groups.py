"""The migrations that came with groups of robots, and since; ``schema`` has their order. A shipped one is never edited."""

from __future__ import annotations

_GROUPS = """
CREATE TABLE robot_groups (
    id        INTEGER PRIMARY KEY AUTOINCREMENT,
    name      TEXT NOT NULL UNIQUE,           -- robots and groups share their names
    hand_over TEXT NOT NULL DEFAULT 'when_free',
    keep_free INTEGER NOT NULL DEFAULT 0
) STRICT;
CREATE TABLE group_members (
    group_id INTEGER NOT NULL REFERENCES robot_groups(id) ON DELETE CASCADE,
    robot_id INTEGER NOT NULL REFERENCES robots(id) ON DELETE CASCADE,
    PRIMARY KEY (group_id, robot_id)
) STRICT, WITHOUT ROWID;
CREATE INDEX group_members_by_robot ON group_members (robot_id);
CREATE TABLE places (
    id   INTEGER PRIMARY KEY AUTOINCREMENT,
    name TEXT NOT NULL UNIQUE,
    most INTEGER NOT NULL                     -- missions of this app that use it at a time
) STRICT;
CREATE TABLE mission_places (
    mission_id INTEGER NOT NULL REFERENCES missions(id) ON DELETE CASCADE,
    place_id   INTEGER NOT NULL REFERENCES places(id) ON DELETE CASCADE,
    PRIMARY KEY (mission_id, place_id)
) STRICT, WITHOUT ROWID;
ALTER TABLE robots ADD COLUMN hand_over TEXT NOT NULL DEFAULT 'at_once';

CREATE TABLE schedules_anew (
    id                      INTEGER PRIMARY KEY AUTOINCREMENT,
    name                    TEXT NOT NULL UNIQUE,
    robot_id                INTEGER REFERENCES robots(id) ON DELETE CASCADE,
    group_id                INTEGER REFERENCES robot_groups(id) ON DELETE CASCADE,
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
    finish_by_minutes       INTEGER,          -- after its instant; NULL: whenever
    overlap                 TEXT NOT NULL DEFAULT 'skip',
    priority                INTEGER NOT NULL DEFAULT 0,
    parameters              TEXT NOT NULL DEFAULT '{}',
    changed_at              TEXT NOT NULL,
    next_at                 TEXT,
    paused_until            TEXT,
    planned_through         TEXT,             -- instants up to here have their rows, or had them
    started_through         TEXT,             -- the newest instant whose row was to be sent
    CHECK ((robot_id IS NULL) <> (group_id IS NULL))
) STRICT;
INSERT INTO schedules_anew
    (id, name, robot_id, mission_id, start, timezone, recurrence, between_start, between_end, enabled, minimum_battery_percent,
     respect_working_days, start_window_minutes, overlap, priority, parameters, changed_at, next_at, paused_until, planned_through,
     started_through)
SELECT id, name, robot_id, mission_id, start, timezone, recurrence, between_start, between_end, enabled, minimum_battery_percent,
       respect_working_days, start_window_minutes, overlap, priority, parameters, changed_at, next_at, paused_until, planned_through,
       started_through FROM schedules;
-- ids that were given stay given: tokens are made of them
DELETE FROM sqlite_sequence WHERE name = 'schedules_anew';
INSERT INTO sqlite_sequence (name, seq) SELECT 'schedules_anew', seq FROM sqlite_sequence WHERE name = 'schedules';
DROP TABLE schedules;
ALTER TABLE schedules_anew RENAME TO schedules;
CREATE INDEX schedules_due ON schedules (next_at) WHERE enabled = 1 AND next_at IS NOT NULL;
CREATE INDEX schedules_by_robot ON schedules (robot_id);
CREATE INDEX schedules_by_group ON schedules (group_id) WHERE group_id IS NOT NULL;

ALTER TABLE executions ADD COLUMN group_id INTEGER;          -- no foreign key, like those of schedule and robot
ALTER TABLE executions ADD COLUMN robot_group TEXT NOT NULL DEFAULT '';
ALTER TABLE executions ADD COLUMN finish_by TEXT;
ALTER TABLE executions ADD COLUMN bound_at TEXT;             -- when its robot was chosen
ALTER TABLE executions ADD COLUMN choice TEXT NOT NULL DEFAULT '{}';         -- why that one, or why none yet
ALTER TABLE executions ADD COLUMN tried TEXT NOT NULL DEFAULT '{}';          -- by robot id: what became of it there
ALTER TABLE executions ADD COLUMN approach_m REAL;
CREATE INDEX executions_unbound ON executions (group_id, planned_at) WHERE state = 'waiting' AND robot_id IS NULL;
CREATE TABLE watches (                        -- robots to which a start may come yet that was given up there
    execution_id INTEGER NOT NULL,
    robot_id     INTEGER NOT NULL REFERENCES robots(id) ON DELETE CASCADE,
    queue_floor  INTEGER NOT NULL,
    until        TEXT NOT NULL,
    PRIMARY KEY (execution_id, robot_id)
) STRICT, WITHOUT ROWID;

CREATE TRIGGER executions_have_a_robot_when_added BEFORE INSERT ON executions
WHEN NEW.robot_id IS NULL AND NEW.state IN ('submitting', 'queued', 'executing') BEGIN
    SELECT raise(ABORT, 'what is sent needs a robot');
END;
CREATE TRIGGER executions_have_a_robot BEFORE UPDATE OF state, robot_id ON executions
WHEN NEW.robot_id IS NULL AND NEW.state IN ('submitting', 'queued', 'executing') BEGIN
    SELECT raise(ABORT, 'what is sent needs a robot');
END;
CREATE TRIGGER executions_change_no_robot BEFORE UPDATE OF robot_id ON executions
WHEN OLD.robot_id <> NEW.robot_id BEGIN
    SELECT raise(ABORT, 'a start gets another robot by way of none');
END;
"""

_SUGGESTIONS_AND_GROUP_FIGURES = """
CREATE TABLE suggestion_answers (             -- what people said to suggestions; no foreign key, like the history
    id          INTEGER PRIMARY KEY AUTOINCREMENT,
    schedule_id INTEGER NOT NULL,
    answer      TEXT NOT NULL,                -- accepted, dismissed
    answered_at TEXT NOT NULL,
    late        INTEGER NOT NULL,             -- of ``starts``, as it was found
    starts      INTEGER NOT NULL,
    option      TEXT NOT NULL DEFAULT '{}'    -- JSON: kind and value of what was accepted
) STRICT;
-- figures of groups, from the index alone
CREATE INDEX executions_of_groups ON executions (group_id, ended_at, planned_at, bound_at, submitted_at, robot_delay_s, robot_id, state,
    reason_code) WHERE group_id IS NOT NULL AND ended_at IS NOT NULL AND trigger = 'scheduled';
"""

_SKIPPED_AHEAD = """
-- A start that a person skips ahead ends when it was planned, so that it counts on that day; when it was skipped is with its reason.
UPDATE executions SET ended_at = planned_at,
    reason_details = CASE reason_details WHEN '{}' THEN json_object('skipped_at', ended_at) ELSE reason_details END
WHERE state = 'skipped' AND reason_code = 'hold' AND attempts = 0 AND planned_at > ended_at;
"""

_DRAIN = """
ALTER TABLE robots ADD COLUMN drain_runs INTEGER NOT NULL DEFAULT 0;         -- runs of ours that were seen from beginning to end
ALTER TABLE robots ADD COLUMN drain_percent REAL NOT NULL DEFAULT 0;         -- what these used of the battery; of older ones less
ALTER TABLE robots ADD COLUMN drain_hours REAL NOT NULL DEFAULT 0;           -- in this time, of older ones less
"""

_FAILURES = """
ALTER TABLE robots ADD COLUMN failures INTEGER NOT NULL DEFAULT 0;           -- starts of ours that it failed since its last success
"""

_MISSION_PARAMETERS = """
CREATE TABLE mission_parameters (             -- what a mission asks for when it is queued, as each robot said when it was asked last
    robot_id     INTEGER NOT NULL REFERENCES robots(id) ON DELETE CASCADE,
    mission_guid TEXT NOT NULL,
    parameters   TEXT NOT NULL,               -- JSON
    PRIMARY KEY (robot_id, mission_guid)
) STRICT, WITHOUT ROWID;
CREATE INDEX mission_parameters_by_guid ON mission_parameters (mission_guid);
"""

_NOTE_DURATION = """
    INSERT INTO run_durations (robot_id, mission_guid, ended_at, execution_id, duration_s)
        SELECT id, NEW.mission_guid, NEW.ended_at, NEW.id, NEW.duration_s FROM robots WHERE id = NEW.robot_id
        ON CONFLICT DO NOTHING;
    DELETE FROM run_durations WHERE robot_id = NEW.robot_id AND mission_guid = NEW.mission_guid AND (ended_at, execution_id) <= (
        SELECT ended_at, execution_id FROM run_durations WHERE robot_id = NEW.robot_id AND mission_guid = NEW.mission_guid
        ORDER BY ended_at DESC, execution_id DESC LIMIT 1 OFFSET 20);
END;
"""

_RUN_DURATIONS = f"""
CREATE TABLE run_durations (                  -- seconds of the newest 20 completed runs of each mission on each robot, kept by the triggers
    robot_id     INTEGER NOT NULL REFERENCES robots(id) ON DELETE CASCADE,
    mission_guid TEXT NOT NULL,
    ended_at     TEXT NOT NULL,
    execution_id INTEGER NOT NULL,            -- its row may be gone: the history is pruned, this is not
    duration_s   REAL NOT NULL CHECK (duration_s BETWEEN 0 AND 86400),
    PRIMARY KEY (robot_id, mission_guid, ended_at, execution_id)
) STRICT, WITHOUT ROWID;
-- A run of more than a day, as much as can be typed, is left out: a robot whose clock was set meanwhile says decades.
INSERT INTO run_durations SELECT robot_id, mission_guid, ended_at, id, duration_s FROM (
    SELECT robot_id, mission_guid, ended_at, id, duration_s,
           row_number() OVER (PARTITION BY robot_id, mission_guid ORDER BY ended_at DESC, id DESC) AS place
    FROM executions WHERE state = 'completed' AND ended_at IS NOT NULL AND duration_s BETWEEN 0 AND 86400
                    AND robot_id IN (SELECT id FROM robots))
WHERE place <= 20;
CREATE TRIGGER run_durations_add AFTER INSERT ON executions
WHEN NEW.state = 'completed' AND NEW.ended_at IS NOT NULL AND NEW.duration_s BETWEEN 0 AND 86400 BEGIN {_NOTE_DURATION}
CREATE TRIGGER run_durations_complete AFTER UPDATE OF state ON executions
WHEN NEW.state = 'completed' AND OLD.state <> 'completed' AND NEW.ended_at IS NOT NULL AND NEW.duration_s BETWEEN 0 AND 86400 BEGIN
{_NOTE_DURATION}
"""

_NOTE_RUN = """
    INSERT INTO run_durations (robot_id, mission_guid, ended_at, execution_id, duration_s, approach_m)
        SELECT id, NEW.mission_guid, NEW.ended_at, NEW.id, NEW.duration_s, NEW.approach_m FROM robots WHERE id = NEW.robot_id
        ON CONFLICT DO NOTHING;
    DELETE FROM run_durations WHERE robot_id = NEW.robot_id AND mission_guid = NEW.mission_guid AND (ended_at, execution_id) <= (
        SELECT ended_at, execution_id FROM run_durations WHERE robot_id = NEW.robot_id AND mission_guid = NEW.mission_guid
        ORDER BY ended_at DESC, execution_id DESC LIMIT 1 OFFSET 20);
END;
"""

_WAYS = f"""
CREATE TABLE mission_stops (                  -- what a mission drives to, in order, as its actions said when a robot was asked last
    mission_guid TEXT NOT NULL,
    number       INTEGER NOT NULL,
    position     TEXT NOT NULL,               -- its guid; '': asked for when the mission is queued, or coordinates
    name         TEXT NOT NULL,
    map_id       TEXT,
    x            REAL,                        -- m
    y            REAL,
    PRIMARY KEY (mission_guid, number)
) STRICT, WITHOUT ROWID;
ALTER TABLE run_durations ADD COLUMN approach_m REAL;         -- straight way to the first of these when it began; NULL: not known
DROP TRIGGER run_durations_add;
DROP TRIGGER run_durations_complete;
CREATE TRIGGER run_durations_add AFTER INSERT ON executions
WHEN NEW.state = 'completed' AND NEW.ended_at IS NOT NULL AND NEW.duration_s BETWEEN 0 AND 86400 BEGIN {_NOTE_RUN}
CREATE TRIGGER run_durations_complete AFTER UPDATE OF state ON executions
WHEN NEW.state = 'completed' AND OLD.state <> 'completed' AND NEW.ended_at IS NOT NULL AND NEW.duration_s BETWEEN 0 AND 86400 BEGIN
{_NOTE_RUN}
"""

_DAY = """substr({0}.ended_at, 1, 10), coalesce({0}.robot_id, 0), {0}.trigger = 'scheduled', {0}.state, coalesce({0}.reason_code, ''),
        {0}.submitted_at IS NOT NULL"""
_COUNT = """
    INSERT INTO ended_days (day, robot_id, is_scheduled, state, reason_code, is_submitted, number, timed, microseconds, starts)
    SELECT {_DAY}, 1, NEW.duration_s IS NOT NULL, coalesce(CAST(round(NEW.duration_s * 1000000) AS INTEGER), 0), NEW.starts
    WHERE NEW.ended_at IS NOT NULL
    ON CONFLICT DO UPDATE SET number = number + 1, timed = timed + excluded.timed, microseconds = microseconds + excluded.microseconds,
        starts = starts + excluded.starts;""".replace("{_DAY}", _DAY.format("NEW"))
_UNCOUNT = """
    UPDATE ended_days SET number = number - 1, timed = timed - (OLD.duration_s IS NOT NULL), starts = starts - OLD.starts,
        microseconds = microseconds - coalesce(CAST(round(OLD.duration_s * 1000000) AS INTEGER), 0)
    WHERE (day, robot_id, is_scheduled, state, reason_code, is_submitted) = ({_DAY});""".replace(
    "{_DAY}", _DAY.format("OLD")
)
_DROP_EMPTY = """
    DELETE FROM ended_days WHERE day = substr(OLD.ended_at, 1, 10) AND number = 0;"""

_STARTS = f"""
ALTER TABLE executions ADD COLUMN starts INTEGER NOT NULL DEFAULT 1          -- that the row stands for: those of one absence are one row
    CHECK (starts BETWEEN 1 AND 1000000000);
ALTER TABLE ended_days ADD COLUMN starts INTEGER NOT NULL DEFAULT 0;         -- that the ``number`` rows stand for
UPDATE ended_days SET starts = number;
DROP TRIGGER ended_days_add;
DROP TRIGGER ended_days_remove;
DROP TRIGGER ended_days_change;
CREATE TRIGGER ended_days_add AFTER INSERT ON executions WHEN NEW.ended_at IS NOT NULL BEGIN {_COUNT}
END;
CREATE TRIGGER ended_days_remove AFTER DELETE ON executions WHEN OLD.ended_at IS NOT NULL BEGIN {_UNCOUNT} {_DROP_EMPTY}
END;
CREATE TRIGGER ended_days_change
AFTER UPDATE OF ended_at, robot_id, trigger, state, reason_code, submitted_at, duration_s, starts ON executions
WHEN OLD.ended_at IS NOT NULL OR NEW.ended_at IS NOT NULL BEGIN {_UNCOUNT} {_COUNT} {_DROP_EMPTY}
END;
-- figures count starts, from the index alone
DROP INDEX executions_by_robot;
DROP INDEX executions_by_outcome;
CREATE INDEX executions_by_robot ON executions (robot_id, state, ended_at, duration_s, starts) WHERE ended_at IS NOT NULL;
CREATE INDEX executions_by_outcome ON executions (state, reason_code, ended_at, robot_id, starts)
    WHERE ended_at IS NOT NULL AND trigger = 'scheduled';
"""

_FLEETS = """
CREATE TABLE fleets (                         -- MiR Fleets, through which some of the robots are reached
    id                 INTEGER PRIMARY KEY AUTOINCREMENT,
    name               TEXT NOT NULL UNIQUE,
    address            TEXT NOT NULL,
    kind               TEXT NOT NULL,         -- classic, enterprise
    username           TEXT NOT NULL DEFAULT '',
    token              TEXT,                  -- value of the header with its credentials: the one place where it is kept
    certificate_sha256 TEXT,
    enabled            INTEGER NOT NULL DEFAULT 1,
    needs_password     INTEGER NOT NULL DEFAULT 0,
    identity           TEXT,                  -- what tells it from other fleets
    software           TEXT,
    profile            TEXT,                  -- JSON, as in check_ups
    deleted_at         TEXT
) STRICT;
CREATE VIEW current_fleets AS SELECT * FROM fleets WHERE deleted_at IS NULL;
ALTER TABLE robots ADD COLUMN fleet_id INTEGER REFERENCES fleets(id) ON DELETE CASCADE;       -- it has its address and credentials
ALTER TABLE robots ADD COLUMN vehicle TEXT NOT NULL DEFAULT '';              -- its id at the fleet; any: whichever the fleet chooses
ALTER TABLE robots ADD COLUMN off_with_fleet INTEGER NOT NULL DEFAULT 0;     -- on again with its fleet
CREATE INDEX robots_of_fleets ON robots (fleet_id) WHERE fleet_id IS NOT NULL;
ALTER TABLE executions ADD COLUMN taken_by TEXT NOT NULL DEFAULT '';         -- the robot that the fleet chose
"""

_CHECK_UPS_OF_FLEETS = """
ALTER TABLE fleets ADD COLUMN report TEXT;                                   -- JSON, as in check_ups
ALTER TABLE fleets ADD COLUMN left_behind TEXT;
"""

_BEGUN = """
ALTER TABLE executions ADD COLUMN begun_at TEXT;             -- when its last attempt was: nothing of that was sent before
"""

_LAST_MISSION = """
ALTER TABLE robots ADD COLUMN last_mission TEXT;             -- its guid, of the item with last_queue_id
UPDATE robots SET last_mission = (SELECT mission_guid FROM executions WHERE token = last_token);
"""
