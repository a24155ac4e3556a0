"""Requests to a robot over HTTP.

An adapter of requests without its ``Session``, which adds what is not wanted here: cookies, proxies, .netrc (it overrides the Authorization
header) and redirects (they make a GET of a POST, and their bodies are read without a limit).
"""

from __future__ import annotations

import itertools
import json as json_module
from collections.abc import Callable, Mapping
from http.client import HTTPException
from typing import Any, cast
from urllib.parse import urlencode

import requests
from urllib3.exceptions import HTTPError

from app.mir.address import Address
from app.mir.connections import MOST_PARTS, RobotConnection, TlsConnection, not_http, tls_context, too_long
from app.mir.credentials import Token, normalise_fingerprint
from app.mir.errors import ConnectionLost
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
            kind, tls = (
                TlsConnection,
                {"ssl_context": tls_context(is_pinned=pin is not None), "assert_fingerprint": pin},
            )
        self._reading, self._writing = kind(address.host, address.port, **tls), kind(address.host, address.port, **tls)
        self._headers = {
            "Host": address.netloc,
            "Accept": "application/json",
            "Accept-Encoding": "identity",
            "Accept-Language": "en_US",
            "Content-Type": "application/json",
            "User-Agent": "AMR-Scheduler",
        }
        self._credentials = {"Authorization": token.header} if token else {}

    def send(
        self,
        method: str,
        path: str,
        *,
        query: Mapping[str, str] | None = None,
        json: Any = None,
        timeout: Timeouts,
        is_wanted: Callable[[], bool] | None = None,
        with_credentials: bool = True,
    ) -> Response:
        request, headers = requests.PreparedRequest(), {"Connection": "keep-alive"}
        request.method, request.url = (
            method,
            f"{self._address.url}{API}{path}" + (f"?{urlencode(query, safe=',')}" if query else ""),
        )
        if method != "GET":
            body = b"" if json is None else json_module.dumps(json, allow_nan=False).encode("ascii")
            request.body, headers = body or None, {"Connection": "close", "Content-Length": str(len(body))}
        # Their names need no other case.
        request.headers = cast(Any, self._headers | (self._credentials if with_credentials else {}) | headers)
        connection = self._reading if method == "GET" else self._writing
        # To the machine whose status was read last, whatever its name means by now.
        connection.begin(timeout, is_wanted, self._reading.place if with_credentials else None)
        try:
            return self._once(request, connection)
        except ConnectionLost as error:
            error.is_stale = method == "GET" and not (connection.is_new or connection.received)
            raise

    def kept(self) -> object:
        return (sock := self._reading.sock) and self._reading.is_connected and sock

    def close(self) -> None:
        self._reading.close()

    def _once(self, request: requests.PreparedRequest, connection: RobotConnection) -> Response:
        self._adapter.connection, keeps = connection, False
        try:
            answer = self._adapter.send(request, stream=True)
            # As they come: each chunk costs microseconds, and unpacking could take minutes; it was not to be packed.
            parts = list(itertools.islice(answer.raw.stream(1 << 16, decode_content=False), MOST_PARTS))
            if len(parts) == MOST_PARTS:
                raise too_long()
            # Answers of failure may be followed by what they don't announce.
            keeps = request.method == "GET" and answer.status_code == 200 and not connection.will_close
            return Response(answer.status_code, b"".join(parts), answer.headers)
        except (
            OSError,
            HTTPException,
            HTTPError,
            ValueError,
            TypeError,
        ):  # the last for parameters that contradict each other
            # Not chained: the originals carry the request with its token.
            raise (ConnectionLost() if connection.is_at_end else not_http()) from None
        finally:
            if not keeps:  # or what is left of the answer may be taken for that of the next request
                connection.close()
