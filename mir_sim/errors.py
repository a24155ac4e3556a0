"""Refusals of the REST API: a status code, MiR's machine word and MiR's human text.

The human texts are those of MiR's definition. The machine words were never recorded except ``service_unavailable``; the others are guesses.
"""
from __future__ import annotations

from typing import ClassVar


class ApiError(Exception):
    """An answer other than success.

    Args:
        status: HTTP status code.
        human: text for ``error_human``.
        code: word for ``error_code``; derived from the status when left out.
    """

    WORDS: ClassVar = {400: "bad_request", 401: "unauthorized", 404: "not_found", 405: "method_not_allowed", 409: "duplicate_entry",
                       410: "gone", 500: "internal_server_error", 503: "service_unavailable"}

    def __init__(self, status: int, human: str, code: str | None = None) -> None:
        super().__init__(f"{status} {human}")
        self.status = status
        self.human = human
        self.code = code or self.WORDS[status]

    def body(self) -> dict[str, str]:
        return {"error_code": self.code, "error_human": self.human}


def bad_request(human: str = "Bad request") -> ApiError:
    return ApiError(400, human)


def argument_error() -> ApiError:
    return ApiError(400, "Argument error")


def not_found() -> ApiError:
    return ApiError(404, "Not found")


def duplicate() -> ApiError:
    return ApiError(409, "Duplicate entry")
