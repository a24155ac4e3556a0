"""The execution history as CSV (docs/interfaces.md): RFC 4180, UTF-8 without BOM, English, open executions included.

Excel uses the separator of the country's settings, in most of Europe a semicolon, and takes a file without a mark for
one that isn't UTF-8.
"""

from __future__ import annotations

import csv
import re
import sqlite3
from datetime import datetime, tzinfo
from typing import TextIO

from app.database.execution_history import ExecutionFilter, ExecutionHistory
from app.domain.choice import chosen
from app.domain.execution import Execution
from app.domain.reasons import known_zone, sentence

COLUMNS = (
    "id",
    "trigger",
    "schedule",
    "robot",
    "mission",
    "mission_guid",
    "state",
    "reason_code",
    "reason",
    "planned_at",
    "created_at",
    "submitted_at",
    "started_at",
    "ended_at",
    "duration_s",
    "attempts",
    "queue_id",
    "group",
    "choice",
    "starts",
    "moved_from",
    "taken_by",
)
BYTE_ORDER_MARK = "\ufeff"
# The begin of a cell that a spreadsheet takes for a formula; inside a text, too, for spreadsheets that separate by semicolons or tabs.
_FORMULA = re.compile(r'(^|[;\t\r\n])(?=[\s"]*[=+\-@＝＋－＠])')


def write_history(
    c: sqlite3.Connection, file: TextIO, wanted: ExecutionFilter | None = None, *, for_excel: bool = False
) -> int:
    """Write the header and one row per execution, oldest first; returns how many rows. ``for_excel``: with semicolons
    and a byte order mark.

    ``file`` has to pass line ends on as they are (``newline=""``). Reads row by row through a read-only connection, so
    it works with a running app and with any length of history.
    """
    if for_excel:
        file.write(BYTE_ORDER_MARK)
    writer = csv.writer(file, dialect="excel", delimiter=";" if for_excel else ",", lineterminator="\r\n")
    writer.writerow(COLUMNS)
    number = 0
    for execution in ExecutionHistory().stream(c, wanted):
        writer.writerow(_cells(execution))
        number += 1
    return number


def _cells(execution: Execution) -> list[object]:
    zone, reason = known_zone(execution.timezone), execution.reason
    return [
        execution.id,
        execution.trigger,
        *map(_text, (execution.schedule, execution.robot, execution.mission, execution.mission_guid)),
        execution.state,
        reason.code if reason else "",
        _text(sentence(reason, zone)) if reason else "",
        _instant(execution.planned_at, zone),
        _instant(execution.created_at, zone),
        _instant(execution.submitted_at, zone),
        _instant(execution.started_at, zone),
        _instant(execution.ended_at, zone),
        "" if execution.duration_s is None else round(execution.duration_s),
        execution.attempts,
        "" if execution.queue_id is None else execution.queue_id,
        _text(execution.robot_group),
        _text(chosen(execution.choice, zone) if execution.robot_id else ""),
        execution.starts,
        _instant(execution.moved_from, zone),
        _text(execution.taken_by),
    ]


def _instant(instant: datetime | None, zone: tzinfo) -> str:
    return "" if instant is None else instant.astimezone(zone).isoformat(timespec="seconds")


def _text(text: str) -> str:
    """Preceded by an apostrophe where a spreadsheet would run it (OWASP: "CSV Injection"), and always encodable."""
    text = text.encode("utf-8", "replace").decode()
    text = _FORMULA.sub(r"\1'", text)
    return f"'{text}" if text[:1] in ("\t", "\r", "\n") else text
