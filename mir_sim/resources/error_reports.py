"""/log/error_reports: errors, reported by the robot itself or by a user."""

from __future__ import annotations

from typing import Any

from mir_sim.resources import rows
from mir_sim.resources.call import Call, Handlers

TABLE = "/log/error_reports"


def list_reports(call: Call) -> list[dict[str, Any]]:
    """The recorded answer is ``[{id, url}]``; the definition has one full object."""
    return [{"id": row["id"], "url": rows.url_of(TABLE, row["id"])} for row in call.machine.site.table(TABLE)]


def file_report(call: Call) -> dict[str, Any]:
    row = call.machine.file_report("User", call.fields()["description"])
    return rows.shown(call.machine, TABLE, row, call.machine.definition.properties(call.operation.schema))


HANDLERS: Handlers = {("get", TABLE): list_reports, ("post", TABLE): file_report}
