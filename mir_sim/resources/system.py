"""The robot as a machine: registers, network, software, distances, metrics."""
from __future__ import annotations

from typing import Any

from mir_sim.errors import argument_error, not_found
from mir_sim.resources.registry import Call, Handler
from mir_sim.site import Row


def _register(call: Call) -> Row:
    row = call.robot.site.table("/registers").get(call.params["id"])
    if row is None:
        raise not_found()
    return row


def _shown(row: Row) -> dict[str, Any]:
    return {"allowed_methods": ["PUT", "GET", "POST"], "id": row["id"], "value": row["value"], "label": row["label"]}


def get_register(call: Call) -> dict[str, Any]:
    return _shown(_register(call))


def write_register(call: Call) -> dict[str, Any]:
    """PUT and POST do the same; the definition has forgotten the body of the PUT. Registers 1–100 hold integers, 101–200 floats."""
    row, body = _register(call), call.json()
    operation = call.robot.definition.operation("post", "/registers/{id}")
    assert operation is not None and operation.body_schema is not None
    fields = call.robot.definition.check_body(operation.body_schema, body)
    if row["id"] <= 100 and float(fields.get("value", 0)) % 1:
        raise argument_error()
    row["label"] = fields.get("label", row["label"])
    if "value" in fields:
        call.robot.set_register(row["id"], fields["value"])
    return _shown(row)


HANDLERS: dict[tuple[str, str], Handler] = {
    ("get", "/registers/{id}"): get_register,
    ("put", "/registers/{id}"): write_register,
    ("post", "/registers/{id}"): write_register,
}
