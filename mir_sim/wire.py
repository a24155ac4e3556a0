"""HTTP/1.1 on a stream: reads requests and encodes responses, as far as clients of robots need it."""

from __future__ import annotations

import asyncio
from collections.abc import Mapping
from http import HTTPStatus

from mir_sim.messages import Request, Response

MAX_HEAD = 64 * 1024
MAX_BODY = 16 * 1024 * 1024


class BadRequest(Exception):
    """The bytes are not an HTTP/1.1 request; the connection can't be used further."""


async def read_request(reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> Request | None:
    """Read one request with its body; None when the client has closed the connection between requests.

    Raises:
        BadRequest: the request is malformed or too large.
    """
    try:
        head = await reader.readuntil(b"\r\n\r\n")
    except asyncio.IncompleteReadError as error:
        if error.partial.strip():
            raise BadRequest from None
        return None
    except asyncio.LimitOverrunError:
        raise BadRequest from None
    first, *lines = head.decode("latin-1").strip("\r\n").split("\r\n")
    parts = first.split(" ")
    if len(parts) != 3 or not parts[2].startswith("HTTP/1."):
        raise BadRequest
    headers = {}
    for line in lines:
        name, colon, value = line.partition(":")
        if not colon:
            raise BadRequest
        headers[name.strip().lower()] = value.strip()
    if headers.get("expect", "").lower() == "100-continue":
        writer.write(b"HTTP/1.1 100 Continue\r\n\r\n")
    body = await _read_body(reader, headers)
    if parts[2] == "HTTP/1.0":
        headers.setdefault("connection", "close")
    try:
        return Request.of(parts[0], parts[1], headers, body)
    except ValueError:  # the target is not a URL
        raise BadRequest from None


async def _read_body(reader: asyncio.StreamReader, headers: Mapping[str, str]) -> bytes:
    try:
        if headers.get("transfer-encoding", "").lower() == "chunked":
            return await _read_chunks(reader)
        length = int(headers.get("content-length") or 0)
        if not 0 <= length <= MAX_BODY:
            raise BadRequest
        return await reader.readexactly(length)
    except (ValueError, asyncio.IncompleteReadError):
        raise BadRequest from None


async def _read_chunks(reader: asyncio.StreamReader) -> bytes:
    body = b""
    while True:
        size = int((await reader.readline()).split(b";")[0], 16)
        if not 0 <= size <= MAX_BODY - len(body):
            raise BadRequest
        body += await reader.readexactly(size)
        await reader.readline()
        if size == 0:
            return body


def encode(response: Response, *, date: str, close: bool, length: int | None = None) -> bytes:
    """The bytes of a response. ``length`` replaces the true Content-Length when the body is to be cut or left out."""
    try:
        phrase = HTTPStatus(response.status).phrase
    except ValueError:
        phrase = ""
    lines = [f"HTTP/1.1 {response.status} {phrase}", f"Date: {date}"]
    lines += [f"{name}: {value}" for name, value in response.headers.items()]
    if response.status != 204:
        lines.append(f"Content-Length: {len(response.body) if length is None else length}")
    lines.append(f"Connection: {'close' if close else 'keep-alive'}")
    body = b"" if response.status == 204 else response.body
    return ("\r\n".join(lines) + "\r\n\r\n").encode("latin-1", "replace") + body
