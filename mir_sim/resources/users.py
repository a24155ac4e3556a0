"""/users/me and /users/auth: the user who asks."""

from __future__ import annotations

from datetime import timedelta
from typing import Any

from mir_sim.resources import rows
from mir_sim.resources.call import Call, Handlers
from mir_sim.site import with_hashed_password


def get_me(call: Call) -> dict[str, Any]:
    """One object (recorded); the definition has a list of them."""
    me = call.asker
    return {
        "url": f"/v2.0.0/users/{me['guid']}",
        "guid": me["guid"],
        "name": me["name"],
        "user_group_id": me["user_group_id"],
        "user_group": f"/v2.0.0/user_groups/{me['user_group_id']}",
        "allowed_methods": ["GET", "PUT"],
    }


def put_me(call: Call) -> dict[str, Any]:
    call.asker.update(with_hashed_password(call.changes()))
    return get_me(call)


def my_group(call: Call) -> list[dict[str, Any]]:
    group = call.machine.site.table("/user_groups").get(call.asker["user_group_id"])
    fields = call.machine.definition.properties(call.operation.schema)
    return [rows.shown(call.machine, "/user_groups", group, fields)] if group else []


def log_in(call: Call) -> dict[str, Any]:
    """Open a session of the web interface. Clients with Basic credentials don't need one."""
    now = call.machine.clock.local(call.machine.now)
    return {
        "user_id": call.asker["guid"],
        "ip": "127.0.0.1",
        "login_time": now.isoformat(timespec="seconds"),
        "expiration_time": (now + timedelta(minutes=15)).isoformat(timespec="seconds"),
        "token": call.machine.site.new_guid(),
        "allowed_methods": None,
    }


HANDLERS: Handlers = {
    ("get", "/users/me"): get_me,
    ("put", "/users/me"): put_me,
    ("get", "/users/me/group"): my_group,
    ("post", "/users/auth"): log_in,
    ("delete", "/users/auth"): lambda call: None,
}
