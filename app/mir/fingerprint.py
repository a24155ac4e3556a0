"""The certificate that a robot shows, for a person to compare and pin."""

from __future__ import annotations

import hashlib
from contextlib import closing

from app.mir.address import Address
from app.mir.connections import TlsConnection, tls_context
from app.mir.errors import Unreachable
from app.mir.transport import Timeouts


def presented_fingerprint(address: Address, timeouts: Timeouts | None = None) -> str:
    """SHA-256 of the certificate at an https address, as 64 hex digits. Sends no request.

    Raises Unreachable or CertificateProblem.
    """
    with closing(TlsConnection(address.host, address.port, ssl_context=tls_context(is_pinned=True))) as connection:
        connection.begin(timeouts or Timeouts())
        try:
            connection.connect()
        except Unreachable as error:
            raise error.at(address.netloc) from None
        return hashlib.sha256(connection.sock.getpeercert(binary_form=True)).hexdigest()
