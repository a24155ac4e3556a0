"""/batch: several requests in one body, answered in order."""

from __future__ import annotations

import json
from typing import Any

from mir_sim.errors import argument_error
from mir_sim.resources.call import Call, Handlers


def batch(call: Call) -> list[dict[str, Any]]:
    """Answer ``{"requests": [{"url", "method", "body"?}]}`` with a list of ``{"status", "body", "headers"}``."""
    body = call.json()
    requests = body.get("requests") if isinstance(body, dict) else None
    if not isinstance(requests, list):
        raise argument_error("requests")
    answers = []
    for one in requests:
        if (
            not isinstance(one, dict)
            or not isinstance(one.get("url"), str)
            or not isinstance(one.get("method"), str)
            or one["url"].startswith("/batch")
        ):
            raise argument_error("requests")
        content = json.dumps(one["body"]).encode() if "body" in one else b""
        response = call.ask(one["method"], one["url"], content)
        text = response.body.decode()
        is_json = response.headers.get("Content-Type") == "application/json"
        content_of = json.loads(text) if is_json and text else text or None
        answers.append({"status": response.status, "body": content_of, "headers": dict(response.headers)})
    return answers


HANDLERS: Handlers = {("post", "/batch"): batch}
