"""Refusals of the REST API: a status code, ``error_code`` and ``error_human``.

The texts are those of MiR's definition. Of the codes only ``service_unavailable`` was recorded on robots; the others are guesses.
"""

from __future__ import annotations

# Status code → error_code and the usual error_human.
ERRORS = {
    400: ("bad_request", "Bad request"),
    401: ("unauthorized", "Unauthorized"),
    404: ("not_found", "Not found"),
    409: ("duplicate_entry", "Duplicate entry"),
    410: ("gone", "Gone"),
    500: ("internal_server_error", "Internal server error"),
    503: ("service_unavailable", "Service unavailable"),
}


class ApiError(Exception):
    """An answer other than success. ``text`` replaces the usual ``error_human`` of the status code."""

    def __init__(self, status: int, text: str = "") -> None:
        self.status = status
        self.code, usual = ERRORS[status]
        self.text = text or usual
        super().__init__(f"{status} {self.text}")

    def body(self) -> dict[str, str]:
        return {"error_code": self.code, "error_human": self.text}


def argument_error(*fields: str) -> ApiError:
    """``fields``: what is missing or wrong; none: the body as a whole. That they are named after a colon is a guess."""
    return ApiError(400, ": ".join(filter(None, ("Argument error", ", ".join(fields)))))
