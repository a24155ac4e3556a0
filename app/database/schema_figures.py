"""Counts for key figures: ended executions per UTC day, updated by triggers. ``schema`` has the order of the
migrations."""

from __future__ import annotations

LONGEST_RUN = 131 * 366 * 86400  # s: robots' clocks are read from 1970 to 2099

_KEY = "day, robot_id, robot_group, is_scheduled, state, reason_code, is_submitted"
_KEY_OF = """substr({0}.ended_at, 1, 10), coalesce({0}.robot_id, 0), {0}.robot_group, {0}.trigger = 'scheduled', {0}.state,
        coalesce({0}.reason_code, ''), {0}.submitted_at IS NOT NULL"""
_MICROSECONDS = "coalesce(CAST(round({0}.duration_s * 1000000) AS INTEGER), 0)"
_COUNT = f"""
    INSERT INTO ended_days ({_KEY}, number, starts, timed, microseconds)
    SELECT {_KEY_OF.format("NEW")}, 1, NEW.starts, NEW.duration_s IS NOT NULL, {_MICROSECONDS.format("NEW")}
    WHERE NEW.ended_at IS NOT NULL
    ON CONFLICT DO UPDATE SET number = number + 1, starts = starts + excluded.starts, timed = timed + excluded.timed,
        microseconds = microseconds + excluded.microseconds;"""
_UNCOUNT = f"""
    UPDATE ended_days SET number = number - 1, starts = starts - OLD.starts, timed = timed - (OLD.duration_s IS NOT NULL),
        microseconds = microseconds - {_MICROSECONDS.format("OLD")}
    WHERE ({_KEY}) = ({_KEY_OF.format("OLD")});
    DELETE FROM ended_days WHERE day = substr(OLD.ended_at, 1, 10) AND number = 0;"""

# Rebuild the counters from the executions. A duration that no robot can report would soon be too much to be added up.
RECOUNT = f"""
DELETE FROM ended_days;
UPDATE executions SET duration_s = NULL WHERE duration_s NOT BETWEEN 0 AND {LONGEST_RUN};
DELETE FROM ended_days;
INSERT INTO ended_days ({_KEY}, number, starts, timed, microseconds)
SELECT {_KEY_OF.format("executions")}, count(*), sum(starts), count(duration_s), sum({_MICROSECONDS.format("executions")})
FROM executions WHERE ended_at IS NOT NULL GROUP BY 1, 2, 3, 4, 5, 6, 7;
"""

_FIGURES = f"""
DROP TRIGGER ended_days_add;
DROP TRIGGER ended_days_remove;
DROP TRIGGER ended_days_change;
DROP TABLE ended_days;
CREATE TABLE ended_days (                     -- what ended, counted per UTC day by the triggers below
    day          TEXT NOT NULL,               -- YYYY-MM-DD of ended_at
    robot_id     INTEGER NOT NULL,            -- 0: none
    robot_group  TEXT NOT NULL,               -- as the rows have it; '': none
    is_scheduled INTEGER NOT NULL,
    state        TEXT NOT NULL,
    reason_code  TEXT NOT NULL,               -- '': none
    is_submitted INTEGER NOT NULL,
    number       INTEGER NOT NULL,
    starts       INTEGER NOT NULL,            -- that the ``number`` rows stand for
    timed        INTEGER NOT NULL,            -- rows with a known duration
    microseconds INTEGER NOT NULL,            -- of these durations; whole ones, so that what is added can be taken away again exactly
    PRIMARY KEY ({_KEY})
) STRICT, WITHOUT ROWID;
{RECOUNT}
CREATE TRIGGER ended_days_add AFTER INSERT ON executions WHEN NEW.ended_at IS NOT NULL BEGIN {_COUNT}
END;
CREATE TRIGGER ended_days_remove AFTER DELETE ON executions WHEN OLD.ended_at IS NOT NULL BEGIN {_UNCOUNT}
END;
CREATE TRIGGER ended_days_change
AFTER UPDATE OF ended_at, robot_id, robot_group, trigger, state, reason_code, submitted_at, duration_s, starts ON executions
WHEN OLD.ended_at IS NOT NULL OR NEW.ended_at IS NOT NULL BEGIN {_UNCOUNT} {_COUNT}
END;
-- the rows between the days, from one index alone
DROP INDEX executions_by_day;
DROP INDEX executions_by_robot;
DROP INDEX executions_by_outcome;
CREATE INDEX executions_by_day ON executions
    (ended_at, id, robot_id, state, robot_group, trigger, reason_code, submitted_at, starts, duration_s) WHERE ended_at IS NOT NULL;
"""
