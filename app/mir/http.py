"""Requests to a robot over HTTP.

An adapter of requests without its ``Session``, which adds what is not wanted here: cookies, proxies, .netrc (it overrides the Authorization
header) and redirects (they make a GET of a POST, and their bodies are read without a limit).
"""
from __future__ import annotations

import json as json_module
from collections.abc import Callable, Mapping
from http.client import HTTPException
from typing import Any, cast
from urllib.parse import urlencode

import requests
from urllib3.exceptions import HTTPError

from app.mir.address import Address
from app.mir.connections import LONGEST_BODY, RobotConnection, TlsConnection, not_http, tls_context, too_long
from app.mir.credentials import Token, normalise_fingerprint
from app.mir.errors import ConnectionLost, RobotError
from app.mir.transport import API, Response, Timeouts


class _Adapter(requests.adapters.HTTPAdapter):
    """Of requests, on one connection of ours and without cookies."""
    connection: RobotConnection

    def get_connection_with_tls_context(self, *_: Any, **__: Any) -> Any:
        return self.connection

    def cert_verify(self, *_: Any) -> None:
        """Done by the connection."""

    def build_response(self, req: requests.PreparedRequest, resp: Any) -> requests.Response:
        response = requests.Response()
        response.request, response.raw, response.status_code, response.headers = req, resp, resp.status, resp.headers
        return response


class HttpTransport:
    """Reads keep their connection open; everything else gets a fresh one, as the robot may just be closing an open one."""

    def __init__(self, address: Address, token: Token, certificate_sha256: str | None = None) -> None:
        self._address, self._adapter = address, _Adapter()
        kind, tls = RobotConnection, dict[str, Any]()
        if address.is_secure:
            pin = normalise_fingerprint(certificate_sha256) if certificate_sha256 else None
            kind, tls = TlsConnection, {"ssl_context": tls_context(is_pinned=pin is not None), "assert_fingerprint": pin}
        self._reading, self._writing = kind(address.host, address.port, **tls), kind(address.host, address.port, **tls)
        self._headers = {
            "Host": address.netloc, "Accept": "application/json", "Accept-Encoding": "identity", "Accept-Language": "en_US",
            "Content-Type": "application/json", "User-Agent": "AMR-Scheduler"}
        self._credentials = {"Authorization": token.header} if token else {}

    def send(self, method: str, path: str, *, query: Mapping[str, str] | None = None, json: Any = None, timeout: Timeouts,
             is_wanted: Callable[[], bool] | None = None, with_credentials: bool = True) -> Response:
        request, headers = requests.PreparedRequest(), {"Connection": "keep-alive"}
        request.method, request.url = method, f"{self._address.url}{API}{path}" + (f"?{urlencode(query, safe=',')}" if query else "")
        if method != "GET":
            body = b"" if json is None else json_module.dumps(json, allow_nan=False).encode("ascii")
            request.body, headers = body or None, {"Connection": "close", "Content-Length": str(len(body))}
        # Their names need no other case.
        request.headers = cast(Any, self._headers | (self._credentials if with_credentials else {}) | headers)
        connection = self._reading if method == "GET" else self._writing
        connection.begin(timeout, is_wanted)
        try:
            try:
                return self._once(request, connection)
            except ConnectionLost:
                if method != "GET" or connection.is_new or connection.received:
                    raise
            return self._once(request, connection)   # a read: the robot had closed the kept-alive connection
        except RobotError as error:
            raise error.at(self._address.netloc) from None

    def close(self) -> None:
        self._reading.close()

    def _once(self, request: requests.PreparedRequest, connection: RobotConnection) -> Response:
        self._adapter.connection, keeps = connection, False
        try:
            answer = self._adapter.send(request, stream=True)
            body = answer.raw.read(LONGEST_BODY + 1, decode_content=True)      # unpacks no more than that
            if len(body) > LONGEST_BODY:
                raise too_long()
            keeps = request.method == "GET" and answer.status_code == 200      # others may be followed by what they don't announce
            return Response(answer.status_code, body, answer.headers)
        except (OSError, HTTPException, HTTPError, ValueError, TypeError):     # the last for parameters that contradict each other
            # Not chained: the originals carry the request with its token.
            raise (ConnectionLost() if connection.is_at_end else not_http()) from None
        finally:
            if not keeps:                    # or what is left of the answer may be taken for that of the next request
                connection.close()
